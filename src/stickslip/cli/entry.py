"""The application, and what every ending of it means to the caller."""

import inspect
import logging
import sys
from collections.abc import Callable, Sequence

from cyclopts import App, CycloptsError

from stickslip import __version__
from stickslip.cli.data import data
from stickslip.cli.demo import demo
from stickslip.cli.identify import EXAMPLES, identify
from stickslip.cli.terminal import one_line

__all__ = ["main"]

_BAD_INPUT = 2
_INTERRUPTED = 130

app = App(
    name="stickslip",
    help="Identify, simulate and beat dry friction in motion axes.",
    help_epilogue=(
        "Exit codes: 0 done; 1 done, but the result cannot be trusted (its status says why); "
        "2 bad input (one line on standard error says what, where, and the remedy)."
    ),
    help_format="plaintext",
    version=__version__,
)


def _help(command: Callable[..., int]) -> str:
    """Return a command's docstring as paragraphs that the terminal can wrap."""
    text = inspect.cleandoc(command.__doc__ or "")
    return "\n\n".join(one_line(paragraph) for paragraph in text.split("\n\n"))


app.command(identify, help=_help(identify), help_epilogue=EXAMPLES)
app.command(demo, help=_help(demo), help_epilogue="Example:\n  stickslip demo --out demo-output")
app.command(data, help=_help(data), help_epilogue="Example:\n  stickslip data emps")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Parameters
    ----------
    arguments
        What follows the program's name; None takes it from the process.

    Returns
    -------
    The exit code: 0 done; 1 done, but the result cannot be trusted; 2 bad input; 130 interrupted.
    """
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # pyright: ignore[reportAttributeAccessIssue] - of a text file, not of every stream
    try:
        return _run(list(sys.argv[1:] if arguments is None else arguments))
    except KeyboardInterrupt:
        _say("interrupted; nothing was left half-written")
        return _INTERRUPTED


def _run(arguments: list[str]) -> int:
    try:
        command, bound, _ = app.parse_args(arguments, print_error=False, exit_on_error=False)
    except CycloptsError as error:
        known = [name for name in app if not name.startswith("-")]
        asked = " ".join(["stickslip", *arguments[:1]] if arguments[0] in known else ["stickslip"])
        _say(f"{one_line(str(error)).rstrip('.')}; see: {asked} --help")
        return _BAD_INPUT
    if command in {app.help_print, app.version_print}:
        command(*bound.args, **bound.kwargs)
        return 0
    # Only now, as it loads what --help and --version can do without.
    from stickslip.records import StickslipError

    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("stickslip: %(message)s"))
    logger = logging.getLogger("stickslip")
    logger.addHandler(handler)
    logger.propagate = False
    try:
        return int(command(*bound.args, **bound.kwargs))
    except StickslipError as error:
        _say(one_line(str(error)))
        return _BAD_INPUT
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        _say(f"{where}{error.strerror or error}; check the path and that you may use it")
        return _BAD_INPUT
    finally:
        logger.removeHandler(handler)
        logger.propagate = True


def _say(text: str) -> None:
    sys.stderr.write(f"stickslip: {text}\n")
