"""Runs of a controller on the mass of Table 1, and several in a row."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.control import PulseController
from stickslip.records import PositioningOutcome
from studies.pulse_run import PulseRun, run_pulses
from studies.van_de_wijdeven.part_b.setting import DURATION, RUNS_IN_A_ROW, TOLERANCE, source_plant
from studies.van_de_wijdeven.records import CarriedRuns

_END = (
    0.5  # of a run, in which its final error is looked for: an axis that cycles is never there [s]
)


@dataclass(frozen=True, kw_only=True)
class Series:
    """Consecutive runs of one controller."""

    #: That of each run; all but the first begin with what the one before had learned.
    controllers: tuple[PulseController, ...]
    runs: tuple[PulseRun, ...]  #: What they did.

    def error(self, run: int) -> Float[np.ndarray, " n"]:
        """Return target less position at each sample of a run [m]."""
        return self.controllers[run].target - self.runs[run].run.motion.position

    def final_error(self, run: int) -> float:
        """Return the largest error of a run's last half second, with its sign [m]."""
        samples = round(_END / self.controllers[run].sampling_time)
        last = self.error(run)[-samples:]
        return float(last[np.argmax(np.abs(last))])

    def reached(self, run: int) -> bool:
        """Return whether a run ended at rest within the tolerance."""
        return self.runs[run].outcome is PositioningOutcome.REACHED

    def settling_time(self, run: int) -> float:
        """Return when the error came within the tolerance for good; NaN if it never did [s]."""
        outside = np.flatnonzero(np.abs(self.error(run)) > TOLERANCE)
        if not self.reached(run):
            return np.nan
        return float(self.runs[run].run.motion.time[outside[-1] + 1]) if outside.size else 0.0

    def efforts(self, run: int) -> Float[np.ndarray, " k"]:
        """Return the efforts of a run's pulses, in order [N]."""
        return np.array([pulse.levels[0][0] for pulse in self.runs[run].pulses])

    def estimate(self, run: int, name: str) -> Float[np.ndarray, " k"]:
        """Return an estimate at the start of a run and after each pulse [SI]."""
        return self.runs[run].estimates[name]

    def reversed_pulses(self, run: int) -> int:
        """Return how many pulses of a run pushed back, against the first."""
        efforts = self.efforts(run)
        return int(np.sum(efforts * efforts[:1] < 0.0))


def one_run(controller: PulseController, *, duration: float = DURATION) -> PulseRun:
    """Run a controller on the mass of Table 1, from rest at 0, with ideal sensors."""
    return run_pulses(
        source_plant(), controller, sampling_time=controller.sampling_time, duration=duration
    )


def series_of(
    first: PulseController,
    *,
    runs: int = RUNS_IN_A_ROW,
    keep_covariance: bool = True,
    last: Callable[[Mapping[str, float]], bool] | None = None,
) -> Series:
    """Run a controller several times, each time with what it learned in the run before.

    Without ``keep_covariance`` each run goes on with the estimates alone. A run that ends with
    estimates of which ``last`` is true is the last one.
    """
    controllers, done = [first], [one_run(first)]
    for _ in range(1, runs):
        before, state = controllers[-1], done[-1].run.controller_state
        if last is not None and last(before.estimates(state)):
            break
        learned = before.learned(state)
        controllers.append(before.resumed(learned, keep_covariance=keep_covariance))
        done.append(one_run(controllers[-1]))
    return Series(controllers=tuple(controllers), runs=tuple(done))


def carried(
    series: Series, *, controller: str, reading: str, longest_pulse: float | None
) -> CarriedRuns:
    """Return the results of a series, run by run."""
    runs = range(len(series.runs))
    names = [
        name for name in ("pulse_gain", "coulomb_friction") if name in series.runs[0].estimates
    ]
    return CarriedRuns(
        controller=controller,
        reading=reading,
        longest_pulse=longest_pulse,
        final_error=np.array([series.final_error(run) for run in runs]),
        reached=np.array([series.reached(run) for run in runs]),
        time=np.array([series.settling_time(run) for run in runs]),
        pulses=np.array([len(series.runs[run].pulses) for run in runs]),
        reversed_pulses=np.array([series.reversed_pulses(run) for run in runs]),
        estimates={
            name: np.array([float(series.estimate(run, name)[-1]) for run in runs])
            for name in names
        },
    )
