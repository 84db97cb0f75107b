"""Derivatives of a simulated motion by every parameter of its plant, exact to first order."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.plants import Plant, check_affine
from stickslip.simulation.kernels.sensitivity import (
    FRICTION_COLUMNS,
    Modes,
    Trajectory,
    sample_matrices,
    sensitivity_run,
)
from stickslip.simulation.plant_kernels import EVENT_BUDGET
from stickslip.simulation.simulate import SimulatedMotion, make_arrays_read_only, simulate

_FRICTION = (
    "coulomb_friction_positive",
    "coulomb_friction_negative",
    "static_friction_positive",
    "static_friction_negative",
    "offset",
)
_VISCOUS = ("viscous_friction_positive", "viscous_friction_negative")
_INITIAL = (
    "initial_position",
    "initial_velocity",
    "initial_load_position",
    "initial_load_velocity",
)


@dataclass(frozen=True, kw_only=True)
class MotionSensitivity:
    """A simulated motion and its derivatives by the parameters of its plant and its first state.

    The motion is a continuous function of the parameters, and its derivative is exact, except where
    an event grazes: with static friction above Coulomb friction the motion then jumps, and a
    derivative does not show that (``motion.grazing`` shows where). A single mass is freed by a
    new effort at the beginning of a sample only; there, too, the motion jumps when static friction
    passes the effort, and is constant between such jumps: its derivatives by static friction are 0.
    """

    motion: SimulatedMotion  #: The motion.
    #: The parameters, those of the plant and its friction law, then the initial state.
    names: tuple[str, ...]
    #: Derivative of that of the (first) mass by each parameter [m or rad over the unit of the
    #: parameter], shape (n+1, p).
    position: Float[np.ndarray, "samples p"]
    #: Likewise [m/s or rad/s over the unit of the parameter].
    velocity: Float[np.ndarray, "samples p"]
    #: The same of the second mass of a flexible arm [as above], or None.
    load_position: Float[np.ndarray, "samples p"] | None = None
    #: The same of the second mass of a flexible arm [as above], or None.
    load_velocity: Float[np.ndarray, "samples p"] | None = None

    def __post_init__(self) -> None:
        make_arrays_read_only(self)


def sensitivity_names(plant: Plant) -> tuple[str, ...]:
    """Return the names of the parameters that a plant's motion is derived by, in order."""
    check_affine(plant)
    initial = _INITIAL[: len(plant.state_names)]
    return (*plant.parameter_names, *_VISCOUS, *_FRICTION, *initial)


def simulate_sensitivity(
    plant: Plant,
    commanded_effort: ArrayLike,
    *,
    sampling_time: float,
    initial_state: tuple[float, ...] | None = None,
    event_budget: int = EVENT_BUDGET,
) -> MotionSensitivity:
    """Propagate a plant as `simulate` does, and how its motion changes with each parameter.

    The variational equation is propagated exactly between events, and through every stop, reversal
    and breakaway by what their shift in time leaves (saltation).

    Parameters
    ----------
    plant
        `SingleMass` or `FlexibleArm`.
    commanded_effort
        Effort held over each sample [N or N m], shape (n,).
    sampling_time
        [s].
    initial_state
        ``(position, velocity)`` [m or rad, m/s or rad/s], of the arm ``(position, velocity,
        load_position, load_velocity)``; at rest at 0 if None. A mass at rest has no derivative by
        its velocity but in the direction in which it is set free at once.
    event_budget
        Events allowed in one sample.

    Raises
    ------
    InputError, EventBudgetError
        As `simulate` does.

    Examples
    --------
    A mass that slides to rest: its way m v^2/(2 fc) grows by v^2/(2 fc) a unit of mass.

    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=0.0)
    >>> found = simulate_sensitivity(SingleMass(mass=1.0, friction=law), [0.0] * 10,
    ...                              sampling_time=0.1, initial_state=(0.0, 1.0))
    >>> round(float(found.position[-1, found.names.index("mass")]), 9)
    0.25
    """
    motion = simulate(
        plant,
        commanded_effort,
        sampling_time=sampling_time,
        initial_state=initial_state,
        event_budget=event_budget,
    )
    names = sensitivity_names(plant)
    rates, slopes, norms = _rates(plant)
    made = [
        sample_matrices(rate, slope, float(norm), motion.sampling_time)
        for rate, slope, norm in zip(rates, slopes, norms, strict=True)
    ]
    rows = [motion.position, motion.velocity]
    if motion.load_position is not None and motion.load_velocity is not None:
        rows += [motion.position - motion.load_position, motion.load_velocity]
    law: Any = plant.friction
    s = len(rows)
    out = np.empty((motion.position.size, s, len(names)))
    increments, increment_slopes = (np.stack(each) for each in zip(*made, strict=True))
    sensitivity_run(
        Modes(rates, slopes, norms, increments, increment_slopes),
        np.array([getattr(law, name) for name in _FRICTION]),
        getattr(plant, "stiffness", 0.0),
        motion.sampling_time,
        Trajectory(motion.commanded_effort, np.stack(rows), motion.event_time, motion.event_mode),
        out,
    )
    if plant.flexible:
        _from_distances(out, slopes.shape[1] + FRICTION_COLUMNS)
    signals = ("position", "velocity", "load_position", "load_velocity")
    derivatives = {name: out[:, k] for k, name in enumerate(signals[:s])}
    return MotionSensitivity(motion=motion, names=names, **derivatives)


def _from_distances(out: Float[np.ndarray, "n 4 p"], first: int) -> None:
    """Convert derivatives of d = x1 - x2 into those of x2, in the rows and the first state."""
    out[:, 2] = out[:, 0] - out[:, 2]
    # x1 at first with x2 fixed moves d as well, and d = x1 - x2
    out[:, :, first] += out[:, :, first + 2]
    out[:, :, first + 2] *= -1.0


def _rates(
    plant: Plant,
) -> tuple[
    Float[np.ndarray, "3 s columns"], Float[np.ndarray, "3 q s columns"], Float[np.ndarray, "3"]
]:
    """Return the rates of the modes -1, 0, +1, their derivatives, and how fast they are [1/s].

    y' = R (y, F) with y = (x1, v1) or (x1, v1, d, v2), d = x1 - x2; the derivatives are by the
    masses, the stiffness and both viscous frictions.
    """
    law: Any = plant.friction
    sides = (law.viscous_friction_negative, 0.0, law.viscous_friction_positive)
    m1, *load_and_spring = (getattr(plant, name) for name in plant.parameter_names)
    s, q = len(plant.state_names), len(plant.parameter_names) + 2
    rates, slopes, norms = np.zeros((3, s, s + 1)), np.zeros((3, q, s, s + 1)), np.zeros(3)
    for mode, c in zip((-1, 0, 1), sides, strict=True):
        R, dR = rates[mode + 1], slopes[mode + 1]
        viscous = q - 2 if mode > 0 else q - 1
        if mode != 0:
            R[0, 1] = 1.0
            R[1, 1], R[1, s] = -c / m1, 1.0 / m1
            dR[0, 1, 1], dR[0, 1, s] = c / m1**2, -1.0 / m1**2
            dR[viscous, 1, 1] = -1.0 / m1
            norms[mode + 1] = c / m1
        if plant.flexible:
            m2, ks = load_and_spring
            R[2, 1], R[2, 3] = float(mode != 0), -1.0
            R[3, 2] = ks / m2
            dR[1, 3, 2], dR[2, 3, 2] = -ks / m2**2, 1.0 / m2
            if mode != 0:
                R[1, 2] = -ks / m1
                dR[0, 1, 2], dR[2, 1, 2] = ks / m1**2, -1.0 / m1
            norms[mode + 1] += np.sqrt(ks / m1 + ks / m2)
    return rates, slopes, norms
