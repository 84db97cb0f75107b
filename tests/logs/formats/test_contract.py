"""The contract of every log format of the registry, on files that other libraries write."""

import sys
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
import scipy.io
from matlab_files import write_matlab_73

from stickslip.logs import LogSchema, read_log, write_csv
from stickslip.logs.formats.registry import FORMATS, format_of
from stickslip.logs.isolation import read_guarded
from stickslip.records import InputError, MissingExtraError

LINEAR = LogSchema(kind="linear")


def read_here(path):
    """Read a file as the process of the readers does, but in this one, which is quicker."""
    return read_guarded(format_of(path), path)


def write_text(path, columns, delimiter=",", decimal="."):
    rows = [delimiter.join(columns)]
    for row in zip(*columns.values(), strict=True):
        rows.append(delimiter.join(repr(float(each)).replace(".", decimal) for each in row))
    path.write_text("\n".join(rows) + "\n")


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

BY_ROWS = {"text"}  # formats of which the first rows of a file are a file
WHOLE = [name for name in WRITERS if FORMATS[Path(name).suffix].name not in BY_ROWS]


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_of_another_library_gives_its_columns(name, columns, expected, same, tmp_path):
    path = tmp_path / name
    WRITERS[name](path, columns)
    log = read_log(path, LINEAR)
    same(log, expected, name=False)
    assert log.name == Path(name).stem
    assert log.source is not None
    assert log.source.files == (name,)


@pytest.mark.parametrize("ending", FORMATS)
def test_every_ending_in_either_case(ending, columns, tmp_path):
    write = next(
        write for name, write in WRITERS.items() if FORMATS[Path(name).suffix] is FORMATS[ending]
    )
    for name in (f"log{ending}", f"log{ending.upper()}"):
        write(tmp_path / f"written{ending}", columns)
        path = (tmp_path / f"written{ending}").rename(tmp_path / name)
        table = format_of(path).read(path)
        assert table.label == name
        assert tuple(table.headers) == tuple(columns)
        chosen = table.load(["effort", "time"])
        assert set(chosen) == {"effort", "time"}
        np.testing.assert_array_equal(chosen["effort"], columns["effort"])
        assert table.place("effort", 3).startswith(f"{name}, ")


@pytest.mark.parametrize("ending", FORMATS)
def test_other_content_is_refused_with_the_name_of_the_file(ending, tmp_path):
    path = tmp_path / f"log{ending}"
    for content in (b"no such format " * 40, b"\x00", b"PK\x03\x04" + b"x" * 99):
        path.write_bytes(content)
        with pytest.raises(InputError) as caught:
            read_log(path, LINEAR)
        assert caught.value.where.startswith(path.name)
        assert caught.value.remedy


@pytest.mark.parametrize("name", WHOLE)
def test_a_file_cut_short_anywhere_is_refused(name, columns, tmp_path):
    path = tmp_path / name
    WRITERS[name](path, columns)
    content = path.read_bytes()
    for length in range(1, len(content), len(content) // 40):
        path.write_bytes(content[:length])
        with pytest.raises(InputError) as caught:
            read_here(path).load(["time", "effort"])
        assert caught.value.where
        assert caught.value.where.startswith(name)


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


@pytest.mark.parametrize(
    ("name", "library", "extra"),
    [("parquet.parquet", "pyarrow", "parquet"), ("version-7.3.mat", "h5py", "hdf5")],
)
def test_a_missing_library_names_its_extra(name, library, extra, columns, tmp_path, monkeypatch):
    path = tmp_path / name
    WRITERS[name](path, columns)
    monkeypatch.setitem(sys.modules, library, None)
    with pytest.raises(MissingExtraError, match=rf"stickslip\[{extra}\]"):
        format_of(path).read(path)
