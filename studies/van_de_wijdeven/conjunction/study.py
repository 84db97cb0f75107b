"""The landing controller and its rivals on random arms."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product

import numpy as np

from stickslip.planning import PulseSeriesPlanner
from stickslip.tasks.parallel import in_parallel
from studies.van_de_wijdeven.conjunction.cases import CASES, EXACT, NOISY, WRONG, Case
from studies.van_de_wijdeven.conjunction.contenders import LANDINGS, RIVALS, landing_controller
from studies.van_de_wijdeven.conjunction.random_arms import SAMPLING_TIME, RandomArm, random_arms
from studies.van_de_wijdeven.conjunction.scoring import (
    MoveOutcome,
    landed_moves,
    rival_moves,
    score,
)
from studies.van_de_wijdeven.records import LandingScore

_RIVAL_CASES = (EXACT, NOISY, WRONG)


@dataclass(frozen=True, kw_only=True)
class ArmOutcomes:
    """How all controllers have moved one arm."""

    #: The shortest time of each move, everything about the arm known [s].
    shortest: tuple[float, ...]
    #: Of each controller in each case, in the order of `trials`.
    moves: tuple[tuple[MoveOutcome, ...], ...]


def trials(cases: Sequence[Case]) -> list[tuple[str, Case]]:
    """Return which controllers are tried in which cases; the rivals in three of `CASES` at most."""
    rivals = [(name, case) for case in _RIVAL_CASES if case in cases for name in RIVALS]
    return [*product(LANDINGS, cases), *rivals]


def arm_outcomes(arm: RandomArm, cases: Sequence[Case]) -> ArmOutcomes:
    """Let every controller move an arm in every case."""
    return ArmOutcomes(
        shortest=shortest_times(arm),
        moves=tuple(
            tuple(
                landed_moves(arm, case, landing_controller(arm, case, name))
                if name in LANDINGS
                else rival_moves(arm, case, RIVALS[name])
            )
            for name, case in trials(cases)
        ),
    )


def scores_of(outcomes: Sequence[ArmOutcomes], cases: Sequence[Case]) -> tuple[LandingScore, ...]:
    """Return the score of each controller in each case, of the outcomes of every arm."""
    shortest = [each.shortest for each in outcomes]
    return tuple(
        score(name, case, [each.moves[k] for each in outcomes], shortest)
        for k, (name, case) in enumerate(trials(cases))
    )


def landing_scores(
    arms: int,
    seed: int,
    *,
    cases: Sequence[Case] = CASES,
    workers: int,
    advance: Callable[[], None],
) -> tuple[LandingScore, ...]:
    """Let the landing controller, in every case, and its rivals, in some, move random arms.

    ``workers`` arms are worked on at once, by threads, on which the result does not depend;
    ``advance`` is called after each arm.
    """
    drawn = random_arms(np.random.default_rng(seed), arms)
    found = in_parallel(
        [partial(arm_outcomes, arm, cases) for arm in drawn], workers=workers, advance=advance
    )
    return scores_of(found, cases)


def shortest_times(arm: RandomArm) -> tuple[float, ...]:
    """Return the shortest time of each move of an arm, everything about it known [s]."""
    planner = PulseSeriesPlanner(
        arm=arm.arm, sampling_time=SAMPLING_TIME, effort_limit=arm.effort_limit
    )
    starts = (0.0, *arm.targets[:-1])
    return tuple(
        planner.plan((start, 0.0, start, 0.0), target).duration
        for start, target in zip(starts, arm.targets, strict=True)
    )
