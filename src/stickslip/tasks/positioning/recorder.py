"""A controller whose pulses, estimates and phases are recorded along a run."""

from collections.abc import Callable, Sequence
from math import ceil
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import PositionController
from stickslip.records import LandingPhase, PositioningOutcome, PulseRecord, SensorSample

_NOTED = 600  # times in a run at which estimates of an estimator that runs along are recorded

_PROGRESS = 50  # samples between two calls of the progress

Notes = dict[str, Float[np.ndarray, " k"]]


class Recorder:
    """A controller that steps another one, sets its targets, and records its results.

    It runs in Python, so that nothing has to be compiled for a single short run. Estimates are
    recorded at the first sample, whenever the outcome of a pulse becomes known, on a rigid axis
    when a phase begins, and at the end of a move that has changed them; those with standard
    deviations also at regular times. Of a flexible arm, estimates without a standard deviation are
    left out.

    ``targets`` [m or rad] are one a move, the first of which is set already; ``samples`` are those
    of a move; ``advance`` is called now and then with the number of samples done.
    """

    def __init__(
        self,
        controller: PositionController[Any],
        targets: Sequence[float],
        samples: int,
        *,
        flexible: bool = False,
        advance: Callable[[int], None] = lambda _: None,
    ) -> None:
        self._controller: Any = controller
        self._step = self._controller.step
        self._targets, self._samples = targets, samples
        self._flexible, self._advance = flexible, advance
        self._every = ceil(max(len(targets), 1) * samples / _NOTED)
        self._k = self._known = self._seen = 0
        self._time = 0.0
        self._times: list[float] = []
        self._values: list[dict[str, float]] = []
        self._deviations: list[dict[str, float]] = []
        self.sampling_time: float = self._controller.sampling_time
        self.pulses: list[PulseRecord] = []
        self.outcomes: list[PositioningOutcome | None] = []
        self.reasons: list[str | None] = []

    def init(self) -> Any:
        """Return the state before the first sample."""
        return self._controller.init()

    def step(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        """Step the controller, to the next target when it is time."""
        move, k = divmod(self._k, self._samples)
        if k == 0 and move > 0:
            self.end_move(state)
            state = self._controller.retargeted(state, self._targets[move])
        if k % _PROGRESS == 0:
            self._advance(self._k)
        state, effort = self._step(state, sample)
        self._record(state, sample.time)
        self._k += 1
        return state, effort

    def end_move(self, state: Any) -> None:
        """Record the outcome of a move, and the estimates if they have changed."""
        self.outcomes.append(self._controller.outcome(state))
        self.reasons.append(self._controller.why(state))
        self._note(state, self._time, changed=True)

    def _record(self, state: Any, time: float) -> None:
        controller = self._controller
        known = controller.pulse_count(state)
        if known != self._known:
            self._known = known
            pulse = controller.last_pulse(state)
            if pulse is not None:
                self.pulses.append(pulse)
        events = len(self.pulses)
        if not self._flexible:
            events += len(controller.phases(state))
        regular = self._k % self._every == 0 and bool(self._deviations and self._deviations[0])
        if self._k == 0 or regular or events != self._seen:
            self._seen = events
            self._note(state, time)
        self._time = time

    def _note(self, state: Any, time: float, *, changed: bool = False) -> None:
        """Record the estimates, if there are any; or only if they have changed."""
        values = self._controller.estimates(state)
        spread = self._controller.deviations(state)
        if not values:
            return
        noted = {name: values[name] for name in (spread if self._flexible else values)}
        if changed and self._values and noted == self._values[-1]:
            return
        self._times.append(time)
        self._values.append(noted)
        self._deviations.append(spread)

    @property
    def times(self) -> Float[np.ndarray, " k"]:
        """Times at which estimates were recorded [s]."""
        return np.array(self._times)

    @property
    def estimates(self) -> Notes:
        """Estimates at these times, by name [SI]."""
        return _by_name(self._values)

    @property
    def deviations(self) -> Notes:
        """Standard deviations of some of them at these times, by name [SI]."""
        return _by_name(self._deviations)

    def phases(self, state: Any, end: float) -> tuple[LandingPhase, ...]:
        """Return the phases of a finished run."""
        phases = self._controller.phases(state)
        ends = [*(each.start for each in phases[1:]), end][: len(phases)]
        return tuple(
            LandingPhase(name=each.name, start_time=each.start, end_time=until, reason=each.reason)
            for each, until in zip(phases, ends, strict=True)
        )


def _by_name(notes: Sequence[dict[str, float]]) -> Notes:
    return {name: np.array([each[name] for each in notes]) for name in notes[0]} if notes else {}
