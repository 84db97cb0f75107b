"""What every pulse controller does: wait for rest, judge the last pulse, fire the next.

All that a controller is and remembers is one vector. Its head is laid out by the constants below
and kept by the kernels here; what is a method's own begins at `OWN`; the window of positions in
which rest is looked for is its end. A method is three kernels of its own on top of these::

    @compiled()
    def method_step(state, sample):
        s = state.copy()
        if not readable(s, METHOD, sample):
            return s, np.nan
        if watch(s, sample):  # the axis has come to rest
            if s[FRESH] > 0.0:  # after a pulse, which now is the one at LAST
                learn(s)
            if s[OUTCOME] == MOVING:  # outside the tolerance
                plan(s)
        return s, emit(s)

``learn`` reads the pulse at ``s[LAST + ...]`` (its effort levels, the displacement it was to make
and the one it made, whether it moved the axis) and the positions sampled from its start on, which
are ``s[TRACE : TRACE + int(s[TRACED])]``, every ``s[STRIDE]`` samples. ``METHOD`` is a number by
which `readable` knows a vector of this method. ``plan`` reads ``s[ERROR]``
(target minus position) and either calls `fire` and then `add_level` once or several times, or calls
`stop`. A pulse ends early where the axis has gone farther than ``s[REACH]``, if that is set after
`fire`.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.records import SensorSample

__all__ = [
    "AT_ACHIEVED",
    "AT_ERROR",
    "AT_LEVELS",
    "AT_LEVEL_COUNT",
    "AT_MOVED",
    "AT_PREDICTED",
    "AT_TIME",
    "DELAY",
    "ERROR",
    "FRESH",
    "IDLE",
    "LAST",
    "LEAST_MOTION",
    "METHOD",
    "MOVING",
    "OUTCOME",
    "OWN",
    "PENDING",
    "PHASE",
    "PULSES",
    "PULSING",
    "REACH",
    "REACHED",
    "REST",
    "RESTING",
    "ROUNDING",
    "SIZE",
    "SPEED",
    "SPREAD",
    "STOPPED",
    "STRIDE",
    "TARGET",
    "TOLERANCE",
    "TRACE",
    "TRACED",
    "TRACE_SIZE",
    "WAITING",
    "WINDOW",
    "add_level",
    "emit",
    "fire",
    "readable",
    "stop",
    "watch",
    "whole_samples",
]

WAITING, PULSING, RESTING = 0.0, 1.0, 2.0  # values of PHASE
MOVING, REACHED, STOPPED = 0.0, 1.0, 2.0  # values of OUTCOME
_MOST_LEVELS = 4  # of one pulse
TRACE_SIZE = 64  # positions kept from a pulse's first sample on
ROUNDING = 1e-9  # samples; a width above a whole number of samples by no more has been rounded so

# Settings
(
    METHOD,  # whose vector it is
    SIZE,  # of the vector
    TARGET,
    TOLERANCE,
    WINDOW,  # samples in which rest is looked for
    SPREAD,  # largest range of positions at rest
    SPEED,  # largest measured velocity at rest; infinite where none is measured
    LEAST_MOTION,  # a displacement of no more than this is none
    DELAY,  # of the sensors, in samples
) = range(9)
# What changes
(
    PHASE,
    OUTCOME,
    REST,  # position at the last rest
    ERROR,  # target minus that
    PENDING,  # 1 from a pulse's start to the rest after it
    FRESH,  # 1 in the sample in which the last pulse's displacement became known
    PULSES,  # fired so far
    IDLE,  # the last so many pulses in a row did not move the axis
    _LEVEL,  # on its way
    _LEFT,  # samples of it left
    _WAIT,  # samples that still show what was before the pulse's end
    _FILLED,  # samples in the window
    _NEXT,  # place in the window of the next one
    _QUIET,  # samples in a row in which the measured velocity was small enough
    _TIME,  # of this sample
    _POSITION,  # in this sample
    STRIDE,  # samples between two positions kept
    _AGE,  # samples since the pulse's start
    REACH,  # how far the axis may go under the pulse before it is cut short
) = range(DELAY + 1, DELAY + 20)
# Places within a pulse
(
    AT_TIME,
    AT_ERROR,
    AT_PREDICTED,
    AT_ACHIEVED,
    AT_MOVED,
    AT_LEVEL_COUNT,
    AT_LEVELS,  # effort and whole samples of each
) = range(7)
_PULSE_SIZE = AT_LEVELS + 2 * _MOST_LEVELS
_PULSE = REACH + 1  # the pulse on its way
LAST = _PULSE + _PULSE_SIZE  # the last pulse of which it is known what it did
TRACED = LAST + _PULSE_SIZE  # positions kept
TRACE = TRACED + 1
OWN = TRACE + TRACE_SIZE  # from here to the window: the method's own


@compiled()
def readable(s: Float[np.ndarray, " s"], method: float, sample: SensorSample) -> bool:
    """Return whether the sample holds what the controller needs.

    Raises
    ------
    ValueError
        If the vector is not one of this method: what lies where in it could not be told.
    """
    if s.size < OWN or s[METHOD] != method or s[SIZE] != s.size:
        raise ValueError("not a state of this controller's method: begin with the one of init()")
    return np.isfinite(sample.measured_position) and (
        s[SPEED] == np.inf or np.isfinite(sample.measured_velocity)
    )


@compiled()
def _see(s: Float[np.ndarray, " s"], x: float, v: float) -> None:
    """Take a sample into the window."""
    window = int(s[WINDOW])
    place = int(s[_NEXT])
    s[s.size - window + place] = x
    s[_NEXT] = (place + 1) % window
    s[_FILLED] = min(s[_FILLED] + 1.0, s[WINDOW])
    s[_QUIET] = s[_QUIET] + 1.0 if s[SPEED] == np.inf or abs(v) <= s[SPEED] else 0.0


@compiled()
def _rest_position(s: Float[np.ndarray, " s"]) -> float:
    """Return the mean position over the window, or NaN if the axis is not at rest."""
    window = int(s[WINDOW])
    if s[_FILLED] < window or s[_QUIET] < window:
        return np.nan
    start = s.size - window
    first = s[start]
    low, high, total = first, first, 0.0
    for k in range(start, s.size):
        low, high = min(low, s[k]), max(high, s[k])
        total += s[k] - first  # from the first: equal positions have exactly that mean
    return first + total / window if high - low <= s[SPREAD] else np.nan


@compiled()
def _conclude(s: Float[np.ndarray, " s"], rest: float) -> None:
    """Note what the pulse on its way has done, now that the axis rests again."""
    d = rest - s[REST]
    s[_PULSE + AT_ACHIEVED] = d
    s[_PULSE + AT_MOVED] = 1.0 if abs(d) > s[LEAST_MOTION] else 0.0
    for k in range(_PULSE_SIZE):
        s[LAST + k] = s[_PULSE + k]
    s[IDLE] = 0.0 if s[LAST + AT_MOVED] > 0.0 else s[IDLE] + 1.0
    s[PENDING] = 0.0
    s[FRESH] = 1.0


@compiled()
def _keep(s: Float[np.ndarray, " s"], x: float) -> None:
    """Keep a position; where there is no more room, let go of every other one."""
    s[_AGE] += 1.0
    if s[_AGE] != s[STRIDE] * s[TRACED]:
        return
    if s[TRACED] == TRACE_SIZE:
        for k in range(TRACE_SIZE // 2):
            s[TRACE + k] = s[TRACE + 2 * k]
        s[TRACED] = TRACE_SIZE // 2
        s[STRIDE] *= 2.0
    s[TRACE + int(s[TRACED])] = x
    s[TRACED] += 1.0


@compiled()
def _end(s: Float[np.ndarray, " s"]) -> None:
    """Wait for rest from here on."""
    s[PHASE], s[_WAIT] = WAITING, s[DELAY]
    s[_FILLED] = s[_NEXT] = s[_QUIET] = 0.0


@compiled()
def _cut(s: Float[np.ndarray, " s"]) -> None:
    """End the pulse before its time, and note how long it has lasted."""
    i = int(s[_LEVEL])
    s[_PULSE + AT_LEVELS + 2 * i + 1] -= s[_LEFT]
    s[_PULSE + AT_LEVEL_COUNT] = i + (1.0 if s[_PULSE + AT_LEVELS + 2 * i + 1] > 0.0 else 0.0)
    _end(s)


@compiled()
def watch(s: Float[np.ndarray, " s"], sample: SensorSample) -> bool:
    """Take a sample in; return whether the axis has come to rest, so that it is time to decide.

    Then ``s[REST]``, ``s[ERROR]`` and ``s[OUTCOME]`` (`MOVING` or `REACHED`) are those of this
    rest, and ``s[FRESH]`` says whether a pulse has led to it. It stays silent while a pulse is on
    its way, while the axis moves, and once a rest has been judged, until the axis is at rest
    elsewhere.
    """
    x = sample.measured_position
    s[_TIME], s[_POSITION], s[FRESH] = sample.time, x, 0.0
    if s[PENDING] > 0.0:
        _keep(s, x)
    if s[PHASE] == PULSING:
        if abs(x - s[REST]) <= s[REACH]:
            return False
        _cut(s)
    if s[_WAIT] > 0.0:
        s[_WAIT] -= 1.0
        return False
    _see(s, x, sample.measured_velocity)
    rest = _rest_position(s)
    if np.isnan(rest):
        return False
    if s[PHASE] == RESTING and abs(rest - s[REST]) <= s[LEAST_MOTION]:
        return False
    if s[PENDING] > 0.0:
        _conclude(s, rest)
    else:
        s[IDLE] = 0.0
    s[REST], s[ERROR], s[PHASE] = rest, s[TARGET] - rest, RESTING
    s[OUTCOME] = REACHED if abs(s[ERROR]) <= s[TOLERANCE] else MOVING
    return True


@compiled()
def fire(s: Float[np.ndarray, " s"], predicted: float) -> None:
    """Begin a pulse, from this sample on, that is expected to move the axis by ``predicted``."""
    s[_PULSE + AT_TIME], s[_PULSE + AT_ERROR] = s[_TIME], s[ERROR]
    s[_PULSE + AT_PREDICTED], s[_PULSE + AT_LEVEL_COUNT] = predicted, 0.0
    s[PHASE], s[PENDING] = PULSING, 1.0
    s[PULSES] += 1.0
    s[TRACE], s[TRACED], s[STRIDE], s[_AGE] = s[_POSITION], 1.0, 1.0, 0.0
    s[_LEVEL], s[REACH] = 0.0, np.inf


@compiled()
def add_level(s: Float[np.ndarray, " s"], effort: float, samples: float) -> None:
    """Add a level to the pulse that was begun, held for whole samples, at least one."""
    i = int(s[_PULSE + AT_LEVEL_COUNT])
    s[_PULSE + AT_LEVELS + 2 * i], s[_PULSE + AT_LEVELS + 2 * i + 1] = effort, samples
    s[_PULSE + AT_LEVEL_COUNT] = i + 1.0
    if i == 0:
        s[_LEFT] = samples


@compiled()
def whole_samples(width: float, T: float) -> float:
    """Return a width rounded up to whole samples, at least one."""
    return max(np.ceil(width / T - ROUNDING), 1.0)


@compiled()
def stop(s: Float[np.ndarray, " s"]) -> None:
    """Fire no pulse: none brings the axis nearer."""
    s[OUTCOME] = STOPPED


@compiled()
def emit(s: Float[np.ndarray, " s"]) -> float:
    """Return the effort from this sample to the next, and go on by one sample in the pulse."""
    if s[PHASE] != PULSING:
        return 0.0
    i = int(s[_LEVEL])
    effort = s[_PULSE + AT_LEVELS + 2 * i]
    s[_LEFT] -= 1.0
    if s[_LEFT] <= 0.0:
        s[_LEVEL] = i + 1.0
        if i + 1 < s[_PULSE + AT_LEVEL_COUNT]:
            s[_LEFT] = s[_PULSE + AT_LEVELS + 2 * (i + 1) + 1]
        else:
            _end(s)
    return effort
