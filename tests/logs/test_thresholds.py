"""Time stamps, preambles and matrices: jitter, gaps, and both sides of the thresholds."""

import numpy as np
import pytest
from matlab_files import write_matlab_73
from refusals import refuses

from stickslip.logs import LogSchema, read_log
from stickslip.logs.formats.text import _find_layout
from stickslip.records import InputError

SCHEMA = LogSchema(
    kind="linear",
    time="t",
    position="x",
    effort="f",
    units={"time": "s", "position": "m", "effort": "N"},
)


@pytest.fixture
def read(tmp_path):
    def from_times(time):
        path = tmp_path / "log.csv"
        rows = [f"{t!r},{k},1" for k, t in enumerate(np.asarray(time).tolist())]
        path.write_text("\n".join(["t,x,f", *rows, ""]))
        return read_log(path, SCHEMA)

    return from_times


def test_uniform_time_needs_no_note(read):
    log = read(np.round(np.arange(100) * 0.001, 6))
    assert log.source.assumptions == ()
    assert log.sampling_time == pytest.approx(0.001, rel=1e-12)


def test_note_on_jitter(read):
    time = np.arange(100) * 0.01
    time[50] += 0.001
    (assumption,) = read(time).source.assumptions
    assert assumption == (
        "steps of the time stamps deviate by up to 10 % from the sampling time of 0.01 s"
    )


def test_gaps_split_the_log(read):
    time = np.arange(30) * 0.5
    time[10:] += 2.0
    time[20:] += 3.0
    log = read(time)
    (assumption,) = log.source.assumptions
    assert assumption == (
        "2 gaps split the log into 3 segments; the first is 2.5 s long, before log.csv, row 12"
    )
    assert [len(segment) for segment in log.segments()] == [10, 10, 10]


def test_one_gap(read):
    time = np.arange(30) * 0.5
    time[29:] += 2.0
    (assumption,) = read(time).source.assumptions
    assert assumption.startswith("1 gap splits the log into 2 segments")


@pytest.mark.parametrize(("deviation", "noted"), [(0.9e-6, False), (1.1e-6, True)])
def test_jitter_is_noted_from_a_millionth_of_a_step(read, deviation, noted):
    time = np.arange(100.0)
    time[50:] += deviation
    assert bool(read(time).source.assumptions) == noted


@pytest.mark.parametrize(("preamble", "readable"), [(498, True), (499, False)])
def test_data_begin_within_500_lines(tmp_path, preamble, readable):
    path = tmp_path / "log.csv"
    rows = [f"{k},{k},1" for k in range(30)]
    path.write_text("\n".join(["% remark"] * preamble + ["t,x,f", *rows, ""]))
    if readable:
        assert len(read_log(path, SCHEMA)) == 30
    else:
        with pytest.raises(InputError):
            read_log(path, SCHEMA)


@pytest.mark.parametrize(
    ("widths", "readable"),
    [
        ([4] * 25 + [3] * 25, True),  # as many of either width: that of the earlier row
        ([4] * 24 + [3] * 26, False),
        ([4] + [3] * 25 + [4] * 25, False),  # the row before the last 50 does not count
    ],
)
def test_the_last_fifty_rows_decide_how_many_columns_there_are(widths, readable):
    """Rows of numbers above the first one with so many are no names of columns."""
    lines = [",".join("1" * width) + "\n" for width in widths]
    if readable:
        assert _find_layout(lines, "log.csv").first_row == 0
    else:
        with refuses("header_of_other_width", columns=4, width=3):
            _find_layout(lines, "log.csv")


@pytest.mark.parametrize("samples", [2, 3, 4])
def test_samples_are_the_rows_of_a_square_matrix(tmp_path, samples):
    """As MATLAB shows it; HDF5 holds the transpose. Beyond a square, the longer side is time."""
    shown = np.arange(3.0 * samples).reshape(samples, 3) ** 2
    shown[:, 0] = 0.5 * np.arange(samples)
    path = tmp_path / "log.mat"
    write_matlab_73(path, {"q": shown.T})
    schema = LogSchema(kind="linear", time="q_1", position="q_2", effort="q_3")
    if samples == 2:  # 2 x 3: three samples of two columns
        with pytest.raises(InputError):
            read_log(path, schema)
    else:
        np.testing.assert_array_equal(read_log(path, schema).effort, shown[:, 2])
