"""Several axes of a log, and the inspection of one, on the command line."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from stage_log import csv_text, table


@pytest.fixture
def two_axes(tmp_path):
    one = table(2000)
    names = list(one)
    path = tmp_path / "gantry.csv"
    columns = {"time [s]": one[names[0]]}
    for axis in ("x", "y"):
        columns[f"{axis}_position [m]"] = one["position [m]"] * (1 if axis == "x" else -1)
        columns[f"{axis}_force [N]"] = one["force [N]"] * (1 if axis == "x" else -1)
    path.write_text(csv_text(columns))
    return path


def test_inspect(run, two_axes, tmp_path):
    outcome = run("inspect", two_axes, "--schema-out", tmp_path / "gantry.toml", "--json", "-")
    document = json.loads(outcome.printed())
    assert [each["name"] for each in document["axes"]] == ["x", "y"]
    assert "x_force" in outcome.err
    assert "[axes.y]" in (tmp_path / "gantry.toml").read_text()


def test_inspect_says_what_is_missing(run, tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t,angle,volts\n0,1,2\n1,2,3\n2,4,3\n")
    outcome = run("inspect", path)
    assert "no column is obviously the effort" in " ".join(outcome.printed(1).split())


@pytest.mark.slow
def test_identify_all_axes(run, two_axes, tmp_path):
    report, file = tmp_path / "r.html", tmp_path / "r.json"
    outcome = run("identify", two_axes, "--report", report, "--json", file,
                  "--validate", two_axes, "--from", 0.5)  # fmt: skip
    assert "2 of 2 axes identified" in outcome.printed()
    document = json.loads(file.read_text())
    assert list(document["axes"]) == ["x", "y"]
    masses = [axis["parameters"]["mass"]["value"] for axis in document["axes"].values()]
    np.testing.assert_allclose(masses, 3.0, rtol=0.02)
    assert document["axes"]["x"]["validation"]["error"] < 0.05
    assert report.stat().st_size > 10_000


def workers_of(process):
    """Return the processes that a process has started."""
    parents = Path(f"/proc/{process.pid}/task").glob("*/children")
    return [int(each) for path in parents for each in path.read_text().split()]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc")
@pytest.mark.parametrize("delay", [0.1, pytest.param(1.0, marks=pytest.mark.slow)])
def test_ctrl_c_is_one_line(two_axes, delay):
    running = subprocess.Popen(
        [sys.executable, "-m", "stickslip", "identify", str(two_axes)],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    deadline = time.monotonic() + 60.0
    while len(workers := workers_of(running)) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    time.sleep(delay)
    os.killpg(running.pid, signal.SIGINT)  # as a terminal does: to all processes of the group
    output, messages = running.communicate(timeout=60)
    assert (running.returncode, output) == (130, "")
    lines = [line for line in messages.splitlines() if "compiling the kernels" not in line]
    assert lines == ["stickslip: interrupted; nothing was left half-written"]
    assert not any(Path(f"/proc/{each}").exists() for each in workers)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs a terminal")
def test_a_terminal_shows_the_axes_while_the_first_is_identified(two_axes):
    terminal, end = os.openpty()
    running = subprocess.Popen(
        [sys.executable, "-m", "stickslip", "identify", str(two_axes)],
        stdout=subprocess.DEVNULL, stderr=end, start_new_session=True,
    )  # fmt: skip
    os.close(end)
    shown = b""
    while b"identifying x, y" not in shown:
        shown += os.read(terminal, 4096)  # an error when the program has ended
    os.killpg(running.pid, signal.SIGINT)
    os.close(terminal)
    assert running.wait(timeout=60) != 0


def test_axis_that_the_log_does_not_have(run, two_axes):
    run("identify", two_axes, "--axis", "z").refused("there is no axis 'z'")


def test_delays_of_logs_for_several_axes(run, two_axes):
    run("identify", two_axes, "--effort-delay", "gantry=0.001").refused("choose an axis")
