"""Controllers on the same random axes."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from stickslip.tasks.parallel import in_parallel
from studies.van_de_wijdeven.part_b.random_axes import RandomAxis
from studies.van_de_wijdeven.part_b.scoring import WATCH, AxisOutcome, Make, outcome_on, score
from studies.van_de_wijdeven.records import ControllerScore

_CHUNK = 25  # axes a task: so many that handing out tasks costs nothing


def study(
    axes: Sequence[RandomAxis],
    controllers: Mapping[str, Make],
    *,
    watch: float = WATCH,
    workers: int,
    advance: Callable[[], None],
) -> tuple[ControllerScore, ...]:
    """Try every controller on every axis; the result does not depend on the workers.

    ``controllers`` make that for an axis; ``advance`` is called after the runs of one of them on
    some of the axes.
    """
    chunks = [axes[k : k + _CHUNK] for k in range(0, len(axes), _CHUNK)]

    def run(make: Make, chunk: Sequence[RandomAxis]) -> list[AxisOutcome]:
        return [outcome_on(axis, make, watch=watch) for axis in chunk]

    found = in_parallel(
        [partial(run, make, chunk) for make in controllers.values() for chunk in chunks],
        workers=workers,
        advance=advance,
    )
    n = len(chunks)
    return tuple(
        score(name, [each for part in found[k * n : (k + 1) * n] for each in part])
        for k, name in enumerate(controllers)
    )


def tasks(axes: int) -> int:
    """Return how often `study` calls ``advance`` for each controller."""
    return -(-axes // _CHUNK)
