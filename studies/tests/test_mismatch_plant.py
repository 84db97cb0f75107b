"""The plant of the mismatch study against closed forms, and its recordings."""

from dataclasses import replace

import numpy as np
import pytest
from estimates import doubtful_estimate
from jaxtyping import Float

from stickslip.records import Identification, ParameterEstimate, Status
from studies.mismatch.cases import CASES, Recorded, record
from studies.mismatch.judgement import judge
from studies.mismatch.plant import FINE_STEP, Controller, Inputs, Plant, Run, run_plant

SECOND_ORDER = 1e-6
"""Relative error of smooth motion: (h / time constant)^2 with a margin, h = 20 µs."""

ONE_STEP = 2 * FINE_STEP
"""Error of an instant at which the direction or the contact changes [s]."""

BALANCE = 2e-3
"""Error of an energy balance from samples of 1 ms, of the energy put in [-]."""


def open_loop(plant: Plant, effort: Float[np.ndarray, " n"], **initial: float) -> Run:
    """Return the run under an effort per fine step."""
    none = np.zeros_like(effort)
    return run_plant(
        plant,
        Controller(),
        Inputs(
            reference_position=np.full_like(effort, initial.pop("position", 0.0)),
            reference_velocity=none,
            feedforward=effort,
            integrate=none,
            disturbance=none,
            fine_steps=np.ones(effort.size, dtype=int),
        ),
        initial_velocity=initial.pop("velocity", 0.0),
    )


@pytest.mark.slow
def test_coulomb_and_viscous_friction_stop_a_body_where_the_closed_form_does() -> None:
    m, fc, c, v0 = 2.0, 3.0, 5.0, 0.8
    plant = Plant(
        mass=m, coulomb_positive=fc, coulomb_negative=9.0, viscous_positive=c, viscous_negative=c
    )
    run = open_loop(plant, np.zeros(20_000), velocity=v0)
    stop = m / c * np.log1p(c * v0 / fc)
    expected = (v0 + fc / c) * np.exp(-c / m * run.time) - fc / c
    sliding = run.time < stop - ONE_STEP
    np.testing.assert_allclose(run.velocity[sliding], expected[sliding], atol=SECOND_ORDER * v0)
    assert abs(run.time[run.velocity == 0.0][0] - stop) < ONE_STEP
    distance = m / c * (v0 - fc / c * np.log1p(c * v0 / fc))
    assert run.position[-1] == pytest.approx(distance, rel=SECOND_ORDER)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_each_direction_has_its_own_friction_and_its_own_breakaway(side: float) -> None:
    plant = Plant(mass=2.0, coulomb_positive=3.0, coulomb_negative=4.0, offset=0.5)
    holding = 3.5 if side > 0 else -3.5
    assert np.all(open_loop(plant, np.full(5000, holding)).position == 0.0)
    run = open_loop(plant, np.full(5000, holding + side * 0.2))
    np.testing.assert_allclose(run.velocity, side * 0.1 * run.time, rtol=0, atol=1e-12)


def test_a_body_on_a_spring_swings_between_the_heights_that_coulomb_friction_leaves() -> None:
    m, k, fc, x0 = 1.5, 600.0, 2.0, 0.05
    plant = Plant(mass=m, coulomb_positive=fc, coulomb_negative=fc, spring=k)
    half = np.pi * np.sqrt(m / k)
    run = open_loop(plant, np.zeros(round(8 * half / FINE_STEP)), position=x0)
    for swing in range(1, 7):
        expected = (-1) ** swing * (x0 - 2 * swing * fc / k)
        assert np.interp(swing * half, run.time, run.position) == pytest.approx(
            expected, abs=1e-5 * x0
        )
    # 7 half swings leave 3.3 mm, and friction holds that against the spring (fc / k = 3.3 mm).
    assert abs(run.position[-1]) <= fc / k
    assert run.velocity[-1] == 0.0


def test_two_masses_swing_at_their_frequency_and_keep_their_energy() -> None:
    m1, m2, k, force = 2.0, 1.0, 4e4, 10.0
    plant = Plant(mass=m1, load_mass=m2, coupling_stiffness=k)
    run = open_loop(plant, np.full(50_000, force))
    w = np.sqrt(k * (1 / m1 + 1 / m2))
    stretch = run.position - run.load_position
    expected = force / m1 / w**2 * (1 - np.cos(w * run.time))
    # Leapfrog shifts the frequency by (w h)^2 / 24, which adds up over some 40 periods.
    phase = (w * FINE_STEP) ** 2 / 24 * w * run.time[-1]
    np.testing.assert_allclose(stretch, expected, atol=2 * phase * force / m1 / w**2)
    energy = 0.5 * (m1 * run.velocity**2 + m2 * run.load_velocity**2 + k * stretch**2)
    work = force * run.position
    np.testing.assert_allclose(energy, work, atol=1e-5 * work[-1])


def test_backlash_lets_the_motor_move_alone() -> None:
    plant = Plant(mass=1.0, load_mass=1.0, coupling_stiffness=1e5, backlash=0.01)
    run = open_loop(plant, np.full(6000, 1.0))
    free = run.position < 0.005
    assert np.all(run.load_position[free] == 0.0)
    np.testing.assert_allclose(run.position[free], 0.5 * run.time[free] ** 2, atol=1e-9)
    assert run.load_position[-1] > 0.0


def test_bristles_yield_by_the_deflection_of_the_lugre_law_and_slide_at_coulomb_friction() -> None:
    fc, size, c = 4.0, 20e-6, 30.0
    plant = Plant(
        mass=1.0,
        coulomb_positive=fc,
        coulomb_negative=fc,
        viscous_positive=c,
        viscous_negative=c,
        presliding=size,
        presliding_damping=3.0,
    )
    # dz/dx = 1 - z / size in motion of one direction, and at rest F = sigma_0 z. The damping is
    # above critical where a fifth of the stiffness is left, so that the body does not turn back.
    ramp = np.minimum(np.linspace(0.0, 1.2 * fc, 100_000), 0.8 * fc)
    assert open_loop(plant, ramp).position[-1] == pytest.approx(-size * np.log(0.2), rel=1e-5)
    sliding = open_loop(plant, np.full(50_000, 2.0 * fc))
    assert sliding.velocity[-1] == pytest.approx(fc / c, rel=SECOND_ORDER)


def test_breakaway_grows_with_the_time_at_rest() -> None:
    fc, ratio, half = 2.0, 1.6, 0.2
    plant = Plant(
        mass=1.0,
        coulomb_positive=fc,
        coulomb_negative=fc,
        stribeck_velocity=0.001,
        dwell_ratio=ratio,
        dwell_time=half,
    )
    for rest in (0.1, 0.5):
        ramp = np.clip((np.arange(50_000) * FINE_STEP - rest) * 20.0, 0.0, None)
        run = open_loop(plant, ramp)
        k = int(np.flatnonzero(run.velocity)[0])
        grown = run.time[k] / (run.time[k] + half)
        assert ramp[k] == pytest.approx(fc * (1 + (ratio - 1) * grown), rel=1e-3)


def test_an_effort_acts_after_its_delay_and_within_the_limit() -> None:
    plant = Plant(mass=2.0, actuation_delay=0.013, limit=4.0)
    run = open_loop(plant, np.full(5000, 10.0))
    acting = np.clip(run.time - 0.013, 0.0, None)
    np.testing.assert_allclose(run.position, acting**2, atol=1e-12)
    assert np.all(run.effort == 4.0)
    assert np.all(run.command == 10.0)


def test_drifts_are_linear_and_leave_the_mean() -> None:
    plant = Plant(mass=1.0, gain_drift=-0.1)
    run = open_loop(plant, np.ones(50_000))
    share = run.time / 1.0
    np.testing.assert_allclose(run.velocity, run.time * (1.05 - 0.05 * share), atol=2 * FINE_STEP)


@pytest.mark.parametrize(
    "name", ["ideal", "stribeck", "asymmetry", "quadratic", "two_thirds", "sine", "constant_load"]
)
@pytest.mark.parametrize("seed", [0, 1])
def test_work_of_the_effort_is_kinetic_energy_and_work_of_the_true_curve(
    name: str, seed: int
) -> None:
    recorded = record(name, seed)
    run, mass = recorded.run, recorded.setup.mass
    work = np.sum(run.effort[:-1] * np.diff(run.position))
    put_in = np.sum(np.abs(run.effort[:-1] * np.diff(run.position)))
    moving = run.velocity != 0.0
    power = np.zeros_like(run.velocity)
    power[moving] = recorded.curve(run.velocity[moving]) * run.velocity[moving]
    lost = np.trapezoid(power, run.time)
    kinetic = 0.5 * mass * (run.velocity[-1] ** 2 - run.velocity[0] ** 2)
    assert work == pytest.approx(kinetic + lost, abs=BALANCE * put_in)


@pytest.mark.parametrize("name", CASES)
def test_case_and_seed_determine_a_recording(name: str) -> None:
    first, again, other = record(name, 1), record(name, 1), record(name, 3)
    np.testing.assert_array_equal(first.log.effort, again.log.effort)
    np.testing.assert_array_equal(first.log.measured_position, again.log.measured_position)
    assert first.truth != other.truth
    assert first.scales.keys() == first.truth.keys()
    assert all(value > 0.0 for value in first.scales.values())
    low, high = first.speed_range
    assert 0.0 < low < high or name == "single_speed"
    assert np.all(np.abs(first.velocities) >= low * (1 - 1e-12))
    assert np.all(np.abs(first.velocities) <= high * (1 + 1e-12))
    assert np.all(np.isfinite(first.curve(first.velocities)))


def identification(recorded: Recorded, names: tuple[str, ...], factor: float) -> Identification:
    """Return an estimate of these parameters, all wrong by a factor, with errors of 1 %."""
    truth = recorded.truth
    deviations = {name: 0.01 * abs(truth[name]) for name in names}
    parameters = {
        name: ParameterEstimate(
            name=name,
            value=factor * truth[name],
            std=deviations[name],
            ci95=(
                factor * truth[name] - 2 * deviations[name],
                factor * truth[name] + 2 * deviations[name],
            ),
            unit="",
        )
        for name in names
    }
    estimate = replace(
        doubtful_estimate(),
        kind=recorded.log.kind,
        parameters=parameters,
        covariance=np.diag([deviations[name] ** 2 for name in names]),
        status=Status.OK,
    )
    return Identification(log=recorded.log, estimate=estimate)


@pytest.mark.parametrize(
    ("case", "names"),
    [
        ("ideal", "viscous_friction coulomb_friction offset"),
        (
            "asymmetry",
            "viscous_friction_positive viscous_friction_negative coulomb_friction_positive "
            "coulomb_friction_negative",
        ),
        (
            "stribeck",
            "viscous_friction coulomb_friction static_friction stribeck_velocity offset",
        ),
    ],
)
def test_an_estimate_is_judged_by_its_intervals_and_its_errors(case: str, names: str) -> None:
    recorded, given = record(case, 0), tuple(names.split())
    right = judge(identification(recorded, given, 1.0), recorded)
    assert not right["outside"]
    assert right["curve"]["coverage"] == 1.0
    assert right["curve"]["error"] < 1e-9
    outside = judge(identification(recorded, given, 1.04), recorded)
    assert outside["outside"]
    assert not outside["critical"]
    critical = judge(identification(recorded, given, 1.06), recorded)
    assert critical["critical"]
    assert critical["curve"]["critical"]
    assert critical["curve"]["coverage"] < 1.0


REGRESSION = 1e-4
"""Relative error of a regression on true signals: of the second order in 1 ms, where friction is
smooth."""


@pytest.mark.parametrize("seed", [1, 3])
@pytest.mark.parametrize(
    ("case", "terms"),
    [
        ("ideal", ()),
        ("presliding", ()),
        ("steps", ()),
        ("short_1s", ()),
        ("asymmetry", ("viscous_asymmetry",)),
        ("spring", ("spring_stiffness",)),
        ("pendulum", ("gravity_sine", "gravity_cosine")),
        ("quadratic", ("quadratic_friction",)),
        ("two_thirds", ("two_thirds_friction",)),
        ("friction_drift", ("friction_drift",)),
        ("gain_drift", ("gain_drift",)),
    ],
)
def test_a_regression_on_the_true_signals_returns_the_true_parameters(
    case: str, terms: tuple[str, ...], seed: int
) -> None:
    recorded = record(case, seed)
    run, setup = recorded.run, recorded.setup
    v = 0.5 * (run.velocity[1:] + run.velocity[:-1])
    x = 0.5 * (run.position[1:] + run.position[:-1])
    time = 0.5 * (run.time[1:] + run.time[:-1]) - 0.5 * setup.duration
    u, sign = run.effort[:-1], np.sign(v)
    columns = {
        "mass" if setup.kind == "linear" else "inertia": np.diff(run.velocity) / np.diff(run.time),
        "viscous_friction": v,
        "coulomb_friction": sign,
        "offset": np.ones_like(v),
    }
    candidates = {
        "viscous_asymmetry": np.abs(v),
        "spring_stiffness": x,
        "gravity_sine": np.sin(x),
        "gravity_cosine": np.cos(x),
        "quadratic_friction": v * np.abs(v),
        "two_thirds_friction": sign * np.abs(v) ** (2 / 3),
        "friction_drift": time
        * (recorded.truth["coulomb_friction"] * sign + recorded.truth["viscous_friction"] * v),
        "gain_drift": -u * time,
    }
    columns |= {name: candidates[name] for name in terms}
    slow = 0.3 * min(setup.speeds) * setup.top_speed
    moving = np.minimum(np.abs(run.velocity[1:]), np.abs(run.velocity[:-1])) > slow
    matrix = np.column_stack(list(columns.values()))[moving]
    size = np.linalg.norm(matrix, axis=0)
    found = np.linalg.lstsq(matrix / size, u[moving])[0] / size
    for name, value in zip(columns, found, strict=True):
        assert value == pytest.approx(
            recorded.truth[name], abs=REGRESSION * recorded.scales[name]
        ), name
