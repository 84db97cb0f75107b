"""Which pulse the exact pulse controller fires, and when it fires none any more.

At rest with an error e there are three cases.

One pulse takes the mass to the target: Eq. 3, inverted, gives the least width in whole samples for
which the effort stays within its limit, and the effort. As long as the friction is not known well
the pulse aims short, as it is cheaper to go on than to come back.

The error is so small that this effort might not free the mass (Eq. 24): the pulse then takes it
beyond the target, by as much as a pulse back certainly can.

No pulse improves: the spread of a pulse back, from what friction changes from pulse to pulse and
from the sensors' noise, is several times what would help, or the last pulses have not halved the
error, or have not even freed the mass. Then none is fired. As an error can only be halved so often
until it is below what the sensors tell apart, and at most twice the patience goes by between, the
number of pulses is bounded, however the axis answers them: there is no limit cycle. Only what moves
the axis without a pulse begins a new task.
"""

import math

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.exact_pulse_learning import (
    ALLOWED,
    BEST,
    BREAKAWAY,
    COULOMB,
    COVARIANCE,
    FRUITLESS,
    GOAL,
    LIMIT,
    LONGEST,
    MOVED_AT,
    PARAMETERS,
    PATIENCE,
    PERIOD,
    REASON,
    REST_NOISE,
    VALUES,
    VISCOUS,
    WALK,
    slopes,
)
from stickslip.control.pulse_kernel import (
    ERROR,
    FRESH,
    IDLE,
    LEAST_MOTION,
    REACH,
    SPREAD,
    TOLERANCE,
    add_level,
    fire,
    stop,
    whole_samples,
)
from stickslip.planning.pulse_kernels import (
    effort_for,
    pulse_displacement,
    pulse_ends,
    width_for,
)

__all__ = ["EXHAUSTED", "HELD_FAST", "NO_BETTER", "plan"]

NO_BETTER, EXHAUSTED, HELD_FAST = 1.0, 2.0, 3.0  # values of REASON

_CAUTION = 2.0  # how much shorter a pulse aims when its displacement is uncertain
_SURE = 0.5  # of the way from the believed breakaway to an effort that has freed the mass
_HOPELESS = 4.0  # standard deviations over what would do: fewer than one try in five succeeds
_NEAR = 3.0  # times the best error so far
_DETOURS = 4  # most samples of a pulse back that is looked for
_SEEN = 4.0  # times the least displacement that the sensors tell from none
_ROOM = 1.2  # what a step back may fall short by and still be large enough

Vector = Float[np.ndarray, " s"]


@compiled()
def _law(s: Vector, side: int) -> tuple[float, float, float]:
    """Return the estimates of m, F and c in one direction."""
    return (
        math.exp(s[VALUES]),
        math.exp(s[VALUES + COULOMB + side]),
        math.exp(s[VALUES + VISCOUS + side]),
    )


@compiled()
def _spread(s: Vector, side: int, f: float, t: float, learned: bool) -> float:
    """Return the standard deviation of a pulse's displacement, relative to it.

    ``learned``: only what is left when all that can be learned is: the walk of the friction.
    """
    m, F, c = _law(s, side)
    d, by_m, by_f, by_c = slopes(m, F, c, f, t)
    variance = by_f * by_f * s[WALK]
    if not learned:
        rows = (by_m, by_f, by_c)
        places = (0, COULOMB + side, VISCOUS + side)
        for a in range(3):
            for b in range(3):
                P = s[COVARIANCE + PARAMETERS * places[a] + places[b]]
                variance += rows[a] * P * rows[b]
    return math.sqrt(max(variance, 0.0)) / d


@compiled()
def _pulse(s: Vector, side: int, d: float) -> tuple[float, float]:
    """Return effort and whole samples of the shortest pulse that moves the mass by d.

    If that takes more than the longest pulse it is the longest one, at the effort limit.
    """
    m, F, c = _law(s, side)
    if s[LIMIT] <= F:  # as far as is known nothing moves: try
        return s[LIMIT], 1.0
    n = whole_samples(width_for(m, F, c, d, s[LIMIT]), s[PERIOD])
    longest = min(s[LONGEST], s[ALLOWED])
    if n > longest:
        return s[LIMIT], longest
    return min(effort_for(m, F, c, d, n * s[PERIOD]), s[LIMIT]), n


@compiled()
def _sure(s: Vector, side: int) -> float:
    """Return an effort that frees the mass as far as can be told."""
    f = s[BREAKAWAY + side] + _SURE * (s[MOVED_AT + side] - s[BREAKAWAY + side])
    return min(f, s[LIMIT])


@compiled()
def _short(s: Vector, side: int, d: float) -> tuple[float, float]:
    """Return a pulse that frees the mass as far as can be told and takes it by d, or farther."""
    m, F, c = _law(s, side)
    f = _sure(s, side)
    n = whole_samples(width_for(m, F, c, d, f), s[PERIOD]) if f > F else 1.0
    return f, min(n, s[LONGEST], s[ALLOWED])


@compiled()
def _beyond(s: Vector, side: int, error: float) -> tuple[float, float, float]:
    """Return a pulse beyond the target, by what a pulse back can make good, and what that leaves.

    Where breakaway and effort limit are near each other, the displacements that n samples can cause
    leave gaps to those of n + 1: the least n for the way back is taken with which the pulse there
    leads to none. Returns effort, whole samples, and the standard deviation at the end.
    """
    back = 1 - side
    m, F, c = _law(s, side)
    m_back, F_back, c_back = _law(s, back)
    f_there, f_back = _sure(s, side), _sure(s, back)
    f, n, spread = f_there, 1.0, 0.0
    for n_back in range(1, _DETOURS + 1):
        if f_back <= F_back or f_there <= F:  # not known yet: try
            break
        t = n_back * s[PERIOD]
        least = pulse_displacement(m_back, F_back, c_back, f_back, t)
        most = pulse_displacement(m_back, F_back, c_back, s[LIMIT], t)
        f, n = _pulse(s, side, error + min(_ROOM * least, 0.5 * (least + most)))
        f = max(f, f_there)
        step = pulse_displacement(m, F, c, f, n * s[PERIOD]) - error
        spread = _spread(s, back, f_back, t, True) * step
        if least <= step <= most:
            break
    return f, n, math.sqrt(spread * spread + 2.0 * s[REST_NOISE] ** 2)


@compiled()
def _shoot(s: Vector, side: int, f: float, n: float) -> None:
    """Fire a pulse, which ends where the axis has gone as far as the effort was to take it.

    As the effort does on its way what the friction does on the whole of it, an axis that is lighter
    than believed comes to rest no farther for that.
    """
    m, F, c = _law(s, side)
    way = 1.0 if side == 0 else -1.0
    if f > F:
        under_effort, _, _, d = pulse_ends(m, F, c, f, n * s[PERIOD])
        fire(s, way * d)
        s[REACH] = under_effort + s[SPREAD]
    else:
        fire(s, 0.0)
        s[REACH] = s[SPREAD]
    add_level(s, way * f, n)


@compiled()
def _give_up(s: Vector, reason: float) -> None:
    s[REASON] = reason
    stop(s)


@compiled()
def plan(s: Vector) -> None:
    """Fire the pulse for ``s[ERROR]``, or stop."""
    error = abs(s[ERROR])
    if s[FRESH] == 0.0:  # a new task, or pushed away
        s[BEST] = s[GOAL] = math.inf
    s[BEST] = min(s[BEST], error)
    if error <= s[GOAL]:
        s[GOAL], s[FRUITLESS] = 0.5 * error, 0.0
    else:
        s[FRUITLESS] += 1.0
    side = 0 if s[ERROR] > 0.0 else 1
    T = s[PERIOD]
    f, n = _pulse(s, side, error)
    if f > _law(s, side)[1]:
        uncertain = _CAUTION * _spread(s, side, f, n * T, False)
        short = error / (1.0 + uncertain * uncertain)
        short_f, short_n = _pulse(s, side, short)
        if short_f >= s[BREAKAWAY + side]:
            f, n = short_f, short_n
        elif uncertain > 1.0 and n > 1.0:
            f, n = _short(s, side, max(short, _SEEN * s[LEAST_MOTION]))
    direct = f >= s[BREAKAWAY + side]
    # Rather where it has come near than where it was only to come back from
    patience = s[PATIENCE] * (1.0 if error <= _NEAR * s[BEST] else 2.0 if direct else 1.5)
    if s[FRUITLESS] >= patience:
        _give_up(s, HELD_FAST if s[IDLE] >= s[FRUITLESS] else EXHAUSTED)
        return
    if direct:
        _shoot(s, side, f, n)
        return
    f, n, left = _beyond(s, side, error)
    if left > _HOPELESS * max(s[TOLERANCE], 0.5 * error):
        _give_up(s, NO_BETTER)
        return
    _shoot(s, side, f, n)
