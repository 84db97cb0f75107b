"""A landing whose plans are made in a thread, while the loop holds its sampling time."""

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field

from stickslip.control.landing.arm import LandingController
from stickslip.control.landing.arm_plan import LandingState, PlanAnswer, PlanRequest
from stickslip.control.landing.tracked.controller import TrackedLandingController
from stickslip.records import InputError, SensorSample


@dataclass(frozen=True, kw_only=True)
class PlannedBeside(LandingController):
    """A `LandingController` that plans in a thread beside the loop.

    The arm rests while a plan is made: the series begins ``planning_time`` after its request, from
    where mass 2 swings to until then. A plan that comes later is dropped, and another is asked for
    with twice the time that has passed. The plans depend on when the thread is done; otherwise
    a step is that of `LandingController`. One controller serves one loop.

    Attributes
    ----------
    planning_time
        Between request and series, above 0 [s]; 0.5 s is enough for most arms.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    plans_inside: bool = False
    _thread: ThreadPoolExecutor = field(
        default_factory=lambda: ThreadPoolExecutor(1, "stickslip-planner"),
        init=False,
        repr=False,
        compare=False,
    )
    _pending: dict[int, "Future[PlanAnswer]"] = field(
        default_factory=dict["int", "Future[PlanAnswer]"], init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.planning_time == 0.0 or self.plans_inside:
            raise InputError("no_planning_time", planning_time=self.planning_time)

    def step(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        """Take a sample; return the state after it and the effort until the next [N or N m]."""
        if state.request is not None:
            state = self._looked_after(state, state.request)
        return super().step(state, sample)

    def _looked_after(self, state: LandingState, request: PlanRequest) -> LandingState:
        """Return the state with the answer to its request, if it is there; else ask for it."""
        pending = self._pending.get(request.number)
        if pending is None:
            for old in self._pending.values():
                old.cancel()
            self._pending.clear()
            series = state.phase.name not in ("done", "stopped")
            self._pending[request.number] = self._thread.submit(self.plan, request, series=series)
            return state
        return self.answered(state, pending.result()) if pending.done() else state


@dataclass(frozen=True, kw_only=True)
class TrackedBeside(PlannedBeside, TrackedLandingController):
    """A `TrackedLandingController` that plans in a thread beside the loop, as `PlannedBeside`.

    What follows a rest on the way is planned anew only where the plan is there in time.
    """
