"""Braking of an axis whose motion no plan explains.

The speed of braking is the mean over the last three samples, which a vibration behind the axis
disturbs little, and what the commands since then have changed. For an axis that vibrates the mean
is over 30 ms, or 16 samples if that is shorter. Right after a move that a vibration disturbs, the
impulse of the effort and the mass give a second value; the two are averaged with weights by their
variances. Braking holds the effort that takes this speed away for three samples or more, and then
estimates the speed again: feedback in each sample would excite the vibration.

A push is short, and changes faster: it is held (`stickslip.control.precise.holding`).
"""

import math
from typing import Any

from stickslip.compiled import compiled
from stickslip.control.equal_positions import MOST_EQUAL, VISIBLE, compare, may_be_frozen
from stickslip.control.precise.holding import (
    TURNS,
    hold,
    move_delay,
    start_holding_falling,
    start_holding_moving,
)
from stickslip.control.precise.learning import (
    BRAKING,
    FROZEN,
    HISTORY,
    HOLDING,
    KEPT,
    PAST,
    ROWS,
    TAUGHT,
    delay_of,
    direction,
    lag_of,
    misfit_scale,
    model,
    variance_of,
)

_SAMPLES = 3  # the shortest braking
_SWING = 0.03  # time of the mean speed of an axis that vibrates [s]: two periods of 65 Hz
_EXPLAINS = 100.0  # mean squared innovation over its variance, below which an impulse says much
# Least time to one side of a fall [s]: half a period of 8 Hz; at least so many times the samples of
# a mean speed and of the delay
_FALL_TIME, _FALL_SAMPLES = 0.06, 2
_FAR = 0.2  # of the way of a move: an axis that goes so far after a braking is braked at once
_SHARE = 0.6  # of the effort limit: braking is planned with so much
_MOST = 6  # brakings until the axis is left to friction
PUSHES = 2  # brakings from one rest to the next: an axis that still accelerates is held
_HOLDS = 3  # pushes until the axis has been at rest at the target: one that swings is let swing out
_SURE = 0.1  # of a step is what the one before it has at least, where the axis moved before
STRONGEST_PUSH = 1.2  # of the effort limit: a push
_FAILED = 0.7  # of the speed is left by a braking that something opposes
_COASTING = 20.0  # `bend`: an axis that friction stops within it is not braked
_NOISE = 50.0  # standard deviations of a position, likewise
_UNSURE = 3.0  # standard deviations of a speed
_FARTHER = 3.0  # times that way: bristles spring back less far
_EVEN = 0.7  # of the way of three samples is that of each at most; from rest it is 5/9


@compiled()
def may_be_elsewhere(p: Any) -> bool:
    """Return whether the axis may be elsewhere than the sensor shows it."""
    frozen = p.glitch == FROZEN and p.sensor.equal < MOST_EQUAL
    return frozen or may_be_frozen(p.sensor)


@compiled()
def remember(p: Any, x: float) -> None:
    """Keep a position, and where the axis began to move without effort in its direction.

    Counts equal positions, and the samples since it has turned round by a visible way, too.
    """
    compare(p.sensor, x, p.noise, p.moving == 0, False)
    if p.sensor.equal == 0:
        p.glitch = min(p.glitch, 1)
    for k in range(KEPT - 1, 0, -1):
        p.past[k] = p.past[k - 1]
    p.past[0] = x
    forward = 1 if p.ahead == 1 else -1
    p.one_way += 1
    if p.past_count == 0 or forward * (x - p.farthest) > 0.0:
        p.farthest = x
    elif forward * (x - p.farthest) < -VISIBLE * p.noise:
        p.farthest, p.ahead, p.one_way = x, 1 - p.ahead, 0
    p.past_count = min(p.past_count + 1, KEPT)
    acted = p.past_count < PAST
    for k in range(min(math.ceil(delay_of(p.best) + lag_of(p.best)) + PAST, HISTORY)):
        acted = acted or p.commands[k] != 0.0
    turned = (x - p.past[PAST - 1]) * (x - p.free_x) < 0.0
    if acted or turned:
        p.free_x = x
        p.free_v = 0.0 if turned else abs(x - p.past[PAST - 1]) / ((PAST - 1) * p.period)


@compiled()
def _steps(p: Any) -> int:
    """Return the number of samples of the mean speed."""
    if p.swung or p.shaken or p.shakes:
        return min(max(math.ceil(_SWING / p.period), PAST - 1), KEPT - 1)
    return PAST - 1


@compiled()
def _speed(p: Any, m: float, n: int) -> float:
    """Return the mean velocity over the last n samples; no step counts as more than is possible."""
    if p.past_count < PAST:
        return 0.0
    fastest = math.sqrt(p.limit * max(p.way, p.limit * p.period * p.period / m) / m) * p.period
    total = 0.0
    for k in range(n):
        step = p.past[k] - p.past[k + 1]
        total += min(max(step, -fastest), fastest)
    return total / (n * p.period)


@compiled()
def _by_impulse(p: Any) -> tuple[float, float]:
    """Return the velocity of a move by its impulse and mass, and the variance of that velocity.

    It is v = (U' - F tau - c x - g)/m of the law of a move, with U' as the integral of the effort
    that has acted.
    """
    h = p.best
    m, F, c = model(p)
    tau = max((p.samples - 1 - delay_of(h)) * p.period, 0.0)
    v = (p.once[h] - max(F, 0.0) * tau - c * p.position - p.values[h, TAUGHT]) / m
    row, variance = (v, tau, p.position, 1.0), 0.0
    for i in range(ROWS):
        for j in range(ROWS):
            variance += row[i] * p.covariance[h, i, j] * row[j]
    return direction(p) * max(v, 0.0), variance * misfit_scale(p) / (m * m)


@compiled()
def _harmless(p: Any) -> float:
    """Return a way that an axis may go on without effort."""
    return max(_COASTING * p.bend, _NOISE * p.noise)


@compiled()
def _runs(p: Any, m: float, F: float, v: float) -> bool:
    """Return whether an axis goes farther than friction may take it without harm."""
    return 0.5 * m * v * v > F * _harmless(p)


@compiled()
def _swings(p: Any) -> bool:
    """Return whether efforts have made an axis swing that is not under a load."""
    swings = (p.holds >= _HOLDS and p.sided == 0) or (p.fast == 1 and p.turns > TURNS)
    return swings and p.held == 0


@compiled()
def _response(p: Any) -> int:
    """Return the samples after which the axis shows what a command does."""
    return math.ceil(delay_of(p.best) + lag_of(p.best)) + PAST - 1


@compiled()
def _goes_one_way(p: Any) -> bool:
    """Return whether the axis has moved to one side for at least half a swing."""
    return p.one_way >= max(_FALL_TIME / p.period, _FALL_SAMPLES * _response(p))


@compiled()
def is_falling(p: Any) -> bool:
    """Return whether a load drives an axis that has swung: one way, for at least half a swing."""
    return (p.swung == 1 or _swings(p)) and _goes_one_way(p)


@compiled()
def coasts(p: Any, target: float) -> bool:
    """Return whether an axis without effort goes on from its target, and friction hardly stops it.

    From the speed v_0 to v over a way d it has been slowed by a = (v_0^2 - v^2)/(2 d), and would go
    on by v^2/(2 a). An axis that swings does not coast, but falls (`is_falling`).
    """
    if _swings(p) and not is_falling(p):
        return False
    d, way = abs(p.past[0] - p.free_x), p.past[0] - p.past[PAST - 1]
    away = (p.past[0] - target) * way > 0.0
    error = _UNSURE * math.sqrt(2.0 * variance_of(p)) / ((PAST - 1) * p.period)
    least = max(abs(way) / ((PAST - 1) * p.period) - error, 0.0)
    slowed = (p.free_v + error) ** 2 - least * least
    most = _FARTHER * _harmless(p)
    far = d > most and abs(p.past[0] - target) > most
    for k in range(PAST - 1):  # a glitch is one step
        far = far and abs(p.past[k] - p.past[k + 1]) <= _EVEN * abs(way)
    return away and far and least > 0.0 and d * least * least > slowed * _harmless(p)


@compiled()
def becomes_faster(p: Any) -> bool:
    """Return whether the last two steps are no noise, to one side, and the second no shorter."""
    new, old = p.past[0] - p.past[1], p.past[1] - p.past[2]
    faster = abs(new) >= abs(old) and old * new > _SURE * new * new
    return faster and abs(new + old) > VISIBLE * p.noise


@compiled()
def pushed(p: Any, m: float, F: float, rested: bool) -> bool:
    """Return whether an axis that should rest runs away without becoming slower.

    One that was at rest shows it by one step, if a force such as the effort limit explains it: a
    larger one may be a glitch. An axis that has been braked `PUSHES` times since it was at rest is
    not pushed if it vibrates: effort would excite the vibration.
    """
    new, old = p.past[0] - p.past[1], p.past[1] - p.past[2]
    faster = becomes_faster(p)
    jumps = rested and abs(old) <= _SURE * abs(new) and abs(new) > VISIBLE * p.noise
    jumps = jumps and 2.0 * m * abs(new) <= STRONGEST_PUSH * p.limit * p.period * p.period
    steady = p.shaken == 0 and p.swung == 0 and (p.fast == 0 or p.turns <= TURNS)
    may = (p.held > 0 and p.swung == 0) or ((p.brakings < PUSHES or steady) and p.holds < _HOLDS)
    return (faster or jumps) and may and p.past_count >= PAST and _runs(p, m, F, new / p.period)


@compiled()
def creeps(p: Any, m: float, F: float) -> bool:
    """Return whether an axis moves so slowly that friction would soon stop it.

    Its speed is the mean over three samples. What the commands add is left out, as friction or a
    load may take it.
    """
    return not _runs(p, m, F, (p.past[0] - p.past[PAST - 1]) / ((PAST - 1) * p.period))


@compiled()
def start_braking(p: Any) -> None:
    """Brake from this sample on."""
    p.moving, p.brake_left, p.brake_wait, p.unslowed, p.waited = BRAKING, 0, 0, 0, 0


@compiled()
def _slows(p: Any, n: int) -> bool:
    """Return whether the axis has become slower over the last n samples."""
    half = n // 2
    new, old = p.past[0] - p.past[half], p.past[half] - p.past[2 * half]
    return abs(new) < abs(old)


@compiled()
def speed_now(p: Any, m: float, F: float, n: int) -> float:
    """Return the velocity in the sample: the mean over the last n samples, and what followed.

    With fewer samples since the start the mean is over all of them.
    Of an acceleration a in the last sample but j that mean lacks a T [1 - (j + 1/2)/n], and a T of
    a command that has not arrived.
    """
    n = min(n, max(p.past_count - 1, PAST - 1))
    v, T = _speed(p, m, n), p.period
    v -= math.copysign(min(0.5 * n * F * T / m, abs(v)), v)
    delay = int(delay_of(p.best) + lag_of(p.best) + 0.5)
    coming = 0.0
    for j in range(min(delay + n, HISTORY)):
        if j < delay:
            coming += p.commands[j] * T / m
        else:
            v += (1.0 - (j - delay + 0.5) / n) * p.commands[j] * T / m
    after_move = p.brakings == 0 and p.unslowed == 0 and p.waited == 0
    explained = p.misfit[p.best] <= _EXPLAINS * p.rows
    if p.shakes and explained and after_move:
        other, variance = _by_impulse(p)
        swings = 2.0 * (max(p.excess, p.off * p.off) + variance_of(p)) / (n * T) ** 2
        v += (other - v) * swings / (swings + variance)
    return v + coming


@compiled()
def _is_steady(p: Any) -> bool:
    """Return whether no hold and no earlier move has shown a vibration."""
    return p.shaken == 0 and p.holds == 0 and p.swung == 0


@compiled()
def _runs_along_brake(p: Any, m: float, F: float) -> bool:
    """Return whether an axis runs along the effort that should brake it, ever faster."""
    new, old = p.past[0] - p.past[1], p.past[1] - p.past[2]
    faster = p.brake * old > 0.0 and new * old >= old * old
    faster = faster and abs(new + old) > VISIBLE * p.noise and _is_steady(p)
    return faster and _runs(p, m, F, new / p.period)


@compiled()
def accelerates_against_effort(p: Any) -> bool:
    """Return whether an axis becomes ever faster against all efforts that act: a load moves it.

    It is compared over three times: together about 30 ms, 3 to 15 samples. A vibration has changed
    the sign of wild innovations more than once, and a glitch is one step.
    """
    q = min(max(math.ceil(_SWING / p.period), PAST - 1), KEPT - 1) // (PAST - 1)
    if p.past_count <= (PAST - 1) * q or p.shaken or p.swung or p.shakes > 1:
        return False
    new, old = p.past[0] - p.past[q], p.past[q] - p.past[2 * q]
    first = p.past[2 * q] - p.past[3 * q]
    faster = abs(new) >= abs(old) >= abs(first) and new * old > 0.0 and old * first >= 0.0
    faster = faster and abs(new) <= _EVEN * abs(new + old + first)
    acted = math.ceil(move_delay(p) + 2.0 * lag_of(p.best)) + (PAST - 1) * q  # three lags in all
    for k in range(min(acted, HISTORY)):
        faster = faster and p.commands[k] * new <= 0.0
    return faster and abs(new - old) > VISIBLE * p.noise


@compiled()
def _moves_against_move(p: Any, v: float) -> bool:
    """Return whether an axis moves against its last move, for at least half a swing."""
    return v * direction(p) < 0.0 and _goes_one_way(p)


@compiled()
def _next_braking(p: Any, m: float, slowing: float, v: float) -> float:
    """Return the effort of the next samples, by which an axis with the velocity v stops."""
    p.braked_speed = abs(v)
    n = max(math.ceil(m * abs(v) / (_SHARE * p.limit * p.period)), _SAMPLES)
    u = max(m * abs(v) / (n * p.period) - slowing, 0.0)
    p.brakings += 1
    p.unslowed = 0
    p.brake = math.copysign(min(u, p.limit), -v)
    p.brake_left = n - 1
    p.brake_wait = math.ceil(delay_of(p.best) + lag_of(p.best)) + _steps(p)
    return p.brake


@compiled()
def brake(p: Any, m: float, F: float, measured: bool) -> float:
    """Return the effort until the next sample; the braking ends with `moving` 0."""
    along = p.brake_left > 0 and _runs_along_brake(p, m, F)
    if measured and (accelerates_against_effort(p) or along):
        start_holding_moving(p, m)
        return hold(p, m, F, True)
    if p.brake_left > 0:
        p.brake_left -= 1
        return p.brake
    if not measured:
        p.waited += 1
        return 0.0
    seen = _steps(p)
    if p.brake_wait > 0:
        p.brake_wait -= 1
        seen -= p.brake_wait
        if seen < PAST - 1 or abs(p.past[0] - p.past[seen]) < _FAR * p.way:
            return 0.0
        p.brake_wait = 0
    slowing = 0.0 if p.unslowed else F
    v = speed_now(p, m, slowing, seen)
    if p.brakings >= _MOST or not (p.unslowed or _runs(p, m, F, v)):
        p.moving = 0
        return 0.0
    failed = p.brakings > 0 and p.brake * v < 0.0 and abs(v) >= _FAILED * p.braked_speed
    if is_falling(p) and not _slows(p, seen):
        start_holding_falling(p, m)
    elif failed and ((_is_steady(p) and p.shakes == 0) or _moves_against_move(p, v)):
        # A vibration would have turned it round
        p.held = max(p.held, 1)
        start_holding_moving(p, m)
    return hold(p, m, F, True) if p.moving == HOLDING else _next_braking(p, m, slowing, v)
