"""Names and units as they are written in messages and results."""

import math
import re

from stickslip.records.quantities import QUANTITIES, AxisKind

__all__ = [
    "count_of",
    "in_units_of",
    "in_words",
    "parameter_label",
    "prefixed",
    "prefixed_unit",
    "unit_text",
]

_EITHER_UNIT = re.compile(
    " (?:"
    + "|".join(
        re.escape(f"{each.linear} or {each.rotary}")
        for each in QUANTITIES.values()
        if each.linear != each.rotary
    )
    + r")(?![\w/^])"
)
_DIRECTIONS = {"_positive": ", forward", "_negative": ", backward"}
_PREFIXABLE = ("m", "rad", "s")
_PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))
_ROUNDED_TO_ONE = 0.9995
_ROUNDING = 1.0 / _ROUNDED_TO_ONE
_NAMES = re.compile(
    rf"\b(?:{'|'.join(key for key in QUANTITIES if '_' in key)})(?:_positive|_negative)?\b"
)


def parameter_label(name: str, kind: AxisKind = "linear") -> str:
    """Return the field's term for a parameter; a mass of a rotary axis is an inertia.

    Examples
    --------
    >>> parameter_label("coulomb_friction_positive")
    'Coulomb friction, forward'
    >>> parameter_label("load_mass", "rotary")
    'Load inertia'
    >>> parameter_label("offset[morning]")
    'Offset [morning]'
    """
    name, bracket, log = name.partition("[")
    if bracket:
        return f"{parameter_label(name, kind)} [{log}"
    for suffix, words in _DIRECTIONS.items():
        if name.endswith(suffix):
            return parameter_label(name.removesuffix(suffix), kind) + words
    term = QUANTITIES[name].name.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")
    if kind == "rotary":
        term = term.replace("mass", "inertia")
    return term[0].upper() + term[1:]


def in_units_of(kind: AxisKind, sentence: str) -> str:
    """Return a sentence with the unit of one kind of axis where it names those of both.

    Examples
    --------
    >>> in_units_of("rotary", "tolerance is 0 m or rad, and 3 N s/m or N m s/rad are lost")
    'tolerance is 0 rad, and 3 N m s/rad are lost'
    """
    part = 0 if kind == "linear" else 1
    return _EITHER_UNIT.sub(lambda found: " " + found[0][1:].split(" or ")[part], sentence)


def count_of(number: int, thing: str) -> str:
    """Return how many things there are, in words that agree.

    Examples
    --------
    >>> count_of(1, "sample"), count_of(0, "sample")
    ('1 sample', '0 samples')
    """
    return f"{number} {thing}{'' if number == 1 else 's'}"


def in_words(sentence: str) -> str:
    """Return a sentence with the field's terms in place of the names of quantities in it.

    Examples
    --------
    >>> in_words("it cannot be told apart from viscous_friction and coulomb_friction_positive")
    'it cannot be told apart from viscous friction and Coulomb friction (forward)'
    """
    return _NAMES.sub(_term_of, sentence)


def _term_of(name: re.Match[str]) -> str:
    term, _, direction = parameter_label(name[0]).partition(", ")
    term = term if term.startswith(("Coulomb", "Stribeck")) else term[0].lower() + term[1:]
    return f"{term} ({direction})" if direction else term


def unit_text(unit: str) -> str:
    """Return a unit as it is printed.

    Examples
    --------
    >>> unit_text("kg m^2")
    'kg m²'
    """
    return unit.replace("^2", "²")


def prefixed_unit(size: float, unit: str) -> tuple[float, str]:
    """Return the unit that suits values of a size, and how many of it make the SI unit.

    Parameters
    ----------
    size
        A typical or the largest magnitude [``unit``].
    unit
        Its SI unit; metres, radians and seconds get prefixes, others are left as they are.

    Examples
    --------
    >>> prefixed_unit(0.012, "m"), prefixed_unit(2.5, "N")
    ((1000.0, 'mm'), (1.0, 'N'))
    """
    if unit not in _PREFIXABLE or not 0 < abs(size) < math.inf:
        return 1.0, unit_text(unit)
    for factor, prefix in _PREFIXES:
        # What is rounded up to 1000 of a unit is written as 1 of the next
        if abs(size) * factor >= _ROUNDED_TO_ONE:
            return factor, prefix + unit
    factor, prefix = _PREFIXES[-1]
    return factor, prefix + unit


def prefixed(value: float, unit: str) -> str:
    """Return a value with three digits, in the unit that suits its size.

    Parameters
    ----------
    value
        The value [``unit``].
    unit
        Its SI unit.

    Examples
    --------
    >>> prefixed(-1.2345e-5, "m"), prefixed(0.31, "s"), prefixed(95.1, "kg m^2")
    ('-12.3 µm', '310 ms', '95.1 kg m²')
    """
    factor, shown = prefixed_unit(value, unit)
    return f"{_three_digits(value * factor)} {shown}"


def _three_digits(value: float) -> str:
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.3g}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value) * _ROUNDING)))}f}"
