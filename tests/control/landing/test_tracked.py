"""Tracked series: what is learned of the drive, the computed load, and landings with faults."""

from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
from landing_runs import Waited, fly, landing_settings
from scipy.integrate import solve_ivp

from stickslip.control import TrackedBeside, TrackedLandingController
from stickslip.control.landing.arm_belief import Swing
from stickslip.control.landing.tracked.correction import NONE
from stickslip.control.landing.tracked.drive_fit import DriveFit, SeenSeries
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseSeries
from stickslip.plants import FlexibleArm
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import PlantStepper

T, LIMIT = 0.02, 1.0
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.2, mass_2=0.8, stiffness=1.5, friction=LAW)
UNKNOWN = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
WITHIN = 1e-5  # of a move of 1 m
EFFORT = np.repeat(np.random.default_rng(3).uniform(0.2, 0.8, 20), 5)
FIRST = DriveFit.first(0.1, 0.0, np.diag([0.01, 0.25]))


def integrated(effort: np.ndarray, delay: float, gain: float, damping: float = 0.0) -> np.ndarray:
    """Return the states of the arm while mass 1 slips, by an integrator of general use."""
    sent = np.concatenate((np.zeros(8), gain * effort))
    part = delay % 1.0

    def rates(t: float, y: np.ndarray, u: float) -> list[float]:
        del t
        x1, v1, x2, v2 = y
        spring = ARM.stiffness * (x1 - x2) + damping * (v1 - v2)
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
    found = FIRST.clipped(series(effort, seen, noise), 1.0)
    assert found == pytest.approx(most, abs=0.011)


@pytest.mark.parametrize(("delay", "gain"), [(0.0, 1.0), (0.25, 1.03), (1.0, 0.9), (2.0, 1.0)])
def test_friction_delay_and_gain_are_those_of_the_drive(delay: float, gain: float) -> None:
    # The efforts before the first sample were others
    fit = FIRST.after(series(EFFORT, integrated(EFFORT, delay, gain)), LIMIT)
    assert fit.delay == pytest.approx(delay, abs=0.02)
    assert fit.gain == pytest.approx(gain, rel=0.002)
    assert fit.friction[0] == pytest.approx(0.15, rel=0.01)
    assert fit.friction[1] == pytest.approx(0.1, rel=0.02)


@pytest.mark.parametrize("samples", [15, 100])
def test_friction_is_that_of_mass_1_behind_a_damped_spring(samples: int) -> None:
    effort, damping = EFFORT[:samples], 0.1
    seen = series(effort, integrated(effort, 0.0, 1.0, damping))
    fit = FIRST.after(replace(seen, damping=damping), LIMIT)
    assert fit.friction == pytest.approx((0.15, 0.1), rel=1e-3)
    assert FIRST.after(seen, LIMIT).friction != pytest.approx((0.15, 0.1), rel=0.01)


def test_nothing_is_learned_from_a_series_without_friction() -> None:
    seen = integrated(EFFORT + 0.3, 0.0, 1.0)  # a force drives mass 1, more than friction brakes it
    first = DriveFit.first(0.15, 0.1, np.diag([0.01, 0.25]))
    assert first.after(series(EFFORT, seen), LIMIT) is first


@pytest.mark.parametrize("samples", [15, 100])
def test_intervals_of_friction_cover_it_with_noise(samples: int) -> None:
    seen = integrated(EFFORT[:samples], 0.0, 1.0)
    off = []
    for seed in range(40):
        noise = np.random.default_rng(seed).normal(size=seen.shape) * [1e-5, 1e-3, 1e-5, 1e-3]
        noisy = series(EFFORT[:samples], seen + noise, velocity_noise=1e-3)
        fit = FIRST.after(noisy, LIMIT)
        assert fit.rows > 0
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


def without_load(sample: SensorSample) -> SensorSample:
    return sample._replace(measured_load_position=np.nan, measured_load_velocity=np.nan)


def frozen(sample: SensorSample) -> SensorSample:
    return SensorSample(sample.time, 0.0, 0.0, 0.0, 0.0)


def flown(
    landing: Any,
    seconds: float,
    *,
    plant: FlexibleArm = ARM,
    delay: int = 0,
    gain: float = 1.0,
    lost: float = 0.0,
    seen: Callable[[SensorSample], SensorSample] = lambda sample: sample,
) -> tuple[Any, np.ndarray, np.ndarray]:
    """Return the state of the controller, the states of the arm, and the efforts as sent.

    The drive has a delay in samples and a gain; sensors may turn a true sample into another one.
    """
    stepper = PlantStepper(plant, sampling_time=T)
    arm, motion = stepper.init(), (0.0, 0.0, 0.0, 0.0)
    generator = np.random.default_rng(1)
    state, waiting = landing.init(), [0.0] * delay
    path, sent = [], []
    for k in range(round(seconds / T)):
        if generator.uniform() < lost:
            state, effort = landing.blind(state, k * T)
        else:
            state, effort = landing.step(state, seen(SensorSample(k * T, *motion)))
        effort = 0.0 if np.isnan(effort) else effort
        waiting.append(gain * effort)
        path.append(motion)
        arm, motion = stepper.step(arm, waiting.pop(0))
        sent.append(effort)
    return state, np.array(path), np.array(sent)


def off(path: np.ndarray, target: float) -> float:
    x, _, x2, v2 = path[-1]
    return max(abs(x - target), float(np.hypot(x2 - x, v2 / np.sqrt(1.5 / 0.8))))


@pytest.mark.parametrize(
    "faults",
    [
        {"delay": 2, "seen": without_load},
        pytest.param({}, marks=pytest.mark.slow),
        pytest.param({"lost": 0.02}, marks=pytest.mark.slow),
        pytest.param({"seen": without_load}, marks=pytest.mark.slow),
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

    def positions(sample: SensorSample) -> SensorSample:
        x, x2 = (step * np.round(np.array((sample[1], sample[3])) / step)).tolist()
        return SensorSample(sample.time, x, np.nan, x2, np.nan)

    state, path, _ = flown(landing, 40.0, seen=positions)
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert off(path, 1.0) <= 5e-5
    assert state.drive.lag == pytest.approx(0.5, rel=0.02)
    assert state.drive.delay == pytest.approx(0.0, abs=0.1)
    assert landing.estimates(state)["coulomb_friction"] == pytest.approx(0.15, rel=0.02)


KNOWN = EnergyEstimator(
    force_noise=0.0,
    inertia=1.2,
    load_inertia=0.8,
    stiffness=1.5,
    offset=False,
    initial_values={"coulomb_friction": 0.15, "viscous_friction": 0.1},
    initial_variance=1e-6,
)


def test_one_series_does_with_friction_known() -> None:
    landing = controller(arm=ARM, estimator=KNOWN)
    state, path, _ = flown(landing, 12.0)
    assert len(state.flights) == 1
    assert off(path, 1.0) <= WITHIN
    assert [phase.name for phase in state.phases] == ["resting", "series", "resting", "done"]
    # Little longer than the shortest series
    assert state.phases[-1].start < 1.35 * state.flights[0].planned.least_duration + 0.5


def test_a_series_whose_motion_is_not_seen_is_stopped() -> None:
    """Sensors that froze while the arm rested: it moves, and nobody sees it."""
    landing = controller(arm=ARM)
    state, path, _ = flown(landing, 20.0, seen=frozen)
    assert landing.outcome(state) is PositioningOutcome.STOPPED
    assert "its sensor" in str(landing.why(state))
    assert 0.0 < np.abs(path[:, 0]).max() < 0.5  # of a move of 1 m


def test_an_arm_that_does_not_show_a_strong_effort_is_stopped_at_once() -> None:
    """Twelve samples with most of the limit, after a delay of two: not 2 % of a long way."""
    landing = controller(target=10.0)
    state, _, sent = flown(landing, 4.0, seen=frozen)
    assert landing.outcome(state) is PositioningOutcome.STOPPED
    assert 12 <= np.count_nonzero(sent) <= 15


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
def test_a_new_target_in_motion_is_reached_after_the_series(when: float, target: float) -> None:
    landing = controller()
    run = fly(ARM, landing, (when, target), seconds=50.0)
    state = run.controller_state
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert abs(run.motion.position[-1] - target) <= WITHIN
    # The first series was not braked: mass 2 hardly swings at its end
    assert state.flights[0].final_swing < 0.05


def test_an_assumed_static_friction_is_no_reason_not_to_move() -> None:
    landing = controller(arm=ARM, estimator=KNOWN, effort_limit=0.22)
    state = landing.init()
    assert state.static_ratio * 0.15 > landing._plan_limit(state)
    swing = Swing(position=0.0, offset=0.0, velocity=0.0, frequency=1.37)
    assert isinstance(landing._next_series(state, swing), PulseSeries)


def test_a_miss_is_aimed_against_where_the_next_correction_is_the_same() -> None:
    landing = controller(arm=ARM, estimator=KNOWN)
    state, _, _ = flown(landing, 6.0)
    flight = state.flights[0]
    back = replace(flight.planned, position=flight.planned.position + 0.8)  # from 0.8 on
    missed = replace(state, flights=(*state.flights, replace(flight, planned=back)), drive=None)
    missed = replace(missed, travel=2.0, phases=(*state.phases, *state.phases))
    end = flight.start + back.moving * T
    swing = Swing(position=1.0 + 2e-4, offset=3e-4, velocity=0.0, frequency=back.frequency)
    missed = landing._with_lesson(missed, SensorSample(end, 0.0, 0.0, 0.0, 0.0), swing)
    aim = landing._aim(missed, 0.8, 1.0)
    np.testing.assert_allclose(aim, (-1.4e-4, 0.0, -3.5e-4, 0.0), atol=1e-12)
    assert landing._aim(missed, 0.9, 1.0) == NONE  # from another place
    other = replace(missed.lesson, coulomb_friction=0.12)
    assert landing._aim(replace(missed, lesson=other), 0.8, 1.0) == NONE  # with another model
    # Not what feedback could not follow: 0.02 of the travel of 0.2
    far, end_of = replace(swing, offset=4.3e-3), SensorSample(end, 0.0, 0.0, 0.0, 0.0)
    assert landing._with_lesson(missed, end_of, far).lesson is None


def test_a_series_to_a_place_beyond_is_planned_anew_to_that_place() -> None:
    landing = controller(arm=ARM, estimator=KNOWN)
    state, _, _ = flown(landing, 1.0)
    flight = state.flights[0]
    beyond = replace(flight, planned=replace(flight.planned, target=1.2))
    swing = Swing(position=0.5, offset=0.0, velocity=0.0, frequency=1.37)
    assert state.phase.name == "series"
    assert landing._places(replace(state, flights=(beyond,)), swing, 0.1) == [1.2]
    # Not where the target is another one meanwhile
    other = replace(state, target=0.7, begun=len(state.phases))
    assert landing._places(replace(other, flights=(beyond,)), swing, 0.1) == [0.7]


def test_masses_that_are_learned_are_no_gain_of_the_drive() -> None:
    wrong = replace(ARM, mass_1=1.08, mass_2=0.88, stiffness=1.35, friction=UNKNOWN)
    landing = controller(arm=wrong, arm_uncertainty=0.05, tolerance=WITHIN)
    state, path, _ = flown(landing, 40.0)
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert off(path, 1.0) <= WITHIN
    assert state.drive.gain == pytest.approx(1.0, abs=2e-3)


@pytest.mark.slow
def test_a_tolerance_that_no_series_meets_ends_near_the_target() -> None:
    landing = controller(tolerance=1e-13, most_series=40)
    state, path, _ = flown(landing, 100.0, delay=1)
    assert landing.outcome(state) is PositioningOutcome.STOPPED
    assert "no nearer" in str(landing.why(state))
    assert off(path, 1.0) <= WITHIN
    assert state.series_since_target <= landing.most_series


@pytest.mark.slow
def test_plans_beside_the_loop_land_the_arm_and_what_follows_a_rest_is_planned_anew() -> None:
    soft = replace(ARM, mass_2=2.7, stiffness=0.45)  # slow enough for a rest on the way
    estimator = EnergyEstimator(
        force_noise=0.0, inertia=1.2, load_inertia=2.7, stiffness=0.45, offset=False
    )
    inside = controller(arm=replace(soft, friction=UNKNOWN), estimator=estimator)
    settings = {each.name: getattr(inside, each.name) for each in fields(inside)}
    landing = TrackedBeside(**settings | {"plans_inside": False, "planning_time": 0.4})
    state, path, _ = flown(Waited(landing), 60.0, plant=soft, delay=1, gain=1.03)
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert abs(path[-1, 0] - 1.0) <= WITHIN
    assert state.drive.gain == pytest.approx(1.03, rel=1e-3)
    assert any("anew" in phase.reason for phase in state.phases)


def test_a_fit_to_an_effort_of_the_wrong_sign_has_no_delay() -> None:
    """No share of the effort is positive; 0/0 would be the delay."""
    values = -np.abs(FIRST.values)
    assert replace(FIRST, values=values, rows=10).delay == 0.0
