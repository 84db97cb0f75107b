"""Chapter 5 of the source against quadrature, Monte Carlo, and refits of its polynomials."""

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
import scipy.integrate
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.estimation.energy.published.kernels import BIAS_OF_POLYNOMIAL
from studies.van_de_wijdeven.part_a.noise_compensation import (
    BIAS_OF_DOUBLE_MEAN,
    SIXTH_ORDER,
    absolute_bias,
    absolute_bias_polynomial,
    absolute_density,
    absolute_mean,
    absolute_mean_polynomial,
    double_absolute_mean,
    double_absolute_mean_polynomial,
)

DRAWS = 200_000
STANDARD_ERRORS = 5.0  # missed by chance once in two million comparisons
QUADRATURE = 1e-9  # what adaptive quadrature guarantees of integrands of size one
REFIT = 1e-9  # relative: rounding of the normal equations of five columns
SIGMA = 0.05
SPEEDS = np.array([-0.3, -0.11, -0.02, 0.0, 0.01, 0.05, 0.1, 0.15, 0.4])  # up to 8 sigma


def normal_expectation(function: Callable[[float], float], sigma: float, kink: float) -> float:
    """Integrate a function of zero-mean normal noise, in pieces around a kink."""

    def weighted(v: float) -> float:
        return function(v) * float(scipy.stats.norm.pdf(v, scale=sigma))

    ends = sorted({-12.0 * sigma, float(np.clip(kink, -12 * sigma, 12 * sigma)), 12.0 * sigma})
    return sum(
        scipy.integrate.quad(weighted, low, high, epsabs=1e-13, limit=200)[0]
        for low, high in pairwise(ends)
    )


def assert_mean_of(samples: np.ndarray, expected: float) -> None:
    error = float(samples.std(ddof=1) / np.sqrt(samples.size))
    assert abs(float(samples.mean()) - expected) < STANDARD_ERRORS * error


@pytest.fixture
def draws() -> np.ndarray:
    return SIGMA * np.random.default_rng(0).standard_normal((4, DRAWS))


@pytest.mark.parametrize("mean", [0.0, 2.0])  # the two of Fig. 5.1
def test_the_density_of_an_absolute_value(mean: float) -> None:
    y = np.linspace(0.0, 8.0, 81)
    folded = scipy.stats.foldnorm(abs(mean))
    np.testing.assert_allclose(absolute_density(y, mean, 1.0), folded.pdf(y), atol=QUADRATURE)
    np.testing.assert_array_equal(absolute_density(-y[1:], mean, 1.0), 0.0)
    draws = np.abs(mean + np.random.default_rng(2).standard_normal(DRAWS))
    edges = np.linspace(0.0, 3.0, 13)
    inside = [
        scipy.integrate.quad(lambda v: float(absolute_density(v, mean, 1.0)), low, high)[0]
        for low, high in pairwise(edges.tolist())
    ]
    counts = np.histogram(draws, edges)[0]
    spread = np.sqrt(DRAWS * np.array(inside) * (1.0 - np.array(inside)))
    assert np.all(np.abs(counts - DRAWS * np.array(inside)) < STANDARD_ERRORS * spread)


def test_the_mean_of_an_absolute_value(draws: np.ndarray) -> None:
    """Eq. 5.20."""
    for speed, mean in zip(SPEEDS.tolist(), absolute_mean(SPEEDS, SIGMA).tolist(), strict=True):
        exact = normal_expectation(lambda v, m=speed: abs(m + v), SIGMA, -speed)
        assert mean == pytest.approx(exact, abs=QUADRATURE)
        assert mean == pytest.approx(
            scipy.stats.foldnorm(abs(speed) / SIGMA, scale=SIGMA).mean(), abs=QUADRATURE
        )
        assert_mean_of(np.abs(speed + draws[0]), mean)


def test_the_double_mean(draws: np.ndarray) -> None:
    """E_v g(m - v): by quadrature of Eq. 5.20, by draws of both noises, and in closed form."""
    found = double_absolute_mean(SPEEDS, SIGMA)
    for speed, mean in zip(SPEEDS.tolist(), found.tolist(), strict=True):
        exact = normal_expectation(
            lambda v, m=speed: float(absolute_mean(m - v, SIGMA)), SIGMA, speed
        )
        assert mean == pytest.approx(exact, abs=QUADRATURE)
        assert_mean_of(np.abs(speed - draws[0] + draws[1]), mean)
    a = np.abs(SPEEDS)
    closed = 2 * SIGMA / np.sqrt(np.pi) * np.exp(-(a**2) / (4 * SIGMA**2)) + a * scipy.special.erf(
        a / (2 * SIGMA)
    )
    np.testing.assert_allclose(found, closed, rtol=REFIT)
    np.testing.assert_allclose(absolute_bias(SPEEDS, SIGMA), closed - a, atol=REFIT)


def test_the_printed_double_mean() -> None:
    """Eq. 5.24 is the expectation of Eq. 5.21 at m - v, by Gauss-Hermite quadrature exactly."""
    nodes, weights = np.polynomial.hermite_e.hermegauss(8)
    s = np.linspace(-2.99, 2.99, 25)
    even = np.zeros(7)
    even[[0, 2, 4, 6]] = SIXTH_ORDER
    shifted = np.polyval(even, s[:, None] - nodes)
    expected = shifted @ weights / np.sqrt(2.0 * np.pi)
    np.testing.assert_allclose(double_absolute_mean_polynomial(s, 1.0), expected, rtol=REFIT)
    draws = np.random.default_rng(3).standard_normal(DRAWS)
    for speed in (-2.5, 0.0, 1.0):
        assert_mean_of(
            np.polyval(even, speed - draws), float(double_absolute_mean_polynomial(speed, 1.0))
        )
    # It runs the polynomial far beyond where it holds, and so misses what it stands for
    too_large = double_absolute_mean_polynomial([2.0, 3.0], 1.0) - double_absolute_mean(
        [2.0, 3.0], 1.0
    )
    np.testing.assert_allclose(too_large, [0.063, 0.538], atol=0.001)


def refit(function: np.ndarray, s: np.ndarray, weights: np.ndarray, powers: range) -> np.ndarray:
    columns = np.column_stack([s**power for power in powers])
    gram = columns.T @ (weights[:, None] * columns)
    return np.linalg.solve(gram, columns.T @ (weights * function))


def test_the_polynomials_are_least_squares_fits() -> None:
    """Over the whole range, every velocity weighing the same (Eqs. 5.21, 5.22 and the text)."""
    nodes, weights = np.polynomial.legendre.leggauss(100)
    s = 3.0 * nodes
    sixth = refit(absolute_mean(s, 1.0), s, weights, range(0, 7, 2))
    np.testing.assert_allclose(sixth[::-1], SIXTH_ORDER, rtol=1e-7)
    error = absolute_mean_polynomial(s, 1.0) - absolute_mean(s, 1.0)
    assert float(np.max(np.abs(error))) < 0.0077
    # An odd power would find nothing to explain
    odd = refit(absolute_mean(s, 1.0), s, weights, range(7))
    np.testing.assert_allclose(odd[1::2], 0.0, atol=1e-9)
    s = 1.5 * (nodes + 1.0)
    printed = double_absolute_mean_polynomial(s, 1.0) - s
    np.testing.assert_allclose(refit(printed, s, weights, range(5)), BIAS_OF_POLYNOMIAL, rtol=1e-7)
    exact = absolute_bias(s, 1.0)
    np.testing.assert_allclose(refit(exact, s, weights, range(5)), BIAS_OF_DOUBLE_MEAN, rtol=1e-7)
    for of, bias, largest in (("polynomial", printed, 0.0089), ("double_mean", exact, 0.0018)):
        fitted = absolute_bias_polynomial(s, 1.0, of=of)  # type: ignore[arg-type]
        assert float(np.max(np.abs(fitted - bias))) < largest


def test_the_settled_quartic_is_the_published_one() -> None:
    published = (1.1301, -1.0177, 0.32372, -0.036428, 0.000108)
    np.testing.assert_allclose(BIAS_OF_DOUBLE_MEAN, published, rtol=2e-3)
    np.testing.assert_allclose(BIAS_OF_DOUBLE_MEAN, published, atol=3e-5)


@pytest.mark.parametrize(
    ("speed", "removed", "added"),
    # What noise adds at 2 sigma is 2 [pdf(2) - 2 cdf(-2)] = 0.01698
    [(0.0, 0.584, 0.798), (2.0, 0.195, 0.017)],
)
def test_the_double_mean_is_itself_biased(speed: float, removed: float, added: float) -> None:
    """Averaged over what is measured, it takes off too little at rest and too much in motion."""
    noise = np.random.default_rng(4).standard_normal(DRAWS)
    taken = float(np.mean(absolute_bias(speed + noise, 1.0)))
    assert taken == pytest.approx(removed, abs=0.003)
    assert float(absolute_mean(speed, 1.0)) - speed == pytest.approx(added, abs=0.0005)
    # h of a noisy velocity is a folded normal once more, of three times the variance
    three = float(absolute_mean(speed, np.sqrt(3.0))) - float(absolute_mean(speed, 1.0))
    assert three == pytest.approx(removed, abs=0.0015)


@given(
    speed=st.floats(-10.0, 10.0),
    sigma=st.floats(0.01, 1.0),
    scale=st.floats(0.001, 1000.0),
)
def test_biases_are_even_positive_and_without_a_unit(
    speed: float, sigma: float, scale: float
) -> None:
    bias = float(absolute_bias(speed, sigma))
    assert -1e-12 <= bias <= 2.0 / np.sqrt(np.pi) * sigma * (1.0 + 1e-12)
    assert float(absolute_bias(-speed, sigma)) == bias
    quartic = float(absolute_bias_polynomial(speed, sigma, of="polynomial"))
    assert float(absolute_bias_polynomial(-speed, sigma, of="polynomial")) == quartic
    scaled = float(absolute_bias(scale * speed, scale * sigma))
    assert scaled == pytest.approx(scale * bias, rel=1e-9, abs=1e-12 * scale)


def test_without_noise_nothing_is_added() -> None:
    a = np.abs(SPEEDS)
    for function in (absolute_mean, absolute_mean_polynomial, double_absolute_mean):
        np.testing.assert_array_equal(function(SPEEDS, 0.0), a)
    np.testing.assert_array_equal(double_absolute_mean_polynomial(SPEEDS, 0.0), a)
    np.testing.assert_array_equal(absolute_bias(SPEEDS.reshape(3, 3), 0.0), np.zeros((3, 3)))
    np.testing.assert_array_equal(absolute_bias_polynomial(SPEEDS, 0.0, of="double_mean"), 0.0)


def test_impossible_noise_is_refused() -> None:
    with refuses("negative", name="noise", value=-1.0):
        absolute_mean(0.0, -1.0)
    with refuses("not_positive", name="noise"):
        absolute_density(0.0, 0.0, 0.0)
