"""Samples that a loop on hardware has read, and efforts that it has written."""

from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from stickslip.records import AxisKind, AxisLog, SensorSample


@dataclass
class Recording:
    """Samples and efforts of a loop, as far as it has come.

    Hand one to `run` to keep what was recorded when the loop ends by an exception.
    """

    times: list[float] = field(default_factory=list[float])  #: Of reading [s].
    samples: list[SensorSample] = field(default_factory=list[SensorSample])  #: As they were read.
    efforts: list[float] = field(default_factory=list[float])  #: As they were written [N or N m].
    written: list[float] = field(default_factory=list[float])  #: Of writing [s].

    def append(self, time: float, sample: SensorSample, effort: float, written: float) -> None:
        """Add a sample.

        Parameters
        ----------
        time
            When it was read, from the start of the loop [s].
        sample
            What was read.
        effort
            What was written [N or N m].
        written
            When it was written, from the start of the loop [s].
        """
        self.times.append(time)
        self.samples.append(sample)
        self.efforts.append(effort)
        self.written.append(written)

    def log(self, name: str, kind: AxisKind = "linear") -> AxisLog:
        """Return the recording as a log.

        Samples without a position are left out; a channel that is missing in any other sample is
        left out as a whole. The effort of a sample is the mean effort from its reading to the next
        sample: an effort may be written with a delay, and is written at a lost sample too.

        Parameters
        ----------
        name
            Of the axis.
        kind
            ``"linear"`` or ``"rotary"``; decides the units.

        Raises
        ------
        InputError
            If there are fewer than two samples with a position.
        """
        kept = [k for k, each in enumerate(self.samples) if isfinite(each.measured_position)]
        after = [*kept[1:], None]
        position, *others = np.array([self.samples[k][1:] for k in kept]).reshape(-1, 4).T
        velocity, load_position, load_velocity = (
            values if np.all(np.isfinite(values)) else None for values in others
        )
        return AxisLog(
            name=name,
            kind=kind,
            time=np.array([self.times[k] for k in kept]),
            effort=np.array([self._mean_effort(a, b) for a, b in zip(kept, after, strict=True)]),
            measured_position=position,
            measured_velocity=velocity,
            measured_load_position=load_position,
            measured_load_velocity=load_velocity,
        )

    def _mean_effort(self, a: int, b: int | None) -> float:
        """Return the mean effort from sample `a` to `b` [N or N m]; that of `a` if `b` is None.

        An effort acts from its writing to the next one; before the first it is zero.
        """
        if b is None:
            return self.efforts[a]
        mean, T = self.efforts[b - 1], self.times[b] - self.times[a]
        for k in range(a, b):
            before = self.efforts[k - 1] if k > 0 else 0.0
            mean += (before - self.efforts[k]) * (self.written[k] - self.times[a]) / T
        return mean
