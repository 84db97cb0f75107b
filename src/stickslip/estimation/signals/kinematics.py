"""From measured positions to smooth motion: zero-phase filters, differences, noise, rests."""

from dataclasses import dataclass
from math import comb

import numpy as np
from jaxtyping import Bool, Float
from scipy import signal

from stickslip.records import InputError

LARGEST_CUTOFF = 100.0
"""Cutoff frequency [Hz] published for the EMPS benchmark; drives act below it."""

SAMPLES_PER_PERIOD = 10.0
"""Fewest samples in a period of the cutoff [-]: central differences are accurate there."""

REST_SPEED = 0.005
"""Speed below which the axis may be at rest, over the largest speed in the log [-]."""

REST_NOISE = 3.0
"""The same in standard deviations of the speed's noise [-]."""

REST_PERIODS = 2.0
"""Least duration of a rest [periods of the cutoff]: a reversal passes through low speed faster."""

_NOISE_DIFFERENCE = 6  # order of the difference that removes smooth motion and keeps noise
_NOISE_QUANTILE = 0.8  # the largest fifth of the differences may be jumps [-]
_FREQUENCIES = 4096  # for integrals over the spectrum [-]
_NOISE_QUANTILE_NORMAL = 1.2815515655446004  # that quantile of abs(standard normal)

DECIMATION_ORDER = 8  # of the Chebyshev low-pass before decimation
DECIMATION_RIPPLE = 0.05  # dB
DECIMATION_PASSBAND = 0.8  # of the Nyquist frequency after it [-]


@dataclass(frozen=True, kw_only=True)
class LowPass:
    """A Butterworth low-pass run forwards and backwards, without delay."""

    order: int  #: Of one pass.
    cutoff: float  #: -3 dB frequency of one pass [Hz].

    @classmethod
    def of(cls, sampling_time: float, cutoff: float | None = None, order: int = 4) -> "LowPass":
        """Return the low-pass of a cutoff [Hz]; None takes that for the sampling time [s]."""
        return cls(order=order, cutoff=default_cutoff(sampling_time) if cutoff is None else cutoff)

    def apply(
        self, values: Float[np.ndarray, " n"], sampling_time: float
    ) -> Float[np.ndarray, " n"]:
        """Return the filtered values (ends extended by odd reflection over 3 orders)."""
        pad = min(3 * self.order, values.size - 1)
        filtered = signal.sosfiltfilt(self._sections(sampling_time), values, padlen=pad)
        return np.asarray(filtered, dtype=np.float64)

    def noise_gain(self, sampling_time: float, *, derivatives: int, decimation: int = 1) -> float:
        """Return the rms of unit noise filtered, differenced and decimated [1/s^derivatives]."""
        angle, response = signal.freqz_sos(self._sections(sampling_time), worN=_FREQUENCIES)
        gain = np.abs(response) ** 4 * (np.sin(angle) / sampling_time) ** (2 * derivatives)
        if decimation > 1:
            _, response = signal.freqz_sos(_decimation_filter(decimation), worN=_FREQUENCIES)
            gain = gain * np.abs(response) ** 4
        return float(np.sqrt(np.mean(gain)))

    def _sections(self, sampling_time: float) -> Float[np.ndarray, "s 6"]:
        nyquist = 0.5 / sampling_time
        if not 0 < self.cutoff < nyquist:
            raise InputError("cutoff_out_of_range", value=self.cutoff, most=nyquist)
        return np.asarray(signal.butter(self.order, self.cutoff / nyquist, output="sos"))


def default_cutoff(sampling_time: float) -> float:
    """Return the cutoff frequency [Hz] for a sampling time: a tenth of the rate, at most 100 Hz."""
    return min(LARGEST_CUTOFF, 1.0 / (SAMPLES_PER_PERIOD * sampling_time))


def central_difference(
    values: Float[np.ndarray, " n"], sampling_time: float
) -> Float[np.ndarray, " n"]:
    """Return the derivative by central differences, one-sided at both ends."""
    return np.asarray(np.gradient(values, sampling_time), dtype=np.float64)


def decimate(columns: Float[np.ndarray, "n p"], factor: int) -> Float[np.ndarray, "m p"]:
    """Low-pass each column without delay and keep every ``factor``-th sample, the last included.

    Chebyshev I of order 8 with 0.05 dB ripple at 0.8 of the new Nyquist frequency, forwards and
    backwards: the same filter on every column of a regression keeps it valid (parallel decimation).
    """
    if factor == 1:
        return columns
    pad = min(3 * DECIMATION_ORDER, columns.shape[0] - 1)
    filtered = signal.sosfiltfilt(_decimation_filter(factor), columns, axis=0, padlen=pad)
    filtered = np.asarray(filtered, dtype=np.float64)
    return filtered[decimated_start(columns.shape[0], factor) :: factor]


def _decimation_filter(factor: int) -> Float[np.ndarray, "s 6"]:
    """Return second-order sections: at a factor of 70 one polynomial of order 8 is unstable."""
    edge = DECIMATION_PASSBAND / factor
    return np.asarray(signal.cheby1(DECIMATION_ORDER, DECIMATION_RIPPLE, edge, output="sos"))


def decimated_start(samples: int, factor: int) -> int:
    """Return the index of the first sample that `decimate` keeps."""
    return (samples - 1) % factor


def noise_level(values: Float[np.ndarray, " n"]) -> float:
    """Return the standard deviation of the white noise on a smooth signal, in the signal's unit.

    The sixth difference removes motion that is smooth over seven samples and multiplies the
    variance of white noise by the central binomial coefficient C(12, 6); its 80 % quantile ignores
    the jumps that a switched force leaves.
    """
    if values.size <= _NOISE_DIFFERENCE:
        return 0.0
    difference = np.abs(np.diff(values, _NOISE_DIFFERENCE))
    scale = np.sqrt(comb(2 * _NOISE_DIFFERENCE, _NOISE_DIFFERENCE))
    return noise_quantile(difference) / float(scale)


def noise_quantile(magnitudes: Float[np.ndarray, " n"]) -> float:
    """Return the standard deviation of normal values by the 80 % quantile of their magnitudes.

    The largest fifth may be jumps of the motion.
    """
    return float(np.quantile(magnitudes, _NOISE_QUANTILE)) / _NOISE_QUANTILE_NORMAL


def slow_speed(largest_speed: float, noise: float) -> float:
    """Return the speed below which the axis may be at rest [m/s or rad/s].

    From the largest speed in the log and the standard deviation of the speed [m/s or rad/s].
    """
    return max(REST_SPEED * largest_speed, REST_NOISE * noise)


def rests(
    velocity: Float[np.ndarray, " n"], threshold: float, least_samples: int
) -> Bool[np.ndarray, " n"]:
    """Mark the samples of stretches in which the speed stays below a threshold long enough.

    A reversal passes through low speeds too, in a shorter time than a rest.
    """
    slow = np.abs(velocity) < threshold
    edges = np.flatnonzero(np.diff(np.concatenate(([False], slow, [False]))))
    marks = np.zeros(velocity.size, dtype=bool)
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if stop - start >= least_samples:
            marks[start:stop] = True
    return marks
