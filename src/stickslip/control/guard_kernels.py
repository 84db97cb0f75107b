"""Kernels of the guard: which samples are admitted, and which effort is released.

Times and values of samples are NaN or at most 1e12 in magnitude: products of them are finite.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.guard_momentum import (
    CREEPS,
    HELD,
    momentum_after,
    momentum_error,
    stands_too_long,
)
from stickslip.numerics.named_fields import fields_at, places

# Faults; 0 is none
LOST, TRAVEL, SPEED, TIME, JUMP, FROZEN, BLOCKED, LOAD, FAILED, SIGN = range(1, 11)
HOLD, ZERO, BRAKE = range(3)  # reactions to a lost sample

STATE = np.dtype(
    [
        # Settings
        ("period", "f8"),  # sampling time
        ("effort_limit", "f8"),
        ("low", "f8"),  # travel
        ("high", "f8"),
        ("speed", "f8"),
        ("acceleration", "f8"),  # largest that any force causes
        ("braking", "f8"),  # deceleration that braking certainly reaches
        ("gain", "f8"),  # effort of braking over speed
        ("time_limit", "f8"),  # of a move
        ("reaction", "i8"),
        ("max_lost", "i8"),
        ("resolution", "f8"),  # largest error of a position, of a velocity
        ("velocity_resolution", "f8"),
        ("same_limit", "i8"),  # equal positions of a frozen sensor; 0 for no limit
        ("gravity", "i8"),  # 1 if acceleration without effort is a fault
        ("needed", "i8", (4,)),  # channels
        ("mass", "f8", (2,)),  # driven, and behind a spring
        ("stall", "f8"),  # distance that a free axis would have moved, of one that stands still
        # What changes
        ("fault", "i8"),
        ("samples", "i8"),  # admitted so far
        ("time", "f8"),  # of the last admitted sample
        ("x", "f8"),
        ("v", "f8"),
        ("begun", "f8"),  # time of the first sample of the move
        ("started", "i8"),  # 1 from that sample on
        ("lost", "i8"),  # samples in a row
        ("lost_total", "i8"),
        ("stuck", "i8"),  # of them, those of a moving axis in the same position, in the last bit
        ("halted", "i8"),  # 1 if the first of them showed an axis that was slower than possible
        ("rejected", "f8"),  # position of the last of them that no force explains; NaN for none
        ("missing", "i8", (4,)),  # channels of the last lost sample
        ("mismatch", "f8"),  # of position and velocity, with a memory of some ten samples
        ("same", "i8"),  # equal positions in a row
        ("seen", "f8", (2, 2)),  # last position and velocity of each mass
        ("alike", "i8", (2,)),  # samples in a row in which both have not changed in the last bit
        ("momentum", "f8"),  # of both masses, estimated from the last sample that was new
        # FAST or LESS while it is that of an axis that was seen to move fast
        ("moved_fast", "i8"),
        ("missed", "f8"),  # distance that an axis with it would have moved since
        ("fast", "i8"),  # samples in a row above the speed limit
        ("sure_speed", "f8"),  # speed at the last sample, less its error, at least 0
        ("above", "i8"),  # samples in a row from which the axis cannot stop within the travel
        ("below", "i8"),
        ("effort", "f8"),  # last one sent
        ("follows", "i8"),  # 1 once the axis has moved by a strong effort, along it
        ("driven", "i8"),  # samples after the first strong effort to one side, before that
        ("driven_x", "f8"),  # position at the first of them
        ("driven_by", "f8"),  # that effort
        ("wait", "i8"),  # samples that may show what an effort to the other side has done
        ("strong", "i8"),  # strong samples to one side less weak ones; `_ALIKE` before the first
        ("weak", "i8"),  # weak ones in a row
        ("turning", "f8"),  # change of position in a sample, over the last clear way against it
        ("pushing", "i8"),  # samples in a row with nearly the largest effort and no motion
        ("pushing_from", "f8"),
        ("unanswered", "i8"),  # samples in a row to which the controller gave no effort
        ("idle", "i8"),  # samples in a row at rest without effort
        ("free", "i8"),  # samples in a row without effort in which the speed has not fallen
        ("free_x", "f8"),  # position at the first of them
        ("half", "i8"),  # samples from there to the middle of those that are compared
        ("half_x", "f8"),  # position in the middle
        ("turns", "i8"),  # changes of the sign of the effort that brakes
        ("brake", "f8"),  # last one
        ("anchored", "i8"),  # 1 while it leads the axis to rest
        ("anchor", "f8"),  # planned position
        ("pace", "f8"),  # planned velocity
        ("slowing", "f8"),  # planned deceleration
        ("braked_v", "f8"),  # velocity in the last sample of braking
        ("impulse", "f8"),  # of the efforts since then
        ("efforts_time", "f8"),  # for which these act, whatever the time stamps are
        ("against", "i8"),  # samples in which braking makes the axis faster
        ("hold", "f8"),  # effort that takes the load at rest
        ("quiet", "i8"),  # samples at rest while braking
        ("quiet_x", "f8"),  # position at the first of them
        ("kept", "i8"),  # 1 if the axis moved after it was let go, and is held
        ("released", "i8"),  # 1 if the effort is 0 after braking
    ]
)
"""State of the guard."""

fields = fields_at(STATE)
SIZE = places(STATE)

TIME_CONSTANT = 4.0  # of braking, in samples
EARLIEST, _LATEST = 0.25, 20.0  # samples: a shorter or longer step of time is wrong
_FAST, _OUTSIDE = 3, 2  # samples above the speed limit, beyond the travel
_UNSEEN = 1.5  # times the braking, where mass 2 is not seen: mass 1 is faster than both on average
_MEMORY = 0.9  # of the mismatch
_FREE_SAMPLES, _FREE_TIME = 25, 0.2  # samples and time [s] of acceleration without effort
_FALLS = 0.1  # of a stall, or of the travel
_CONSTANT = 1e3  # errors of a way: over so long a way the speed of an axis with friction falls
_IDLE = 25  # samples at rest without effort that end a move
_BLOCKED_SAMPLES, _BLOCKED_TIME = 100, 0.5  # samples and time [s] of a push without motion
_NEARLY = 0.98  # of the effort limit
_RESTED, _QUIET = 5, 20  # samples at rest: swings have ended; the brake is released
_SLOW = 2.0  # samples of braking: an axis so slow has stopped
_STOP = 8.0  # samples: braking takes so long where travel and effort allow it
_PLANNED = 0.9  # of the effort limit: the strongest braking
_LEARNS = 0.1  # of what is wrong of the load is corrected in a sample
_GROWS = 0.001  # of the effort limit, in a sample: effort on an axis that rests outside its travel
_TURNS, _SLOWER, _SLOWEST = 6, 0.5, 32.0  # changes of sign, after which each makes it slower
_STEADIEST = 8.0  # times slower at most by the noise of a velocity sensor, which has a mean of 0
_FORGETS = 0.5  # of the load stays at such a change of sign
_NOISE, _CLEARLY = 0.2, 0.1  # of the effort limit: that of an error of the speed; one that brakes
_DRIVES = 0.6  # of the effort limit: a strong effort
_CLEAR, _FASTER = 2.0, 1.1  # resolutions: a way; speed over the next one, if the axis accelerates
_REVERSED = 0.25  # of effort over mass: acceleration to the wrong side, more than by most loads
_AGAINST = 10  # samples, more than a delay: braking that makes an axis faster
_FILTERED = 6.0  # times the way of the largest acceleration: a filtered velocity may be so late
_MOVES = 5e-3  # of the travel: an axis let go is moved by more than bristles that spring back
_WIDE = 4.0  # resolutions: errors of two positions, and of the speed from them
_STUCK = 5  # samples for which a moving axis was in the same position: it has not stopped there
_STILL = 2  # samples at rest without effort: the speed at the end is 0
_AS_FAR = 0.25  # of its distance from a rest: positions so close together are the same glitch
_OFF = 4  # lost samples in a row, from which on it is taken for the position
_ALIKE = 8  # samples: a slow sensor may repeat some
_SLOWS = 0.9  # of the mean speed of a time: a lower one at its end shows no load
_STILL_SHARE = 0.25  # of what an effort adds to the speed in a sample: it moves what stands less


@compiled()
def _lose(g: Any, fault: int) -> bool:
    g.lost += 1
    g.lost_total += 1
    if g.lost > g.max_lost and g.fault == 0:
        g.fault = fault
    return False


@compiled()
def _halt(g: Any) -> bool:
    """Lose a sample of an axis that is slower than any effort explains; one of many is true."""
    g.halted = 1
    _lose(g, BLOCKED)
    if g.fault == BLOCKED:  # begin anew, to brake
        g.samples, g.moved_fast, g.momentum = 0, 0, 0.0
    return False


@compiled()
def _falls(g: Any, x: float, v: float, rests: bool) -> bool:
    """Return whether the axis accelerates without effort, where friction can only slow it.

    The ways d_1 and d_2 of two equal times, whose length is doubled as long as the errors of the
    positions leave it open, differ by the acceleration times the square of that time.
    """
    if g.effort != 0.0 or g.free == 0 or rests or v * (x - g.free_x) < 0.0:
        g.free, g.free_x = (1 if g.effort == 0.0 else 0), x
        g.half, g.half_x = 1, x
        return False
    g.free += 1
    if g.free - 1 < 2 * g.half:
        return False
    d_1, d_2 = abs(g.half_x - g.free_x), abs(x - g.half_x)
    error = _WIDE * g.resolution
    long = g.free > max(_FREE_SAMPLES, _FREE_TIME / g.period)
    if d_1 > d_2 + error:
        g.free, g.free_x, g.half, g.half_x = 1, x, 1, x
        return False
    last = (abs(v) + g.velocity_resolution) * g.half * g.period  # in such a time, as fast as now
    g.half, g.half_x = g.free - 1, x
    constant = d_1 + d_2 > _CONSTANT * error
    # Bristles spring back by less, or become slower at the end
    far = d_1 + d_2 > _FALLS * min(g.stall, g.high - g.low)
    fast = last > _SLOWS * d_2 - error
    return long and far and fast and g.gravity == 1 and (d_2 > d_1 + error or constant)


@compiled()
def _turns_away(g: Any, x: float) -> bool:
    """Return whether the first strong effort to one side accelerates the axis to the other.

    Two mean speeds are compared, over times so long that such an acceleration exceeds the likely
    error of a position, and after so many strong samples that the effort has acted all the time,
    behind a delay as well. The first strong effort begins at rest, and needs none before. A load
    that a strong effort has held may move the axis in a weak one: no motion is judged there, and
    after two in a row they are counted anew.
    """
    strong = abs(g.effort) >= _DRIVES * g.effort_limit
    if g.follows == 1 or not (strong or g.driven_by != 0.0):
        return False
    if strong and g.effort * g.driven_by <= 0.0:
        # Behind a delay the axis goes on by the effort before
        g.wait, g.strong = (0, _ALIKE) if g.driven_by == 0.0 else (_ALIKE, 0)
        g.driven_by = g.effort
        g.driven, g.turning, g.driven_x = 0, 0.0, x
    g.strong = min(g.strong + 1, 2 * _ALIKE) if strong else max(g.strong - 1, 0)
    g.weak = 0 if strong else g.weak + 1
    if g.weak > 1:
        g.strong, g.driven, g.turning, g.driven_x = 0, 0, 0.0, x
        return False
    if g.wait > 0:
        g.wait -= 1
        g.driven_x = x
        return False
    g.driven += 1
    way, error = np.copysign(1.0, g.driven_by) * (x - g.driven_x), _CLEAR * g.resolution
    g.follows = 1 if way > error else 0
    known = g.mass[0] > 0.0
    gained = _REVERSED * abs(g.effort) * g.period * g.period * g.driven
    gained = gained / (g.mass[0] + g.mass[1]) if known else 0.0
    if not strong or way >= -error or (known and gained * g.driven < g.resolution):
        return False
    pace, acted = way / g.driven, g.strong >= g.driven + _ALIKE
    gained += g.resolution / g.driven if known else 0.0
    faster = pace < _FASTER * g.turning < 0.0 and g.turning - pace > gained
    g.turning, g.driven, g.driven_x = (pace if acted else 0.0), 0, x
    return acted and faster


@compiled()
def _watch(g: Any, x: float, v: float, v2: float) -> None:
    """Compare an admitted sample with the limits."""
    T, limit = g.period, g.effort_limit
    # Speed and travel: the axis must be able to stop before the limit
    g.fast = g.fast + 1 if abs(v) > g.speed + g.velocity_resolution + g.resolution / T else 0
    # Braking stops both masses: their mean speed counts
    whole = g.mass[0] + g.mass[1]
    both = g.mass[1] > 0.0 and np.isfinite(v2)
    mean = (g.mass[0] * v + g.mass[1] * v2) / whole if both else v
    sure = max(abs(mean) - g.velocity_resolution - 2.0 * g.resolution / T, 0.0)
    unseen = g.mass[1] > 0.0 and not both
    stop = 0.5 * sure * sure / (g.braking * (_UNSEEN if unseen else 1.0))
    if g.effort == 0.0 and sure >= g.sure_speed:  # it keeps its speed until braking begins
        stop += _OUTSIDE * T * sure
    g.sure_speed = sure
    above = x > g.high or (mean > 0.0 and x + stop > g.high)
    below = x < g.low or (mean < 0.0 and x - stop < g.low)
    # Blocked: nearly the largest effort and no motion
    if abs(g.effort) < _NEARLY * limit or g.pushing == 0:
        g.pushing_from = x
    moves = abs(x - g.pushing_from) > g.resolution
    pushes = abs(g.effort) >= _NEARLY * limit and not moves
    g.pushing = g.pushing + 1 if pushes else 0
    blocked = g.pushing > max(_BLOCKED_SAMPLES, _BLOCKED_TIME / T)
    rests = abs(v) * T <= g.velocity_resolution * T + g.resolution
    g.idle = g.idle + 1 if g.effort == 0.0 and rests else 0
    if g.idle > _IDLE:  # what moves the axis after a rest begins a move of its own
        g.begun = g.time
    if _falls(g, x, v, rests):
        g.hold = 0.0 if g.fault == SIGN else g.hold
        g.free, g.fault, g.kept = 0, LOAD, 1
        g.anchored, g.released = 0, 0
    # A glitch shows the axis on its way to one side, and then to the other
    g.above = g.above + 1 if above else 0
    g.below = g.below + 1 if below else 0
    turns_away = _turns_away(g, x)
    if g.fault != 0:
        return
    if turns_away:
        g.fault = SIGN
    elif g.fast >= _FAST:
        g.fault = SPEED
    elif g.above >= _OUTSIDE or g.below >= _OUTSIDE:
        g.fault = TRAVEL
    elif blocked:
        g.fault = BLOCKED
    elif g.time - g.begun > g.time_limit and g.effort != 0.0:
        g.fault = TIME


@compiled(inline=True)
def _stays_off(g: Any, x: float) -> bool:
    """Return whether a position is as far off a rest as the one that was rejected before it.

    A force takes an axis ever farther off.
    """
    same = abs(x - g.rejected) <= _AS_FAR * abs(g.rejected - g.x)
    return same and g.idle >= _STILL and 0 < g.lost < _OFF


@compiled()
def _repeats(g: Any, k: int, x: float, v: float) -> bool:
    """Return whether a moving mass keeps its position and velocity in the last bit, as none does.

    One whose velocity v is measured moves by v n T in n samples, more than a few encoder steps.
    """
    T, last = g.period, g.seen[k, 1]
    same = x == g.seen[k, 0] and (v == last or (np.isnan(v) and np.isnan(last)))
    g.alike[k] = g.alike[k] + 1 if same else 0
    g.seen[k, 0], g.seen[k, 1] = x, v
    moves = abs(v) - g.velocity_resolution
    far = moves * T * g.alike[k]
    return moves > CREEPS * g.speed and g.alike[k] >= _ALIKE and far > _WIDE * g.resolution


@compiled()
def admit(
    guard: Float[np.ndarray, " g"], time: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take a sample in; return whether the controller may see it."""
    g = fields(guard)
    gap = not np.isfinite(time)
    for k in range(4):
        value = x if k == 0 else v if k == 1 else x2 if k == 2 else v2
        absent = g.needed[k] == 1 and not np.isfinite(value)
        if g.fault != LOST:
            g.missing[k] = 1 if absent else 0
        gap = gap or absent
    T = g.period
    dt = time - g.time if g.samples > 0 else T
    if gap or not EARLIEST * T < dt < _LATEST * T:
        if not gap and g.fault != 0:  # begin anew, to brake
            g.time, g.samples = time, 0
        return _lose(g, LOST)
    repeats = _repeats(g, 0, x, v)
    repeats = _repeats(g, 1, x2, v2) or repeats
    if repeats and g.fault == 0:
        g.fault = FROZEN
    measured = np.isfinite(v)
    speed = v if measured else (x - g.x) / dt
    if g.samples == 0:
        speed = v if measured else 0.0
    else:
        # The speed from positions is that of the middle of the last step; at rest it is 0
        late = dt if g.idle >= _STILL and not measured else dt + T
        slack = 0.5 * g.acceleration * dt * late + _WIDE * g.resolution
        slack += (g.velocity_resolution if measured else _WIDE * g.resolution / T) * late
        halted = abs(x - g.x) <= abs(dt * g.v) + _WIDE * g.resolution
        jumps = abs(x - g.x - dt * g.v) > slack or (not halted and _stays_off(g, x))
        if jumps and g.samples == g.lost == 1 and abs(x - g.rejected) <= slack:
            # Not this one and the one before were glitches, but the first, or the axis moved in it:
            # begin anew
            g.samples = g.free = 0
            speed = v if measured else 2.0 * (x - g.rejected) / dt
        elif jumps:
            g.rejected = x
            if (halted or g.halted == 1) and x != g.x:
                return _halt(g)
            g.stuck += 1 if x == g.x else 0
            return _lose(g, FROZEN if x == g.x else JUMP)
        if not measured and abs(x - g.rejected) <= _WIDE * g.resolution:
            speed = (x - g.rejected) / T  # it rests where it was off before
        if g.stuck >= _STUCK and x == g.x and g.fault == 0:  # by no force
            g.fault = FROZEN
        if measured and g.samples > 0:
            unsure = g.velocity_resolution + 2.0 * g.resolution / T  # of a difference of positions
            if abs(v - g.v) > g.acceleration * late + 2.0 * unsure:
                return _halt(g) if abs(v) <= abs(g.v) + unsure else _lose(g, JUMP)
            # A velocity that the position does not follow
            step = x - g.x - 0.5 * dt * (v + g.v)
            g.mismatch = _MEMORY * g.mismatch + step
            wide = _FILTERED * g.acceleration * late * late + _WIDE * g.resolution
            if abs(g.mismatch) > wide + 10.0 * g.velocity_resolution * T and g.fault == 0:
                g.fault = FROZEN
        g.same = g.same + 1 if x == g.x else 0
        if g.same_limit > 0 and g.same >= g.same_limit and g.fault == 0:
            g.fault = FROZEN
    g.time, g.x, g.v = time, x, speed
    g.samples += 1
    g.lost = g.halted = g.stuck = 0
    g.rejected = np.nan
    if stands_too_long(g, speed, v2, dt) and g.fault == 0:
        g.fault = BLOCKED
    if g.started == 0:
        g.started, g.begun = 1, time
    _watch(g, x, speed, v2)
    return True


@compiled(inline=True)
def _mass(g: Any) -> float:
    """Return the mass that is braked."""
    return TIME_CONSTANT * g.gain * g.period


@compiled()
def _begin_braking(g: Any) -> None:
    """Begin a plan of braking at the state of the axis.

    It takes the speed away evenly, soon enough to stop within the travel, as far as the effort
    limit allows. The load is that which held the axis before it was let go, or that of an effort
    under which it stood, or crept out of its travel.
    """
    x, v, T = g.x, g.v, g.period
    inward = (g.above > 0 and g.effort < 0.0) or (g.below > 0 and g.effort > 0.0)
    held = g.fault in (BLOCKED, TIME) or (g.fault == TRAVEL and inward)
    slow = _STILL_SHARE * abs(g.effort) * T / _mass(g) + g.velocity_resolution + g.resolution / T
    stood = held and abs(v) <= slow
    if g.kept == 0:
        g.hold = g.effort if stood else 0.0
    g.anchored, g.anchor, g.pace, g.quiet, g.quiet_x = 1, x, v, 0, x
    g.against = 0
    room = max((g.high - x if v > 0.0 else x - g.low) - abs(v) * T, 0.5 * abs(v) * T)
    needed = 0.5 * v * v / room if v != 0.0 else 0.0
    most = _PLANNED * g.effort_limit / _mass(g)
    g.slowing = min(max(needed, min(abs(v) / (_STOP * T), g.braking)), most)


@compiled(inline=True)
def _is_outside(g: Any) -> bool:
    """Return whether an axis that follows its effort is outside its travel."""
    return g.follows == 1 and (g.x < g.low - g.resolution or g.x > g.high + g.resolution)


@compiled()
def _plan(g: Any, slower: float) -> None:
    """Go on by a sample in the plan, in which a load is learned so many times slower.

    What the efforts do not explain of the change of the velocity is the load. An axis that is
    slower than planned, by friction, is not driven on; one that stops outside its travel is brought
    back, by an effort that grows while it rests.
    """
    x, v, T = g.x, g.v, g.period
    if g.quiet < _RESTED:  # both where noise shows a motion and where it does not
        load = (_mass(g) * (v - g.braked_v) - g.impulse) / g.efforts_time
        g.hold -= min(_LEARNS * g.efforts_time / T, 1.0) / slower * (load + g.hold)
    most = g.effort_limit
    if g.quiet > 0 and _is_outside(g):
        g.hold += np.copysign(_GROWS * most, g.low - x)
        most = max(HELD * most, abs(g.hold) - _GROWS * most)
    g.hold = min(max(g.hold, -most), most)
    sign, left = np.copysign(1.0, g.pace), max(abs(g.pace) - g.slowing * T, 0.0)
    g.anchor += 0.5 * sign * (abs(g.pace) + left) * T
    if left > 0.0 and sign * v < left:
        left = max(sign * v, 0.0)
        g.anchor = sign * min(sign * g.anchor, sign * x)
    g.pace = sign * left
    if left == 0.0:
        g.anchor = min(max(g.anchor, g.low), g.high)


@compiled(inline=True)
def _slower(g: Any) -> float:
    """Return the factor by which braking takes longer: an axis swings, or its speed has noise."""
    measured = not np.isnan(g.seen[0, 1])
    error = g.velocity_resolution if measured else g.resolution / g.period
    noisy = g.gain * error / (_NOISE * g.effort_limit)
    noisy = min(noisy, _STEADIEST) if measured else noisy
    return min(max(1.0 + _SLOWER * max(g.turns - _TURNS, 0), noisy), _SLOWEST)


@compiled()
def _brake(g: Any) -> float:
    """Return the effort that leads the axis to rest by a plan, holds it there, and then lets go.

    A spring of K_p = gain/(16 T) about the plan damps a mass of gain 4 T critically. An axis that
    moves once it was let go is held for good. With many changes of the sign of the effort all of it
    becomes slower, and half of the load is forgotten at each: behind a long delay, or with a
    resonance, an axis would swing for ever. It is slower too where the speed has noise. An axis
    that has swung rests where it stops within its travel. Braking that makes it faster ends.
    """
    x, v = g.x, g.v
    if g.released == 1:
        if abs(x - g.anchor) <= _WIDE * g.resolution + _MOVES * (g.high - g.low):
            return 0.0
        g.released, g.anchored, g.kept = 0, 0, 1
        g.fault = LOAD if g.gravity == 1 else g.fault
    slower = _slower(g)
    begins = g.anchored == 0
    if begins:
        _begin_braking(g)
    slow = abs(v) <= _SLOW * g.braking * g.period + g.velocity_resolution + g.resolution / g.period
    g.quiet = g.quiet + 1 if slow and abs(x - g.quiet_x) <= g.resolution else 0
    if not begins:
        _plan(g, slower)
    speed, g.braked_v, g.impulse, g.efforts_time = abs(g.braked_v), v, 0.0, 0.0
    if g.quiet == 0:
        g.quiet_x = x
    elif g.quiet >= _RESTED and g.turns > _TURNS and g.low <= x <= g.high:
        g.turns, g.anchor = _TURNS, x  # it does not swing any more
    returns = _is_outside(g) and abs(g.hold) < HELD * g.effort_limit
    if g.quiet >= _QUIET and g.kept == 0 and not returns:
        g.released, g.anchor = 1, x
        return 0.0
    gain = g.gain / slower
    u = -gain * (v - g.pace) + g.hold
    u -= gain / (4.0 * TIME_CONSTANT * slower * g.period) * (x - g.anchor)
    if g.pace != 0.0:
        u -= np.copysign(_mass(g) * g.slowing, g.pace)
    if abs(u) > _CLEARLY * g.effort_limit:
        if u * g.brake < 0.0:
            g.turns += 1
            g.hold *= _FORGETS if g.turns > _TURNS else 1.0
        g.brake = u
    if u * v < 0.0 and abs(u) >= _NEARLY * g.effort_limit and abs(v) > speed:
        g.against += 1
        if g.against > _AGAINST and g.fault != LOAD:
            g.fault = SIGN
            return 0.0
    else:
        g.against = max(g.against - 1, 0)
    return u


@compiled()
def _coast(g: Any) -> float:
    """Return the effort that takes the estimated momentum out of an axis that is not seen.

    It leaves time, as the mass may be wrong, and samples that come may show so; more of it if the
    axis has swung before.
    """
    T = g.period
    if abs(g.momentum) <= momentum_error(g):
        return 0.0
    little = abs(g.momentum) <= _CLEARLY * g.effort_limit * T
    return -g.momentum / (T if little else TIME_CONSTANT * T * _slower(g))


@compiled()
def release(guard: Float[np.ndarray, " g"], readable: bool, effort: float) -> float:
    """Return the effort for the drive: finite and within the limit."""
    g = fields(guard)
    if g.fault != 0:
        unseen = not readable or g.fault in (FROZEN, JUMP)
        unseen = unseen or (g.fault == BLOCKED and g.alike[0] > 0 and g.anchored == 0)
        u = 0.0 if g.fault == SIGN else _coast(g) if unseen else _brake(g)
    elif np.isfinite(effort):
        u, g.unanswered = effort, 0
    else:
        g.unanswered += 1 if readable else 0
        if g.unanswered > g.max_lost:
            g.fault = FAILED
        u = 0.0
        if g.reaction == HOLD:
            u = g.effort
        elif g.reaction == BRAKE and g.samples > 0:
            u = -g.gain * g.v
    u = min(max(u, -g.effort_limit), g.effort_limit) if np.isfinite(u) else 0.0
    g.effort = u
    g.impulse += u * g.period
    g.efforts_time += g.period
    g.momentum = momentum_after(g, u)
    return u


@compiled()
def renew(guard: Float[np.ndarray, " g"]) -> None:
    """Begin a move to another target: no fault, its time not begun."""
    g = fields(guard)
    g.fault, g.started, g.lost, g.fast, g.pushing, g.free = 0, 0, 0, 0, 0, 0
    g.anchored, g.quiet, g.released, g.kept, g.above, g.below = 0, 0, 0, 0, 0, 0
    g.same, g.mismatch, g.unanswered, g.turns, g.against, g.weak = 0, 0.0, 0, 0, 0, 0
    g.momentum, g.missed, g.moved_fast, g.hold, g.alike[:] = 0.0, 0.0, 0, 0.0, 0
