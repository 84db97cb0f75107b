"""The motion that an identified axis makes under the logged effort, beside the measured one."""

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy import EnergyEstimator
from stickslip.friction import CoulombViscousFriction, StribeckFriction
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import AxisLog, FrictionEstimate, Resimulation
from stickslip.simulation import simulate

__all__ = ["identified_plant", "resimulate"]

HORIZONS = 20
"""Restarts in a log: small force errors add up to large position errors over a whole log."""

LARGEST_PLOT = 4000
"""Points beyond which a curve only gets heavier, not clearer."""


def identified_plant(estimate: FrictionEstimate, balance: EnergyEstimator) -> Plant:
    """Return the plant that an estimate describes.

    Static friction that is not estimated is taken equal to Coulomb friction, and a negative
    estimate as zero.

    Parameters
    ----------
    estimate
        All of whose parameters are identified.
    balance
        What is known of the axis: its inertia, if it was not estimated, and its load.
    """
    values = {name: p.value or 0.0 for name, p in estimate.parameters.items()}
    known = balance.inertia or 0.0
    inertia = values.get("mass", values.get("inertia", known))

    def side(term: str, which: str) -> float:
        return max(values.get(f"{term}_{which}", values.get(term, 0.0)), 0.0)

    forward, backward = side("coulomb_friction", "positive"), side("coulomb_friction", "negative")
    magnitudes = {
        "coulomb_friction_positive": forward,
        "coulomb_friction_negative": backward,
        "static_friction_positive": max(side("static_friction", "positive"), forward),
        "static_friction_negative": max(side("static_friction", "negative"), backward),
        "viscous_friction_positive": side("viscous_friction", "positive"),
        "viscous_friction_negative": side("viscous_friction", "negative"),
        "offset": values.get("offset", 0.0),
    }
    law = CoulombViscousFriction(**magnitudes)
    for effect in balance.terms.stribeck:
        law = StribeckFriction(**magnitudes, stribeck_velocity=effect.velocity, shape=effect.shape)
    if balance.load_inertia is None or balance.stiffness is None:
        return SingleMass(mass=inertia, friction=law, kind=estimate.kind)
    return FlexibleArm(
        mass_1=inertia,
        mass_2=balance.load_inertia,
        stiffness=balance.stiffness,
        friction=law,
        kind=estimate.kind,
    )


def resimulate(log: AxisLog, plant: Plant, balance: EnergyEstimator) -> Resimulation:
    """Simulate the identified plant under the logged effort, restarted twenty times.

    Each piece starts from the smoothed measured state.

    Parameters
    ----------
    log
        The measurement.
    plant
        The identified axis.
    balance
        How the log's motion is smoothed.
    """
    T = log.sampling_time
    horizon = max(len(log) // HORIZONS, 1)
    pieces: list[Float[np.ndarray, "5 n"]] = []
    for levels, part in balance.levels(log):
        position, velocity = levels.motion.position, levels.motion.smooth_velocity
        started = np.where(levels.motion.resting, 0.0, velocity)
        simulated = np.empty((2, len(part)))
        for start in range(0, len(part), horizon):
            stop = min(start + horizon, len(part))
            state: tuple[float, ...] = (float(position[start]), float(started[start]))
            if levels.load is not None:
                load_velocity = float(levels.load.smooth_velocity[start])
                state = (*state, float(levels.load.position[start]), load_velocity)
            motion = simulate(plant, part.effort[start:stop], sampling_time=T, initial_state=state)
            simulated[:, start:stop] = motion.position[:-1], motion.velocity[:-1]
        shown = velocity if part.measured_velocity is None else part.measured_velocity
        pieces.append(
            np.vstack([part.time, part.measured_position, simulated[0], shown, simulated[1]])
        )
    time, measured, model, measured_velocity, model_velocity = np.hstack(pieces)
    fit = 1.0 - float(np.linalg.norm(measured - model) / np.linalg.norm(measured - measured.mean()))
    step = -(-time.size // LARGEST_PLOT)
    return Resimulation(
        time=time[::step],
        measured_position=measured[::step],
        simulated_position=model[::step],
        measured_velocity=measured_velocity[::step],
        simulated_velocity=model_velocity[::step],
        horizon=horizon * T,
        fit=fit,
    )
