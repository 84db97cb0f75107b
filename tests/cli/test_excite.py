"""``stickslip excite``: what it prints and writes, and how it refuses what cannot be."""

import json
from pathlib import Path

import numpy as np
import pytest
from stage_log import MASS, Run

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.simulation import simulate

LIMITS = {"effort": 10.0, "speed": 0.3, "travel": 0.2}
ROUNDING = 1e-6  # relative: nine digits of each effort are written

ASKED = (
    *("--effort-limit", 10, "--speed-limit", 0.3, "--travel-limit", 0.2),
    *("--duration", 2, "--sampling-time", 0.01),
)


def asked(option: str, value: float) -> tuple[object, ...]:
    """Return what is asked for, but for one option."""
    place = ASKED.index(f"--{option}")
    return (*ASKED[: place + 1], value, *ASKED[place + 2 :])


SENSORS = ("--position-noise", 1e-5)
AXIS = ("--mass", 3.0, "--coulomb-friction", 1.5, "--viscous-friction", 4.0)


def test_effort_keeps_the_limits(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "input.csv"
    outcome = run("excite", *AXIS, *ASKED, *SENSORS, "--out", out, "--json", "-")
    document = json.loads(outcome.printed())
    assert document["schema"] == 3
    lines = out.read_text().splitlines()
    assert lines[0] == "time [s],effort [N]"
    time, effort = np.array([[float(cell) for cell in line.split(",")] for line in lines[1:]]).T
    assert np.allclose(np.diff(time), 0.01)
    assert np.allclose(effort, document["effort"], rtol=ROUNDING)
    law = CoulombViscousFriction.symmetric(coulomb_friction=1.5, viscous_friction=4.0)
    motion = simulate(SingleMass(mass=3.0, friction=law), effort, sampling_time=0.01)
    speed, travel = np.max(np.abs(motion.velocity)), np.max(np.abs(motion.position))
    assert np.max(np.abs(effort)) <= LIMITS["effort"]
    assert speed <= LIMITS["speed"]
    assert travel <= LIMITS["travel"]
    assert document["largest_speed"] == pytest.approx(speed, rel=1e-3)
    assert document["largest_travel"] == pytest.approx(travel, rel=1e-3)
    mass = document["expected"]["mass"]
    assert mass["first_guess"] == 3.0
    assert mass["ci95"][1] - mass["ci95"][0] == pytest.approx(2 * 1.96 * mass["std"], rel=1e-3)
    assert "at best" in outcome.err


def test_effort_that_does_not_determine_the_parameters(run: Run, tmp_path: Path) -> None:
    out, saved = tmp_path / "input.csv", tmp_path / "input.json"
    short = (*AXIS, *asked("duration", 0.25), "--position-noise", 1e-3)
    outcome = run("excite", *short, "--out", out, "--json", saved)
    assert "Not to be trusted" in outcome.printed(1)
    undetermined = json.loads(saved.read_text())["undetermined"]
    assert "viscous_friction" in undetermined
    assert "viscous friction" in outcome.out
    assert out.exists()


def test_small_offset_is_identifiable(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "input.csv"
    arguments = (*AXIS, *ASKED, *SENSORS, "--out", out, "--json", "-")
    offset = json.loads(run("excite", *arguments, "--offset", 1e-9).printed())["expected"]["offset"]
    assert offset["ci95"][0] < 0.0 < offset["ci95"][1]


@pytest.mark.slow
def test_axis_from_an_estimate(run: Run, good_log: Path) -> None:
    estimate, out = good_log.with_suffix(".json"), good_log.with_name("input.csv")
    assert run("identify", good_log, "--json", estimate).code == 0
    outcome = run(
        *("excite", "--estimate", estimate, "--mass", MASS, *ASKED, *SENSORS),
        *("--out", out, "--json", "-"),
    )
    expected = json.loads(outcome.printed())["expected"]
    held = json.loads(estimate.read_text())["parameters"]
    assert expected["mass"]["first_guess"] == MASS  # given beside the estimate
    for name in ("coulomb_friction", "viscous_friction", "offset"):
        assert expected[name]["first_guess"] == held[name]["value"]


@pytest.mark.slow
def test_designed_effort_in_a_study(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "input.csv"
    assert run("excite", *AXIS, *ASKED, *SENSORS, "--out", out).code == 0
    scenario = tmp_path / "designed.toml"
    scenario.write_text(
        "runs = 2\n[axis]\nmass = 3.0\ncoulomb_friction = 1.5\nviscous_friction = 4.0\n"
        '[input]\nfile = "input.csv"\n[sensors]\nposition_noise = 1e-5\nvelocity = "none"\n'
    )
    outcome = run(
        *("compare", scenario, "--mass", 3.0, "--only", "maximum-likelihood", "--json", "-")
    )
    document = json.loads(outcome.printed())
    assert document["samples"] == 201
    (found,) = document["estimators"]
    ratio = found["parameters"]["coulomb_friction"]["bound_ratio"]
    assert 0.0 < ratio < 4.0  # of two runs


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((*ASKED, *SENSORS), ["mass is missing", "kg"]),
        ((*AXIS[:4], *ASKED, *SENSORS), ["--viscous-friction is missing", "N s/m"]),
        ((*AXIS, *ASKED), ["neither noise nor steps", "--position-noise"]),
        ((*AXIS, *ASKED, *SENSORS, "--velocity-noise", 0), ["velocity has no noise"]),
        ((*AXIS, *asked("effort-limit", -1), *SENSORS), ["--effort-limit is -1 N,"]),
        (
            (*AXIS, *asked("effort-limit", 1), *SENSORS),
            ["does not free", "takes 1.5 N", "allow more"],
        ),
        ((*AXIS, *asked("duration", 0.1), *SENSORS), ["10 samples", "longer"]),
        ((*AXIS, *asked("duration", 1e5), *SENSORS), ["200000", "shorten"]),
        ((*AXIS, *ASKED, *SENSORS, "--seed", -1), ["seed is -1"]),
        ((*AXIS, *ASKED, *SENSORS, "--seed", 1.5), ["not a whole number"]),
        (("--estimate", "no.json", *ASKED, *SENSORS), ["no.json", "no such file"]),
    ],
)
def test_bad_option(
    arguments: tuple[object, ...], words: list[str], run: Run, tmp_path: Path
) -> None:
    outcome = run("excite", *arguments, "--out", tmp_path / "input.csv")
    line = outcome.refused(*words)
    assert "[guess]" not in line
    assert list(tmp_path.iterdir()) == []


def test_bad_estimate(run: Run, tmp_path: Path) -> None:
    estimate = tmp_path / "estimate.json"
    document = {"schema": 1, "kind": "linear", "status": "poor_fit", "parameters": {}}
    estimate.write_text(json.dumps(document))
    arguments = ("--estimate", estimate, *ASKED, *SENSORS, "--out", tmp_path / "input.csv")
    line = run("excite", *arguments).line()
    assert "poor_fit" in line
    assert "[guess]" not in line
    document |= {"kind": "rotary", "status": "ok"}
    estimate.write_text(json.dumps(document))
    assert "rotary" in run("excite", *arguments, "--kind", "linear").line()
    assert "inertia is missing" in run("excite", *arguments).line()
