"""Scenario files that are good but for some changes, and how they are refused."""

import json
import tomllib
from pathlib import Path
from typing import Any

from stage_log import Run

AXIS: dict[str, Any] = tomllib.loads("""
axis = {mass = 150.0, coulomb_friction = 100.0, viscous_friction = 700.0, static_friction = 130.0}
task = {target = 0.001, tolerance = 2e-5, duration = 0.5, sampling_time = 0.01}
controller = {method = "papwc", effort_limit = 300.0}
guess = {mass = 150.0, coulomb_friction = 80.0}
""")
ARM: dict[str, Any] = tomllib.loads("""
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
""")
PARAMETERS: dict[str, Any] = {
    "mass": {"value": 150.0, "std": 1.0, "unit": "kg"},
    "coulomb_friction": {"value": 98.0, "std": 1.0, "unit": "N"},
    "viscous_friction": {"value": 690.0, "std": 9.0, "unit": "N s/m"},
}
ESTIMATE: dict[str, Any] = {
    "schema": 1,
    "kind": "linear",
    "parameters": PARAMETERS,
    "status": "ok",
    "status_text": "The parameters are identified.",
}
GAINS: dict[str, Any] = {
    "gain_1": {"value": 3.3e-5, "unit": "m/(N s)^2"},
    "gain_2": {"value": 0.0033, "unit": "m/(N s^2)"},
}
LEARNED: dict[str, Any] = {
    "schema": 1,
    "method": "papwc",
    "kind": "linear",
    "values": GAINS,
    "covariance": [[1e-6, 0.0], [0.0, 1e-6]],
}
FRICTION: dict[str, Any] = {
    "coulomb_friction": {"value": 0.15, "unit": "N"},
    "viscous_friction": {"value": 0.1, "unit": "N s/m"},
    "static_friction": {"value": 0.2, "unit": "N"},
}
ARM_LEARNED = LEARNED | {"method": "landing", "values": FRICTION}


def scenario_file(good: dict[str, Any], folder: Path, changes: str = "") -> Path:
    """Return a scenario file with changes to a good one, written as TOML.

    A key or table that is changed to ``"absent"`` is left out; of a table with ``only = true`` no
    other keys are kept.
    """
    document: dict[str, Any] = {name: dict(table) for name, table in good.items()}
    for name, change in tomllib.loads(changes).items():
        if isinstance(change, dict):
            kept = {} if change.pop("only", False) else document.get(name, {})
            values = kept | change
            document[name] = {key: value for key, value in values.items() if value != "absent"}
        elif change == "absent":
            del document[name]
        else:
            document = {name: change} | document  # before the first table
    path = folder / "scenario.toml"
    path.write_text("\n".join(_lines(document)))
    return path


def _lines(document: dict[str, Any]) -> list[str]:
    lines: list[str] = []
    for name, value in document.items():
        if isinstance(value, dict):
            lines += [f"[{name}]", *(f"{key} = {_text(each)}" for key, each in value.items())]
        else:
            lines.append(f"{name} = {_text(value)}")
    return lines


def _text(value: Any) -> str:
    """Return a value as TOML, which writes text and lists as JSON does."""
    return str(value) if isinstance(value, float) else json.dumps(value)


def refused(run: Run, scenario: Path, words: list[str]) -> None:
    """Check that a scenario is refused in one line with these words, and nothing is written."""
    results = scenario.parent / "results"
    results.mkdir()
    before = sorted(scenario.parent.rglob("*"))
    outcome = run(
        "position", scenario, "--json", results / "a.json", "--report", results / "a.html"
    )
    line = outcome.refused(*words, scenario.parent.name)
    assert "; " in line, "the remedy follows a semicolon"
    assert sorted(scenario.parent.rglob("*")) == before
