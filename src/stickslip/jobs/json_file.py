"""Results as JSON, in a form that every reader of JSON accepts."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from stickslip.outputs import check_output, whole_file

__all__ = ["json_text", "write_json"]


def json_text(document: Mapping[str, Any]) -> str:
    """Return a result as JSON text; an infinite or undefined number becomes null.

    Examples
    --------
    >>> print(json_text({"condition_number": float("inf")}), end="")
    {
      "condition_number": null
    }
    """
    return json.dumps(_finite(document), allow_nan=False, indent=2, ensure_ascii=False) + "\n"


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
    check_output(target, what="the JSON file")
    with whole_file(target, what="the JSON file") as stream:
        stream.write(json_text(document))
    return target


def _finite(value: Any) -> Any:
    """Replace numbers that JSON does not know."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return value
