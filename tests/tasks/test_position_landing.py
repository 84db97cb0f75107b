"""Landings from a scenario: of a rigid axis, and of an arm whose masses and spring are learned."""

import json
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
from scenario_runs import ARM, AXIS, Run, positioned

from stickslip.records import Ending, Positioning

TASK = "targets = [0.3, 0.1]\ntolerance = 1e-5\nduration = 4.0\nsampling_time = 0.01"
GUESS = "mass = 150.0\ncoulomb_friction = 50.0\nviscous_friction = 350.0"
ARM_TASK = "target = 1.0\ntolerance = 1e-5\nduration = 44.0\nsampling_time = 0.02"
WRONG = "mass = 1.02\nload_mass = 0.99\nstiffness = 1.01\ncoulomb_friction = 0.1"

LEARNED = 1e-4  # of friction along a way with stops in the middle of samples; 1e-5 is seen
OF_AN_ARM = 1e-4  # of masses and spring after a landing within 1e-5 of the way


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("landings")
    return partial(positioned, folder, axis=AXIS, task=TASK, guess=GUESS, limit=400.0)


@pytest.fixture(scope="module")
def landed(run: Run) -> Positioning:
    return run("landing")


def test_rigid_axis_lands(landed: Positioning) -> None:
    assert landed.method == "landing"
    assert landed.ending is Ending.REACHED
    (each,) = landed.runs
    assert each.arm is None
    assert [phase.name for phase in each.phases] == ["feedback", "pulses", "done"] * 2
    for before, after in pairwise(each.phases):
        assert after.start_time == before.end_time
    assert each.phases[-1].end_time == each.time[-1]
    # Feedback goes the way; no pulse is left more than a hundredth of it
    assert each.pulses
    for move in each.moves:
        for pulse in move.pulses:
            assert move.start_time <= pulse.time < move.end_time
            assert abs(pulse.predicted_displacement) < 0.01


def test_estimates_and_their_deviations(landed: Positioning) -> None:
    (each,) = landed.runs
    for name in ("coulomb_friction", "viscous_friction"):
        assert each.estimates[name][0] == pytest.approx(0.5 * landed.truth[name])
        assert each.estimates[name][-1] == pytest.approx(landed.truth[name], rel=LEARNED)
        assert each.deviations[name].shape == each.estimate_time.shape
    assert set(landed.truth) >= set(each.estimates) - {"mass"}
    assert set(landed.limits) == {"static_friction_positive", "static_friction_negative"}
    document = landed.to_dict()
    assert json.dumps(document["runs"][0]["phases"])
    assert document["runs"][0]["phases"][1]["name"] == "pulses"


def test_landing_and_exact_pulses_resume_from_each_other(landed: Positioning, run: Run) -> None:
    assert landed.learned.method == "exact"
    again = run("landing", guess="", learned=landed)
    assert again.ending is Ending.REACHED
    assert again.first_guess_sources["mass"] == "learned learned.json"
    first = again.runs[0].estimates
    assert first["coulomb_friction_positive"][0] == pytest.approx(
        landed.learned.values["coulomb_friction_positive"]
    )
    exact = run("exact", guess="", learned=landed)
    assert exact.ending is Ending.REACHED
    back = run("landing", guess="", learned=exact)
    assert back.ending is Ending.REACHED


def test_next_run_resumes(run: Run) -> None:
    first, second = run("landing", task=f"{TASK}\nruns = 2").runs
    for name in ("coulomb_friction_positive", "mass"):
        assert second.estimates[name][0] == pytest.approx(first.estimates[name][-1])
    assert second.moves[-1].ending is Ending.REACHED


def test_note_without_a_guess_of_friction(run: Run) -> None:
    result = run("landing", guess="mass = 150.0")
    assert result.ending is Ending.REACHED
    assert any("No friction is guessed" in note for note in result.notes)


def test_landing_with_gravity_and_an_encoder(run: Run) -> None:
    axis = AXIS.replace("coulomb_friction = 100.0", "coulomb_friction = 100.0\noffset = 20.0")
    result = run(
        "landing",
        settings="rest_samples = 12\nlongest_width = 0.1\nposition_gain = 2e4\nvelocity_gain = 3e3",
        axis=axis,
        sensors="encoder_step = 1e-6\nposition_noise = 1e-6\nvelocity_noise = 1e-4",
    )
    assert result.ending is Ending.REACHED
    assert any("12 positions in a row" in note for note in result.notes)


def test_too_short_a_task_ends_under_way(run: Run) -> None:
    result = run(
        "landing", task="target = 0.3\ntolerance = 1e-5\nduration = 0.1\nsampling_time = 0.01"
    )
    assert result.ending is Ending.UNDER_WAY


def test_rotary_axis(run: Run) -> None:
    kind = 'kind = "rotary"\n'
    result = run(
        "landing",
        axis=kind + AXIS.replace("mass", "inertia"),
        guess=GUESS.replace("mass", "inertia"),
    )
    assert result.ending is Ending.REACHED
    assert result.scenario["guess"]["inertia"] == (150.0, "kg m^2")


@pytest.fixture(scope="module")
def wrong_guess(run: Run) -> Positioning:
    """An arm whose masses and spring are guessed, and not as they are."""
    return run(axis=ARM, task=ARM_TASK, guess=WRONG, limit=1.0)


def test_guessed_masses_and_spring_are_learned(wrong_guess: Positioning) -> None:
    assert wrong_guess.ending is Ending.REACHED
    (each,) = wrong_guess.runs
    assert any("off by 2% or so" in note for note in wrong_guess.notes)
    for name, guessed in (("mass", 1.02), ("load_mass", 0.99), ("stiffness", 1.01)):
        assert each.estimates[name][0] == pytest.approx(guessed)
        assert each.deviations[name][0] == pytest.approx(0.02 * guessed)
        assert each.estimates[name][-1] == pytest.approx(1.0, rel=OF_AN_ARM)
        assert each.deviations[name][-1] < OF_AN_ARM
    assert wrong_guess.learned.covariance.shape == (5, 5)


def test_run_resumes_with_learned_masses_and_spring(wrong_guess: Positioning, run: Run) -> None:
    result = run(axis=ARM, task=ARM_TASK, guess="", limit=1.0, learned=wrong_guess)
    assert result.ending is Ending.REACHED
    assert result.first_guess_sources["stiffness"] == "learned learned.json"
    assert wrong_guess.learned is not None
    for name in ("mass", "load_mass", "stiffness", "coulomb_friction"):
        first = float(result.runs[0].estimates[name][0])
        assert first == pytest.approx(wrong_guess.learned.values[name])
    arm, before = result.runs[0].arm, wrong_guess.runs[0].arm
    assert len(arm.series) < len(before.series)


def test_certain_masses_are_not_learned(run: Run) -> None:
    task = ARM_TASK.replace("44.0", "1.0")
    result = run(axis=ARM, task=task, guess=f"{WRONG}\narm_uncertainty = 0.0", limit=1.0)
    assert set(result.runs[0].estimates) == {"coulomb_friction", "viscous_friction"}
    given = run(axis=ARM, task=task, guess="arm_uncertainty = 0.05", limit=1.0)
    assert given.runs[0].deviations["stiffness"][0] == pytest.approx(0.05)
    assert not any("off by 2% or so" in note for note in given.notes)
    assert given.runs[0].estimates["mass"][0] == 1.0


def test_file_of_friction_alone(run: Run) -> None:
    task = ARM_TASK.replace("44.0", "10.0")
    friction = run(axis=ARM, task=task, guess="coulomb_friction = 0.1", limit=1.0)
    assert friction.learned.covariance.shape == (2, 2)
    guess = "stiffness = 1.01\narm_uncertainty = 0.01"
    result = run(
        axis=ARM, task=task.replace("10.0", "1.0"), guess=guess, limit=1.0, learned=friction
    )
    first = result.runs[0].estimates
    assert first["stiffness"][0] == 1.01
    np.testing.assert_allclose(
        first["coulomb_friction"][0], friction.learned.values["coulomb_friction"]
    )
