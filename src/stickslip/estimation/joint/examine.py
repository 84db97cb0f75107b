"""Data of the report of a joint fit."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import cast

import numpy as np
from threadpoolctl import threadpool_limits

from stickslip.estimation.figures import effort_residuals, energy_balance, friction_curve
from stickslip.estimation.joint.estimator import JointEstimator
from stickslip.estimation.joint.model import JointModel
from stickslip.estimation.selection.evaluation.figures import (
    energy_stretches,
    force_rows,
    velocity_law,
)
from stickslip.records import AxisLog, Identification


@threadpool_limits.wrap(limits=1, user_api="blas")  # as in `examine`
def examine_jointly(
    logs: Sequence[AxisLog], estimator: JointEstimator, truth: Mapping[str, float] | None = None
) -> Identification:
    """Fit several logs and compute the data of the report.

    The truth (parameter values by name [SI], of simulated logs) is only passed on. The result has
    friction curve, energy balance and residuals, one log after another, unless a parameter is not
    identified. Raises as ``estimator.fit``.
    """
    fit = estimator.details(logs)
    estimate, model = fit.estimate, cast("JointModel", fit.model)
    found = Identification(log=logs[0], further=tuple(logs[1:]), estimate=estimate, truth=truth)
    if not all(parameter.identified for parameter in estimate.parameters.values()):
        return found
    level = np.array(model.levels)[model.rows.log]
    unweighted = replace(
        fit.rows, target=fit.rows.target * level, regressors=fit.rows.regressors * level[:, None]
    )
    rows = replace(force_rows(estimate, model, unweighted), time=fit.rows.time)
    stretches = [
        replace(stretch, time=stretch.time + begin)
        for k, (log, begin) in enumerate(zip(model.logs, model.begins, strict=True))
        for stretch in energy_stretches(estimate.of_log(log), model.of_log(k))
    ]
    return replace(
        found,
        curve=friction_curve(rows, velocity_law(estimate), estimate),
        energy=energy_balance(stretches),
        residuals=effort_residuals(rows),
    )
