"""Kalman filter, smoother and whitening against dense Gaussian algebra."""

import numpy as np
import pytest
from scipy.linalg import block_diag

from stickslip.numerics import smooth, whiten

N, S, C, M = 12, 3, 2, 1
TOLERANCE = 1e-9  # relative; both ways take some hundred operations on numbers of order 1


def model() -> dict[str, np.ndarray]:
    generator = np.random.default_rng(3)
    root = generator.standard_normal((S, S))
    return {
        "A": np.array([[1.0, 0.3, 0.1], [0.0, 0.9, 0.2], [-0.1, 0.0, 0.7]]),
        "B": generator.standard_normal((S, M)),
        "Q": root @ root.T,
        "H": generator.standard_normal((C, S)),
        "R": np.array([0.5, 2.0]),
        "inputs": generator.standard_normal((N, M)),
        "measured": generator.standard_normal((N, C)),
        "first": generator.standard_normal(S),
        "spread": 2.0 * np.eye(S) + 0.5,
    }


def dense(
    given: dict[str, np.ndarray],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Mean and covariance of all states, the map to all measurements and their noise."""
    mean, cov = [given["first"]], np.zeros((N * S, N * S))
    cov[:S, :S] = given["spread"]
    for k in range(1, N):
        mean.append(given["A"] @ mean[-1] + given["B"] @ given["inputs"][k - 1])
        old, new = slice(0, k * S), slice(k * S, (k + 1) * S)
        cross = given["A"] @ cov[(k - 1) * S : k * S, old]
        cov[new, old], cov[old, new] = cross, cross.T
        last = cov[(k - 1) * S : k * S, (k - 1) * S : k * S]
        cov[new, new] = given["A"] @ last @ given["A"].T + given["Q"]
    rows = block_diag(*[given["H"]] * N)
    return np.concatenate(mean), cov, rows, np.diag(np.tile(given["R"], N))


def test_whitening_is_that_of_the_dense_covariance() -> None:
    given = model()
    mean, cov, rows, noise = dense(given)
    factor = np.linalg.cholesky(rows @ cov @ rows.T + noise)
    expected = np.linalg.solve(factor, given["measured"].ravel() - rows @ mean)
    found, logs = whiten(
        given["A"],
        given["B"],
        given["Q"],
        given["H"],
        given["R"],
        given["inputs"][:, :, None],
        given["measured"][:, :, None],
        given["first"][:, None],
        given["spread"],
    )
    np.testing.assert_allclose(found.ravel(), expected, rtol=TOLERANCE, atol=TOLERANCE)
    assert logs == pytest.approx(2.0 * np.sum(np.log(np.diag(factor))), rel=TOLERANCE)


def test_smoothing_is_conditioning_on_all_measurements() -> None:
    given = model()
    mean, cov, rows, noise = dense(given)
    gain = np.linalg.solve(rows @ cov @ rows.T + noise, rows @ cov).T
    expected = mean + gain @ (given["measured"].ravel() - rows @ mean)
    left = cov - gain @ rows @ cov
    means, covariances = smooth(**given)
    np.testing.assert_allclose(means.ravel(), expected, rtol=TOLERANCE, atol=TOLERANCE)
    for k in range(N):
        here = slice(k * S, (k + 1) * S)
        np.testing.assert_allclose(covariances[k], left[here, here], atol=TOLERANCE)
