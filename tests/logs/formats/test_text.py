"""The many ways of writing columns as text."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.logs import LogSchema, read_log

LINEAR = LogSchema(kind="linear")
ROWS = "0,1,2\n1,2,3\n2,4,5\n"
TIME, POSITION, EFFORT = [0.0, 1.0, 2.0], [1.0, 2.0, 4.0], [2.0, 3.0, 5.0]


@pytest.fixture
def read(tmp_path):
    def from_text(text, schema=LINEAR, encoding="utf-8", name="log.csv"):
        path = tmp_path / name
        path.write_bytes(text.encode(encoding))
        return read_log(path, schema)

    return from_text


@pytest.mark.parametrize(
    "text",
    [
        pytest.param("t,x,F\n" + ROWS, id="plain"),
        pytest.param("t,x,F\r\n0,1,2\r\n1,2,3\r\n2,4,5\r\n", id="Windows line ends"),
        pytest.param("t,x,F\r0,1,2\r1,2,3\r2,4,5\r", id="old Macintosh line ends"),
        pytest.param("t,x,F\n0,1,2\n1,2,3\n2,4,5", id="no last line end"),
        pytest.param("\ufefft,x,F\n" + ROWS, id="byte order mark"),
        pytest.param("t;x;F\n0;1;2\n1;2;3\n2;4;5\n", id="semicolons"),
        pytest.param("t;x;F\n0,0;1,0;2,0\n1,0;2,0;3,0\n2,0;4,0;5,0\n", id="decimal commas"),
        pytest.param("t\tx\tF\n0\t1\t2\n1\t2\t3\n2\t4\t5\n", id="tabs"),
        pytest.param("t x   F\n 0  1 2\n1\t2 3 \n2 4 5\n", id="blanks"),
        pytest.param("t, x, F\n0, 1, 2\n1, 2, 3\n2, 4, 5\n", id="commas and blanks"),
        pytest.param('"t","x","F"\n' + ROWS, id="quoted names"),
        pytest.param('"t","x","F"\n"0","1","2"\n"1","2","3"\n"2","4","5"\n', id="all quoted"),
        pytest.param("t,x,F\ns,m,N\n" + ROWS, id="row of units"),
        pytest.param("t,x,F\n[s],[m],[N]\n" + ROWS, id="row of units in brackets"),
        pytest.param("t [s],x [m],F [N]\n" + ROWS, id="units in names"),
        pytest.param("t x [m] F (N)\n0 1 2\n1 2 3\n2 4 5\n", id="units between blanks"),
        pytest.param("# t x F\n0 1 2\n1 2 3\n2 4 5\n", id="header in a comment"),
        pytest.param("# made by, a, logger\n%\nt,x,F\n" + ROWS, id="comments before"),
        pytest.param("Logger version 2\nRate;1000\n\nt,x,F\n" + ROWS, id="preamble"),
        pytest.param("t,x,F\n# zero, one, two\n\n" + ROWS, id="comment below the header"),
        pytest.param("t,x,F\n0,1,2\n# pause\n\n1,2,3\n2,4,5\n", id="comments between"),
        pytest.param("t,x,F\n0,1,2 # start\n1,2,3\n2,4,5\n", id="remark behind a row"),
        pytest.param("t,x,F,\n0,1,2,\n1,2,3,\n2,4,5,\n", id="comma at the ends"),
        pytest.param(",t,x,F\n0,0,1,2\n1,1,2,3\n2,2,4,5\n", id="unnamed index"),
        pytest.param("state,t,x,F\nrun,0,1,2\n#2,9,9\nrun,1,2,3\nrun,2,4,5\n", id="text column"),
        pytest.param("t,x,F,note\n0,1,2,\n1,2,3,here\n2,4,5,\n", id="notes now and then"),
        pytest.param("t,x,F\n0e0,+1,2.\n1E+0,.2e1,3\n2,4,5\n", id="ways to write a number"),
    ],
)
def test_dialects(text, read):
    log = read(text)
    np.testing.assert_array_equal(log.time, TIME)
    np.testing.assert_array_equal(log.measured_position, POSITION)
    np.testing.assert_array_equal(log.effort, EFFORT)


@pytest.mark.parametrize(
    "rows",
    ["999,5;-1.234.567,25;1\n1.000,5;9,0;2\n", "999.5;-1,234,567.25;1\n1,000.5;9.0;2\n"],
    ids=["points", "commas"],
)
def test_separators_of_thousands(rows, read):
    log = read("x;F;t\n" + rows)
    assert log.measured_position.tolist() == [999.5, 1000.5]
    assert log.effort.tolist() == [-1234567.25, 9.0]


@pytest.mark.parametrize("encoding", ["utf-16", "utf-8-sig", "latin-1"])
def test_encodings(encoding, read):
    log = read("t [s],q [°],tau [Nm]\n0,0,1\n1,180,2\n", LogSchema(), encoding)
    np.testing.assert_allclose(log.measured_position, [0.0, np.pi], rtol=1e-15)
    assert any("Latin-1" in each for each in log.source.assumptions) == (encoding == "latin-1")


def test_without_a_header_the_columns_are_numbered(read):
    schema = LogSchema(kind="linear", time="column_1", position="column_2", effort="-column_3")
    log = read(ROWS, schema)
    np.testing.assert_array_equal(log.effort, [-2.0, -3.0, -5.0])
    assert log.source.assumptions[0].startswith("there is no header row")


def test_one_column_files_of_a_folder(tmp_path):
    (tmp_path / "x.txt").write_text("x\n1\n2\n4\n")
    (tmp_path / "u.txt").write_text("u\n2\n3\n5\n")
    schema = LogSchema(
        kind="linear", files={"a": "x.txt", "b": "u.txt"}, sampling_time=1.0, position="a:x",
        effort="b:u",
    )  # fmt: skip
    log = read_log(tmp_path, schema)
    np.testing.assert_array_equal(log.measured_position, POSITION)


names = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=9)
# Of a size that a log is accepted with.
values = st.floats(-1e20, 1e20).filter(lambda value: value == 0 or abs(value) >= 1e-20)


@given(
    st.lists(names.filter(lambda name: not set(name) & set("\"[](),;#%/'`")), min_size=3,
             max_size=6, unique=True),
    st.integers(2, 30).flatmap(
        lambda n: st.tuples(
            st.lists(st.floats(1e-6, 1e3), min_size=n, max_size=n),
            st.lists(values, min_size=n, max_size=n).filter(lambda v: len(set(v)) > 1),
            st.lists(values, min_size=n, max_size=n).filter(any),
        )
    ),
    st.sampled_from([(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("  ", ".")]),
    st.sampled_from(["\n", "\r\n"]),
    st.booleans(),
    st.sampled_from(["utf-8", "utf-8-sig", "utf-16"]),
    st.sampled_from(["", "# a comment", "\n"]),
)  # fmt: skip
def test_any_dialect_gives_the_numbers_back(
    tmp_path_factory, titles, data, dialect, line_end, quote, encoding, preamble
):
    delimiter, decimal = dialect
    steps, position, effort = data
    time = np.cumsum(steps)
    rows = [preamble] if preamble else []
    titles = [f"n{title}" for title in titles]
    rows.append(delimiter.join(f'"{title}"' if quote else title for title in titles))
    for row in zip(time.tolist(), position, effort, strict=True):
        cells = [repr(each).replace(".", decimal) for each in row]
        rows.append(delimiter.join(cells + ["0"] * (len(titles) - 3)))
    path = tmp_path_factory.mktemp("text") / "log.txt"
    path.write_bytes(line_end.join([*rows, ""]).encode(encoding))
    if np.any(np.diff(time) <= 0):
        return
    schema = LogSchema(kind="linear", time=titles[0], position=titles[1], effort=titles[2],
                       units={"time": "s", "position": "m", "effort": "N"})  # fmt: skip
    log = read_log(path, schema)
    np.testing.assert_array_equal(log.time, time)
    np.testing.assert_array_equal(log.measured_position, position)
    np.testing.assert_array_equal(log.effort, effort)


def test_a_hash_without_a_blank_before_it_belongs_to_its_cell(read):
    with refuses("cell_of_text", name="x", cell="#N/A"):
        read("t,x,F\n0,1,2\n1,#N/A,3\n2,4,5\n")


def test_a_candump_is_named(read):
    frames = [f"(1436509052.{k:06d}) vcan0 0{k % 8}4#2A366C{k:02X}" for k in range(60)]
    with refuses("other_format", format="a candump"):
        read("\n".join(frames))


def test_empty_cells_of_a_slower_channel(read):
    """Nothing of a cell is lost, and the place of the first empty one is named where it is."""
    rows = [f"{k},{k * k},{k if k % 2 else ''}" for k in range(60)]
    log = read("t,x,F\n" + "\n".join(rows) + "\n")
    np.testing.assert_array_equal(log.time, np.arange(1.0, 60.0, 2.0))
    np.testing.assert_array_equal(log.measured_position, log.time**2)
    np.testing.assert_array_equal(log.effort, log.time)
    with refuses("cell_empty", where="log.csv, row 12", name="F"):
        read("t,x,F\n" + "\n".join(f"{k},{k * k},{'' if k == 10 else k}" for k in range(60)))


def test_a_column_may_be_named_as_a_pattern(read):
    schema = LogSchema(kind="linear", time="n0", position="n1", effort="n{axis}")
    log = read("n0,n1,n{axis}\n" + ROWS, schema)
    np.testing.assert_array_equal(log.effort, EFFORT)


@pytest.mark.parametrize(
    "date", ["2024-12-31 {}", "2024-12-31T{}", "2024/12/31 {}", "31.12.2024 {}", "{}"]
)
def test_dates_of_several_forms_are_seconds_since_the_first(read, date):
    clocks = ["23:59:58.5", "23:59:59.000", "23:59:59.5"]
    rows = [f"{date.format(clock)},{k},{k + 1}" for k, clock in enumerate(clocks)]
    log = read("\n".join(["time,x,F", *rows, ""]))
    assert log.time.tolist() == [0.0, 0.5, 1.0]


@pytest.mark.parametrize(("one", "other"), [("31.12.2024 ", "01.01.2025 "), ("", "")])
def test_a_time_goes_on_at_midnight(one, other, read):
    log = read(f"t,x,F\n{one}23:59:59,0,1\n{other}00:00:00,1,2\n")
    assert log.time.tolist() == [0.0, 1.0]


def test_stamps_out_of_order_at_midnight_are_refused(read):
    with refuses("time_not_increasing"):
        read("t,x,F\n23:59:59.5,0,1\n00:00:00.5,1,2\n23:59:59.9,2,3\n00:00:01,3,4\n")


def test_a_delimiter_behind_the_last_name_is_no_column(read):
    log = read("t,x,F,\n" + ROWS)
    assert log.effort.tolist() == EFFORT


LABVIEW = """LabVIEW Measurement|
Writer_Version|2
Reader_Version|2
Separator|Tab
Decimal_Separator|.
Multi_Headings|No
X_Columns|One
Time_Pref|Absolute
Date|2024/11/02
Time|10:12:13.1234567
***End_of_Header***|
|
Channels|2||
Samples|3|3|
Date|2024/11/02|2024/11/02|
Time|10:12:13.1234567|10:12:13.1234567|
Y_Unit_Label|mm|N|
X_Dimension|Time|Time|
X0|0.0000000000000000E+0|0.0000000000000000E+0|
Delta_X|1.000000|1.000000|
***End_of_Header***|||
X_Value|x|F|Comment
0.000000|1000.0|2.0|
1.000000|2000.0|3.0|
2.000000|4000.0|5.0|
""".replace("|", "\t")


@pytest.mark.parametrize("decimal", [".", ","])
def test_a_labview_measurement_file_has_its_units_and_its_time(read, decimal):
    log = read(LABVIEW.replace(".", decimal), schema=LogSchema(), name="log.lvm")
    np.testing.assert_array_equal(log.time, TIME)
    np.testing.assert_allclose(log.measured_position, POSITION, rtol=1e-12)
    np.testing.assert_array_equal(log.effort, EFFORT)
