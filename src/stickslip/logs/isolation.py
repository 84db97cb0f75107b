"""Readers of binary files in a process of their own, whose time and memory are limited.

Libraries that parse damaged files may crash, hang or ask for any amount of memory.
"""

import math
import os
import pickle
import signal
import subprocess
import sys
import threading
import weakref
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import IO, Any, cast

from stickslip.errors import StickslipError
from stickslip.logs.formats.registry import LogFormat, format_named
from stickslip.logs.table import Column, Table
from stickslip.records import InputError

_SECONDS, _SECONDS_A_BYTE = 8.0, 1e-6
"""Time of the processor for a file, and what a byte adds to it: the slowest library reads ten times
as fast."""

_PATIENCE = 5.0
"""A process that computes for its time takes at most so many times as long on a busy machine."""

_BYTES, _BYTES_A_BYTE = 800_000_000, 20
"""Memory of a reader, and what a byte of the file adds to it: compressed numbers take less."""

_LONGEST_REASON = 120
"""Characters of a library's message that are repeated."""

_CHILD = "import sys; sys.path[:] = {path!r}; from stickslip.logs.isolation import serve; serve()"
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
        # The interpreter that runs this, with nothing of the user's in the command
        self._process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-c", _CHILD.format(path=sys.path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, **_ENVIRONMENT},
        )
        weakref.finalize(self, _end, self._process)
        self._send((memory_limit(size), self._seconds))

    def ask(self, *request: Any) -> Any:
        """Return the answer to a request, or raise the error that it is."""
        timer = threading.Timer(_PATIENCE * self._seconds, self._stop)
        timer.start()
        try:
            self._send(request)
            answer = _received(cast("IO[bytes]", self._process.stdout))
        except (EOFError, OSError, pickle.UnpicklingError):
            raise self._failure() from None
        finally:
            timer.cancel()
            timer.join()  # its thread refers to this, and so to the process
        if isinstance(answer, StickslipError):
            raise answer
        return answer

    def _send(self, request: Any) -> None:
        with suppress(OSError):  # that the process has ended shows in the missing answer
            pickle.dump(request, self._process.stdin)  # pyright: ignore[reportArgumentType]
            self._process.stdin.flush()  # pyright: ignore[reportOptionalMemberAccess]

    def _stop(self) -> None:
        self._late = True
        self._process.kill()

    def _failure(self) -> InputError:
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(timeout=1.0)
        if self._late or self._process.returncode == -getattr(signal, "SIGXCPU", 0):
            return InputError("reading_takes_long", where=self._label, seconds=self._seconds)
        return _damaged(self._entry, self._label, "its library stops on it")


def _received(pipe: IO[bytes]) -> Any:
    """Return the next object of the other process, which is of this package."""
    return pickle.load(pipe)  # noqa: S301


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End the process, which has no more to do."""
    for pipe in (process.stdin, process.stdout):
        if pipe is not None:
            with suppress(OSError):
                pipe.close()
    process.kill()
    process.wait()


def serve() -> None:
    """Answer the requests of `read_apart`, until its side of the pipe closes."""
    answers = os.fdopen(os.dup(1), "wb")
    silent = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silent, 1)  # what a library prints is no answer
    memory, seconds = _received(sys.stdin.buffer)
    limit_this_process(memory)
    table: Table | None = None
    while True:
        try:
            kind, *arguments = _received(sys.stdin.buffer)
        except EOFError:
            return
        _limit_time(seconds)
        try:
            if kind == "read" or table is None:
                name, path = arguments
                table = read_guarded(format_named(name), Path(path))
                answer: Any = {field: getattr(table, field) for field in _SHOWN}
            else:
                answer = (table.load if kind == "load" else table.place)(*arguments)
        except StickslipError as error:
            answer = error
        pickle.dump(answer, answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()
