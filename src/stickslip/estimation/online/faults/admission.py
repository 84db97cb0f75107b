"""Admission of samples to an online estimator: missing and impossible values, and the delay.

A sample passes through here before an estimator sees it.

- A value that is not finite or larger than `IMPOSSIBLE` is missing. So is a position or velocity
  that contradicts the motion before it (a glitch). Both are counted.
- The prediction is kinematic: x+ = x + T (v + v+) / 2 with a measured velocity, else a constant
  velocity. The tolerance follows the prediction errors themselves (`_FACTOR` times their 90 %
  quantile, twice their recent maximum), plus the acceleration that the efforts so far allow.
- A contradiction that lasts for more than `LASTING` samples is accepted as a step (an encoder that
  was homed again, an angle that wraps). The estimator then starts its motion again. As long as the
  inertia is unknown, it is an acceleration larger than those before: the tolerance is learned anew,
  and nothing is counted.
- A known delay of the effort is removed. For a delay of n + f samples the effort in the interval
  that begins with sample k is (1 - f) u(k-n) + f u(k-n-1). With a negative delay (an effort that
  is logged late) the motion is delayed instead.

All memory is a part of the estimator's state, which begins at an offset ``at``.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.records import InputError

__all__ = [
    "ADMISSION_SIZE",
    "EFFORT_GLITCHES",
    "IMPOSSIBLE",
    "LARGEST_EFFORT",
    "LASTING",
    "LONGEST_DELAY",
    "MISSING_VALUES",
    "MOTION_GLITCHES",
    "MOTION_STEPS",
    "SAMPLES_SEEN",
    "VELOCITY_GLITCHES",
    "admit",
    "continued",
    "lay_admission",
    "learn_inertia",
    "restart_admission",
]

IMPOSSIBLE = 1e30
"""Size of a value beyond which it is missing [any unit]: its square is still a number."""

LASTING = 8
"""Contradicting samples in a row that are rejected; the next one is accepted as a step."""

LONGEST_DELAY = 30
"""Largest delay of the effort [samples]."""

_FACTOR = 8.0  # tolerance over the 90 % quantile of prediction errors: 13 standard deviations
_FACTOR_WARM_UP = 64.0  # the same while the quantile is estimated from few errors
_WARM_UP = 16.0  # errors
_RECENT = 2.0  # tolerance over the largest recent error
_FADING = 1.0 / 4096.0  # relative decay of that largest error in a sample
_RATE = 0.01  # step of the quantile's estimate (relative, downwards; 9 times that upwards)
_RATE_WARM_UP = 0.3  # the same, divided by the number of errors
_ACCELERATION = 3.0  # largest net force over the largest effort so far
_EFFORT = 10.0
"""An effort larger than this many times the largest so far is a glitch, once the axis has moved."""
_EFFORT_AT_REST = 1e6  # the same before: the effort so far may have been too small to move it

_KNOWN_INERTIA = 4.0  # standard deviations

(
    _LAG,  # whole samples by which the effort is delayed
    _FRACTION,  # the rest of it
    _MOTION_LAG,  # samples by which the motion is delayed
    _SAMPLING_TIME,
    _MOBILITY,  # T / m; 0 as long as the inertia is unknown
    _HEAD,  # samples in the ring so far
    _LAST_EFFORT,
    _EFFORT_RUN,  # rejected efforts in a row
    SAMPLES_SEEN,
    MISSING_VALUES,
    EFFORT_GLITCHES,
    MOTION_GLITCHES,  # positions of either mass
    VELOCITY_GLITCHES,
    MOTION_STEPS,
    LARGEST_EFFORT,
    _HAS_VELOCITY,
    _HAS_LOAD,
    _HAS_LOAD_VELOCITY,
    _START,  # first position of the driven mass
    _MOVED,  # whether it has moved
) = range(20)
_MASSES = 20
(
    _KNOWN,
    _PREDICTED,  # position that the next sample should have
    _ACCEPTED,  # last accepted position
    _GAP,  # samples since then
    _VELOCITY,
    _LATEST,  # position of the latest sample, accepted or not
    _POSITION_ERRORS,  # four places, as the next four constants say
) = range(7)
_QUANTILE, _LARGEST, _COUNT, _RUN = range(4)
_VELOCITY_ERRORS = _POSITION_ERRORS + 4
_MASS_SIZE = _VELOCITY_ERRORS + 4
_RING = _MASSES + 2 * _MASS_SIZE
_SLOTS = LONGEST_DELAY + 2
_SLOT = 6  # effort, whether it is unknown, position, velocity, load position, load velocity
ADMISSION_SIZE = _RING + _SLOTS * _SLOT


def lay_admission(
    s: Float[np.ndarray, " s"],
    at: int,
    *,
    sampling_time: float,
    effort_delay: float,
    inertia: float | None,
    measured: tuple[bool, bool, bool],
) -> None:
    """Initialise the part of a state that begins at ``at``, in place.

    Parameters
    ----------
    s, at
        State and offset.
    sampling_time
        [s].
    effort_delay
        Samples by which the effort acts after it is logged; negative if it is logged late.
    inertia
        Of the driven mass [kg or kg m^2]; None if it is unknown.
    measured
        Whether velocity, load position and load velocity are measured.

    Raises
    ------
    InputError
        If the delay is not finite or longer than `LONGEST_DELAY`.
    """
    if not abs(effort_delay) <= LONGEST_DELAY:
        raise InputError(
            f"effort_delay is {effort_delay:g} samples, it must be between -{LONGEST_DELAY} and "
            f"{LONGEST_DELAY}",
            remedy="give the delay in samples, not in seconds",
        )
    motion_lag = max(int(np.ceil(-effort_delay)), 0)
    lag, fraction = divmod(effort_delay + motion_lag, 1.0)
    s[at : at + ADMISSION_SIZE] = 0.0
    s[at + _LAG], s[at + _FRACTION], s[at + _MOTION_LAG] = lag, fraction, motion_lag
    s[at + _SAMPLING_TIME] = sampling_time
    s[at + _MOBILITY] = 0.0 if inertia is None else sampling_time / inertia
    velocity, load, load_velocity = measured
    s[at + _HAS_VELOCITY] = velocity
    s[at + _HAS_LOAD], s[at + _HAS_LOAD_VELOCITY] = load, load_velocity


@compiled(inline=True)
def restart_admission(s: Float[np.ndarray, " s"], at: int) -> None:
    """Forget the motion and the samples under way, but no errors or largest efforts: a gap."""
    s[at + _HEAD] = 0.0
    s[at + _MASSES + _KNOWN] = 0.0
    s[at + _MASSES + _MASS_SIZE + _KNOWN] = 0.0


@compiled(inline=True)
def learn_inertia(s: Float[np.ndarray, " s"], at: int, inertia: float, variance: float) -> None:
    """Take an estimated inertia, if it is more than `_KNOWN_INERTIA` standard deviations."""
    if inertia * inertia > _KNOWN_INERTIA**2 * variance and inertia > 0.0:
        s[at + _MOBILITY] = s[at + _SAMPLING_TIME] / inertia


@compiled(inline=True)
def _tolerance(s: Float[np.ndarray, " s"], at: int, c: int) -> float:
    """Return how large a prediction error may be: max(8 q_90, 2 largest).

    The first error of all is accepted. With an unknown inertia it is rejected until it lasts, as
    nothing else shows a glitch in the rest before the first motion.
    """
    if s[c + _COUNT] == 0.0:
        return IMPOSSIBLE if s[at + _MOBILITY] > 0.0 else _FACTOR_WARM_UP * s[c + _QUANTILE]
    factor = _FACTOR if s[c + _COUNT] >= _WARM_UP else _FACTOR_WARM_UP
    return max(factor * s[c + _QUANTILE], _RECENT * s[c + _LARGEST])


@compiled(inline=True)
def _learn_step(s: Float[np.ndarray, " s"], at: int, c: int, counter: int, error: float) -> None:
    """Count an accepted step; with an unknown inertia take it as the acceleration.

    The ``error`` is then that of one sample, and the tolerance is learned anew from it.
    """
    if s[at + _MOBILITY] > 0.0:
        s[at + MOTION_STEPS] += 1.0
        return
    if s[c + _COUNT] > 0.0:
        s[at + counter] -= LASTING
    s[c + _COUNT], s[c + _QUANTILE], s[c + _LARGEST] = 1.0, error, 0.0


@compiled(inline=True)
def _learn_error(s: Float[np.ndarray, " s"], c: int, error: float) -> None:
    """Update quantile and recent maximum with an accepted error other than an exact zero."""
    if error == 0.0:
        return
    s[c + _COUNT] += 1.0
    if s[c + _COUNT] == 1.0:
        s[c + _QUANTILE] = error
        return
    rate = max(_RATE, _RATE_WARM_UP / s[c + _COUNT])
    if error > s[c + _QUANTILE]:
        s[c + _QUANTILE] *= 1.0 + 9.0 * rate
    else:
        s[c + _QUANTILE] *= 1.0 - rate
    s[c + _LARGEST] *= 1.0 - _FADING
    if s[c + _COUNT] > _WARM_UP:
        s[c + _LARGEST] = max(s[c + _LARGEST], error)


@compiled(inline=True)
def continued(s: Float[np.ndarray, " s"], at: int, mass: int) -> tuple[float, float]:
    """Return predicted position and last velocity of a mass, in place of missing ones."""
    m = at + _MASSES + _MASS_SIZE * mass
    return s[m + _PREDICTED], s[m + _VELOCITY]


@compiled(inline=True)
def _is_possible(value: float) -> bool:
    return abs(value) <= IMPOSSIBLE  # False for NaN


@compiled(inline=True)
def _admit_motion(
    s: Float[np.ndarray, " s"], at: int, mass: int, x: float, v: float, measured: bool
) -> tuple[float, float, bool]:
    """Return position and velocity of a mass, NaN where missing, and whether they stepped."""
    T = s[at + _SAMPLING_TIME]
    m = at + _MASSES + _MASS_SIZE * mass
    cx, cv = m + _POSITION_ERRORS, m + _VELOCITY_ERRORS
    has_x, has_v = _is_possible(x), measured and _is_possible(v)
    if not has_x or (measured and not has_v):
        s[at + MISSING_VALUES] += 1.0
    if s[m + _KNOWN] == 0.0:
        if not has_x or (measured and not has_v):
            return np.nan, np.nan, False
        if s[at + _MOVED] == 0.0 and mass == 0:
            s[at + _START] = x
        s[m + _KNOWN] = 1.0
        s[m + _PREDICTED] = s[m + _ACCEPTED] = s[m + _LATEST] = x
        s[m + _VELOCITY] = v if measured else 0.0
        s[m + _GAP] = s[cx + _RUN] = s[cv + _RUN] = 0.0
        return x, v if measured else np.nan, False
    stepped = False
    # Change of velocity that a sample may bring
    change = max(_ACCELERATION * s[at + LARGEST_EFFORT] * s[at + _MOBILITY], s[cv + _LARGEST])
    before = s[m + _VELOCITY]
    if measured:
        if has_v:
            error = abs(v - before)
            if error <= _tolerance(s, at, cv) + change * (1.0 + s[cv + _RUN]):
                _learn_error(s, cv, error)
                s[m + _VELOCITY] = v
                s[cv + _RUN] = 0.0
            else:
                s[cv + _RUN] += 1.0
                has_v = s[cv + _RUN] > LASTING
                if has_v:
                    _learn_step(s, at, cv, VELOCITY_GLITCHES, error / s[cv + _RUN])
                    s[m + _VELOCITY] = v
                    s[cv + _RUN] = 0.0
                    stepped = True
                else:
                    s[at + VELOCITY_GLITCHES] += 1.0 if s[cv + _COUNT] > 0.0 else 0.0
        else:
            s[cv + _RUN] = min(s[cv + _RUN] + 1.0, LASTING)
        s[m + _PREDICTED] += 0.5 * T * (before + s[m + _VELOCITY])
    else:
        s[m + _PREDICTED] += T * before
    s[m + _GAP] += 1.0
    gap = s[m + _GAP]
    if has_x:
        latest = x
        error = abs(x - s[m + _PREDICTED])
        allowed = _tolerance(s, at, cx)
        if measured:
            allowed += T * change * (0.5 + s[cv + _RUN])
        else:
            allowed = gap * (allowed + T * change * 0.5 * (gap + 1.0))
        if error > allowed and not stepped:
            s[cx + _RUN] += 1.0
            if s[cx + _COUNT] == 0.0 and s[cx + _RUN] == 1.0:
                s[cx + _QUANTILE] = error  # a first error, to compare the second one with
            if s[cx + _RUN] <= LASTING:
                s[at + MOTION_GLITCHES] += 1.0 if s[cx + _COUNT] > 0.0 else 0.0
                has_x = False
            else:
                _learn_step(s, at, cx, MOTION_GLITCHES, 2.0 * error / (gap * gap))
                stepped = True
        elif gap == 1.0 and not stepped:
            _learn_error(s, cx, error)
        if has_x:
            if not measured:
                travel = (x - s[m + _LATEST]) * gap if stepped else x - s[m + _ACCEPTED]
                s[m + _VELOCITY] = travel / (gap * T)
            s[m + _PREDICTED] = s[m + _ACCEPTED] = x
            s[m + _GAP] = s[cx + _RUN] = 0.0
            if mass == 0 and abs(x - s[at + _START]) > _FACTOR_WARM_UP * s[cx + _QUANTILE]:
                s[at + _MOVED] = 1.0
        s[m + _LATEST] = latest
    return x if has_x else np.nan, v if has_v else np.nan, stepped


@compiled(inline=True)
def _admit_effort(s: Float[np.ndarray, " s"], at: int, u: float) -> tuple[float, bool]:
    """Return the effort, the last accepted one where it is missing, and whether it is unknown."""
    if not _is_possible(u):
        s[at + MISSING_VALUES] += 1.0
        return s[at + _LAST_EFFORT], True
    largest = s[at + LARGEST_EFFORT]
    factor = _EFFORT if s[at + _MOVED] > 0.0 else _EFFORT_AT_REST
    if largest > 0.0 and abs(u) > factor * largest:
        s[at + _EFFORT_RUN] += 1.0
        if s[at + _EFFORT_RUN] <= LASTING:
            s[at + EFFORT_GLITCHES] += 1.0
            return s[at + _LAST_EFFORT], True
    s[at + _EFFORT_RUN] = 0.0
    s[at + LARGEST_EFFORT] = max(largest, abs(u))
    s[at + _LAST_EFFORT] = u
    return u, False


@compiled(inline=True)
def admit(
    s: Float[np.ndarray, " s"], at: int, u: float, x: float, v: float, x2: float, v2: float
) -> tuple[bool, float, bool, float, float, float, float, bool]:
    """Admit a sample.

    Returns
    -------
    Whether there is a sample (a negative delay lets the first ones wait), its effort, whether the
    force in the interval that it begins is unknown, position and velocity of both masses (NaN
    where missing or not measured), and whether the motion stepped.
    """
    s[at + SAMPLES_SEEN] += 1.0
    u, unknown = _admit_effort(s, at, u)
    lag, motion_lag = int(s[at + _LAG]), int(s[at + _MOTION_LAG])
    if lag > 0 or motion_lag > 0 or s[at + _FRACTION] > 0.0:
        n = int(s[at + _HEAD])
        s[at + _HEAD] += 1.0
        slot = at + _RING + _SLOT * (n % _SLOTS)
        s[slot], s[slot + 1] = u, 1.0 if unknown else 0.0
        s[slot + 2], s[slot + 3], s[slot + 4], s[slot + 5] = x, v, x2, v2
        if n < motion_lag:
            return False, u, True, x, v, x2, v2, False
        unknown = n < lag + 1
        if not unknown:
            new = at + _RING + _SLOT * ((n - lag) % _SLOTS)
            old = at + _RING + _SLOT * ((n - lag - 1) % _SLOTS)
            part = s[at + _FRACTION]
            u = (1.0 - part) * s[new] + part * s[old]
            unknown = s[new + 1] + (s[old + 1] if part > 0.0 else 0.0) > 0.0
        slot = at + _RING + _SLOT * ((n - motion_lag) % _SLOTS)
        x, v, x2, v2 = s[slot + 2], s[slot + 3], s[slot + 4], s[slot + 5]
    x, v, stepped = _admit_motion(s, at, 0, x, v, s[at + _HAS_VELOCITY] > 0.0)
    if s[at + _HAS_LOAD] > 0.0:
        x2, v2, also = _admit_motion(s, at, 1, x2, v2, s[at + _HAS_LOAD_VELOCITY] > 0.0)
        stepped = stepped or also
    return True, u, unknown, x, v, x2, v2, stepped
