"""Detection of measured velocities that disagree with the measured positions."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.signals.kinematics import LowPass, noise_level
from stickslip.estimation.signals.sensor_noise import longest_in_motion
from stickslip.records import AxisLog, InputError

LARGEST_DELAY = 0.1
"""Largest delay of a measured velocity [samples]: half a sample moves energy from friction to
inertia."""

LARGEST_GAIN_ERROR = 0.005
"""Largest relative error of a measured velocity [-]: the inertia changes with its square."""

PLAUSIBLE_GAIN = (0.4, 2.5)
"""Velocity over the derivative of the position [-], outside of which it is in another unit, has the
wrong sign, or is another quantity. Edges of an encoder that are counted once or twice are a factor
of two."""

LEAST_RANGE = 30.0
"""Range of positions over their noise [-], beyond which the axis moves for certain."""

_SIGNIFICANCE = 5.0  # standard deviations beyond which an error counts [-]
_LEAST_SAMPLES = 50  # rows of the comparison [-]: its normal approximation needs them
_SHIFT_PERIODS = 1.0  # of the cutoff: noise is almost uncorrelated over this time


@dataclass(frozen=True, kw_only=True)
class VelocityMatch:
    """A measured velocity as ``gain`` times the position's derivative ``delay`` ago."""

    gain: float  #: [-].
    gain_std: float  #: Its standard deviation [-].
    delay: float  #: Delay of the velocity [s]; negative if it precedes the motion.
    delay_std: float  #: Its standard deviation [s].
    #: Relative error of the comparison if the acceleration changes within the samples [-].
    trapezium_error: float

    @property
    def foreign(self) -> bool:
        """Whether the velocity cannot be that of the position."""
        low, high = PLAUSIBLE_GAIN
        nearest = min(max(self.gain, low), high)
        return abs(self.gain - nearest) > _SIGNIFICANCE * self.gain_std

    @property
    def scaled(self) -> bool:
        """Whether the velocity is too large or too small."""
        error = abs(self.gain - 1.0)
        allowed = max(LARGEST_GAIN_ERROR, self.trapezium_error)
        return error > allowed and error > _SIGNIFICANCE * self.gain_std

    def shifted(self, sampling_time: float) -> bool:
        """Return whether the velocity has a delay, for a sampling time [s]."""
        size = abs(self.delay)
        return size > LARGEST_DELAY * sampling_time and size > _SIGNIFICANCE * self.delay_std


def velocity_match(
    position: Float[np.ndarray, " n"],
    velocity: Float[np.ndarray, " n"],
    low_pass: LowPass,
    sampling_time: float,
) -> VelocityMatch | None:
    """Return how a velocity compares with a position, or None if the motion does not show it.

    A velocity with the gain g and the delay tau is v = g (dx/dt - tau d2x/dt2), so that dx/dt is
    v / g + (tau / g) dv/dt. Both sides are low-passed alike. Noise of v would bias 1/g to zero, so
    the equations are multiplied by v and dv/dt of some samples earlier and later (instrumental
    variables), which share the motion and not the noise.
    """
    T = sampling_time
    # The low-pass, run both ways, leaves about one independent sample in a period of its cutoff
    period = max(1.0 / (low_pass.cutoff * T), 1.0)
    shift = max(round(_SHIFT_PERIODS * period), 1)
    if position.size < _LEAST_SAMPLES + 2 * shift:
        return None
    found = low_pass.apply(np.diff(position) / T, T)
    given = low_pass.apply(0.5 * (velocity[1:] + velocity[:-1]), T)
    acceleration = low_pass.apply(np.diff(velocity) / T, T)
    columns = np.column_stack([given, acceleration])
    around = columns[2 * shift :] + columns[: -2 * shift]
    inner = slice(shift, -shift)
    power = np.sum(columns[inner] ** 2, axis=0)
    if np.any(power == 0.0):
        return None
    products = around.T @ columns[inner]
    if np.linalg.cond(products / np.sqrt(np.outer(power, power))) > 1.0 / np.finfo(float).eps:
        return None
    inverse = np.linalg.inv(products)
    slope, rate = (inverse @ (around.T @ found[inner])).tolist()
    residual = found[inner] - columns[inner] @ np.array([slope, rate])
    spread = float(np.mean(residual**2)) * period * inverse @ (around.T @ around) @ inverse.T
    slope_std, rate_std = np.sqrt(np.diag(spread)).tolist()
    if abs(slope) <= _SIGNIFICANCE * slope_std:
        return None
    return VelocityMatch(
        gain=1.0 / slope,
        gain_std=slope_std / slope**2,
        delay=rate / slope,
        delay_std=rate_std / abs(slope),
        trapezium_error=T**2 / 12.0 * float(power[1] / power[0]),
    )


def without_wrong_velocity(
    log: AxisLog, low_pass: LowPass, *, load: bool
) -> tuple[AxisLog, tuple[str, ...]]:
    """Return the log without velocities with a delay or another scale, and notes on them.

    Drives often log the difference of the last two positions, with a delay of half a sample, or a
    filtered velocity. Differences of the position are more accurate. A velocity of another unit or
    sign is an InputError.
    """
    notes: tuple[str, ...] = ()
    for name in ("velocity", "load velocity") if load else ("velocity",):
        note = checked_velocity(log, low_pass, name)[1]
        if note:
            log, notes = replace(log, **{_field(name): None}), (*notes, note)
    return log, notes


def checked_velocity(
    log: AxisLog, low_pass: LowPass, name: str = "velocity"
) -> tuple[VelocityMatch | None, str]:
    """Return how a measured velocity compares with its position, and a note if it is wrong.

    No match if one of both is not measured, or the motion does not show it. A velocity of another
    unit or sign is an InputError. ``name`` is ``"velocity"`` or ``"load velocity"``.
    """
    longest = longest_in_motion(log.segments())
    velocity = getattr(longest, _field(name))
    position = getattr(longest, _field(name).replace("velocity", "position"))
    if velocity is None or position is None:
        return None, ""
    moves = float(np.ptp(position)) > LEAST_RANGE * noise_level(position)
    if moves and not np.any(velocity):  # of a driver that does not measure it
        return None, _UNUSED.format(name=name, error="0 in all samples of a motion")
    match = velocity_match(position, velocity, low_pass, log.sampling_time)
    if match is not None and match.foreign:
        turned = -1.0 / PLAUSIBLE_GAIN[0] <= match.gain <= -PLAUSIBLE_GAIN[0]
        raise InputError(
            "velocity_reversed" if turned else "velocity_foreign",
            where=log.name,
            name=name,
            gain=match.gain,
            unit=log.unit("velocity"),
        )
    error = "" if match is None else _error(match, log.sampling_time)
    return match, _UNUSED.format(name=name, error=error) if error else ""


_UNUSED = "the measured {name} is {error}, so differences of the position are used instead"


def _field(name: str) -> str:
    return "measured_" + name.replace(" ", "_")


def _error(match: VelocityMatch, sampling_time: float) -> str:
    """Return the error of a velocity in words; empty if it has none."""
    shifted = match.shifted(sampling_time)
    if not (match.scaled or shifted):
        return ""
    text = f"{match.gain:.4g} times the derivative of the position"
    if not shifted:
        return text
    side, size = "behind" if match.delay > 0 else "ahead of", abs(match.delay)
    samples = size / sampling_time
    return f"{text} and {1e3 * size:.3g} ms {side} the position ({samples:.2g} samples)"
