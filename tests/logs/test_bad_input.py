"""Logs and schemas that cannot be used: one line with what, where and the remedy."""

import os
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import scipy.io
from refusals import refuses

from stickslip.logs import LogSchema, read_log, read_schema
from stickslip.records import InputError

LINEAR = LogSchema(kind="linear")
HEAD = "time,pos,force\n"
GOOD = "0,0,1\n1,2,1\n2,3,1\n"


def refusal(path, schema=LINEAR, axis=None):
    """Return the message of the error that reading ends in, which must be one line."""
    with pytest.raises(InputError) as caught:
        read_log(path, schema, axis)
    message = str(caught.value)
    assert "\n" not in message
    assert caught.value.where
    assert caught.value.remedy
    return message


@pytest.fixture
def file(tmp_path):
    def write(content, name="log.csv"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize(
    ("content", "start", "what"),
    [
        ("", "", "the file is empty"),
        ("\n \n", "log.csv: ", "no rows of numbers"),
        (HEAD, "log.csv: ", "no rows of numbers"),
        ("once upon a time\nthere was\n", "log.csv: ", "no rows of numbers"),
        (b"\x00\x01\x02" * 50, "log.csv: ", "the file is not text"),
        (HEAD + "0,0,1\n", "log.csv: ", "the log has 1 sample, at least 2"),
        (HEAD + "0,0,1\n1,2,oops\n2,3,1\n", "log.csv, row 3: ", "'force' has the text 'oops'"),
        (HEAD + "0,oops,1\n" + GOOD, "log.csv, row 2: ", "'pos' has the text 'oops'"),
        ("# c\n\n" + HEAD + "0,0,1\n\n1,2,x\n", "log.csv, row 6: ", "has the text 'x'"),
        (HEAD + "0,0,1\n1,,1\n2,3,1\n", "log.csv, row 3: ", "'pos' has an empty cell"),
        (HEAD + "0,0,1\n1,1_0,1\n2,3,1\n", "log.csv, row 3: ", "'pos' has the text '1_0'"),
        (HEAD + "0,0,1\n1,nan,1\n2,3,1\n", "log.csv, row 3: ", "column 'pos' is nan (1 of 3"),
        (HEAD + "0,0,1\n1,1,inf\n2,3,-inf\n", "log.csv, row 3: ", "'force' is inf (2 of 3"),
        (HEAD + "0,0,1\n1,1,1e999\n2,3,1\n", "log.csv, row 3: ", "'force' is inf"),
        (HEAD + "nan,0,1\n" + GOOD, "log.csv, row 2: ", "column 'time' is nan"),
        (HEAD + "0,0,1\n2,1,1\n1,3,1\n", "log.csv, row 4: ", "time does not increase at sample 2"),
        (
            HEAD + "0,0,1\n\n0,1,1\n1,3,1\n",
            "log.csv, row 4: ",
            "time does not increase at sample 1",
        ),
        (HEAD + "0,0,1\n1,2\n2,3,1\n", "log.csv, row 3: ", "has 2 columns and the header has 3"),
        (HEAD + "0,0\n1,2,1\n2,3,1\n", "log.csv, row 2: ", "has 2 columns and the header has 3"),
        (HEAD + "0,0,1\n1,2,1\n2,3,1,4\n", "log.csv, row 4: ", "has 4 columns and the header"),
        ("a,b\n" + GOOD, "log.csv, row 1: ", "the header has 2 columns and the rows have 3"),
        (HEAD + "0,7,1\n1,7,1\n2,7,1\n", "log.csv: ", "position (pos) is 7 m in all 3 samples"),
        (HEAD + "0,1,0\n1,2,0\n2,3,0\n", "log.csv: ", "effort (force) is zero in all 3 samples"),
        (
            "time,pos [N],force\n" + GOOD,
            "log.csv: ",
            "position is in N, which is not a unit like m",
        ),
        ("time [m],pos,force\n" + GOOD, "log.csv: ", "time is in m, which is not a unit like s"),
        ("time,pos [foo],force\n" + GOOD, "log.csv: ", "'foo' is not a unit"),
        (GOOD, "log.csv: ", "no column is obviously the position"),
        ("t;x;f\n0,1;1.500;2,5\n0,2;2,0;3,5\n", "log.csv, row 2: ", "'x' has the text '1.500'"),
        ("s,t,x,f\na,0,0,1\nb,1,1\nc,2,3,1\n", "log.csv, row 3: ", "has 3 columns and the header"),
        ("s,t,x,f\na,0,0,1\nb,1,z,1\nc,2,3,1\n", "log.csv, row 3: ", "'x' has the text 'z'"),
        ("s t x f\na 0 0 1\nb 1 1\nc 2 3 1\n", "log.csv, row 3: ", "has 3 columns and the header"),
        ("time,pos,power\n" + GOOD, "log.csv: ", "no column is obviously the effort"),
        (
            "time,postion,force\n" + GOOD,
            "log.csv: ",
            "did you mean 'postion'? say so, as in --position \"postion\" on the command line",
        ),
        ("time,pos,motor torqe\n" + GOOD, "log.csv: ", "did you mean 'motor torqe'? say so"),
        ("tme,pos,force\n" + GOOD, "log.csv: ", "did you mean 'tme'? say so"),
        (
            "pos,vel,force\n" + GOOD,
            "log.csv: ",
            "say how long a sample is: sampling_time or --sampling-time SECONDS",
        ),
        (HEAD + "0\n1,2,1\n2,3,1\n", "log.csv, row 2: ", "has 1 column and the header has 3"),
    ],
)
def test_bad_text(content, start, what, file):
    message = refusal(file(content))
    assert message.startswith(start)
    assert what in message


def test_missing_file(tmp_path):
    assert "no such file or folder" in refusal(tmp_path / "nowhere.csv")


def test_impossible_file_name(tmp_path):
    assert "cannot be read" in refusal(tmp_path / ("x" * 5000 + ".csv"))


@pytest.mark.parametrize(
    ("expression", "what"),
    [
        ("force * 1e400", "has the number 1e400, which is too small or too large"),
        ("1e-400 * force", "has the number 1e-400, which is too small or too large"),
        ("1e300 * force", "the largest effort (1e300 * force) is 3e+300 N, outside 1e-20 to"),
        ("1e-300 * force", "the largest effort (1e-300 * force) is 3e-300 N, outside 1e-20 to"),
        ("1e300 * force * 1e300", "(1e300 * force * 1e300) is inf N, outside 1e-20 to 1e+20 N"),
        ("1e-300 * force * 1e-300", "is zero in all 3 samples"),
    ],
)
def test_factors_out_of_range(expression, what, file):
    schema = LogSchema(kind="linear", effort=expression, units={"effort": "N"})
    assert what in refusal(file(HEAD + "0,0,1\n1,2,3\n2,3,1\n"), schema)


def test_zero_effort_must_be_stated(file):
    path = file(HEAD + "0,0,0\n1,2,0\n2,3,0\n")
    schema = LogSchema(kind="linear", effort="0 * pos", units={"effort": "N"})
    assert read_log(path, schema).effort.tolist() == [0.0, 0.0, 0.0]
    assert 'give effort = "0 * position"' in refusal(path)
    for silent in ("2 * force", "1.5 - 1.5 + force"):
        schema = LogSchema(kind="linear", effort=silent, units={"effort": "N"})
        with pytest.raises(InputError):
            read_log(path, schema)


def test_pipe(tmp_path):
    pipe = tmp_path / "log.csv"
    os.mkfifo(pipe)
    assert "this is a pipe or a device, which are not supported" in refusal(pipe)


@pytest.mark.usefixtures("without_shape_checks")
def test_data_frame_is_no_path():
    with refuses("not_a_path", found="DataFrame"):
        read_log(pd.DataFrame({"t": [0.0, 1.0]}))


@pytest.mark.parametrize("name", ["log.xyz", "log"])
def test_unknown_format(name, file):
    message = refusal(file(HEAD + GOOD, name))
    assert "unknown" in message
    assert ".parquet" in message


def test_folder_without_a_schema(tmp_path):
    assert "this is a folder" in refusal(tmp_path)
    assert "[files]" in refusal(tmp_path, LogSchema(kind="linear", position="q"))


DATA = {"t": np.arange(200) * 0.01, "x": np.sin(np.arange(200) * 0.1), "f": np.ones(200)}


@pytest.mark.parametrize(("name", "save"), [("log.npz", np.savez), ("log.npy", np.save)])
def test_files_of_numpy_run_nothing(name, save, tmp_path):
    class Trap:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "run"),)

    save(tmp_path / name, np.array([Trap()], dtype=object))
    with refuses("no_numbers_over_time"):
        read_log(tmp_path / name)
    assert not (tmp_path / "run").exists()


def test_no_numbers_over_time(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, gain=2.0, name=np.array("stage"))
    assert "no variables with numbers over time" in refusal(path)


def test_columns_of_different_lengths(tmp_path):
    path = tmp_path / "log.npz"
    np.savez(path, **{**DATA, "f": np.ones(199)})
    assert "t has 200 samples and f has 199" in refusal(path)


def test_index_of_a_fault_in_an_array(tmp_path):
    position = DATA["x"].copy()
    position[7] = np.nan
    np.savez(tmp_path / "log.npz", **{**DATA, "x": position})
    scipy.io.savemat(tmp_path / "log.mat", {**DATA, "x": position})
    assert refusal(tmp_path / "log.npz").startswith("log.npz, x at index 7: ")
    assert refusal(tmp_path / "log.mat").startswith("log.mat, x at index 8: ")


@pytest.mark.parametrize(
    ("schema", "start", "what"),
    [
        ({"position": "posi"}, "log.csv: ", "no column 'posi' for position; did you mean 'pos'?"),
        ({"position": "Pos"}, "log.csv: ", "did you mean 'pos'?"),
        ({"position": "zzz"}, "log.csv: ", "the columns are: time, pos, force"),
        ({"effort": "2 * forc"}, "log.csv: ", "no column 'forc' for effort = '2 * forc'; did you"),
        ({"effort": "2 * force +"}, "schema, effort: ", "something is missing at the end"),
        ({"effort": "2 * 3"}, "schema, effort: ", "has no column in it"),
        ({"effort": "force * pos"}, "log.csv: ", "multiplies two columns"),
        ({"effort": "force / 0"}, "log.csv: ", "divides by zero"),
        ({"position": "pos", "units": {"position": "N"}}, "log.csv: ", "position is in N, which"),
        ({"position": "pos", "units": {"time": "mm"}}, "log.csv: ", "time is in mm, which"),
        ({"files": {"a": "log.csv"}}, "", "names files in a folder, and this is one file"),
    ],
)
def test_bad_schemas(schema, start, what, file):
    message = refusal(file(HEAD + GOOD), LogSchema(kind="linear", **schema))
    assert message.startswith(start)
    assert what in message


@pytest.mark.parametrize(
    ("text", "what"),
    [
        ('posision = "x"', "unknown key 'posision'; did you mean 'position'"),
        ("[axes.1]\nfiles = {}", "[axes.1]: unknown key 'files'"),
        ('[units]\nposison = "mm"', "[units]: unknown key 'posison'; did you mean 'position'"),
        ('[axes.1.units]\nvel = "mm"', "[axes.1], [units]: unknown key 'vel'"),
        ("colour = 3", "unknown key 'colour'; the keys are: kind, name, time"),
        ("position = 3", "position is 3: input should be a valid string"),
        ('kind = "round"', "kind is 'round': input should be 'linear' or 'rotary'"),
        ('units = "mm"', "units is 'mm': "),
        ('sampling_time = "0.1"', "sampling_time is '0.1': "),
        ("sampling_time = true", "sampling_time is True: "),
        ("sampling_time = 2024-03-01", "sampling_time is '2024-03-01': "),
        ("sampling_time = -0.1", "sampling_time is -0.1 s, it must be positive"),
        ("sampling_frequency = 0", "sampling_frequency is 0 Hz, it must be positive"),
        ("sampling_time = nan", "sampling_time is nan s, it must be finite"),
        ('time = "t"\nsampling_time = 0.1', "time and sampling_time are both given"),
        ("axes = 3", "axes is 3: "),
        ("position = ", "the schema is not TOML"),
        (b"\xff\xfe", "the schema is not TOML"),
    ],
)
def test_bad_schema_files(text, what, file):
    path = file(text, "axis.toml")
    with pytest.raises(InputError) as caught:
        read_schema(path)
    assert str(caught.value).startswith(str(path))
    assert what in str(caught.value)
    assert "\n" not in str(caught.value)


def test_missing_schema_file(file, tmp_path):
    log = file(HEAD + GOOD)
    assert "no such schema file" in refusal(log, tmp_path / "nowhere.toml")
    assert "the schema file cannot be read" in refusal(log, tmp_path)


@pytest.mark.usefixtures("without_shape_checks")
def test_unknown_kind():
    with refuses("not_a_choice", value="round"):
        LogSchema(kind="round")


FOLDER = LogSchema(
    kind="rotary",
    files={"motor": "q.csv", "signal": "i.csv"},
    sampling_frequency=1000.0,
    position="motor:a / 32",
    effort="32 * signal:a",
)


@pytest.mark.parametrize(
    ("motor", "signal", "start", "what"),
    [
        ("a\n0\n1\n2\n", None, "", "no file 'i.csv' in the folder"),
        ("a\n0\n1\n2\n", "a\n1\n2\n", "", "motor:a has 3 samples and signal:a has 2"),
        ("a\n0\n1\n2\n", "a\n1\nnan\n3\n", "i.csv, row 3: ", "'signal:a' is nan"),
        ("a\n0\n1\n2\n", "a\n1\noops\n3\n", "i.csv, row 3: ", "'a' has the text 'oops'"),
        ("b\n0\n1\n2\n", "a\n1\n2\n3\n", "", "no column 'motor:a' for position"),
    ],
)
def test_bad_folders(motor, signal, start, what, tmp_path):
    (tmp_path / "q.csv").write_text(motor)
    if signal:
        (tmp_path / "i.csv").write_text(signal)
    message = refusal(tmp_path, FOLDER)
    assert message.startswith(start)
    assert what in message


def test_schema_file_is_named(file):
    schema = file('kind = "linear"\neffort = "force +"\n', "axis.toml")
    assert refusal(file(HEAD + GOOD), schema).startswith("axis.toml, effort: ")
    assert refusal(file(HEAD + GOOD), schema, axis=2).startswith("log.csv: axis '2' was chosen")


def test_log_without_permission(file, monkeypatch):
    path = file(HEAD + GOOD)

    def denied(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", denied)
    assert "the log cannot be read (Permission denied)" in refusal(path)


def test_frame_without_motion():
    from stickslip.logs import log_from_frame

    still = pd.DataFrame({"t": [0.0, 1.0], "x": [2.0, 2.0], "f": [1.0, 1.0]})
    with refuses("position_column_constant", where="data frame"):
        log_from_frame(still, LINEAR)
