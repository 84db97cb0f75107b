"""Which compiled kernels propagate a plant: one table for single steps, runs, loops and batches."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.friction.registry import LAWS
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import InputError, positive
from stickslip.simulation.kernels.arm import arm_run, arm_step
from stickslip.simulation.kernels.arm_batch import arm_batch
from stickslip.simulation.kernels.single_mass import mass_batch, mass_run, mass_step
from stickslip.simulation.laws import law_batch, law_mass_step, law_model, law_run, law_step
from stickslip.simulation.models import (
    exact_arm_model,
    exact_arm_state,
    exact_mass_model,
    exact_mass_state,
    law_state,
)

__all__ = ["EVENT_BUDGET", "PlantKernels", "initial_kernel_state", "kernel_model", "kernels_of"]

EVENT_BUDGET = 10_000
"""Events allowed in one sample."""

Vector = NDArray[np.float64]


class PlantKernels(NamedTuple):
    """The kernels of one kind of plant.

    Attributes
    ----------
    step
        ``(model, state, effort) -> (state, output)`` over one sample.
    loop_step
        The same with the output of an arm; NaN for the load of a rigid axis.
    run
        ``(model, state, effort, out, deflection, grazing, event_time, event_mode) -> (count,
        failed)`` over a trajectory; ``out`` and ``deflection`` (of bristles) hold a column or value
        a sample, ``failed`` is the sample in which the budget was exceeded or -1.
    batch
        As `stickslip.simulation.kernels.single_mass.mass_batch`.
    model
        ``(plant, sampling_time, event_budget) -> model``.
    initial
        ``values -> state`` from the plant's state.
    """

    step: Any
    loop_step: Any
    run: Callable[..., tuple[int, int]]
    batch: Any
    model: Callable[[Any, float, int], Vector]
    initial: Callable[[tuple[float, ...]], tuple[float, ...]]


@compiled()
def _mass_loop_step(
    model: Vector, state: tuple[float, ...], effort: float
) -> tuple[tuple[float, ...], tuple[float, float, float, float]]:
    """`mass_step` with the output of an arm, of which the second half does not exist."""
    state, output = mass_step(model, state, effort)
    return state, (output[0], output[1], np.nan, np.nan)


def _mass_run(
    model: Vector, state: Any, effort: Vector, out: Vector, deflection: Vector, grazing: Any,
    event_time: Vector, event_mode: Any,
) -> tuple[int, int]:  # fmt: skip
    del deflection  # it has no bristles
    _, count = mass_run(model, state, effort, out[0], out[1], grazing, event_time, event_mode)
    return count, -1


def _arm_run(
    model: Vector, state: Any, effort: Vector, out: Vector, deflection: Vector, grazing: Any,
    event_time: Vector, event_mode: Any,
) -> tuple[int, int]:  # fmt: skip
    del deflection  # it has no bristles
    x1, v1, x2, v2 = out
    _, count, failed = arm_run(
        model, state, effort, x1, v1, x2, v2, grazing, event_time, event_mode
    )
    return count, failed


def _law_run(
    model: Vector, state: Any, effort: Vector, out: Vector, deflection: Vector, grazing: Any,
    event_time: Vector, event_mode: Any,
) -> tuple[int, int]:  # fmt: skip
    del grazing  # friction begins as it ended: no outcome is sudden
    return law_run(model, state, effort, out, deflection, event_time, event_mode)


_LAW_ON_ARM = PlantKernels(
    step=law_step,
    loop_step=law_step,
    run=_law_run,
    batch=law_batch,
    model=law_model,
    initial=law_state,
)
_KERNELS: Mapping[tuple[type, bool], PlantKernels] = {
    (SingleMass, True): PlantKernels(
        step=mass_step,
        loop_step=_mass_loop_step,
        run=_mass_run,
        batch=mass_batch,
        model=exact_mass_model,
        initial=exact_mass_state,
    ),
    (FlexibleArm, True): PlantKernels(
        step=arm_step,
        loop_step=arm_step,
        run=_arm_run,
        batch=arm_batch,
        model=exact_arm_model,
        initial=exact_arm_state,
    ),
    (SingleMass, False): _LAW_ON_ARM._replace(step=law_mass_step),
    (FlexibleArm, False): _LAW_ON_ARM,
}
"""By the class of the plant, and whether its friction is affine."""


def kernels_of(plant: Plant) -> PlantKernels:
    """Return the kernels that propagate a plant.

    Parameters
    ----------
    plant
        Its class and its friction law decide.

    Raises
    ------
    InputError
        If its friction law is not in the registry, or there are no kernels for its class.
    """
    law = plant.friction
    if not isinstance(law, tuple(LAWS.values())):
        raise InputError(
            f"the friction law {type(law).__name__} cannot be simulated",
            remedy="use one of those in stickslip.friction",
        )
    kernels = _KERNELS.get((type(plant), law.affine))
    if kernels is None:
        raise InputError(
            f"there are no kernels for the plant {type(plant).__name__}",
            remedy="use one of those in stickslip.plants",
        )
    return kernels


@lru_cache(maxsize=256)
def kernel_model(plant: Plant, sampling_time: float, event_budget: int = EVENT_BUDGET) -> Vector:
    """Return the vector of numbers that the plant's kernel works with, read-only.

    Raises
    ------
    InputError
        If the sampling time is not positive, or of an arm too long for its fastest time constant;
        if the event budget is not at least 1; or if the friction law is not one that can be
        simulated.
    """
    T = positive("sampling time", sampling_time, "s")
    if not event_budget >= 1:
        raise InputError(
            f"event_budget is {event_budget}, it must be at least 1", remedy="leave it at default"
        )
    model = kernels_of(plant).model(plant, T, event_budget)
    model.flags.writeable = False
    return model


def initial_kernel_state(
    plant: Plant, initial_state: tuple[float, ...] | None
) -> tuple[float, ...]:
    """Return the kernel's state for a plant's state; at rest at 0 if None.

    Bristles are straight at first.

    Parameters
    ----------
    plant
        Decides the state's length.
    initial_state
        ``(position, velocity)``, of the arm ``(position, velocity, load_position,
        load_velocity)``, in SI units.

    Raises
    ------
    InputError
        If the length is wrong or a value is not finite.
    """
    names = plant.state_names
    values = (0.0,) * len(names) if initial_state is None else tuple(map(float, initial_state))
    if len(values) != len(names):
        raise InputError(
            f"the initial state has {len(values)} values, the plant's has {len(names)}",
            remedy=f"give ({', '.join(names)})",
        )
    for name, value in zip(names, values, strict=True):
        if not math.isfinite(value):
            raise InputError(f"initial {name} is {value}", remedy="give a finite value")
    return kernels_of(plant).initial(values)
