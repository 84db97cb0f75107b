"""Columns of different rates, resampled to the slowest."""

import numpy as np
import pytest
from refusals import refuses

from stickslip.logs import LogSchema
from stickslip.logs.columns.assignment import assign, one_axis
from stickslip.logs.columns.conversion import axis_log
from stickslip.logs.table import RateGroup, Table
from stickslip.records import InputError


def table(groups, *, units=None):
    """Return a table of groups, each a mapping of columns with its time stamps first."""
    columns = {name: values for group in groups.values() for name, values in group.items()}
    return Table(
        label="log",
        headers={name: name for name in columns},
        units=units or {},
        load=lambda names: {name: columns[name] for name in names},
        place=lambda name, sample: f"log, {name} {sample}",
        groups=tuple(
            RateGroup(columns=tuple(group), time=next(iter(group)), name=name)
            for name, group in groups.items()
        ),
    )


def read(made):
    assigned = assign(made, LogSchema(kind="rotary"))
    return axis_log(
        made, one_axis(assigned, None, label="log").checked(), "", None, default_name="log"
    )


FAST, SLOW = np.arange(0, 2, 0.001), np.arange(0.0003, 1.9, 0.008)


def held(time):
    """Return an effort that changes every 1 ms."""
    return np.sin(7 * np.floor(time / 0.001 + 1e-6) * 0.001)


def test_a_fast_effort_is_averaged_while_it_is_held():
    log = read(table({"drive": {"ta": FAST, "torque": held(FAST)},
                      "encoder": {"tb": SLOW, "angle": np.cos(SLOW)}}))  # fmt: skip
    np.testing.assert_allclose(log.time, SLOW)
    np.testing.assert_array_equal(log.measured_position, np.cos(SLOW))
    fine = np.arange(800) * 1e-5 + 5e-6  # 10 us, in the middle of each
    brute = [held(start + fine).mean() for start in SLOW[:-1]]
    np.testing.assert_allclose(log.effort[:-1], brute, atol=1e-12)
    (note,) = (each for each in log.source.assumptions if "resampled" in each)
    assert "effort of drive" in note
    assert "averaged" in note
    assert "at most 0.5 ms" in note


def test_a_fast_position_is_interpolated():
    log = read(table({"encoder": {"ta": FAST, "angle": np.cos(FAST)},
                      "drive": {"tb": SLOW, "torque": np.sin(SLOW)}}))  # fmt: skip
    np.testing.assert_array_equal(log.effort, np.sin(SLOW))
    bound = 0.001**2 / 8  # of linear interpolation, where the second derivative is at most 1
    np.testing.assert_allclose(log.measured_position, np.cos(SLOW), atol=bound)


def test_one_clock_for_stamps_of_a_calendar():
    start = 1.7e18
    log = read(table({"encoder": {"ta": start + FAST * 1e9, "angle": np.cos(FAST)},
                      "drive": {"tb": start + SLOW * 1e9, "torque": np.sin(SLOW)}}))  # fmt: skip
    np.testing.assert_allclose(log.measured_position, np.cos(SLOW), atol=1e-6)


def test_the_same_stamps_are_left_alone():
    log = read(table({"encoder": {"ta": SLOW, "angle": np.cos(SLOW)},
                      "drive": {"tb": SLOW, "torque": np.sin(SLOW)}}))  # fmt: skip
    assert not any("resampled" in each for each in log.source.assumptions)
    np.testing.assert_array_equal(log.effort, np.sin(SLOW))


@pytest.mark.parametrize(
    ("stamps", "code"),
    [(SLOW + 100.0, "groups_apart"), (SLOW[::-1], "group_time_not_increasing")],
)
def test_groups_that_do_not_fit(stamps, code):
    made = table({"encoder": {"ta": FAST, "angle": np.cos(FAST)},
                  "drive": {"tb": stamps, "torque": np.sin(stamps)}})  # fmt: skip
    with refuses(code):
        read(made)


def test_a_group_that_is_cut_off():
    """In a damaged file a column may end before the time stamps of its group."""
    made = table({"encoder": {"ta": FAST, "angle": np.cos(FAST)},
                  "drive": {"tb": SLOW, "torque": np.sin(SLOW)[:-1]}})  # fmt: skip
    with refuses("unequal_lengths"):
        read(made)


def test_a_stated_column_that_is_absent_is_named_before_the_time():
    made = table({"fast": {"t #1": FAST, "pos": FAST}, "slow": {"t #2": SLOW, "tau": SLOW}})
    schema = LogSchema(kind="rotary", position="missing", effort="tau")
    assigned = one_axis(assign(made, schema), None, label="log").checked()
    with refuses("no_such_column", name="missing"):
        axis_log(made, assigned, "", None, default_name="log")


ROWS = np.arange(2000)


def sparse(values, every, first=0):
    """Return a column with an empty cell but in every n-th row."""
    return np.where(ROWS % every == first, values, np.nan)


@pytest.mark.parametrize("first", [0, 3])
def test_a_channel_with_empty_cells_is_slower(first):
    log = read(table({"": {"t": FAST, "angle": np.cos(FAST),
                           "torque": sparse(np.sin(FAST), 8, first)}}))  # fmt: skip
    np.testing.assert_array_equal(log.time, FAST[first::8])
    np.testing.assert_array_equal(log.effort, np.sin(FAST[first::8]))
    np.testing.assert_array_equal(log.measured_position, np.cos(FAST[first::8]))
    assert any("resampled" in each for each in log.source.assumptions)


def test_one_channel_a_row():
    log = read(table({"": {"t": FAST, "angle": sparse(np.cos(FAST), 2, 0),
                           "torque": sparse(held(FAST), 2, 1)}}))  # fmt: skip
    assert 998 <= log.samples <= 1000
    assert log.sampling_time == pytest.approx(0.002)
    inside = slice(2, -2)
    np.testing.assert_allclose(log.measured_position[inside], np.cos(log.time[inside]), atol=1e-6)


@pytest.mark.parametrize(
    "torque",
    [
        np.where(ROWS % 100 == 0, np.nan, 1.0),  # few
        np.where((ROWS > 500) & (ROWS < 900), np.nan, 1.0),  # many in a row
        np.where(ROWS % 400 == 0, 1.0, np.nan),  # hardly any value
    ],
)
def test_values_that_are_missing_are_no_slower_channel(torque):
    with refuses("column_not_finite"):
        read(table({"": {"t": FAST, "angle": np.cos(FAST), "torque": torque * np.sin(FAST)}}))


def test_an_expression_of_two_rates_is_sampled_where_both_are():
    made = table(
        {"": {"t": FAST, "angle": np.cos(FAST), "a": sparse(FAST, 2), "b": sparse(FAST, 3)}}
    )
    assigned = assign(made, LogSchema(kind="rotary", effort="a + b"))
    log = axis_log(made, one_axis(assigned, None, label="log").checked(), "", None, default_name="")
    np.testing.assert_array_equal(log.effort, 2 * FAST[::6])


@pytest.mark.parametrize("bits", [16, 32])
def test_a_counter_that_begins_again_is_continued(bits):
    counts = np.mod(1000.0 * ROWS + 2**bits - 30000.0, 2**bits)
    log = read(table({"": {"t": counts, "angle": np.cos(FAST), "torque": np.sin(FAST)}},
                     units={"t": "us"}))  # fmt: skip
    np.testing.assert_allclose(log.time - log.time[0], FAST, atol=1e-9)
    assert any(f"a counter of {bits} bits" in each for each in log.source.assumptions)


def test_a_step_back_that_is_no_wrap_is_refused():
    counts = np.where(ROWS < 1000, 1000.0 * ROWS, 1000.0 * (ROWS - 1000))
    with refuses("time_not_increasing"):
        read(table({"": {"t": counts, "angle": np.cos(FAST), "torque": np.sin(FAST)}},
                   units={"t": "us"}))  # fmt: skip


@pytest.mark.parametrize("start", [5e6, 1.2e9, 2.4e9, 2.6e9])
def test_a_counter_of_microseconds_is_no_calendar(start):
    """Between 1e9 and 2.5e9 it is of the size of seconds since 1970, but not its step."""
    log = read(table({"": {"t": start + 1000.0 * ROWS, "angle": np.cos(FAST),
                           "torque": np.sin(FAST)}}))  # fmt: skip
    assert log.sampling_time == pytest.approx(0.001)


def test_an_infinite_value_of_a_slower_channel_is_refused():
    torque = sparse(np.sin(FAST), 8)
    torque[800] = np.inf
    with pytest.raises(InputError) as refused:
        read(table({"": {"t": FAST, "angle": np.cos(FAST), "torque": torque}}))
    assert refused.value.code == "column_not_finite"
    assert "torque 800" in str(refused.value)


def read_stamps(stamps):
    place = np.cumsum(np.ones(stamps.size))
    return read(table({"": {"t": stamps, "angle": np.cos(place), "torque": np.sin(place)}}))


@pytest.mark.parametrize("rounded", [np.floor, np.rint])
@pytest.mark.parametrize("period", [0.25e-3, 0.75e-3, 0.9995e-3, 1.02e-3, 2.5e-3, 9.9e-3])
def test_stamps_of_a_uniform_clock_that_are_rounded_are_uniform(period, rounded):
    log = read_stamps(rounded(1e3 * (period * np.arange(5000) + 3e-4)) / 1e3)
    assert log.timing_jitter < 1e-6
    assert log.sampling_time == pytest.approx(period, abs=1e-3 / 4000)
    assert any("rounded to multiples of 0.001" in each for each in log.source.assumptions)


def test_rounded_stamps_of_a_uniform_clock_may_have_gaps():
    stamps = 2.5e-3 * np.arange(5000) + np.where(np.arange(5000) < 2000, 0.0, 0.1234)
    log = read_stamps(np.floor(1e3 * stamps) / 1e3)
    assert log.segment_starts.tolist() == [0, 2000]
    assert log.timing_jitter < 1e-6
    assert log.sampling_time == pytest.approx(2.5e-3, abs=1e-6)


@pytest.mark.parametrize("resolution", [1e-3, 15.6e-3])
def test_rounded_stamps_of_no_uniform_clock_are_refused_by_that_name(resolution):
    stamps = np.cumsum(np.random.default_rng(1).uniform(0.4e-3, 1e-3, 5000))
    with refuses("time_rounded"):
        read_stamps(np.floor(stamps / resolution) * resolution)


def test_equal_stamps_are_refused_as_such():
    with refuses("time_not_increasing"):
        read_stamps(np.zeros(5000))


def test_a_lost_row_is_not_taken_for_rounding():
    time = np.delete(1e-3 * np.arange(5000), 500)
    log = read_stamps(time)
    np.testing.assert_array_equal(log.time, time)


def test_a_repeated_row_is_refused():
    with pytest.raises(InputError) as refused:
        read_stamps(np.insert(1e-3 * np.arange(5000), 500, 0.499))
    assert refused.value.code == "time_not_increasing"


def test_stamps_with_jitter_are_not_taken_for_rounded():
    steps = 1e-3 * np.random.default_rng(1).integers(8, 13, 5000)
    stamps = np.cumsum(steps)
    log = read_stamps(stamps)
    np.testing.assert_array_equal(log.time, stamps)
