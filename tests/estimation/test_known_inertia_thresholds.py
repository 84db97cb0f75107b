"""Both sides of the thresholds of the energy estimator with a known inertia, on known forces."""

import math
import re
from collections.abc import Callable
from dataclasses import replace
from typing import ParamSpec, TypeVar

import numpy as np
import pytest
from simulated_logs import disturbed

from stickslip.estimation import EnergyEstimator
from stickslip.estimation.energy.known_inertia import balance
from stickslip.estimation.energy.known_inertia.balance import sought_regression
from stickslip.estimation.energy.known_inertia.free_friction import HeldAxis, likeliest_rate
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.fit.rows import MotionSummary, Regression, least_squares
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors

P = ParamSpec("P")
R = TypeVar("R")

T, SAMPLES = 0.002, 1_500
MASS, VISCOUS, COULOMB = 1.5, 3.0, 2.0
TIME = T * np.arange(SAMPLES)
EFFORT = 4.0 * np.sin(np.pi * TIME + 1.0) + 3.0 * np.sin(2.6 * np.pi * TIME + 2.0)
RMS = float(np.sqrt(np.mean(EFFORT**2)))
CLEAN = 1e-6  # relative, without noise and disturbance; 3e-8 is seen
GRID = 9  # places at which a search looks first
GOLDEN = 0.5 * (1.0 + math.sqrt(5.0))


def log_of(disturbance: float) -> AxisLog:
    """Return positions under a white force, held over each sample, that is not logged [N]."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
    generator = np.random.default_rng(0)
    force = disturbance * generator.normal(size=SAMPLES)
    sensors = Sensors(velocity="none", position_noise=1e-6) if disturbance else Sensors()
    plant = SingleMass(mass=MASS, friction=law)
    return disturbed(plant, EFFORT, force, sensors, generator, sampling_time=T)


def levels_of(mass: float) -> Regression:
    """Return rows whose least squares is a given mass."""
    return Regression(
        kind="linear",
        names=("mass", "viscous_friction", "coulomb_friction"),
        time=np.zeros(3),
        target=np.array([mass, 0.0, 0.0]),
        regressors=np.eye(3),
        regressor_noise=np.zeros(3),
        quantity="energy",
        motion=MotionSummary(
            largest_speed=1.0,
            speed_noise=0.0,
            position_range=1.0,
            position_noise=0.0,
            forward_travel=1.0,
            backward_travel=1.0,
            speed_variation=1.0,
        ),
        samples=SAMPLES,
    )


def sought(levels: Regression, log: AxisLog) -> Regression:
    model = AxisModel(inertia=None)
    low_pass = LowPass.of(T)
    return sought_regression(levels, [log], model, low_pass, notes=())


def counted(function: Callable[P, R], calls: list[None]) -> Callable[P, R]:
    def inner(*args: P.args, **kwargs: P.kwargs) -> R:
        calls.append(None)
        return function(*args, **kwargs)

    return inner


def places(width: float, tolerance: float) -> int:
    """Return at how many places a grid and a golden-section search after it look."""
    return GRID + math.ceil(math.log(width / tolerance, GOLDEN))


@pytest.mark.parametrize("disturbance", [0.02, 0.03, 0.05, 0.1, 0.2, 0.4, 0.7])
def test_a_disturbance_is_searched_to_a_fifth_of_a_decade(
    disturbance: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of its variance; a smooth cost leaves half of that, and no more places are looked at."""
    calls: list[None] = []
    monkeypatch.setattr(HeldAxis, "whiten", counted(HeldAxis.whiten, calls))
    estimate = EnergyEstimator(inertia=MASS, offset=False).fit(log_of(disturbance))
    noted = re.search(r"taken to have (\S+) N rms", estimate.diagnostics.notes[0])
    assert noted is not None
    assert 2.0 * abs(math.log10(float(noted[1]) / disturbance)) < 0.1
    assert len(calls) <= places(4.0, 0.2) + 2  # one of them for the rows


@pytest.mark.parametrize("decades", np.linspace(-13.4, 1.3, 8))
def test_a_disturbance_of_any_size_is_searched_to_a_fifth_of_a_decade(
    decades: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A cost that is no parabola leaves a quarter of that, and no more places are looked at."""
    calls: list[None] = []

    def whitened(_self: object, place: float, _beside: object) -> tuple[np.ndarray, float]:
        calls.append(None)
        return np.array([[abs(place - decades) ** 0.75]]), 0.0

    monkeypatch.setattr(balance._Balance, "_whitened", whitened)
    work = balance._Balance.of([log_of(0.0)], AxisModel(inertia=MASS), LowPass.of(T))
    assert abs(work.likeliest() - decades) < 0.05
    assert len(calls) <= places(4.0, 0.2)


@pytest.mark.parametrize("decades", np.linspace(-5.3, 3.1, 8))
def test_a_rate_is_searched_to_a_tenth_of_a_decade(decades: float) -> None:
    """A smooth cost leaves a quarter of that, and no more places are looked at than needed."""
    calls: list[None] = []
    cost = counted(lambda rate: abs(math.log10(rate) - decades) ** 1.5, calls)
    assert abs(math.log10(likeliest_rate(1.0, cost)) - decades) < 0.025
    assert len(calls) <= places(3.0, 0.1)


@pytest.mark.parametrize(("share", "to_levels"), [(0.22, False), (0.28, True)])
def test_levels_are_used_from_a_quarter_of_the_effort_on(share: float, to_levels: bool) -> None:
    levels = levels_of(MASS)
    assert (sought(levels, log_of(share * RMS)) is levels) == to_levels


@pytest.mark.parametrize(
    ("error", "passes"), [(-1.2e-4, 2), (-0.8e-4, 1), (0.0, 1), (0.8e-4, 1), (1.2e-4, 2)]
)
def test_a_mass_stays_below_a_change_of_1e_4(
    error: float, passes: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[None] = []
    monkeypatch.setattr(balance, "prepared", counted(balance.prepared, calls))
    sought(levels_of(MASS * (1.0 + error)), log_of(0.0))
    assert len(calls) == passes


@pytest.mark.parametrize("guess", [0.2, 0.9, 1.1, 5.0])
def test_a_mass_is_found_from_either_side(guess: float) -> None:
    rows = sought(levels_of(guess * MASS), log_of(0.0))
    found = least_squares(rows.regressors, rows.target)
    np.testing.assert_allclose(found, [MASS, VISCOUS, COULOMB], rtol=CLEAN)


def test_an_effort_that_acts_backwards_has_no_mass() -> None:
    """It makes m_0 over the mass -1."""
    log = log_of(0.0)
    levels = levels_of(MASS)
    turned = replace(log, effort=-log.effort)
    assert sought(levels, turned) is levels
    assert sought(levels, log) is not levels
