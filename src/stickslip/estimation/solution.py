"""Solve a regression and certify the result."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from stickslip import __version__
from stickslip.estimation.diagnostics import (
    SMALLEST_SINGULAR_RATIO,
    condition_number,
    cross_validation_residual,
    identifiable_columns,
    status_of,
    verdicts_of,
)
from stickslip.estimation.intervals import autocorrelation, hac_covariance, t_quantile
from stickslip.estimation.regression import Regression
from stickslip.records import (
    AxisLog,
    Diagnostics,
    FrictionEstimate,
    InputError,
    ParameterEstimate,
    Provenance,
    unit_of,
)

__all__ = ["check_excited", "provenance_of", "solve"]

_LEAST_ROWS_PER_PARAMETER = 3
_LEAST_DEGREES_OF_FREEDOM = 3.0


def check_excited(log: AxisLog) -> None:
    """Refuse a log in which nothing moves or nothing pushes.

    Raises
    ------
    InputError
        If every effort is zero, or the position never changes.
    """
    if not np.any(log.effort):
        raise InputError(
            f"the effort is 0 {log.unit('effort')} in all {len(log)} samples",
            where=log.name,
            remedy="map the column that holds the force, torque or motor current",
        )
    if np.ptp(log.measured_position) == 0:
        raise InputError(
            f"the position is {log.measured_position[0]:g} {log.unit('position')} in all "
            f"{len(log)} samples",
            where=log.name,
            remedy="map the column that holds the axis' position, or record a motion",
        )


def provenance_of(log: AxisLog, options: Mapping[str, Any]) -> Provenance:
    """Return what produced a result from this log."""
    source = log.source
    return Provenance(
        stickslip_version=__version__,
        files=() if source is None else source.files,
        input_sha256="" if source is None else source.sha256,
        options=options,
        assumptions=() if source is None else source.assumptions,
    )


def solve(regression: Regression, *, estimator: str, provenance: Provenance) -> FrictionEstimate:
    """Fit by least squares, with intervals, verdicts and diagnostics.

    What the rows do not determine gets no value: directions of the parameter space below 1 % of the
    strongest are left out of the fit (truncated singular values) and the parameters that take part
    in them are reported as not identifiable.

    Parameters
    ----------
    regression
        The rows.
    estimator
        Name of the estimator that made them.
    provenance
        Where they come from.

    Raises
    ------
    InputError
        If there are too few rows.
    """
    target, regressors = regression.without_nuisance()
    n, p = regressors.shape
    nuisance = regression.nuisance.shape[1]
    least = _LEAST_ROWS_PER_PARAMETER * (p + nuisance)
    if n < least:
        raise InputError(
            f"the log leaves {n} rows for {p} parameters, at least {least} are needed",
            remedy="record a longer log, or raise the cutoff frequency",
        )
    mask, groups = identifiable_columns(regressors, regression.regressor_noise)
    seen = np.linalg.norm(regressors, axis=0) > 0
    for group in groups:
        if len(group) == 1:
            seen[list(group)] = False
    columns = np.flatnonzero(seen)
    values = np.zeros(p)
    covariance = np.zeros((p, p))
    classical = np.zeros(p)
    if columns.size:
        norms = np.linalg.norm(regressors[:, columns], axis=0)
        left, singular, right = np.linalg.svd(regressors[:, columns] / norms, full_matrices=False)
        kept = singular >= singular[0] * SMALLEST_SINGULAR_RATIO
        left, singular, right = left[:, kept], singular[kept], right[kept]
        to_values = (right.T / singular) / norms[:, None]
        values[columns] = to_values @ (left.T @ target)
        residual = target - regressors @ values
        inner = hac_covariance(left, residual, lost=nuisance)
        covariance[np.ix_(columns, columns)] = to_values @ inner @ to_values.T
        spread = float(np.var(residual, ddof=1))
        classical[columns] = np.sqrt(spread * np.sum(to_values**2, axis=1))
    else:
        residual = target
    ratio = np.divide(
        classical**2, np.diag(covariance), out=np.ones(p), where=np.diag(covariance) > 0
    )
    effective = np.clip(n * ratio, 1.0, float(n))
    parameters: dict[str, ParameterEstimate] = {}
    for k, name in enumerate(regression.names):
        unit = unit_of(name, regression.kind)
        if not mask[k]:
            parameters[name] = ParameterEstimate(
                name=name, value=None, std=None, ci95=None, unit=unit
            )
            continue
        std = float(np.sqrt(covariance[k, k]))
        freedom = max(float(effective[k]) - p - nuisance, _LEAST_DEGREES_OF_FREEDOM)
        half = t_quantile(freedom) * std
        value = float(values[k])
        parameters[name] = ParameterEstimate(
            name=name, value=value, std=std, ci95=(value - half, value + half), unit=unit
        )
    relative = float(np.linalg.norm(residual) / np.linalg.norm(target))
    diagnostics = Diagnostics(
        relative_residual=relative,
        cross_validation_residual=cross_validation_residual(target, regressors),
        condition_number=condition_number(regressors),
        residual_autocorrelation=float(autocorrelation(residual, 1)[1]),
        effective_samples=float(np.min(effective[mask])) if np.any(mask) else 1.0,
        classical_std={
            name: float(classical[k]) for k, name in enumerate(regression.names) if mask[k]
        },
        samples=regression.samples,
        verdicts=verdicts_of(regression, mask, groups),
        notes=regression.notes,
    )
    return FrictionEstimate(
        estimator=estimator,
        kind=regression.kind,
        parameters=parameters,
        covariance=covariance[np.ix_(mask, mask)],
        status=status_of(list(parameters.values()), relative, regression.motion),
        diagnostics=diagnostics,
        provenance=provenance,
    )
