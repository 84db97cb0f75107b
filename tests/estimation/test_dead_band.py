"""Which logs show a dead band of the actuator: a motion in closed form."""

import numpy as np
import pytest
from jaxtyping import Float
from two_sines import Motion, log_of, plain_effort

from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.search.tuning import SearchTuning
from stickslip.estimation.selection.tuning import SelectionTuning
from stickslip.records import AxisLog


def tuned(search: SearchTuning) -> SelectedModelEstimator:
    return SelectedModelEstimator(tuning=SelectionTuning(search=search))


def selected(estimator: SelectedModelEstimator, log: AxisLog) -> tuple[str, ...]:
    found = estimator.fit(log).selection
    assert found is not None
    return found.selected


def test_friction_that_builds_up_is_no_dead_band() -> None:
    """A light axis whose friction builds up over 1 mm brakes by itself: its effort is friction."""

    def light(motion: Motion) -> Float[np.ndarray, " n"]:
        sign = np.sign(motion.velocity)
        path = np.cumsum(np.abs(motion.velocity)) * 1e-3
        changed = np.concatenate(([True], np.diff(sign) != 0.0))
        start = np.maximum.accumulate(np.where(changed, np.arange(sign.size), 0))
        built_up = -3.0 * sign * np.exp(-(path - path[start]) / 1e-3)
        return built_up - 2.7 * motion.acceleration - 0.2  # 0.3 kg without an offset

    log = log_of(light)
    assert "dead band" not in selected(SelectedModelEstimator(), log)
    assert "dead band" in selected(tuned(SearchTuning(friction_beside=-np.inf)), log)


def test_a_dead_band_explains_next_to_all_that_is_left() -> None:
    noisy = log_of(lambda m: 0.3 * np.sign(plain_effort(m)), noise=0.05)
    assert "dead band" not in selected(SelectedModelEstimator(), noisy)
    assert selected(tuned(SearchTuning(dead_band_gain=0.3)), noisy) == ("dead band",)


def test_a_dead_band_is_coulomb_friction_where_the_effort_never_opposes_the_motion() -> None:
    def heavy(motion: Motion) -> Float[np.ndarray, " n"]:
        return 0.3 * np.sign(motion.velocity) - 2.8 * motion.acceleration  # 0.2 kg

    estimate = SelectedModelEstimator().fit(log_of(heavy))
    assert estimate.selection is not None
    assert estimate.selection.selected == ()
    assert estimate.value("coulomb_friction") == pytest.approx(1.8, rel=0.02)
