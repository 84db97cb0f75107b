"""A servo on a MuJoCo axis in real time, through the loop that runs controllers on hardware.

Run it: python examples/08_mujoco_in_real_time.py  (needs the package mujoco)

The simulation goes on with the clock, whatever the loop does: a late sample is late here too.
"""

import threading
import time
from typing import Any, cast

import mujoco as _mujoco

from stickslip import SensorSample
from stickslip.control import LoopSettings, PIDController, run

mujoco = cast("Any", _mujoco)  # it has no type information

T, STEP = 0.01, 0.001  # s, of the loop and of MuJoCo
TARGET = 0.05  # m
AXIS = f"""
<mujoco>
  <option gravity="0 0 0" timestep="{STEP}" integrator="implicitfast"/>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
      <joint type="slide" axis="1 0 0" damping="20" frictionloss="5"
        solreffriction="{4 * STEP} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
    </body>
  </worldbody>
</mujoco>
"""


class MuJoCoAxis:
    """A slide with friction that moves with the clock.

    The watchdog of the loop writes from a thread of its own: a lock keeps both threads apart.
    """

    def __init__(self) -> None:
        self._model = mujoco.MjModel.from_xml_string(AXIS)
        self._data = mujoco.MjData(self._model)
        self._lock = threading.Lock()
        self._start = time.perf_counter()

    def _advance(self) -> None:
        """Simulate up to now, under the effort so far; the lock is held."""
        left = time.perf_counter() - self._start - self._data.time
        steps = int(left / STEP)
        if steps > 0:
            mujoco.mj_step(self._model, self._data, nstep=steps)

    def read(self) -> SensorSample:
        """Return position and velocity."""
        with self._lock:
            self._advance()
            position, velocity = float(self._data.qpos[0]), float(self._data.qvel[0])
        return SensorSample(measured_position=position, measured_velocity=velocity)

    def write(self, effort: float) -> None:
        """Apply an effort from now on [N]."""
        with self._lock:
            self._advance()
            self._data.qfrc_applied[0] = effort


def main() -> float:
    """Move the axis for 4 s; return how far it ends from the target [m]."""
    servo = PIDController(
        sampling_time=T,
        target=TARGET,
        position_gain=800.0,
        integral_gain=4000.0,
        velocity_gain=60.0,
        filter_time=0.02,
        effort_limit=40.0,
    )
    limits = LoopSettings(
        sampling_time=T,
        duration=4.0,
        effort=40.0,
        travel=(-0.02, 0.1),
        max_lost=100,
        watchdog=1.0,  # s: a desktop computer is late by tens of milliseconds
    )
    done = run(MuJoCoAxis(), servo, limits)
    if not done.ending.normal:
        raise SystemExit(f"not moved: {done.ending.text}")
    error = done.recording.samples[-1].measured_position - TARGET
    print(
        f"{done.ending.text}; {1e3 * error:+.2f} mm off the target; {done.overruns} overruns, "
        f"rounds of at most {1e3 * done.longest:.2f} ms"
    )
    return error


if __name__ == "__main__":
    main()
