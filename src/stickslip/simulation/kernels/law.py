"""Trajectories of a plant whose friction law is not affine: steps, reversals, sticking.

The input is held over the sample, so the motion is smooth but for the zeros of the velocity. A step
never goes over one: it is taken again, shorter, so that it ends there. Without bristles the mass
then rests if the force on it is within the static friction, until the load frees it (in closed
form) or the effort changes. With bristles it never rests quite; only the direction changes.
"""

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.kernels.law_step import (
    ORDER,
    STAGES,
    STATES,
    TUNING,
    acceleration,
    law_fields,
    rosenbrock_step,
)
from stickslip.simulation.kernels.single_mass import record_event

Vector = NDArray[np.float64]
Memory = tuple[NDArray[np.float64], Vector, Vector]  # stages of a step, and two states
Events = tuple[Vector, NDArray[np.int8], float]  # their times and modes; time of the sample's start
Progress = tuple[float, int, int]  # length of the next step, mode, and count of events
State = tuple[float, ...]  # (x1, v1, z, v2, x2, length of the next step, mode)

TWO_PI = 2.0 * math.pi


@compiled()
def _new_memory() -> Memory:
    """Return memory for `_law_sample`."""
    return np.empty((STAGES + 1, STATES)), np.empty(STATES), np.empty(STATES)


@compiled()
def _freed_after(m: Any, U: float, d: float, v2: float) -> tuple[float, int]:
    """Return when a swinging load frees the resting mass, and its mode then; infinite if never.

    The spring's stretch d = x1 - x2 follows R cos(omega t + phi).
    """
    ks = m.ks
    if ks == 0.0:
        return math.inf, 0
    omega = math.sqrt(ks / m.m2)
    R = math.hypot(d, v2 / omega)
    phi = math.atan2(v2 / omega, d)
    low, high = (U - m.fs_p) / ks, (U + m.fs_n) / ks
    first, mode = math.inf, 0
    if low > -R:
        first, mode = (math.acos(max(min(low / R, 1.0), -1.0)) - phi) % TWO_PI, 1
    if high < R:
        other = (-math.acos(max(min(high / R, 1.0), -1.0)) - phi) % TWO_PI
        if other < first:
            first, mode = other, -1
    return first / omega, mode


@compiled()
def _rest(m: Any, y: Vector, time: float) -> None:
    """Let the load swing while the mass rests, in place."""
    ks = m.ks
    if ks == 0.0:
        return
    omega = math.sqrt(ks / m.m2)
    d, v2 = y[0] - y[4], y[3]
    c, s = math.cos(omega * time), math.sin(omega * time)
    y[4] = y[0] - (d * c - v2 / omega * s)
    y[3] = v2 * c + omega * d * s


@compiled()
def _speed_after(
    m: Any, s: float, U: float, y: Vector, h: float, work: Vector, new: Vector
) -> float:
    """Return s v after a step of length h; the state is left in ``new``."""
    rosenbrock_step(m, s, U, y, h, work, new)
    return s * new[1]


@compiled()
def _until_zero(
    m: Any, s: float, U: float, y: Vector, bracket: tuple[float, float], work: Vector, new: Vector
) -> float:
    """Return the length of the step that ends where v is zero, in a bracket.

    Newton's method on the length of the step, with the bracket kept; the state there is left in
    ``new``.
    """
    low, high = bracket
    h = high
    speed = _speed_after(m, s, U, y, h, work, new)
    for _ in range(TUNING.iterations):
        rate = s * acceleration(m, s, U, new[0], new[1], new[2], new[4])
        after = h - speed / rate
        if not low < after < high:
            after = 0.5 * (low + high)
        done = abs(after - h) <= 4e-16 * high
        h = after
        speed = _speed_after(m, s, U, y, h, work, new)
        if done or speed == 0.0:
            break
        if speed > 0.0:
            low = h
        else:
            high = h
    return h


@compiled()
def _dip(v0: float, a0: float, v1: float, a1: float, h: float) -> float:
    """Return where in (0, 1) the cubic through both ends of a step is lowest; 2 if at an end."""
    # Its slope is a + b t + c t^2
    rise = v1 - v0
    a = a0 * h
    b = 6.0 * rise - 4.0 * a0 * h - 2.0 * a1 * h
    c = 3.0 * (a0 + a1) * h - 6.0 * rise
    root = b * b - 4.0 * a * c
    if root < 0.0:
        return 2.0
    t = -2.0 * a / (b + math.sqrt(root))
    return t if 0.0 < t < 1.0 else 2.0


@compiled()
def _crossing(
    m: Any, s: float, U: float, y: Vector, h: float, memory: Memory
) -> float:  # fmt: skip
    """Return how long the step may be until v is zero in it; h if it is nowhere.

    ``memory`` holds the state after the step of length h, and after what is returned.
    """
    work, new, spare = memory
    v0, v1 = s * y[1], s * new[1]
    end = h
    if v1 > 0.0:
        a0 = s * acceleration(m, s, U, y[0], y[1], y[2], y[4])
        if v0 == 0.0 and a0 <= 0.0:
            return h  # it has just set off
        a1 = s * acceleration(m, s, U, new[0], new[1], new[2], new[4])
        t = _dip(v0, a0, v1, a1, h)
        if t > 1.0 or _speed_after(m, s, U, y, t * h, work, spare) > 0.0:
            return h
        end = t * h
    if v0 > 0.0:
        return _until_zero(m, s, U, y, (0.0, end), work, new)
    # From rest: find where it moves forward, if it does
    low = end
    for _ in range(TUNING.halvings):
        low *= 0.5
        if _speed_after(m, s, U, y, low, work, spare) > 0.0:
            return _until_zero(m, s, U, y, (low, 2.0 * low), work, new)
    return h


@compiled(inline=True)
def _jump(m: Any, y: Vector, new: Vector) -> float:
    """Return how far a step went over what the friction force looks like, over what it may.

    An error estimate depends only on the stages of a step.
    """
    slower = max(min(abs(y[1]), abs(new[1])), m.feature_v)
    jump = abs(new[1] - y[1]) / (2.0 * slower)
    if m.sigma_0 > 0.0:
        jump = max(jump, abs(new[2] - y[2]) / m.feature_z)
    return jump


@compiled()
def _direction(m: Any, U: float, y: Vector, mode: int) -> float:
    """Return in which direction a mass with bristles moves, or is about to."""
    if y[1] != 0.0:
        return 1.0 if y[1] > 0.0 else -1.0
    a = acceleration(m, 1.0, U, y[0], y[1], y[2], y[4])  # the same for both directions
    if a != 0.0:
        return 1.0 if a > 0.0 else -1.0
    return -1.0 if mode < 0 else 1.0


@compiled()
def _attempt(
    m: Any, s: float, U: float, y: Vector, rem: float, h: float, memory: Memory
) -> tuple[float, float]:
    """Try a step of length h or of all that remains; ``memory`` holds the state after it.

    Returns its length, 0 if it is not good enough, and the h to try next; that is NaN if there is
    no step, because the motion is too large.
    """
    work, new, _ = memory
    step = min(h, rem)
    error = rosenbrock_step(m, s, U, y, step, work, new)
    if math.isnan(error):
        return (
            0.0,
            TUNING.smallest_change * step if step > TUNING.left * m.sampling_time else math.nan,
        )
    if error > 1.0:
        return 0.0, step * max(TUNING.smallest_change, TUNING.caution * error ** (-1.0 / ORDER))
    jump = _jump(m, y, new)
    if jump > 1.0:
        return 0.0, step * max(TUNING.smallest_change, TUNING.caution / jump)
    grown = step * min(
        TUNING.largest_change, TUNING.caution * max(error, TUNING.least_error) ** (-1.0 / ORDER)
    )
    return step, (grown if step < rem else max(h, grown))


@compiled()
def _with_stiction(
    m: Any, U: float, y: Vector, last: Progress, events: Events, memory: Memory
) -> tuple[float, int, int, bool]:
    """Propagate over one sample with a law that rests, see `_law_sample`."""
    h, mode, count = last
    event_time, event_mode, t0 = events
    new = memory[1]
    t = 0.0
    for _ in range(int(m.budget)):
        rem = m.sampling_time - t
        if rem <= TUNING.left * m.sampling_time:
            return h, mode, count, True
        if mode == 0:
            w = U - m.ks * (y[0] - y[4])
            if -m.fs_n <= w <= m.fs_p:
                after, freed = _freed_after(m, U, y[0] - y[4], y[3])
                if not after < rem:
                    _rest(m, y, rem)
                    return h, mode, count, True
                _rest(m, y, after)
                t += after
                mode = freed
            else:
                mode = 1 if w > 0.0 else -1
            count = record_event(event_time, event_mode, count, t0 + t, mode)
            continue
        s = float(mode)
        step, h = _attempt(m, s, U, y, rem, h, memory)
        if math.isnan(h):
            return h, mode, count, True
        if step == 0.0:
            continue
        taken = _crossing(m, s, U, y, step, memory)
        y[:] = new
        t += taken
        if taken < step or s * y[1] <= 0.0:
            y[1] = 0.0
            w = U - m.ks * (y[0] - y[4])
            mode = 1 if w > m.fs_p else (-1 if w < -m.fs_n else 0)
            count = record_event(event_time, event_mode, count, t0 + t, mode)
    return h, mode, count, False


@compiled()
def _with_bristles(
    m: Any, U: float, y: Vector, last: Progress, events: Events, memory: Memory
) -> tuple[float, int, int, bool]:
    """Propagate over one sample with a law that has bristles, see `_law_sample`."""
    h, mode, count = last
    event_time, event_mode, t0 = events
    new = memory[1]
    significant = TUNING.significant * m.typical_v
    t = 0.0
    turned = False
    for _ in range(int(m.budget)):
        rem = m.sampling_time - t
        if rem <= TUNING.left * m.sampling_time:
            return h, mode, count, True
        s = _direction(m, U, y, mode)
        if turned:
            s = -s
        step, after = _attempt(m, s, U, y, rem, h, memory)
        if math.isnan(after):
            return after, mode, count, True
        if step == 0.0:
            h = after
            continue
        if max(abs(y[1]), abs(new[1])) > significant:
            if y[1] == 0.0 and s * new[1] < 0.0 and not turned:
                turned = True  # at rest it was not to be seen which way it would go
                continue
            taken = _crossing(m, s, U, y, step, memory)
        else:
            taken = step
        turned = False
        if abs(new[1]) > significant and mode != int(s):
            mode = int(s)
            count = record_event(event_time, event_mode, count, t0 + t, mode)
        y[:] = new
        if taken < step:
            y[1] = 0.0
        t += taken
        h = after
    return h, mode, count, False


@compiled()
def _law_sample(
    m: Any, U: float, y: Vector, last: Progress, events: Events, memory: Memory
) -> tuple[float, int, int, bool]:
    """Propagate y = (x1, v1, z, v2, x2) over one sample, in place.

    ``U`` is the effort less the offset. The mode is -1, 0 or +1: slipping or resting without
    bristles; with them, where it last went. Events are appended as far as there is room. Returns
    what comes next of ``last``, and whether the sample was finished within the budget. From what is
    not finite follows a state of NaN.
    """
    h, mode, count = last
    finite = abs(U) + abs(y[0]) + abs(y[1]) + abs(y[3]) + abs(y[4]) < math.inf
    finished = True
    if finite:
        if m.sigma_0 > 0.0:
            first, mode, count, finished = _with_bristles(m, U, y, last, events, memory)
        else:
            first, mode, count, finished = _with_stiction(m, U, y, last, events, memory)
        finite = not math.isnan(first)
        h = first if finite else h
    if not finite:
        y[:] = math.nan
    return h, mode, count, finished


@compiled()
def law_step(
    model: Vector, state: State, effort: float
) -> tuple[State, tuple[float, float, float, float]]:
    """Propagate one sample under a held effort; pure.

    The output is (x1, v1, x2, v2), of a rigid axis (x, v, NaN, NaN). The mode is NaN if the effort
    or the motion is not finite or the budget was exceeded; from such a state follows one of NaN.
    """
    m = law_fields(model)
    y = np.array(state[:STATES])
    h, mode_float = state[5], state[6]
    mode = 0 if math.isnan(mode_float) else int(mode_float)
    U = math.nan if math.isnan(mode_float) else effort - m.offset
    finished = False
    if abs(U) < math.inf:
        none = np.empty(0), np.empty(0, dtype=np.int8), 0.0
        h, mode, _, finished = _law_sample(m, U, y, (h, mode, 0), none, _new_memory())
    good = finished and abs(y[0]) + abs(y[1]) + abs(y[3]) + abs(y[4]) < math.inf
    last = (y[0], y[1], y[2], y[3], y[4], h, float(mode) if good else math.nan)
    if m.ks == 0.0:
        return last, (y[0], y[1], math.nan, math.nan)
    return last, (y[0], y[1], y[4], y[3])


@compiled()
def law_mass_step(model: Vector, state: State, effort: float) -> tuple[State, tuple[float, float]]:
    """`law_step` with the output of a rigid axis, (x, v)."""
    state, output = law_step(model, state, effort)
    return state, (output[0], output[1])


@compiled()
def law_run(
    model: Vector, state: State, effort: Vector, out: NDArray[np.float64],
    _grazing: NDArray[np.bool_], event_time: Vector, event_mode: NDArray[np.int8],
) -> tuple[int, int]:  # fmt: skip
    """Propagate one trajectory and store every sample, as `PlantKernels.run`.

    No sample grazes: friction begins as it ended, so that no outcome is sudden.
    """
    m = law_fields(model)
    memory = _new_memory()
    y = np.array(state[:STATES])
    h, mode = state[5], int(state[6])
    rows = out.shape[0]
    count = 0
    for k in range(effort.size + 1):
        out[0, k], out[1, k], out[rows - 1, k] = y[0], y[1], y[2]
        if rows == 5:
            out[2, k], out[3, k] = y[4], y[3]
        if k == effort.size:
            break
        events = event_time, event_mode, k * m.sampling_time
        h, mode, count, finished = _law_sample(
            m, effort[k] - m.offset, y, (h, mode, count), events, memory
        )
        if not finished:
            return count, k
    return count, -1


@compiled()
def law_batch(
    models: NDArray[np.float64], states: NDArray[np.float64], efforts: NDArray[np.float64],
    every: int, out: NDArray[np.float64], first: int, last: int,
) -> tuple[int, int]:  # fmt: skip
    """Propagate trajectories ``first`` to ``last`` (exclusive), as `PlantKernels.batch`."""
    memory = _new_memory()
    none = np.empty(0), np.empty(0, dtype=np.int8), 0.0
    for b in range(first, last):
        m = law_fields(models[b if models.shape[0] > 1 else 0])
        effort = efforts[b if efforts.shape[0] > 1 else 0]
        y = states[b, :STATES]
        h, mode = states[b, 5], int(states[b, 6])
        for k in range(effort.size):
            h, mode, _, finished = _law_sample(
                m, effort[k] - m.offset, y, (h, mode, 0), none, memory
            )
            if not finished:
                return b, k
            if every > 0 and (k + 1) % every == 0:
                row = (k + 1) // every - 1
                out[b, row, 0], out[b, row, 1] = y[0], y[1]
                if out.shape[2] == 4:
                    out[b, row, 2], out[b, row, 3] = y[4], y[3]
        states[b, 5], states[b, 6] = h, mode
    return -1, -1
