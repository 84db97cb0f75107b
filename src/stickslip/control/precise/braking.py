"""Braking of an axis whose motion no plan explains, and holding of one that is pushed.

The speed is that of the last three samples together, which a vibration behind the axis disturbs
little. Braking holds the effort that takes this speed away for three samples or more, and then
estimates the speed again: feedback in each sample would excite the vibration. A push is short, and
changes faster: its force is estimated in each sample, and the effort opposes it and the speed.
"""

import math
from typing import Any

from stickslip.compiled import compiled
from stickslip.control.precise.learning import BRAKING, HOLDING, PAST, delay_of, lag_of

_SAMPLES = 3  # the shortest braking
_SHARE = 0.6  # of the effort limit: braking is planned with so much
_MOST = 6  # brakings until the axis is left to friction
_PUSHES = 2  # pushes from one rest to the next: an axis that goes on to accelerate is under a load
_HOLDS = 3  # pushes until the axis has been at rest at the target: one that swings is let swing out
_TURNS = 3  # of the effort against a push; more are an oscillation that the effort excites
_SURE = 0.1  # of a step is what the one before it has at least, where it is no glitch
_VISIBLE = 10.0  # standard deviations of a position: two steps that are no noise
_GAIN = 0.3  # of the speed is taken away in a sample of a push
_FOLLOWED = 0.5  # of a change of the push is believed in a sample
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
def pushed(p: Any, m: float, F: float) -> bool:
    """Return whether an axis that should rest runs away without becoming slower."""
    new, old = p.past[0] - p.past[1], p.past[1] - p.past[2]
    faster = p.past_count >= PAST and abs(new) >= abs(old) and old * new > _SURE * new * new
    faster = faster and abs(new + old) > _VISIBLE * p.noise
    may = p.brakings < _PUSHES and p.holds < _HOLDS
    return faster and may and _runs(p, m, F, new / p.period)


@compiled()
def start_braking(p: Any) -> None:
    """Brake from this sample on."""
    p.moving, p.brake_left, p.brake_wait = BRAKING, 0, 0


@compiled()
def start_holding(p: Any, m: float, rested: bool) -> None:
    """Act against a push from this sample on.

    The last two steps show its force, if the axis was at rest before: another one may swing.
    """
    change = p.past[0] - 2.0 * p.past[1] + p.past[2] if rested else 0.0
    p.moving, p.push, p.brake = HOLDING, m * change / (p.period * p.period), 0.0
    p.speed = _speed(p, m) - change / p.period if rested else 0.0
    p.brake_left, p.quiet = math.ceil(_LONGEST / p.period), 0
    p.brakings += 1
    p.holds += 1
    p.turns = 0


@compiled()
def hold(p: Any, m: float, F: float) -> float:
    """Return the effort until the next sample against a push; it ends with `moving` 0.

    What the acceleration has beyond the effort is the force of the push and of friction.
    """
    v = _speed(p, m)
    p.push += _FOLLOWED * (m * (v - p.speed) / p.period - p.brake - p.push)
    p.speed = v
    p.brake_left -= 1
    p.quiet = 0 if _runs(p, m, F, v) or abs(p.push) > F else p.quiet + 1
    u = -_GAIN * m * v / p.period - p.push
    p.turns += 1 if u * p.brake < 0.0 and abs(u) > F else 0
    if p.brake_left <= 0 or p.quiet >= PAST or p.turns > _TURNS:
        p.moving = 0
        return 0.0
    p.brake = min(max(u, -p.limit), p.limit)
    return p.brake


@compiled()
def brake(p: Any, m: float, F: float) -> float:
    """Return the effort until the next sample; the braking ends with `moving` 0."""
    if p.brake_left > 0:
        p.brake_left -= 1
        return p.brake
    if p.brake_wait > 0:
        p.brake_wait -= 1
        return 0.0
    v = _speed(p, m)
    if p.brakings >= _MOST or not _runs(p, m, F, v):
        p.moving = 0
        return 0.0
    n = max(math.ceil(m * abs(v) / (_SHARE * p.limit * p.period)), _SAMPLES)
    u = max(m * abs(v) / (n * p.period) - F, 0.0)
    p.brakings += 1
    p.brake = math.copysign(min(u, p.limit), -v)
    p.brake_left = n - 1
    p.brake_wait = math.ceil(delay_of(p.best) + lag_of(p.best)) + PAST - 1
    return p.brake
