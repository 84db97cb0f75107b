"""Obvious columns: found by their names when nobody has said which is which."""

import re
from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from types import MappingProxyType

from stickslip.logs.expressions import quoted
from stickslip.logs.table import Table
from stickslip.logs.units import header_unit
from stickslip.records import AxisKind, InputError

__all__ = ["candidates", "find_column", "kind_of_name", "not_found"]

_WORDS = MappingProxyType(
    {
        "time": {"t", "time", "timestamp", "timestamps", "elapsed", "clock", "seconds"},
        "position": {"position", "pos", "x", "q", "angle", "theta", "displacement", "qm"},
        "velocity": {"velocity", "vel", "v", "dq", "qd", "qdot", "dx", "xdot", "speed", "omega"},
        "effort": {"effort", "force", "torque", "tau", "f", "current", "cur", "i", "iq"},
    }
)
"""What a column's name comes down to, by channel."""

_QUALIFIERS = frozenset({"measured", "meas", "actual", "act", "motor", "joint", "axis", "stage"})
"""Words that leave a name's meaning as it is."""

_COMMANDED = frozenset({"commanded", "command", "cmd", "applied", "drive", "input"})
"""Words that leave the meaning of an effort as it is; a commanded position is not measured."""

_LIKENESS = 0.75
"""A name this similar to a known one, from 0 to 1, may be meant for it."""

_SHORTEST_LIKENESS = 4
"""Shorter words are similar to too many others."""

_CURRENTS = frozenset({"current", "cur", "i", "iq"})

_KINDS: Mapping[str, AxisKind] = MappingProxyType(
    {
        "force": "linear",
        "displacement": "linear",
        "torque": "rotary",
        "tau": "rotary",
        "angle": "rotary",
        "theta": "rotary",
        "omega": "rotary",
    }
)
"""Words that are said of one kind of axis only."""


def find_column(table: Table, channel: str) -> str | None:
    """Return the one column that is obviously the channel, or None.

    Raises
    ------
    InputError
        If several columns could be it, or if the only one is a motor current without a unit.
    """
    found = candidates(table, channel)
    currents = [name for name in found if not _CURRENTS.isdisjoint(_words_of(name, table))]
    found = [name for name in found if name not in currents] or currents
    if len(found) > 1:
        raise InputError(
            f"columns {_listed(found)} could each be the {channel.replace('_', ' ')}",
            where=table.label,
            remedy=f"say which, as in {_as_option(channel, found[0])}",
        )
    if found and found == currents and found[0] not in table.units:
        raise InputError(
            f"column {found[0]!r} seems to be a motor current, not a force or a torque",
            where=table.label,
            remedy=f"say its constant, as in {_as_option(channel, f'1.2 * {quoted(found[0])}')}",
        )
    return found[0] if found else None


def candidates(table: Table, channel: str) -> list[str]:
    """Return every column whose name says that it is the channel."""
    words = _WORDS[channel.removeprefix("load_")]
    return [name for name in table.headers if _core_for(channel, name, table) in words]


def not_found(table: Table, channel: str) -> InputError:
    """Return the error that no column is obviously the channel, with the names that come near."""
    taken = {name for each in _WORDS for name in candidates(table, each)}
    known = [word for word in _WORDS[channel] if len(word) >= _SHORTEST_LIKENESS]
    near = [
        name
        for name in table.headers
        if name not in taken
        and get_close_matches(_core_for(channel, name, table), known, n=1, cutoff=_LIKENESS)
    ]
    what = f"no column is obviously the {channel}; "
    if near:
        likely = " or ".join(map(repr, near))
        remedy = f"did you mean {likely}? say so, as in {_as_option(channel, near[0])}"
    else:
        remedy = f"say which it is: {_as_option(channel, 'NAME')}"
    if channel == "time":
        remedy += "; or say how long a sample is: sampling_time or --sampling-time SECONDS"
    return InputError(
        f"{what}the columns are: {', '.join(table.headers)}", where=table.label, remedy=remedy
    )


def kind_of_name(name: str, table: Table) -> AxisKind | None:
    """Return the kind of axis that a column's name is said of, None where it may be either."""
    kinds: set[AxisKind] = {_KINDS[word] for word in _words_of(name, table) if word in _KINDS}
    return kinds.pop() if len(kinds) == 1 else None


def _words_of(name: str, table: Table) -> list[str]:
    """Split a name into lower-case words, without the unit that may end it."""
    title, unit = header_unit(table.headers[name].rpartition(":")[2])
    title = title.removesuffix(f"_{unit}")
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", title)
    return [word for word in re.split(r"[^a-z0-9]+", spaced.lower()) if word]


def _core_for(channel: str, name: str, table: Table) -> str:
    ignored = _QUALIFIERS | (_COMMANDED if channel == "effort" else frozenset[str]())
    return _core(_words_of(name, table), load=channel.startswith("load_"), ignored=ignored)


def _core(words: list[str], *, load: bool, ignored: Iterable[str]) -> str:
    """Return what is left of a name without its qualifiers; empty unless load is as wanted."""
    if ("load" in words) != load:
        return ""
    left = [word for word in words if word not in {*ignored, "load"}]
    return "".join(left)


def _as_option(channel: str, text: str) -> str:
    """Return how to state a channel, as a flag and in a schema."""
    flag = channel.replace("_", "-")
    return (
        f'--{flag} "{text}" on the command line, or {channel} = "{text}" in a schema or LogSchema'
    )


def _listed(names: list[str]) -> str:
    return f"{', '.join(map(repr, names[:-1]))} and {names[-1]!r}"
