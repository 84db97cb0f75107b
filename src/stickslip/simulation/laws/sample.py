"""One sample of a plant whose friction law is not affine: steps, reversals, sticking.

The input is held over the sample, so the motion is smooth but for the zeros of the velocity. A step
never goes over one: it is taken again, shorter, so that it ends there. Without bristles the mass
then rests if the force on it is within the static friction, until the load frees it (in closed
form) or the effort changes. With bristles it never rests quite; only the direction changes.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.kernels.event_list import record_event
from stickslip.simulation.laws.rates import (
    BUDGET,
    FEATURE_V,
    FEATURE_Z,
    FS_N,
    FS_P,
    KS,
    M2,
    SIGMA_0,
    TIME,
    TYPICAL_V,
    acceleration,
)
from stickslip.simulation.laws.rosenbrock import ORDER, STAGES, STATES, rosenbrock_step

__all__ = ["law_sample", "new_work"]

Vector = NDArray[np.float64]

SMALLEST, LARGEST, SAFETY = 0.2, 6.0, 0.9  # change of a step's length, and caution in it
SIGNIFICANT = 1e-9  # of the typical speed: a reversal of a slower motion is none
ITERATIONS = 60  # to find a zero, at most
HALVINGS = 40
LEAST_ERROR = 1e-10  # that a step's length is grown by
LEFT = 1e-13  # of the sample: what rounding leaves of it
TWO_PI = 2.0 * math.pi


@compiled()
def new_work() -> tuple[Vector, Vector, Vector]:
    """Return memory for `law_sample`: the stages of a step, and two states."""
    return np.empty((STAGES + 1, STATES)), np.empty(STATES), np.empty(STATES)


@compiled()
def _freed_after(model: Vector, U: float, d: float, v2: float) -> tuple[float, int]:
    """Return when a swinging load frees the resting mass, and which way; infinite if never.

    The spring's stretch d = x1 - x2 follows R cos(omega t + phi).
    """
    ks = model[KS]
    if ks == 0.0:
        return math.inf, 0
    omega = math.sqrt(ks / model[M2])
    R = math.hypot(d, v2 / omega)
    phi = math.atan2(v2 / omega, d)
    low, high = (U - model[FS_P]) / ks, (U + model[FS_N]) / ks
    first, way = math.inf, 0
    if low > -R:
        first, way = (math.acos(max(min(low / R, 1.0), -1.0)) - phi) % TWO_PI, 1
    if high < R:
        other = (-math.acos(max(min(high / R, 1.0), -1.0)) - phi) % TWO_PI
        if other < first:
            first, way = other, -1
    return first / omega, way


@compiled()
def _rest(model: Vector, y: Vector, time: float) -> None:
    """Let the load swing while the mass rests, in place."""
    ks = model[KS]
    if ks == 0.0:
        return
    omega = math.sqrt(ks / model[M2])
    d, v2 = y[0] - y[3], y[4]
    c, s = math.cos(omega * time), math.sin(omega * time)
    y[3] = y[0] - (d * c - v2 / omega * s)
    y[4] = v2 * c + omega * d * s


@compiled()
def _speed_after(
    model: Vector, s: float, U: float, y: Vector, h: float, work: Vector, new: Vector
) -> float:
    """Return s v after a step of length h, which is left in ``new``."""
    rosenbrock_step(model, s, U, y, h, work, new)
    return s * new[1]


@compiled()
def _until_zero(
    model: Vector, s: float, U: float, y: Vector, low: float, high: float, work: Vector, new: Vector
) -> float:
    """Return the length of the step that ends where v is zero: between ``low`` and ``high``.

    Newton's method on the length of the step, with the bracket kept; the state there is left in
    ``new``.
    """
    h = high
    speed = _speed_after(model, s, U, y, h, work, new)
    for _ in range(ITERATIONS):
        rate = s * acceleration(model, s, U, new[0], new[1], new[2], new[3])
        after = h - speed / rate
        if not low < after < high:
            after = 0.5 * (low + high)
        done = abs(after - h) <= 4e-16 * high
        h = after
        speed = _speed_after(model, s, U, y, h, work, new)
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
    model: Vector, s: float, U: float, y: Vector, h: float, work: Vector, new: Vector, spare: Vector
) -> float:
    """Return how long the step may be until v is zero in it; h if it is nowhere.

    ``new`` holds the state after the step of length h, and after what is returned.
    """
    v0, v1 = s * y[1], s * new[1]
    end = h
    if v1 > 0.0:
        a0 = s * acceleration(model, s, U, y[0], y[1], y[2], y[3])
        if v0 == 0.0 and a0 <= 0.0:
            return h  # it has just set off
        a1 = s * acceleration(model, s, U, new[0], new[1], new[2], new[3])
        t = _dip(v0, a0, v1, a1, h)
        if t > 1.0 or _speed_after(model, s, U, y, t * h, work, spare) > 0.0:
            return h
        end = t * h
    if v0 > 0.0:
        return _until_zero(model, s, U, y, 0.0, end, work, new)
    # From rest: find where it moves the right way, if it does
    low = end
    for _ in range(HALVINGS):
        low *= 0.5
        if _speed_after(model, s, U, y, low, work, spare) > 0.0:
            return _until_zero(model, s, U, y, low, 2.0 * low, work, new)
    return h


@compiled(inline=True)
def _jump(model: Vector, y: Vector, new: Vector) -> float:
    """Return how far a step went over what the friction force looks like, over what it may.

    An error estimate knows only what a step has seen.
    """
    slower = max(min(abs(y[1]), abs(new[1])), model[FEATURE_V])
    jump = abs(new[1] - y[1]) / (2.0 * slower)
    if model[SIGMA_0] > 0.0:
        jump = max(jump, abs(new[2] - y[2]) / model[FEATURE_Z])
    return jump


@compiled()
def _direction(model: Vector, U: float, y: Vector, mode: int) -> float:
    """Return in which direction a mass with bristles moves, or is about to."""
    if y[1] != 0.0:
        return 1.0 if y[1] > 0.0 else -1.0
    a = acceleration(model, 1.0, U, y[0], y[1], y[2], y[3])  # the same for both directions
    if a != 0.0:
        return 1.0 if a > 0.0 else -1.0
    return -1.0 if mode < 0 else 1.0


@compiled()
def _attempt(
    model: Vector, s: float, U: float, y: Vector, rem: float, h: float, work: Vector, new: Vector
) -> tuple[float, float]:
    """Try a step of length h or of all that remains; ``new`` holds the state after it.

    Returns its length, 0 if it is not good enough, and the h to try next; that is NaN if there is
    no step, because the motion is too large.
    """
    step = min(h, rem)
    error = rosenbrock_step(model, s, U, y, step, work, new)
    if math.isnan(error):
        return 0.0, SMALLEST * step if step > LEFT * model[TIME] else math.nan
    if error > 1.0:
        return 0.0, step * max(SMALLEST, SAFETY * error ** (-1.0 / ORDER))
    jump = _jump(model, y, new)
    if jump > 1.0:
        return 0.0, step * max(SMALLEST, SAFETY / jump)
    grown = step * min(LARGEST, SAFETY * max(error, LEAST_ERROR) ** (-1.0 / ORDER))
    return step, (grown if step < rem else max(h, grown))


@compiled(inline=True)
def _set(y: Vector, new: Vector) -> None:
    for n in range(STATES):
        y[n] = new[n]


@compiled()
def _with_stiction(
    model: Vector, U: float, y: Vector, h: float, mode: int, t0: float,
    event_time: Vector, event_mode: NDArray[np.int8], count: int,
    work: Vector, new: Vector, spare: Vector,
) -> tuple[float, int, int, bool]:  # fmt: skip
    """Propagate over one sample with a law that rests, see `law_sample`."""
    t = 0.0
    for _ in range(int(model[BUDGET])):
        rem = model[TIME] - t
        if rem <= LEFT * model[TIME]:
            return h, mode, count, True
        if mode == 0:
            w = U - model[KS] * (y[0] - y[3])
            if -model[FS_N] <= w <= model[FS_P]:
                after, way = _freed_after(model, U, y[0] - y[3], y[4])
                if not after < rem:
                    _rest(model, y, rem)
                    return h, mode, count, True
                _rest(model, y, after)
                t += after
                mode = way
            else:
                mode = 1 if w > 0.0 else -1
            count = record_event(event_time, event_mode, count, t0 + t, mode)
            continue
        s = float(mode)
        step, h = _attempt(model, s, U, y, rem, h, work, new)
        if math.isnan(h):
            return h, mode, count, True
        if step == 0.0:
            continue
        taken = _crossing(model, s, U, y, step, work, new, spare)
        _set(y, new)
        t += taken
        if taken < step or s * y[1] <= 0.0:
            y[1] = 0.0
            w = U - model[KS] * (y[0] - y[3])
            mode = 1 if w > model[FS_P] else (-1 if w < -model[FS_N] else 0)
            count = record_event(event_time, event_mode, count, t0 + t, mode)
    return h, mode, count, False


@compiled()
def _with_bristles(
    model: Vector, U: float, y: Vector, h: float, mode: int, t0: float,
    event_time: Vector, event_mode: NDArray[np.int8], count: int,
    work: Vector, new: Vector, spare: Vector,
) -> tuple[float, int, int, bool]:  # fmt: skip
    """Propagate over one sample with a law that has bristles, see `law_sample`."""
    significant = SIGNIFICANT * model[TYPICAL_V]
    t = 0.0
    turned = False
    for _ in range(int(model[BUDGET])):
        rem = model[TIME] - t
        if rem <= LEFT * model[TIME]:
            return h, mode, count, True
        s = _direction(model, U, y, mode)
        if turned:
            s = -s
        step, after = _attempt(model, s, U, y, rem, h, work, new)
        if math.isnan(after):
            return after, mode, count, True
        if step == 0.0:
            h = after
            continue
        if max(abs(y[1]), abs(new[1])) > significant:
            if y[1] == 0.0 and s * new[1] < 0.0 and not turned:
                turned = True  # at rest it was not to be seen which way it would go
                continue
            taken = _crossing(model, s, U, y, step, work, new, spare)
        else:
            taken = step
        turned = False
        if abs(new[1]) > significant and mode != int(s):
            mode = int(s)
            count = record_event(event_time, event_mode, count, t0 + t, mode)
        _set(y, new)
        if taken < step:
            y[1] = 0.0
        t += taken
        h = after
    return h, mode, count, False


@compiled()
def law_sample(
    model: Vector, U: float, y: Vector, h: float, mode: int, t0: float,
    event_time: Vector, event_mode: NDArray[np.int8], count: int,
    work: Vector, new: Vector, spare: Vector,
) -> tuple[float, int, int, bool]:  # fmt: skip
    """Propagate over one sample, in place.

    Parameters
    ----------
    model
        See `stickslip.simulation.laws.rates`.
    U
        Effort less the offset, held over the sample.
    y
        (x1, v1, z, x2, v2).
    h
        Length of the step to try first.
    mode
        -1, 0, +1: slipping or resting without bristles; with them, where it last went.
    t0
        Time at the start of the sample.
    event_time, event_mode, count
        Events are appended at ``count``, as far as there is room.
    work, new, spare
        From `new_work`.

    Returns
    -------
    The next h, mode and count, and whether the sample was finished within the budget. From what is
    not finite follows a state of NaN.
    """
    finite = abs(U) + abs(y[0]) + abs(y[1]) + abs(y[3]) + abs(y[4]) < math.inf
    finished = True
    if finite:
        if model[SIGMA_0] > 0.0:
            first, mode, count, finished = _with_bristles(
                model, U, y, h, mode, t0, event_time, event_mode, count, work, new, spare
            )
        else:
            first, mode, count, finished = _with_stiction(
                model, U, y, h, mode, t0, event_time, event_mode, count, work, new, spare
            )
        finite = not math.isnan(first)
        h = first if finite else h
    if not finite:
        for n in range(STATES):
            y[n] = math.nan
    return h, mode, count, finished
