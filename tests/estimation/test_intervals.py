"""Intervals: against their definition, and by how often they hold the truth."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from stickslip.estimation.fit.intervals import (
    Overlap,
    Uncertainty,
    autocorrelation,
    information_time,
    pooled,
    robust_uncertainty,
    t_quantile,
    white_variances,
)

ROUNDING = 1e-10


def correlated(generator: np.random.Generator, n: int, coefficient: float) -> np.ndarray:
    """Return an AR(1) sequence with unit innovations, settled."""
    return scipy.signal.lfilter([1.0], [1.0, -coefficient], generator.normal(size=2 * n))[n:]


def test_the_variance_is_that_of_its_definition() -> None:
    generator = np.random.default_rng(1)
    n, d = 60, 3
    orthonormal, _ = np.linalg.qr(generator.normal(size=(n, d)))
    to_values = generator.normal(size=(2, d))
    residual = correlated(generator, n, 0.6)
    residual -= orthonormal @ (orthonormal.T @ residual)
    maker = np.eye(n) - orthonormal @ orthonormal.T  # makes residuals
    leverage = np.diag(orthonormal @ orthonormal.T)
    count = int(d**2 / np.sum(leverage**2) / 4)
    found = robust_uncertainty(orthonormal, to_values, residual)
    for k in range(2):
        weights = orthonormal @ to_values[k]
        rows = []
        for j in range(1, count + 1):
            time = [(np.sum(leverage[:t]) + leverage[t] / 2) / d for t in range(n)]
            rows.append([np.cos(np.pi * j * time[t]) * weights[t] for t in range(n)])
        white = np.array(rows) @ maker @ np.array(rows).T
        variance = np.sum((np.array(rows) @ residual) ** 2) / np.trace(white)
        variance *= np.sum(weights**2) * n / (n - d)
        degrees = np.trace(white) ** 2 / np.trace(white @ white)
        assert found.covariance[k, k] == pytest.approx(variance, rel=ROUNDING)
        assert found.degrees_of_freedom[k] == pytest.approx(degrees, rel=ROUNDING)


def test_rows_without_information_take_no_time() -> None:
    time, rows = information_time(np.array([1.0, 0.0, 0.0, 1.0, 2.0, 0.0]))
    np.testing.assert_allclose(time, [0.125, 0.25, 0.25, 0.375, 0.75, 1.0], rtol=ROUNDING)
    assert rows == pytest.approx(16 / 6)


@pytest.mark.slow
@pytest.mark.parametrize("coefficient", [0.0, 0.9, 0.98])
@pytest.mark.parametrize("fast_noise", [0.0, 10.0])
@pytest.mark.parametrize("moving", [1.0, 0.3])
def test_intervals_have_their_coverage(
    coefficient: float, fast_noise: float, moving: float
) -> None:
    """Also under noise that differentiation has amplified, and if the log rests in the end."""
    runs, n = 600, round(4000 / moving)  # the same number of rows with information
    generator = np.random.default_rng(4)
    time = np.arange(n)
    regressors = np.column_stack([np.sin(0.02 * time), np.cos(0.03 * time), np.ones(n)])
    regressors[time > moving * n] *= 1e-3
    orthonormal, triangle = np.linalg.qr(regressors)
    to_values = np.linalg.inv(triangle)
    truth = np.array([1.0, -3.0, 2.0])
    slow = scipy.signal.lfilter(
        [np.sqrt(1 - coefficient**2)], [1.0, -coefficient], generator.normal(size=(runs, 2 * n))
    )[:, n:]
    noise = slow + fast_noise * np.diff(generator.normal(size=(runs, n + 1)))
    held = np.zeros(3)
    for row in noise:
        target = regressors @ truth + row
        coordinates = orthonormal.T @ target
        residual = target - orthonormal @ coordinates
        found = robust_uncertainty(orthonormal, to_values, residual)
        quantiles = np.array([t_quantile(float(nu)) for nu in found.degrees_of_freedom])
        half = quantiles * np.sqrt(np.diag(found.covariance))
        held += np.abs(to_values @ coordinates - truth) <= half
    # 94 to 98 %, widened by what chance does once in a thousand
    assert np.all(held >= scipy.stats.binom.ppf(0.001, runs, 0.94))
    assert np.all(held <= scipy.stats.binom.ppf(0.999, runs, 0.98))


def test_autocorrelation_of_a_known_sequence() -> None:
    values = np.array([1.0, -2.0, 3.0, 0.5])
    expected = [1.0, (-2 - 6 + 1.5) / 14.25, (3 - 1) / 14.25]
    np.testing.assert_allclose(autocorrelation(values, 2), expected, rtol=ROUNDING)
    np.testing.assert_array_equal(autocorrelation(np.zeros(4), 2), [1.0, 0.0, 0.0])


def test_white_variances_are_those_of_overlapping_means() -> None:
    generator = np.random.default_rng(3)
    half, stride, n = 6, 4, 40
    taps = np.hanning(2 * half + 1)  # zero at its ends
    # Two logs, the second with times of its own
    makers = np.zeros((2 * n, 2 * (n * stride + taps.size)))
    for row in range(2 * n):
        start = row * stride + (taps.size if row >= n else 0)
        makers[row, start : start + taps.size] = taps
    weights = generator.normal(size=(2 * n, 2))
    expected = np.diag(weights.T @ makers @ makers.T @ weights)
    full = np.correlate(taps, taps, mode="full")[taps.size - 1 :]
    found = white_variances(
        weights,
        np.full(2 * n, np.sqrt(np.sum(taps**2))),
        0.01 * stride * np.concatenate([np.arange(n), np.arange(n)]),
        Overlap(lags=0.01 * np.arange(full.size), correlations=full / full[0]),
        np.repeat([0, 1], n),
    )
    assert found == pytest.approx(expected, rel=ROUNDING)


def test_variances_that_are_small_by_chance_are_pooled() -> None:
    uncertainty = Uncertainty(
        covariance=np.array([[1.0, 0.5], [0.5, 4.0]]), degrees_of_freedom=np.array([12.0, 12.0])
    )
    found = pooled(uncertainty, np.array([2.5, 3.0]))
    # The first: (12 * 1 + 24 * 2.5) / 36; the second is larger than under white noise
    assert found.covariance == pytest.approx(np.array([[2.0, 0.5 * np.sqrt(2)], [0.5**0.5, 4.0]]))
    assert found.degrees_of_freedom.tolist() == [36.0, 12.0]


@pytest.mark.parametrize("redness", [1.0, 2.0])
def test_pooled_intervals_hold_and_are_seldom_far_off(redness: float) -> None:
    generator = np.random.default_rng(4)
    n, degrees = 4000, 12
    values = np.sqrt(redness) * generator.normal(size=n)
    variances = redness * generator.chisquare(degrees, size=n) / degrees
    missed, far = 0, 0
    for value, variance in zip(values, variances, strict=True):
        found = pooled(
            Uncertainty(
                covariance=np.array([[variance]]), degrees_of_freedom=np.array([float(degrees)])
            ),
            np.array([1.0]),
        )
        half = np.sqrt(found.covariance[0, 0]) * t_quantile(float(found.degrees_of_freedom[0]))
        missed += abs(value) > half
        far += abs(value) > 1.8 * half
    # Four standard deviations of a binomial count at 5 %; without pooling 0.2 % are far off
    assert missed < n * 0.05 + 4.0 * np.sqrt(n * 0.05 * 0.95)
    assert far <= scipy.stats.binom.ppf(0.999, n, 0.002)


@pytest.mark.parametrize("intervals", [1, 5])
def test_quantiles_hold_together(intervals: int) -> None:
    expected = scipy.stats.t.ppf(1.0 - 0.025 / intervals, 10.0)
    assert t_quantile(10.0, intervals) == pytest.approx(expected, rel=ROUNDING)
