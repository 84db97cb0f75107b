"""``stickslip identify``: its printed text, its files, and its exit code."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pydantic
import pytest
from slow_cases import quick_where
from stage_log import COULOMB, MASS, OFFSET, VISCOUS, Run, csv_text, table
from two_sines import Motion

from stickslip.friction import StribeckFriction
from stickslip.plants import SingleMass
from stickslip.records import PARAMETER_NAMES, Status
from stickslip.simulation import simulate

CLOSE = 0.03  # relative; the log has 1 % noise and a velocity that is differentiated from positions


class _Parameter(pydantic.BaseModel):
    model_config = {"extra": "forbid", "strict": True}
    value: float | None
    std: float | None
    ci95: tuple[float, float] | None = pydantic.Field(strict=False)
    unit: str


class _Contract(pydantic.BaseModel):
    """The promised form of ``--json``; more keys may stand beside these."""

    schema_: int = pydantic.Field(alias="schema")
    parameters: dict[str, _Parameter]
    status: str
    diagnostics: dict[str, Any]
    provenance: dict[str, Any]


def contract(text: str) -> _Contract:
    """Check text against the contract, and that it is JSON for every reader."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{constant} is not JSON")

    result = _Contract.model_validate(json.loads(text, parse_constant=refuse))
    assert result.schema_ == 1
    assert set(result.parameters) <= set(PARAMETER_NAMES)
    assert result.status in {each.value for each in Status}
    for parameter in result.parameters.values():
        if parameter.value is not None:
            assert parameter.ci95[0] <= parameter.value <= parameter.ci95[1]
    return result


@pytest.mark.parametrize("estimator", ["energy", "idim-ls"])
def test_parameters_of_a_good_log(estimator: str, run: Run, good_log: Path) -> None:
    outcome = run("identify", good_log, "--estimator", estimator, "--json", "-")
    found = contract(outcome.printed()).parameters
    truth = {"mass": MASS, "coulomb_friction": COULOMB, "viscous_friction": VISCOUS}
    for name, value in truth.items():
        assert found[name].value == pytest.approx(value, rel=CLOSE), name
    assert found["offset"].value == pytest.approx(OFFSET, abs=CLOSE)
    assert found["viscous_friction"].unit == "N s/m"


def test_json_alone_on_standard_output(run: Run, good_log: Path) -> None:
    outcome = run("identify", good_log, "--json", "-")
    assert json.loads(outcome.out)["status"] == "ok"
    for words in ("Coulomb friction", "95 % interval", "Assumed in reading it", "identified"):
        assert words in outcome.err


def test_printed_text_and_files(run: Run, good_log: Path) -> None:
    json_file = good_log.with_suffix(".json")
    report = good_log.with_suffix(".html")
    outcome = run("identify", good_log, "--json", json_file, "--report", report)
    assert outcome.code == 0
    for words in ("'position'", "Mass", "kg", "✓ ok: The parameters are identified."):
        assert words in outcome.out
    assert "Model selection" in outcome.out
    assert f"Report: {report}" in outcome.out
    assert contract(json_file.read_text()).status == "ok"
    assert "<h1>stage</h1>" in report.read_text()
    assert sorted(good_log.parent.iterdir()) == sorted([good_log, json_file, report])


def test_a_log_that_cannot_be_predicted_is_no_validation(
    run: Run, good_log: Path, tmp_path: Path
) -> None:
    other = tmp_path / "other.csv"
    other.write_text(good_log.read_text().replace("[N]", "[A]"))
    fit = ("identify", good_log, "--no-select", "--validate")
    assert run(*fit, good_log).code == 0
    outcome = run(*fit, other)
    assert outcome.code == 1
    assert "No prediction of other.csv" in outcome.out


def test_assumed_units_are_printed(run: Run, tmp_path: Path) -> None:
    columns = table()
    bare = {name.partition(" ")[0]: values for name, values in columns.items()}
    for name, header in (("bare", bare), ("named", columns)):
        log, report = tmp_path / f"{name}.csv", tmp_path / f"{name}.html"
        log.write_text(csv_text(header))
        outcome = run("identify", log, "--kind", "linear", "--report", report)
        words = "Assumed units, as the log names none: effort in N, position in m, time in s."
        assert (words in outcome.out) == (words in report.read_text()) == (name == "bare")


def test_known_inertia_is_not_estimated(run: Run, good_log: Path) -> None:
    """The efforts of the log are those at the time stamps: held, they are half a sample early."""
    outcome = run("identify", good_log, "--mass", MASS, "--json", "-")
    parameters = contract(outcome.out).parameters
    assert set(parameters) == {"coulomb_friction", "viscous_friction", "offset"}
    assert '"effort_kind": "sampled"' in outcome.out


@pytest.mark.parametrize(
    ("options", "names"),
    [
        (("--no-offset", "--no-select"), {"mass", "coulomb_friction", "viscous_friction"}),
        (
            ("--per-direction",),
            {
                f"{name}_friction_{side}"
                for name in ("coulomb", "viscous")
                for side in ("positive", "negative")
            }
            | {"mass"},
        ),
    ],
)
def test_options_choose_the_parameters(
    options: tuple[str, ...], names: set[str], run: Run, good_log: Path
) -> None:
    outcome = run("identify", good_log, *options, "--json", "-")
    assert set(contract(outcome.out).parameters) == names


@pytest.mark.parametrize(
    "estimator",
    quick_where(lambda name: name == "idim-ls", ["auto", "energy", "idim-ls"]),
)
def test_stribeck_effect_is_estimated(estimator: str, run: Run, tmp_path: Path) -> None:
    law = StribeckFriction.symmetric(
        coulomb_friction=COULOMB, static_friction=2.4, viscous_friction=VISCOUS,
        stribeck_velocity=0.05,
    )  # fmt: skip
    time = np.arange(8000) * 0.001
    effort = 4.0 * np.sin(np.pi * time) + 2.0 * np.sin(3.4 * np.pi * time + 1.0)
    motion = simulate(SingleMass(mass=MASS, friction=law), effort, sampling_time=0.001)
    log = tmp_path / "stribeck.csv"
    measured = {"position [m]": motion.position[:-1], "velocity [m/s]": motion.velocity[:-1]}
    log.write_text(csv_text({"time [s]": time, **measured, "force [N]": effort}))
    page = log.with_suffix(".html")
    arguments = ("--stribeck", "--estimator", estimator, "--json", "-", "--report", page)
    outcome = run("identify", log, *arguments)
    found = contract(outcome.printed()).parameters
    truth = {"mass": MASS, "coulomb_friction": COULOMB, "viscous_friction": VISCOUS}
    truth |= {"static_friction": 2.4, "stribeck_velocity": 0.05}
    assert set(found) == {*truth, "offset"}
    for name, value in truth.items():
        assert found[name].value == pytest.approx(value, rel=CLOSE), name
    assert found["stribeck_velocity"].unit == "m/s"
    assert "Stribeck velocity" in outcome.err
    assert "Stribeck velocity" in page.read_text()


def test_absent_stribeck_effect_is_not_identifiable(run: Run, good_log: Path) -> None:
    page = good_log.with_suffix(".html")
    arguments = ("--estimator", "energy", "--stribeck", "--report", page, "--json", "-")
    outcome = run("identify", good_log, *arguments)
    assert outcome.code == 1
    assert "Static friction, Stribeck velocity: no step" in outcome.err
    found = contract(outcome.out)
    assert found.status == "not_identifiable"
    for name in ("static_friction", "stribeck_velocity"):
        assert found.parameters[name].value is None
    assert found.parameters["coulomb_friction"].value == pytest.approx(COULOMB, rel=CLOSE)
    assert "curve-plot" in page.read_text()


def test_included_stribeck_effect_that_is_absent(run: Run, good_log: Path) -> None:
    outcome = run("identify", good_log, "--include", "stribeck", "--json", "-")
    found = contract(outcome.out).parameters
    assert found["static_friction"].value == pytest.approx(COULOMB, rel=CLOSE)


def test_term_that_the_log_does_not_show_is_named(run: Run, good_log: Path) -> None:
    outcome = run("identify", good_log, "--include", "gravity", "--json", "-")
    assert "'gravity'" in " ".join(json.loads(outcome.out)["diagnostics"]["notes"])
    assert "gravity_sine" not in json.loads(outcome.out)["parameters"]


def test_observer_has_a_report(run: Run, good_log: Path) -> None:
    page = good_log.with_suffix(".html")
    outcome = run(
        *("identify", good_log, "--estimator", "rls", "--mass", MASS, "--report", page),
        *("--json", "-"),
    )
    assert json.loads(outcome.out)["estimator"] == "rls"
    assert "Coulomb friction" in page.read_text()


def test_published_recursion_takes_its_settings(run: Run, good_log: Path) -> None:
    arguments = ["--estimator", "published-energy", "--mass", MASS, "--json", "-"]
    plain = contract(run("identify", good_log, *arguments).out)
    other = contract(run("identify", good_log, *arguments, "--forgetting-factor", "0.999").out)
    assert plain.provenance["options"]["estimator"] == "published-energy"
    assert other.provenance["options"]["forgetting_factor"] == 0.999
    assert plain.parameters["coulomb_friction"].value != other.parameters["coulomb_friction"].value


def test_columns_on_the_command_line(run: Run, tmp_path: Path) -> None:
    columns = table()
    log = tmp_path / "odd.csv"
    recorded = {
        "us": columns["time [s]"] * 1e6,
        "motor angle": columns["position [m]"] * 32,
        "amps": columns["force [N]"] / 0.35,
    }
    log.write_text(csv_text(recorded))
    arguments = ("--time", "us / 1e6", "--position", "'motor angle' / 32", "--kind", "rotary")
    outcome = run("identify", log, *arguments, "--effort", "0.35 * amps", "--json", "-")
    found = contract(outcome.printed()).parameters
    assert found["inertia"].value == pytest.approx(MASS, rel=CLOSE)
    assert found["coulomb_friction"].unit == "N m"


def test_flags_take_precedence_over_the_schema(run: Run, tmp_path: Path) -> None:
    columns = table()
    log = tmp_path / "log.csv"
    named = {"a": columns["time [s]"], "b": columns["position [m]"], "c": columns["force [N]"]}
    log.write_text(csv_text({**named, "d": columns["force [N]"] * 2}))
    schema = tmp_path / "log.toml"
    schema.write_text('kind = "linear"\n[axes.x]\ntime = "a"\nposition = "b"\neffort = "c"\n')
    arguments = ("--schema", schema, "--axis", "x", "--json", "-")
    plain = contract(run("identify", log, *arguments).out)
    doubled = contract(run("identify", log, *arguments, "--effort", "d").out)
    once, twice = (each.parameters["mass"].value for each in (plain, doubled))
    assert twice == pytest.approx(2 * once, rel=1e-6)


def test_samples_without_time_stamps_need_a_sampling_time(run: Run, tmp_path: Path) -> None:
    columns = table()
    del columns["time [s]"]
    log = tmp_path / "log.csv"
    log.write_text(csv_text(columns))
    outcome = run("identify", log, "--sampling-time", "0.002", "--json", "-")
    found = contract(outcome.out).parameters
    assert found["viscous_friction"].value == pytest.approx(VISCOUS, rel=CLOSE)


@pytest.mark.parametrize("estimator", ["energy", "idim-ls"])
def test_log_without_excitation(estimator: str, run: Run, tmp_path: Path) -> None:
    """The axis sticks: the effort stays below breakaway and the encoder shows its noise."""
    generator = np.random.default_rng(3)
    columns = table()
    samples = columns["time [s]"].size
    columns["force [N]"] = 0.3 * np.sin(3 * columns["time [s]"])
    columns["position [m]"] = 0.1 + 1e-6 * generator.integers(-1, 2, samples)
    log = tmp_path / "stuck.csv"
    log.write_text(csv_text(columns))
    report = tmp_path / "stuck.html"
    arguments = ["--estimator", estimator, "--json", "-", "--report", report]
    outcome = run("identify", log, *arguments)
    result = contract(outcome.printed(1))
    assert result.status in {"insufficient_excitation", "not_identifiable"}
    assert "record a motion" in outcome.err
    assert f"✗ {result.status}" in outcome.err
    assert "Do not use the values" in report.read_text()
    assert result.parameters["coulomb_friction"].value is None


def test_motion_at_one_speed_leaves_friction_unidentified(run: Run, tmp_path: Path) -> None:
    """At constant speed one way, Coulomb, viscous and offset forces are one number."""
    generator = np.random.default_rng(3)
    columns = table()
    time = columns["time [s]"]
    columns["position [m]"] = 0.1 * time
    columns["force [N]"] = 2.0 + generator.normal(0, 0.01, time.size)
    log = tmp_path / "steady.csv"
    log.write_text(csv_text(columns))
    result = contract(run("identify", log, "--mass", MASS, "--json", "-").printed(1))
    assert result.status in {"insufficient_excitation", "not_identifiable"}
    assert result.parameters["coulomb_friction"].value is None


@pytest.mark.parametrize("estimator", ["energy", "idim-ls"])
def test_emps_benchmark(
    estimator: str, run: Run, benchmark_data: Callable[[str], Path], schema_of: Callable[..., Path]
) -> None:
    log = benchmark_data("emps/DATA_EMPS.mat")
    arguments = ["--schema", schema_of("emps"), "--estimator", estimator, "--json", "-"]
    result = contract(run("identify", log, *arguments).printed())
    # Published: mass 95.1089 kg, viscous 203.5034 N s/m, Coulomb 20.3935 N.
    tolerance = 5e-7 if estimator == "idim-ls" else 0.08
    published = {"mass": 95.1089, "viscous_friction": 203.5034, "coulomb_friction": 20.3935}
    for name, value in published.items():
        assert result.parameters[name].value == pytest.approx(value, rel=tolerance, abs=5e-5)
    assert result.provenance["input_sha256"].startswith("6cf6814a")


@pytest.mark.parametrize(
    ("axis", "viscous", "coulomb", "tolerance"),
    [("1", 8.05, 7.14, 0.05), ("4", 1.11, 2.48, 0.08)],
)
def test_robot_benchmark(
    axis: str,
    viscous: float,
    coulomb: float,
    tolerance: float,
    run: Run,
    benchmark_data: Callable[[str], Path],
    schema_of: Callable[..., Path],
) -> None:
    log = benchmark_data("staubli_tx40")
    arguments = ("--schema", schema_of("tx40"), "--axis", axis, "--estimator", "energy")
    found = contract(run("identify", log, *arguments, "--json", "-").printed()).parameters
    assert found["viscous_friction"].value == pytest.approx(viscous, rel=0.05)
    # The wrist's coupling disturbs the Coulomb friction of joint 4.
    assert found["coulomb_friction"].value == pytest.approx(coulomb, rel=tolerance)
    assert found["inertia"].unit == "kg m^2"


def several(tmp_path: Path, *more_coulomb: float) -> list[Path]:
    """Return logs of one axis in files, each with the Coulomb friction of the first and more."""
    paths: list[Path] = []
    for k, more in enumerate(more_coulomb):
        columns = table()
        sign = np.sign(Motion(time=columns["time [s]"]).velocity)
        noise = np.random.default_rng(k).normal(0.0, 0.02, sign.size)
        columns["force [N]"] = columns["force [N]"] + more * sign + 0.1 * k + noise
        paths.append(tmp_path / f"log{k}.csv")
        paths[-1].write_text(csv_text(columns))
    return paths


def test_several_logs_are_fitted_jointly(run: Run, tmp_path: Path) -> None:
    logs = several(tmp_path, 0.0, 0.0)
    page = tmp_path / "joint.html"
    outcome = run("identify", *logs, "--report", page, "--json", "-")
    found = json.loads(outcome.printed())
    assert found["parameters"]["coulomb_friction"]["value"] == pytest.approx(COULOMB, rel=CLOSE)
    for k in range(2):
        value = found["parameters"][f"offset[log{k}]"]["value"]
        assert value == pytest.approx(OFFSET + 0.1 * k, abs=CLOSE)
    assert found["joint"]["consistent"]
    assert [log["name"] for log in found["joint"]["logs"]] == ["log0", "log1"]
    assert found["provenance"]["files"] == ["log0.csv", "log1.csv"]
    for words in ("Offset [log1]", "The logs are consistent", "log0: 4000 samples"):
        assert words in outcome.err
    text = page.read_text()
    for words in ("<h1>log0 and log1</h1>", "The logs are consistent", "curve-plot", "Log log1"):
        assert words in text


@pytest.mark.slow
def test_log_that_differs_is_named(run: Run, tmp_path: Path) -> None:
    outcome = run("identify", *several(tmp_path, 0.0, 0.0, 0.3))
    assert "model_mismatch" in outcome.printed(1)
    assert "log2 shows" in outcome.out
    assert "more Coulomb friction than the others" in outcome.out


def test_input_of_several_is_not_overwritten(run: Run, tmp_path: Path) -> None:
    logs = several(tmp_path, 0.0, 0.0)
    before = logs[1].read_text()
    assert run("identify", *logs, "--report", logs[1]).code == 2
    assert logs[1].read_text() == before


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("log0=0.001", "log0=0.002"), "--effort-delay is given twice for log0"),
        (("log0=0.001", "log1=late"), "--effort-delay log1=late is not understood"),
        (("0.001", "log1=0.001"), "given for all logs and again"),
        (("log7=0.001",), "'log7', which is none of the logs"),
    ],
)
def test_bad_delays(words: tuple[str, ...], message: str, run: Run, tmp_path: Path) -> None:
    options = [part for word in words for part in ("--effort-delay", word)]
    run("identify", *several(tmp_path, 0.0, 0.0), *options).refused(message)


def test_delays_are_given_by_log(run: Run, tmp_path: Path) -> None:
    logs = several(tmp_path, 0.0, 0.0)
    options = ("--effort-delay", "log0=0", "--effort-delay", "log1=-0.0001", "--json", "-")
    found = json.loads(run("identify", *logs, *options).out)
    assert found["provenance"]["options"]["effort_delays"] == {"log0": 0.0, "log1": -0.0001}
    assert not any(name.startswith("effort_delay") for name in found["parameters"])
