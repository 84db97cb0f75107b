"""Position, velocity, acceleration and the effort that acts, as rows of the inverse dynamics."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.fit.solve import check_excited
from stickslip.estimation.regression.idim_least_squares import SETTLING_PERIODS
from stickslip.estimation.signals.kinematics import (
    REST_PERIODS,
    LowPass,
    central_difference,
    decimate,
    decimated_start,
    default_cutoff,
    noise_level,
    rests,
    slow_speed,
)
from stickslip.records import AxisLog, InputError, positive

__all__ = ["RowSettings", "SmoothMotion"]

_LEAST_ROWS = 50


@dataclass(frozen=True, kw_only=True)
class SmoothMotion:
    """A log's motion without its noise, sample by sample.

    Attributes
    ----------
    time
        [s], shape (n,).
    position, velocity, acceleration
        Smoothed and differentiated [m, m/s, m/s^2, or rad ...], shape (n,).
    effort
        The mean of the efforts held before and after each instant, which is what acts there
        [N or N m], shape (n,).
    slow
        Speed below which the axis may be at rest [m/s or rad/s].
    resting
        Whether a sample belongs to a rest, shape (n,).
    settling
        Samples after which the filter has forgotten how the log began.
    factor
        Of the decimation.
    """

    time: Float[np.ndarray, " n"]
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]
    slow: float
    resting: Bool[np.ndarray, " n"]
    settling: int
    factor: int

    def kept(self) -> Bool[np.ndarray, " n"]:
        """Return which samples `decimated` keeps, a row each: none at rest."""
        marks = np.zeros(self.time.size, dtype=bool)
        after = self.time.size - self.settling
        marks[self.settling + decimated_start(after, self.factor) :: self.factor] = True
        return marks & ~self.resting

    def decimated(self, columns: Float[np.ndarray, "n p"]) -> Float[np.ndarray, "m p"]:
        """Return rows of columns: all filtered alike, so that a linear relation stays one."""
        rows = decimate(columns[self.settling :], self.factor)
        start = decimated_start(self.time.size - self.settling, self.factor)
        return rows[~self.resting[self.settling :][start :: self.factor]]


@dataclass(frozen=True, kw_only=True)
class RowSettings:
    """How a log becomes rows of the inverse dynamics, as `stickslip.estimation.IdimLeastSquares`.

    The one difference is the effort. A drive holds it from each sample to the next, so that around
    a sample the mean of two efforts acts; taking the later one alone shifts it by half a sample.

    Attributes
    ----------
    cutoff
        Of the low-pass on the position [Hz]; None takes a tenth of the sampling rate and at most
        100 Hz.
    filter_order
        Of one pass of that low-pass.
    decimation
        Keep every so-manieth sample; None keeps one a period of the cutoff frequency.
    held
        Whether the effort is held from sample to sample; if not, it is taken as it stands, as the
        literature does.

    Raises
    ------
    InputError
        If a setting is out of range.
    """

    cutoff: float | None = None
    filter_order: int = 4
    decimation: int | None = None
    held: bool = True

    def __post_init__(self) -> None:
        if self.cutoff is not None:
            positive("cutoff", self.cutoff, "Hz")
        for name, value in (("filter_order", self.filter_order), ("decimation", self.decimation)):
            if value is not None and value < 1:
                raise InputError(
                    f"{name} is {value}, it must be at least 1", remedy=f"raise {name}"
                )

    def motion(self, log: AxisLog) -> SmoothMotion:
        """Return the smooth motion that a log shows.

        Raises
        ------
        InputError
            If the log has gaps or is too short, or nothing moves or pushes in it.
        """
        check_excited(log)
        T = log.sampling_time
        cutoff = default_cutoff(T) if self.cutoff is None else self.cutoff
        low_pass = LowPass(order=self.filter_order, cutoff=cutoff)
        period = 1.0 / (cutoff * T)
        factor = max(round(period), 1) if self.decimation is None else self.decimation
        settling = max(round(SETTLING_PERIODS * period) - 1, 0)
        least = settling + _LEAST_ROWS * factor
        if log.segment_starts.size > 1 or len(log) < least:
            raise InputError(
                f"the log has {log.segment_starts.size - 1} gaps and {len(log)} samples; it must "
                f"have none, and at least {least} samples",
                where=log.name,
                remedy="take the longest of log.segments()",
            )
        x = low_pass.apply(log.measured_position, T)
        v = central_difference(x, T)
        noise = noise_level(log.measured_position) * low_pass.noise_gain(T, derivatives=1)
        slow = slow_speed(float(np.max(np.abs(v))), noise)
        before = np.concatenate([log.effort[:1], log.effort[:-1]])
        return SmoothMotion(
            time=log.time,
            position=x,
            velocity=v,
            acceleration=central_difference(v, T),
            effort=0.5 * (before + log.effort) if self.held else log.effort,
            slow=slow,
            resting=rests(v, slow, round(REST_PERIODS * period)),
            settling=settling,
            factor=factor,
        )
