"""Estimates during a move from rest: mass, friction of its direction, delay and lag.

A mass that moves one way from the time t_d on obeys

    m x + F tau^2/2 + c X + g tau = U,    tau = t - t_d,  X = integral of x,

where U is the double integral of the effort that acts: the command, later by t_d and through a
first-order lag. It is linear in m, F and c, no sample is differentiated but in a small term of X,
and the noise of a sample is that of its row over m. The impulse g is what friction takes less at
first: bristles bend before they slip. For each of some delays and lags a Kalman filter has these
parameters and the evidence of all samples so far,

    J = sum of [innovation^2/S + log S],

whose least is that of the best delay and lag. Innovations count for three standard deviations
at most, as no axis follows the law exactly. What their squares exceed their variances by, on
average, is added to the latter, as where a resonance swings. Two deviations from the law are
expected, and both are alike in many samples of a long move: one of a share of the way, and one of a
share of the friction in an early part of the move, as by the Stribeck effect.
"""

import math
from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.equal_positions import SENSOR
from stickslip.control.feedback.profile_kernels import STATE as SERVO_STATE
from stickslip.control.pulses.exact_state import COULOMB, PARAMETERS, VISCOUS
from stickslip.numerics.named_fields import fields_at, places

FINE, COARSE = 32, 16  # delays of models: in quarters of a sample, and longer ones in halves
DELAYS, LAGS = 1 + FINE + COARSE, 4
PER_SAMPLE = 4.0  # short delays a sample
LAG_STEP = 0.5  # samples
MODELS = DELAYS * LAGS
LONGEST_DELAY = (FINE + 2 * COARSE) / PER_SAMPLE
HISTORY = 34  # commands kept: of the longest delay and lag, 18, and of the longest mean speed, 16
ROWS = 4  # m, F, c, g
TAUGHT = 3  # of these, those that the pulses take over: m, F, c
PAST = 4  # positions of a mean speed over three samples
KEPT = 17  # positions kept: of the longest mean speed, that of an axis that vibrates
SHAKES = 3  # changes of the sign of wild innovations: the axis vibrates
FROZEN = 2  # of `glitch`: it equals the one before, though the axis surely moves

# A move; braking after one that no plan explains; a push; the servo, once the axis vibrates
MOVE, BRAKING, HOLDING, SERVO = 1, 2, 3, 4

OWN_DTYPE = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("length", "i8"),  # of the vector
        ("period", "f8"),  # T
        ("limit", "f8"),  # of the effort
        ("most", "f8"),  # effort of moves, at most
        ("move_effort", "f8"),  # largest effort of this move
        ("reserve", "f8"),  # share of it that the plan does not use
        ("noise", "f8"),  # standard deviation of a sampled position
        ("bend", "f8"),  # way after which friction is taken to be complete
        ("known", "i8"),  # 1 if the delay is known, or learned
        ("delay", "f8"),  # then this many samples
        ("lag", "f8"),  # samples
        ("most_moves", "i8"),  # to one target
        ("fast", "i8"),  # 1 if samples are short and quiet enough for the servo
        # What changes
        ("moving", "i8"),
        ("begun", "i8"),  # 1 after the first sample
        ("moves", "i8"),  # to this target
        ("last_error", "f8"),  # before the last one
        ("shaken", "i8"),  # 1 once a vibration has disturbed a move
        ("undecided", "i8"),  # 1 from a rest until it is decided what follows
        ("by_pulse", "i8"),  # 1 if a pulse has led to it
        ("waits", "i8"),  # 1 if what swings on the axis was waited for in it
        ("swing", "f8"),  # largest of a mass on the axis, by the pulses so far
        ("pauses", "i8"),  # after pulses that did not help, to this target
        ("samples", "i8"),  # since it began
        ("shortest", "f8"),  # samples that it takes at least
        ("longest", "i8"),  # samples after which it is ended
        ("start", "f8"),
        ("backward", "i8"),  # 1 if it goes in the negative direction
        ("way", "f8"),  # to the target, positive at the start
        ("seen", "i8"),  # 1 once it has moved
        ("wild", "i8"),  # innovations that the model does not explain
        ("off", "f8"),  # the last of them
        # 1 or FROZEN: the last position was not used; -1: it was, though no law explains it
        ("glitch", "i8"),
        ("shakes", "i8"),  # how often their sign has changed, counted by weight
        ("reversals", "i8"),  # how often it has changed in this move, `_SLOW` samples apart or more
        ("reversed_at", "i8"),  # sample of the move in which it has changed last
        ("left", "i8"),  # samples of the last part of the move; 0 before
        ("ending", "i8"),  # 1 after it: the axis is stopped, should it still move
        ("waited", "i8"),  # samples since then; in a braking, lost samples without effort
        ("quiet", "i8"),  # those without effort, in a row; in a hold, those at rest
        ("for_speed", "f8"),  # weights of its forces: of what they do to the speed and the way
        ("for_way", "f8"),
        ("x", "f8"),  # state in the sample, in the direction of the move, as estimated
        ("v", "f8"),
        ("p_xx", "f8"),  # its covariance
        ("p_xv", "f8"),
        ("p_vv", "f8"),
        ("position", "f8"),  # last one, as measured
        ("past", "f8", (KEPT,)),  # the last positions of all, as measured; the latest is the first
        ("past_count", "i8"),  # of them so far
        ("sensor", SENSOR),  # equal positions, and whether there is noise
        ("free_x", "f8"),  # position from which on no effort has acted and the axis has not turned
        ("free_v", "f8"),  # speed there
        ("farthest", "f8"),  # extreme position since the axis has last turned round
        ("ahead", "i8"),  # 1 if it has moved forward since then
        ("one_way", "i8"),  # samples since then
        ("shown", "i8"),  # 1 once motion of the last move has been seen
        ("stood", "f8"),  # position at the first sample of a rest in a hold
        ("unslowed", "i8"),  # 1 for a braking of an axis that friction has not slowed
        ("brakings", "i8"),  # since the axis was seen at rest
        ("strongest", "f8"),  # effort of the move
        ("unseen", "i8"),  # 1 after a move that the sensors have not shown
        ("leavings", "i8"),  # times in a row that the axis has soon left its target of itself
        ("stayed", "i8"),  # samples that it has been there
        ("side", "i8"),  # to which it left it: 1 or -1
        ("holds", "i8"),  # since it was at rest at the target
        ("turns", "i8"),  # of the effort against a push
        ("swung", "i8"),  # 1 once it turned too often, as by a vibration, until the axis is at rest
        # x, v T and d T^2/m of an axis that a force d pushes, with the delay of the last move and
        # with none
        ("motion", "f8", (2, 3)),
        ("spread", "f8", (3, 3)),  # their covariance
        ("hold_misfit", "f8", (2,)),  # of either: sum of innovation^2/S
        # 1 once no delay explains the positions clearly better, until the other does or the axis is
        # at rest
        ("undelayed", "i8"),
        ("held", "i8"),  # how often a push was held since the axis was at rest
        ("restarts", "i8"),  # times in this part of a hold that it has moved, the effort lowered
        ("held_back", "i8"),  # 1 if that push was to lower positions
        ("sided", "i8"),  # 1 if all pushes since it was at rest at the target were to one side
        ("loaded", "i8"),  # 1 while a push that does not end is held
        ("brake", "f8"),  # effort of the present one
        ("braked_speed", "f8"),  # speed at its begin
        ("brake_left", "i8"),  # samples of it, or most samples of a push
        ("brake_wait", "i8"),  # samples until it is seen what it has done
        ("servo", SERVO_STATE),
        ("saturated", "i8"),  # sign of the last effort of the servo at its limit
        ("swings", "i8"),  # changes of that sign since the axis was last at rest at the target
        ("patience", "f8"),  # time in which the servo has to bring the axis there [s]
        ("unsettled", "i8"),  # samples of the servo since it was last at rest at the target
        ("profiles", "i8"),  # that the servo has begun since its first
        ("servo_failed", "i8"),  # 1 once it has not brought the axis there or not held it there
        ("area", "f8"),  # X
        ("commands", "f8", (HISTORY,)),  # the last ones of all, as sent; the latest is the first
        ("open", "i8"),  # 1 as long as it moves one way, and its samples teach
        ("best", "i8"),  # the model in use
        ("mass", "f8"),  # by which a row's noise is that of a sample
        ("rows", "i8"),  # so far
        ("excess", "f8"),  # variance of positions beyond the expected one: an exponential mean
        ("late", "f8", (LAGS,)),  # samples by which friction counts later under a lag
        ("misfit", "f8", (MODELS,)),  # sum of innovation^2/S
        ("evidence", "f8", (MODELS,)),
        ("effort", "f8", (MODELS,)),  # that acts, behind the lag
        ("once", "f8", (MODELS,)),  # its integral
        ("twice", "f8", (MODELS,)),  # its double integral
        ("values", "f8", (MODELS, ROWS)),
        ("covariance", "f8", (MODELS, ROWS, ROWS)),
    ]
)
own_fields = fields_at(OWN_DTYPE)
SIZE = places(OWN_DTYPE)

_ROUGH = 5e-4  # of the way so far: no axis follows the law more closely
_ALIKE = 20.0  # samples of a move whose deviations from the law are taken for independent
_EARLY_FRICTION, _EARLY = 0.2, 0.05  # of friction, and of the samples of a move: unlike the law
_NO_EARLY = 2.5  # such samples are neglected: a short move has too few to teach otherwise
_CLEARLY = 3.0  # difference of evidence: models side by side hardly differ
_CERTAIN = 6.0  # such a difference excludes a model
_ONSET = 6.0  # samples of the motion in which the best model is taken at once
_DRIVEN = 3.0  # samples of the motion that show a load beyond friction: a spring yields for fewer
_DELAY_SPREAD = 0.1  # samples: standard deviation of a known delay
_SIMPLER = 1.0  # evidence against each sample of an unknown lag
_MEMORY = 0.1  # weight of a sample in that mean: half a period of a resonance of 50 Hz at 1 ms
_OUTLYING = 9.0  # squared standard deviations
EXPLAINED = 9.0  # mean squared innovation over its variance: a move that the law explains
_MOST = 2.0  # factor between a mass and its first guess, during a move
_STRONGEST = 0.95  # of the effort limit: friction, during a move
_LEAST = 0.02  # of a prior value: no parameter is less
_BRIEF = 3.0  # samples of a move which feedback hardly corrects
_UNKNOWN = 0.5  # variance of the logarithm of friction that is not known
_FINEST = 1e-12  # standard deviation of a position, at least
_SHORTEST = 1e-12  # way, at least
_SUREST = 0.01  # relative standard deviation of what a move teaches, at least


@compiled()
def place(side: int, i: int) -> int:
    """Return where m, F and c of a direction are among the parameters of the pulses."""
    if i == 0:
        return 0
    return (COULOMB if i == 1 else VISCOUS) + side


@compiled(inline=True)
def delay_of(h: int) -> float:
    """Return the delay of a model in samples."""
    k = h % DELAYS
    return (k + max(k - FINE, 0)) / PER_SAMPLE


@compiled(inline=True)
def lag_of(h: int) -> float:
    """Return the lag of a model in samples."""
    return (h // DELAYS) * LAG_STEP


@compiled()
def is_brief(p: Any) -> bool:
    """Return whether feedback hardly corrects the move, as it is too short at the whole limit."""
    return 2.0 * math.sqrt(p.mass * p.way / p.limit) < _BRIEF * p.period


@compiled()
def begin(p: Any, values: Any, covariance: Any) -> None:
    """Begin with what the pulses have learned: a Gaussian of logarithms."""
    side = p.backward
    p.mass = math.exp(values[0])
    F = math.exp(values[COULOMB + side])
    share = min(F / p.limit, 0.9)
    bending = F * math.sqrt(2.0 * p.bend * p.mass / max(p.limit - F, 0.1 * p.limit))
    i = COULOMB + side
    viscous, wide, low = 0.0, 1.0, 1.0
    if covariance[i, i] > _UNKNOWN:
        # At the speed of the move it is as uncertain as Coulomb friction, at least
        viscous = covariance[i, i] * F * F * p.mass / (p.limit * max(p.way, _SHORTEST))
        # Its variance is that of a log-normal, which is skewed to larger values
        wide = math.exp(covariance[i, i]) * math.expm1(covariance[i, i]) / covariance[i, i]
        # One standard deviation less: in a move of few samples too much effort is the worse error
        if is_brief(p):
            low = math.exp(-math.sqrt(covariance[i, i]))
    for lag in range(LAGS):
        # A lagging effort first has to exceed friction, which takes its impulse until then
        p.late[lag] = lag * LAG_STEP * (-math.log(1.0 - share) - share) / share
    for h in range(MODELS):
        off = (delay_of(h) - p.delay) / _DELAY_SPREAD
        slow = (lag_of(h) - p.lag) / _DELAY_SPREAD
        p.evidence[h] = off * off + slow * slow if p.known else _SIMPLER * lag_of(h)
        p.misfit[h] = p.effort[h] = p.once[h] = p.twice[h] = 0.0
        for i in range(ROWS):
            p.values[h, i] = math.exp(values[place(side, i)]) if i < TAUGHT else 0.0
            for j in range(ROWS):
                p.covariance[h, i, j] = 0.0
                if i < TAUGHT and j < TAUGHT:
                    a, b = place(side, i), place(side, j)
                    p.covariance[h, i, j] = covariance[a, b] * math.exp(values[a] + values[b])
        p.covariance[h, 2, 2] = max(p.covariance[h, 2, 2], viscous)
        p.covariance[h, 1, 1] *= wide
        p.values[h, 1] *= low
        p.values[h, 2] *= low
        p.covariance[h, TAUGHT, TAUGHT] = bending * bending
    p.best = 0
    for h in range(MODELS):
        if p.evidence[h] < p.evidence[p.best]:
            p.best = h
    p.rows, p.area, p.open, p.excess = 0, 0.0, 1, 0.0


@compiled(inline=True)
def lagging(f: float, u: float, lag: float, h: float) -> tuple[float, float, float]:
    """Return effort, mean and double integral over h^2 behind a lag, after the time h under u."""
    if lag <= 0.0:
        return u, u, 0.5 * u
    z = h / lag
    if z < 1e-9:
        return f, f, 0.5 * f
    left = math.exp(-z)
    mean = (1.0 - left) / z
    return u + (f - u) * left, u + (f - u) * mean, 0.5 * u + (f - u) * (1.0 - mean) / z


@compiled()
def variance_of(p: Any) -> float:
    """Return the variance of a sampled position."""
    return max(p.noise * p.noise, _FINEST * _FINEST)


@compiled()
def sent(p: Any, u: float) -> None:
    """Keep a command."""
    for k in range(HISTORY - 1, 0, -1):
        p.commands[k] = p.commands[k - 1]
    p.commands[0] = u


@compiled(inline=True)
def direction(p: Any) -> float:
    """Return the sign of the direction of the move."""
    return -1.0 if p.backward else 1.0


@compiled(inline=True)
def acting(p: Any, h: int) -> tuple[float, float, float]:
    """Return two commands that arrived in the last sample, and the share of the first in it.

    They are in the direction of the move.
    """
    delay = delay_of(h)
    whole = int(delay)
    sign = direction(p)
    return sign * p.commands[whole + 1], sign * p.commands[whole], delay - whole


@compiled()
def _integrate(p: Any, h: int) -> None:
    """Integrate the effort over the last sample."""
    older, newer, share = acting(p, h)
    lag = lag_of(h) * p.period
    for part in range(2):
        step = (share if part == 0 else 1.0 - share) * p.period
        f, mean, double = lagging(p.effort[h], older if part == 0 else newer, lag, step)
        p.twice[h] += p.once[h] * step + double * step * step
        p.once[h] += mean * step
        p.effort[h] = f


@compiled()
def learn(p: Any, x: float, measured: bool) -> None:
    """Take the position x of a sample in, in the direction of the move, from its start on."""
    T = p.period
    p.area += 0.5 * T * (x + p.position)
    alike = max(p.samples / _ALIKE, 1.0)
    rough = p.noise * p.noise + alike * (_ROUGH * x) ** 2
    even = p.mass * p.mass * max(rough, 1e-30)
    excess = p.mass * p.mass * p.excess
    in_use, explained = 0.0, 0.0  # innovation of the model in use, and its variance
    friction = 0.5 * _EARLY_FRICTION * p.values[p.best, 1]
    early = max(_EARLY * p.shortest - _NO_EARLY, 0.0) * T
    # Trapezoids are too large by T^2 (v - v_0)/12 (Euler and Maclaurin), with v_0 = 0
    area = p.area - T * T * p.v / 12.0
    row, gain = np.empty(ROWS), np.empty(ROWS)
    for h in range(MODELS):
        _integrate(p, h)
        if not (measured and p.open):
            continue
        tau = max((p.samples - delay_of(h) - p.late[h // DELAYS]) * T, 0.0)
        row[0], row[1], row[2], row[3] = x, 0.5 * tau * tau, area, tau
        R = even + (friction * tau * min(tau, early)) ** 2
        innovation, variance = p.twice[h], R
        if tau == 0.0:
            innovation = p.mass * x
        else:
            for i in range(ROWS):
                innovation -= row[i] * p.values[h, i]
                gain[i] = 0.0
                for j in range(ROWS):
                    gain[i] += p.covariance[h, i, j] * row[j]
            for i in range(ROWS):
                variance += row[i] * gain[i]
            if h == p.best:
                in_use, explained = innovation, variance
            wide = max(variance + excess, innovation * innovation / _OUTLYING)
            for i in range(ROWS):
                p.values[h, i] += gain[i] * innovation / wide
                for j in range(ROWS):
                    p.covariance[h, i, j] -= gain[i] * gain[j] / wide
        p.misfit[h] += innovation * innovation / variance
        square = innovation * innovation / (variance + excess)
        if square > _OUTLYING:
            square = _OUTLYING * (1.0 + math.log(square / _OUTLYING))
        p.evidence[h] += square + math.log((variance + excess) / (R + excess))
    if measured and p.open:
        p.rows += 1
        if p.samples - delay_of(p.best) > _ONSET:
            beyond = max(in_use * in_use - explained, 0.0) / (p.mass * p.mass)
            p.excess += _MEMORY * (beyond - p.excess)
    p.position = x


@compiled()
def choose(p: Any) -> bool:
    """Choose the model with the best evidence; return whether it changes.

    It has to be clearly better, but in the first samples of the motion, which show the delay.
    """
    best = p.best
    for h in range(MODELS):
        if p.evidence[h] < p.evidence[best]:
            best = h
    onset = p.seen and p.samples - delay_of(p.best) <= _ONSET
    clearly = 0.0 if onset and p.known == 0 else _CLEARLY
    changed = p.evidence[best] < p.evidence[p.best] - clearly
    if changed:
        p.best = best
    return changed


@compiled()
def certain(p: Any) -> bool:
    """Return whether no model more than a sample later or earlier is nearly as good."""
    best = delay_of(p.best) + lag_of(p.best)
    for h in range(MODELS):
        apart = abs(delay_of(h) + lag_of(h) - best) > 1.0
        if apart and p.evidence[h] < p.evidence[p.best] + _CERTAIN:
            return False
    return True


@compiled()
def unexplained(p: Any) -> bool:
    """Return whether the law does not explain the last move."""
    return p.misfit[p.best] > EXPLAINED * p.rows


@compiled(inline=True)
def misfit_scale(p: Any) -> float:
    """Return the mean squared innovation over its variance, at least 1: a factor of variances."""
    return max(p.misfit[p.best] / max(p.rows, 1), 1.0)


@compiled()
def physical(p: Any) -> tuple[float, float, float]:
    """Return m, F and c of the model in use, with c = 0 where its estimate is negative.

    The means of the Gaussian given c = 0 are m - P_mc c/P_cc and F - P_Fc c/P_cc.
    """
    h = p.best
    c = p.values[h, 2]
    k = min(c, 0.0) / max(p.covariance[h, 2, 2], 1e-300)
    return (
        p.values[h, 0] - k * p.covariance[h, 0, 2],
        p.values[h, 1] - k * p.covariance[h, 1, 2],
        max(c, 0.0),
    )


@compiled()
def _driven(p: Any, F: float) -> bool:
    """Return whether a load beyond friction certainly drives the axis of a move.

    A spring behind the drive yields at first, and a vibration looks like a force.
    """
    certain = _OUTLYING * misfit_scale(p) * p.covariance[p.best, 1, 1] < F * F
    lasts = p.samples - delay_of(p.best) >= _DRIVEN
    return certain and lasts and p.shaken == 0 and not unexplained(p)


@compiled()
def model(p: Any) -> tuple[float, float, float]:
    """Return m, F and c of the model in use, within what is possible.

    A load to the side of the move that exceeds friction makes F negative.
    """
    m, F, c = physical(p)
    m = min(max(m, p.mass / _MOST), p.mass * _MOST)
    most = _STRONGEST * p.limit
    least = -most if _driven(p, F) else 0.0
    return m, min(max(F, least), most), c


@compiled()
def teach(p: Any, values: Any, covariance: Any) -> None:
    """Give the pulses what the move has taught.

    With the mean mu and covariance P of all parameters, and those nu, Q of m, F and c after the
    move, the mean becomes mu + K (nu - mu_s) and the covariance P + K (Q - P_s) K', where
    K = P_(.s) P_s^-1: what the move has not seen follows as far as it depends on what it has.
    """
    side, h = p.backward, p.best
    p.values[h, 0], p.values[h, 1], p.values[h, 2] = physical(p)
    for i in range(TAUGHT):
        if p.values[h, i] <= 0.0:
            p.values[h, i] = _LEAST * math.exp(values[place(side, i)])
    scale = misfit_scale(p)
    P_s, Q, change = np.empty((TAUGHT, TAUGHT)), np.empty((TAUGHT, TAUGHT)), np.empty(TAUGHT)
    cross = np.empty((PARAMETERS, TAUGHT))
    for i in range(TAUGHT):
        a = place(side, i)
        change[i] = math.log(p.values[h, i]) - values[a]
        for j in range(TAUGHT):
            P_s[i, j] = covariance[a, place(side, j)]
            Q[i, j] = scale * p.covariance[h, i, j] / (p.values[h, i] * p.values[h, j])
        Q[i, i] += _SUREST * _SUREST
        P_s[i, i] *= 1.0 + 1e-9
        for b in range(PARAMETERS):
            cross[b, i] = covariance[b, a]
    for i in range(TAUGHT):
        limit = P_s[i, i] / Q[i, i]
        if limit < 1.0:  # no less certain than before
            for j in range(TAUGHT):
                Q[i, j] *= math.sqrt(limit)
                Q[j, i] *= math.sqrt(limit)
    K = cross @ np.linalg.inv(P_s)
    D = K @ (Q - P_s) @ K.T
    for a in range(PARAMETERS):
        for i in range(TAUGHT):
            values[a] += K[a, i] * change[i]
        for b in range(PARAMETERS):
            covariance[a, b] += 0.5 * (D[a, b] + D[b, a])
