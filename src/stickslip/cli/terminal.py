"""Printing: results to standard output, messages about them to standard error."""

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Generator, Sequence
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from rich.console import Console

_WIDTH_OF_A_PIPE = 120  # characters a line
_QUIET_TIME = 2.0  # s, after which progress is shown


def console_on(stream: Literal["output", "error"]) -> "Console":
    """Return a console that prints user text unchanged, without markup and highlighting."""
    from rich.console import Console

    file = sys.stderr if stream == "error" else sys.stdout
    return Console(
        file=file,
        markup=False,
        highlight=False,
        emoji=False,
        width=None if file.isatty() else _WIDTH_OF_A_PIPE,
    )


def one_line(text: str) -> str:
    """Return text without line breaks, as every refusal is one line."""
    return " ".join(text.split())


def say(text: str) -> None:
    """Print one line to standard error; a closed stream is ignored."""
    with contextlib.suppress(OSError):
        sys.stderr.write(f"stickslip: {text}\n")


@contextlib.contextmanager
def reader_may_leave() -> Generator[None]:
    """Print inside; stop silently if the reader of a pipe has closed it, as ``head`` does."""
    try:
        yield
        sys.stdout.flush()
    except BrokenPipeError:
        _send_the_rest_nowhere()
    except SystemExit:
        # rich exits so when its pipe is closed, and discards the rest.
        return
    except OSError as error:
        from stickslip.errors import InputError

        _send_the_rest_nowhere()
        raise InputError(
            "not_printed",
            where="standard output",
            reason=error.strerror or type(error).__name__,
        ) from error


def _send_the_rest_nowhere() -> None:
    """Discard the buffer of standard output, which would fail again at exit."""
    with contextlib.suppress(OSError, ValueError):
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


@contextlib.contextmanager
def working(doing: str) -> Generator[None]:
    """Show a status on a terminal; print nothing elsewhere."""
    if not sys.stderr.isatty():
        yield
        return
    console = console_on("error")
    with console.status(f"{doing} …"):
        yield


@contextlib.contextmanager
def axis_progress(axes: Sequence[str]) -> Generator[Callable[[str, int, int], None] | None]:
    """Show a bar with the axes that are being identified on a terminal; print nothing elsewhere.

    Yields a function of the axis that is done, the number done and the number of all; None
    elsewhere.
    """
    with progress_bar("identifying", quiet_time=0.0) as advance:
        if advance is None:
            yield None
            return
        left = list(axes)
        advance(0, len(left), f"identifying {', '.join(left)}")

        def done(axis: str, number: int, every: int) -> None:
            left.remove(axis)
            advance(number, every, f"identifying {', '.join(left)}")

        yield done


@contextlib.contextmanager
def progress_bar(
    doing: str, quiet_time: float = _QUIET_TIME
) -> Generator[Callable[..., None] | None]:
    """Draw a bar on a terminal after ``quiet_time`` [s]; print nothing elsewhere.

    Yields a function of the number done, the number of all, and the description of the next step;
    None without a bar. A timer draws the bar, as the first step may be a long one.
    """
    if not sys.stderr.isatty():
        yield None
        return
    from rich.progress import Progress

    bar = Progress(console=console_on("error"), transient=True)
    task = bar.add_task(doing, total=None)
    timer = threading.Timer(quiet_time, bar.start)

    def advance(done: int, every: int, doing: str | None = None) -> None:
        bar.update(task, completed=done, total=every, description=doing)

    timer.start()
    try:
        yield advance
    finally:
        timer.cancel()
        timer.join()
        if bar.live.is_started:
            bar.stop()
