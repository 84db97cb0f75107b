"""Data frames of every library give the same log."""

import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest
from refusals import refuses

from stickslip.logs import LogSchema, log_from_frame

LINEAR = LogSchema(kind="linear")

FRAMES = {
    "pandas": pd.DataFrame,
    "polars": pl.DataFrame,
    "lazy polars": pl.LazyFrame,
    "pyarrow": pa.table,
}


@pytest.mark.parametrize("library", FRAMES)
def test_frames_give_the_same_log(library, columns, expected, same):
    log = log_from_frame(FRAMES[library](columns), LogSchema(kind="linear", name="stage"))
    same(log, expected)


def test_frames_of_the_same_numbers_have_the_same_hash(columns):
    logs = [log_from_frame(make(columns), LINEAR) for make in FRAMES.values()]
    assert len({log.source.sha256 for log in logs}) == 1
    changed = {**columns, "effort": columns["effort"] + 1.0}
    other = log_from_frame(pd.DataFrame(changed), LINEAR)
    assert other.source.sha256 != logs[0].source.sha256


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


def test_the_index_of_a_pandas_frame_is_its_time(columns, expected, same):
    frame = pd.DataFrame(columns)
    stage = LogSchema(kind="linear", name="stage")
    same(log_from_frame(frame.set_index("time"), stage), expected)
    stamps = pd.Timestamp("2024-03-01") + pd.to_timedelta(frame.pop("time"), unit="s")
    log = log_from_frame(frame.set_index(pd.DatetimeIndex(stamps, name=None)), stage)
    np.testing.assert_allclose(log.time, columns["time"], rtol=0, atol=1e-15)
    log = log_from_frame(pd.DataFrame(columns, index=range(60, 0, -1)), stage)
    np.testing.assert_array_equal(log.time, columns["time"])


@pytest.mark.parametrize("thing", [3, None, [1.0, 2.0], np.zeros((3, 3))])
def test_what_is_no_data_frame(thing):
    with refuses("not_a_frame", where="data frame"):
        log_from_frame(thing)


@pytest.mark.parametrize("library", FRAMES)
def test_bad_columns_of_frames(library, columns):
    missing = [None, *columns["effort"][1:].tolist()]
    with refuses("column_with_gaps", name="effort"):
        log_from_frame(FRAMES[library]({**columns, "effort": missing}), LINEAR)
    with refuses("column_not_numeric", name="effort", found="String"):
        log_from_frame(FRAMES[library]({**columns, "effort": ["a"] * 60}), LINEAR)


@pytest.mark.parametrize("library", FRAMES)
def test_empty_cells_of_a_slower_channel(library, columns):
    every = [value if k % 2 else None for k, value in enumerate(columns["effort"].tolist())]
    log = log_from_frame(FRAMES[library]({**columns, "effort": every}), LINEAR)
    np.testing.assert_array_equal(log.effort, columns["effort"][1::2])
    np.testing.assert_array_equal(log.time, columns["time"][1::2])


def test_a_frame_without_columns():
    with refuses("frame_without_columns"):
        log_from_frame(pd.DataFrame())


@pytest.mark.parametrize("library", ["pandas", "pyarrow"])
def test_a_frame_with_equal_names(library):
    rows = [[0.0, 1.0, 2.0], [1.0, 2.0, 3.0]]
    names = ["t", "x", "x"]
    frames = {
        "pandas": pd.DataFrame(rows, columns=names),
        "pyarrow": pa.table([[0.0, 1.0], [1.0, 2.0], [2.0, 3.0]], names=names),
    }
    with refuses("frame_with_equal_names", where="data frame"):
        log_from_frame(frames[library], LINEAR)


def test_a_frame_has_no_files(columns):
    with refuses("frame_with_files"):
        log_from_frame(pd.DataFrame(columns), LogSchema(kind="linear", files={"a": "a.csv"}))


def test_a_column_of_objects_that_are_numbers(columns, expected, same):
    frame = pd.DataFrame(columns).astype(object)
    same(log_from_frame(frame, LINEAR), expected, name=False)
    frame.loc[3, "effort"] = None
    with refuses("column_not_finite", name="effort"):
        log_from_frame(frame, LINEAR)
    frame.loc[3, "effort"] = "1.5"
    with refuses("column_not_numeric", name="effort", found="Object"):
        log_from_frame(frame, LINEAR)
