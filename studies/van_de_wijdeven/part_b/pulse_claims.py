"""Claims of section 4 on the pulses of amplitude and width control (PAPWC)."""

import numpy as np

from studies.van_de_wijdeven.part_b.cases import PAPWC, READINGS, UNBOUNDED
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import FIRST, LAST, Quantity, Row, by_bound, by_reading
from studies.van_de_wijdeven.part_b.runs import Series


def _count(series: Series, run: int) -> int:
    return len(series.runs[run].pulses)


def _last_counts(evidence: Evidence) -> dict[str, float]:
    return {
        f"{reading}, {carried}": float(_count(every[PAPWC, reading, UNBOUNDED], LAST))
        for carried, every in (("P carried", evidence.series), ("P laid anew", evidence.anew))
        for reading in READINGS[PAPWC]
    }


def _settling(_: Evidence, series: Series, __: Series) -> float:
    """Return the longer settling time of runs 1 and 10 [s]; NaN if either does not settle."""
    return float(np.max([series.settling_time(run) for run in (FIRST, LAST)]))


def _nearer_runs(evidence: Evidence) -> int:
    """Return the runs from half the distance that two pulses bring to the reference."""
    nearer = evidence.nearer
    return sum(nearer.reached(run) and _count(nearer, run) == 2 for run in range(len(nearer.runs)))


PULSE_CLAIMS = (
    Row(
        "one pulse in the end",
        "3.1; 4, Fig. 4",
        "If the error is the same every time, no t_p,max is needed: b̂ will not converge to b, but "
        "such that one pulse does it.",
        "With P carried from run to run, as section 4 has it, adaptation slows down before the "
        "first pulse hits. With P laid anew before each run it goes on, and from then on one pulse "
        "is enough.",
        Quantity("pulses of run 10 without a bound", "pulses", _last_counts, 1.0, 1.0),
    ),
    Row(
        "pulses die out",
        "4, Fig. 6",
        "The pulses of PAPWC die out after a short period.",
        "As for the final error: without a bound, f̂_c becomes so large that the last pulses cycle.",
        Quantity("longer settling time of runs 1 and 10", "s", by_bound(_settling)),
        Quantity(
            "runs of 1 and 10 that end at rest within the tolerance",
            "runs",
            by_bound(lambda _, series, __: sum(map(series.reached, (FIRST, LAST)))),
            low=2.0,
        ),
    ),
    Row(
        "positive pulses only",
        "4, Fig. 6",
        "With t_p,max, only positive pulses drive the system.",
        "With P(0) = 1e-5 I, b̂ falls slowly from above, so that pulses are too short and the "
        "target is approached from one side. With 1e5 I it is hit at once, and overshot once.",
        Quantity(
            "pulses of runs 1 and 10 that push back",
            "pulses",
            by_reading(PAPWC, lambda _, __, bound: sum(map(bound.reversed_pulses, (FIRST, LAST)))),
            high=0.0,
        ),
    ),
    Row(
        "negative pulses without a bound",
        "4, Fig. 6",
        "Without a bound overshoot occurs, which results in negative pulses.",
        "With P(0) = 1e-5 I, b̂ is above what short pulses need in run 1 and below it later.",
        Quantity(
            "fewer pulses that push back, of runs 1 and 10",
            "pulses",
            by_reading(PAPWC, lambda _, free, __: min(map(free.reversed_pulses, (FIRST, LAST)))),
            low=1.0,
        ),
    ),
    Row(
        "two pulses after ten iterations",
        "4, Fig. 6",
        "After ten iterations two pulses take it to the reference, without a bound.",
        "The distance from which the source starts is not printed; two pulses are enough from half "
        "of the distance taken here.",
        Quantity(
            "pulses of run 10",
            "pulses",
            by_reading(PAPWC, lambda _, free, __: _count(free, LAST)),
            2.0,
            2.0,
        ),
        Quantity(
            "runs 10 that end within the tolerance",
            "runs",
            by_reading(PAPWC, lambda _, free, __: free.reached(LAST)),
            low=1.0,
        ),
        Quantity(
            f"runs of ten from half the distance with two pulses, {READINGS[PAPWC][0]}",
            "runs",
            _nearer_runs,
        ),
    ),
    Row(
        "input with the bound unchanged",
        "4, Fig. 6",
        "The input with the bound has not changed much after ten iterations.",
        "The first six pulses are at the bound whatever b̂ is.",
        Quantity(
            "change of the number of pulses from run 1 to run 10",
            "pulses",
            by_reading(PAPWC, lambda _, __, bound: abs(_count(bound, LAST) - _count(bound, FIRST))),
            high=2.0,
        ),
    ),
)
