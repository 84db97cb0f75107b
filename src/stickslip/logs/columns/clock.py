"""Units of time stamps by their size and their step, where nothing states them."""

import numpy as np
from jaxtyping import Float

from stickslip.records import InputError

_EPOCHS = (
    (1.0, "s since 1970", 1e9, 2.5e9),
    (1e-3, "ms since 1970", 1e12, 2.5e12),
    (1e-6, "us since 1970", 1e15, 2.5e15),
    (1e-7, "FILETIME, in 100 ns since 1601", 1.1e17, 1.6e17),
    (1e-9, "ns since 1970", 1e18, 2.5e18),
)
"""Factor to s, name, and the range of stamps between the years 2001 and 2049 (FILETIME: 1949 and
2108)."""

_FASTEST, _SLOWEST = 5e-5, 0.1
"""Sampling times [s] that logs of motion axes come in: 20 kHz drives to 10 Hz buses. A step is
taken in the one unit that puts it there."""

_SECONDS = 1.0
"""Steps up to this are seconds: nothing logs an axis every 1 us [s]."""

_AMBIGUOUS = 100
"""Fewest samples at which a step of 0.1 to 1 is ambiguous: it may be in s or in ms."""

_ROUNDED = 1e-6
"""Relative error of a step: differences of large stamps are not exact."""


def unit_of_stamps(
    stamps: Float[np.ndarray, " n"], *, column: str, label: str
) -> tuple[float, str]:
    """Return how many seconds a unit of time stamps is, and a sentence on why.

    Stamps of the size of a calendar time are one. Others are in s if their step is at most 1, or
    else in the one unit of ms, us and ns in which it is a sampling time. A long log with a step of
    0.1 to 1 is refused: it is slow in s, and ordinary in ms.
    """
    plain = "no unit is given, so it is taken in s"
    if stamps.size < 2 or not np.isfinite(stamps).all():
        return 1.0, plain
    for factor, name, low, high in _EPOCHS:
        if low <= float(stamps[0]) <= high:
            return factor, f"no unit is given; its size is that of {name}"
    step = float(np.median(np.abs(np.diff(stamps))))
    if _SLOWEST * (1.0 + _ROUNDED) < step <= _SECONDS and stamps.size >= _AMBIGUOUS:
        raise InputError(
            "time_unit_unknown", where=label, column=column, step=step, units=["s", "ms"]
        )
    if step <= _SECONDS:
        return 1.0, plain
    units = {"ms": 1e-3, "us": 1e-6, "ns": 1e-9}
    likely = [name for name, factor in units.items() if _FASTEST <= step * factor <= _SLOWEST]
    if len(likely) != 1:
        raise InputError(
            "time_unit_unknown", where=label, column=column, step=step, units=likely or list(units)
        )
    return units[likely[0]], (
        f"no unit is given; its step of {step:.6g} is a sampling time in {likely[0]} only"
    )
