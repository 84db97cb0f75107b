"""A delay of the effort that a log does not determine widens the intervals."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from jaxtyping import Float

from stickslip.estimation import JointEstimator, SelectedModelEstimator
from stickslip.records import AxisLog, FrictionEstimate, Status

T = 1e-3
MASS, VISCOUS, COULOMB = 3.0, 40.0, 2.0
POLES = np.array([40.0, 40.0, 40.0, 40.0, 40.0, 40.0])
DISTANCES = np.array([0.1, -0.1, 0.06, -0.06, 0.14, -0.14])
REST = 0.5  # s, in which a step with a double pole of 40 rad/s settles to 1e-7


def settled(poles: Float[np.ndarray, " k"], delay: float) -> AxisLog:
    """Return steps with a double pole, x = d (1 - (1 + w t) e^(-w t)), and a delayed effort.

    The effort of a double pole is a combination of velocity and acceleration, and so is its slope:
    where all steps have the same pole, a delay cannot be separated from mass and viscous friction.
    """
    t = np.arange(round(REST / T)) * T
    positions, efforts, start = [], [], 0.0
    for w, d in zip(poles, DISTANCES, strict=True):
        positions.append(start + d * (1.0 - (1.0 + w * t) * np.exp(-w * t)))
        # The mean over the sample, as an effort that is held acts
        at = np.maximum(t + 0.5 * T + delay * T, 0.0)
        velocity = d * w**2 * at * np.exp(-w * at)
        acceleration = d * w**2 * (1.0 - w * at) * np.exp(-w * at)
        efforts.append(MASS * acceleration + VISCOUS * velocity + COULOMB * np.sign(d))
        start += d
    noise = np.random.default_rng(5).normal(0.0, 0.2, t.size * len(poles))
    return axis_log(
        np.arange(t.size * len(poles)) * T,
        np.concatenate(efforts) + noise,
        np.concatenate(positions),
    )


def half(estimate: FrictionEstimate, name: str) -> float:
    low, high = estimate.parameters[name].ci95 or (-np.inf, np.inf)
    return 0.5 * (high - low)


def unsure(estimate: FrictionEstimate) -> bool:
    return any("within a sample of its time stamp" in note for note in estimate.diagnostics.notes)


@pytest.mark.parametrize("delay", [-0.4, 0.4])
def test_intervals_contain_the_truth_if_the_log_does_not_show_the_delay(delay: float) -> None:
    log = settled(POLES, delay)
    estimate = SelectedModelEstimator().fit(log)
    taken_for_known = SelectedModelEstimator(effort_delay=0.0, select=False).fit(log)
    assert abs(taken_for_known.value("mass") - MASS) > half(taken_for_known, "mass")
    assert abs(estimate.value("mass") - MASS) < half(estimate, "mass")
    assert unsure(estimate)


def test_intervals_are_narrow_if_the_delay_is_given() -> None:
    log = settled(POLES, 0.4)
    given = SelectedModelEstimator(effort_delay=0.4 * T).fit(log)
    assert given.status is Status.OK
    assert not unsure(given)
    assert abs(given.value("mass") - MASS) < half(given, "mass")
    assert half(given, "mass") < 0.5 * half(SelectedModelEstimator().fit(log), "mass")


def test_steps_of_different_poles_show_the_delay() -> None:
    log = settled(np.array([20.0, 20.0, 40.0, 40.0, 80.0, 80.0]), 0.4)
    estimate = SelectedModelEstimator().fit(log)
    assert estimate.status is Status.OK
    assert not unsure(estimate)
    assert abs(estimate.value("effort_delay") - 0.4 * T) < half(estimate, "effort_delay")
    assert abs(estimate.value("mass") - MASS) < half(estimate, "mass")


def test_several_logs_of_the_same_steps_contain_the_truth() -> None:
    logs = [replace(settled(POLES, 0.4), name=name) for name in ("first", "second")]
    estimate = JointEstimator().fit(logs)
    assert half(estimate, "mass") > abs(estimate.value("mass") - MASS) > 0.05
