"""Inputs designed for identification: within the limits, and better than what one would try."""

import numpy as np
import pytest
from refusals import refuses

from stickslip.estimation import (
    DesignedInput,
    InputLimits,
    MaximumLikelihoodEstimator,
    cramer_rao_bound,
    design_input,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.simulation import Sensors, simulate

STAGE = SingleMass(
    mass=95.0,
    friction=CoulombViscousFriction.symmetric(
        coulomb_friction=20.0, viscous_friction=200.0, offset=-3.0
    ),
)
SENSORS = Sensors(position_noise=1e-5, velocity="none")
LIMITS = InputLimits(effort=120.0, speed=0.3, travel=0.1)
SAMPLING_TIME = 0.005
DURATION = 4.0

BEYOND = 5.0
"""Standard deviations from the truth that one estimate in a million exceeds."""


def design(
    plant: SingleMass = STAGE, *, limits: InputLimits = LIMITS, duration: float = DURATION
) -> DesignedInput:
    return design_input(
        plant,
        duration=duration,
        sampling_time=SAMPLING_TIME,
        sensors=SENSORS,
        limits=limits,
        generator=np.random.default_rng(1),
    )


def within(effort: np.ndarray) -> bool:
    motion = simulate(STAGE, effort, sampling_time=SAMPLING_TIME)
    way = np.max(np.abs(motion.position - motion.position[0]))
    return bool(
        np.max(np.abs(effort)) <= LIMITS.effort
        and np.max(np.abs(motion.velocity)) <= LIMITS.speed
        and way <= LIMITS.travel
    )


def determined(effort: np.ndarray) -> float:
    bound = cramer_rao_bound(STAGE, effort, sampling_time=SAMPLING_TIME, sensors=SENSORS)
    return float(np.linalg.slogdet(bound.information)[1])


def test_a_designed_input_keeps_the_limits_and_beats_every_sine() -> None:
    designed = design()
    assert within(designed.effort)
    time = SAMPLING_TIME * np.arange(designed.effort.size)
    sines = [
        amplitude * np.sin(2.0 * np.pi * frequency * time)
        for frequency in (0.5, 1.0, 2.0, 4.0)
        for amplitude in np.linspace(30.0, LIMITS.effort, 10)
    ]
    allowed = [determined(sine) for sine in sines if within(sine)]
    assert len(allowed) > 5
    assert determined(designed.effort) > max(allowed) + 2.0  # e: a third of the ellipsoid's volume
    motion = simulate(STAGE, designed.effort, sampling_time=SAMPLING_TIME)
    log = SENSORS.measure(motion, np.random.default_rng(2))
    estimate = MaximumLikelihoodEstimator(noise="white").fit(log)
    truth = {"mass": 95.0, "viscous_friction": 200.0, "coulomb_friction": 20.0, "offset": -3.0}
    for name, value in truth.items():
        assert abs(estimate.value(name) - value) < BEYOND * designed.bound.std[name]


@pytest.mark.slow
def test_ten_times_as_long_determines_at_least_ten_times_as_much() -> None:
    content = []
    for duration in (DURATION, 10.0 * DURATION):
        designed = design(duration=duration)
        bound = designed.bound
        content.append(np.linalg.slogdet(bound.information)[1] / len(bound.names))
        assert within(designed.effort)
    assert content[1] >= content[0] + np.log(10.0)


@pytest.mark.parametrize(
    ("offset", "effort", "direction", "needed"),
    [
        (0.0, 10.0, "", 20.0),
        (-15.0, 30.0, "backwards", 35.0),
    ],
)
def test_an_effort_that_does_not_free_the_axis_is_named(
    offset: float, effort: float, direction: str, needed: float
) -> None:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=20.0, viscous_friction=200.0, offset=offset
    )
    with refuses("effort_frees_nothing", direction=direction, needed=needed):
        design(SingleMass(mass=95.0, friction=law), duration=1.0, limits=InputLimits(effort=effort))


def test_impossible_designs_are_refused() -> None:
    with refuses("no_input_separates"):
        design(duration=1.0, limits=InputLimits(effort=120.0, travel=1e-12))
    with refuses("input_too_short", samples=10):
        design(duration=0.05)
    with refuses("not_positive", name="travel_limit", value=-1.0):
        InputLimits(effort=1.0, travel=-1.0)
