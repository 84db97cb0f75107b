import os
import stat

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.logs import read_log, write_csv
from stickslip.records import AxisLog

# Of a size that a log is accepted with.
finite = st.floats(-1e20, 1e20).filter(lambda value: value == 0 or abs(value) >= 1e-20)


@given(
    st.sampled_from(["linear", "rotary"]),
    st.integers(2, 20).flatmap(
        lambda n: st.lists(st.lists(finite, min_size=n, max_size=n), min_size=5, max_size=5)
    ),
    st.lists(st.booleans(), min_size=3, max_size=3),
)
def test_every_number_comes_back(same, tmp_path_factory, kind, values, present):
    position, effort, *others = np.array(values)
    if (position == position[0]).all() or not effort.any():
        return
    velocity, load_position, load_velocity = (
        each if there else None for each, there in zip(others, present, strict=True)
    )
    path = tmp_path_factory.mktemp("written") / "stage.csv"
    log = AxisLog(
        name="stage",
        kind=kind,
        time=np.arange(len(position)) / 3.0,
        effort=effort,
        measured_position=position,
        measured_velocity=velocity,
        measured_load_position=load_position,
        measured_load_velocity=load_velocity,
    )
    write_csv(log, path)
    same(read_log(path), log)


def test_a_file_that_exists_is_replaced_in_one_step(expected, tmp_path):
    path = tmp_path / "stage.csv"
    path.write_text("old")
    write_csv(expected, path)
    assert len(read_log(path)) == len(expected)
    assert [each.name for each in tmp_path.iterdir()] == ["stage.csv"]


def test_nothing_half_written_is_left(expected, tmp_path, monkeypatch):
    def full(*_args):
        raise OSError(28, "No space left on device")

    path = tmp_path / "stage.csv"
    path.write_text("old")
    monkeypatch.setattr("pathlib.Path.replace", full)
    with refuses("output_failed", reason="No space left on device"):
        write_csv(expected, path)
    assert path.read_text() == "old"
    assert [each.name for each in tmp_path.iterdir()] == ["stage.csv"]


def test_unwritable_places(expected, tmp_path):
    with refuses("output_without_folder"):
        write_csv(expected, tmp_path / "nowhere" / "stage.csv")
    with refuses("output_is_folder"):
        write_csv(expected, tmp_path)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.skipif(os.name != "posix", reason="file rights as POSIX has them")
def test_the_file_has_the_rights_of_any_new_file(expected, tmp_path):
    write_csv(expected, tmp_path / "stage.csv")
    (tmp_path / "other").touch()
    modes = [stat.S_IMODE((tmp_path / name).stat().st_mode) for name in ("stage.csv", "other")]
    assert modes[0] == modes[1]
