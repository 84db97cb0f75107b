"""Growth of the breakaway friction with the time that the axis was at rest.

Friction at rest does not enter windows of slip. Each breakaway gives one level: the effort at the
instant at which the axis starts to move, without the forces of the model that act at rest. Static
friction grows with the logarithm of the dwell time (J. H. Dieterich 1972, "Time-dependent friction
in rocks", J. Geophys. Res. 77(20)):

    f_b = f_1 + g log10(t_dwell / 1 s).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float
from scipy.linalg import block_diag
from scipy.special import stdtr, stdtrit

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.selection.evaluation.prediction import effort_at_rest
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.terms import DWELL
from stickslip.estimation.weak_form.motion import SlipMotion, SlipMotions
from stickslip.records import (
    FrictionEstimate,
    ParameterEstimate,
    TermScore,
    Verdict,
    mass_name,
    quantity_name,
)


@dataclass(frozen=True, kw_only=True)
class DwellTuning:
    """Tuning of the breakaways."""

    rest_deviations: float = 5.0
    """Deviation from the position of rest, in standard deviations of the position [-], within which
    the axis may be at rest: noise exceeds it in one of two million samples."""
    before: int = 30
    """Samples before the first detected motion that may contain the breakaway [-]. The mean of as
    many samples before them is the position of rest, so that a rest has twice as many. A mass moves
    by `rest_deviations` in 10 samples of 1 ms if friction drops by 20 % of the effort."""
    after: int = 8
    """Samples of the motion in the fit of the breakaway's instant [-]: friction and effort change
    little in them."""
    trials: int = 4
    """Instants that are tried in a sample [-]; the uncertainty is larger than their distance."""
    slow_power: float = 4.0
    """Power of the time with which the axis moves if friction falls slowly [-]. The difference to
    friction that falls at once widens the interval of the breakaway friction."""
    half_width: int = 5
    """Half of the window of the effort around the breakaway [samples]: the effort is a straight
    line in it."""
    largest_step: float = 6.0
    """Largest step of the effort around the breakaway over the median one, or over the resolution
    [-]: beyond it the effort jumps, and the level within the jump is not known. With noise the
    ratio is 3 to 4."""
    fewest: int = 6  #: Fewest breakaways for a test [-].
    least_spread: float = 2.0
    """Least ratio of the second longest to the second shortest dwell time for a test [-]: one rest
    alone shows no growth."""


@dataclass(frozen=True, kw_only=True)
class Breakaway:
    """The start of a motion after a rest."""

    dwell: float  #: Time at rest [s].
    #: Effort against friction at the breakaway, over the friction of the model at zero speed
    #: [N or N m].
    level: float
    std: float  #: Standard deviation of the level by noise of effort and position [N or N m].


@dataclass(frozen=True, kw_only=True)
class RestedLog:
    """A prepared log with its motion and its estimate."""

    log: PreparedLog
    motions: SlipMotions
    estimate: FrictionEstimate  #: Of this log, with the usual names of all parameters.

    @cached_property
    def resolution(self) -> float:
        """Smallest step of the effort [N or N m]; noise makes it close to zero."""
        steps = np.concatenate([np.abs(np.diff(m.effort)) for m in self.motions.stretches])
        steps = steps[steps > _ROUNDING * np.max(steps, initial=0.0)]
        return float(np.min(steps, initial=np.inf)) if steps.size else 0.0


@dataclass(frozen=True, kw_only=True)
class Rest:
    """A rest between two slips."""

    of: RestedLog
    motion: SlipMotion  #: Stretch of the log.
    samples: slice  #: Of the rest, in the stretch.
    direction: float  #: Sign of the velocity of the slip after it [-].


def breakaways(
    rests: Sequence[Rest], inertia: float, tuning: DwellTuning, power: float = 2.0
) -> list[Breakaway]:
    """Return the breakaways that the sampling resolves, in the order of the rests.

    ``power`` is that of the time with which the axis moves as friction falls [-]: 2 if it falls at
    once. All have a standard deviation above zero.
    """
    every: list[Breakaway] = []
    for rest in rests:
        log, motion, direction = rest.of.log, rest.motion, rest.direction
        instant = _instant(motion, rest.samples, direction, log, inertia, tuning, power)
        if instant is None:
            continue
        resolution, selection = rest.of.resolution, rest.of.estimate.selection
        delay = (0.5 - log.effort_lead) * log.sampling_time
        delay += 0.0 if selection is None else selection.effort_delay
        time, time_std = instant
        since = motion.time + delay - time
        near = np.abs(since) <= tuning.half_width * log.sampling_time
        steps = np.abs(np.diff(motion.effort[near]))
        if steps.size < tuning.half_width or not np.all(motion.usable[near]):
            continue
        if np.max(steps) > tuning.largest_step * max(np.median(steps), resolution):
            continue
        effort, slope, effort_std = _line(since[near], motion.effort[near])
        place = float(motion.position[rest.samples.start])
        at_rest = effort_at_rest(rest.of.estimate, time, place, direction)
        std = float(np.linalg.norm([effort_std, slope * time_std, resolution / np.sqrt(12.0)]))
        if std > 0.0:
            dwell = time - float(motion.time[rest.samples.start])
            level = direction * (effort - at_rest)
            every.append(Breakaway(dwell=dwell, level=level, std=std))
    return every


_ROUNDING = 1e-9  # over the largest step [-]: smaller steps are rounding of numbers


def rests_of(own: RestedLog, tuning: DwellTuning) -> Iterator[Rest]:
    """Yield every rest between two slips of a log."""
    for motion in own.motions.stretches:
        motion = replace(motion, effort=motion.effort - motion.model_effort)  # noqa: PLW2901
        edges = np.flatnonzero(np.diff(motion.direction != 0))
        for before, after in pairwise(edges.tolist()):
            if motion.direction[before] == 0:
                continue
            position = motion.position[before + 1 : after + 2]
            away = np.abs(position - np.median(position))
            rest = np.flatnonzero(away <= tuning.rest_deviations * own.log.position_noise)
            # A rest is one stretch: an axis that creeps or swings is not at rest
            if rest.size >= 2 * tuning.before and rest[-1] - rest[0] + 1 == rest.size:
                samples = slice(before + 1 + int(rest[0]), before + 2 + int(rest[-1]))
                direction = float(motion.direction[after + 1])
                yield Rest(of=own, motion=motion, samples=samples, direction=direction)


def _instant(
    motion: SlipMotion,
    rest: slice,
    direction: float,
    log: PreparedLog,
    inertia: float,
    tuning: DwellTuning,
    power: float,
) -> tuple[float, float] | None:
    """Return the instant of the breakaway and its standard deviation [s]; None if not resolved.

    The position follows x_0 + (u'/m) t^3 / 6 + b t^p from the breakaway on, in the direction of the
    motion: the rise of the effort, and friction that falls at once (p = 2) or as the speed grows
    (p > 2). If the residual shows that this does not hold, the breakaway is in the sample before
    the first detected motion.
    """
    first, onset, last = rest.stop - 2 * tuning.before, rest.stop - 1, rest.stop + tuning.after
    if last > motion.time.size:
        return None
    T = log.sampling_time
    place = np.mean(motion.position[first : onset - tuning.before])
    away = direction * (motion.position[first:last] - place)
    rising = slice(onset - tuning.after, last)
    rise = direction * _line(motion.time[rising] - motion.time[onset], motion.effort[rising])[1]
    trials = motion.time[onset] + T * np.arange(-tuning.before, 2, 1.0 / tuning.trials)
    since = np.maximum(motion.time[first:last] - trials[:, None], 0.0)
    left = away - max(rise, 0.0) / (6.0 * inertia) * since**3
    shape = (since / T) ** power
    size = np.maximum(np.sum(left * shape, axis=1) / np.sum(shape**2, axis=1), 0.0)
    errors = np.sum((left - size[:, None] * shape) ** 2, axis=1)
    noise = max(log.position_noise, float(np.finfo(float).tiny))
    best = int(np.argmin(errors))
    freedom = float(last - first - 2)
    if errors[best] > noise**2 * (freedom + 4.0 * np.sqrt(2.0 * freedom)):
        return float(motion.time[onset]), T
    likely = np.flatnonzero(errors <= errors[best] + (2.0 * noise) ** 2)
    if likely[0] == 0 or likely[-1] == trials.size - 1:
        return None
    return float(trials[best]), 0.25 * T * float(likely[-1] - likely[0] + 1.0) / tuning.trials


def _line(
    time: Float[np.ndarray, " n"], effort: Float[np.ndarray, " n"]
) -> tuple[float, float, float]:
    """Return value and slope of the line through efforts, at time zero, and the value's std."""
    columns = np.column_stack([np.ones(time.size), time])
    values = least_squares(columns, effort)
    rest = effort - columns @ values
    variance = float(rest @ rest) / max(time.size - 2, 1)
    share = float(np.linalg.inv(columns.T @ columns)[0, 0])
    return float(values[0]), float(values[1]), float(np.sqrt(variance * share))


@dataclass(frozen=True, kw_only=True)
class _Line:
    """Levels over the logarithm of dwell times, each with a variance of its own."""

    # Level at 1 s and growth in a decade; of a constant the level alone [SI]
    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]  # of the values [SI]
    residual: Float[np.ndarray, " n"]  # of each row divided by its standard deviation [-]
    leverage: Float[np.ndarray, " n"]  # of each row [-]

    @classmethod
    def of(
        cls, columns: Float[np.ndarray, "n p"], level: Float[np.ndarray, " n"], std: np.ndarray
    ) -> "_Line":
        """Fit the levels by weighted least squares."""
        rows, target = columns / std[:, None], level / std
        inverse = np.linalg.inv(rows.T @ rows)
        values = inverse @ (rows.T @ target)
        return cls(
            values=values,
            covariance=inverse,
            residual=target - rows @ values,
            leverage=np.sum((rows @ inverse) * rows, axis=1),
        )

    @property
    def left_out(self) -> Float[np.ndarray, " n"]:
        """Return the squared error of each row in the fit to all the others [-]."""
        return (self.residual / (1.0 - self.leverage)) ** 2


def _growth(found: Sequence[Breakaway]) -> tuple[_Line, float, float, float]:
    """Return the line through the levels, its p-value, and gain and gain's std beyond a constant.

    Besides their noise, all levels have a common scatter, estimated by the method of moments (R.
    DerSimonian and N. Laird 1986, "Meta-analysis in clinical trials", Controlled Clinical Trials
    7).
    """
    level, std = (np.array([getattr(each, name) for each in found]) for name in ("level", "std"))
    columns = np.column_stack([np.ones(level.size), np.log10([each.dwell for each in found])])
    freedom = level.size - 2
    line = _Line.of(columns, level, std)
    beyond = float(line.residual @ line.residual) - freedom
    scatter = max(beyond / float(np.sum((1.0 - line.leverage) / std**2)), 0.0)
    std = np.sqrt(std**2 + scatter)
    line = _Line.of(columns, level, std)
    excess = max(float(line.residual @ line.residual) / freedom, 1.0)
    line = replace(line, covariance=line.covariance * excess)
    t = float(line.values[1] / np.sqrt(line.covariance[1, 1]))
    without = _Line.of(columns[:, :1], level, std).left_out
    gains = (without - line.left_out) / max(float(np.sum(without)), float(np.finfo(float).tiny))
    spread = float(np.sqrt(level.size) * np.std(gains, ddof=1))
    return line, float(2.0 * stdtr(freedom, -abs(t))), float(np.sum(gains)), spread


def with_dwell(
    estimate: FrictionEstimate,
    logs: Sequence[RestedLog],
    search: SearchTuning,
    tuning: DwellTuning,
    *,
    inertia: float | None,
    include: bool,
) -> tuple[FrictionEstimate, TermScore | None]:
    """Add the breakaway friction and its growth to an estimate, if the growth is significant.

    A known ``inertia`` is used in place of the estimated one; ``include`` adds the term without a
    test. Returns the estimate and the score of the term. If the logs have no breakaways to test it
    with, the score is None; a note states the reason if the term was to be included.
    """
    if not all(each.identified for name, each in estimate.parameters.items() if _at_rest(name)):
        return _without_dwell(estimate, "a parameter is not identified", include=include), None
    if "presliding_friction" in estimate.parameters:
        return _without_dwell(estimate, "presliding hides the breakaways", include=include), None
    moved = estimate.value(mass_name(estimate.kind)) if inertia is None else inertia
    rests = [rest for own in logs for rest in rests_of(own, tuning)]
    every = breakaways(rests, moved, tuning)
    dwell = sorted(each.dwell for each in every)
    if len(every) < tuning.fewest or dwell[-2] < tuning.least_spread * dwell[1]:
        reason = "there are too few breakaways after rests of different length"
        return _without_dwell(estimate, reason, include=include), None
    line, p_value, gain, gain_std = _growth(every)
    grows = (
        bool(line.values[1] > 0.0)
        and bool(np.mean([each.level for each in every]) > 0.0)  # above the friction of slow motion
        and p_value < search.largest_p_value
        and gain > max(search.fewest_deviations * gain_std, search.smallest_gain)
    )
    score = TermScore(
        term=DWELL,
        text="the breakaway friction grows with the time at rest",
        selected=include or grows,
        p_value=p_value,
        gain=gain,
        gain_std=gain_std,
        share=0.0,
    )
    if not score.selected:
        return estimate, score
    slowly = breakaways(rests, moved, tuning, tuning.slow_power)
    if len(slowly) < tuning.fewest:
        reason = "too few breakaways are resolved if friction falls slowly"
        return _without_dwell(estimate, reason, include=include), None
    slow, *_ = _growth(slowly)
    # All levels shift alike
    shift = np.diag([float(slow.values[0] - line.values[0]) ** 2, 0.0])
    line = replace(line, covariance=line.covariance + shift)
    return _with_breakaway(estimate, logs[0].estimate, line, dwell), score


def _with_breakaway(
    estimate: FrictionEstimate, first: FrictionEstimate, line: _Line, dwell: Sequence[float]
) -> FrictionEstimate:
    """Return an estimate with the parameters of the line through the levels.

    The levels are over the effort at rest of the estimate ``first``; ``dwell`` are the dwell times
    in increasing order [s].
    """
    known = first.selection
    time, place = (0.0, 0.0) if known is None else (known.reference_time, known.reference_position)
    at_rest = [effort_at_rest(first, time, place, way) for way in (1.0, -1.0)]
    values = line.values + np.array([0.5 * (at_rest[0] - at_rest[1]), 0.0])
    stds = np.sqrt(np.diag(line.covariance))
    quantile = -float(stdtrit(len(dwell) - 2, 0.025))
    added = {
        name: ParameterEstimate(
            name=name,
            value=value,
            std=std,
            ci95=(value - quantile * std, value + quantile * std),
            unit=estimate.unit(name),
        )
        for name, value, std in zip(
            ("breakaway_friction", "breakaway_growth"), values.tolist(), stds.tolist(), strict=True
        )
    }
    reason = f"{len(dwell)} rests of {dwell[0]:.2g} to {dwell[-1]:.2g} s determine it"
    verdicts = [Verdict(parameter=name, identifiable=True, reason=reason) for name in added]
    diagnostics = estimate.diagnostics
    return replace(
        estimate,
        parameters={**estimate.parameters, **added},
        covariance=block_diag(estimate.covariance, line.covariance),
        diagnostics=replace(diagnostics, verdicts=(*diagnostics.verdicts, *verdicts)),
    )


def _at_rest(name: str) -> bool:
    """Return whether the effort at rest depends on a parameter."""
    return quantity_name(name) not in {"effort_delay", "elasticity", "ripple_period"}


def _without_dwell(estimate: FrictionEstimate, reason: str, *, include: bool) -> FrictionEstimate:
    """Return the estimate, with a note if the term was to be included."""
    if not include:
        return estimate
    notes = (*estimate.diagnostics.notes, f"the term {DWELL!r} is left out: {reason}")
    return replace(estimate, diagnostics=replace(estimate.diagnostics, notes=notes))
