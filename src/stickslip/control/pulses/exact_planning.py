"""Choice of the next pulse by the exact law, and of the end.

At rest with an error e there are three cases.

One pulse takes the mass to the target: Eq. 3, inverted, gives the least width in whole samples for
which the effort stays within its limit, and the effort. As long as the friction is not known well
the pulse aims short, as it is cheaper to go on than to come back.

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

from stickslip.compiled import compiled
from stickslip.control.pulses.exact_learning import COULOMB, VISCOUS, slopes
from stickslip.control.pulses.kernel import add_level, fire, stop, whole_samples
from stickslip.planning.pulse_kernels import (
    effort_for,
    pulse_displacement,
    pulse_ends,
    width_for,
)

__all__ = ["EXHAUSTED", "HELD_FAST", "NO_BETTER", "plan"]

NO_BETTER, EXHAUSTED, HELD_FAST = 1, 2, 3  # reasons

_CAUTION = 2.0  # how much shorter a pulse aims when its displacement is uncertain
_SURE = 0.5  # of the way from the believed breakaway to an effort that has freed the mass
_HOPELESS = 4.0  # standard deviations over what would do: fewer than one try in five succeeds
_NEAR = 3.0  # times the best error so far
_DETOURS = 4  # most samples of a pulse back that is looked for
_SEEN = 4.0  # times the least displacement that the sensors tell from none
_ROOM = 1.2  # what a step back may fall short by and still be large enough


@compiled()
def _law(own: Any, side: int) -> tuple[float, float, float]:
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
    m, F, c = _law(own, side)
    d, by_m, by_f, by_c = slopes(m, F, c, f, t)
    variance = by_f * by_f * own.walk
    if not learned:
        rows = (by_m, by_f, by_c)
        places = (0, COULOMB + side, VISCOUS + side)
        for a in range(3):
            for b in range(3):
                P = own.covariance[places[a], places[b]]
                variance += rows[a] * P * rows[b]
    return math.sqrt(max(variance, 0.0)) / d


@compiled()
def _pulse(own: Any, side: int, d: float) -> tuple[float, float]:
    """Return effort and whole samples of the shortest pulse that moves the mass by d.

    If that takes more than the longest pulse it is the longest one, at the effort limit.
    """
    m, F, c = _law(own, side)
    if own.limit <= F:  # as far as is known nothing moves: try
        return own.limit, 1.0
    n = whole_samples(width_for(m, F, c, d, own.limit), own.period)
    longest = min(own.longest, own.allowed)
    if n > longest:
        return own.limit, longest
    return min(effort_for(m, F, c, d, n * own.period), own.limit), n


@compiled()
def _sure(own: Any, side: int) -> float:
    """Return an effort that frees the mass by all that is known."""
    f = own.breakaway[side] + _SURE * (own.moved_at[side] - own.breakaway[side])
    return min(f, own.limit)


@compiled()
def _short(own: Any, side: int, d: float) -> tuple[float, float]:
    """Return a pulse that frees the mass by all that is known and takes it by d, or farther."""
    m, F, c = _law(own, side)
    f = _sure(own, side)
    n = whole_samples(width_for(m, F, c, d, f), own.period) if f > F else 1.0
    return f, min(n, own.longest, own.allowed)


@compiled()
def _beyond(own: Any, side: int, error: float) -> tuple[float, float, float]:
    """Return a pulse beyond the target, by what a pulse back can make good, and what that leaves.

    Where breakaway and effort limit are near each other, the displacements that n samples can cause
    leave gaps to those of n + 1: the least n for the way back is taken with which the pulse there
    leads to none. Returns effort, whole samples, and the standard deviation at the end.
    """
    back = 1 - side
    m, F, c = _law(own, side)
    m_back, F_back, c_back = _law(own, back)
    f_there, f_back = _sure(own, side), _sure(own, back)
    f, n, spread = f_there, 1.0, 0.0
    for n_back in range(1, _DETOURS + 1):
        if f_back <= F_back or f_there <= F:  # not known yet: try
            break
        t = n_back * own.period
        least = pulse_displacement(m_back, F_back, c_back, f_back, t)
        most = pulse_displacement(m_back, F_back, c_back, own.limit, t)
        f, n = _pulse(own, side, error + min(_ROOM * least, 0.5 * (least + most)))
        f = max(f, f_there)
        step = pulse_displacement(m, F, c, f, n * own.period) - error
        spread = _spread(own, back, f_back, t, True) * step
        if least <= step <= most:
            break
    return f, n, math.sqrt(spread * spread + 2.0 * own.rest_noise**2)


@compiled()
def _shoot(s: Any, own: Any, side: int, f: float, n: float) -> None:
    """Fire a pulse, which ends where the axis has gone as far as the effort was to take it.

    As the effort does on its way what the friction does on the whole of it, an axis that is lighter
    than believed comes to rest no farther for that.
    """
    m, F, c = _law(own, side)
    way = 1.0 if side == 0 else -1.0
    if f > F:
        under_effort, _, _, d = pulse_ends(m, F, c, f, n * own.period)
        fire(s, way * d)
        s.reach = under_effort + s.spread
    else:
        fire(s, 0.0)
        s.reach = s.spread
    add_level(s, way * f, n)


@compiled()
def _give_up(s: Any, own: Any, reason: int) -> None:
    own.reason = reason
    stop(s)


@compiled()
def plan(s: Any, own: Any) -> None:
    """Fire the pulse for ``s.error``, or stop."""
    error = abs(s.error)
    if not s.fresh:  # a new task, or pushed away
        own.best = own.goal = math.inf
    own.best = min(own.best, error)
    if error <= own.goal:
        own.goal, own.fruitless = 0.5 * error, 0
    else:
        own.fruitless += 1
    side = 0 if s.error > 0.0 else 1
    T = own.period
    f, n = _pulse(own, side, error)
    if f > _law(own, side)[1]:
        uncertain = _CAUTION * _spread(own, side, f, n * T, False)
        short = error / (1.0 + uncertain * uncertain)
        short_f, short_n = _pulse(own, side, short)
        if short_f >= own.breakaway[side]:
            f, n = short_f, short_n
        elif uncertain > 1.0 and n > 1.0:
            f, n = _short(own, side, max(short, _SEEN * s.least_motion))
    direct = f >= own.breakaway[side]
    # Rather where it has come near than where it was only to come back from
    allowed = own.max_idle_pulses * (1.0 if error <= _NEAR * own.best else 2.0 if direct else 1.5)
    if own.fruitless >= allowed:
        _give_up(s, own, HELD_FAST if s.idle >= own.fruitless else EXHAUSTED)
        return
    if direct:
        _shoot(s, own, side, f, n)
        return
    f, n, left = _beyond(own, side, error)
    if left > _HOPELESS * max(s.tolerance, 0.5 * error):
        _give_up(s, own, NO_BETTER)
        return
    _shoot(s, own, side, f, n)
