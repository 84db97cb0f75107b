"""``stickslip compare``: what it prints and writes, and how it refuses what cannot be."""

import io
import json
import time
from pathlib import Path

import pytest
from stage_log import COULOMB, MASS, OFFSET, VISCOUS, Run, csv_text, table

from stickslip import ESTIMATORS
from stickslip.cli.terminal import progress_bar

CLOSE = 0.03  # relative; the log has 1 % noise and a velocity that is differentiated from positions

FEW = ("--only", "energy", "--only", "idim-ls", "--only", "rls", "--only", "free-decay")

SCENARIO = """
runs = 3
[axis]
mass = 1.5
coulomb_friction = 2.0
viscous_friction = 3.0
offset = 0.2
[input]
amplitudes = [4.0, 3.0]
frequencies = [0.5, 1.3]
duration = 2.0
sampling_time = 0.004
[sensors]
position_noise = 1e-4
velocity_noise = 0.01
"""

DURATION = "duration = 2.0"

# Text of the good scenario, its replacement, and parts of the message.
BAD = [
    ("[axis]", "[axis", ["not TOML"]),
    ("amplitudes", "amplitude", ["[input]", "'amplitude'", "'amplitudes'"]),
    ("[input]", "[task]", ["this is a positioning task", "stickslip position"]),
    (SCENARIO, 'effort = "35 * v"', ["this is a schema", "--schema"]),
    ("[input]", "[axis.input]", ["'input'"]),
    ("coulomb_friction = 2.0\n", "", ["[axis]", "coulomb_friction is missing"]),
    ("frequencies = [0.5, 1.3]\n", "", ["[input]", "frequencies is missing"]),
    ("[0.5, 1.3]", "[0.5]", ["2 amplitudes and 1 frequency;"]),
    ("[0.5, 1.3]", "[0.5, 130.0]", ["130 Hz", "at most 125 Hz"]),
    (DURATION, "duration = 0.2", ["0.2 s", "100 to"]),
    (
        "position_noise = 1e-4\nvelocity_noise = 0.01",
        "",
        ["nothing is random", "position_noise"],
    ),
    ("runs = 3", "runs = 1", ["runs is 1", "2 to 100000"]),
    (DURATION, 'file = "input.csv"', ["amplitudes and file"]),
    (DURATION, f"{DURATION}\neffort_delay = 0.5", ["[input]", "effort_delay"]),
    (DURATION, f"{DURATION}\neffort_delay = -1", ["effort_delay is -1 sample", "0 to 50"]),
    (
        DURATION,
        f"{DURATION}\ndisturbance_correlation = 1.0",
        ["disturbance_correlation is 1", "0.98"],
    ),
]


@pytest.fixture
def scenario(tmp_path: Path) -> Path:
    path = tmp_path / "noisy.toml"
    path.write_text(SCENARIO)
    return path


@pytest.mark.slow
def test_every_estimator_has_values_or_a_reason(run: Run, good_log: Path) -> None:
    outcome = run("compare", good_log, "--json", "-")
    document = json.loads(outcome.printed())
    assert (document["schema"], document["comparison"], document["kind"]) == (1, "log", "linear")
    estimators = {each["name"]: each for each in document["estimators"]}
    assert tuple(estimators) == tuple(ESTIMATORS)
    for name in ESTIMATORS:
        each = estimators[name]
        assert name in outcome.err
        assert each["applies"] == (each["estimate"] is not None) == (each["why_not"] == "")
        if each["applies"]:
            assert each["seconds_per_sample"] > 0
            assert each["estimate"]["schema"] == 1
    assert "extremes" in estimators["free-decay"]["why_not"]
    energy = estimators["energy"]["estimate"]["parameters"]
    truth = {"mass": MASS, "coulomb_friction": COULOMB, "viscous_friction": VISCOUS}
    for name, value in truth.items():
        assert energy[name]["value"] == pytest.approx(value, rel=CLOSE), name
    assert energy["offset"]["value"] == pytest.approx(OFFSET, abs=CLOSE)
    # Observers estimate no mass: they get the one that the energy estimator found
    given = estimators["ekf"]
    assert given["assumed_inertia"] == energy["mass"]["value"]
    assert given["estimate"]["provenance"]["options"]["inertia"] == energy["mass"]["value"]
    assert estimators["energy"]["unexplained_effort"] < CLOSE
    assert estimators["energy"]["position_fit"] > 1 - CLOSE


def test_tables_and_files(run: Run, good_log: Path) -> None:
    json_file, page = good_log.with_suffix(".json"), good_log.with_suffix(".html")
    outcome = run("compare", good_log, *FEW, "--json", json_file, "--report", page)
    assert outcome.code == 0, outcome.err
    for words in ("Coulomb", "±", "Does not apply", "free-decay: ", f"Report: {page}"):
        assert words in outcome.out
    assert "ekf" not in outcome.out
    names = [each["name"] for each in json.loads(json_file.read_text())["estimators"]]
    assert names == ["energy", "idim-ls", "rls", "free-decay"]
    assert sorted(good_log.parent.iterdir()) == sorted([good_log, json_file, page])


def test_known_mass_and_friction_for_each_direction(run: Run, good_log: Path) -> None:
    arguments = ["--mass", MASS, "--per-direction", "--json", "-", *FEW, "--only", "ekf"]
    found = {
        e["name"]: e for e in json.loads(run("compare", good_log, *arguments).out)["estimators"]
    }
    assert set(found["energy"]["estimate"]["parameters"]) == {
        f"{name}_{side}"
        for name in ("coulomb_friction", "viscous_friction")
        for side in ("positive", "negative")
    }
    assert "both directions" in found["ekf"]["why_not"]
    assert found["idim-ls"]["position_fit"] > 1 - CLOSE
    assert all(each["assumed_inertia"] is None for each in found.values())


def test_no_result_to_trust_ends_with_1(run: Run, tmp_path: Path) -> None:
    columns = table()
    log = tmp_path / "one_way.csv"
    columns["position [m]"] = 0.1 * columns["time [s]"]
    columns["force [N]"] = columns["force [N]"] * 0 + 1.9
    log.write_text(csv_text(columns))
    outcome = run("compare", log, "--only", "energy")
    assert "None of the estimates can be trusted" in outcome.printed(1)


def test_scenario_is_scored_by_its_truth(run: Run, scenario: Path) -> None:
    page = scenario.with_suffix(".html")
    outcome = run("compare", scenario, *FEW, "--json", "-", "--report", page)
    document = json.loads(outcome.printed())
    assert (document["comparison"], document["runs"], document["samples"]) == ("scenario", 3, 501)
    assert document["truth"]["mass"] == 1.5
    assert document["scenario"]["input"]["frequencies"] == {"value": [0.5, 1.3], "unit": "Hz"}
    mass = document["estimators"][0]["parameters"]["mass"]
    assert mass["runs"] == 3
    assert mass["rmse"] >= abs(mass["bias"])
    assert mass["bound_ratio"] == pytest.approx(mass["rmse"] / document["bound"]["mass"])
    assert "RMSE" in outcome.err
    assert page.exists()


def test_runs_option_takes_precedence(run: Run, scenario: Path) -> None:
    outcome = run("compare", scenario, "--runs", 2, "--only", "idim-ls", "--json", "-")
    assert json.loads(outcome.out)["runs"] == 2


@pytest.mark.slow
def test_effort_delay_is_found(run: Run, scenario: Path) -> None:
    scenario.write_text(SCENARIO.replace("[sensors]", "effort_delay = 1\n[sensors]"))
    page = scenario.with_suffix(".html")
    chosen = ["--only", "maximum-likelihood", "--only", "energy", "--report", page]
    _, found = (
        run("compare", scenario, *chosen, "--largest-delay", 2).printed().split("delay found")
    )
    last = {line.split()[0]: line.split()[-1] for line in found.splitlines() if line.strip()}
    assert last["maximum-likelihood"] == "100.0%"
    assert last["energy"] == "–"
    assert "Delay found" in page.read_text()
    not_sought = run("compare", scenario, "--only", "energy")
    assert "delay found" not in not_sought.out


@pytest.mark.parametrize(("old", "new", "words"), BAD)
def test_bad_scenario(old: str, new: str, words: list[str], run: Run, scenario: Path) -> None:
    assert old in SCENARIO
    scenario.write_text(SCENARIO.replace(old, new))
    run("compare", scenario).refused(str(scenario), *words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--position", "nothing"], ["'nothing'"]),
        (["--only", "magic"], ["'magic'", "energy"]),
        (["--runs", "3"], ["--runs 3", "scenario"]),
        (["--mass", "-1"], ["mass", "-1"]),
        (["--load-mass", "1"], ["load", "stiffness"]),
        (["--per-direction", "--offset"], ["offset", "direction"]),
        (["--largest-delay", "-1"], ["--largest-delay is -1 sample", "0 to 100"]),
        (["--largest-delay", "101"], ["--largest-delay is 101 samples", "0 to 100"]),
        (["--largest-delay", "2", "--only", "energy"], ["2 samples", "maximum-likelihood"]),
        (["--largest-delay", "1.5"], ["--largest-delay", "not a whole number"]),
        (["--unit", "position"], ["--unit position", "position=mm"]),
    ],
)
def test_bad_option(arguments: list[str], words: list[str], run: Run, good_log: Path) -> None:
    run("compare", good_log, *arguments).refused(*words)


def test_useless_option_and_bad_path(run: Run, scenario: Path, tmp_path: Path) -> None:
    assert "log" in run("compare", scenario, "--position", "x").line()
    assert "no such" in run("compare", tmp_path / "no.csv").line()
    assert "no such" in run("compare", tmp_path / "no.toml").line()
    assert "overwrite" in run("compare", scenario, "--json", scenario).line()
    same = tmp_path / "same"
    assert "same file" in run("compare", scenario, "--json", same, "--report", same).line()


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize("seconds", [0.01, 60.0])
def test_a_bar_is_drawn_after_the_quiet_time(
    seconds: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr("sys.stderr", shown := _Terminal())
    end = time.monotonic() + 5.0 / (1.0 + seconds)
    with progress_bar("comparing", quiet_time=seconds):
        while "comparing" not in shown.getvalue() and time.monotonic() < end:
            time.sleep(0.01)
    assert ("comparing" in shown.getvalue()) == (seconds < 1.0)
