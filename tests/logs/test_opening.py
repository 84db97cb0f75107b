"""Sources of a log: compressed files, standard input, URLs, names of any bytes."""

import gzip
import http.server
import io
import os
import sys
import tempfile
import threading
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from sample_files import COMPRESSED, OF_ALL_CHANNELS, OF_JOINTS, text_of

from stickslip.logs import LogSchema, read_axes, read_log, read_schema, reading
from stickslip.records import InputError, MissingExtraError

LINEAR = LogSchema(kind="linear")


@pytest.fixture(autouse=True)
def _no_folders_are_left(tmp_path, monkeypatch):
    scratch = tmp_path / "scratch"
    scratch.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(scratch))
    yield
    assert list(scratch.iterdir()) == []


@pytest.fixture
def standard_input(monkeypatch):
    """Return a function that gives bytes as the standard input."""

    def give(content):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(content)))

    return give


@pytest.fixture
def robot(tmp_path):
    """Return a function that writes a log of two axes, in which a text replaces another."""

    def write(old="", new=""):
        path = tmp_path / "robot.csv"
        rows = "\n".join(f"{k},{k * k},{k % 3},{-k * k},{k % 5}" for k in range(50))
        names = "time [s],a_position [rad],a_torque [N m],b_position [rad],b_torque [N m]"
        path.write_text(f"{names}\n{rows.replace(old, new) if old else rows}")
        return path

    return write


def refused(location, code):
    with pytest.raises(InputError) as caught:
        read_log(location, LINEAR)
    assert caught.value.code == code
    assert "\n" not in str(caught.value)
    return caught.value


@pytest.mark.parametrize("name", COMPRESSED)
def test_a_compressed_log(name, columns, expected, same, tmp_path):
    path = tmp_path / name
    COMPRESSED[name](path, columns)
    log = read_log(path, LINEAR)
    same(log, expected, name=False)
    assert log.name == "log"
    assert log.source.files == (name,)


@pytest.mark.parametrize("inner", ["parquet.parquet", "version-5.mat", "json.mcap"])
def test_a_compressed_log_of_another_format(inner, columns, expected, same, tmp_path):
    OF_ALL_CHANNELS[inner](tmp_path / inner, columns)
    path = tmp_path / f"{inner}.gz"
    path.write_bytes(gzip.compress((tmp_path / inner).read_bytes()))
    same(read_log(path, LINEAR), expected, name=False)


@pytest.mark.parametrize("name", COMPRESSED)
def test_a_compressed_log_cut_short(name, columns, tmp_path):
    path = tmp_path / name
    COMPRESSED[name](path, columns)
    content = path.read_bytes()
    for length in (1, 5, len(content) // 2, len(content) - 1):
        path.write_bytes(content[:length])
        refused(path, "damaged_compression")


def test_the_only_log_in_an_archive_is_taken(columns, expected, same, tmp_path):
    path = tmp_path / "run.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("notes.docx", "none")
        archive.writestr("__MACOSX/._run.csv", "none")
        archive.writestr("data/run.csv", text_of(columns))
    same(read_log(path, LINEAR), expected, name=False)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr("data/other.csv", text_of(columns))
    error = refused(path, "logs_in_archive")
    assert error.quantities["names"] == ["data/run.csv", "data/other.csv"]


@pytest.mark.parametrize("name", ["run.csv", "", "..", "data/..", "x" * 5000 + ".csv"])
def test_names_in_an_archive(name, columns, expected, same, tmp_path):
    path = tmp_path / "run.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(name or "run.csv", text_of(columns))
        if not name:  # as a damaged archive has it
            archive.filelist[0].filename = ""
    if name.endswith(".csv"):
        same(read_log(path, LINEAR), expected, name=False)
    else:
        refused(path, "logs_in_archive")


def test_a_file_that_is_made_to_fill_the_disk(tmp_path):
    path = tmp_path / "bomb.csv.gz"
    path.write_bytes(gzip.compress(b"0,0,0\n" * 20_000_000, compresslevel=1))
    assert path.stat().st_size < 1_000_000
    refused(path, "too_large_decompressed")


def test_standard_input(columns, expected, same, tmp_path, standard_input):
    for name in ("comma.csv", "blanks.txt", "parquet.parquet", "version-5.mat", "datasets.h5"):
        OF_ALL_CHANNELS[name](tmp_path / name, columns)
        standard_input((tmp_path / name).read_bytes())
        log = read_log("-", LINEAR)
        same(log, expected, name=False)
        assert log.name == "standard input"


@pytest.mark.parametrize("name", ["version-1.bag", "ros.mcap", "json.mcap", "protobuf.mcap"])
def test_messages_from_standard_input(name, columns, tmp_path, standard_input):
    write = {**OF_ALL_CHANNELS, **OF_JOINTS}[name]
    write(tmp_path / name, columns)
    standard_input((tmp_path / name).read_bytes())
    log = next(iter(read_axes("-", LINEAR).values()))
    np.testing.assert_array_equal(log.measured_position, columns["position"])
    assert log.source.files == ("standard input",)


@pytest.mark.parametrize("name", [name for name in COMPRESSED if not name.endswith(".zip")])
def test_compressed_standard_input(name, columns, expected, same, tmp_path, standard_input):
    COMPRESSED[name](tmp_path / name, columns)
    content = (tmp_path / name).read_bytes()
    standard_input(content)
    log = read_log("-", LINEAR)
    same(log, expected, name=False)
    assert log.source.files == ("standard input",)
    standard_input(content[:-40])
    refused("-", "damaged_compression")


def test_no_standard_input(standard_input, monkeypatch):
    standard_input(b"")
    refused("-", "empty_log")
    monkeypatch.setattr(sys.stdin, "isatty", lambda: True, raising=False)
    refused(Path("-"), "terminal_as_log")


class _Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_args):
        pass


@pytest.fixture
def server(tmp_path):
    """Address of a server of the files in a folder."""

    def handler(*args):
        return _Quiet(*args, directory=str(tmp_path))

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as each:
        thread = threading.Thread(target=each.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{each.server_port}"
        each.shutdown()
        thread.join()


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_a_url(server, columns, expected, same, tmp_path):
    pytest.importorskip("aiohttp", reason="fsspec reads http through aiohttp")
    COMPRESSED["log.csv.gz"](tmp_path / "log.csv.gz", columns)
    OF_ALL_CHANNELS["comma.csv"](tmp_path / "comma.csv", columns)
    log = read_log(f"{server}/comma.csv?key=secret", LINEAR)
    same(log, expected, name=False)
    assert log.source.files == ("comma.csv",)
    same(read_log(f"{server}/log.csv.gz", LINEAR), expected, name=False)
    # A command line takes it for a path, in which two slashes are one.
    same(read_log(Path(f"{server}/comma.csv"), LINEAR), expected, name=False)
    error = refused(f"{server}/nothing.csv?key=secret", "cannot_fetch")
    assert error.where == "nothing.csv"


def test_urls_of_other_protocols(columns, expected, same, tmp_path):
    OF_ALL_CHANNELS["comma.csv"](tmp_path / "comma.csv", columns)
    same(read_log(f"file://{tmp_path}/comma.csv", LINEAR), expected, name=False)
    refused("nonsense://host/comma.csv", "cannot_fetch")


def test_a_url_needs_its_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "fsspec", None)
    with pytest.raises(MissingExtraError, match=r"stickslip\[url\]"):
        read_log("https://host/log.csv")


@pytest.mark.skipif(sys.platform == "win32", reason="names of files are text there")
@pytest.mark.parametrize("sample", ["comma.csv", "version-5.mat"])
def test_a_name_that_is_no_text(sample, columns, expected, same, tmp_path):
    OF_ALL_CHANNELS[sample](tmp_path / sample, columns)
    name = os.fsdecode(b"t\xfcr") + Path(sample).suffix
    path = (tmp_path / sample).rename(tmp_path / name)
    log = read_log(path, LINEAR)
    same(log, expected, name=False)
    assert log.name == "t\ufffdr"
    assert log.source.files == (f"t\ufffdr{path.suffix}",)
    path.write_bytes(b"")
    error = refused(path, "empty_log")
    error.where.encode()
    refused(tmp_path / os.fsdecode(b"no\xfc.csv"), "no_such_file").where.encode()


def test_a_schema_that_is_a_pipe(tmp_path):
    pipe = tmp_path / "axis.toml"
    os.mkfifo(pipe)
    with pytest.raises(InputError, match="it is a pipe or a device"):
        read_schema(pipe)


@pytest.mark.parametrize("text", ["a = " + "[" * 5000, "a" + ".a" * 50_000 + " = 1"])
def test_a_schema_that_is_nested_deeply(text, tmp_path):
    path = tmp_path / "axis.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_schema(path)
    assert caught.value.where == str(path)


@pytest.mark.slow
def test_many_columns_take_time_in_proportion(tmp_path):
    import time

    def seconds(columns):
        path = tmp_path / "wide.csv"
        names = ["time [s]", "pos [m]", "force [N]", *(f"x{k}" for k in range(columns))]
        rows = [",".join(map(str, np.arange(len(names)) + k)) for k in range(5)]
        path.write_text("\n".join([",".join(names), *rows]))
        begin = time.process_time()
        assert len(read_log(path)) == 5
        return time.process_time() - begin

    seconds(100)  # the library of units loads
    assert seconds(12_000) < 10 * max(seconds(3_000), 0.1)


def test_standard_input_of_the_command_line(columns, standard_input, capsys):
    from stickslip.cli import main

    standard_input(text_of(columns).encode())
    assert main(["inspect", "-", "--kind", "linear"]) == 0
    assert "position is read from column 'position'" in capsys.readouterr().out


def test_each_column_is_loaded_once(robot, monkeypatch):
    """Most formats read the whole file for any column."""
    asked = []

    def counted(*arguments):
        table, *others = open_log(*arguments)
        load = table.load
        table = replace(table, load=lambda names: (asked.append(list(names)), load(names))[1])
        return (table, *others)

    open_log = reading.open_log
    monkeypatch.setattr(reading, "open_log", counted)
    logs = read_axes(robot(), LogSchema(kind="rotary"))
    assert list(logs) == ["a", "b"]
    assert [len(names) for names in asked] == [5]
    assert logs["b"].measured_position[-1] == -(49**2)


def test_a_fault_in_one_axis_leaves_the_other(robot):
    logs = read_axes(robot("7,49,1,-49,2", "7,49,1,-49,?"), LogSchema(kind="rotary"))
    assert logs["a"].samples == 50
    assert logs["b"].code == "cell_of_text"
