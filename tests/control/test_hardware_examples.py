"""The examples on hardware: a drive in another process, and a simulation in real time."""

import os
import re
import runpy
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"
SCRIPT = """
import sys
sys.path.insert(0, sys.argv[1])
from math import nan
from stickslip import SensorSample
from stickslip.control import LoopSettings, run

class Axis:
    def read(self):
        return SensorSample(nan, 0.0, nan, nan, nan)
    def write(self, effort):
        print(effort, flush=True)

class Constant:
    def init(self): return 0
    def step(self, state, sample): return state, 5.0

settings = LoopSettings(sampling_time=0.05, duration=60.0, effort=9.0, max_lost=1000, watchdog=20.0)
print(run(Axis(), Constant(), settings).ending.value, flush=True)
"""


@pytest.mark.slow
def test_an_axis_over_udp_is_commissioned() -> None:
    """In a process of its own, which starts another one for the drive."""
    done = subprocess.run(
        [sys.executable, "-W", "error", str(EXAMPLES / "07_a_drive_over_udp.py")],
        capture_output=True, text=True, check=False, timeout=200,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    for name, value in (("mass", 5.0), ("coulomb_friction", 20.0), ("viscous_friction", 80.0)):
        (found,) = re.findall(rf"{name} (\S+?)(?:,|$)", done.stdout, re.MULTILINE)
        assert float(found) == pytest.approx(value, rel=0.05), name
    (error,) = re.findall(r"([+-]\d+) µm off the target", done.stdout)
    assert abs(float(error)) < 1000.0


@pytest.mark.slow
def test_a_mujoco_axis_is_moved_in_real_time() -> None:
    pytest.importorskip("mujoco")
    main = runpy.run_path(str(EXAMPLES / "08_mujoco_in_real_time.py"))["main"]
    start = time.perf_counter()
    error = main()
    assert time.perf_counter() - start > 3.9
    assert abs(error) < 2e-3


@pytest.mark.slow
def test_a_drive_on_a_can_bus_is_moved_in_real_time() -> None:
    pytest.importorskip("canopen")
    example = runpy.run_path(str(EXAMPLES / "09_a_cia402_drive_over_can.py"))
    assert abs(example["main"]()) < 5.0 * example["TOLERANCE"]


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_from_outside_stops_safely(sent: signal.Signals, tmp_path: Path) -> None:
    script = tmp_path / "loop.py"
    script.write_text(SCRIPT)
    with subprocess.Popen(
        [sys.executable, str(script), str(EXAMPLES.parent / "src")],
        stdout=subprocess.PIPE, text=True,
    ) as process:  # fmt: skip
        assert process.stdout is not None
        assert [process.stdout.readline().strip() for _ in range(3)] == ["5.0"] * 3
        process.send_signal(sent)
        rest = process.stdout.read().split()
    assert process.returncode == 0
    assert rest[-4:] == ["0.0", "0.0", "0.0", "interrupted"]
