"""What a loop on hardware has read and written."""

from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from stickslip.records import AxisKind, AxisLog, SensorSample

_CHANNELS = (
    "measured_position",
    "measured_velocity",
    "measured_load_position",
    "measured_load_velocity",
)


@dataclass
class Recording:
    """Samples and efforts of a loop, as far as it has come.

    Hand one to `run` to keep what was recorded when the loop ends by an exception.
    """

    times: list[float] = field(default_factory=list[float])  #: Of reading [s].
    samples: list[SensorSample] = field(default_factory=list[SensorSample])  #: As they were read.
    efforts: list[float] = field(default_factory=list[float])  #: As they were written [N or N m].

    def append(self, time: float, sample: SensorSample, effort: float) -> None:
        """Add a sample.

        Parameters
        ----------
        time
            When it was read, from the start of the loop [s].
        sample
            What was read.
        effort
            What was written [N or N m].
        """
        self.times.append(time)
        self.samples.append(sample)
        self.efforts.append(effort)

    def log(self, name: str, kind: AxisKind = "linear") -> AxisLog:
        """Return the recording as a log.

        Samples without a position are left out; a channel that is missing in any other sample is
        left out as a whole.

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
        columns = [
            np.array([getattr(self.samples[k], channel) for k in kept]) for channel in _CHANNELS
        ]
        position, *others = columns
        velocity, load_position, load_velocity = (
            values if np.all(np.isfinite(values)) else None for values in others
        )
        return AxisLog(
            name=name,
            kind=kind,
            time=np.array([self.times[k] for k in kept]),
            effort=np.array([self.efforts[k] for k in kept]),
            measured_position=position,
            measured_velocity=velocity,
            measured_load_position=load_position,
            measured_load_velocity=load_velocity,
        )
