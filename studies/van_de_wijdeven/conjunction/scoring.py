"""One controller on random arms: where both masses end, how soon, and what still swings."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.control import LandingController, PulseController
from stickslip.plants import FlexibleArm
from stickslip.records import LearnedPulses, PositioningOutcome, SensorSample, quantity_field
from stickslip.simulation import Controller, PlantStepper, simulate_closed_loop
from studies.van_de_wijdeven.conjunction.cases import Case
from studies.van_de_wijdeven.conjunction.random_arms import SAMPLING_TIME, RandomArm
from studies.van_de_wijdeven.records import LandingScore, Spread

ARRIVAL = 200.0
"""Time to arrive [s]: ten times what most moves take."""
WATCH = 20.0
"""Time thereafter in which both masses are watched [s]: longer than the slowest load swings."""
_SERIES = 4
"""Within so many series an arm is to land."""


@dataclass(frozen=True, kw_only=True)
class Leg:
    """A move that a rival is to make."""

    #: Of which arm, and under which conditions.
    arm: RandomArm
    case: Case
    #: From where, to where.
    start: float = quantity_field("position")
    target: float = quantity_field("position")
    #: In the moves before, by a controller of pulses; None in the first and by others.
    learned: LearnedPulses | None

    @property
    def way(self) -> float:
        """Its length [m]."""
        return abs(self.target - self.start)

    @property
    def guessed(self) -> FlexibleArm:
        """The arm as `Case.guessed` has it."""
        return self.case.guessed(self.arm)


Rival = Callable[[Leg], Controller[Any]]
"""Makes the controller of a move."""


@dataclass(frozen=True, kw_only=True)
class MoveOutcome:
    """How one move of one arm ended."""

    #: The farthest that either mass was from the target while watched, over the move [1].
    error_1: float
    error_2: float
    swing: float  #: Largest amplitude of mass 2 about mass 1 while watched, over the move [1].
    landed: bool  #: Whether both errors were within the bound.
    #: From which on they were [s]; None if they were not.
    time: float | None = quantity_field("time")
    series: int | None = None  #: That were fired; None for a controller without series.
    #: Whether the controller reports that it has landed; None if it reports nothing.
    reported: bool | None = None
    #: The farthest that either mass ever was from the way between start and target, over the move
    #: [1].
    farthest: float
    peak_effort: float  #: Over the limit [1].


class _Motion(NamedTuple):
    """The true motion of a move, ``(position, velocity, load_position, load_velocity)``."""

    states: Float[np.ndarray, "n 4"]
    effort: Float[np.ndarray, " n"]


def rival_moves(arm: RandomArm, case: Case, make: Rival) -> list[MoveOutcome]:
    """Run the controllers that are made for an arm's moves, one after the other."""
    generator = np.random.default_rng(arm.seed)
    state = (0.0, 0.0, 0.0, 0.0)
    start, learned, found = 0.0, None, list[MoveOutcome]()
    for target in arm.targets:
        controller = make(Leg(arm=arm, case=case, start=start, target=target, learned=learned))
        run = simulate_closed_loop(
            arm.arm,
            controller,
            sampling_time=SAMPLING_TIME,
            samples=round((ARRIVAL + WATCH) / SAMPLING_TIME),
            sensors=case.sensors(),
            generator=generator,
            initial_state=state,
        )
        if isinstance(controller, PulseController):
            learned = controller.learned(run.controller_state)
        truth = run.motion
        columns = (truth.position, truth.velocity, truth.load_position, truth.load_velocity)
        motion = _Motion(np.column_stack([each for each in columns if each is not None]),
                         truth.commanded_effort)  # fmt: skip
        found.append(_judged(arm, case, motion, start, target))
        state = tuple(motion.states[-1].tolist())
        start = target
    return found


def landed_moves(arm: RandomArm, case: Case, controller: LandingController) -> list[MoveOutcome]:
    """Run the landing controller on an arm, from target to target.

    It is watched, at work, from the instant on at which it says that it has ended.
    """
    generator = np.random.default_rng(arm.seed)
    stepper = PlantStepper(arm.arm, sampling_time=SAMPLING_TIME)
    state, plant = controller.init(), stepper.init()
    output: tuple[float, ...] = (0.0, 0.0, 0.0, 0.0)
    samples, watched = round(ARRIVAL / SAMPLING_TIME), round(WATCH / SAMPLING_TIME)
    start, begun, found = 0.0, 0, list[MoveOutcome]()
    for target in arm.targets:
        if begun:
            state = controller.retargeted(state, target)
        noise = np.column_stack(case.sensors().draw(samples + watched, generator))
        noise[:, 0::2] *= case.position_noise
        noise[:, 1::2] *= case.velocity_noise
        states, efforts = [output], list[float]()
        before, until = len(state.flights), samples + watched
        for k, row in enumerate(noise.tolist()):
            if k == until:
                break
            shown = [value + error for value, error in zip(output, row, strict=True)]
            state, effort = controller.step(
                state, SensorSample((begun + k) * SAMPLING_TIME, *shown)
            )
            if until == samples + watched and (
                controller.outcome(state) is not PositioningOutcome.MOVING
            ):
                until = min(k + watched, until)
            plant, output = stepper.step(plant, effort)
            states.append(output)
            efforts.append(effort)
        begun += len(efforts)
        motion = _Motion(np.array(states), np.array(efforts))
        reported = controller.outcome(state) is PositioningOutcome.REACHED
        fired = len(state.flights) - before
        found.append(_judged(arm, case, motion, start, target, series=fired, reported=reported))
        start = target
    return found


def _judged(
    arm: RandomArm,
    case: Case,
    motion: _Motion,
    start: float,
    target: float,
    *,
    series: int | None = None,
    reported: bool | None = None,
) -> MoveOutcome:
    way = abs(target - start)
    x1, _, x2, v2 = motion.states.T
    errors = np.abs(motion.states[:, 0::2] - target)
    watched = max(len(x1) - round(WATCH / SAMPLING_TIME), 0)
    outside = np.flatnonzero(errors.max(axis=1) > case.bound(way))
    arrived = int(outside[-1]) + 1 if outside.size else 0  # sample
    landed = arrived <= watched
    swing = np.hypot(x2 - x1, v2 * sqrt(arm.arm.mass_2 / arm.arm.stiffness))
    ends = min(start, target), max(start, target)
    beyond = np.maximum(ends[0] - motion.states[:, 0::2], motion.states[:, 0::2] - ends[1])
    return MoveOutcome(
        error_1=float(errors[watched:, 0].max()) / way,
        error_2=float(errors[watched:, 1].max()) / way,
        swing=float(swing[watched:].max()) / way,
        landed=landed,
        time=arrived * SAMPLING_TIME if landed else None,
        series=series,
        reported=reported,
        farthest=max(float(beyond.max()), 0.0) / way,
        peak_effort=float(np.abs(motion.effort).max()) / arm.effort_limit,
    )


def score(
    name: str,
    case: Case,
    outcomes: Sequence[Sequence[MoveOutcome]],
    shortest: Sequence[Sequence[float]],
) -> LandingScore:
    """Return the score of one controller over the moves of all arms.

    ``shortest`` is the shortest possible time of each move [s].
    """
    moves = [each for of_arm in outcomes for each in of_arm]
    least = [each for of_arm in shortest for each in of_arm]
    ratios = [
        each.time / fastest
        for each, fastest in zip(moves, least, strict=True)
        if each.time is not None
    ]
    series = [float(each.series) for each in moves if each.series is not None]
    judged = [(each.reported, each.landed) for each in moves if each.reported is not None]
    return LandingScore(
        controller=name,
        case=case.name,
        arms=len(outcomes),
        moves=len(moves),
        landed=float(np.mean([all(each.landed for each in of_arm) for of_arm in outcomes])),
        landed_in_four=float(
            np.mean(
                [
                    all(each.landed and (each.series or 0) <= _SERIES for each in of_arm)
                    for of_arm in outcomes
                ]
            )
        )
        if series
        else None,
        error_1=Spread.of([each.error_1 for each in moves]),
        error_2=Spread.of([each.error_2 for each in moves]),
        swing=Spread.of([each.swing for each in moves]),
        time_ratio=Spread.of(ratios) if ratios else None,
        series=Spread.of(series) if series else None,
        misjudged=sum(reported and not landed for reported, landed in judged) / len(judged)
        if judged
        else None,
        farthest=max(each.farthest for each in moves),
        peak_effort=max(each.peak_effort for each in moves),
    )
