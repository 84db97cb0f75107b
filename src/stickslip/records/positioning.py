"""A positioning task that was run on a simulated axis: all that its page draws."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from stickslip.records.pulses import LearnedPulses, PulseRecord
from stickslip.records.quantities import AxisKind, quantity_field, unit_of
from stickslip.records.record import Record, ScenarioTables, Worded, valued_tables

LandingPhaseName = Literal["feedback", "resting", "series", "pulses", "done", "stopped"]

_SCHEMA = 3  # version of the JSON form

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
"""Meaning of the keys of the JSON document, as far as their names do not say it."""

_PHASE_WORDS: dict[LandingPhaseName, str] = {
    "feedback": "Feedback",
    "resting": "Resting",
    "series": "Pulse series",
    "pulses": "Pulses",
    "done": "Done",
    "stopped": "Stopped",
}


@dataclass(frozen=True, kw_only=True)
class LandingPhase(Record):
    """A phase of a controller that lands, and why it began.

    ``"feedback"`` moves the axis near its target; ``"resting"`` gives no effort until mass 1 of an
    arm rests and the swing of mass 2 is known; ``"series"`` are pulses planned together,
    ``"pulses"`` of a rigid axis one after the other; then ``"done"`` or ``"stopped"``.
    """

    name: LandingPhaseName  #: One of these.
    start_time: float = quantity_field("time")  #: Within its run [s].
    end_time: float = quantity_field("time")  #: Within its run [s].
    reason: str  #: The condition under which it began.

    @property
    def word(self) -> str:
        """Its name in a word or two."""
        return _PHASE_WORDS[self.name]


@dataclass(frozen=True, kw_only=True)
class ArmSeries(Record):
    """A series of pulses: its plan for both masses, and the true outcome."""

    json_form = (
        "move start_time duration pulses samples=effort.size target",
        "coulomb_friction viscous_friction start_swing planned_error final_error",
        "final_load_error final_swing planned_effort=effort",
        "planned_position=position planned_load_position=load_position",
    )

    move: int  #: Number of the move that it belongs to.
    start_time: float = quantity_field("time")  #: Of its first pulse, within its run [s].
    sampling_time: float = quantity_field("sampling_time")  #: Between two planned states.
    pulses: int  #: Number of its pulses.
    #: Planned rest of both masses: the target of the move, or a place from where the next series
    #: takes them there.
    target: float = quantity_field("position")
    coulomb_friction: float = quantity_field("coulomb_friction")  #: With which it was planned.
    viscous_friction: float = quantity_field("viscous_friction")  #: With which it was planned.
    effort: Float[np.ndarray, " n"] = quantity_field("effort")  #: Held from sample to sample.
    position: Float[np.ndarray, " n+1"] = quantity_field("position")  #: Of mass 1, as planned.
    load_position: Float[np.ndarray, " n+1"] = quantity_field("position")  #: Of mass 2, as planned.
    start_swing: float = quantity_field("position")  #: True amplitude of mass 2 before it.
    #: True rest of mass 1 after it; None if it has not come to rest.
    final_position: float | None = quantity_field("position", default=None)
    #: True amplitude of mass 2 about that place; None as before.
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
        return max(
            self.target - float(self.position[-1]),
            self.target - float(self.load_position[-1]),
            key=abs,
        )

    @property
    def final_error(self) -> float | None:
        """Target of the series less where mass 1 truly came to rest [m or rad]."""
        return None if self.final_position is None else self.target - self.final_position

    @property
    def final_load_error(self) -> float | None:
        """Largest true distance of mass 2 from the series' target, in its swing [m or rad]."""
        if self.final_error is None or self.final_swing is None:
            return None
        return abs(self.final_error) + self.final_swing


@dataclass(frozen=True, kw_only=True)
class ArmRun(Record):
    """Both masses of a run at each sample, and its series of pulses."""

    json_form = (
        "series target position load_position",
        "measured_position measured_load_position",
    )

    target: Float[np.ndarray, " samples"] = quantity_field("position")  #: Target at each sample.
    position: Float[np.ndarray, " samples"] = quantity_field("position")  #: True, of mass 1.
    load_position: Float[np.ndarray, " samples"] = quantity_field("position")  #: True, of mass 2.
    measured_position: Float[np.ndarray, " samples"] = quantity_field("position")  #: Of mass 1.
    #: Of mass 2.
    measured_load_position: Float[np.ndarray, " samples"] = quantity_field("position")
    resting: Bool[np.ndarray, " samples"]  #: Whether mass 1 truly stuck.
    series: tuple[ArmSeries, ...]  #: In their order.

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

    Errors of a flexible arm are those of the mass that is farther from the target.
    """

    json_form = (
        "number start_time end_time start target ending",
        "ending_text=ending.text reason final_error late_errors settling_time",
        "peak_effort swing pulses",
    )

    number: int  #: Place in its run, from 1.
    start_time: float = quantity_field("time")  #: Within its run [s].
    end_time: float = quantity_field("time")  #: Within its run [s].
    start: float = quantity_field("position")  #: True position at its start.
    target: float = quantity_field("position")  #: Target position.
    ending: Ending  #: How it ended.
    reason: str | None  #: Why the controller stopped short, if it says so.
    final_error: float = quantity_field("position")  #: Target less true position at the end.
    #: Smallest and largest target less true position in the last half of the move.
    late_errors: tuple[float, float] = quantity_field("position")
    #: From the start of the move until the true error is within the tolerance for good; None if it
    #: never is.
    settling_time: float | None = quantity_field("time")
    peak_effort: float = quantity_field("effort")  #: Largest magnitude of the effort.
    #: Those begun in this move whose outcome is known; empty for a controller without pulses.
    pulses: tuple[PulseRecord, ...]
    #: Amplitude of the second mass of a flexible arm at the end; None of a rigid axis.
    swing: float | None = quantity_field("position", default=None)


@dataclass(frozen=True, kw_only=True)
class PositioningRun(Record):
    """One run of the task: its moves one after the other, from the start position at rest.

    Errors of a flexible arm are those of the mass that is farther from the target. The controller's
    estimates are those at the start and after each pulse whose outcome is known; of a landing, and
    of a flexible arm, now and then.
    """

    json_form = (
        "number moves estimate_time estimates deviations phases",
        "time error measured_error effort arm",
    )

    number: int  #: From 1.
    time: Float[np.ndarray, " samples"] = quantity_field("time")  #: Sample instants.
    error: Float[np.ndarray, " samples"] = quantity_field("position")  #: Target less true position.
    #: Target less measured position.
    measured_error: Float[np.ndarray, " samples"] = quantity_field("position")
    effort: Float[np.ndarray, " efforts"] = quantity_field("effort")  #: Held to the next sample.
    estimate_time: Float[np.ndarray, " k"] = quantity_field("time")  #: Times of the estimates.
    estimates: Mapping[str, Float[np.ndarray, " k"]]  #: By name [SI].
    moves: tuple[PositioningMove, ...]  #: In their order.
    arm: ArmRun | None = None  #: Both masses of a flexible arm; None of a rigid axis.
    phases: tuple[LandingPhase, ...] = ()  #: Of a controller that lands; empty for another.
    #: Standard deviations of the estimates, by name [SI]; empty for a controller without them.
    deviations: Mapping[str, Float[np.ndarray, " k"]] = field(default_factory=dict)

    @property
    def pulses(self) -> tuple[PulseRecord, ...]:
        """Every pulse of the run whose outcome is known."""
        return tuple(pulse for move in self.moves for pulse in move.pulses)


@dataclass(frozen=True, kw_only=True)
class Positioning(Record):
    """A positioning task and its outcome."""

    schema, legend = _SCHEMA, _LEGEND
    json_form = (
        "schema name kind method ending ending_text tolerance units",
        "legend scenario truth first_guess_sources limits learned notes",
        {"provenance": ("stickslip_version", "file", "input_sha256=sha256")},
        "runs",
    )

    name: str  #: Of the scenario.
    kind: AxisKind  #: Decides the units.
    method: str  #: The controller's name in a scenario.
    controller: str  #: The controller in words.
    tolerance: float = quantity_field("position")  #: Largest error of a target that is reached.
    scenario: ScenarioTables  #: Contents of the scenario, by table and key, with units.
    truth: Mapping[str, float]  #: Of the simulated axis, by the names of the estimates [SI].
    #: Source of each first guess, by name: the scenario, an estimate, an earlier run.
    first_guess_sources: Mapping[str, str]
    runs: tuple[PositioningRun, ...]  #: At least one, each with at least one move.
    #: Limits that pulses have shown, by name, of estimates that are known within limits only [SI];
    #: None where none has.
    limits: Mapping[str, tuple[float | None, float | None]]
    learned: LearnedPulses | None  #: After the last run; None of a controller that does not learn.
    notes: tuple[str, ...] = ()  #: Anything else a user should know, one sentence each.
    file: str  #: The scenario file.
    sha256: str  #: Its hash.
    stickslip_version: str  #: Version of this package that ran it.

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
