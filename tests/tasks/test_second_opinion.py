"""Named estimators on logs that their model does not describe, with motions in closed form."""

import numpy as np
import pytest
from axis_logs import axis_log
from two_sines import Motion

from stickslip import identify
from stickslip.records import AxisLog, Status

TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5}


def log_of(*, delay: float = 0.0, stiffness: float = 0.0, scale: float = 1.0) -> AxisLog:
    """Return a log of two sines, whose effort has noise of 1 % of friction."""
    time = np.arange(0.0, 10.0, 1e-3)
    # The effort of a sample is held until the next
    acts = Motion(time=time + 0.5e-3 + delay, phases=(0.3, 0.3))
    effort = acts.effort() + stiffness * acts.position
    effort += 0.015 * np.random.default_rng(1).standard_normal(time.size)
    shown = Motion(time=time, phases=(0.3, 0.3)).position
    return axis_log(time, effort, scale * shown, name="sines")


@pytest.mark.parametrize("estimator", ["energy", "idim-ls"])
def test_an_estimate_that_the_default_one_confirms_is_ok(estimator: str) -> None:
    found = identify(log_of(), estimator=estimator).estimate
    assert found.status is Status.OK
    for name, value in TRUTH.items():
        assert found.value(name) == pytest.approx(value, rel=0.02)


@pytest.mark.parametrize("estimator", ["energy", "idim-ls"])
@pytest.mark.parametrize("fault", [{"delay": 5e-3}, {"delay": 20e-3}, {"stiffness": 6.0}])
def test_an_estimate_that_the_default_one_contradicts_is_a_mismatch(
    fault: dict[str, float], estimator: str
) -> None:
    log = log_of(**fault)
    right, other = identify(log).estimate, identify(log, estimator=estimator).estimate
    assert right.status is Status.OK
    assert right.value("mass") == pytest.approx(3.0, rel=0.01)
    assert abs(other.value("mass") / 3.0 - 1.0) > 0.02  # what the model lacks
    assert other.status is Status.MODEL_MISMATCH
    assert other.diagnostics.notes[0].startswith("the default estimator finds mass of ")


def test_a_mismatch_that_the_default_estimator_finds_holds_for_others() -> None:
    found = identify(log_of(scale=1e3), estimator="energy").estimate  # the position in mm
    assert found.status is Status.MODEL_MISMATCH
    assert "is the position in mm? if so, state --unit position=mm" in found.diagnostics.notes[0]
