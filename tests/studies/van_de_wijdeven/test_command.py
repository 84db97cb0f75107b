"""``python -m studies.van_de_wijdeven``: options, printed tables, and refusals."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from stage_log import Outcome, Run

from studies.van_de_wijdeven import Reproduced
from studies.van_de_wijdeven.__main__ import main
from studies.van_de_wijdeven.records import (
    CarriedRuns,
    Claim,
    ConjunctionReproduction,
    ControllerScore,
    EnergyReproduction,
    FiveRuns,
    FrictionErrorEffect,
    LandingScore,
    PrintedNumber,
    PulseReproduction,
    Reading,
    ReferenceSeries,
    Spread,
    VariantScore,
)

NAMES = ("coulomb_friction", "viscous_friction")


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    def run_main(*arguments: object) -> Outcome:
        code = main([str(each) for each in arguments])
        captured = capsys.readouterr()
        return Outcome(code=code, out=captured.out, err=captured.err)

    return run_main


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Let a small finished reproduction stand for the job; return what the job was asked for."""
    calls: list[dict[str, object]] = []
    claims = [
        Claim(
            place=f"place {agrees}",
            statement=f"statement {agrees}",
            criterion="criterion",
            measured="measured",
            agrees=agrees,
            why="why",
        )
        for agrees in (True, False)
    ]

    def job(
        folder: Path,
        *,
        runs: int,
        seed: int,
        progress: Callable[[int, int], None] | None,
    ) -> Reproduced:
        calls.append({"folder": folder, "runs": runs, "seed": seed, "progress": progress})
        reproduction = EnergyReproduction(
            title="A part",
            setting="With surrogate values.",
            values={"truth": {"coulomb_friction": (0.15, "N")}},
            figures=(),
            five_runs=(
                FiveRuns(
                    loop="feedback",
                    case="with noise",
                    values={name: np.array([0.1, 0.1234]) for name in NAMES},
                    itse=np.array([1.0, 0.5]),
                ),
            ),
            variants=tuple(
                VariantScore(
                    loop=loop,
                    variant="exact sums",
                    noise=1.0,
                    assumed=None,
                    runs=runs,
                    failed=0,
                    bias=dict.fromkeys(NAMES, -0.0123),
                    rmse=dict.fromkeys(NAMES, 0.0456),
                    coverage=None,
                )
                for loop in ("feedforward", "feedback")
            ),
            claims=tuple(claims),
            options={"runs": runs, "seed": seed},
            stickslip_version="1.2.3",
        )
        return Reproduced(
            reproduction=reproduction,
            page=folder / "part-a.html",
            numbers=folder / "part-a.json",
            pictures=(folder / "figure-5.1.png", folder / "figure-5.2.png"),
        )

    monkeypatch.setattr("studies.van_de_wijdeven.reproduce_part_a", job)
    return calls


@pytest.fixture
def asked_of_b(monkeypatch: pytest.MonkeyPatch) -> list[dict[str, object]]:
    """Let a small finished reproduction stand for the job of part B."""
    calls: list[dict[str, object]] = []

    def job(
        folder: Path,
        *,
        axes: int,
        seed: int,
        progress: Callable[[int, int], None] | None,
    ) -> Reproduced:
        calls.append({"folder": folder, "axes": axes, "seed": seed, "progress": progress})
        claims = tuple(
            Claim(
                place="4",
                statement=f"statement {verdicts}",
                criterion="criterion",
                measured="measured",
                agrees=all(verdicts),
                why="why",
                readings=tuple(
                    Reading(name="one", agrees=agrees, measured="seen") for agrees in verdicts
                ),
            )
            for verdicts in ((True, True), (True, False), (False, False))
        )
        reproduction = PulseReproduction(
            title="Part B",
            setting="With Table 1.",
            values={"table_1": {"mass": (150.0, "kg")}},
            figures=(),
            claims=claims,
            printed_numbers=(
                PrintedNumber(
                    place="3.1",
                    quantity="a width",
                    printed="0.092",
                    value=0.09157,
                    unit="s",
                    how="Eq. 3",
                ),
            ),
            carried_runs=(
                CarriedRuns(
                    controller="PWC",
                    reading="as printed",
                    longest_pulse=None,
                    final_error=np.array([1.136e-4, -4.191e-4]),
                    reached=np.array([False, True]),
                    time=np.array([np.nan, 0.5]),
                    pulses=np.array([58, 30]),
                    reversed_pulses=np.array([28, 14]),
                    estimates={"pulse_gain": np.array([2.2, 1.5])},
                ),
            ),
            controller_scores=(
                ControllerScore(
                    controller="exact",
                    axes=axes,
                    within_tolerance=0.995,
                    hunting=0.005,
                    median_error=2.6e-6,
                    error_95=8e-6,
                    worst_error=1.07e-5,
                    median_time=None,
                    median_pulses=2.0,
                    peak_effort=1.0,
                ),
            ),
            how_compared="",
            resolution_scores=(),
            options={"axes": axes, "seed": seed},
            stickslip_version="1.2.3",
        )
        return Reproduced(
            reproduction=reproduction,
            page=folder / "part-b.html",
            numbers=folder / "part-b.json",
            pictures=(folder / "figure-1.png", folder / "figure-2.png"),
        )

    monkeypatch.setattr("studies.van_de_wijdeven.reproduce_part_b", job)
    return calls


def test_part_b_prints_its_own_tables(
    run: Run, asked_of_b: list[dict[str, object]], tmp_path: Path
) -> None:
    outcome = run("part-b", "--out", tmp_path, "--axes", 30, "--seed", 3)
    assert outcome.code == 0, outcome.err
    assert asked_of_b == [{"folder": tmp_path, "axes": 30, "seed": 3, "progress": None}]
    for words in (
        "Table 1",
        "0.09157",
        "113.6",
        "-419.1",
        "1 of 2",
        "30 random axes",
        "99.5 %",
        "2.6 µm",
        "1 of 3 claims",
        "1 in part of the readings",
        "statement (False, False)",
        "part-b.json",
        "and 1 more",
    ):
        assert words in outcome.out, words
    assert "statement (True" not in outcome.out


def test_part_b_has_a_default_too(
    run: Run, asked_of_b: list[dict[str, object]], tmp_path: Path
) -> None:
    assert run("part-b", "--out", tmp_path).code == 0
    assert (asked_of_b[0]["axes"], asked_of_b[0]["seed"]) == (400, 1)


def test_tables_differences_and_files_are_printed(
    run: Run, asked: list[dict[str, object]], tmp_path: Path
) -> None:
    outcome = run("part-a", "--out", tmp_path, "--runs", 7, "--seed", 3)
    assert outcome.code == 0, outcome.err
    assert asked == [{"folder": tmp_path, "runs": 7, "seed": 3, "progress": None}]
    for words in (
        "surrogate values",
        "0.1234",
        "-1.23 (4.56)",
        "7 runs",
        "1 of 2 claims",
        "statement False",
        "part-a.html",
        "part-a.json",
        "and 1 more",
    ):
        assert words in outcome.out, words
    assert "statement True" not in outcome.out


def test_what_is_not_said_has_a_default(
    run: Run, asked: list[dict[str, object]], tmp_path: Path
) -> None:
    assert run("part-a", "--out", tmp_path).code == 0
    assert (asked[0]["runs"], asked[0]["seed"]) == (20, 1)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["part-a", "--out", "OUT", "--runs", "1"], ["runs is 1", "give 5 or more"]),
        (["part-a", "--out", "OUT", "--seed", "-1"], ["seed is -1"]),
        (["part-a", "--out", "OUT", "--runs", "many"], ["many", "van_de_wijdeven --help"]),
        (["part-z", "--out", "OUT"], ["part-z", "van_de_wijdeven --help"]),
        (["part-a"], ["--out", "van_de_wijdeven --help"]),
        (["part-a", "--out", "OUT", "--runs", "2.5"], ["--runs", '"2.5" is not a whole number']),
        (["part-a", "--out", "OUT", "--seed", "1.5"], ["--seed", '"1.5" is not a whole number']),
        (["part-a", "--out", ""], ["--out", "empty", "give ."]),
        (["part-a", "--out", "FILE"], ["file: ", "is a file, not a folder"]),
        (["part-b", "--out", "OUT", "--runs", "20"], ["--runs", "no use for part-b", "leave it"]),
        (["part-a", "--out", "OUT", "--axes", "99"], ["--axes", "no use for part-a", "leave it"]),
        (["part-b", "--out", "OUT", "--axes", "1"], ["axes is 1", "give 25 or more"]),
        (["part-b", "--out", "OUT", "--axes", "2.5"], ["--axes", '"2.5" is not a whole number']),
        (["part-b", "--out", "FILE"], ["file: ", "is a file, not a folder"]),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(
    arguments: list[str], words: list[str], run: Run, tmp_path: Path
) -> None:
    (tmp_path / "file").write_text("kept")
    places = {"OUT": str(tmp_path / "out"), "FILE": str(tmp_path / "file")}
    outcome = run(*(places.get(word, word) for word in arguments))
    assert outcome.code == 2
    for word in words:
        assert word in outcome.line()
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_the_help_says_what_it_does(run: Run) -> None:
    outcome = run("--help")
    assert outcome.code == 0
    for word in (
        "part-a",
        "part-b",
        "--out",
        "--runs",
        "--axes",
        "--seed",
        "surrogate",
    ):
        assert word in outcome.out


def test_the_conjunction_prints_its_own_tables(
    run: Run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls: list[tuple[int, int]] = []
    spread = Spread(median=2.5e-7, upper_95=5e-7, worst=6e-7)

    def job(folder: Path, *, arms: int, seed: int, progress: object) -> Reproduced:
        del progress
        calls.append((arms, seed))
        return Reproduced(
            reproduction=ConjunctionReproduction(
                title="The arm lands",
                setting="With surrogate values.",
                values={},
                figures=(),
                claims=(),
                reference_series=(
                    ReferenceSeries(
                        pulse_width=0.5,
                        pulses=10,
                        expected_duration=5.0,
                        duration=5.0,
                        impulse=1.2,
                        peak_effort=1.0,
                        residual=2e-15,
                    ),
                ),
                friction_errors=(
                    FrictionErrorEffect(
                        friction_error=0.01,
                        expected_error=-0.002,
                        expected_swing=0.0005,
                        error=-0.003,
                        swing=0.0007,
                    ),
                ),
                successive_series=(),
                landing_scores=(
                    LandingScore(
                        controller="landing",
                        case="no noise",
                        arms=arms,
                        moves=2 * arms,
                        landed=1.0,
                        landed_in_four=1.0,
                        error_1=spread,
                        error_2=spread,
                        swing=spread,
                        time_ratio=None,
                        series=None,
                        misjudged=None,
                        farthest=0.2,
                        peak_effort=1.0,
                    ),
                ),
                how_compared="All alike.",
                options={"arms": arms, "seed": seed},
                stickslip_version="0.1.0",
            ),
            page=folder / "conjunction.html",
            numbers=folder / "conjunction.json",
            pictures=(folder / "figure-C.1.png",),
        )

    monkeypatch.setattr("studies.van_de_wijdeven.reproduce_conjunction", job)
    outcome = run("conjunction", "--out", tmp_path, "--arms", 7, "--seed", 3)
    assert outcome.code == 0, outcome.err
    assert run("conjunction", "--out", tmp_path).code == 0
    assert calls == [(7, 3), (2, 1)]
    for words in ("5.00", "-0.30 (-0.20)", "7 random arms", "2.5e-07", "conjunction.html"):
        assert words in outcome.out, words
    assert "These differ" not in outcome.out
    refused = run("part-b", "--out", tmp_path, "--arms", 7)
    assert refused.code == 2
    assert "--arms is an option of conjunction" in refused.err
