"""One trajectory of a plant under a commanded effort."""

import numpy as np
from numpy.typing import ArrayLike

from stickslip.plants import Plant
from stickslip.records import EventBudgetError, InputError, finite_vector, unit_of
from stickslip.simulation.motion import SimulatedMotion
from stickslip.simulation.plant_kernels import (
    EVENT_BUDGET,
    initial_kernel_state,
    kernel_model,
    kernels_of,
)

__all__ = ["budget_error", "overflow_error", "simulate"]


def budget_error(time: float, event_budget: int, trajectory: int | None = None) -> EventBudgetError:
    """Return the error for a sample with more events than allowed."""
    whose = "" if trajectory is None else f" of trajectory {trajectory}"
    return EventBudgetError(
        f"more than {event_budget} events or steps in the sample at {time:.9g} s{whose}; "
        "shorten the sampling time, or raise event_budget if the axis really sticks so often"
    )


def overflow_error(where: str) -> InputError:
    """Return the error for a motion that leaves the range of floating-point numbers."""
    return InputError(
        "the motion is too large for floating-point numbers",
        where=where,
        remedy="give smaller efforts or a smaller initial state",
    )


def simulate(
    plant: Plant,
    commanded_effort: ArrayLike,
    *,
    sampling_time: float,
    initial_state: tuple[float, ...] | None = None,
    event_budget: int = EVENT_BUDGET,
) -> SimulatedMotion:
    """Propagate a plant under an effort that is held over each sample.

    With `CoulombViscousFriction` the solution between events is exact to rounding; every stick,
    slip and reversal is found, also those that come in pairs inside one sample. Other laws are not
    affine: they are integrated, each step to 1e-11, with the same events.

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
        load_position, load_velocity)``; at rest at 0 if None.
    event_budget
        Events, and steps of integration where a law needs them, allowed in one sample.

    Returns
    -------
    The motion at n+1 samples and at the events between them.

    Raises
    ------
    InputError
        If an argument is not finite, or out of its range, or so large that the motion overflows.
    EventBudgetError
        If a sample holds more events or steps than allowed.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=0.0)
    >>> plant = SingleMass(mass=150.0, friction=law)
    >>> motion = simulate(plant, [300.0, 0.0, 0.0, 0.0], sampling_time=0.01)
    >>> round(float(motion.position[-1]), 9), motion.event_mode.tolist()
    (0.0002, [1, 0])
    """
    effort = finite_vector("commanded effort", commanded_effort, unit_of("effort", plant.kind))
    model = kernel_model(plant, sampling_time, event_budget)
    state = initial_kernel_state(plant, initial_state)
    n = effort.size
    rigid = not plant.flexible
    capacity = n // 4 + 256
    while True:
        # One block of memory, which the allocator keeps for the next run more readily than several
        outputs = np.empty((3 if rigid else 5, n + 1))
        out, deflection = outputs[:-1], outputs[-1]
        grazing = np.zeros(n, dtype=np.bool_)
        event_time, event_mode = np.empty(capacity), np.empty(capacity, dtype=np.int8)
        count, failed = kernels_of(plant).run(
            model, state, effort, out, deflection, grazing, event_time, event_mode
        )
        if failed >= 0:
            raise budget_error(failed * sampling_time, event_budget)
        if count <= capacity:
            break
        capacity = count  # an eventful run: once more, with room for all of them
    if not np.isfinite(out[:, -1]).all():  # what is not finite stays so
        at = int(np.isfinite(out).all(axis=0).argmin())
        raise overflow_error(f"sample {at}")
    return SimulatedMotion(
        kind=plant.kind,
        sampling_time=float(sampling_time),
        commanded_effort=effort,
        position=out[0],
        velocity=out[1],
        load_position=None if rigid else out[2],
        load_velocity=None if rigid else out[3],
        event_time=event_time[:count].copy(),
        event_mode=event_mode[:count].copy(),
        grazing=grazing,
        bristle_deflection=deflection if plant.friction.bristles is not None else None,
    )
