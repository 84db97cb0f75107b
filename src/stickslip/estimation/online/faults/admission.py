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
- The first position or velocity that contradicts that acceleration is not used. If the next one
  agrees with it and not with those before, those were wrong (a glitch in the first sample), and the
  motion starts again.
- Positions that agree with each other and with the velocity, but not with those before, are an
  offset (samples that were not delivered): the motion starts again as soon as the tolerance, which
  grows with the time since the last accepted position, allows for it.
- A known delay of the effort is removed. For a delay of n + f samples the effort in the interval
  that begins with sample k is (1 - f) u(k-n) + f u(k-n-1). With a negative delay (an effort that
  acts before it is logged) the motion is delayed instead.

All memory is a part of the estimator's state, laid out by `ADMISSION_DTYPE`.
"""

from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import places
from stickslip.records import InputError

IMPOSSIBLE = 1e30
"""Size of a value beyond which it is missing [any unit]: its square is still a number."""

LASTING = 8
"""Contradicting samples in a row that are rejected; the next one is accepted as a step."""

LONGEST_DELAY = 30
"""Largest delay of the effort [samples]."""

_FACTOR = 8.0  # tolerance over the 90 % quantile of prediction errors: 13 standard deviations
_FACTOR_WARM_UP = 64.0  # the same while the quantile is estimated from few errors
_WARM_UP = 16  # errors
_FIRST = 64.0  # times the change of velocity that a sample may bring: before an error is learned
_AGREES = 4.0
"""Ratio of a contradiction to the change since the sample before, above which both samples agree
with each other and contradict those before: an offset. An acceleration has less for 7 samples."""
_MOST_RESTARTS = 3
"""Most glitches before the first learned error that are forgotten: the counts of a coarse encoder
at low speed look like them."""
_RECENT = 2.0  # tolerance over the largest recent error
_FADING = 1.0 / 4096.0  # relative decay of that largest error in a sample
_RATE = 0.01  # step of the quantile's estimate (relative, downwards; 9 times that upwards)
_RATE_WARM_UP = 0.3  # the same, divided by the number of errors
_ACCELERATION = 3.0  # largest net force over the largest effort so far
_EFFORT = 10.0
"""An effort larger than this many times the largest so far is a glitch, once the axis has moved."""
_EFFORT_AT_REST = 1e6  # the same before: the effort so far may have been too small to move it

_KNOWN_INERTIA = 4.0  # standard deviations

_SLOTS = LONGEST_DELAY + 2

_ERRORS = np.dtype(
    [
        ("quantile", "f8"),  # 90 % of the prediction errors
        ("largest", "f8"),  # recently
        ("count", "i8"),
        ("run", "i8"),  # rejected values in a row
        ("restarts", "i8"),  # forgotten glitches before the first error was learned
    ]
)
_MASS = np.dtype(
    [
        ("is_driven", "i8"),  # 1 for the driven mass, 0 for the load
        ("known", "i8"),  # whether there was a sample
        ("predicted", "f8"),  # position that the next sample should have
        ("accepted", "f8"),  # last accepted position
        ("gap", "i8"),  # samples since then
        ("velocity", "f8"),
        ("latest", "f8"),  # position of the latest sample, accepted or not
        ("latest_velocity", "f8"),  # likewise
        ("position_errors", _ERRORS),
        ("velocity_errors", _ERRORS),
    ]
)
_SAMPLE = np.dtype(
    [
        ("effort", "f8"),
        ("unknown", "i8"),  # whether the effort is
        ("x", "f8"),
        ("v", "f8"),
        ("x2", "f8"),
        ("v2", "f8"),
    ]
)
ADMISSION_DTYPE = np.dtype(
    [
        ("lag", "i8"),  # whole samples by which the effort is delayed
        ("fraction", "f8"),  # the rest of it
        ("motion_lag", "i8"),  # samples by which the motion is delayed
        ("sampling_time", "f8"),
        ("mobility", "f8"),  # T / m; 0 as long as the inertia is unknown
        ("head", "i8"),  # samples in the ring so far
        ("last_effort", "f8"),
        ("effort_run", "i8"),  # rejected efforts in a row
        ("samples_seen", "i8"),
        ("missing_values", "i8"),
        ("effort_glitches", "i8"),
        ("motion_glitches", "i8"),  # positions of either mass
        ("velocity_glitches", "i8"),
        ("motion_steps", "i8"),
        ("largest_effort", "f8"),
        ("has_velocity", "i8"),
        ("has_load", "i8"),
        ("has_load_velocity", "i8"),
        ("start", "f8"),  # first position of the driven mass
        ("moved", "i8"),  # whether it has moved
        ("driven", _MASS),
        ("load", _MASS),
        ("ring", _SAMPLE, (_SLOTS,)),  # of samples
    ]
)
"""Memory of the admission."""

ADMISSION_SIZE = places(ADMISSION_DTYPE)


def set_admission(
    admission: Any,
    *,
    sampling_time: float,
    effort_delay: float,
    inertia: float | None,
    measured: tuple[bool, bool, bool],
) -> None:
    """Initialise the memory, zeros before, in place.

    ``effort_delay`` is the number of samples by which the effort acts after it is logged, negative
    if it acts before; ``inertia`` that of the driven mass [kg or kg m^2], None if it is unknown;
    ``measured`` says whether velocity, load position and load velocity are.
    """
    if not abs(effort_delay) <= LONGEST_DELAY:
        raise InputError(
            "out_of_range",
            name="effort_delay",
            value=effort_delay,
            least=-LONGEST_DELAY,
            most=LONGEST_DELAY,
            unit="samples",
        )
    motion_lag = max(int(np.ceil(-effort_delay)), 0)
    lag, fraction = divmod(effort_delay + motion_lag, 1.0)
    admission.lag, admission.fraction, admission.motion_lag = lag, fraction, motion_lag
    admission.sampling_time = sampling_time
    admission.mobility = 0.0 if inertia is None else sampling_time / inertia
    admission.driven.is_driven = 1
    admission.has_velocity, admission.has_load, admission.has_load_velocity = measured


@compiled(inline=True)
def restart_admission(s: Any) -> None:
    """Forget the motion and the samples under way, but no errors or largest efforts: a gap."""
    s.head = s.driven.known = s.load.known = 0


@compiled(inline=True)
def learn_inertia(s: Any, inertia: float, variance: float) -> None:
    """Take an estimated inertia, if it is more than `_KNOWN_INERTIA` standard deviations."""
    if inertia * inertia > _KNOWN_INERTIA**2 * variance and inertia > 0.0:
        s.mobility = s.sampling_time / inertia


@compiled(inline=True)
def _tolerance(errors: Any) -> float:
    """Return how large a prediction error may be: max(8 q_90, 2 largest).

    Before the first error is learned, it is 64 times the first one that was not used, or zero:
    nothing else shows a glitch in the rest before the first motion.
    """
    if errors.count == 0:
        return _FACTOR_WARM_UP * errors.quantile
    factor = _FACTOR if errors.count >= _WARM_UP else _FACTOR_WARM_UP
    return max(factor * errors.quantile, _RECENT * errors.largest)


@compiled(inline=True)
def _learn_step(s: Any, errors: Any, error: float) -> bool:
    """Count an accepted step; return whether the values rejected before are no glitches.

    With an unknown inertia the step is an acceleration. The ``error`` is then that of one sample,
    and the tolerance is learned anew from it.
    """
    if s.mobility > 0.0:
        s.motion_steps += 1
        return False
    counted = errors.count > 0
    errors.count, errors.quantile, errors.largest = 1, error, 0.0
    return counted


@compiled(inline=True)
def _first(errors: Any) -> float:
    """Return the factor of the change of velocity that a sample may bring: larger for a first one.

    A spring that was stretched before the log, or the load of an arm, accelerates more than effort.
    """
    return _FIRST if errors.count == 0 and errors.run == 0 else 1.0


@compiled(inline=True)
def _learn_error(errors: Any, error: float) -> None:
    """Update quantile and recent maximum with an accepted error other than an exact zero."""
    if error == 0.0:
        return
    errors.count += 1
    if errors.count == 1:
        errors.quantile = error
        return
    rate = max(_RATE, _RATE_WARM_UP / errors.count)
    if error > errors.quantile:
        errors.quantile *= 1.0 + 9.0 * rate
    else:
        errors.quantile *= 1.0 - rate
    errors.largest *= 1.0 - _FADING
    if errors.count > _WARM_UP:
        errors.largest = max(errors.largest, error)


@compiled(inline=True)
def _forget_glitch(errors: Any) -> None:
    """Forget the first error, which the second one has shown to be a glitch."""
    if errors.restarts < _MOST_RESTARTS:
        errors.restarts += 1
        errors.quantile = 0.0


@compiled(inline=True)
def _is_glitch_before(errors: Any, error: float, change: float) -> bool:
    """Return whether the second value shows that those before the first error were glitches.

    ``error`` and ``change`` are its differences from the prediction and from the sample before.
    """
    return errors.count == 0 and errors.run == 1 and _AGREES * change < error


@compiled(inline=True)
def continued(mass: Any) -> tuple[float, float]:
    """Return predicted position and last velocity of a mass, in place of missing ones."""
    return mass.predicted, mass.velocity


@compiled(inline=True)
def _is_possible(value: float) -> bool:
    return abs(value) <= IMPOSSIBLE  # False for NaN


@compiled(inline=True)
def _admit_velocity(s: Any, m: Any, v: float, change: float) -> tuple[bool, bool]:
    """Return whether a possible velocity of a mass is accepted, and whether it stepped.

    ``change`` is the change of velocity that a sample may bring.
    """
    errors = m.velocity_errors
    error = abs(v - m.velocity)
    accepted, stepped = True, False
    if _is_glitch_before(errors, error, abs(v - m.latest_velocity)):
        _forget_glitch(errors)
    elif error <= _tolerance(errors) + change * (_first(errors) + errors.run):
        _learn_error(errors, error)
    else:
        errors.run += 1
        if errors.count == 0 and errors.run == 1 and s.mobility > 0.0:
            errors.quantile = error  # a first error, to compare the second one with
        accepted = stepped = errors.run > LASTING
        if stepped:
            if _learn_step(s, errors, error / errors.run):
                s.velocity_glitches -= LASTING
        else:
            s.velocity_glitches += 1 if errors.count > 0 else 0
    if accepted:
        m.velocity = v
        errors.run = 0
    m.latest_velocity = v
    return accepted, stepped


@compiled(inline=True)
def _admit_position(
    s: Any, m: Any, x: float, change: float, before: float, measured: bool, stepped: bool
) -> tuple[bool, bool]:
    """Return whether a possible position of a mass is accepted, and whether its motion stepped.

    ``change`` is the change of velocity that a sample may bring, ``before`` the velocity before
    this sample, and ``stepped`` whether the velocity stepped.
    """
    T, gap = s.sampling_time, m.gap
    errors = m.position_errors
    error = abs(x - m.predicted)
    allowed = _tolerance(errors)
    if measured:
        allowed += T * change * (_first(errors) - 0.5 + m.velocity_errors.run)
    else:
        allowed = gap * (allowed + T * change * (_first(errors) + 0.5 * (gap - 1.0)))
    off_latest = abs(x - m.latest - T * before)
    offset = not measured and errors.run > 0 and _AGREES * off_latest < error
    accepted = True
    if _is_glitch_before(errors, error, abs(x - m.latest)):
        _forget_glitch(errors)
        stepped = True
        if m.is_driven and s.moved == 0:
            s.start = x
    elif error > allowed and not stepped:
        errors.run += 1
        if errors.count == 0 and errors.run == 1:
            errors.quantile = error  # a first error, to compare the second one with
        accepted = stepped = errors.run > LASTING
        if stepped:
            if _learn_step(s, errors, 2.0 * error / (float(gap) * gap)):
                s.motion_glitches -= LASTING
        else:
            s.motion_glitches += 1 if errors.count > 0 else 0
    elif gap == 1 and not stepped:
        _learn_error(errors, error)
    elif offset and errors.count > 0 and error > _tolerance(errors):
        s.motion_steps += 1
        stepped = True
    elif errors.count == 0 and errors.run == 1 and _AGREES * error < errors.quantile:
        _forget_glitch(errors)
    if accepted:
        if not measured:
            travel = (x - m.latest) * gap if stepped else x - m.accepted
            m.velocity = travel / (gap * T)
        m.predicted = m.accepted = x
        m.gap = errors.run = 0
        if m.is_driven and abs(x - s.start) > _FACTOR_WARM_UP * errors.quantile:
            s.moved = 1
    m.latest = x
    return accepted, stepped


@compiled(inline=True)
def _admit_motion(s: Any, m: Any, x: float, v: float, measured: bool) -> tuple[float, float, bool]:
    """Return position and velocity of a mass, NaN where missing, and whether they stepped."""
    T = s.sampling_time
    has_x, has_v = _is_possible(x), measured and _is_possible(v)
    whole = has_x and (has_v or not measured)
    if not whole:
        s.missing_values += 1
    if m.known == 0:
        if not whole:
            return np.nan, np.nan, False
        if m.is_driven and s.moved == 0:
            s.start = x
        m.known = 1
        m.predicted = m.accepted = m.latest = x
        m.velocity = m.latest_velocity = v if measured else 0.0
        m.gap = m.position_errors.run = m.velocity_errors.run = 0
        return x, v if measured else np.nan, False
    stepped = False
    change = max(_ACCELERATION * s.largest_effort * s.mobility, m.velocity_errors.largest)
    before = m.velocity
    if has_v:
        has_v, stepped = _admit_velocity(s, m, v, change)
    elif measured:
        m.velocity_errors.run = min(m.velocity_errors.run + 1, LASTING)
    m.predicted += 0.5 * T * (before + m.velocity) if measured else T * before
    m.gap += 1
    if has_x:
        has_x, stepped = _admit_position(s, m, x, change, before, measured, stepped)
    return x if has_x else np.nan, v if has_v else np.nan, stepped


@compiled(inline=True)
def _admit_effort(s: Any, u: float) -> tuple[float, bool]:
    """Return the effort, the last accepted one where it is missing, and whether it is unknown."""
    if not _is_possible(u):
        s.missing_values += 1
        return s.last_effort, True
    largest = s.largest_effort
    factor = _EFFORT if s.moved > 0 else _EFFORT_AT_REST
    if largest > 0.0 and abs(u) > factor * largest:
        s.effort_run += 1
        if s.effort_run <= LASTING:
            s.effort_glitches += 1
            return s.last_effort, True
    s.effort_run = 0
    s.largest_effort = max(largest, abs(u))
    s.last_effort = u
    return u, False


@compiled(inline=True)
def admit(
    s: Any, u: float, x: float, v: float, x2: float, v2: float
) -> tuple[bool, float, bool, float, float, float, float, bool]:
    """Admit a sample.

    Returns whether there is a sample (a negative delay lets the first ones wait), its effort,
    whether the force in the interval that it begins is unknown, position and velocity of both
    masses (NaN where missing or not measured), and whether the motion stepped.
    """
    s.samples_seen += 1
    u, unknown = _admit_effort(s, u)
    if s.lag > 0 or s.motion_lag > 0 or s.fraction > 0.0:
        n = s.head
        s.head += 1
        slot = s.ring[n % _SLOTS]
        slot.effort, slot.unknown = u, 1 if unknown else 0
        slot.x, slot.v, slot.x2, slot.v2 = x, v, x2, v2
        if n < s.motion_lag:
            return False, u, True, x, v, x2, v2, False
        unknown = n < s.lag + 1
        if not unknown:
            new, old = s.ring[(n - s.lag) % _SLOTS], s.ring[(n - s.lag - 1) % _SLOTS]
            part = s.fraction
            u = (1.0 - part) * new.effort + part * old.effort
            unknown = new.unknown > 0 or (part > 0.0 and old.unknown > 0)
        slot = s.ring[(n - s.motion_lag) % _SLOTS]
        x, v, x2, v2 = slot.x, slot.v, slot.x2, slot.v2
    x, v, stepped = _admit_motion(s, s.driven, x, v, s.has_velocity > 0)
    if s.has_load:
        x2, v2, also = _admit_motion(s, s.load, x2, v2, s.has_load_velocity > 0)
        stepped = stepped or also
    return True, u, unknown, x, v, x2, v2, stepped
