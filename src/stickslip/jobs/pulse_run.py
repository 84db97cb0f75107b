"""A pulse controller on a simulated axis, with every pulse and every estimate kept."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.control import PulseController
from stickslip.jobs.recorder import Recorder
from stickslip.plants import Plant
from stickslip.records import (
    PositioningOutcome,
    PulseRecord,
    ReadOnlyMapping,
    positive,
)
from stickslip.simulation import ClosedLoopRun, Sensors, simulate_closed_loop

__all__ = ["PulseRun", "run_pulses"]

State = Float[np.ndarray, " s"]


@dataclass(frozen=True, kw_only=True)
class PulseRun:
    """A finished run of a pulse controller.

    Attributes
    ----------
    run
        Truth, log, and the controller's state after the last sample.
    pulses
        Every pulse of which it is known what it did, in order.
    outcome
        How far positioning has come at the end.
    estimate_times
        At the first sample, and whenever the outcome of a pulse became known, shape (k,) [s].
    estimates
        By name, at these times and from each on until the next, shape (k,) each [SI].
    """

    run: ClosedLoopRun[State]
    pulses: tuple[PulseRecord, ...]
    outcome: PositioningOutcome
    estimate_times: Float[np.ndarray, " k"]
    estimates: Mapping[str, Float[np.ndarray, " k"]]

    def __post_init__(self) -> None:
        object.__setattr__(self, "estimates", ReadOnlyMapping(self.estimates))


def run_pulses(
    plant: Plant,
    controller: PulseController,
    *,
    sampling_time: float,
    duration: float,
    sensors: Sensors | None = None,
    generator: np.random.Generator | None = None,
    initial_state: tuple[float, ...] | None = None,
) -> PulseRun:
    """Run a pulse controller on a plant, and keep its pulses and estimates.

    Parameters
    ----------
    plant
        What it moves.
    controller
        What moves it.
    sampling_time
        Of the loop [s].
    duration
        How long, to the nearest sample [s].
    sensors, generator, initial_state
        As `stickslip.simulation.simulate_closed_loop` takes them.

    Raises
    ------
    InputError
        As `stickslip.simulation.simulate_closed_loop` does.
    """
    samples = round(
        positive("duration", duration, "s") / positive("sampling time", sampling_time, "s")
    )
    recorder = Recorder(controller, (controller.target,), samples)
    run = simulate_closed_loop(
        plant,
        recorder,
        sampling_time=sampling_time,
        samples=samples,
        sensors=sensors,
        generator=generator,
        initial_state=initial_state,
    )
    return PulseRun(
        run=run,
        pulses=tuple(recorder.pulses),
        outcome=controller.outcome(run.controller_state),
        estimate_times=recorder.times,
        estimates=recorder.estimates,
    )
