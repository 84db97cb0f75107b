"""The energy estimator on line: rests, units, and what it refuses."""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from refusals import refuses
from simulated_logs import logged_early, measured

from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, SimulatedMotion, simulate

T = 0.001
TRUTH = np.array([95.0, 200.0, 20.0])  # mass, viscous and Coulomb friction
NOT_DRIFTED = 1e-4  # relative; a hundredth of what a tenth of a per cent of noise in the rows gives
SCALED = 1e-6  # relative: what rounding leaves of a change of units
SMALL_STAGE = np.array([20.0, 30.0, 8.0])


def moved(truth: np.ndarray, effort: np.ndarray) -> SimulatedMotion:
    mass, viscous, coulomb = truth.tolist()
    law = CoulombViscousFriction.symmetric(coulomb_friction=coulomb, viscous_friction=viscous)
    return simulate(SingleMass(mass=mass, friction=law), effort, sampling_time=T)


def swing(samples: int) -> np.ndarray:
    time = np.arange(samples) * T
    return 70.0 * np.sin(2.0 * time) + 60.0 * np.sin(7.0 * time)


@cache
def move_rest_move() -> SimulatedMotion:
    return moved(TRUTH, np.concatenate([swing(20_000), np.zeros(100_000), swing(10_000)]))


STOPPED, STARTED = 20_600, 120_000  # samples: the axis rests in between


@pytest.fixture(scope="module")
def log() -> AxisLog:
    return measured(moved(TRUTH, swing(3000)), Sensors())


@pytest.mark.parametrize("factor", [1.0, 0.9999, 0.99])
@pytest.mark.parametrize("velocity", ["none", "measured"])
def test_a_long_rest_changes_nothing(factor: float, velocity: Any) -> None:
    assert not np.any(move_rest_move().velocity[STOPPED:STARTED])
    noise = 1e-3 if velocity == "measured" else 0.0
    sensors = Sensors(position_noise=1e-6, velocity=velocity, velocity_noise=noise)
    log = measured(move_rest_move(), sensors)
    estimator = EnergyEstimator(forgetting_factor=factor, offset=False)
    state = estimator.init(sampling_time=T, velocity_measured=velocity == "measured")
    # One row may be under way when the axis stops
    settled, first = estimator.run(state, log.part(0, STOPPED + 500))
    rested, second = estimator.run(settled, log.part(STOPPED + 500, STARTED))
    np.testing.assert_allclose(second[-1], first[-1], rtol=NOT_DRIFTED)
    np.testing.assert_allclose(
        np.diag(estimator.covariance(rested)), np.diag(estimator.covariance(settled)), rtol=0.1
    )
    # And nothing that went on in the rest comes in with the first motion after it
    _, history = estimator.run(rested, log.part(STARTED, len(log)))
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.01)


def test_noise_of_the_velocity_adds_no_way_in_a_rest() -> None:
    """Noise of 10 mm/s changes the sign of the velocity at every other sample of a rest."""
    sensors = Sensors(position_noise=1e-6, velocity_noise=1e-2)
    log = measured(move_rest_move(), sensors)
    estimator = EnergyEstimator(inertia=TRUTH[0], offset=False)
    _, history = estimator.run(estimator.init(sampling_time=T), log)
    np.testing.assert_allclose(history[-1], TRUTH[1:], rtol=0.05)


@pytest.mark.parametrize("factor", [1.0, 0.99])
def test_noise_before_the_first_motion_changes_nothing(factor: float) -> None:
    motion = moved(TRUTH, np.concatenate([np.zeros(20_000), swing(5000)]))
    log = measured(motion, Sensors(position_noise=1e-6, velocity="none"), 3)
    estimator = EnergyEstimator(forgetting_factor=factor, offset=False)
    state = estimator.init(sampling_time=T, velocity_measured=False)
    _, history = estimator.run(state, log)
    np.testing.assert_array_equal(history[:20_000], 0.0)
    np.testing.assert_allclose(history[-1], TRUTH, rtol=0.01)


def small_stage(noise: float) -> AxisLog:
    time = np.arange(10_000) * T
    effort = 30.0 * np.sin(6.0 * time) + 15.0 * np.sin(15.0 * time)
    sensors = Sensors(position_noise=noise, velocity_noise=100.0 * noise)
    return measured(moved(SMALL_STAGE, effort), sensors)


@pytest.mark.parametrize("noise", [0.0, 1e-6])
@pytest.mark.parametrize("factor", [1.0, 0.999])
def test_the_result_does_not_depend_on_the_units(noise: float, factor: float) -> None:
    log = small_stage(noise)
    assert log.measured_velocity is not None
    estimator = EnergyEstimator(offset=False, forgetting_factor=factor)
    _, history = estimator.run(estimator.init(sampling_time=T), log)
    np.testing.assert_allclose(history[-1], SMALL_STAGE, rtol=1e-3)
    length_scales = [10.0**k for k in range(-6, 0)]
    scales = [(length, 1.0, 1.0) for length in length_scales]
    scales += [(1.0, 1e-6, 1.0), (1.0, 1e4, 1.0), (1.0, 1.0, 1e3), (1e-3, 1e-3, 1e-2)]
    for length, force, time in scales:
        scaled = replace(
            log,
            time=time * log.time,
            effort=force * log.effort,
            measured_position=length * log.measured_position,
            measured_velocity=length / time * log.measured_velocity,
        )
        _, other = estimator.run(estimator.init(sampling_time=time * T), scaled)
        units = np.array([force * time**2 / length, force * time / length, force])
        np.testing.assert_allclose(other[-1] / units, history[-1], rtol=SCALED)


def test_a_prior_that_is_given_holds() -> None:
    log = small_stage(0.0)
    guesses = {"mass": 1.0, "viscous_friction": 2.0, "coulomb_friction": 3.0}
    estimator = EnergyEstimator(
        offset=False, initial_values=guesses, initial_variance=1e-12, level_noise=1.0
    )
    _, history = estimator.run(estimator.init(sampling_time=T), log)
    np.testing.assert_allclose(history[-1], list(guesses.values()), rtol=1e-3)


def test_a_parameter_without_rows_has_infinite_variance() -> None:
    log = small_stage(0.0)
    estimator = EnergyEstimator(per_direction=True)
    state = estimator.init(sampling_time=T)
    assert np.all(np.isinf(np.diag(estimator.covariance(state))))
    forward = log.part(0, int(np.flatnonzero(np.diff(log.measured_position) < 0)[0]))
    state, history = estimator.run(state, forward)
    unknown = np.isinf(np.diag(estimator.covariance(state)))
    assert unknown.tolist() == [False, False, True, False, True]
    np.testing.assert_array_equal(history[:, [2, 4]], 0.0)


@pytest.mark.parametrize(
    "settings",
    [
        {"offset": True},  # acts as Coulomb friction does: the information is singular
        {"offset": False, "per_direction": True},  # no information on the other direction
    ],
)
def test_one_direction_of_motion_gives_no_intervals(settings: dict[str, Any]) -> None:
    motion = moved(np.array([3.0, 5.0, 2.0]), np.full(400, 10.0))
    estimator = EnergyEstimator(inertia=3.0, **settings)
    state, _ = estimator.run(estimator.init(sampling_time=T), Sensors().measure(motion))
    found = estimator.intervals(state)
    np.testing.assert_array_equal(found, np.tile([-np.inf, np.inf], (len(found), 1)))


@pytest.mark.usefixtures("without_shape_checks")
def test_whole_numbers_will_do_in_a_sample() -> None:
    estimator = EnergyEstimator(offset=False)
    state = estimator.init(sampling_time=T)
    mixed: Any = (12, np.float64(0.1), 0.2, 0, 0)
    after, values = estimator.step(state, mixed)
    expected, _ = estimator.step(state, (12.0, 0.1, 0.2, 0.0, 0.0))
    np.testing.assert_array_equal(after, expected)
    assert values.shape == (3,)


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("sample", [(1.0, 2.0, 3.0), (1.0,) * 6, 1.0, (1.0, "a", 0.0, 0.0, 0.0)])
def test_a_sample_that_is_not_five_numbers_is_refused(sample: Any) -> None:
    estimator = EnergyEstimator()
    with refuses("sample_not_five"):
        estimator.step(estimator.init(sampling_time=T), sample)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
@pytest.mark.parametrize("place", range(5))
def test_an_impossible_value_is_counted_and_changes_nothing(
    log: AxisLog, place: int, bad: float
) -> None:
    estimator = EnergyEstimator()
    state, history = estimator.run(estimator.init(sampling_time=T), log)
    sample: Any = [1.0, 0.1, 0.2, 0.0, 0.0]
    sample[place] = bad
    after, values = estimator.step(state, tuple(sample))
    np.testing.assert_array_equal(values, history[-1])
    read = place < 3  # a rigid axis has no load
    assert estimator.health(after).missing_samples == read
    assert estimator.kernel(state.copy(), *sample) == (bool(np.isfinite(bad)) or not read)


@pytest.mark.parametrize("delay", [2.0, 0.5, -1.5])
def test_a_known_delay_is_removed(delay: float) -> None:
    log = small_stage(0.0)
    early = logged_early(log, delay)

    def error(effort_delay: float) -> float:
        estimator = EnergyEstimator(offset=False, effort_delay=effort_delay)
        _, history = estimator.run(estimator.init(sampling_time=T), early)
        return float(np.max(np.abs(history[-1] / SMALL_STAGE - 1.0)))

    assert error(delay) < 2e-3
    assert error(0.0) > 5.0 * error(delay)


def test_a_log_without_the_velocity_that_was_promised_is_refused(log: AxisLog) -> None:
    estimator = EnergyEstimator()
    with refuses("state_needs_velocity"):
        estimator.run(estimator.init(sampling_time=T), replace(log, measured_velocity=None))


def test_a_log_with_a_gap_is_refused(log: AxisLog) -> None:
    estimator = EnergyEstimator()
    later = log.time + np.where(np.arange(len(log)) >= 1000, 2.0, 0.0)
    with refuses("gap_without_resumption", sample=1000):
        estimator.run(estimator.init(sampling_time=T), replace(log, time=later))


def test_a_log_of_another_sampling_time_is_refused(log: AxisLog) -> None:
    estimator = EnergyEstimator()
    with refuses("other_sampling_time", name="the state"):
        estimator.run(estimator.init(sampling_time=2 * T), log)


def test_a_log_without_the_load_is_refused(log: AxisLog) -> None:
    estimator = EnergyEstimator(load_inertia=1.0, stiffness=1.0)
    with refuses("no_load_position"):
        estimator.run(estimator.init(sampling_time=T), log)
    with_position = replace(log, measured_load_position=log.measured_position)
    with refuses("state_needs_velocity", of=" of the load"):
        estimator.run(estimator.init(sampling_time=T), with_position)


def test_the_load_velocity_is_derived_where_all_are() -> None:
    """The arm of van de Wijdeven (2002), with positions alone."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    time = np.arange(20_000) * T
    motion = simulate(arm, np.sin(time), sampling_time=T)
    log = measured(motion, Sensors(velocity="none"))
    assert log.measured_load_velocity is None
    estimator = EnergyEstimator(inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False)
    state = estimator.init(sampling_time=T, velocity_measured=False)
    _, history = estimator.run(state, log)
    np.testing.assert_allclose(history[-1], [0.1, 0.1], rtol=0.01)
