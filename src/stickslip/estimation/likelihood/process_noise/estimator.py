"""Maximum likelihood of a rigid axis with process noise."""

from dataclasses import dataclass, fields, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.estimation.fit.diagnostics import (
    condition_number,
    determined,
    status_of,
    verdicts_of,
)
from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import check_excited, provenance_of
from stickslip.estimation.likelihood.axis_parameters import mass_name
from stickslip.estimation.likelihood.process_noise.problem import (
    LogPart,
    Problem,
    effort_residual,
    first_guess,
    problem_of,
)
from stickslip.estimation.likelihood.process_noise.search import (
    DISTURBANCE,
    EFFORT,
    FORCE,
    POSITION,
    TIME_CONSTANT,
    VELOCITY,
    Evaluation,
    Maximum,
    evaluate,
    maximise,
    with_jumps,
)
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.estimation.likelihood.process_noise.uncertainty import (
    Comparison,
    Intervals,
    compare_with_windows,
    intervals_of,
    shift_by_low_speed,
)
from stickslip.estimation.prepare import PreparedLog, prepare
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.terms import DELAY, SATURATION
from stickslip.estimation.settings import check_given
from stickslip.estimation.signals.kinematics import LowPass, default_cutoff
from stickslip.estimation.signals.resampling import resampled
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms
from stickslip.records import (
    AxisKind,
    AxisLog,
    Diagnostics,
    FrictionEstimate,
    InputError,
    ParameterEstimate,
    Status,
    Verdict,
    count_of,
    positive,
    unit_of,
)

__all__ = ["ProcessNoiseLikelihoodEstimator"]

_DELAY = "effort_delay"
_LOW_SPEED = {"stribeck_excess", "low_speed_friction", "presliding_friction"}


class _Candidate(NamedTuple):
    """The estimate from one band.

    Attributes
    ----------
    problem, maximum, rows
        The log as the likelihood took it, its maximum, and the normalised innovations there.
    intervals
        Of all parameters sought, the delay among them.
    comparison
        With the selection's estimate; None if nothing was selected.
    reliable
        Whether the model holds at all frequencies, so far as the innovations show.
    """

    problem: Problem
    maximum: Maximum
    rows: Regression
    intervals: Intervals
    comparison: Comparison | None
    reliable: bool

    @property
    def agrees(self) -> bool:
        """Whether the estimate is that of the selection within chance."""
        return self.comparison is None or not self.comparison.causes

    @property
    def width(self) -> float:
        """Sum of the logarithms of the intervals' halves [-]."""
        return float(np.sum(np.log(np.maximum(self.intervals.half, 1e-300))))


class _Selected(NamedTuple):
    """What the selection of terms found: the terms, and which samples may be used.

    Attributes
    ----------
    per_direction
        Whether friction differs between the directions.
    delay
        Of the effort [samples].
    load_names
        Names of the coefficients of further terms.
    columns
        Of each part, which samples may be used, and the columns of these terms [SI].
    estimate
        Of the selection; None if nothing was selected.
    """

    per_direction: bool
    delay: float
    load_names: tuple[str, ...]
    columns: list[tuple[Bool[np.ndarray, " n"], Float[np.ndarray, "n l"]]]
    estimate: FrictionEstimate | None


@dataclass(frozen=True, kw_only=True)
class ProcessNoiseLikelihoodEstimator:
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
        Delays of the effort of up to so many samples, late or early and with fractions, are
        estimated; 0 estimates one only if the selection finds one.
    select
        Whether the terms that `SelectedModelEstimator` finds in the log (a load, friction of
        another form, a delay of the effort) are part of the model, with their shapes as found.
    tuning
        Tuning constants.

    Raises
    ------
    InputError
        If a setting is out of range, or offset and per_direction are both asked for.

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

    def __post_init__(self) -> None:
        check_given(self, positive, {"inertia": "kg or kg m^2"})
        if self.largest_delay < 0:
            raise InputError(
                f"largest_delay is {count_of(self.largest_delay, 'sample')}",
                remedy="give 0 or more whole samples",
            )
        _ = self.terms  # checks that offset and per_direction go together

    @property
    def name(self) -> str:
        """Name of the estimator."""
        return "maximum-likelihood-process-noise"

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(per_direction=self.per_direction, offset=self.offset)

    def names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of the parameters, in the order of the covariance.

        Parameters
        ----------
        kind
            ``"linear"`` or ``"rotary"``.
        """
        return (*(() if self.inertia is not None else (mass_name(kind),)), *self.terms.names)

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If nothing moves or pushes in the log.
        """
        return self.details(log).estimate

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report.

        Raises
        ------
        InputError
            As `fit`.
        """
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
                velocity=velocity,
                usable=part.usable & usable,
                loads=loads,
            )
            for part, velocity, (usable, loads) in zip(
                prepared.parts, velocities, found.columns, strict=True
            )
        ]
        names = self._base_names(log.kind, found.per_direction)
        with_delay = bool(self.largest_delay or found.delay)
        sought = (*names, *((_DELAY,) if with_delay else ()), *found.load_names)
        known = {} if self.inertia is None else {mass_name(log.kind): self.inertia}

        def averaged(samples: int) -> Problem | None:
            return problem_of(
                parts,
                log.kind,
                prepared.sampling_time,
                sought=sought,
                known=known,
                tuning=self.tuning,
                averaged=samples,
            )

        notes = (*prepared.notes, *wrong)
        problem = averaged(1)
        if problem is None or _innovations(problem) < self.tuning.fewest_innovations:
            return self._nothing(log, notes)
        whole = best = self._candidate(log, problem, found)
        others: list[_Candidate] = []
        if found.estimate is not None and not (whole.reliable and whole.agrees):
            slipping, samples = _innovations(problem), self.tuning.averaging_ratio
            while (slower := averaged(samples)) is not None:
                left = _innovations(slower)
                if left < max(
                    self.tuning.least_share * slipping / samples, self.tuning.fewest_means
                ):
                    break
                others.append(self._candidate(log, slower, found))
                samples *= self.tuning.averaging_ratio
            agreeing = [each for each in (whole, *others) if each.agrees]
            best = min(agreeing, key=lambda each: each.width, default=whole)
        return self._estimate(log, best, notes, found)

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
            maximum = maximise(problem, values, tuning, maximum, most=most, first=True)
            marked = with_jumps(problem, maximum, tuning.largest_effort_innovation)
            if marked is None:
                break
            problem, values = marked, maximum.values
        maximum = maximise(problem, values, tuning, maximum, most=tuning.max_iterations)
        innovations = evaluate(problem, maximum.values, maximum.levels, with_rows=True)
        rows = _regression(log, problem, maximum, innovations)
        intervals = intervals_of(problem, maximum, innovations, rows, tuning)
        comparison = None
        if found.estimate is not None:
            values = dict(zip(rows.names, maximum.values.tolist(), strict=True))
            std = dict(
                zip(rows.names, np.sqrt(np.diag(intervals.covariance)).tolist(), strict=True)
            )
            comparison = compare_with_windows(
                values, std, found.estimate, tuning.disagreement_level
            )
        reliable = problem.averaged == 1 and intervals.growth <= tuning.tolerated_widening
        # Shapes of terms have errors of their own, of which the likelihood has no account
        if comparison is not None and (found.load_names or not reliable):
            intervals = intervals.widened(
                np.array([comparison.differences.get(name, 0.0) for name in rows.names])
            )
        if not set(found.load_names) & _LOW_SPEED:
            shift = shift_by_low_speed(problem, maximum, tuning)
            intervals = intervals if shift is None else intervals.widened(shift)
        return _Candidate(problem, maximum, rows, intervals, comparison, reliable)

    def _selected(self, log: PreparedLog) -> _Selected:
        """Return what the selection of terms finds in a log."""
        unselected = [(part.usable, np.zeros((part.time.size, 0))) for part in log.parts]
        nothing = _Selected(self.per_direction, 0.0, (), unselected, None)
        if not self.select:
            return nothing
        estimator = SelectedModelEstimator(
            inertia=self.inertia,
            offset=self.per_direction or self.terms.offset,
            include=("direction",) if self.per_direction else (),
        )
        fit = estimator.fit_prepared(log)
        model = fit.model
        if model is None or model.inertia != self.inertia:  # the given inertia is wrong
            return nothing._replace(estimate=fit.estimate)
        shapes = [
            (term.name, shape)
            for term, shape in model.chosen
            if term.name not in {DELAY, SATURATION, "direction"}
        ]
        names = [
            f"{term}_excess" if term == "stribeck" else name
            for term, shape in shapes
            for name in shape.names
        ]
        columns = [
            (
                motion.usable & (motion.direction != 0),
                np.column_stack(
                    [np.zeros((motion.time.size, 0))]
                    + [column(motion) for _, shape in shapes for column in shape.columns]
                ),
            )
            for motion in model.rows.motions
        ]
        return _Selected(
            "direction" in model.names, model.rows.delay, tuple(names), columns, fit.estimate
        )

    def _base_names(self, kind: AxisKind, per_direction: bool) -> tuple[str, ...]:
        """Return the names of inertia and friction, per direction if the log shows it."""
        return replace(
            self,
            per_direction=per_direction,
            offset=None if per_direction else self.offset,
        ).names(kind)

    def _estimate(
        self, log: AxisLog, candidate: _Candidate, notes: tuple[str, ...], found: _Selected
    ) -> Fit:
        """Return the estimate at the maximum, with intervals, verdicts and status."""
        problem, maximum, regression, intervals, comparison, reliable = candidate
        sought = problem.layout.sought
        # The delay is a diagnostic, and the size of a Stribeck effect a difference of two forces
        names = [name for name in sought if name != _DELAY and not name.endswith("_excess")]
        at = np.array([sought.index(name) for name in names])
        values = maximum.values[at]
        independent = determined(
            regression.regressors, regression.regressor_noise, regression.smallest_singular_ratio
        )
        mask = independent.mask(len(sought))[at]
        every = verdicts_of(regression, independent)
        verdicts = [every[k] for k in at]
        covariance, half_width = intervals.covariance[np.ix_(at, at)], intervals.half[at]
        unsure = set() if comparison is None or intervals.white else set(comparison.unshared)
        parameters: dict[str, ParameterEstimate] = {}
        for k, name in enumerate(names):
            half, value = float(half_width[k]), float(values[k])
            reason = None
            if name == problem.mass_name and half > abs(value):
                reason = "its 95 % interval is wider than the value itself"
            elif name in unsure:
                reason = (
                    "the innovations are not white, and slow motion alone does not determine it"
                )
            if mask[k] and reason is not None:
                mask[k] = False
                verdicts[k] = Verdict(parameter=name, identifiable=False, reason=reason)
            parameters[name] = ParameterEstimate(
                name=name,
                value=value if mask[k] else None,
                std=float(np.sqrt(covariance[k, k])) if mask[k] else None,
                ci95=(value - half, value + half) if mask[k] else None,
                unit=unit_of(name, log.kind),
            )
        relative = effort_residual(problem, maximum.values)
        status = status_of(list(parameters.values()), relative, None, regression)
        if status is Status.OK and comparison is None and not reliable:
            status = Status.MODEL_MISMATCH
        causes: tuple[str, ...] = ()
        windows = None if found.estimate is None else found.estimate.status
        if status is Status.OK and windows is Status.NOT_IDENTIFIABLE and not intervals.white:
            status = Status.NOT_IDENTIFIABLE
        if found.estimate is not None and windows is Status.MODEL_MISMATCH:
            status = Status.MODEL_MISMATCH
            causes = found.estimate.diagnostics.notes[:1]
        elif comparison is not None and status.usable and comparison.causes:
            status, causes = Status.MODEL_MISMATCH, comparison.causes
        residual = regression.target - regression.regressors @ maximum.values
        variances = np.diag(covariance)
        classical = intervals.classical[at]
        delay = None
        if _DELAY in sought:
            seconds = maximum.values[sought.index(_DELAY)]
            delay = round(seconds * problem.averaged / problem.sampling_time)
        noise = _noise_notes(log, problem, maximum, intervals)
        estimate = FrictionEstimate(
            estimator=self.name,
            kind=log.kind,
            parameters=parameters,
            covariance=covariance[np.ix_(mask, mask)],
            status=status,
            diagnostics=Diagnostics(
                relative_residual=relative,
                cross_validation_residual=None,
                condition_number=condition_number(regression.regressors),
                residual_autocorrelation=float(autocorrelation(residual, 1)[1]),
                effective_samples=float(_innovations(problem) * np.min(classical**2 / variances)),
                classical_std={
                    name: float(classical[k]) for k, name in enumerate(names) if mask[k]
                },
                samples=len(log),
                verdicts=tuple(verdicts),
                notes=(*causes, *notes, *noise, *intervals.notes),
                effort_delay=delay,
            ),
            provenance=provenance_of(log, self._options),
            selection=None if found.estimate is None else found.estimate.selection,
        )
        return Fit(
            estimate=estimate, rows=_only(regression, at, maximum.values), inertia=self.inertia
        )

    @property
    def _options(self) -> dict[str, object]:
        settings = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "tuning"}
        tuning = {f.name: getattr(self.tuning, f.name) for f in fields(self.tuning)}
        return {"estimator": self.name, **settings, "tuning": tuning}

    def _nothing(self, log: AxisLog, notes: tuple[str, ...]) -> Fit:
        """Return the estimate from a log in which the axis hardly slips, without rows."""
        reason = "the axis hardly moves in this log"
        names = self.names(log.kind)
        estimate = FrictionEstimate(
            estimator=self.name,
            kind=log.kind,
            parameters={
                name: ParameterEstimate(
                    name=name, value=None, std=None, ci95=None, unit=unit_of(name, log.kind)
                )
                for name in names
            },
            covariance=np.empty((0, 0)),
            status=Status.INSUFFICIENT_EXCITATION,
            diagnostics=Diagnostics(
                relative_residual=1.0,
                cross_validation_residual=None,
                condition_number=float("inf"),
                residual_autocorrelation=0.0,
                effective_samples=1.0,
                classical_std={},
                samples=len(log),
                verdicts=tuple(
                    Verdict(parameter=name, identifiable=False, reason=reason) for name in names
                ),
                notes=notes,
            ),
            provenance=provenance_of(log, self._options),
        )
        rows = Regression(
            kind=log.kind,
            names=names,
            time=np.empty(0),
            target=np.empty(0),
            regressors=np.empty((0, len(names))),
            regressor_noise=np.zeros(len(names)),
            quantity="position",
            motion=summarise_motion(
                [log.measured_position],
                [np.gradient(log.measured_position, log.time)],
                log.sampling_time,
                (0.0, 0.0),
            ),
            samples=len(log),
        )
        return Fit(estimate=estimate, rows=rows, inertia=self.inertia)


def _velocities(
    log: AxisLog, prepared: PreparedLog
) -> tuple[list[Float[np.ndarray, " _"] | None], tuple[str, ...]]:
    """Return the measured velocity of each part if it is one, and notes."""
    none: list[Float[np.ndarray, " _"] | None] = [None] * len(prepared.parts)
    if log.measured_velocity is None:
        return none, ()
    even, _ = resampled(replace(prepared.log, measured_velocity=log.measured_velocity))
    low_pass = LowPass(order=4, cutoff=default_cutoff(even.sampling_time))
    even, notes = without_wrong_velocity(even, low_pass, load=False)
    velocity = even.measured_velocity
    if velocity is None:
        return none, notes
    starts = [int(np.searchsorted(even.time, part.time[0])) for part in prepared.parts]
    return [
        velocity[start : start + part.time.size]
        for start, part in zip(starts, prepared.parts, strict=True)
    ], notes


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


def _innovations(problem: Problem) -> int:
    """Return the number of samples in slip."""
    return sum(int(np.count_nonzero(segment.direction)) for segment in problem.segments)


def _regression(log: AxisLog, problem: Problem, maximum: Maximum, found: Evaluation) -> Regression:
    """Return the innovations as rows that are linear in the parameters around the maximum."""
    kept = [s.direction != 0 for s in problem.segments]
    stacked = np.concatenate([r[k] for r, k in zip(found.rows, kept, strict=True)])
    time = np.concatenate([s.time[k] for s, k in zip(problem.segments, kept, strict=True)])
    n, channels, q = stacked.shape
    stacked = stacked.reshape(n * channels, q)
    target = stacked[:, 0] + stacked[:, 1:] @ maximum.values
    # A combination is determined if its standard deviation is below half of its value
    ratio = 2.0 / max(float(np.linalg.norm(target)), 1.0)
    noise = max(position_noise(s.position) for s in problem.segments)
    return Regression(
        kind=log.kind,
        names=problem.layout.sought,
        time=np.repeat(time, channels),
        target=target,
        regressors=stacked[:, 1:],
        regressor_noise=np.zeros(q - 1),
        quantity="position",
        motion=summarise_motion(
            [s.position for s in problem.segments],
            [s.smooth_velocity for s in problem.segments],
            problem.sampling_time,
            (noise, 0.0),
        ),
        samples=len(log),
        smallest_singular_ratio=max(ratio, 1e-9),
        resolution=0.0,
    )


def _noise_notes(
    log: AxisLog, problem: Problem, maximum: Maximum, intervals: Intervals
) -> tuple[str, ...]:
    """Return the estimated noise levels, and the delay if it was sought."""
    std = np.exp(0.5 * maximum.levels)
    force, position = log.unit("effort"), log.unit("position")
    parts = [
        f"effort noise {std[EFFORT]:.3g} {force}",
        f"white disturbance force {std[FORCE]:.3g} {force}",
        f"autoregressive disturbance force {std[DISTURBANCE]:.3g} {force} with correlation time "
        f"{np.exp(maximum.levels[TIME_CONSTANT]):.2g} s",
        f"encoder noise {std[POSITION]:.3g} {position}",
    ]
    if std.size > VELOCITY:
        parts.append(f"velocity noise {std[VELOCITY]:.3g} {log.unit('velocity')}")
    notes = [f"estimated noise levels: {', '.join(parts)}"]
    if problem.averaged > 1:
        notes.append(
            f"means of {problem.averaged} samples are used: faster motion is not that of the model"
        )
    jumps = sum(int(np.count_nonzero(segment.jumps)) for segment in problem.segments)
    if jumps:
        notes.append(f"the effort jumps in {count_of(jumps, 'sample')}, where it was taken as such")
    if _DELAY in problem.layout.sought:
        k = problem.layout.sought.index(_DELAY)
        std = np.sqrt(intervals.covariance[k, k])
        T = problem.sampling_time / problem.averaged
        notes.append(
            f"the effort acts {maximum.values[k] / T:.2f} ± {std / T:.2f} samples later than "
            "logged (standard error)"
        )
    if not maximum.converged:
        notes.append("the search of the likelihood has not converged")
    return tuple(notes)
