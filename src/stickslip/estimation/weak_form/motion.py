"""Motion of a log: where the axis slips, in which direction, and how far."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import comb

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.signal import lfilter

from stickslip.estimation.prepare import PreparedLog
from stickslip.estimation.signals.kinematics import noise_quantile
from stickslip.estimation.weak_form.windows import Weight, convolved


@dataclass(frozen=True, kw_only=True)
class MotionTuning:
    """Tuning of the detection of slip."""

    slow_share: float = 0.02
    """Speed below which the axis may be at rest, relative to its largest [-]. Breakaway and the
    history of the motion act below it; twice or half of it changes little."""
    slow_noise: float = 5.0  #: The same in standard deviations of the speed's noise [-].
    narrowest: int = 4  #: Half of the narrowest window for a velocity [samples].
    widest: float = 0.05  #: Half of the widest window for a velocity [s]: moves are longer.


@dataclass(frozen=True, kw_only=True)
class SlipMotion:
    """One stretch without gaps, sample by sample."""

    time: Float[np.ndarray, " n"]  # [s]
    effort: Float[np.ndarray, " n"]  # [N or N m]
    position: Float[np.ndarray, " n"]  # [m or rad]
    velocity: Float[np.ndarray, " n"]  # smoothed [m/s or rad/s]
    direction: Int[np.ndarray, " n"]  # of travel: 1, -1, or 0 where the axis may be at rest
    travelled: Float[np.ndarray, " n"]  # since the direction last changed [m or rad]
    model_effort: Float[np.ndarray, " n"]  # at each time stamp [N or N m]
    usable: Bool[np.ndarray, " n"]  # effort and position were recorded as they were


@dataclass(frozen=True, kw_only=True)
class SlipMotions:
    """The motion of a log, in the stretches between its gaps."""

    stretches: tuple[SlipMotion, ...]
    slow: float  # speed below which the axis may be at rest [m/s or rad/s]
    position_noise: float
    """Standard deviation of a position's noise while the axis moves, rounding and jitter of the
    sampling included [m or rad]."""
    noise_correlation: float = 0.0  # of that noise from one sample to the next [-]

    def noise_of(self, taps: Float[np.ndarray, " taps"]) -> float:
        """Return the standard deviation of a weighted sum of positions by their noise.

        sum_ij w_i w_j r^|i-j| by one recursive filter, with the correlation r.
        """
        filtered = lfilter([1.0], [1.0, -self.noise_correlation], taps)
        return self.position_noise * float(np.sqrt(2.0 * (taps @ filtered) - taps @ taps))

    def moving(
        self, values: Callable[[SlipMotion], Float[np.ndarray, " n"]]
    ) -> Float[np.ndarray, " m"]:
        """Return a function of the motion at the samples in slip, in its unit."""
        return np.concatenate([values(m)[m.direction != 0] for m in self.stretches])

    def without(
        self, marks: Callable[[SlipMotion], Bool[np.ndarray, " n"]]
    ) -> tuple["SlipMotions", float]:
        """Return the motions with the marked samples not usable, and the share of these [-]."""
        marked = [marks(m) for m in self.stretches]
        stretches = tuple(
            replace(m, usable=m.usable & ~out)
            for m, out in zip(self.stretches, marked, strict=True)
        )
        return replace(self, stretches=stretches), float(np.mean(np.concatenate(marked)))

    @property
    def reference_time(self) -> float:
        """Middle of the log [s], at which drifting parameters have the values given."""
        return 0.5 * float(self.stretches[0].time[0] + self.stretches[-1].time[-1])

    @property
    def reference_position(self) -> float:
        """Position at which a spring has no effort [m or rad].

        The origin; the middle of the travel if that is far from the origin.
        """
        position = self.moving(lambda m: m.position)
        if position.size == 0:
            return 0.0
        middle = 0.5 * float(np.max(position) + np.min(position))
        return middle if abs(middle) > _FAR * float(np.ptp(position)) else 0.0

    @property
    def largest_speed(self) -> float:
        """Largest smoothed speed [m/s or rad/s]."""
        return max(float(np.max(np.abs(m.velocity))) for m in self.stretches)

    @property
    def top_speed(self) -> float:
        """Smoothed speed that 99 % of the samples in slip are below [m/s or rad/s].

        The largest one may be that of a jump of the encoder.
        """
        moving = self.moving(lambda m: np.abs(m.velocity))
        return float(np.quantile(moving, 0.99)) if moving.size else 0.0


_FAR = 3.0
"""Distance of the travel from the origin over the range of positions [-], beyond which a spring has
its rest position elsewhere."""

_GROWTH = 1.4  # ratio of one half-width to the one before [-]
_LEAST_WINDOWS = 20  # half-widths in the longest stretch [-]: wider windows leave too little of it
_DIFFERENCE = 6  # order of the difference that removes smooth motion and keeps noise


def slip_motions(log: PreparedLog, tuning: MotionTuning) -> SlipMotions:
    """Return the motion of every stretch of a log, of which there is at least one."""
    T = log.sampling_time
    velocities, slow = _velocities(log, log.position_noise, tuning)
    noise = max(log.position_noise, _noise_in_motion(log, velocities, slow))
    if noise > log.position_noise:
        velocities, slow = _velocities(log, noise, tuning)
    motions: list[SlipMotion] = []
    for part, velocity in zip(log.parts, velocities, strict=True):
        direction = np.where(np.abs(velocity) < slow, 0, np.sign(velocity)).astype(np.int64)
        motions.append(
            SlipMotion(
                time=part.time,
                effort=part.effort,
                position=part.position,
                velocity=velocity,
                direction=direction,
                travelled=_travelled(direction, velocity, T),
                model_effort=part.model_effort,
                usable=part.usable,
            )
        )
    return SlipMotions(
        stretches=tuple(motions),
        slow=slow,
        position_noise=noise,
        # Jitter of the clock, seen in motion only, is white
        noise_correlation=log.noise_correlation if noise == log.position_noise else 0.0,
    )


def _velocities(
    log: PreparedLog, noise: float, tuning: MotionTuning
) -> tuple[list[Float[np.ndarray, " _"]], float]:
    """Return velocities from the narrowest window that is quiet enough, and the speed `slow`."""
    T = log.sampling_time
    half = tuning.narrowest
    longest = max(part.position.size for part in log.parts)
    while True:
        weight = Weight(half_width=half, sampling_time=T, margin=0)
        velocities = [_smoothed(part.position, weight) for part in log.parts]
        slow = tuning.slow_share * max(float(np.max(np.abs(v))) for v in velocities)
        noisy = tuning.slow_noise * (noise * float(np.linalg.norm(weight.first())))
        wider = max(int(half * _GROWTH), half + 1)
        if noisy <= slow or _LEAST_WINDOWS * wider > longest or wider * T > tuning.widest:
            return velocities, max(slow, noisy, np.finfo(float).tiny)
        half = wider


def _smoothed(position: Float[np.ndarray, " n"], weight: Weight) -> Float[np.ndarray, " n"]:
    """Return the velocity, with the position continued evenly beyond its ends."""
    reach = weight.reach
    padded = np.pad(position, reach, mode="reflect", reflect_type="odd")
    return convolved(padded, weight.first())[reach:-reach]


def _noise_in_motion(
    log: PreparedLog, velocities: list[Float[np.ndarray, " _"]], slow: float
) -> float:
    """Return the noise of positions while the axis moves, jitter of the clock included."""
    differences: list[Float[np.ndarray, " _"]] = []
    for part, velocity in zip(log.parts, velocities, strict=True):
        moving = np.abs(velocity) >= slow
        sixth = np.abs(np.diff(part.position, _DIFFERENCE))
        inside = np.lib.stride_tricks.sliding_window_view(moving, _DIFFERENCE + 1).all(axis=1)
        differences.append(sixth[inside])
    every = np.concatenate(differences)
    scale = float(np.sqrt(comb(2 * _DIFFERENCE, _DIFFERENCE)))
    return noise_quantile(every) / scale if every.size else 0.0


def _travelled(
    direction: Int[np.ndarray, " n"], velocity: Float[np.ndarray, " n"], T: float
) -> Float[np.ndarray, " n"]:
    """Return the distance since the direction of travel last changed."""
    path = np.cumsum(np.abs(velocity)) * T
    changed = np.concatenate(([True], np.diff(direction) != 0))
    start = np.maximum.accumulate(np.where(changed, np.arange(direction.size), 0))
    return path - path[start]
