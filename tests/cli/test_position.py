"""``stickslip position``: what it prints and writes, and how it refuses what cannot be."""

import json
from collections.abc import Mapping
from functools import partial
from pathlib import Path

import pytest
from scenario_files import refused, scenario_file
from stage_log import Run

from stickslip.control import ExactPulseController
from stickslip.tasks import read_scenario

SCENARIOS = sorted((Path(__file__).parents[2] / "examples" / "scenarios").glob("*.toml"))
UNREACHED = {"pid", "pwc", "pwc_short"}

GOOD = """
[axis]
mass = 150.0
coulomb_friction = 100.0
viscous_friction = 700.0
static_friction = 130.0
[task]
target = 0.001
tolerance = 2e-5
duration = 0.5
sampling_time = 0.01
[controller]
method = "papwc"
effort_limit = 300.0
[guess]
mass = 150.0
coulomb_friction = 80.0
"""

WIDER = ("tolerance = 2e-5", "tolerance = 1e-4")

ESTIMATE = {
    "schema": 1,
    "estimator": "energy",
    "kind": "linear",
    "parameters": {
        "mass": {"value": 150.0, "std": 1.0, "ci95": [148.0, 152.0], "unit": "kg"},
        "coulomb_friction": {"value": 98.0, "std": 1.0, "ci95": [96.0, 100.0], "unit": "N"},
        "viscous_friction": {"value": 690.0, "std": 9.0, "ci95": [672.0, 708.0], "unit": "N s/m"},
    },
    "status": "ok",
    "status_text": "The parameters are identified.",
    "provenance": {"options": {"inertia": None}},
}
LEARNED = {
    "schema": 1,
    "method": "papwc",
    "kind": "linear",
    "values": {
        "gain_1": {"value": 3.3e-5, "unit": "m/(N s)^2"},
        "gain_2": {"value": 0.0033, "unit": "m/(N s^2)"},
    },
    "covariance": [[1e-6, 0.0], [0.0, 1e-6]],
}

# What becomes of the good scenario, and what the line must say.
BAD: dict[str, tuple[list[tuple[str, str]], list[str]]] = {
    "not TOML": ([("[axis]", "[axis")], ["not TOML", "mass = 150.0"]),
    "unknown key": ([("mass = 150.0\nco", "mas = 150.0\nco")], ["[axis]", "'mas'", "'mass'"]),
    "unknown key of all": ([("[axis]", "speed = 1\n[axis]")], ["'speed'", "axis, task"]),
    "to compare on": (
        [("[task]", "[input]")],
        ["this is a scenario to compare estimators on", "stickslip compare"],
    ),
    "unknown table": ([("[task]", "[tasks]")], ["unknown key 'tasks'", "'task'"]),
    "a table that is none": ([("[axis]", "sensors = 3\n[axis]")], ["sensors is 3", "[sensors]"]),
    "missing table": ([("[task]", "[axis.task]")], ["[axis]", "'task'"]),
    "no task": (
        [
            ("\n[task]", ""),
            ("target = 0.001\ntolerance = 2e-5\nduration = 0.5\nsampling_time = 0.01", ""),
        ],
        ["the table [task] is missing"],
    ),
    "missing key": ([("tolerance = 2e-5", "")], ["[task]", "tolerance is missing", "there, in m"]),
    "missing friction": (
        [("viscous_friction = 700.0", "")],
        ["[axis]", "viscous friction", "N s/m"],
    ),
    "a number as text": ([("150.0\nco", "'heavy'\nco")], ["[axis]", "mass is 'heavy'", "number"]),
    "negative mass": ([("mass = 150.0", "mass = -1.0")], ["[axis]", "mass is -1 kg", "positive"]),
    "static below Coulomb": ([("130.0", "90.0")], ["[axis]", "90 N", "at least the Coulomb"]),
    "static below Coulomb, by its own name": (
        [("130.0", "90.0")],
        ["static_friction is 90 N, below the Coulomb friction, 100 N;"],
    ),
    "static below Coulomb in one direction": (
        [
            (
                "coulomb_friction = 100.0",
                "coulomb_friction_positive = 100.0\ncoulomb_friction_negative = 140.0",
            )
        ],
        ["static_friction is 130 N, below the Coulomb friction of that direction, 140 N;"],
    ),
    "no tolerance, in its unit": ([("tolerance = 2e-5", "tolerance = 0.0")], ["is 0 m, it must"]),
    "a rotary axis without friction to stop it": (
        [
            ("[axis]\nmass", "[axis]\nkind = 'rotary'\ninertia"),
            ("[guess]\nmass", "[guess]\ninertia"),
            ("coulomb_friction = 100.0", "coulomb_friction = 0.0"),
        ],
        ["[axis]", "Coulomb friction is 0 N m in", "does not stop", "the friction that there is"],
    ),
    "an offset between Coulomb and static friction": (
        [("[task]", "offset = 115.0\n[task]")],
        [
            "[axis]",
            "100 N in the negative direction",
            "offset 115 N",
            "does not stop",
            "method pid",
        ],
    ),
    "a rest longer than the move": (
        [("[guess]", "rest_samples = 100000000\n[guess]")],
        ["[controller]", "rest_samples is 100000000", "50 samples", "lengthen the duration"],
    ),
    "a usual rest longer than the move": (
        [
            ("[controller]", "[sensors]\nencoder_step = 1e-6\n[controller]"),
            ("duration = 0.5", "duration = 0.2"),
        ],
        ["rest_samples is 10 by default", "20 samples"],
    ),
    "a rest of one sample on an encoder": (
        [
            ("[controller]", "[sensors]\nencoder_step = 1e-6\n[controller]"),
            ("[guess]", "rest_samples = 1\n[guess]"),
        ],
        ["[controller]", "rest_samples is 1, it must be at least 2"],
    ),
    "too much bandwidth": (
        [('"papwc"', '"pid"\nbandwidth = 60.0'), ("coulomb_friction = 80.0", "")],
        ["[controller]", "60 Hz", "less bandwidth, or shorten the sampling time"],
    ),
    "an estimate without a name": (
        [("[guess]", "[guess]\nestimate = ''")],
        ["[guess]", "estimate is empty"],
    ),
    "a direction alone": (
        [("coulomb_friction = 100.0", "coulomb_friction_positive = 100.0")],
        ["coulomb_friction_positive", "without coulomb_friction_negative"],
    ),
    "both and each": (
        [("static_friction = 130.0", "static_friction = 130.0\nstatic_friction_positive = 140.0")],
        ["static_friction", "both directions", "apart"],
    ),
    "inertia of a linear axis": (
        [("[axis]", "[axis]\ninertia = 2.0")],
        ["inertia", "linear", "kg"],
    ),
    "kind": ([("[axis]", "[axis]\nkind = 'round'")], ["'round'", "linear", "rotary"]),
    "effort below the breakaway": (
        [("effort_limit = 300.0", "effort_limit = 120.0")],
        ["[controller]", "120 N", "130 N", "allow more than 130 N"],
    ),
    "effort below breakaway and gravity": (
        [("effort_limit = 300.0", "effort_limit = 200.0"), ("[task]", "offset = 90.0\n[task]")],
        ["200 N", "positive", "220 N", "offset 90 N"],
    ),
    "an axis that slides away": (
        [("[task]", "offset = 140.0\n[task]")],
        ["[axis]", "offset is 140 N", "slides"],
    ),
    "effort below the guess": (
        [("coulomb_friction = 80.0", "coulomb_friction = 310.0")],
        ["[guess]", "effort_limit is 300 N", "310 N", "coulomb_friction from the scenario"],
    ),
    "no sampling": ([("sampling_time = 0.01", "sampling_time = 0")], ["sampling_time is 0 s"]),
    "no target": ([("target = 0.001", "")], ["[task]", "neither target nor targets"]),
    "two targets": (
        [("target = 0.001", "target = 0.001\ntargets = [0.1]")],
        ["[task]", "both given"],
    ),
    "a short task": ([("duration = 0.5", "duration = 0.05")], ["duration is 0.05 s", "10 samples"]),
    "a long task": ([("duration = 0.5", "duration = 1e9")], ["1e+11 samples", "2e+06"]),
    "no runs": ([("[controller]", "runs = 0\n[controller]")], ["runs is 0"]),
    "half a run": ([("[controller]", "runs = 1.5\n[controller]")], ["runs is 1.5"]),
    "a target that is none": ([("target = 0.001", "target = nan")], ["target is nan", "finite"]),
    "tolerance below the encoder": (
        [("[controller]", "[sensors]\nencoder_step = 1e-4\n[controller]")],
        ["[task]", "2e-05 m", "0.0001 m", "encoder"],
    ),
    "tolerance below the noise": (
        [("[controller]", "[sensors]\nposition_noise = 1e-4\n[controller]")],
        ["[task]", "2e-05 m", "tell a position", "rest_samples"],
    ),
    "noise of no sensor": (
        [("[controller]", "[sensors]\nvelocity = 'none'\nvelocity_noise = 1e-4\n[controller]")],
        ["[sensors]", "velocity_noise", "where no velocity is measured"],
    ),
    "negative seed": ([("[controller]", "[sensors]\nseed = -1\n[controller]")], ["seed is -1"]),
    "unknown method": ([("papwc", "magic")], ["'magic'", "'exact'", "'pid-reset'"]),
    "setting of another method": (
        [("[guess]", "dither_amplitude = 50.0\n[guess]")],
        ["[controller]", "dither_amplitude", "papwc", "use method 'pid-dither'"],
    ),
    "guess of another method": (
        [("[guess]", "[guess]\nviscous_friction = 5.0")],
        ["[guess]", "viscous_friction", "papwc", "no use"],
    ),
    "a guess without a mass": (
        [("[guess]\nmass = 150.0", "[guess]")],
        ["[guess]", "mass is missing", "kg"],
    ),
    "a negative guess": ([("80.0", "-80.0")], ["[guess]", "-80 N", "negative"]),
    "pulses longer than the task": (
        [("[guess]", "longest_width = 2.0\n[guess]")],
        ["longest_width is 2 s", "0.5 s"],
    ),
    "pulses shorter than a sample": (
        [("[guess]", "longest_width = 0.001\n[guess]")],
        ["longest_width is 0.001 s", "0.01 s"],
    ),
    "a gain too large": ([("[guess]", "gain = 2.5\n[guess]")], ["gain is 2.5", "2"]),
    "gains without a velocity": (
        [
            ('method = "papwc"', 'method = "pd"\nposition_gain = 1e4\nvelocity_gain = 1e3'),
            ("[controller]", "[sensors]\nvelocity = 'none'\n[controller]"),
            ("[guess]\nmass = 150.0\ncoulomb_friction = 80.0", ""),
        ],
        ["[controller]", "velocity", "filter_time"],
    ),
    "no gains": (
        [('"papwc"', '"pid"'), ("[guess]\nmass = 150.0\ncoulomb_friction = 80.0", "")],
        ["position_gain is missing", "bandwidth"],
    ),
    "gains and bandwidth": (
        [('"papwc"', '"pid"\nbandwidth = 2.0\nposition_gain = 1e4')],
        ["bandwidth and position_gain", "both"],
    ),
    "dither without a frequency": (
        [('"papwc"', '"pid-dither"\nbandwidth = 2.0\ndither_amplitude = 50.0')],
        ["dither_frequency is missing", "pid-dither"],
    ),
    "dither too fast": (
        [
            (
                '"papwc"',
                '"pid-dither"\nbandwidth = 2.0\ndither_amplitude = 50.0\ndither_frequency = 80.0',
            ),
            ("coulomb_friction = 80.0", ""),
        ],
        ["80 Hz", "50 Hz"],
    ),
    "a rest of no samples": (
        [("[guess]", "rest_samples = 0\n[guess]")],
        ["rest_samples is 0", "1 or more"],
    ),
    "an estimate for gains": (
        [
            ('"papwc"', '"pd"\nposition_gain = 1e4\nvelocity_gain = 1e3'),
            ("[guess]\nmass = 150.0\ncoulomb_friction = 80.0", "[guess]\nestimate = 'a.json'"),
        ],
        ["[guess]", "estimate", "pd", "no use"],
    ),
    "no estimate file": (
        [("[guess]", "[guess]\nestimate = 'none.json'")],
        ["[guess]", "none.json", "no such file"],
    ),
    "estimate that is no JSON": (
        [("[guess]", "[guess]\nestimate = 'scenario.toml'")],
        ["scenario.toml", "not JSON", "stickslip wrote"],
    ),
    "learned and guessed": (
        [("[guess]", "[guess]\nlearned = 'learned.json'")],
        ["[guess]", "learned", "mass, coulomb_friction"],
    ),
}

# What becomes of the good estimate, given in place of all guesses, and what the line must say.
BAD_ESTIMATES: dict[str, tuple[dict[str, object], list[str]]] = {
    "another kind": ({"kind": "rotary"}, ["estimate.json, kind", "rotary", "linear"]),
    "not trusted": ({"status": "poor_fit"}, ["estimate.json, status", "'poor_fit'", "identified."]),
    "another schema": ({"schema": 7}, ["estimate.json, schema", "7", "reads 1"]),
    "not identified": (
        {"parameters": {**ESTIMATE["parameters"], "mass": {"value": None, "unit": "kg"}}},  # type: ignore[dict-item]
        ["[guess]", "parameters.mass", "not identified", "beside"],
    ),
    "no such parameter": ({"parameters": {}}, ["mass is missing", "[guess]"]),
    "parameters of another form": ({"parameters": 3}, ["estimate.json, parameters"]),
    "another unit": (
        {"parameters": {**ESTIMATE["parameters"], "mass": {"value": 1.0, "unit": "g"}}},  # type: ignore[dict-item]
        ["parameters.mass", "1.0 g", "kg"],
    ),
    "a flexible arm": (
        {
            "parameters": {"coulomb_friction": {"value": 1.0, "unit": "N"}},
            "provenance": {"options": {"inertia": 1.0, "load_inertia": 1.0}},
        },
        ["flexible arm", "give the moving mass"],
    ),
}

BAD_LEARNED: dict[str, tuple[dict[str, object], list[str]]] = {
    "another method": ({"method": "pwc"}, ["learned.json, method", "pwc", "papwc"]),
    "another kind": (
        {
            "kind": "rotary",
            "values": {
                "gain_1": {"value": 3.3e-5, "unit": "rad/(N m s)^2"},
                "gain_2": {"value": 0.0033, "unit": "rad/(N m s^2)"},
            },
        },
        ["learned.json, kind", "rotary", "linear"],
    ),
    "another schema": ({"schema": 2}, ["learned.json, schema", "2"]),
    "nothing learned": ({"values": {}}, ["learned.json", "gain_1", "missing"]),
    "no covariance": ({"covariance": [[1.0]]}, ["learned.json, covariance", "(1, 1)"]),
}


written = partial(scenario_file, GOOD)


@pytest.mark.parametrize("case", BAD)
def test_a_bad_scenario_is_refused_in_one_line(case: str, run: Run, tmp_path: Path) -> None:
    changes, words = BAD[case]
    refused(run, written(tmp_path, changes), words)


@pytest.mark.parametrize("case", BAD_ESTIMATES)
def test_a_bad_estimate_is_refused_in_one_line(case: str, run: Run, tmp_path: Path) -> None:
    changes, words = BAD_ESTIMATES[case]
    (tmp_path / "estimate.json").write_text(json.dumps(ESTIMATE | changes))
    guess = "[guess]\nmass = 150.0\ncoulomb_friction = 80.0"
    refused(run, written(tmp_path, [(guess, '[guess]\nestimate = "estimate.json"')]), words)


@pytest.mark.parametrize("case", BAD_LEARNED)
def test_a_bad_file_of_what_was_learned_is_refused(case: str, run: Run, tmp_path: Path) -> None:
    changes, words = BAD_LEARNED[case]
    (tmp_path / "learned.json").write_text(json.dumps(LEARNED | changes))
    guess = "[guess]\nmass = 150.0\ncoulomb_friction = 80.0"
    refused(run, written(tmp_path, [(guess, '[guess]\nlearned = "learned.json"')]), words)


def test_a_byte_order_mark_is_no_fault(run: Run, tmp_path: Path) -> None:
    path = written(tmp_path, [WIDER])
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())
    assert run("position", path).code == 0


def test_feedback_needs_no_friction_at_all(run: Run, tmp_path: Path) -> None:
    gains = 'method = "pd"\nposition_gain = 1e4\nvelocity_gain = 2e3'
    changes = [
        ('method = "papwc"', gains),
        ("[guess]\nmass = 150.0\ncoulomb_friction = 80.0", ""),
        ("coulomb_friction = 100.0", "coulomb_friction = 0.0"),
        ("static_friction = 130.0", "static_friction = 0.0"),
        ("duration = 0.5", "duration = 5.0"),
    ]
    outcome = run("position", written(tmp_path, changes))
    assert outcome.code == 0, outcome.err


def uncertainties(
    folder: Path, std: Mapping[str, object], guess: str = ""
) -> tuple[float, float, str]:
    """Return those of mass and friction that a controller begins with, and the notes."""
    parameters = {
        name: {**entry, "std": std.get(name, entry["std"])}
        for name, entry in ESTIMATE["parameters"].items()  # type: ignore[attr-defined]
    }
    (folder / "estimate.json").write_text(json.dumps(ESTIMATE | {"parameters": parameters}))
    old = "[guess]\nmass = 150.0\ncoulomb_friction = 80.0"
    changes = [(old, f'[guess]\nestimate = "estimate.json"\n{guess}'), ("papwc", "exact")]
    scenario = read_scenario(written(folder, changes)).scenario
    built = scenario.build(folder)
    controller = built.controller
    assert isinstance(controller, ExactPulseController)
    return controller.mass_uncertainty, controller.friction_uncertainty, " ".join(built.notes)


def test_an_estimate_tells_how_sure_it_is(tmp_path: Path) -> None:
    std = {"mass": 4.5, "coulomb_friction": 9.8, "viscous_friction": 138.0}
    # Of friction the larger one; friction changes after the log, and a guess is no less sure
    for told, expected in (
        (std, (0.03, 0.2)),
        ({"mass": 0.1, "viscous_friction": 1.0}, (0.01, 0.05)),
        ({"mass": 80.0, "viscous_friction": 1e4}, (0.05, 0.5)),
        ({"mass": None, "coulomb_friction": "?"}, (0.05, 0.5)),
    ):
        assert uncertainties(tmp_path, told)[:2] == pytest.approx(expected)
    _, _, notes = uncertainties(tmp_path, std)
    assert "estimate.json it begins with mass_uncertainty 0.03 and friction_uncertainty" in notes


def test_what_the_scenario_says_comes_before_how_sure_an_estimate_is(tmp_path: Path) -> None:
    std = {"mass": 4.5, "coulomb_friction": 9.8}
    *sure, notes = uncertainties(tmp_path, std, "friction_uncertainty = 0.3")
    assert sure == pytest.approx([0.03, 0.3])
    assert "friction_uncertainty" not in notes
    # A friction of the scenario's own is none of the estimate
    *sure, _ = uncertainties(tmp_path, std, "coulomb_friction = 98.0")
    assert sure == pytest.approx([0.03, 0.5])


def test_a_missing_scenario_is_refused(run: Run, tmp_path: Path) -> None:
    line = run("position", tmp_path / "no.toml").line()
    assert "no such scenario file" in line
    assert "check the path" in line


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
def test_an_output_that_cannot_be_is_found_before_the_run(
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
    guess = "[guess]\nmass = 150.0\ncoulomb_friction = 80.0"
    scenario = written(tmp_path, [(guess, '[guess]\nestimate = "estimate.json"')])
    before = {path: path.read_text() for path in tmp_path.iterdir()}
    line = run("position", scenario, option, tmp_path / place).line()
    assert option in line
    assert problem in line
    assert {path: path.read_text() for path in tmp_path.iterdir()} == before


def test_two_outputs_in_one_file_are_refused(run: Run, tmp_path: Path) -> None:
    same = tmp_path / "same"
    line = run("position", written(tmp_path, []), "--json", same, "--learned", same).line()
    assert "--json and --learned name the same file" in line


def test_nothing_learned_cannot_be_saved(run: Run, tmp_path: Path) -> None:
    changes = [('"papwc"', '"pid"\nbandwidth = 2.0'), ("coulomb_friction = 80.0", "")]
    line = run(
        "position", written(tmp_path, changes), "--learned", tmp_path / "learned.json"
    ).line()
    assert "learns nothing" in line
    assert not (tmp_path / "learned.json").exists()


@pytest.mark.parametrize("scenario", SCENARIOS, ids=lambda path: path.stem)
def test_every_scenario_of_the_examples_ends_as_it_says(
    scenario: Path, run: Run, tmp_path: Path
) -> None:
    files = {name: tmp_path / name for name in ("a.json", "a.html")}
    outcome = run("position", scenario, "--json", files["a.json"], "--report", files["a.html"])
    assert outcome.code == (1 if scenario.stem in UNREACHED else 0), outcome.err
    document = json.loads(files["a.json"].read_text())
    assert document["ending"] == ("hunting" if scenario.stem in UNREACHED else "reached")
    assert document["name"] in outcome.out
    assert document["ending"] in outcome.out
    assert "a.html" in outcome.out
    assert files["a.html"].stat().st_size > 5e5


def test_a_covariance_of_another_axis_is_said(run: Run, tmp_path: Path) -> None:
    said = "hardly learns"
    assert said not in run("position", written(tmp_path, [WIDER])).out
    light = [WIDER, ("mass = 150.0", "mass = 1.0"), ("700.0", "5.0")]
    # The report's 1e-5 times (150/1)^2
    outcome = run("position", written(tmp_path, light)).out
    assert said in outcome
    assert "alike here is 0.2." in " ".join(outcome.split())
    told = ("[guess]", "initial_covariance = 0.2\n[guess]")
    assert said not in run("position", written(tmp_path, [*light, told])).out


def test_an_offset_in_the_frictions_is_said(run: Run, tmp_path: Path) -> None:
    said = "constant offset in it"
    exact = [("papwc", "exact"), ("= 80.0", "= 80.0\nviscous_friction = 500.0")]
    offset = ("[task]", "offset = 20.0\n[task]")
    assert said not in run("position", written(tmp_path, exact)).out
    assert said in run("position", written(tmp_path, [*exact, offset])).out
    # The mean of both directions has none
    assert said not in run("position", written(tmp_path, [WIDER, offset])).out


def test_what_was_learned_is_gone_on_from(run: Run, tmp_path: Path) -> None:
    learned = tmp_path / "learned.json"
    first = run("position", written(tmp_path, [WIDER]), "--learned", learned, "--json", "-")
    assert first.code == 0, first.err
    guess = "[guess]\nmass = 150.0\ncoulomb_friction = 80.0"
    scenario = written(tmp_path, [WIDER, (guess, '[guess]\nlearned = "learned.json"')])
    before = json.loads(learned.read_text())
    # In place: what it began with is replaced by what it ended with
    second = run("position", scenario, "--learned", learned, "--json", "-")
    assert second.code == 0, second.err
    begun, ended = (json.loads(each.out)["runs"][0]["estimates"] for each in (second, first))
    for name in ("gain_1", "gain_2"):
        assert begun[name][0] == ended[name][-1] == before["values"][name]["value"]
    assert json.loads(learned.read_text()) != before
    assert "learned learned.json" in json.loads(second.out)["believed"].values()


def test_an_estimate_of_identify_flows_in(run: Run, good_log: Path, tmp_path: Path) -> None:
    estimate = tmp_path / "estimate.json"
    assert run("identify", good_log, "--json", estimate).code == 0
    found = json.loads(estimate.read_text())["parameters"]
    scenario = tmp_path / "stage.toml"
    scenario.write_text(
        "[axis]\nmass = 3.0\ncoulomb_friction = 1.5\nviscous_friction = 4.0\noffset = 0.2\n"
        "static_friction = 1.8\n[task]\ntarget = 0.01\ntolerance = 1e-5\nduration = 2.0\n"
        'sampling_time = 0.01\n[controller]\nmethod = "exact"\neffort_limit = 10.0\n'
        '[guess]\nestimate = "estimate.json"\nstatic_friction = 1.7\nmass_uncertainty = 0.01\n'
    )
    outcome = run("position", scenario, "--json", "-")
    assert outcome.code == 0, outcome.err
    document = json.loads(outcome.out)
    first = {name: values[0] for name, values in document["runs"][0]["estimates"].items()}
    assert first["mass"] == pytest.approx(found["mass"]["value"])
    offset, coulomb = found["offset"]["value"], found["coulomb_friction"]["value"]
    assert first["coulomb_friction_positive"] == pytest.approx(coulomb + offset)
    assert first["coulomb_friction_negative"] == pytest.approx(coulomb - offset)
    assert first["static_friction_positive"] == pytest.approx(1.7 + offset)
    assert document["believed"]["mass"] == "estimate estimate.json"
    assert document["believed"]["static_friction"] == "the scenario"


def test_a_known_mass_is_taken_from_the_options_of_the_estimate(
    run: Run, good_log: Path, tmp_path: Path
) -> None:
    estimate = tmp_path / "estimate.json"
    assert run("identify", good_log, "--mass", 3, "--json", estimate).code == 0
    assert "mass" not in json.loads(estimate.read_text())["parameters"]
    stage = {
        "mass = 150.0\ncoulomb_friction = 100.0": "mass = 3.0\ncoulomb_friction = 1.5",
        "= 700.0": "= 4.0",
        "= 130.0": "= 1.8",
        "= 300.0": "= 10.0",
        "[guess]\nmass = 150.0\ncoulomb_friction = 80.0": '[guess]\nestimate = "estimate.json"',
    }
    changes = list(stage.items())
    document = json.loads(run("position", written(tmp_path, changes), "--json", "-").out)
    assert document["runs"][0]["estimates"]["gain_2"][0] == pytest.approx(1.0 / (2.0 * 3.0))


def test_the_help_says_what_it_does(run: Run) -> None:
    outcome = run("position", "--help")
    assert outcome.code == 0
    for word in ("SCENARIO", "--json", "--report", "--learned", "Exit code 0", "Examples:"):
        assert word in outcome.out
