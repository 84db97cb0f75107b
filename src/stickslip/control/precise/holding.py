"""Holding of an axis that is pushed or under a load: the force on it is estimated in each sample.

The effort opposes the force and the speed. Where it changes its sign more than three times it
excites a vibration: the axis is braked, and not held, until it is at rest. An axis that has stopped
is held by friction, whatever the estimate: it changes its sign where the axis would turn round.

A load in a short move looks like a delay. The Kalman filter therefore has two means: one with the
delay of the last move, and one with no delay. The second is used if the delay is not known and it
explains the positions clearly better.
"""

import math
from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.equal_positions import VISIBLE
from stickslip.control.precise.learning import (
    HISTORY,
    HOLDING,
    PAST,
    delay_of,
    lag_of,
    unexplained,
    variance_of,
)
from stickslip.numerics.kalman import measure, predict

_TRANSITION = np.array([[1.0, 1.0, 0.5], [0.0, 1.0, 1.0], [0.0, 0.0, 1.0]])  # of x, v T, d T^2/m
_WALK = np.diag([0.0, 0.0, 1.0])  # of these, the one that walks
# Pushes to one side until the axis has been at rest at the target: a load, though the effort
# against it has oscillated
_MANY = 6
RELEASES = 2  # times an axis is let go until what moves it again is a load
_SLOWER = 0.5  # of the time constant: added by each of more turns, where a load is held
TURNS = 3  # of the effort against a push; more are an oscillation that the effort excites
_GAIN = 0.8  # of the speed is taken away in a sample of a push
_NOISY = 0.2  # of the effort limit: that of an error of the speed; a larger one lowers the gain
_STRONG = 0.5  # of the limit: standard deviation of a load
_CHANGES = 0.1  # of the limit: standard deviation of the change of a push in a sample
_STEADY = 0.3  # of friction: likewise at most, where noise looks like a force above friction
# Standard deviations of a position, and of the limit: an effort below both may be by noise, and its
# change of sign is no turn
_WILD, _CLEAR = 6.0, 0.2
_SHAKEN = 0.01  # times `_CHANGES` where a vibration moves the axis too, and of a load
_BETTER = 3.0  # difference of the sums of innovation^2/S at which the other delay is used
_GLITCH = 25.0  # innovation^2/S, at most: a glitch adds no more
_LIKELY = 3.0  # standard deviations of a push
_LONGEST, _ENDS = 0.3, 5.0  # of a push [s], and least time constants of its effort
_LOWERED = 0.25  # time constants at rest after which the effort is lowered by a fifth or more
# Time constant of the effort at rest, and at least so many samples; of friction: none is left
_LETS_GO, _LETS_GO_SAMPLES, _LITTLE = 0.01, 3.0, 0.1


@compiled()
def _stands(p: Any) -> bool:
    """Return whether an axis that is held shows no motion since it came to rest.

    Counts how often it moves again.
    """
    seen = VISIBLE * p.noise
    still = abs(p.past[0] - p.past[PAST - 1]) <= seen
    still = still and (p.quiet == 0 or abs(p.past[0] - p.stood) <= seen)
    let_go = p.loaded == 0 and p.quiet >= _LOWERED * letting_go(p)
    p.restarts += 1 if let_go and not still else 0
    if p.quiet == 0:
        p.stood = p.past[0]
    p.quiet = p.quiet + 1 if still else 0
    return still


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
def _turned(v: float, net: float, push: float, band: float, h: float) -> float:
    """Return the velocity v after a time h of the acceleration `net`.

    The push includes friction, which changes its sign where the axis turns round: it stops there
    unless the acceleration exceeds a band of twice the friction.
    """
    after = v + net * h
    turns = v * after < 0.0 or (v == 0.0 and net * push <= 0.0)
    return 0.0 if turns and abs(net) <= band else after


@compiled()
def _predict(p: Any, m: float, F: float, efforts: tuple[float, float]) -> None:
    """Take x, v T and d T^2/m, and their covariance, over a sample under either effort.

    The force d of the push walks at random: x' = x + v T + (d + u) T^2/(2 m), v' = v + (d + u) T/m
    under an effort u. Either delay has its effort; the covariance is the same for both.
    """
    unit = p.period * p.period / m
    for h in range(2):
        a = p.motion[h]
        net = a[2] + efforts[h] * unit
        after = _turned(a[1], net, a[2], 2.0 * F * unit, 1.0)
        a[0] += a[1] + 0.5 * net if after != 0.0 else 0.5 * a[1]
        a[1] = after
    predict(_TRANSITION, _WALK, p.spread, np.empty((3, 3)), 3, _change(p, m, F) ** 2)


@compiled()
def _correct(p: Any, x: float) -> None:
    """Correct them by a position: one step of a Kalman filter."""
    gain = np.empty(3)
    variance = measure(0, variance_of(p), p.spread, gain, 3)
    for h in range(2):
        off = x - p.motion[h, 0]
        p.hold_misfit[h] += min(off * off / variance, _GLITCH)
        for i in range(3):
            p.motion[h, i] += gain[i] * off


@compiled()
def _choose_delay(p: Any) -> None:
    """Choose the delay that explains the positions clearly better, unless it is known."""
    better = p.hold_misfit[0] - p.hold_misfit[1]  # how much no delay is
    if p.known == 0 and p.undelayed == 0 and better > _BETTER:
        # The wrong delay has caused the turns, and has spoiled what the move would teach
        p.undelayed, p.turns, p.seen = 1, 0, 0
    elif p.undelayed and better < -_BETTER:
        p.undelayed = 0


@compiled()
def letting_go(p: Any) -> float:
    """Return the time constant with which an effort is lowered at rest, in samples."""
    return max(_LETS_GO / p.period, _LETS_GO_SAMPLES)


@compiled()
def lowered(p: Any, effort: float) -> float:
    """Return the effort a sample later, where it is lowered at rest."""
    samples = letting_go(p)
    return effort * samples / (samples + 1.0)


@compiled()
def _most_held(p: Any) -> int:
    """Return the samples after which what needs an effort is no push."""
    return math.ceil(max(_LONGEST / p.period, _ENDS * letting_go(p)))


@compiled()
def _begin_holding(p: Any, x: float) -> None:
    p.moving, p.brake = HOLDING, 0.0
    p.motion[:, :], p.spread[:, :], p.hold_misfit[:] = 0.0, 0.0, 0.0
    p.motion[:, 0], p.spread[0, 0] = x, p.noise * p.noise
    p.brake_left = _most_held(p)
    p.turns = p.quiet = p.loaded = p.restarts = 0


@compiled()
def _start_holding(p: Any, x: float) -> None:
    _begin_holding(p, x)
    back = 1 if p.past[0] < p.past[1] else 0
    again = back == p.held_back  # a load acts to one side
    p.held = p.held + 1 if again else 1
    p.held_back = back
    p.sided = 1 if p.holds == 0 or (again and p.sided) else 0
    p.loaded = 1 if p.held > RELEASES or (p.sided and p.holds >= _MANY) else 0
    p.brakings += 1
    p.holds += 1


@compiled()
def start_holding(p: Any, m: float, F: float) -> None:
    """Act against a push from this sample on; the axis was at rest two samples ago."""
    _start_holding(p, p.past[2])
    p.spread[2, 2] = _change(p, m, F) ** 2
    _predict(p, m, F, (0.0, 0.0))
    _correct(p, p.past[1])


@compiled()
def start_holding_moving(p: Any, m: float) -> None:
    """Act likewise against what drives an axis that moves."""
    _start_holding(p, p.past[1])
    strong = _STRONG * p.limit * p.period * p.period / m
    p.motion[:, 1] = p.past[1] - p.past[2]
    p.spread[1, 1] = p.spread[2, 2] = strong * strong


@compiled()
def start_holding_load(p: Any, m: float, push: float) -> None:
    """Act likewise against a load; the move has shown by how much it exceeds friction."""
    start_holding_moving(p, m)
    unit = p.period * p.period / m
    p.motion[:, 2], p.spread[2, 2] = push * unit, (_STEADY * push * unit) ** 2


@compiled()
def start_holding_falling(p: Any, m: float) -> None:
    """Act likewise against a load, for good."""
    p.swung, p.held = 0, max(p.held, RELEASES)
    p.held_back = 1 if p.past[0] < p.past[1] else 0
    start_holding_moving(p, m)


@compiled()
def start_letting_go(p: Any, m: float, effort: float) -> None:
    """Lower an effort that has not moved the axis: it may hold a load."""
    _begin_holding(p, p.past[0])
    unit = p.period * p.period / m
    p.brake, p.held, p.held_back = effort, 1, int(effort > 0.0)
    p.motion[:, 2], p.spread[2, 2] = -effort * unit, (_STRONG * p.limit * unit) ** 2


@compiled()
def start_holding_creeping(p: Any, m: float, effort: float) -> None:
    """Hold an axis that creeps under an effort, which friction or a load takes."""
    start_letting_go(p, m, effort)
    p.motion[:, 0], p.motion[:, 1] = p.past[1], p.past[1] - p.past[2]
    p.spread[1, 1] = p.spread[2, 2]


@compiled()
def _held(p: Any, u: float) -> float:
    """Return the effort of a hold, within the limit.

    An axis that needs it for long, or restarts twice, is under a load.
    """
    p.brake = min(max(u, -p.limit), p.limit)
    p.brake_left -= 1
    if p.loaded == 0 and p.brake_left <= 0:
        p.held += max(p.restarts, 1)
        p.restarts = 0
        p.brake_left = _most_held(p)
        p.loaded = 1 if p.held > RELEASES else 0
    return p.brake


@compiled()
def move_delay(p: Any) -> float:
    """Return delay and lag in samples: those of the last move, if it has shown them.

    They are limited to the commands that are kept.
    """
    if p.known or p.shown == 0 or unexplained(p):
        return min(p.delay + p.lag, HISTORY - 2.0)
    return delay_of(p.best) + lag_of(p.best)


@compiled()
def _acted(p: Any, delay: float) -> float:
    """Return the mean effort that acted in the last sample."""
    whole = int(delay)
    part = delay - whole
    return (1.0 - part) * p.commands[whole] + part * p.commands[whole + 1]


@compiled()
def hold(p: Any, m: float, F: float, measured: bool) -> float:
    """Return the effort until the next sample against a push; it ends with `moving` 0.

    At rest the effort is lowered, so that a load moves the axis little. One that moves it whenever
    that is done is held for good. F is the friction without a load.
    """
    T, force = p.period, m / (p.period * p.period)
    delays = (move_delay(p), 0.0)
    _predict(p, m, F, (_acted(p, delays[0]), _acted(p, delays[1])))
    if measured:
        _correct(p, p.past[0])
        _choose_delay(p)
        for h in range(2):
            if p.motion[h, 1] * (p.past[0] - p.past[1]) < 0.0:
                p.motion[h, 1] = 0.0  # it has stopped within the sample
    if measured and _stands(p):
        p.motion[:, 0], p.motion[:, 1], p.motion[:, 2] = p.past[0], 0.0, -p.brake / force
        p.brake = p.brake if p.loaded else lowered(p, p.brake)
        if p.loaded == 0 and abs(p.brake) <= _LITTLE * F:
            p.moving = 0
            return 0.0
        return _held(p, p.brake)
    motion, delay = p.motion[p.undelayed], delays[p.undelayed]
    v, push = motion[1] / T, motion[2] * force
    whole = int(delay)
    for k in range(whole + 1):  # until the effort acts
        h = 1.0 if k < whole else delay - whole
        v = _turned(v, (push + p.commands[k]) * T / m, push, 2.0 * F * T / m, h)
    noise = math.sqrt(p.spread[1, 1]) * force / (_NOISY * p.limit)
    slower = max(noise, 1.0) + (_SLOWER * max(p.turns - TURNS, 0) if p.loaded else 0.0)
    u = -_GAIN / slower * m * v / T - push
    strong = max(0.0 if p.shaken else F, min(_WILD * p.noise * force, _CLEAR * p.limit))
    p.turns += 1 if u * p.brake < 0.0 and abs(u) > strong else 0
    if p.turns > TURNS and p.loaded == 0:
        p.held, p.moving = 0, 0
        p.brakings = 0 if p.swung == 0 else p.brakings
        p.swung = 1
        return 0.0
    return _held(p, u)
