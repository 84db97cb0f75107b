"""Where the process enters, and how it leaves when it is interrupted."""

import sys
from collections.abc import Sequence

from stickslip.cli.terminal import say

__all__ = ["main"]

_INTERRUPTED = 130


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
    try:
        for stream in (sys.stdout, sys.stderr):
            if hasattr(stream, "reconfigure"):
                stream.reconfigure(errors="replace")  # pyright: ignore[reportAttributeAccessIssue] - of a text file, not of every stream
        # Imported here, so that an interruption while it loads ends quietly too.
        from stickslip.cli.application import run

        return run(sys.argv[1:] if arguments is None else arguments)
    except KeyboardInterrupt:
        say("interrupted; nothing was left half-written")
        return _INTERRUPTED
