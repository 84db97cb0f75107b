"""The torque constant from a known weight on a lever, on currents of a plant of its own."""

from dataclasses import replace

import numpy as np
import pytest
from refusals import refuses

from stickslip.records import AxisLog
from stickslip.tasks import identify

CONSTANT = 0.85  # N m/A
MASS, RADIUS, ROTOR = 2.5, 0.3, 0.05  # kg, m, kg m^2
COULOMB, VISCOUS = 1.1, 0.6  # N m, N m s/rad
STEP, SAMPLE, DURATION = 2e-4, 2e-3, 20.0  # s


def lever(swing: float, mass: float = MASS, seed: int = 4) -> AxisLog:
    """Simulate the lever under a PD controller, its friction as a torque that stops it."""
    generator = np.random.default_rng(seed)
    inertia, every = ROTOR + mass * RADIUS**2, round(SAMPLE / STEP)
    count = round(DURATION / SAMPLE)
    position, velocity = 0.2, 0.0
    found, current = np.empty(count), np.empty(count)
    for k in range(count):
        t = k * SAMPLE
        target = 0.2 + swing * (np.sin(0.9 * t) + 0.2 * np.sin(3.7 * t))
        speed = swing * (0.9 * np.cos(0.9 * t) + 0.74 * np.cos(3.7 * t))
        found[k] = position
        current[k] = 150.0 * (target - position) + 12.0 * (speed - velocity)
        for _ in range(every):
            driving = CONSTANT * current[k] - mass * 9.80665 * RADIUS * np.sin(position - 0.4)
            driving -= VISCOUS * velocity
            stopping = driving + inertia * velocity / STEP
            friction = min(max(stopping, -COULOMB), COULOMB)
            velocity += STEP * (driving - friction) / inertia
            position += STEP * velocity
    return AxisLog(
        name="lever",
        kind="rotary",
        time=SAMPLE * np.arange(count),
        effort=current + generator.normal(scale=0.02, size=count),
        effort_unit="A",
        measured_position=found + generator.normal(scale=1e-5, size=count),
    )


@pytest.fixture(scope="module")
def log():
    return lever(1.2)


@pytest.mark.slow
def test_friction_in_newton_metres(log):
    estimate = identify(log, known_load=(MASS, RADIUS)).estimate
    assert estimate.status.value == "ok"
    truth = {
        "coulomb_friction": COULOMB,
        "viscous_friction": VISCOUS,
        "inertia": ROTOR + MASS * RADIUS**2,
    }
    for name, value in truth.items():
        low, high = estimate.parameters[name].ci95
        assert low <= value <= high, name
        assert estimate.value(name) == pytest.approx(value, rel=0.03), name
        assert estimate.parameters[name].unit.startswith(("N m", "kg"))
    amplitude = np.hypot(estimate.value("gravity_sine"), estimate.value("gravity_cosine"))
    assert amplitude == pytest.approx(MASS * 9.80665 * RADIUS, rel=1e-6)


@pytest.mark.slow
def test_intervals_hold_the_uncertainty_of_the_constant(log):
    """By the delta method on the plain estimate in ampere, term by term."""
    plain = identify(log, include=("gravity",)).estimate
    estimate = identify(log, known_load=(MASS, RADIUS)).estimate
    names = [name for name, each in plain.parameters.items() if each.identified]
    assert names == [name for name, each in estimate.parameters.items() if each.identified]
    draws = np.random.default_rng(1).multivariate_normal(
        [plain.value(name) for name in names], plain.covariance, size=200_000
    )
    columns = dict(zip(names, draws.T, strict=True))
    amplitude = np.hypot(columns["gravity_sine"], columns["gravity_cosine"])
    for name in ("coulomb_friction", "viscous_friction"):
        spread = np.std(columns[name] * MASS * 9.80665 * RADIUS / amplitude)
        assert estimate.parameters[name].std == pytest.approx(spread, rel=0.02), name


@pytest.mark.slow
def test_a_load_that_is_heavier_than_stated_shows(log):
    estimate = identify(log, known_load=(MASS, 1.6 * RADIUS)).estimate
    assert estimate.status.value == "model_mismatch"
    assert "known load" in estimate.diagnostics.notes[0]


@pytest.mark.slow
def test_a_swing_that_does_not_determine_gravity():
    with pytest.raises(ValueError, match="known load"):
        identify(lever(0.05), known_load=(MASS, RADIUS))


def test_what_a_known_load_needs(log):
    with refuses("known_load_needs_current"):
        identify(replace(log, effort_unit=""), known_load=(MASS, RADIUS))
    with refuses("not_positive", name="radius"):
        identify(log, known_load=(MASS, 0.0))
    with refuses("known_load_of_several_logs"):
        identify([log, replace(log, name="b", effort=2 * log.effort)], known_load=(1.0, 1.0))
    with refuses("setting_unused", name="include"):
        identify(log, known_load=(1.0, 1.0), estimator="energy")
