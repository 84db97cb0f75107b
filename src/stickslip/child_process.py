"""A process beside this one that answers requests of this package, one after another."""

import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import IO, Any, cast


class ChildProcess:
    """The interpreter that runs this, with the same path, at code that calls `answer`."""

    def __init__(
        self, code: str, *, stderr: int | None = None, env: Mapping[str, str] | None = None
    ) -> None:
        # Nothing of the user's is in the command
        self.process = subprocess.Popen(  # noqa: S603
            [sys.executable, "-c", f"import sys; sys.path[:] = {sys.path!r}; {code}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=stderr,
            env=env,
            process_group=0,  # Ctrl-C interrupts this process, which ends the other
        )

    def ask(self, request: Any) -> Any:
        """Return the answer to a request; an EOFError or OSError if the process has ended."""
        stdin = cast("IO[bytes]", self.process.stdin)
        with suppress(OSError):  # that the process has ended shows in the missing answer
            pickle.dump(request, stdin)
            stdin.flush()
        return pickle.load(cast("IO[bytes]", self.process.stdout))  # noqa: S301 - our own process

    def end(self) -> None:
        """End the process, at once if it is at work; a thread that waits for it gets an error."""
        self.process.kill()
        self.process.wait()
        for pipe in (self.process.stdin, self.process.stdout):
            with suppress(OSError):
                cast("IO[bytes]", pipe).close()


def answer(reply: Callable[[Any], Any]) -> None:
    """Answer the requests of a `ChildProcess`, until its side of the pipe closes."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # what is printed is no answer
    while True:
        try:
            request = pickle.load(sys.stdin.buffer)  # noqa: S301 - of this package
        except EOFError:
            return
        pickle.dump(reply(request), answers, protocol=pickle.HIGHEST_PROTOCOL)
        answers.flush()
