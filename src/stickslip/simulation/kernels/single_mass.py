"""Exact propagation of a single mass under a held input, event by event.

Van de Wijdeven (2002) B, Eq. 1. While slipping in direction s, m v' = F - c v with the held force
F = U - s fc (U is the effort less the offset), so that v is monotone within a sample: the sign at
its end shows whether there was a zero, and the zero is known in closed form. At a zero the mass
rests if |U| <= fs, else it slips the way of U; it cannot come to a second zero within the sample.

All increments are relative to the state, and every expression keeps its relative accuracy as
c T/m goes to 0, where cancellation would spoil the textbook forms.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.plants.closed_forms import phi1, phi2, stopping_distance, stopping_time
from stickslip.simulation.kernels.double_double import accumulate
from stickslip.simulation.kernels.event_list import GRAZING, record_event

__all__ = ["mass_batch", "mass_model", "mass_run", "mass_step"]

TIME, MASS, FC_N, FC_P, FS_N, FS_P, C_N, C_P, OFFSET = 0, 1, 2, 3, 4, 5, 6, 7, 8
# Increments over a whole sample, for the negative and then the positive direction:
# dv = DECAY v + GAIN F, dx = TRAVEL v + SHIFT F
DECAY, GAIN, TRAVEL, SHIFT = 9, 10, 11, 12
POSITIVE = 4  # from the negative direction's places to the positive direction's
MODEL_SIZE = 17

GRAZING_TOLERANCE = 1e-10  # of the velocity at the start of a sample

Vector = NDArray[np.float64]
State = tuple[float, ...]  # (x, v, their low parts, mode)


@compiled()
def mass_model(
    m: float, fc_n: float, fc_p: float, fs_n: float, fs_p: float, c_n: float, c_p: float,
    offset: float, T: float,
) -> Vector:  # fmt: skip
    """Return the vector of numbers the kernels of this file work with."""
    model = np.zeros(MODEL_SIZE)
    model[TIME], model[MASS], model[OFFSET] = T, m, offset
    model[FC_N], model[FC_P], model[FS_N], model[FS_P] = fc_n, fc_p, fs_n, fs_p
    model[C_N], model[C_P] = c_n, c_p
    for side in range(2):
        z = -model[C_N + side] * T / m
        place = side * POSITIVE
        model[DECAY + place] = math.expm1(z)
        model[GAIN + place] = T / m * phi1(z)
        model[TRAVEL + place] = T * phi1(z)
        model[SHIFT + place] = T * T / m * phi2(z)
    return model


@compiled()
def _events(
    model: Vector, event_time: Vector, event_mode: NDArray[np.int8], count: int, t0: float,
    mode: int, U: float, x: float, v: float, xl: float, vl: float,
) -> tuple[float, float, float, float, int, int, int]:  # fmt: skip
    """Propagate over one sample in which the mass starts to move, stops or reverses.

    ``t0`` is the time at its start; events (time, mode after it) are appended at ``count`` as far
    as there is room. Returns the state, the mode, the new count and the flags. From an effort or a
    state that is not finite follows a state of NaN.
    """
    if not abs(U) + abs(v) < math.inf:
        return math.nan, math.nan, math.nan, math.nan, mode, count, 0
    T, m = model[TIME], model[MASS]
    rem = T
    flags = 0
    arrived = mode != 0
    if mode != 0:
        F = U - model[FC_P] if mode > 0 else U + model[FC_N]
        c = model[C_P] if mode > 0 else model[C_N]
        if mode * F >= 0.0:
            # No zero: viscous friction has brought the velocity below the rounding of the increment
            E = POSITIVE if mode > 0 else 0
            x, xl = accumulate(x, xl, model[TRAVEL + E] * v + model[SHIFT + E] * F)
            v, vl = v * math.exp(-c * T / m) + model[GAIN + E] * F, 0.0
            return x, v, xl, vl, (mode if v != 0.0 else 0), count, flags
        z = -c * v / F
        rem = max(T + m * v / F * stopping_time(z), 0.0)
        x, xl = accumulate(x, xl, -m * v * v / F * stopping_distance(z))
        v, vl = 0.0, 0.0
        if rem < GRAZING_TOLERANCE * T and (model[FS_P] > model[FC_P] or model[FS_N] > model[FC_N]):
            flags = GRAZING
        mode = 0
    if rem > 0.0:
        if model[FS_P] < U:
            mode = 1
        elif -model[FS_N] > U:
            mode = -1
    if arrived or mode != 0:
        count = record_event(event_time, event_mode, count, t0 + (T - rem), mode)
    if mode != 0:
        force = U - model[FC_P] if mode > 0 else U + model[FC_N]
        z = -(model[C_P] if mode > 0 else model[C_N]) * rem / m
        x, xl = accumulate(x, xl, rem * rem / m * phi2(z) * force)
        v, vl = rem / m * phi1(z) * force, 0.0
    return x, v, xl, vl, mode, count, flags


@compiled(inline=True)
def _slip(
    model: Vector, E: int, F: float, x: float, v: float, xl: float, vl: float
) -> tuple[float, float, float, float]:
    """Propagate over a whole sample in one direction."""
    nx, nxl = accumulate(x, xl, model[TRAVEL + E] * v + model[SHIFT + E] * F)
    nv, nvl = accumulate(v, vl, model[DECAY + E] * v + model[GAIN + E] * F)
    return nx, nv, nxl, nvl


@compiled(inline=True)
def _sample(
    model: Vector, mode: int, U: float, x: float, v: float, xl: float, vl: float
) -> tuple[float, float, float, float, bool]:
    """Propagate over a whole sample in one mode; the last is False if the mode may end in it."""
    if mode == 0:
        return x, v, xl, vl, -model[FS_N] <= U <= model[FS_P]
    F = U - model[FC_P] if mode > 0 else U + model[FC_N]
    x, v, xl, vl = _slip(model, POSITIVE if mode > 0 else 0, F, x, v, xl, vl)
    return x, v, xl, vl, mode * v > 0.0


@compiled()
def mass_step(model: Vector, state: State, effort: float) -> tuple[State, tuple[float, float]]:
    """Propagate one sample under a held effort; pure.

    Parameters
    ----------
    model
        Vector of `MODEL_SIZE` numbers.
    state
        (x, v, their low parts, mode), five floats.
    effort
        Held over the sample.

    Returns
    -------
    state, output
        The state at the end and (x, v). The mode is NaN if the effort or the motion is not finite;
        from such a state follows one of NaN.
    """
    x, v, xl, vl, mode_float = state
    has_failed = math.isnan(mode_float)
    mode = 0 if has_failed else int(mode_float)
    U = math.nan if has_failed else effort - model[OFFSET]
    nx, nv, nxl, nvl, ok = _sample(model, mode, U, x, v, xl, vl)
    if not ok:
        nx, nv, nxl, nvl, mode, _, _ = _events(
            model, np.empty(0), np.empty(0, dtype=np.int8), 0, 0.0, mode, U, x, v, xl, vl
        )
    return (nx, nv, nxl, nvl, float(mode) if abs(nv) < math.inf else math.nan), (nx, nv)


@compiled()
def mass_run(
    model: Vector, state: State, effort: Vector, position: Vector, velocity: Vector,
    grazing: NDArray[np.bool_], event_time: Vector, event_mode: NDArray[np.int8],
) -> tuple[State, int]:  # fmt: skip
    """Propagate one trajectory and store every sample.

    Parameters
    ----------
    model, state
        As in `mass_step`.
    effort
        Shape (n,).
    position, velocity
        Outputs, shape (n + 1,).
    grazing
        Output, shape (n,), zero on entry: samples with an event too close to call.
    event_time, event_mode
        Outputs: the events as far as there is room.

    Returns
    -------
    state, count
        The last state and the number of events.
    """
    x, v, xl, vl, mode_float = state
    mode = int(mode_float)
    n = np.uint64(effort.size)  # unsigned: no index counts from the end
    T, offset = model[TIME], model[OFFSET]
    sudden = model[FS_P] > model[FC_P] or model[FS_N] > model[FC_N]
    count = 0
    position[0], velocity[0] = x, v
    k = np.uint64(0)
    while k < n:
        if mode == 0:
            while k < n and -model[FS_N] <= effort[k] - offset <= model[FS_P]:
                k += np.uint64(1)
                position[k], velocity[k] = x, v
        else:
            s = float(mode)
            E = POSITIVE if mode > 0 else 0
            fc = model[FC_P] if mode > 0 else -model[FC_N]
            while k < n:
                nx, nv, nxl, nvl = _slip(model, E, (effort[k] - offset) - fc, x, v, xl, vl)
                if not s * nv > 0.0:
                    break
                if sudden and s * nv < GRAZING_TOLERANCE * (s * v):
                    grazing[k] = True
                x, v, xl, vl = nx, nv, nxl, nvl
                k += np.uint64(1)
                position[k], velocity[k] = x, v
        if k < n:
            x, v, xl, vl, mode, count, flags = _events(
                model, event_time, event_mode, count, k * T, mode, effort[k] - offset, x, v, xl, vl
            )
            if flags:
                grazing[k] = True
            k += np.uint64(1)
            position[k], velocity[k] = x, v
    return (x, v, xl, vl, float(mode)), count


@compiled()
def mass_batch(
    models: NDArray[np.float64], states: NDArray[np.float64], efforts: NDArray[np.float64],
    every: int, out: NDArray[np.float64], first: int, last: int,
) -> tuple[int, int]:  # fmt: skip
    """Propagate trajectories ``first`` to ``last`` (exclusive), storing some of their samples.

    Parameters
    ----------
    models
        Shape (1 or batch, MODEL_SIZE).
    states
        Shape (batch, 5); replaced by the last states.
    efforts
        Shape (1 or batch, n).
    every
        Store the state after every so many samples; 0 to store none.
    out
        Output, shape (batch, n // every, 2): position and velocity.
    first, last
        The trajectories to propagate.

    Returns
    -------
    (-1, -1), as `arm_batch` does when no event budget was exceeded; a single mass needs none.
    """
    n = efforts.shape[1]
    no_time = np.empty(0)
    no_mode = np.empty(0, dtype=np.int8)
    for b in range(first, last):
        model = models[b if models.shape[0] > 1 else 0]
        effort = efforts[b if efforts.shape[0] > 1 else 0]
        x, v, xl, vl = states[b, 0], states[b, 1], states[b, 2], states[b, 3]
        mode = int(states[b, 4])
        due = every
        row = 0
        offset = model[OFFSET]
        for k in range(n):
            U = effort[k] - offset
            nx, nv, nxl, nvl, ok = _sample(model, mode, U, x, v, xl, vl)
            if not ok:
                nx, nv, nxl, nvl, mode, _, _ = _events(
                    model, no_time, no_mode, 0, 0.0, mode, U, x, v, xl, vl
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
