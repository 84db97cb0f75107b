"""Cases of a test of which `make test` takes some."""

from collections.abc import Callable, Iterable
from typing import Any

import pytest


def quick_where(quick: Callable[..., bool], cases: Iterable[Any]) -> list[Any]:
    """Return cases, those for which ``quick`` is false marked slow; a tuple is several values."""
    found: list[Any] = []
    for case in cases:
        values = case if isinstance(case, tuple) else (case,)
        found.append(case if quick(*values) else pytest.param(*values, marks=pytest.mark.slow))
    return found
