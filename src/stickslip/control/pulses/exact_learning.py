"""Kernels of the exact pulse controller: what it learns from a pulse.

The parameters are the logarithms of mass, Coulomb friction (offset included) and
viscous friction, the last two for each direction, so that every estimate is positive whatever is
observed. They are known as a Gaussian with covariance P. A pulse is one observation: the positions
sampled along it and the displacement from rest to rest. Its likelihood is that of Eq. 3's motion
with white noise on the samples, and the maximum of the posterior is found by an iterated extended
Kalman filter (each iteration is a Gauss-Newton step), one scalar at a time: no matrix is inverted.

A prior that is contradicted, by residuals that a wider one explains, is widened: a first guess that
was wrong by orders of magnitude would otherwise be corrected only as far as its spread allows.

Once a move has taught mass and friction, a short pulse cannot contradict it: such a pulse counts by
its displacement alone, and what the law misses becomes a factor of the next displacements.

From pulse to pulse the friction of both directions, Coulomb and viscous, walks at random; how far
is learned from how far the estimates of the Coulomb friction had to move.

The breakaway is learned apart, as an interval for each direction: an effort that freed the mass is
at least as strong, one that did not is weaker. A mass that rests behind its start was not freed by
the pulse: a load or bristles have moved it. As long as none has failed, the breakaway is taken
to be at most twice the Coulomb friction: to try in vain costs a sample, never to try costs detours.
It is taken to be less after each pulse that has freed the mass but not halved the error.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulses.exact_state import (
    COULOMB,
    DIFFERENCE,
    PARAMETERS,
    STRONGER,
    VISCOUS,
    WIDEST,
    last_pulse,
)
from stickslip.planning.pulse_kernels import behind_lag, peak_behind_lag, position_along, pulse_ends

_ITERATIONS = 30  # of an update, at most
_COOLING = 0.1  # of the variance by which the observation is inflated, from iteration to iteration
_CONVERGED = 1e-7  # change of a logarithm
_STRONGEST = 0.98  # of the effort: the Coulomb friction of a mass that it has moved
_LONGEST_STEP = 0.5  # of a logarithm in one iteration
_UNEXPLAINED = 9.0  # mean square of the normalised residuals beyond which a prior is widened
_WIDENING, _WIDENINGS = 100.0, 4  # of its variance, and so often at most
_ROUNDED = 1e-12  # of a variance: none
_SMALL = 0.1  # of the Coulomb friction: viscous friction that hardly counts
_HEAVIER, _STICKIER = 1.5, 10.0  # factors of mass and friction from those that a move has taught
_UNTAUGHT = 0.25  # variance of the logarithm of Coulomb friction that a move has taught wrongly
_LEAST_SHARE, LARGEST_SHARE = 0.5, 8.0  # of a predicted displacement that is achieved
_SHARED = 0.7  # part of a deviation that a share takes over
_MISSED = 2.0  # factor between predicted and achieved displacement; of the next pulse's width then
_NEAR_LONGER = 4.0  # of the next pulse's width where the law does not hold but gives the direction
_EXPLAINED = 0.5  # of that mean square is left, or less, where it is right to widen the prior
_FARTHEST = 5.0  # standard deviations that a short pulse may move what moves have taught
_FINEST = 1e-4  # of the displacement: no axis follows the law more closely
_ROUGH = 0.05  # of displacement and friction, of an axis that does not follow the law along the way
_ALONG_LAG = 0.02  # of the displacement: the pulse that stands for a lagging one, on the way
_SURPRISE = 25.0  # most that one pulse counts for, as a multiple of the variance expected
HIGHEST = 2.0  # breakaway over Coulomb friction, where no pulse has failed
_WEAKER = 0.7  # times the breakaway, after a pulse that has not halved the error
_GROWN = 1.02  # times an effort that did not free the mass: a lower limit from before is outdated
_AGAIN = 1.05  # likewise on an axis that vibrates, or after a move has determined its friction
_STRONG = 0.7  # of the effort limit: longer pulses follow, not stronger ones
_PATIENT, _BOLDER = 4, 3.0  # as many may fail; then the first guess is wrong by more than that
_CLEAR = 4.0  # standard deviations of a position
_MOVING = 8  # samples in motion that can contradict a prior of mass and friction
_SLOWEST_WALK = 1e-10  # variance: what the estimates forget even where friction repeats exactly

Vector = Float[np.ndarray, " s"]
Matrix = Float[np.ndarray, "p p"]


@compiled()
def _observe(
    value: Vector, P: Matrix, at: Vector, side: int, row: Vector, y: float, R: float
) -> None:
    """Update mean and covariance with a scalar y of variance R, in place: one Kalman update.

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
    s: Any, own: Any, P: Matrix, at: Vector, doubt: tuple[float, float], value: Vector, Q: Matrix
) -> float:
    """Write the posterior linearised at ``at`` into ``value`` and ``Q``; P is the prior covariance.

    ``doubt`` is the inflation of the variance of the residuals, and a rough share. Where that is
    above 0, the displacement from rest to rest alone counts, and it and friction are so uncertain
    over their values. Returns the mean square of the normalised residuals there.
    """
    inflation, rough = doubt
    side, f, t = last_pulse(s, own)
    value[:], Q[:] = own.values, P
    m = math.exp(at[0])
    F, c = math.exp(at[COULOMB + side]), math.exp(at[VISCOUS + side])
    sign = 1.0 if f > 0.0 else -1.0
    achieved = sign * s.last.achieved
    start = s.rest - s.last.achieved
    coarse = (max(_FINEST, rough) * achieved) ** 2
    on_way = (_ALONG_LAG * achieved) ** 2 if own.lag > 0.0 else 0.0
    count, total = (1 if rough > 0.0 else s.position_count), 0.0
    up, row = 1.0 + DIFFERENCE, np.empty(4)
    u, w, begin = behind_lag(F, abs(f), t, own.lag)
    u_f, w_f, begin_f = behind_lag(F * up, abs(f), t, own.lag)
    ends, ends_m = pulse_ends(m, F, c, u, w), pulse_ends(m * up, F, c, u, w)
    ends_f, ends_c = pulse_ends(m, F * up, c, u_f, w_f), pulse_ends(m, F, c * up, u, w)
    delay = s.delay * own.period - own.lag
    for k in range(1, count + 1):
        last = k == count
        time = math.inf if last else k * s.stride * own.period - delay
        tau, tau_f = max(time - begin, 0.0), max(time - begin_f, 0.0)
        x = position_along(m, F, c, u, w, tau, ends)
        row[0] = x
        row[1] = (position_along(m * up, F, c, u, w, tau, ends_m) - x) / DIFFERENCE
        row[2] = (position_along(m, F * up, c, u_f, w_f, tau_f, ends_f) - x) / DIFFERENCE
        row[3] = (position_along(m, F, c * up, u, w, tau, ends_c) - x) / DIFFERENCE
        y = achieved if last else sign * (s.positions[k] - start)
        sensor = own.rest_noise if last else own.noise
        way = 0.0 if last else on_way
        R = own.rest_noise**2 + coarse + sensor**2 + (rough * row[2]) ** 2 + way
        total += (y - row[0]) ** 2 / R
        _observe(value, Q, at, side, row, y, R * inflation)
    return total / count


@compiled()
def _largest_change(value: Vector, at: Vector) -> float:
    largest = 0.0
    for a in range(value.size):
        largest = max(largest, abs(value[a] - at[a]))
    return largest


@compiled()
def _maximum(
    s: Any, own: Any, P: Matrix, at: Vector, rough: float, value: Vector, Q: Matrix
) -> float:
    """Write the posterior's maximum, searched from ``at`` on, and its covariance.

    Returns the mean square of the normalised residuals there.
    """
    side, f, t = last_pulse(s, own)
    most = math.log(_STRONGEST * peak_behind_lag(abs(f), t, own.lag))
    at[COULOMB + side] = min(at[COULOMB + side], most)
    # Far from the prior the slopes there mislead: the observation gains its weight step by step
    inflation = misfit = _posterior(s, own, P, at, (1.0, rough), value, Q)
    for _ in range(_ITERATIONS):
        inflation = max(min(inflation, misfit) * _COOLING, 1.0)
        misfit = _posterior(s, own, P, at, (inflation, rough), value, Q)
        change = _largest_change(value, at)
        shorter = min(1.0, _LONGEST_STEP / change) if change > 0.0 else 1.0
        for a in range(at.size):
            at[a] += shorter * (value[a] - at[a])
        at[COULOMB + side] = min(at[COULOMB + side], most)
        if change <= _CONVERGED and inflation == 1.0:
            break
    # Where the law does not hold to within the noise, the noise is taken to be as large as needed
    _posterior(s, own, P, at, (max(misfit, 1.0), rough), value, Q)
    # A step so long leaves the range in which the linearisation holds
    if not _largest_change(value, at) <= _LONGEST_STEP:
        value[:] = at
    return misfit


@compiled()
def _unseen(P: Matrix, side: int, C: Matrix) -> None:
    """Write into C the part of P that is left when mass and friction of one direction are known."""
    n = PARAMETERS
    C[:] = P
    column = np.empty(n)
    for i in (0, COULOMB + side, VISCOUS + side):
        pivot = C[i, i]
        if pivot <= _ROUNDED * P[i, i]:
            continue
        column[:] = C[:, i]
        for a in range(n):
            for b in range(n):
                C[a, b] -= column[a] * column[b] / pivot


@compiled()
def _estimate(s: Any, own: Any, at: Vector) -> None:
    """Write into ``at`` the mass and friction that the pulse alone implies, viscous friction small.

    The work of the effort over its part of the travel is that of friction over the whole; Eq. 2
    then gives the mass.
    """
    side, f, t = last_pulse(s, own)
    at_end, k = (t / own.period + s.delay) / s.stride, 0
    for each in range(s.position_count - 1):  # the first position at the end of the effort or later
        if each < at_end:
            k = each + 1
    u, d = abs(f), abs(s.last.achieved)
    under_effort = abs(s.positions[k] - (s.rest - s.last.achieved))
    F = u * min(max(under_effort / d, 1.0 - _STRONGEST), _STRONGEST)
    m = u * (u - F) * t * t / (2.0 * d * F)
    at[0], at[COULOMB + side] = math.log(m), math.log(F)
    at[VISCOUS + side] = min(at[VISCOUS + side], math.log(_SMALL * F * m / ((u - F) * t)))


@compiled()
def _in_motion(s: Any, own: Any) -> int:
    """Return how many positions of the last pulse are between those before and after it."""
    start, clear, count = s.rest - s.last.achieved, _CLEAR * own.noise, 0
    for k in range(s.position_count):
        if abs(s.positions[k] - start) > clear and abs(s.positions[k] - s.rest) > clear:
            count += 1
    return count


@compiled()
def _far(own: Any, value: Vector) -> bool:
    """Return whether a parameter changes by many of its standard deviations."""
    for a in range(PARAMETERS):
        variance = own.covariance[a, a] + (own.walk if a >= COULOMB else 0.0)
        if (value[a] - own.values[a]) ** 2 > _FARTHEST**2 * variance:
            return True
    return False


@compiled()
def _beyond(own: Any, value: Vector) -> bool:
    """Return whether a value is farther from what a move has taught than a pulse may contradict.

    Coulomb friction may be any larger: a move to one side may have said little of the other.
    """
    for a in range(PARAMETERS):
        most = math.log(_HEAVIER if a == 0 else _STICKIER)
        change = value[a] - own.by_moves[a]
        more = change > most and not COULOMB <= a < VISCOUS
        if more or change < -most:
            return True
    return False


@compiled()
def _fit(s: Any, own: Any) -> None:
    """Replace mean and covariance of the parameters by those after the last pulse."""
    side, _, t = last_pulse(s, own)
    n = PARAMETERS
    prior, at, value = own.values.copy(), own.values.copy(), np.empty(n)
    P, Q = own.covariance.copy(), np.empty((n, n))
    own.walk = max(own.walk, _SLOWEST_WALK)
    for i in range(COULOMB, n):
        P[i, i] += own.walk
    misfit = _maximum(s, own, P, at, 0.0, value, Q)
    i = COULOMB + side
    surprise = (value[i] - prior[i]) ** 2 / P[i, i]
    # A prior that leaves much unexplained which a wider one explains was too sure of itself. On an
    # axis that does not follow the law none explains it.
    wider, wider_Q, C = np.empty(n), np.empty((n, n)), np.empty((n, n))
    if misfit > _UNEXPLAINED and (not own.taught or _in_motion(s, own) >= _MOVING):
        _unseen(P, side, C)
        for _ in range(_WIDENINGS):
            at[:] = prior
            for a in range(n):
                for b in range(n):
                    P[a, b] = C[a, b] + _WIDENING * (P[a, b] - C[a, b])
            _estimate(s, own, at)
            again = _maximum(s, own, P, at, 0.0, wider, wider_Q)
            if again <= _UNEXPLAINED or (not own.taught and again < _EXPLAINED * misfit):
                misfit = again
                value[:], Q[:] = wider, wider_Q
            if misfit <= _UNEXPLAINED:
                break
    if own.taught:
        few = _in_motion(s, own) < _MOVING
        if (few and _far(own, value)) or _beyond(own, value):
            misfit = math.inf
        if misfit == math.inf or (misfit > _UNEXPLAINED and not few):
            # A law that does not hold along the way may hold for all of it
            at[:] = prior
            P[:] = own.covariance
            for i in range(COULOMB, VISCOUS):
                P[i, i] += own.walk
            contradicted = own.share[side] >= LARGEST_SHARE  # pulse after pulse
            if contradicted:
                P[COULOMB + side, COULOMB + side] += _UNTAUGHT
            for i in range(VISCOUS, n):  # one displacement cannot teach both kinds of friction
                P[i, :] = 0.0
                P[:, i] = 0.0
            _maximum(s, own, P, at, _ROUGH, value, Q)
            if _beyond(own, value):
                value[:], Q[:] = prior, own.covariance
            if contradicted:
                own.share[side] = 1.0
            elif s.last.predicted != 0.0:
                achieved = max(s.last.achieved / s.last.predicted, _LEAST_SHARE)
                share = own.share[side] * achieved**_SHARED
                own.share[side] = min(max(share, _LEAST_SHARE), LARGEST_SHARE)
            for i in range(VISCOUS, n):
                for j in range(VISCOUS, n):
                    Q[i, j] = own.covariance[i, j]
    if misfit <= _UNEXPLAINED:
        own.share[side] = 1.0
    ratio = s.last.predicted / s.last.achieved
    near = 1.0 / _MISSED < ratio < _MISSED
    longer = _NEAR_LONGER if near else _MISSED
    own.allowed = math.inf if misfit <= _UNEXPLAINED else longer * np.ceil(t / own.period - 0.5)
    if misfit <= _UNEXPLAINED or not own.taught:
        own.walk = max(own.walk * (0.1 + 0.9 * min(surprise, _SURPRISE)), _SLOWEST_WALK)
    own.values[:], own.covariance[:] = value, Q


@compiled()
def forget_held(own: Any) -> None:
    """Discard the efforts that did not free the axis: a mass that swings on it may have held it."""
    for side in range(2):
        own.held[side] = 0.0
        most = HIGHEST * math.exp(own.values[COULOMB + side])
        own.breakaway[side] = min(own.breakaway[side], most)
        own.moved_at[side] = max(own.moved_at[side], own.breakaway[side])


@compiled()
def freed_before(s: Any, own: Any) -> bool:
    """Return whether an effort no stronger than that of the last pulse has freed the mass."""
    side, f, _ = last_pulse(s, own)
    return own.moved_at[side] <= _GROWN * abs(f)


@compiled()
def learn(s: Any, own: Any) -> None:
    """Learn from the last pulse."""
    side, f, _ = last_pulse(s, own)
    strength = abs(f)
    if not s.last.moved or s.last.achieved * f < 0.0:  # at most another force has moved the axis
        if strength >= _STRONG * own.limit and own.more + 1.0 < WIDEST:
            own.more = (
                2.0 * own.more + 1.0
            )  # behind the lag of a drive a short effort does not act in full
            own.allowed = max(own.allowed, own.more + 1.0)
            if own.taught:
                return
        own.held[side] = strength
        if freed_before(s, own):  # it has grown since
            own.moved_at[side] = own.limit
        growth = STRONGER if s.idle <= _PATIENT else _BOLDER
        if (own.vibrates or own.taught) and s.idle <= 2 * _PATIENT:
            growth = _AGAIN
        next_try = min(0.5 * (strength + own.moved_at[side]), strength * growth)
        own.breakaway[side] = max(own.breakaway[side], next_try)
        return
    _fit(s, own)
    own.moved_at[side] = min(own.moved_at[side], strength)
    for each in range(2):
        most = HIGHEST * math.exp(own.values[COULOMB + each])
        if own.held[each] < most:
            own.breakaway[each] = min(own.breakaway[each], most)
    F = math.exp(own.values[COULOMB + side])
    if own.held[side] >= strength or own.held[side] < F:  # it has fallen since; or is at least F
        own.held[side] = min(F, strength)
    if own.breakaway[side] > own.moved_at[side]:
        own.breakaway[side] = 0.5 * (own.held[side] + own.moved_at[side])
    elif abs(s.error) > own.half_error and own.held[side] <= F:  # none has failed
        weaker = max(F, _WEAKER * own.breakaway[side])
        own.breakaway[side] = min(weaker, own.moved_at[side])
    own.breakaway[side] = max(own.breakaway[side], own.held[side])
