"""The comparison of all contenders on random axes."""

from collections.abc import Callable

import numpy as np

from studies.van_de_wijdeven.part_b.contenders import (
    CONTENDERS,
    LONG_WATCH,
    LONG_WATCHED,
    LONG_WATCHED_AXES,
)
from studies.van_de_wijdeven.part_b.random_axes import random_axes
from studies.van_de_wijdeven.part_b.trials import study, tasks
from studies.van_de_wijdeven.records import ControllerScore


def controller_scores(
    axes: int, seed: int, *, workers: int, advance: Callable[[], None]
) -> tuple[ControllerScore, ...]:
    """Try all contenders on the same random axes, ``workers`` runs at once.

    What is watched for long is tried on the first `LONG_WATCHED_AXES` of them; ``advance`` is
    called `pieces` times.
    """
    drawn = random_axes(np.random.default_rng(seed), axes)
    scores = study(drawn, CONTENDERS, workers=workers, advance=advance)
    few = drawn[:LONG_WATCHED_AXES]
    return scores + study(few, LONG_WATCHED, watch=LONG_WATCH, workers=workers, advance=advance)


def pieces(axes: int) -> int:
    """Return how often `controller_scores` calls ``advance``."""
    long_watched = len(LONG_WATCHED) * tasks(min(axes, LONG_WATCHED_AXES))
    return len(CONTENDERS) * tasks(axes) + long_watched
