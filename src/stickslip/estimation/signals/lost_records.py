"""Records that are missing in a log although its time stamps are even."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.signals.resampling import SMALLEST_JITTER
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import GAP_RATIO, AxisLog, count_of


@dataclass(frozen=True, kw_only=True)
class LostRecordTuning:
    """Tuning of the search for lost records."""

    least_ratio: float = 1.6
    """Step of the position over those around it [-], from which records may be lost in it."""
    whole: float = 0.25
    """Largest deviation of such a ratio from a whole number [-]: half of the ratios of other jumps
    deviate more."""
    certain: float = 0.08  #: Standard deviation of a ratio [-], below which its deviation counts.
    alike: float = 0.3
    """Relative deviation of a step from the median of three [-], up to which the axis moves evenly
    there: no motion doubles its speed for one sample only."""
    fewest: int = 4
    """Fewest places where records are lost [-]: fewer cause small errors, and a few ratios are
    whole by chance."""
    arrival: bool = False
    """Whether the times are even in place of those of arrival: they may have gaps, and steps of
    them as well show where records are lost, so that one place is enough."""
    most_others: float = 0.1
    """Other uneven steps over the places with whole ratios [-]: a position that is delayed by a
    sample in places has as many short steps as long ones."""


def with_lost_time(log: AxisLog, tuning: LostRecordTuning) -> tuple[AxisLog, list[str]]:
    """Return a log whose time stamps have steps where records are lost, and notes on them.

    Time stamps that were counted, and not measured, are even across lost records. The position then
    steps by a whole multiple of the steps around it. A log is returned as it is if its time stamps
    jitter, if they have gaps without being those of arrival, or if no records are lost.
    """
    T, x = log.sampling_time, log.measured_position
    steps = np.diff(x)
    measured = log.segment_starts.size > 1 and not tuning.arrival
    if log.timing_jitter >= SMALLEST_JITTER or measured or steps.size < _FEWEST_STEPS:
        return log, []
    before, after = _medians(steps, tuning.alike)
    inner = steps[_BESIDE:-_BESIDE]
    usual = 0.5 * (before + after)
    noise = position_noise(x)
    # Steps close to zero make ratios overflow; they are not certain
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        ratios = np.where((before * after > 0.0), inner / usual, 0.0)
        stds = noise * np.hypot(np.sqrt(2.0), _OF_MEDIANS * ratios)
        stds = stds / np.maximum(np.abs(usual), np.finfo(float).tiny)
        certain = stds < tuning.certain
        lost = certain & (ratios > tuning.least_ratio) & np.isfinite(ratios)
        whole = lost & (np.abs(ratios - np.rint(ratios)) < tuning.whole)
    short = certain & (before * after > 0.0) & (ratios < 1.0 / tuning.least_ratio)
    one = (np.diff(log.time) < GAP_RATIO * T)[_BESIDE:-_BESIDE]
    whole, lost, short = whole & one, lost & one, short & one
    places, others = int(np.sum(whole)), int(np.sum(lost & ~whole) + np.sum(short))
    if places < (1 if tuning.arrival else tuning.fewest) or others > tuning.most_others * places:
        return log, []
    missing = np.zeros(len(log))
    missing[_BESIDE + 1 : -_BESIDE][lost] = np.rint(ratios[lost]) - 1.0
    records, gaps = int(np.sum(missing)), int(np.sum(lost))
    note = (
        f"{count_of(records, 'record')} missing in {count_of(gaps, 'place')}, where the position "
        "moves by several steps at once"
    )
    if tuning.arrival:
        note += "; later samples are shifted"
    else:
        note += (
            ", although the time stamps are even; later time stamps are shifted; record the time "
            "stamps as measured"
        )
    return replace(log, time=log.time + T * np.cumsum(missing)), [note]


_FEWEST_STEPS = 20  # of a log [-]: with fewer, few steps have enough others on either side
_BESIDE = 3  # steps on either side that are compared [-]
_OF_MEDIANS = 0.5  # standard deviation of the mean of their medians over that of a position [-]


def _medians(
    steps: Float[np.ndarray, " n"], alike: float
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
    """Return the medians of three steps before and after each inner one; 0 where they differ."""
    three = np.lib.stride_tricks.sliding_window_view(steps, _BESIDE)
    median = np.median(three, axis=1)
    even = np.sum(np.abs(three - median[:, None]) <= alike * np.abs(median)[:, None], axis=1) > 1
    median = np.where(even, median, 0.0)
    return median[: -_BESIDE - 1], median[_BESIDE + 1 :]
