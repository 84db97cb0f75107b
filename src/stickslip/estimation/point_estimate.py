"""Estimates of methods that give no interval, certified as far as they can be."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.diagnostics import (
    condition_number,
    determined,
    status_of,
    verdicts_of,
)
from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import withheld
from stickslip.records import (
    Diagnostics,
    FrictionEstimate,
    ParameterEstimate,
    Provenance,
    Status,
    Verdict,
    unit_of,
)

NO_INTERVAL = "the method gives no interval"

NORMAL_95 = 1.959963984540054
"""Half of a 95 % interval over the standard deviation [-], of a normal distribution."""


def estimate_of(
    regression: Regression,
    values: Sequence[float],
    *,
    estimator: str,
    provenance: Provenance,
    deviations: Sequence[float] | None = None,
    covariance: Float[np.ndarray, "p p"] | None = None,
    notes: Sequence[str] = (),
) -> FrictionEstimate:
    """Return an estimate whose values [SI] come from elsewhere than least squares on the rows.

    The rows, linear in the parameters, give its verdicts, residual and status.
    """
    regressors, target, array = regression.regressors, regression.target, np.asarray(values)
    found = determined(regressors, regression.regressor_noise)
    verdicts = list(verdicts_of(regression, found))
    parameters: dict[str, ParameterEstimate] = {}
    for k, (name, verdict) in enumerate(zip(regression.names, verdicts, strict=True)):
        known = verdict.identifiable
        value = float(values[k])
        if known and deviations is not None:
            half = NORMAL_95 * float(deviations[k])
            reason = withheld(regression, k, array, half, partly=found.undetermined != ())
            if reason:
                known = False
                verdicts[k] = Verdict(parameter=name, identifiable=False, reason=reason)
        std = None if deviations is None or not known else float(deviations[k])
        half = 0.0 if std is None else NORMAL_95 * std
        parameters[name] = ParameterEstimate(
            name=name,
            value=value if known else None,
            std=std,
            ci95=None if std is None else (value - half, value + half),
            unit=unit_of(name, regression.kind, provenance.effort_unit),
        )
    residual = target - regressors @ array
    relative = float(np.linalg.norm(residual)) / regression.scale if regression.scale > 0 else 0.0
    kept = [k for k, verdict in enumerate(verdicts) if verdict.identifiable]
    every = list(parameters.values())
    status = status_of(every, relative, None, regression)
    negative = any(not p.signed and p.value is not None and p.value < 0 for p in every)
    if status in {Status.OK, Status.BIASED} and deviations is None and negative:
        status = Status.UNPHYSICAL
    if status is Status.OK and deviations is None:
        status = Status.NO_INTERVAL
    return FrictionEstimate(
        estimator=estimator,
        kind=regression.kind,
        parameters=parameters,
        covariance=np.empty((0, 0)) if covariance is None else covariance[np.ix_(kept, kept)],
        status=status,
        diagnostics=Diagnostics(
            relative_residual=relative,
            cross_validation_residual=None,
            condition_number=condition_number(regressors),
            residual_autocorrelation=float(autocorrelation(residual, 1)[1])
            if residual.size
            else 0.0,
            effective_samples=float(max(residual.size, 1)),
            classical_std={},
            samples=regression.samples,
            verdicts=tuple(verdicts),
            notes=(*regression.notes, *notes),
        ),
        provenance=provenance,
    )
