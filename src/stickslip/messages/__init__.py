"""Sentences of errors: one table from codes to templates, in the TOML files of this folder.

A template names quantities of the error in braces, with a format as in ``str.format`` or one of
these: ``name`` and ``names`` (settings, as the front end calls them), ``words`` (a name without
underscores), ``value`` (a number in short, else as Python writes it), ``unit`` and ``in`` (" N" and
" in N"; nothing where there is none), ``list`` (items as text), ``and`` and ``or`` (the same, with
that word before the last), ``all`` and ``any`` (the same, with items as Python writes them), ``n
sample`` (a count of samples; ``n axis|axes`` for another plural), ``if TEXT`` (text, itself a
template, unless the quantity is 0, empty
or None). ``{option.NAME}`` is a setting, as the front end calls it.
"""

import string
import tomllib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from numbers import Real
from pathlib import Path
from typing import Any

__all__ = ["Message", "messages", "rendered"]

Naming = Callable[[str], str]
_NO_UNIT = ("", "-")


@dataclass(frozen=True)
class Message:
    """Template of a sentence, or the sentence."""

    what: str  #: What is wrong.
    remedy: str  #: What to do about it.


@cache
def messages() -> dict[str, Message]:
    """Return every template by its code, with the files read once."""
    every: dict[str, Message] = {}
    for path in sorted(Path(__file__).parent.glob("*.toml")):
        for code, entry in tomllib.loads(path.read_text(encoding="utf-8")).items():
            if code in every:
                raise ValueError(f"the code {code} is in {path.name} and in another file")
            every[code] = Message(**entry)
    return every


def rendered(code: str, quantities: Mapping[str, Any], naming: Naming = str) -> Message:
    """Return what is wrong and the remedy, with settings named by ``naming``."""
    message, template = messages()[code], _Template(naming)
    values = {"option": _Options(naming), **quantities}
    return Message(
        what=template.vformat(message.what, (), values),
        remedy=template.vformat(message.remedy, (), values),
    )


@dataclass(frozen=True)
class _Options:
    """Attributes that are the front end's names of settings."""

    naming: Naming

    def __getattr__(self, name: str) -> str:
        return self.naming(name)


class _Template(string.Formatter):
    """Format fields as the templates do."""

    def __init__(self, naming: Naming) -> None:
        self._own: dict[str, Callable[[Any], str]] = {
            "name": lambda value: naming(str(value)),
            "names": lambda value: _listed([naming(each) for each in value], "and"),
            "words": lambda value: str(value).replace("_", " "),
            "value": _short,
            "unit": lambda value: "" if value in _NO_UNIT else f" {value}",
            "in": lambda value: "" if value in _NO_UNIT else f" in {value}",
            "list": lambda value: ", ".join(map(str, value)) or "none",
            "and": lambda value: _listed(list(value), "and"),
            "or": lambda value: _listed(list(value), "or"),
            "any": lambda value: _listed([_quoted(each) for each in value], "or"),
            "all": lambda value: _listed([_quoted(each) for each in value], "and"),
        }

    def format_field(self, value: Any, format_spec: str) -> str:
        if format_spec in self._own:
            return self._own[format_spec](value)
        if format_spec.startswith("n "):
            one, _, several = format_spec[2:].partition("|")
            return f"{value} {one if value == 1 else several or f'{one}s'}"
        if format_spec.startswith("if "):
            return format_spec[3:] if value else ""
        try:
            return format(value, format_spec)
        except (TypeError, ValueError):  # text where a number belongs
            return repr(value)


def _short(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, Real):
        return repr(value)
    return f"{value:g}"


def _quoted(value: object) -> str:
    return repr(value) if isinstance(value, str) else str(value)


def _listed(items: Sequence[str], last: str) -> str:
    *others, end = items or ["none"]
    return f"{', '.join(others)} {last} {end}" if others else end
