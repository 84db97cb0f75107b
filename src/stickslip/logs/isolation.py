"""Readers of binary files in a process of their own, whose time and memory are limited.

Libraries that parse damaged files may crash, hang or ask for any amount of memory.
"""

import math
import os
import pickle
import signal
import subprocess
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from stickslip.child_process import ChildProcess, answer
from stickslip.errors import StickslipError
from stickslip.logs.formats.registry import LogFormat, format_named
from stickslip.logs.table import Column, Table
from stickslip.records import InputError

_SECONDS, _SECONDS_A_BYTE = 8.0, 1e-6
"""Time of the processor for a file, opened and loaded, and what a byte adds to it: the slowest
library reads ten times as fast."""

_PATIENCE = 5.0
"""A process that computes for its time takes at most so many times as long on a busy machine."""

_BYTES, _BYTES_A_BYTE = 800_000_000, 20
"""Memory of a reader, and what a byte of the file adds to it: compressed numbers take less."""

_LONGEST_REASON = 120  # characters of a library's message that are repeated

_CHILD = "from stickslip.logs.isolation import serve; serve()"
_ENVIRONMENT = {"ARROW_DEFAULT_MEMORY_POOL": "system"}
"""Settings of libraries: the default pool of Arrow reserves more memory than a reader may take."""

_SHOWN = ("label", "headers", "units", "constants", "notes", "groups", "origins")
"""Fields of a table that are plain data."""


def memory_limit(size: int) -> int:
    """Return the memory [bytes] that a reader may take for files of so many bytes."""
    return _BYTES + _BYTES_A_BYTE * size


def time_limit(size: int) -> float:
    """Return the time of the processor [s] that a reader may take for files of so many bytes."""
    return _SECONDS + _SECONDS_A_BYTE * size


def limit_this_process(memory: int) -> None:
    """Limit the memory [bytes] that this process may still take, where the system can (Linux)."""
    try:
        import resource
    except ImportError:  # Windows
        return
    taken = Path("/proc/self/statm")
    pages = int(taken.read_text().split()[5]) if taken.exists() else 0
    limit = memory + pages * resource.getpagesize()
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_DATA, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _limit_time(seconds: float) -> None:
    """Limit the time of the processor [s] that this process may still take, where there is one."""
    try:
        import resource
    except ImportError:  # Windows
        return
    spent = resource.getrusage(resource.RUSAGE_SELF)
    limit = math.ceil(spent.ru_utime + spent.ru_stime + seconds)
    with suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_CPU, (limit, resource.RLIM_INFINITY))


def read_guarded(entry: LogFormat, path: Path) -> Table:
    """Return the table in a file; whatever its library raises is an error of the file."""

    def guarded(call: Callable[..., Any], *arguments: Any) -> Any:
        try:
            return call(*arguments)
        except StickslipError:
            raise
        except MemoryError:
            raise InputError("reading_takes_memory", where=path.name) from None
        except RecursionError:
            raise _damaged(entry, path.name, "it is nested too deeply") from None
        except Exception as error:
            reason = " ".join(f"{type(error).__name__}: {error}".split())[:_LONGEST_REASON]
            raise _damaged(entry, path.name, reason) from error

    table: Table = guarded(entry.read, path)
    load, place = table.load, table.place
    return replace(table, load=partial(guarded, load), place=partial(guarded, place))


def _damaged(entry: LogFormat, label: str, reason: str) -> InputError:
    return InputError("damaged_file", where=label, format=entry.name, reason=reason)


def read_apart(entry: LogFormat, path: Path) -> Table:
    """Return the table in a file, read by another process as long as the table is used."""
    reader = _Reader(entry, path)
    shown = reader.ask("read", entry.name, str(path))

    def load(names: Sequence[str]) -> Mapping[str, Column]:
        return reader.ask("load", list(names))

    def place(name: str, sample: int) -> str:
        return reader.ask("place", name, sample)

    return Table(**shown, load=load, place=place)


class _Reader:
    """The other process, which answers one request after another."""

    def __init__(self, entry: LogFormat, path: Path) -> None:
        files = [path] if path.is_file() else [each for each in path.rglob("*") if each.is_file()]
        size = sum(file.stat().st_size for file in files)
        self._entry, self._label = entry, path.name
        self._seconds, self._late = time_limit(size), False
        self._memory = memory_limit(size)
        self._child = ChildProcess(
            _CHILD, stderr=subprocess.DEVNULL, env={**os.environ, **_ENVIRONMENT}
        )
        weakref.finalize(self, self._child.end)

    def ask(self, *request: Any) -> Any:
        """Return the answer to a request, or raise the error that it is."""
        timer = threading.Timer(_PATIENCE * self._seconds, self._stop)
        timer.start()
        try:
            found = self._child.ask((self._memory, self._seconds, *request))
        except (EOFError, OSError, pickle.UnpicklingError):
            raise self._failure() from None
        finally:
            timer.cancel()
            timer.join()  # its thread refers to this, and so to the process
        if isinstance(found, StickslipError):
            raise found
        return found

    def _stop(self) -> None:
        self._late = True
        self._child.process.kill()

    def _failure(self) -> InputError:
        with suppress(subprocess.TimeoutExpired):
            self._child.process.wait(timeout=1.0)
        if self._late or self._child.process.returncode == -getattr(signal, "SIGXCPU", 0):
            return InputError("reading_takes_long", where=self._label, seconds=self._seconds)
        return _damaged(self._entry, self._label, "its library stops on it")


def serve() -> None:
    """Answer the requests of `read_apart`."""
    table: Table | None = None

    def reply(request: Any) -> Any:
        nonlocal table
        memory, seconds, kind, *arguments = request
        if table is None:  # both limits hold for all requests together
            limit_this_process(memory)
            _limit_time(seconds)
        try:
            if kind == "read" or table is None:
                name, path = arguments
                table = read_guarded(format_named(name), Path(path))
                return {field: getattr(table, field) for field in _SHOWN}
            return (table.load if kind == "load" else table.place)(*arguments)
        except StickslipError as error:
            return error

    answer(reply)
