"""Cases of part B: quantities by reading of a controller, and by bound of the width."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven import judging
from studies.van_de_wijdeven.part_b.cases import BOUNDED, PAPWC, PWC, READINGS, UNBOUNDED
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import RUNS_IN_A_ROW

FIRST, LAST = 0, RUNS_IN_A_ROW - 1
RUNS = range(RUNS_IN_A_ROW)
BOUNDS = ("no bound", "with the bound")
"""Cases of t_p,max, in the order of `Evidence.by_bound`."""

Quantity = judging.Quantity[Evidence]
Row = judging.Row[Evidence]

Of = Callable[[Evidence], dict[str, float]]


def largest_final_error(*every: Series) -> float:
    """Return the largest error at the end of all runs of some series [m]."""
    return max(abs(series.final_error(run)) for series in every for run in RUNS)


def relative_gains(evidence: Evidence, series: Series, run: int) -> Float[np.ndarray, " k"]:
    """Return b_hat/b at the start of a run and after each of its pulses."""
    return series.estimate(run, "pulse_gain") / evidence.gain


def by_reading(controller: str, measure: Callable[[Evidence, Series, Series], float]) -> Of:
    """Return a quantity of the runs without and with a bound, in each reading of a controller."""
    return lambda e: {
        reading: measure(e, *e.by_bound(controller, reading)) for reading in READINGS[controller]
    }


def by_controller(measure: Callable[[Evidence, Series, Series], float]) -> Of:
    """Return the same for both controllers."""
    return lambda e: {
        f"{controller}, {reading}": value
        for controller in (PWC, PAPWC)
        for reading, value in by_reading(controller, measure)(e).items()
    }


def by_bound(measure: Callable[[Evidence, Series, Series], float]) -> Of:
    """Return a quantity of the runs of PAPWC and of those that begin anew, by reading and bound."""
    bounds = dict(zip(BOUNDS, (UNBOUNDED, BOUNDED), strict=True))
    return lambda e: {
        f"{reading}, {words}": measure(
            e, e.series[PAPWC, reading, bound], e.anew[PAPWC, reading, bound]
        )
        for reading in READINGS[PAPWC]
        for words, bound in bounds.items()
    }
