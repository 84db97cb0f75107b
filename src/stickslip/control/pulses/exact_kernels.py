"""Kernels of the exact pulse controller: what it learns from a pulse, and its choice of the next.

**Learning.** The parameters are the logarithms of mass, Coulomb friction (offset included) and
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
at least as strong, one that did not is weaker. As long as none has failed, the breakaway is taken
to be at most twice the Coulomb friction: to try in vain costs a sample, never to try costs detours.

**Choice.** At rest with an error e there are three cases.

One pulse takes the mass to the target: Eq. 3, inverted, gives the least width in whole samples for
which the effort stays within its limit, and the effort. As long as the friction is not known well
the pulse falls short on purpose, as it is cheaper to go on than to come back.

The error is so small that this effort might not free the mass (Eq. 24): the pulse then takes it
beyond the target, by as much as a pulse back certainly can.

No pulse improves: the spread of a pulse back, from what friction changes from pulse to pulse and
from the sensors' noise, is several times what would help, or the last pulses have not halved the
error, or have not even freed the mass. Then none is fired. As an error can only be halved so often
until it is below the resolution of the sensors, and at most twice ``max_idle_pulses`` go by
between, the number of pulses is bounded, however the axis answers them: there is no limit cycle.
Only what moves the axis without a pulse begins a new task.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulses.kernel import OWN, add_level, fire, stop, whole_samples
from stickslip.numerics.named_fields import fields_at
from stickslip.planning.pulse_kernels import (
    behind_lag,
    lagging_displacement,
    lagging_effort_for,
    peak_behind_lag,
    position_along,
    pulse_ends,
    width_for,
)

PARAMETERS = 5  # logarithms of m, F+, F-, c+, c-
COULOMB, VISCOUS = 1, 3  # of the positive direction; that of the negative follows
NO_BETTER, EXHAUSTED, HELD_FAST = 1, 2, 3  # reasons to stop

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
        ("breakaway", "f8", (2,)),  # estimated, for each direction
        ("held", "f8", (2,)),  # strongest effort that did not free the mass, or Coulomb friction
        ("moved_at", "f8", (2,)),  # weakest effort that freed it
        ("best", "f8"),  # smallest error at rest so far
        ("half_error", "f8"),  # half of what the error was when it was last halved
        ("fruitless", "i8"),  # pulses since then
        ("reason", "i8"),  # why no pulse is fired any more
        ("more", "f8"),  # samples of the shortest pulse beyond one, where shorter ones free nothing
        ("share", "f8", (2,)),  # achieved over predicted displacement, where the law fails
        ("lag", "f8"),  # of the effort behind the command
        ("taught", "i8"),  # 1 if something else than pulses has taught it
        ("vibrates", "i8"),  # 1 if what swings on the axis may hold it, or free it
        ("by_moves", "f8", (PARAMETERS,)),  # values after the last move that the law explains
        ("allowed", "f8"),  # most samples of the next pulse
        ("values", "f8", (PARAMETERS,)),
        ("covariance", "f8", (PARAMETERS, PARAMETERS)),
    ]
)
own_fields = fields_at(OWN_DTYPE, start=OWN)

# Learning
_ITERATIONS = 30
_COOLING = 0.1  # of the variance by which the observation is inflated, from iteration to iteration
_CONVERGED = 1e-7  # change of a logarithm
_STRONGEST = 0.98  # of the effort: the Coulomb friction of a mass that it has moved
_LONGEST_STEP = 0.5  # of a logarithm in one iteration
_UNEXPLAINED = 9.0  # mean square of the normalised residuals beyond which a prior is widened
_WIDENING, _WIDENINGS = 100.0, 4  # of its variance, and so often at most
_ROUNDED = 1e-12  # of a variance: none
_SMALL = 0.1  # of the Coulomb friction: viscous friction that hardly counts
_HEAVIER, _STICKIER = 1.5, 10.0  # factors of mass and friction from those that a move has taught
_LEAST_SHARE, _SHARED = 0.5, 0.7  # least share, and the part of a deviation that it takes over
_MISSED = 2.0  # factor between predicted and achieved displacement; of the next pulse's width then
_NEAR_LONGER = 10.0  # of the next pulse's width where the law does not hold but gives the direction
_EXPLAINED = 0.5  # of that mean square is left, or less, where it is right to widen the prior
_FARTHEST = 5.0  # standard deviations that a short pulse may move what moves have taught
_DIFFERENCE = 1e-6  # of a logarithm, for slopes
_FINEST = 1e-4  # of the displacement: no axis follows the law more closely
_ROUGH = 0.05  # of displacement and friction, of an axis that does not follow the law along the way
_ALONG_LAG = 0.02  # of the displacement: the pulse that stands for a lagging one, on the way
_SURPRISE = 25.0  # most that one pulse counts for, as a multiple of the variance expected
HIGHEST = 2.0  # breakaway over Coulomb friction, where no pulse has failed
_FREES = 0.9  # of the effort limit: it moves any axis that is not blocked
_CLEARLY = 10.0  # times the least displacement that the sensors distinguish from none
_STUCK = 3  # pulses in a row that do not free an axis, which a move has moved before: it is blocked
_GROWN = 1.02  # times an effort that did not free the mass: a lower limit from before is outdated
_STRONGER = 1.5  # times an effort that did not free the mass: the next
_AGAIN = 1.05  # likewise on an axis that vibrates: rather the same again
_STRONG = 0.7  # of the effort limit: longer pulses follow, not stronger ones
_WIDEST = 4.0  # samples, at which the fewest samples of a pulse end
_LATER = 16  # most samples by which a lag makes a pulse longer
_PATIENT, _BOLDER = 4, 3.0  # as many may fail; then the first guess is wrong by more than that
_CLEAR = 4.0  # standard deviations of a position
_MOVING = 8  # samples in motion that can contradict a prior of mass and friction
_SLOWEST_WALK = 1e-10  # variance: what the estimates forget even where friction repeats exactly
# Choice
_CAUTION = 2.0  # standard deviations by which a pulse falls short when it is uncertain
_SURE = 0.5  # between the estimated breakaway and an effort that has freed the mass
_LONGEST_REST = 10.0  # windows
_HOPELESS = 4.0  # standard deviations over what would do: fewer than one try in five succeeds
_NEAR = 3.0  # times the best error so far
_DETOURS = 4  # most samples of a pulse back that is looked for
_SEEN = 4.0  # times the least displacement that the sensors distinguish from none
_ROOM = 1.2  # what a step back may fall short by and still be large enough

Vector = Float[np.ndarray, " s"]
Matrix = Float[np.ndarray, "p p"]


@compiled()
def _slopes(
    m: float, F: float, c: float, f: float, t: float, lag: float
) -> tuple[float, float, float, float]:
    """Return the displacement from rest to rest and its slopes by log m, log F and log c."""
    up = 1.0 + _DIFFERENCE
    d = lagging_displacement(m, F, c, f, t, lag)
    by_m = lagging_displacement(m * up, F, c, f, t, lag)
    by_f = lagging_displacement(m, F * up, c, f, t, lag)
    by_c = lagging_displacement(m, F, c * up, f, t, lag)
    return d, (by_m - d) / _DIFFERENCE, (by_f - d) / _DIFFERENCE, (by_c - d) / _DIFFERENCE


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
def _last_pulse(s: Any, own: Any) -> tuple[int, float, float]:
    """Return the direction of the last pulse (0: positive), its effort and its width."""
    f = s.last.levels[0, 0]
    return 0 if f > 0.0 else 1, f, s.last.levels[0, 1] * own.period


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
    side, f, t = _last_pulse(s, own)
    value[:], Q[:] = own.values, P
    m = math.exp(at[0])
    F, c = math.exp(at[COULOMB + side]), math.exp(at[VISCOUS + side])
    sign = 1.0 if f > 0.0 else -1.0
    achieved = sign * s.last.achieved
    start = s.rest - s.last.achieved
    coarse = (max(_FINEST, rough) * achieved) ** 2
    on_way = (_ALONG_LAG * achieved) ** 2 if own.lag > 0.0 else 0.0
    count, total = (1 if rough > 0.0 else s.position_count), 0.0
    up, row = 1.0 + _DIFFERENCE, np.empty(4)
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
        row[1] = (position_along(m * up, F, c, u, w, tau, ends_m) - x) / _DIFFERENCE
        row[2] = (position_along(m, F * up, c, u_f, w_f, tau_f, ends_f) - x) / _DIFFERENCE
        row[3] = (position_along(m, F, c * up, u, w, tau, ends_c) - x) / _DIFFERENCE
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
    side, f, t = _last_pulse(s, own)
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
    side, f, t = _last_pulse(s, own)
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
    side, _, t = _last_pulse(s, own)
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
            for i in range(VISCOUS, n):  # one displacement cannot teach both kinds of friction
                P[i, :] = 0.0
                P[:, i] = 0.0
            _maximum(s, own, P, at, _ROUGH, value, Q)
            if _beyond(own, value):
                value[:], Q[:] = prior, own.covariance
            if s.last.predicted != 0.0:
                achieved = max(s.last.achieved / s.last.predicted, _LEAST_SHARE)
                share = own.share[side] * achieved**_SHARED
                own.share[side] = min(max(share, _LEAST_SHARE), 1.0 / _LEAST_SHARE)
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
def learn(s: Any, own: Any) -> None:
    """Learn from the last pulse."""
    side, f, _ = _last_pulse(s, own)
    strength = abs(f)
    if not s.last.moved:
        if strength >= _STRONG * own.limit and own.more + 1.0 < _WIDEST:
            own.more = (
                2.0 * own.more + 1.0
            )  # behind the lag of a drive a short effort does not act in full
            own.allowed = max(own.allowed, own.more + 1.0)
            if own.taught:
                return
        own.held[side] = strength
        if own.moved_at[side] <= _GROWN * strength:  # it has grown since
            own.moved_at[side] = own.limit
        growth = _STRONGER if s.idle <= _PATIENT else _BOLDER
        if own.vibrates and s.idle <= 2 * _PATIENT:
            growth = _AGAIN
        next_try = min(0.5 * (strength + own.moved_at[side]), strength * growth)
        own.breakaway[side] = max(own.breakaway[side], next_try)
        return
    if s.last.achieved * f < 0.0:  # another force has moved the axis
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
    own.breakaway[side] = max(own.breakaway[side], own.held[side])


@compiled()
def law_of(own: Any, side: int) -> tuple[float, float, float]:
    """Return the estimates of m, F and c in one direction."""
    return (
        math.exp(own.values[0]),
        math.exp(own.values[COULOMB + side]),
        math.exp(own.values[VISCOUS + side]),
    )


@compiled()
def _spread(own: Any, side: int, f: float, t: float, learned: bool) -> float:
    """Return the standard deviation of a pulse's displacement, relative to it.

    ``learned``: only what is left when all that can be learned is: the walk of the friction.
    """
    m, F, c = law_of(own, side)
    d, by_m, by_f, by_c = _slopes(m, F, c, f, t, own.lag)
    if d <= 0.0:  # frees nothing
        return 0.0
    variance = by_f * by_f * own.walk
    if not learned:
        rows = (by_m, by_f, by_c)
        places = (0, COULOMB + side, VISCOUS + side)
        for a in range(3):
            for b in range(3):
                variance += rows[a] * own.covariance[places[a], places[b]] * rows[b]
    return math.sqrt(max(variance, 0.0)) / d


@compiled()
def _reached(own: Any, m: float, F: float, c: float, n: float) -> float:
    """Return how far n samples of the largest effort take the mass; infinite without a lag.

    Without a lag the width in whole samples is known to suffice.
    """
    if own.lag <= 0.0:
        return math.inf
    return lagging_displacement(m, F, c, own.limit, n * own.period, own.lag)


@compiled()
def pulse_for(own: Any, side: int, d: float) -> tuple[float, float]:
    """Return effort and whole samples of the shortest pulse that moves the mass by d.

    If that takes more than the longest pulse it is the longest one, at the effort limit.
    """
    m, F, c = law_of(own, side)
    d /= own.share[side]
    if own.limit <= F:  # as far as is known nothing moves: try
        return own.limit, min(own.more + 1.0, own.longest)
    n = max(whole_samples(width_for(m, F, c, d, own.limit), own.period), own.more + 1.0)
    longest = max(min(own.longest, own.allowed), 1.0)
    for _ in range(_LATER):
        if n > longest or _reached(own, m, F, c, n) >= d:
            break
        n += 1.0
    if n > longest:
        return own.limit, longest
    return lagging_effort_for(m, F, c, d, n * own.period, own.lag, own.limit), n


@compiled()
def _freeing_effort(own: Any, side: int) -> float:
    """Return an effort that frees the mass by all that is known."""
    breakaway = own.breakaway[side]
    f = breakaway + _SURE * (own.moved_at[side] - breakaway)
    return min(f, _STRONGER * breakaway, own.limit)


@compiled()
def _freeing_pulse(own: Any, side: int, d: float) -> tuple[float, float]:
    """Return a pulse that frees the mass by all that is known and moves it by d, or farther."""
    m, F, c = law_of(own, side)
    f = _freeing_effort(own, side)
    d /= own.share[side]
    n = max(whole_samples(width_for(m, F, c, d, f), own.period) if f > F else 1.0, own.more + 1.0)
    return f, min(n, own.longest, own.allowed)


@compiled()
def _overshoot(own: Any, side: int, error: float) -> tuple[float, float, float]:
    """Return a pulse beyond the target, from where a pulse back can reach it.

    Where breakaway and effort limit are near each other, the displacements that n samples can cause
    leave gaps to those of n + 1: the least n for the pulse back is taken with which the first pulse
    leads to none. Returns effort, whole samples, and the standard deviation of the final error.
    """
    back = 1 - side
    m, F, c = law_of(own, side)
    m_back, F_back, c_back = law_of(own, back)
    f_there, f_back = _freeing_effort(own, side), _freeing_effort(own, back)
    least_n = min(own.more + 1.0, own.longest)
    f, n, spread = f_there, least_n, 0.0
    for n_back in range(_DETOURS):
        if f_back <= F_back or f_there <= F:  # not known yet: try
            break
        t = (n_back + least_n) * own.period
        least = lagging_displacement(m_back, F_back, c_back, f_back, t, own.lag) * own.share[back]
        most = lagging_displacement(m_back, F_back, c_back, own.limit, t, own.lag) * own.share[back]
        f, n = pulse_for(own, side, error + min(_ROOM * least, 0.5 * (least + most)))
        f = max(f, f_there)
        step = lagging_displacement(m, F, c, f, n * own.period, own.lag) * own.share[side] - error
        spread = _spread(own, back, f_back, t, True) * step
        if least <= step <= most:
            break
    return f, n, math.sqrt(spread * spread + 2.0 * own.rest_noise**2)


@compiled()
def _fire(s: Any, own: Any, side: int, f: float, n: float) -> None:
    """Fire a pulse, which ends where the axis has gone as far as the effort was to take it.

    By the balance of work (see `_estimate`), an axis that is lighter than estimated then comes to
    rest no farther.
    """
    m, F, c = law_of(own, side)
    sign = 1.0 if side == 0 else -1.0
    u, w, start = behind_lag(F, f, n * own.period, own.lag)
    if u > F:
        ends = pulse_ends(m, F, c, u, w)
        fire(s, sign * ends[3] * own.share[side])
        at_end = max(n * own.period - start, 0.0)
        under_effort = position_along(m, F, c, u, w, at_end, ends)
        s.reach = under_effort * max(own.share[side], 1.0) + s.spread
    else:
        fire(s, 0.0)
        s.reach = s.spread
    add_level(s, sign * f, n)


@compiled()
def give_up(s: Any, own: Any, reason: int) -> None:
    """Stop for a reason."""
    own.reason = reason
    stop(s)


@compiled()
def lengthen_rest(s: Any, own: Any) -> None:
    """Let a rest last so long that a motion which friction stops would be seen in it.

    Slowed by F/m alone, an axis goes F (n T)^2/(2 m) in the last n samples.
    """
    F = math.exp(min(own.values[COULOMB], own.values[COULOMB + 1]))
    n = math.sqrt(2.0 * s.spread * math.exp(own.values[0]) / F) / own.period
    s.calm_least = min(n, _LONGEST_REST * s.window) if n > s.window else 0.0


@compiled()
def _was_strong(s: Any, own: Any) -> bool:
    """Return whether the last pulse would have moved any axis clearly, behind any lag."""
    _, f, t = _last_pulse(s, own)
    if abs(s.last.predicted) < _CLEARLY * s.least_motion:
        return False
    return abs(f) >= _FREES * own.limit and t >= (_WIDEST - 0.5) * own.period


@compiled()
def plan(s: Any, own: Any) -> None:
    """Fire the pulse for ``s.error``, or stop."""
    lengthen_rest(s, own)
    error = abs(s.error)
    if not s.fresh:  # a new task, or moved from outside
        own.best = own.half_error = math.inf
    own.best = min(own.best, error)
    if error <= own.half_error:
        own.half_error, own.fruitless = 0.5 * error, 0
    else:
        own.fruitless += 1
    side = 0 if s.error > 0.0 else 1
    f, n = pulse_for(own, side, error)
    if f > law_of(own, side)[1]:
        uncertain = _CAUTION * _spread(own, side, f, n * own.period, False)
        short = error / (1.0 + uncertain * uncertain)
        short_f, short_n = pulse_for(own, side, short)
        if short_f >= own.breakaway[side]:
            f, n = short_f, short_n
        elif uncertain > 1.0 and n > 1.0:
            f, n = _freeing_pulse(own, side, max(short, _SEEN * s.least_motion))
    direct = f >= own.breakaway[side]
    # Rather where it has come near than where it was only to come back from
    allowed = own.max_idle_pulses * (1.0 if error <= _NEAR * own.best else 2.0 if direct else 1.5)
    if own.fruitless >= allowed:
        give_up(s, own, HELD_FAST if s.idle >= own.fruitless else EXHAUSTED)
        return
    if own.taught and not own.vibrates and s.idle >= _STUCK and _was_strong(s, own):
        give_up(s, own, HELD_FAST)
        return
    if not direct:
        f, n, spread = _overshoot(own, side, error)
        if spread > _HOPELESS * max(s.tolerance, 0.5 * error):
            give_up(s, own, NO_BETTER)
            return
    _fire(s, own, side, f, n)
