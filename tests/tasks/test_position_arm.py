"""Positioning of a flexible arm: landing, results, and endings."""

from functools import partial
from itertools import pairwise
from math import hypot

import numpy as np
import pytest
from refusals import refuses
from scenario_runs import ARM, Run, positioned

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import Ending, Positioning, PositioningOutcome
from stickslip.simulation import simulate
from stickslip.tasks.positioning.judging import arm_ending

TASK = "target = 1.0\ntolerance = 1e-5\nduration = 36.0\nsampling_time = 0.02"
LANDING = "landing"
T = 0.02

LEARNED = 1e-5  # what friction is off by after a move without noise, relative; 1e-7 is seen
ROUNDING = 1e-9  # of a motion of 1 m simulated twice, by another division into calls [m]


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    folder = tmp_path_factory.mktemp("arms")
    return partial(positioned, folder, axis=ARM, task=TASK, limit=1.0)


@pytest.fixture(scope="module")
def landed(run: Run) -> Positioning:
    """Two moves without any first guess of the friction."""
    return run(LANDING, task=TASK.replace("target = 1.0", "targets = [1.0, 0.5]"))


def test_arm_lands_with_unknown_friction(landed: Positioning) -> None:
    assert landed.method == "landing"
    assert landed.ending is Ending.REACHED
    (each,) = landed.runs
    for move in each.moves:
        assert abs(move.final_error) <= 1e-5
        assert move.swing <= 1e-5
        assert move.settling_time is not None
    assert landed.truth == {"coulomb_friction": 0.15, "viscous_friction": 0.1}
    assert each.estimates["coulomb_friction"][0] < LEARNED  # none, as far as a plan can have none
    for name, truth in landed.truth.items():
        assert each.estimates[name][-1] == pytest.approx(truth, rel=LEARNED)
    assert landed.learned.method == "landing"


def test_next_run_resumes(run: Run) -> None:
    result = run(
        LANDING, task=TASK.replace("36.0", "8.0") + "\nruns = 2", guess="coulomb_friction = 0.08"
    )
    first, second = result.runs
    assert first.estimates["coulomb_friction"][0] == 0.08
    for name, truth in result.truth.items():
        assert second.estimates[name][0] == pytest.approx(first.estimates[name][-1], rel=LEARNED)
        assert second.estimates[name][0] == pytest.approx(truth, rel=1e-3)


def test_phases(landed: Positioning) -> None:
    (run,) = landed.runs
    names = [phase.name for phase in run.phases]
    assert names[0] == "feedback"
    assert names[-1] == "done"
    assert names.count("feedback") == len(run.moves)
    assert run.phases[0].start_time == 0.0
    assert run.phases[-1].end_time == run.time[-1]
    for before, after in pairwise(run.phases):
        assert after.start_time == before.end_time
    assert all(phase.reason for phase in run.phases)


def test_efforts_of_the_series(landed: Positioning) -> None:
    each = landed.runs[0]
    assert each.arm.series
    for series in each.arm.series:
        k = round(series.start_time / T)
        np.testing.assert_array_equal(each.effort[k : k + series.effort.size], series.effort)
        move = each.moves[series.move - 1]
        assert move.start_time <= series.start_time < move.end_time


def test_end_of_a_series(landed: Positioning) -> None:
    each = landed.runs[0]
    arm = each.arm
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=0.15, viscous_friction=0.1, static_friction=0.18
    )
    plant = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    motion = simulate(plant, each.effort, sampling_time=T)
    assert motion.load_position is not None
    assert motion.load_velocity is not None
    for k, series in enumerate(arm.series):
        at = round(series.end_time / T) + 5  # mass 1 rests, and mass 2 swings with what it has
        apart = float(motion.load_position[at] - motion.position[at])
        swing = hypot(apart, float(motion.load_velocity[at]))
        assert series.final_position == pytest.approx(motion.position[at], abs=ROUNDING)
        assert series.final_swing == pytest.approx(swing, abs=ROUNDING), k
    last = [series for series in arm.series if series.move == 2][-1]
    assert last.target == 0.5
    assert last.final_error == pytest.approx(0.5 - float(arm.position[-1]), abs=ROUNDING)


def test_feedback_alone_leaves_a_swing(run: Run) -> None:
    result = run("feedback", task=TASK.replace("36.0", "25.0"))
    assert result.method == "feedback"
    assert not result.ending.reached
    assert result.last.swing > 1e-3
    each = result.runs[0]
    assert each.phases == each.arm.series == ()
    assert result.learned is None
    assert each.estimates["coulomb_friction"][-1] == pytest.approx(0.15, rel=1e-3)


def test_feedback_alone_follows_the_targets(run: Run) -> None:
    task = TASK.replace("target = 1.0", "targets = [0.6, 0.2]").replace("36.0", "20.0")
    result = run("feedback", task=task)
    arm = result.runs[0].arm
    assert arm is not None
    for move in result.runs[0].moves:
        k = round(move.end_time / T)
        assert abs(float(arm.position[k]) - move.target) < 0.05


def test_landing_with_noise(run: Run) -> None:
    sensors = "position_noise = 1e-4\nvelocity_noise = 1e-3\nseed = 4"
    result = run(LANDING, task=TASK.replace("1e-5", "3e-4"), sensors=sensors)
    assert result.ending is Ending.REACHED
    assert any("276 µm" in note for note in result.notes)  # 3 sd of a mean of 158 less
    arm = result.runs[0].arm
    assert np.any(arm.measured_position != arm.position)
    for name, truth in result.truth.items():
        off = abs(float(result.runs[0].estimates[name][-1]) - truth)
        assert off <= 4.0 * float(result.runs[0].deviations[name][-1])


@pytest.mark.slow
def test_wrong_guess_of_masses_and_spring(run: Run) -> None:
    guess = "mass = 1.02\nload_mass = 0.99\nstiffness = 1.01\ncoulomb_friction = 0.1"
    result = run(LANDING, guess=guess, task=TASK.replace("1e-5", "1e-1"))
    assert result.first_guess_sources["mass"] == "the scenario"
    assert result.runs[0].estimates["coulomb_friction"][0] == 0.1
    assert np.max(np.abs(result.runs[0].effort)) <= 1.0
    assert result.last.settling_time is not None


def test_rotary_arm(run: Run) -> None:
    axis = 'kind = "rotary"\n' + ARM.replace("mass", "inertia")
    result = run(LANDING, axis=axis, task=TASK.replace("36.0", "5.0"))
    assert result.scenario["axis"]["load_inertia"] == (1.0, "kg m^2")
    assert result.scenario["axis"]["stiffness"] == (1.0, "N m/rad")
    assert result.ending is Ending.UNDER_WAY


TIME = np.arange(501) * 0.01


def test_ending_of_an_arm() -> None:
    driven = np.where(TIME < 1.0, 1.0, 1e-4)
    swings = driven + np.where(TIME < 1.0, 0.0, 0.1 * np.sin(5.0 * TIME))
    assert arm_ending(swings, driven, 1e-3, None) is Ending.SWINGING
    assert arm_ending(swings, driven, 1e-5, None) is Ending.STUCK
    assert arm_ending(swings, driven, 0.2, None) is Ending.REACHED
    assert arm_ending(swings, driven, 1e-3, PositioningOutcome.STOPPED) is Ending.STOPPED
    assert arm_ending(swings, driven, 1e-3, PositioningOutcome.REACHED) is Ending.MISJUDGED
    under_way = np.linspace(1.0, 0.5, TIME.size)
    moving = PositioningOutcome.MOVING
    assert arm_ending(under_way, under_way, 1e-3, moving) is Ending.UNDER_WAY
    hunting = 0.1 * np.sin(5.0 * TIME)
    assert arm_ending(hunting, hunting, 1e-3, None) is Ending.HUNTING
    assert arm_ending(hunting, hunting, 1e-3, moving) is Ending.UNDER_WAY
    assert arm_ending(swings, driven, 1e-3, moving) is Ending.UNDER_WAY


def test_too_long_a_sampling_time(run: Run) -> None:
    with refuses("swing_above_nyquist", value=2.5) as refused:
        run(LANDING, task=TASK.replace("0.02", "2.5"))
    assert "[task]" in refused.value.where


def test_note_on_an_offset_that_is_not_guessed(run: Run) -> None:
    short = TASK.replace("36.0", "0.4")
    axis = ARM + "\noffset = 0.02"
    assert any(
        "Give offset in [guess]" in note for note in run(LANDING, axis=axis, task=short).notes
    )
    given = run(LANDING, axis=axis, task=short, guess="offset = 0.02")
    assert not any("offset" in note for note in given.notes)
