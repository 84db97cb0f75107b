"""Intervals: against statsmodels, and by how often they hold the truth."""

import numpy as np
import pytest
import scipy.stats
import statsmodels.api as sm
from statsmodels.stats.sandwich_covariance import cov_hac_simple

from stickslip.estimation.intervals import (
    andrews_bandwidth,
    autocorrelation,
    hac_covariance,
    long_run_covariance,
    t_quantile,
)

ROUNDING = 1e-10


def correlated(generator: np.random.Generator, n: int, coefficient: float) -> np.ndarray:
    noise = generator.normal(size=n)
    out = np.empty(n)
    out[0] = noise[0] / np.sqrt(1 - coefficient**2)
    for k in range(1, n):
        out[k] = coefficient * out[k - 1] + noise[k]
    return out


@pytest.mark.parametrize("lags", [0, 3, 11])
def test_without_prewhitening_it_is_newey_west(lags: int) -> None:
    generator = np.random.default_rng(1)
    regressors = generator.normal(size=(200, 3))
    residual = correlated(generator, 200, 0.6)
    fit = sm.OLS(regressors @ [1.0, 2.0, 3.0] + residual, regressors).fit()
    theirs = cov_hac_simple(fit, nlags=lags, use_correction=True)
    ours = hac_covariance(regressors, np.asarray(fit.resid), bandwidth=lags + 1.0, prewhiten=False)
    np.testing.assert_allclose(ours, theirs, rtol=ROUNDING)


def test_the_bandwidth_of_an_autoregression_is_that_of_andrews() -> None:
    # For one AR(1) score alpha = 4 rho^2 / ((1 - rho)^2 (1 + rho)^2), Andrews (1991) Eq. 6.4
    scores = correlated(np.random.default_rng(2), 5000, 0.7)[:, None]
    rho = float(np.sum(scores[1:] * scores[:-1]) / np.sum(scores[:-1] ** 2))
    alpha = 4 * rho**2 / ((1 - rho) ** 2 * (1 + rho) ** 2)
    assert andrews_bandwidth(scores) == pytest.approx(1.1447 * (alpha * 5000) ** (1 / 3))


def test_the_long_run_variance_of_an_autoregression() -> None:
    # The spectrum at zero of an AR(1) with unit innovations is 1 / (1 - rho)^2
    scores = correlated(np.random.default_rng(3), 200_000, 0.5)[:, None]
    variance = long_run_covariance(scores, andrews_bandwidth(scores))[0, 0] / 200_000
    assert variance == pytest.approx(4.0, rel=0.1)  # a fifth of its theoretical spread is 4 %


@pytest.mark.parametrize("coefficient", [0.0, 0.5, 0.9])
def test_intervals_hold_the_truth_as_often_as_they_say(coefficient: float) -> None:
    runs, n = 400, 600
    generator = np.random.default_rng(4)
    time = np.arange(n)
    regressors = np.column_stack([np.sin(0.05 * time), np.ones(n)])
    held = 0
    for _ in range(runs):
        target = regressors @ [1.0, 2.0] + correlated(generator, n, coefficient)
        values, *_ = np.linalg.lstsq(regressors, target, rcond=None)
        covariance = hac_covariance(regressors, target - regressors @ values)
        half = t_quantile(n * (1 - coefficient) / (1 + coefficient)) * np.sqrt(covariance[1, 1])
        held += abs(values[1] - 2.0) <= half
    # At least 90 % coverage: fewer would be seen by chance once in a thousand
    assert held >= scipy.stats.binom.ppf(0.001, runs, 0.90)


def test_autocorrelation_of_a_known_sequence() -> None:
    values = np.array([1.0, -2.0, 3.0, 0.5])
    expected = [1.0, (-2 - 6 + 1.5) / 14.25, (3 - 1) / 14.25]
    np.testing.assert_allclose(autocorrelation(values, 2), expected, rtol=ROUNDING)
    np.testing.assert_array_equal(autocorrelation(np.zeros(4), 2), [1.0, 0.0, 0.0])
