"""The one way a function becomes machine code.

Kernels are plain functions on scalars, tuples and arrays. ``compiled`` hands them to Numba with the
settings all kernels share: cached on disk, no fast-math (results must not depend on how terms are
reordered), IEEE division, and, unless they are brief, free of the interpreter lock. Numba itself
refreshes its cache of a kernel only when the kernel's own file changes; here a change does in any
file of its folder, or of the folders of the kernels that it calls.
"""

import logging
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
from numba.core import event

__all__ = ["compiled"]

P = ParamSpec("P")
R = TypeVar("R")

_logger = logging.getLogger("stickslip")


class _CompilationNotice(event.Listener):
    """Says once per process that kernels are being compiled, so that a pause is explained.

    Kernels that are not cached are compiled in every process; the notice is not about them.
    """

    def __init__(self) -> None:
        self._said = False

    def on_start(self, event: event.Event) -> None:
        dispatcher = (event.data or {})["dispatcher"]
        cached = dispatcher.stats.cache_path is not None
        if not self._said and cached and dispatcher.py_func.__module__.startswith("stickslip."):
            self._said = True
            _logger.warning(
                "compiling the kernels for this machine (once; later runs use the cache)"
            )

    def on_end(self, event: event.Event) -> None:
        """Nothing is said when compilation ends."""


event.register("numba:compile", _CompilationNotice())


@cache
def _folder_stamp(folder: Path) -> tuple[tuple[str, float, int], ...]:
    """Name, time and size of every file in a folder: kernels may take constants from any."""
    files = ((path.name, path.stat()) for path in sorted(folder.glob("*.py")))
    return tuple((name, stat.st_mtime, stat.st_size) for name, stat in files)


def _note_folders(dispatcher: Any) -> None:
    """Note on a kernel in which folders it and the kernels that it calls lie."""
    code = dispatcher.py_func.__code__
    callees = (dispatcher.py_func.__globals__.get(name) for name in code.co_names)
    dispatcher.stickslip_folders = frozenset({Path(code.co_filename).parent}).union(
        *(getattr(each, "stickslip_folders", ()) for each in callees)
    )


def _cache_by_folder(dispatcher: Any) -> None:
    """Let a cached kernel be valid only as long as no file of its folders has changed."""
    file = dispatcher._cache._cache_file  # Numba has no public way to say it
    stamps = tuple(_folder_stamp(folder) for folder in sorted(dispatcher.stickslip_folders))
    file._source_stamp = (file._source_stamp, stamps)


def compiled(
    *, inline: bool = False, cached: bool = True, brief: bool = False
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile a kernel to machine code at its first call, and keep it for the next process.

    Parameters
    ----------
    inline
        Ask the compiler's back end to inline the kernel where it is called.
    cached
        Keep the machine code for the next process. A kernel that takes other kernels as arguments
        cannot be found in the cache again, and would only add to it.
    brief
        Keep the interpreter's lock: for a kernel that takes less than a microsecond and is called
        from Python sample by sample, where to let go of the lock would be a good part of the time.

    Returns
    -------
    The decorator; the decorated kernel keeps its signature.
    """
    options: dict[str, Any] = {"cache": cached, "nogil": not brief, "error_model": "numpy"}
    if inline:
        options["forceinline"] = True

    def compile_lazily(function: Callable[P, R]) -> Callable[P, R]:
        dispatcher: Any = numba.njit(**options)(function)
        if hasattr(dispatcher, "py_func"):  # not under NUMBA_DISABLE_JIT, where nothing is compiled
            _note_folders(dispatcher)
            if cached:
                _cache_by_folder(dispatcher)
        return dispatcher

    return compile_lazily
