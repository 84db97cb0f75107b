"""A flexible arm whose load's position is not measured: its motion, friction being a free force.

As in `stickslip.estimation.energy.known_inertia.free_motion` the friction is a random walk. The
load has only the spring to go by, so that the path of the driven mass shows how the load was
pulled, and the pull on the driven mass shows where the load is: the Kalman smoother of the known
masses and spring estimates both, and where the load began.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.free_motion import (
    FreeAxis,
    FreeMotion,
    Shown,
    likeliest_rate,
    shown_by_mass,
)
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.signals.kinematics import noise_level
from stickslip.records import AxisLog

__all__ = [
    "LEAST_NOISE",
    "ROUNDING",
    "ArmMotion",
    "ArmSensors",
    "arm_motions",
    "arms_of",
    "lengths_of_runs",
    "load_reconstruction_note",
    "load_seen",
    "smoothed_arm",
]

ROUNDING = 1e-7  # of the largest value: noise that a log without any is taken to have
LEAST_NOISE = 1e-150  # of a signal that is zero throughout
_WITHIN_95 = 1.96  # standard deviations
_LOAD_VELOCITY = 3  # number of that state
_SPREADS_OF = (1, 2)  # velocity of the driven mass, position of the load
_ANYTHING = 1e4  # times faster than elsewhere, where friction may be anything
_LARGER = 10.0
"""How many times what the log shows the load may be stretched, or as fast, when it begins."""


@dataclass(frozen=True, kw_only=True)
class ArmMotion(FreeMotion):
    """What `arm_motions` finds; `friction` is without the spring.

    Attributes
    ----------
    load_position, load_velocity
        Of the load [m or rad, m/s or rad/s], shape (n,).
    load_spread
        Standard deviation of the load's position [m or rad], shape (n,).
    """

    load_position: Float[np.ndarray, " n"]
    load_velocity: Float[np.ndarray, " n"]
    load_spread: Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class ArmSensors(Shown):
    """What the sensors of an arm show while nothing measures the load's position.

    Attributes
    ----------
    origin
        First measured position of the driven mass, which the others are counted from [m or rad].
    """

    origin: float

    @classmethod
    def of(
        cls,
        part: AxisLog,
        *,
        inertia: float,
        load_inertia: float,
        stiffness: float,
        noise: tuple[float, float],
        load_velocity_noise: float,
    ) -> "ArmSensors":
        """Return what the sensors show in a stretch of a log.

        The load begins anywhere, as fast as it likes.

        Parameters
        ----------
        part
            Without gaps.
        inertia, load_inertia, stiffness
            Of the arm [SI].
        noise
            Standard deviations of position and velocity of the driven mass.
        load_velocity_noise
            That of the velocity of the load, if it is measured.
        """
        T, x, v2 = part.sampling_time, part.measured_position, part.measured_load_velocity
        own = shown_by_mass(x - x[0], part.measured_velocity, part.effort, inertia, T, noise)
        stretched = _LARGER * (float(np.ptp(x)) + float(np.max(np.abs(part.effort))) / stiffness)
        fastest = float(np.max(np.abs(np.diff(x)))) / T
        swinging = np.sqrt(stiffness / load_inertia) * stretched + fastest
        measured, channels = own.measured, own.channels
        if v2 is not None:
            swinging = load_velocity_noise
            measured = np.column_stack([measured, v2])
            channels = np.vstack([channels, (float(_LOAD_VELOCITY), load_velocity_noise**2)])
        return cls(
            origin=float(x[0]),
            measured=measured,
            channels=channels,
            first=np.append(own.first, (stretched**2, swinging**2)),
            force=own.force,
            force_squared=own.force_squared,
            duration=own.duration,
        )


def arm_motions(
    stretches: Sequence[ArmSensors],
    *,
    inertia: float,
    load_inertia: float,
    stiffness: float,
    sampling_time: float,
    direction: Callable[[ArmMotion], Float[np.ndarray, " n"]],
) -> list[ArmMotion]:
    """Return the motion of every stretch, with one rate at which friction roams for all.

    A mass that sticks is held by whatever force the spring has, which no walk is likely to follow:
    where the first look leaves the direction of friction uncertain, the second lets friction be
    anything, so that the load is found from the rest alone.

    Parameters
    ----------
    stretches
        What the sensors show.
    inertia, load_inertia, stiffness
        Of the arm [SI].
    sampling_time
        [s].
    direction
        Returns 1 where the direction of friction is uncertain and 0 elsewhere.
    """
    axis = FreeAxis.of(
        inertia=inertia,
        load_inertia=load_inertia,
        stiffness=stiffness,
        sampling_time=sampling_time,
    )
    typical = sum(s.force_squared for s in stretches) / sum(s.duration for s in stretches) ** 2
    rate = likeliest_rate(typical, lambda rate: sum(axis.cost(s, rate) for s in stretches))
    motions: list[ArmMotion] = []
    for s in stretches:
        look = smoothed_arm(axis, s, rate, np.ones(s.force.size))
        second = smoothed_arm(axis, s, rate, 1.0 + _ANYTHING * direction(look))
        motions.append(
            replace(
                look,
                load_position=second.load_position,
                load_velocity=second.load_velocity,
                load_spread=second.load_spread,
            )
        )
    return motions


def smoothed_arm(
    axis: FreeAxis, sensors: ArmSensors, rate: float, freedom: Float[np.ndarray, " n"]
) -> ArmMotion:
    """Return the motion of one stretch.

    Parameters
    ----------
    axis
        The arm.
    sensors
        What they show.
    rate
        At which friction roams [N^2/s or (N m)^2/s].
    freedom
        Factor of that in each sample.
    """
    x, v, x2, v2, f, v_spread, x2_spread = axis.smoothed(sensors, rate, freedom, _SPREADS_OF).T
    return ArmMotion(
        position=sensors.origin + x,
        velocity=v,
        friction=f,
        velocity_spread=v_spread,
        load_position=sensors.origin + x2,
        load_velocity=v2,
        load_spread=x2_spread,
    )


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


def load_reconstruction_note(part: AxisLog, motions: Sequence[FreeMotion]) -> tuple[str, ...]:
    """Return what a user should know of a load that was reconstructed.

    Parameters
    ----------
    part
        One stretch of the log.
    motions
        Of all stretches; the note is empty unless they are those of such an arm.
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
