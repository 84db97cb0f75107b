"""What landings leave behind: their phases, and of a flexible arm both masses and the series."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from jaxtyping import Bool, Float

from stickslip.records.plain import Record
from stickslip.records.quantities import quantity_field

__all__ = ["ArmRun", "ArmSeries", "LandingPhase", "LandingPhaseName"]

LandingPhaseName = Literal["feedback", "resting", "series", "pulses", "done", "stopped"]

_WORDS: dict[LandingPhaseName, str] = {
    "feedback": "Feedback",
    "resting": "Resting",
    "series": "Pulse series",
    "pulses": "Pulses",
    "done": "Done",
    "stopped": "Stopped",
}


@dataclass(frozen=True, kw_only=True)
class LandingPhase(Record):
    """What a controller that lands was doing for a while, and why it began to.

    Attributes
    ----------
    name
        ``"feedback"``: it moves the axis near its target; ``"resting"``: without effort, until mass
        1 of an arm rests and the swing of mass 2 is known; ``"series"``: pulses planned together;
        ``"pulses"``: one after the other, of a rigid axis; ``"done"``; ``"stopped"``.
    start_time, end_time
        Within its run [s].
    reason
        The condition under which it began.
    """

    name: LandingPhaseName
    start_time: float = quantity_field("time")
    end_time: float = quantity_field("time")
    reason: str

    @property
    def word(self) -> str:
        """What is done in it, in a word or two."""
        return _WORDS[self.name]

    @staticmethod
    def words() -> Mapping[LandingPhaseName, str]:
        """Return the words of all phases, by name, in the order in which they follow each other."""
        return {name: _WORDS[name] for name in get_args(LandingPhaseName)}


@dataclass(frozen=True, kw_only=True)
class ArmSeries(Record):
    """A series of pulses: what it was to do with both masses, and what it truly did.

    Attributes
    ----------
    move
        Number of the move that it belongs to.
    start_time
        Of its first pulse, within its run [s].
    sampling_time
        From one planned state to the next [s].
    pulses
        How many it has.
    target
        Where both masses were to rest [m or rad]: the target of the move, or a place from where the
        next series takes them there.
    coulomb_friction, viscous_friction
        With which it was planned [N or N m, N s/m or N m s/rad].
    effort
        Held from each sample to the next, shape (n,) [N or N m].
    position, load_position
        Of mass 1 and of mass 2, as planned, shape (n+1,) [m or rad].
    start_swing
        Amplitude with which mass 2 truly swung before it [m or rad].
    final_position
        Where mass 1 truly rested after it [m or rad]; None if it has not come to rest.
    final_swing
        Amplitude with which mass 2 truly swung about that place; None as before [m or rad].
    """

    json_form = (
        "move start_time duration pulses samples=effort.size target",
        "coulomb_friction viscous_friction start_swing planned_error final_error",
        "final_load_error final_swing planned_effort=effort",
        "planned_position=position planned_load_position=load_position",
    )

    move: int
    start_time: float = quantity_field("time")
    sampling_time: float = quantity_field("sampling_time")
    pulses: int
    target: float = quantity_field("position")
    coulomb_friction: float = quantity_field("coulomb_friction")
    viscous_friction: float = quantity_field("viscous_friction")
    effort: Float[np.ndarray, " n"] = quantity_field("effort")
    position: Float[np.ndarray, " n+1"] = quantity_field("position")
    load_position: Float[np.ndarray, " n+1"] = quantity_field("position")
    start_swing: float = quantity_field("position")
    final_position: float | None = quantity_field("position", default=None)
    final_swing: float | None = quantity_field("position", default=None)

    @property
    def duration(self) -> float:
        """From the begin of the first pulse to the end of the last [s]."""
        return self.effort.size * self.sampling_time

    @property
    def end_time(self) -> float:
        """Of its last pulse, within its run [s]."""
        return self.start_time + self.duration

    @property
    def time(self) -> Float[np.ndarray, " samples"]:
        """Instants of the planned states, within the run, shape (n+1,) [s]."""
        return self.start_time + self.sampling_time * np.arange(self.position.size)

    @property
    def planned_error(self) -> float:
        """Target less the planned place of the mass that is planned farther from it [m or rad]."""
        errors = (
            self.target - float(self.position[-1]),
            self.target - float(self.load_position[-1]),
        )
        return max(errors, key=abs)

    @property
    def final_error(self) -> float | None:
        """Target of the series less where mass 1 truly came to rest [m or rad]."""
        return None if self.final_position is None else self.target - self.final_position

    @property
    def final_load_error(self) -> float | None:
        """How far from the series' target mass 2 truly got at most, in its swing [m or rad]."""
        if self.final_error is None or self.final_swing is None:
            return None
        return abs(self.final_error) + self.final_swing


@dataclass(frozen=True, kw_only=True)
class ArmRun(Record):
    """Both masses of a run, and its series of pulses.

    Attributes
    ----------
    target
        That is on at each sample, shape (n+1,) [m or rad].
    position, load_position
        True, of mass 1 and of mass 2, shape (n+1,) [m or rad].
    measured_position, measured_load_position
        As the sensors showed them, shape (n+1,) [m or rad].
    resting
        Whether mass 1 truly stuck, shape (n+1,).
    series
        In their order.
    """

    json_form = (
        "series target position load_position",
        "measured_position measured_load_position",
    )

    target: Float[np.ndarray, " samples"] = quantity_field("position")
    position: Float[np.ndarray, " samples"] = quantity_field("position")
    load_position: Float[np.ndarray, " samples"] = quantity_field("position")
    measured_position: Float[np.ndarray, " samples"] = quantity_field("position")
    measured_load_position: Float[np.ndarray, " samples"] = quantity_field("position")
    resting: Bool[np.ndarray, " samples"]
    series: tuple[ArmSeries, ...]

    @property
    def error(self) -> Float[np.ndarray, " samples"]:
        """Target less true position of the mass that is farther from it, shape (n+1,)."""
        return _farther(self.target - self.position, self.target - self.load_position)

    @property
    def measured_error(self) -> Float[np.ndarray, " samples"]:
        """As `error`, of the measured positions."""
        return _farther(
            self.target - self.measured_position, self.target - self.measured_load_position
        )


def _farther(
    error: Float[np.ndarray, " n"], load_error: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    return np.where(np.abs(load_error) > np.abs(error), load_error, error)
