"""A positioning task that was run on a simulated axis: all that its page draws."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from stickslip.records.pulses import LearnedPulses, PulseRecord
from stickslip.records.quantities import AxisKind, quantity_field, unit_of
from stickslip.records.record import Record, ScenarioTables, Worded, valued_tables

__all__ = [
    "ArmRun",
    "ArmSeries",
    "Ending",
    "LandingPhase",
    "LandingPhaseName",
    "Positioning",
    "PositioningMove",
    "PositioningRun",
]

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


_SCHEMA = 2

_LEGEND = {
    "error": "target less true position; of a flexible arm, of the mass that is farther from it",
    "measured_error": "target less measured position",
    "late_errors": "smallest and largest error in the last half of the move",
    "reason": "why the controller stopped short, if it says so",
    "settling_time": "from the start of the move until the true error is within the tolerance for "
    "good; null: it never is",
    "effort": "held from each sample to the next, so one fewer than samples",
    "pulses.levels": "effort and duration of each part of a pulse",
    "estimates": "at the start of a run and after each pulse whose outcome is known; of a landing, "
    "and of a flexible arm, now and then",
    "deviations": "standard deviations of the estimates, where the controller has them; null "
    "while nothing is known",
    "phases": "of a controller that lands; none: another controller",
    "limits": "of static friction: the strongest effort that has not freed the axis (or the "
    "Coulomb friction), and the weakest that has; null: none",
    "truth": "of the simulated axis; the controller does not see it",
    "swing": "amplitude with which the second mass of a flexible arm swings at the end; null: none",
    "arm": "of a flexible arm: both masses, and the series of pulses; null: a rigid axis",
    "arm.series.final_error": "target of the series less where mass 1 truly came to rest",
    "arm.series.final_load_error": "how far from it mass 2 truly got at most, in its swing",
}
"""What the keys of the JSON document mean, as far as their names do not say it."""


class Ending(Worded):
    """How a move ended, judged by the truth; the text names what happened and the remedy."""

    REACHED = ("reached", "Target reached", "The axis stays within the tolerance.")
    HUNTING = (
        "hunting",
        "Hunting",
        "The axis goes to and fro across its target and does not settle; widen the tolerance, or "
        "take a controller that stops when it cannot improve (method exact).",
    )
    STOPPED = (
        "stopped",
        "Stopped short",
        "The controller stopped, as no pulse that it may give brings the axis closer; widen the "
        "tolerance, give better first guesses, shorten the sampling time, or raise the effort "
        "limit.",
    )
    MISJUDGED = (
        "misjudged",
        "Reached by the sensors only",
        "The sensors show the axis within the tolerance, and in truth it is outside; take better "
        "sensors, average over more samples, or widen the tolerance.",
    )
    SWINGING = (
        "swinging",
        "Swinging",
        "Mass 1 rests within the tolerance, and mass 2 swings on beyond it; take a controller that "
        "takes up the swing (method landing), or widen the tolerance.",
    )
    STUCK = (
        "stuck",
        "Stuck",
        "The axis rests outside the tolerance, and the controller does not free it; give it more "
        "effort, a better first guess, or integral action.",
    )
    UNDER_WAY = (
        "under_way",
        "Still under way",
        "The time ended before the axis came to rest within the tolerance; give it a longer "
        "duration.",
    )

    @property
    def reached(self) -> bool:
        """Whether the axis stays within the tolerance."""
        return self is Ending.REACHED


_ARM_ENDINGS = {
    Ending.REACHED: "Both masses stay within the tolerance.",
    Ending.HUNTING: (
        "Mass 1 goes to and fro across its target and does not settle; take a controller that "
        "lands (method landing), or widen the tolerance."
    ),
    Ending.STUCK: (
        "Mass 1 rests outside the tolerance, and the controller does not free it; take a "
        "controller that moves it by pulses (method landing), or widen the tolerance."
    ),
}
"""Of a flexible arm, where it is another sentence."""


@dataclass(frozen=True, kw_only=True)
class PositioningMove(Record):
    """One move of a run, from where the axis was to a target.

    Attributes
    ----------
    number
        Place in its run, from 1.
    start_time, end_time
        Within its run [s].
    start, target
        Where the axis truly was, and where it should go [m or rad].
    ending
        How it ended.
    reason
        Why the controller stopped short, if it says so.
    final_error
        Target less true position at the end [m or rad]; of a flexible arm, here and in what
        follows, of the mass that is farther from it.
    late_errors
        Smallest and largest target less true position in the last half of the move [m or rad].
    settling_time
        From the start of the move until the true error is within the tolerance for good [s]; None
        if it never is.
    peak_effort
        Largest magnitude of the effort [N or N m].
    pulses
        Those begun in this move whose outcome is known; empty for a controller without pulses.
    swing
        Amplitude with which the second mass of a flexible arm swings at the end [m or rad]; None of
        a rigid axis.
    """

    json_form = (
        "number start_time end_time start target ending",
        "ending_text=ending.text reason final_error late_errors settling_time",
        "peak_effort swing pulses",
    )

    number: int
    start_time: float = quantity_field("time")
    end_time: float = quantity_field("time")
    start: float = quantity_field("position")
    target: float = quantity_field("position")
    ending: Ending
    reason: str | None
    final_error: float = quantity_field("position")
    late_errors: tuple[float, float] = quantity_field("position")
    settling_time: float | None = quantity_field("time")
    peak_effort: float = quantity_field("effort")
    pulses: tuple[PulseRecord, ...]
    swing: float | None = quantity_field("position", default=None)


@dataclass(frozen=True, kw_only=True)
class PositioningRun(Record):
    """One run of the task: its moves one after the other, from the start position at rest.

    Attributes
    ----------
    number
        From 1.
    time
        Sample instants [s], shape (n+1,).
    error, measured_error
        Target of the move that is on less the true and the measured position [m or rad], shape
        (n+1,); of a flexible arm, of the mass that is farther from it.
    effort
        Held from each sample to the next [N or N m], shape (n,).
    estimate_time, estimates
        What the controller believed, by name: at the start and after each pulse whose outcome is
        known [s, SI], shape (k,); of a landing, and of a flexible arm, now and then.
    moves
        In their order.
    arm
        Both masses and the series of a flexible arm; None of a rigid axis.
    phases
        Of a controller that lands, in their order; empty for another.
    deviations
        Standard deviations of estimates, by name, at their times [SI], shape (k,); empty for a
        controller without them.
    """

    json_form = (
        "number moves estimate_time estimates deviations phases",
        "time error measured_error effort arm",
    )

    number: int
    time: Float[np.ndarray, " samples"] = quantity_field("time")
    error: Float[np.ndarray, " samples"] = quantity_field("position")
    measured_error: Float[np.ndarray, " samples"] = quantity_field("position")
    effort: Float[np.ndarray, " efforts"] = quantity_field("effort")
    estimate_time: Float[np.ndarray, " k"] = quantity_field("time")
    estimates: Mapping[str, Float[np.ndarray, " k"]]
    moves: tuple[PositioningMove, ...]
    arm: ArmRun | None = None
    phases: tuple[LandingPhase, ...] = ()
    deviations: Mapping[str, Float[np.ndarray, " k"]] = field(default_factory=dict)

    @property
    def pulses(self) -> tuple[PulseRecord, ...]:
        """Every pulse of the run whose outcome is known."""
        return tuple(pulse for move in self.moves for pulse in move.pulses)


@dataclass(frozen=True, kw_only=True)
class Positioning(Record):
    """A positioning task and what came of it.

    Attributes
    ----------
    name
        Of the scenario.
    kind
        ``"linear"`` or ``"rotary"``; decides the units.
    method, controller
        The controller's name in a scenario, and in words.
    tolerance
        [m or rad].
    scenario
        What the scenario says, by table and key, with units.
    truth
        Of the simulated axis, by the names of the controller's estimates [SI].
    believed
        Where each first guess came from, by name: the scenario, an estimate, an earlier run.
    runs
        At least one, each with at least one move.
    limits
        Of estimates that are beliefs within limits, by name: the limits that pulses have shown
        [SI], None where none has.
    learned
        What the controller knows after the last run; None if it does not learn.
    notes
        Anything else a user should know, one sentence each.
    file, sha256, stickslip_version
        The scenario file, its hash, and the version of this package that ran it.
    """

    schema, legend = _SCHEMA, _LEGEND
    json_form = (
        "schema name kind method ending ending_text tolerance units",
        "legend scenario truth believed limits learned notes",
        {"provenance": ("stickslip_version", "file", "input_sha256=sha256")},
        "runs",
    )

    name: str
    kind: AxisKind
    method: str
    controller: str
    tolerance: float = quantity_field("position")
    scenario: ScenarioTables
    truth: Mapping[str, float]
    believed: Mapping[str, str]
    runs: tuple[PositioningRun, ...]
    limits: Mapping[str, tuple[float | None, float | None]]
    learned: LearnedPulses | None
    notes: tuple[str, ...] = ()
    file: str
    sha256: str
    stickslip_version: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "scenario", valued_tables(self.scenario))
        super().__post_init__()

    @property
    def last(self) -> PositioningMove:
        """The last move of the last run, by which the task is judged first."""
        return self.runs[-1].moves[-1]

    @property
    def counts_offset(self) -> bool:
        """Whether there is an offset, and estimates of friction by direction have it in them."""
        return bool(self.scenario.get("axis", {}).get("offset", (0.0, ""))[0]) and any(
            name.endswith("_positive") for name in self.runs[0].estimates
        )

    @property
    def ending(self) -> Ending:
        """Ending of the last run, that of the first of its moves that did not reach its target."""
        moves = self.runs[-1].moves
        return next((each.ending for each in moves if not each.ending.reached), Ending.REACHED)

    @property
    def ending_text(self) -> str:
        """One sentence on the ending, with the controller's own reason and the remedy."""
        text = self.ending.text
        if self.runs[-1].arm is not None:
            text = _ARM_ENDINGS.get(self.ending, text)
        if self.ending is Ending.HUNTING and self.method == "exact":
            return f"{text.partition('; ')[0]}; give better first guesses, or a longest_width."
        reasons = [move.reason for move in self.runs[-1].moves if move.reason]
        if self.ending is not Ending.STOPPED or not reasons:
            return text
        return f"The controller stopped, as {reasons[0]}; {text.partition('; ')[2]}"

    @property
    def units(self) -> dict[str, str]:
        """SI units of times, positions, efforts and estimates."""
        names = ("time", "position", "effort", *self.truth)
        return {name: unit_of(name, self.kind) for name in names}
