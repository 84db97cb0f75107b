"""The extended Kalman filter: its motion and derivatives, coverage, and where it fails."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from axis_logs import axis_log
from estimates import assert_covers, least_coverage, std_of
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses
from simulated_logs import autoregression, disturbed, measured, samples_of

from stickslip.estimation import ExtendedKalmanFilter, cramer_rao_bound
from stickslip.estimation.online.kalman import state as at
from stickslip.estimation.online.kalman.motion import predicted
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, simulate

T = 0.001
MASS = 1.0
TRUTH = {"viscous_friction": 1.0, "coulomb_friction": 1.0, "offset": 0.2}
LAW = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=1.0, offset=0.2)
PLANT = SingleMass(mass=MASS, friction=LAW)
STANDARD_ERRORS = 4.0
SLOPES = 1e-6  # central differences with steps of 1e-6
LIMIT = 1.5  # of the Cramer-Rao bound, for the root mean square error
FOUND = 1e-6  # relative: what the filter is sure of without noise


def swings(duration: float = 10.0) -> np.ndarray:
    time = np.arange(0.0, duration, T)
    return 3.0 * np.sin(2.0 * time) + 2.0 * np.sin(5.1 * time)


def end_of(at: np.ndarray, u: float, slopes: np.ndarray) -> tuple[float, float]:
    return predicted(1.3, at, u, 0.2, slopes)


def log_of(noise: float, seed: int, *, velocity: bool = True) -> AxisLog:
    motion = simulate(PLANT, swings(), sampling_time=T)
    sensors = Sensors(
        position_noise=1e-2 * noise,
        velocity_noise=noise if velocity else 0.0,
        velocity="measured" if velocity else "none",
    )
    return measured(motion, sensors, seed)


@given(
    v=st.floats(-0.5, 0.5),
    c=st.sampled_from([0.0, 1e-3, 0.7, 30.0]),
    f_c=st.floats(0.1, 2.0),
    o=st.floats(-0.3, 0.3),
    u=st.floats(-4.0, 4.0),
)
def test_it_moves_as_the_exact_simulator_does(
    v: float, c: float, f_c: float, o: float, u: float
) -> None:
    law = CoulombViscousFriction.symmetric(coulomb_friction=f_c, viscous_friction=c, offset=o)
    plant = SingleMass(mass=1.3, friction=law)
    motion = simulate(plant, [u], sampling_time=0.2, initial_state=(0.1, v))
    x1, v1 = predicted(1.3, np.array([0.1, v, c, f_c, o]), u, 0.2, np.empty((2, 5)))
    assert x1 == pytest.approx(motion.position[-1], abs=1e-12)
    assert v1 == pytest.approx(motion.velocity[-1], abs=1e-12)


def test_derivatives_through_stops_and_reversals() -> None:
    rng = np.random.default_rng(0)
    kinds: set[str] = set()
    for _ in range(500):
        v, o, u = 0.5 * rng.normal(), 0.2 * rng.normal(), 3.0 * rng.normal()
        c, f_c = float(rng.choice([0.0, 1e-3, 0.7, 30.0])), rng.uniform(0.1, 2.0)
        at = np.array([0.2, v, c, f_c, o])
        F = np.empty((2, 5))
        _, end = end_of(at, u, F)
        kinds.add("slip" if end * v > 0 else "stop" if end == 0 else "reversal")
        for j in range(5):
            step = np.zeros(5)
            step[j] = 1e-6
            high = np.array(end_of(at + step, u, np.empty((2, 5))))
            low = np.array(end_of(at - step, u, np.empty((2, 5))))
            np.testing.assert_allclose(F[:, j], (high - low) / 2e-6, atol=SLOPES)
    assert kinds == {"slip", "stop", "reversal"}


def test_small_viscous_friction_in_high_precision() -> None:
    with mpmath.workdps(40):
        for c in (1e-12, 1e-7, 5e-2, 0.06, 3.0):
            m, v, u, f_c, t = map(mpmath.mpf, ("1.3", "0.4", "2.0", "0.5", "0.2"))
            h = mpmath.mpf(c) / m
            force = (u - f_c) / mpmath.mpf(c)
            end = force + (v - force) * mpmath.exp(-h * t)
            way = force * t + (v - force) * (1 - mpmath.exp(-h * t)) / h
            found = predicted(1.3, np.array([0.0, 0.4, c, 0.5, 0.0]), 2.0, 0.2, np.empty((2, 5)))
            assert found == pytest.approx((float(way), float(end)), rel=1e-11)


@pytest.mark.parametrize("velocity", [True, False])
def test_friction_is_found_without_noise(velocity: bool) -> None:
    found = ExtendedKalmanFilter(inertia=MASS, offset=True).fit(log_of(0.0, 0, velocity=velocity))
    for name, true in TRUTH.items():
        assert found.value(name) == pytest.approx(true, rel=FOUND)
    assert found.status is Status.OK


@pytest.mark.slow
@pytest.mark.parametrize("velocity", [True, False])
def test_intervals_cover_under_white_noise(velocity: bool) -> None:
    runs = 60
    ekf = ExtendedKalmanFilter(inertia=MASS, offset=True)
    fits = [ekf.fit(log_of(1e-2, seed, velocity=velocity)) for seed in range(runs)]
    assert_covers(fits, TRUTH)
    errors = [[fit.value(name) - true for name, true in TRUTH.items()] for fit in fits]
    deviations = [[std_of(fit, name) for name in TRUTH] for fit in fits]
    bias = np.mean(errors, axis=0) / np.mean(deviations, axis=0)
    assert np.all(np.abs(bias) < STANDARD_ERRORS / np.sqrt(runs))


def short_push() -> np.ndarray:
    time = np.arange(0.0, 4.0, 2.0 * T)
    return 4.0 * np.sin(np.pi * time) + 3.0 * np.sin(2.6 * np.pi * time)


def short_plant(static_friction: float) -> SingleMass:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=2.0, viscous_friction=3.0, offset=0.2, static_friction=static_friction
    )
    return SingleMass(mass=1.5, friction=law)


SHORT_TRUTH = np.array([3.0, 2.0, 0.2])
SHORT_SENSORS = Sensors(position_noise=1e-4, velocity_noise=0.01)


def found_in_short_runs(
    static_friction: float, runs: int, *, exact_events: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Return errors and 95 % half widths in many runs of 4 s, shape (runs, 3)."""
    motion = simulate(short_plant(static_friction), short_push(), sampling_time=2.0 * T)
    errors: list[np.ndarray] = []
    widths: list[np.ndarray] = []
    ekf = ExtendedKalmanFilter(inertia=1.5, offset=True, exact_events=exact_events)
    for generator in np.random.default_rng(11).spawn(runs):
        found = ekf.fit(SHORT_SENSORS.measure(motion, generator))
        errors.append(np.array([found.value(name) for name in TRUTH]) - SHORT_TRUTH)
        ends = [found.parameters[name].ci95 or (np.nan, np.nan) for name in TRUTH]
        widths.append(np.array([0.5 * (high - low) for low, high in ends]))
    return np.array(errors), np.array(widths)


@pytest.mark.slow
def test_it_comes_near_the_cramer_rao_bound() -> None:
    runs = 100
    errors, widths = found_in_short_runs(2.0, runs)
    bound = cramer_rao_bound(
        short_plant(2.0),
        short_push(),
        sampling_time=2.0 * T,
        sensors=SHORT_SENSORS,
        sought=tuple(TRUTH),
    )
    least = np.array([bound.std[name] for name in TRUTH])
    # The relative standard error of a root mean square of normal errors is 1 / sqrt(2 runs)
    ratio = np.sqrt(np.mean(errors**2, axis=0)) / least
    assert np.all(ratio * (1.0 + STANDARD_ERRORS / np.sqrt(2.0 * runs)) < LIMIT)
    assert np.all(np.abs(np.mean(errors, axis=0)) < STANDARD_ERRORS * least / np.sqrt(runs))
    inside = np.mean(np.abs(errors) < widths, axis=0)
    assert np.all(inside > least_coverage(runs))


def test_stops_and_rests_hold_most_of_the_information() -> None:
    sharp, _ = found_in_short_runs(2.0, 25)
    careful, _ = found_in_short_runs(2.0, 25, exact_events=False)
    assert np.all(np.std(careful, axis=0) > 2.0 * np.std(sharp, axis=0))


@pytest.mark.parametrize("excess", [0.1, 0.3, 1.0])
def test_higher_static_friction_is_detected_and_nothing_learned_from_it(excess: float) -> None:
    runs = 20
    errors, widths = found_in_short_runs(2.0 * (1.0 + excess), runs)
    careful, _ = found_in_short_runs(2.0 * (1.0 + excess), runs, exact_events=False)
    np.testing.assert_array_equal(errors, careful)
    inside = np.mean(np.abs(errors) < widths, axis=0)
    assert np.all(inside > least_coverage(runs))


def test_the_sharp_filter_catches_up_with_what_was_kept() -> None:
    motion = simulate(short_plant(2.0), short_push(), sampling_time=2.0 * T)
    log = measured(motion, SHORT_SENSORS, 5)
    ekf = ExtendedKalmanFilter(
        inertia=1.5,
        offset=True,
        position_noise=1e-4,
        velocity_noise=0.01,
        rest_speed=0.03,
        rest_force=4.0,
        force_noise=0.0,
        initial_deviations=dict.fromkeys(TRUTH, 5.0),
    )
    seen: dict[str, float] = {}
    spreads: dict[str, np.ndarray] = {}
    for title, memory in (("kept", 2048), ("too few", 100), ("none", 0)):
        one = replace(ekf, memory=memory)
        state = one.init(sampling_time=2.0 * T)
        for k, sample in enumerate(samples_of(log)):
            state, _ = one.step(state, sample)
            if at.fields(state).stage == at.TRUSTED:
                seen.setdefault(title, k)
        assert at.fields(state).stage == at.TRUSTED
        spreads[title] = np.sqrt(np.diag(one.covariance(state)))
    # It begins when enough is known, and goes through four kept samples while one comes in
    assert seen["too few"] == seen["none"]
    assert seen["kept"] == pytest.approx(seen["none"] * 4 / 3, abs=2)
    np.testing.assert_array_equal(spreads["too few"], spreads["none"])
    assert np.all(spreads["kept"] < 0.8 * spreads["none"])


def test_the_plain_filter_takes_a_rest_for_an_equation_and_diverges() -> None:
    log = log_of(1e-2, 0)
    plain = ExtendedKalmanFilter(inertia=MASS, offset=True, rest_speed=0.0, force_noise=0.0)
    careful = ExtendedKalmanFilter(inertia=MASS, offset=True, force_noise=0.0)
    lost, kept = plain.fit(log), careful.fit(log)
    assert not lost.status.trusted
    for name, true in TRUTH.items():
        assert kept.value(name) == pytest.approx(true, abs=1e-3)
    std = std_of(lost, "coulomb_friction")
    # Without the gate on the innovations it was off by thousands of standard deviations
    assert abs(lost.value("coulomb_friction") - 1.0) > 10.0 * std


def test_a_disturbing_force_is_found_and_widens_the_intervals() -> None:
    disturbance = 0.3
    rng = np.random.default_rng(3)
    effort = swings()
    force = disturbance * rng.normal(size=effort.size)
    sensors = Sensors(position_noise=1e-6, velocity_noise=1e-5)
    log = disturbed(PLANT, effort, force, sensors, rng, sampling_time=T)
    found = ExtendedKalmanFilter(
        inertia=MASS, offset=True, position_noise=1e-6, velocity_noise=1e-5
    ).fit(log)
    assert found.provenance.options["force_noise"] == pytest.approx(disturbance, rel=0.1)
    for name, true in TRUTH.items():
        assert abs(found.value(name) - true) < STANDARD_ERRORS * std_of(found, name)


@pytest.mark.slow
def test_intervals_cover_under_a_slow_disturbing_force() -> None:
    runs, coefficient, deviation = 25, 0.98, 0.1
    effort = swings(20.0)
    sensors = Sensors(position_noise=1e-5, velocity_noise=1e-3)
    fits = []
    for seed in range(runs):
        rng = np.random.default_rng(seed)
        force = deviation * autoregression(rng, effort.size, coefficient)
        log = disturbed(PLANT, effort, force, sensors, rng, sampling_time=T)
        fits.append(ExtendedKalmanFilter(inertia=MASS, offset=True).fit(log))
    assert_covers(fits, TRUTH)


def test_steps_and_runs_are_the_same() -> None:
    log = log_of(1e-3, 1).part(0, 400)
    ekf = ExtendedKalmanFilter(
        inertia=MASS,
        position_noise=1e-5,
        velocity_noise=1e-3,
        rest_speed=0.01,
        rest_force=2.0,
        initial_deviations={"viscous_friction": 1.0, "coulomb_friction": 1.0},
    )
    first = ekf.init(sampling_time=T)
    after, history = ekf.run(first, log)
    innovations = ekf.normalised_innovations(first, log)
    state = first
    values = np.zeros(2)
    for sample in samples_of(log):
        state, values = ekf.step(state, sample)
    assert state.tolist() == after.tolist()
    assert values.tolist() == history[-1].tolist()
    assert innovations.size == len(log)
    assert np.all(np.linalg.eigvalsh(ekf.covariance(after)) > 0)


def test_gaps_end_a_motion_and_keep_the_estimates() -> None:
    whole = log_of(1e-3, 2)
    keep = np.r_[0:4000, 4500 : len(whole)]
    v = whole.measured_velocity
    assert v is not None
    gappy = axis_log(whole.time[keep], whole.effort[keep], whole.measured_position[keep], v[keep])
    found = ExtendedKalmanFilter(inertia=MASS, offset=True).fit(gappy)
    for name, true in TRUTH.items():
        assert found.value(name) == pytest.approx(true, abs=1e-3)


def test_two_samples_identify_nothing() -> None:
    found = ExtendedKalmanFilter(inertia=MASS).fit(log_of(1e-3, 2).part(0, 2))
    assert not any(parameter.identified for parameter in found.parameters.values())


def test_missing_settings_of_an_online_filter_are_refused() -> None:
    with refuses("filter_needs"):
        ExtendedKalmanFilter(inertia=1.0).init(sampling_time=T)


def test_a_log_without_velocity_needs_a_state_for_it() -> None:
    ekf = ExtendedKalmanFilter(
        inertia=MASS,
        position_noise=1e-5,
        velocity_noise=1e-3,
        rest_speed=0.0,
        initial_deviations={"viscous_friction": 1.0, "coulomb_friction": 1.0},
    )
    with refuses("state_needs_velocity"):
        ekf.run(ekf.init(sampling_time=T), log_of(1e-3, 0, velocity=False))
