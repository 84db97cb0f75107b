"""What every command that has a result does with it: files, JSON on standard output, and words."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Group, Parameter

from stickslip.cli.terminal import console_on, reader_may_leave

if TYPE_CHECKING:
    from rich.console import Console

__all__ = ["ResultFiles", "check_apart", "check_outputs", "json_file", "print_result"]

_OUTPUT = Group("Output", sort_key=4)


def json_file(json: str | None) -> Path | None:
    """Return the file that ``--json`` names; - is standard output, and no file."""
    return None if json in {None, "-"} else Path(str(json))


def check_apart(files: Mapping[str, Path | None]) -> None:
    """Refuse two options that name the same file.

    Raises
    ------
    InputError
        If two do.
    """
    from stickslip.records import InputError

    for (option, path), (other, same) in combinations(files.items(), 2):
        if path is not None and same is not None and path.resolve() == same.resolve():
            raise InputError(
                f"{option} and {other} name the same file",
                where=str(same),
                remedy="name two files",
            )


def check_outputs(files: Mapping[str, Path | None], *, inputs: Sequence[Path]) -> None:
    """Refuse files that cannot be written, before anything is computed.

    Parameters
    ----------
    files
        By the option that names each; None is not to be written.
    inputs
        What must not be overwritten.

    Raises
    ------
    InputError
        If two are the same, one is an input, or one cannot be written.
    """
    from stickslip.outputs import check_output

    check_apart(files)
    for option, path in files.items():
        if path is not None:
            check_output(path, inputs=list(inputs), what=option)


def print_result(
    document: Callable[[], Mapping[str, Any]],
    words: "Callable[[Console], None]",
    *,
    json: str | None,
    files: Mapping[str, Path | None],
) -> None:
    """Print the words, and the JSON alone on standard output if it was asked for there.

    Parameters
    ----------
    document
        Returns the result as plain JSON types.
    words
        Prints the result for a reader.
    json
        As the option was given.
    files
        What was written, by what it is.
    """
    to_stdout = json == "-"
    if to_stdout:
        from stickslip.tasks import json_text

        with reader_may_leave():
            sys.stdout.write(json_text(document()))
    console = console_on("error" if to_stdout else "output")
    with reader_may_leave():
        words(console)
        for what, path in files.items():
            if path is not None:
                console.print(f"{what}: {path}", soft_wrap=True)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ResultFiles:
    """Where a result goes."""

    json: Annotated[
        str | None,
        Parameter(
            group=_OUTPUT,
            allow_leading_hyphen=True,
            help="Write the result as JSON to this file; - is standard output.",
        ),
    ] = None
    report: Annotated[
        Path | None,
        Parameter(group=_OUTPUT, help="Write the report, one HTML page that works offline."),
    ] = None

    def check(self, *, inputs: Sequence[Path]) -> None:
        """Refuse files that cannot be written.

        Raises
        ------
        InputError
            As `check_outputs` does.
        """
        files = {"--json": json_file(self.json), "--report": self.report}
        check_outputs(files, inputs=inputs)

    def write(
        self, document: Callable[[], Mapping[str, Any]], page: Callable[[Path], object]
    ) -> None:
        """Write what is asked for.

        Parameters
        ----------
        document
            Returns the result as plain JSON types.
        page
            Writes its report.
        """
        from stickslip.tasks import write_json

        if self.report is not None:
            page(self.report)
        if (path := json_file(self.json)) is not None:
            write_json(document(), path)

    def tell(
        self, document: Callable[[], Mapping[str, Any]], words: "Callable[[Console], None]"
    ) -> None:
        """Print the result, as `print_result` does, and what was written."""
        files = {"JSON": json_file(self.json), "Report": self.report}
        print_result(document, words, json=self.json, files=files)
