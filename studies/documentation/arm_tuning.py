"""Tune the rivals of the landing controller: ``python -m studies.documentation.arm_tuning``.

It takes some minutes and prints what it finds, the best first, for sensors without noise and with
it; the best of each is in `studies.van_de_wijdeven.conjunction.contenders`.
"""

from functools import partial
from itertools import product
from os import cpu_count

import numpy as np
from rich import print as say

from stickslip.tasks.parallel import in_parallel
from studies.documentation.style import no_arguments
from studies.van_de_wijdeven.conjunction.cases import EXACT, NOISY
from studies.van_de_wijdeven.conjunction.contenders import FASTEST, PIDTuning, ZeroVibrationTuning
from studies.van_de_wijdeven.conjunction.random_arms import random_arms
from studies.van_de_wijdeven.conjunction.scoring import rival_moves, score

SEED, ARMS = 99, 40
SHOWN = 4
FREQUENCIES = [w for w in (5.0, 7.0, 10.0, 14.0, 20.0, 28.0, 40.0) if w < FASTEST]  # rad/s
GRIDS = {
    "PID": [
        PIDTuning(frequency=frequency, integral=integral)
        for frequency, integral in product((0.3, 0.5, 0.7, 1.0, 1.4), (0.1, 0.2, 0.35, 0.5, 0.8))
    ],
    "zero vibration, friction as guessed": [
        ZeroVibrationTuning(friction="guessed", frequency=w) for w in FREQUENCIES
    ],
    "zero vibration, friction known": [
        ZeroVibrationTuning(friction="known", frequency=w) for w in FREQUENCIES
    ],
}


def main() -> None:
    """Try all, and say which landed most arms; of equals, which left the load nearer."""
    arms = random_arms(np.random.default_rng(SEED), ARMS)
    for case, (name, grid) in product((EXACT, NOISY), GRIDS.items()):
        found = []
        for tuning in grid:
            tasks = [partial(rival_moves, arm, case, tuning) for arm in arms]
            moves = in_parallel(tasks, workers=cpu_count() or 1, advance=lambda: None)
            of_it = score(name, case, moves, [[1.0] * len(each) for each in moves])
            found.append((-of_it.landed, of_it.error_2.median, tuning))
        say(f"{name}, {case.name}")
        for landed, error, tuning in sorted(found, key=lambda each: each[:2])[:SHOWN]:
            say(f"  {-100 * landed:.1f} % landed, median error of mass 2 {error:.1e}: {tuning}")


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
