"""Results on a terminal: nothing of a table is cut where the terminal is narrow."""

import pytest
from results import make
from terminals import printed_on

from stickslip.presentation.identification import parameter_table
from stickslip.presentation.positioning.page import estimate_table, move_table
from stickslip.presentation.table import Cell, Table
from stickslip.presentation.terminal import print_identification, print_positioning
from stickslip.records import Identification


def cells(table: Table) -> list[str]:
    rows = [row[k] for row in table.rows for k, _ in table.shown("terminal")]
    return [each.text if isinstance(each, Cell) else each for each in rows]


@pytest.mark.parametrize("width", [50, 80])
def test_a_narrow_terminal_shows_every_parameter_and_verdict(
    width: int, identification: Identification
) -> None:
    text = printed_on(width, print_identification, identification)
    assert all(each in text for each in cells(parameter_table(identification)))
    assert "verdict" in text


@pytest.mark.parametrize("width", [50, 80])
def test_a_narrow_terminal_shows_every_move_and_its_ending(width: int) -> None:
    result = make()
    text = printed_on(width, print_positioning, result)
    assert all(each in text for each in cells(move_table(result)))
    assert all(each in text for each in cells(estimate_table(result)))
