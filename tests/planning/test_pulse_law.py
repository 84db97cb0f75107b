"""The law of a pulse against Eq. 3 in many digits, van de Wijdeven's numbers and the simulator."""

from dataclasses import replace
from math import ceil
from typing import Literal

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import uneven
from refusals import refuses

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw
from stickslip.planning.pulse_kernels import position_along, pulse_ends
from stickslip.plants import SingleMass
from stickslip.simulation import simulate

TABLE_1 = PulseLaw(
    mass=150.0, coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
)
WITHOUT_VISCOSITY = replace(TABLE_1, viscous_friction=0.0)
ROUNDING = 1e-14  # relative: some tens of units in the last place, of sums of positive terms
INVERTED = 1e-11  # relative: rounding times the condition of the inverse, up to a thousand
NEAR_ZERO = 1e-12  # relative: the simulator's own, on displacements of a micrometre

masses = st.floats(0.1, 1e3)
coulombs = st.floats(0.1, 1e3)
ratios = st.floats(1.01, 10.0)  # of the effort to the Coulomb friction
# Of the time constant m/c to the width: from no viscous friction to nothing but it
swiftness = st.floats(1e-12, 30.0)
widths = st.floats(1e-3, 1.0)


def printed(law: PulseLaw, effort: float, width: float) -> mpmath.mpf:
    """Eq. 3 as van de Wijdeven (2002) prints it, in 60 digits."""
    with mpmath.workdps(60):
        m, fc, c, fp, tp = (
            mpmath.mpf(x)
            for x in (law.mass, law.coulomb_friction, law.viscous_friction, effort, width)
        )
        if c == 0:
            return fp * (fp - fc) / (2 * m * fc) * tp**2
        log = mpmath.log(fp / fc * (mpmath.exp(c * tp / m) - 1) + 1)
        return fp * tp / c - m * fc / c**2 * log


@given(masses, coulombs, ratios, swiftness, widths)
def test_displacement_is_equation_3(m: float, F: float, ratio: float, z: float, t: float) -> None:
    law = PulseLaw(mass=m, coulomb_friction=F, viscous_friction=z * m / t)
    exact = printed(law, F * ratio, t)
    assert float(law.displacement(F * ratio, t)) == pytest.approx(float(exact), rel=ROUNDING * 10)


@given(masses, coulombs, ratios, widths)
def test_without_viscosity_it_is_equation_2(m: float, F: float, ratio: float, t: float) -> None:
    law = PulseLaw(mass=m, coulomb_friction=F, viscous_friction=0.0)
    d, exact = float(law.displacement(F * ratio, t)), float(printed(law, F * ratio, t))
    assert d == pytest.approx(exact, rel=ROUNDING * 10)
    assert law.gain(F * ratio) * t * t == pytest.approx(d, rel=ROUNDING * 10)


@given(masses, coulombs, ratios, swiftness, widths)
def test_inverses_meet_the_displacement(
    m: float, F: float, ratio: float, z: float, t: float
) -> None:
    law = PulseLaw(mass=m, coulomb_friction=F, viscous_friction=z * m / t)
    d = float(printed(law, F * ratio, t))
    assert float(law.width_for(d, effort=F * ratio)) == pytest.approx(t, rel=INVERTED)
    assert float(law.effort_for(d, width=t)) == pytest.approx(F * ratio, rel=INVERTED)


def test_printed_numbers() -> None:
    # Section 3.1, as printed (two or three digits)
    t = float(TABLE_1.width_for(0.01, effort=300.0))
    assert f"{t:.3f}" == "0.092"
    assert f"{float(WITHOUT_VISCOSITY.width_for(0.01, effort=300.0)):.3f}" == "0.071"  # R: 0.070
    b = TABLE_1.gain(300.0)
    assert f"{0.01 / t**2 / b:.1f}" == "0.6"
    assert f"{float(TABLE_1.displacement(300.0, 0.03)) / 0.03**2 / b:.0%}" == "81%"
    assert f"{float(TABLE_1.width_for(0.002, effort=300.0)):.3f}" == "0.036"
    too_long = np.sqrt(0.002 / (0.01 / t**2))
    assert f"{too_long:.3f}" == "0.041"
    assert f"{float(TABLE_1.displacement(300.0, too_long)):.4f}" == "0.0026"  # R: 2.5 mm
    guess = PulseLaw(mass=150.0, coulomb_friction=80.0, viscous_friction=0.0)
    assert guess.gain(300.0) / b == pytest.approx(1.375, abs=1e-12)
    # Eqs. 23 and 24
    assert f"{float(TABLE_1.displacement(300.0, 0.01)):.1e}" == "1.9e-04"
    assert f"{float(TABLE_1.smallest_displacement(0.01)):.1e}" == "1.3e-05"


@settings(max_examples=30)
@given(
    m=st.floats(75.0, 300.0),
    F=st.floats(50.0, 200.0),
    c=st.sampled_from([0.0, 350.0, 1400.0]),
    offset=st.floats(-0.3, 0.3),
    ratio=st.floats(2.0, 4.0),
    n=st.integers(1, 30),
    way=st.sampled_from([1, -1]),
)
def test_the_simulator_goes_as_far(
    m: float, F: float, c: float, offset: float, ratio: float, n: int, way: int
) -> None:
    T = 0.01
    friction = uneven(
        coulomb=(F, 0.8 * F), static=(1.2 * F, 1.1 * F), viscous=(c, 0.9 * c), offset=offset * F
    )
    plant = SingleMass(mass=m, friction=friction)
    law = PulseLaw.of(plant, direction=way)
    effort = ratio * F
    rest = n + ceil(float(law.duration(effort, n * T)) / T)
    u = np.zeros(rest + 1)
    u[:n] = way * effort
    motion = simulate(plant, u, sampling_time=T)
    d = float(law.displacement(effort, n * T))
    assert motion.velocity[-1] == 0.0
    assert way * motion.position[-1] == pytest.approx(d, rel=NEAR_ZERO)
    stop = motion.event_time[motion.event_mode == 0]
    assert float(stop[-1]) == pytest.approx(float(law.duration(effort, n * T)), rel=NEAR_ZERO)
    pulse = (m, law.coulomb_friction, law.viscous_friction, effort, n * T)
    along = [position_along(*pulse, float(tau), pulse_ends(*pulse)) for tau in motion.time]
    np.testing.assert_allclose(way * motion.position, along, rtol=NEAR_ZERO, atol=NEAR_ZERO * d)


def test_what_does_not_break_away_does_not_move() -> None:
    efforts = np.array([0.0, 50.0, 130.0, np.nextafter(130.0, 200.0)])
    assert TABLE_1.displacement(efforts, 0.01).tolist()[:3] == [0.0, 0.0, 0.0]
    assert TABLE_1.displacement(efforts, 0.01)[3] == pytest.approx(
        float(TABLE_1.smallest_displacement(0.01)), rel=ROUNDING * 100
    )
    assert np.isnan(TABLE_1.effort_for(1e-5, width=0.01))  # below Eq. 24
    assert float(TABLE_1.effort_for(1.3e-5, width=0.01)) > 130.0
    assert TABLE_1.duration(efforts, 0.01).tolist()[:3] == [0.01] * 3


@pytest.mark.parametrize(("way", "held"), [(1, 1.75), (-1, 2.25)])
@pytest.mark.parametrize(("beyond", "moves"), [(0.0, False), (np.spacing(2.0), True)])
def test_a_pulse_must_exceed_static_friction_and_the_offset(
    way: Literal[1, -1], held: float, beyond: float, moves: bool
) -> None:
    friction = uneven(coulomb=(1.0, 1.0), static=(1.5, 2.5), viscous=(1.0, 1.0), offset=0.25)
    plant = SingleMass(mass=1.0, friction=friction)
    effort = held + beyond
    assert bool(PulseLaw.of(plant, direction=way).displacement(effort, 1.0) > 0.0) == moves
    motion = simulate(plant, [way * effort] * 2, sampling_time=1.0)
    assert bool(way * motion.position[1] > 0.0) == moves


def test_arrays_are_broadcast() -> None:
    grid = TABLE_1.displacement(np.array([[200.0], [300.0]]), np.array([0.0, 0.01, 0.02]))
    assert grid.shape == (2, 3)
    assert (np.diff(grid) > 0).all()
    assert (np.diff(grid, axis=0)[:, 1:] > 0).all()
    assert TABLE_1.width_for(np.array([0.0, 1e-3]), effort=300.0)[0] == 0.0


@pytest.mark.parametrize(
    ("call", "code", "name"),
    [
        (lambda: TABLE_1.displacement(300.0, -0.01), "negative", "width"),
        (lambda: TABLE_1.displacement(np.nan, 0.01), "not_finite", "effort"),
        (lambda: TABLE_1.width_for(0.01, effort=130.0), "effort_below_breakaway", "effort"),
        (lambda: TABLE_1.width_for(-0.01, effort=300.0), "negative", "displacement"),
        (lambda: TABLE_1.effort_for(0.0, width=0.01), "not_positive", "displacement"),
        (lambda: TABLE_1.effort_for(0.01, width=0.0), "not_positive", "width"),
        (lambda: TABLE_1.displacement("a", 1.0), "not_numbers", "effort"),
        (lambda: TABLE_1.gain(np.nan), "not_finite", "effort"),
        (lambda: replace(TABLE_1, mass=0.0), "not_positive", "mass"),
        (lambda: replace(TABLE_1, coulomb_friction=0.0), "not_positive", "coulomb_friction"),
        (lambda: replace(TABLE_1, static_friction=99.0), "static_below_coulomb", "static_friction"),
    ],
)
def test_bad_input_is_named(call, code: str, name: str) -> None:
    with refuses(code, name=name):
        call()


def test_a_displacement_that_no_float_holds_is_refused() -> None:
    with refuses("displacement_overflows", effort=1e300):
        TABLE_1.displacement(1e300, 1.0)


def test_an_offset_that_never_lets_go_is_refused() -> None:
    friction = CoulombViscousFriction.symmetric(
        coulomb_friction=1.0, viscous_friction=1.0, static_friction=3.0, offset=2.0
    )
    plant = SingleMass(mass=1.0, friction=friction)
    assert PulseLaw.of(plant, direction=1).coulomb_friction == 3.0
    with refuses("offset_never_stops"):
        PulseLaw.of(plant, direction=-1)
    balanced = replace(plant, friction=replace(friction, offset=1.0))
    with refuses("offset_never_stops"):
        PulseLaw.of(balanced, direction=-1)
    less = replace(plant, friction=replace(friction, offset=np.nextafter(1.0, 0.0)))
    assert PulseLaw.of(less, direction=-1).coulomb_friction > 0.0
