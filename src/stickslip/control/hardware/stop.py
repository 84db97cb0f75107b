"""Output of efforts to a drive, of which zero is the last in every case."""

import contextlib
import signal
import threading
import time
from collections.abc import Callable, Generator
from typing import Any

_STOP_WRITES = 3  # of zero effort: a frame of a bus may be lost
_PATIENCE = 0.05  # for a write that has begun, before zero is written beside it [s]


class Output:
    """Writes efforts to a drive until it is stopped; from then on zero."""

    def __init__(self, write: Callable[[float], Any]) -> None:
        self._write = write
        self._lock = threading.Lock()
        self.stopped = False

    def write(self, effort: float) -> bool:
        """Write an effort [N or N m]; return False, without having written, after a stop."""
        with self._lock:
            if self.stopped:
                return False
            self._write(effort)
            return True

    def stop(self) -> BaseException | None:
        """Write zero effort several times; return the error if none of the writes succeeded."""
        self.stopped = True
        # A write that does not return must not keep zero effort from being written
        held = self._lock.acquire(timeout=_PATIENCE)
        error: BaseException | None = None
        written = False
        try:
            for _ in range(_STOP_WRITES):
                try:
                    self._write(0.0)
                    written = True
                except BaseException as failed:  # noqa: BLE001 - it is tried again, and reported
                    error = failed
        finally:
            if held:
                self._lock.release()
        return None if written else error


class Watchdog:
    """Stops an output from a thread of its own when the loop has not been round for too long.

    ``patience`` is the longest time between two rounds [s].
    """

    def __init__(self, output: Output, patience: float) -> None:
        self._output, self._patience = output, patience
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="stickslip watchdog", daemon=True)
        self._fed = time.monotonic()
        self.tripped = False

    def feed(self) -> None:
        """Note that the loop has been round."""
        self._fed = time.monotonic()

    def __enter__(self) -> "Watchdog":
        self.feed()
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    def _watch(self) -> None:
        while not self._ended.wait(0.25 * self._patience):
            if time.monotonic() - self._fed > self._patience:
                self.tripped = True
                self._output.stop()
                return


@contextlib.contextmanager
def terminated_as_interrupted() -> Generator[None]:
    """Let a request to terminate (SIGTERM) interrupt the program as Ctrl-C does.

    Only the main thread receives signals; elsewhere nothing changes.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def interrupt(_: int, __: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


@contextlib.contextmanager
def uninterrupted() -> Generator[None]:
    """Put off Ctrl-C and requests to terminate until the end of the block."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
