"""Many trajectories at once."""

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import AxisKind, InputError, quantity_field, unit_of, whole
from stickslip.simulation.kernels.arm_batch import LANES
from stickslip.simulation.plant_kernels import (
    EVENT_BUDGET,
    initial_kernel_state,
    kernel_model,
    kernels_of,
)
from stickslip.simulation.simulate import budget_error, make_arrays_read_only, overflow_error


@dataclass(frozen=True, kw_only=True)
class SimulatedBatch:
    """The stored samples of many simulated trajectories."""

    kind: AxisKind  #: ``"linear"`` or ``"rotary"``; decides the units.
    #: Times of the stored samples, shape (s,); without any stored, the end.
    time: Float[np.ndarray, " s"] = quantity_field("time")
    position: Float[np.ndarray, "batch s"] = quantity_field("position")  #: Of the (first) mass.
    velocity: Float[np.ndarray, "batch s"] = quantity_field("velocity")  #: Of the (first) mass.
    #: Of the second mass of flexible arms, or None.
    load_position: Float[np.ndarray, "batch s"] | None = quantity_field("position", default=None)
    #: Of the second mass of flexible arms, or None.
    load_velocity: Float[np.ndarray, "batch s"] | None = quantity_field("velocity", default=None)

    def __post_init__(self) -> None:
        make_arrays_read_only(self)


def simulate_batch(
    plants: Plant | Sequence[Plant],
    commanded_efforts: ArrayLike,
    *,
    sampling_time: float,
    initial_states: ArrayLike | None = None,
    store_every: int | None = None,
    threads: int | None = None,
    event_budget: int = EVENT_BUDGET,
) -> SimulatedBatch:
    """Propagate many trajectories exactly; each agrees with `simulate` to the last bit.

    Parameters
    ----------
    plants
        One plant for all trajectories, or one a trajectory, all of the same class.
    commanded_efforts
        Efforts held over each sample [N or N m], shape (batch, n), or (n,) for one effort that
        all trajectories share.
    sampling_time
        [s].
    initial_states
        As `simulate` takes them [m or rad, m/s or rad/s], shape (batch, 2) for single masses or
        (batch, 4) for arms, or one state for all; at rest at 0 if None.
    store_every
        Store every so many samples, counted from the first; the last state only if None.
    threads
        How many cores to use; all if None.
    event_budget
        Events allowed in one sample.

    Returns
    -------
    The stored samples, at the times of ``SimulatedBatch.time``.

    Raises
    ------
    InputError
        If shapes do not fit together, or a value is not finite or out of its range.
    EventBudgetError
        If a sample holds more events than allowed; the trajectory is named.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, viscous_friction=0.0)
    >>> plant = SingleMass(mass=150.0, friction=law)
    >>> batch = simulate_batch(plant, [[300.0, 0.0, 0.0], [150.0, 0.0, 0.0]], sampling_time=0.01)
    >>> batch.position[:, -1].round(9).tolist()
    [0.0002, 2.5e-05]
    """
    plants = [plants] if isinstance(plants, SingleMass | FlexibleArm) else list(plants)
    if not plants or any(kernels_of(plant) is not kernels_of(plants[0]) for plant in plants):
        raise InputError("mixed_batch")
    efforts = _efforts(commanded_efforts, plants[0])
    states_given = None if initial_states is None else np.atleast_2d(np.asarray(initial_states))
    sizes = {
        "plants": len(plants),
        "commanded_efforts": efforts.shape[0],
        "initial_states": 1 if states_given is None else states_given.shape[0],
    }
    batch = max(sizes.values())
    for name, size in sizes.items():
        if size not in (1, batch):
            raise InputError("unequal_batch", name=name, trajectories=size, batch=batch)
    n = efforts.shape[1]
    every = 0 if store_every is None else store_every
    if store_every is not None and not 1 <= store_every <= n:
        raise InputError(
            "out_of_range", name="store_every", value=store_every, least=1, most=n, unit="samples"
        )
    if threads is not None:
        whole("threads", threads, least=1)
    models = np.stack([kernel_model(plant, sampling_time, event_budget) for plant in plants])
    given = [None] if states_given is None else [tuple(row) for row in states_given.tolist()]
    states = np.array([initial_kernel_state(plants[0], state) for state in given])
    states = np.array(np.broadcast_to(states, (batch, states.shape[1])))  # the kernel's to write
    width = len(plants[0].state_names)
    rows = n // every if every else 0
    stored = np.empty((batch, rows + 1 if every else 1, width))
    start = _outputs(states, width)
    out = np.empty((batch, rows, width))
    kernel = partial(kernels_of(plants[0]).batch, models, states, efforts, every, out)
    for trajectory, sample in _run(kernel, batch, threads):
        if trajectory >= 0:
            raise budget_error(sample * sampling_time, event_budget, trajectory)
    finite = np.isfinite(states).all(axis=1)
    if not finite.all():
        raise overflow_error(f"trajectory {int(finite.argmin())}")
    if every:
        stored[:, 0], stored[:, 1:] = start, out
        time = np.arange(rows + 1) * (every * sampling_time)
    else:
        stored[:, 0] = _outputs(states, width)
        time = np.array([n * sampling_time])
    arm = width == 4
    return SimulatedBatch(
        kind=plants[0].kind,
        time=time,
        position=stored[:, :, 0],
        velocity=stored[:, :, 1],
        load_position=stored[:, :, 2] if arm else None,
        load_velocity=stored[:, :, 3] if arm else None,
    )


def _efforts(commanded_efforts: ArrayLike, plant: Plant) -> Float[np.ndarray, "batch n"]:
    efforts = np.ascontiguousarray(np.atleast_2d(np.asarray(commanded_efforts, dtype=np.float64)))
    unit = unit_of("effort", plant.kind)
    if efforts.ndim != 2:
        raise InputError("efforts_not_a_matrix", dimensions=efforts.ndim)
    # One pass that allocates nothing; a sum that overflows is looked at in detail
    with np.errstate(over="ignore", invalid="ignore"):
        total = efforts.sum()
    if not np.isfinite(total) and not np.isfinite(efforts).all():
        row, sample = np.argwhere(~np.isfinite(efforts))[0].tolist()
        raise InputError(
            "effort_not_finite",
            where=f"trajectory {row}",
            name="commanded_efforts",
            value=efforts[row, sample],
            unit=unit,
            sample=sample,
        )
    view = efforts.view()
    view.flags.writeable = False  # always, so that one compiled kernel serves every caller
    return view


def _outputs(states: Float[np.ndarray, "batch k"], width: int) -> Float[np.ndarray, "batch w"]:
    """Return (position, velocity[, load_position, load_velocity]) of kernel states."""
    return states[:, [0, 1] if width == 2 else [0, 1, 4, 3]]


def _run(
    kernel: Callable[[int, int], tuple[int, int]], batch: int, threads: int | None
) -> list[tuple[int, int]]:
    """Run a kernel over all trajectories, in parallel; return its results of each part."""
    workers = min(threads or os.cpu_count() or 1, -(-batch // LANES))
    if workers == 1:
        return [kernel(0, batch)]
    # Whole groups of lanes, several parts a worker, so that uneven trajectories balance
    part = max(LANES, -(-batch // (4 * workers * LANES)) * LANES)
    kernel(0, 0)  # compile once, before the threads do
    with ThreadPoolExecutor(workers) as pool:
        jobs = [
            pool.submit(kernel, first, min(first + part, batch)) for first in range(0, batch, part)
        ]
        return [job.result() for job in jobs]
