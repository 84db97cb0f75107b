"""A pulse controller on a simulated axis, with every pulse and every estimate kept."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.control import PulseController
from stickslip.plants import Plant
from stickslip.records import (
    PositioningOutcome,
    PulseRecord,
    ReadOnlyMapping,
    SensorSample,
    positive,
)
from stickslip.simulation import ClosedLoopRun, Sensors, simulate_closed_loop

__all__ = ["PulseNotes", "PulseRun", "run_pulses"]

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


class PulseNotes:
    """What a pulse controller has found out: its pulses and its estimates, as they become known."""

    def __init__(self, controller: PulseController) -> None:
        self._controller = controller
        self._known = 0
        self._times: list[float] = []
        self._estimates: list[dict[str, float]] = []
        self.pulses: list[PulseRecord] = []

    def take(self, state: State, time: float) -> None:
        """Look, after a step, whether the outcome of a pulse has become known.

        Parameters
        ----------
        state
            After the step.
        time
            Of its sample [s].
        """
        known = self._controller.pulse_count(state)
        if known != self._known:
            self._known = known
            pulse = self._controller.last_pulse(state)
            if pulse is not None:
                self.pulses.append(pulse)
        elif self._times:
            return
        self._times.append(time)
        self._estimates.append(self._controller.estimates(state))

    @property
    def times(self) -> Float[np.ndarray, " k"]:
        """Of the first sample, and of those in which the outcome of a pulse became known [s]."""
        return np.array(self._times)

    @property
    def estimates(self) -> dict[str, Float[np.ndarray, " k"]]:
        """Estimates at these times, by name [SI]."""
        names = self._estimates[0] if self._estimates else ()
        return {name: np.array([each[name] for each in self._estimates]) for name in names}


class _Recorder:
    """A controller that does what another does, and notes what that one has found out."""

    def __init__(self, controller: PulseController) -> None:
        self._controller = controller
        self._step = controller.step
        self.sampling_time = controller.sampling_time
        self.notes = PulseNotes(controller)

    def init(self) -> State:
        """Return the state before the first sample."""
        return self._controller.init()

    def step(self, state: State, sample: SensorSample) -> tuple[State, float]:
        """Step the other controller, and take note."""
        state, effort = self._step(state, sample)
        self.notes.take(state, sample.time)
        return state, effort


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
    recorder = _Recorder(controller)
    samples = round(
        positive("duration", duration, "s") / positive("sampling time", sampling_time, "s")
    )
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
        pulses=tuple(recorder.notes.pulses),
        outcome=controller.outcome(run.controller_state),
        estimate_times=recorder.notes.times,
        estimates=recorder.notes.estimates,
    )
