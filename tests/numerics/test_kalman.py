"""Kalman filter, smoother and whitening against dense Gaussian algebra."""

from typing import NamedTuple

import numpy as np
import pytest
from scipy.linalg import block_diag

from stickslip.numerics import LinearModel, cost, measure, smooth, update, whiten

N, M = 12, 2
SENSORS = np.array([2, 0])
STATES = (3, 4, 5, 6)  # with a size that the kernels are written for, and without
TOLERANCE = 1e-9  # relative; both ways take some hundred operations on numbers of order 1


class Problem(NamedTuple):
    """Arguments of the filters, with one state measured twice as well as another."""

    model: LinearModel
    inputs: np.ndarray
    measured: np.ndarray
    first: np.ndarray
    spread: np.ndarray

    @classmethod
    def of(cls, states: int) -> "Problem":
        generator = np.random.default_rng(states)
        root = generator.standard_normal((states, states))
        return cls(
            LinearModel(
                A=0.5 * np.eye(states) + 0.2 * generator.standard_normal((states, states)),
                B=generator.standard_normal((states, M)),
                Q=root @ root.T,
                factors=generator.uniform(0.5, 2.0, N),
                sensors=SENSORS,
                R=np.array([0.5, 2.0]),
            ),
            inputs=generator.standard_normal((N, M)),
            measured=generator.standard_normal((N, SENSORS.size)),
            first=generator.standard_normal(states),
            spread=2.0 * np.eye(states) + 0.5,
        )

    def dense(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Mean and covariance of all states, the map to all measurements and their noise."""
        s = self.first.size
        mean, cov = [self.first], np.zeros(((N + 1) * s, (N + 1) * s))
        cov[:s, :s] = self.spread
        for k in range(1, N + 1):
            mean.append(self.model.A @ mean[-1] + self.model.B @ self.inputs[k - 1])
            old, new = slice(0, k * s), slice(k * s, (k + 1) * s)
            cross = self.model.A @ cov[(k - 1) * s : k * s, old]
            cov[new, old], cov[old, new] = cross, cross.T
            last = cov[(k - 1) * s : k * s, (k - 1) * s : k * s]
            cov[new, new] = (
                self.model.A @ last @ self.model.A.T + self.model.factors[k - 1] * self.model.Q
            )
        rows = np.hstack([np.zeros((N * SENSORS.size, s)), block_diag(*[np.eye(s)[SENSORS]] * N)])
        return np.concatenate(mean), cov, rows, np.diag(np.tile(self.model.R, N))


@pytest.mark.parametrize("states", STATES)
def test_whitening_is_that_of_the_dense_covariance(states: int) -> None:
    given = Problem.of(states)
    mean, cov, rows, noise = given.dense()
    factor = np.linalg.cholesky(rows @ cov @ rows.T + noise)
    expected = np.linalg.solve(factor, given.measured.ravel() - rows @ mean)
    found, logs = whiten(
        given.model,
        given.inputs[:, :, None],
        given.measured[:, :, None],
        given.first[:, None],
        given.spread,
    )
    np.testing.assert_allclose(found.ravel(), expected, rtol=TOLERANCE, atol=TOLERANCE)
    assert logs == pytest.approx(2.0 * np.sum(np.log(np.diag(factor))), rel=TOLERANCE)
    assert cost(*given) == pytest.approx(logs + expected @ expected, rel=TOLERANCE)


@pytest.mark.parametrize("states", STATES)
def test_smoothing_is_conditioning_on_all_measurements(states: int) -> None:
    given = Problem.of(states)
    mean, cov, rows, noise = given.dense()
    gain = np.linalg.solve(rows @ cov @ rows.T + noise, rows @ cov).T
    expected = mean + gain @ (given.measured.ravel() - rows @ mean)
    left = np.sqrt(np.diag(cov - gain @ rows @ cov)).reshape(-1, states)
    of = np.array([states - 1, 0])
    found = smooth(*given, of)
    np.testing.assert_allclose(found[:, :states].ravel(), expected, rtol=TOLERANCE, atol=TOLERANCE)
    np.testing.assert_allclose(found[:, states:], left[:, of], atol=TOLERANCE)


def test_a_measurement_of_one_state_is_one_by_a_unit_vector() -> None:
    covariance = Problem.of(4).spread + np.diag([1.0, 2.0, 3.0, 4.0])
    one, other, gains = covariance.copy(), covariance.copy(), np.zeros((2, 4))
    variance = measure(1, 0.3, one, gains[0])
    assert variance == pytest.approx(update(np.eye(4)[1], 0.3, other, gains[1]), rel=TOLERANCE)
    np.testing.assert_allclose(one, other, rtol=TOLERANCE)
    np.testing.assert_allclose(gains[0], gains[1], rtol=TOLERANCE)
