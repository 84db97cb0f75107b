"""The application: its commands, and the exit code of each."""

import logging
import sys
from collections.abc import Callable, Sequence
from functools import partial
from inspect import cleandoc

from cyclopts import App, CycloptsError

from stickslip import __version__
from stickslip.cli import compare, demo, excite, export, identify, inspect, position
from stickslip.cli.terminal import one_line, reader_may_leave, say

_BAD_INPUT = 2  # exit code
_SIMULATE = (
    "there is no command simulate; stickslip position simulates the moves of a scenario, and "
    "stickslip.simulate in Python an axis under a given effort"
)

app = App(
    name="stickslip",
    help="Identify, simulate and beat dry friction in motion axes.",
    help_epilogue=(
        "Exit codes: 0 done; 1 done, but the result cannot be trusted (its status says why); "
        "2 bad input (one line on standard error says what, where, and the remedy); "
        "70 a defect of stickslip (with its traceback); 130 interrupted; 143 terminated."
    ),
    help_format="plaintext",
    version=__version__,
)


def _help(command: Callable[..., int]) -> str:
    """Return a command's docstring as paragraphs that the terminal can wrap."""
    text = cleandoc(command.__doc__ or "")
    return "\n\n".join(one_line(paragraph) for paragraph in text.split("\n\n"))


for _command, _examples in (
    (identify.identify, identify.EXAMPLES),
    (inspect.inspect, inspect.EXAMPLES),
    (compare.compare, compare.EXAMPLES),
    (excite.excite, excite.EXAMPLES),
    (position.position, position.EXAMPLES),
    (export.export, export.EXAMPLES),
    (demo.demo, "Example:\n  stickslip demo"),
    (demo.data, "Example:\n  stickslip data emps"),
):
    app.command(_command, help=_help(_command), help_epilogue=_examples)


def _flag(arguments: Sequence[str], name: str) -> str:
    """Return the option of the command for a setting of the package; its name without an option."""
    flag = f"--{name.replace('_', '-')}"
    options = app[arguments[0]].assemble_argument_collection()
    if any(flag in each.names for each in options):
        return flag
    others = (each.name for each in options if each.field_info.name == name)
    return next((each for each in others if each.startswith("--")), name)


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        command, bound, _ = app.parse_args(arguments, print_error=False, exit_on_error=False)
    except CycloptsError as error:
        if arguments[:1] == ["simulate"]:
            say(_SIMULATE)
            return _BAD_INPUT
        known = [name for name in app if not name.startswith("-")]
        named = [each for each in arguments[:1] if each in known]
        say(f"{one_line(str(error)).rstrip('.')}; see: {' '.join(['stickslip', *named])} --help")
        return _BAD_INPUT
    if command in {app.help_print, app.version_print}:
        with reader_may_leave():
            command(*bound.args, **bound.kwargs)
        return 0
    # Imported here, as --help and --version do not need what it loads.
    from stickslip.errors import StickslipError

    handler = logging.StreamHandler(sys.stderr)
    logger = logging.getLogger("stickslip")
    logger.addHandler(handler)
    logger.propagate = False
    try:
        return int(command(*bound.args, **bound.kwargs))
    except StickslipError as error:
        say(one_line(error.sentence(partial(_flag, arguments))))
        return _BAD_INPUT
    except OSError as error:
        where = f"{error.filename}: " if error.filename else ""
        say(f"{where}{error.strerror or error}; check the path and that you may use it")
        return _BAD_INPUT
    finally:
        logger.removeHandler(handler)
        logger.propagate = True
