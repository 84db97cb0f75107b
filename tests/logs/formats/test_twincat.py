"""Exports of TwinCAT Scope: separators, rate groups, stamps and faults."""

import numpy as np
import pytest
from sample_files import read, write_twincat

from stickslip.records import InputError


@pytest.mark.parametrize("delimiter", ["\t", ";", ":"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("end", [True, False])
def test_two_rate_groups(delimiter, decimal, end, columns, tmp_path):
    path = tmp_path / "scope.csv"
    write_twincat(path, columns, delimiter=delimiter, decimal=decimal, end=end)
    table, loaded = read(path)
    fast, slow = table.groups
    assert [fast.time, slow.time] == ["time #1", "time #2"]
    assert fast.columns == ("time #1", "axis pos", "axis torque")
    assert table.units == {"time #1": "ms", "time #2": "ms", "axis pos": "mm", "axis torque": "Nm"}
    np.testing.assert_array_equal(loaded["time #1"], columns["time"] * 1e3)
    np.testing.assert_array_equal(loaded["axis torque"], columns["effort"])
    np.testing.assert_array_equal(loaded["axis vel"], columns["velocity"][::4])
    assert loaded["time #2"].size == 15
    assert table.place("axis pos", 0) == "scope.csv, row 13"


def test_groups_of_the_same_stamps_are_one(columns, tmp_path):
    path = tmp_path / "scope.csv"
    write_twincat(path, columns, slower=1)
    table, loaded = read(path)
    (group,) = table.groups
    assert group.time == "time"
    assert set(loaded) == {"time", "axis pos", "axis torque", "axis vel"}


def test_names_that_blanks_separate_are_those_of_the_controller(columns, tmp_path):
    path = tmp_path / "scope.csv"
    write_twincat(path, columns, delimiter=" ", decimal=".", slower=1)
    text = path.read_text().replace("mm (Length)", "mm").replace("Nm (Torque)", "Nm")
    path.write_text(text)
    table, loaded = read(path)
    assert {"MAIN.pos", "MAIN.torque", "MAIN.vel"} < set(loaded)
    assert "called by their symbols" in table.notes[0]


def test_stamps_since_1601_are_exact_to_100_ns(columns, tmp_path):
    path = tmp_path / "scope.csv"
    write_twincat(path, columns, decimal=".", slower=1)
    start = 133_500_000_000_000_001
    head, rows = path.read_text().split("Unit\tmm")
    lines = []
    for k, line in enumerate(rows.splitlines()):
        cells = line.split("\t")
        if k > 1 and len(cells) == 5:
            cells[0] = cells[3] = str(start + (k - 2) * 100_001)
        lines.append("\t".join(cells))
    path.write_text(head + "Unit\tmm" + "\n".join(lines))
    table, loaded = read(path)
    assert table.units["time"] == "s"
    np.testing.assert_allclose(np.diff(loaded["time"]), 0.0100001, rtol=1e-12)


def test_a_stamp_that_lost_its_comma_is_a_number(columns, tmp_path):
    path = tmp_path / "scope.csv"
    write_twincat(path, columns)
    path.write_text(path.read_text().replace("\n0,0\t", "\n10123028476644624\t", 1))
    _, loaded = read(path)
    assert loaded["time #1"].dtype == np.float64


@pytest.mark.parametrize(
    ("old", "new", "place"),
    [
        ("\nEOF", "\n1\t2\t3\t4\t5\t6\nEOF", "row 73"),  # a cell too many
        ("\nEOF", "\nten\t2\t3\nEOF", "row 73"),
        ("\nEOF", "\n600,0\t2\t3\t9\t9\nEOF", "row 73"),  # the slow group has ended
        ("Data-Type", "Type", ""),
        ("Data-Type\tREAL64\tREAL64\t", "", ""),
    ],
)
def test_faults(old, new, place, columns, tmp_path):
    path = tmp_path / "scope.csv"
    write_twincat(path, columns)
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(InputError) as caught:
        read(path)
    assert caught.value.where == f"scope.csv, {place}" if place else "scope.csv"
