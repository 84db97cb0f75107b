"""The public logs that the shipped schemas read, and what was published of them."""

from pathlib import Path

import numpy as np
import pytest
import scipy.io

from stickslip.logs import benchmarks, find_benchmark, read_log, read_schema

EXAMPLES = Path(__file__).parents[2] / "examples"
EMPS_SAMPLES = 24841
EMPS_FORCE_GAIN = 35.15  # N/V, as published, to its digits
TX40_SAMPLES = 45000
TX40_RATIOS = (32, 32, 45, -48, 45, 32)

EMPS_JITTER = 1e-4
"""The file's time stamps are of a 1 kHz recording, exact to better than this fraction."""


@pytest.mark.parametrize("name", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_emps(name, benchmark_data):
    path = benchmark_data(f"emps/{name}")
    log = read_log(path, EXAMPLES / "emps.toml")
    variables = scipy.io.loadmat(path, squeeze_me=True)
    assert (log.name, log.kind, len(log)) == ("EMPS", "linear", EMPS_SAMPLES)
    assert log.sampling_time == pytest.approx(1e-3, rel=1e-6)
    assert log.timing_jitter < EMPS_JITTER
    assert log.segment_starts.tolist() == [0]
    np.testing.assert_array_equal(log.measured_position, variables["qm"])
    np.testing.assert_array_equal(log.effort, float(variables["gtau"]) * variables["vir"])
    assert log.effort == pytest.approx(EMPS_FORCE_GAIN * variables["vir"], rel=1e-4)


def test_emps_is_what_was_published(benchmark_data, monkeypatch):
    folder = benchmark_data("emps/DATA_EMPS.mat").parent
    monkeypatch.setenv("STICKSLIP_DATA", str(folder.parent))
    assert find_benchmark("emps") == folder


@pytest.mark.parametrize("axis", [1, 2, 3, 4, 5, 6])
def test_tx40(axis, benchmark_data):
    folder = benchmark_data("staubli_tx40")
    log = read_log(folder, EXAMPLES / "tx40.toml", axis)
    assert (log.name, log.kind, len(log)) == (f"TX40 axis {axis}", "rotary", TX40_SAMPLES)
    assert log.sampling_time == pytest.approx(2e-4, rel=1e-9)
    column = axis - 1
    motor, signal = (
        np.loadtxt(folder / name, delimiter=",", skiprows=1, usecols=column)
        for name in ("pos_read_data.csv", "curr_data.csv")
    )
    np.testing.assert_array_equal(log.measured_position, motor / TX40_RATIOS[column])
    np.testing.assert_array_equal(log.effort, signal * TX40_RATIOS[column])


def test_the_schemas_that_ship_state_everything():
    emps, tx40 = read_schema(EXAMPLES / "emps.toml"), read_schema(EXAMPLES / "tx40.toml")
    assert emps.kind == "linear"
    assert list(tx40.axes) == ["1", "2", "3", "4", "5", "6"]
    assert set(emps.units) == {"time", "position", "effort"}
    assert set(tx40.units) == {"position", "effort"}


def test_the_address_names_a_whole_commit():
    commit = benchmarks._BENCHMARKS["emps"].address.split("/")[-3]
    assert commit.startswith("d1137b8")
    assert len(commit) == 40
