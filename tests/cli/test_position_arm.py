"""``stickslip position`` on a flexible arm: what it prints and saves, and what it refuses."""

import json
from functools import partial
from pathlib import Path

import pytest
from scenario_files import refused, scenario_file
from stage_log import Run

GOOD = """
[axis]
mass = 1.0
load_mass = 1.0
stiffness = 1.0
coulomb_friction = 0.15
viscous_friction = 0.1
static_friction = 0.18
[task]
target = 1.0
tolerance = 1e-5
duration = 36.0
sampling_time = 0.02
[controller]
method = "landing"
effort_limit = 1.0
[guess]
coulomb_friction = 0.08
"""
GUESS = "coulomb_friction = 0.08"
CONTROLLER = "[controller]"

LEARNED = {
    "schema": 1,
    "method": "landing",
    "kind": "linear",
    "values": {
        "coulomb_friction": {"value": 0.15, "unit": "N"},
        "viscous_friction": {"value": 0.1, "unit": "N s/m"},
        "static_friction": {"value": 0.2, "unit": "N"},
    },
    "covariance": [[1e-6, 0.0], [0.0, 1e-6]],
}

# What becomes of the good scenario, and what the line must say.
BAD: dict[str, tuple[list[tuple[str, str]], list[str]]] = {
    "a method of a rigid axis": (
        [('"landing"', '"exact"')],
        ["[controller]", "method exact moves a rigid axis", "landing or feedback"],
    ),
    "no load": ([("load_mass = 1.0\n", "")], ["[axis]", "load_mass is missing", "in kg"]),
    "no spring": ([("stiffness = 1.0\n", "")], ["[axis]", "stiffness is missing", "in N/m"]),
    "a spring of no stiffness": (
        [("stiffness = 1.0", "stiffness = 0.0")],
        ["[axis]", "stiffness is 0 N/m", "positive"],
    ),
    "a negative load": (
        [("load_mass = 1.0", "load_mass = -1.0")],
        ["[axis]", "load_mass is -1 kg", "positive"],
    ),
    "a load of inertia": (
        [("load_mass = 1.0", "load_inertia = 1.0")],
        ["[axis]", "load_inertia", "linear", "load_mass [kg]"],
    ),
    "a rigid axis": (
        [("load_mass = 1.0\nstiffness = 1.0\n", ""), ('"landing"', '"feedback"')],
        ["[controller]", "method feedback", "rigid", "landing or pd", "load_mass and stiffness"],
    ),
    "a rigid axis whose mass is not guessed": (
        [("load_mass = 1.0\nstiffness = 1.0\n", ""), ('method = "landing"\n', "")],
        ["[guess]", "mass is missing", "in kg"],
    ),
    "series of a rigid axis": (
        [("load_mass = 1.0\nstiffness = 1.0\n", ""), ("[guess]", "most_series = 3\n[guess]")],
        ["[controller]", "most_series", "landing", "a rigid axis"],
    ),
    "a rigid axis without a velocity": (
        [
            ("load_mass = 1.0\nstiffness = 1.0\n", ""),
            (CONTROLLER, "[sensors]\nvelocity = 'none'\n[controller]"),
        ],
        ["[sensors]", "velocity is none", "landing", "exact"],
    ),
    "an uncertain spring of a rigid axis": (
        [
            ("load_mass = 1.0\nstiffness = 1.0\n", ""),
            (GUESS, f"{GUESS}\nmass = 1.0\narm_uncertainty = 0.02"),
        ],
        ["[guess]", "arm_uncertainty", "landing", "no use"],
    ),
    "a width of a series": (
        [("[guess]", "longest_width = 0.1\n[guess]")],
        ["[controller]", "longest_width", "landing", "a flexible arm"],
    ),
    "an uncertain arm under feedback": (
        [('"landing"', '"feedback"'), (GUESS, "arm_uncertainty = 0.02")],
        ["[guess]", "arm_uncertainty", "feedback", "no use"],
    ),
    "a negative uncertainty": (
        [(GUESS, "arm_uncertainty = -0.02")],
        ["[guess]", "arm_uncertainty is -0.02"],
    ),
    "unknown key": ([("stiffness =", "stifness =")], ["[axis]", "'stifness'", "'stiffness'"]),
    "effort below the breakaway": (
        [("effort_limit = 1.0", "effort_limit = 0.17")],
        ["[controller]", "0.17 N", "allow more than 0.18 N"],
    ),
    "effort below the guess": (
        [(GUESS, f"{GUESS}\nstatic_friction = 1.2")],
        ["[guess]", "effort_limit is 1 N", "1.2 N to free mass 1", "guess less"],
    ),
    "an arm that slides away": (
        [("[task]", "offset = 0.3\n[task]")],
        ["[axis]", "offset is 0.3 N", "balance the offset"],
    ),
    "no velocity": (
        [(CONTROLLER, "[sensors]\nvelocity = 'none'\n[controller]")],
        ["[sensors]", "velocity", "both its masses"],
    ),
    "tolerance below the noise": (
        [(CONTROLLER, "[sensors]\nposition_noise = 1e-3\n[controller]")],
        ["[task]", "1e-05 m", "half a swing", "better sensors"],
    ),
    "a gain alone": (
        [("[guess]", "position_gain = 1.0\n[guess]")],
        ["[controller]", "velocity_gain is missing", "or neither"],
    ),
    "a setting of pulses": (
        [("[guess]", "max_idle_pulses = 3\n[guess]")],
        ["[controller]", "max_idle_pulses", "landing", "leave it out"],
    ),
    "series for a feedback": (
        [('"landing"', '"feedback"\nmost_series = 3')],
        ["most_series", "feedback", "use method 'landing'"],
    ),
    "no series": ([("[guess]", "most_series = 0\n[guess]")], ["most_series is 0", "at least 1"]),
    "a negative wait": ([("[guess]", "longest_wait = -1.0\n[guess]")], ["-1 s", "positive"]),
    "a reference that does not fit": (
        [('"landing"', '"feedback"'), ("36.0", "2.0")],
        ["[task]", "duration is 2 s", "the reference takes", "more time"],
    ),
    "a guess without use": (
        [(GUESS, "mass_uncertainty = 0.1")],
        ["[guess]", "mass_uncertainty", "no use"],
    ),
    "a guess of no mass": ([(GUESS, "mass = 0.0")], ["[guess]", "mass is 0 kg", "positive"]),
    "static below Coulomb": (
        [(GUESS, f"{GUESS}\nstatic_friction = 0.01")],
        ["0.01 N", "0.08 N", "at least the Coulomb"],
    ),
    "learned and guessed": (
        [(GUESS, f"{GUESS}\nlearned = 'learned.json'")],
        ["[guess]", "learned is given beside coulomb_friction"],
    ),
    "no such file": ([(GUESS, "learned = 'none.json'")], ["none.json", "no such file"]),
}

BAD_LEARNED: dict[str, tuple[dict[str, object], list[str]]] = {
    "another method": (
        {"method": "exact"},
        ["learned.json, method", "method exact", "needs landing"],
    ),
    "another kind": ({"kind": "rotary", "values": {}}, ["learned.json, kind", "rotary", "linear"]),
    "nothing learned": ({"values": {}}, ["learned.json", "coulomb_friction is missing"]),
    "too much friction": (
        {"values": {**LEARNED["values"], "static_friction": {"value": 1.6, "unit": "N"}}},  # type: ignore[dict-item]
        ["learned.json", "effort_limit is 1 N", "1.6 N"],
    ),
}


written = partial(scenario_file, GOOD)


@pytest.mark.parametrize("case", BAD)
def test_a_bad_scenario_is_refused_in_one_line(case: str, run: Run, tmp_path: Path) -> None:
    changes, words = BAD[case]
    refused(run, written(tmp_path, changes), words)


@pytest.mark.parametrize("case", BAD_LEARNED)
def test_a_bad_file_of_what_was_learned_is_refused(case: str, run: Run, tmp_path: Path) -> None:
    changes, words = BAD_LEARNED[case]
    (tmp_path / "learned.json").write_text(json.dumps(LEARNED | changes))
    refused(run, written(tmp_path, [(GUESS, 'learned = "learned.json"')]), words)


def test_what_was_learned_of_masses_stands_alone(run: Run, tmp_path: Path) -> None:
    parts = (("mass", 1.0, "kg"), ("load_mass", 1.0, "kg"), ("stiffness", 1.0, "N/m"))
    values = LEARNED["values"] | {  # type: ignore[operator]
        name: {"value": value, "unit": unit} for name, value, unit in parts
    }
    wide = [[1e-4 * (i == j) for j in range(5)] for i in range(5)]
    for covariance, guess, words in (
        (wide, "learned = 'learned.json'\nstiffness = 1.1", ["beside stiffness", "keep learned"]),
        (LEARNED["covariance"], "learned = 'learned.json'", ["learned.json, covariance", "5 by 5"]),
    ):
        learned = LEARNED | {"values": values, "covariance": covariance}
        (tmp_path / "learned.json").write_text(json.dumps(learned))
        line = run("position", written(tmp_path, [(GUESS, guess)])).line()
        for word in words:
            assert word in line, line


def test_a_rigid_axis_refuses_what_an_arm_has_learned(run: Run, tmp_path: Path) -> None:
    (tmp_path / "learned.json").write_text(json.dumps(LEARNED))
    changes = [
        ("load_mass = 1.0\nstiffness = 1.0\n", ""),
        ('"landing"', '"exact"'),
        (GUESS, 'learned = "learned.json"'),
    ]
    refused(run, written(tmp_path, changes), ["learned.json, method", "landing", "exact"])


def test_a_rigid_axis_refuses_a_guess_of_a_spring(run: Run, tmp_path: Path) -> None:
    changes = [
        ("load_mass = 1.0\nstiffness = 1.0\n", ""),
        ('"landing"', '"exact"'),
        (GUESS, f"{GUESS}\nmass = 1.0\nviscous_friction = 0.1\nstiffness = 1.0"),
    ]
    refused(run, written(tmp_path, changes), ["[guess]", "stiffness is given", "exact", "no use"])


def test_what_a_landing_did_is_printed(run: Run, tmp_path: Path) -> None:
    learned = tmp_path / "learned.json"
    outcome = run("position", written(tmp_path, []), "--learned", learned)
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


def test_an_estimate_of_an_arm_is_a_first_guess(run: Run, tmp_path: Path) -> None:
    estimate = {
        "schema": 1,
        "estimator": "energy",
        "kind": "linear",
        "parameters": {
            "coulomb_friction": {"value": 0.14, "std": 0.01, "unit": "N"},
            "viscous_friction": {"value": 0.11, "std": 0.01, "unit": "N s/m"},
        },
        "status": "ok",
        "provenance": {"options": {"inertia": 1.0, "load_inertia": 1.0, "stiffness": 1.0}},
    }
    (tmp_path / "estimate.json").write_text(json.dumps(estimate))
    changes = [("36.0", "1.0"), (GUESS, 'estimate = "estimate.json"')]
    outcome = run("position", written(tmp_path, changes), "--json", "-")
    assert outcome.code == 1, outcome.err
    document = json.loads(outcome.out)
    first = document["runs"][0]["estimates"]
    assert (first["coulomb_friction"][0], first["viscous_friction"][0]) == (0.14, 0.11)
    assert document["believed"]["coulomb_friction"] == "estimate estimate.json"
    assert document["believed"]["stiffness"] == "the axis, taken as known"


def test_a_feedback_alone_is_not_there(run: Run, tmp_path: Path) -> None:
    changes = [('"landing"', '"feedback"'), ("36.0", "20.0"), (GUESS, 'learned = "learned.json"')]
    (tmp_path / "learned.json").write_text(json.dumps(LEARNED))
    outcome = run("position", written(tmp_path, changes), "--json", "-")
    assert outcome.code == 1
    document = json.loads(outcome.out)
    assert document["ending"] in {"stuck", "swinging", "under_way"}
    assert document["runs"][0]["phases"] == []
    assert document["runs"][0]["estimates"]["coulomb_friction"][0] == 0.15
    assert document["believed"]["coulomb_friction"] == "learned learned.json"
    assert "series" not in outcome.err
    line = run("position", tmp_path / "scenario.toml", "--learned", tmp_path / "b.json").line()
    assert "learns nothing" in line


def test_what_was_not_learned_is_not_saved(run: Run, tmp_path: Path) -> None:
    learned = tmp_path / "learned.json"
    outcome = run("position", written(tmp_path, [("36.0", "0.4")]), "--learned", learned)
    assert outcome.code == 1
    assert "has learned nothing" in outcome.out.replace("\n", " ")
    assert "Learned:" not in outcome.out
    assert not learned.exists()
