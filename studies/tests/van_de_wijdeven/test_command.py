"""``python -m studies.van_de_wijdeven``: options, printed tables, and refusals."""

from collections.abc import Callable
from pathlib import Path

import pytest
from refusals import refuses
from reproductions import conjunction_reproduction, energy_reproduction, pulse_reproduction
from stage_log import Run, runner

from studies.van_de_wijdeven import (
    Reproduced,
    reproduce_conjunction,
    reproduce_part_a,
    reproduce_part_b,
)
from studies.van_de_wijdeven.__main__ import main

MADE = {
    "part_a": energy_reproduction,
    "part_b": pulse_reproduction,
    "conjunction": conjunction_reproduction,
}


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    return runner(main, capsys)


@pytest.mark.parametrize(
    ("part", "option", "default", "words"),
    [
        ("part-a", "runs", 20, ["surrogate", "-0.2", "-1.23 (2.34)", "1 of 3 claims"]),
        (
            "part-b",
            "axes",
            400,
            ["Table 1", "0.07071", "2.5", "1 of 2", "30 random axes", "83.33", "12.7",
             "1 of 3 claims", "1 in part of the readings"],
        ),
        ("conjunction", "arms", 2, ["5.50", "+0.49", "3 random arms", "2e-07"]),
    ],
)  # fmt: skip
def test_tables_differences_and_files_are_printed(
    part: str,
    option: str,
    default: int,
    words: list[str],
    run: Run,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    """A finished reproduction stands for the job."""
    name, calls = part.replace("-", "_"), []

    def job(folder: Path, **options: object) -> Reproduced:
        calls.append({"folder": folder, **options})
        return Reproduced(
            reproduction=MADE[name](),
            page=folder / f"{part}.html",
            numbers=folder / f"{part}.json",
            pictures=(folder / "figure-1.png", folder / "figure-2.png"),
        )

    monkeypatch.setattr(f"studies.van_de_wijdeven.reproduce_{name}", job)
    outcome = run(part, "--out", tmp_path, f"--{option}", 7, "--seed", 3)
    assert outcome.code == 0, outcome.err
    assert run(part, "--out", tmp_path).code == 0
    expected = {"folder": tmp_path, "progress": None}
    assert calls == [expected | {option: 7, "seed": 3}, expected | {option: default, "seed": 1}]
    for word in (*words, f"{part}.html", f"{part}.json", "and 1 more"):
        assert word in outcome.out, word
    # Only claims that differ are printed
    claims, printed = MADE[name]().claims, " ".join(outcome.out.split())
    differing = {each.statement for each in claims if not (each.agrees or each.agrees_partly)}
    for claim in claims:
        assert (claim.statement in printed) == (claim.statement in differing)


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
        (
            ["part-b", "--out", "OUT", "--runs", "20"],
            ["--runs", "part-b does not use it", "leave it"],
        ),
        (
            ["part-a", "--out", "OUT", "--axes", "99"],
            ["--axes", "part-a does not use it", "leave it"],
        ),
        (
            ["part-b", "--out", "OUT", "--arms", "7"],
            ["--arms is given, and part-b does not use it; leave it out, or use conjunction"],
        ),
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
    run(*(places.get(word, word) for word in arguments)).refused(*words)
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


@pytest.mark.parametrize("setting", ["seed", "workers"])
@pytest.mark.parametrize(
    ("reproduce", "size", "fewest"),
    [
        (reproduce_part_a, "runs", 5),
        (reproduce_part_b, "axes", 25),
        (reproduce_conjunction, "arms", 1),
    ],
)
def test_bad_settings_are_refused(
    reproduce: Callable[..., Reproduced], size: str, fewest: int, setting: str, tmp_path: Path
) -> None:
    least = {size: fewest, "seed": 0, "workers": 1}
    for name in (size, setting):
        with refuses("not_whole", name=name, value=least[name] - 1, least=least[name]):
            reproduce(tmp_path / "out", **least | {name: least[name] - 1})
    assert list(tmp_path.iterdir()) == []
