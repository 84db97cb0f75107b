"""Units of time stamps by their size and their step, where nothing states them."""

import numpy as np
from jaxtyping import Float

from stickslip.records import InputError, count_of

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

_SLOW_CALENDAR = 10.0
"""Largest step of calendar stamps [s]: a counter of microseconds may be of their size."""

_BITS = (16, 32)  # sizes of counters that begin again at 0

_NEAR_END = 100.0
"""Steps from its end at which a counter can begin again: samples may be lost there."""

_SECONDS = 1.0  # steps up to this may be seconds: nothing logs an axis every 1 us [s]

_LONGER = {"min": 60.0, "hour": 3600.0, "day": 86400.0}
"""Units longer than s, which a step below the shortest sampling time may be in [s]."""

_BRIEF, _NO_SECONDS = 1.0, 3e-6
"""Length of a log in s at least, whose step is below the shortest sampling time; no such step in s:
10 ms are 2.8e-6 hours [s]."""

_AMBIGUOUS = 100  # fewest samples at which a step of 0.1 to 1 is ambiguous: it may be in s or in ms

_COARSE = 0.01
"""Resolution of stamps over the sampling time [-] from which they are not exact enough."""

_COARSEST = 10.0  # the same up to which a lost sample still shows

_OFF_LINE = 1.1
"""Range of the deviations of rounded stamps from a uniform clock, in units of their resolution [-]:
1 if the resolution itself is not rounded."""

_UNEQUAL = 0.1
"""Deviation of a step from a multiple of the resolution [-]: 15.6 ms may be printed in ms."""

_MOST_GAPS = 0.01
"""Share of the steps that are gaps in a uniform clock, or that are zero by chance [-]."""

_FEWEST_STEPS = 20  # of stamps that show a uniform clock [-]
_FEWEST_OF_A_KIND = 2  # of the rarer step [-]: a single one is a repeated or a lost row

_ROUNDED = 1e-6  # relative error of a step: differences of large stamps are not exact


def continued(stamps: Float[np.ndarray, " n"]) -> tuple[Float[np.ndarray, " n"], list[str]]:
    """Return the stamps of a counter that begins again at 0 as if it did not, and a note on it.

    Others are returned as they are: a step back is an error that the log names.
    """
    steps = np.diff(stamps)
    back = np.flatnonzero(steps < 0.0)
    if not back.size or not np.isfinite(stamps).all() or np.any(stamps != np.floor(stamps)):
        return stamps, []
    near = _NEAR_END * float(np.median(steps))
    for bits in _BITS:
        size = 2.0**bits
        over = steps[back] + size
        inside = stamps.min() >= 0.0 and stamps.max() < size
        if inside and over.min() > 0.0 and over.max() <= near:
            wraps = np.concatenate(([0.0], np.cumsum(steps < 0.0)))
            return stamps + size * wraps, [
                f"time: a counter of {bits} bits begins again at 0 in "
                f"{count_of(back.size, 'place')}; continued"
            ]
    return stamps, []


def unrounded(
    stamps: Float[np.ndarray, " n"], *, column: str, label: str
) -> tuple[Float[np.ndarray, " n"], list[str]]:
    """Return the stamps of a uniform clock that were rounded to a coarse resolution, and a note.

    Steps of a uniform clock are the two multiples of the resolution around the sampling time. Rare
    longer ones are gaps, behind which the clock goes on at any phase. Others are returned as they
    are, unless some are equal.
    """
    steps = np.diff(stamps)
    if steps.size < _FEWEST_STEPS or not np.isfinite(steps).all() or np.min(steps) < 0.0:
        return stamps, []
    low = float(np.min(steps))
    high = float(np.min(steps[steps > low * (1.0 + _COARSE)], initial=np.inf))
    unit = high - low
    if not np.isfinite(unit):
        return stamps, []  # all steps are equal
    counts = steps / unit
    if np.max(np.abs(counts - np.rint(counts))) > _UNEQUAL:
        return stamps, []
    gaps = np.flatnonzero(steps > high + 0.5 * unit)
    starts = np.append(0, gaps + 1)
    span = float(np.sum(steps) - np.sum(steps[gaps]))
    count = np.arange(stamps.size, dtype=np.float64)
    mean = span / (steps.size - gaps.size)
    shorter = int(np.sum(steps < low + 0.5 * unit))
    rarer = min(shorter, steps.size - gaps.size - shorter)
    even = gaps.size <= _MOST_GAPS * steps.size and _COARSE * mean < unit < _COARSEST * mean
    even = even and rarer >= _FEWEST_OF_A_KIND

    def ends(period: float) -> tuple[Float[np.ndarray, " k"], Float[np.ndarray, " k"]]:
        off = stamps - period * count
        return np.minimum.reduceat(off, starts), np.maximum.reduceat(off, starts)

    def width(period: float) -> float:
        least, most = ends(period)
        return float(np.max(most - least))

    if even:
        from scipy.optimize import minimize_scalar

        reach = unit * starts.size / steps.size
        found = minimize_scalar(
            lambda share: width(mean + share * reach), bounds=(-1.0, 1.0), method="bounded"
        )
        period = mean + float(found.x) * reach
        if width(period) <= _OFF_LINE * unit:
            least, most = ends(period)
            phase = np.repeat(0.5 * (least + most), np.diff(np.append(starts, stamps.size)))
            return phase + period * count, [
                f"time: the stamps are those of a uniform clock with a step of {period:.6g}, "
                f"rounded to multiples of {unit:.4g}; the clock is used"
            ]
    if low == 0.0 and np.mean(steps == 0.0) > _MOST_GAPS:
        raise InputError("time_rounded", where=label, column=column, unit=unit, step=mean)
    return stamps, []


def unit_of_stamps(
    stamps: Float[np.ndarray, " n"], *, column: str, label: str
) -> tuple[float, str]:
    """Return how many seconds a unit of time stamps is, and a sentence on why.

    Stamps of the size of a calendar time are one. Others are in s if their step is at most 1, or
    else in the one unit of ms, us and ns in which it is a sampling time. A long log with a step of
    0.1 to 1 is refused: it is slow in s, and ordinary in ms. A step below 5e-5 is refused too if
    the log is shorter than 1, or the step below 3e-6: it may be in minutes, hours or days.
    """
    plain = "no unit is given, so it is taken in s"
    if stamps.size < 2 or not np.isfinite(stamps).all():
        return 1.0, plain
    step = float(np.median(np.abs(np.diff(stamps))))
    for factor, name, low, high in _EPOCHS:
        if low <= float(stamps[0]) <= high and step * factor <= _SLOW_CALENDAR:
            return factor, f"no unit is given; its size is that of {name}"
    if _SLOWEST * (1.0 + _ROUNDED) < step <= _SECONDS and stamps.size >= _AMBIGUOUS:
        raise InputError(
            "time_unit_unknown", where=label, column=column, step=step, units=["s", "ms"]
        )
    brief = step < _NO_SECONDS or float(np.ptp(stamps)) < _BRIEF
    if 0.0 < step < _FASTEST * (1.0 - _ROUNDED) and brief:
        units = {"s": 1.0, **_LONGER}
        likely = [name for name, factor in units.items() if step * factor <= _SLOWEST]
        raise InputError("time_unit_unknown", where=label, column=column, step=step, units=likely)
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
