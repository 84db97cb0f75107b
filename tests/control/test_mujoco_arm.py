"""The landing controller on an arm that MuJoCo moves, whose friction holds truly."""

from types import ModuleType

import numpy as np
import pytest
from mujoco_example import mujoco_example

from stickslip import CoulombViscousFriction, FlexibleArm, simulate
from stickslip.control import TrackedLandingController
from stickslip.planning import PulseSeriesPlanner

EULER_POSITION = 1e-4
"""Of a move of 1 m on the way [m]: MuJoCo's Euler steps are of first order. Found was 4.3e-5."""

EULER_END = 1e-5
"""Of where it ends [m]. Found was 3.8e-6."""

CREEP = 1e-9
"""Of a resting mass 1 in 30 s, mass 2 swinging [m]."""


@pytest.fixture(scope="module")
def example() -> ModuleType:
    return mujoco_example("06_land_a_mujoco_arm")


def known_arm(example: ModuleType) -> FlexibleArm:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=example.COULOMB, viscous_friction=example.VISCOUS
    )
    return FlexibleArm(
        mass_1=example.MASS_1, mass_2=example.MASS_2, stiffness=example.STIFFNESS, friction=law
    )


def test_friction_holds_while_the_load_swings(example: ModuleType) -> None:
    arm = example.MuJoCoArm()
    amplitude = 0.9 * example.COULOMB / example.STIFFNESS
    arm.place(0.0, amplitude)
    arm.push(0.0, 30.0)
    assert abs(arm.state[0]) < CREEP
    assert example.swing(arm) == pytest.approx(amplitude, rel=1e-3)
    arm.place(0.0, 1.1 * example.COULOMB / example.STIFFNESS)
    arm.push(0.0, 1.0)
    assert arm.state[0] > 1e-4


def test_a_series_moves_it_as_the_exact_simulator_says(example: ModuleType) -> None:
    planner = PulseSeriesPlanner(
        arm=known_arm(example), sampling_time=example.T, effort_limit=example.EFFORT_LIMIT
    )
    series = planner.plan((0.0, 0.0, 0.0, 0.0), 1.0)
    motion = simulate(known_arm(example), series.effort, sampling_time=example.T)
    arm = example.MuJoCoArm()
    states = [arm.state]
    for effort in series.effort:
        arm.push(float(effort), example.T)
        states.append(arm.state)
    found = np.array(states)
    assert motion.load_position is not None
    assert np.abs(found[:, 0] - motion.position).max() < EULER_POSITION
    assert np.abs(found[:, 2] - motion.load_position).max() < EULER_POSITION
    arm.push(0.0, example.T)
    assert abs(arm.state[0] - 1.0) < EULER_END
    assert example.swing(arm) < EULER_END


@pytest.mark.slow
def test_it_lands_on_one_target_after_the_other(example: ModuleType) -> None:
    arm, pilot = example.MuJoCoArm(), example.controller(1.0)
    generator = np.random.default_rng(3)
    state = pilot.init()
    for target in (1.0, 0.4):
        fired = len(state.flights)
        state = example.land(arm, pilot, pilot.retargeted(state, target), generator)
        assert pilot.outcome(state).value == "reached"
        assert len(state.flights) - fired <= 4
        # What is measured within the tolerance is so truly but for the noise of a mean
        allowed = example.TOLERANCE + example.POSITION_NOISE
        assert abs(arm.state[0] - target) < allowed
        assert example.swing(arm) < allowed
    found = pilot.estimates(state)
    assert found["coulomb_friction"] == pytest.approx(example.COULOMB, rel=1e-3)
    assert found["viscous_friction"] == pytest.approx(example.VISCOUS, rel=1e-2)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6))
def test_it_lands_where_friction_stops_mass_1_softly(
    example: ModuleType, monkeypatch: pytest.MonkeyPatch, seed: int
) -> None:
    """Steps of 2 ms: mass 1 goes on by some 0.1 mm where exact friction stops it."""
    soft = example.ARM.replace(repr(example.STEP), "0.002").replace(repr(2 * example.STEP), "0.004")
    monkeypatch.setattr(example, "ARM", soft.replace('"Euler"', '"implicitfast"'))
    monkeypatch.setattr(example, "STEP", 2e-3)
    arm, generator = example.MuJoCoArm(), np.random.default_rng(seed)
    pilot = TrackedLandingController(
        sampling_time=example.T, target=0.0, tolerance=3e-5, arm=known_arm(example),
        effort_limit=example.EFFORT_LIMIT, estimator=example.controller(0.0).estimator,
        position_noise=example.POSITION_NOISE, velocity_noise=example.VELOCITY_NOISE,
    )  # fmt: skip
    state = pilot.init()
    for target in (1.0, 0.6, -0.3):
        state = example.land(arm, pilot, pilot.retargeted(state, target), generator)
        assert pilot.outcome(state).value == "reached"
        assert abs(arm.state[0] - target) < 3e-5 + example.POSITION_NOISE
        assert example.swing(arm) < 3e-5 + example.POSITION_NOISE
