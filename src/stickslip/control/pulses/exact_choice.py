"""Kernels of the exact pulse controller: the choice of the next pulse.

At rest with an error e there are three cases.

One pulse takes the mass to the target: Eq. 3, inverted, gives the least width in whole samples for
which the effort stays within its limit, and the effort. As long as the friction is not known well
the pulse falls short on purpose, as it is cheaper to go on than to come back.

The error is so small that this effort might not free the mass (Eq. 24): the pulse then takes it
beyond the target, by as much as a pulse back certainly can. If that is many times the error, as
against a load with which a pulse back goes far, the weaker effort is tried, or the shortest pulse
that certainly frees the mass.

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
from stickslip.control.pulses.exact_state import (
    COULOMB,
    DIFFERENCE,
    EXHAUSTED,
    HELD_FAST,
    NO_BETTER,
    STRONGER,
    VISCOUS,
    WIDEST,
    last_pulse,
    law_of,
)
from stickslip.control.pulses.kernel import add_level, fire, stop, whole_samples
from stickslip.planning.pulse_kernels import (
    behind_lag,
    lagging_displacement,
    lagging_effort_for,
    position_along,
    pulse_ends,
    width_for,
)

_FREES = 0.9  # of the effort limit: it moves any axis that is not blocked
_CLEARLY = 10.0  # times the least displacement that the sensors distinguish from none
_STUCK = 3  # pulses in a row that do not free an axis, which a move has moved before: it is blocked
_LATER = 16  # most samples by which a lag makes a pulse longer
_CAUTION = 2.0  # standard deviations by which a pulse falls short when it is uncertain
_SURE = 0.5  # between the estimated breakaway and an effort that has freed the mass
_LONGEST_REST = 10.0  # windows
_HOPELESS = 4.0  # standard deviations over what would do: fewer than one try in five succeeds
_NEAR = 3.0  # times the best error so far
_DETOURS = 4  # most samples of a pulse back that is looked for
_DETOUR = 20.0  # times the error: rather than farther beyond the target, a weaker pulse is tried
_SEEN = 4.0  # times the least displacement that the sensors distinguish from none
_ROOM = 1.2  # what a step back may fall short by and still be large enough


@compiled()
def _slopes(
    m: float, F: float, c: float, f: float, t: float, lag: float
) -> tuple[float, float, float, float]:
    """Return the displacement from rest to rest and its slopes by log m, log F and log c."""
    up = 1.0 + DIFFERENCE
    d = lagging_displacement(m, F, c, f, t, lag)
    by_m = lagging_displacement(m * up, F, c, f, t, lag)
    by_f = lagging_displacement(m, F * up, c, f, t, lag)
    by_c = lagging_displacement(m, F, c * up, f, t, lag)
    return d, (by_m - d) / DIFFERENCE, (by_f - d) / DIFFERENCE, (by_c - d) / DIFFERENCE


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
    return min(f, STRONGER * breakaway, own.limit)


@compiled()
def _freeing_pulse(own: Any, side: int, d: float) -> tuple[float, float]:
    """Return a pulse that frees the mass by all that is known and moves it by d, or farther."""
    m, F, c = law_of(own, side)
    f = _freeing_effort(own, side)
    d /= own.share[side]
    n = max(whole_samples(width_for(m, F, c, d, f), own.period) if f > F else 1.0, own.more + 1.0)
    return f, min(n, own.longest, own.allowed)


@compiled()
def _overshoot(own: Any, side: int, error: float) -> tuple[float, float, float, float]:
    """Return a pulse beyond the target, from where a pulse back can reach it.

    Where breakaway and effort limit are near each other, the displacements that n samples can cause
    leave gaps to those of n + 1: the least n for the pulse back is taken with which the first pulse
    leads to none. Returns effort, whole samples, the standard deviation of the final error, and how
    far beyond the target the pulse leads.
    """
    back = 1 - side
    m, F, c = law_of(own, side)
    m_back, F_back, c_back = law_of(own, back)
    f_there, f_back = _freeing_effort(own, side), _freeing_effort(own, back)
    least_n = min(own.more + 1.0, own.longest)
    f, n, spread, step = f_there, least_n, 0.0, 0.0
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
    return f, n, math.sqrt(spread * spread + 2.0 * own.rest_noise**2), step


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
    _, f, t = last_pulse(s, own)
    if abs(s.last.predicted) < _CLEARLY * s.least_motion:
        return False
    return abs(f) >= _FREES * own.limit and t >= (WIDEST - 0.5) * own.period


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
        f_there, n_there, spread, step = _overshoot(own, side, error)
        if step <= _DETOUR * error:
            f, n = f_there, n_there
        elif f <= own.held[side]:  # does not free the axis
            f, n = _freeing_effort(own, side), min(own.more + 1.0, own.longest)
        if spread > _HOPELESS * max(s.tolerance, 0.5 * error):
            give_up(s, own, NO_BETTER)
            return
    _fire(s, own, side, f, n)
