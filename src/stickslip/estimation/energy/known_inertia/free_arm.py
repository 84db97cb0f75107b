"""The motion of a flexible arm whose load's position is not measured, friction being a free force.

As in `stickslip.estimation.energy.known_inertia.free_friction` the friction may go wherever it
likes. The load has only the spring to go by, so that where the driven mass went says how the load
was pulled, and how the driven mass was pulled says where the load is: the Kalman smoother of the
known masses and spring finds both, and where the load began.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.free_friction import FreeMotion, shown_by_mass
from stickslip.estimation.energy.known_inertia.free_smoother import FreeAxis, Shown, likeliest_rate
from stickslip.records import AxisLog

__all__ = ["ArmMotion", "ArmSensors", "arm_motions", "smoothed_arm"]

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
