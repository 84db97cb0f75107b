"""Weighted means of the force balance over short windows in which the axis slips one way.

Multiply the force balance ``u = m a + c v + f_c sign(v) + f_0 + ...`` by a smooth weight phi of
compact support and integrate by parts:

    int phi u dt = m int phi'' x dt - c int phi' x dt + f_c sign(v) + f_0 + ...      (int phi = 1)

so that no signal is differentiated: the derivatives are those of the weight (modulating functions,
Shinbrot 1957; weak form of the equation of motion). Noise of the logged effort stays on the left
side, where it costs variance and no bias. The support is compact, so that a row depends on nothing
outside its window: reversals, rests, gaps, clipped and lost samples are left out exactly.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy import ndimage, signal

from stickslip.estimation.fit.intervals import Overlap

_LONG = 200  # taps, above which a Fourier transform is faster
_ORDER = 4  # of the weight (1 - s^2)^n: three continuous derivatives at the ends of its support


@dataclass(frozen=True, kw_only=True)
class Weight:
    """The weight phi(s) = (1 - s^2)^4 on -1 < s < 1, scaled to unit integral."""

    half_width: int  # half of its support [samples]
    sampling_time: float  # [s]
    margin: int = 1  # samples beyond either end that a delayed effort may reach into
    # Time before its time stamp from which an effort acts, for a sample [samples]; 0 if it is held,
    # and half a sample if it is smooth between the samples
    lead: float = 0.0
    # Whether a sample of the effort is the mean over the time for which it acts, of an effort that
    # varies meanwhile
    averaged: bool = False

    @property
    def duration(self) -> float:
        """Half of its support [s]."""
        return self.half_width * self.sampling_time

    def mean(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of int phi g dt for a sampled signal g [-]."""
        return self._with_moments(0, {0: 1.0, 2: self._variance})

    def first(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of -int phi' x dt, which is the mean of the velocity [1/s]."""
        moments = {1: 1.0, 3: 3.0 * self._variance}
        return self._with_moments(1, moments) / self.sampling_time

    def second(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of int phi'' x dt, which is the mean of the acceleration [1/s^2]."""
        moments = {0: 0.0, 2: 2.0, 4: 12.0 * self._variance}
        return self._with_moments(2, moments) / self.sampling_time**2

    def fourth(self) -> Float[np.ndarray, " taps"]:
        """Return the taps of the mean of the fourth derivative of the position [1/s^4]."""
        moments = {0: 0.0, 2: 0.0, 4: 24.0}
        return self._with_moments(4, moments) / self.sampling_time**4

    def effort(self, delay: float) -> Float[np.ndarray, " taps"]:
        """Return the taps of int phi u dt [-] for an effort with a delay [samples].

        The effort acts later than it is logged by the delay. It is held from its time stamp to the
        next, or smooth between them if it has a lead. A mean over a sample adds 1/12 to the second
        moment of a smooth effort.
        """
        if self.averaged:
            moments = {0: 1.0, 1: 0.0, 2: self._variance - 1.0 / 12.0}
            return self._with_moments(0, moments, delay + 0.5)
        if self.lead > 0.0:
            return self._with_moments(0, {0: 1.0, 1: 0.0, 2: self._variance}, delay)
        k = self._steps()
        edges = np.append(k, k[-1] + 1.0) + delay
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

    @property
    def _variance(self) -> float:
        """Second moment of the weight, int phi k^2 dk [samples^2]."""
        return self.half_width**2 / (2 * _ORDER + 3)

    def _at(self, k: Float[np.ndarray, " n"], order: int = 0) -> Float[np.ndarray, " n"]:
        """Return a derivative of phi, up to the sign, at k samples from the middle."""
        s = k / self.half_width
        values = np.asarray(_WEIGHT.deriv(order)(s)) * np.heaviside(1.0 - np.abs(s), 0.5)
        return (-1.0) ** order * _SCALE * values / self.half_width ** (order + 1)

    def _with_moments(
        self, order: int, moments: Mapping[int, float], delay: float = 0.0
    ) -> Float[np.ndarray, " taps"]:
        """Return a derivative of phi at k samples from the middle, with moments sum taps k^n.

        The k are those of the samples plus a delay [samples]. A sum over few samples differs from
        the integral. With the moments of the integral it is exact for polynomials up to the highest
        of their orders.
        """
        k = self._steps() + delay
        taps = self._at(k, order)
        powers = np.stack([k**order for order in moments])
        weighted = powers * self._at(k)
        missing = np.array(list(moments.values())) - powers @ taps
        return taps + np.linalg.solve(weighted @ powers.T, missing) @ weighted


_WEIGHT = np.polynomial.Polynomial([1.0, 0.0, -1.0]) ** _ORDER
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
