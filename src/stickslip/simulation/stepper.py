"""A plant as something that steps in time."""

from collections.abc import Callable
from functools import partial

from stickslip.plants import Plant
from stickslip.simulation.plant_kernels import (
    EVENT_BUDGET,
    initial_kernel_state,
    kernel_model,
    kernels_of,
)

__all__ = ["PlantStepper"]

State = tuple[float, ...]


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

    Raises
    ------
    InputError
        As `simulate` does for the plant, the sampling time and the event budget.

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
