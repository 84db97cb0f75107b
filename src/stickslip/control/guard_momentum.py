"""Momentum of a guarded axis whose sensors show no motion: it stands, or they are frozen."""

from typing import Any

import numpy as np

from stickslip.compiled import compiled

CREEPS = 0.005  # of the speed limit: a velocity sensor may have such an offset at rest
HELD = 0.75  # of the effort limit: friction certainly holds no more
_LEAST_FRICTION = 0.1  # of the effort limit: it slows an axis that moves
_STOPPED_AT_ONCE = 3.0  # times the effort limit: what effort, friction and load stop in a sample
FAST, LESS = 1, 2  # of `moved_fast`: the momentum as measured, and less its error; 0 is neither
_STANDS = 20  # samples without motion under an effort


@compiled(inline=True)
def momentum_error(g: Any) -> float:
    """Return the error of a momentum that is measured."""
    return g.mass[0] * 2.0 * (g.velocity_resolution + g.resolution / g.period)


@compiled(inline=True)
def _stands(g: Any) -> bool:
    """Return whether the sensors of the driven mass show no motion, in the last bit."""
    return g.alike[0] > 0 and abs(g.v) <= CREEPS * g.speed + g.velocity_resolution


@compiled()
def momentum_after(g: Any, u: float) -> float:
    """Return the momentum after a sample under an effort.

    An axis whose sensors show no motion goes on if it was seen to move faster than it can stop in a
    sample, slowed by little friction, until it has stopped. An axis at rest is moved by the part of
    the effort above 0.75 of the limit; a lower one does not keep up its momentum.
    """
    if g.fault != 0 or not _stands(g):
        return g.momentum + u * g.period
    if g.moved_fast > 0 and g.momentum != 0.0:
        along = np.copysign(u, u * g.momentum)
        left = abs(g.momentum) + (along - _LEAST_FRICTION * g.effort_limit) * g.period
        if left <= 0.0:
            g.moved_fast = 0
        return np.copysign(max(left, 0.0), g.momentum)
    excess = max(abs(u) - HELD * g.effort_limit, 0.0)
    return g.momentum + np.copysign(excess, u) * g.period if excess > 0.0 else 0.0


@compiled()
def stands_too_long(g: Any, v: float, v2: float, dt: float) -> bool:
    """Return whether an axis should have moved since the last sample that was new.

    Its momentum m v + m_2 v_2 is taken from each new sample, and would have moved it by the
    integral of momentum over mass. That of a second mass may return through the spring, and that
    after a glitch is to the other side. The sample follows the last admitted one by the time dt.
    """
    whole, before = g.mass[0] + g.mass[1], g.momentum
    if g.alike[0] == 0:
        g.momentum = g.mass[0] * v + g.mass[1] * (v2 if np.isfinite(v2) else v)
        least = momentum_error(g) + _STOPPED_AT_ONCE * g.effort_limit * max(dt, g.period)
        fast = abs(g.momentum) > least and before * g.momentum > 0.0 and abs(before) > 0.5 * least
        g.missed, g.moved_fast = 0.0, FAST if fast and g.mass[1] == 0.0 else 0
    elif _stands(g) and whole > 0.0:
        if g.moved_fast == FAST:
            left = max(abs(g.momentum) - momentum_error(g), 0.0)
            g.momentum, g.moved_fast = np.copysign(left, g.momentum), LESS
        g.missed += g.momentum / whole * g.period
        return g.alike[0] >= _STANDS and abs(g.missed) > g.stall
    return False
