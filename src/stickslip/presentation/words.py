"""Values, intervals and verdicts as text, for the terminal and for pages."""

import math
from collections.abc import Callable, Iterable, Mapping
from enum import Enum
from typing import Any, NamedTuple

from stickslip.records import (
    AxisKind,
    AxisLog,
    EffortUnit,
    FrictionEstimate,
    ParameterEstimate,
    Status,
    in_words,
    parameter_label,
    unit_of,
    unit_text,
)

NONE = "–"
"""Text for a missing value."""

_MOST_DECIMALS = 15  # more are below the precision of a float
_PREFIXABLE = ("m", "rad", "s")
_PREFIXES = ((1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"))
_ROUNDED_TO_ONE = 0.9995  # rounded to three digits it is 1
_ROUNDING = 1.0 / _ROUNDED_TO_ONE
_MIDDLE = 0.01  # of half of an interval: a value nearer to the middle is taken to lie in it


class Judgement(Enum):
    """Whether a value of an estimate can be used."""

    IDENTIFIED = "identified"
    NOT_IDENTIFIED = "not identified"
    UNPHYSICAL = "unphysical"
    UNUSABLE = "not to be used"


class Judged(NamedTuple):
    """A judgement with its reason, unless the status of the estimate is the reason."""

    judgement: Judgement
    reason: str = ""


def judged(estimate: FrictionEstimate, name: str) -> Judged:
    """Return whether a parameter of an estimate can be used, and why not."""
    parameter = estimate.parameters[name]
    verdicts = {each.parameter: each for each in estimate.diagnostics.verdicts}
    verdict = verdicts.get(name)
    negative = parameter.value is not None and parameter.value <= 0
    if estimate.status is Status.UNPHYSICAL and negative and not parameter.signed:
        return Judged(Judgement.UNPHYSICAL, "it cannot be negative")
    if parameter.identified and not estimate.status.usable:
        return Judged(Judgement.UNUSABLE)
    if parameter.identified and (verdict is None or verdict.identifiable):
        return Judged(Judgement.IDENTIFIED)
    return Judged(Judgement.NOT_IDENTIFIED, "" if verdict is None else in_words(verdict.reason))


def missing_parameters(estimate: FrictionEstimate, kind: AxisKind = "linear") -> list[str]:
    """Return one sentence for each reason for which parameters are not identifiable."""
    reasons: dict[str, list[str]] = {}
    for verdict in estimate.diagnostics.verdicts:
        if not verdict.identifiable:
            reasons.setdefault(verdict.reason, []).append(parameter_label(verdict.parameter, kind))
    return [f"{', '.join(names)}: {in_words(reason)}" for reason, names in reasons.items()]


def reasons_of_status(estimate: FrictionEstimate, kind: AxisKind = "linear") -> list[str]:
    """Return the cause of a mismatch, which is the first note, or else the missing parameters."""
    notes = estimate.diagnostics.notes
    if estimate.status is Status.MODEL_MISMATCH and notes:
        return [in_words(notes[0])]
    return missing_parameters(estimate, kind)


def side_text(estimate: FrictionEstimate) -> str:
    """Return a sentence on the side of the gear that the values refer to; empty if not known."""
    side = estimate.provenance.side
    return f"The values refer to the {side} side of the gear." if side else ""


def assumed_units(logs: Iterable[AxisLog]) -> str:
    """Return which units were assumed, as the logs name none; empty if they name all."""
    units = {
        f"{channel.replace('_', ' ')} in {unit_text(unit)}"
        for log in logs
        if log.source is not None
        for channel, unit in log.source.assumed_units
    }
    words = f"Assumed units, as the log names none: {', '.join(sorted(units))}."
    return words if units else ""


def value_texts(parameter: ParameterEstimate) -> tuple[str, str]:
    """Return value and 95 % interval with their significant digits; a dash for a missing one."""
    value, std, interval = parameter.value, parameter.std, parameter.ci95
    if value is None:
        return NONE, NONE
    if std is None or interval is None:
        return f"{value:.5g}", "none"
    decimals = _decimals(std)
    return rounded(value, std), " to ".join(_fixed(end, decimals) for end in interval)


def value_with_half(parameter: ParameterEstimate) -> str:
    """Return a value with half of its 95 % interval; a dash for a missing one.

    An interval about another middle is written with both ends.
    """
    if parameter.value is None:
        return NONE
    if parameter.ci95 is None:
        return f"{parameter.value:.4g}"
    low, high = parameter.ci95
    half = 0.5 * (high - low)
    if abs(0.5 * (low + high) - parameter.value) > _MIDDLE * half:
        value, interval = value_texts(parameter)
        return f"{value} ({interval})"
    return f"{rounded(parameter.value, half)} ± {half:.2g}"


def or_none(value: float | None, text: Callable[[float], str]) -> str:
    """Return the text of a value; a dash for a missing one."""
    return NONE if value is None else text(value)


def ratio_text(ratio: float) -> str:
    """Return a ratio with three digits, or all before the point.

    >>> ratio_text(1.0234), ratio_text(1234.5)
    ('1.02', '1234')
    """
    return f"{ratio:.3g}" if abs(ratio) < 1000 else f"{ratio:.0f}"


def between_text(low: float | None, high: float | None) -> str:
    """Return the limits that a value lies between, None where there is none.

    >>> between_text(130.0, 173.24), between_text(None, 173.24), between_text(None, None)
    ('130 to 173.2', 'below 173.2', 'untested')
    """
    if low is not None and high is not None:
        return f"{low:.4g} to {high:.4g}"
    if high is not None:
        return f"below {high:.4g}"
    return "untested" if low is None else f"above {low:.4g}"


def rounded(value: float, uncertainty: float) -> str:
    """Return a value with the digits that two digits of its standard deviation leave meaningful.

    >>> rounded(95.108877, 0.1085), rounded(203503.4, 1146.0)
    ('95.11', '203500')
    """
    return _fixed(value, _decimals(uncertainty))


def printed_unit(name: str, kind: AxisKind, effort: EffortUnit = "") -> str:
    """Return the unit of a quantity or parameter as it is printed, by the unit of the effort.

    >>> printed_unit("mass", "rotary")
    'kg m²'
    """
    return unit_text(unit_of(name, kind, effort))


def prefixed_unit(size: float, unit: str) -> tuple[float, str]:
    """Return the unit that suits values of a size [``unit``], and how many of it make the SI unit.

    Metres, radians and seconds get prefixes, other units are left as they are.

    >>> prefixed_unit(0.012, "m"), prefixed_unit(2.5, "N")
    ((1000.0, 'mm'), (1.0, 'N'))
    """
    if unit not in _PREFIXABLE or not 0 < abs(size) < math.inf:
        return 1.0, unit_text(unit)
    # A value that is rounded up to 1000 of a unit is written as 1 of the next
    suited = (each for each in _PREFIXES if abs(size) * each[0] >= _ROUNDED_TO_ONE)
    factor, prefix = next(suited, _PREFIXES[-1])
    return factor, prefix + unit


def prefixed(value: float, unit: str) -> str:
    """Return a value [``unit``, SI] with three digits, in the unit that suits its size.

    >>> prefixed(-1.2345e-5, "m"), prefixed(0.31, "s"), prefixed(95.1, "kg m^2")
    ('-12.3 µm', '310 ms', '95.1 kg m²')
    """
    factor, shown = prefixed_unit(value, unit)
    return f"{_three_digits(value * factor)} {shown}"


def _three_digits(value: float) -> str:
    if value == 0 or not 1e-3 <= abs(value) < 1e6:
        return f"{value:.3g}"
    return f"{value:.{max(0, 2 - math.floor(math.log10(abs(value) * _ROUNDING)))}f}"


def typeset(number: str) -> str:
    """Return a number with its unit as a page shows it: with a minus sign, on one line."""
    return number.replace("-", "−").replace(" ", "\u00a0")


def shown(value: float, unit: str) -> str:
    """Return a value in the unit that suits its size, typeset for a page."""
    return typeset(prefixed(value, unit))


def value_text(value: Any, unit: str = "") -> str:
    """Return a value of a scenario or an option of an estimator, with its unit.

    >>> value_text([0.5, 1.0], "Hz"), value_text(True), value_text(None)
    ('0.5, 1 Hz', 'yes', 'not given')
    """
    match value:
        case None:
            text = "not given"
        case bool():
            text = "yes" if value else "no"
        case float():
            text = f"{value:.6g}"
        case Mapping():
            text = ", ".join(f"{key} = {value_text(each)}" for key, each in value.items()) or "none"
        case tuple() | list():
            text = ", ".join(map(value_text, value)) or "none"
        case _:
            text = str(value)
    return f"{text} {unit_text(unit)}".rstrip()


def _decimals(uncertainty: float) -> int | None:
    """Return how many decimals show two digits of an uncertainty; None if it has no digits."""
    if not (math.isfinite(uncertainty) and uncertainty > 0):
        return None
    decimals = 1 - math.floor(math.log10(uncertainty))
    return decimals if abs(decimals) <= _MOST_DECIMALS else None


def _fixed(value: float, decimals: int | None) -> str:
    if decimals is None or abs(value) >= 10.0**_MOST_DECIMALS:
        return f"{value:.6g}"
    text = f"{round(value, decimals):.{max(decimals, 0)}f}"
    return text.removeprefix("-") if float(text) == 0 else text
