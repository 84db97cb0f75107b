"""Entry point, and exit when the process is interrupted, terminated, or fails."""

import contextlib
import os
import signal
import sys
import threading
import traceback
from collections.abc import Generator, Sequence
from types import FrameType

from stickslip.cli.terminal import say
from stickslip.errors import interruption_behind

_DEFECT = 70  # what sysexits.h calls an internal software error
_INTERRUPTED = 128 + signal.SIGINT
_TERMINATED = 128 + signal.SIGTERM


class _Terminated(KeyboardInterrupt):
    """The process was asked to end; it unwinds in the way that an interruption does."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments
        What follows the program's name; None takes it from the process.

    Returns
    -------
    The exit code: 0 done; 1 done, but the result cannot be trusted; 2 bad input; 70 a defect of
    this program, whose traceback is printed; 130 interrupted; 143 terminated.
    """
    try:
        _prepare_streams()
        with _ended_by_a_signal():
            # Imported here, so that an interruption while it loads ends quietly too.
            from stickslip.cli.application import run

            given = sys.argv[1:] if arguments is None else arguments
            # The parser takes a lone - for an option; behind --json it is standard output.
            before = ("", *given)
            return run(
                [
                    "/dev/stdin" if each == "-" and before[k] != "--json" else each
                    for k, each in enumerate(given)
                ]
            )
    except (KeyboardInterrupt, Exception) as error:  # noqa: BLE001 - no failure may look like a result
        stop = interruption_behind(error)
        if isinstance(stop, _Terminated):
            say("terminated; nothing was left half-written")
            return _TERMINATED
        if stop is not None:
            say("interrupted; nothing was left half-written")
            return _INTERRUPTED
        with contextlib.suppress(OSError):
            traceback.print_exc()
        say("this is a defect of stickslip; please report it with the lines above")
        return _DEFECT


def _prepare_streams() -> None:
    """Let every text be printed, and let nothing be printed where the caller closed a stream.

    A closed descriptor is opened on the null device, or the next file opened would take its place
    and receive what is printed.
    """
    for descriptor in range(3):
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the lowest number that is free: this one
    if sys.stdout is None:  # pyright: ignore[reportUnnecessaryComparison] - so Python has it when it is closed
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - kept to the end
    if sys.stderr is None:  # pyright: ignore[reportUnnecessaryComparison] - as above
        sys.stderr = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - as above
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # pyright: ignore[reportAttributeAccessIssue] - of a text file, not of every stream


@contextlib.contextmanager
def _ended_by_a_signal() -> Generator[None]:
    """Unwind when the process is terminated, unless whoever started it has arranged for that."""
    if (
        threading.current_thread() is not threading.main_thread()
        or signal.getsignal(signal.SIGTERM) != signal.SIG_DFL
    ):
        yield
        return
    signal.signal(signal.SIGTERM, _terminate)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _terminate(_signal: int, _frame: FrameType | None) -> None:
    raise _Terminated
