"""A servo on a CANopen drive in torque mode (CiA 402), over the virtual bus of python-can.

Run it: python examples/09_a_cia402_drive_over_can.py  (needs the packages canopen and python-can)

The drive is simulated, with the clock. Its node answers on the bus as a real one does: service
data for its mode and its rated torque, a state machine that a control word leads to "operation
enabled", and process data at each SYNC. For a real drive, leave out `Drive` and name the interface
of the bus, as in ``network.connect(interface="socketcan", channel="can0")``.
"""

import struct
import threading
import time
from math import isfinite, nan, pi
from typing import Any, cast

import canopen as _canopen
import numpy as np

from stickslip import CoulombViscousFriction, SensorSample, SingleMass, simulate
from stickslip.control import LoopRun, LoopSettings, ProfileController, run

canopen = cast("Any", _canopen)  # its attributes have no types

BUS = {"interface": "virtual", "channel": "stickslip"}
NODE = 5
CONTROL_WORD, STATUS_WORD, MODE, POSITION, TORQUE, RATED_TORQUE = (
    0x6040, 0x6041, 0x6060, 0x6064, 0x6071, 0x6076,
)  # fmt: skip
CYCLIC_TORQUE = 10  # of MODE
SHUT_DOWN, SWITCH_ON, ENABLE = 0x06, 0x07, 0x0F  # control words
STATES = {SHUT_DOWN: 0x21, SWITCH_ON: 0x23, ENABLE: 0x27}  # status words that they lead to
DISABLED = 0x40
PROCESS_OUT, PROCESS_IN = 0x200 + NODE, 0x180 + NODE  # control word and torque; status and position
SYNC = 0x80

T = 0.01  # s, of the loop
COUNTS = 1 << 20  # of the encoder, a turn
RATED = 1.0  # N m
STEP = 0.001  # s, of the simulated axis
WATCHDOG = 0.1  # s without SYNC, after which the drive applies no torque
TARGET, TOLERANCE = 1.0, 2e-3  # rad
INERTIA = 2e-3  # kg m^2
FRICTION = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.01)


def dictionary() -> Any:
    """Return the object dictionary of the drive, in place of its EDS file."""
    unsigned16, signed16 = canopen.objectdictionary.UNSIGNED16, canopen.objectdictionary.INTEGER16
    objects = {
        CONTROL_WORD: ("Controlword", unsigned16),
        STATUS_WORD: ("Statusword", unsigned16),
        MODE: ("Modes of operation", canopen.objectdictionary.INTEGER8),
        POSITION: ("Position actual value", canopen.objectdictionary.INTEGER32),
        TORQUE: ("Target torque", signed16),
        RATED_TORQUE: ("Motor rated torque", canopen.objectdictionary.UNSIGNED32),
    }
    found = canopen.ObjectDictionary()
    for index, (name, kind) in objects.items():
        variable = canopen.objectdictionary.ODVariable(name, index)
        variable.data_type, variable.access_type, variable.default = kind, "rw", 0
        found.add_object(variable)
    return found


class Drive:
    """A simulated drive with its axis."""

    def __init__(self) -> None:
        self._network = canopen.Network()
        self._node = self._network.create_node(NODE, dictionary())
        self._node.sdo[RATED_TORQUE].raw = round(1000 * RATED)  # mN m
        self._node.sdo[STATUS_WORD].raw = DISABLED
        self._node.add_write_callback(self._written)
        self._axis = SingleMass(mass=INERTIA, friction=FRICTION)
        self._state, self._torque = (0.0, 0.0), 0.0
        simulate(self._axis, np.zeros(1), sampling_time=STEP)  # loads the kernels
        self._now = self._heard = time.perf_counter()
        self._network.connect(**BUS)
        self._network.subscribe(SYNC, self._synchronised)
        self._network.subscribe(PROCESS_OUT, self._commanded)

    def close(self) -> None:
        """Leave the bus."""
        self._network.disconnect()

    def _written(self, index: int, data: bytes, **_: object) -> None:
        """Follow a control word that was written as service data."""
        if index == CONTROL_WORD:
            self._follow(int.from_bytes(data, "little"))

    def _follow(self, word: int) -> None:
        self._node.sdo[STATUS_WORD].raw = STATES.get(word, DISABLED)

    def _commanded(self, _: int, data: bytes, __: float) -> None:
        """Apply a torque from its arrival on [0.1 % of the rated one]."""
        self._go_on()
        word, torque = struct.unpack("<Hh", data)
        self._follow(word)
        enabled = self._node.sdo[STATUS_WORD].raw == STATES[ENABLE]
        ready = enabled and self._node.sdo[MODE].raw == CYCLIC_TORQUE
        self._torque = 1e-3 * torque * RATED if ready else 0.0

    def _synchronised(self, *_: object) -> None:
        """Send status and position."""
        self._go_on()
        self._heard = time.perf_counter()
        counts = round(self._state[0] * COUNTS / (2 * pi))
        status = self._node.sdo[STATUS_WORD].raw
        self._network.send_message(PROCESS_IN, struct.pack("<Hi", status, counts))

    def _go_on(self) -> None:
        """Simulate up to now, under the torque so far."""
        steps = int((time.perf_counter() - self._now) / STEP)
        if steps == 0:
            return
        torque = np.full(steps, self._torque)
        torque[self._now + STEP * np.arange(steps) > self._heard + WATCHDOG] = 0.0
        motion = simulate(self._axis, torque, sampling_time=STEP, initial_state=self._state)
        self._state = (float(motion.position[-1]), float(motion.velocity[-1]))
        self._now += STEP * steps


class CanAxis:
    """Sensors and drive of the axis, over CAN."""

    def __init__(self) -> None:
        self._network = canopen.Network()
        self._network.connect(**BUS)
        self._node = self._network.add_node(NODE, dictionary())
        self._answered = threading.Event()
        self._position = nan
        self._network.subscribe(PROCESS_IN, self._received)
        self._rated = 1e-3 * self._node.sdo[RATED_TORQUE].raw  # N m
        self._node.sdo[MODE].raw = CYCLIC_TORQUE
        for word, state in STATES.items():
            self._node.sdo[CONTROL_WORD].raw = word
            if self._node.sdo[STATUS_WORD].raw != state:
                raise RuntimeError(f"the drive does not follow the control word {word:#04x}")

    def _received(self, _: int, data: bytes, __: float) -> None:
        status, counts = struct.unpack("<Hi", data)
        self._position = counts * 2 * pi / COUNTS if status == STATES[ENABLE] else nan
        self._answered.set()

    def read(self) -> SensorSample:
        """Ask for the position; NaN if the drive does not answer within half a sampling time."""
        self._answered.clear()
        self._network.send_message(SYNC, b"")
        position = self._position if self._answered.wait(0.5 * T) else nan
        return SensorSample(measured_position=position)

    def write(self, effort: float) -> None:
        """Send a torque [N m]."""
        torque = round(1000 * effort / self._rated)
        self._network.send_message(PROCESS_OUT, struct.pack("<Hh", ENABLE, torque))

    def close(self) -> None:
        """Shut the drive down, and leave the bus."""
        self._network.send_message(PROCESS_OUT, struct.pack("<Hh", SHUT_DOWN, 0))
        self._network.disconnect()


def move(axis: CanAxis) -> "LoopRun[Any]":
    """Move the axis to its target."""
    servo = ProfileController(
        sampling_time=T,
        target=TARGET,
        tolerance=TOLERANCE,
        mass=INERTIA,
        friction=FRICTION,
        effort_limit=0.5 * RATED,
        position_noise=2 * pi / COUNTS,
    )
    limits = LoopSettings(
        sampling_time=T,
        duration=4.0,
        effort=RATED,
        travel=(-0.5, 1.5),
        max_lost=100,
        watchdog=0.5,  # the drive has one of its own
        settled=0.2,
    )
    return run(axis, servo, limits)


def main() -> float:
    """Switch the drive on and move its axis; return how far it ends from the target [rad]."""
    drive = Drive()
    try:
        axis = CanAxis()
        try:
            done = move(axis)
        finally:
            axis.close()
    finally:
        drive.close()
    if not done.ending.normal:
        raise SystemExit(f"not moved: {done.ending.text}")
    measured = [sample.measured_position for sample in done.recording.samples]
    error = next(position for position in reversed(measured) if isfinite(position)) - TARGET
    print(
        f"{done.ending.text}; {1e3 * error:+.2f} mrad off the target (tolerance "
        f"{1e3 * TOLERANCE:.0f} mrad); {done.overruns} overruns, {done.lost_samples} lost samples"
    )
    return error


if __name__ == "__main__":
    main()
