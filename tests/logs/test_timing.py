"""Time stamps: jitter is measured, gaps split the log, and both are told."""

import numpy as np
import pytest

from stickslip.logs import LogSchema, read_log

SCHEMA = LogSchema(kind="linear", time="t", position="x", effort="f",
                   units={"time": "s", "position": "m", "effort": "N"})  # fmt: skip


@pytest.fixture
def read(tmp_path):
    def from_times(time):
        path = tmp_path / "log.csv"
        rows = [f"{t!r},{k},1" for k, t in enumerate(np.asarray(time).tolist())]
        path.write_text("\n".join(["t,x,f", *rows, ""]))
        return read_log(path, SCHEMA)

    return from_times


def test_uniform_time_needs_no_words(read):
    log = read(np.round(np.arange(100) * 0.001, 6))
    assert log.source.assumptions == ()
    assert log.sampling_time == pytest.approx(0.001, rel=1e-12)


def test_jitter_is_told(read):
    time = np.arange(100) * 0.01
    time[50] += 0.001
    (told,) = read(time).source.assumptions
    assert told == (
        "steps of the time stamps deviate by up to 10 % from the sampling time of 0.01 s"
    )


def test_gaps_split_the_log(read):
    time = np.arange(30) * 0.5
    time[10:] += 2.0
    time[20:] += 3.0
    log = read(time)
    (told,) = log.source.assumptions
    assert told == (
        "2 gaps split the log into 3 segments; the first is 2.5 s long, before log.csv, row 12"
    )
    assert [len(segment) for segment in log.segments()] == [10, 10, 10]


def test_one_gap(read):
    time = np.arange(30) * 0.5
    time[29:] += 2.0
    (told,) = read(time).source.assumptions
    assert told.startswith("1 gap splits the log into 2 segments")
