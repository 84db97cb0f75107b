"""``stickslip position`` refuses what it cannot use, in one line that helps."""

import json
from pathlib import Path
from typing import Any

import pytest
from scenario_files import (
    ARM,
    ARM_LEARNED,
    AXIS,
    ESTIMATE,
    FRICTION,
    LEARNED,
    PARAMETERS,
    refused,
    scenario_file,
)
from stage_log import Run

PD = "method = 'pd', position_gain = 1e4, velocity_gain = 1e3"
NO_ARM = "axis = {load_mass = 'absent', stiffness = 'absent'}"

# Changes to a good scenario of a rigid axis, and parts of the message.
BAD_AXIS = [
    ("axis.mas = 1.0", ["[axis]", "'mas'", "'mass'"]),
    ("speed = 1", ["'speed'", "axis, task"]),
    ("task = 'absent'\ninput = {}", ["a scenario to compare estimators on", "stickslip compare"]),
    ("task = 'absent'\ntasks = {}", ["unknown key 'tasks'", "'task'"]),
    ("sensors = 3", ["sensors is 3", "[sensors]"]),
    ("axis.task = {}", ["[axis]", "'task'"]),
    ("task = 'absent'", ["the table [task] is missing"]),
    ("task.tolerance = 'absent'", ["[task]", "tolerance is missing", "there, in m"]),
    ("axis.viscous_friction = 'absent'", ["[axis]", "viscous_friction is missing", "N s/m"]),
    ("axis.mass = 'heavy'", ["[axis]", "mass is 'heavy'", "see docs/reference/scenario.md"]),
    ("axis.mass = -1.0", ["[axis]", "mass is -1 kg", "positive"]),
    (
        "axis.static_friction = 90.0",
        ["static_friction is 90 N, below the Coulomb friction, 100 N;"],
    ),
    (
        "axis = {coulomb_friction = 'absent', coulomb_friction_positive = 100.0, "
        "coulomb_friction_negative = 140.0}",
        ["static_friction is 130 N, below the Coulomb friction, 140 N;"],
    ),
    ("task.tolerance = 0.0", ["is 0 m, it must"]),
    (
        "axis = {kind = 'rotary', mass = 'absent', inertia = 1.0, coulomb_friction = 0.0}\n"
        "guess = {mass = 'absent', inertia = 1.0}",
        [
            "[axis]",
            "Coulomb friction is 0 N m in",
            "does not stop",
            "the Coulomb friction of the axis",
        ],
    ),
    (
        "axis.offset = 115.0",
        ["[axis]", "100 N in the negative direction", "offset 115 N", "not stop", "method pid"],
    ),
    (
        "controller.rest_samples = 100000000",
        ["[controller]", "rest_samples is 100000000", "50 samples", "lengthen the duration"],
    ),
    (
        "sensors.encoder_step = 1e-6\ntask.duration = 0.2",
        ["rest_samples is 10 by default", "20 samples"],
    ),
    (
        "sensors.encoder_step = 1e-6\ncontroller.rest_samples = 1",
        ["[controller]", "rest_samples is 1, it must be at least 2"],
    ),
    ("controller.rest_samples = 0", ["rest_samples is 0", "1 or more"]),
    (
        "controller = {method = 'pid', bandwidth = 60.0}\nguess.coulomb_friction = 'absent'",
        ["[controller]", "60 Hz", "less bandwidth, or shorten the sampling time"],
    ),
    ("guess.estimate = ''", ["[guess]", "estimate is empty"]),
    (
        "axis = {coulomb_friction = 'absent', coulomb_friction_positive = 100.0}",
        ["coulomb_friction_positive", "without coulomb_friction_negative"],
    ),
    ("axis.static_friction_positive = 140.0", ["static_friction", "both directions", "apart"]),
    ("axis.inertia = 2.0", ["inertia", "linear", "kg"]),
    ("axis.kind = 'round'", ["'round'", "linear", "rotary"]),
    ("controller.effort_limit = 120.0", ["[controller]", "120 N", "allow more than 130 N"]),
    (
        "controller.effort_limit = 200.0\naxis.offset = 90.0",
        ["200 N", "positive", "220 N", "offset 90 N"],
    ),
    ("axis.offset = 140.0", ["[axis]", "offset is 140 N", "slides"]),
    (
        "guess.coulomb_friction = 310.0",
        ["[guess]", "effort_limit is 300 N", "310 N", "coulomb_friction from the scenario"],
    ),
    ("task.sampling_time = 0", ["sampling_time is 0 s"]),
    ("task.target = 'absent'", ["[task]", "neither target nor targets"]),
    ("task.targets = [0.1]", ["[task]", "both given"]),
    ("task.duration = 0.05", ["duration is 0.05 s", "10 samples"]),
    ("task.duration = 1e9", ["1e+11 samples", "2e+06"]),
    ("task.runs = 0", ["runs is 0"]),
    ("task.runs = 1.5", ["runs is 1.5"]),
    ("task.target = nan", ["target is nan", "finite"]),
    ("sensors.encoder_step = 1e-4", ["[task]", "2e-05 m", "0.0001 m", "encoder"]),
    (
        "sensors.position_noise = 1e-4",
        ["[task]", "2e-05 m", "determine a position", "rest_samples"],
    ),
    (
        "sensors = {velocity = 'none', velocity_noise = 1e-4}",
        ["[sensors]", "velocity_noise", "where no velocity is measured"],
    ),
    ("sensors.seed = -1", ["seed is -1"]),
    ("controller.method = 'magic'", ["'magic'", "'exact'", "'pid-reset'"]),
    ("guess.viscous_friction = 5.0", ["[guess]", "viscous_friction", "papwc", "no use"]),
    ("guess.mass = 'absent'", ["[guess]", "mass is missing", "kg"]),
    ("guess.coulomb_friction = -80.0", ["[guess]", "-80 N", "negative"]),
    ("controller.longest_width = 2.0", ["longest_width is 2 s", "0.5 s"]),
    ("controller.longest_width = 0.001", ["longest_width is 0.001 s", "0.01 s"]),
    ("controller.gain = 2.5", ["gain is 2.5", "2"]),
    (
        f"controller = {{{PD}}}\nsensors.velocity = 'none'\nguess.only = true",
        ["[controller]", "velocity", "filter_time"],
    ),
    (
        "controller.method = 'pid'",
        ["position_gain is missing, and method 'pid' needs it", "in N/m, or give a bandwidth"],
    ),
    (
        "controller = {method = 'pd', velocity_gain = 1e3}",
        ["position_gain is missing, and method 'pd' needs it", "in N/m"],
    ),
    (
        "controller = {method = 'pid', bandwidth = 2.0, position_gain = 1e4}",
        ["bandwidth and position_gain", "both"],
    ),
    (
        "controller = {method = 'pid-dither', bandwidth = 2.0, dither_amplitude = 50.0}",
        ["dither_frequency is missing", "pid-dither"],
    ),
    (
        "controller = {method = 'pid-dither', bandwidth = 2.0, dither_amplitude = 50.0, "
        "dither_frequency = 80.0}\nguess.coulomb_friction = 'absent'",
        ["80 Hz", "50 Hz"],
    ),
    (
        f"controller = {{{PD}}}\nguess = {{only = true, estimate = 'a.json'}}",
        ["[guess]", "estimate", "pd", "no use"],
    ),
    ("guess.estimate = 'none.json'", ["[guess]", "none.json", "no such file"]),
    ("guess.estimate = 'scenario.toml'", ["scenario.toml", "not JSON", "stickslip wrote"]),
    ("guess.learned = 'learned.json'", ["[guess]", "learned", "mass, coulomb_friction"]),
]

# Likewise of a flexible arm.
BAD_ARM = [
    (
        "controller.method = 'exact'",
        ["[controller]", "method exact moves a rigid axis", "landing or feedback"],
    ),
    ("axis.load_mass = 'absent'", ["[axis]", "load_mass is missing", "in kg"]),
    ("axis.stiffness = 'absent'", ["[axis]", "stiffness is missing", "in N/m"]),
    ("axis.stiffness = 0.0", ["[axis]", "stiffness is 0 N/m", "positive"]),
    ("axis.load_mass = -1.0", ["[axis]", "load_mass is -1 kg", "positive"]),
    (
        "axis = {load_mass = 'absent', load_inertia = 1.0}",
        ["[axis]", "load_inertia", "linear", "load_mass [kg]"],
    ),
    (
        f"{NO_ARM}\ncontroller.method = 'feedback'",
        ["[controller]", "method feedback", "rigid", "landing or pd", "load_mass and stiffness"],
    ),
    (f"{NO_ARM}\ncontroller.method = 'absent'", ["[guess]", "mass is missing", "in kg"]),
    (
        f"{NO_ARM}\ncontroller.most_series = 3",
        ["[controller]", "most_series", "landing", "a rigid axis"],
    ),
    (
        f"{NO_ARM}\nsensors.velocity = 'none'",
        ["[sensors]", "velocity is none", "landing", "exact"],
    ),
    (
        f"{NO_ARM}\nguess = {{mass = 1.0, arm_uncertainty = 0.02}}",
        ["[guess]", "arm_uncertainty", "landing", "no use"],
    ),
    (
        f"{NO_ARM}\ncontroller.method = 'exact'\n"
        "guess = {mass = 1.0, viscous_friction = 0.1, stiffness = 1.0}",
        ["[guess]", "stiffness is given", "exact", "no use"],
    ),
    ("controller.longest_width = 0.1", ["[controller]", "longest_width", "landing", "a flexible"]),
    (
        "controller.method = 'feedback'\nguess.arm_uncertainty = 0.02",
        ["[guess]", "arm_uncertainty", "feedback", "no use"],
    ),
    ("guess.arm_uncertainty = -0.02", ["[guess]", "arm_uncertainty is -0.02"]),
    ("axis.stifness = 1.0", ["[axis]", "'stifness'", "'stiffness'"]),
    ("controller.effort_limit = 0.17", ["[controller]", "0.17 N", "allow more than 0.18 N"]),
    (
        "guess.static_friction = 1.2",
        ["[guess]", "effort_limit is 1 N", "1.2 N to free mass 1", "guess less"],
    ),
    ("axis.offset = 0.3", ["[axis]", "offset is 0.3 N", "balance the offset"]),
    ("sensors.velocity = 'none'", ["[sensors]", "velocity", "both its masses"]),
    ("sensors.position_noise = 1e-3", ["[task]", "1e-05 m", "half a swing", "better sensors"]),
    ("controller.position_gain = 1.0", ["[controller]", "velocity_gain is missing", "or neither"]),
    ("controller.max_idle_pulses = 3", ["[controller]", "max_idle_pulses", "landing", "leave it"]),
    (
        "controller = {method = 'feedback', most_series = 3}",
        ["most_series", "feedback", "'tracked' or 'landing'"],
    ),
    ("controller.most_series = 0", ["most_series is 0", "at least 1"]),
    ("controller.longest_wait = -1.0", ["-1 s", "positive"]),
    (
        "controller.method = 'feedback'\ntask.duration = 2.0",
        ["[task]", "duration is 2 s", "the reference takes", "more time"],
    ),
    ("guess.mass_uncertainty = 0.1", ["[guess]", "mass_uncertainty", "no use"]),
    ("guess.mass = 0.0", ["[guess]", "mass is 0 kg", "positive"]),
    ("guess.static_friction = 0.01", ["0.01 N", "0.08 N", "at least the Coulomb"]),
    ("guess.learned = 'learned.json'", ["[guess]", "learned is given beside coulomb_friction"]),
    ("guess = {only = true, learned = 'none.json'}", ["none.json", "no such file"]),
]

# Changes to a good file that the scenario names, and parts of the message.
BAD_ESTIMATES = [
    ({"kind": "rotary"}, ["estimate.json, kind", "rotary", "linear"]),
    ({"status": "poor_fit"}, ["estimate.json, status", "'poor_fit'", "identified."]),
    ({"schema": 7}, ["estimate.json, schema", "7", "reads 1"]),
    (
        {"parameters": PARAMETERS | {"mass": {"value": None, "unit": "kg"}}},
        ["[guess]", "parameters.mass", "not identified", "beside"],
    ),
    ({"parameters": {}}, ["mass is missing", "[guess]"]),
    ({"parameters": 3}, ["estimate.json, parameters"]),
    (
        {"parameters": PARAMETERS | {"mass": {"value": 1.0, "unit": "g"}}},
        ["parameters.mass", "1.0 g", "kg"],
    ),
    (
        {
            "parameters": {"coulomb_friction": {"value": 1.0, "unit": "N"}},
            "provenance": {"options": {"inertia": 1.0, "load_inertia": 1.0}},
        },
        ["flexible arm", "give the moving mass"],
    ),
]
ROTARY = {
    "gain_1": {"value": 3.3e-5, "unit": "rad/(N m s)^2"},
    "gain_2": {"value": 0.0033, "unit": "rad/(N m s^2)"},
}
BAD_LEARNED = [
    (AXIS, LEARNED | {"method": "pwc"}, ["learned.json, method", "pwc", "papwc"]),
    (AXIS, LEARNED | {"kind": "rotary", "values": ROTARY}, [".json, kind", "rotary", "linear"]),
    (AXIS, LEARNED | {"schema": 2}, ["learned.json, schema", "2"]),
    (AXIS, LEARNED | {"values": {}}, ["learned.json", "gain_1", "missing"]),
    (AXIS, LEARNED | {"covariance": [[1.0]]}, ["learned.json, covariance", "(1, 1)"]),
    (AXIS, ARM_LEARNED, ["learned.json, method", "landing", "papwc"]),
    (ARM, ARM_LEARNED | {"method": "exact"}, [".json, method", "method 'exact'", "has 'landing'"]),
    (ARM, ARM_LEARNED | {"kind": "rotary", "values": {}}, [".json, kind", "rotary", "linear"]),
    (ARM, ARM_LEARNED | {"values": {}}, ["learned.json", "coulomb_friction is missing"]),
    (
        ARM,
        ARM_LEARNED | {"values": FRICTION | {"static_friction": {"value": 1.6, "unit": "N"}}},
        ["learned.json", "effort_limit is 1 N", "1.6 N"],
    ),
]


@pytest.mark.parametrize(
    ("good", "changes", "words"),
    [(AXIS, *case) for case in BAD_AXIS] + [(ARM, *case) for case in BAD_ARM],
    ids=[changes for changes, _ in BAD_AXIS] + [f"arm: {changes}" for changes, _ in BAD_ARM],
)
def test_bad_scenario(
    good: dict[str, Any], changes: str, words: list[str], run: Run, tmp_path: Path
) -> None:
    refused(run, scenario_file(good, tmp_path, changes), words)


def test_file_that_is_not_toml(run: Run, tmp_path: Path) -> None:
    (tmp_path / "scenario.toml").write_text("[axis\nmass = 150.0")
    refused(run, tmp_path / "scenario.toml", ["not TOML", "mass = 150.0"])


@pytest.mark.parametrize(("changes", "words"), BAD_ESTIMATES)
def test_bad_estimate(changes: dict[str, Any], words: list[str], run: Run, tmp_path: Path) -> None:
    (tmp_path / "estimate.json").write_text(json.dumps(ESTIMATE | changes))
    guess = "guess = {only = true, estimate = 'estimate.json'}"
    refused(run, scenario_file(AXIS, tmp_path, guess), words)


@pytest.mark.parametrize(("good", "learned", "words"), BAD_LEARNED)
def test_bad_file_of_learned_values(
    good: dict[str, Any], learned: dict[str, Any], words: list[str], run: Run, tmp_path: Path
) -> None:
    (tmp_path / "learned.json").write_text(json.dumps(learned))
    guess = "guess = {only = true, learned = 'learned.json'}"
    refused(run, scenario_file(good, tmp_path, guess), words)


@pytest.mark.parametrize(
    ("size", "guess", "words"),
    [
        (5, "stiffness = 1.1, ", ["beside stiffness", "keep learned"]),
        (2, "", ["learned.json, covariance", "5 by 5"]),
    ],
)
def test_learned_masses_need_their_covariance_and_no_guess(
    size: int, guess: str, words: list[str], run: Run, tmp_path: Path
) -> None:
    parts = (("mass", 1.0, "kg"), ("load_mass", 1.0, "kg"), ("stiffness", 1.0, "N/m"))
    values = FRICTION | {name: {"value": value, "unit": unit} for name, value, unit in parts}
    covariance = [[1e-4 * (i == j) for j in range(size)] for i in range(size)]
    learned = ARM_LEARNED | {"values": values, "covariance": covariance}
    (tmp_path / "learned.json").write_text(json.dumps(learned))
    changes = f"guess = {{only = true, {guess}learned = 'learned.json'}}"
    refused(run, scenario_file(ARM, tmp_path, changes), words)
