"""Many flexible arms at once, several in lockstep.

A sample with events is in `arm`; here is its fast path for many trajectories side by side.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import fields_at, places
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

_EACH = ("f8", (LANES,))
_STATES = np.dtype(
    [(name, *_EACH) for name in ("x", "v", "d", "w", "z", "xl", "vl", "dl", "wl", "zl")]
)
_LOCKSTEP = np.dtype(
    [
        # Increments of the lane's mode, as `increments` gives them
        ("high", "f8", (20, LANES)),
        ("low", "f8", (20, LANES)),
        ("f0", *_EACH),  # F = U - f0
        # The tested quantity p = pv v1 + pd d + pu U, and its bounds at both ends of a sample
        ("pv", *_EACH),
        ("pd", *_EACH),
        ("pu", *_EACH),
        ("lowest", *_EACH),
        ("highest", *_EACH),
        ("offset", *_EACH),
        ("passed", *_EACH),  # 1 if the lane had no event in the last sample
    ]
)
_lanes, _table = fields_at(_STATES), fields_at(_LOCKSTEP)
_TABLE_SIZE = places(_LOCKSTEP)


@compiled()
def _aligned(size: int) -> Vector:
    """Return zeros that begin at a cache line, so that no vector straddles two of them."""
    values = np.zeros(size + 8)
    start = (-(values.ctypes.data // 8)) % 8
    return values[start : start + size]


@compiled()
def _enter(table: Vector, i: int, m: Any, mode: int) -> None:
    """Prepare lane i for samples in a mode."""
    t = _table(table)
    low_part = 1.0 if m.fine != 0.0 else 0.0
    for j in range(20):
        t.high[j, i] = m.high[mode + 1, j]
        t.low[j, i] = low_part * m.low[mode + 1, j]
    t.offset[i] = m.offset
    t.f0[i] = m.fc_p if mode > 0 else (-m.fc_n if mode < 0 else 0.0)
    t.pv[i] = float(mode)
    t.pd[i] = -m.ks if mode == 0 else 0.0
    t.pu[i] = 1.0 if mode == 0 else 0.0


@compiled()
def _bound(table: Vector, i: int, m: Any, mode: int, R: float, u_max: float) -> None:
    """Renew the bounds of lane i; R and u_max hold for the block of samples to come."""
    t = _table(table)
    if mode == 0:
        margin = stick_margin(m, R, u_max)
        t.lowest[i], t.highest[i] = margin - m.fs_n, m.fs_p - margin
    else:
        t.lowest[i], t.highest[i] = slip_threshold(m, R, u_max), np.inf


@compiled(inline=True)
def _lockstep(
    state: Vector, following: Vector, table: Vector, u: Vector, k: int, fine: bool
) -> int:
    """Propagate all lanes over one sample without events; return how many may have had one.

    The loop over the lanes has no branch in it, so that it becomes vector instructions. Sums are
    taken in the order of `slip` and `rest`, so that lanes and single runs agree to the last bit.
    """
    y, new, t = _lanes(state), _lanes(following), _table(table)
    failed = 0
    for i in range(LANES):
        x, v, d, w, z = y.x[i], y.v[i], y.d[i], y.w[i], y.z[i]
        xl, vl, dl, wl, zl = y.xl[i], y.vl[i], y.dl[i], y.wl[i], y.zl[i]
        U = u[k, i] - t.offset[i]
        F = U - t.f0[i]
        dx = (t.high[0, i] * v + t.high[3, i] * F) + (t.high[1, i] * d + t.high[2, i] * w)
        dv = (t.high[4, i] * v + t.high[7, i] * F) + (t.high[5, i] * d + t.high[6, i] * w)
        dd = (t.high[8, i] * v + t.high[11, i] * F) + (t.high[9, i] * d + t.high[10, i] * w)
        dw = (t.high[12, i] * v + t.high[15, i] * F) + (t.high[13, i] * d + t.high[14, i] * w)
        dz = (t.high[16, i] * v + t.high[19, i] * F) + (t.high[17, i] * d + t.high[18, i] * w)
        if fine:
            dx += (t.low[0, i] * v + t.low[3, i] * F) + (t.low[1, i] * d + t.low[2, i] * w)
            dv += (t.low[4, i] * v + t.low[7, i] * F) + (t.low[5, i] * d + t.low[6, i] * w)
            dd += (t.low[8, i] * v + t.low[11, i] * F) + (t.low[9, i] * d + t.low[10, i] * w)
            dw += (t.low[12, i] * v + t.low[15, i] * F) + (t.low[13, i] * d + t.low[14, i] * w)
            dz += (t.low[16, i] * v + t.low[19, i] * F) + (t.low[17, i] * d + t.low[18, i] * w)
        nx, nxl = accumulate(x, xl, dx)
        nv, nvl = accumulate(v, vl, dv)
        nd, ndl = accumulate(d, dl, dd)
        nw, nwl = accumulate(w, wl, dw)
        nz, nzl = accumulate(z, zl, dz)
        p0 = t.pv[i] * v + (t.pd[i] * d + t.pu[i] * U)
        p1 = t.pv[i] * nv + (t.pd[i] * nd + t.pu[i] * U)
        low, high = t.lowest[i], t.highest[i]
        passed = (p0 >= low) & (p0 <= high) & (p1 >= low) & (p1 <= high)
        failed += 0 if passed else 1
        t.passed[i] = 1.0 if passed else 0.0
        new.x[i], new.v[i], new.d[i], new.w[i], new.z[i] = nx, nv, nd, nw, nz
        new.xl[i], new.vl[i], new.dl[i], new.wl[i], new.zl[i] = nxl, nvl, ndl, nwl, nzl
    return failed


@compiled()
def _advance(
    y: Vector, new: Vector, table: Vector, u: Vector, k: int, stop: int, fine: bool
) -> tuple[int, bool, bool]:
    """Propagate all lanes from sample k until one of them may have an event, or to ``stop``.

    The states go to and fro between the two tables. Returns the sample reached; False if some lanes
    have an event in it; and whether the states at its start are in ``new`` (then those at its end
    are in ``y``, for the lanes without an event).
    """
    while k < stop:
        if _lockstep(y, new, table, u, k, fine) > 0:
            return k, False, False
        k += 1
        if k == stop:
            return k, True, True
        if _lockstep(new, y, table, u, k, fine) > 0:
            return k, False, True
        k += 1
    return k, True, False


@compiled()
def _state(state: Vector, i: int) -> State:
    """Return lane i's state."""
    y = _lanes(state)
    return (
        y.x[i], y.v[i], y.d[i], y.w[i], y.z[i], y.xl[i], y.vl[i], y.dl[i], y.wl[i], y.zl[i]
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
    table = _aligned(_TABLE_SIZE)
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
            _enter(table, i, m, modes[i])
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
                s = _lanes(y)
                R[i] = energy_root(m, s.v[i], s.d[i], s.w[i])
                R[i] += size * m.growth * u_max[i]
                _bound(table, i, m, modes[i], R[i], u_max[i])
            j = 0
            while j < size:
                stop = min(size, j + due) if every > 0 else size
                reached, passed, swapped = _advance(y, new, table, u, j, stop, fine)
                if swapped:
                    y, new = new, y
                due -= reached - j
                j = reached
                if not passed:
                    for i in range(LANES):
                        if _table(table).passed[i] == 0.0:
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
                                _enter(table, i, m, mode)
                                _bound(table, i, m, mode, R[i], u_max[i])
                    y, new = new, y
                    due -= 1
                    j += 1
                if every > 0 and due == 0:
                    s = _lanes(y)
                    for i in range(lanes):
                        out[start + i, row, 0], out[start + i, row, 1] = s.x[i], s.v[i]
                        out[start + i, row, 2], out[start + i, row, 3] = s.z[i], s.w[i]
                    row += 1
                    due = every
        for i in range(lanes):
            for j in range(10):
                states[start + i, j] = y[j * LANES + i]
            states[start + i, 10] = modes[i]
    return -1, -1
