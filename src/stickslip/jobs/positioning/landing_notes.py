"""What a landing finds out along its run: phases, pulses, estimates and how sure they are."""

from collections.abc import Sequence
from math import ceil
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import AxisLandingController, AxisLandingState, SupervisorState
from stickslip.jobs.pulse_run import PulseNotes
from stickslip.records import LandingPhase, PulseRecord
from stickslip.simulation import ClosedLoopRun

__all__ = ["NOTED", "LandingNotes", "by_name", "landing_phases"]

NOTED = 600
"""Times in a run at which estimates are noted."""


class LandingNotes:
    """What the landing controller of a single mass has found out, as it becomes known."""

    def __init__(self, controller: AxisLandingController, samples: int) -> None:
        self._controller = controller
        self._every = ceil(samples / NOTED)
        self._k = self._seen = 0
        self._before: list[PulseRecord] = []
        self._present: PulseNotes | None = None
        self._pulsing: object = None
        self._times: list[float] = []
        self._values: list[dict[str, float]] = []
        self._deviations: list[dict[str, float]] = []

    def take(self, state: AxisLandingState, time: float) -> None:
        """Note, after a step, pulses whose outcome has become known, and now and then estimates.

        Parameters
        ----------
        state
            After the step.
        time
            Of its sample [s].
        """
        if state.pulses is not self._pulsing and state.pulses is not None:
            # Each target has a controller of pulses of its own
            self._before = self.pulses
            self._pulsing, self._present = state.pulses, PulseNotes(state.pulses)
        if self._present is not None:
            self._present.take(state.pulse_state, time)
        events = len(self.pulses) + len(state.phases)
        if self._k % self._every == 0 or events != self._seen:
            self._times.append(time)
            self._values.append(self._controller.estimates(state))
            self._deviations.append(self._controller.deviations(state))
        self._k, self._seen = self._k + 1, events

    @property
    def pulses(self) -> list[PulseRecord]:
        """Every pulse whose outcome is known, on the way to all targets."""
        return self._before + ([] if self._present is None else self._present.pulses)

    @property
    def times(self) -> Float[np.ndarray, " k"]:
        """At which estimates were noted [s]."""
        return np.array(self._times)

    @property
    def estimates(self) -> dict[str, Float[np.ndarray, " k"]]:
        """Estimates at these times, by name [SI]."""
        return by_name(self._values)

    @property
    def deviations(self) -> dict[str, Float[np.ndarray, " k"]]:
        """Standard deviations of some of them at these times, by name [SI]."""
        return by_name(self._deviations)


def by_name(notes: Sequence[dict[str, float]]) -> dict[str, Float[np.ndarray, " k"]]:
    """Return by each name what was noted under it.

    Parameters
    ----------
    notes
        All with the same names.
    """
    return {name: np.array([each[name] for each in notes]) for name in notes[0]} if notes else {}


def landing_phases(run: ClosedLoopRun[Any]) -> tuple[LandingPhase, ...]:
    """Return the phases of a run; none of a controller that does not land.

    Parameters
    ----------
    run
        With the controller's last state.
    """
    state = run.controller_state
    phases = state.phases if isinstance(state, SupervisorState) else ()
    starts = [each.start for each in phases]
    ends = [*starts[1:], float(run.motion.time[-1])][: len(starts)]
    return tuple(
        LandingPhase(name=each.name, start_time=each.start, end_time=end, reason=each.reason)
        for each, end in zip(phases, ends, strict=True)
    )
