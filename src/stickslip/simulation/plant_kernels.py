"""Which compiled kernels propagate a plant: one table for single steps, runs, loops and batches."""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import Plant, SingleMass
from stickslip.simulation.kernels.arm import arm_run, arm_step
from stickslip.simulation.kernels.arm_batch import arm_batch
from stickslip.simulation.kernels.single_mass import mass_batch, mass_run, mass_step
from stickslip.simulation.laws import law_batch, law_mass_step, law_run, law_step

__all__ = ["PlantKernels", "kernels_of"]

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
    """

    step: Any
    loop_step: Any
    run: Callable[..., tuple[int, int]]
    batch: Any


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


_MASS = PlantKernels(step=mass_step, loop_step=_mass_loop_step, run=_mass_run, batch=mass_batch)
_ARM = PlantKernels(step=arm_step, loop_step=arm_step, run=_arm_run, batch=arm_batch)
_LAW_ON_MASS = PlantKernels(step=law_mass_step, loop_step=law_step, run=_law_run, batch=law_batch)
_LAW_ON_ARM = PlantKernels(step=law_step, loop_step=law_step, run=_law_run, batch=law_batch)


def kernels_of(plant: Plant) -> PlantKernels:
    """Return the kernels that propagate a plant.

    Parameters
    ----------
    plant
        Its class and its friction law decide.
    """
    exact = isinstance(plant.friction, CoulombViscousFriction)
    if isinstance(plant, SingleMass):
        return _MASS if exact else _LAW_ON_MASS
    return _ARM if exact else _LAW_ON_ARM
