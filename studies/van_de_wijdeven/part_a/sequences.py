"""Five consecutive runs, many times over: what in them is chance, and what is not."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_a.runs import RUNS_IN_A_ROW, Loop, Trace, itse

_EARLY = 10.0  # when "rapidly" is over [s]
_STREAM = 0  # of the seeds


@dataclass(frozen=True, kw_only=True)
class MeanLine:
    """The straight line through the prediction error of one run, in the mean over sequences.

    Sizes are root mean square over the run.
    """

    measured: float  #: Its size [J].
    chance: float  #: Standard error of that, from what differs between the sequences [J].

    @property
    def size(self) -> float:
        """Size less what chance adds to it on average, the best estimate [J]; not below zero."""
        return math.sqrt(max(self.measured**2 - self.chance**2, 0.0))


@dataclass(frozen=True, kw_only=True)
class Sequences:
    """One case in one loop, over several sequences of runs."""

    #: Estimates of Coulomb and viscous friction 10 s after the first run's beginning and at its
    #: half [N, N s/m], shape (sequences, 2).
    early: Float[np.ndarray, "sequences 2"]
    halfway: Float[np.ndarray, "sequences 2"]
    #: The same at the end of each run, shape (sequences, runs, 2).
    values: Float[np.ndarray, "sequences runs 2"]
    #: Of the straight line through the prediction error of each run: its mean, and what it gains
    #: from beginning to end [J], shape (sequences, runs).
    level: Float[np.ndarray, "sequences runs"]
    rise: Float[np.ndarray, "sequences runs"]
    #: Of the prediction error of each run (Eq. 6.3) [J^2 s^2], shape (sequences, runs).
    itse: Float[np.ndarray, "sequences runs"]

    def line(self, run: int) -> MeanLine:
        """Return the mean line through one run's prediction error.

        What is chance in single sequences averages out but for its standard error.
        """
        parts = np.array([self.level[:, run], self.rise[:, run] / np.sqrt(12.0)])
        chance = np.std(parts, axis=1, ddof=1) / np.sqrt(parts.shape[1])
        return MeanLine(
            measured=math.hypot(*np.mean(parts, axis=1).tolist()),
            chance=math.hypot(*chance.tolist()),
        )


def sequence_seeds(seed: int, sequence: int) -> list[np.random.SeedSequence]:
    """Return the seeds of the runs of one sequence; all cases share them."""
    return [
        np.random.SeedSequence(seed, spawn_key=(_STREAM, sequence, run))
        for run in range(RUNS_IN_A_ROW)
    ]


def sequences_of(
    digests: Sequence[Mapping[tuple[Loop, str], Sequences]],
) -> dict[tuple[Loop, str], Sequences]:
    """Return the sequences of all digests together, by loop and case."""
    return {key: _together([each[key] for each in digests]) for key in digests[0]}


def digest(traces: Mapping[tuple[Loop, str], Trace]) -> dict[tuple[Loop, str], Sequences]:
    """Return what one sequence of every case showed, by loop and case."""
    return {key: _digest(trace) for key, trace in traces.items()}


def _together(each: Sequence[Sequences]) -> Sequences:
    return Sequences(
        **{
            field.name: np.concatenate([getattr(one, field.name) for one in each])
            for field in fields(Sequences)
        }
    )


def _digest(trace: Trace) -> Sequences:
    time, error = trace.time, trace.error
    early, halfway = np.searchsorted(time, (_EARLY, 0.5 * time[-1]))
    centred = time - np.mean(time)
    slope = error @ centred / np.sum(centred**2)
    # Copies: a view would keep every sample of every run in memory.
    return Sequences(
        early=trace.values[None, 0, early].copy(),
        halfway=trace.values[None, 0, halfway].copy(),
        values=trace.values[None, :, -1].copy(),
        level=np.mean(error, axis=1)[None],
        rise=slope[None] * (time[-1] - time[0]),
        itse=itse(time, error)[None],
    )
