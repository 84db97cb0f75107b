"""Estimators side by side: arms, scenarios by direction, disturbances, and files of efforts."""

from pathlib import Path

import numpy as np
import pytest
from refusals import refuses

from stickslip import EstimationTask
from stickslip.estimation import cramer_rao_bound
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.scenario import read_study
from stickslip.scenario.study import read_effort
from stickslip.simulation import Sensors, simulate
from stickslip.tasks import compare_log, compare_scenario, write_effort
from stickslip.tasks.comparison import disturbance, measured_log

EXAMPLES = sorted((Path(__file__).parents[2] / "examples" / "comparisons").glob("*.toml"))

CLOSE = 0.05  # relative, of a short log with little noise
NINE_DIGITS = 1e-8  # relative, of what is written
FIVE_SIGMA = 5.0
ROUNDING = 1e-9  # relative

ASYMMETRIC = """
[axis]
mass = 1.5
coulomb_friction_positive = 2.0
coulomb_friction_negative = 1.6
viscous_friction = 3.0
offset = 0.1
[input]
amplitudes = [4.0, 3.0]
frequencies = [0.5, 1.3]
duration = 4.0
sampling_time = 0.004
[sensors]
position_noise = 1e-5
velocity_noise = 1e-3
"""


def test_an_arm_needs_estimators_with_a_load() -> None:
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.05)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    time = 0.01 * np.arange(4000)
    effort = 0.4 * np.sin(0.9 * time) + 0.3 * np.sin(2.3 * time)
    sensors = Sensors(position_noise=1e-5, velocity_noise=1e-4)
    log = sensors.measure(simulate(arm, effort, sampling_time=0.01), np.random.default_rng(1))
    only = ("energy", "idim-ls", "ekf", "gradient")
    task = EstimationTask(load_inertia=1.0, stiffness=1.0)
    found = compare_log(log, task=task, only=only).compared
    energy, idim, kalman, gradient = found
    assert energy.estimate.value("mass") == pytest.approx(1.0, rel=CLOSE)
    assert energy.unexplained_effort is None
    assert energy.resimulation.fit > 1 - CLOSE
    assert "flexible arm" in idim.why_not
    assert "flexible arm" in kalman.why_not
    assert gradient.assumed_inertia == energy.estimate.value("mass")


def test_directions_apart_have_the_offset_in_them(tmp_path: Path) -> None:
    path = tmp_path / "asymmetric.toml"
    path.write_text(ASYMMETRIC)
    task = EstimationTask(per_direction=True)
    study = compare_scenario(path, runs=3, task=task, only=("energy", "maximum-likelihood"))
    assert study.truth["coulomb_friction_positive"] == pytest.approx(2.1)
    assert study.truth["coulomb_friction_negative"] == pytest.approx(1.5)
    for each in study.applied:
        for name in ("coulomb_friction_positive", "coulomb_friction_negative", "mass"):
            score = each.scores[name]
            assert abs(score.bias) < CLOSE * score.truth, (each.name, name)
    both = compare_scenario(path, runs=2, only=("energy",))
    assert both.truth["coulomb_friction"] == pytest.approx(1.8)
    assert both.truth["offset"] == pytest.approx(0.3)
    assert both.applied[0].scores["offset"].bias == pytest.approx(0.0, abs=CLOSE)


def test_runs_are_the_same_every_time_and_differ_from_each_other(tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(ASYMMETRIC)
    one, again = (compare_scenario(path, runs=3, only=("idim-ls",)) for _ in range(2))
    score = one.applied[0].scores["mass"]
    assert again.applied[0].scores["mass"] == score
    assert score.rmse > abs(score.bias)


def test_there_is_no_bound_under_a_disturbance_force(tmp_path: Path) -> None:
    path = tmp_path / "scenario.toml"
    path.write_text(ASYMMETRIC.replace("[sensors]", "disturbance = 0.1\n[sensors]"))
    calls: list[tuple[int, int]] = []
    study = compare_scenario(
        path,
        runs=3,
        only=("energy",),
        progress=lambda done, every: calls.append((done, every)),
    )
    assert dict(study.bound) == {}
    assert "no Cramér-Rao bound" in study.notes[0]
    assert all(score.bound_ratio is None for score in study.applied[0].scores.values())
    assert calls[-1] == (3, 3)


@pytest.mark.slow
def test_the_delay_of_an_effort_is_found(tmp_path: Path) -> None:
    plain, delayed = tmp_path / "plain.toml", tmp_path / "delayed.toml"
    effort = 4.0 * np.sin(0.02 * np.arange(1000)) + 3.0 * np.sin(0.05 * np.arange(1000))
    write_effort(effort, 0.004, tmp_path / "sent.csv", kind="linear")
    write_effort(np.append([0.0, 0.0], effort[:-2]), 0.004, tmp_path / "acts.csv", kind="linear")
    head, rest = ASYMMETRIC.split("amplitudes")
    tail = rest[rest.index("[sensors]") :]
    plain.write_text(f'{head}file = "acts.csv"\n{tail}')
    delayed.write_text(f'{head}file = "sent.csv"\neffort_delay = 2\n{tail}')
    sent, acts = (read_study(path) for path in (delayed, plain))
    logs = [measured_log(read, np.random.default_rng(1)) for read in (sent, acts)]
    assert np.array_equal(logs[0].measured_position, logs[1].measured_position)
    assert np.allclose(logs[0].effort[:-1], effort, rtol=NINE_DIGITS)
    assert sent.scenario.tables()["input"]["effort_delay"] == (2, "samples")

    task, both = EstimationTask(largest_delay=3), ("energy", "maximum-likelihood")
    study = compare_scenario(delayed, runs=2, task=task, only=both)
    energy, likelihood = study.applied
    assert energy.delay_found is None
    assert likelihood.delay_found == 1.0
    assert likelihood.to_dict()["delay_found"] == 1.0
    for name, score in likelihood.scores.items():
        assert abs(score.bias) < CLOSE * score.truth, name
    # The bound is that of the effort that acts, whose delay is a whole number and found for sure
    assert dict(study.bound) == dict(compare_scenario(plain, runs=2, task=task, only=both).bound)
    task = EstimationTask(largest_delay=1)
    missed = compare_scenario(delayed, runs=2, task=task, only=both).applied[1]
    assert missed.delay_found == 0.0


def test_sines_begin_anywhere_and_each_run_has_its_own_bound(tmp_path: Path) -> None:
    path = tmp_path / "phases.toml"
    path.write_text(ASYMMETRIC.replace("[sensors]", "random_phases = true\n[sensors]"))
    read = read_study(path)
    generators = np.random.default_rng(read.scenario.sensors.seed).spawn(3)
    asked, plant = read.scenario, read.scenario.axis.build()
    efforts = [asked.input.build(tmp_path, each)[0] for each in generators]
    assert np.std([effort[0] for effort in efforts]) > 0.0
    # The power of sines that fill their periods does not depend on where they begin
    squares = [float(np.mean(effort**2)) for effort in efforts]
    assert np.ptp(squares) < 0.5 * np.mean(squares)

    study = compare_scenario(read, runs=3, only=("maximum-likelihood",))
    variances = [
        cramer_rao_bound(
            plant,
            effort,
            sampling_time=asked.input.sampling_time or 0.0,
            sensors=asked.sensors.build(),
            sought=tuple(study.bound),
        ).std["mass"]
        ** 2
        for effort in efforts
    ]
    assert study.bound["mass"] == pytest.approx(np.sqrt(np.mean(variances)), rel=ROUNDING)
    assert np.ptp(variances) > 0.0


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_a_disturbance_is_as_large_and_as_slow_as_requested(correlation: float) -> None:
    force = disturbance(200_000, 0.3, correlation, np.random.default_rng(3))
    # Samples that a correlated mean square is worth, and the standard error of each of the two
    worth = force.size * (1 - correlation**2) / (1 + correlation**2)
    error = FIVE_SIGMA / np.sqrt(worth)
    assert np.std(force) == pytest.approx(0.3, rel=error)
    assert np.corrcoef(force[1:], force[:-1])[0, 1] == pytest.approx(correlation, abs=error)
    assert np.std(force[:100]) > 0.1  # it begins at its full size


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_every_example_can_be_read(path: Path) -> None:
    read = read_study(path)
    effort, step = read.scenario.input.build(path.parent, np.random.default_rng(1))
    assert effort.size * step == pytest.approx(read.scenario.input.duration)
    assert read.scenario.tables()["input"]["frequencies"][1] == "Hz"


def test_an_effort_is_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "effort.csv"
    effort = np.random.default_rng(2).normal(size=300)
    write_effort(effort, 0.002, path, kind="rotary")
    assert path.read_text().startswith("time [s],effort [N m]\n0,")
    back, step = read_effort(path)
    assert step == pytest.approx(0.002)
    assert np.allclose(back, effort, rtol=NINE_DIGITS)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("time,effort\n0,a\n", "efforts_not_numbers"),
        ("time,effort\n0,1\n", "efforts_too_few"),
        ("time,effort\n0,1\n1,nan\n", "efforts_too_few"),
        ("time,effort\n0,1\n1,2\n3,2\n", "efforts_uneven"),
        ("", "efforts_too_few"),
    ],
)
def test_what_is_no_effort_is_refused(text: str, code: str, tmp_path: Path) -> None:
    path = tmp_path / "effort.csv"
    path.write_text(text)
    with refuses(code):
        read_effort(path)
    with refuses("no_such_file"):
        read_effort(tmp_path / "none.csv")
