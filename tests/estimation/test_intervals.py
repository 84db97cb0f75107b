"""Intervals: against their definition, and by how often they hold the truth."""

import numpy as np
import pytest
import scipy.signal
import scipy.stats

from stickslip.estimation.fit.intervals import (
    autocorrelation,
    information_time,
    robust_uncertainty,
    t_quantile,
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


def test_rows_that_tell_nothing_take_no_time() -> None:
    time, rows = information_time(np.array([1.0, 0.0, 0.0, 1.0, 2.0, 0.0]))
    np.testing.assert_allclose(time, [0.125, 0.25, 0.25, 0.375, 0.75, 1.0], rtol=ROUNDING)
    assert rows == pytest.approx(16 / 6)


@pytest.mark.parametrize("coefficient", [0.0, 0.9, 0.98])
@pytest.mark.parametrize("fast_noise", [0.0, 10.0])
@pytest.mark.parametrize("moving", [1.0, 0.3])
def test_intervals_hold_the_truth_as_often_as_they_say(
    coefficient: float, fast_noise: float, moving: float
) -> None:
    """Also under noise that differentiation has amplified, and if the log rests in the end."""
    runs, n = 600, round(4000 / moving)  # the same number of rows that tell something
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
