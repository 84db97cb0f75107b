"""Kernels that all pulse controllers share: wait for rest, judge the last pulse, fire the next.

The state of a pulse controller is one vector of three parts: the fields that all methods share
(`HEAD`), the method's own fields, and the window of positions in which rest is looked for. A method
is three kernels of its own on top of these::

    own = fields_at(OWN_DTYPE, start=OWN)

    @compiled()
    def method_step(state, sample):
        vector = state.copy()
        s = head(vector)
        if not readable(vector, METHOD, sample):
            return vector, np.nan
        if watch(vector, sample):  # the axis has come to rest
            if s.fresh:  # after a pulse, which now is s.last
                learn(s, own(vector))
            if s.outcome == MOVING:  # outside the tolerance
                plan(s, own(vector))
        return vector, emit(s)

``learn`` reads the last pulse ``s.last`` (its effort levels, the displacement predicted and the one
achieved, whether it moved the axis) and the positions sampled from its start on, which are
``s.positions[: s.position_count]``, every ``s.stride`` samples. ``METHOD`` is a number by which
`readable` recognises a vector of this method. ``plan`` reads ``s.error`` (target minus position)
and either calls `fire` and then `add_level` once or several times, or calls `stop`. A pulse ends
early where the axis has gone farther than ``s.reach``, if that is set after `fire`.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.equal_positions import SENSOR, may_be_frozen
from stickslip.numerics.named_fields import fields_at, places
from stickslip.records import SensorSample

PWC, PAPWC, EXACT = 1, 2, 3  # methods
WAITING, PULSING, RESTING = 0, 1, 2  # phases
MOVING, REACHED, STOPPED = 0, 1, 2  # outcomes
_MOST_LEVELS = 4  # of one pulse
TRACE_SIZE = 64  # positions kept from a pulse's first sample on
_NEVER = 2**40  # an age at which no position is kept
CREEP = 0.01  # of the tolerance: positions that hardly change, where none is exact at rest
_FAR = 1e-3  # of the way left: likewise
_CALM = 20  # samples of them that are a rest
ROUNDING = 1e-9  # samples; a width above a whole number of samples by no more has been rounded so

PULSE = np.dtype(
    [
        ("time", "f8"),  # of its first sample
        ("error", "f8"),  # target minus position before it
        ("predicted", "f8"),  # displacement
        ("achieved", "f8"),
        ("moved", "i8"),  # 1 if it moved the axis
        ("level_count", "i8"),
        ("levels", "f8", (_MOST_LEVELS, 2)),  # effort, and whole samples it is held for
    ]
)
"""A pulse."""

HEAD = np.dtype(
    [
        # Settings
        ("method", "i8"),  # whose vector it is
        ("length", "i8"),  # of the vector
        ("target", "f8"),
        ("tolerance", "f8"),
        ("window", "i8"),  # samples in which rest is looked for
        ("spread", "f8"),  # largest range of positions at rest
        ("speed", "f8"),  # largest measured velocity at rest; infinite where none is measured
        ("least_motion", "f8"),  # a displacement of no more than this is none
        ("delay", "f8"),  # of the sensors, in samples
        ("early", "i8"),  # samples of a rest far from the target; 0 for the window
        ("calm_width", "f8"),  # largest range of positions that hardly change
        ("calm_least", "f8"),  # samples in which they do so at rest, where more than the window
        # What changes
        ("phase", "i8"),
        ("outcome", "i8"),
        ("rest", "f8"),  # position at the last rest
        ("error", "f8"),  # target minus that
        ("pending", "i8"),  # 1 from a pulse's start to the rest after it
        ("fresh", "i8"),  # 1 in the sample in which the last pulse's displacement became known
        ("pulses", "i8"),  # fired so far
        ("idle", "i8"),  # the last so many pulses in a row did not move the axis
        ("level", "i8"),  # on its way
        ("left", "f8"),  # samples of it left
        ("wait", "f8"),  # samples that still show what was before the pulse's end
        ("filled", "i8"),  # samples in the window
        ("next", "i8"),  # place in the window of the next one
        ("quiet", "i8"),  # samples in a row in which the measured velocity was small enough
        ("calm", "i8"),  # samples in a row in which the position has hardly changed
        ("lowest", "f8"),  # in these
        ("highest", "f8"),
        ("time", "f8"),  # of this sample
        ("position", "f8"),  # in this sample
        ("age", "i8"),  # samples since the pulse's start
        ("stride", "i8"),  # samples between two positions kept
        ("reach", "f8"),  # how far the axis may go under the pulse before it is cut short
        ("pulse", PULSE),  # on its way
        ("last", PULSE),  # the last pulse of which it is known what it did
        ("sensor", SENSOR),  # equal positions, and whether there is noise, of method `exact`
        ("position_count", "i8"),
        ("positions", "f8", (TRACE_SIZE,)),  # kept
    ]
)
"""Fields that all methods share."""

head = fields_at(HEAD)
OWN = places(HEAD)
"""Place from which a method has its own fields."""


@compiled()
def readable(vector: Float[np.ndarray, " s"], method: int, sample: SensorSample) -> bool:
    """Return whether the sample holds what the controller needs.

    Raises
    ------
    ValueError
        If the vector is not a state of this method.
    """
    if vector.size < OWN or head(vector).method != method or head(vector).length != vector.size:
        raise ValueError("not a state of this controller's method: begin with the one of init()")
    return np.isfinite(sample.measured_position) and (
        head(vector).speed == np.inf or np.isfinite(sample.measured_velocity)
    )


@compiled()
def _calm_width(s: Any) -> float:
    """Return the range of positions that hardly change: the farther from the target the wider."""
    return max(s.calm_width, _FAR * abs(s.target - s.position))


@compiled()
def _see(vector: Float[np.ndarray, " s"], x: float, v: float) -> None:
    """Take a sample into the window."""
    s = head(vector)
    vector[vector.size - s.window + s.next] = x
    s.next = (s.next + 1) % s.window
    s.filled = min(s.filled + 1, s.window)
    s.quiet = s.quiet + 1 if s.speed == np.inf or abs(v) <= s.speed else 0
    s.lowest, s.highest = min(s.lowest, x), max(s.highest, x)
    s.calm += 1
    if s.calm == 1 or s.highest - s.lowest > _calm_width(s):
        s.calm, s.lowest, s.highest = 1, x, x


@compiled()
def _rest_position(vector: Any, samples: int) -> float:
    """Return the mean of the last positions, or NaN if the axis is not at rest in them."""
    s = head(vector)
    if s.filled < samples or s.quiet < samples:
        return np.nan
    start = vector.size - s.window
    first = vector[start + (s.next - samples) % s.window]
    low, high, total = first, first, 0.0
    for k in range(samples):
        x = vector[start + (s.next - 1 - k) % s.window]
        low, high = min(low, x), max(high, x)
        total += x - first  # from the first: equal positions have exactly that mean
    return first + total / samples if high - low <= s.spread else np.nan


@compiled()
def _conclude(s: Any, rest: float) -> None:
    """Note what the pulse on its way has done, now that the axis rests again."""
    d = rest - s.rest
    s.pulse.achieved = d
    s.pulse.moved = 1 if abs(d) > s.least_motion else 0
    s.last = s.pulse
    s.idle = 0 if s.last.moved else s.idle + 1
    s.pending, s.fresh = 0, 1


@compiled()
def _keep(s: Any, x: float) -> None:
    """Keep a position; where there is no more room, let go of every other one."""
    s.age += 1
    if s.age != s.stride * s.position_count:
        return
    if s.position_count == TRACE_SIZE:
        for k in range(TRACE_SIZE // 2):
            s.positions[k] = s.positions[2 * k]
        s.position_count = TRACE_SIZE // 2
        s.stride *= 2
    s.positions[s.position_count] = x
    s.position_count += 1


@compiled()
def wait_for_rest(s: Any) -> None:
    """Wait for rest from here on."""
    s.phase, s.wait = WAITING, np.ceil(s.delay)
    s.filled = s.next = s.quiet = s.calm = 0


@compiled()
def _cut(s: Any) -> None:
    """End the pulse before its time, and note how long it has lasted."""
    i = s.level
    s.pulse.levels[i, 1] -= s.left
    s.pulse.level_count = i + (1 if s.pulse.levels[i, 1] > 0.0 else 0)
    wait_for_rest(s)


@compiled()
def leaves(s: Any, x: float) -> bool:
    """Return whether two samples in a row, of which x is the later, are certainly off the target.

    Once `watch` has taken the sample in, the axis is no longer at its target.
    """
    certain = s.tolerance + s.spread
    off = abs(x - s.target) > certain and abs(s.position - s.target) > certain
    return s.outcome == REACHED and off


@compiled()
def watch(vector: Float[np.ndarray, " s"], sample: SensorSample) -> bool:
    """Take a sample in; return whether the axis has come to rest, so that it is time to decide.

    Then ``rest``, ``error`` and ``outcome`` (`MOVING` or `REACHED`) are those of this rest, and
    ``fresh`` says whether a pulse has led to it. It is False during a pulse, while the axis moves,
    and after a rest that was judged until the axis rests elsewhere. An axis farther from its target
    than the tolerance may be judged by ``early`` samples. A position that hardly changes for long
    is a rest although no velocity is 0 or no two positions are equal: sensors have offsets, and
    bristles creep. Where the sensor of method `exact` may be frozen, a rest is judged later.
    """
    s = head(vector)
    x = sample.measured_position
    moved_away = leaves(s, x)
    s.time, s.position, s.fresh = sample.time, x, 0
    if s.pending:
        _keep(s, x)
    if s.phase == PULSING:
        if abs(x - s.rest) <= s.reach:
            return False
        _cut(s)
    if s.wait > 0.0:
        s.wait -= 1.0
        return False
    _see(vector, x, sample.measured_velocity)
    if moved_away:
        s.outcome = MOVING
    rest = _rest_position(vector, s.window)
    if np.isnan(rest) and s.phase == WAITING and 0 < s.early < s.window:
        rest = _rest_position(vector, s.early)
        if abs(s.target - rest) <= s.tolerance + s.spread:  # takes the whole window to judge
            return False
    least = s.least_motion
    if np.isnan(rest) and s.calm >= max(_CALM, s.window):
        rest, least = x, max(least, _calm_width(s))
    if np.isnan(rest) or s.calm < s.calm_least or may_be_frozen(s.sensor):
        return False
    left = s.outcome == MOVING and abs(s.error) <= s.tolerance
    if s.phase == RESTING and abs(rest - s.rest) <= least and not left:
        return False
    if s.pending:
        _conclude(s, rest)
    else:
        s.idle = 0
    s.rest, s.error, s.phase = rest, s.target - rest, RESTING
    s.outcome = REACHED if abs(s.error) <= s.tolerance else MOVING
    return True


@compiled()
def blind_step(
    state: Float[np.ndarray, " s"],
) -> tuple[Float[np.ndarray, " s"], float]:
    """Go on by one sample of which nothing is known; no position is kept from there on."""
    vector = state.copy()
    s = head(vector)
    if s.pending:
        s.age = _NEVER
    if s.phase != PULSING and s.wait > 0.0:
        s.wait -= 1.0
    return vector, emit(s)


@compiled()
def fire(s: Any, predicted: float) -> None:
    """Begin a pulse, from this sample on, that is expected to move the axis by ``predicted``."""
    s.pulse.time, s.pulse.error = s.time, s.error
    s.pulse.predicted, s.pulse.level_count = predicted, 0
    s.phase, s.pending = PULSING, 1
    s.pulses += 1
    s.positions[0], s.position_count, s.stride, s.age = s.position, 1, 1, 0
    s.level, s.reach = 0, np.inf


@compiled()
def add_level(s: Any, effort: float, samples: float) -> None:
    """Add a level to the pulse that was begun, held for one whole sample or more; four at most."""
    i = s.pulse.level_count
    s.pulse.levels[i, 0], s.pulse.levels[i, 1] = effort, samples
    s.pulse.level_count = i + 1
    if i == 0:
        s.left = samples


@compiled()
def whole_samples(width: float, T: float) -> float:
    """Return a width rounded up to whole samples, at least one."""
    return max(np.ceil(width / T - ROUNDING), 1.0)


@compiled()
def stop(s: Any) -> None:
    """Fire no pulse: none brings the axis nearer."""
    s.outcome = STOPPED


@compiled()
def emit(s: Any) -> float:
    """Return the effort from this sample to the next, and go on by one sample in the pulse."""
    if s.phase != PULSING:
        return 0.0
    i = s.level
    effort = s.pulse.levels[i, 0]
    s.left -= 1.0
    if s.left <= 0.0:
        if i + 1 < s.pulse.level_count:
            s.level, s.left = i + 1, s.pulse.levels[i + 1, 1]
        else:
            wait_for_rest(s)
    return effort
