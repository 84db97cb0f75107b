"""Tracked series: what is learned of the drive, the computed load, and landings with faults."""

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from landing_runs import landing_settings
from scipy.integrate import solve_ivp

from stickslip.control import TrackedBeside, TrackedLandingController
from stickslip.control.landing.tracked.drive_fit import DriveFit, SeenSeries
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import PlantStepper

T, LIMIT = 0.02, 1.0
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.2, mass_2=0.8, stiffness=1.5, friction=LAW)
UNKNOWN = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
WITHIN = 1e-5  # of a move of 1 m


def integrated(effort: np.ndarray, delay: float, gain: float) -> np.ndarray:
    """Return the states of the arm while mass 1 slips, by an integrator of general use."""
    sent = np.concatenate((np.zeros(8), gain * effort))
    part = delay % 1.0

    def rates(t: float, y: np.ndarray, u: float) -> list[float]:
        del t
        x1, v1, x2, v2 = y
        spring = ARM.stiffness * (x1 - x2)
        return [v1, (u - 0.15 - 0.1 * v1 - spring) / ARM.mass_1, v2, spring / ARM.mass_2]

    y = np.array([0.0, 0.3, 0.0, 0.3])
    states = [y]
    for k in range(effort.size):
        last = 8 + k - int(delay)
        # The effort of the sample before acts until it is through
        for length, u in ((part * T, sent[last - 1]), ((1.0 - part) * T, sent[last])):
            if length > 0.0:
                y = solve_ivp(rates, (0.0, length), y, args=(u,), rtol=1e-10, atol=1e-12).y[:, -1]
        states.append(y)
    return np.array(states)


def series(effort: np.ndarray, seen: np.ndarray, velocity_noise: float = 0.0) -> SeenSeries:
    return SeenSeries(
        arm=ARM, effort=effort, seen=seen, sampling_time=T, velocity_noise=velocity_noise
    )


@pytest.mark.parametrize("noise", [0.0, 1e-4])
@pytest.mark.parametrize("most", [0.52, 0.6, 1.0])
def test_a_limit_of_the_drive_is_seen(most: float, noise: float) -> None:
    generator = np.random.default_rng(3)
    effort = np.repeat(generator.uniform(0.2, 0.8, 20), 5)
    seen = integrated(np.minimum(effort, most), 0.0, 1.0)
    seen = seen + generator.normal(size=seen.shape) * [0.1 * noise, noise, 0.1 * noise, noise]
    first = DriveFit.first(0.1, 0.0, np.diag([0.01, 0.25]))
    found = first.clipped(series(effort, seen, noise), 1.0)
    assert found == pytest.approx(most, abs=0.011)


@pytest.mark.parametrize(("delay", "gain"), [(0.0, 1.0), (0.25, 1.03), (1.0, 0.9), (2.0, 1.0)])
def test_friction_delay_and_gain_are_those_of_the_drive(delay: float, gain: float) -> None:
    generator = np.random.default_rng(3)
    effort = np.repeat(generator.uniform(0.2, 0.8, 20), 5)
    seen = integrated(effort, delay, gain)
    first = DriveFit.first(0.1, 0.0, np.diag([0.01, 0.25]))
    # The efforts before the first sample were others
    fit = first.after(series(effort, seen), LIMIT)
    assert fit.delay == pytest.approx(delay, abs=0.02)
    assert fit.gain == pytest.approx(gain, rel=0.002)
    assert fit.friction[0] == pytest.approx(0.15, rel=0.01)
    assert fit.friction[1] == pytest.approx(0.1, rel=0.02)


def test_a_series_without_friction_teaches_nothing() -> None:
    effort = np.repeat(np.random.default_rng(3).uniform(0.2, 0.8, 20), 5)
    seen = integrated(effort + 0.3, 0.0, 1.0)  # a force drives mass 1, more than friction brakes it
    first = DriveFit.first(0.15, 0.1, np.diag([0.01, 0.25]))
    assert first.after(series(effort, seen), LIMIT) is first


def test_intervals_of_friction_cover_it_with_noise() -> None:
    effort = np.repeat(np.random.default_rng(3).uniform(0.2, 0.8, 20), 5)
    seen = integrated(effort, 0.0, 1.0)
    first = DriveFit.first(0.1, 0.0, np.diag([0.01, 0.25]))
    off = []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(size=seen.shape) * [1e-5, 1e-3, 1e-5, 1e-3]
        fit = first.after(series(effort, seen + noise, velocity_noise=1e-3), LIMIT)
        spread = np.sqrt(np.diag(fit.covariance))
        off.append((np.array(fit.friction) - (0.15, 0.1)) / spread)
    # 95 % of the intervals and not much fewer
    assert np.mean(np.abs(off) < 1.96) > 0.85
    assert np.std(off) > 0.2


def controller(**settings: Any) -> TrackedLandingController:
    usual: dict[str, Any] = {
        "sampling_time": T,
        "tolerance": 0.5 * WITHIN,
        "arm": replace(ARM, friction=UNKNOWN),
        "effort_limit": LIMIT,
    }
    return TrackedLandingController(**landing_settings(**(usual | settings)))


def flown(
    landing: TrackedLandingController,
    seconds: float,
    *,
    delay: int = 0,
    lost: float = 0.0,
    load: bool = True,
    encoder: float = 0.0,
) -> tuple[Any, np.ndarray, np.ndarray]:
    """Return the state of the controller, the states of the arm, and the efforts as sent."""
    plant = PlantStepper(ARM, sampling_time=T)
    arm, motion = plant.init(), (0.0, 0.0, 0.0, 0.0)
    generator = np.random.default_rng(1)
    state, waiting = landing.init(), [0.0] * delay
    path, sent = [], []
    for k in range(round(seconds / T)):
        x, v, x2, v2 = motion
        sample = SensorSample(k * T, x, v, x2 if load else np.nan, v2 if load else np.nan)
        if encoder > 0.0:  # positions alone
            place, place_2 = encoder * np.round(np.array((x, x2)) / encoder)
            sample = SensorSample(k * T, float(place), np.nan, float(place_2), np.nan)
        if generator.uniform() < lost:
            state, effort = landing.blind(state, k * T)
        else:
            state, effort = landing.step(state, sample)
        effort = 0.0 if np.isnan(effort) else effort
        waiting.append(effort)
        arm, motion = plant.step(arm, waiting.pop(0))
        path.append((x, v, x2, v2))
        sent.append(effort)
    return state, np.array(path), np.array(sent)


def off(path: np.ndarray, target: float) -> float:
    x, _, x2, v2 = path[-1]
    return max(abs(x - target), float(np.hypot(x2 - x, v2 / np.sqrt(1.5 / 0.8))))


@pytest.mark.parametrize(
    "faults",
    [
        {"delay": 2, "load": False},
        pytest.param({}, marks=pytest.mark.slow),
        pytest.param({"lost": 0.02}, marks=pytest.mark.slow),
        pytest.param({"load": False}, marks=pytest.mark.slow),
    ],
    ids=["delay, no load", "none", "lost", "no load"],
)
def test_the_arm_lands_without_knowing_friction(faults: dict[str, Any]) -> None:
    landing = controller()
    state, path, sent = flown(landing, 40.0, **faults)
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert off(path, 1.0) <= WITHIN
    assert np.abs(sent).max() <= LIMIT
    assert state.drive.delay == pytest.approx(faults.get("delay", 0), abs=0.05)
    assert landing.estimates(state)["coulomb_friction"] == pytest.approx(0.15, rel=0.02)


def test_the_arm_lands_by_encoders_alone() -> None:
    step = 1e-5
    landing = controller(
        tolerance=5e-5,
        position_noise=step / np.sqrt(12.0),
        velocity_noise=step / (np.sqrt(6.0) * T),
    )
    state, path, _ = flown(landing, 40.0, encoder=step)
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert off(path, 1.0) <= 5e-5
    assert state.drive.lag == pytest.approx(0.5, rel=0.02)
    assert state.drive.delay == pytest.approx(0.0, abs=0.1)
    assert landing.estimates(state)["coulomb_friction"] == pytest.approx(0.15, rel=0.02)


def test_one_series_does_with_friction_known() -> None:
    landing = controller(arm=ARM, estimator=EnergyEstimator(
        force_noise=0.0, inertia=1.2, load_inertia=0.8, stiffness=1.5, offset=False,
        initial_values={"coulomb_friction": 0.15, "viscous_friction": 0.1},
        initial_variance=1e-6,
    ))  # fmt: skip
    state, path, _ = flown(landing, 12.0)
    assert len(state.flights) == 1
    assert off(path, 1.0) <= WITHIN
    assert [phase.name for phase in state.phases] == ["resting", "series", "resting", "done"]
    # Little longer than the shortest series
    assert state.phases[-1].start < 1.35 * state.flights[0].planned.least_duration + 0.5


def test_a_series_whose_motion_is_not_seen_is_stopped() -> None:
    """Sensors that froze while the arm rested: it moves, and nobody sees it."""
    landing = controller(arm=ARM)
    plant = PlantStepper(ARM, sampling_time=T)
    arm, motion, state = plant.init(), (0.0, 0.0, 0.0, 0.0), landing.init()
    farthest = 0.0
    for k in range(round(20.0 / T)):
        state, effort = landing.step(state, SensorSample(k * T, 0.0, 0.0, 0.0, 0.0))
        arm, motion = plant.step(arm, effort)
        farthest = max(farthest, abs(motion[0]))
    assert landing.outcome(state) is PositioningOutcome.STOPPED
    assert "its sensor" in str(landing.why(state))
    assert 0.0 < farthest < 0.5  # of a move of 1 m


def test_the_corridor_is_that_of_the_corrected_series() -> None:
    landing = controller(arm=ARM)
    state, path, _ = flown(landing, 1.0)
    assert state.phase.name == "series"
    off_plan = (0.6, 0.0, 0.0, 0.0)
    corrected = replace(state, deviations=(*state.deviations[:-1], off_plan))
    x, v, x2, v2 = path[-1]
    here, ahead = SensorSample(1.0, x, v, x2, v2), SensorSample(1.0, x + 0.6, v, x2, v2)
    assert not landing._off(state, here)
    assert landing._off(state, ahead)
    assert landing._off(corrected, here)
    assert not landing._off(corrected, ahead)


@pytest.mark.parametrize(
    ("when", "target"),
    [(1.0, -0.5), (2.0, 0.5), pytest.param(2.4, 0.45, marks=pytest.mark.slow)],
)
def test_a_new_target_in_motion_brakes_and_goes_there(when: float, target: float) -> None:
    landing = controller()
    plant = PlantStepper(ARM, sampling_time=T)
    arm, motion = plant.init(), (0.0, 0.0, 0.0, 0.0)
    state = landing.init()
    for k in range(round(50.0 / T)):
        if k == round(when / T):
            state = landing.retargeted(state, target)
        state, effort = landing.step(state, SensorSample(k * T, *motion))
        arm, motion = plant.step(arm, effort)
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert abs(motion[0] - target) <= WITHIN


@pytest.mark.slow
def test_a_tolerance_that_no_series_meets_ends_near_the_target() -> None:
    landing = controller(tolerance=1e-13)
    state, path, _ = flown(landing, 100.0, delay=1)
    assert landing.outcome(state) is PositioningOutcome.STOPPED
    assert "no nearer" in str(landing.why(state))
    assert off(path, 1.0) <= WITHIN
    assert state.series_since_target <= landing.most_series


class Waited:
    """A loop in which every plan beside it is there one sample later."""

    def __init__(self, landing: TrackedBeside) -> None:
        self.landing = landing

    def step(self, state: Any, sample: SensorSample) -> Any:
        for each in self.landing._pending.values():
            each.result()
        return self.landing.step(state, sample)


@pytest.mark.slow
def test_plans_beside_the_loop_land_the_arm_and_what_follows_a_rest_is_planned_anew() -> None:
    soft = replace(ARM, mass_2=2.7, stiffness=0.45)  # slow enough for a rest on the way
    estimator = EnergyEstimator(
        force_noise=0.0, inertia=1.2, load_inertia=2.7, stiffness=0.45, offset=False
    )
    inside = controller(arm=replace(soft, friction=UNKNOWN), estimator=estimator)
    settings = {each.name: getattr(inside, each.name) for each in fields(inside)}
    landing = TrackedBeside(**settings | {"plans_inside": False, "planning_time": 0.4})
    loop = Waited(landing)
    plant = PlantStepper(soft, sampling_time=T)
    arm, motion = plant.init(), (0.0, 0.0, 0.0, 0.0)
    state = landing.init()
    waiting = [0.0]
    for k in range(round(60.0 / T)):
        state, effort = loop.step(state, SensorSample(k * T, *motion))
        waiting.append(1.03 * effort)
        arm, motion = plant.step(arm, waiting.pop(0))
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert abs(motion[0] - 1.0) <= WITHIN
    assert state.drive.gain == pytest.approx(1.03, rel=1e-3)
    assert any("anew" in phase.reason for phase in state.phases)
