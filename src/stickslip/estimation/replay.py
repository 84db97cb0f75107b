"""Any estimate held against its log, in the same way whatever method it comes from."""

import numpy as np

from stickslip.estimation.energy import EnergyEstimator
from stickslip.estimation.idim_least_squares import IdimLeastSquares
from stickslip.estimation.resimulation import identified_plant, resimulate
from stickslip.friction import StribeckEffect
from stickslip.records import AxisLog, FrictionEstimate, Resimulation

__all__ = ["replay", "unexplained_effort"]

_OPTIONAL = ("static_friction", "stribeck_velocity")
"""Without these an estimate is that of a law without a step from static to Coulomb friction."""


def unexplained_effort(
    log: AxisLog, estimate: FrictionEstimate, *, inertia: float | None = None
) -> float | None:
    """Return what an estimate leaves of the effort of a rigid axis.

    Norm of effort less inertia force, friction and offset over norm of the effort, both smoothed
    and decimated as `IdimLeastSquares` does it, and without rows at rest.

    Parameters
    ----------
    log
        The measurement.
    estimate
        Of any estimator.
    inertia
        Moving mass or inertia, where the estimate does not hold it [kg or kg m^2].

    Returns
    -------
    The share [-]; None if a parameter is missing.

    Raises
    ------
    InputError
        If the log is too short, or nothing moves or pushes in it.
    """
    values = _values(estimate, inertia)
    if values is None:
        return None
    rows = IdimLeastSquares(
        per_direction=_per_direction(estimate),
        offset="offset" in values,
        stribeck=_effect(estimate),
    ).regression(log)
    law = np.array([values.get(name, 0.0) for name in rows.names])
    residual = rows.target - rows.regressors @ law
    return float(np.linalg.norm(residual) / np.linalg.norm(rows.target))


def replay(
    log: AxisLog,
    estimate: FrictionEstimate,
    *,
    inertia: float | None = None,
    load_inertia: float | None = None,
    stiffness: float | None = None,
) -> Resimulation | None:
    """Return the motion of the identified axis under the logged effort.

    It starts anew from the smoothed measured state twenty times.

    Parameters
    ----------
    log
        The measurement.
    estimate
        Of any estimator.
    inertia, load_inertia, stiffness
        Of the axis, where the estimate does not hold them [kg or kg m^2, kg or kg m^2, N/m or
        N m/rad].

    Returns
    -------
    None if a parameter is missing, or the mass is not positive.

    Raises
    ------
    InputError
        If the log is too short, or lacks the load of a flexible arm.
    """
    values = _values(estimate, inertia)
    if values is None:
        return None
    mass = values.get("mass", values.get("inertia", 0.0))
    if mass <= 0.0:
        return None
    balance = EnergyEstimator(
        inertia=mass,
        load_inertia=values.get("load_mass", values.get("load_inertia", load_inertia)),
        stiffness=values.get("stiffness", stiffness),
        per_direction=_per_direction(estimate),
        offset="offset" in values,
        stribeck=_effect(estimate),
    )
    return resimulate(log, identified_plant(estimate, balance), balance)


def _values(estimate: FrictionEstimate, inertia: float | None) -> dict[str, float] | None:
    """Return the parameters of the identified axis; None if one is missing."""
    body = "mass" if estimate.kind == "linear" else "inertia"
    values = {} if inertia is None else {body: inertia}
    for name, parameter in estimate.parameters.items():
        if parameter.value is not None:
            values[name] = parameter.value
        elif not name.startswith(_OPTIONAL):
            return None
    return values if body in values else None


def _per_direction(estimate: FrictionEstimate) -> bool:
    return any(name.endswith("_positive") for name in estimate.parameters)


def _effect(estimate: FrictionEstimate) -> StribeckEffect | None:
    """Return how the step from static to Coulomb friction fades, if the estimate holds both."""
    held = estimate.parameters.get("stribeck_velocity")
    if held is None or held.value is None:
        return None
    return StribeckEffect(
        velocity=held.value,
        shape=estimate.provenance.options.get("shape", "gaussian"),
    )
