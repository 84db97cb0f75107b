"""The flexible arm sample by sample: one step, one trajectory, many trajectories.

What a sample does is in `arm_events`; here are the loops around its fast path.
"""

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.arm_events import (
    BUDGET_EXCEEDED,
    FC_N,
    FC_P,
    FINE,
    FS_N,
    FS_P,
    GRAZING,
    GROWTH,
    KS,
    OFFSET,
    TIME,
    State,
    Vector,
    arm_events,
    energy_root,
    increments,
    rest,
    slip,
    slip_threshold,
    stick_margin,
)
from stickslip.simulation.first_root import WORK_SIZE

__all__ = ["LANES", "arm_batch", "arm_run", "arm_step"]

BLOCK_MIN, BLOCK_MAX = 8, 128  # samples between renewals of the energy bound
LANES = 16  # trajectories propagated in lockstep
MAGNITUDE = np.int64(0x7FFFFFFFFFFFFFFF)  # all bits of a double but its sign


@compiled(inline=True)
def _block(R: float, growth: float) -> int:
    """Return for how many samples a bound is worth keeping: until it may have doubled."""
    return BLOCK_MAX if R >= BLOCK_MAX * growth else max(int(R / growth), BLOCK_MIN)


@compiled()
def _largest(values: Vector) -> float:
    """Return the largest magnitude, by the integers whose order is that of magnitudes."""
    bits = values.view(np.int64)
    largest = np.int64(0)
    for i in range(bits.size):
        largest = max(largest, bits[i] & MAGNITUDE)
    return np.array([largest]).view(np.float64)[0]


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
        The state at the end and (x1, v1, x2, v2). The mode is NaN if the event budget was exceeded.
    """
    y = state[:10]
    mode = int(state[10])
    U = effort - model[OFFSET]
    R = energy_root(model, y[1], y[2], y[3]) + model[GROWTH] * abs(U)
    c, low = increments(model, mode)
    if mode == 0:
        ny = rest(c, low, y)
        margin = stick_margin(model, R, abs(U))
        w_max, w_min = model[FS_P] - margin, margin - model[FS_N]
        ok = w_min <= U - model[KS] * y[2] <= w_max and w_min <= U - model[KS] * ny[2] <= w_max
    else:
        ny = slip(c, low, model[FINE] != 0.0, U - model[FC_P] if mode > 0 else U + model[FC_N], y)
        threshold = slip_threshold(model, R, abs(U))
        ok = mode * y[1] > threshold and mode * ny[1] > threshold
    new_mode = float(mode)
    if not ok:
        ny, mode, _, flags = arm_events(
            model, np.empty(WORK_SIZE), np.empty(0), np.empty(0, np.int8), 0, 0.0, mode, U, y
        )
        new_mode = np.nan if flags & BUDGET_EXCEEDED else float(mode)
    return ny + (new_mode,), (ny[0], ny[1], ny[4], ny[3])


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
    u_max = _largest(effort) + abs(offset)
    growth = model[GROWTH] * u_max
    fine = model[FINE] != 0.0
    work = np.empty(WORK_SIZE)
    count = 0
    x1[0], v1[0], x2[0], v2[0] = y[0], y[1], y[4], y[3]
    k = np.uint64(0)
    while k < n:
        R = energy_root(model, y[1], y[2], y[3])
        block = _block(R, growth)
        stop = min(k + np.uint64(block), n)
        R += block * growth
        threshold = slip_threshold(model, R, u_max)
        margin = stick_margin(model, R, u_max)
        w_max, w_min = model[FS_P] - margin, margin - model[FS_N]
        while k < stop:
            # one stretch in one mode
            c, low = increments(model, mode)
            if mode == 0:
                while k < stop:
                    U = effort[k] - offset
                    ny = rest(c, low, y)
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
                        return y + (float(mode),), count, np.int64(k)
                k += np.uint64(1)
                x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
    return y + (float(mode),), count, -1


# Rows of the lockstep table, one number a lane in each
_STATE = 0  # (x1, v1, d, v2, x2) and their low parts
_OLD = 10  # the same at the start of the sample
_HIGH = 20  # increments of the lane's mode, high parts
_LOW = 40  # low parts
_F0 = 60  # F = U - F0
_PV, _PD, _PU = 61, 62, 63  # the tested quantity p = PV v1 + PD d + PU U
_MIN, _MAX = 64, 65  # its bounds at both ends of a sample
_OFFSET = 66
_ROWS = 67


@compiled(inline=True)
def _enter(t: Vector, i: int, model: Vector, mode: int, R: float, u_max: float) -> None:
    """Prepare lane i for samples in a mode."""
    E = 20 * (mode + 1)
    for j in range(20):
        t[(_HIGH + j) * LANES + i] = model[E + j]
        t[(_LOW + j) * LANES + i] = model[E + 60 + j]
    if mode == 0:
        margin = stick_margin(model, R, u_max)
        t[_F0 * LANES + i] = 0.0
        t[_PV * LANES + i], t[_PD * LANES + i], t[_PU * LANES + i] = 0.0, -model[KS], 1.0
        t[_MIN * LANES + i], t[_MAX * LANES + i] = margin - model[FS_N], model[FS_P] - margin
    else:
        t[_F0 * LANES + i] = model[FC_P] if mode > 0 else -model[FC_N]
        t[_PV * LANES + i], t[_PD * LANES + i], t[_PU * LANES + i] = float(mode), 0.0, 0.0
        t[_MIN * LANES + i], t[_MAX * LANES + i] = slip_threshold(model, R, u_max), np.inf


@compiled(inline=True)
def _lane(t: Vector, i: int, first: int) -> State:
    """Return the state of lane i from the rows at ``first``."""
    return (
        t[first * LANES + i], t[(first + 1) * LANES + i], t[(first + 2) * LANES + i],
        t[(first + 3) * LANES + i], t[(first + 4) * LANES + i], t[(first + 5) * LANES + i],
        t[(first + 6) * LANES + i], t[(first + 7) * LANES + i], t[(first + 8) * LANES + i],
        t[(first + 9) * LANES + i],
    )  # fmt: skip


@compiled()
def _lockstep(t: Vector, u: Vector, k: int, fine: bool) -> int:
    """Propagate all lanes over one sample without events; return how many may have had one.

    The loop over the lanes has no branch in it, so that it becomes vector instructions.
    """
    L = LANES
    failed = 0
    for i in range(LANES):
        x, v, d, w, z = t[i], t[L + i], t[2 * L + i], t[3 * L + i], t[4 * L + i]
        xl, vl, dl, wl, zl = t[5 * L + i], t[6 * L + i], t[7 * L + i], t[8 * L + i], t[9 * L + i]
        U = u[k * L + i] - t[_OFFSET * L + i]
        F = U - t[_F0 * L + i]
        dx = (t[20 * L + i] * v + t[23 * L + i] * F) + (t[21 * L + i] * d + t[22 * L + i] * w)
        dv = (t[24 * L + i] * v + t[27 * L + i] * F) + (t[25 * L + i] * d + t[26 * L + i] * w)
        dd = (t[28 * L + i] * v + t[31 * L + i] * F) + (t[29 * L + i] * d + t[30 * L + i] * w)
        dw = (t[32 * L + i] * v + t[35 * L + i] * F) + (t[33 * L + i] * d + t[34 * L + i] * w)
        dz = (t[36 * L + i] * v + t[39 * L + i] * F) + (t[37 * L + i] * d + t[38 * L + i] * w)
        if fine:
            dx += (t[40 * L + i] * v + t[43 * L + i] * F) + (t[41 * L + i] * d + t[42 * L + i] * w)
            dv += (t[44 * L + i] * v + t[47 * L + i] * F) + (t[45 * L + i] * d + t[46 * L + i] * w)
            dd += (t[48 * L + i] * v + t[51 * L + i] * F) + (t[49 * L + i] * d + t[50 * L + i] * w)
            dw += (t[52 * L + i] * v + t[55 * L + i] * F) + (t[53 * L + i] * d + t[54 * L + i] * w)
            dz += (t[56 * L + i] * v + t[59 * L + i] * F) + (t[57 * L + i] * d + t[58 * L + i] * w)
        nx, nxl = accumulate(x, xl, dx)
        nv, nvl = accumulate(v, vl, dv)
        nd, ndl = accumulate(d, dl, dd)
        nw, nwl = accumulate(w, wl, dw)
        nz, nzl = accumulate(z, zl, dz)
        p = t[_PV * L + i] * v + (t[_PD * L + i] * d + t[_PU * L + i] * U)
        np_ = t[_PV * L + i] * nv + (t[_PD * L + i] * nd + t[_PU * L + i] * U)
        low, high = t[_MIN * L + i], t[_MAX * L + i]
        failed += 0 if (p >= low) & (p <= high) & (np_ >= low) & (np_ <= high) else 1
        t[10 * L + i], t[11 * L + i], t[12 * L + i] = x, v, d
        t[13 * L + i], t[14 * L + i], t[15 * L + i] = w, z, xl
        t[16 * L + i], t[17 * L + i], t[18 * L + i], t[19 * L + i] = vl, dl, wl, zl
        t[i], t[L + i], t[2 * L + i], t[3 * L + i], t[4 * L + i] = nx, nv, nd, nw, nz
        t[5 * L + i], t[6 * L + i], t[7 * L + i], t[8 * L + i], t[9 * L + i] = nxl, nvl, ndl, nwl, nzl
    return failed
