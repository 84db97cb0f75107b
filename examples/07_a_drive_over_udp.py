"""Commission an axis on hardware: excite, record, identify, check, position.

Run it: python examples/07_a_drive_over_udp.py

The drive is simulated in another process, in real time, and answers over UDP. It has a watchdog of
its own: without a frame for 0.1 s it applies no effort. To use another drive, replace `UdpAxis`.
"""

import multiprocessing
import socket
import struct
import time
from math import nan
from multiprocessing.connection import Connection

import numpy as np

from stickslip import CoulombViscousFriction, SensorSample, SingleMass, identify, simulate
from stickslip.control import (
    ExactPulseController,
    GuardedController,
    Limits,
    LoopRun,
    LoopSettings,
    Playback,
    RestDetection,
    SensorErrors,
    run,
)

T = 0.01  # s, of the loop
ENCODER = 1e-6  # m
LIMIT = 60.0  # N
TOLERANCE = 2e-4  # m: a desktop computer is late by milliseconds, which make pulses longer
MASS, COULOMB, VISCOUS = 5.0, 20.0, 80.0  # kg, N, N s/m, known to the drive alone
EFFORT, READ, END = b"E", b"R", b"Q"


def drive(ready: Connection) -> None:
    """Simulate the axis in real time, and answer."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
    axis = SingleMass(mass=MASS, friction=law)
    state, effort = (0.0, 0.0), 0.0
    simulate(axis, np.zeros(1), sampling_time=0.001)  # loads the kernels
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bus:
        bus.bind(("127.0.0.1", 0))
        bus.settimeout(0.01)
        ready.send(bus.getsockname()[1])
        now = heard = time.perf_counter()
        while True:
            try:
                frame, sender = bus.recvfrom(64)
                heard = time.perf_counter()
            except TimeoutError:
                frame, sender = b"", None
            steps = int((time.perf_counter() - now) / 0.001)
            if steps:
                motion = simulate(
                    axis, np.full(steps, effort), sampling_time=0.001, initial_state=state
                )
                state = (float(motion.position[-1]), float(motion.velocity[-1]))
                now += steps * 0.001
            if time.perf_counter() - heard > 0.1:
                effort = 0.0
            if frame[:1] == EFFORT:
                (effort,) = struct.unpack("<d", frame[1:])
            elif frame[:1] == READ and sender is not None:
                position = ENCODER * round(state[0] / ENCODER)
                bus.sendto(frame[1:] + struct.pack("<d", position), sender)
            elif frame[:1] == END:
                return


class UdpAxis:
    """Sensors and drive of the axis, over UDP."""

    def __init__(self, port: int) -> None:
        self._bus = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._bus.connect(("127.0.0.1", port))
        self._count = 0

    def read(self) -> SensorSample:
        """Ask for the position; NaN if no answer comes within half a sampling time."""
        self._count += 1
        key = struct.pack("<q", self._count)
        self._bus.send(READ + key)
        end = time.perf_counter() + 0.5 * T
        position = nan
        while (left := end - time.perf_counter()) > 0.0:
            self._bus.settimeout(left)
            try:
                frame = self._bus.recv(64)
            except TimeoutError:
                break
            if frame[:8] == key:  # and not a late answer to an earlier question
                (position,) = struct.unpack("<d", frame[8:])
                break
        return SensorSample(nan, position, nan, nan, nan)

    def write(self, effort: float) -> None:
        """Send an effort, without waiting."""
        self._bus.send(EFFORT + struct.pack("<d", effort))

    def close(self) -> None:
        """End the drive."""
        self._bus.send(END)
        self._bus.close()


def show(title: str, done: "LoopRun[object]") -> None:
    """Print how a loop went."""
    print(
        f"{title}: {done.ending.text}; {done.overruns} overruns, {done.lost_samples} lost samples, "
        f"at most {1e3 * done.latest:.1f} ms late"
    )


def commission(axis: UdpAxis) -> None:
    """Commission the axis, and move it."""
    # Excite and record: efforts of several speeds and reversals, within limits of effort and travel
    t = T * np.arange(600)
    effort = 38.0 * np.sin(4.0 * t) + 16.0 * np.sin(11.0 * t + 1.0)
    limits = LoopSettings(
        sampling_time=T, duration=6.0, effort=LIMIT, travel=(-1.0, 1.0), max_lost=100
    )
    done = run(axis, Playback(effort=effort, sampling_time=T), limits)
    show("Excited", done)
    log = done.recording.log("stage")

    # Identify, and check: a result that is not to be used says so
    found = identify(log).estimate
    values = {n: each.value for n, each in found.parameters.items() if each.value is not None}
    print(
        f"Identified: {found.status.value}, " + ", ".join(f"{n} {v:.3g}" for n, v in values.items())
    )
    if not found.status.trusted:
        raise SystemExit(f"not positioned: {found.status.text}")

    # Position, with guards that know the task
    start = float(log.measured_position[-1])
    target = start + 0.02
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=values["coulomb_friction"], viscous_friction=values["viscous_friction"]
    )
    controller = GuardedController(
        controller=ExactPulseController(
            sampling_time=T,
            target=target,
            tolerance=TOLERANCE,
            rest=RestDetection.for_encoder(resolution=ENCODER, samples=5),
            effort_limit=LIMIT,
            mass=values["mass"],
            friction=law,
            position_noise=ENCODER / 12**0.5,
        ),
        limits=Limits.for_task(
            mass=values["mass"],
            effort_limit=LIMIT,
            sampling_time=T,
            places=(start, target),
            sensors=SensorErrors(encoder_step=ENCODER),
        ),
    )
    limits = LoopSettings(
        sampling_time=T,
        duration=15.0,
        effort=LIMIT,
        travel=(start - 0.05, target + 0.05),
        max_lost=100,
        settled=0.3,
    )
    done = run(axis, controller, limits)
    show("Positioned", done)
    outcome, why = (
        controller.outcome(done.controller_state),
        controller.why(done.controller_state),
    )
    position = done.recording.samples[-1].measured_position
    print(f"{outcome}, {1e6 * (position - target):+.0f} µm off the target; {why or 'no fault'}")


def main() -> None:
    """Start the drive, and commission it."""
    context = multiprocessing.get_context("spawn")
    here, there = context.Pipe()
    process = context.Process(target=drive, args=(there,), daemon=True)
    process.start()
    axis = UdpAxis(here.recv())
    try:
        commission(axis)
    finally:
        axis.close()
        process.join(5.0)


if __name__ == "__main__":
    main()
