"""Markho's free decay: the closed form in high precision, and logs of a mass on a spring."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from estimates import covered, least_coverage
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.estimation import DecayingExtremes, FreeDecayEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, simulate

MASS, STIFFNESS = 2.0, 50.0
COULOMB, VISCOUS = 0.8, 0.5
TRUTH = {"mass": MASS, "viscous_friction": VISCOUS, "coulomb_friction": COULOMB}
CLAMPED = 1e12  # a load so heavy that it does not move
CLOSED_FORM = 1e-9  # relative: extremes in doubles, and the solver's tolerance
SHAPE = 2e-5  # relative: the polynomials through an extreme end at the fourth power


def swings(c: float, f_c: float, count: int, *, amplitude: float, centre: float) -> list[float]:
    """Return extremes, each from the motion in between solved to 30 digits."""
    with mpmath.workdps(30):
        m, k = mpmath.mpf(MASS), mpmath.mpf(STIFFNESS)
        sigma = mpmath.mpf(c) / (2 * m)
        omega = mpmath.sqrt(k / m - sigma**2)
        x = mpmath.mpf(amplitude)
        found = [x]
        for _ in range(count - 1):
            about = mpmath.sign(x) * mpmath.mpf(f_c) / k  # friction acts the way it came from
            a = x - about
            b = a * sigma / omega

            def velocity(t: mpmath.mpf, a: mpmath.mpf = a, b: mpmath.mpf = b) -> mpmath.mpf:
                swing = a * mpmath.cos(omega * t) + b * mpmath.sin(omega * t)
                slope = -a * mpmath.sin(omega * t) + b * mpmath.cos(omega * t)
                return mpmath.exp(-sigma * t) * (omega * slope - sigma * swing)

            t = mpmath.findroot(velocity, (0.9 * mpmath.pi / omega, 1.1 * mpmath.pi / omega))
            swing = a * mpmath.cos(omega * t) + b * mpmath.sin(omega * t)
            x = about + mpmath.exp(-sigma * t) * swing
            found.append(x)
        return [float(x + mpmath.mpf(centre)) for x in found]


@given(
    c=st.floats(0.01, 2.0),
    f_c=st.floats(0.0, 1.0),
    centre=st.floats(-0.3, 0.3),
    count=st.integers(4, 7),
)
def test_the_formula_in_high_precision(c: float, f_c: float, centre: float, count: int) -> None:
    extremes = np.array(swings(c, f_c, count, amplitude=2.0, centre=centre))
    amplitudes = np.abs(extremes - centre)
    found = DecayingExtremes(position=extremes, deviation=np.full(count, 1e-6))
    (q, shift), _, _ = found.solve()
    sigma = c / (2 * MASS)
    half = np.pi / np.sqrt(STIFFNESS / MASS - sigma**2)
    assert amplitudes[1] < amplitudes[0]
    assert q == pytest.approx(np.exp(-sigma * half), rel=CLOSED_FORM)
    assert shift == pytest.approx(f_c / STIFFNESS, abs=CLOSED_FORM)


def log_of(noise: float, seed: int = 0, load: float = CLAMPED) -> AxisLog:
    law = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
    arm = FlexibleArm(mass_1=MASS, mass_2=load, stiffness=STIFFNESS, friction=law)
    motion = simulate(arm, np.zeros(2400), sampling_time=0.005, initial_state=(0.5, 0.0, 0.0, 0.0))
    sensors = Sensors(position_noise=noise, velocity="none", load=load != CLAMPED)
    return sensors.measure(motion, np.random.default_rng(seed))


@pytest.mark.parametrize("known", [{"inertia": MASS}, {"stiffness": STIFFNESS}])
def test_friction_of_a_mass_on_a_spring(known: dict[str, float]) -> None:
    found = FreeDecayEstimator(**known).fit(log_of(0.0))
    assert found.status is Status.OK
    for name, parameter in found.parameters.items():
        assert parameter.value == pytest.approx(TRUTH[name], rel=SHAPE)
    assert ("mass" in found.parameters) == ("stiffness" in known)


@pytest.mark.slow
@pytest.mark.parametrize("noise", [2e-4, 1e-3])
def test_intervals_cover(noise: float) -> None:
    runs = 60
    inside = dict.fromkeys(TRUTH, 0)
    for seed in range(runs):
        found = FreeDecayEstimator(stiffness=STIFFNESS).fit(log_of(noise, seed))
        for name, holds in covered(found, TRUTH).items():
            inside[name] += holds
    assert all(count > least_coverage(runs) * runs for count in inside.values()), inside


def test_an_effort_before_the_decay_is_left_out() -> None:
    free = log_of(0.0)
    pushed = replace(
        free,
        time=np.concatenate([free.time[0] - 0.005 * np.arange(100, 0, -1), free.time]),
        effort=np.concatenate([np.linspace(3.0, 25.0, 100), free.effort]),
        measured_position=np.concatenate([np.full(100, 0.5), free.measured_position]),
    )
    found = FreeDecayEstimator(inertia=MASS).fit(pushed)
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e-4)


def test_logs_without_a_free_decay_are_refused() -> None:
    with refuses("load_moves"):
        FreeDecayEstimator(inertia=MASS).fit(log_of(0.0, load=2.0))
    free = log_of(0.0)
    pushed = replace(free, effort=np.sin(free.time))
    with refuses("no_swing", least=4):
        FreeDecayEstimator(inertia=MASS).fit(pushed)


@pytest.mark.parametrize(
    ("position", "code"),
    [([1.0, -1.0, 0.5], "too_few_extremes"), ([1, -1, -1.5, 0.5], "extremes_not_in_turn")],
)
def test_extremes_must_alternate_and_be_enough(position: list[float], code: str) -> None:
    with refuses(code):
        DecayingExtremes(position=np.array(position), deviation=np.ones(len(position)))
