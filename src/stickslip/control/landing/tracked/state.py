"""State of a landing by tracked series, and what a plan answers."""

from dataclasses import dataclass
from itertools import pairwise
from math import inf

from stickslip.control.landing.arm_plan import LandingState, PlanAnswer
from stickslip.control.landing.tracked.correction import NONE, Deviation, Goal
from stickslip.control.landing.tracked.drive_fit import DriveFit
from stickslip.control.landing.tracked.load_fit import LoadFit
from stickslip.control.landing.tracked.sensing import VelocityLag
from stickslip.numerics.growing import Growing
from stickslip.records import SensorSample, quantity_field


@dataclass(frozen=True, kw_only=True)
class Lesson:
    """Aim of the next correction from the same place, if it is planned with the same model.

    It is computed from the miss of the last one, which repeats where a model error is its cause.
    """

    place: float = quantity_field("position")  #: Where it began.
    aim: Goal  #: Final deviation to aim at.
    coulomb_friction: float = quantity_field("coulomb_friction")  #: With which it was planned.
    drive: DriveFit  #: With which it was planned.


@dataclass(frozen=True, kw_only=True)
class TrackedState(LandingState):
    """State of a landing by tracked series."""

    begun: int = 0  #: Phases before the present target.
    travel: float = quantity_field("position", default=0.0)  #: Length of the move.
    best: float = quantity_field("position", default=inf)  #: Smallest miss of the target so far.
    integral: float = quantity_field("effort", default=0.0)  #: Effort of the integral action.
    #: Planned velocity of mass 1 less the measured one, filtered.
    behind: float = quantity_field("velocity", default=0.0)
    efforts: Growing[float] = Growing()  #: Sent in the present series.
    #: The last sample with a position and a velocity of mass 1, its load as measured or, where it
    #: is not measured, as computed from the motion of mass 1; None before the first.
    last: SensorSample | None = None
    lag: VelocityLag = VelocityLag()  #: Of measured velocities.
    #: Friction, delay and gain of the drive by the series so far; None before the first.
    drive: DriveFit | None = None
    load: LoadFit = LoadFit()  #: Stiffness and losses of the load by the series so far.
    #: Of the corrected series from the plan, in the present sample and some before.
    deviations: tuple[Deviation, ...] = ()
    goal: Goal = NONE  #: Final deviation that the correction of the series aims at.
    computed: bool = False  #: Whether the load was computed in some sample of the last series.
    spent: str | None = None  #: Why no further series shall follow; None if one may.
    #: Whether series that correct lead farther, as shorter ones have not helped.
    farther: bool = False
    lesson: Lesson | None = None  #: Of the last correction; None without one.
    nudges: int = 0  #: Pulses on mass 1 alone since the last series.
    nudge: tuple[int, float] = (0, 0.0)  #: Samples and effort left of one.
    #: Where the last one began, and its planned way, both signed; None once it has been judged.
    nudged: tuple[float, float] | None = None
    nudge_scale: float = 1.0  #: Way of such pulses over that by their law [-].

    @property
    def series_since_target(self) -> int:
        """How many series have begun since the last target, parts planned anew not counted."""
        names = ["", *(phase.name for phase in self.phases[self.begun :])]
        return sum(now == "series" != before for before, now in pairwise(names))


@dataclass(frozen=True, kw_only=True)
class TrackedAnswer(PlanAnswer):
    """Answer to a request, with what was learned of drive and load."""

    drive: DriveFit | None  #: As of `TrackedState`.
    load: LoadFit  #: As of `TrackedState`.
