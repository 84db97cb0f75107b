"""Time stamps that jitter although the samples are even.

A drive samples by its clock. A host that stamps each record when it arrives adds the varying time
of the transport.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from numpy.lib.stride_tricks import sliding_window_view

from stickslip.estimation.signals.resampling import SMALLEST_JITTER
from stickslip.records import GAP_RATIO, AxisLog


@dataclass(frozen=True, kw_only=True)
class ArrivalTuning:
    """Tuning of the test for time stamps of arrival."""

    largest_error_ratio: float = 0.5
    """Largest error with even times over that with the time stamps [-]. Logs with time stamps of
    arrival have 0 to 0.07, public logs with others 0.97 and more."""
    largest_growth: float = 25.0
    """Largest spread of the duration of ``period_span`` steps over that of one [-]. The error of a
    time stamp of arrival does not last: it is 1 to 4 in simulated logs, and 17 where a public one
    has lost many records. Public logs whose steps have two sizes have 13 to 98; that of which the
    positions alone are as near to even times has 37 and more."""
    share: float = 0.1
    """Share of the samples that are compared [-]: those where speed and uneven steps make the
    largest difference."""
    fewest: int = 50  #: Fewest compared samples [-].
    least_spread: float = 1.5
    """Ratio of the 90 % to the 10 % quantile of the steps of the position [-], below which the log
    may have one record for each change of the position."""
    period_span: int = 100
    """Fewest samples between the time stamps whose difference gives a first period [-], of which
    the error is the jitter over this number."""
    spans: int = 20  #: Such differences that fit into the log one after another, at most [-].
    beside_gap: int = 100
    """Samples on either side of a gap [-], whose median deviations differ by what is missing. A
    slow transport shifts a few time stamps only."""
    moving: float = 0.05  #: Least speed of a moving axis over the 95 % quantile [-].
    fewest_of_move: int = 20
    """Samples of a move that measures the rate [-]: jitter is small beside its duration."""


def with_even_time(log: AxisLog, tuning: ArrivalTuning) -> tuple[AxisLog, list[str]]:
    """Return a log with even time stamps if its samples are even, and notes.

    A line through the two samples beside it predicts each position, once with the time stamps and
    once with even times. The smaller error shows which of them are the times of the samples. Steps
    that are large by the time stamps and not by even times are compared on their own. A log is
    returned as it is if its time stamps are even, or are those of the samples. They are if the
    deviations from even times add up: those of arrival do not.
    """
    steps = np.diff(log.time)
    if np.ptp(steps) <= SMALLEST_JITTER * np.mean(steps):
        return log, []
    sizes = np.abs(np.diff(log.measured_position))
    sizes = sizes[sizes > 0.0]
    if len(log) < 2 * tuning.fewest or sizes.size < tuning.fewest or _grows(log.time, tuning):
        return log, []
    if np.quantile(sizes, 0.9) < tuning.least_spread * np.quantile(sizes, 0.1):
        return log, []
    stamps, position = (sliding_window_view(x, 3) for x in (log.time, log.measured_position))
    stamp_share = (stamps[:, 1] - stamps[:, 0]) / (stamps[:, 2] - stamps[:, 0])
    change = position[:, 2] - position[:, 0]
    moved = position[:, 1] - position[:, 0]
    uneven = np.abs(stamp_share - 0.5)
    lever = np.where(uneven > SMALLEST_JITTER, uneven * np.abs(change), 0.0)
    count = max(tuning.fewest, int(tuning.share * lever.size))
    compared = np.argsort(lever)[-count:]

    def even_is_better(windows: np.ndarray) -> bool:
        even, stamped = (
            float(np.median(np.abs((moved - share * change)[windows])))
            for share in (0.5, stamp_share)
        )
        return even < tuning.largest_error_ratio * stamped

    if np.min(lever[compared]) <= 0.0 or not even_is_better(compared):
        return log, []
    found, period = _even(log.time, tuning)
    step, even_step = (
        np.max(sliding_window_view(np.diff(t), 2), axis=1) for t in (log.time, found)
    )
    closed = (step > GAP_RATIO * period) & (even_step < GAP_RATIO * period) & (lever > 0.0)
    if closed.any() and not even_is_better(closed):
        return log, []
    note = (
        f"the samples are even, every {1e3 * period:.4g} ms, but their time stamps deviate by up "
        f"to {1e3 * float(np.max(np.abs(found - log.time))):.3g} ms, as times of arrival do; even "
        "times are used; log the time of the sample instead"
    )
    return replace(log, time=found), [note]


def _grows(time: Float[np.ndarray, " n"], tuning: ArrivalTuning) -> bool:
    """Return whether the deviations from even steps add up far beyond those of one step.

    They are compared twice, with whole periods left out as well, as records may be lost. Spreads
    are between the 5 % and 95 % quantiles, so that a slow transport does not count.
    """
    span = min(tuning.period_span, time.size // 4)
    period = float(np.median(time[span:] - time[:-span])) / span
    steps = np.diff(time)
    growths = []
    for whole in (0.0, np.round(steps / period)):
        errors = np.cumsum(steps - period * whole)
        long, short = (
            np.ptp(np.quantile(errors[k:] - errors[:-k], [0.05, 0.95])) for k in (span, 1)
        )
        growths.append(long > tuning.largest_growth * short)
    return all(growths)


def at_rate_of(log: AxisLog, stamps: Float[np.ndarray, " n"], tuning: ArrivalTuning) -> AxisLog:
    """Scale restored times to the rate of the time stamps of arrival [s] during motion.

    The log has even times, shifted where records are lost. Records that are lost at rest are not
    seen, and change the rate.
    """
    speed = np.abs(np.gradient(log.measured_position, log.time))
    moving = speed > tuning.moving * np.quantile(speed, 0.95)
    edges = [0, *(np.flatnonzero(np.diff(moving)) + 1).tolist(), moving.size]
    moves = [
        slice(a, b) for a, b in pairwise(edges) if moving[a] and b - a >= tuning.fewest_of_move
    ]
    if not moves:
        return log
    times, arrivals = (
        np.concatenate([x[move] - np.mean(x[move]) for move in moves]) for x in (log.time, stamps)
    )
    rate = float(times @ arrivals / (times @ times))
    return replace(log, time=log.time[0] + rate * (log.time - log.time[0]))


def _even(
    time: Float[np.ndarray, " n"], tuning: ArrivalTuning
) -> tuple[Float[np.ndarray, " n"], float]:
    """Return even times with the gaps of the time stamps, at their median, and the period."""
    count = np.arange(time.size, dtype=float)
    span = min(max(tuning.period_span, time.size // tuning.spans), time.size - 1)
    first = float(np.median(time[span:] - time[:-span])) / span
    gaps = _gaps(time, first, tuning.beside_gap)
    numbers, stamps = (
        np.concatenate([part - part.mean() for part in np.split(each, list(gaps))])
        for each in (count, time)
    )
    period = float(numbers @ stamps / (numbers @ numbers))
    found = period * count
    for start, missing in gaps.items():
        found[start:] += missing
    return found + np.median(time - found), period


def _gaps(time: Float[np.ndarray, " n"], period: float, beside: int) -> dict[int, float]:
    """Return the first sample after each gap, in order, and the time that is missing there [s].

    A gap shifts all later time stamps; a slow transport shifts a few.
    """
    excess = time - period * np.arange(time.size)
    shift: dict[int, float] = {}
    for k in np.flatnonzero(np.diff(time) > GAP_RATIO * period) + 1:
        before, after = excess[max(k - beside, 0) : k], excess[k : k + beside]
        shift[int(k)] = float(np.median(after) - np.median(before))
    gaps: dict[int, float] = {}
    for k in sorted(shift, key=shift.__getitem__, reverse=True):
        if shift[k] > GAP_RATIO * period and all(abs(k - other) >= beside for other in gaps):
            gaps[k] = shift[k]
    return dict(sorted(gaps.items()))
