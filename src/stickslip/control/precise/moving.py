"""The effort of a move from rest to rest: as fast as the limit allows, with feedback.

In each sample the state is taken forward over the delay, with the commands that are on their way.
From there on there are three parts:

1. Largest effort, as long as a stop at the target is possible after one more sample of it, with
   0.95 - r of the effort of the move. The reserve r for feedback is 0.1 at most.
2. The acceleration a after which the state is on the curve of that stop, v^2 = 2 b (e - e_0):
   (v + a T)^2 = 2 b (e - e_0 - v T - a T^2/2). The distance e_0 = (1 + 5 r) b T^2 lets the last
   part end with less effort than the braking, and so with less of the error of the model.
3. As soon as n samples within the limit lead almost to rest at the target, those with the least sum
   of squares of the force f = u - F, planned anew in each sample as long as noise is small beside
   what it changes. A sample of f and k more without it add, with z = c T/m,

       f T/m e^(-k z) phi_1(-z)  to the speed, f T^2/m [phi_2(-z) + k phi_1(-z) phi_1(-k z)]  to x.

The effort for an acceleration is m a + F + c v, with what has been learned so far. Viscous friction
is exact in the prediction of the state and in part 3; parts 1 and 2 take it as constant in a
sample, and the curve neglects it.
"""

import math
from typing import Any

from stickslip.compiled import compiled
from stickslip.control.precise.braking import STRONGEST_PUSH, becomes_faster, creeps, start_braking
from stickslip.control.precise.holding import (
    lowered,
    start_holding_creeping,
    start_holding_load,
    start_holding_moving,
    start_letting_go,
)
from stickslip.control.precise.learning import (
    BRAKING,
    FROZEN,
    LONGEST_DELAY,
    MOVE,
    PAST,
    PER_SAMPLE,
    SHAKES,
    TAUGHT,
    acting,
    begin,
    choose,
    delay_of,
    direction,
    is_brief,
    lag_of,
    lagging,
    learn,
    misfit_scale,
    model,
    unexplained,
    variance_of,
)
from stickslip.control.pulses.exact_state import COULOMB
from stickslip.plants.closed_forms import phi1, phi2, stopping_distance, stopping_time

_RESERVE = 0.1  # of the effort of the move: not planned, so that feedback can correct
# Standard deviation of log F and log m below which the reserve of the first move to a target, or
# after a disturbance, is proportional to it
_UNSURE = 0.1
_PLANNED = 0.95  # of the effort of the move: planned braking, and the reserve
_LAST = 8  # samples: the longest last part
_QUIET = 0.03  # of the limit: effect of noise on an effort up to which the last part is replanned
_ROUGH_FRICTION = 0.05  # of the friction: what no law has, for the estimation of the velocity
_ROUGH_EFFORT = 0.003  # of the limit, likewise: steps of the effort
_ROUGH_SWITCH = 0.03  # of a change of the effort, likewise: its delay
_OUTLYING = 9.0  # squared standard deviations of an innovation
_SEEN = 5.0  # standard deviations of a position: an axis that has moved
_SHAKE, _LARGE = 0.03, 0.1  # of the way: one that counts, and one that counts for all of them
# A vibration, after one change of the sign of unexplained innovations: so many of them in a move
# that the law does not explain. After two: so many, and this mean squared innovation over its
# variance
_ONCE = 5
_AGAIN, _LITTLE = 9, 0.8
# Fewest samples of the motion, and mean squared innovation over its variance, above which a move
# does not follow the law
_FEW, _LOST = 8, 36.0
_SOON = 0.75  # of the shortest time: nearer to the end the servo does not save time
_SLOW = 6  # samples from one change to the next: feedback can damp what is slower
WILD = 5  # such innovations after which an axis is left to friction
_UNSEEN = 0.5  # of the way after which friction is complete: an axis that coasts so far has stopped
_LONGER = 3.0  # times the shortest time that a move may last
# Shortest duration of a move [samples] per standard deviation of log F, as friction is learned in
# it; more of it if the delay is unknown or the move is brief, as a resonance takes longer with less
_FEWEST, _FEWEST_MORE = 6.0, 1.0
_SLACK = 40  # samples more
_FIRST = 3  # samples: the shortest last part, so that feedback can correct it
_HOLDS = 0.25  # of the limit: friction that may hold the axis
_GLIDES = 0.08  # of half the tolerance: the last way, in which friction alone stops the axis
_TAPER, _TAPER_MORE = 1.0, 5.0  # distance of the last part over b T^2, and more of it per reserve
_FREES = 0.98  # of the limit: an effort that moves any axis which is not blocked
_STUCK = 0.9  # of the strongest effort: friction that explains why the axis has not moved
_STOPPING = 6  # samples: an axis that does not stop on the plan is stopped for so long
_NOT_SLOWER = 0.7  # of the step before: the last one of an axis that a load drives
_REACTION = 3.0  # lags after which an axis moves that can
_CERTAIN = 2.0  # standard deviations of friction
_GENTLY = 0.7  # of the speed is taken away in a sample then
_SURELY = 4.0  # standard deviations of the way in a sample: an axis that surely moves


@compiled()
def shortest(m: float, F: float, limit: float, d: float) -> float:
    """Return the shortest time from rest to rest over d, without viscous friction."""
    up, down = (limit - F) / m, (limit + F) / m
    return math.sqrt(2.0 * d * (1.0 / up + 1.0 / down))


@compiled()
def _lasting(m: float, F: float, d: float, time: float) -> float:
    """Return the effort with which a move from rest to rest over d takes this time.

    It solves 2 m u/(u^2 - F^2) = t^2/(2 d), that of `shortest`.
    """
    spread = 0.5 * time * time / d
    return (m + math.sqrt(m * m + spread * spread * F * F)) / spread


@compiled()
def start_move(p: Any, x: float, target: float, values: Any, covariance: Any) -> None:
    """Start a move from rest at x: set its effort, its reserve and its longest duration."""
    p.moving, p.samples, p.left, p.ending, p.waited, p.quiet = MOVE, 0, 0, 0, 0, 0
    p.seen = p.wild = p.reversals = p.reversed_at = p.brakings = p.unseen = p.shown = 0
    p.strongest = 0.0
    p.off, p.shakes, p.glitch = 0.0, 0, 0
    p.moves += 1
    p.start, p.backward = x, (1 if target < x else 0)
    p.way = p.last_error = abs(target - x)
    p.x = p.v = p.position = 0.0
    p.p_xx, p.p_xv, p.p_vv = p.noise * p.noise, 0.0, 0.0
    begin(p, values, covariance)
    m, F, _ = model(p)
    i = COULOMB + p.backward
    spread = math.sqrt(covariance[i, i])  # of log F
    p.reserve = _RESERVE
    if p.moves == 1:
        p.reserve *= min(max(spread, math.sqrt(covariance[0, 0])) / _UNSURE, 1.0)
    p.move_effort = p.most
    if p.known == 0 or p.moves == 1:
        more = _FEWEST_MORE if p.known == 0 or is_brief(p) else 0.0
        fewest = max((_FEWEST + more) * spread, 1.0)
        p.move_effort = min(p.most, _lasting(m, F, p.way, fewest * p.period))
    p.shortest = shortest(m, min(F, 0.9 * p.move_effort), p.move_effort, p.way) / p.period
    p.longest = int(_LONGER * p.shortest) + _SLACK


@compiled()
def _free(
    x: float, v: float, mean: float, double: float, law: tuple[float, float, float], h: float
) -> tuple[float, float]:
    """Return position and speed after the time h under an effort; it may stop, and turn round.

    The effort has this mean, and this double integral over h^2. The law is mass, Coulomb and
    viscous friction.
    """
    m, F, c = law
    for part in range(2):
        if v == 0.0 and abs(mean) <= F:
            break
        sign = math.copysign(1.0, v if v != 0.0 else mean)
        net, z = mean - sign * F, -c * h / m
        after = v * math.exp(z) + net * h / m * phi1(z)
        if v == 0.0 or after * v > 0.0:
            shape = double - 0.5 * mean if part == 0 else 0.0
            return x + v * h * phi1(z) + (net * phi2(z) + shape) * h * h / m, after
        if net == 0.0:
            break
        w = abs(v / net)
        x += m * v * w * stopping_distance(c * w)
        h -= m * w * stopping_time(c * w)
        v = 0.0
    return x, 0.0


@compiled()
def _unmodelled(p: Any, a: float, v: float, older: float, newer: float) -> float:
    """Return the standard deviation of the acceleration in a sample.

    It is that of m a + F + c v by what has been learned, of a switch between two commands by the
    delay, and of what no law has.
    """
    h = p.best
    row = (a, 1.0, v)
    variance = 0.0
    for i in range(TAUGHT):
        for j in range(TAUGHT):
            variance += row[i] * p.covariance[h, i, j] * row[j]
    variance *= misfit_scale(p)
    m, F, _ = model(p)
    variance += (_ROUGH_FRICTION * F + _ROUGH_EFFORT * p.limit) ** 2
    variance += (_ROUGH_SWITCH * (newer - older)) ** 2
    return math.sqrt(variance) / m


@compiled()
def _track(p: Any, x: float, measured: bool, f: float) -> None:
    """Estimate the state in the sample by a Kalman filter: prediction, correction by the position.

    The effort that acted at the start of the sample is ``f``. An innovation of more than three
    standard deviations is that of the acceleration. A position that no possible force explains is a
    glitch, and not used; the next one is, and so are all after a position that was used although no
    law explains it, as on an axis that vibrates. One that equals the position before, though the
    axis surely moves, is that of a frozen sensor, and so are those that equal it.
    """
    T = p.period
    law = model(p)
    m, F, _ = law
    older, newer, share = acting(p, p.best)
    lag = lag_of(p.best) * T
    f, mean, double = lagging(f, older, lag, share * T)
    x_0, v_0 = _free(p.x, p.v, mean, double, law, share * T)
    f, mean, double = lagging(f, newer, lag, (1.0 - share) * T)
    x_0, v_0 = _free(x_0, v_0, mean, double, law, (1.0 - share) * T)
    q = _unmodelled(p, (v_0 - p.v) / T, v_0, older, newer) ** 2
    p_xx = p.p_xx + T * (2.0 * p.p_xv + T * p.p_vv)
    p_xv = p.p_xv + T * p.p_vv
    p_vv = p.p_vv
    way = x_0 - p.x
    p.x, p.v = x_0, v_0
    p.p_xx, p.p_xv, p.p_vv = p_xx + 0.25 * q * T**4, p_xv + 0.5 * q * T**3, p_vv + q * T**2
    off, R = x - x_0, variance_of(p)
    if measured:
        most = 0.5 * STRONGEST_PUSH * p.limit / m * T * T + _SEEN * math.sqrt(p.p_xx + R)
        moves = p.glitch == FROZEN or way > _SURELY * math.sqrt(p.p_xx + R) + p.bend
        if p.sensor.equal > 0 and p.seen == 1 and moves:
            p.glitch = FROZEN
        else:
            p.glitch = 1 if p.glitch == p.wild == 0 and abs(off) > most else 0
    if measured and p.glitch < 1:
        beyond = off * off / _OUTLYING - p.p_xx - R
        if beyond > 0.0:
            p.glitch = -1
            if off * p.off < 0.0:
                p.reversals += 1 if p.samples - p.reversed_at >= _SLOW else 0
                p.reversed_at = p.samples
            if off * p.off < 0.0 and abs(off) > _SHAKE * p.way:
                p.shakes += SHAKES if abs(off) > _LARGE * p.way else 1
            p.off = off
            p.wild += 1
            p.p_xx += beyond
            p.p_xv += 2.0 * beyond / T
            p.p_vv += 4.0 * beyond / (T * T)
        k_x, k_v = p.p_xx / (p.p_xx + R), p.p_xv / (p.p_xx + R)
        p.x += k_x * off
        p.v += k_v * off
        slow = _SEEN * p.noise / T  # as it may be while no motion is seen
        if p.ending and abs(x - p.position) <= slow * T and m * slow * slow <= _UNSEEN * p.bend * F:
            p.v = 0.0
        p.p_vv -= k_v * p.p_xv
        p.p_xx *= 1.0 - k_x
        p.p_xv *= 1.0 - k_x


@compiled()
def _ahead(p: Any) -> tuple[float, float, float]:
    """Return the state at the time at which the next command acts.

    It is that of the least plausible friction before any motion is seen, as nothing corrects it
    yet, unless friction is much of the limit: it may hold the axis.

    Behind a lag tau, X = x + tau v and V = v + tau (f - F)/m obey V' = (u - F)/m as a mass without
    a lag does, and X is where the axis comes to rest once V = 0. Returns X, V and v.
    """
    m, F, c = model(p)
    unsure = 0.0
    if p.seen == 0 and p.known == 0 and _HOLDS * p.limit > F:
        unsure = min(_CERTAIN * math.sqrt(max(p.covariance[p.best, 1, 1], 0.0)), max(F, 0.0))
    law = (m, F - unsure, c)
    T, delay = p.period, delay_of(p.best)
    lag, f = lag_of(p.best) * T, p.effort[p.best]
    whole, sign = int(delay), direction(p)
    x, v = p.x, p.v
    for k in range(whole, -1, -1):
        step = (delay - whole) * T if k == whole else T
        if step > 0.0:
            f, mean, double = lagging(f, sign * p.commands[k], lag, step)
            x, v = _free(x, v, mean, double, law, step)
    if lag > 0.0 and (v > 0.0 or f > F):
        return x + lag * v, v + lag * (f - F) / m, v
    return x, v, v


@compiled()
def _drag(p: Any) -> float:
    """Return c T/m of the last part. Behind a lag not V but the speed has viscous friction."""
    m, _, c = model(p)
    return 0.0 if lag_of(p.best) > 0.0 else c * p.period / m


@compiled()
def _gains(z: float, k: int) -> tuple[float, float]:
    """Return what a force f does to speed and way k samples after its own, over f T/m, f T^2/m."""
    return phi1(-z) * math.exp(-k * z), phi2(-z) + phi1(-z) * k * phi1(-k * z)


@compiled()
def _plan_last(p: Any, e: float, v: float, n: int) -> None:
    """Plan the n least forces that lead almost to rest at the target; one leads to that speed only.

    Friction takes the axis the last bit: an effort that stops it early could drive it back.
    """
    m, F, _ = model(p)
    T, z = p.period, _drag(p)
    glide = _GLIDES * p.bend if F > 0.0 else 0.0
    speed = (math.sqrt(2.0 * max(F, 0.0) * glide / m) - v * math.exp(-n * z)) / T
    way = (e - glide - v * n * T * phi1(-n * z)) / (T * T)
    vv = vx = xx = 0.0
    for k in range(n):
        by_v, by_x = _gains(z, k)
        vv += by_v * by_v
        vx += by_v * by_x
        xx += by_x * by_x
    det = vv * xx - vx * vx
    p.left = n
    p.for_speed = m * (speed / vv if n == 1 else (speed * xx - way * vx) / det)
    p.for_way = 0.0 if n == 1 else m * (way * vv - speed * vx) / det


@compiled()
def _of_last(p: Any, k: int, speed: float) -> float:
    """Return the planned effort of the last part, k samples before its last one."""
    _, F, c = model(p)
    by_v, by_x = _gains(_drag(p), k)
    u = p.for_speed * by_v + p.for_way * by_x + F
    return u + c * max(speed, 0.0) if lag_of(p.best) > 0.0 else u


@compiled()
def _can_end(p: Any, e: float, v: float, speed: float) -> bool:
    """Plan the shortest last part within effort and reserve; return whether there is one."""
    F, most = model(p)[1], (1.0 - p.reserve) * p.move_effort
    for n in range(_FIRST, _LAST + 1):
        _plan_last(p, e, v, n)
        push, brake = _of_last(p, n - 1, speed), _of_last(p, 0, 0.0)
        if max(abs(push), abs(brake)) <= most and brake <= F:
            return True
    p.left = 0
    return False


@compiled()
def _next_of_last(p: Any, speed: float) -> float:
    """Return the effort of the first sample that is left of the last part, and go on by it."""
    p.left -= 1
    p.ending = 1 if p.left == 0 else 0
    u = _of_last(p, p.left, speed)
    return min(max(u, -p.move_effort), p.move_effort)


@compiled()
def _effort(p: Any, a: float, v: float, speed: float) -> float:
    """Return the effort of an acceleration over the next sample, within the limit.

    Behind a lag the speed itself, and not V, has the viscous friction.
    """
    m, F, c = model(p)
    mean = speed if lag_of(p.best) > 0.0 else v + 0.5 * a * p.period
    u = m * a + F + c * max(mean, 0.0)
    return min(max(u, -p.move_effort), p.move_effort)


@compiled()
def _unseen(p: Any) -> float:
    """End a move that the sensors have not shown; return the last effort, to be lowered."""
    p.moving, p.unseen = 0, 1 if p.strongest >= _FREES * p.limit else 0
    last = p.commands[0]
    if last != 0.0:
        start_letting_go(p, model(p)[0], last)
    return direction(p) * last


@compiled()
def _after_plan(p: Any, F: float) -> float:
    """Return the effort on an axis of which no motion has been seen, once the plan has ended.

    The whole limit is lowered slowly where friction explains that: what holds the axis may be a
    load.
    """
    held = p.strongest >= _FREES * p.limit and p.strongest * _STUCK <= F
    return direction(p) * lowered(p, p.commands[0]) if held else 0.0


@compiled()
def _give_up(p: Any, m: float, F: float) -> float:
    """End a move that does not follow the plan: brake the axis, or hold it if it creeps.

    With samples short enough for the servo the axis is braked, and the servo continues the move.
    """
    usable = p.fast == 0 and p.glitch < 1 and p.shakes < SHAKES and p.past_count >= PAST
    friction = min(max(F, 0.0), _HOLDS * p.limit)  # the estimate may contain a load
    if usable and creeps(p, m, friction):
        start_holding_creeping(p, m, p.commands[0])
    else:
        start_braking(p)
    return 0.0


@compiled()
def _decide(p: Any) -> float:
    """Return the next command, in the direction of the move; the move ends with `moving` 0."""
    x, v, speed = _ahead(p)
    T, e = p.period, p.way - x
    m, F, c = model(p)
    if p.samples > p.longest or p.shakes >= SHAKES or (p.open == 0 and p.wild > WILD):
        return _give_up(p, m, F)
    if p.left > 0:
        n = p.left
        noise = 6.0 * p.noise / (T * T * n * (n + 1.0)) * m
        if noise <= _QUIET * p.move_effort or n == 1:
            _plan_last(p, e, v, n)
            if abs(_of_last(p, n - 1, speed)) > p.move_effort and not _can_end(p, e, v, speed):
                _plan_last(p, e, v, n)
        return _next_of_last(p, speed)
    reacts = p.samples > delay_of(p.best) + _REACTION * lag_of(p.best) + 1.0
    if p.ending or (reacts and speed <= 0.0):
        return _stop(p, e, v, speed)
    push = (p.move_effort - F - c * v) / m
    x_1, v_1 = v * T + 0.5 * push * T * T, v + push * T
    b = max((_PLANNED - p.reserve) * p.move_effort + F, 0.1 * p.move_effort) / m
    gentle = (_TAPER + _TAPER_MORE * p.reserve) * b * T * T
    if push > 0.0 and v_1 * v_1 <= 2.0 * b * (e - gentle - x_1):
        return p.move_effort
    if _can_end(p, e, v, speed):
        return _next_of_last(p, speed)
    B, C = 2.0 * v / T + b, (v * v - 2.0 * b * (e - gentle - v * T)) / (T * T)
    root = B * B - 4.0 * C
    a = 0.5 * (math.sqrt(root) - B) if root > 0.0 else -2.0 * p.move_effort / m
    return _effort(p, a, v, speed)


@compiled()
def _stop(p: Any, e: float, v: float, speed: float) -> float:
    """Return the effort that stops the axis; end the move when friction does.

    An axis that still moves towards the target has another last part. One that does not stop is
    held, as a load drives it. One of which no motion has been seen is waited for, as long as the
    longest delay. Behind a lag the effort balances friction until the axis stops.
    """
    m, F, c = model(p)
    if p.seen == 0:
        return _unseen(p) if p.samples > LONGEST_DELAY else _after_plan(p, F)
    p.ending = 1
    p.waited += 1
    coasts = 0.5 * m * speed * speed / max(F, 1e-300)
    driven = coasts > p.bend and p.waited == _STOPPING + 1
    driven = driven and abs(p.past[0] - p.past[1]) >= _NOT_SLOWER * abs(p.past[1] - p.past[2])
    if F < 0.0 or (driven and p.shaken == 0 and not unexplained(p)):
        if F < 0.0 and (p.past[0] - p.past[1]) * direction(p) > 0.0:
            start_holding_load(p, m, -F * direction(p))
        else:
            start_holding_moving(p, m)
        return 0.0
    if coasts > p.bend and p.waited <= _STOPPING:
        p.quiet = 0
        if e > 2.0 * p.bend and _can_end(p, e, v, speed):
            return _next_of_last(p, speed)
        # Beyond the target, what friction certainly does
        unsure = _CERTAIN * math.sqrt(max(p.covariance[p.best, 1, 1], 0.0)) if e < 0.0 else 0.0
        holding = max(F - unsure, 0.0)
        u = -_GENTLY * m * v / p.period + math.copysign(holding, speed) + c * speed
        alone = lag_of(p.best) == 0.0 or e < -2.0 * p.bend  # friction alone stops it as soon
        if u * speed > 0.0 and alone:
            return 0.0
        return min(max(u, -p.move_effort), p.move_effort)
    p.quiet += 1
    if p.quiet > delay_of(p.best) + 1.0:
        p.moving = 0
    return 0.0


@compiled()
def vibrates(p: Any) -> bool:
    """Return whether a move shows a slow vibration, or does not follow the law.

    Unexplained innovations of a vibration change their sign.
    """
    if p.moving == BRAKING or p.seen == 0:
        return False
    once = p.reversals > 0 and p.wild >= _ONCE and unexplained(p)
    again = p.reversals > 1 and p.wild >= _AGAIN and p.samples <= _SOON * p.shortest
    lost = p.rows >= _FEW and p.misfit[p.best] > _LOST * p.rows
    return once or lost or (again and p.misfit[p.best] > _LITTLE * p.rows)


@compiled()
def _falls_back(p: Any) -> bool:
    """Return whether a load moves an axis against its move, from rest and ever faster."""
    back = direction(p) * (p.past[0] - p.past[1]) < 0.0
    rested = p.seen == 0 and p.shaken == 0 and p.way > 0.0
    return rested and back and becomes_faster(p) and p.glitch < 1 and p.past_count >= PAST


@compiled()
def go_on(p: Any, position: float, measured: bool) -> float:
    """Take a sample of a move in; return the effort until the next one."""
    sign = direction(p)
    if p.samples > 0:
        x = sign * (position - p.start)
        _track(p, x, measured, p.effort[p.best])
        if p.seen and p.v <= 0.0:
            p.open = 0  # it has stopped within the sample
        if measured and p.glitch < 1:
            p.seen = p.shown = 1 if p.seen or x > _SEEN * p.noise else 0
            learn(p, x, True)
            tau = (p.samples - delay_of(p.best)) * p.period
            changed = p.open == 1 and choose(p)
            if changed:  # what was wild was so by the model before
                p.shakes, p.off = 0, 0.0
            if changed and tau > 0.0:
                m, F, c = model(p)
                impulse = F * tau + c * x + p.values[p.best, TAUGHT]
                p.x, p.v = x, max((p.once[p.best] - impulse) / m, 0.0)
                late = p.v * p.period / (PER_SAMPLE * tau)
                p.p_xx, p.p_xv, p.p_vv = p.noise * p.noise, 0.0, p.p_vv + late * late
        else:
            learn(p, p.x, False)
    if measured and _falls_back(p):
        start_holding_moving(p, model(p)[0])
        return 0.0
    # What has not been seen to move is not braked
    u = _unseen(p) if p.seen == 0 and p.samples > p.longest else _decide(p)
    p.strongest = max(p.strongest, abs(u))
    p.samples += 1
    return sign * u
