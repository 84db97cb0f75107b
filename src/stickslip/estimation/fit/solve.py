"""Solve a regression and certify the result."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip import __version__
from stickslip.estimation.fit.diagnostics import (
    Determined,
    condition_number,
    cross_validation_residual,
    determined,
    hardly_moves,
    status_of,
    verdicts_of,
)
from stickslip.estimation.fit.intervals import (
    autocorrelation,
    pooled,
    robust_uncertainty,
    t_quantile,
    white_variances,
)
from stickslip.estimation.fit.rows import Regression
from stickslip.records import (
    SIGNED_PARAMETERS,
    AxisLog,
    Diagnostics,
    FrictionEstimate,
    InputError,
    ParameterEstimate,
    Provenance,
    Status,
    Verdict,
    quantity_name,
    shared_name,
    unit_of,
)

_LEAST_ROWS_PER_PARAMETER = 3  # with fewer, the variance of the residual is too uncertain [-]


def check_excited(log: AxisLog) -> None:
    """Check that a log has effort and motion; if not, that is an InputError."""
    if not np.any(log.effort):
        raise InputError("no_effort", where=log.name, unit=log.unit("effort"), samples=len(log))
    if np.ptp(log.measured_position) == 0:
        raise InputError(
            "no_motion",
            where=log.name,
            value=log.measured_position[0],
            unit=log.unit("position"),
            samples=len(log),
        )


def long_stretches(log: AxisLog, least: int, *, decimation: int | None = None) -> list[AxisLog]:
    """Return the stretches without gaps of at least ``least`` samples.

    A log without such a stretch, or without motion or effort in them, is an InputError.
    ``decimation`` is the factor that needs so many samples [-]; None for no decimation.
    """
    parts = [part for part in log.segments() if len(part) >= least]
    if not parts:
        sampling_time, samples = log.sampling_time, len(log)
        raise InputError(
            "no_long_stretch",
            where=log.name,
            least=least,
            samples=samples,
            sampling_time=sampling_time,
            decimation=decimation,
        )
    moves = any(float(np.ptp(part.measured_position)) > 0.0 for part in parts)
    has_effort = any(np.any(part.effort) for part in parts)
    if not (moves and has_effort):
        code = "no_effort_in_stretches" if moves else "no_motion_in_stretches"
        raise InputError(code, where=log.name, least=least, decimation=decimation)
    return parts


def provenance_of(log: AxisLog, options: Mapping[str, Any]) -> Provenance:
    """Return the provenance of a result from this log."""
    source = log.source
    return Provenance(
        stickslip_version=__version__,
        files=() if source is None else source.files,
        input_sha256="" if source is None else source.sha256,
        options=options,
        assumptions=() if source is None else source.assumptions,
        side="" if source is None else source.side,
        effort_unit=log.effort_unit,
    )


def solve(regression: Regression, *, estimator: str, provenance: Provenance) -> FrictionEstimate:
    """Fit by least squares, with intervals, verdicts and diagnostics.

    Parameters that the rows do not determine get no value: directions of the parameter space below
    1 % of the strongest (or another share that the rows state) are left out of the fit (truncated
    singular values), and the parameters that take part in them are not identifiable.
    """
    regressors = regression.regressors
    n, p = regressors.shape
    least = _LEAST_ROWS_PER_PARAMETER * p
    if hardly_moves(regression.motion) or n < least or regression.scale == 0.0:
        return _nothing_identified(regression, least, estimator=estimator, provenance=provenance)
    found = determined(regressors, regression.regressor_noise, regression.smallest_singular_ratio)
    mask = found.mask(p)
    fit = _fit(regression, found)
    variances = np.diag(fit.covariance)
    sampled = fit.sampling_variance
    ratio = np.divide(fit.classical_std**2, sampled, out=np.ones(p), where=sampled > 0)
    effective = np.clip(n * ratio, 1.0, float(min(n, regression.samples)))
    verdicts = list(verdicts_of(regression, found))
    parameters: dict[str, ParameterEstimate] = {}
    together = p if regression.simultaneous else 1
    for k, name in enumerate(regression.names):
        value, std = float(fit.values[k]), float(np.sqrt(variances[k]))
        degrees = float(fit.degrees_of_freedom[k])
        within = float(np.sqrt(fit.within_law[k]))
        half, alone = within * t_quantile(degrees, together), within * t_quantile(degrees)
        laws = np.zeros(1) if regression.law_shifts is None else regression.law_shifts[:, k]
        lower, higher = float(np.min(laws, initial=0.0)), float(np.max(laws, initial=0.0))
        judged = half if quantity_name(name) in _POSITIVE else alone
        reason = withheld(regression, k, fit.values, judged, partly=found.undetermined != ())
        if mask[k] and reason:
            mask[k] = False
            verdicts[k] = Verdict(parameter=name, identifiable=False, reason=reason)
        parameters[name] = ParameterEstimate(
            name=name,
            value=value if mask[k] else None,
            std=std if mask[k] else None,
            ci95=(value - half + lower, value + half + higher) if mask[k] else None,
            unit=unit_of(name, regression.kind, provenance.effort_unit),
        )
    relative = float(np.linalg.norm(fit.residual)) / regression.scale
    left_out = cross_validation_residual(regression)
    return FrictionEstimate(
        estimator=estimator,
        kind=regression.kind,
        parameters=parameters,
        covariance=fit.covariance[np.ix_(mask, mask)],
        status=status_of(list(parameters.values()), relative, left_out, regression),
        diagnostics=Diagnostics(
            relative_residual=relative,
            cross_validation_residual=left_out,
            condition_number=condition_number(regressors),
            residual_autocorrelation=float(autocorrelation(fit.residual, 1)[1]),
            effective_samples=float(np.min(effective[mask])) if np.any(mask) else 1.0,
            classical_std={
                name: float(fit.classical_std[k])
                for k, name in enumerate(regression.names)
                if mask[k]
            },
            samples=regression.samples,
            verdicts=tuple(verdicts),
            notes=regression.notes,
            effort_delay=regression.effort_delay,
        ),
        provenance=provenance,
    )


def _largest_effect(regression: Regression, k: int) -> float:
    """Return the effect of a unit of a parameter relative to the fitted signal [1 / SI].

    Where shapes are estimated, rows are compared one by one, as a term may act in a few of them
    only.
    """
    column = regression.regressors[:, k]
    if regression.effort is None:
        return float(np.linalg.norm(column)) / regression.scale
    largest = float(np.max(np.abs(regression.effort)))
    return float(np.max(np.abs(column))) / max(largest, np.finfo(float).tiny)


_POSITIVE = frozenset({"mass", "inertia", "stribeck_velocity"})
"""Parameters whose reported interval must exclude zero."""

_NEVER_SMALL = frozenset({"static_friction", "stribeck_velocity"})
"""Parameters for which a value close to zero is no result, as they act in few rows only."""

LARGEST_EFFECT = 0.1
"""Effect of half of an interval relative to the fitted signal [-], up to which it is informative
even for a value close to zero: "viscous friction is close to zero" is a result."""


def withheld(
    regression: Regression,
    k: int,
    values: Float[np.ndarray, " p"],
    half_width: float,
    *,
    partly: bool,
) -> str:
    """Return why a value is withheld although its column has content; empty if it is given.

    An interval is informative if its half-width is less than the value, or if its effect is small
    beside the fitted signal; a mass, static friction or a Stribeck velocity must be larger than
    its half-width. A sine and its cosine are judged by their amplitude. ``partly`` is whether the
    log leaves combinations of parameters undetermined, ``k`` the column, and values and half-width
    are in SI units.
    """
    name, value = regression.names[k], float(values[k])
    base = quantity_name(name)
    # Where the motion is simulated, the effect of static friction vanishes with its excess
    nonlinear = regression.effort is not None or regression.quantity == "position"
    small = base not in {"mass", "inertia"} and not (nonlinear and base in _NEVER_SMALL)
    if half_width > _amplitude(regression.names, values, k) and not (
        small and half_width * _largest_effect(regression, k) <= LARGEST_EFFECT
    ):
        return "half of its 95 % interval exceeds the value itself"
    if partly and shared_name(name) not in SIGNED_PARAMETERS and value <= 0:
        return "the parameters that the log does not separate leave no positive value for it"
    return ""


def _amplitude(names: Sequence[str], values: Float[np.ndarray, " p"], k: int) -> float:
    """Return the size of a parameter, or of the pair of sine and cosine that it is part of [SI]."""
    for own, other in (("sine", "cosine"), ("cosine", "sine")):
        beside = names[k].removesuffix(own) + other
        if names[k].endswith(f"_{own}") and beside in names:
            return float(np.hypot(values[k], values[list(names).index(beside)]))
    return abs(float(values[k]))


@dataclass(frozen=True, kw_only=True)
class _Fit:
    """Least squares on some of the columns; zero for the others."""

    values: Float[np.ndarray, " p"]
    covariance: Float[np.ndarray, "p p"]
    sampling_variance: Float[np.ndarray, " p"]
    within_law: Float[np.ndarray, " p"]
    classical_std: Float[np.ndarray, " p"]
    residual: Float[np.ndarray, " n"]
    degrees_of_freedom: Float[np.ndarray, " p"]


def _fit(regression: Regression, found: Determined) -> _Fit:
    """Fit in the directions that are determined.

    The classical standard deviations have the variance of the residual over n - 1, like the
    published ones.
    """
    p = regression.regressors.shape[1]
    values, covariance, classical = np.zeros(p), np.zeros((p, p)), np.zeros(p)
    degrees = np.ones(p)
    columns = found.columns
    to_values = (found.right.T / found.singular) / found.norms[:, None]
    values[columns] = to_values @ (found.left.T @ regression.target)
    residual = regression.target - regression.regressors @ values
    uncertainty = robust_uncertainty(
        found.left, to_values, residual, slow=regression.slow_residual, log=regression.log
    )
    if regression.overlap is not None:
        rows, used = found.left.shape
        white = white_variances(
            found.left @ to_values.T,
            residual * np.sqrt(rows / (rows - used)),
            regression.time,
            regression.overlap,
            regression.log,
        )
        uncertainty = pooled(uncertainty, white)
    covariance[np.ix_(columns, columns)] = uncertainty.covariance
    degrees[columns] = uncertainty.degrees_of_freedom
    sampling = np.diag(covariance).copy()
    resolution = regression.resolution * float(np.linalg.norm(regression.target))
    covariance[columns, columns] += (resolution / found.norms) ** 2
    # Noise in the columns biases the values by about this much
    noise = regression.target.size * regression.regressor_noise[columns] ** 2
    bias = to_values @ (to_values.T @ (noise * values[columns]))
    covariance[columns, columns] += bias**2
    if regression.shifts is not None:
        covariance += regression.shifts.T @ regression.shifts
    within_law = np.diag(covariance).copy()
    if regression.law_shifts is not None:  # variance of laws of equal weight about the selected one
        laws = regression.law_shifts
        covariance += laws.T @ laws / (laws.shape[0] + 1)
    spread = float(np.var(residual, ddof=1))
    classical[columns] = np.sqrt(spread * np.sum(to_values**2, axis=1))
    return _Fit(
        values=values,
        covariance=covariance,
        sampling_variance=sampling,
        within_law=within_law,
        classical_std=classical,
        residual=residual,
        degrees_of_freedom=degrees,
    )


def _nothing_identified(
    regression: Regression, least: int, *, estimator: str, provenance: Provenance
) -> FrictionEstimate:
    """Return the estimate from a log in which the axis hardly moves."""
    reason = (
        "the axis hardly moves in this log"
        if hardly_moves(regression.motion)
        else f"the axis moves in {regression.target.size} rows only, {least} are needed"
    )
    return FrictionEstimate(
        estimator=estimator,
        kind=regression.kind,
        parameters={
            name: ParameterEstimate(
                name=name,
                value=None,
                std=None,
                ci95=None,
                unit=unit_of(name, regression.kind, provenance.effort_unit),
            )
            for name in regression.names
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
            samples=regression.samples,
            verdicts=tuple(
                Verdict(parameter=name, identifiable=False, reason=reason)
                for name in regression.names
            ),
            notes=regression.notes,
        ),
        provenance=provenance,
    )
