"""Zero-vibration shaping: the load's swing in closed form, and arms that follow or stick."""

from dataclasses import replace
from itertools import pairwise
from math import pi, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import uneven
from refusals import refuses

from stickslip import CoulombViscousFriction, FlexibleArm, SensorSample
from stickslip.control import PD, Move, PointToPoint
from stickslip.simulation import simulate_closed_loop
from studies.van_de_wijdeven.conjunction.zero_vibration import ZeroVibrationController

NODES, WEIGHTS = np.polynomial.legendre.leggauss(60)
QUADRATURE = 1e-13
"""Of a swing over the move [-]: rounding."""

SAMPLED = 2e-5
"""Over the move [-]: what the effort held over a sample leaves of the closed form. Found was 6e-6.
"""

ARM = FlexibleArm(
    mass_1=1.0,
    mass_2=1.5,
    stiffness=2.0,
    friction=CoulombViscousFriction.symmetric(
        coulomb_friction=0.1, viscous_friction=0.1, static_friction=0.12
    ),
)
CONTROLLER = ZeroVibrationController(
    sampling_time=0.02,
    arm=ARM,
    pd=PD(position_gain=400.0, velocity_gain=40.0),
    reference=PointToPoint(
        moves=(Move(target=1.0, duration=3.0, dwell=9.0), Move(target=0.3, duration=2.5))
    ),
    effort_limit=2.0,
)


def residual_swing(controller: ZeroVibrationController, *, shaped: bool) -> float:
    """Return the swing of a load at rest that is left by its spring's other end.

    A load with the frequency w whose spring's end has the acceleration a(t) swings afterwards with
    the amplitude abs(integral of a exp(i w t) dt)/w.
    """
    w, duration = pi / controller.delay, controller.reference.duration
    ends = sorted({0.0, controller.delay, duration, duration + controller.delay})
    total = 0j
    for begin, end in pairwise(ends):  # between them the acceleration is a polynomial
        t = begin + 0.5 * (end - begin) * (1.0 + NODES)
        a = (controller.shaped_at(t) if shaped else controller.reference.at(t)).acceleration
        total += 0.5 * (end - begin) * (WEIGHTS @ (a * np.exp(1j * w * t)))
    return abs(total) / w


@given(mass_2=st.floats(0.3, 3.0), stiffness=st.floats(0.3, 3.0), duration=st.floats(0.5, 5.0))
def test_a_shaped_move_leaves_no_swing(mass_2: float, stiffness: float, duration: float) -> None:
    controller = replace(
        CONTROLLER,
        arm=replace(ARM, mass_2=mass_2, stiffness=stiffness),
        reference=PointToPoint(moves=(Move(target=1.0, duration=duration),)),
    )
    assert controller.delay == pytest.approx(pi * sqrt(mass_2 / stiffness))
    assert residual_swing(controller, shaped=True) < QUADRATURE


def test_without_shaping_it_swings() -> None:
    fast = replace(CONTROLLER, reference=PointToPoint(moves=(Move(target=1.0, duration=2.0),)))
    assert residual_swing(fast, shaped=False) > 0.1


def test_a_wrong_frequency_leaves_what_the_theory_says() -> None:
    # The impulses' swings cancel but for cos(w h/2), h = pi/w', on top of the unshaped swing
    reference = PointToPoint(moves=(Move(target=1.0, duration=2.0),))
    guessed = replace(CONTROLLER, reference=reference, arm=replace(ARM, stiffness=2.4))
    w, h = sqrt(ARM.stiffness / ARM.mass_2), guessed.delay
    times = np.linspace(0.0, 2.0 + h, 40_001)
    a = guessed.shaped_at(times).acceleration
    swing = abs(np.trapezoid(a * np.exp(1j * w * times), times)) / w
    unshaped = residual_swing(replace(CONTROLLER, reference=reference), shaped=False)
    assert swing == pytest.approx(unshaped * abs(np.cos(0.5 * w * h)), rel=1e-6)


def test_the_shaped_reference_is_the_mean_of_two() -> None:
    times = np.linspace(-1.0, 20.0, 500)
    shaped = CONTROLLER.shaped_at(times)
    early = CONTROLLER.reference.at(times)
    late = CONTROLLER.reference.at(times - CONTROLLER.delay)
    for name in ("position", "velocity", "acceleration"):
        mean = 0.5 * (getattr(early, name) + getattr(late, name))
        assert np.abs(getattr(shaped, name) - mean).max() < 1e-15
    assert shaped.position[0] == 0.0
    assert shaped.position[-1] == pytest.approx(0.3, abs=1e-15)


def run(plant: FlexibleArm, controller: ZeroVibrationController) -> tuple[np.ndarray, np.ndarray]:
    """Return the deviation of mass 1 from the shaped reference, and mass 2 about mass 1."""
    done = simulate_closed_loop(plant, controller, sampling_time=0.02, samples=1500)
    motion = done.motion
    assert np.abs(motion.commanded_effort).max() <= controller.effort_limit
    deviation = motion.position - controller.shaped_at(done.log.time).position
    return deviation, motion.load_position - motion.position


def test_an_arm_that_is_known_follows_and_rests() -> None:
    deviation, deflection = run(ARM, CONTROLLER)
    assert np.abs(deviation).max() < 10 * SAMPLED
    assert np.abs(deflection[-500:]).max() < SAMPLED
    assert abs(deviation[-1]) < SAMPLED


def test_friction_that_is_not_known_leaves_an_error() -> None:
    unknown = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
    deviation, _ = run(ARM, replace(CONTROLLER, arm=replace(ARM, friction=unknown)))
    stuck = ARM.friction.static_friction_positive / CONTROLLER.pd.position_gain
    assert 0.1 * stuck < abs(deviation[-1]) <= stuck


def test_the_effort_is_limited_and_a_missing_sensor_is_refused() -> None:
    state = CONTROLLER.init()
    again, effort = CONTROLLER.step(state, SensorSample(1.0, -1.0, 0.0, -1.0, 0.0))
    assert effort == CONTROLLER.effort_limit
    assert np.array_equal(again, state)
    for k in range(1, 5):
        seen = [1.0, 0.1, 0.0, 0.1, 0.0]
        seen[k] = np.nan
        assert np.isnan(CONTROLLER.step(state, SensorSample(*seen))[1])


def test_friction_and_offset_are_compensated_each_way() -> None:
    law = uneven(coulomb=(0.2, 0.3), static=(0.3, 0.3), viscous=(0.4, 0.5), offset=0.05)
    exact = replace(CONTROLLER, arm=replace(ARM, friction=law))
    for t in (1.5, 14.0):  # there, and back
        here = CONTROLLER.shaped_at(t)
        x, v = float(here.position[0]), float(here.velocity[0])
        sample = SensorSample(t, x, v, x, v)
        fed = CONTROLLER.shaped_at(t + 0.5 * CONTROLLER.sampling_time)
        w = float(fed.velocity[0])
        friction = 0.2 + 0.4 * w if w > 0 else -0.3 + 0.5 * w
        expected = ARM.mass_1 * float(fed.acceleration[0]) + friction + 0.05
        assert exact.step(exact.init(), sample)[1] == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("name", ["sampling_time", "effort_limit"])
def test_what_is_not_positive_is_refused(name: str) -> None:
    with refuses("not_positive", name=name):
        replace(CONTROLLER, **{name: 0.0})


@pytest.mark.usefixtures("without_shape_checks")
@pytest.mark.parametrize("name", ["arm", "pd", "reference"])
def test_a_part_of_another_class_is_refused(name: str) -> None:
    with refuses("wrong_type", name=name, found="float"):
        replace(CONTROLLER, **{name: 1.0})
