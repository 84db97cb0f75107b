"""A log to identify, and a way to run the command line inside the test process."""

from collections.abc import Callable
from pathlib import Path

import pytest
from stage_log import Run, csv_text, runner, table

from stickslip.cli import main


@pytest.fixture
def run(capsys: pytest.CaptureFixture[str]) -> Run:
    return runner(main, capsys)


@pytest.fixture
def good_log(tmp_path: Path) -> Path:
    path = tmp_path / "stage.csv"
    path.write_text(csv_text(table()))
    return path


@pytest.fixture
def schema_of() -> Callable[[str], Path]:
    """Return a function that finds a schema among the examples."""
    examples = Path(__file__).parents[2] / "examples"
    return lambda name: examples / f"{name}.toml"
