"""Estimators of friction from a log: one method a file, interchangeable.

The public names stand in ``__init__.pyi``; each is loaded when it is first used, so that the
registry is quick to import.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
