"""The meaning of a column by the words of its name: a channel, an axis, measured or commanded."""

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from stickslip.logs.table import Table
from stickslip.logs.unit_spelling import (
    TORQUE_WORDS,
    is_unit,
    is_worded_unit,
    texts_beside,
    title_of,
)
from stickslip.logs.units import effort_unit, measures
from stickslip.records import AxisKind

Source = Literal["measured", "", "commanded"]


def _set(words: str) -> frozenset[str]:
    return frozenset(words.split())


_STRONG: Mapping[str, frozenset[str]] = {
    "time": _set(
        "time timestamp timestamps elapsed clock stamp secs seconds zeit temps tempo tiempo "
        "datetime"
    ),
    "position": _set(
        "position pos posn fpos angle theta displacement qm lage lageistwert winkel weg posizione "
        "posicion deplacement qpos"
    ),
    "velocity": _set(
        "velocity vel velo fvel speed omega dq qd qdot dx xdot drehzahl geschwindigkeit "
        "vitesse velocita velocidad qvel"
    ),
    "effort": TORQUE_WORDS | _set("effort force kraft forza fuerza qfrc"),
    "current": _set("current curr cur iq strom amps"),
}
"""Words that name a quantity, by channel; a current is an effort."""

_WEAK: Mapping[str, frozenset[str]] = {
    "time": _set("t"),
    "position": _set("x q phi pl"),
    "velocity": _set("v vl"),
    "effort": _set("f eff"),
    "current": _set("i il"),
}
"""Words that name a quantity where no other word of the name does."""

_MEASURED = _set(
    "measured meas measurement actual act fb fbk feedback estimate estimated est present sensed "
    "read observation ist istwert"
)
_COMMANDED = _set(
    "commanded command cmd setpoint set sp target reference ref desired des demand demanded goal "
    "input planned control action soll sollwert"
)
_EXCLUDED = _set(
    "error err acc acceleration accel ddq qdd jerk temp temperature limit max min maximum minimum "
    "std variance covariance gain kp kd ki ff feedforward mode lag following deviation difference "
    "diff integral integrator flag seq id count counter voltage bus power friction gravity "
    "disturbance noise rated nominal external ext offset bias"
)
"""Words of a column that is no channel, such as a position error or a rated torque."""

_NEUTRAL = _set(
    "motor joint axis ax stage state status value val data field raw encoder drive driven actuator "
    "loop signal channel ch of in the telemetry get nc to plc main gvl msg sensor controller "
    "header applied total low filtered side"
)
"""Words that identify neither a quantity nor an axis."""

_NEUTRAL_OF_CURRENT = _set("q active generating producing quadrature")
_NEUTRAL_OF_TIME = _set("sample log ros unix epoch utc system server since start receive record")
_QUALIFIERS = _set(
    "from cell link output unfiltered smoothed calculated calc computed absolute abs relative rel "
    "achse direct new old corrected mean average avg dimensionless unitless"
)
"""Words in brackets that say more of a quantity and name no unit."""

_NUMBERED = _set("j m a dof servo")
"""Words that are neutral before a number: joint 1 is axis 1, whatever it is called."""

_PAIRS: Mapping[tuple[str, str], str] = {
    ("d", "q"): "dq",
    ("q", "dot"): "qdot",
    ("x", "dot"): "xdot",
    ("i", "q"): "iq",
    ("tau", "j"): "tau",
    ("feed", "back"): "feedback",
    ("set", "point"): "setpoint",
    ("time", "stamp"): "timestamp",
}
"""Words that a name may hold in two pieces."""

WORDS_OF_KIND: Mapping[AxisKind, frozenset[str]] = {
    "linear": _set("force displacement kraft weg deplacement forza fuerza"),
    "rotary": _set(
        "torque torq tau trq drehmoment couple coppia angle theta omega winkel drehzahl"
    ),
}
"""Words that are used of one kind of axis only."""

_VOCABULARY = frozenset[str]().union(
    *_STRONG.values(), *_WEAK.values(), _MEASURED, _COMMANDED, _EXCLUDED, _NEUTRAL, _QUALIFIERS,
    _NEUTRAL_OF_CURRENT, _NEUTRAL_OF_TIME, _set("load")
)  # fmt: skip
_UNIT_OR_WORD = _set("in ft inc incr step steps rot lb lbs")
"""Words that are units at the end of a name, or parts of the name: both are possible."""

_SEGMENT = re.compile(r"[/.]|->")
_PIECE = re.compile(r"[^\W_]+")
_WORD = re.compile(r"[^\W\d_]*[A-Z]{2,}(?![a-z])|[^\W\d_]?[^\W\dA-Z_]+|[A-Z]+|\d+")
_SIEMENS = re.compile(r"\b[rp]\d{2,5}\b(?:\[\d+\])?")  # numbers of a drive's parameters
_HUNGARIAN = re.compile(r"^(?:f|lr|r|n|i|b|st|fb|di|ui|ar)(?=[A-Z][a-z])")
"""Type prefix of a variable of a programmable controller, as in ``fActPos``."""


@dataclass(frozen=True, kw_only=True)
class Meaning:
    """Meaning of a column by its name."""

    column: str
    channel: str  # one of the channels of a schema
    axis: str  # words that identify the axis; empty if none do
    source: Source = ""
    current: bool = False  # whether the effort is a current
    stamp: bool = False  # whether the time is that of a measurement, not of its reception
    kind: AxisKind | None = None  # that the name implies


def meaning(table: Table, column: str) -> Meaning | None:
    """Return what a column is by its name, or None if it is no channel."""
    segments = _segments(table.headers[column])
    every = {word for words in segments for word in words}
    if table.group_of(column).time == column:
        return Meaning(column=column, channel="time", axis="", stamp="stamp" in every)
    if every & _EXCLUDED:
        return None
    head, quantity = _head(segments)
    if not head:  # the unit alone names the quantity, as in motor_amps
        head, quantity = _head([words_in(table.headers[column].rpartition(":")[2])])
    if not head and "load" in every:  # as of servo drives that report their load
        head, quantity = "load", "effort"
    if not head:
        return None
    stated = table.units.get(column)
    if stated is not None and not measures(stated, "effort" if quantity == "current" else quantity):
        if head not in _NEUTRAL_OF_CURRENT or effort_unit(stated) != "A":
            return None  # as a torque constant in N m/A
        quantity = "current"  # a q-axis in A
    rest = [word for words in segments for word in words if word != head]
    second_mass = "load" in rest
    if second_mass and quantity not in {"position", "velocity"}:
        return None
    source: Source = ""
    if every & _COMMANDED:
        source = "commanded"
    elif every & _MEASURED or "current" in rest:
        source = "measured"
    kinds: list[AxisKind] = [kind for kind, own in WORDS_OF_KIND.items() if own & every]
    channel = "effort" if quantity == "current" else quantity
    return Meaning(
        column=column,
        channel=f"load_{channel}" if second_mass else channel,
        axis=_axis(rest, quantity),
        source=source,
        current=quantity == "current",
        stamp=bool(every & {"stamp", "header"}),
        kind=kinds[0] if len(kinds) == 1 else None,
    )


def words_of(header: str) -> tuple[str, ...]:
    """Return the words of a header but for its unit."""
    return tuple(word for words in _segments(header) for word in words)


def unread_unit(table: Table, column: str) -> str:
    """Return the text in a header that may be a unit and is not read as one; empty if none is."""
    if column in table.units:
        return ""
    title = title_of(table.headers[column])
    for text in texts_beside(title):
        pieces = _PIECE.findall(text)
        units = [each for each in re.findall(r"[^\W\d_]+|[%°]", text) if is_unit(each)]
        computed = "/" in text or "*" in text
        if any(len(each) > 1 or computed for each in units):
            return text.strip()
        if " " not in text.strip() and not all(map(_is_known, pieces)):
            return text.strip()
    named = _STRONG["time"] | _STRONG["current"]
    pieces = _PIECE.findall(title)
    worded = [each for each in pieces if is_worded_unit(each) and each.lower() not in named]
    last = [each for each in pieces[1:][-1:] if each.lower() in _UNIT_OR_WORD]
    return next(iter((*worded, *last)), "")


def _is_known(piece: str) -> bool:
    """Return whether a piece in brackets names no unit: known words, a number, or an axis."""
    if len(piece) == 1 or piece.isdigit() or piece.lower() in _VOCABULARY:
        return True
    return all(word.isdigit() or word in _VOCABULARY for word in words_in(piece))


def _segments(header: str) -> list[list[str]]:
    """Return the words of each segment of a header that has any, without its unit."""
    title = _SIEMENS.sub(" ", title_of(header).rpartition(":")[2])
    return [words for part in _SEGMENT.split(title) if (words := words_in(part))]


def words_in(text: str) -> list[str]:
    """Split a segment of a name into lower-case words and numbers, plurals without their s."""
    words: list[str] = []
    for piece in _PIECE.findall(text):
        found = _WORD.findall(_HUNGARIAN.sub("", piece))
        words += [part for word in found for part in _known(word.lower())]
    merged: list[str] = []
    for word in words:
        pair = _PAIRS.get((merged[-1], word)) if merged else None
        if pair:
            merged[-1] = pair
        else:
            merged.append(word)
    return merged


def _known(word: str) -> list[str]:
    """Return a word in the form of the vocabulary: singular, without accents, compounds split.

    >>> _known("velocità"), _known("istposition"), _known("épaule")
    (['velocita'], ['ist', 'position'], ['épaule'])
    """
    plain = "".join(c for c in unicodedata.normalize("NFKD", word) if not unicodedata.combining(c))
    word = _singular(plain if plain in _VOCABULARY else word)
    for first in ("ist", "soll"):
        rest = word.removeprefix(first)
        if rest != word and any(rest in words for words in _STRONG.values()):
            return [first, rest]
    return [word]


def _singular(word: str) -> str:
    single = {"velocities": "velocity", "states": "state"}.get(word)
    if single:
        return single
    if word.endswith("s") and len(word) > 4 and word not in _STRONG["time"]:  # temps
        stem = word[:-1]
        if any(stem in words for words in _STRONG.values()) or stem in (
            _NEUTRAL | _MEASURED | _COMMANDED | _EXCLUDED
        ):
            return stem
    return word


def _head(segments: list[list[str]]) -> tuple[str, str]:
    """Return the word that names the quantity, and the quantity; empty if no word does.

    Of several it is the last, as in "torque current", in the last segment that has one.
    """
    for vocabulary in (_STRONG, _WEAK):
        for words in reversed(segments):
            for word in reversed(words):
                for quantity, known in vocabulary.items():
                    if word in known:
                        return word, quantity
    return "", ""


def _axis(words: list[str], quantity: str) -> str:
    """Return the words that identify the axis."""
    ignored = _NEUTRAL | _MEASURED | _COMMANDED | {"load"}
    ignored = ignored.union(*_STRONG.values())
    if quantity == "current":
        ignored |= _NEUTRAL_OF_CURRENT
    if quantity == "time":
        ignored |= _NEUTRAL_OF_TIME
    kept: list[str] = []
    for k, word in enumerate(words):
        numbered = word in _NUMBERED and k + 1 < len(words) and words[k + 1].isdigit()
        if word not in ignored and not numbered:
            kept.append(word)
    return " ".join(kept)
