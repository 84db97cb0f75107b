"""The motion of the driven mass with its friction as a free force: nothing is assumed of any law.

The known inertia ties position, velocity and force together; the friction may go wherever it likes
(a random walk). The Kalman smoother of that is the motion that the sensors show, with as little of
their noise as can be without knowing the friction.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.free_smoother import FreeAxis, Shown, likeliest_rate

__all__ = ["FreeMotion", "free_motion", "roaming"]

Measured = tuple[Float[np.ndarray, " _"], Float[np.ndarray, " _"] | None, Float[np.ndarray, " _"]]
"""Position, velocity if it is measured, and force."""


@dataclass(frozen=True, kw_only=True)
class FreeMotion:
    """What `free_motion` finds.

    Attributes
    ----------
    position, velocity
        Of the driven mass [m or rad, m/s or rad/s], shape (n,).
    friction
        Force that the motion leaves to friction [N or N m], shape (n,).
    velocity_spread
        Standard deviation of the velocity [m/s or rad/s], shape (n,).
    """

    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    friction: Float[np.ndarray, " n"]
    velocity_spread: Float[np.ndarray, " n"]


def roaming(
    stretches: Sequence[Measured], inertia: float, sampling_time: float, noise: tuple[float, float]
) -> float:
    """Return the intensity of the friction's rate of change that makes a log likeliest.

    Parameters
    ----------
    stretches
        Position, velocity and force of each stretch of the log, as `free_motion` takes them.
    inertia
        [kg or kg m^2].
    sampling_time
        [s].
    noise
        Standard deviations of position and velocity [m or rad, m/s or rad/s].

    Returns
    -------
    Spectral density of the rate [N^2/s or (N m)^2/s].
    """
    shown = [shown_by_mass(*stretch, inertia, sampling_time, noise) for stretch in stretches]
    axis = FreeAxis.of(inertia=inertia, sampling_time=sampling_time)
    typical = sum(one.force_squared for one in shown) / sum(one.duration for one in shown) ** 2
    return likeliest_rate(typical, lambda rate: sum(axis.cost(one, rate) for one in shown))


def free_motion(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"] | None,
    force: Float[np.ndarray, " n"],
    inertia: float,
    sampling_time: float,
    noise: tuple[float, float],
    rate: float,
) -> FreeMotion:
    """Return the motion with a friction that roams at a given rate.

    Parameters
    ----------
    x, v
        Measured position and velocity [m or rad, m/s or rad/s]; v may be None.
    force
        On the driven mass but for friction, held over each sample [N or N m].
    inertia, sampling_time, noise
        As `roaming` takes them.
    rate
        What `roaming` returns.
    """
    shown = shown_by_mass(x, v, force, inertia, sampling_time, noise)
    axis = FreeAxis.of(inertia=inertia, sampling_time=sampling_time)
    smooth = axis.smoothed(shown, rate, np.ones(x.size), (1,))
    return FreeMotion(
        position=smooth[:, 0],
        velocity=smooth[:, 1],
        friction=smooth[:, 2],
        velocity_spread=smooth[:, 3],
    )


def shown_by_mass(
    x: Float[np.ndarray, " n"],
    v: Float[np.ndarray, " n"] | None,
    force: Float[np.ndarray, " n"],
    inertia: float,
    sampling_time: float,
    noise: tuple[float, float],
) -> Shown:
    """Return what the sensors of the driven mass show.

    Parameters
    ----------
    x, v, force, inertia, sampling_time, noise
        As `free_motion` takes them.
    """
    variances = noise[0] ** 2, noise[1] ** 2
    fastest = float(np.max(np.abs(np.diff(x)))) / sampling_time
    duration = x.size * sampling_time
    measured = (x,) if v is None else (x, v)
    return Shown(
        measured=np.column_stack(measured),
        channels=np.array([(float(k), variances[k]) for k in range(len(measured))]),
        first=np.array([variances[0], fastest**2 if v is None else variances[1]]),
        force=force,
        force_squared=sampling_time * float(np.sum(force**2)) + (inertia * fastest) ** 2 / duration,
        duration=duration,
    )
