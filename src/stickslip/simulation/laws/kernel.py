"""Trajectories of plants whose friction law is not affine, as the exact kernels offer them."""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.laws.rates import KS, OFFSET, TIME
from stickslip.simulation.laws.sample import law_sample, new_work

__all__ = ["law_batch", "law_mass_step", "law_run", "law_step"]

Vector = NDArray[np.float64]
State = tuple[float, ...]  # (x1, v1, z, v2, x2, length of the next step, mode)


@compiled()
def law_step(
    model: Vector, state: State, effort: float
) -> tuple[State, tuple[float, float, float, float]]:
    """Propagate one sample under a held effort; pure.

    Parameters
    ----------
    model
        See `stickslip.simulation.laws.rates`.
    state
        (x1, v1, z, v2, x2, length of the next step, mode), seven floats.
    effort
        Held over the sample.

    Returns
    -------
    state, output
        The state at the end and (x1, v1, x2, v2), of a rigid axis (x, v, NaN, NaN). The mode is NaN
        if the effort or the motion is not finite or the budget was exceeded; from such a state
        follows one of NaN.
    """
    work, new, spare = new_work()
    y = np.empty(5)
    y[0], y[1], y[2], y[3], y[4] = state[0], state[1], state[2], state[4], state[3]
    h, mode_float = state[5], state[6]
    mode = 0 if math.isnan(mode_float) else int(mode_float)
    U = math.nan if math.isnan(mode_float) else effort - model[OFFSET]
    finished = False
    if abs(U) < math.inf:
        h, mode, _, finished = law_sample(
            model, U, y, h, mode, 0.0, np.empty(0), np.empty(0, dtype=np.int8), 0, work, new, spare
        )
    good = finished and abs(y[0]) + abs(y[1]) + abs(y[3]) + abs(y[4]) < math.inf
    last = (y[0], y[1], y[2], y[4], y[3], h, float(mode) if good else math.nan)
    if model[KS] == 0.0:
        return last, (y[0], y[1], math.nan, math.nan)
    return last, (y[0], y[1], y[3], y[4])


@compiled()
def law_mass_step(model: Vector, state: State, effort: float) -> tuple[State, tuple[float, float]]:
    """`law_step` with the output of a rigid axis, (x, v)."""
    state, output = law_step(model, state, effort)
    return state, (output[0], output[1])


@compiled()
def law_run(
    model: Vector, state: State, effort: Vector, out: Vector, deflection: Vector,
    event_time: Vector, event_mode: NDArray[np.int8],
) -> tuple[int, int]:  # fmt: skip
    """Propagate one trajectory and store every sample.

    Parameters
    ----------
    model, state
        As in `law_step`.
    effort
        Shape (n,).
    out
        Output, shape (2, n + 1): position and velocity; or (4, n + 1), with those of the load.
    deflection
        Output, shape (n + 1,): of the bristles.
    event_time, event_mode
        Outputs: the events as far as there is room.

    Returns
    -------
    count, failed
        The number of events, and the sample in which the budget was exceeded or -1.
    """
    work, new, spare = new_work()
    y = np.empty(5)
    y[0], y[1], y[2], y[3], y[4] = state[0], state[1], state[2], state[4], state[3]
    h, mode = state[5], int(state[6])
    arm = out.shape[0] == 4
    count = 0
    for k in range(effort.size + 1):
        out[0, k], out[1, k], deflection[k] = y[0], y[1], y[2]
        if arm:
            out[2, k], out[3, k] = y[3], y[4]
        if k == effort.size:
            break
        h, mode, count, finished = law_sample(
            model, effort[k] - model[OFFSET], y, h, mode, k * model[TIME],
            event_time, event_mode, count, work, new, spare,
        )  # fmt: skip
        if not finished:
            return count, k
    return count, -1


@compiled()
def law_batch(
    models: NDArray[np.float64], states: NDArray[np.float64], efforts: NDArray[np.float64],
    every: int, out: NDArray[np.float64], first: int, last: int,
) -> tuple[int, int]:  # fmt: skip
    """Propagate trajectories ``first`` to ``last`` (exclusive), storing some of their samples.

    Parameters
    ----------
    models
        Shape (1 or batch, MODEL_SIZE).
    states
        Shape (batch, 7); replaced by the last states.
    efforts
        Shape (1 or batch, n).
    every
        Store the state after every so many samples; 0 to store none.
    out
        Output, shape (batch, n // every, 2 or 4): as ``out`` in `law_run`, the last axis first.
    first, last
        The trajectories to propagate.

    Returns
    -------
    trajectory, sample
        Where the budget was exceeded, or (-1, -1).
    """
    work, new, spare = new_work()
    no_time, no_mode = np.empty(0), np.empty(0, dtype=np.int8)
    y = np.empty(5)
    arm = out.shape[2] == 4
    for b in range(first, last):
        model = models[b if models.shape[0] > 1 else 0]
        effort = efforts[b if efforts.shape[0] > 1 else 0]
        y[0], y[1], y[2] = states[b, 0], states[b, 1], states[b, 2]
        y[3], y[4] = states[b, 4], states[b, 3]
        h, mode = states[b, 5], int(states[b, 6])
        row = 0
        for k in range(effort.size):
            h, mode, _, finished = law_sample(
                model, effort[k] - model[OFFSET], y, h, mode, 0.0, no_time, no_mode, 0,
                work, new, spare,
            )  # fmt: skip
            if not finished:
                return b, k
            if every > 0 and (k + 1) % every == 0:
                out[b, row, 0], out[b, row, 1] = y[0], y[1]
                if arm:
                    out[b, row, 2], out[b, row, 3] = y[3], y[4]
                row += 1
        states[b, 0], states[b, 1], states[b, 2] = y[0], y[1], y[2]
        states[b, 3], states[b, 4] = y[4], y[3]
        states[b, 5], states[b, 6] = h, mode
    return -1, -1
