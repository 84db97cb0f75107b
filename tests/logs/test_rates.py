"""Columns of different rates, resampled to the slowest."""

import numpy as np
import pytest

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
    with pytest.raises(InputError) as caught:
        read(made)
    assert caught.value.code == code


def test_a_group_that_is_cut_off():
    """In a damaged file a column may end before the time stamps of its group."""
    made = table({"encoder": {"ta": FAST, "angle": np.cos(FAST)},
                  "drive": {"tb": SLOW, "torque": np.sin(SLOW)[:-1]}})  # fmt: skip
    with pytest.raises(InputError) as caught:
        read(made)
    assert caught.value.code == "unequal_lengths"


def test_a_stated_column_that_is_absent_is_named_before_the_time():
    made = table({"fast": {"t #1": FAST, "pos": FAST}, "slow": {"t #2": SLOW, "tau": SLOW}})
    schema = LogSchema(kind="rotary", position="missing", effort="tau")
    assigned = one_axis(assign(made, schema), None, label="log").checked()
    with pytest.raises(InputError) as caught:
        axis_log(made, assigned, "", None, default_name="log")
    assert caught.value.code == "no_such_column"
    assert caught.value.quantities["name"] == "missing"
