"""The linear loop of the surrogate arm, and how the real one follows it and its reference."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import signal

from stickslip.control import FrictionCompensation, Move, PointToPoint
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import Sensors, simulate_closed_loop

SAMPLES = 6000  # 60 s
MOVING = 2350  # samples until the reference rests
VISCOUS = 0.1
# What the loop is asked for
LEAST_PHASE_MARGIN = 35.0  # degrees
LEAST_GAIN_MARGIN = 10.0
LEAST_DISTANCE = 0.6  # of the loop gain from -1
LEAST_DECAY = 0.13  # 1/s, of every closed-loop pole
LEAST_DAMPING = 0.13


def arm_matrices():
    """The arm slipping without Coulomb friction; states x1, v1, x2, v2."""
    A = np.array(
        [[0, 1, 0, 0], [-1, -VISCOUS, 1, 0], [0, 0, 0, 1], [1, 0, -1, 0]], dtype=np.float64
    )
    return A, np.array([[0.0], [1.0], [0.0], [0.0]])


def loop_transfer(controller):
    """Numerator and denominator in z of the loop gain, by scipy's conversions."""
    A, B = arm_matrices()
    gains = np.array([[controller.pd.position_gain, controller.pd.velocity_gain, 0.0, 0.0]])
    Ad, Bd, C, D, _ = signal.cont2discrete((A, B, gains, [[0.0]]), controller.sampling_time)
    numerator, denominator = signal.ss2tf(Ad, Bd, C, D)
    c = controller.notch.coefficients(controller.sampling_time)
    return (
        np.convolve(numerator[0], [c.b0, c.b1, c.b2]),  # keeps leading zeros, as polymul does not
        np.convolve(denominator, [1.0, c.a1, c.a2]),
    )


def test_the_loop_has_margins(controller):
    T = controller.sampling_time
    numerator, denominator = loop_transfer(controller)
    w = np.append(np.geomspace(1e-3, np.pi / T, 100_000, endpoint=False), np.pi / T)
    L = signal.freqz(numerator, denominator, worN=w * T)[1]
    crossing = np.flatnonzero(np.diff(np.abs(L) > 1.0))
    phase = np.degrees(np.angle(L[crossing])) % 360.0
    assert crossing.size
    assert np.abs(phase - 180.0).min() > LEAST_PHASE_MARGIN
    assert np.abs(1.0 + L).min() > LEAST_DISTANCE
    # Only at half the sampling rate is the loop gain real and negative
    turning = np.flatnonzero((np.diff(np.sign(L.imag[:-1])) != 0) & (L.real[1:-1] < 0))
    assert not turning.size
    assert L[-1].real < 0
    assert -1.0 / L[-1].real > LEAST_GAIN_MARGIN


def test_every_closed_loop_pole_is_damped(controller):
    numerator, denominator = loop_transfer(controller)
    poles = np.log(np.roots(np.polyadd(numerator, denominator)).astype(complex))
    poles /= controller.sampling_time
    assert -poles.real.max() > LEAST_DECAY
    assert (-poles.real / np.abs(poles)).min() > LEAST_DAMPING


def test_the_real_loop_without_coulomb_friction_is_the_linear_one(controller):
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=VISCOUS)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    rest = PointToPoint(moves=[Move(target=0.0, duration=1.0)])
    plain = replace(controller, compensation=None, effort_limit=None, reference=rest)
    run = simulate_closed_loop(
        arm, plain, sampling_time=0.01, samples=2000, initial_state=(0.3, 0.0, -0.2, 0.1)
    )
    A, B = arm_matrices()
    Ad, Bd, *_ = signal.cont2discrete((A, B, np.eye(4), np.zeros((4, 1))), 0.01)
    c = controller.notch.coefficients(0.01)
    numerator, denominator = [c.b0, c.b1, c.b2], [1.0, c.a1, c.a2]
    x, memory = np.array([0.3, 0.0, -0.2, 0.1]), np.zeros(2)
    expected = np.empty(2001)
    for k in range(2001):
        expected[k] = x[0]
        e = -controller.pd.position_gain * x[0] - controller.pd.velocity_gain * x[1]
        (u,), memory = signal.lfilter(numerator, denominator, [e], zi=memory)
        x = Ad @ x + Bd[:, 0] * u
    np.testing.assert_allclose(run.motion.position, expected, rtol=0, atol=1e-9)


def tracking_error(arm, controller, sensors=None):
    run = simulate_closed_loop(
        arm,
        controller,
        sampling_time=controller.sampling_time,
        samples=SAMPLES,
        sensors=sensors,
        generator=np.random.default_rng(1),
    )
    wanted = controller.reference.at(run.motion.time).position
    return run, run.motion.position - wanted


def test_the_arm_follows_its_reference_and_better_with_its_friction_compensated(arm, controller):
    run, error = tracking_error(arm, controller)
    _, without = tracking_error(arm, replace(controller, compensation=None))
    # Moves of 0.5 to 2.5 m; what is left is the swing of the load
    assert np.abs(error).max() < 0.25
    assert error[:MOVING].std() < 0.75 * without[:MOVING].std()
    assert np.abs(error[-1000:]).max() < 0.15 / 1.5  # friction over position gain, standing still
    assert np.ptp(run.motion.position[-1000:]) < 1e-3
    assert np.abs(run.log.effort).max() < 1.0


def test_noise_neither_pushes_hard_nor_moves_the_resting_mass_far(arm, controller):
    noise = Sensors(position_noise=0.005, velocity_noise=0.05)
    run, error = tracking_error(arm, controller, noise)
    assert np.abs(error).max() < 0.25
    assert np.abs(run.log.effort).max() < 1.5
    assert np.diff(run.log.effort).std() < 0.2
    assert np.abs(np.diff(run.motion.position[3000:])).sum() < 0.05


@pytest.mark.parametrize(("velocity", "rests"), [("reference", True), ("measured", False)])
def test_friction_taken_for_twice_too_much_is_harmless_on_the_reference(
    arm, controller, velocity, rests
):
    double = CoulombViscousFriction.symmetric(coulomb_friction=0.3, viscous_friction=0.2)
    wrong = replace(
        controller, compensation=FrictionCompensation(friction=double, velocity=velocity)
    )
    run, _ = tracking_error(arm, wrong)
    way = np.abs(np.diff(run.motion.position[3000:])).sum()
    assert way < 1e-3 if rests else way > 1.0


def test_a_running_estimate_does_for_the_compensation(arm, controller, online):
    running = replace(controller, compensation=FrictionCompensation(friction=online))
    run, error = tracking_error(arm, running)
    learned = running.estimator_state(run.controller_state)[list(online.places)]
    np.testing.assert_allclose(learned, [0.15, 0.1], rtol=2e-3)
    assert np.abs(error).max() < 0.25
    _, noisy = tracking_error(arm, running, Sensors(position_noise=0.005, velocity_noise=0.05))
    assert np.abs(noisy).max() < 0.25


def test_a_rigid_axis_with_all_fed_forward_is_late_by_the_hold_only(controller):
    # A held effort acts half a sample late: the error falls with the sampling time, first order
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    mass = SingleMass(mass=2.0, friction=law)
    errors = []
    for T in (0.01, 0.005, 0.0025):
        one = PointToPoint(moves=[Move(target=1.5, duration=5.0)])
        follower = replace(controller, notch=None, sampling_time=T, reference=one)
        run = simulate_closed_loop(mass, follower, sampling_time=T, samples=round(4.0 / T))
        errors.append(np.abs(run.motion.position - one.at(run.motion.time).position).max())
    ratios = np.array(errors[:-1]) / errors[1:]
    np.testing.assert_allclose(ratios, 2.0, atol=0.2)
