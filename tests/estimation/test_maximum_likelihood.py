"""Maximum likelihood on the exact simulator: truth recovered, honest intervals, limits reported."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from estimates import std_of
from laws import uneven
from refusals import refuses

from stickslip.estimation import MaximumLikelihoodEstimator, examine
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, simulate

SAMPLING_TIME = 1e-3
COUNT = 2 * np.pi / 4096
INERTIA, VISCOUS, COULOMB, OFFSET = 0.05, 0.1, 0.5, 0.05
TRUTH = {
    "inertia": INERTIA,
    "viscous_friction": VISCOUS,
    "coulomb_friction": COULOMB,
    "offset": OFFSET,
}

ENCODER = Sensors(encoder_step=COUNT, velocity="none")
QUIET = Sensors(position_noise=1e-4, velocity="none")

NOISELESS_TOLERANCE = 1e-6
"""Relative; the search ends where a step would gain less than 1e-4 in the likelihood, and without
noise errors of 1e-9 of the range count."""

BEYOND = 5.0
"""Standard deviations from the truth that one estimate in a million exceeds."""


def law(**changes: float) -> CoulombViscousFriction:
    values = {"coulomb_friction": COULOMB, "viscous_friction": VISCOUS, "offset": OFFSET}
    return CoulombViscousFriction.symmetric(**{**values, **changes})


def servo(**changes: float) -> SingleMass:
    return SingleMass(mass=INERTIA, friction=law(**changes), kind="rotary")


def multisine(generator: np.random.Generator, samples: int = 4000) -> np.ndarray:
    time = np.arange(samples) * SAMPLING_TIME
    tones = ((0.6, 0.3), (0.5, 0.7), (0.5, 1.3), (0.4, 2.9), (0.4, 5.1))
    phases = generator.uniform(0.0, 2.0 * np.pi, len(tones))
    return sum(
        (a * np.sin(2.0 * np.pi * f * time + p) for (a, f), p in zip(tones, phases, strict=True)),
        start=np.zeros(samples),
    )


def logged(
    plant: Plant,
    effort: np.ndarray,
    sensors: Sensors,
    generator: np.random.Generator,
    *,
    state: tuple[float, ...] | None = None,
    acting: np.ndarray | None = None,
) -> AxisLog:
    """Return a log of the effort, under another one that acts if it is given."""
    acting = effort if acting is None else acting
    motion = simulate(plant, acting, sampling_time=SAMPLING_TIME, initial_state=state)
    return replace(sensors.measure(motion, generator), effort=np.append(effort, effort[-1]))


def check_truth(estimator: MaximumLikelihoodEstimator, log: AxisLog, truth: Any) -> None:
    estimate = estimator.fit(log)
    assert estimate.status is Status.OK
    for name in estimate.parameters:
        error = abs(estimate.value(name) - truth[name])
        assert error < BEYOND * std_of(estimate, name), name


def test_without_noise_the_truth_is_found() -> None:
    generator = np.random.default_rng(1)
    log = logged(servo(), multisine(generator), Sensors(), generator, state=(0.3, 1.5))
    estimate = MaximumLikelihoodEstimator().fit(log)
    for name, value in TRUTH.items():
        assert estimate.value(name) == pytest.approx(value, rel=NOISELESS_TOLERANCE)


def test_directions_of_their_own_are_found() -> None:
    generator = np.random.default_rng(2)
    friction = uneven(coulomb=(0.4, 0.6), static=(0.4, 0.6), viscous=(0.08, 0.12))
    plant = SingleMass(mass=INERTIA, friction=friction, kind="rotary")
    log = logged(plant, multisine(generator), ENCODER, generator)
    truth = {name: getattr(friction, name) for name in friction.__dataclass_fields__}
    check_truth(MaximumLikelihoodEstimator(per_direction=True, inertia=INERTIA), log, truth)


@pytest.mark.slow
def test_a_correlated_sensor_error_is_whitened() -> None:
    generator = np.random.default_rng(3)
    log = logged(servo(), multisine(generator), Sensors(velocity="none"), generator)
    error = np.zeros(len(log))
    for k in range(1, error.size):
        error[k] = 0.98 * error[k - 1] + 1e-3 * generator.standard_normal()
    log = replace(log, measured_position=log.measured_position + error)
    estimator = MaximumLikelihoodEstimator()
    check_truth(estimator, log, TRUTH)
    noise = estimator.maximum(log).noise["position"]
    assert noise.correlation == pytest.approx(0.98, abs=0.01)
    assert noise.std == pytest.approx(1e-3, rel=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("delay", [0, 1, 2])
def test_the_delay_of_the_effort_is_found(delay: int) -> None:
    generator = np.random.default_rng(4)
    effort = multisine(generator, 2500)
    late = np.concatenate((np.zeros(delay), effort[: effort.size - delay]))
    log = logged(servo(), effort, ENCODER, generator, acting=late)
    estimate = MaximumLikelihoodEstimator(largest_delay=2).fit(log)
    note = f"the effort acts {delay} sample{'' if delay == 1 else 's'} late (likeliest of 0 to 2)"
    assert note in estimate.diagnostics.notes
    assert estimate.value("inertia") == pytest.approx(INERTIA, rel=1e-3)


@pytest.mark.parametrize("per_direction", [False, True])
def test_a_short_log_of_positions_alone_is_fitted(per_direction: bool) -> None:
    """Two hundred samples at 10 ms: too short for filters, and yet each parameter to 1 %."""
    generator = np.random.default_rng(8)
    friction = CoulombViscousFriction.symmetric(coulomb_friction=20.0, viscous_friction=200.0)
    time = 0.01 * np.arange(200)
    effort = 70.0 * np.sin(7.0 * time + 1.0) + 60.0 * np.sin(17.0 * time)
    motion = simulate(SingleMass(mass=95.0, friction=friction), effort, sampling_time=0.01)
    log = Sensors(position_noise=1e-6, velocity="none").measure(motion, generator)
    estimate = MaximumLikelihoodEstimator(per_direction=per_direction).fit(log)
    assert estimate.status is Status.OK
    truth = {"mass": 95.0, "viscous_friction": 200.0, "coulomb_friction": 20.0, "offset": 0.0}
    for name, parameter in estimate.parameters.items():
        assert parameter.value is not None
        assert parameter.std is not None
        both = truth[name.removesuffix("_positive").removesuffix("_negative")]
        assert abs(parameter.value - both) < BEYOND * parameter.std
        assert parameter.std < 0.01 * 20.0


def test_a_delayed_effort_is_among_the_causes_named() -> None:
    generator = np.random.default_rng(4)
    effort = multisine(generator, 2500)
    late = np.append([0.0, 0.0], effort[:-2])
    estimate = MaximumLikelihoodEstimator().fit(
        logged(servo(), effort, QUIET, generator, acting=late)
    )
    assert estimate.status is Status.BIASED
    assert any("largest_delay" in note for note in estimate.diagnostics.notes)


def test_an_axis_that_rests_on_a_count_gives_one_reading() -> None:
    """Ten times as long at rest adds no information: values and intervals stay what they are."""
    generator = np.random.default_rng(5)
    moving = multisine(generator, 4000)
    fits = []
    for rest in (100, 20_000):
        effort = np.concatenate((moving, np.zeros(rest)))
        log = logged(servo(), effort, ENCODER, generator, state=(0.0003, 0.0))
        fits.append(MaximumLikelihoodEstimator().fit(log))
    for name in TRUTH:
        short, long = (fit.diagnostics.classical_std[name] for fit in fits)
        assert long == pytest.approx(short, rel=1e-2)
        assert fits[1].value(name) == pytest.approx(fits[0].value(name), rel=1e-5)


@pytest.mark.slow
def test_static_friction_of_a_rigid_axis_is_between_what_held_and_what_freed_it() -> None:
    generator = np.random.default_rng(6)
    time = np.arange(4000) * SAMPLING_TIME
    effort = 1.2 * np.sin(2 * np.pi * 1.1 * time) * (0.5 + 0.5 * time / time[-1])
    sensors = Sensors(position_noise=1e-4, velocity_noise=1e-2)
    log = logged(servo(static_friction=0.65), effort, sensors, generator)
    estimate = MaximumLikelihoodEstimator(static_friction=True).fit(log)
    found = estimate.parameters["static_friction"]
    assert estimate.status is Status.OK
    assert found.ci95 is not None
    assert found.ci95[0] <= 0.65 <= found.ci95[1]
    assert found.ci95[1] - found.ci95[0] < 0.02
    assert estimate.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e-3)


ARM_FRICTION = CoulombViscousFriction.symmetric(
    coulomb_friction=0.15, viscous_friction=0.1, static_friction=0.2
)
ARM = FlexibleArm(mass_1=1.0, mass_2=0.8, stiffness=30.0, friction=ARM_FRICTION)


KNOWN_ARM = MaximumLikelihoodEstimator(
    inertia=1.0, load_inertia=0.8, stiffness=30.0, static_friction=True, offset=False
)


def arm_log(sensors: Sensors, seed: int) -> AxisLog:
    generator = np.random.default_rng(seed)
    effort = np.repeat(generator.uniform(-0.6, 0.6, 24), 50)
    motion = simulate(ARM, effort, sampling_time=0.01)
    return sensors.measure(motion, generator)


@pytest.mark.slow
def test_masses_stiffness_and_friction_of_an_arm_are_found() -> None:
    log = arm_log(Sensors(position_noise=1e-3, velocity_noise=1e-2), 7)
    guesses = {"mass": 1.2, "load_mass": 0.7, "stiffness": 27.0}
    estimator = MaximumLikelihoodEstimator(
        flexible=True, static_friction=True, initial_values=guesses
    )
    truth = {"mass": 1.0, "load_mass": 0.8, "stiffness": 30.0, "viscous_friction": 0.1}
    truth |= {"coulomb_friction": 0.15, "static_friction": 0.2, "offset": 0.0}
    check_truth(estimator, log, truth)


@pytest.mark.slow
def test_an_arm_whose_load_is_not_measured() -> None:
    log = arm_log(Sensors(position_noise=1e-3, velocity_noise=1e-2, load=False), 5)
    truth = {"viscous_friction": 0.1, "coulomb_friction": 0.15, "static_friction": 0.2}
    check_truth(KNOWN_ARM, log, truth)
    assert KNOWN_ARM.fit(log).parameters["static_friction"].std == pytest.approx(0.025, rel=0.5)


@pytest.mark.slow
def test_static_friction_that_the_motion_does_not_show_is_not_identifiable() -> None:
    log = arm_log(Sensors(position_noise=1e-3, velocity_noise=1e-2, load=False), 8)
    estimate = KNOWN_ARM.fit(log)
    assert estimate.status is Status.NOT_IDENTIFIABLE
    assert estimate.parameters["static_friction"].value is None
    reasons = {v.parameter: v.reason for v in estimate.diagnostics.verdicts}
    assert "half of its 95 % interval exceeds the value" in reasons["static_friction"]
    assert estimate.value("coulomb_friction") == pytest.approx(0.15, rel=0.05)


def test_one_direction_does_not_separate_coulomb_friction_and_offset() -> None:
    generator = np.random.default_rng(9)
    time = np.arange(4000) * SAMPLING_TIME
    log = logged(servo(), 1.2 + 0.4 * np.sin(9.0 * time), ENCODER, generator)
    estimate = MaximumLikelihoodEstimator().fit(log)
    assert estimate.status is Status.NOT_IDENTIFIABLE
    assert estimate.parameters["coulomb_friction"].value is None
    assert estimate.parameters["offset"].value is None
    reasons = {v.parameter: v.reason for v in estimate.diagnostics.verdicts}
    assert "one way only" in reasons["offset"]
    assert estimate.value("inertia") == pytest.approx(INERTIA, rel=1e-3)


def test_an_axis_that_hardly_moves_has_insufficient_excitation() -> None:
    generator = np.random.default_rng(10)
    effort = 0.3 * np.sin(np.arange(2000) * 0.01)
    log = logged(servo(), effort, Sensors(position_noise=1e-4), generator)
    with refuses("no_first_guess_in_log"):
        MaximumLikelihoodEstimator().fit(log)
    estimator = MaximumLikelihoodEstimator(
        inertia=INERTIA, initial_values={"coulomb_friction": 0.5}
    )
    assert estimator.fit(log).status is Status.INSUFFICIENT_EXCITATION


@pytest.mark.slow
def test_gaps_and_a_horizon_give_every_stretch_a_first_state() -> None:
    generator = np.random.default_rng(11)
    log = logged(servo(), multisine(generator), QUIET, generator)
    keep = np.delete(np.arange(len(log)), slice(2000, 2200))
    gappy = replace(
        log,
        time=log.time[keep],
        effort=log.effort[keep],
        measured_position=log.measured_position[keep],
    )
    check_truth(MaximumLikelihoodEstimator(), gappy, TRUTH)
    assert len(MaximumLikelihoodEstimator().maximum(gappy).initial_states) == 2
    estimator = MaximumLikelihoodEstimator(horizon=1.0)
    check_truth(estimator, log, TRUTH)
    assert len(estimator.maximum(log).initial_states) == 4


def test_an_unmodelled_force_has_a_note() -> None:
    generator = np.random.default_rng(12)
    effort = multisine(generator)
    disturbed = effort + 0.1 * np.sin(2 * np.pi * 0.11 * np.arange(effort.size) * SAMPLING_TIME)
    log = logged(servo(), effort, QUIET, generator, acting=disturbed)
    notes = MaximumLikelihoodEstimator(noise="white").fit(log).diagnostics.notes
    assert any("disturbing force" in note for note in notes)


def test_a_report_can_be_made_of_it() -> None:
    generator = np.random.default_rng(13)
    log = logged(servo(), multisine(generator), Sensors(encoder_step=COUNT), generator)
    found = examine(log, MaximumLikelihoodEstimator())
    assert found.curve is not None
    assert found.residuals is not None
    assert found.residuals.share < 0.1
