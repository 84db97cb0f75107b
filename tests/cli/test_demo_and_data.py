"""``stickslip demo`` shows the truth beside the estimate; ``stickslip data`` prints a place."""

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from stage_log import Run

TOLERANCE = 0.015  # m: three times the noise of a measured position


@pytest.mark.slow
def test_the_demo_writes_its_files_and_shows_truth_and_estimate(run: Run, tmp_path: Path) -> None:
    out = tmp_path / "new" / "folder"
    outcome = run("demo", "--out", out)
    assert outcome.code == 0, outcome.err
    assert sorted(path.name for path in out.iterdir()) == [
        "estimate.json",
        "landing.html",
        "landing.toml",
        "report.html",
        "surrogate_arm.csv",
    ]
    for words in ("surrogate values", "true value", "0.15", "0.1", "Coulomb friction", "Report"):
        assert words in outcome.out
    parameters = json.loads((out / "estimate.json").read_text())["parameters"]
    for name, truth in (("coulomb_friction", 0.15), ("viscous_friction", 0.1), ("offset", 0.0)):
        low, high = parameters[name]["ci95"]
        margin = high - low  # one interval's width beyond it: seeds are few, noise is not
        assert low - margin < truth < high + margin, name
    assert "✓ landed after" in outcome.out
    again = run("position", out / "landing.toml", "--json", tmp_path / "landing.json")
    assert again.code == 0, again.err
    landed = json.loads((tmp_path / "landing.json").read_text())
    (move,) = landed["runs"][0]["moves"]
    assert abs(move["final_error"]) <= TOLERANCE
    assert move["swing"] <= TOLERANCE
    assert landed["first_guess_sources"]["coulomb_friction"] == "estimate estimate.json"


@pytest.mark.slow
def test_the_demo_depends_on_its_seed_only(run: Run, tmp_path: Path) -> None:
    texts: list[str] = []
    for folder, seed in (("a", 1), ("b", 1), ("c", 2)):
        assert run("demo", "--out", tmp_path / folder, "--seed", seed).code == 0
        texts.append((tmp_path / folder / "surrogate_arm.csv").read_text())
    assert texts[0] == texts[1]
    assert texts[0] != texts[2]


def test_data_prints_where_the_benchmark_is(
    run: Run, benchmark_data: Callable[[str], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = benchmark_data("emps/DATA_EMPS.mat").parent
    monkeypatch.setenv("STICKSLIP_DATA", str(folder.parent))
    outcome = run("data", "emps")
    assert (outcome.code, outcome.out, outcome.err) == (0, f"{folder}\n", "")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [(("--out", "x", "--seed", "1.5"), "not a whole number"), (("--out", ""), "it is empty")],
)
def test_the_demo_guesses_nothing(run: Run, arguments: tuple[str, ...], message: str) -> None:
    run("demo", *arguments).refused(message)
