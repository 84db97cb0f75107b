"""Results of a command: files, JSON on standard output, and text for a reader."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, TypeVar, runtime_checkable

from cyclopts import Parameter

from stickslip.cli.arguments import group
from stickslip.cli.terminal import console_on, reader_may_leave

if TYPE_CHECKING:
    from rich.console import Console

    from stickslip.presentation.results import Result

output = partial(Parameter, group=group("Output", 4))
_TITLES = {"json": "JSON", "schema_out": "Schema"}


@runtime_checkable
class _Document(Protocol):
    """A result with a JSON form."""

    def to_dict(self) -> dict[str, Any]: ...


_Found = TypeVar("_Found", bound=_Document)


def check_apart(files: Mapping[str, Path | None]) -> None:
    """Check that no two options name the same file."""
    from stickslip.errors import InputError

    for (option, path), (other, same) in combinations(files.items(), 2):
        if path is not None and same is not None and path.resolve() == same.resolve():
            raise InputError("same_output", where=str(same), names=(option, other))


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class JsonFile:
    """JSON form of a result."""

    json: Annotated[
        str | None,
        output(
            allow_leading_hyphen=True,
            help="Write the result as JSON to this file; - is standard output.",
        ),
    ] = None

    def named(self) -> dict[str, Path | None]:
        """Return the files by the options that name them; - is standard output, and no file."""
        return {"json": None if self.json in {None, "-"} else Path(str(self.json))}

    def check(self, *, inputs: Sequence[Path], **others: Path | None) -> None:
        """Check that these files and others, by their options, can be written and are no inputs.

        This comes before anything is computed.
        """
        from stickslip.outputs import check_output

        files = self.named() | others
        check_apart(files)
        for option, path in files.items():
            if path is not None:
                check_output(path, inputs=list(inputs), what=option)

    def write(self, found: _Document) -> None:
        """Write the JSON file if it was requested."""
        from stickslip.tasks import write_json

        if (path := self.named()["json"]) is not None:
            write_json(found.to_dict(), path)

    def print(
        self, found: _Found, text: "Callable[[Console, _Found], None]", **others: Path | None
    ) -> None:
        """Print a result and its files; ``--json -`` prints JSON, and the rest to standard error.

        ``text`` prints it for a reader, ``others`` are further files by their options.
        """
        to_stdout = self.json == "-"
        if to_stdout:
            from stickslip.tasks import json_text

            with reader_may_leave():
                sys.stdout.write(json_text(found.to_dict()))
        console = console_on("error" if to_stdout else "output")
        with reader_may_leave():
            text(console, found)
            for option, path in (self.named() | others).items():
                if path is not None:
                    title = _TITLES.get(option, option.capitalize())
                    console.print(f"{title}: {path}", soft_wrap=True)


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class ResultFiles(JsonFile):
    """Files of a result."""

    report: Annotated[
        Path | None, output(help="Write the report, one HTML page that works offline.")
    ] = None

    def named(self) -> dict[str, Path | None]:
        """Return the files by the options that name them."""
        return {**super().named(), "report": self.report}

    def check(self, *, inputs: Sequence[Path], **others: Path | None) -> None:
        """Check the files, and that the report is named as an HTML page."""
        from stickslip.outputs import check_page_suffix

        super().check(inputs=inputs, **others)
        if self.report is not None:
            check_page_suffix(self.report, what="report")

    def write_all(self, found: "Result") -> None:
        """Write the requested files."""
        from stickslip import write_report

        if self.report is not None:
            write_report(found, self.report)
        self.write(found)
