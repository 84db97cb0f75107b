"""The landing controller and its rivals on random arms."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from stickslip.jobs.reproduce.conjunction.cases import CASES, EXACT, NOISY, WRONG, Case
from stickslip.jobs.reproduce.conjunction.contenders import LANDING, RIVALS, landing_controller
from stickslip.jobs.reproduce.conjunction.random_arms import (
    SAMPLING_TIME,
    RandomArm,
    random_arms,
)
from stickslip.jobs.reproduce.conjunction.scoring import (
    MoveOutcome,
    landed_moves,
    rival_moves,
    score,
)
from stickslip.jobs.reproduce.parallel import in_parallel
from stickslip.planning import PulseSeriesPlanner
from stickslip.records import LandingScore

__all__ = ["landing_pieces", "landing_scores", "shortest_times"]

_RIVAL_CASES = (EXACT, NOISY, WRONG)


def landing_scores(
    arms: int,
    seed: int,
    *,
    cases: Sequence[Case] = CASES,
    workers: int,
    advance: Callable[[], None],
) -> tuple[LandingScore, ...]:
    """Let the landing controller, in every case, and its rivals, in some, move random arms.

    The result does not depend on the workers.

    Parameters
    ----------
    arms
        How many, the same for each controller and case.
    seed
        Of the arms and their noise.
    cases
        In which they are tried; the rivals are tried in three of `CASES` at most.
    workers
        How many arms are worked on at once. Threads do: most of the time is spent in linear
        programmes and in compiled loops, which leave the interpreter's lock alone.
    advance
        Called `landing_pieces` times.
    """
    drawn = random_arms(np.random.default_rng(seed), arms)
    trials = [
        *((LANDING, case, _land) for case in cases),
        *(
            (name, case, partial(rival_moves, make=make))
            for case in _RIVAL_CASES
            if case in cases
            for name, make in RIVALS.items()
        ),
    ]
    shortest = in_parallel(
        [partial(shortest_times, arm) for arm in drawn], workers=workers, advance=advance
    )
    found = in_parallel(
        [partial(run, arm, case) for _, case, run in trials for arm in drawn],
        workers=workers,
        advance=advance,
    )
    return tuple(
        score(name, case, found[k * arms : (k + 1) * arms], shortest)
        for k, (name, case, _) in enumerate(trials)
    )


def landing_pieces(arms: int, cases: Sequence[Case] = CASES) -> int:
    """Return how often `landing_scores` calls ``advance``."""
    rivals = len(RIVALS) * sum(case in cases for case in _RIVAL_CASES)
    return arms * (1 + len(cases) + rivals)


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


def _land(arm: RandomArm, case: Case) -> list[MoveOutcome]:
    return landed_moves(arm, case, landing_controller(arm, case))
