"""Estimates as tests need them."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from stickslip.records import (
    Diagnostics,
    FrictionEstimate,
    ParameterEstimate,
    Provenance,
    Status,
    Verdict,
)


def doubtful_estimate() -> FrictionEstimate:
    """Return an estimate of a mass, and of an offset that is not identified."""
    return FrictionEstimate(
        estimator="energy",
        kind="linear",
        parameters={
            "mass": ParameterEstimate(name="mass", value=2.0, std=0.5, ci95=(1.0, 3.0), unit="kg"),
            "offset": ParameterEstimate(name="offset", value=None, std=None, ci95=None, unit="N"),
        },
        covariance=np.array([[0.25]]),
        status=Status.NOT_IDENTIFIABLE,
        diagnostics=Diagnostics(
            relative_residual=0.1,
            cross_validation_residual=None,
            condition_number=3.0,
            residual_autocorrelation=0.0,
            effective_samples=10.0,
            classical_std={"mass": 0.4},
            samples=10,
            verdicts=(Verdict(parameter="offset", identifiable=False, reason="it does not move"),),
        ),
        provenance=Provenance(
            stickslip_version="0", files=("a.csv",), input_sha256="00", options={"order": 4}
        ),
    )


def rotary_estimate() -> FrictionEstimate:
    """Return an estimate of a rotary axis in which everything is identified."""
    doubtful, units = doubtful_estimate(), ("kg m^2", "N m s/rad", "N m")
    values = {"inertia": 0.05, "viscous_friction": 0.2, "coulomb_friction": 0.5}
    return replace(
        doubtful,
        kind="rotary",
        parameters={
            name: ParameterEstimate(
                name=name, value=value, std=0.01, ci95=(value - 0.02, value + 0.02), unit=unit
            )
            for (name, value), unit in zip(values.items(), units, strict=True)
        },
        covariance=1e-4 * np.eye(3),
        status=Status.OK,
        diagnostics=replace(doubtful.diagnostics, verdicts=(), classical_std={}),
    )


def std_of(estimate: FrictionEstimate, name: str) -> float:
    """Return the standard deviation of a parameter, which must have one [SI]."""
    std = estimate.parameters[name].std
    assert std is not None, name
    return std


def covered(estimate: FrictionEstimate, truth: Mapping[str, float]) -> dict[str, bool]:
    """Return whether the 95 % interval of each parameter holds the truth; all must have one."""
    intervals = {name: estimate.parameters[name].ci95 for name in truth}
    assert None not in intervals.values(), intervals
    return {name: low <= truth[name] <= high for name, (low, high) in intervals.items()}  # type: ignore[misc]


def least_coverage(runs: int) -> float:
    """Return the share of 95 % intervals that hold the truth, less four standard errors."""
    return 0.95 - 4.0 * float(np.sqrt(0.95 * 0.05 / runs))


def assert_covers(fits: Iterable[FrictionEstimate], truth: Mapping[str, float]) -> None:
    """Check the share of 95 % intervals of independent runs that hold the truth.

    The parameters of a run are correlated: as many independent trials as runs are counted.
    """
    held = [list(covered(fit, truth).values()) for fit in fits]
    assert np.mean(held) > least_coverage(len(held))
