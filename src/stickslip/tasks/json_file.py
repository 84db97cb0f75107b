"""Results as JSON, in a form that every reader of JSON accepts."""

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from stickslip.outputs import whole_file


def json_text(document: Mapping[str, Any]) -> str:
    """Return a result as JSON text; an infinite or undefined number becomes null.

    Every key stands on a line of its own, with all of a list of numbers.

    Examples
    --------
    >>> print(json_text({"condition_number": float("inf"), "ci95": [1.0, 2.0]}), end="")
    {
      "condition_number": null,
      "ci95": [1.0, 2.0]
    }
    """
    return "".join(_pieces(document, "\n")) + "\n"


def write_json(document: Mapping[str, Any], path: Path | str) -> Path:
    """Write a result as JSON; the file appears when it is complete.

    Parameters
    ----------
    document
        The result as plain types.
    path
        The file to write; an existing one is replaced.

    Raises
    ------
    InputError
        If nothing can be written there.
    """
    target = Path(path)
    with whole_file(target, what="the JSON file") as stream:
        stream.writelines(_pieces(document, "\n"))
        stream.write("\n")
    return target


def _pieces(value: Any, line: str) -> Iterator[str]:
    """Yield a value as JSON, piece by piece; each line begins with ``line``."""
    if isinstance(value, Mapping) and value:
        inner, before = f"{line}  ", "{"
        for key, each in value.items():
            yield f"{before}{inner}{_plain(str(key))}: "
            yield from _pieces(each, inner)
            before = ","
        yield f"{line}}}"
    elif isinstance(value, list | tuple) and any(
        isinstance(each, Mapping | list | tuple) for each in value
    ):
        inner, before = f"{line}  ", "["
        for each in value:
            yield f"{before}{inner}"
            yield from _pieces(each, inner)
            before = ","
        yield f"{line}]"
    elif isinstance(value, list | tuple):
        yield _plain([_finite(each) for each in value])
    else:
        yield _plain(_finite(value))


def _plain(value: Any) -> str:
    return json.dumps(value, allow_nan=False, ensure_ascii=False)


def _finite(value: Any) -> Any:
    """Replace a number that JSON has no form for."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
