"""Which logs show a dead band of the actuator: a motion in closed form."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from jaxtyping import Float

from stickslip.estimation.selection.estimator import SelectedModelEstimator, SelectionTuning
from stickslip.estimation.selection.search import SearchTuning
from stickslip.records import AxisLog

TIME = np.arange(0.0, 20.0, 1e-3)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """Two sines of 0.32 and 0.8 Hz."""

    time: Float[np.ndarray, " n"]

    @property
    def velocity(self) -> Float[np.ndarray, " n"]:
        return 0.1 * np.sin(2.0 * self.time) + 0.05 * np.sin(5.0 * self.time)

    @property
    def acceleration(self) -> Float[np.ndarray, " n"]:
        return 0.2 * np.cos(2.0 * self.time) + 0.25 * np.cos(5.0 * self.time)


def plain_effort(motion: Motion) -> Float[np.ndarray, " n"]:
    friction = 1.5 * np.sign(motion.velocity) + 4.0 * motion.velocity
    return 3.0 * motion.acceleration + friction + 0.2


def log_of(extra: Callable[[Motion], Float[np.ndarray, " n"]], *, noise: float = 0.02) -> AxisLog:
    """Return a log whose effort is held over each sample and has white noise."""
    acts = Motion(time=TIME + 0.5e-3)
    rng = np.random.default_rng(1)
    return AxisLog(
        name="stage",
        kind="linear",
        time=TIME,
        effort=plain_effort(acts) + extra(acts) + noise * rng.standard_normal(TIME.size),
        measured_position=-0.05 * np.cos(2.0 * TIME) - 0.01 * np.cos(5.0 * TIME),
    )


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
