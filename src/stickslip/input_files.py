"""Input files: TOML and JSON documents, and records made from them.

A leaf beside the packages: schemas of logs, scenarios and saved results are such files.
"""

import errno
import json
import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from stickslip.errors import InputError

Record = TypeVar("Record")

_LARGEST_DOCUMENT = 1e8  # bytes of a saved result with all its arrays are fewer

_DOTTED = re.compile(rb"(?<![\w'\"-])(?:[\w'\"-]++[ \t]*+\.[ \t]*+){200}")
"""A key in a table in a table, and so on, deeper than any document."""

_UNKNOWN = "unexpected_keyword_argument"


def printable(name: str | Path) -> str:
    """Return a file's name with a substitute for each byte that is no UTF-8."""
    return os.fsencode(name).decode("utf-8", errors="replace")


def check_exists(path: Path, kind: str) -> None:
    """Check that a path exists; ``kind`` is what the error calls it.

    Raises
    ------
    InputError
        If it does not.
    """
    if not path.exists():
        raise InputError("no_such_file", where=printable(path), kind=kind)


def _parsed_toml(content: bytes) -> dict[str, Any]:
    if _DOTTED.search(content):  # the parser takes quadratic time for it
        raise RecursionError
    return tomllib.loads(content.decode("utf-8-sig"))


def read_toml(path: Path, *, what: str, line: str) -> dict[str, Any]:
    """Read a TOML file."""
    content = bytes_of(path, f"{what} file")
    try:
        # Some editors begin a file with a byte order mark
        return _parsed_toml(content)
    except RecursionError:
        raise InputError("nested_too_deep", where=printable(path), kind=what) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        reason = str(error)
        raise InputError(
            "not_toml", where=printable(path), kind=what, reason=reason, line=line
        ) from error


def read_json(path: Path) -> dict[str, Any]:
    """Read a table from a JSON file."""
    where = printable(path)
    content = bytes_of(path, "file")
    try:
        document = json.loads(content)
    except RecursionError:
        raise InputError("nested_too_deep", where=where, kind="file") from None
    except ValueError as error:
        raise InputError("not_json", where=where, reason=str(error)) from error
    if not isinstance(document, dict):
        raise InputError("no_table_in_json", where=where)
    return document


def bytes_of(path: Path, kind: str, most: float = _LARGEST_DOCUMENT) -> bytes:
    """Return the bytes of a file, at most ``most``; a pipe may never end, and is refused."""
    where = printable(path)
    try:
        return _content(path, most)
    except FileNotFoundError:
        raise InputError("no_such_file", where=where, kind=kind) from None
    except OSError as error:
        reason = error.strerror or type(error).__name__
        raise InputError("unreadable", where=where, kind=kind, reason=reason) from error


def _content(path: Path, most: float) -> bytes:
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EINVAL, "it is a pipe or a device")
    if path.is_file() and path.stat().st_size > most:
        raise OSError(errno.EFBIG, f"it has more than {most / 1e6:.0f} MB")
    return path.read_bytes()


def record_from(
    record: type[Record], document: Mapping[str, Any], *, where: str, guide: str
) -> Record:
    """Make a record from what a TOML file says."""
    # Loaded here, as it takes a while.
    from pydantic import TypeAdapter, ValidationError

    try:
        # As JSON, so that types are taken strictly: no numbers in quotes, no true for 1.
        text = json.dumps(document, default=str)
        return TypeAdapter(record).validate_json(text, strict=True)
    except ValidationError as error:
        faults = error.errors()
        # A name that is mistyped is also missing: the one that is there says more
        fault = next((each for each in faults if each["type"] == _UNKNOWN), faults[0])
        keys = [str(key) for key in fault["loc"]]
        own = fault.get("ctx", {}).get("error")
        if isinstance(own, InputError):
            raise own.at(_place(where, keys)) from None
        tables = keys[:-1]
        place = _place(where, tables)
        if fault["type"] == _UNKNOWN:
            known = [each.name for each in fields(_table_at(record, tables))]
            raise unknown_key(keys[-1], known).at(place) from None
        if fault["type"] == "dataclass_type":
            raise not_a_table(".".join(keys), fault["input"]).at(place) from None
        raise wrong_value(keys[-1], fault, guide).at(place) from None


def _place(where: str, tables: list[str]) -> str:
    return f"{where}, [{'.'.join(tables)}]" if tables else where


def _table_at(record: Any, keys: list[str]) -> Any:
    """Return the type at a place: of a key, of a table, or of one of several tables by its name."""
    for key in keys:
        record = get_type_hints(record)[key] if is_dataclass(record) else get_args(record)[-1]
    return record


def not_a_table(name: str, value: object) -> InputError:
    """Return the refusal of a value that stands where a table belongs."""
    return InputError("not_a_table", name=name.rpartition(".")[2], value=value, table=name)


def wrong_value(key: str, fault: Mapping[str, Any], guide: str) -> InputError:
    """Return the refusal of a value of the wrong type, from one of pydantic's errors."""
    message = fault["msg"]
    reason = f"{message[0].lower()}{message[1:]}"
    return InputError("wrong_value", name=key, value=fault["input"], reason=reason, guide=guide)


def unknown_key(key: str, known: Iterable[str]) -> InputError:
    """Return the refusal of a key that is none of the known ones."""
    known = tuple(known)
    near = nearest(key, known)
    code = "misspelt_key" if near else "unknown_key"
    return InputError(code, key=key, near=near, keys=known)


def nearest(name: str, known: Iterable[str]) -> list[str]:
    """Return the known names that look like the given one."""
    by_plain: dict[str, str] = {}
    for each in known:
        by_plain.setdefault(each.casefold(), each)
    near = get_close_matches(name.casefold(), by_plain, n=3, cutoff=0.6)
    return [by_plain[each] for each in near]
