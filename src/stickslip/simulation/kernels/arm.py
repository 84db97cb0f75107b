"""The flexible arm sample by sample: one step, one trajectory.

What a sample does is in `arm_events`; here are the loops around its fast path.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.kernels.arm_events import (
    BUDGET_EXCEEDED,
    FC_N,
    FC_P,
    FINE,
    FS_N,
    FS_P,
    GROWTH,
    KS,
    OFFSET,
    TIME,
    State,
    Vector,
    arm_events,
    energy_root,
    increments,
    largest_magnitude,
    rest,
    slip,
    slip_threshold,
    stick_margin,
)
from stickslip.simulation.kernels.event_list import GRAZING
from stickslip.simulation.kernels.first_root import WORK_SIZE

__all__ = ["arm_run", "arm_step"]

BLOCK_MIN, BLOCK_MAX = 8, 128  # samples between renewals of the energy bound


@compiled(inline=True)
def _block(R: float, growth: float) -> int:
    """Return for how many samples a bound is worth keeping: until it may have doubled."""
    return BLOCK_MAX if BLOCK_MAX * growth <= R else max(int(R / growth), BLOCK_MIN)


@compiled()
def arm_step(
    model: Vector, state: State, effort: float
) -> tuple[State, tuple[float, float, float, float]]:
    """Propagate one sample under a held effort; pure.

    Parameters
    ----------
    model
        Vector of `MODEL_SIZE` numbers.
    state
        (x1, v1, d, v2, x2, their five low parts, mode), eleven floats.
    effort
        Held over the sample.

    Returns
    -------
    state, output
        The state at the end and (x1, v1, x2, v2). The mode is NaN if the event budget was exceeded
        or the effort or the motion is not finite; from such a state follows one of NaN.
    """
    y = state[:10]
    has_failed = math.isnan(state[10])
    mode = 0 if has_failed else int(state[10])
    U = math.nan if has_failed else effort - model[OFFSET]
    R = energy_root(model, y[1], y[2], y[3]) + model[GROWTH] * abs(U)
    c, low = increments(model, mode)
    if mode == 0:
        ny = rest(c, low, model[FINE] != 0.0, y)
        margin = stick_margin(model, R, abs(U))
        w_max, w_min = model[FS_P] - margin, margin - model[FS_N]
        ok = w_min <= U - model[KS] * y[2] <= w_max and w_min <= U - model[KS] * ny[2] <= w_max
    else:
        ny = slip(c, low, model[FINE] != 0.0, U - model[FC_P] if mode > 0 else U + model[FC_N], y)
        threshold = slip_threshold(model, R, abs(U))
        ok = mode * y[1] > threshold and mode * ny[1] > threshold
    flags = 0
    if not ok:
        ny, mode, _, flags = arm_events(
            model, np.empty(WORK_SIZE), np.empty(0), np.empty(0, np.int8), 0, 0.0, mode, U, y
        )
    failed = flags & BUDGET_EXCEEDED != 0 or not abs(ny[1]) < math.inf
    new_mode = math.nan if failed else float(mode)
    return (*ny, new_mode), (ny[0], ny[1], ny[4], ny[3])


@compiled()
def arm_run(
    model: Vector, state: State, effort: Vector, x1: Vector, v1: Vector, x2: Vector, v2: Vector,
    grazing: NDArray[np.bool_], event_time: Vector, event_mode: NDArray[np.int8],
) -> tuple[State, int, int]:  # fmt: skip
    """Propagate one trajectory and store every sample.

    Parameters
    ----------
    model, state
        As in `arm_step`.
    effort
        Shape (n,).
    x1, v1, x2, v2
        Outputs, shape (n + 1,).
    grazing
        Output, shape (n,), zero on entry: samples with an event too close to call.
    event_time, event_mode
        Outputs: the events as far as there is room.

    Returns
    -------
    state, count, failed
        The last state, the number of events, and the sample that exceeded the event budget or -1.
    """
    y = state[:10]
    mode = int(state[10])
    n = np.uint64(effort.size)  # unsigned: no index counts from the end
    T, offset, ks = model[TIME], model[OFFSET], model[KS]
    u_max = largest_magnitude(effort) + abs(offset)
    growth = model[GROWTH] * u_max
    fine = model[FINE] != 0.0
    work = np.empty(WORK_SIZE)
    count = 0
    x1[0], v1[0], x2[0], v2[0] = y[0], y[1], y[4], y[3]
    k = np.uint64(0)
    while k < n:
        R0 = energy_root(model, y[1], y[2], y[3])
        block = _block(R0, growth)
        stop = min(k + np.uint64(block), n)
        R = R0 + block * growth
        threshold = slip_threshold(model, R, u_max)
        margin = stick_margin(model, R, u_max)
        w_max, w_min = model[FS_P] - margin, margin - model[FS_N]
        while k < stop:
            # one stretch in one mode
            c, low = increments(model, mode)
            if mode == 0:
                while k < stop:
                    U = effort[k] - offset
                    ny = rest(c, low, fine, y)
                    if not (w_min <= U - ks * y[2] <= w_max and w_min <= U - ks * ny[2] <= w_max):
                        break
                    y = ny
                    k += np.uint64(1)
                    x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
            else:
                s = float(mode)
                fc = model[FC_P] if mode > 0 else -model[FC_N]
                clear = s * y[1] > threshold
                while clear and k < stop:
                    ny = slip(c, low, fine, (effort[k] - offset) - fc, y)
                    if not s * ny[1] > threshold:
                        break
                    y = ny
                    k += np.uint64(1)
                    x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
            if k < stop:
                y, mode, count, flags = arm_events(
                    model, work, event_time, event_mode, count, k * T, mode, effort[k] - offset, y
                )
                if flags:
                    grazing[k] = flags & GRAZING
                    if flags & BUDGET_EXCEEDED:
                        return (*y, float(mode)), count, int(np.int64(k))
                k += np.uint64(1)
                x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
    return (*y, float(mode)), count, -1
