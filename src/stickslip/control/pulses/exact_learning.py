"""Update of the exact pulse controller's estimates by a pulse.

The parameters are the logarithms of mass, Coulomb friction (offset included) and viscous friction,
the last two for each direction, so that every estimate is positive whatever is observed. They are
known as a Gaussian with covariance P. A pulse is one observation: the positions sampled along it
and the displacement from rest to rest. Its likelihood is that of Eq. 3's motion with white noise on
the samples, and the maximum of the posterior is found by an iterated extended Kalman filter (each
iteration is a Gauss-Newton step), one scalar at a time: no matrix is inverted.

A prior that is contradicted, by residuals that a wider one explains, is widened: a first guess that
was wrong by orders of magnitude would otherwise be corrected only as far as its spread says.

From pulse to pulse the friction of both directions, Coulomb and viscous, walks at random; how far
is learned from how far the estimates of the Coulomb friction had to move.

The breakaway is learned apart, as an interval for each direction: an effort that freed the mass is
at least as strong, one that did not is weaker. As long as none has failed, the breakaway is taken
to be at most twice the Coulomb friction: to try in vain costs a sample, never to try costs detours.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulses.kernel import OWN
from stickslip.numerics.named_fields import fields_at
from stickslip.planning.pulse_kernels import position_along, pulse_displacement, pulse_ends

__all__ = [
    "COULOMB",
    "OWN_DTYPE",
    "PARAMETERS",
    "VISCOUS",
    "learn",
    "own_fields",
    "slopes",
]

PARAMETERS = 5  # logarithms of m, F+, F-, c+, c-
COULOMB, VISCOUS = 1, 3  # of the positive direction; that of the negative follows

OWN_DTYPE = np.dtype(
    [
        # Settings
        ("period", "f8"),  # sampling time
        ("limit", "f8"),  # of the effort
        ("longest", "f8"),  # most samples in one pulse
        ("noise", "f8"),  # standard deviation of a sampled position
        ("rest_noise", "f8"),  # of the position at rest
        ("max_idle_pulses", "f8"),  # pulses in a row that may bring nothing
        # What changes
        ("walk", "f8"),  # variance by which log F+, F-, c+ and c- walk from pulse to pulse
        ("breakaway", "f8", (2,)),  # believed, for each direction
        ("held", "f8", (2,)),  # strongest effort that did not free the mass, or Coulomb friction
        ("moved_at", "f8", (2,)),  # weakest effort that freed it
        ("best", "f8"),  # smallest error at rest so far
        ("goal", "f8"),  # half of what the error was when it was last halved
        ("fruitless", "i8"),  # pulses since then
        ("reason", "i8"),  # why no pulse is fired any more
        ("allowed", "f8"),  # most samples of the next pulse
        ("values", "f8", (PARAMETERS,)),
        ("covariance", "f8", (PARAMETERS, PARAMETERS)),
    ]
)
"""What the exact pulse controller adds to the state."""

own_fields = fields_at(OWN_DTYPE, start=OWN)

_ITERATIONS = 30
_COOLING = 0.1  # of the variance by which the observation is inflated, from iteration to iteration
_CONVERGED = 1e-7  # change of a logarithm
_STRONGEST = 0.98  # of the effort: the Coulomb friction of a mass that it has moved
_LONGEST_STEP = 0.5  # of a logarithm in one iteration
_UNEXPLAINED = 9.0  # mean square of the normalised residuals with which a prior is doubted
_WIDENING, _WIDENINGS = 100.0, 4  # of its variance, and so often at most
_ROUNDED = 1e-12  # of a variance: none
_SMALL = 0.1  # of the Coulomb friction: viscous friction that hardly counts
_MISSED = 2.0  # factor between predicted and achieved displacement; of the next pulse's width then
_NEAR_LONGER = 10.0  # of the next pulse's width where the law does not hold but gives the direction
_EXPLAINED = 0.5  # of that mean square is left, or less, where it is right to widen the prior
_DIFFERENCE = 1e-6  # of a logarithm, for slopes
_FINEST = 1e-4  # of the displacement: no axis follows the law more closely
_SURPRISE = 25.0  # most that one pulse counts for, as a multiple of the variance expected
_HIGHEST = 2.0  # breakaway over Coulomb friction, where nothing shows that it is higher
_SLOWEST_WALK = 1e-10  # variance: what the estimates forget even where friction repeats exactly

Vector = Float[np.ndarray, " s"]


@compiled()
def slopes(m: float, F: float, c: float, f: float, t: float) -> tuple[float, float, float, float]:
    """Return the displacement from rest to rest and its slopes by log m, log F and log c."""
    up = 1.0 + _DIFFERENCE
    d = pulse_displacement(m, F, c, f, t)
    by_m = pulse_displacement(m * up, F, c, f, t)
    by_f = pulse_displacement(m, F * up, c, f, t)
    by_c = pulse_displacement(m, F, c * up, f, t)
    return d, (by_m - d) / _DIFFERENCE, (by_f - d) / _DIFFERENCE, (by_c - d) / _DIFFERENCE


@compiled()
def _observe(
    value: Vector, P: Float[np.ndarray, "p p"], at: Vector, side: int, row: Vector, y: float,
    R: float,
) -> None:  # fmt: skip
    """Take a scalar observation y with variance R in place: one update of the Kalman filter.

    ``row`` is the prediction at the point of linearisation ``at``, and its slopes by log m, log F
    and log c of the direction ``side``.
    """
    n = value.size
    gain = np.empty(n)
    innovation = y - row[0]
    for k in range(3):
        i = 0 if k == 0 else (COULOMB if k == 1 else VISCOUS) + side
        innovation -= row[1 + k] * (value[i] - at[i])
    for a in range(n):
        gain[a] = row[1] * P[a, 0] + row[2] * P[a, COULOMB + side] + row[3] * P[a, VISCOUS + side]
    S = R + row[1] * gain[0] + row[2] * gain[COULOMB + side] + row[3] * gain[VISCOUS + side]
    for a in range(n):
        value[a] += gain[a] / S * innovation
        for b in range(n):
            P[a, b] -= gain[a] * gain[b] / S


@compiled()
def _posterior(
    s: Any, own: Any, prior: Vector, P: Float[np.ndarray, "p p"], at: Vector, side: int, f: float,
    t: float, inflation: float, value: Vector, Q: Float[np.ndarray, "p p"],
) -> float:  # fmt: skip
    """Write the posterior linearised at ``at`` into ``value`` and ``Q``.

    Returns the mean square of the normalised residuals there.
    """
    n = prior.size
    for a in range(n):
        value[a] = prior[a]
        for b in range(n):
            Q[a, b] = P[a, b]
    m = math.exp(at[0])
    F, c = math.exp(at[COULOMB + side]), math.exp(at[VISCOUS + side])
    way = 1.0 if f > 0.0 else -1.0
    achieved = way * s.last.achieved
    start = s.rest - s.last.achieved
    coarse = (_FINEST * achieved) ** 2
    count, total = s.position_count, 0.0
    u, up, row = abs(f), 1.0 + _DIFFERENCE, np.empty(4)
    ends, ends_m = pulse_ends(m, F, c, u, t), pulse_ends(m * up, F, c, u, t)
    ends_f, ends_c = pulse_ends(m, F * up, c, u, t), pulse_ends(m, F, c * up, u, t)
    for k in range(1, count + 1):
        last = k == count
        tau = math.inf if last else max(k * s.stride - s.delay, 0.0) * own.period
        x = position_along(m, F, c, u, t, tau, ends)
        row[0] = x
        row[1] = (position_along(m * up, F, c, u, t, tau, ends_m) - x) / _DIFFERENCE
        row[2] = (position_along(m, F * up, c, u, t, tau, ends_f) - x) / _DIFFERENCE
        row[3] = (position_along(m, F, c * up, u, t, tau, ends_c) - x) / _DIFFERENCE
        y = achieved if last else way * (s.positions[k] - start)
        R = own.rest_noise**2 + coarse + (own.rest_noise**2 if last else own.noise**2)
        total += (y - row[0]) ** 2 / R
        _observe(value, Q, at, side, row, y, R * inflation)
    return total / count


@compiled()
def _maximum(
    s: Any, own: Any, prior: Vector, P: Float[np.ndarray, "p p"], at: Vector, side: int, f: float,
    t: float, value: Vector, Q: Float[np.ndarray, "p p"],
) -> float:  # fmt: skip
    """Write the posterior's maximum, looked for from ``at`` on, and its covariance.

    Returns the mean square of the normalised residuals there.
    """
    n = prior.size
    most = math.log(_STRONGEST * abs(f))
    at[COULOMB + side] = min(at[COULOMB + side], most)
    # Far from the prior the slopes there mislead: the observation gains its weight step by step
    inflation = misfit = _posterior(s, own, prior, P, at, side, f, t, 1.0, value, Q)
    for _ in range(_ITERATIONS):
        inflation = max(min(inflation, misfit) * _COOLING, 1.0)
        misfit = _posterior(s, own, prior, P, at, side, f, t, inflation, value, Q)
        farthest = 0.0
        for a in range(n):
            farthest = max(farthest, abs(value[a] - at[a]))
        shorter = min(1.0, _LONGEST_STEP / farthest) if farthest > 0.0 else 1.0
        for a in range(n):
            at[a] += shorter * (value[a] - at[a])
        at[COULOMB + side] = min(at[COULOMB + side], most)
        if farthest <= _CONVERGED and inflation == 1.0:
            break
    # Where the law does not hold to within the noise, the noise is taken to be as large as needed
    _posterior(s, own, prior, P, at, side, f, t, max(misfit, 1.0), value, Q)
    farthest = 0.0
    for a in range(n):
        farthest = max(farthest, abs(value[a] - at[a]))
    if not farthest <= _LONGEST_STEP:  # it leads nowhere: what is linear here says little of there
        for a in range(n):
            value[a] = at[a]
    return misfit


@compiled()
def _unseen(P: Float[np.ndarray, "p p"], side: int, C: Float[np.ndarray, "p p"]) -> None:
    """Write into C the part of P that is left when mass and friction of one direction are known."""
    n = PARAMETERS
    for a in range(n):
        for b in range(n):
            C[a, b] = P[a, b]
    column = np.empty(n)
    for i in (0, COULOMB + side, VISCOUS + side):
        pivot = C[i, i]
        if pivot <= _ROUNDED * P[i, i]:
            continue
        for a in range(n):
            column[a] = C[a, i]
        for a in range(n):
            for b in range(n):
                C[a, b] -= column[a] * column[b] / pivot


@compiled()
def _estimate(s: Any, own: Any, side: int, f: float, t: float, at: Vector) -> None:
    """Write into ``at`` the mass and friction that the pulse alone implies, viscous friction small.

    The effort does on its way what the friction does on all of it; Eq. 2 then gives the mass.
    """
    k = min(math.ceil((t / own.period + s.delay) / s.stride), s.position_count - 1)
    u, d = abs(f), abs(s.last.achieved)
    way = abs(s.positions[k] - (s.rest - s.last.achieved))
    F = u * min(max(way / d, 1.0 - _STRONGEST), _STRONGEST)
    m = u * (u - F) * t * t / (2.0 * d * F)
    at[0], at[COULOMB + side] = math.log(m), math.log(F)
    at[VISCOUS + side] = min(at[VISCOUS + side], math.log(_SMALL * F * m / ((u - F) * t)))


@compiled()
def _fit(s: Any, own: Any, side: int, f: float, t: float) -> None:
    """Replace mean and covariance of the parameters by those after the last pulse."""
    n = PARAMETERS
    prior, at, value = np.empty(n), np.empty(n), np.empty(n)
    P, Q = np.empty((n, n)), np.empty((n, n))
    for a in range(n):
        prior[a] = at[a] = own.values[a]
        for b in range(n):
            P[a, b] = own.covariance[a, b]
    own.walk = max(own.walk, _SLOWEST_WALK)
    for side_ in range(2):
        P[COULOMB + side_, COULOMB + side_] += own.walk
        P[VISCOUS + side_, VISCOUS + side_] += own.walk
    misfit = _maximum(s, own, prior, P, at, side, f, t, value, Q)
    i = COULOMB + side
    surprise = (value[i] - prior[i]) ** 2 / P[i, i]
    # A prior that leaves much unexplained which a wider one explains was too sure of itself. On an
    # axis that does not follow the law none explains it.
    wider, wider_Q, C = np.empty(n), np.empty((n, n)), np.empty((n, n))
    if misfit > _UNEXPLAINED:
        _unseen(P, side, C)
        for _ in range(_WIDENINGS):
            for a in range(n):
                at[a] = prior[a]
                for b in range(n):
                    P[a, b] = C[a, b] + _WIDENING * (P[a, b] - C[a, b])
            _estimate(s, own, side, f, t, at)
            again = _maximum(s, own, prior, P, at, side, f, t, wider, wider_Q)
            if again < _EXPLAINED * misfit:
                misfit = again
                for a in range(n):
                    value[a] = wider[a]
                    for b in range(n):
                        Q[a, b] = wider_Q[a, b]
            if misfit <= _UNEXPLAINED:
                break
    ratio = s.last.predicted / s.last.achieved
    near = 1.0 / _MISSED < ratio < _MISSED
    longer = _NEAR_LONGER if near else _MISSED
    own.allowed = math.inf if misfit <= _UNEXPLAINED else longer * math.ceil(t / own.period - 0.5)
    own.walk = max(own.walk * (0.1 + 0.9 * min(surprise, _SURPRISE)), _SLOWEST_WALK)
    for a in range(n):
        own.values[a] = value[a]
        for b in range(n):
            own.covariance[a, b] = Q[a, b]


@compiled()
def learn(s: Any, own: Any) -> None:
    """Learn from the last pulse."""
    f = s.last.levels[0, 0]
    t = s.last.levels[0, 1] * own.period
    side = 0 if f > 0.0 else 1
    strength = abs(f)
    if not s.last.moved:
        own.held[side] = strength
        if own.moved_at[side] <= strength:  # it has grown since
            own.moved_at[side] = own.limit
        own.breakaway[side] = max(own.breakaway[side], 0.5 * (own.held[side] + own.moved_at[side]))
        return
    if s.last.achieved * f < 0.0:  # something else has pushed
        return
    _fit(s, own, side, f, t)
    own.moved_at[side] = min(own.moved_at[side], strength)
    for side_ in range(2):
        most = _HIGHEST * math.exp(own.values[COULOMB + side_])
        if own.held[side_] < most:
            own.breakaway[side_] = min(own.breakaway[side_], most)
    F = math.exp(own.values[COULOMB + side])
    if own.held[side] >= strength or own.held[side] < F:  # it has fallen since; or is at least F
        own.held[side] = min(F, strength)
    if own.breakaway[side] > own.moved_at[side]:
        own.breakaway[side] = 0.5 * (own.held[side] + own.moved_at[side])
    own.breakaway[side] = max(own.breakaway[side], own.held[side])
