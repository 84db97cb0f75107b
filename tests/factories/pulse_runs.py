"""Runs of a pulse controller with every pulse and every estimate recorded, for several tests."""

from collections.abc import Mapping
from typing import Any, NamedTuple

from numpy.typing import NDArray

from stickslip.control import PulseController
from stickslip.plants import Plant
from stickslip.records import PositioningOutcome, PulseRecord
from stickslip.simulation import ClosedLoopRun, simulate_closed_loop
from stickslip.tasks.positioning.recorder import Recorder


class PulseRun(NamedTuple):
    """A finished run; estimates by name at the first sample and after every pulse [SI]."""

    run: ClosedLoopRun[Any]
    pulses: tuple[PulseRecord, ...]
    outcome: PositioningOutcome
    estimate_times: NDArray[Any]
    estimates: Mapping[str, NDArray[Any]]


def run_pulses(
    plant: Plant,
    controller: PulseController,
    *,
    sampling_time: float,
    duration: float,
    **options: Any,
) -> PulseRun:
    """Run a pulse controller on a plant; options as of `simulate_closed_loop`."""
    samples = round(duration / sampling_time)
    recorder = Recorder(controller, (controller.target,), samples)
    run = simulate_closed_loop(
        plant, recorder, sampling_time=sampling_time, samples=samples, **options
    )
    outcome = controller.outcome(run.controller_state)
    return PulseRun(run, tuple(recorder.pulses), outcome, recorder.times, recorder.estimates)
