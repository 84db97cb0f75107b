"""Scenario files that are good but for some changes, and how they are refused."""

from pathlib import Path

from stage_log import Run


def scenario_file(good: str, folder: Path, changes: list[tuple[str, str]]) -> Path:
    """Return a scenario file with changes to a good one."""
    text = good
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "scenario.toml"
    path.write_text(text)
    return path


def refused(run: Run, scenario: Path, words: list[str]) -> None:
    """Check that a scenario is refused in one line with these words, and nothing is written."""
    results = scenario.parent / "results"
    results.mkdir()
    before = sorted(scenario.parent.rglob("*"))
    outcome = run(
        "position", scenario, "--json", results / "a.json", "--report", results / "a.html"
    )
    assert outcome.code == 2, outcome.err
    line = outcome.line()
    for word in [*words, scenario.parent.name]:
        assert word in line, line
    assert "; " in line, "the remedy follows a semicolon"
    assert sorted(scenario.parent.rglob("*")) == before
