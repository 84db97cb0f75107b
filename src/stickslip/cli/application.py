"""The application: its commands, and the exit code of each."""

import inspect
import logging
import sys
from collections.abc import Callable, Sequence
from functools import partial

from cyclopts import App, CycloptsError

from stickslip import __version__
from stickslip.cli.compare import EXAMPLES as COMPARE_EXAMPLES
from stickslip.cli.compare import compare
from stickslip.cli.demo import data, demo
from stickslip.cli.excite import EXAMPLES as EXCITE_EXAMPLES
from stickslip.cli.excite import excite
from stickslip.cli.export import EXAMPLES as EXPORT_EXAMPLES
from stickslip.cli.export import export
from stickslip.cli.identify import EXAMPLES, identify
from stickslip.cli.inspect import EXAMPLES as INSPECT_EXAMPLES
from stickslip.cli.inspect import inspect as inspect_log
from stickslip.cli.position import EXAMPLES as POSITION_EXAMPLES
from stickslip.cli.position import position
from stickslip.cli.terminal import one_line, reader_may_leave, say

_BAD_INPUT = 2

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
    text = inspect.cleandoc(command.__doc__ or "")
    return "\n\n".join(one_line(paragraph) for paragraph in text.split("\n\n"))


app.command(identify, help=_help(identify), help_epilogue=EXAMPLES)
app.command(inspect_log, name="inspect", help=_help(inspect_log), help_epilogue=INSPECT_EXAMPLES)
app.command(compare, help=_help(compare), help_epilogue=COMPARE_EXAMPLES)
app.command(excite, help=_help(excite), help_epilogue=EXCITE_EXAMPLES)
app.command(position, help=_help(position), help_epilogue=POSITION_EXAMPLES)
app.command(export, help=_help(export), help_epilogue=EXPORT_EXAMPLES)
app.command(demo, help=_help(demo), help_epilogue="Example:\n  stickslip demo --out demo-output")
app.command(data, help=_help(data), help_epilogue="Example:\n  stickslip data emps")


def _flag(arguments: Sequence[str], name: str) -> str:
    """Return the option of the command for a setting of the package; its name without an option."""
    flag = f"--{name.replace('_', '-')}"
    options = app[arguments[0]].assemble_argument_collection()
    return flag if any(flag in each.names for each in options) else name


def run(arguments: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    try:
        command, bound, _ = app.parse_args(arguments, print_error=False, exit_on_error=False)
    except CycloptsError as error:
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
    handler.setFormatter(logging.Formatter("stickslip: %(message)s"))
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
