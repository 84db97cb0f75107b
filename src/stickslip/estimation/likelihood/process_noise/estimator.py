"""Maximum likelihood of a rigid axis with process noise."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.estimation.fit.diagnostics import (
    condition_number,
    determined,
    status_of,
    verdicts_of,
)
from stickslip.estimation.fit.fitted import Fit, RowsEstimator
from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import check_excited, provenance_of, solve
from stickslip.estimation.likelihood.process_noise import search, uncertainty
from stickslip.estimation.likelihood.process_noise.problem import (
    LogPart,
    Problem,
    Tuning,
    effort_residual,
    first_guess,
    problem_of,
)
from stickslip.estimation.likelihood.process_noise.search import Evaluation, Maximum
from stickslip.estimation.likelihood.process_noise.uncertainty import Comparison, Intervals
from stickslip.estimation.prepare import PreparedLog, prepare
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.model_rows import width_slope
from stickslip.estimation.selection.terms import DELAY, DIRECTION, ELASTIC, SATURATION
from stickslip.estimation.settings import check_given, options_of
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.resampling import resampled
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.estimation.weak_form.motion import SlipMotion
from stickslip.estimation.weak_form.rows import Column
from stickslip.estimation.weak_form.windows import convolved
from stickslip.friction import FrictionTerms
from stickslip.records import (
    AxisKind,
    AxisLog,
    Diagnostics,
    FrictionEstimate,
    ParameterEstimate,
    Status,
    Verdict,
    count_of,
    mass_name,
    positive,
    whole,
)

_DELAY = "effort_delay"
_LOW_SPEED = {"stribeck_excess", "low_speed_friction", "presliding_friction"}


class _Candidate(NamedTuple):
    """The estimate from one band of frequencies."""

    problem: Problem
    maximum: Maximum
    rows: Regression  # the normalised innovations at the maximum
    intervals: Intervals  # of all parameters sought, the delay among them
    comparison: Comparison | None  # with the selection's estimate
    reliable: bool  # whether the model holds at all frequencies, so far as innovations show

    @property
    def agrees(self) -> bool:
        """Whether the estimate is that of the selection within chance."""
        return self.comparison is None or not self.comparison.causes

    @property
    def width(self) -> float:
        """Sum of the logarithms of the intervals' halves."""
        return float(np.sum(np.log(np.maximum(self.intervals.half, 1e-300))))


class _Selected(NamedTuple):
    """Terms that the selection found, and the samples that may be used."""

    per_direction: bool
    delay: float  # of the effort [samples]
    load_names: tuple[str, ...]  # of the coefficients of further terms
    columns: list[tuple[Bool[np.ndarray, " n"], Float[np.ndarray, "n l"]]]
    """Of each part, which samples may be used, and the columns of these terms [SI]."""
    estimate: FrictionEstimate | None


@dataclass(frozen=True, kw_only=True)
class ProcessNoiseLikelihoodEstimator(RowsEstimator):
    """Maximum likelihood with noise on the logged effort, disturbance forces and sensor noise.

    The log may come from a closed loop. A Kalman filter follows the axis through every stretch in
    which it surely slips in one direction, with position, velocity, disturbance force and the true
    effort as states; logged position and logged effort are two measurements. Noise of the log and
    forces on the axis are thus separated by their effect: a force moves the axis. The noise
    levels (sensor noise with quantisation, effort noise, white and autoregressive forces, and the
    roughness of the effort) are estimated by restricted maximum likelihood beside the parameters.

    It has no static friction, Stribeck effect or flexible arm: samples near rest and reversal are
    left out.

    Attributes
    ----------
    inertia
        Mass or inertia if it is known [kg or kg m^2]; None estimates it.
    per_direction
        Whether Coulomb and viscous friction are estimated for each direction.
    offset
        Whether a constant offset is estimated; None estimates it unless ``per_direction``.
    largest_delay
        Delays of the effort of up to so many samples, of either sign and with fractions, are
        estimated; 0 estimates one only if the selection finds one.
    select
        Whether the terms that `SelectedModelEstimator` finds in the log (a load, friction of
        another form, a delay of the effort) are part of the model, with their shapes as found.
    tuning
        Tuning constants.

    Raises
    ------
    InputError
        If a setting is out of range, or offset and per_direction are both requested.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import Sensors, simulate
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0)
    >>> effort = 9.0 * np.sin(np.arange(2000) * 0.02)
    >>> motion = simulate(SingleMass(mass=1.5, friction=law), effort, sampling_time=0.005)
    >>> log = Sensors(encoder_step=1e-5, velocity="none").measure(motion)
    >>> estimate = ProcessNoiseLikelihoodEstimator().fit(log)
    >>> [round(estimate.value(name), 2) for name in ("mass", "coulomb_friction")]
    [1.5, 2.0]
    """

    inertia: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    largest_delay: int = 0
    select: bool = True
    tuning: Tuning = Tuning()
    name: ClassVar[str] = "maximum-likelihood-process-noise"

    def __post_init__(self) -> None:
        check_given(self, positive, {"inertia": "kg or kg m^2"})
        whole("largest_delay", self.largest_delay, unit="samples")
        _ = self.terms  # checks that offset and per_direction go together

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(per_direction=self.per_direction, offset=self.offset)

    def names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of the parameters of an axis of a kind, in the covariance's order."""
        return (*(() if self.inertia is not None else (mass_name(kind),)), *self.terms.names)

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report."""
        check_excited(log)
        prepared = prepare(replace(log, measured_velocity=None))
        if not prepared.parts:
            return self._nothing(log, prepared.notes)
        velocities, wrong = _velocities(log, prepared)
        found = self._selected(prepared)
        parts = [
            LogPart(
                time=part.time,
                effort=part.effort,
                position=part.position,
                usable=part.usable & usable,
                velocity=velocity,
                loads=loads,
            )
            for part, velocity, (usable, loads) in zip(
                prepared.parts, velocities, found.columns, strict=True
            )
        ]
        offset = None if found.per_direction else self.offset
        names = replace(self, per_direction=found.per_direction, offset=offset).names(log.kind)
        delay = (_DELAY,) if self.largest_delay or found.delay else ()
        known = {} if self.inertia is None else {mass_name(log.kind): self.inertia}

        def averaged(samples: int) -> Problem | None:
            return problem_of(
                parts,
                log.kind,
                prepared.sampling_time,
                sought=(*names, *delay, *found.load_names),
                known=known,
                tuning=self.tuning,
                averaged=samples,
            )

        notes = (*prepared.notes, *wrong)
        problem = averaged(1)
        if problem is None or problem.innovations < self.tuning.fewest_innovations:
            return self._nothing(log, notes)
        whole = best = self._candidate(log, problem, found)
        if found.estimate is not None and not (whole.reliable and whole.agrees):
            candidates, samples = [whole], self.tuning.averaging_ratio
            while (slower := averaged(samples)) is not None:
                least = self.tuning.least_share * problem.innovations / samples
                if slower.innovations < max(least, self.tuning.fewest_means):
                    break
                candidates.append(self._candidate(log, slower, found))
                samples *= self.tuning.averaging_ratio
            agreeing = [each for each in candidates if each.agrees]
            best = min(agreeing, key=lambda each: each.width, default=whole)
        return self._estimate(log, best, notes, found)

    def _selected(self, log: PreparedLog) -> _Selected:
        """Return what the selection of terms finds in a log."""
        unselected = [(part.usable, np.zeros((part.time.size, 0))) for part in log.parts]
        nothing = _Selected(self.per_direction, 0.0, (), unselected, None)
        if not self.select:
            return nothing
        estimator = SelectedModelEstimator(
            inertia=self.inertia,
            offset=self.per_direction or self.terms.offset,
            include=(DIRECTION,) if self.per_direction else (),
        )
        fit = estimator.fit_prepared(log)
        model = fit.model
        if model is None or model.inertia != self.inertia:  # the given inertia is wrong
            return nothing._replace(estimate=fit.estimate)
        loads = _loads(model, fit.estimate)
        columns = [
            (
                motion.usable & (motion.direction != 0),
                np.column_stack(
                    [np.zeros((motion.time.size, 0))]
                    + [column(motion) for column in loads.values()]
                ),
            )
            for motion in model.rows.motions
        ]
        per_direction = DIRECTION in model.names
        return _Selected(per_direction, model.rows.delay, tuple(loads), columns, fit.estimate)

    def _candidate(self, log: AxisLog, problem: Problem, found: _Selected) -> _Candidate:
        """Return the maximum of the likelihood for a log, or for means of its samples."""
        largest = -(-self.largest_delay // problem.averaged)
        delays = range(-largest, largest + 1)
        if not largest:
            delays = (round(found.delay / problem.averaged),)
        # Jumps of the effort first, on the way: they hide where the maximum is
        tuning, maximum = self.tuning, None
        values = first_guess(problem, delays)
        for _ in range(tuning.jump_passes):
            most = tuning.jump_iterations
            maximum = search.maximise(problem, values, tuning, maximum, most=most, first=True)
            marked = search.with_jumps(problem, maximum, tuning.largest_effort_innovation)
            if marked is None:
                break
            problem, values = marked, maximum.values
        most = tuning.max_iterations
        maximum = search.maximise(problem, values, tuning, maximum, most=most)
        innovations = search.evaluate(problem, maximum.values, maximum.levels, with_rows=True)
        rows = _regression(log, problem, maximum, innovations)
        intervals = uncertainty.intervals_of(problem, maximum, innovations, rows, tuning)
        reliable = problem.averaged == 1 and intervals.growth <= tuning.tolerated_widening
        comparison = None
        if found.estimate is not None:
            std = np.sqrt(np.diag(intervals.covariance))
            comparison = uncertainty.compare_with_windows(
                dict(zip(rows.names, maximum.values.tolist(), strict=True)),
                dict(zip(rows.names, std.tolist(), strict=True)),
                found.estimate,
                tuning.disagreement_level,
            )
            # Shapes of terms have errors of their own, of which the likelihood has no account
            if found.load_names or not reliable:
                differences = [comparison.differences.get(name, 0.0) for name in rows.names]
                intervals = intervals.widened(np.array(differences))
        if not set(found.load_names) & _LOW_SPEED:
            shift = uncertainty.shift_by_low_speed(problem, maximum, tuning)
            intervals = intervals if shift is None else intervals.widened(shift)
        return _Candidate(problem, maximum, rows, intervals, comparison, reliable)

    def _estimate(
        self, log: AxisLog, candidate: _Candidate, notes: tuple[str, ...], found: _Selected
    ) -> Fit:
        """Return the estimate at the maximum, with intervals, verdicts and status."""
        problem, maximum, rows, intervals, comparison, _ = candidate
        sought = problem.sought.names
        # The delay is a diagnostic, and the size of a Stribeck effect a difference of two forces
        names = [name for name in sought if name != _DELAY and not name.endswith(_NOT_REPORTED)]
        at = np.array([sought.index(name) for name in names])
        values = maximum.values[at]
        independent = determined(
            rows.regressors, rows.regressor_noise, rows.smallest_singular_ratio
        )
        mask = independent.mask(len(sought))[at]
        every = verdicts_of(rows, independent)
        verdicts = [every[k] for k in at]
        covariance, half_width = intervals.covariance[np.ix_(at, at)], intervals.half[at]
        unsure = set() if comparison is None or intervals.white else set(comparison.unshared)
        withheld = dict.fromkeys(
            unsure, "the innovations are not white, and slow motion alone does not determine it"
        )
        parameters: dict[str, ParameterEstimate] = {}
        for k, name in enumerate(names):
            half, value = float(half_width[k]), float(values[k])
            if name == problem.mass_name and half > abs(value):
                withheld[name] = "half of its 95 % interval exceeds the value itself"
            if mask[k] and name in withheld:
                mask[k] = False
                verdicts[k] = Verdict(parameter=name, identifiable=False, reason=withheld[name])
            parameters[name] = ParameterEstimate(
                name=name,
                value=value if mask[k] else None,
                std=float(np.sqrt(covariance[k, k])) if mask[k] else None,
                ci95=(value - half, value + half) if mask[k] else None,
                unit=log.unit(name),
            )
        relative = effort_residual(problem, maximum.values)
        status, causes = _status(candidate, parameters, relative, found.estimate)
        classical = intervals.classical[at]
        shares = classical**2 / np.diag(covariance)
        residual = rows.target - rows.regressors @ maximum.values
        delay = None
        if _DELAY in sought:
            seconds = maximum.values[sought.index(_DELAY)]
            delay = round(seconds * problem.averaged / problem.sampling_time)
        estimate = FrictionEstimate(
            estimator=self.name,
            kind=log.kind,
            parameters=parameters,
            covariance=covariance[np.ix_(mask, mask)],
            status=status,
            diagnostics=Diagnostics(
                relative_residual=relative,
                cross_validation_residual=None,
                condition_number=condition_number(rows.regressors),
                residual_autocorrelation=float(autocorrelation(residual, 1)[1]),
                effective_samples=float(problem.innovations * np.min(shares)),
                classical_std={n: float(classical[k]) for k, n in enumerate(names) if mask[k]},
                samples=len(log),
                verdicts=tuple(verdicts),
                notes=(*causes, *notes, *_noise_notes(log, candidate), *intervals.notes),
                effort_delay=delay,
            ),
            provenance=provenance_of(log, options_of(self)),
            selection=None if found.estimate is None else found.estimate.selection,
        )
        return Fit(estimate=estimate, rows=_only(rows, at, maximum.values), inertia=self.inertia)

    def _nothing(self, log: AxisLog, notes: tuple[str, ...]) -> Fit:
        """Return the estimate from a log in which the axis hardly slips, without rows."""
        names, motion = self.names(log.kind), log.measured_position
        rows = Regression(
            kind=log.kind,
            names=names,
            time=np.empty(0),
            target=np.empty(0),
            regressors=np.empty((0, len(names))),
            regressor_noise=np.zeros(len(names)),
            quantity="position",
            # No motion stands out of its noise
            motion=summarise_motion(
                [motion], [np.gradient(motion, log.time)], log.sampling_time, (np.inf, 0.0)
            ),
            samples=len(log),
            notes=notes,
        )
        provenance = provenance_of(log, options_of(self))
        estimate = solve(rows, estimator=self.name, provenance=provenance)
        return Fit(estimate=estimate, rows=rows, inertia=self.inertia)


def _loads(model: Model, estimate: FrictionEstimate) -> dict[str, Column]:
    """Return the columns of the terms of a selected model, by name of their coefficients.

    A shape that the log determines (a Stribeck velocity, the period of a ripple) has a column too:
    the derivative of the effort, whose coefficient is the change of the shape. Intervals without it
    would be those of a known shape.
    """
    loads: dict[str, Column] = {}
    for term, shape in model.chosen:
        if term.name in {DELAY, SATURATION, DIRECTION}:
            continue
        if term.name == ELASTIC:
            taps = model.rows.weight.fourth()
            loads["elasticity"] = partial(_fourth_derivative, taps=taps)
            continue
        stribeck = term.name == "stribeck"
        loads |= dict(
            zip(("stribeck_excess",) if stribeck else shape.names, shape.columns, strict=True)
        )
        sizes = model.coefficients(term.name)
        if term.name in {"stribeck", "low speed"}:
            velocity = "stribeck_velocity" if stribeck else "low_speed_velocity"
            change = velocity, _scaled(float(sizes[0]), width_slope(shape.value))
        elif shape.slope is not None:
            change = shape.slope[0], shape.slope[1](sizes)
        else:
            continue
        found = estimate.parameters.get(change[0])
        if found is not None and found.identified:
            loads[f"{change[0]}{_CHANGE}"] = change[1]
    return loads


def _fourth_derivative(
    motion: SlipMotion, *, taps: Float[np.ndarray, " k"]
) -> Float[np.ndarray, " n"]:
    """Return the fourth derivative of the position [m/s^4 or rad/s^4]."""
    return convolved(motion.position - motion.position[0], taps)


def _scaled(size: float, column: Column) -> Column:
    """Return a column times a number."""
    return lambda motion: size * column(motion)


_CHANGE = "_change"  # end of the name of the change of a shape from its value in the selection
_NOT_REPORTED = ("_excess", _CHANGE)
"""Ends of the names of coefficients that are no parameters of the axis."""


def _status(
    candidate: _Candidate,
    parameters: Mapping[str, ParameterEstimate],
    relative_residual: float,
    selected: FrictionEstimate | None,
) -> tuple[Status, tuple[str, ...]]:
    """Return the status of the estimate, and the causes of a mismatch that are known."""
    status = status_of(list(parameters.values()), relative_residual, None, candidate.rows)
    if selected is None:
        mismatch = status is Status.OK and not candidate.reliable
        return Status.MODEL_MISMATCH if mismatch else status, ()
    if selected.status is Status.MODEL_MISMATCH:
        return Status.MODEL_MISMATCH, selected.diagnostics.notes[:1]
    uncertain = selected.status.usable and not candidate.intervals.white
    uncertain = uncertain and not all(each.identified for each in selected.parameters.values())
    if status is Status.OK and uncertain:
        status = Status.NOT_IDENTIFIABLE
    causes = () if candidate.comparison is None else candidate.comparison.causes
    return (Status.MODEL_MISMATCH, causes) if status.usable and causes else (status, ())


def _velocities(
    log: AxisLog, prepared: PreparedLog
) -> tuple[list[Float[np.ndarray, " _"] | None], tuple[str, ...]]:
    """Return the measured velocity of each part if it is one, and notes."""
    none: list[Float[np.ndarray, " _"] | None] = [None] * len(prepared.parts)
    if log.measured_velocity is None:
        return none, ()
    even, _ = resampled(replace(prepared.log, measured_velocity=log.measured_velocity))
    even, notes = without_wrong_velocity(even, LowPass.of(even.sampling_time), load=False)
    velocity = even.measured_velocity
    if velocity is None:
        return none, notes
    starts = [int(np.searchsorted(even.time, part.time[0])) for part in prepared.parts]
    sizes = [part.time.size for part in prepared.parts]
    return [velocity[k : k + n] for k, n in zip(starts, sizes, strict=True)], notes


def _only(
    regression: Regression, at: Int[np.ndarray, " k"], values: Float[np.ndarray, " p"]
) -> Regression:
    """Return the rows with some of their columns; the others are subtracted from the target."""
    others = np.setdiff1d(np.arange(values.size), at)
    return replace(
        regression,
        names=tuple(regression.names[k] for k in at),
        target=regression.target - regression.regressors[:, others] @ values[others],
        regressors=regression.regressors[:, at],
        regressor_noise=regression.regressor_noise[at],
    )


def _regression(log: AxisLog, problem: Problem, maximum: Maximum, found: Evaluation) -> Regression:
    """Return the innovations as rows that are linear in the parameters around the maximum."""
    segments = problem.segments
    stacked = problem.in_slip(found.rows)
    n, channels, q = stacked.shape
    stacked = stacked.reshape(n * channels, q)
    target = stacked[:, 0] + stacked[:, 1:] @ maximum.values
    # A combination is determined if its standard deviation is below half of its value
    ratio = 2.0 / max(float(np.linalg.norm(target)), 1.0)
    positions = [s.position for s in segments]
    return Regression(
        kind=log.kind,
        names=problem.sought.names,
        time=np.repeat(problem.in_slip([s.time for s in segments]), channels),
        target=target,
        regressors=stacked[:, 1:],
        regressor_noise=np.zeros(q - 1),
        quantity="position",
        motion=summarise_motion(
            positions,
            [s.smooth_velocity for s in segments],
            problem.sampling_time,
            (max(map(position_noise, positions)), 0.0),
        ),
        samples=len(log),
        smallest_singular_ratio=max(ratio, 1e-9),
        resolution=0.0,
    )


def _noise_notes(log: AxisLog, candidate: _Candidate) -> tuple[str, ...]:
    """Return the estimated noise levels, and the delay if it was sought."""
    problem, maximum = candidate.problem, candidate.maximum
    std = np.exp(0.5 * maximum.levels)
    force, position = log.unit("effort"), log.unit("position")
    parts = [
        f"effort noise {std[search.EFFORT]:.3g} {force}",
        f"white disturbance force {std[search.FORCE]:.3g} {force}",
        f"autoregressive disturbance force {std[search.DISTURBANCE]:.3g} {force} with correlation "
        f"time {np.exp(maximum.levels[search.TIME_CONSTANT]):.2g} s",
        f"encoder noise {std[search.POSITION]:.3g} {position}",
    ]
    if std.size > search.VELOCITY:
        parts.append(f"velocity noise {std[search.VELOCITY]:.3g} {log.unit('velocity')}")
    notes = [f"estimated noise levels: {', '.join(parts)}"]
    if problem.averaged > 1:
        notes.append(
            f"means of {problem.averaged} samples are used: faster motion is not that of the model"
        )
    jumps = search.jumps_in(problem)
    if jumps:
        notes.append(f"the effort jumps in {count_of(jumps, 'sample')}, where it was taken as such")
    if _DELAY in problem.sought.names:
        k = problem.sought.names.index(_DELAY)
        T = problem.sampling_time / problem.averaged
        error = np.sqrt(candidate.intervals.covariance[k, k]) / T
        notes.append(
            f"the effort acts {maximum.values[k] / T:.2f} ± {error:.2f} samples later than "
            "logged (standard error)"
        )
    if not maximum.converged:
        notes.append("the search of the likelihood has not converged")
    return tuple(notes)
