"""Maximum likelihood of a rigid axis with process noise."""

from dataclasses import dataclass, fields
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.diagnostics import (
    condition_number,
    determined,
    status_of,
    verdicts_of,
)
from stickslip.estimation.fit.intervals import autocorrelation, robust_uncertainty, t_quantile
from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.fit.solve import check_excited, provenance_of
from stickslip.estimation.likelihood.axis_parameters import mass_name
from stickslip.estimation.likelihood.process_noise.problem import (
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
    Maximum,
    Problem,
    evaluate,
    maximise,
    with_jumps,
)
from stickslip.estimation.likelihood.process_noise.tuning import Tuning
from stickslip.estimation.likelihood.process_noise.uncertainty import covariance_of
from stickslip.estimation.likelihood.process_noise.whiteness import whiteness_probability
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

_LEAST_INNOVATIONS = 50
_DELAY = "effort_delay"


class _Intervals(NamedTuple):
    """Covariance [SI], half of each 95 % interval [SI], and whether the model misses something."""

    covariance: Float[np.ndarray, "p p"]
    half: Float[np.ndarray, " p"]
    mismatch: bool
    notes: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class ProcessNoiseLikelihoodEstimator:
    """Maximum likelihood with noise on the logged effort, disturbance forces and sensor noise.

    The log may come from a closed loop. A Kalman filter follows the axis through every stretch in
    which it surely slips in one direction, with position, velocity, disturbance force and the true
    effort as states; logged position and logged effort are two measurements. Noise of the log and
    forces on the axis are thus told apart by what they do: a force moves the axis. The noise
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
        estimated; 0 takes the effort as it is.
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
        check_excited(log)
        even, changes = resampled(log)
        low_pass = LowPass(order=4, cutoff=default_cutoff(even.sampling_time))
        even, wrong = without_wrong_velocity(even, low_pass, load=False)
        names = self.names(log.kind)
        sought = (*names, _DELAY) if self.largest_delay else names
        known = {} if self.inertia is None else {mass_name(log.kind): self.inertia}
        problem = problem_of(even, sought=sought, known=known, tuning=self.tuning)
        if problem is None or _innovations(problem) < _LEAST_INNOVATIONS:
            return self._nothing(log, (*changes, *wrong))
        maximum = maximise(problem, first_guess(problem, self.largest_delay), self.tuning)
        for _ in range(self.tuning.jump_passes):
            marked = with_jumps(problem, maximum, self.tuning.largest_effort_innovation)
            if marked is None:
                break
            problem = marked
            maximum = maximise(problem, maximum.values, self.tuning, maximum.levels)
        return self._estimate(log, problem, maximum, (*changes, *wrong))

    def _estimate(
        self, log: AxisLog, problem: Problem, maximum: Maximum, notes: tuple[str, ...]
    ) -> FrictionEstimate:
        """Return the estimate at the maximum, with intervals, verdicts and status."""
        names = self.names(log.kind)
        p = len(names)
        values = maximum.values[:p]
        regression = _regression(log, problem, maximum)
        found = determined(
            regression.regressors, regression.regressor_noise, regression.smallest_singular_ratio
        )
        mask = found.mask(len(regression.names))[:p]
        intervals = self._intervals(problem, maximum, regression)
        verdicts = list(verdicts_of(regression, found)[:p])
        parameters: dict[str, ParameterEstimate] = {}
        for k, name in enumerate(names):
            half, value = float(intervals.half[k]), float(values[k])
            if mask[k] and name == problem.mass_name and half > abs(value):
                mask[k] = False
                reason = "its 95 % interval is wider than the value itself"
                verdicts[k] = Verdict(parameter=name, identifiable=False, reason=reason)
            parameters[name] = ParameterEstimate(
                name=name,
                value=value if mask[k] else None,
                std=float(np.sqrt(intervals.covariance[k, k])) if mask[k] else None,
                ci95=(value - half, value + half) if mask[k] else None,
                unit=unit_of(name, log.kind),
            )
        relative = effort_residual(problem, maximum.values)
        status = status_of(list(parameters.values()), relative, None, regression)
        if status is Status.OK and intervals.mismatch:
            status = Status.MODEL_MISMATCH
        residual = regression.target - regression.regressors @ maximum.values
        variances = np.diag(intervals.covariance)
        classical = np.sqrt(np.diag(covariance_of(problem, maximum)[0]))
        delay = round(maximum.values[-1] / problem.sampling_time) if self.largest_delay else None
        return FrictionEstimate(
            estimator=self.name,
            kind=log.kind,
            parameters=parameters,
            covariance=intervals.covariance[:p, :p][np.ix_(mask, mask)],
            status=status,
            diagnostics=Diagnostics(
                relative_residual=relative,
                cross_validation_residual=None,
                condition_number=condition_number(regression.regressors),
                residual_autocorrelation=float(autocorrelation(residual, 1)[1]),
                effective_samples=float(
                    _innovations(problem) * np.min(classical[:p] ** 2 / variances[:p])
                ),
                classical_std={
                    name: float(classical[k]) for k, name in enumerate(names) if mask[k]
                },
                samples=len(log),
                verdicts=tuple(verdicts),
                notes=(*notes, *_noise_notes(log, problem, maximum), *intervals.notes),
                effort_delay=delay,
            ),
            provenance=provenance_of(log, self._options),
        )

    @property
    def _options(self) -> dict[str, object]:
        settings = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "tuning"}
        tuning = {f.name: getattr(self.tuning, f.name) for f in fields(self.tuning)}
        return {"estimator": self.name, **settings, "tuning": tuning}

    def _intervals(self, problem: Problem, maximum: Maximum, regression: Regression) -> _Intervals:
        """Return the intervals, wider by what is measured where the innovations are not white."""
        covariance, degrees = covariance_of(problem, maximum)
        half = np.sqrt(np.diag(covariance)) * np.array([t_quantile(float(d)) for d in degrees])
        rows = evaluate(
            problem, maximum.values, maximum.levels, with_rows=True, with_changes=False
        ).rows
        slipping = [s.direction != 0 for s in problem.segments]
        channels = rows[0].shape[1]
        probability = channels * min(
            whiteness_probability(
                np.concatenate([r[kept, c, 0] for r, kept in zip(rows, slipping, strict=True)])
            )
            for c in range(channels)
        )
        if probability > self.tuning.whiteness_level:
            return _Intervals(covariance, half, mismatch=False, notes=())
        residual = regression.target - regression.regressors @ maximum.values
        left, singular, right = np.linalg.svd(regression.regressors, full_matrices=False)
        robust = robust_uncertainty(left, right.T / singular, residual)
        spread = np.sqrt(np.diag(robust.covariance))
        wide = spread * np.array([t_quantile(float(d)) for d in robust.degrees_of_freedom])
        growth = np.maximum(wide / half, 1.0)
        note = (
            f"the innovations are not white (probability {probability:.1g}): the axis, or its "
            f"noise, is not that of the model; intervals are widened by up to {np.max(growth):.2g}"
        )
        return _Intervals(
            covariance * np.outer(growth, growth),
            half * growth,
            mismatch=bool(np.max(growth) > self.tuning.tolerated_widening),
            notes=(note,),
        )

    def _nothing(self, log: AxisLog, notes: tuple[str, ...]) -> FrictionEstimate:
        """Return the estimate from a log in which the axis hardly slips."""
        reason = "the axis hardly moves in this log"
        names = self.names(log.kind)
        return FrictionEstimate(
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


def _innovations(problem: Problem) -> int:
    """Return the number of samples in slip."""
    return sum(int(np.count_nonzero(segment.direction)) for segment in problem.segments)


def _regression(log: AxisLog, problem: Problem, maximum: Maximum) -> Regression:
    """Return the innovations as rows that are linear in the parameters around the maximum."""
    rows = evaluate(
        problem, maximum.values, maximum.levels, with_rows=True, with_changes=False
    ).rows
    kept = [s.direction != 0 for s in problem.segments]
    stacked = np.concatenate([r[k] for r, k in zip(rows, kept, strict=True)])
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


def _noise_notes(log: AxisLog, problem: Problem, maximum: Maximum) -> tuple[str, ...]:
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
    jumps = sum(int(np.count_nonzero(segment.jumps)) for segment in problem.segments)
    if jumps:
        notes.append(f"the effort jumps in {count_of(jumps, 'sample')}, where it was taken as such")
    if _DELAY in problem.layout.sought:
        covariance, _ = covariance_of(problem, maximum)
        T = problem.sampling_time
        notes.append(
            f"the effort acts {maximum.values[-1] / T:.2f} ± {np.sqrt(covariance[-1, -1]) / T:.2f} "
            "samples later than logged (standard error)"
        )
    if not maximum.converged:
        notes.append("the search of the likelihood has not converged")
    return tuple(notes)
