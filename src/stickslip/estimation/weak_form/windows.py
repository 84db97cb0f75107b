"""Weighted means of the force balance over short windows in which the axis slips one way.

Multiply the force balance ``u = m a + c v + f_c sign(v) + f_0 + ...`` by a smooth weight phi of
compact support and integrate. By parts,

    int phi u dt = m int phi'' x dt - c int phi' x dt + f_c sign(v) + f_0 + ...      (int phi = 1)

so that no signal is differentiated: the derivatives are those of the weight (modulating functions,
Shinbrot 1957; weak form of the equation of motion). Noise of the logged effort stays on the left
side, where it costs variance and no bias. The support is compact, so that a row depends on nothing
outside its window: reversals, rests, gaps, clipped and lost samples are left out exactly.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage, signal

from stickslip.estimation.fit.intervals import Overlap

_LONG = 200  # taps: beyond, a Fourier transform is faster
_ORDER = 4  # of the weight (1 - s^2)^n: three continuous derivatives at the ends of its support


@dataclass(frozen=True, kw_only=True)
class Weight:
    """The weight phi(s) = (1 - s^2)^4 on -1 < s < 1, scaled to unit integral."""

    half_width: int  # half of its support [samples]
    sampling_time: float  # [s]
    margin: int = 1  # samples beyond either end that a delayed effort may reach into
    lead: float = 0.0  # time before its time stamp from which an effort acts [samples]

    @property
    def duration(self) -> float:
        """Half of its support [s]."""
        return self.half_width * self.sampling_time

    def mean(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of int phi g dt for a sampled signal g [-]."""
        s = self._abscissa()
        taps = (1.0 - s**2) ** _ORDER
        return taps / np.sum(taps)

    def first(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of -int phi' x dt, which is the mean of the velocity [1/s]."""
        s = self._abscissa()
        taps = 2.0 * _ORDER * s * (1.0 - s**2) ** (_ORDER - 1)
        # Exact for a uniform motion: the sum of k taps is one over the sampling time
        return taps / (float(np.sum(taps * self._steps())) * self.sampling_time)

    def second(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of int phi'' x dt, which is the mean of the acceleration [1/s^2]."""
        s = self._abscissa()
        n = _ORDER
        taps = (1.0 - s**2) ** (n - 2) * (4 * n * (n - 1) * s**2 - 2 * n * (1.0 - s**2))
        taps -= self.mean() * float(np.sum(taps))  # a resting axis does not accelerate
        squares = self._steps() ** 2
        return taps * 2.0 / (float(np.sum(taps * squares)) * self.sampling_time**2)

    def fourth(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of the mean of the fourth derivative of the position [1/s^4]."""
        s = self._abscissa()
        taps = _FOURTH(s) * (np.abs(s) < 1.0)
        k = self._steps()
        # The sum of the taps and their second moment vanish, as the integrals do
        powers = np.stack([np.ones(k.size), k**2])
        weighted = powers * self.mean()
        taps -= np.linalg.solve(weighted @ powers.T, powers @ taps) @ weighted
        return taps * 24.0 / (float(np.sum(taps * k**4)) * self.sampling_time**4)

    def held(self, delay: float) -> Float[np.ndarray, " taps"]:
        """Return the taps of int phi u dt for an effort held over each sample [-].

        The effort acts by ``delay`` samples later than it is logged.
        """
        k = self._steps()
        edges = np.append(k, k[-1] + 1.0) + delay - self.lead
        return np.diff(_integral(edges / self.half_width))

    def overlap(self) -> Overlap:
        """Return the correlation of two windows over a signal with white noise."""
        taps = self.mean()
        full = np.correlate(taps, taps, mode="full")[taps.size - 1 :]
        lags = self.sampling_time * np.arange(full.size)
        return Overlap(lags=lags, correlations=full / full[0])

    def _steps(self) -> Float[np.ndarray, " taps"]:
        return np.arange(-self.reach, self.reach + 1, dtype=float)

    @property
    def reach(self) -> int:
        """Samples on either side of the middle that a row depends on [-]."""
        return self.half_width + self.margin

    def _abscissa(self) -> Float[np.ndarray, " taps"]:
        return np.clip(self._steps() / self.half_width, -1.0, 1.0)


_FOURTH = np.polynomial.Polynomial([1.0, 0.0, -1.0]).__pow__(_ORDER).deriv(4)
_SCALE = 315.0 / 256.0  # 1 / int (1 - s^2)^4 ds


def _integral(s: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return the integral of the scaled weight from -1 to s."""
    x = np.clip(s, -1.0, 1.0)
    antiderivative = x - 4 * x**3 / 3 + 6 * x**5 / 5 - 4 * x**7 / 7 + x**9 / 9
    return 0.5 + _SCALE * antiderivative


def convolved(
    values: Float[np.ndarray, " n"], taps: Float[np.ndarray, " taps"]
) -> Float[np.ndarray, " n"]:
    """Return ``sum_k taps[k] values[i + k]`` for every middle i, with zeros beyond the ends.

    The number of taps is odd, the middle one at k = 0.
    """
    if taps.size > _LONG:
        return np.asarray(signal.oaconvolve(values, taps[::-1], mode="same"), dtype=np.float64)
    return np.asarray(ndimage.correlate1d(values, taps, mode="constant"), dtype=np.float64)


def whole_windows(
    direction: Int[np.ndarray, " n"],
    usable: Bool[np.ndarray, " n"],
    reach: int,
    effort_reach: int | None = None,
) -> Bool[np.ndarray, " n"]:
    """Mark the middles of windows in which all samples move one way and are usable.

    The direction of travel is 1, -1, or 0 where the axis may be at rest. ``reach`` samples on
    either side of the middle move one way, and ``effort_reach`` (the same if None) are usable: a
    delayed effort is from before or after the motion that it causes.
    """
    one_way = _all_within(direction == 1, reach) | _all_within(direction == -1, reach)
    return one_way & _all_within(usable, reach if effort_reach is None else effort_reach)


def _all_within(marks: Bool[np.ndarray, " n"], reach: int) -> Bool[np.ndarray, " n"]:
    """Return whether all samples as far as ``reach`` on either side are there and marked."""
    width = 2 * reach + 1
    found = np.zeros(marks.size, dtype=bool)
    if marks.size >= width:
        count = np.concatenate(([0], np.cumsum(marks)))
        found[reach : marks.size - reach] = count[width:] - count[:-width] == width
    return found
