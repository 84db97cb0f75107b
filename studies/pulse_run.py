"""A pulse controller on a simulated axis, with every pulse and every estimate recorded."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.control import PulseController
from stickslip.plants import Plant
from stickslip.records import PositioningOutcome, PulseRecord
from stickslip.simulation import ClosedLoopRun, Sensors, simulate_closed_loop
from stickslip.tasks.positioning.recorder import Recorder


class PulseRun(NamedTuple):
    """A finished run of a pulse controller."""

    #: Truth, log, and the controller's state after the last sample.
    run: ClosedLoopRun[Float[np.ndarray, " s"]]
    pulses: tuple[PulseRecord, ...]  #: Every pulse of known outcome, in order.
    outcome: PositioningOutcome  #: How far positioning has come at the end.
    #: At the first sample, and whenever the outcome of a pulse became known, shape (k,) [s].
    estimate_times: Float[np.ndarray, " k"]
    #: By name, at these times and from each on until the next, shape (k,) each [SI].
    estimates: Mapping[str, Float[np.ndarray, " k"]]


def run_pulses(
    plant: Plant,
    controller: PulseController,
    *,
    sampling_time: float,
    duration: float,
    sensors: Sensors | None = None,
    generator: np.random.Generator | None = None,
) -> PulseRun:
    """Run a pulse controller for a duration, to the nearest sample [s], as `simulate_closed_loop`.

    Raises
    ------
    InputError
        As `stickslip.simulation.simulate_closed_loop` does.
    """
    samples = round(duration / sampling_time)
    recorder = Recorder(controller, (controller.target,), samples)
    run = simulate_closed_loop(
        plant,
        recorder,
        sampling_time=sampling_time,
        samples=samples,
        sensors=sensors,
        generator=generator,
    )
    outcome = controller.outcome(run.controller_state)
    return PulseRun(run, tuple(recorder.pulses), outcome, recorder.times, recorder.estimates)
