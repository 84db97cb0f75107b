"""A load whose position is not measured: what the sensors show then, and what is said of it."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.free_arm import ArmMotion, ArmSensors
from stickslip.estimation.energy.known_inertia.free_friction import FreeMotion
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.records import AxisLog

__all__ = ["LEAST_NOISE", "ROUNDING", "arms_of", "lengths_of_runs", "load_seen", "said_of_load"]

ROUNDING = 1e-7  # of the largest value: noise that a log without any is taken to have
LEAST_NOISE = 1e-150  # of a signal that is zero throughout
_WITHIN_95 = 1.96  # standard deviations


def load_seen(parts: Sequence[AxisLog], model: AxisModel) -> bool:
    """Return whether there is a load and its position is measured.

    Parameters
    ----------
    parts
        Stretches of a log without gaps.
    model
        What is known of the axis.
    """
    return model.load_inertia is not None and parts[0].measured_load_position is not None


def arms_of(
    parts: Sequence[AxisLog], model: AxisModel, noise: Sequence[tuple[float, float]]
) -> list[ArmSensors]:
    """Return what the sensors of an arm show whose load's position is not measured, else nothing.

    Noise of a velocity of the load is what varies from sample to sample in it.

    Parameters
    ----------
    parts
        Stretches of a log without gaps.
    model
        What is known of the axis.
    noise
        Standard deviations on position and velocity of the driven mass, first of all.
    """
    arm = (model.inertia, model.load_inertia, model.stiffness)
    if None in arm or load_seen(parts, model):
        return []
    velocities = [part.measured_load_velocity for part in parts]
    seen = [v for v in velocities if v is not None]
    velocity = np.concatenate(seen) if seen else np.zeros(1)
    load_noise = max(
        noise_level(velocity) if seen else 0.0,
        ROUNDING * float(np.max(np.abs(velocity))),
        LEAST_NOISE,
    )
    return [
        ArmSensors.of(
            part,
            inertia=model.inertia or 0.0,
            load_inertia=model.load_inertia or 0.0,
            stiffness=model.stiffness or 0.0,
            noise=noise[0],
            load_velocity_noise=load_noise,
        )
        for part in parts
    ]


def said_of_load(part: AxisLog, motions: Sequence[FreeMotion]) -> tuple[str, ...]:
    """Return what a user should know of a load that was reconstructed.

    Parameters
    ----------
    part
        One stretch of the log.
    motions
        What was found of all; nothing is said unless they are those of such an arm.
    """
    arms = [motion for motion in motions if isinstance(motion, ArmMotion)]
    if not arms:
        return ()
    half = _WITHIN_95 * float(np.median(np.concatenate([arm.load_spread for arm in arms])))
    unit = part.unit("position")
    reconstructed = (
        "the position of the load is not measured: it is reconstructed from the motion of the "
        f"driven mass, to +-{half:.2g} {unit} (95 %) if both masses and the stiffness are right"
    )
    way = float(np.sqrt(np.mean([np.var(arm.load_position) for arm in arms])))
    if half < way:
        return (reconstructed,)
    return (
        f"{reconstructed}; that is no better than not knowing it, as it moves by {way:.2g} {unit} "
        "rms: friction is found without it, where an interval is given, but energies and the "
        "simulated motion are not to be relied on; measure the load's position, or record a longer "
        "motion that shakes the load",
    )


def lengths_of_runs(unknown: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return, for each sample, how many in a row are like it.

    Parameters
    ----------
    unknown
        0 or 1.
    """
    turns = np.flatnonzero(np.diff(unknown)) + 1
    runs = np.diff(np.concatenate([[0], turns, [unknown.size]]))
    return np.repeat(runs, runs).astype(np.float64)
