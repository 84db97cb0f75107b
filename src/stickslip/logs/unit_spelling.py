"""Units as the headers of logs spell them."""

import re
from functools import lru_cache
from types import MappingProxyType

_SPELLINGS = MappingProxyType(
    {
        meant: spelled.split()
        for meant, spelled in {
            "s": "sec secs second seconds",
            "ms": "msec msecs millisec millisecond milliseconds",
            "us": "µs μs usec usecs microsec microsecond microseconds",
            "ns": "nsec nsecs nanosec nanosecond nanoseconds",
            "minute": "min minutes",
            "hour": "h hr hours",
            "m": "meter meters metre metres",
            "cm": "centimeter centimeters centimetre centimetres",
            "mm": "millimeter millimeters millimetre millimetres",
            "um": "µm μm micron microns micrometer micrometers micrometre micrometres",
            "nm": "nanometer nanometers nanometre nanometres",
            "inch": "in inches",
            "ft": "foot feet",
            "deg": "° degree degrees grad",
            "mdeg": "millideg millidegree millidegrees",
            "rad": "rads radian radians",
            "mrad": "milliradian milliradians",
            "urad": "µrad μrad microradian microradians",
            "arcmin": "arcminute arcminutes",
            "arcsec": "arcsecond arcseconds",
            "turn": "turns rev revs revolution revolutions rot rots rotation rotations",
            "count": "counts cnt cnts tick ticks pulse pulses inc incr increment increments "
            "step steps lsb puu",
            "rpm": "",
            "krpm": "",
            "(turn/s)": "rps",
            "(deg/s)": "dps",
            "(count/s)": "cps",
            "mps": "",
            "N": "newton newtons",
            "mN": "millinewton millinewtons",
            "kN": "kilonewton kilonewtons",
            "cN": "",
            "daN": "",
            "(N*m)": "Nm",
            "(mN*m)": "mNm",
            "(uN*m)": "uNm µNm μNm",
            "(cN*m)": "cNm",
            "(kN*m)": "kNm",
            "(N*mm)": "Nmm",
            "(N*cm)": "Ncm",
            "lbf": "",
            "ozf": "",
            "kgf": "kp",
            "gf": "",
            "(ozf*inch)": "ozin inoz",
            "(lbf*inch)": "lbin inlb",
            "(lbf*ft)": "lbft ftlb",
            "(kgf*cm)": "kgcm",
            "(gf*cm)": "gcm",
            "A": "Arms Apk Aeff amp amps ampere amperes",
            "mA": "mArms mApk mAeff mAmp mAmps milliamp milliamps milliampere milliamperes",
            "kA": "",
            "V": "volt volts",
            "mV": "millivolt millivolts",
            "percent": "% pct",
        }.items()
    }
)
"""Spellings of each unit, by how the unit library is to read it."""

_READ_AS = MappingProxyType(
    {meant.strip("()"): meant for meant in _SPELLINGS if meant.strip("()").isalpha()}
    | {each: meant for meant, spelled in _SPELLINGS.items() for each in spelled}
)
_OF_ANY_CASE = MappingProxyType(
    {
        spelled.casefold(): meant
        for spelled, meant in _READ_AS.items()
        if len(spelled) > 2 and spelled not in {"mNm", "cNm", "kNm", "uNm", "mArms"}
    }
    | {"mm": "mm"}
)
"""Those that mean the same in capitals; NM, mS and the like are left to the user."""

_WHOLE = MappingProxyType(
    {
        spelled: meant
        for meant, every in {
            "rpm": ("1/min", "r/min", "U/min", "tr/min", "min-1", "min^-1", "Umdr/min"),
            "turn/s": ("r/s", "U/s", "tr/s"),
        }.items()
        for spelled in every
    }
)
"""Speeds of rotation whose parts mean something else, by how the unit library is to read them."""

_FORCE, _LENGTH = r"(?:[mkcu]N|daN|N|ozf?|lbs?f?|kgf?|gf?)", r"(?:[mc]?m|in|ft|inch)"
_JOINT = r" ?[ _.*·-] ?"
_TORQUE = re.compile(
    rf"(?<![\w/])(?:(?P<force>{_FORCE}){_JOINT}(?P<length>{_LENGTH})"
    rf"|(?P<first>in|ft){_JOINT}(?P<last>ozf?|lbs?f?))(?![\w^²*]|/s)"
)
"""A torque; in one, a pound is a force."""

_WORDED_TORQUE = re.compile(r"(?<!\w)newtons?[ _*-]met(?:er|re)s?(?!\w)", re.IGNORECASE)
_AS_FORCE = MappingProxyType(
    {"oz": "ozf", "lb": "lbf", "lbs": "lbf", "lbsf": "lbf", "kg": "kgf", "g": "gf"}
)
_NUMBER = re.compile(
    r"(?P<number>\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)(?:/(?P<parts>[1-9]\d*))? ?(?P<unit>[^\W\d]|[%‰°])"
)
_INVERSE = re.compile(r"[ .·*](s|min)(?:\^?-1|⁻¹)")
_RMS = re.compile(r"(?<=A)[ _](?:rms|RMS|pk|eff)$")
_WORD = re.compile(r"[^\W\d_]+|[%‰°]")
_BUILT = re.compile(r"(?:[^\W\d_]|[%‰° .*·/()²⁻¹-]|\^-?[1-9]|(?<=\w)-[1-9])+")
_BRACKETS = re.compile(r"\[(?P<square>[^][]*)\]|\((?P<round>[^()]*)\)")
_DIN = re.compile(r"(?P<name>.*\S)(?: / | in |, ?|: )(?P<unit>[^,:()]+|\([^()]*\))")
_RATE = r"(?:(?:_per_|_?/)(?:s|secs?|seconds?|min|minute)|_(?:s|secs?|seconds?))"
_AMBIGUOUS = frozenset(
    """
    s m h N A V in min inc incr step steps pulse pulses grad cps mps kp gf rot rots ft feet foot
    second hour hours hr minute minutes meter metre amp Amp volt volts count tick turn lbs
    """.split()  # noqa: SIM905 - a list of words is read more easily
)
"""Spellings that are words of names as well."""

_SUFFIXES = frozenset(
    form
    for word in _READ_AS
    if word not in _AMBIGUOUS and word[0].isalpha() and len(word) > 1
    for form in (
        (word, word.upper(), word.capitalize()) if word.casefold() in _OF_ANY_CASE else (word,)
    )
)
_LONG = "|".join(
    [
        r"newton_met(?:er|re)s?|[mck]?N_m|m?nm|ma|(?:lbf?|ozf?)_(?:in|ft)|(?:in|ft)_lbf?|%|‰",
        *map(re.escape, sorted(_SUFFIXES, key=lambda word: (-len(word), word))),
    ]
)
_SLASH = re.compile(rf"(?P<name>[^/]+)/(?P<unit>(?:{_LONG}){_RATE}?)")
_LETTER = re.compile(r"(?P<name>[^\W\d_])/(?P<unit>[^/]+)")  # t/s, but not joint/h
_CAMEL = "|".join(
    [
        "RPM|Mm|Nm|mNm|Ms|Us|mA",
        *sorted(word for word in _SUFFIXES if word[0].isupper() and word[1:].islower()),
    ]
)
_SUFFIXED = re.compile(
    rf".*?(?:[^\W_]\)?[_. -](?P<unit>(?:{_LONG}){_RATE}?|m{_RATE})"
    rf"|[a-z](?P<camel>{_CAMEL})|[^\W\d_]{{3}}_(?P<letter>[smNA]))|t_(?P<second>s)"
)
_IN_CAMEL = MappingProxyType({"Mm": "mm", "Ms": "ms", "Us": "us"})
TORQUE_WORDS = frozenset(
    ["torque", "torq", "tau", "trq", "moment", "drehmoment", "couple", "coppia"]
)
"""Words that name a torque, in lower case."""

_WORDED = re.compile(_LONG)
_OF_TORQUES = re.compile("|".join(sorted({*TORQUE_WORDS, "effort", "kraft"})), re.IGNORECASE)


def is_unit(text: str) -> bool:
    """Return whether a text is one of the units that logs of motion axes come in.

    >>> is_unit("deg/s"), is_unit("(N.mm)"), is_unit("elbow")
    (True, True, False)
    """
    _, text = number_in(text.strip().strip("[]()").strip())
    if text in {"-", "1"} or text in _WHOLE:
        return True
    bare = _WORDED_TORQUE.sub("N", _TORQUE.sub("N", _RMS.sub("", text)))
    words = _WORD.findall(bare)
    return bool(words) and bool(_BUILT.fullmatch(bare)) and all(map(_read_as, words))


def header_unit(header: str) -> tuple[str, str | None]:
    """Split a column's header into its name and the unit in it.

    A unit stands in brackets, behind a slash or a comma, or at the end of the name where it cannot
    be mistaken; then it remains in the name. A text in square brackets that is no index is a unit,
    known or not.

    >>> header_unit("position [mm]"), header_unit("vel (rad/s)"), header_unit("time_ms")
    (('position', 'mm'), ('vel', 'rad/s'), ('time_ms', 'ms'))
    >>> header_unit("torque")
    ('torque', None)
    """
    name, _, unit = _parts(header)
    return name, unit


def title_of(header: str) -> str:
    """Return a header without its unit.

    >>> title_of("position_deg"), title_of("Weg / mm")
    ('position', 'Weg')
    """
    return _parts(header)[1]


def texts_beside(title: str) -> list[str]:
    """Return what stands in a title where a unit would: in round brackets, behind a slash or comma.

    >>> texts_beside("pos (furlong)"), texts_beside("speed, furlong/s"), texts_beside("speed")
    (['furlong'], ['furlong/s'], [])
    """
    found = [match["round"] for match in _BRACKETS.finditer(title) if match["round"]]
    behind = _DIN.fullmatch(title)
    return [*found, behind["unit"]] if behind else found


def number_in(unit: str) -> tuple[float, str]:
    """Split a unit into the number before it, 1 if there is none, and the rest.

    >>> number_in("0.1 Nm"), number_in("1/4096 rev"), number_in("1/min"), number_in("‰")
    ((0.1, 'Nm'), (0.000244140625, 'rev'), (1.0, '1/min'), (0.1, '%'))
    """
    if unit == "‰":
        return 0.1, "%"
    match = _NUMBER.match(unit)
    if match is None:
        return 1.0, unit
    return float(match["number"]) / float(match["parts"] or 1), unit[match.start("unit") :]


def is_worded_unit(word: str) -> bool:
    """Return whether a word of a name is a unit whatever stands around it.

    >>> is_worded_unit("deg"), is_worded_unit("m"), is_worded_unit("step")
    (True, False, False)
    """
    return _WORDED.fullmatch(word) is not None


def for_unit_library(unit: str) -> str:
    """Return a unit as the unit library reads it; unknown words are unchanged.

    >>> for_unit_library("N.mm"), for_unit_library("Degrees/sec"), for_unit_library("in-lb")
    ('(N*mm)', 'deg/s', '(lbf*inch)')
    """
    unit = unit.strip()
    if unit in _WHOLE:
        return _WHOLE[unit]
    spelled = _INVERSE.sub(r"/\1", _RMS.sub("", unit))
    spelled = spelled.replace("_per_", "/").replace("²", "^2")
    spelled = _WORDED_TORQUE.sub("(N*m)", _TORQUE.sub(_torque, spelled))
    spelled = spelled.replace("_", "/").replace("·", "*")
    return _WORD.sub(lambda word: _read_as(word[0]) or word[0], spelled)


def _torque(match: re.Match[str]) -> str:
    force, length = match["force"] or match["last"], match["length"] or match["first"]
    return f"({_AS_FORCE.get(force, force)}*{length})"


def _read_as(word: str) -> str | None:
    """Return how the unit library is to read a word of a unit, None for one that is none."""
    return _READ_AS.get(word) or _OF_ANY_CASE.get(word.casefold())


def _unit_among(text: str) -> str | None:
    """Return the unit in a text in brackets, which may say more; None if there is none.

    >>> _unit_among("measured, rad"), _unit_among("% rated"), _unit_among("joint 1")
    ('rad', '%', None)
    """
    if is_unit(text):
        return text.strip()
    if re.search(r"\d", text):  # a factor, an index, or both
        return None
    parts = [part.strip() for part in re.split("[,;]", text)]
    words = text.split()
    worded = [word for word in (*words[:1], *words[-1:]) if is_worded_unit(word)]
    return next((part for part in parts if is_unit(part)), next(iter(worded), None))


def _in_capitals(unit: str, title: str) -> str:
    """Return the unit at the end of a name, which may be spelled in the case of the name."""
    if unit in {"nm", "mnm"} and _OF_TORQUES.search(title):
        return unit.replace("nm", "Nm")
    return _IN_CAMEL.get(unit, "mA" if unit == "ma" else unit)


@lru_cache(maxsize=65536)  # the parts of a header are asked for when it is named and understood
def _parts(header: str) -> tuple[str, str, str | None]:
    """Return the name of a column, its title without a unit, and the unit."""
    header = header.strip()
    found = list(_BRACKETS.finditer(header))
    for match in reversed(found):
        square, inside = match["square"], match["square"] or match["round"] or ""
        rest = header[: match.start()].rstrip()
        if not rest or inside.strip().isdigit():  # q[3] is an element of q
            continue
        behind = header[match.end() :].strip()
        unit = _unit_among(inside)
        if (square is not None and not behind) or unit is not None:
            name = f"{rest} {behind}" if behind else rest.removesuffix("/")
            return name, name, unit or inside.strip() or None
    match = _DIN.fullmatch(header)
    if match and _WORD.search(match["unit"]) and is_unit(match["unit"]):
        return match["name"], match["name"], match["unit"].strip()
    match = _SLASH.fullmatch(header) or _LETTER.fullmatch(header)
    if match and is_unit(match["unit"]):
        return match["name"], match["name"], match["unit"]
    if match := _SUFFIXED.fullmatch(header):
        group = next(each for each in ("unit", "camel", "letter", "second") if match[each])
        title = header[: match.start(group)].rstrip("_. -")
        return header, title, _in_capitals(match[group], title)
    return header, header, None
