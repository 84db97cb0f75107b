"""Every bad input ends with exit code 2, one line that helps, and no file left behind."""

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from stage_log import Run, csv_text, table

pytest.importorskip("pyarrow", reason="Parquet needs pyarrow")


def with_row(row: int, text: str) -> str:
    """Return the good log as text, with one of its lines (counted from 1) replaced."""
    lines = csv_text(table(200)).splitlines()
    lines[row - 1] = text
    return "\n".join(lines) + "\n"


def changed(name: str, values: Callable[[np.ndarray], np.ndarray]) -> str:
    columns = table(200)
    columns[name] = values(columns[name])
    return csv_text(columns)


def truncated_mat(folder: Path) -> Path:
    whole = folder / "whole.mat"
    scipy.io.savemat(whole, table(200), do_compression=True)
    path = folder / "log.mat"
    path.write_bytes(whole.read_bytes()[:900])
    whole.unlink()
    return path


def truncated_parquet(folder: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet as pq

    whole = folder / "whole.parquet"
    pq.write_table(pa.table(table(200)), whole)
    path = folder / "log.parquet"
    path.write_bytes(whole.read_bytes()[:-200])
    whole.unlink()
    return path


def file(name: str, text: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        (folder / name).write_text(text)
        return folder / name

    return write


# The log, further arguments, and what the line must say: what is wrong, where, and the remedy.
LOGS: dict[str, tuple[Callable[[Path], Path], list[str], list[str]]] = {
    "missing file": (lambda f: f / "no.csv", [], ["no such file", "no.csv", "check the path"]),
    "empty file": (file("log.csv", ""), [], ["empty", "log.csv", "record"]),
    "only a header": (file("log.csv", "time [s],position [m],force [N]\n"), [], ["log.csv"]),
    "a folder": (lambda f: f, [], ["folder", "give a file"]),
    "unknown format": (file("log.xyz", "1"), [], [".xyz", "convert", ".csv"]),
    "missing column": (
        file("log.csv", csv_text(table(200))),
        ["--position", "positon"],
        ["positon", "position", "log.csv"],
    ),
    "no effort column": (
        file("log.csv", csv_text({k: v for k, v in table(200).items() if "force" not in k})),
        [],
        ["effort", "log.csv"],
    ),
    "text among numbers": (
        file("log.csv", with_row(120, "0.236,broken,1.0")),
        [],
        ["broken", "row 120", "position"],
    ),
    "not a number": (
        file("log.csv", with_row(120, "0.236,nan,1.0")),
        [],
        ["nan", "row 120", "position", "repair"],
    ),
    "infinity": (
        file("log.csv", with_row(120, "0.236,inf,1.0")),
        [],
        ["inf", "row 120", "position", "repair"],
    ),
    "time going backwards": (
        file("log.csv", with_row(120, "0.1,0.01,1.0")),
        [],
        ["time goes backwards", "row 120", "sort"],
    ),
    "time repeated": (
        file("log.csv", with_row(120, "0.234,0.01,1.0")),
        [],
        ["time repeats", "row 120", "duplicates"],
    ),
    "one sample": (
        file("log.csv", "time [s],position [m],force [N]\n0,0,1\n"),
        [],
        ["1 sample", "longer"],
    ),
    "constant position": (
        file("log.csv", changed("position [m]", lambda x: 0 * x + 0.25)),
        [],
        ["position", "0.25 m", "200 samples", "record the axis in motion"],
    ),
    "rows of different widths": (
        file("log.csv", with_row(120, "0.236,0.01")),
        [],
        ["row 120", "2", "3"],
    ),
    "wrong unit": (
        file("log.csv", csv_text(table(200))),
        ["--unit", "position=kg"],
        ["kg", "position"],
    ),
    "unknown unit": (
        file("log.csv", csv_text(table(200))),
        ["--unit", "position=furlongs_per"],
        ["furlongs_per"],
    ),
    "a unit of nothing": (
        file("log.csv", csv_text(table(200))),
        ["--unit", "speed=m/s"],
        ["speed", "velocity"],
    ),
    "a unit without a channel": (
        file("log.csv", csv_text(table(200))),
        ["--unit", "mm"],
        ["--unit mm", "position=mm"],
    ),
    "negative inertia": (
        file("log.csv", csv_text(table(200))),
        ["--inertia", "-2"],
        ["mass is -2 kg, it must be positive; give a positive value"],
    ),
    "negative inertia of a rotary axis": (
        file("log.csv", csv_text(table(200)).replace("[N]", "[N m]").replace("[m]", "[rad]")),
        ["--inertia", "-2"],
        ["inertia is -2 kg m^2, it must be positive"],
    ),
    "infinite stiffness": (
        file("log.csv", csv_text(table(200))),
        ["--stiffness", "inf", "--load-mass", "1"],
        ["stiffness is inf N/m, it must be finite"],
    ),
    "inertia not a number": (
        file("log.csv", csv_text(table(200))),
        ["--mass", "nan"],
        ["mass is nan kg, it must be positive; give a positive value"],
    ),
    "effort all zero": (
        file("log.csv", changed("force [N]", lambda x: 0 * x)),
        [],
        ["effort", "zero", "200 samples"],
    ),
    "truncated mat": (truncated_mat, [], ["log.mat"]),
    "truncated parquet": (truncated_parquet, [], ["log.parquet"]),
    "missing schema": (
        file("log.csv", csv_text(table(200))),
        ["--schema", "no.toml"],
        ["no.toml", "check the path"],
    ),
    "an axis without a schema": (
        file("log.csv", csv_text(table(200))),
        ["--axis", "3"],
        ["axis '3'"],
    ),
    "a spring for a rigid method": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "idim-ls", "--stiffness", "5"],
        ["idim-ls applies to rigid axes only", "use auto, energy"],
    ),
    "forgetting where nothing is forgotten": (
        file("log.csv", csv_text(table(200))),
        ["--forgetting-factor", "0.99"],
        ["forgetting factor 0.99", "auto does not use it", "published-energy"],
    ),
    "an unknown estimator": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "report"],
        ["'report' is not an estimator", "published-energy"],
    ),
    "a cutoff for a method without a filter": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "ekf", "--mass", "3", "--cutoff", "50"],
        ["cutoff 50", "ekf does not use it", "energy"],
    ),
    "a forgetting factor above one": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "published-energy", "--mass", "3", "--forgetting-factor", "1.5"],
        ["forgetting factor", "1.5", "(0, 1]"],
    ),
    "a printed recursion without a mass": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "published-energy"],
        ["published-energy needs the mass", "give the mass"],
    ),
    "a printed recursion for each direction": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "published-energy", "--mass", "3", "--per-direction"],
        ["friction per direction", "published-energy", "both directions"],
    ),
    "a printed recursion with an offset": (
        file("log.csv", csv_text(table(200))),
        ["--estimator", "published-energy", "--mass", "3", "--offset"],
        ["offset is given", "published-energy does not use it"],
    ),
    "a load without a spring": (
        file("log.csv", csv_text(table(200))),
        ["--load-mass", "5"],
        ["load"],
    ),
}


@pytest.mark.parametrize("case", LOGS)
def test_a_bad_log_is_refused_in_one_line(case: str, run: Run, tmp_path: Path) -> None:
    make, arguments, words = LOGS[case]
    log = make(tmp_path)
    results = tmp_path / "results"
    results.mkdir()
    before = sorted(tmp_path.rglob("*"))
    outcome = run(
        "identify", log, *arguments, "--json", results / "a.json", "--report", results / "a.html"
    )
    assert outcome.code == 2, outcome.err
    line = outcome.line()
    for word in words:
        assert word in line
    assert "; " in line, "the remedy follows a semicolon"
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("case", ["missing file", "text among numbers", "negative inertia"])
def test_a_refusal_leaves_old_results_alone(case: str, run: Run, tmp_path: Path) -> None:
    make, arguments, _ = LOGS[case]
    old = tmp_path / "old.json"
    old.write_text("{}")
    assert run("identify", make(tmp_path), *arguments, "--json", old).code == 2
    assert old.read_text() == "{}"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["identify"], ["LOG", "requires", "identify --help"]),
        (["identify", "a.csv", "b.csv"], ["a.csv", "no such file"]),
        (["identify", "a.csv", "--bogus"], ["--bogus", "identify --help"]),
        (["identify", "a.csv", "--estimator", "magic"], ["magic", "energy", "idim-ls"]),
        (["identify", "a.csv", "--kind", "round"], ["round", "linear", "rotary"]),
        (["identify", "a.csv", "--inertia", "heavy"], ["heavy", "--inertia"]),
        (["identify", "a.csv", "--inertia"], ["--inertia", "requires"]),
        (["identfy", "a.csv"], ["identfy", "identify"]),
        (["demo"], ["--out", "requires"]),
        (["demo", "--out", "x", "--seed", "many"], ["--seed", "many"]),
        (["data", "nothing"], ["nothing", "emps"]),
    ],
)
def test_a_bad_command_is_refused_in_one_line(
    arguments: list[str], words: list[str], run: Run
) -> None:
    outcome = run(*arguments)
    assert outcome.code == 2
    line = outcome.line()
    for word in words:
        assert word in line


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
def test_an_output_that_cannot_be_is_found_before_the_fit(
    option: str, place: str, problem: str, run: Run, good_log: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("stickslip.tasks.identify", _never)
    before = good_log.read_bytes()
    outcome = run("identify", good_log, option, good_log.parent / place)
    assert outcome.code == 2
    line = outcome.line()
    assert option in line
    assert problem in line
    assert good_log.read_bytes() == before
    assert list(good_log.parent.iterdir()) == [good_log]


def _never(*_: object, **__: object) -> None:
    raise AssertionError("the fit was begun")


def test_both_outputs_in_one_file_are_refused(run: Run, good_log: Path) -> None:
    target = good_log.parent / "result"
    outcome = run("identify", good_log, "--json", target, "--report", target)
    assert outcome.code == 2
    assert "same file" in outcome.line()


def test_a_file_of_a_logged_folder_is_not_overwritten(run: Run, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("1")
    outcome = run("identify", tmp_path, "--json", tmp_path / "a.csv")
    assert outcome.code == 2
    assert "overwrite" in outcome.line()


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_protected_folder_is_refused(run: Run, good_log: Path, tmp_path: Path) -> None:
    folder = tmp_path / "protected"
    folder.mkdir(mode=0o555)
    outcome = run("identify", good_log, "--json", folder / "a.json")
    assert outcome.code == 2
    assert "Permission denied" in outcome.line()


def test_a_demo_where_nothing_can_be_written_is_refused(run: Run, good_log: Path) -> None:
    outcome = run("demo", "--out", good_log / "folder")
    assert outcome.code == 2
    assert "folder" in outcome.line()
    outcome = run("demo", "--out", good_log.parent / "new", "--seed", "-1")
    assert outcome.code == 2
    assert "seed" in outcome.line()
    assert not (good_log.parent / "new").exists()
