"""Every format gives the same log."""

import sys
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io

from stickslip.logs import LogSchema, log_from_frame, read_log, write_csv
from stickslip.records import InputError, MissingExtraError

LINEAR = LogSchema(kind="linear")


def write_text(path, columns, delimiter=",", decimal="."):
    rows = [delimiter.join(columns)]
    for row in zip(*columns.values(), strict=True):
        rows.append(delimiter.join(repr(float(each)).replace(".", decimal) for each in row))
    path.write_text("\n".join(rows) + "\n")


def write_matlab_73(path, variables):
    """Write what MATLAB writes: HDF5 behind a text header, matrices with their axes swapped."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in variables.items():
            if isinstance(value, dict):
                group = file.create_group(name)
                group.attrs["MATLAB_class"] = np.bytes_("struct")
                for key, inner in value.items():
                    group.create_dataset(key, data=np.atleast_2d(inner))
            else:
                data = file.create_dataset(name, data=np.atleast_2d(value))
                data.attrs["MATLAB_class"] = np.bytes_("double")
        text = file.create_dataset("comment", data=np.array([[104], [105]], dtype=np.uint16))
        text.attrs["MATLAB_class"] = np.bytes_("char")
        file.create_group("#refs#")
    header = (
        b"MATLAB 7.3 MAT-file, Platform: GLNXA64, Created on: Fri Mar 01 2024 HDF5 schema 1.00 ."
    )
    with path.open("r+b") as file:
        file.write(header.ljust(124) + b"\x00\x02IM")


WRITERS = {
    "comma.csv": write_text,
    "semicolon.csv": lambda path, columns: write_text(path, columns, ";"),
    "decimal-comma.csv": lambda path, columns: write_text(path, columns, ";", ","),
    "tab.tsv": lambda path, columns: write_text(path, columns, "\t"),
    "tab-decimal-comma.txt": lambda path, columns: write_text(path, columns, "\t", ","),
    "blanks.txt": lambda path, columns: write_text(path, columns, "   "),
    "parquet.parquet": lambda path, columns: pq.write_table(pa.table(columns), path),
    "version-4.mat": lambda path, columns: scipy.io.savemat(path, columns, format="4"),
    "version-5.mat": scipy.io.savemat,
    "compressed.mat": lambda path, columns: scipy.io.savemat(path, columns, do_compression=True),
    "rows.mat": lambda path, columns: scipy.io.savemat(path, columns, oned_as="row"),
    "version-7.3.mat": write_matlab_73,
    "archive.npz": lambda path, columns: np.savez(path, **columns),
    "compressed.npz": lambda path, columns: np.savez_compressed(path, **columns),
}

FRAMES = {
    "pandas": pd.DataFrame,
    "polars": pl.DataFrame,
    "lazy polars": pl.LazyFrame,
    "pyarrow": pa.table,
}


@pytest.mark.parametrize("name", WRITERS)
def test_files_give_the_same_log(name, columns, expected, same, tmp_path):
    path = tmp_path / name
    WRITERS[name](path, columns)
    log = read_log(path, LINEAR)
    same(log, expected, name=False)
    assert log.name == Path(name).stem
    assert log.source is not None
    assert log.source.files == (name,)


@pytest.mark.parametrize("library", FRAMES)
def test_frames_give_the_same_log(library, columns, expected, same):
    log = log_from_frame(FRAMES[library](columns), LogSchema(kind="linear", name="stage"))
    same(log, expected)


def test_a_written_log_reads_back_without_a_schema(expected, same, tmp_path):
    path = tmp_path / "stage.csv"
    write_csv(expected, path)
    log = read_log(path)
    same(log, expected)


def test_the_source_has_the_hash_of_the_bytes(expected, tmp_path):
    import hashlib

    path = tmp_path / "stage.csv"
    write_csv(expected, path)
    log = read_log(path)
    assert log.source is not None
    assert log.source.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()


def test_frames_of_the_same_numbers_have_the_same_hash(columns):
    logs = [log_from_frame(make(columns), LINEAR) for make in FRAMES.values()]
    assert len({log.source.sha256 for log in logs}) == 1
    changed = {**columns, "effort": columns["effort"] + 1.0}
    other = log_from_frame(pd.DataFrame(changed), LINEAR)
    assert other.source.sha256 != logs[0].source.sha256


@pytest.mark.parametrize("write", [scipy.io.savemat, write_matlab_73], ids=["5", "7.3"])
def test_matlab_structures_matrices_and_numbers(write, columns, tmp_path):
    path = tmp_path / "stage.mat"
    matrix = np.column_stack([columns["position"], columns["load_position"]])
    # HDF5 as MATLAB writes it holds the transpose.
    stored = matrix.T if write is write_matlab_73 else matrix
    write(path, {"log": {"t": columns["time"], "u": columns["effort"]}, "q": stored, "gain": 2.5})
    schema = LogSchema(
        kind="linear", time="log.t", position="q_1", load_position="q_2", effort="gain * log.u"
    )
    log = read_log(path, schema)
    np.testing.assert_array_equal(log.time, columns["time"])
    np.testing.assert_array_equal(log.measured_position, columns["position"])
    np.testing.assert_array_equal(log.measured_load_position, columns["load_position"])
    np.testing.assert_array_equal(log.effort, 2.5 * columns["effort"])


def test_a_matrix_with_samples_in_rows_is_said(columns, tmp_path):
    path = tmp_path / "stage.npz"
    np.savez(
        path,
        time=columns["time"],
        q=np.stack([columns["position"], columns["load_position"]]),
        effort=columns["effort"],
    )
    log = read_log(path, LogSchema(kind="linear", position="q_1", effort="effort"))
    np.testing.assert_array_equal(log.measured_position, columns["position"])
    assert "q is 2 x 60; its longer side is taken as time" in log.source.assumptions


def test_units_in_the_names_of_any_format(columns, tmp_path):
    path = tmp_path / "stage.parquet"
    table = {"time [ms]": columns["time"], "pos (mm)": columns["position"],
             "force [kN]": columns["effort"]}  # fmt: skip
    pq.write_table(pa.table(table), path)
    log = read_log(path)
    np.testing.assert_array_equal(log.time, columns["time"] * 1e-3)
    np.testing.assert_array_equal(log.measured_position, columns["position"] * 1e-3)
    np.testing.assert_array_equal(log.effort, columns["effort"] * 1e3)


def test_parquet_names_with_dots_and_other_types(columns, tmp_path):
    path = tmp_path / "stage.parquet"
    whole = np.arange(60)
    table = {"state": ["run"] * 60, "t": columns["time"], "axis.pos": whole.astype(np.int16),
             "tau": columns["effort"].astype(np.float32)}  # fmt: skip
    pq.write_table(pa.table(table), path)
    log = read_log(path, LogSchema(kind="rotary", position="axis.pos", effort="tau"))
    np.testing.assert_array_equal(log.measured_position, whole)
    np.testing.assert_array_equal(log.effort, columns["effort"].astype(np.float32))


@pytest.mark.parametrize("library", FRAMES)
@pytest.mark.parametrize("stamps", ["dates", "durations"])
def test_dates_and_durations_become_seconds(library, stamps, columns):
    steps = pd.to_timedelta(np.arange(60) * 10, unit="ms")
    time = pd.Timestamp("2024-03-01T12:00:00") + steps if stamps == "dates" else steps
    frame = pl.from_pandas(pd.DataFrame({**columns, "time": time}))
    native = {"pandas": frame.to_pandas, "polars": frame.clone, "lazy polars": frame.lazy,
              "pyarrow": frame.to_arrow}[library]()  # fmt: skip
    log = log_from_frame(native, LINEAR)
    np.testing.assert_allclose(log.time, columns["time"], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "library", "extra"),
    [("parquet.parquet", "pyarrow", "parquet"), ("version-7.3.mat", "h5py", "hdf5")],
)
def test_a_missing_library_names_its_extra(name, library, extra, columns, tmp_path, monkeypatch):
    path = tmp_path / name
    WRITERS[name](path, columns)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=rf"stickslip\[{extra}\]"):
        read_log(path, LINEAR)


@pytest.mark.parametrize("thing", [3, None, [1.0, 2.0], np.zeros((3, 3))])
def test_what_is_no_data_frame(thing):
    with pytest.raises(InputError, match="is no data frame"):
        log_from_frame(thing)


@pytest.mark.parametrize("library", FRAMES)
def test_bad_columns_of_frames(library, columns):
    missing = [None, *columns["effort"][1:].tolist()]
    with pytest.raises(InputError, match=r"row 0 .*'effort' (is empty there|is nan)"):
        log_from_frame(FRAMES[library]({**columns, "effort": missing}), LINEAR)
    with pytest.raises(InputError, match="'effort' holds String, not numbers"):
        log_from_frame(FRAMES[library]({**columns, "effort": ["a"] * 60}), LINEAR)


def test_a_frame_without_columns():
    with pytest.raises(InputError, match="there are no columns"):
        log_from_frame(pd.DataFrame())


def test_a_frame_has_no_files(columns):
    with pytest.raises(InputError, match=r"leave \[files\] out"):
        log_from_frame(pd.DataFrame(columns), LogSchema(kind="linear", files={"a": "a.csv"}))


def test_a_column_of_objects_that_are_numbers(columns, expected, same):
    frame = pd.DataFrame(columns).astype(object)
    same(log_from_frame(frame, LINEAR), expected, name=False)
    frame.loc[3, "effort"] = None
    with pytest.raises(InputError, match=r"column 'effort' is nan \(1 of 60"):
        log_from_frame(frame, LINEAR)
    frame.loc[3, "effort"] = "1.5"
    with pytest.raises(InputError, match=r"column 'effort' holds Object, not numbers"):
        log_from_frame(frame, LINEAR)
