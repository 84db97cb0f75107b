"""``stickslip position``: its printed text, its files, and its exit code."""

import json
from collections.abc import Mapping
from pathlib import Path

import pytest
from scenario_files import ARM, ARM_LEARNED, AXIS, ESTIMATE, scenario_file
from stage_log import Run

from stickslip.control import ExactPulseController
from stickslip.tasks import read_scenario

SCENARIOS = sorted((Path(__file__).parents[2] / "examples" / "scenarios").glob("*.toml"))
LONG = {"arm", "arm_noisy", "exact", "landing"}
UNREACHED = {"pid", "pwc", "pwc_short"}
WIDER = "task.tolerance = 1e-4\n"
ESTIMATED = "guess = {only = true, estimate = 'estimate.json'}\n"
RESUMED = "guess = {only = true, learned = 'learned.json'}\n"


def test_byte_order_mark_is_accepted(run: Run, tmp_path: Path) -> None:
    path = scenario_file(AXIS, tmp_path, WIDER)
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert run("position", path).code == 0


def test_feedback_needs_no_friction(run: Run, tmp_path: Path) -> None:
    changes = """
        axis = {coulomb_friction = 0.0, static_friction = 0.0}
        controller = {method = "pd", position_gain = 1e4, velocity_gain = 2e3}
        guess.only = true
        task.duration = 5.0
    """
    assert run("position", scenario_file(AXIS, tmp_path, changes)).code == 0


def uncertainties(
    folder: Path, std: Mapping[str, object], guess: str = ""
) -> tuple[float, float, str]:
    """Return those of mass and friction that a controller begins with, and the notes."""
    parameters = {
        name: {**entry, "std": std.get(name, entry["std"])}
        for name, entry in ESTIMATE["parameters"].items()
    }
    (folder / "estimate.json").write_text(json.dumps(ESTIMATE | {"parameters": parameters}))
    changes = f"""
        guess = {{only = true, estimate = "estimate.json"{guess}}}
        controller.method = "exact"
    """
    built = read_scenario(scenario_file(AXIS, folder, changes)).scenario.build(folder)
    controller = built.controller
    assert isinstance(controller, ExactPulseController)
    return controller.mass_uncertainty, controller.friction_uncertainty, " ".join(built.notes)


STD = {"mass": 4.5, "coulomb_friction": 9.8, "viscous_friction": 138.0}


@pytest.mark.parametrize(
    ("std", "guess", "expected"),
    [
        # Of friction the larger one; friction changes after the log, and a guess is no less sure
        (STD, "", (0.03, 0.2)),
        ({"mass": 0.1, "viscous_friction": 1.0}, "", (0.01, 0.05)),
        ({"mass": 80.0, "viscous_friction": 1e4}, "", (0.05, 0.5)),
        ({"mass": None, "coulomb_friction": "?"}, "", (0.05, 0.5)),
        (STD, ", friction_uncertainty = 0.3", (0.03, 0.3)),
        (STD, ", coulomb_friction = 98.0", (0.03, 0.5)),  # not that of the estimate
    ],
)
def test_uncertainty_of_an_estimate(
    std: Mapping[str, object], guess: str, expected: tuple[float, float], tmp_path: Path
) -> None:
    mass, friction, notes = uncertainties(tmp_path, std, guess)
    assert (mass, friction) == pytest.approx(expected)
    note = "estimate.json it begins with mass_uncertainty 0.03 and friction_uncertainty"
    assert (note in notes) == (std is STD and not guess)


def test_missing_scenario(run: Run, tmp_path: Path) -> None:
    run("position", tmp_path / "no.toml").refused("no such scenario file", "check the path")


@pytest.mark.parametrize("option", ["--json", "--report", "--learned"])
@pytest.mark.parametrize(
    ("place", "problem"),
    [
        ("missing/result", "does not exist"),
        (".", "names a folder"),
        ("scenario.toml", "overwrite"),
        ("estimate.json", "overwrite"),
    ],
)
def test_bad_output_is_found_before_the_run(
    option: str,
    place: str,
    problem: str,
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("the run was begun")

    monkeypatch.setattr("stickslip.tasks.position", never)
    (tmp_path / "estimate.json").write_text(json.dumps(ESTIMATE))
    scenario = scenario_file(AXIS, tmp_path, ESTIMATED)
    before = {path: path.read_text() for path in tmp_path.iterdir()}
    run("position", scenario, option, tmp_path / place).refused(option, problem)
    assert {path: path.read_text() for path in tmp_path.iterdir()} == before


def test_two_outputs_in_one_file(run: Run, tmp_path: Path) -> None:
    same = tmp_path / "same"
    scenario = scenario_file(AXIS, tmp_path)
    run("position", scenario, "--json", same, "--learned", same).refused(
        "--json and --learned name the same file"
    )


def test_method_that_learns_nothing_saves_nothing(run: Run, tmp_path: Path) -> None:
    changes = "controller = {method = 'pid', bandwidth = 2.0}\nguess.coulomb_friction = 'absent'"
    learned = tmp_path / "learned.json"
    run("position", scenario_file(AXIS, tmp_path, changes), "--learned", learned).refused(
        "learns nothing"
    )
    assert not learned.exists()


@pytest.mark.parametrize(
    "scenario",
    [
        pytest.param(path, id=path.stem, marks=pytest.mark.slow if path.stem in LONG else [])
        for path in SCENARIOS
    ],
)
def test_examples(scenario: Path, run: Run, tmp_path: Path) -> None:
    files = {name: tmp_path / name for name in ("a.json", "a.html")}
    outcome = run("position", scenario, "--json", files["a.json"], "--report", files["a.html"])
    assert outcome.code == (1 if scenario.stem in UNREACHED else 0), outcome.err
    document = json.loads(files["a.json"].read_text())
    assert document["ending"] == ("hunting" if scenario.stem in UNREACHED else "reached")
    for word in (document["name"], document["ending"], "a.html"):
        assert word in outcome.out
    assert files["a.html"].stat().st_size > 5e5


LIGHT = f"{WIDER}axis = {{mass = 1.0, viscous_friction = 5.0}}\nguess.mass = 1.0\n"
EXACT = "controller.method = 'exact'\nguess.viscous_friction = 500.0\n"
OFFSET = "axis.offset = 20.0\n"


@pytest.mark.parametrize(
    ("note", "changes", "printed"),
    [
        ("hardly learns", WIDER, False),
        ("What is alike here is 0.2.", LIGHT, True),  # the published 1e-5 times (150/1)^2
        ("hardly learns", f"{LIGHT}controller.initial_covariance = 0.2", False),
        ("constant offset in it", EXACT, False),
        ("constant offset in it", EXACT + OFFSET, True),
        ("constant offset in it", WIDER + OFFSET, False),  # the mean of both directions has none
    ],
)
def test_printed_notes(note: str, changes: str, printed: bool, run: Run, tmp_path: Path) -> None:
    text = run("position", scenario_file(AXIS, tmp_path, changes)).out
    assert (note in " ".join(text.split())) == printed


def test_run_resumes_from_learned_values(run: Run, tmp_path: Path) -> None:
    learned = tmp_path / "learned.json"
    scenario = scenario_file(AXIS, tmp_path, WIDER)
    first = run("position", scenario, "--learned", learned, "--json", "-")
    assert first.code == 0, first.err
    scenario = scenario_file(AXIS, tmp_path, WIDER + RESUMED)
    before = json.loads(learned.read_text())
    # The learned values replace those that the run resumes from
    second = run("position", scenario, "--learned", learned, "--json", "-")
    assert second.code == 0, second.err
    begun, ended = (json.loads(each.out)["runs"][0]["estimates"] for each in (second, first))
    for name in ("gain_1", "gain_2"):
        assert begun[name][0] == ended[name][-1] == before["values"][name]["value"]
    assert json.loads(learned.read_text()) != before
    assert "learned learned.json" in json.loads(second.out)["first_guess_sources"].values()


def test_estimate_of_identify_is_a_first_guess(run: Run, good_log: Path, tmp_path: Path) -> None:
    estimate = tmp_path / "estimate.json"
    assert run("identify", good_log, "--json", estimate).code == 0
    found = json.loads(estimate.read_text())["parameters"]
    changes = """
        controller = {method = "exact", effort_limit = 10.0}
        task = {target = 0.01, tolerance = 1e-5, duration = 2.0}
        [axis]
        mass = 3.0
        coulomb_friction = 1.5
        viscous_friction = 4.0
        static_friction = 1.8
        offset = 0.2
        [guess]
        only = true
        estimate = "estimate.json"
        static_friction = 1.7
        mass_uncertainty = 0.01
    """
    outcome = run("position", scenario_file(AXIS, tmp_path, changes), "--json", "-")
    document = json.loads(outcome.printed())
    first = {name: values[0] for name, values in document["runs"][0]["estimates"].items()}
    assert first["mass"] == pytest.approx(found["mass"]["value"])
    offset, coulomb = found["offset"]["value"], found["coulomb_friction"]["value"]
    assert first["coulomb_friction_positive"] == pytest.approx(coulomb + offset)
    assert first["coulomb_friction_negative"] == pytest.approx(coulomb - offset)
    assert first["static_friction_positive"] == pytest.approx(1.7 + offset)
    assert document["first_guess_sources"]["mass"] == "estimate estimate.json"
    assert document["first_guess_sources"]["static_friction"] == "the scenario"


def test_known_mass_comes_from_the_options_of_the_estimate(
    run: Run, good_log: Path, tmp_path: Path
) -> None:
    estimate = tmp_path / "estimate.json"
    assert run("identify", good_log, "--mass", 3, "--json", estimate).code == 0
    assert "mass" not in json.loads(estimate.read_text())["parameters"]
    changes = f"""
        axis = {{mass = 3.0, coulomb_friction = 1.5, viscous_friction = 4.0, static_friction = 1.8}}
        controller.effort_limit = 10.0
        {ESTIMATED}
    """
    scenario = scenario_file(AXIS, tmp_path, changes)
    document = json.loads(run("position", scenario, "--json", "-").out)
    assert document["runs"][0]["estimates"]["gain_2"][0] == pytest.approx(1.0 / (2.0 * 3.0))


def test_help(run: Run) -> None:
    outcome = run("position", "--help")
    assert outcome.code == 0
    for word in ("SCENARIO", "--json", "--report", "--learned", "Exit code 0", "Examples:"):
        assert word in outcome.out


def test_arm_landing(run: Run, tmp_path: Path) -> None:
    learned = tmp_path / "learned.json"
    outcome = run("position", scenario_file(ARM, tmp_path), "--learned", learned)
    assert outcome.code == 0, outcome.err
    for word in (
        "flexible arm, linear",
        "swing left",
        "feedback",
        "the target is new",
        "Pulse series",
        "mass 1 missed by",
        "Coulomb friction",
        "reached",
        "learned.json",
    ):
        assert word in outcome.out, word
    values = json.loads(learned.read_text())["values"]
    assert values["coulomb_friction"]["value"] == pytest.approx(0.15, rel=1e-5)


def test_estimate_of_an_arm_is_a_first_guess(run: Run, tmp_path: Path) -> None:
    parameters = {
        "coulomb_friction": {"value": 0.14, "std": 0.01, "unit": "N"},
        "viscous_friction": {"value": 0.11, "std": 0.01, "unit": "N s/m"},
    }
    options = {"inertia": 1.0, "load_inertia": 1.0, "stiffness": 1.0}
    estimate = ESTIMATE | {"parameters": parameters, "provenance": {"options": options}}
    (tmp_path / "estimate.json").write_text(json.dumps(estimate))
    scenario = scenario_file(ARM, tmp_path, f"{ESTIMATED}task.duration = 1.0")
    document = json.loads(run("position", scenario, "--json", "-").printed(1))
    first = document["runs"][0]["estimates"]
    assert (first["coulomb_friction"][0], first["viscous_friction"][0]) == (0.14, 0.11)
    assert document["first_guess_sources"]["coulomb_friction"] == "estimate estimate.json"
    assert document["first_guess_sources"]["stiffness"] == "the axis, taken as known"


def test_arm_under_feedback_alone(run: Run, tmp_path: Path) -> None:
    changes = f"{RESUMED}controller.method = 'feedback'\ntask.duration = 20.0"
    (tmp_path / "learned.json").write_text(json.dumps(ARM_LEARNED))
    scenario = scenario_file(ARM, tmp_path, changes)
    outcome = run("position", scenario, "--json", "-")
    document = json.loads(outcome.printed(1))
    assert document["ending"] in {"stuck", "swinging", "under_way"}
    assert document["runs"][0]["phases"] == []
    assert document["runs"][0]["estimates"]["coulomb_friction"][0] == 0.15
    assert document["first_guess_sources"]["coulomb_friction"] == "learned learned.json"
    assert "series" not in outcome.err
    run("position", scenario, "--learned", tmp_path / "b.json").refused("learns nothing")


def test_too_short_a_move_teaches_nothing(run: Run, tmp_path: Path) -> None:
    learned = tmp_path / "learned.json"
    scenario = scenario_file(ARM, tmp_path, "task.duration = 0.4")
    outcome = run("position", scenario, "--learned", learned)
    assert "has learned nothing" in outcome.printed(1).replace("\n", " ")
    assert "Learned:" not in outcome.out
    assert not learned.exists()
