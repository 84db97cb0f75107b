"""Prepare a log for estimation, once, whatever is estimated from it.

Wrapped angles are continued, glitches and steps of the position repaired, clipped efforts marked,
and time stamps evened out. Everything that is done is counted and stated.
"""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.signals.kinematics import noise_level
from stickslip.estimation.signals.resampling import resampled
from stickslip.estimation.signals.sensor_noise import encoder_step
from stickslip.records import AxisLog, count_of

__all__ = ["PreparationTuning", "PreparedLog", "PreparedPart", "prepare"]


@dataclass(frozen=True, kw_only=True)
class PreparationTuning:
    """Tuning of what counts as a defect of a log."""

    shortest_part: int = 20
    """Samples of a stretch without gaps that can hold a window."""
    wrap_share: float = 0.8
    """Size of a step over the range of the position [-] from which it may be a wrapped angle."""
    glitch_deviations: float = 8.0
    """Deviation from the neighbours, beyond twice their own changes, in standard deviations of the
    second difference [-]: white noise is at most 25 standard deviations off then."""
    longest_glitch: int = 3
    """Samples; a longer one is a step there and back."""
    most_glitches: float = 0.05
    """Share of the samples [-] beyond which they are not glitches but the signal."""
    fewest_levels: int = 20
    """Distinct efforts: with fewer of them, extremes that repeat are how the drive works."""
    most_clipped: float = 0.4
    """Share of the samples [-] at an extreme beyond which the input is switched, not clipped."""


@dataclass(frozen=True, kw_only=True)
class PreparedPart:
    """One stretch without gaps, evenly sampled.

    Attributes
    ----------
    time, effort, position
        [s, N or N m, m or rad], shape (n,).
    usable
        Whether a sample was recorded as it was, shape (n,): clipped and repaired ones are not.
    """

    time: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    usable: Bool[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class PreparedLog:
    """A log with its defects found, repaired where possible, and counted.

    Attributes
    ----------
    log
        Repaired, with its own time stamps.
    parts
        Its stretches without gaps, evenly sampled.
    sampling_time
        [s].
    position_noise
        Standard deviation of the noise of a position, rounding included [m or rad].
    repaired, clipped
        Numbers of samples repaired, and of samples with a clipped effort [-].
    notes
        What was done, one sentence each.
    """

    log: AxisLog
    parts: tuple[PreparedPart, ...]
    sampling_time: float
    position_noise: float
    repaired: int
    clipped: int
    notes: tuple[str, ...]


_DEFAULT = PreparationTuning()


def prepare(log: AxisLog, tuning: PreparationTuning = _DEFAULT) -> PreparedLog:
    """Return a log with its defects found, repaired where possible, and counted.

    Parameters
    ----------
    log
        Of a rigid axis.
    tuning
        What counts as a defect.
    """
    clipped, notes = _clipped(log, tuning)
    log, found = _unwrapped(log, tuning)
    notes += found
    log, repaired, found = _without_glitches(log, tuning)
    notes += found
    even, found = resampled(log)
    notes += found
    spoiled = np.interp(even.time, log.time, (clipped | repaired).astype(float)) > 0.0
    parts: list[PreparedPart] = []
    starts = [*even.segment_starts.tolist(), len(even)]
    for start, stop in pairwise(starts):
        if stop - start >= tuning.shortest_part:
            parts.append(
                PreparedPart(
                    time=even.time[start:stop],
                    effort=even.effort[start:stop],
                    position=even.measured_position[start:stop],
                    usable=~spoiled[start:stop],
                )
            )
    longest = max((part.position for part in parts), key=len, default=np.zeros(0))
    step = max((encoder_step(part.position) for part in parts), default=0.0)
    return PreparedLog(
        log=log,
        parts=tuple(parts),
        sampling_time=even.sampling_time,
        position_noise=max(noise_level(longest), step / float(np.sqrt(12.0))),
        repaired=int(np.sum(repaired)),
        clipped=int(np.sum(clipped)),
        notes=tuple(notes),
    )


def _clipped(log: AxisLog, tuning: PreparationTuning) -> tuple[Bool[np.ndarray, " n"], list[str]]:
    """Mark samples whose effort stays at its largest or smallest value."""
    u = log.effort
    marks = np.zeros(u.size, dtype=bool)
    levels = np.unique(u)
    if levels.size < tuning.fewest_levels:
        return marks, []
    inner = u[(u > levels[0]) & (u < levels[-1])]
    repeats = float(np.mean(inner[1:] == inner[:-1]))  # in coarse steps, or of a slower bus
    notes: list[str] = []
    for extreme in (levels[0], levels[-1]):
        at = u == extreme
        share = float(np.mean(at))
        expected = 5.0 / levels.size + 5.0 * repeats * share
        if np.sum(at[1:] & at[:-1]) >= 3 and share > expected:
            marks |= at
            notes.append(
                f"effort clipped at {extreme:.4g} {log.unit('effort')} in {100 * share:.2g} % of "
                "samples; samples excluded"
            )
    if np.mean(marks) > tuning.most_clipped:
        return np.zeros(u.size, dtype=bool), []
    return marks, notes


def _unwrapped(log: AxisLog, tuning: PreparationTuning) -> tuple[AxisLog, list[str]]:
    """Return the log with an angle continued where it jumps by its period.

    After a wrap the motion goes on from the other end of the range; a glitch returns at once.
    """
    x = log.measured_position
    steps, extent = np.diff(x), float(np.ptp(x))
    jumps = np.flatnonzero(np.abs(steps) > tuning.wrap_share * extent)
    if jumps.size == 0 or np.any(np.diff(jumps) <= tuning.longest_glitch):
        return log, []
    others = np.abs(np.delete(steps, jumps))
    if others.size == 0 or extent < 10.0 * float(np.max(others)):
        return log, []
    turn = 2.0 * np.pi
    is_turn = log.kind == "rotary" and abs(extent / turn - 1.0) < 1.0 - tuning.wrap_share
    if is_turn:
        period = turn
    else:  # the motion within the step of a jump is that of its neighbours
        around = 0.5 * (steps[np.maximum(jumps - 1, 0)] + steps[np.minimum(jumps + 1, len(x) - 2)])
        period = float(np.median(np.abs(steps[jumps] - around)))
    turns = np.zeros(x.size)
    turns[jumps + 1] = -np.sign(steps[jumps])
    note = (
        f"position jumps by {period:.4g} {log.unit('position')} in "
        f"{count_of(jumps.size, 'place')}; unwrapped"
    )
    return replace(log, measured_position=x + period * np.cumsum(turns)), [note]


def _without_glitches(
    log: AxisLog, tuning: PreparationTuning
) -> tuple[AxisLog, Bool[np.ndarray, " n"], list[str]]:
    """Return the log with glitches interpolated and steps of the position taken out."""
    repaired = np.zeros(len(log), dtype=bool)
    notes: list[str] = []
    changed: dict[str, Float[np.ndarray, " n"]] = {}
    for name in ("effort", "measured_position"):
        values = getattr(log, name)
        wild = _glitches(values, tuning)
        if np.any(wild):
            good = np.flatnonzero(~wild)
            changed[name] = np.interp(np.arange(values.size), good, values[good])
            repaired |= wild
            what = name.removeprefix("measured_")
            notes.append(
                f"{count_of(int(wild.sum()), 'sample')} of the {what} excluded as glitches"
            )
    return (replace(log, **changed) if changed else log), repaired, notes


def _glitches(values: Float[np.ndarray, " n"], tuning: PreparationTuning) -> Bool[np.ndarray, " n"]:
    """Mark runs of a few samples that are far off the line through their neighbours."""
    n = values.size
    wild = np.zeros(n, dtype=bool)
    second = np.abs(np.diff(values, 2))
    if second.size < 50:
        return wild
    # Quantiles of the magnitudes of normal values: the one is robust, the other sees coarse steps
    scale = max(float(np.median(second)) / 0.6745, float(np.quantile(second, 0.9)) / 1.645)
    for length in range(1, tuning.longest_glitch + 1):
        at = np.arange(2, n - length - 1)
        before, after = values[at - 1], values[at + length]
        middle = np.stack([values[at + k] for k in range(length)])
        off = middle - 0.5 * (before + after)
        same_side = np.all(np.sign(off) == np.sign(off[0]), axis=0)
        changes = (
            np.abs(after - before)
            + np.abs(before - values[at - 2])
            + np.abs(values[at + length + 1] - after)
        )
        beyond = np.min(np.abs(off), axis=0) - 2.0 * changes
        for k in at[same_side & (beyond > tuning.glitch_deviations * scale)].tolist():
            wild[k : k + length] = True
    return wild if np.mean(wild) <= tuning.most_glitches else np.zeros(n, dtype=bool)
