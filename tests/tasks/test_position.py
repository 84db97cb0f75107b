"""A positioning task from its scenario: moves, runs, learned values, and endings."""

from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from refusals import refuses
from scenario_runs import AXIS, Run, positioned

from stickslip.records import Ending, InputError, PositioningOutcome
from stickslip.tasks import position, read_scenario
from stickslip.tasks.positioning.judging import ending, reversals, settling_time

GUESS = "mass = 150.0\ncoulomb_friction = 80.0"
FULLER = f"{GUESS}\nviscous_friction = 500.0"
TASK = "target = 0.01\ntolerance = 2e-5\nduration = 2.0\nsampling_time = 0.01"

# van de Wijdeven (2002), part B, run 1 with F(0) = 1e5: the cycle of one sample at full effort [m]
CYCLE = (-0.072e-3, 0.114e-3)
PRINTED = 0.5e-6  # of numbers printed with three decimals of a millimetre


@pytest.fixture
def run(tmp_path: Path) -> Run:
    return partial(positioned, tmp_path, axis=AXIS, task=TASK, guess=GUESS, limit=300.0)


def test_published_pulse_width_control_hunts(run: Run) -> None:
    result = run("pwc")
    assert result.ending is Ending.HUNTING
    assert result.last.late_errors == pytest.approx(CYCLE, abs=PRINTED)
    assert result.last.settling_time is None
    assert result.truth["pulse_gain"] == pytest.approx(2.0)
    assert result.runs[0].estimates["pulse_gain"][0] == pytest.approx(1.375 * 2.0)
    assert result.name == "a task"


def test_runs_resume(run: Run) -> None:
    result = run("papwc", "longest_width = 0.03\nforgetting = 1.0", task=f"{TASK}\nruns = 3")
    assert [each.number for each in result.runs] == [1, 2, 3]
    assert result.ending is Ending.REACHED
    for before, after in pairwise(result.runs):
        for name, values in before.estimates.items():
            assert after.estimates[name][0] == values[-1]
    assert result.learned.values["gain_1"] == result.runs[-1].estimates["gain_1"][-1]
    for each in result.runs:
        assert each.estimate_time.size == len(each.pulses) + 1
        assert each.time[0] == 0.0
        assert each.error[0] == 0.01


def test_moves_follow_each_other(run: Run) -> None:
    task = TASK.replace("target = 0.01", "start = 0.002\ntargets = [0.01, 0.004, 0.0045]")
    result = run("exact", task=task, guess=FULLER)
    moves = result.runs[0].moves
    assert [move.ending for move in moves] == [Ending.REACHED] * 3
    assert [move.number for move in moves] == [1, 2, 3]
    assert moves[0].start == 0.002
    for before, after in pairwise(moves):
        assert after.start == pytest.approx(before.target - before.final_error, abs=1e-15)
        assert after.start_time == before.end_time
    assert all(move.pulses for move in moves)
    for move in moves:
        for pulse in move.pulses:
            assert move.start_time <= pulse.time < move.end_time
    pulses = result.runs[0].pulses
    assert sum(pulse.achieved_displacement for pulse in pulses) == pytest.approx(
        0.0045 - 0.002 - moves[-1].final_error, abs=1e-12
    )


def test_what_a_move_without_pulses_teaches_is_in_the_result(run: Run) -> None:
    result = run(guess=FULLER)
    assert result.method == "precise"  # the default
    (each,) = result.runs
    assert not each.pulses
    assert each.estimates["coulomb_friction_positive"][0] == pytest.approx(80.0)
    assert each.estimates["coulomb_friction_positive"][-1] == pytest.approx(100.0, rel=0.02)
    assert each.estimates["viscous_friction_positive"][-1] == pytest.approx(700.0, rel=0.1)


@pytest.mark.parametrize(("guess", "unknown"), [(FULLER, False), ("mass = 150.0", True)])
def test_friction_that_is_not_given_begins_by_a_rule(guess: str, unknown: bool, run: Run) -> None:
    result = run(guess=guess)
    source = result.first_guess_sources["viscous_friction"]
    assert source.startswith("a rule") is unknown
    assert any("begins by a rule" in note for note in result.notes) is unknown
    assert result.first_guess_sources["static_friction"].startswith("Coulomb friction")


def test_efforts_of_the_pulses(run: Run) -> None:
    result = run("exact", guess=FULLER)
    each = result.runs[0]
    drawn = np.zeros_like(each.effort)
    for pulse in each.pulses:
        k = round(pulse.time / 0.01)
        for level, width in pulse.levels:
            n = round(width / 0.01)
            drawn[k : k + n] = level
            k += n
    np.testing.assert_array_equal(drawn, each.effort)
    assert result.last.peak_effort == np.max(np.abs(each.effort))


def test_noise_follows_the_seed(run: Run) -> None:
    sensors = 'encoder_step = 1e-6\nposition_noise = 1e-6\nvelocity = "none"\nseed = '
    first, again, other = (
        run("exact", guess=FULLER, sensors=sensors + seed).runs[0].measured_error
        for seed in ("3", "3", "4")
    )
    np.testing.assert_array_equal(first, again)
    assert np.any(first != other)


def test_tolerance_of_the_controller_allows_for_the_sensors(run: Run) -> None:
    sensors = 'encoder_step = 1e-6\nposition_noise = 1e-6\nvelocity = "none"'
    result = run("exact", guess=FULLER, sensors=sensors)
    # 20 um less half a step and three standard deviations of a mean of ten
    assert any("18.6 µm" in note for note in result.notes)
    assert result.ending is Ending.REACHED


def test_rotary_axis(run: Run) -> None:
    axis = 'kind = "rotary"\n' + AXIS.replace("mass", "inertia")
    result = run("papwc", axis=axis, guess=GUESS.replace("mass", "inertia"))
    assert result.scenario["axis"]["inertia"] == (150.0, "kg m^2")
    assert result.scenario["task"]["target"] == (0.01, "rad")
    assert result.to_dict()["units"]["effort"] == "N m"
    assert next(iter(result.scenario["axis"])) == "kind"


GAINS = "position_gain = 2e4\nvelocity_gain = 1.5e3\n"


@pytest.mark.parametrize(
    ("method", "settings"),
    [
        ("pd", ""),
        ("pd", "filter_time = 0.01"),
        ("pid", "integral_gain = 1e4\ndead_band = 1e-5"),
        (
            "pid-dither",
            "integral_gain = 1e4\ndither_amplitude = 40.0\ndither_frequency = 25.0\n"
            'dither_shape = "sine"',
        ),
        ("pid-reset", 'integral_gain = 1e4\nreset_law = "stribeck"\nreset_speed = 1e-4'),
    ],
)
def test_feedback_controllers_learn_nothing(method: str, settings: str, run: Run) -> None:
    result = run(method, GAINS + settings, guess="")
    assert result.learned is None
    assert not result.runs[0].pulses
    assert not result.runs[0].estimates
    assert abs(result.last.final_error) < 0.005


def test_pd_control_stops_short(run: Run) -> None:
    result = run("pd", GAINS, guess="")
    assert result.ending is Ending.STUCK
    assert 0.0 < 2e4 * abs(result.last.final_error) <= 130.0


def test_effort_beyond_all_numbers(run: Run) -> None:
    settings = "position_gain = 1e307\nvelocity_gain = 1e3"
    axis = AXIS.replace("mass = 150.0", "mass = 1e-300")
    with refuses("not_finite", name="speed"):
        run("pd", settings, axis=axis, guess="", limit=1e308)


def test_progress(tmp_path: Path) -> None:
    calls: list[tuple[int, int]] = []
    scenario = Path(__file__).parents[2] / "examples" / "scenarios" / "papwc.toml"
    read = read_scenario(scenario)
    position(read, progress=lambda done, every: calls.append((done, every)))
    every = 10 * 200
    assert calls[0] == (0, every)
    assert calls[-1] == (every, every)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


def test_run_that_cannot_resume_starts_anew(run: Run) -> None:
    # A first guess of b so large that the first pulse, far too short, teaches a negative one is
    # not to be had; what cannot be gone on from is made by hand
    from stickslip.control import PulseWidthController

    def refuse(*_: object, **__: object) -> None:
        raise InputError("not_positive", name="first_gain", value=-1.0, unit="m/s^2")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PulseWidthController, "resumed", refuse)
        result = run("pwc", task=f"{TASK}\nruns = 2")
    assert any("first_gain is -1" in note for note in result.notes)
    first, second = (each.estimates["pulse_gain"] for each in result.runs)
    np.testing.assert_array_equal(first, second)


TIME = np.arange(101) * 0.01


def falling(to: float) -> np.ndarray:
    return np.where(TIME < 0.5, 0.01, to)


@pytest.mark.parametrize(
    ("error", "outcome", "expected"),
    [
        (falling(1e-5), PositioningOutcome.REACHED, Ending.REACHED),
        (falling(1e-5), PositioningOutcome.STOPPED, Ending.REACHED),
        (falling(1e-5), None, Ending.REACHED),
        (falling(3e-5), PositioningOutcome.REACHED, Ending.MISJUDGED),
        (falling(3e-5), PositioningOutcome.STOPPED, Ending.STOPPED),
        (falling(3e-5), PositioningOutcome.MOVING, Ending.STUCK),
        (falling(3e-5), None, Ending.STUCK),
        (0.01 - 0.009 * TIME, PositioningOutcome.MOVING, Ending.UNDER_WAY),
        (1e-4 * np.sign(np.sin(30.0 * TIME)), PositioningOutcome.MOVING, Ending.HUNTING),
        (1e-4 * np.sin(30.0 * TIME), None, Ending.HUNTING),
        (1e-5 * np.sin(30.0 * TIME), None, Ending.REACHED),
        (0.01 - 0.0100099 * TIME, None, Ending.UNDER_WAY),  # inside at the last sample only
        (2.1e-4 - 2.1e-4 * TIME, None, Ending.UNDER_WAY),  # inside for less than a tenth
        (1.7e-4 - 1.7e-4 * TIME, None, Ending.REACHED),  # for more than a tenth
        (np.where(TIME < 0.96, 0.01, 1e-5), PositioningOutcome.REACHED, Ending.UNDER_WAY),
    ],
)
def test_ending(error: np.ndarray, outcome: PositioningOutcome | None, expected: Ending) -> None:
    assert ending(error, 2e-5, outcome) is expected


STEPS = np.array([3.0, -1.0, 1.0, -1.0])[np.minimum(np.arange(1001) // 150, 3)]
"""Sticks at four places about the target, at the last for more than the last half [-]."""


@pytest.mark.parametrize(
    ("error", "integrates", "expected"),
    [
        (STEPS, True, Ending.HUNTING),
        (STEPS, False, Ending.STUCK),
        (STEPS[:400], True, Ending.UNDER_WAY),  # has not turned round twice yet
        (np.minimum(STEPS, 2.0), True, Ending.HUNTING),  # whatever it did on its way there
        (np.abs(STEPS), True, Ending.UNDER_WAY),  # has not been there
        (0.5 * np.exp(-2.0 * TIME) * np.cos(8.5 * TIME), True, Ending.UNDER_WAY),  # never sticks
    ],
)
def test_ending_under_integral_control(
    error: np.ndarray, integrates: bool, expected: Ending
) -> None:
    assert ending(1e-3 * error, 2e-5, None, integrates=integrates) is expected


def test_late_rest_settles() -> None:
    error = np.concatenate((np.linspace(0.01, 1e-4, 990), np.full(10, 1e-5)))
    assert settling_time(np.arange(1000) * 0.01, error, 2e-5) == pytest.approx(9.9)
    error[-1] += 1e-9
    assert settling_time(np.arange(1000) * 0.01, error, 2e-5) is None


def test_settling_time() -> None:
    error = falling(1e-5)
    assert settling_time(TIME, error, 2e-5) == pytest.approx(0.5)
    error[70] = 1e-3
    assert settling_time(TIME, error, 2e-5) == pytest.approx(0.71)
    error[95] = 1e-3
    assert settling_time(TIME, error, 2e-5) is None
    assert settling_time(TIME, 0.0 * error, 2e-5) == 0.0


def test_reversals() -> None:
    assert reversals(1e-5 * np.sin(30.0 * TIME), 2.1e-5) == 0
    assert reversals(1e-4 * np.sin(2.0 * np.pi * 3.0 * TIME), 2e-5) == 6
    assert reversals(TIME, 2e-5) == 0


def test_files_are_beside_the_scenario(tmp_path: Path) -> None:
    path = tmp_path / "task.toml"
    path.write_text(
        f"[axis]\n{AXIS}\n[task]\n{TASK}\n[guess]\nlearned = 'sub/learned.json'\n"
        '[controller]\neffort_limit = 300.0\nmethod = "papwc"\n'
    )
    read = read_scenario(path)
    assert read.learned == tmp_path / "sub" / "learned.json"
    assert read.inputs == (read.learned,)
    assert read.learns
    with refuses("no_such_file"):
        position(read)
