"""The balance of work on line: steps and runs, rests, changes, refusals, and in a loop."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.stats
from arm_logs import arm_feedback, arm_log, energy_estimator
from axis_logs import axis_log
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.extending import is_jitted
from refusals import refuses
from simulated_logs import measured, samples_of

from stickslip.control import (
    PD,
    FeedbackController,
    FrictionCompensation,
    Move,
    OnlineFriction,
    PointToPoint,
)
from stickslip.estimation import EnergyEstimator
from stickslip.estimation.energy.known_inertia.online.state import LAG
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, simulate, simulate_closed_loop
from stickslip.tasks import surrogate

T = 0.001
MASS, VISCOUS, COULOMB = 3.0, 5.0, 2.0
TRUTH = np.array([VISCOUS, COULOMB])
LAW = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
RIGID = EnergyEstimator(inertia=MASS, offset=False)
ARM = energy_estimator()
NOISY = Sensors(position_noise=1e-4, velocity_noise=1e-2)

SURE = 0.999  # probability with which a right estimator passes a statistical bound


def swing(samples: int) -> np.ndarray:
    time = np.arange(samples) * T
    return 30.0 * np.sin(2.0 * time) + 15.0 * np.sin(5.0 * time)


def logged(effort: np.ndarray, sensors: Sensors = NOISY, seed: int = 0) -> AxisLog:
    motion = simulate(SingleMass(mass=MASS, friction=LAW), effort, sampling_time=T)
    return measured(motion, sensors, seed)


VARIANTS: dict[str, tuple[dict[str, Any], Sensors]] = {
    "noise": ({}, NOISY),
    "no velocity": ({}, Sensors(encoder_step=1e-5, velocity="none")),
    "directions": ({"per_direction": True, "offset": None}, NOISY),
    "offset": ({"offset": True}, NOISY),
    "forgetting, given noise": (
        {"forgetting_factor": 0.999, "position_noise": 1e-4, "velocity_noise": 1e-2},
        NOISY,
    ),
    "disturbance, given prior": (
        {"force_noise": 0.1, "initial_variance": 10.0, "initial_values": {"coulomb_friction": 1.0}},
        NOISY,
    ),
}


@pytest.mark.parametrize("variant", VARIANTS)
def test_steps_are_the_run_and_so_are_its_parts(variant: str) -> None:
    settings, sensors = VARIANTS[variant]
    estimator = replace(RIGID, **settings)
    log = logged(swing(700), sensors)
    start = estimator.init(sampling_time=T, velocity_measured=log.measured_velocity is not None)
    before = start.copy()
    whole, history = estimator.run(start, log)
    state, values = start, start[:0]
    for sample in samples_of(log):
        state, values = estimator.step(state, sample)
    np.testing.assert_array_equal(state, whole)
    np.testing.assert_array_equal(values, history[-1])
    np.testing.assert_array_equal(start, before)
    first, one = estimator.run(start, log.part(0, 40))
    second, two = estimator.run(first, log.part(40, 333))
    third, three = estimator.run(second, log.part(333, len(log)))
    np.testing.assert_array_equal(third, whole)
    np.testing.assert_array_equal(np.concatenate([one, two, three]), history)
    assert np.all(np.isfinite(whole))


def test_the_estimate_is_delayed_by_its_lag() -> None:
    log = logged(swing(1000))
    start = replace(RIGID, initial_values={"coulomb_friction": 1.5}).init(sampling_time=T)
    state, history = RIGID.run(start, log.part(0, LAG))
    np.testing.assert_array_equal(history, np.broadcast_to([0.0, 1.5], (LAG, 2)))
    assert np.all(np.isinf(np.diag(RIGID.covariance(state))))
    _, history = RIGID.run(state, log.part(LAG, len(log)))
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.02)


@pytest.mark.slow
def test_it_comes_to_what_the_whole_log_gives() -> None:
    """On the same log the two differ by less than either is uncertain."""
    apart, spread = [], []
    for seed in range(20):
        log = arm_log("feedforward", 1.0, np.random.default_rng(seed))
        fit = ARM.fit(log)
        offline = np.array([fit.value(name) for name in ARM.parameter_names("linear")])
        start = ARM.init(sampling_time=surrogate.SAMPLING_TIME)
        _, history = ARM.run(start, log)
        apart.append(history[-1] - offline)
        spread.append(offline)
    wandering = np.std(spread, axis=0, ddof=1)
    assert np.all(np.sqrt(np.mean(np.square(apart), axis=0)) < 0.5 * wandering)


def test_its_covariance_is_that_of_its_errors() -> None:
    """Squared errors over P, at the end and half way, follow chi squared."""
    runs = 60
    squares = {"half": 0.0, "end": 0.0}
    truth = np.array([surrogate.VISCOUS_FRICTION, surrogate.COULOMB_FRICTION])
    for seed in range(runs):
        log = arm_log("feedforward", 1.0, np.random.default_rng(100 + seed))
        state = ARM.init(sampling_time=surrogate.SAMPLING_TIME)
        for name, part in (("half", log.part(0, 1000)), ("end", log.part(1000, len(log)))):
            state, history = ARM.run(state, part)
            error = history[-1] - truth
            squares[name] += float(error @ np.linalg.solve(ARM.covariance(state), error))
    low, high = scipy.stats.chi2.interval(SURE, 2 * runs)
    assert all(low < total < high for total in squares.values())


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
@pytest.mark.parametrize("place", range(3))
def test_an_impossible_value_is_counted_and_changes_nothing(place: int, bad: float) -> None:
    log = logged(swing(300))
    state, _ = RIGID.run(RIGID.init(sampling_time=T), log)
    sample: Any = [1.0, 0.1, 0.2, 0.0, 0.0]
    sample[place] = bad
    after, values = RIGID.step(state, tuple(sample))
    np.testing.assert_allclose(values, state[RIGID._places], rtol=0.01)
    assert RIGID.health(after).missing_samples == 1
    assert np.all(np.isfinite(values))
    assert RIGID.kernel(state.copy(), *sample) == bool(np.isfinite(bad))


@settings(max_examples=25)
@given(
    seed=st.integers(0, 1000),
    factor=st.floats(0.9, 1.0),
    noise=st.sampled_from([0.0, 1e-6, 1e-4, 1e-2]),
    encoder=st.sampled_from([0.0, 1e-5, 1e-3]),
    velocity=st.booleans(),
    force_noise=st.sampled_from([0.0, 0.1, 10.0]),
    variant=st.sampled_from([{"offset": False}, {"offset": True}, {"per_direction": True}]),
)
def test_the_covariance_is_positive(
    seed: int,
    factor: float,
    noise: float,
    encoder: float,
    velocity: bool,
    force_noise: float,
    variant: dict[str, bool],
) -> None:
    """Through motions and rests of a random push, with any sensor."""
    generator = np.random.default_rng(seed)
    effort = np.repeat(10.0 * generator.normal(size=12) * generator.integers(0, 2, 12), 250)
    sensors = Sensors(
        position_noise=noise,
        encoder_step=encoder,
        velocity="measured" if velocity else "none",
        velocity_noise=100.0 * noise if velocity else 0.0,
    )
    log = logged(effort, sensors, seed)
    estimator = EnergyEstimator(
        inertia=MASS, forgetting_factor=factor, force_noise=force_noise, **variant
    )
    state = estimator.init(sampling_time=T, velocity_measured=velocity)
    for k in range(0, len(log) - 100, 100):
        state, history = estimator.run(state, log.part(k, k + 100))
        assert np.all(np.isfinite(history))
        P = estimator.covariance(state)
        known = np.isfinite(np.diag(P))
        inner = P[np.ix_(known, known)]
        np.testing.assert_array_equal(inner, inner.T)
        assert np.all(np.diag(inner) > 0.0)
        scale = np.sqrt(np.diag(inner))
        # Eight digits are left of what the motion so far does not determine
        assert np.all(np.linalg.eigvalsh(inner / np.outer(scale, scale)) > -1e-7)


@pytest.mark.parametrize("factor", [1.0, 0.999, 0.99])
@pytest.mark.parametrize(
    "sensors",
    [NOISY, Sensors(position_noise=1e-4, velocity="none"), Sensors(), Sensors(encoder_step=1e-5)],
)
def test_a_long_rest_changes_nothing(factor: float, sensors: Sensors) -> None:
    effort = np.concatenate([swing(5000), np.zeros(100_000), swing(3000)])
    log = logged(effort, sensors)
    measured = log.measured_velocity is not None
    estimator = replace(RIGID, forgetting_factor=factor)
    state = estimator.init(sampling_time=T, velocity_measured=measured)
    settled, before = estimator.run(state, log.part(0, 6000))
    rested, after = estimator.run(settled, log.part(6000, 105_000))
    np.testing.assert_allclose(after[-1], before[-1], rtol=1e-4)
    spread, later = (np.diag(estimator.covariance(s)) for s in (settled, rested))
    assert np.all(later < 1.2 * spread)
    _, history = estimator.run(rested, log.part(105_000, len(log)))
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.02)


def warmed_up(before: int, after: int, sensors: Sensors) -> AxisLog:
    """Return the log of a stage whose grease is warm, with half the friction, after a while."""
    half = CoulombViscousFriction.symmetric(
        coulomb_friction=0.5 * COULOMB, viscous_friction=0.5 * VISCOUS
    )
    effort = swing(before + after)
    cold = simulate(SingleMass(mass=MASS, friction=LAW), effort[:before], sampling_time=T)
    end = (float(cold.position[-1]), float(cold.velocity[-1]))
    warm = simulate(
        SingleMass(mass=MASS, friction=half), effort[before:], sampling_time=T, initial_state=end
    )
    generator = np.random.default_rng(0)
    first = sensors.measure(cold, generator).part(0, before)
    second = sensors.measure(warm, generator)

    def both(name: str) -> Any:
        return np.concatenate([getattr(first, name), getattr(second, name)])

    measured = first.measured_velocity is not None
    return replace(
        first,
        time=np.arange(before + after + 1) * T,
        effort=both("effort"),
        measured_position=both("measured_position"),
        measured_velocity=both("measured_velocity") if measured else None,
    )


@pytest.mark.parametrize("sensors", [NOISY, Sensors(encoder_step=1e-5, velocity="none")])
def test_a_change_of_friction_is_followed(sensors: Sensors) -> None:
    """It takes some swings: the noise is small, so that the change is ten thousand of it."""
    before, memory = 5_000, 200
    log = warmed_up(before, 20_000, sensors)
    ends = {}
    for factor in (1.0, 1.0 - 1.0 / memory):
        estimator = replace(RIGID, forgetting_factor=factor, force_noise=0.0)
        state = estimator.init(sampling_time=T, velocity_measured=log.measured_velocity is not None)
        _, history = estimator.run(state, log)
        np.testing.assert_allclose(history[before], TRUTH, rtol=0.05)
        ends[factor] = history[-1]
    np.testing.assert_allclose(ends[1.0 - 1.0 / memory], 0.5 * TRUTH, rtol=0.05)
    # Who forgets nothing is far from it
    assert np.any(np.abs(ends[1.0] / TRUTH - 0.5) > 0.1)


@pytest.mark.parametrize(
    "sensors",
    [
        Sensors(velocity="none"),
        Sensors(encoder_step=1e-4, velocity="none"),
        Sensors(encoder_step=1e-3, velocity="differences"),
        Sensors(position_noise=1e-5, velocity="none"),
        NOISY,
    ],
)
@pytest.mark.parametrize("rest", [100, 20_000])
def test_a_rest_before_the_first_motion_changes_nothing(sensors: Sensors, rest: int) -> None:
    """An encoder that has not counted yet says nothing of its noise."""
    log = logged(np.concatenate([np.zeros(rest), swing(8000)]), sensors)
    state = RIGID.init(sampling_time=T, velocity_measured=log.measured_velocity is not None)
    _, history = RIGID.run(state, log)
    np.testing.assert_array_equal(history[:rest], 0.0)
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.002)


def test_a_count_of_the_encoder_is_no_motion() -> None:
    time = np.arange(5000) * T
    log = axis_log(time, 1.5 * np.sin(time), np.where(time > 2.0, 1e-4, 0.0))
    state = RIGID.init(sampling_time=T, velocity_measured=False)
    state, history = RIGID.run(state, log)
    np.testing.assert_array_equal(history, 0.0)
    assert np.all(np.isinf(np.diag(RIGID.covariance(state))))


def test_a_given_prior_holds_until_the_log_outweighs_it() -> None:
    log = logged(swing(2000))
    guesses = {"viscous_friction": 1.0, "coulomb_friction": 9.0}
    firm = replace(RIGID, initial_values=guesses, initial_variance=1e-12)
    _, history = firm.run(firm.init(sampling_time=T), log)
    np.testing.assert_allclose(history[-1], [1.0, 9.0], rtol=0.01)
    loose = replace(RIGID, initial_values=guesses, initial_variance=1e3)
    _, history = loose.run(loose.init(sampling_time=T), log)
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.01)


def test_a_prior_covariance_acts_as_samples_seen_before() -> None:
    log = logged(swing(2000))
    noisy = replace(RIGID, initial_variance=1e3, position_noise=1e-5)
    whole, _ = noisy.run(noisy.init(sampling_time=T), log)
    P = noisy.covariance(whole)
    values = dict(zip(noisy.parameter_names("linear"), whole[noisy.values_at][::-1], strict=True))
    resumed = replace(RIGID, initial_values=values, initial_variance=tuple(map(tuple, P.tolist())))
    state = resumed.init(sampling_time=T)
    np.testing.assert_allclose(resumed.covariance(state), P, rtol=1e-12)
    assert abs(P[0, 1]) > 0.1 * np.sqrt(P[0, 0] * P[1, 1])  # a diagonal would lose something
    for wrong in (-1.0, ((1.0, 2.0), (2.0, 1.0)), ((1.0,),), ((1.0, 0.5), (0.0, 1.0))):
        with refuses("not_positive" if isinstance(wrong, float) else "initial_variance_wrong"):
            replace(RIGID, initial_variance=wrong)


def test_two_coulomb_frictions_have_no_one_place() -> None:
    with refuses("places_per_direction"):
        _ = replace(RIGID, per_direction=True, offset=None).values_at


@pytest.mark.slow
@pytest.mark.parametrize("offset", [False, True])
def test_an_arm_in_its_loop(offset: bool) -> None:
    """Friction of the arm of section 6.2 of the thesis, with its noise in the loop."""
    estimator = replace(ARM, offset=offset)
    controller = arm_feedback(estimator)
    run = simulate_closed_loop(
        surrogate.surrogate_arm(),
        controller,
        sampling_time=surrogate.SAMPLING_TIME,
        samples=6000,
        sensors=surrogate.surrogate_sensors(),
        generator=np.random.default_rng(5),
    )
    state, history = estimator.run(
        estimator.init(sampling_time=surrogate.SAMPLING_TIME), run.log.part(0, 6000)
    )
    values = state[estimator.values_at]
    # The estimator's state lies in that of the controller; the same log gives the same estimates
    assert set(values.tolist()) <= set(np.asarray(run.controller_state).tolist())
    np.testing.assert_array_equal(values, history[-1][[1, 0]])
    np.testing.assert_allclose(
        values, [surrogate.COULOMB_FRICTION, surrogate.VISCOUS_FRICTION], rtol=0.02
    )


def test_a_rigid_stage_in_its_loop() -> None:
    """Friction is estimated by the loop that compensates it."""
    strokes = tuple(Move(target=x, duration=1.0, dwell=0.2) for x in (0.5, 0.0, 0.8, 0.0, 0.3))
    friction = OnlineFriction(
        kernel=RIGID.kernel,
        first_state=RIGID.init(sampling_time=T),
        sampling_time=T,
        values_at=RIGID.values_at,
        needs_load=False,
    )
    controller = FeedbackController(
        sampling_time=T,
        pd=PD(position_gain=2000.0, velocity_gain=150.0),
        compensation=FrictionCompensation(friction=friction),
        inertia=MASS,
        effort_limit=100.0,
        reference=PointToPoint(moves=strokes),
    )
    assert is_jitted(controller.step)
    run = simulate_closed_loop(
        SingleMass(mass=MASS, friction=LAW),
        controller,
        sampling_time=T,
        samples=6000,
        sensors=Sensors(encoder_step=1e-5, velocity_noise=1e-2),
        generator=np.random.default_rng(5),
    )
    state, history = RIGID.run(RIGID.init(sampling_time=T), run.log.part(0, 6000))
    values = state[RIGID.values_at]
    # The estimator's state lies in that of the controller; the same log gives the same estimates
    assert set(values.tolist()) <= set(np.asarray(run.controller_state).tolist())
    np.testing.assert_array_equal(values, history[-1][[1, 0]])
    np.testing.assert_allclose(values, [COULOMB, VISCOUS], rtol=0.01)
    assert abs(run.motion.position[-1] - strokes[-1].target) < 2e-3


def test_an_arm_whose_load_has_no_velocity_sensor() -> None:
    """Positions of both masses are enough."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=5.0)
    arm = FlexibleArm(mass_1=2.0, mass_2=1.0, stiffness=2000.0, friction=law)
    motion = simulate(arm, swing(10_000), sampling_time=T)
    log = Sensors(encoder_step=1e-5, velocity="none").measure(motion)
    estimator = EnergyEstimator(inertia=2.0, load_inertia=1.0, stiffness=2000.0, offset=False)
    state = estimator.init(sampling_time=T, velocity_measured=False)
    _, history = estimator.run(state, log)
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.002)


@pytest.mark.parametrize("stiffness", [0.5, 50.0])
def test_noise_at_rest_changes_nothing(stiffness: float) -> None:
    first = {"coulomb_friction": 0.3, "viscous_friction": 0.1}
    variance = ((1e-4, 0.0), (0.0, 1e-3))
    estimator = EnergyEstimator(
        inertia=1.0,
        load_inertia=2.0,
        stiffness=stiffness,
        offset=False,
        force_noise=0.0,
        initial_values=first,
        initial_variance=variance,
    )
    state = estimator.init(sampling_time=0.01)
    generator = np.random.default_rng(5)
    for _ in range(3000):
        x, x2 = 1e-6 * generator.normal(size=2)
        v, v2 = 1e-5 * generator.normal(size=2)
        estimator.kernel(state, 0.0, x, v, x2, v2)
    assert state[estimator.values_at].tolist() == [0.3, 0.1]
    np.testing.assert_allclose(estimator.covariance(state), variance)
