"""Unexplained effort and resimulated motion of any estimate.

The plant that is simulated has the friction of the estimate, as far as a plant can have it.
"""

from collections.abc import Sequence
from dataclasses import asdict

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.energy.levels import EnergyLevels
from stickslip.estimation.figures import LARGEST_PLOT
from stickslip.estimation.regression.idim import IdimLeastSquares, identified_law
from stickslip.estimation.selection.evaluation.prediction import prediction_error
from stickslip.friction import StribeckEffect, StribeckFriction
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import AxisLog, FrictionEstimate, Resimulation, mass_name, quantity_name
from stickslip.simulation import simulate

_RESTARTS = 20  # in a log: small force errors add up to large position errors over a whole log
OPTIONAL = ("static_friction", "stribeck_velocity")
"""Without these an estimate is that of a law without a step from static to Coulomb friction."""
_SIMULATED = frozenset(
    {
        *("mass", "inertia", "load_mass", "load_inertia", "stiffness", "offset"),
        *("viscous_friction", "coulomb_friction", "static_friction", "stribeck_velocity"),
    }
)


def can_simulate(estimate: FrictionEstimate) -> bool:
    """Return whether energy balance and simulator have every term of an estimate."""
    return {quantity_name(name) for name in estimate.parameters} <= _SIMULATED


def unexplained_effort(
    log: AxisLog, estimate: FrictionEstimate, *, inertia: float | None = None
) -> float | None:
    """Return what an estimate leaves of the effort of a rigid axis.

    Norm of effort less inertia force, friction and offset over norm of the effort, both smoothed
    and decimated as `IdimLeastSquares` does it, and without rows at rest. Of an estimate with
    further terms (spring, drift, delay ...) both are means over the windows of the selected model.

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
    The share [-]; None if a parameter is missing, or the smoothed rows hold no effort.

    Raises
    ------
    InputError
        If the log is too short, or nothing moves or pushes in it; or an estimate with further terms
        is of several logs or of another kind of axis.
    """
    values = _values(estimate, inertia)
    if values is None:
        return None
    if not can_simulate(estimate):
        known = all(parameter.value is not None for parameter in estimate.parameters.values())
        return prediction_error(estimate, log, inertia=inertia) if known else None
    rows = IdimLeastSquares(
        per_direction=_per_direction(estimate),
        offset="offset" in values,
        stribeck=identified_effect(estimate),
    ).regression(log)
    law = np.array([values.get(name, 0.0) for name in rows.names])
    size = float(np.linalg.norm(rows.target))
    residual = rows.target - rows.regressors @ law
    return float(np.linalg.norm(residual)) / size if size > 0.0 else None


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
    None if a parameter is missing, the simulator lacks a term of the estimate, or the mass is not
    positive.

    Raises
    ------
    InputError
        If the log is too short, or lacks the load of a flexible arm.
    """
    if not can_simulate(estimate):
        return None
    balance = identified_balance(
        estimate, inertia=inertia, load_inertia=load_inertia, stiffness=stiffness
    )
    if balance is None:
        return None
    return resimulate(identified_plant(estimate, balance), balance.levels(log))


def identified_balance(
    estimate: FrictionEstimate,
    *,
    inertia: float | None = None,
    load_inertia: float | None = None,
    stiffness: float | None = None,
    stribeck: StribeckEffect | None = None,
    cutoff: float | None = None,
    filter_order: int = 4,
) -> EnergyEstimator | None:
    """Return the energy balance of the identified axis; None if it lacks a parameter or its mass.

    Inertia, load inertia, stiffness and Stribeck effect are those of the axis where the estimate
    does not hold them. Cutoff [Hz] and order are of the low-pass for noisy signals.
    """
    values = _values(estimate, inertia)
    if values is None:
        return None
    mass = values.get("mass", values.get("inertia", 0.0))
    if mass <= 0.0:
        return None
    return EnergyEstimator(
        inertia=mass,
        load_inertia=values.get("load_mass", values.get("load_inertia", load_inertia)),
        stiffness=values.get("stiffness", stiffness),
        per_direction=_per_direction(estimate),
        offset="offset" in values,
        stribeck=identified_effect(estimate) if stribeck is None else stribeck,
        cutoff=cutoff,
        filter_order=filter_order,
    )


def identified_plant(estimate: FrictionEstimate, balance: EnergyEstimator) -> Plant:
    """Return the plant of an estimate, with the known parameters of its balance."""
    values = {name: p.value or 0.0 for name, p in estimate.parameters.items()}
    inertia = values.get("mass", values.get("inertia", balance.inertia or 0.0))
    law = identified_law(values)
    for effect in balance.terms.stribeck:
        law = StribeckFriction(**asdict(law), stribeck_velocity=effect.velocity, shape=effect.shape)
    if balance.load_inertia is None or balance.stiffness is None:
        return SingleMass(mass=inertia, friction=law, kind=estimate.kind)
    return FlexibleArm(
        mass_1=inertia,
        mass_2=balance.load_inertia,
        stiffness=balance.stiffness,
        friction=law,
        kind=estimate.kind,
    )


def resimulate(plant: Plant, stretches: Sequence[tuple[EnergyLevels, AxisLog]]) -> Resimulation:
    """Simulate the identified plant under the logged effort, restarted twenty times.

    Each piece starts from the smoothed measured state. The stretches are those of
    `EnergyEstimator.levels`: smoothed, and as measured.
    """
    T = stretches[0][1].sampling_time
    horizon = max(sum(len(part) for _, part in stretches) // _RESTARTS, 1)
    pieces: list[Float[np.ndarray, "5 n"]] = []
    for levels, part in stretches:
        velocity = levels.motion.smooth_velocity
        started = np.where(levels.motion.resting, 0.0, velocity)
        states = [levels.motion.position, started]
        if levels.load is not None:
            states += [levels.load.position, levels.load.smooth_velocity]
        simulated = np.empty((2, len(part)))
        for start in range(0, len(part), horizon):
            piece = slice(start, start + horizon)
            state = tuple(float(each[start]) for each in states)
            motion = simulate(plant, part.effort[piece], sampling_time=T, initial_state=state)
            simulated[:, piece] = motion.position[:-1], motion.velocity[:-1]
        measured = velocity if part.measured_velocity is None else part.measured_velocity
        pieces.append(
            np.vstack([part.time, part.measured_position, simulated[0], measured, simulated[1]])
        )
    time, position, model, measured_velocity, model_velocity = np.hstack(pieces)
    misfit = np.linalg.norm(position - model) / np.linalg.norm(position - position.mean())
    step = -(-time.size // LARGEST_PLOT)
    return Resimulation(
        time=time[::step],
        measured_position=position[::step],
        simulated_position=model[::step],
        measured_velocity=measured_velocity[::step],
        simulated_velocity=model_velocity[::step],
        horizon=horizon * T,
        fit=1.0 - float(misfit),
    )


def _values(estimate: FrictionEstimate, inertia: float | None) -> dict[str, float] | None:
    """Return the parameters of the identified axis; None if one is missing."""
    body = mass_name(estimate.kind)
    values = {} if inertia is None else {body: inertia}
    for name, parameter in estimate.parameters.items():
        if parameter.value is not None:
            values[name] = parameter.value
        elif not name.startswith(OPTIONAL):
            return None
    return values if body in values else None


def _per_direction(estimate: FrictionEstimate) -> bool:
    return any(name.endswith("_positive") for name in estimate.parameters)


def identified_effect(estimate: FrictionEstimate) -> StribeckEffect | None:
    """Return how the step from static to Coulomb friction fades, if the estimate holds it."""
    held = estimate.parameters.get("stribeck_velocity")
    static = [p for name, p in estimate.parameters.items() if name.startswith("static_friction")]
    if held is None or held.value is None or not all(p.identified for p in static):
        return None
    shape = estimate.provenance.options.get("shape", "gaussian")
    return StribeckEffect(velocity=held.value, shape=shape)
