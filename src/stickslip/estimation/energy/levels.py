"""Energies of an axis over time, and the regressors of their loss.

Source: van de Wijdeven (2002), part A, Eqs. 3.1-4.4.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.observation import (
    MotionNoise,
    ObservedMotion,
    motion_noise,
    observe,
    smoothed,
)
from stickslip.friction import FrictionTerms
from stickslip.records import AxisLog, InputError


@dataclass(frozen=True, kw_only=True)
class AxisModel:
    """Known parameters of an axis, and the friction parameters that are sought."""

    inertia: float | None  # of the (first) mass [kg or kg m^2]; None if it is sought
    load_inertia: float | None = None  # of a flexible arm [kg or kg m^2]
    stiffness: float | None = None  # of its spring [N/m or N m/rad]
    terms: FrictionTerms = FrictionTerms(per_direction=False, offset=False)

    @property
    def driven(self) -> float:
        """Inertia of the (first) mass [kg or kg m^2]; 0 if it is sought."""
        return 0.0 if self.inertia is None else self.inertia


@dataclass(frozen=True, kw_only=True)
class LoadMotion:
    """Motion of the second mass of a flexible arm."""

    position: Float[np.ndarray, " n"]  # fused or filtered [m or rad]
    velocity: Float[np.ndarray, " n"]  # as measured or differentiated [m/s or rad/s]
    smooth_velocity: Float[np.ndarray, " n"]  # low-passed [m/s or rad/s]
    noise: MotionNoise  # of its measurements


@dataclass(frozen=True, kw_only=True)
class EnergyLevels:
    """Energies of one stretch without gaps [J], one value a sample, and what explains them."""

    time: Float[np.ndarray, " n"]  # [s]
    input: Float[np.ndarray, " n"]
    kinetic: Float[np.ndarray, " n"]  # of the known masses; that of a sought one is a regressor
    potential: Float[np.ndarray, " n"]
    regressors: Float[np.ndarray, "n p"]  # from the start of the stretch [J per unit of parameter]
    noise: Float[np.ndarray, " n"]  # variance of each level of the balance from sensor noise [J^2]
    walk: Float[np.ndarray, " n-1"]  # variance that it adds up to from sample to sample [J^2]
    motion: ObservedMotion  # of the (first) mass
    load: LoadMotion | None  # of the second mass of a flexible arm
    spring_force: Float[np.ndarray, " n"]  # on the driven mass [N or N m]; 0 for a rigid axis

    @property
    def dissipated(self) -> Float[np.ndarray, " n"]:
        """Measured dissipation, input less kinetic less potential energy [J] (Eq. 4.4)."""
        return self.input - self.kinetic - self.potential


def summed(increments: Float[np.ndarray, "m ..."]) -> Float[np.ndarray, "n ..."]:
    """Return running sums that begin with zero."""
    return np.cumulative_sum(increments, axis=0, include_initial=True)


def energy_levels(
    part: AxisLog, model: AxisModel, low_pass: LowPass, noise: MotionNoise, sampling_time: float
) -> EnergyLevels:
    """Return the energies of one stretch without gaps (settled forms of Eqs. 3.6-4.4).

    ``noise`` is that of the measurements of the (first) mass. Raises InputError if the model has a
    load and the log does not hold its position.
    """
    T = sampling_time
    motion = observe(part, low_pass, noise, T)
    x, v = motion.position, motion.velocity
    work = summed(part.effort[:-1] * np.diff(x))
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
    shift = max(round(1.0 / (low_pass.cutoff * T)), 1)  # a period of the cutoff [samples]
    rough = _rough_axis(model, regressors, work - kinetic - potential)
    white, walk = _sensor_noise(part, motion, spring, noise, rough, shift, T)
    if load is not None and model.load_inertia is not None:
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
    """Return the measured position of the load [m or rad], or raise InputError without one."""
    if log.measured_load_position is None:
        raise InputError("no_load_position", where=log.name)
    return log.measured_load_position


def _load_motion(part: AxisLog, low_pass: LowPass, sampling_time: float) -> LoadMotion:
    position, velocity = load_position(part), part.measured_load_velocity
    noise = motion_noise(position, velocity, low_pass, sampling_time)
    x, v, smooth = smoothed(position, velocity, low_pass, noise, sampling_time)
    return LoadMotion(position=x, velocity=v, smooth_velocity=smooth, noise=noise)


class _RoughAxis(NamedTuple):
    """Parameters good enough to weigh noise with [SI]."""

    inertia: float
    viscous: float
    coulomb: float
    offset: float


def _rough_axis(
    model: AxisModel, regressors: Float[np.ndarray, "n p"], dissipated: Float[np.ndarray, " n"]
) -> _RoughAxis:
    """Fit the levels without any weights."""
    columns = np.column_stack([regressors, np.ones(dissipated.size)])
    values = least_squares(columns, dissipated).tolist()
    inertia = abs(values.pop(0)) if model.inertia is None else model.inertia
    found = dict(zip(model.terms.names, values, strict=False))

    def magnitude(term: str) -> float:
        return float(np.mean([abs(a) for name, a in found.items() if name.startswith(term)]))

    return _RoughAxis(inertia, magnitude("viscous"), magnitude("coulomb"), found.get("offset", 0.0))


def _sensor_noise(
    part: AxisLog,
    motion: ObservedMotion,
    spring: Float[np.ndarray, " n"],
    noise: MotionNoise,
    rough: _RoughAxis,
    shift: int,
    sampling_time: float,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n-1"]]:
    """Return the variances that noise on the (first) mass gives the energy balance [J^2].

    White in the level: that of the kinetic energy, and position noise times the force that acts.
    Adding up from sample to sample: position noise times the change of that force (summation by
    parts of sum u dx), and velocity noise in the viscous regressor.
    """
    speed = motion.smooth_velocity
    white = _kinetic_noise(rough.inertia, speed, noise.used_velocity, shift)
    net = part.effort[:-1] - rough.offset - rough.coulomb * motion.direction
    acting = np.concatenate([net, net[-1:]]) - spring
    white += (acting * noise.smooth_position) ** 2
    walk = (np.diff(net, prepend=net[:1]) * noise.smooth_position) ** 2
    walk += (2.0 * rough.viscous * sampling_time * speed[:-1] * noise.velocity) ** 2
    return white, walk


def _kinetic_noise(
    inertia: float, velocity: Float[np.ndarray, " n"], noise: float, shift: int
) -> Float[np.ndarray, " n"]:
    """Return the variance of a kinetic energy [J^2] from noise of its velocity.

    The velocity is taken ``shift`` samples earlier and later: a weight that depends on the error of
    its own sample would favour errors of one sign.
    """
    padded = np.pad(velocity**2, shift, mode="edge")
    square = 0.5 * (padded[: velocity.size] + padded[2 * shift :])
    return (inertia * noise) ** 2 * (square + 0.5 * noise**2)
