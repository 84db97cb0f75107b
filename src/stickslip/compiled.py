"""The one way a function becomes machine code.

Kernels are plain functions on scalars, tuples and arrays. ``compiled`` hands them to Numba with the
settings all kernels share: cached on disk, no fast-math (results must not depend on how terms are
reordered), IEEE division, and free of the interpreter lock. Numba's cache of a kernel is not
refreshed when a kernel *in another file* that it calls changes, so kernels that call each other
live in one file.
"""

import logging
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core import event

__all__ = ["compiled"]

P = ParamSpec("P")
R = TypeVar("R")

_logger = logging.getLogger("stickslip")


class _CompilationNotice(event.Listener):
    """Says once per process that kernels are being compiled, so that a pause is explained."""

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: event.Event) -> None:
        dispatcher = (event.data or {})["dispatcher"]
        if not self._said and dispatcher.py_func.__module__.startswith("stickslip."):
            self._said = True
            _logger.warning(
                "compiling the kernels for this machine (once; later runs use the cache)"
            )

    def on_end(self, event: event.Event) -> None:
        """Nothing is said when compilation ends."""


event.register("numba:compile", _CompilationNotice())


def compiled(
    *, parallel: bool = False, inline: bool = False
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a kernel to machine code at its first call, and keep it for the next process.

    Parameters
    ----------
    parallel
        Let ``numba.prange`` loops use every core.
    inline
        Ask the compiler's back end to inline the kernel where it is called.

    Returns
    -------
    The decorator; the decorated kernel keeps its signature.
    """
    options: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
    if parallel:
        options["parallel"] = True
    if inline:
        options["forceinline"] = True
    return numba.njit(**options)
