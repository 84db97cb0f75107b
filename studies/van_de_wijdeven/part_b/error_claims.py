"""Claims of sections 4 and 5 on the errors of amplitude and width control (PAPWC)."""

import numpy as np

from studies.van_de_wijdeven.part_b.cases import CALCULATED, PAPWC, PWC
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import (
    FIRST,
    LAST,
    RUNS,
    Quantity,
    Row,
    by_bound,
    by_reading,
    largest_final_error,
)
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import (
    PULSE_EFFORT,
    SAMPLING_TIME,
    START_ERROR,
    STATIC_FRICTION,
    TOLERANCE,
)

_LEAST = 1e-9  # a time, length or speed below every one here [SI]
_RESTING = 50  # samples at the end of a run


def _left(series: Series, run: int) -> float:
    """Return the distance that the first pulse of a run leaves [m]."""
    first = series.runs[run].pulses[0]
    return abs(first.error - first.achieved_displacement)


def _resting_speed(evidence: Evidence) -> float:
    """Return the largest speed after the last motion, with a tolerance of 1 nm [m/s]."""
    return max(
        float(np.max(np.abs(series.runs[0].run.motion.velocity[-_RESTING:])))
        for series in evidence.tight.values()
        if not series.runs[0].pulses[-1].moved
    )


def _smallest(evidence: Evidence) -> float:
    return float(evidence.law.smallest_displacement(SAMPLING_TIME))


def _least_motion(evidence: Evidence) -> float:
    """Return the least displacement of a pulse with a tolerance of 1 nm, over d_min."""
    pulses = [p for series in evidence.tight.values() for p in series.runs[0].pulses if p.moved]
    return min(abs(p.achieved_displacement) for p in pulses) / _smallest(evidence)


def _strongest_in_vain(evidence: Evidence) -> float:
    """Return the largest effort of a pulse that moves nothing, with a tolerance of 1 nm [N]."""
    every = [p for series in evidence.tight.values() for p in series.runs[0].pulses]
    return max((abs(p.levels[0][0]) for p in every if not p.moved), default=np.nan)


def _changes_outcome(_: Evidence, carried: Series, anew: Series) -> float:
    """Return whether only one of both ends run 10 within the tolerance."""
    ends = [abs(series.final_error(LAST)) <= TOLERANCE for series in (carried, anew)]
    return float(ends[0] != ends[1])


def _reduction(evidence: Evidence, *both: Series) -> float:
    """Return the worst final error of PWC over that of PAPWC."""
    return largest_final_error(*evidence.by_bound(PWC, CALCULATED)) / largest_final_error(*both)


ERROR_CLAIMS = (
    Row(
        "longer with the bound",
        "3.1",
        "A drawback of t_p,max is that the system takes longer to the final position.",
        "One wide pulse goes farther than several short ones in the same time.",
        Quantity(
            "time to within the tolerance in run 1, with the bound less without",
            "s",
            by_reading(
                PAPWC, lambda _, free, bound: bound.settling_time(FIRST) - free.settling_time(FIRST)
            ),
            low=_LEAST,
        ),
    ),
    Row(
        "error around zero",
        "4, Fig. 4",
        "The final error of PAPWC is around zero; it is at most 2e-5 m, where the input is set to "
        "zero.",
        "Without a bound, viscous friction is estimated as an f̂_c far above f_c. The closer f "
        "comes to f̂_c, the larger is the loop gain [f (f − f_c)/(2 m f_c)]/[A_1 f (f − f̂_c)], and "
        "PAPWC cycles just outside the tolerance.",
        Quantity(
            "runs of ten that end at rest within the tolerance",
            "runs",
            by_bound(lambda _, series, __: sum(map(series.reached, RUNS))),
            low=float(len(RUNS)),
        ),
        Quantity("largest final error", "m", by_bound(lambda _, own, __: largest_final_error(own))),
    ),
    Row(
        "velocity at rest",
        "4, Fig. 4",
        "Fluctuations with small velocities around zero make a tolerance necessary, as they are a "
        "numerical problem.",
        "It is a problem of integrating with steps. Propagated from event to event, the mass stops "
        "at the zero of its velocity and stays. Without a tolerance PAPWC fires on, in vain or "
        "around the target, within d_min.",
        Quantity(
            "largest speed after the last motion, with a tolerance of 1 nm",
            "m/s",
            _resting_speed,
            low=_LEAST,
        ),
    ),
    Row(
        "stiction bounds the error",
        "4, Eq. 24",
        "d_min of PAPWC is caused by stiction: when the calculated amplitude becomes smaller than "
        "it, the mass does not move.",
        "The effort must exceed f_s for a whole sample. The algorithm does not notice: having "
        "learned nothing, it fires the same pulse again.",
        Quantity(
            "least displacement with a tolerance of 1 nm, over d_min", "1", _least_motion, low=1.0
        ),
        Quantity(
            "largest effort of a pulse without motion",
            "N",
            _strongest_in_vain,
            high=STATIC_FRICTION,
        ),
    ),
    Row(
        "smallest displacements",
        "4, Eqs. 23, 24",
        "PWC has a d_min of 1.9e-4 m, PAPWC one of 1.3e-5 m.",
        f"Effort f_p = {PULSE_EFFORT:g} N and f_s = {STATIC_FRICTION:g} N for one sample.",
        Quantity(
            "d_min of PWC",
            "m",
            lambda e: float(e.law.displacement(PULSE_EFFORT, SAMPLING_TIME)),
            1.85e-4,
            1.95e-4,
        ),
        Quantity("d_min of PAPWC", "m", _smallest, 1.25e-5, 1.35e-5),
    ),
    Row(
        "one pulse very close",
        "4, Fig. 4",
        "In run 10 without a bound, one pulse gets the system very close to zero error.",
        "A larger P adapts to the first pulse at once; with P(0) = 1e-5 I, carried on, ten runs "
        "are not enough.",
        Quantity(
            "distance left by the first pulse, over that at the start",
            "1",
            by_reading(PAPWC, lambda _, free, __: _left(free, LAST) / START_ERROR),
            high=0.02,
        ),
    ),
    Row(
        "never zero after one pulse",
        "4, Fig. 4",
        "The error after the first pulse will practically never be zero, as the small pulses that "
        "follow modify b̂.",
        "With P carried. Laid anew before each run, it does hit: then no pulse follows, and b̂ is "
        "not modified any more.",
        Quantity(
            "least distance left by the first pulse of runs 2 to 10, over the tolerance",
            "1",
            by_reading(
                PAPWC, lambda _, free, __: min(_left(free, run) for run in RUNS[1:]) / TOLERANCE
            ),
            low=1.0 + _LEAST,
        ),
    ),
    Row(
        "final error with P laid anew",
        "4",
        "That does not influence the final error significantly.",
        "Where PAPWC cycles with P carried, laying it anew takes it out of the cycle.",
        Quantity(
            "runs 10 that end within the tolerance only with, or only without, P carried",
            "runs",
            by_bound(_changes_outcome),
            high=0.0,
        ),
    ),
    Row(
        "significant reduction",
        "Abstract; 5",
        "PAPWC reduces the final error of PWC significantly.",
        "Its least displacement is that of f_s, not of f_p.",
        Quantity(
            "worst final error of ten runs of PWC, over that of PAPWC",
            "1",
            by_reading(PAPWC, _reduction),
            low=10.0,
        ),
    ),
)
