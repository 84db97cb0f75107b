"""Intervals: against their definition, and by how often they hold the truth."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from stickslip.estimation.intervals import (
    autocorrelation,
    frequencies,
    long_run_covariance,
    robust_covariance,
    t_quantile,
)

ROUNDING = 1e-10


def correlated(generator: np.random.Generator, n: int, coefficient: float) -> np.ndarray:
    """Return an AR(1) sequence with unit innovations, settled."""
    return scipy.signal.lfilter([1.0], [1.0, -coefficient], generator.normal(size=2 * n))[n:]


def test_the_sandwich_is_that_of_its_definition() -> None:
    generator = np.random.default_rng(1)
    n, p = 60, 3
    regressors = generator.normal(size=(n, p))
    residual = correlated(generator, n, 0.6)
    bread = np.linalg.inv(regressors.T @ regressors)
    count = frequencies(n)
    meat = np.zeros((p, p))
    for j in range(1, count + 1):
        cosine = np.sqrt(2 / n) * np.cos(np.pi * j * (np.arange(n) + 0.5) / n)
        score = (regressors * residual[:, None]).T @ cosine
        meat += np.outer(score, score) * n / count
    expected = bread @ meat @ bread * n / (n - p)
    np.testing.assert_allclose(robust_covariance(regressors, residual), expected, rtol=ROUNDING)


@pytest.mark.parametrize("coefficient", [0.0, 0.5, 0.97])
def test_the_long_run_variance_of_an_autoregression(coefficient: float) -> None:
    # The spectrum at zero of an AR(1) with unit innovations is 1 / (1 - rho)^2
    n, count = 100_000, 400
    scores = correlated(np.random.default_rng(3), n, coefficient)[:, None]
    variance = long_run_covariance(scores, count)[0, 0] / n
    # The mean of 400 squares spreads by 7 %; four times that is not seen by chance
    assert variance == pytest.approx((1 - coefficient) ** -2, rel=4 * np.sqrt(2 / count))


@pytest.mark.parametrize("coefficient", [0.0, 0.9, 0.98])
@pytest.mark.parametrize("fast_noise", [0.0, 10.0])
def test_intervals_hold_the_truth_as_often_as_they_say(
    coefficient: float, fast_noise: float
) -> None:
    """Also under noise that differentiation has amplified, which hides the slow correlation."""
    runs, n = 1000, 3000
    generator = np.random.default_rng(4)
    time = np.arange(n)
    regressors = np.column_stack([np.sin(0.01 * time), np.cos(0.02 * time), np.ones(n)])
    truth = np.array([1.0, -3.0, 2.0])
    to_values = np.linalg.pinv(regressors)
    slow = scipy.signal.lfilter(
        [np.sqrt(1 - coefficient**2)], [1.0, -coefficient], generator.normal(size=(runs, 2 * n))
    )[:, n:]
    noise = slow + fast_noise * np.diff(generator.normal(size=(runs, n + 1)))
    held = np.zeros(3)
    for row in noise:
        target = regressors @ truth + row
        values = to_values @ target
        covariance = robust_covariance(regressors, target - regressors @ values)
        half = t_quantile(frequencies(n)) * np.sqrt(np.diag(covariance))
        held += np.abs(values - truth) <= half
    # 93 to 97 %, widened by what chance does once in a thousand
    assert np.all(held >= scipy.stats.binom.ppf(0.001, runs, 0.93))
    assert np.all(held <= scipy.stats.binom.ppf(0.999, runs, 0.97))


def test_autocorrelation_of_a_known_sequence() -> None:
    values = np.array([1.0, -2.0, 3.0, 0.5])
    expected = [1.0, (-2 - 6 + 1.5) / 14.25, (3 - 1) / 14.25]
    np.testing.assert_allclose(autocorrelation(values, 2), expected, rtol=ROUNDING)
    np.testing.assert_array_equal(autocorrelation(np.zeros(4), 2), [1.0, 0.0, 0.0])
