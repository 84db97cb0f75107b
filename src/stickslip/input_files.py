"""Input files: TOML and JSON documents, and records made from them.

A leaf beside the packages: schemas of logs, scenarios and saved results are such files.
"""

import errno
import json
import os
import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import fields, is_dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, TypeVar, get_args, get_type_hints

from stickslip.records import InputError

Record = TypeVar("Record")

_LARGEST_DOCUMENT = 100_000_000
"""Bytes of a saved result with all its arrays are fewer."""

_UNKNOWN = "unexpected_keyword_argument"


def printable(name: str | Path) -> str:
    """Return a file's name with a substitute for each byte that is no UTF-8."""
    return os.fsencode(name).decode("utf-8", errors="replace")


def read_toml(path: Path, *, what: str, line: str) -> dict[str, Any]:
    """Read a TOML file."""
    try:
        # Some editors begin a file with a byte order mark
        return tomllib.loads(_content(path).decode("utf-8-sig"))
    except FileNotFoundError:
        raise InputError(
            f"there is no such {what} file", where=printable(path), remedy="check the path"
        ) from None
    except OSError as error:
        raise InputError(
            f"the {what} cannot be read ({error.strerror})",
            where=printable(path),
            remedy="give the path of a readable TOML file",
        ) from error
    except RecursionError:
        raise InputError(
            f"the {what} is nested too deeply",
            where=printable(path),
            remedy=f"write lines such as {line}",
        ) from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(
            f"the {what} is not TOML ({error})",
            where=printable(path),
            remedy=f"write lines such as {line}; text goes in quotes",
        ) from error


def read_json(path: Path) -> dict[str, Any]:
    """Read a table from a JSON file."""
    remedy = "give a file that stickslip wrote"
    try:
        document = json.loads(_content(path))
    except FileNotFoundError:
        raise InputError(
            "there is no such file", where=printable(path), remedy="check the path"
        ) from None
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})",
            where=printable(path),
            remedy="give a readable file",
        ) from error
    except RecursionError:
        raise InputError(
            "the file is nested too deeply", where=printable(path), remedy=remedy
        ) from None
    except ValueError as error:
        raise InputError(
            f"the file is not JSON ({error})", where=printable(path), remedy=remedy
        ) from error
    if not isinstance(document, dict):
        raise InputError("the file holds no table", where=printable(path), remedy=remedy)
    return document


def _content(path: Path) -> bytes:
    """Return the bytes of a file; a pipe, from which none may ever come, is none."""
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.EINVAL, "it is a pipe or a device")
    if path.is_file() and path.stat().st_size > _LARGEST_DOCUMENT:
        raise OSError(errno.EFBIG, f"it has more than {_LARGEST_DOCUMENT / 1e6:.0f} MB")
    return path.read_bytes()


def record_from(
    record: type[Record], document: Mapping[str, Any], *, where: str, remedy: str
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
        raise wrong_value(keys[-1], fault, remedy).at(place) from None


def _place(where: str, tables: list[str]) -> str:
    return f"{where}, [{'.'.join(tables)}]" if tables else where


def _table_at(record: Any, keys: list[str]) -> Any:
    """Return the type at a place: of a key, of a table, or of one of several tables by its name."""
    for key in keys:
        record = get_type_hints(record)[key] if is_dataclass(record) else get_args(record)[-1]
    return record


def not_a_table(name: str, value: object) -> InputError:
    """Return the refusal of a value that stands where a table belongs."""
    return InputError(
        f"{name.rpartition('.')[2]} is {value!r}, it must be a table",
        remedy=f"write [{name}] and its keys on the lines below it",
    )


def wrong_value(key: str, fault: Mapping[str, Any], remedy: str) -> InputError:
    """Return the refusal of a value of the wrong type, from one of pydantic's errors."""
    message = fault["msg"]
    return InputError(
        f"{key} is {fault['input']!r}: {message[0].lower()}{message[1:]}", remedy=remedy
    )


def unknown_key(key: str, known: Iterable[str]) -> InputError:
    """Return the refusal of a key that is none of the known ones."""
    known = tuple(known)
    near = nearest(key, known)
    return InputError(
        f"unknown key {key!r}",
        remedy=f"did you mean {near}?" if near else f"the keys are: {', '.join(known)}",
    )


def nearest(name: str, known: Iterable[str]) -> str:
    """Return the known names that look like the given one, quoted; empty if there is none."""
    by_plain: dict[str, str] = {}
    for each in known:
        by_plain.setdefault(each.casefold(), each)
    near = get_close_matches(name.casefold(), by_plain, n=3, cutoff=0.6)
    return " or ".join(repr(by_plain[each]) for each in near)
