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
    PreciseController,
    RestDetection,
    SensorErrors,
    run,
)

T = 0.01  # s, of the loop
ENCODER = 1e-6  # m
LIMIT = 60.0  # N
TOLERANCE = 2e-4  # m: a desktop computer is late by milliseconds, which make pulses longer
MASS, COULOMB, VISCOUS = 5.0, 20.0, 80.0  # kg, N, N s/m, known to the drive alone
WATCHDOG = 0.1  # s, of the drive
EFFORT, READ, END = b"E", b"R", b"Q"
FRAME = struct.Struct("<cdd")  # kind, time of sending [s], value


def drive(ready: Connection) -> None:
    """Simulate the axis in real time, and answer.

    A frame carries the time of its sending, and the axis is simulated up to then: a drive answers
    at once, but a desktop computer may not let this process run for milliseconds.
    """
    law = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
    axis = SingleMass(mass=MASS, friction=law)

    def moved(state: tuple[float, float], effort: float, duration: float) -> tuple[float, float]:
        if duration <= 0.0:
            return state
        held = np.array([effort])
        motion = simulate(axis, held, sampling_time=duration, initial_state=state)
        return float(motion.position[-1]), float(motion.velocity[-1])

    state, effort = moved((0.0, 0.0), 0.0, T), 0.0  # loads the kernels
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as bus:
        bus.bind(("127.0.0.1", 0))
        ready.send(bus.getsockname()[1])
        now = time.perf_counter()
        while True:
            frame, sender = bus.recvfrom(64)
            kind, sent, value = FRAME.unpack(frame)
            state = moved(state, effort, min(sent - now, WATCHDOG))
            state = moved(state, 0.0, sent - now - WATCHDOG)
            now = max(now, sent)
            if kind == EFFORT:
                effort = value
            elif kind == READ:
                position = ENCODER * round(state[0] / ENCODER)
                bus.sendto(FRAME.pack(READ, sent, position), sender)
            elif kind == END:
                return


class UdpAxis:
    """Sensors and drive of the axis, over UDP."""

    def __init__(self, port: int) -> None:
        self._bus = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._bus.connect(("127.0.0.1", port))

    def _send(self, kind: bytes, value: float = 0.0) -> float:
        now = time.perf_counter()
        self._bus.send(FRAME.pack(kind, now, value))
        return now

    def read(self) -> SensorSample:
        """Ask for the position; NaN if no answer comes within half a sampling time."""
        asked = self._send(READ)
        position = nan
        while (left := asked + 0.5 * T - time.perf_counter()) > 0.0:
            self._bus.settimeout(left)
            try:
                _, question, answer = FRAME.unpack(self._bus.recv(64))
            except TimeoutError:
                break
            if question == asked:  # and not a late answer to an earlier question
                position = answer
                break
        return SensorSample(measured_position=position)

    def write(self, effort: float) -> None:
        """Send an effort, without waiting."""
        self._send(EFFORT, effort)

    def close(self) -> None:
        """End the drive."""
        self._send(END)
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
        sampling_time=T,
        duration=6.0,
        effort=LIMIT,
        travel=(-1.0, 1.0),
        max_lost=100,
        watchdog=0.5,  # s: the drive has one of its own
    )
    done = run(axis, Playback(effort=effort, sampling_time=T), limits)
    show("Excited", done)
    if not done.ending.normal:
        raise SystemExit(f"not identified: {done.ending.text}")
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
        controller=PreciseController(
            pulses=ExactPulseController(
                sampling_time=T,
                target=target,
                tolerance=TOLERANCE,
                rest=RestDetection.for_encoder(resolution=ENCODER, samples=5),
                effort_limit=LIMIT,
                mass=values["mass"],
                friction=law,
                position_noise=ENCODER / 12**0.5,
            )
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
        watchdog=0.5,
        settled=0.3,
    )
    done = run(axis, controller, limits)
    show("Positioned", done)
    outcome, why = (
        controller.outcome(done.controller_state),
        controller.why(done.controller_state),
    )
    position = float(done.recording.log("stage").measured_position[-1])
    print(
        f"{outcome}, {1e6 * (position - target):+.0f} µm off the target "
        f"(tolerance {1e6 * TOLERANCE:.0f} µm); {why or 'no fault'}"
    )


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
