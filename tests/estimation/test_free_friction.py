"""The motion with friction as a free force: dense Gaussian algebra, another library, simulation."""

from dataclasses import dataclass
from itertools import product

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from slow_cases import quick_where
from statsmodels.tsa.statespace.kalman_smoother import KalmanSmoother
from van_loan import integrated_noise

from stickslip.estimation.energy.known_inertia.free_friction import (
    DrivenMotion,
    FreeAxis,
    FreeMotion,
    walk_covariance,
)
from stickslip.estimation.energy.levels import AxisModel

ROUNDING = 1e-9  # relative: what the exponential of a matrix of mixed units loses
SAME_ALGEBRA = 1e-8  # of the largest value: two ways to the same posterior, conditioned to 1e7
RATE_TOLERANCE = 0.1  # decades: to which the rate is searched for
SURE = 0.999  # probability with which a right kernel passes a statistical bound


def rate_matrix(inertia: float) -> np.ndarray:
    """Rates of position, velocity and friction: x' = v, v' = -f / m, f' = white."""
    return np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0 / inertia], [0.0, 0.0, 0.0]])


def van_loan(inertia: float, sampling_time: float) -> np.ndarray:
    return integrated_noise(rate_matrix(inertia), sampling_time)


@given(inertia=st.floats(1e-2, 1e3), sampling_time=st.floats(1e-4, 1.0))
def test_what_friction_adds_in_a_sample_is_the_integral(
    inertia: float, sampling_time: float
) -> None:
    found = walk_covariance(AxisModel(inertia=inertia), sampling_time)
    scale = np.sqrt(np.outer(np.diag(found), np.diag(found)))
    np.testing.assert_allclose(
        found / scale, van_loan(inertia, sampling_time) / scale, atol=ROUNDING
    )


def test_what_friction_adds_in_a_sample_by_quadrature() -> None:
    inertia, T = 3.0, 0.07
    A, b = rate_matrix(inertia), np.array([0.0, 0.0, 1.0])
    found = walk_covariance(AxisModel(inertia=inertia), T)
    for i in range(3):
        for j in range(3):

            def integrand(s: float, i: int = i, j: int = j) -> float:
                over = scipy.linalg.expm(A * s) @ b
                return float(over[i] * over[j])

            expected, _ = quad(integrand, 0.0, T, epsabs=0.0, epsrel=1e-12)
            assert found[i, j] == pytest.approx(expected, rel=ROUNDING)


@dataclass(frozen=True, kw_only=True)
class Walk:
    """A simulated stretch whose friction is a random walk, with the noise levels of the filter."""

    inertia: float = 2.0
    sampling_time: float = 0.02
    rate: float = 5.0
    noise: tuple[float, float] = (1e-3, 2e-2)
    force: np.ndarray
    truth: np.ndarray
    position: np.ndarray
    velocity: np.ndarray

    @classmethod
    def simulated(cls, samples: int, seed: int, *, rate: float = 5.0) -> "Walk":
        generator = np.random.default_rng(seed)
        m, T, noise = cls.inertia, cls.sampling_time, cls.noise
        transition = scipy.linalg.expm(rate_matrix(m) * T)
        push = np.array([0.5 * T**2 / m, T / m, 0.0])
        root = np.linalg.cholesky(rate * van_loan(m, T))
        force = 10.0 * np.sin(0.3 * np.arange(samples)) + generator.normal(size=samples)
        states = np.zeros((samples, 3))
        states[0] = 0.3, -0.5, 2.0
        for k in range(samples - 1):
            shock = root @ generator.normal(size=3)
            states[k + 1] = transition @ states[k] + push * force[k] + shock
        return cls(
            rate=rate,
            force=force,
            truth=states,
            position=states[:, 0] + noise[0] * generator.normal(size=samples),
            velocity=states[:, 1] + noise[1] * generator.normal(size=samples),
        )

    @property
    def axis(self) -> FreeAxis:
        return FreeAxis.of(AxisModel(inertia=self.inertia), self.sampling_time)

    def measured(self, *, with_velocity: bool) -> DrivenMotion:
        v = self.velocity if with_velocity else None
        m, T = self.inertia, self.sampling_time
        return DrivenMotion.of(self.position, v, self.force, m, T, self.noise)

    def smoothed(self, *, with_velocity: bool) -> FreeMotion:
        return self.axis.motion(self.measured(with_velocity=with_velocity), self.rate)

    def first(self, *, with_velocity: bool) -> tuple[np.ndarray, np.ndarray]:
        """Mean and variances of the first state: as measured, friction of the size of the force."""
        n, T = self.force.size, self.sampling_time
        fastest = np.max(np.abs(np.diff(self.position))) / T
        friction = (
            np.mean(self.force**2) + (self.inertia * fastest / (n * T)) ** 2 + self.rate * n * T
        )
        speed = self.noise[1] ** 2 if with_velocity else fastest**2
        mean = np.array([self.position[0], self.velocity[0] if with_velocity else 0.0, 0.0])
        return mean, np.array([self.noise[0] ** 2, speed, friction])


@dataclass(frozen=True, kw_only=True)
class Dense:
    """Joint distribution of all states, and what is measured of them after the first sample."""

    mean: np.ndarray
    covariance: np.ndarray
    rows: np.ndarray
    measured: np.ndarray
    noise: np.ndarray

    @classmethod
    def of(cls, walk: Walk, *, with_velocity: bool) -> "Dense":
        n, m, T = walk.force.size, walk.inertia, walk.sampling_time
        transition = scipy.linalg.expm(rate_matrix(m) * T)
        push = np.array([0.5 * T**2 / m, T / m, 0.0])
        mean, variances = walk.first(with_velocity=with_velocity)
        means, shocks = (
            [mean],
            scipy.linalg.block_diag(np.diag(variances), *[walk.rate * van_loan(m, T)] * (n - 1)),
        )
        for k in range(n - 1):
            means.append(transition @ means[-1] + push * walk.force[k])
        powers = [np.linalg.matrix_power(transition, k) for k in range(n)]
        zero = np.zeros((3, 3))
        spread = np.block([[powers[i - j] if i >= j else zero for j in range(n)] for i in range(n)])
        places = [3 * k + c for k in range(1, n) for c in range(2 if with_velocity else 1)]
        columns = [walk.position, walk.velocity]
        return cls(
            mean=np.concatenate(means),
            covariance=spread @ shocks @ spread.T,
            rows=np.eye(3 * n)[places],
            measured=np.array([columns[place % 3][place // 3] for place in places]),
            noise=np.array([walk.noise[place % 3] ** 2 for place in places]),
        )

    @property
    def of_measured(self) -> tuple[np.ndarray, np.ndarray]:
        inside = self.rows @ self.covariance @ self.rows.T
        return self.rows @ self.mean, inside + np.diag(self.noise)

    def conditioned(self) -> tuple[np.ndarray, np.ndarray]:
        expected, spread = self.of_measured
        gain = np.linalg.solve(spread, self.rows @ self.covariance).T
        return (
            self.mean + gain @ (self.measured - expected),
            self.covariance - gain @ self.rows @ self.covariance,
        )


@pytest.mark.parametrize("with_velocity", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_the_smoother_is_the_posterior(with_velocity: bool, seed: int) -> None:
    walk = Walk.simulated(40, seed)
    mean, covariance = Dense.of(walk, with_velocity=with_velocity).conditioned()
    found = walk.smoothed(with_velocity=with_velocity)
    columns = np.column_stack([found.position, found.velocity, found.friction])
    scale = np.max(np.abs(columns), axis=0)
    np.testing.assert_allclose(columns / scale, mean.reshape(-1, 3) / scale, atol=SAME_ALGEBRA)
    spread = np.sqrt(np.diag(covariance))[1::3]
    np.testing.assert_allclose(found.velocity_spread, spread, rtol=1e-5)  # of a difference


@pytest.mark.parametrize("with_velocity", [True, False])
@pytest.mark.parametrize("rate", [1e-4, 5.0, 1e4])
def test_the_cost_is_the_likelihood(with_velocity: bool, rate: float) -> None:
    walk = Walk.simulated(40, 4, rate=rate)
    expected, spread = Dense.of(walk, with_velocity=with_velocity).of_measured
    measured = Dense.of(walk, with_velocity=with_velocity).measured
    whole = scipy.stats.Covariance.from_cholesky(np.linalg.cholesky(spread))
    log_density = scipy.stats.multivariate_normal(expected, whole).logpdf(measured)
    cost = walk.axis.cost(walk.measured(with_velocity=with_velocity), rate)
    twice = -2.0 * log_density - measured.size * np.log(2.0 * np.pi)
    assert cost == pytest.approx(twice, rel=1e-8, abs=1e-6)


@pytest.mark.parametrize("with_velocity", [True, False])
def test_the_smoother_is_that_of_statsmodels(with_velocity: bool) -> None:
    walk = Walk.simulated(500, 7)
    m, T = walk.inertia, walk.sampling_time
    other = KalmanSmoother(k_endog=2, k_states=3, k_posdef=3)
    measured = np.column_stack([walk.position, walk.velocity])
    measured[0] = np.nan  # it is in the first state already
    if not with_velocity:
        measured[:, 1] = np.nan
    other.bind(measured)
    other["design"] = np.eye(2, 3)
    other["obs_cov"] = np.diag(walk.noise) ** 2
    other["transition"] = scipy.linalg.expm(rate_matrix(m) * T)
    other["selection"] = np.eye(3)
    other["state_cov"] = walk.rate * van_loan(m, T)
    other["state_intercept"] = np.outer([0.5 * T**2 / m, T / m, 0.0], walk.force)
    mean, variances = walk.first(with_velocity=with_velocity)
    other.initialize_known(mean, np.diag(variances))
    expected = other.smooth()
    found = walk.smoothed(with_velocity=with_velocity)
    columns = np.column_stack([found.position, found.velocity, found.friction])
    scale = np.max(np.abs(columns), axis=0)
    np.testing.assert_allclose(
        columns / scale, expected.smoothed_state.T / scale, atol=SAME_ALGEBRA
    )
    spread = np.sqrt(expected.smoothed_state_cov[1, 1])
    np.testing.assert_allclose(found.velocity_spread, spread, rtol=1e-5)  # of a difference


@pytest.mark.slow
@pytest.mark.parametrize("with_velocity", [True, False])
def test_the_spread_is_that_of_the_errors(with_velocity: bool) -> None:
    """In the middle and at both ends, over runs with noise and friction of their own."""
    runs = 300
    errors = np.empty((runs, 3))
    for k in range(runs):
        walk = Walk.simulated(60, 1000 + k)
        found = walk.smoothed(with_velocity=with_velocity)
        error = (found.velocity - walk.truth[:, 1]) / found.velocity_spread
        errors[k] = error[[1, 30, 59]]
    low, high = scipy.stats.chi2.interval(SURE, runs)
    squares = np.sum(errors**2, axis=0)
    assert np.all((squares > low) & (squares < high))


@pytest.mark.parametrize(
    ("rate", "with_velocity"),
    quick_where(lambda rate, _: rate == 5.0, product([0.05, 5.0, 500.0], [True, False])),
)
def test_the_rate_of_the_walk_is_found(with_velocity: bool, rate: float) -> None:
    runs = 12
    decades = np.empty(runs)
    for k in range(runs):
        walk = Walk.simulated(1500, k, rate=rate)
        found = walk.axis.likeliest_rate([walk.measured(with_velocity=with_velocity)])
        decades[k] = np.log10(found / rate)
    wandering = 4.0 * decades.std(ddof=1) / np.sqrt(runs)
    assert abs(decades.mean()) < RATE_TOLERANCE + wandering
    assert decades.std(ddof=1) < 0.2  # 1500 samples determine it to better than half of itself


def test_short_stretches_determine_the_rate_together() -> None:
    """Thirty of 100 samples: each alone is wrong by a factor of 2, all together are not."""
    walks = [Walk.simulated(100, 500 + k) for k in range(30)]
    stretches, axis = [walk.measured(with_velocity=True) for walk in walks], walks[0].axis
    together = np.log10(axis.likeliest_rate(stretches) / Walk.rate)
    alone = [np.log10(axis.likeliest_rate([one]) / Walk.rate) for one in stretches]
    spread = np.std(alone, ddof=1)
    assert abs(together) < RATE_TOLERANCE + 4.0 * spread / np.sqrt(len(walks))


def test_a_coast_without_any_force_still_has_friction() -> None:
    """Nothing is pushed: the loss of speed alone says that there is friction."""
    T, m = 0.001, 2.0
    generator = np.random.default_rng(0)
    time = np.arange(1000) * T
    truth = 3.0 - 1.5 * time  # a friction of 3 N
    x = 3.0 * time - 0.75 * time**2 + 1e-5 * generator.normal(size=time.size)
    v = truth + 1e-2 * generator.normal(size=time.size)
    noise = (1e-5, 1e-2)
    measured = DrivenMotion.of(x, v, np.zeros(1000), m, T, noise)
    axis = FreeAxis.of(AxisModel(inertia=m), T)
    found = axis.motion(measured, axis.likeliest_rate([measured]))
    # A dozen standard deviations of the smoothed motion, whose edges are the noisiest
    np.testing.assert_allclose(found.velocity, truth, atol=0.02)
    assert np.median(found.friction) == pytest.approx(3.0, rel=0.02)
