"""One trajectory of a plant under a commanded effort, at once or sample by sample."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int8
from numpy.typing import ArrayLike

from stickslip.plants import Plant
from stickslip.records import (
    AxisKind,
    EventBudgetError,
    InputError,
    finite_vector,
    quantity_field,
    unit_of,
)
from stickslip.simulation.plant_kernels import (
    EVENT_BUDGET,
    State,
    initial_kernel_state,
    kernel_model,
    kernels_of,
)


def make_arrays_read_only(record: Any) -> None:
    """Replace the arrays of a new frozen dataclass by read-only views of them."""
    for name in record.__dataclass_fields__:
        value = getattr(record, name)
        if isinstance(value, np.ndarray):
            view = value.view()
            view.flags.writeable = False
            object.__setattr__(record, name, view)


@dataclass(frozen=True, kw_only=True)
class SimulatedMotion:
    """The true motion of a simulated plant, at every sample and at every event between them.

    ``commanded_effort[k]`` is held from ``time[k]`` to ``time[k+1]``.
    """

    kind: AxisKind  #: ``"linear"`` or ``"rotary"``; decides the units.
    sampling_time: float = quantity_field("sampling_time")  #: [s].
    commanded_effort: Float[np.ndarray, " n"] = quantity_field("effort")  #: Shape (n,).
    position: Float[np.ndarray, " n+1"] = quantity_field("position")  #: Of the (first) mass.
    velocity: Float[np.ndarray, " n+1"] = quantity_field("velocity")  #: Of the (first) mass.
    #: Of the second mass of a flexible arm, shape (n+1,), or None.
    load_position: Float[np.ndarray, " n+1"] | None = quantity_field("position", default=None)
    #: Of the second mass of a flexible arm, shape (n+1,), or None.
    load_velocity: Float[np.ndarray, " n+1"] | None = quantity_field("velocity", default=None)
    #: When the (first) mass came to rest, broke away or reversed [s], shape (e,).
    event_time: Float[np.ndarray, " e"] = quantity_field("time")
    #: Motion from then on, -1 and +1 slip in that direction, 0 rest; shape (e,).
    event_mode: Int8[np.ndarray, " e"]
    #: Samples, shape (n,), in which the outcome of an event was too close to call; the velocity or
    #: the force touched its limit to 1e-10 of its scale, with static friction above Coulomb
    #: friction, where the motion depends on it discontinuously.
    grazing: Bool[np.ndarray, " n"]
    #: Of a friction law with bristles, shape (n+1,), or None.
    bristle_deflection: Float[np.ndarray, " n+1"] | None = quantity_field("position", default=None)

    def __post_init__(self) -> None:
        make_arrays_read_only(self)

    @cached_property
    def time(self) -> Float[np.ndarray, " samples"]:
        """Sample instants [s], shape (n+1,)."""
        time = np.arange(self.position.size) * self.sampling_time
        time.flags.writeable = False
        return time

    @cached_property
    def stuck(self) -> Bool[np.ndarray, " samples"]:
        """Whether the (first) mass rests at each sample instant, shape (n+1,).

        What the effort of the sample that begins there will do to it is not considered. On
        bristles nothing rests quite.
        """
        stuck = self.velocity == 0.0
        stuck.flags.writeable = False
        return stuck

    @property
    def event_count(self) -> int:
        """How often the (first) mass came to rest, broke away or reversed."""
        return self.event_time.size

    @property
    def any_grazing(self) -> bool:
        """Whether the outcome of any event was too close to call."""
        return bool(self.grazing.any())


def budget_error(time: float, event_budget: int, trajectory: int | None = None) -> EventBudgetError:
    """Return the error for a sample with more events than allowed."""
    where = "" if trajectory is None else f"trajectory {trajectory}"
    return EventBudgetError("event_budget", where=where, time=time, event_budget=event_budget)


def overflow_error(where: str) -> InputError:
    """Return the error for a motion that leaves the range of floating-point numbers."""
    return InputError("motion_overflows", where=where)


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
    kernels = kernels_of(plant)
    effort = finite_vector("commanded_effort", commanded_effort, unit_of("effort", plant.kind))
    model = kernel_model(plant, sampling_time, event_budget)
    state = initial_kernel_state(plant, initial_state)
    n = effort.size
    rigid = not plant.flexible
    capacity = n // 4 + 256
    while True:
        # One block of memory, which the allocator keeps for the next run more readily than several
        outputs = np.empty((3 if rigid else 5, n + 1))
        grazing = np.zeros(n, dtype=np.bool_)
        event_time, event_mode = np.empty(capacity), np.empty(capacity, dtype=np.int8)
        count, failed = kernels.run(model, state, effort, outputs, grazing, event_time, event_mode)
        if failed >= 0:
            raise budget_error(failed * sampling_time, event_budget)
        if count <= capacity:
            break
        capacity = count  # an eventful run: once more, with room for all of them
    out, deflection = outputs[:-1], outputs[-1]
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


class PlantStepper:
    """One sample of a plant at a time: ``init() -> state``, ``step(state, effort)``.

    The step is the compiled kernel itself, pure and without a memory of its own, so that stepping
    gives the same numbers as `simulate` to the last bit.

    Parameters
    ----------
    plant
        `SingleMass` or `FlexibleArm`.
    sampling_time
        [s].
    event_budget
        Events, and steps of integration where a law needs them, allowed in one sample.

    Attributes
    ----------
    step
        ``step(state, effort) -> (state, output)`` with the effort held over the sample [N or N m]
        and the output ``(position, velocity)``, of the arm ``(position, velocity, load_position,
        load_velocity)``, at its end. The last number of the state is NaN when the effort was not
        finite, the motion has overflowed or the event budget was exceeded, and from then on: a step
        that a compiled loop may take raises nothing.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=0.0)
    >>> stepper = PlantStepper(SingleMass(mass=150.0, friction=law), sampling_time=0.01)
    >>> state, (position, velocity) = stepper.step(stepper.init(), 300.0)
    >>> round(velocity, 9)
    0.013333333
    """

    step: Callable[[State, float], tuple[State, State]]

    def __init__(
        self, plant: Plant, *, sampling_time: float, event_budget: int = EVENT_BUDGET
    ) -> None:
        self._plant = plant
        model = kernel_model(plant, sampling_time, event_budget)
        self.step = partial(kernels_of(plant).step, model)

    def init(self, initial_state: State | None = None) -> State:
        """Return the kernel's state for a plant's state (as `simulate` takes it)."""
        return initial_kernel_state(self._plant, initial_state)
