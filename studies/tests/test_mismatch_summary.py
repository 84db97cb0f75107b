"""Rates of the mismatch study against Monte Carlo."""

import numpy as np
import pytest

from studies.mismatch.summary import nominal_rate

DRAWS = 200_000


def test_nominal_rate_is_that_of_exact_intervals() -> None:
    """Two parameters with standard deviations of 2 and 4 % and exact 95 % intervals."""
    truths, stds = np.array([10.0, -3.0]), np.array([0.2, 0.12])
    errors = stds * np.random.default_rng(0).standard_normal((DRAWS, 2))
    outside = np.abs(errors) > 1.959964 * stds
    expected = np.mean(np.any(outside & (np.abs(errors) > 0.05 * np.abs(truths)), axis=1))
    found = nominal_rate(
        {
            "value": truth + 0.3 * std,
            "truth": truth,
            "error": 0.3 * std / abs(truth),
            "low": truth - 1.66 * std,
            "high": truth + 2.26 * std,
        }
        for truth, std in zip(truths.tolist(), stds.tolist(), strict=True)
    )
    assert found == pytest.approx(expected, abs=4.0 * np.sqrt(expected / DRAWS))
    assert nominal_rate([]) == 0.0
