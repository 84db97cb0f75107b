"""Measured velocities that are not those of the positions, and what becomes of them."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from refusals import refuses

from stickslip import identify
from stickslip.estimation import EnergyEstimator
from stickslip.estimation.signals.kinematics import LowPass, default_cutoff
from stickslip.estimation.signals.observation import motion_noise
from stickslip.estimation.signals.velocity_delay import velocity_match
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, simulate

TRUTH = {"mass": 20.0, "viscous_friction": 30.0, "coulomb_friction": 8.0}
LAW = CoulombViscousFriction.symmetric(coulomb_friction=8.0, viscous_friction=30.0)
SENSORS = {
    "ideal": Sensors(),
    "noisy": Sensors(position_noise=1e-6, velocity_noise=1e-3),
}
# Velocities from positions come through a filter
DERIVED = 0.001

ARM = EnergyEstimator(inertia=1.0, load_inertia=1.0, stiffness=1.0)
ARM_TRUTH = {"viscous_friction": 0.1, "coulomb_friction": 0.1}


def stage_log(sensors: Sensors) -> AxisLog:
    time = np.arange(20_000) * 0.001
    effort = 25 * np.sin(2 * time) + 20 * np.sin(5 * time)
    motion = simulate(SingleMass(mass=20.0, friction=LAW), effort, sampling_time=0.001)
    return sensors.measure(motion, np.random.default_rng(0))


@pytest.fixture(scope="module", params=list(SENSORS))
def log(request: pytest.FixtureRequest) -> AxisLog:
    return stage_log(SENSORS[request.param])


@pytest.fixture(scope="module")
def arm_log() -> AxisLog:
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    time = np.arange(6000) * 0.01
    effort = np.where(time < 5, 1.0, np.where(time < 10, -1.0, 0.0))
    return Sensors().measure(simulate(arm, effort, sampling_time=0.01))


def velocity_of(log: AxisLog) -> np.ndarray:
    assert log.measured_velocity is not None
    return log.measured_velocity


@pytest.mark.parametrize(
    ("factor", "code"),
    [
        (1000.0, "velocity_foreign"),
        (0.001, "velocity_foreign"),
        (-1.0, "velocity_reversed"),
    ],
)
def test_a_velocity_in_another_unit_or_sign_is_refused(
    log: AxisLog, factor: float, code: str
) -> None:
    wrong = replace(log, measured_velocity=factor * velocity_of(log))
    with refuses(code):
        EnergyEstimator().fit(wrong)


@pytest.mark.parametrize("factor", [1.05, 0.98])
def test_a_velocity_that_is_too_large_is_not_used(log: AxisLog, factor: float) -> None:
    estimate = EnergyEstimator().fit(replace(log, measured_velocity=factor * velocity_of(log)))
    for name, value in TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=DERIVED)
    assert any(f"velocity is {factor:g} times" in note for note in estimate.diagnostics.notes)


def test_a_velocity_that_is_zero_while_the_axis_moves_is_not_used(log: AxisLog) -> None:
    """As that of a file, which is left out when the file is read."""
    zero = replace(log, measured_velocity=np.zeros(len(log)))
    without = replace(log, measured_velocity=None)
    for estimate, alone in (
        (EnergyEstimator().fit(zero), EnergyEstimator().fit(without)),
        (identify(zero).estimate, identify(without).estimate),
    ):
        assert sum("velocity is 0" in note for note in estimate.diagnostics.notes) == 1
        assert estimate.parameters == alone.parameters


@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("factor", [0.5, 1.5, 2.0])
def test_an_identification_notes_a_velocity_of_another_scale(factor: float, noise: float) -> None:
    time = np.arange(0.0, 10.0, 0.001)
    velocity = 0.1 * np.sin(2.0 * time) + 0.05 * np.sin(5.0 * time)
    acceleration = 0.2 * np.cos(2.0 * time) + 0.25 * np.cos(5.0 * time)
    wrong = factor * (velocity + noise * np.random.default_rng(0).normal(size=time.size))
    log = axis_log(
        time,
        3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity,
        -0.05 * np.cos(2.0 * time) - 0.01 * np.cos(5.0 * time),
        wrong,
    )
    found = identify(log).estimate
    assert found.status is Status.OK
    (note,) = (note for note in found.diagnostics.notes if "velocity is" in note)
    assert float(note.split()[4]) == pytest.approx(factor, rel=0.01)
    alone = identify(replace(log, measured_velocity=None)).estimate
    assert found.value("mass") == alone.value("mass") == pytest.approx(3.0, rel=DERIVED)


def test_an_identification_with_a_spring_refuses_a_velocity_of_another_unit(log: AxisLog) -> None:
    """The simulated motion of a report would check it only without further terms."""
    wrong = replace(
        log,
        effort=log.effort + 100.0 * log.measured_position,
        measured_velocity=1000.0 * velocity_of(log),
    )
    with refuses("velocity_foreign"):
        identify(wrong)


def test_a_good_velocity_is_used(log: AxisLog) -> None:
    estimate = EnergyEstimator().fit(log)
    assert not any("instead" in note for note in estimate.diagnostics.notes)


@pytest.mark.parametrize(("samples", "side"), [(1, "behind"), (-1, "ahead of")])
def test_the_note_on_a_shifted_velocity_states_its_side(
    log: AxisLog, samples: int, side: str
) -> None:
    shifted = np.roll(velocity_of(log), samples)
    estimate = EnergyEstimator().fit(replace(log, measured_velocity=shifted))
    (note,) = [note for note in estimate.diagnostics.notes if "instead" in note]
    assert f"ms {side} the position" in note
    assert "-" not in note
    for name, value in TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=DERIVED)


def test_noise_of_the_velocity_does_not_lower_its_gain() -> None:
    generator = np.random.default_rng(1)
    T, time = 0.001, np.arange(20_000) * 0.001
    x = np.sin(3 * time) + 1e-6 * generator.normal(size=time.size)
    # A tenth of the speed's power is noise that passes the filter
    v = 3 * np.cos(3 * time) + 1.5 * generator.normal(size=time.size)
    match = velocity_match(x, v, LowPass(order=4, cutoff=100.0), T)
    assert match is not None
    assert match.gain == pytest.approx(1.0, abs=4 * match.gain_std)
    assert match.gain_std < 0.02
    assert not match.scaled


def test_without_the_velocity_of_the_load_the_filter_does_no_harm(arm_log: AxisLog) -> None:
    estimate = ARM.fit(replace(arm_log, measured_load_velocity=None))
    assert estimate.status is Status.OK
    for name, value in ARM_TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=DERIVED)
    assert estimate.value("offset") == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(("factor", "delay"), [(1.05, 0), (1.0, 2), (1.0, -2)])
def test_a_wrong_velocity_of_the_load_is_not_used(
    arm_log: AxisLog, factor: float, delay: int
) -> None:
    assert arm_log.measured_load_velocity is not None
    wrong = factor * np.roll(arm_log.measured_load_velocity, delay)
    estimate = ARM.fit(replace(arm_log, measured_load_velocity=wrong))
    for name, value in ARM_TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=DERIVED)
    assert any("load velocity is" in note for note in estimate.diagnostics.notes)


def test_a_velocity_of_the_load_in_another_unit_is_refused(arm_log: AxisLog) -> None:
    assert arm_log.measured_load_velocity is not None
    wrong = replace(arm_log, measured_load_velocity=57.3 * arm_log.measured_load_velocity)
    with refuses("velocity_foreign", name="load velocity"):
        ARM.fit(wrong)


SLOW_SAMPLING = 0.01
"""Residual of a switched force over 20 values between two of its switchings."""


@pytest.mark.parametrize("sampling_time", [0.001, 0.01, 0.02, 0.05, 0.1])
def test_sharp_motion_is_not_taken_for_noise(sampling_time: float) -> None:
    """Bang-bang and sines, ideal sensors: once 6 % and 26 % off at 0.05 s and 0.1 s."""
    time = np.arange(round(40.0 / sampling_time)) * sampling_time
    effort = 30 * np.sign(np.sin(2.1 * time)) + 10 * np.sin(3 * time) + 8 * np.sin(7 * time)
    motion = simulate(SingleMass(mass=20.0, friction=LAW), effort, sampling_time=sampling_time)
    estimate = EnergyEstimator().fit(Sensors().measure(motion))
    assert estimate.status is Status.OK
    for name, value in TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=SLOW_SAMPLING)


@pytest.mark.parametrize("sampling_time", [0.001, 0.01, 0.02, 0.05, 0.1])
def test_white_noise_on_that_motion_is_still_found(sampling_time: float) -> None:
    time = np.arange(round(200.0 / sampling_time)) * sampling_time
    effort = 30 * np.sign(np.sin(2.1 * time)) + 10 * np.sin(3 * time) + 8 * np.sin(7 * time)
    motion = simulate(SingleMass(mass=20.0, friction=LAW), effort, sampling_time=sampling_time)
    sensors = Sensors(position_noise=0.002 * sampling_time, velocity_noise=0.02)
    log = sensors.measure(motion, np.random.default_rng(0))
    low_pass = LowPass(order=4, cutoff=default_cutoff(sampling_time))
    noise = motion_noise(log.measured_position, velocity_of(log), low_pass, sampling_time)
    assert noise.noisy
    assert noise.velocity == pytest.approx(0.02, rel=0.1)
