"""What a move from rest teaches while it lasts: mass, friction of its direction, and delay.

With the effort u acting from the delay t_d on, a mass that moves one way obeys

    m x + F (t - t_d)^2/2 + c X = U,    X = integral of x,    U = double integral of u(t - t_d),

which is linear in m, F and c: no sample is differentiated, and the noise of a sample is that of its
row over m. For each of some delays, a quarter of a sample apart, a Kalman filter has these three
parameters and the evidence of all samples so far,

    J = sum of [innovation^2/S + log S],

whose least is that of the delay to believe. A lag of the drive acts as a delay.
"""

import math
from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.pulses.exact_kernels import COULOMB, PARAMETERS, VISCOUS
from stickslip.numerics.named_fields import fields_at, places

DELAYS = 41
PER_SAMPLE = 4.0  # delays a sample
HISTORY = 16  # commands kept, more than the longest delay
ROWS = 3  # m, F, c

OWN_DTYPE = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("length", "i8"),  # of the vector
        ("period", "f8"),  # T
        ("limit", "f8"),  # of the effort
        ("noise", "f8"),  # standard deviation of a sampled position
        ("known", "i8"),  # 1 if the delay is known, or learned
        ("delay", "f8"),  # then this many samples
        ("most_moves", "i8"),  # to one target
        # What changes
        ("moving", "i8"),  # 1 during a move
        ("begun", "i8"),  # 1 after the first sample
        ("moves", "i8"),  # to this target
        ("last_error", "f8"),  # before the last one
        ("samples", "i8"),  # since it began
        ("longest", "i8"),  # samples after which it is ended
        ("start", "f8"),
        ("backward", "i8"),  # 1 if it goes in the negative direction
        ("way", "f8"),  # to the target, positive at the start
        ("left", "i8"),  # samples of the last part of the move; 0 before
        ("level", "f8"),  # of its accelerations: mean and slope
        ("slope", "f8"),
        ("x", "f8"),  # state in the sample, in the direction of the move, as estimated
        ("v", "f8"),
        ("position", "f8"),  # last one, as measured
        ("area", "f8"),  # X
        ("commands", "f8", (HISTORY,)),  # the latest is the first
        ("best", "i8"),  # the delay that is believed
        ("mass", "f8"),  # by which a row's noise is that of a sample
        ("rows", "i8"),  # so far
        ("misfit", "f8", (DELAYS,)),  # sum of innovation^2/S
        ("evidence", "f8", (DELAYS,)),
        ("once", "f8", (DELAYS,)),  # integral of the effort
        ("twice", "f8", (DELAYS,)),  # double integral
        ("values", "f8", (DELAYS, ROWS)),
        ("covariance", "f8", (DELAYS, ROWS, ROWS)),
    ]
)
own_fields = fields_at(OWN_DTYPE)
SIZE = places(OWN_DTYPE)

_ROUGH = 5e-4  # of the way so far: no axis follows the law more closely
_DELAY_SPREAD = 0.5  # samples: standard deviation of a known delay
_LEAST = 0.02  # of a prior value: no parameter is less
_SUREST = 0.01  # relative standard deviation of what a move teaches, at least


@compiled()
def place(side: int, i: int) -> int:
    """Return where m, F and c of a direction are among the parameters of the pulses."""
    if i == 0:
        return 0
    return (COULOMB if i == 1 else VISCOUS) + side


@compiled()
def begin(p: Any, values: Any, covariance: Any) -> None:
    """Begin with what the pulses have learned: a Gaussian of logarithms."""
    side = p.backward
    p.mass = math.exp(values[0])
    for h in range(DELAYS):
        off = (h / PER_SAMPLE - p.delay) / _DELAY_SPREAD
        p.evidence[h] = off * off if p.known else 0.0
        p.misfit[h] = p.once[h] = p.twice[h] = 0.0
        for i in range(ROWS):
            a = place(side, i)
            p.values[h, i] = math.exp(values[a])
            for j in range(ROWS):
                b = place(side, j)
                scale = math.exp(values[a] + values[b])
                p.covariance[h, i, j] = covariance[a, b] * scale
    p.best = int(round(p.delay * PER_SAMPLE)) if p.known else 0
    p.rows, p.area = 0, 0.0
    for k in range(HISTORY):
        p.commands[k] = 0.0


@compiled()
def acting(p: Any, h: int) -> tuple[float, float, float]:
    """Return two efforts that acted in the last sample, and the share of the first in it."""
    delay = h / PER_SAMPLE
    whole = int(delay)
    return p.commands[whole + 1], p.commands[whole], delay - whole


@compiled()
def learn(p: Any, x: float, measured: bool) -> None:
    """Take the position x of a sample in, in the direction of the move, from its start on."""
    T = p.period
    p.area += 0.5 * T * (x + p.position)
    rough = p.noise * p.noise + (_ROUGH * x) ** 2
    R = p.mass * p.mass * max(rough, 1e-30)
    for h in range(DELAYS):
        older, newer, share = acting(p, h)
        first, rest = share * T, (1.0 - share) * T
        p.twice[h] += p.once[h] * T + older * first * (T - 0.5 * first) + 0.5 * newer * rest * rest
        p.once[h] += older * first + newer * rest
        if not measured:
            continue
        tau = max((p.samples - h / PER_SAMPLE) * T, 0.0)
        row = (x, 0.5 * tau * tau, p.area)
        gain = np.empty(ROWS)
        innovation, S = p.twice[h], R
        if tau == 0.0:
            innovation = p.mass * x
        else:
            for i in range(ROWS):
                innovation -= row[i] * p.values[h, i]
                gain[i] = 0.0
                for j in range(ROWS):
                    gain[i] += p.covariance[h, i, j] * row[j]
            for i in range(ROWS):
                S += row[i] * gain[i]
            for i in range(ROWS):
                p.values[h, i] += gain[i] * innovation / S
                for j in range(ROWS):
                    p.covariance[h, i, j] -= gain[i] * gain[j] / S
        p.misfit[h] += innovation * innovation / S
        p.evidence[h] += innovation * innovation / S + math.log(S / R)
    if measured:
        p.rows += 1
    p.position = x


@compiled()
def choose(p: Any) -> bool:
    """Believe the delay with the best evidence; return whether it is another one than before."""
    best = p.best
    for h in range(DELAYS):
        if p.evidence[h] < p.evidence[best]:
            best = h
    changed = best != p.best
    p.best = best
    return changed


@compiled()
def model(p: Any, i: int) -> float:
    """Return m, F or c as believed."""
    least = _LEAST * p.mass if i == 0 else 0.0
    return max(p.values[p.best, i], least)


@compiled()
def teach(p: Any, values: Any, covariance: Any) -> None:
    """Give the pulses what the move has taught.

    With the mean mu and covariance P of all parameters, and those nu, Q of m, F and c after the
    move, the mean becomes mu + K (nu - mu_s) and the covariance P + K (Q - P_s) K', where
    K = P_(.s) P_s^-1: what the move has not seen follows as far as it depends on what it has.
    """
    side, h = p.backward, p.best
    for i in range(ROWS):
        if p.values[h, i] <= 0.0:
            p.values[h, i] = _LEAST * math.exp(values[place(side, i)])
    scale = max(p.misfit[h] / max(p.rows, 1), 1.0)
    P_s, Q, change = np.empty((ROWS, ROWS)), np.empty((ROWS, ROWS)), np.empty(ROWS)
    cross = np.empty((PARAMETERS, ROWS))
    for i in range(ROWS):
        a = place(side, i)
        change[i] = math.log(p.values[h, i]) - values[a]
        for j in range(ROWS):
            P_s[i, j] = covariance[a, place(side, j)]
            Q[i, j] = scale * p.covariance[h, i, j] / (p.values[h, i] * p.values[h, j])
        Q[i, i] += _SUREST * _SUREST
        P_s[i, i] *= 1.0 + 1e-9
        for b in range(PARAMETERS):
            cross[b, i] = covariance[b, a]
    for i in range(ROWS):
        limit = P_s[i, i] / Q[i, i]
        if limit < 1.0:  # no less certain than before
            for j in range(ROWS):
                Q[i, j] *= math.sqrt(limit)
                Q[j, i] *= math.sqrt(limit)
    K = cross @ np.linalg.inv(P_s)
    D = K @ (Q - P_s) @ K.T
    for a in range(PARAMETERS):
        for i in range(ROWS):
            values[a] += K[a, i] * change[i]
        for b in range(PARAMETERS):
            covariance[a, b] += 0.5 * (D[a, b] + D[b, a])
