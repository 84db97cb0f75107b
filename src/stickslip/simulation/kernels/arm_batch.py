"""Many flexible arms at once, several in lockstep.

A sample with events is in `arm`; here is its fast path for many trajectories side by side.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.kernels.arm import (
    BUDGET_EXCEEDED,
    State,
    Vector,
    arm_events,
    arm_fields,
    energy_root,
    largest_magnitude,
    slip_threshold,
    stick_margin,
)
from stickslip.simulation.kernels.double_double import accumulate
from stickslip.simulation.kernels.first_root import WORK_SIZE

BATCH_BLOCK = 64  # samples between renewals of the energy bound
LANES = 16  # trajectories propagated in lockstep

# Rows of the lockstep table t, one number a lane in each: increments of the lane's mode (high and
# low parts), and:
_F0 = 40  # F = U - F0
_PV, _PD, _PU = 41, 42, 43  # the tested quantity p = PV v1 + PD d + PU U
_MIN, _MAX = 44, 45  # its bounds at both ends of a sample
_OFFSET = 46
_PASSED = 47
_ROWS = 48


@compiled()
def _aligned(size: int) -> Vector:
    """Return zeros that begin at a cache line, so that no vector straddles two of them."""
    values = np.zeros(size + 8)
    start = (-(values.ctypes.data // 8)) % 8
    return values[start : start + size]


@compiled()
def _enter(t: Vector, i: int, m: Any, mode: int) -> None:
    """Prepare lane i for samples in a mode."""
    low_part = 1.0 if m.fine != 0.0 else 0.0
    for j in range(20):
        t[j * LANES + i] = m.high[mode + 1, j]
        t[(20 + j) * LANES + i] = low_part * m.low[mode + 1, j]
    t[_OFFSET * LANES + i] = m.offset
    t[_F0 * LANES + i] = m.fc_p if mode > 0 else (-m.fc_n if mode < 0 else 0.0)
    t[_PV * LANES + i] = float(mode)
    t[_PD * LANES + i] = -m.ks if mode == 0 else 0.0
    t[_PU * LANES + i] = 1.0 if mode == 0 else 0.0


@compiled()
def _bound(t: Vector, i: int, m: Any, mode: int, R: float, u_max: float) -> None:
    """Renew the bounds of lane i; R and u_max hold for the block of samples to come."""
    if mode == 0:
        margin = stick_margin(m, R, u_max)
        t[_MIN * LANES + i], t[_MAX * LANES + i] = margin - m.fs_n, m.fs_p - margin
    else:
        t[_MIN * LANES + i], t[_MAX * LANES + i] = slip_threshold(m, R, u_max), np.inf


@compiled(inline=True)
def _lockstep(y: Vector, new: Vector, t: Vector, u: Vector, k: int, fine: bool) -> int:
    """Propagate all lanes over one sample without events; return how many may have had one.

    The loop over the lanes has no branch in it, so that it becomes vector instructions. Sums are
    taken in the order of `slip` and `rest`, so that lanes and single runs agree to the last bit.
    """
    L = LANES
    failed = 0
    for i in range(LANES):
        x, v, d, w, z = y[i], y[L + i], y[2 * L + i], y[3 * L + i], y[4 * L + i]
        xl, vl, dl, wl, zl = y[5 * L + i], y[6 * L + i], y[7 * L + i], y[8 * L + i], y[9 * L + i]
        U = u[k, i] - t[_OFFSET * L + i]
        F = U - t[_F0 * L + i]
        dx = (t[0 * L + i] * v + t[3 * L + i] * F) + (t[1 * L + i] * d + t[2 * L + i] * w)
        dv = (t[4 * L + i] * v + t[7 * L + i] * F) + (t[5 * L + i] * d + t[6 * L + i] * w)
        dd = (t[8 * L + i] * v + t[11 * L + i] * F) + (t[9 * L + i] * d + t[10 * L + i] * w)
        dw = (t[12 * L + i] * v + t[15 * L + i] * F) + (t[13 * L + i] * d + t[14 * L + i] * w)
        dz = (t[16 * L + i] * v + t[19 * L + i] * F) + (t[17 * L + i] * d + t[18 * L + i] * w)
        if fine:
            dx += (t[20 * L + i] * v + t[23 * L + i] * F) + (t[21 * L + i] * d + t[22 * L + i] * w)
            dv += (t[24 * L + i] * v + t[27 * L + i] * F) + (t[25 * L + i] * d + t[26 * L + i] * w)
            dd += (t[28 * L + i] * v + t[31 * L + i] * F) + (t[29 * L + i] * d + t[30 * L + i] * w)
            dw += (t[32 * L + i] * v + t[35 * L + i] * F) + (t[33 * L + i] * d + t[34 * L + i] * w)
            dz += (t[36 * L + i] * v + t[39 * L + i] * F) + (t[37 * L + i] * d + t[38 * L + i] * w)
        nx, nxl = accumulate(x, xl, dx)
        nv, nvl = accumulate(v, vl, dv)
        nd, ndl = accumulate(d, dl, dd)
        nw, nwl = accumulate(w, wl, dw)
        nz, nzl = accumulate(z, zl, dz)
        p0 = t[_PV * L + i] * v + (t[_PD * L + i] * d + t[_PU * L + i] * U)
        p1 = t[_PV * L + i] * nv + (t[_PD * L + i] * nd + t[_PU * L + i] * U)
        low, high = t[_MIN * L + i], t[_MAX * L + i]
        passed = (p0 >= low) & (p0 <= high) & (p1 >= low) & (p1 <= high)
        failed += 0 if passed else 1
        t[_PASSED * L + i] = 1.0 if passed else 0.0
        new[i], new[L + i], new[2 * L + i], new[3 * L + i], new[4 * L + i] = nx, nv, nd, nw, nz
        new[5 * L + i], new[6 * L + i], new[7 * L + i] = nxl, nvl, ndl
        new[8 * L + i], new[9 * L + i] = nwl, nzl
    return failed


@compiled()
def _advance(
    y: Vector, new: Vector, t: Vector, u: Vector, k: int, stop: int, fine: bool
) -> tuple[int, bool, bool]:
    """Propagate all lanes from sample k until one of them may have an event, or to ``stop``.

    The states go to and fro between the two tables. Returns the sample reached; False if some lanes
    have an event in it; and whether the states at its start are in ``new`` (then those at its end
    are in ``y``, for the lanes without an event).
    """
    while k < stop:
        if _lockstep(y, new, t, u, k, fine) > 0:
            return k, False, False
        k += 1
        if k == stop:
            return k, True, True
        if _lockstep(new, y, t, u, k, fine) > 0:
            return k, False, True
        k += 1
    return k, True, False


@compiled()
def _state(y: Vector, i: int) -> State:
    """Return lane i's state."""
    L = LANES
    return (
        y[i], y[i + L], y[i + 2 * L], y[i + 3 * L], y[i + 4 * L],
        y[i + 5 * L], y[i + 6 * L], y[i + 7 * L], y[i + 8 * L], y[i + 9 * L],
    )  # fmt: skip


@compiled()
def arm_batch(
    models: NDArray[np.float64], states: NDArray[np.float64], efforts: NDArray[np.float64],
    every: int, out: NDArray[np.float64], first: int, last: int,
) -> tuple[int, int]:  # fmt: skip
    """Propagate trajectories ``first`` to ``last`` (exclusive), as `PlantKernels.batch`."""
    n = efforts.shape[1]
    shared = efforts.shape[0] == 1
    largest = 0.0
    y, new = _aligned(10 * LANES), _aligned(10 * LANES)  # ten rows of state
    t = _aligned(_ROWS * LANES)
    u = _aligned(BATCH_BLOCK * LANES).reshape((BATCH_BLOCK, LANES))
    work = np.empty(WORK_SIZE)
    no_time, no_mode = np.empty(0), np.empty(0, np.int8)
    modes = np.zeros(LANES, np.int64)
    R = np.zeros(LANES)
    u_max = np.zeros(LANES)
    for start in range(first, last, LANES):
        lanes = min(LANES, last - start)
        fine = False
        for i in range(LANES):  # lanes left over repeat the last trajectory
            b = start + min(i, lanes - 1)
            for j in range(10):
                y[j * LANES + i] = states[b, j]
            modes[i] = int(states[b, 10])
            m = arm_fields(models[b if models.shape[0] > 1 else 0])
            fine = fine or m.fine != 0.0
            _enter(t, i, m, modes[i])
        due = every
        row = 0
        for k0 in range(0, n, BATCH_BLOCK):
            size = min(BATCH_BLOCK, n - k0)
            if shared:
                effort = efforts[0, k0 : k0 + size]
                largest = largest_magnitude(effort)
                for j in range(size):
                    for i in range(LANES):
                        u[j, i] = effort[j]
            for i in range(LANES):
                b = start + min(i, lanes - 1)
                m = arm_fields(models[b if models.shape[0] > 1 else 0])
                if not shared:
                    effort = efforts[b, k0 : k0 + size]
                    largest = largest_magnitude(effort)
                    for j in range(size):
                        u[j, i] = effort[j]
                u_max[i] = largest + abs(m.offset)
                R[i] = energy_root(m, y[LANES + i], y[2 * LANES + i], y[3 * LANES + i])
                R[i] += size * m.growth * u_max[i]
                _bound(t, i, m, modes[i], R[i], u_max[i])
            j = 0
            while j < size:
                stop = min(size, j + due) if every > 0 else size
                reached, passed, swapped = _advance(y, new, t, u, j, stop, fine)
                if swapped:
                    y, new = new, y
                due -= reached - j
                j = reached
                if not passed:
                    for i in range(LANES):
                        if t[_PASSED * LANES + i] == 0.0:
                            b = start + min(i, lanes - 1)
                            m = arm_fields(models[b if models.shape[0] > 1 else 0])
                            state, mode, _, flags = arm_events(
                                m, work, no_time, no_mode, 0,
                                (modes[i], u[j, i] - m.offset, 0.0), _state(y, i),
                            )  # fmt: skip
                            if flags & BUDGET_EXCEEDED:
                                return b, k0 + j
                            for r, value in enumerate(state):
                                new[r * LANES + i] = value
                            if mode != modes[i]:
                                modes[i] = mode
                                _enter(t, i, m, mode)
                                _bound(t, i, m, mode, R[i], u_max[i])
                    y, new = new, y
                    due -= 1
                    j += 1
                if every > 0 and due == 0:
                    for i in range(lanes):
                        out[start + i, row, 0] = y[i]
                        out[start + i, row, 1] = y[LANES + i]
                        out[start + i, row, 2] = y[4 * LANES + i]
                        out[start + i, row, 3] = y[3 * LANES + i]
                    row += 1
                    due = every
        for i in range(lanes):
            for j in range(10):
                states[start + i, j] = y[j * LANES + i]
            states[start + i, 10] = modes[i]
    return -1, -1
