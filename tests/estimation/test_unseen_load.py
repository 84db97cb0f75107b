"""A flexible arm whose load is not measured: friction from the driven mass alone."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import scipy.stats
from axis_logs import axis_log
from estimates import covered, std_of
from refusals import refuses
from simulated_logs import measured
from van_loan import integrated_noise

from stickslip.estimation import EnergyEstimator, MaximumLikelihoodEstimator, examine
from stickslip.estimation.energy.known_inertia.free_friction import (
    DrivenMotion,
    FreeAxis,
    walk_covariance,
)
from stickslip.estimation.energy.known_inertia.stretches import reconstructed
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, SimulatedMotion, simulate
from stickslip.tasks import identify, surrogate

T = surrogate.SAMPLING_TIME
ARM = EnergyEstimator(
    inertia=surrogate.MASS_1,
    load_inertia=surrogate.MASS_2,
    stiffness=surrogate.STIFFNESS,
    offset=False,
)
TRUTH = np.array([surrogate.TRUTH[name] for name in ARM.terms.names])

CLEAN = 1e-6  # relative: what rounding and the search for a disturbance leave without noise
CLEAN_ONLINE = 1e-5  # and on line, where the trapezium of the velocities is mended only in part
SURE = 0.999  # probability with which a right estimator passes a statistical bound
FAR = 5.0  # standard deviations: beyond them in one of some ten values is no chance
RUNS = 40
STRETCHED = 0.5  # [m], standard deviation of where the load begins, half of what the effort bends


def moved(scale: float = 1.0, load: tuple[float, float] = (0.0, 0.0)) -> SimulatedMotion:
    return simulate(
        surrogate.surrogate_arm(),
        scale * surrogate.bang_bang_effort(),
        sampling_time=T,
        initial_state=(0.0, 0.0, *load),
    )


def seen(motion: SimulatedMotion, sensors: Sensors, seed: int = 0) -> AxisLog:
    return measured(motion, replace(sensors, load=False), seed)


@pytest.mark.parametrize(
    "sensors", [Sensors(), Sensors(velocity="none")], ids=["velocity", "position only"]
)
def test_without_noise_friction_is_found_as_with_the_load(sensors: Sensors) -> None:
    log = seen(moved(load=(0.3, -0.4)), sensors)
    assert log.measured_load_position is None
    estimate = ARM.fit(log)
    assert estimate.status is Status.OK
    found = [estimate.value(name) for name in ARM.terms.names]
    np.testing.assert_allclose(found, TRUTH, rtol=CLEAN)
    start = ARM.init(
        sampling_time=T, velocity_measured=sensors.velocity != "none", load_measured=False
    )
    _, history = ARM.run(start, log)
    np.testing.assert_allclose(history[-1], TRUTH, rtol=CLEAN_ONLINE)


def test_a_stiff_spring_is_followed_too() -> None:
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=5.0)
    arm = FlexibleArm(mass_1=1.0, mass_2=2.0, stiffness=9e4, friction=law)
    time = np.arange(6000) * 1e-3
    effort = 12.0 * np.sin(2.0 * time) + 8.0 * np.sin(5.0 * time) + 4.0 * np.sin(17.0 * time)
    motion = simulate(arm, effort, sampling_time=1e-3)
    estimator = EnergyEstimator(inertia=1.0, load_inertia=2.0, stiffness=9e4, offset=False)
    log = seen(motion, Sensors(velocity="none"))
    estimate = estimator.fit(log)
    assert estimate.value("coulomb_friction") == pytest.approx(2.0, rel=CLEAN)
    assert estimate.value("viscous_friction") == pytest.approx(5.0, rel=CLEAN)
    start = estimator.init(sampling_time=1e-3, velocity_measured=False, load_measured=False)
    _, history = estimator.run(start, log)
    np.testing.assert_allclose(history[-1], [5.0, 2.0], rtol=CLEAN_ONLINE)


@pytest.fixture(scope="module")
def study() -> np.ndarray:
    """Error over standard deviation, and whether 95 % intervals hold, offline and on line."""
    generator = np.random.default_rng(11)
    sensors = replace(surrogate.surrogate_sensors(1.0), load=False)
    rows = []
    for _ in range(RUNS):
        place, speed = STRETCHED * generator.standard_normal(2)
        log = sensors.measure(moved(load=(float(place), float(speed))), generator)
        estimate = ARM.fit(log)
        assert estimate.status is Status.OK
        ends = np.array([estimate.parameters[name].ci95 for name in ARM.terms.names], dtype=float)
        value = np.array([estimate.value(name) for name in ARM.terms.names])
        state, history = ARM.run(ARM.init(sampling_time=T, load_measured=False), log)
        online = np.sqrt(np.diag(ARM.covariance(state)))
        held = np.abs(history[-1] - TRUTH) <= scipy.stats.norm.ppf(0.975) * online
        inside = (ends[:, 0] <= TRUTH) & (ends[:, 1] >= TRUTH)
        rows.append([value / TRUTH - 1.0, inside, history[-1] / TRUTH - 1.0, held])
    return np.array(rows, dtype=float)


@pytest.mark.slow
@pytest.mark.parametrize("way", [0, 2], ids=["offline", "on line"])
def test_wherever_the_load_began_no_bias_is_seen(study: np.ndarray, way: int) -> None:
    errors = study[:, way]
    bound = scipy.stats.t.ppf(1.0 - (1.0 - SURE) / 4.0, RUNS - 1)
    assert np.all(np.abs(errors.mean(0)) <= bound * errors.std(0, ddof=1) / np.sqrt(RUNS))
    assert np.all(errors.std(0, ddof=1) < 0.01)


@pytest.mark.slow
@pytest.mark.parametrize("way", [1, 3], ids=["offline", "on line"])
def test_intervals_hold_the_truth_in_95_percent(study: np.ndarray, way: int) -> None:
    least = scipy.stats.binom.ppf(1.0 - SURE, RUNS, 0.95)
    assert np.all(study[:, way].sum(0) >= least)


@pytest.mark.parametrize("scale", [0.25, 0.5])
def test_a_mass_that_mostly_sticks_does_not_mislead(scale: float) -> None:
    # The load rings on for most of the log, against a driven mass that friction holds
    log = seen(moved(scale), surrogate.surrogate_sensors(1.0), seed=1)
    estimate = ARM.fit(log)
    assert estimate.status is Status.OK
    for name, true in zip(ARM.terms.names, TRUTH, strict=True):
        assert abs(estimate.value(name) - true) < FAR * std_of(estimate, name)


def test_a_driven_mass_at_rest_has_insufficient_excitation() -> None:
    effort = 0.1 * np.sin(np.arange(3000) * T)
    motion = simulate(surrogate.surrogate_arm(), effort, sampling_time=T)
    estimate = ARM.fit(seen(motion, surrogate.surrogate_sensors(1.0)))
    assert estimate.status is Status.INSUFFICIENT_EXCITATION
    assert all(verdict.reason for verdict in estimate.diagnostics.verdicts)


def test_the_smoother_finds_the_load() -> None:
    motion = moved(load=(0.3, -0.4))
    log = seen(motion, surrogate.surrogate_sensors(1.0))
    (part,) = reconstructed([log], ARM.model, LowPass.of(T))
    assert part.measured_load_position is not None
    assert motion.load_position is not None
    error = part.measured_load_position - motion.load_position[: len(log)]
    assert np.sqrt(np.mean(error**2)) < 0.02  # a tenth of what friction and spring make of it
    (note,) = [note for note in ARM.fit(log).diagnostics.notes if "reconstructed" in note]
    noted = float(note.split("+-")[1].split(" m ")[0])
    assert np.mean(np.abs(error) <= noted) > 0.5


def test_a_load_that_cannot_be_reconstructed_has_a_note() -> None:
    """A load a thousand times as heavy hardly moves, and its spring does not say where it is."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.5)
    arm = FlexibleArm(mass_1=1.0, mass_2=1e3, stiffness=50.0, friction=law)
    time = np.arange(3000) * 1e-3
    effort = 8.0 * np.sin(2.0 * time) + 6.0 * np.sin(5.1 * time)
    log = seen(
        simulate(arm, effort, sampling_time=1e-3), Sensors(position_noise=1e-5, velocity="none")
    )
    estimate = EnergyEstimator(inertia=1.0, load_inertia=1e3, stiffness=50.0).fit(log)
    (note,) = [note for note in estimate.diagnostics.notes if "reconstructed" in note]
    assert "no better than not knowing it" in note
    assert "measure the load's position" in note
    assert all(covered(estimate, {"coulomb_friction": 1.0, "viscous_friction": 0.5}).values())
    known = [note for note in ARM.fit(seen(moved(), Sensors())).diagnostics.notes if "load" in note]
    assert not any("no better" in note for note in known)


def test_what_is_measured_or_rigid_is_left_as_it_is() -> None:
    log = Sensors().measure(moved(), np.random.default_rng(0))
    low_pass = LowPass.of(T)
    assert reconstructed([log], ARM.model, low_pass)[0] is log
    rigid = AxisModel(inertia=1.0)
    assert reconstructed([log], rigid, low_pass)[0] is log


def test_a_velocity_of_the_load_alone_sharpens_the_estimate() -> None:
    full = surrogate.surrogate_sensors(1.0).measure(moved(), np.random.default_rng(5))
    partly = replace(full, measured_load_position=None)
    nothing = replace(partly, measured_load_velocity=None)
    spread = []
    for log in (partly, nothing):
        found = ARM.fit(log).parameters["coulomb_friction"]
        assert found.value is not None
        assert found.std is not None
        assert abs(found.value - surrogate.TRUTH["coulomb_friction"]) < FAR * found.std
        spread.append(found.std)
    assert spread[0] < spread[1]


def test_what_stands_in_the_place_of_the_load_is_not_read() -> None:
    log = seen(moved(), surrogate.surrogate_sensors(1.0), seed=2)
    nonsense = replace(
        log, measured_load_position=np.full(len(log), 7.0), measured_load_velocity=log.effort
    )
    start = ARM.init(sampling_time=T, load_measured=False)
    np.testing.assert_array_equal(ARM.run(start, log)[0], ARM.run(start, nonsense)[0])


def test_the_inertia_needs_the_load() -> None:
    sought = EnergyEstimator(load_inertia=1.0, stiffness=1.0)
    with refuses("no_load_position"):
        sought.fit(seen(moved(), Sensors()))
    with refuses("load_not_measured"):
        sought.init(sampling_time=T, load_measured=False)
    with refuses("no_load_position"):
        ARM.run(ARM.init(sampling_time=T), seen(moved(), Sensors()))


def test_identify_notes_a_reconstructed_load_and_draws_everything() -> None:
    log = seen(moved(), surrogate.surrogate_sensors(1.0))
    found = identify(log, inertia=1.0, load_inertia=1.0, stiffness=1.0)
    assert found.estimate.status is Status.OK
    assert any("load is not measured" in note for note in found.estimate.diagnostics.notes)
    for figure in ("curve", "energy", "evolution", "residuals", "resimulation"):
        assert getattr(found, figure) is not None, figure
    assert found.resimulation is not None
    assert found.resimulation.fit > 0.95


@pytest.mark.slow
def test_maximum_likelihood_agrees_and_is_drawn() -> None:
    log = seen(moved(), surrogate.surrogate_sensors(1.0))
    likely = MaximumLikelihoodEstimator(inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False)
    found = examine(log, likely)
    assert found.energy is not None
    energy = ARM.fit(log)
    for name in ARM.terms.names:
        ours = energy.parameters[name].std or 0.0
        assert abs(found.estimate.value(name) - energy.value(name)) < FAR * ours


def rate_matrix(inertia: float, load_inertia: float, stiffness: float) -> np.ndarray:
    """Rates of both masses' position and velocity, and of the friction."""
    F = np.zeros((5, 5))
    F[0, 1] = F[2, 3] = 1.0
    F[1, [0, 2, 4]] = np.array([-stiffness, stiffness, -1.0]) / inertia
    F[3, [0, 2]] = np.array([stiffness, -stiffness]) / load_inertia
    return F


SHORT = {"inertia": 1.3, "load_inertia": 0.7, "stiffness": 40.0}


def test_the_smoother_is_the_posterior() -> None:
    n, step, rate = 12, 0.02, 30.0
    generator = np.random.default_rng(3)
    log = axis_log(
        np.arange(n) * step,
        generator.standard_normal(n),
        1e-2 * generator.standard_normal(n),
        1e-1 * generator.standard_normal(n),
    )
    sensors = DrivenMotion.of_arm(log, AxisModel(**SHORT), (1e-2, 1e-1), 1.0)
    freedom = np.where(np.arange(n) % 4 == 0, 50.0, 1.0)
    motion = FreeAxis.of(AxisModel(**SHORT), step).motion(sensors, rate, freedom)
    assert motion.load is not None
    # The rates of all states, friction the last; what the effort does is what friction undoes
    over = scipy.linalg.expm(rate_matrix(**SHORT) * step)
    push = np.append(-over[:4, 4], 0.0)
    Q = rate * integrated_noise(rate_matrix(**SHORT), step)
    duration = n * step
    first = np.append(sensors.first, sensors.force_squared / duration + rate * duration)
    # All states at once: x = mean + G w, w the first state and what each sample adds
    mean, G = np.zeros((n, 5)), np.zeros((n, 5, 5 * n))
    mean[0, :2] = sensors.measured[0]
    W = np.zeros((5 * n, 5 * n))
    W[:5, :5] = np.diag(first)
    G[0, :, :5] = np.eye(5)
    for k in range(1, n):
        mean[k] = over @ mean[k - 1] + push * log.effort[k - 1]
        G[k] = over @ G[k - 1]
        at = slice(5 * k, 5 * k + 5)
        G[k, :, at] += np.eye(5)
        W[at, at] = freedom[k - 1] * Q
    H = G[1:, :2].reshape(-1, 5 * n)
    noise = np.diag(np.tile(sensors.channels[:, 1], n - 1))
    gain = W @ H.T @ np.linalg.inv(H @ W @ H.T + noise)
    w = gain @ (sensors.measured[1:] - mean[1:, :2]).ravel()
    left = W - gain @ H @ W
    expected = mean + G @ w
    spread = np.sqrt(np.einsum("kij,jh,kih->ki", G, left, G))
    found = (
        motion.position - sensors.origin,
        motion.velocity,
        motion.load.position - sensors.origin,
        motion.load.velocity,
        motion.friction,
    )
    np.testing.assert_allclose(np.column_stack(found), expected, rtol=1e-6, atol=1e-8)
    np.testing.assert_allclose(motion.velocity_spread, spread[:, 1], rtol=1e-6)
    np.testing.assert_allclose(motion.load.spread, spread[:, 2], rtol=1e-6)


def test_the_walk_is_van_loans_integral() -> None:
    expected = integrated_noise(rate_matrix(**SHORT), 0.1)
    found = walk_covariance(AxisModel(**SHORT), 0.1)
    np.testing.assert_allclose(found, expected, atol=1e-15, rtol=1e-6)
