"""Exact propagation of a single mass under a held input, event by event.

Van de Wijdeven (2002) B, Eq. 1. While slipping in direction s, m v' = F - c v with the held force
F = U - s fc (U is the effort less the offset), so that v is monotone within a sample: the sign at
its end shows whether there was a zero, and the zero is known in closed form. At a zero the mass
rests if |U| <= fs, else it slips the way of U; it cannot come to a second zero within the sample.

All increments are relative to the state, and every expression keeps its relative accuracy as
c T/m goes to 0, where cancellation would spoil the textbook forms.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import fields_at
from stickslip.plants.closed_forms import phi1, phi2, stopping_distance, stopping_time
from stickslip.simulation.kernels.double_double import accumulate

BOTH = ("f8", 2)  # values of both directions, the negative one first
MASS_MODEL = np.dtype(
    [
        ("sampling_time", "f8"),
        ("mass", "f8"),
        ("coulomb", *BOTH),
        ("static", *BOTH),
        ("viscous", *BOTH),
        ("offset", "f8"),
        # Increments over a whole sample: dv = decay v + gain F, dx = travel v + shift F
        ("decay", *BOTH),
        ("gain", *BOTH),
        ("travel", *BOTH),
        ("shift", *BOTH),
    ]
)
mass_fields = fields_at(MASS_MODEL)

GRAZING = 1  # flag of a sample: the outcome of an event was too close to call
GRAZING_TOLERANCE = 1e-10  # of the velocity at the start of a sample

Vector = NDArray[np.float64]
State = tuple[float, ...]  # (x, v, their low parts, mode)
Sample = tuple[int, float, float]  # mode, effort less the offset, and time at its start


@compiled()
def record_event(
    event_time: Vector, event_mode: NDArray[np.int8], count: int, time: float, mode: int
) -> int:
    """Write an event (its time, the mode after it) at ``count``, if there is room; return the next.

    Events beyond the room are counted all the same, as the caller needs their number.
    """
    if count < event_time.size:
        event_time[count] = time
        event_mode[count] = mode
    return count + 1


@compiled()
def fill_increments(model: Vector) -> None:
    """Fill in the increments over a whole sample, from the parameters of the model."""
    m = mass_fields(model)
    T = m.sampling_time
    for side in range(2):
        z = -m.viscous[side] * T / m.mass
        m.decay[side] = math.expm1(z)
        m.gain[side] = T / m.mass * phi1(z)
        m.travel[side] = T * phi1(z)
        m.shift[side] = T * T / m.mass * phi2(z)


@compiled(inline=True)
def _force(m: Any, mode: int, U: float) -> float:
    """Return the held force F = U - s fc while slipping."""
    return U - m.coulomb[1] if mode > 0 else U + m.coulomb[0]


@compiled(inline=True)
def _sudden(m: Any) -> bool:
    """Return whether static friction exceeds Coulomb friction: only then is a graze a jump."""
    return m.static[1] > m.coulomb[1] or m.static[0] > m.coulomb[0]


@compiled()
def _events(
    p: Any, event_time: Vector, event_mode: NDArray[np.int8], count: int, sample: Sample,
    y: tuple[float, float, float, float],
) -> tuple[float, float, float, float, int, int, int]:  # fmt: skip
    """Propagate y = (x, v, their low parts) over one sample in which it starts, stops or reverses.

    Events (time, mode after it) are appended at ``count`` as far as there is room. Returns the
    state, the mode, the new count and the flags. From an effort or a state that is not finite
    follows a state of NaN.
    """
    mode, U, t0 = sample
    x, v, xl, vl = y
    if not abs(U) + abs(v) < math.inf:
        return math.nan, math.nan, math.nan, math.nan, mode, count, 0
    T, m = p.sampling_time, p.mass
    rem = T
    flags = 0
    arrived = mode != 0
    if mode != 0:
        side = 1 if mode > 0 else 0
        F, c = _force(p, mode, U), p.viscous[side]
        if mode * F >= 0.0:
            # No zero: viscous friction has brought the velocity below the rounding of the increment
            x, xl = accumulate(x, xl, p.travel[side] * v + p.shift[side] * F)
            v, vl = v * math.exp(-c * T / m) + p.gain[side] * F, 0.0
            return x, v, xl, vl, (mode if v != 0.0 else 0), count, flags
        z = -c * v / F
        rem = max(T + m * v / F * stopping_time(z), 0.0)
        x, xl = accumulate(x, xl, -m * v * v / F * stopping_distance(z))
        v, vl = 0.0, 0.0
        if rem < GRAZING_TOLERANCE * T and _sudden(p):
            flags = GRAZING
        mode = 0
    if rem > 0.0:
        if p.static[1] < U:
            mode = 1
        elif -p.static[0] > U:
            mode = -1
    if arrived or mode != 0:
        count = record_event(event_time, event_mode, count, t0 + (T - rem), mode)
    if mode != 0:
        force = _force(p, mode, U)
        z = -p.viscous[1 if mode > 0 else 0] * rem / m
        x, xl = accumulate(x, xl, rem * rem / m * phi2(z) * force)
        v, vl = rem / m * phi1(z) * force, 0.0
    return x, v, xl, vl, mode, count, flags


@compiled(inline=True)
def _slip(
    m: Any, side: int, F: float, x: float, v: float, xl: float, vl: float
) -> tuple[float, float, float, float]:
    """Propagate over a whole sample in one direction."""
    nx, nxl = accumulate(x, xl, m.travel[side] * v + m.shift[side] * F)
    nv, nvl = accumulate(v, vl, m.decay[side] * v + m.gain[side] * F)
    return nx, nv, nxl, nvl


@compiled(inline=True)
def _sample(
    m: Any, mode: int, U: float, x: float, v: float, xl: float, vl: float
) -> tuple[float, float, float, float, bool]:
    """Propagate over a whole sample in one mode; the last is False if the mode may end in it."""
    if mode == 0:
        return x, v, xl, vl, -m.static[0] <= U <= m.static[1]
    x, v, xl, vl = _slip(m, 1 if mode > 0 else 0, _force(m, mode, U), x, v, xl, vl)
    return x, v, xl, vl, mode * v > 0.0


@compiled()
def mass_step(model: Vector, state: State, effort: float) -> tuple[State, tuple[float, float]]:
    """Propagate one sample under a held effort; pure. The output is (x, v).

    The mode is NaN if the effort or the motion is not finite; from such a state follows one of NaN.
    """
    x, v, xl, vl, mode_float = state
    m = mass_fields(model)
    has_failed = math.isnan(mode_float)
    mode = 0 if has_failed else int(mode_float)
    U = math.nan if has_failed else effort - m.offset
    nx, nv, nxl, nvl, ok = _sample(m, mode, U, x, v, xl, vl)
    if not ok:
        nx, nv, nxl, nvl, mode, _, _ = _events(
            m, np.empty(0), np.empty(0, dtype=np.int8), 0, (mode, U, 0.0), (x, v, xl, vl)
        )
    return (nx, nv, nxl, nvl, float(mode) if abs(nv) < math.inf else math.nan), (nx, nv)


@compiled()
def mass_run(
    model: Vector, state: State, effort: Vector, out: NDArray[np.float64],
    grazing: NDArray[np.bool_], event_time: Vector, event_mode: NDArray[np.int8],
) -> tuple[int, int]:  # fmt: skip
    """Propagate one trajectory and store every sample, as `PlantKernels.run`."""
    x, v, xl, vl, mode_float = state
    m = mass_fields(model)
    mode = int(mode_float)
    position, velocity = out[0], out[1]
    n = np.uint64(effort.size)  # unsigned: no index counts from the end
    T, offset = m.sampling_time, m.offset
    sudden = _sudden(m)
    count = 0
    position[0], velocity[0] = x, v
    k = np.uint64(0)
    while k < n:
        if mode == 0:
            while k < n and -m.static[0] <= effort[k] - offset <= m.static[1]:
                k += np.uint64(1)
                position[k], velocity[k] = x, v
        else:
            s = float(mode)
            side = 1 if mode > 0 else 0
            fc = m.coulomb[1] if mode > 0 else -m.coulomb[0]
            while k < n:
                nx, nv, nxl, nvl = _slip(m, side, (effort[k] - offset) - fc, x, v, xl, vl)
                if not s * nv > 0.0:
                    break
                if sudden and s * nv < GRAZING_TOLERANCE * (s * v):
                    grazing[k] = True
                x, v, xl, vl = nx, nv, nxl, nvl
                k += np.uint64(1)
                position[k], velocity[k] = x, v
        if k < n:
            x, v, xl, vl, mode, count, flags = _events(
                m, event_time, event_mode, count, (mode, effort[k] - offset, k * T), (x, v, xl, vl)
            )
            if flags:
                grazing[k] = True
            k += np.uint64(1)
            position[k], velocity[k] = x, v
    return count, -1


@compiled()
def mass_batch(
    models: NDArray[np.float64], states: NDArray[np.float64], efforts: NDArray[np.float64],
    every: int, out: NDArray[np.float64], first: int, last: int,
) -> tuple[int, int]:  # fmt: skip
    """Propagate trajectories ``first`` to ``last`` (exclusive), as `PlantKernels.batch`."""
    n = efforts.shape[1]
    no_time, no_mode = np.empty(0), np.empty(0, dtype=np.int8)
    for b in range(first, last):
        m = mass_fields(models[b if models.shape[0] > 1 else 0])
        effort = efforts[b if efforts.shape[0] > 1 else 0]
        x, v, xl, vl = states[b, 0], states[b, 1], states[b, 2], states[b, 3]
        mode = int(states[b, 4])
        due = every
        row = 0
        for k in range(n):
            U = effort[k] - m.offset
            nx, nv, nxl, nvl, ok = _sample(m, mode, U, x, v, xl, vl)
            if not ok:
                nx, nv, nxl, nvl, mode, _, _ = _events(
                    m, no_time, no_mode, 0, (mode, U, 0.0), (x, v, xl, vl)
                )
            x, v, xl, vl = nx, nv, nxl, nvl
            due -= 1
            if due == 0:
                out[b, row, 0], out[b, row, 1] = x, v
                row += 1
                due = every
        states[b, 0], states[b, 1], states[b, 2], states[b, 3] = x, v, xl, vl
        states[b, 4] = mode
    return -1, -1
