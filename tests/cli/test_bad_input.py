"""Every bad input ends with exit code 2, one line that helps, and no file left behind.

The faults of logs themselves are in ``tests/logs/test_bad_input.py``.
"""

import os
from pathlib import Path

import pytest
from stage_log import Run, csv_text, table

LOG = csv_text(table(200))
BROKEN = LOG.replace(LOG.splitlines()[119], "0.236,broken,1.0")
ROTARY = LOG.replace("[N]", "[N m]").replace("[m]", "[rad]")
PUBLISHED = ("--estimator", "published-energy")

# The text of the log, further arguments, and parts of the message.
BAD = [
    (BROKEN, (), ["broken", "row 120", "position", "repair"]),
    ("", (), ["empty", "log.csv", "record"]),
    (LOG, ("--position", "positon"), ["positon", "position", "log.csv"]),
    (LOG, ("--unit", "position=kg"), ["kg", "position"]),
    (LOG, ("--unit", "speed=m/s"), ["speed", "velocity"]),
    (LOG, ("--unit", "mm"), ["--unit mm", "position=mm"]),
    (LOG, ("--inertia", "-2"), ["mass is -2 kg, it must be positive; give a positive value"]),
    (ROTARY, ("--inertia", "-2"), ["inertia is -2 kg m^2, it must be positive"]),
    (LOG, ("--mass", "nan"), ["--mass is nan kg, it must be finite; give a finite value"]),
    (LOG, ("--stiffness", "inf", "--load-mass", "1"), ["stiffness is inf N/m, it must be finite"]),
    (LOG, ("--from", "-1"), ["--from is -1 s, it must not be negative"]),
    (LOG, ("--load-mass", "5"), ["load"]),
    (LOG, ("--schema", "no.toml"), ["no.toml", "check the path"]),
    (LOG, ("--axis", "3"), ["axis '3'"]),
    (LOG, ("--estimator", "magic"), ["'magic' is not an estimator", "published-energy"]),
    (
        LOG,
        ("--estimator", "idim-ls", "--stiffness", "5"),
        ["idim-ls applies to rigid axes only", "use auto, energy"],
    ),
    (
        LOG,
        ("--forgetting-factor", "0.99"),
        ["--forgetting-factor 0.99", "auto does not use it", "published-energy"],
    ),
    (
        LOG,
        ("--estimator", "ekf", "--mass", "3", "--cutoff", "50"),
        ["cutoff 50", "ekf does not use it", "energy"],
    ),
    (
        LOG,
        (*PUBLISHED, "--mass", "3", "--forgetting-factor", "1.5"),
        ["--forgetting-factor is", "1.5", "(0, 1]"],
    ),
    (LOG, PUBLISHED, ["published-energy needs the mass", "give --mass"]),
    (
        LOG,
        (*PUBLISHED, "--mass", "3", "--per-direction"),
        ["friction per direction", "published-energy", "both directions"],
    ),
    (
        LOG,
        (*PUBLISHED, "--mass", "3", "--offset"),
        ["offset is given", "published-energy does not use it"],
    ),
    (
        LOG,
        (*PUBLISHED, "--mass", "3", "--stribeck"),
        ["stribeck is given", "use auto, stribeck-energy or stribeck-idim-ls"],
    ),
]


@pytest.mark.parametrize(("text", "arguments", "words"), BAD)
def test_bad_log_or_option(
    text: str, arguments: tuple[str, ...], words: list[str], run: Run, tmp_path: Path
) -> None:
    log, results = tmp_path / "log.csv", tmp_path / "results"
    log.write_text(text)
    results.mkdir()
    (results / "a.json").write_text("{}")  # of an earlier run
    before = sorted(tmp_path.rglob("*"))
    outcome = run(
        "identify", log, *arguments, "--json", results / "a.json", "--report", results / "a.html"
    )
    line = outcome.refused(*words)
    assert "; " in line, "the remedy follows a semicolon"
    assert sorted(tmp_path.rglob("*")) == before
    assert (results / "a.json").read_text() == "{}"


@pytest.mark.parametrize(
    ("place", "words"),
    [("no.csv", ["no such file", "no.csv", "check the path"]), (".", ["folder", "give a file"])],
)
def test_path_that_is_no_log(place: str, words: list[str], run: Run, tmp_path: Path) -> None:
    run("identify", tmp_path / place).refused(*words)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["identify"], ["LOG", "requires", "identify --help"]),
        (["identify", "a.csv", "b.csv"], ["a.csv", "no such file"]),
        (["identify", "a.csv", "--bogus"], ["--bogus", "identify --help"]),
        (["identify", "a.csv", "--kind", "round"], ["round", "linear", "rotary"]),
        (["identify", "a.csv", "--inertia", "heavy"], ["heavy", "--inertia"]),
        (["identify", "a.csv", "--inertia"], ["--inertia", "requires"]),
        (["identfy", "a.csv"], ["identfy", "identify"]),
        (["simulate", "stage.toml"], ["stickslip position", "stickslip.simulate in Python"]),
        (["demo", "--out"], ["--out", "requires"]),
        (["demo", "--out", "x", "--seed", "many"], ["--seed", "many"]),
        (["data", "nothing"], ["nothing", "emps"]),
    ],
)
def test_bad_command(arguments: list[str], words: list[str], run: Run) -> None:
    run(*arguments).refused(*words)


@pytest.mark.parametrize("option", ["--json", "--report"])
@pytest.mark.parametrize(
    ("place", "problem"),
    [
        ("missing/result", "does not exist"),
        ("stage.csv/result", "does not exist"),
        (".", "names a folder"),
        ("stage.csv", "overwrite"),
    ],
)
def test_bad_output_is_found_before_the_fit(
    option: str, place: str, problem: str, run: Run, good_log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def never(*_: object, **__: object) -> None:
        raise AssertionError("the fit was begun")

    monkeypatch.setattr("stickslip.tasks.identification.identified", never)
    before = good_log.read_bytes()
    run("identify", good_log, option, good_log.parent / place).refused(option, problem)
    assert good_log.read_bytes() == before
    assert list(good_log.parent.iterdir()) == [good_log]


@pytest.mark.parametrize("command", ["identify", "compare"])
def test_report_with_another_suffix_is_rejected(command: str, run: Run, good_log: Path) -> None:
    run(command, good_log, "--report", good_log.with_suffix(".pdf")).refused(
        "--report is an HTML page, and the name ends in .pdf", ".html or .htm"
    )
    assert list(good_log.parent.iterdir()) == [good_log]


def test_both_outputs_in_one_file(run: Run, good_log: Path) -> None:
    target = good_log.parent / "result"
    run("identify", good_log, "--json", target, "--report", target).refused("same file")


def test_file_of_a_logged_folder_is_not_overwritten(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1")
    run("identify", tmp_path, "--json", tmp_path / "a.csv").refused("overwrite")


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_protected_folder(run: Run, good_log: Path, tmp_path: Path) -> None:
    folder = tmp_path / "protected"
    folder.mkdir(mode=0o555)
    run("identify", good_log, "--json", folder / "a.json").refused("Permission denied")


def test_demo_where_nothing_can_be_written(run: Run, good_log: Path) -> None:
    run("demo", "--out", good_log / "folder").refused("folder")
    run("demo", "--out", good_log.parent / "new", "--seed", "-1").refused("seed")
    assert not (good_log.parent / "new").exists()
