"""Friction, delay and gain of the drive of an arm by the momentum of mass 1 along a series."""

from dataclasses import dataclass, replace
from math import inf
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from stickslip.control.landing.tuning import LANDING, LEARNING
from stickslip.plants import FlexibleArm

LAGS = 4  # samples of the effort that may act in one
_REFITS = 4  # each with the variance that the residuals of the last one show
_CLIPS = tuple(np.arange(0.98, 0.49, -0.02).tolist())  # of the limit, where efforts may be clipped
_MOST_CORRELATED = 0.98  # correlation of successive residuals at which their variance is finite


@dataclass(frozen=True, kw_only=True)
class DriveFit:
    """Estimate of the shares of past efforts, and of Coulomb and viscous friction.

    m1 (v_{k+1} - v_k) + ks int (x1 - x2) dt + d D(x1 - x2) = T sum_j w_j u_{k-j} - f_c T sign(v)
    - c D(x1) while mass 1 slips one way, with D(.) the change over a sample. The delay is
    sum_j j w_j / sum_j w_j samples, the gain of the drive sum_j w_j. It is Bayesian linear
    regression with normal prior. Where the motion that it was seen by lags by ``lag`` samples, that
    is part of the fitted shares. Efforts beyond
    ``most`` are clipped.
    """

    information: Float[np.ndarray, "p p"]
    values: Float[np.ndarray, " p"]
    rows: int = 0
    lag: float = 0.0
    most: float = inf

    @classmethod
    def first(
        cls, coulomb: float, viscous: float, covariance: Float[np.ndarray, "2 2"]
    ) -> "DriveFit":
        """Return the prior: no delay, a gain of 1, and friction as known."""
        P = np.zeros((LAGS + 2, LAGS + 2))
        P[range(LAGS), range(LAGS)] = LEARNING.lag_spread**2
        P[LAGS:, LAGS:] = covariance
        values = np.array([1.0, *[0.0] * (LAGS - 1), coulomb, viscous])
        return cls(information=np.linalg.inv(P), values=values)

    @property
    def covariance(self) -> Float[np.ndarray, "2 2"]:
        """Of Coulomb and viscous friction."""
        P = np.linalg.inv(self.information)[LAGS:, LAGS:]
        return 0.5 * (P + P.T)

    @property
    def delay(self) -> float:
        """Delay of the drive, in samples [-]; 0 where no share of the effort is positive."""
        share = np.maximum(self.values[:LAGS], 0.0)
        total = float(share.sum())
        seen = float(share @ np.arange(LAGS)) / total if self.rows and total > 0.0 else 0.0
        return max(seen - self.lag, 0.0)

    @property
    def gain(self) -> float:
        """Gain of the drive [-]."""
        seen = float(self.values[:LAGS].sum()) if self.rows else 1.0
        return min(max(seen, 1.0 - LEARNING.farthest_gain), 1.0 + LEARNING.farthest_gain)

    @property
    def friction(self) -> tuple[float, float]:
        """Coulomb and viscous friction [N or N m, N s/m or N m s/rad]."""
        coulomb, viscous = self.values[LAGS:].tolist()
        return coulomb, viscous

    def after(self, series: "SeenSeries", limit: float) -> "DriveFit":
        """Return the estimate after a series whose efforts were clipped at a limit [N or N m].

        The weight of a row is that of the residuals of the series. From a series by which there is
        no Coulomb friction nothing is learned.
        """
        fitted = self._fitted(series, limit)
        if fitted is None:
            return self
        if fitted.values[LAGS] <= 0.0:
            return self
        return replace(
            self,
            information=fitted.information,
            values=fitted.values,
            rows=self.rows + fitted.rows,
        )

    def clipped(self, series: "SeenSeries", limit: float) -> float:
        """Return the magnitude at which the efforts of a series were clipped, at most a limit.

        It is that with the smallest residuals of the fit, if they are far below those without, and
        those are neither small ones nor noise. Magnitudes already found are not exceeded.
        """
        most = min(limit, self.most)
        plain = self._fitted(series, most)
        small = LEARNING.clip_residual * series.sampling_time * limit
        noise = LEARNING.clip_noise * series.arm.mass_1 * series.velocity_noise
        if plain is None or plain.residuals <= plain.rows * max(small, noise) ** 2:
            return most
        found, smallest = most, LEARNING.clip_evidence * plain.residuals
        for clip in (share * limit for share in _CLIPS):
            if clip >= most or np.sum(np.abs(series.effort) > clip) < LEARNING.min_rows // 2:
                continue
            fitted = self._fitted(series, clip)
            if fitted is not None and fitted.residuals < smallest:
                found, smallest = clip, fitted.residuals
        return found

    def _fitted(self, series: "SeenSeries", limit: float) -> "_Fitted | None":
        """Return the regression with a series, or None where there are too few rows."""
        arm, T, noise = series.arm, series.sampling_time, series.velocity_noise
        n, m1 = min(series.effort.size, len(series.seen) - 1), arm.mass_1
        effort, seen = np.clip(series.effort[:n], -limit, limit), series.seen[: n + 1]
        x, v = seen[:, 0], seen[:, 1]
        stretch, rate = x - seen[:, 2], v - seen[:, 3]
        pulled = integrals(stretch, rate, T)
        way = 1.0 if np.nansum(v) > 0.0 else -1.0
        fast = way * v > LANDING.moving_deviations * noise
        slips = fast[1:] & fast[:-1] & np.isfinite(pulled)
        past = np.concatenate((np.zeros(LAGS - 1), effort))
        lags = [T * past[LAGS - 1 - j : LAGS - 1 - j + n] for j in range(LAGS)]
        rows = np.column_stack((*lags, np.full(n, -way * T), -np.diff(x)))
        # Not a row in which mass 1 breaks away or stops
        values = m1 * np.diff(v) + arm.stiffness * pulled + series.damping * np.diff(stretch)
        rows, values = momenta(rows, values, slips, noisy=noise > 0.0)
        if len(values) < LEARNING.min_rows:
            return None
        least = (LEARNING.exact_residual * T * float(np.abs(effort).max())) ** 2 + (m1 * noise) ** 2
        information, found = regressed(self.information, self.values, rows, values, least)
        if not np.isfinite(found).all():
            return None
        residuals = float(np.sum((values - rows @ found) ** 2))
        return _Fitted(information, found, len(values), residuals)


class _Fitted(NamedTuple):
    """Information and values of a regression, how many rows it had, and their squared residuals."""

    information: Float[np.ndarray, "p p"]
    values: Float[np.ndarray, " p"]
    rows: int
    residuals: float


@dataclass(frozen=True, kw_only=True)
class SeenSeries:
    """Efforts of a series, and the samples of positions and velocities, one at its begin."""

    arm: FlexibleArm
    effort: Float[np.ndarray, " n"]
    seen: Float[np.ndarray, "m 4"]
    sampling_time: float
    velocity_noise: float
    damping: float = 0.0  # of the spring


def integrals(
    signal: Float[np.ndarray, " n"], rate: Float[np.ndarray, " n"], sampling_time: float
) -> Float[np.ndarray, " m"]:
    """Return the integral of a signal over each sample, of it and its rate (Hermite)."""
    T = sampling_time
    return 0.5 * T * (signal[1:] + signal[:-1]) + T * T / 12.0 * (rate[:-1] - rate[1:])


def momenta(
    rows: Float[np.ndarray, "n p"],
    values: Float[np.ndarray, " n"],
    used: Bool[np.ndarray, " n"],
    *,
    noisy: bool,
) -> tuple[Float[np.ndarray, "k p"], Float[np.ndarray, " k"]]:
    """Return the rows that are used; with noisy velocities those of the momentum since they began.

    Changes of a momentum over a sample have noise that is undone in the next one. The momentum in
    each stretch of used rows has white noise about a mean, which is removed.
    """
    if not noisy:
        return rows[used], values[used]
    edges = np.flatnonzero(np.diff(np.concatenate(([False], used, [False])).astype(np.int8)))
    parts = [np.empty((0, rows.shape[1] + 1))]
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        part = np.column_stack((rows[begin:end], values[begin:end]))
        summed = np.vstack((np.zeros(part.shape[1]), np.cumsum(part, axis=0)))
        parts.append(summed - summed.mean(axis=0))
    whole = np.vstack(parts)
    return whole[:, :-1], whole[:, -1]


def regressed(
    prior: Float[np.ndarray, "p p"],
    mean: Float[np.ndarray, " p"],
    rows: Float[np.ndarray, "n p"],
    values: Float[np.ndarray, " n"],
    least: float,
) -> tuple[Float[np.ndarray, "p p"], Float[np.ndarray, " p"]]:
    """Return information and mean of a Bayesian linear regression with a normal prior.

    The variance of the rows is that of their residuals, and ``least`` at least.
    """
    variance, information, found = least, prior, mean
    for _ in range(_REFITS):
        information = prior + rows.T @ rows / variance
        moment = prior @ mean + rows.T @ values / variance
        found = np.linalg.solve(information, moment)
        fitted = float(np.trace(np.linalg.solve(information, rows.T @ rows))) / variance
        variance = max(least, _variance(values - rows @ found, fitted))
    return information, found


def _variance(residuals: Float[np.ndarray, " n"], fitted: float) -> float:
    """Return the variance of residuals, over the share of them that are independent.

    ``fitted`` is how many parameters the rows determine, of which the residuals show nothing.
    """
    power = float(residuals @ residuals)
    if power == 0.0:
        return 0.0
    rho = min(max(float(residuals[1:] @ residuals[:-1]) / power, 0.0), _MOST_CORRELATED)
    return power / max(residuals.size - fitted, 1.0) * (1.0 + rho) / (1.0 - rho)
