"""Results on a terminal: nothing of a table is cut where the terminal is narrow."""

import io
from collections.abc import Callable

import pytest
from results import make
from rich.console import Console

from stickslip.presentation.identification import parameter_table
from stickslip.presentation.positioning.page import estimate_table, move_table
from stickslip.presentation.table import Cell, Table
from stickslip.presentation.terminal import print_identification, print_positioning
from stickslip.records import Identification


def printed(show: Callable[[Console], None], width: int) -> str:
    console = Console(file=io.StringIO(), width=width, markup=False, highlight=False)
    show(console)
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def cells(table: Table) -> list[str]:
    rows = [row[k] for row in table.rows for k, _ in table.shown("terminal")]
    return [each.text if isinstance(each, Cell) else each for each in rows]


@pytest.mark.parametrize("width", [50, 80])
def test_a_narrow_terminal_shows_every_parameter_and_verdict(
    width: int, identification: Identification
) -> None:
    text = printed(lambda console: print_identification(console, identification), width)
    assert all(each in text for each in cells(parameter_table(identification)))
    assert "verdict" in text


@pytest.mark.parametrize("width", [50, 80])
def test_a_narrow_terminal_shows_every_move_and_its_ending(width: int) -> None:
    result = make()
    text = printed(lambda console: print_positioning(console, result), width)
    assert all(each in text for each in cells(move_table(result)))
    assert all(each in text for each in cells(estimate_table(result)))
