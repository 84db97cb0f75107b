"""Compilation of kernels to machine code.

Kernels are plain functions on scalars, tuples and arrays. ``compiled`` hands them to Numba with the
settings all kernels share: cached on disk, no fast-math (results must not depend on how terms are
reordered), IEEE division, and, unless they are brief, free of the interpreter lock.

Numba compares a cached kernel with the kernel's own file only. The cache therefore lies in a folder
named after the state of all folders that the kernel's module imports from, however indirectly:
after a change in any of them the folder is another one, and everything in it is compiled anew.
"""

import contextlib
import hashlib
import logging
import os
import re
import shutil
import sys
import tempfile
import time
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import platformdirs
from numba.core import config, event

P = ParamSpec("P")
R = TypeVar("R")

_logger = logging.getLogger("stickslip")
_settings: Any = config  # numba.config, whose attributes are set from the environment

_KEPT = 30 * 86400.0  # age from which the kernels of earlier sources are removed [s]


class _CompilationNotice(event.Listener):
    """Reports once per process that kernels are compiled, to explain the pause.

    Kernels that are not cached are compiled in every process; the notice leaves them out.
    """

    def __init__(self) -> None:
        self._reported = False

    def on_start(self, event: event.Event) -> None:
        dispatcher = (event.data or {})["dispatcher"]
        cached = dispatcher.stats.cache_path is not None
        if not self._reported and cached and dispatcher.py_func.__module__.startswith("stickslip."):
            self._reported = True
            _logger.warning(
                "stickslip: compiling the kernels of this task (seconds to two minutes; its "
                "later runs use the cache)"
            )

    def on_end(self, event: event.Event) -> None:
        """Report nothing when compilation ends."""


@cache
def _expect_compilation() -> None:
    """Install the notice; called once a kernel is not in the cache."""
    event.register("numba:compile", _CompilationNotice())


@cache
def _cache_root() -> Path | None:
    """Return the folder of all kernels: the user's choice, beside the package, or the user's cache.

    None if there is none that can be written.
    """
    chosen = _settings.CACHE_DIR  # NUMBA_CACHE_DIR
    beside = Path(__file__).parent / "__pycache__"
    tried = [Path(chosen)] if chosen else [beside, platformdirs.user_cache_path("stickslip")]
    for root in tried:
        try:
            root.mkdir(parents=True, exist_ok=True)
            tempfile.TemporaryFile(dir=root).close()
        except OSError:
            continue
        return root
    _logger.warning(
        "stickslip: kernels are compiled anew in every process: no folder for them can be written "
        "(tried %s); set NUMBA_CACHE_DIR to one that can",
        ", ".join(map(str, tried)),
    )
    return None


@cache
def _folder_stamp(folder: Path) -> tuple[tuple[str, float, int], ...]:
    """Name, time and size of every file in a folder: kernels may take constants from any."""
    files = ((path.name, path.stat()) for path in sorted(folder.glob("*.py")))
    return tuple((name, stat.st_mtime, stat.st_size) for name, stat in files)


@cache
def _cache_folder(root: Path, sources: frozenset[Path]) -> tuple[Path, frozenset[str]]:
    """Return the folder for kernels of some source folders, and the names of its files.

    A file that was cut off or blanked (power loss, full disk) does not end with the stop code of a
    pickle. The folder is then emptied.
    """
    stamps = [(str(source), _folder_stamp(source)) for source in sorted(sources)]
    digest = hashlib.sha256(repr(stamps).encode()).hexdigest()[:20]
    folder = root / f"stickslip-{digest}"
    if not folder.is_dir():
        _remove_outdated(root)
        return folder, frozenset()
    files = [path for path in folder.rglob("*.nb?") if path.is_file()]
    if not all(map(_is_whole, files)):
        _logger.warning(
            "stickslip: the kernel cache %s is damaged; its kernels are compiled anew", folder
        )
        shutil.rmtree(folder, ignore_errors=True)
        return folder, frozenset()
    with contextlib.suppress(OSError):
        os.utime(folder)  # in use
    return folder, frozenset(path.name for path in files)


def _is_whole(path: Path) -> bool:
    """Return whether a file ends with the stop code of a pickle, or was removed meanwhile."""
    try:
        with path.open("rb") as file:
            file.seek(-1, os.SEEK_END)
            return file.read() == b"."
    except FileNotFoundError:
        return True
    except OSError:
        return False


def _remove_outdated(root: Path) -> None:
    """Remove the folders of kernels that were not used for `_KEPT`."""
    for folder in root.glob("stickslip-*"):
        try:
            outdated = time.time() - folder.stat().st_mtime > _KEPT
        except OSError:
            continue
        if outdated:
            shutil.rmtree(folder, ignore_errors=True)


_IMPORT = re.compile(r"^(?:from|import) ([\w.]+)", re.MULTILINE)


@cache
def _imported(file: Path, package: str) -> frozenset[Path]:
    """Return the files of a package's modules that a file imports."""
    names = {name for name in _IMPORT.findall(file.read_text()) if name.startswith(package)}
    modules = (sys.modules.get(name) for name in names)
    return frozenset(Path(m.__file__) for m in modules if m is not None and m.__file__)


@cache
def _sources_of(file: Path, package: str) -> frozenset[Path]:
    """Return the folders of a file and of all that it imports from its package, however indirectly.

    A kernel's machine code contains constants, layouts of states and other kernels of any of them.
    """
    found, open_ = {file}, [file]
    while open_:
        new = _imported(open_.pop(), package) - found
        found |= new
        open_ += new
    return frozenset(each.parent for each in found)


def _sources(function: Callable[..., Any]) -> frozenset[Path]:
    """Return the folders that a kernel's machine code depends on."""
    code = function.__code__
    callees = (function.__globals__.get(name) for name in code.co_names)
    own = _sources_of(Path(code.co_filename), function.__module__.partition(".")[0] + ".")
    return own.union(*(getattr(each, "stickslip_sources", ()) for each in callees))


def _cached(function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Return the kernel with its machine code in the folder of its sources."""
    root = _cache_root()
    sources = _sources(function)
    if root is None:
        dispatcher: Any = numba.njit(**options)(function)
    else:
        folder, names = _cache_folder(root, sources)
        start = f"{Path(function.__code__.co_filename).stem}.{function.__qualname__}-"
        if not any(name.startswith(start) for name in names):
            _expect_compilation()
        chosen = _settings.CACHE_DIR
        _settings.CACHE_DIR = str(folder)
        try:
            dispatcher = numba.njit(**options, cache=True)(function)
        finally:
            _settings.CACHE_DIR = chosen
    dispatcher.stickslip_sources = sources
    return dispatcher


def compiled(
    *, inline: bool = False, cached: bool = True, brief: bool = False
) -> Callable[[Callable[P, R]], Callable[P, R]]:
    """Compile the decorated kernel to machine code at its first call.

    ``inline`` asks the compiler's back end to inline the kernel where it is called. ``cached``
    keeps the machine code for the next process; a kernel that takes other kernels as arguments
    cannot be found in the cache again, and would only add to it. ``brief`` keeps the interpreter's
    lock: for a kernel that takes less than a microsecond and is called from Python sample by
    sample, where to release the lock would be a good part of the time.
    """
    options: dict[str, Any] = {"nogil": not brief, "error_model": "numpy"}
    if inline:
        options["forceinline"] = True

    def compile_lazily(function: Callable[P, R]) -> Callable[P, R]:
        if _settings.DISABLE_JIT:
            return function
        if cached:
            return _cached(function, options)
        dispatcher: Any = numba.njit(**options)(function)
        dispatcher.stickslip_sources = _sources(function)
        return dispatcher

    return compile_lazily
