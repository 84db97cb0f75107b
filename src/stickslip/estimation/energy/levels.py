"""Energies of an axis over time, and the regressors of their loss.

Source: van de Wijdeven (2002), part A, Eqs. 3.1-4.4.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.signals.kinematics import LowPass, central_difference
from stickslip.estimation.signals.observation import (
    MotionNoise,
    ObservedMotion,
    fuse,
    motion_noise,
    observe,
)
from stickslip.friction import FrictionTerms
from stickslip.records import AxisLog, InputError

__all__ = ["AxisModel", "EnergyLevels", "energy_levels", "load_position", "summed"]


@dataclass(frozen=True, kw_only=True)
class AxisModel:
    """What is known of an axis, and what is sought.

    Attributes
    ----------
    inertia
        Of the (first) mass [kg or kg m^2], or None if it is sought.
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis.
    terms
        The friction parameters that are sought.
    """

    inertia: float | None
    load_inertia: float | None
    stiffness: float | None
    terms: FrictionTerms


@dataclass(frozen=True, kw_only=True)
class EnergyLevels:
    """Energies of one stretch without gaps, one value a sample, and what explains them.

    Attributes
    ----------
    time
        [s], shape (n,).
    input, kinetic, potential
        Energies [J], shape (n,). Kinetic holds what is known of it: an inertia that is sought
        counts as a regressor.
    regressors
        Integrated from the start of the stretch, shape (n, p) [J per unit of each parameter].
    noise
        Variance that the sensors' noise gives each level of the balance, shape (n,) [J^2].
    walk
        Variance that it adds up to from sample to sample, shape (n-1,) [J^2].
    motion
        Of the (first) mass.
    load
        Of the second mass of a flexible arm, or None.
    spring_force
        Of the spring on the driven mass [N or N m], shape (n,); zero for a rigid axis.
    """

    time: Float[np.ndarray, " n"]
    input: Float[np.ndarray, " n"]
    kinetic: Float[np.ndarray, " n"]
    potential: Float[np.ndarray, " n"]
    regressors: Float[np.ndarray, "n p"]
    noise: Float[np.ndarray, " n"]
    walk: Float[np.ndarray, " n-1"]
    motion: ObservedMotion
    load: "LoadMotion | None"
    spring_force: Float[np.ndarray, " n"]

    @property
    def dissipated(self) -> Float[np.ndarray, " n"]:
        """Measured dissipation, input less kinetic less potential energy [J] (Eq. 4.4)."""
        return self.input - self.kinetic - self.potential


@dataclass(frozen=True, kw_only=True)
class LoadMotion:
    """Motion of the second mass of a flexible arm.

    Attributes
    ----------
    position
        Fused or filtered [m or rad], shape (n,).
    velocity, smooth_velocity
        As measured (or differentiated) and low-passed [m/s or rad/s], shape (n,).
    noise
        Of its measurements.
    """

    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    smooth_velocity: Float[np.ndarray, " n"]
    noise: MotionNoise


def summed(increments: Float[np.ndarray, "m p"]) -> Float[np.ndarray, "n p"]:
    """Return running sums that begin with zero."""
    return np.concatenate([np.zeros((1, increments.shape[1])), np.cumsum(increments, axis=0)])


def energy_levels(
    part: AxisLog, model: AxisModel, low_pass: LowPass, noise: MotionNoise, sampling_time: float
) -> EnergyLevels:
    """Return the energies of one stretch (settled forms of Eqs. 3.6-4.4).

    Parameters
    ----------
    part
        Without gaps.
    model
        What is known of the axis.
    low_pass
        What smooths.
    noise
        Of the measurements of the (first) mass.
    sampling_time
        [s].

    Raises
    ------
    InputError
        If the model has a load and the log does not hold its position.
    """
    T = sampling_time
    motion = observe(part, low_pass, noise, T)
    x, v = motion.position, motion.velocity
    work = summed((part.effort[:-1] * np.diff(x))[:, None])[:, 0]
    regressors = summed(
        model.terms.energy_columns(
            motion.velocity_squared,
            motion.path,
            np.diff(x),
            motion.direction,
            motion.smooth_velocity,
        )
    )
    kinetic, potential, spring = np.zeros(len(part)), np.zeros(len(part)), np.zeros(len(part))
    load = None
    if model.load_inertia is not None and model.stiffness is not None:
        load = _load_motion(part, low_pass, T)
        kinetic = 0.5 * model.load_inertia * load.velocity**2
        spring = model.stiffness * (x - load.position)
        potential = 0.5 * spring**2 / model.stiffness
    if model.inertia is None:
        unit = 0.5 * motion.smooth_velocity**2
        regressors = np.column_stack([unit - unit[0], regressors])
    else:
        kinetic = kinetic + 0.5 * model.inertia * v**2
    rough = _rough_axis(model, regressors, work - kinetic - potential)
    white, walk = _sensor_noise(part, motion, spring, noise, rough, T, low_pass)
    if load is not None and model.load_inertia is not None:
        shift = _period(low_pass, T)
        white += _kinetic_noise(
            model.load_inertia, load.smooth_velocity, load.noise.used_velocity, shift
        )
        white += (spring * load.noise.smooth_position) ** 2
    return EnergyLevels(
        time=part.time,
        input=work,
        kinetic=kinetic,
        potential=potential,
        regressors=regressors,
        noise=white,
        walk=walk,
        motion=motion,
        load=load,
        spring_force=spring,
    )


def load_position(log: AxisLog) -> Float[np.ndarray, " n"]:
    """Return the measured position of the load [m or rad].

    Raises
    ------
    InputError
        If the log does not hold it.
    """
    if log.measured_load_position is None:
        raise InputError(
            "the log holds no position of the load, which a flexible arm needs",
            where=log.name,
            remedy="map the load's position, leave out load inertia and stiffness, or give the "
            "energy estimator the inertia of the driven side too: it then reconstructs the load",
        )
    return log.measured_load_position


def _load_motion(part: AxisLog, low_pass: LowPass, sampling_time: float) -> LoadMotion:
    T = sampling_time
    position, velocity = load_position(part), part.measured_load_velocity
    noise = motion_noise(position, velocity, low_pass, T)
    if velocity is None:
        position = low_pass.apply(position, T)
        velocity = central_difference(position, T)
    else:
        position = fuse(position, velocity, noise.position, noise.velocity, T)
    smooth = low_pass.apply(velocity, T) if noise.noisy else velocity
    return LoadMotion(position=position, velocity=velocity, smooth_velocity=smooth, noise=noise)


@dataclass(frozen=True, kw_only=True)
class _RoughAxis:
    """Parameters good enough to weigh noise with."""

    inertia: float
    viscous: float
    coulomb: float
    offset: float


def _rough_axis(
    model: AxisModel, regressors: Float[np.ndarray, "n p"], dissipated: Float[np.ndarray, " n"]
) -> _RoughAxis:
    """Fit the levels without any weights."""
    columns = np.column_stack([regressors, np.ones(dissipated.size)])
    fitted = least_squares(columns, dissipated)
    values = fitted.tolist()
    inertia = abs(values.pop(0)) if model.inertia is None else model.inertia
    found = dict(zip(model.terms.names, values, strict=False))

    def magnitude(term: str) -> float:
        return float(np.mean([abs(a) for name, a in found.items() if name.startswith(term)]))

    return _RoughAxis(
        inertia=inertia,
        viscous=magnitude("viscous"),
        coulomb=magnitude("coulomb"),
        offset=found.get("offset", 0.0),
    )


def _sensor_noise(
    part: AxisLog,
    motion: ObservedMotion,
    spring: Float[np.ndarray, " n"],
    noise: MotionNoise,
    rough: _RoughAxis,
    sampling_time: float,
    low_pass: LowPass,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n-1"]]:
    """Return the variances that noise on the (first) mass gives the energy balance [J^2].

    White in the level: that of the kinetic energy, and position noise times the force that acts.
    Adding up from sample to sample: position noise times the change of that force (summation by
    parts of sum u dx), and velocity noise in the viscous regressor.
    """
    T = sampling_time
    speed = motion.smooth_velocity
    white = _kinetic_noise(rough.inertia, speed, noise.used_velocity, _period(low_pass, T))
    net = part.effort[:-1] - rough.offset - rough.coulomb * motion.direction
    acting = np.concatenate([net, net[-1:]]) - spring
    white += (acting * noise.smooth_position) ** 2
    walk = (np.diff(net, prepend=net[:1]) * noise.smooth_position) ** 2
    walk += (2.0 * rough.viscous * T * speed[:-1] * noise.velocity) ** 2
    return white, walk


def _period(low_pass: LowPass, sampling_time: float) -> int:
    return max(round(1.0 / (low_pass.cutoff * sampling_time)), 1)


def _kinetic_noise(
    inertia: float, velocity: Float[np.ndarray, " n"], noise: float, shift: int
) -> Float[np.ndarray, " n"]:
    """Return the variance of a kinetic energy [J^2] from noise of its velocity.

    The velocity is taken some samples earlier and later: a weight that knew the error of its own
    sample would favour errors of one sign.
    """
    padded = np.pad(velocity**2, shift, mode="edge")
    square = 0.5 * (padded[: velocity.size] + padded[2 * shift :])
    return (inertia * noise) ** 2 * (square + 0.5 * noise**2)
