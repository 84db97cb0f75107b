"""Braking of an axis whose motion no plan explains, and holding of one that is pushed.

The speed of braking is that of the last three samples together, which a vibration behind the axis
disturbs little, and what the commands since then have changed. Braking holds the effort that takes
this speed away for three samples or more, and then estimates the speed again: feedback in each
sample would excite the vibration. A push is short, and changes faster: its force is estimated in
each sample, and the effort opposes it and the speed.
"""

import math
from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.precise.learning import (
    BRAKING,
    HISTORY,
    HOLDING,
    PAST,
    SHAKES,
    delay_of,
    lag_of,
    variance_of,
)
from stickslip.numerics.kalman import measure, predict

_TRANSITION = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])  # of x, v T, d T^2/m
_WALK = np.diag([0.0, 0.0, 1.0])  # of these, the one that walks

_SAMPLES = 3  # the shortest braking
_SHARE = 0.6  # of the effort limit: braking is planned with so much
_MOST = 6  # brakings until the axis is left to friction
PUSHES = 2  # brakings from one rest to the next: an axis that still accelerates is held
_HOLDS = 3  # pushes until the axis has been at rest at the target: one that swings is let swing out
RELEASES = 2  # times an axis is let go until what moves it again is a load
_SLOWER = 0.5  # of the time constant: added by each of more turns, where a load is held
_TURNS = 3  # of the effort against a push; more are an oscillation that the effort excites
_SURE = 0.1  # of a step is what the one before it has at least, where the axis moved before
_VISIBLE = 10.0  # standard deviations of a position: a step that is no noise
_STRONGEST = 1.2  # of the effort limit: a push
_GAIN = 0.8  # of the speed is taken away in a sample of a push
_NOISY = 0.2  # of the effort limit: that of an error of the speed; a larger one lowers the gain
_STRONG = 0.5  # of the limit: standard deviation of a load
_FAILED = 0.7  # of the speed is left by a braking that something opposes
_CHANGES = 0.1  # of the limit: standard deviation of the change of a push in a sample
_STEADY = 0.3  # of friction: likewise at most, where noise looks like a force above friction
# Standard deviations of a position, and of the limit: an effort below both may be by noise, and its
# change of sign is no turn
_WILD, _CLEAR = 6.0, 0.2
_SHAKEN = 0.01  # times `_CHANGES` where a vibration moves the axis too, and of a load
_LIKELY = 3.0  # standard deviations of a push
_LONGEST = 0.3  # of a push [s]
_COASTING = 20.0  # `bend`: an axis that friction stops within it is not braked
_NOISE = 50.0  # standard deviations of a position, likewise


@compiled()
def remember(p: Any, x: float) -> None:
    """Keep a position."""
    for k in range(PAST - 1, 0, -1):
        p.past[k] = p.past[k - 1]
    p.past[0] = x
    p.past_count = min(p.past_count + 1, PAST)


@compiled()
def _speed(p: Any, m: float) -> float:
    """Return the velocity over the last positions; a jump counts as the largest possible speed."""
    if p.past_count < PAST:
        return 0.0
    fastest = math.sqrt(p.limit * max(p.way, p.limit * p.period * p.period / m) / m) * p.period
    total = 0.0
    for k in range(PAST - 1):
        step = p.past[k] - p.past[k + 1]
        total += min(max(step, -fastest), fastest)
    return total / ((PAST - 1) * p.period)


@compiled()
def _runs(p: Any, m: float, F: float, v: float) -> bool:
    """Return whether an axis goes farther than friction may take it without harm."""
    return 0.5 * m * v * v > F * max(_COASTING * p.bend, _NOISE * p.noise)


@compiled()
def pushed(p: Any, m: float, F: float, rested: bool) -> bool:
    """Return whether an axis that should rest runs away without becoming slower.

    One that was at rest shows it by one step, if a force such as the effort limit explains it: a
    larger one may be a glitch. An axis that has been braked `PUSHES` times since it was at rest is
    not pushed if it vibrates: effort would excite the vibration.
    """
    new, old = p.past[0] - p.past[1], p.past[1] - p.past[2]
    faster = abs(new) >= abs(old) and old * new > _SURE * new * new
    faster = faster and abs(new + old) > _VISIBLE * p.noise
    jumps = rested and abs(old) <= _SURE * abs(new) and abs(new) > _VISIBLE * p.noise
    jumps = jumps and 2.0 * m * abs(new) <= _STRONGEST * p.limit * p.period * p.period
    steady = p.shaken == 0 and (p.fast == 0 or p.turns <= _TURNS)
    may = p.held > 0 or ((p.brakings < PUSHES or steady) and p.holds < _HOLDS)
    return (faster or jumps) and may and p.past_count >= PAST and _runs(p, m, F, new / p.period)


@compiled()
def start_braking(p: Any) -> None:
    """Brake from this sample on."""
    p.moving, p.brake_left, p.brake_wait = BRAKING, 0, 0


@compiled()
def _change(p: Any, m: float, F: float) -> float:
    """Return the standard deviation of the change of d T^2/m in a sample.

    It is smaller where noise looks like a force above friction, so that noise does not drive the
    axis.
    """
    force = p.limit * _CHANGES * (_SHAKEN if p.shaken or p.loaded else 1.0)
    unit = p.period * p.period / m
    if _LIKELY * p.noise > F * unit:
        force = min(force, _STEADY * F)
    return force * unit


@compiled()
def _predict(p: Any, m: float, F: float, u: float) -> None:
    """Take x, v T and d T^2/m, and their covariance, over a sample under an effort u.

    The force d of the push walks at random: x' = x + v T + (d + u) T^2/(2 m), v' = v + (d + u) T/m.
    """
    a, w = p.motion, u * p.period * p.period / m
    a[0] += a[1] + 0.5 * (a[2] + w)
    a[1] += a[2] + w
    predict(_TRANSITION, _WALK, p.spread, np.empty((3, 3)), 3, _change(p, m, F) ** 2)


@compiled()
def _correct(p: Any, x: float) -> None:
    """Correct them by a position: one step of a Kalman filter."""
    gain, off = np.empty(3), x - p.motion[0]
    measure(0, variance_of(p), p.spread, gain, 3)
    for i in range(3):
        p.motion[i] += gain[i] * off


@compiled()
def _start_holding(p: Any, x: float) -> None:
    p.moving, p.brake = HOLDING, 0.0
    back = 1 if p.past[0] < p.past[1] else 0
    p.held = p.held + 1 if back == p.held_back else 1  # a load acts to one side
    p.held_back = back
    p.loaded = 1 if p.held > RELEASES else 0
    p.motion[:], p.spread[:, :] = 0.0, 0.0
    p.motion[0], p.spread[0, 0] = x, p.noise * p.noise
    p.brake_left, p.quiet, p.turns = math.ceil(_LONGEST / p.period), 0, 0
    p.brakings += 1
    p.holds += 1


@compiled()
def start_holding(p: Any, m: float, F: float) -> None:
    """Act against a push from this sample on; the axis was at rest two samples ago."""
    _start_holding(p, p.past[2])
    p.spread[2, 2] = _change(p, m, F) ** 2
    _predict(p, m, F, 0.0)
    _correct(p, p.past[1])


@compiled()
def start_holding_moving(p: Any, m: float) -> None:
    """Act likewise against what drives an axis that moves."""
    _start_holding(p, p.past[1])
    strong = _STRONG * p.limit * p.period * p.period / m
    p.motion[1] = p.past[1] - p.past[2]
    p.spread[1, 1] = p.spread[2, 2] = strong * strong


@compiled()
def hold(p: Any, m: float, F: float, measured: bool) -> float:
    """Return the effort until the next sample against a push; it ends with `moving` 0.

    One that moves the axis whenever it is let go is a load, and is held for good.
    """
    T, delay = p.period, delay_of(p.best) + lag_of(p.best)
    whole = int(delay)
    part = delay - whole
    _predict(p, m, F, (1.0 - part) * p.commands[whole] + part * p.commands[whole + 1])
    if measured:
        _correct(p, p.past[0])
    force = m / (T * T)
    v, push = p.motion[1] / T, p.motion[2] * force
    seen = max(F, _LIKELY * math.sqrt(p.spread[2, 2]) * force)
    p.brake_left -= 1
    p.quiet = 0 if _runs(p, m, F, v) or abs(push) > seen else p.quiet + 1
    for k in range(whole + 1):  # until the effort acts
        v += (push + p.commands[k]) * (1.0 if k < whole else part) * T / m
    noise = math.sqrt(p.spread[1, 1]) * force / (_NOISY * p.limit)
    slower = max(noise, 1.0) + (_SLOWER * max(p.turns - _TURNS, 0) if p.loaded else 0.0)
    u = -_GAIN / slower * m * v / T - push
    strong = max(F, min(_WILD * p.noise * force, _CLEAR * p.limit))
    p.turns += 1 if u * p.brake < 0.0 and abs(u) > strong else 0
    gone = p.quiet >= PAST and p.held == 1
    swings = p.turns > _TURNS and p.loaded == 0
    if swings:
        p.held = 0
    if swings or (p.loaded == 0 and (p.brake_left <= 0 or gone)):
        p.moving = 0
        return 0.0
    p.brake = min(max(u, -p.limit), p.limit)
    return p.brake


@compiled()
def speed_now(p: Any, m: float, F: float) -> float:
    """Return the velocity in the sample: that over the last three samples, and what followed.

    Of an acceleration a in the last sample but j that mean lacks a T (5 - 2 j)/6, and a T of a
    command that has not arrived.
    """
    v, T = _speed(p, m), p.period
    v -= math.copysign(min(1.5 * F * T / m, abs(v)), v)
    delay = int(delay_of(p.best) + lag_of(p.best) + 0.5)
    impulse = 0.0
    for j in range(min(delay + PAST - 1, HISTORY)):
        impulse += p.commands[j] * T * (1.0 if j < delay else (5.0 - 2.0 * (j - delay)) / 6.0)
    return v + impulse / m


@compiled()
def brake(p: Any, m: float, F: float, measured: bool) -> float:
    """Return the effort until the next sample; the braking ends with `moving` 0."""
    if p.brake_left > 0:
        p.brake_left -= 1
        return p.brake
    if not measured:
        return 0.0
    if p.brake_wait > 0:
        p.brake_wait -= 1
        return 0.0
    v = speed_now(p, m, F)
    if p.brakings >= _MOST or not _runs(p, m, F, v):
        p.moving = 0
        return 0.0
    steady = p.shaken == 0 and p.shakes < SHAKES and p.holds == 0
    if steady and p.brakings > 0 and p.brake * v < 0.0 and abs(v) >= _FAILED * p.braked_speed:
        p.held = max(p.held, 1)
        start_holding_moving(p, m)
        return hold(p, m, F, True)
    p.braked_speed = abs(v)
    n = max(math.ceil(m * abs(v) / (_SHARE * p.limit * p.period)), _SAMPLES)
    u = max(m * abs(v) / (n * p.period) - F, 0.0)
    p.brakings += 1
    p.brake = math.copysign(min(u, p.limit), -v)
    p.brake_left = n - 1
    p.brake_wait = math.ceil(delay_of(p.best) + lag_of(p.best)) + PAST - 1
    return p.brake
