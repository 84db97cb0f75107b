"""Noise and steps of position sensors, and the low-pass that they need."""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Float

from stickslip.estimation.signals.kinematics import LowPass, central_difference, noise_level
from stickslip.records import AxisLog, share_text

QUIET_VELOCITY = 0.01
"""Noise of a differentiated velocity, relative to its rms, above which the cutoff is lowered: it
biases viscous friction by its square, and turns the sign of slow motion."""

LEAST_CUTOFF = 5.0
"""Lowest cutoff frequency [Hz]: friction changes its direction with the motion."""

_STEP = 1.4  # ratio of one cutoff to the next lower one [-]
_MOTION_FOR_NOISE = 2.0  # largest power that a step removes, over that of the noise it removes [-]
_HARMLESS = 0.001  # share of the power that a step may remove besides [-]
_EDGE_PERIODS = 2.0  # of the lowest cutoff, at both ends: the filter extrapolates there
_FEW_STEPS = 10  # most steps of the position of an axis at rest [-]


def encoder_step(position: Float[np.ndarray, " n"]) -> float:
    """Return the step of the encoder behind a position [m or rad]; 0 if none is detected.

    It is detected if the axis takes many samples from count to count: most steps are then isolated
    between equal samples. Slow sampling of a fast motion gives large steps too, but one after the
    other. The position has no gaps.
    """
    steps = np.abs(np.diff(position))
    taken = np.flatnonzero(steps)
    if taken.size == 0:
        return 0.0
    seen = taken.size < _FEW_STEPS or np.mean(np.diff(taken) > 1) > 0.5
    return float(np.min(steps[taken])) if seen else 0.0


def position_noise(position: Float[np.ndarray, " n"]) -> float:
    """Return the standard deviation of the noise of a position [m or rad], rounding included."""
    return max(noise_level(position), encoder_step(position) / float(np.sqrt(12.0)))


def longest_in_motion(parts: Iterable[AxisLog]) -> AxisLog:
    """Return the longest stretch whose position changes, or the longest if there is none.

    An encoder at rest shows neither its step nor any noise.
    """
    return max(parts, key=lambda part: (float(np.ptp(part.measured_position)) > 0.0, len(part)))


def chosen_cutoff(
    log: AxisLog, low_pass: LowPass, shortest: int, *, load: bool
) -> tuple[float, tuple[str, ...]]:
    """Return the cutoff [Hz] at which velocities from positions are quiet, and a note on it.

    It is that of the low-pass unless noise makes more than 1 % of such a velocity: then the cutoff
    is lowered until it does not, or until the filter removes more motion than noise. ``shortest``
    is the least number of its periods in the longest stretch [-], ``load`` whether the velocity of
    the load is needed too.
    """
    longest = longest_in_motion(log.segments())
    positions: list[Float[np.ndarray, " n"]] = []
    if longest.measured_velocity is None:
        positions.append(longest.measured_position)
    if load and longest.measured_load_velocity is None:
        loads = longest.measured_load_position
        positions.extend([] if loads is None else [loads])
    least = max(LEAST_CUTOFF, shortest / (len(longest) * log.sampling_time))
    quiet = [_quiet_cutoff(x, low_pass, log.sampling_time, least) for x in positions]
    cutoff, before, left = min(quiet, default=(low_pass.cutoff, 0.0, 0.0))
    if cutoff == low_pass.cutoff:
        return cutoff, ()
    note = (
        f"velocities are differences of positions smoothed at {cutoff:.3g} Hz: at "
        f"{low_pass.cutoff:.3g} Hz noise of the position would make {share_text(before)} of them, "
        f"now it makes {share_text(left)}"
    )
    return cutoff, (note,)


def _quiet_cutoff(
    position: Float[np.ndarray, " n"], low_pass: LowPass, sampling_time: float, least: float
) -> tuple[float, float, float]:
    """Return the cutoff [Hz] for one position, and the share of noise [-] before and after."""
    T = sampling_time
    noise = position_noise(position)

    def powers(cutoff: float) -> tuple[float, float]:
        """Return the mean squared velocity, and that of its noise."""
        smoother = LowPass(order=low_pass.order, cutoff=cutoff)
        velocity = central_difference(smoother.apply(position, T), T)
        edge = min(round(_EDGE_PERIODS / (least * T)), velocity.size // 4)
        squared = float(np.mean(velocity[edge : velocity.size - edge] ** 2))
        return squared, (noise * smoother.noise_gain(T, derivatives=1)) ** 2

    def share(power: float, noisy: float) -> float:
        return float(np.sqrt(noisy / max(power - noisy, noisy))) if noisy > 0 else 0.0

    cutoff = low_pass.cutoff
    power, noisy = powers(cutoff)
    before = share(power, noisy)
    while share(power, noisy) > QUIET_VELOCITY and cutoff / _STEP >= least:
        lower_power, lower_noisy = powers(cutoff / _STEP)
        removed = noisy - lower_noisy
        if power - lower_power > _MOTION_FOR_NOISE * removed + _HARMLESS * lower_power:
            break
        cutoff, power, noisy = cutoff / _STEP, lower_power, lower_noisy
    return cutoff, before, share(power, noisy)
