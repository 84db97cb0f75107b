"""Axes whose effects stand for each other, on a simulator of fine steps under a controller."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from axis_logs import axis_log
from jaxtyping import Float
from numba import njit

from stickslip import compare_log
from stickslip.estimation import JointEstimator, predict_effort
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.selection.intervals.rival_law import rival_laws
from stickslip.records import AxisLog, FrictionEstimate, Status

MASS, COULOMB, VISCOUS, OFFSET = 2.0, 3.0, 10.0, 0.2
TOP_SPEED = 0.4
T, STEPS = 1e-3, 50
EFFORT_NOISE, ENCODER_STEP = 0.03, 5e-8


@dataclass(frozen=True, kw_only=True)
class Plant:
    """Motor with friction, behind it a load with the encoder, or one rigid mass."""

    viscous: float = VISCOUS
    quadratic: float = 0.0
    two_thirds: float = 0.0
    power: float = 2.0 / 3.0  # of the speed, in place of 2/3
    static: float = COULOMB
    stribeck_velocity: float = 1.0
    slope: float = 0.0  # of Coulomb friction over the position, over its value at 0.15 m [1/m]
    bristle_stiffness: float = 0.0  # [N/m]; 0 for sliding that begins at once
    ripple: float = 0.0
    ripple_period: float = 1.0
    gear_stiffness: float = 0.0  # [N/m]; 0 for a rigid mass
    load_share: float = 0.5


@njit
def _recorded(
    reference: Float[np.ndarray, " n"],
    gains: tuple[float, float],
    law: tuple[float, ...],
    gear: tuple[float, float],
    bristle: float,
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Semi-implicit Euler steps of 20 us under a PD controller; friction can hold the motor."""
    viscous, quadratic, two_thirds, power, static, knee, ripple, period, slope = law
    stiffness, share = gear
    motor, load = MASS * (1.0 - share), MASS * share
    dt = T / STEPS
    x = v = y = w = z = 0.0
    position, effort = np.zeros(reference.size), np.zeros(reference.size)
    before = 0.0
    for k in range(reference.size):
        place = np.round((y if stiffness > 0 else x) / ENCODER_STEP) * ENCODER_STEP
        change = reference[k] - reference[k - 1] if k else 0.0
        error_rate = (change - (place - before)) / T
        before = place
        force = gains[0] * (reference[k] - place) + gains[1] * error_rate
        position[k], effort[k] = place, force
        for _ in range(STEPS):
            speed = abs(v)
            level = COULOMB + (static - COULOMB) * np.exp(-((v / knee) ** 2))
            level *= 1.0 + slope * (x - 0.15)
            smooth = viscous * v + quadratic * v * speed
            smooth += np.sign(v) * two_thirds * speed**power
            outer = OFFSET + ripple * np.sin(2.0 * np.pi * x / period)
            if stiffness > 0.0:
                pull = stiffness * (x - y) + 0.05 * np.sqrt(stiffness * MASS) * (v - w)
                w += dt * (pull - outer) / load
                y += dt * w
                outer, mass = pull, motor
            else:
                mass = MASS
            if bristle > 0.0:
                after = (z + dt * v) / (1.0 + dt * bristle * speed / level)
                damping = 0.6 * np.sqrt(bristle * MASS) * (after - z) / dt
                z = after
                v += dt * (force - smooth - outer - bristle * z - damping) / mass
            else:
                free = v + dt * (force - smooth - outer) / mass
                most = dt * level / mass
                v = 0.0 if abs(free) <= most else free - np.sign(free) * most
            x += dt * v
    return position, effort


def log_of(
    plant: Plant, *, seed: int = 0, moves: int = 14, travel: float = 0.3, early: int = 0
) -> AxisLog:
    """Return moves to and fro at four speeds, logged with white noise of the effort.

    The effort is logged by some samples too early.
    """
    rng = np.random.default_rng(seed)
    pieces = [np.zeros(200)]
    for k in range(moves):
        speed = TOP_SPEED * (1.0, 0.5, 0.25, 0.12)[k // 2 % 4] * rng.uniform(0.9, 1.1)
        ramp = 0.5 - 0.5 * np.cos(np.pi * np.arange(120) / 120)
        flat = np.ones(max(int(min(travel / speed, 1.5) / T) - 120, 0))
        shape = (-1) ** k * np.concatenate([ramp, flat, ramp[::-1]])
        pieces += [shape * min(speed, travel / (T * np.sum(np.abs(shape)))), np.zeros(150)]
    reference = T * np.cumsum(np.concatenate(pieces))
    resonance = np.sqrt(4.0 * plant.gear_stiffness / MASS)  # of two equal masses
    omega = min(40.0, 0.08 * resonance) if resonance else 40.0
    law = (plant.viscous, plant.quadratic, plant.two_thirds, plant.power, plant.static)
    bend = (plant.stribeck_velocity, plant.ripple, plant.ripple_period, plant.slope)
    position, effort = _recorded(
        reference,
        (MASS * omega**2, 1.6 * MASS * omega),
        (*law, *bend),
        (plant.gear_stiffness, plant.load_share if plant.gear_stiffness else 0.0),
        plant.bristle_stiffness,
    )
    effort = np.roll(effort, -early) + EFFORT_NOISE * rng.standard_normal(effort.size)
    return axis_log(T * np.arange(effort.size), effort, position, name=f"axis {seed}")


def missed(found: FrictionEstimate, truth: dict[str, float]) -> list[str]:
    """Return the parameters whose interval does not contain the truth."""
    wrong: list[str] = []
    for name, value in truth.items():
        interval = found.parameters[name].ci95
        assert interval is not None, name
        if not interval[0] <= value <= interval[1]:
            wrong.append(name)
    return wrong


BASE = {"mass": MASS, "coulomb_friction": COULOMB, "viscous_friction": VISCOUS}


@pytest.mark.parametrize("frequency", [20.0, 30.0])
def test_elastic_gear_before_the_encoder_is_found(frequency: float) -> None:
    stiffness = (2.0 * np.pi * frequency) ** 2 * MASS * 0.25  # of two equal masses
    log = log_of(Plant(gear_stiffness=stiffness))
    found = SelectedModelEstimator().fit(log)
    assert found.status is Status.OK
    assert found.selection is not None
    assert "elastic" in found.selection.selected
    elasticity = MASS / (2.0 * np.pi * frequency) ** 2
    assert not missed(found, BASE | {"elasticity": elasticity})
    assert found.value("mass") == pytest.approx(MASS, rel=0.02)
    predicted = predict_effort(found, log)
    known = np.isfinite(predicted)
    error = np.sqrt(np.mean((predicted - log.effort)[known] ** 2))
    assert error < 0.05 * np.sqrt(np.mean(log.effort[known] ** 2))


def test_rigid_axis_is_not_elastic() -> None:
    for seed in range(4):
        found = SelectedModelEstimator().fit(log_of(Plant(), seed=seed))
        assert found.selection is not None
        assert found.status is Status.OK
        assert not found.selection.selected


def test_ripple_shorter_than_a_window_of_most_moves_is_found() -> None:
    period = 4e-3  # a window of 20 ms at the median speed of 0.2 m/s
    found = SelectedModelEstimator().fit(log_of(Plant(ripple=1.0, ripple_period=period)))
    assert found.status is Status.OK
    assert found.selection is not None
    assert "ripple" in found.selection.selected
    assert "delay" not in found.selection.selected
    assert not missed(found, BASE | {"ripple_period": period})


@pytest.mark.parametrize("share", [0.3, 1.0])
def test_motion_within_presliding_is_a_mismatch(share: float) -> None:
    travel = 0.03
    plant = Plant(bristle_stiffness=share * COULOMB / travel)
    found = SelectedModelEstimator().fit(log_of(plant, travel=travel))
    assert found.status is not Status.OK
    if found.status is Status.MODEL_MISMATCH:
        assert "presliding" in found.diagnostics.notes[0]


def test_a_spring_that_is_known_is_no_presliding() -> None:
    plant = Plant(bristle_stiffness=0.3 * COULOMB / 0.03)
    found = SelectedModelEstimator(include=("spring",)).fit(log_of(plant, travel=0.03))
    assert not any("presliding" in note for note in found.diagnostics.notes)


BENT: list[tuple[dict[str, Any], dict[str, float]]] = [
    (
        {"viscous": 0.0, "two_thirds": 4.0, "quadratic": 15.0},
        {"mass": MASS, "coulomb_friction": COULOMB},
    ),
    (
        {"static": 6.0, "stribeck_velocity": 0.08, "quadratic": 30.0},
        {"mass": MASS, "coulomb_friction": COULOMB},
    ),
    (
        {"viscous": 2.5, "two_thirds": 4.0},
        {"mass": MASS, "coulomb_friction": COULOMB},
    ),
    (
        {"static": 7.0, "stribeck_velocity": 0.25},
        BASE | {"stribeck_velocity": 0.25},
    ),
    (
        {"viscous": 0.0, "two_thirds": 4.0, "power": 0.5},
        {"mass": MASS, "coulomb_friction": COULOMB},
    ),
    (
        {"viscous": 0.0, "two_thirds": 4.0, "power": 0.35},
        {"mass": MASS, "coulomb_friction": COULOMB},
    ),
]


@pytest.mark.slow
@pytest.mark.parametrize(("law", "truth"), BENT)
def test_intervals_hold_where_two_bends_are_one(
    law: dict[str, Any], truth: dict[str, float]
) -> None:
    outside = [
        missed(found, {name: value for name, value in truth.items() if name in found.parameters})
        for found in (SelectedModelEstimator().fit(log_of(Plant(**law), seed=s)) for s in range(3))
        if found.status is Status.OK
    ]
    assert len(outside) >= 2
    assert sum(map(len, outside)) <= 1  # of 6 to 12 intervals of 95 %


@pytest.mark.parametrize("slope", [-0.6, 0.6])
def test_viscous_friction_holds_where_friction_varies_along_the_travel(slope: float) -> None:
    """Slow moves stay in a part of the travel: the log does not show what varies."""
    found = SelectedModelEstimator().fit(log_of(Plant(slope=slope), moves=8, travel=0.6))
    assert found.status is Status.OK
    assert abs(found.value("viscous_friction") / VISCOUS - 1.0) > 0.1
    assert missed(found, {"mass": MASS, "viscous_friction": VISCOUS}) == []


def test_a_curve_that_is_bent_more_than_by_the_power_two_thirds_has_no_negative_part() -> None:
    found = SelectedModelEstimator().fit(log_of(Plant(viscous=0.0, two_thirds=4.0, power=0.5)))
    assert found.status is Status.OK
    assert found.selection is not None
    assert found.selection.selected == ("two-thirds",)
    assert "viscous_friction" not in found.parameters
    assert missed(found, {"mass": MASS, "coulomb_friction": COULOMB}) == []


def test_a_law_with_two_more_parameters_needs_almost_three_standard_errors() -> None:
    """Of laws that contain the selected one, whose weight is 1."""
    fit = SelectedModelEstimator().details(log_of(Plant(quadratic=20.0)))
    assert fit.model is not None
    assert fit.model.names == ("quadratic",)
    terms = [term for term, _ in fit.model.chosen]
    larger = [rival for rival in rival_laws(fit.model, terms) if rival.further > 0]
    assert {rival.further for rival in larger} == {2}
    least = 2.0 * np.sqrt(2.0)
    assert all(rival.explains_more == (rival.weight > least * rival.std) for rival in larger)


def test_a_delay_that_is_not_determined_leaves_the_result_ok() -> None:
    """The status follows inertia and friction."""
    rng = np.random.default_rng(3)
    every: list[FrictionEstimate] = []
    for seed in range(3):
        log = log_of(Plant(), seed=seed, moves=6, early=1)
        noisy = log.effort + 0.4 * rng.standard_normal(len(log))
        every.append(SelectedModelEstimator().fit(axis_log(log.time, noisy, log.measured_position)))
    assert all(found.status is Status.OK for found in every)
    assert sum(len(missed(found, BASE)) for found in every) <= 2


def disturbed_effort(log: AxisLog) -> Float[np.ndarray, " n"]:
    """Return an effort that has little to do with the motion."""
    rng = np.random.default_rng(0)
    slow = np.repeat(rng.standard_normal(len(log) // 200 + 1), 200)[: len(log)]
    return log.effort + 0.4 * float(np.std(log.effort)) * slow


def test_a_quarter_of_unexplained_effort_is_a_mismatch_in_a_comparison() -> None:
    log = log_of(Plant())
    disturbed = axis_log(log.time, disturbed_effort(log), log.measured_position)
    (doubted,) = compare_log(disturbed, only=("idim-ls",)).applied
    assert doubted.unexplained_effort is not None
    assert 0.25 < doubted.unexplained_effort < 0.5
    assert doubted.estimate is not None
    assert doubted.estimate.status is Status.MODEL_MISMATCH
    for each in compare_log(log, only=("idim-ls",)).applied:
        assert each.estimate is not None
        assert not any("no term" in note for note in each.estimate.diagnostics.notes)


@pytest.mark.slow
def test_joint_fit_contains_other_laws_of_friction() -> None:
    plant = Plant(viscous=0.0, two_thirds=4.0, quadratic=15.0)
    logs = [log_of(plant, seed=seed) for seed in range(2)]
    found = JointEstimator().fit(logs)
    assert found.status is Status.OK
    assert not missed(found, {"mass": MASS, "coulomb_friction": COULOMB})
