"""What section 4 claims of the pulses that amplitude and width control (PAPWC) fires."""

import numpy as np

from stickslip.records import count_of
from studies.van_de_wijdeven.part_b.cases import KEYS, PAPWC, READINGS, UNBOUNDED
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import (
    BOUND_WORDS,
    Found,
    Numbers,
    by_reading,
    in_both_readings,
)
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import RUNS_IN_A_ROW, START_ERROR
from studies.van_de_wijdeven.records import Claim

__all__ = ["pulse_claims"]

_FIRST, _LAST = 0, RUNS_IN_A_ROW - 1
_SAME_NUMBER = 2  # pulses by which two runs may differ and have "not changed much"
_READINGS = READINGS[PAPWC]


def pulse_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims on the pulses of PAPWC, with their verdicts."""
    return (
        _single_pulse_in_the_end(evidence),
        _pulses_die_out(evidence),
        _positive_only(evidence),
        _negative_without_bound(evidence),
        _two_pulses(evidence),
        _bounded_unchanged(evidence),
    )


def _counts(series: Series) -> list[int]:
    return [len(run.pulses) for run in series.runs]


def _first_and_last(first: int, last: int, what: str = "") -> str:
    """Return the numbers of pulses of the first and the last run in words."""
    return (
        f"{count_of(first, 'pulse')}{what} in run 1, {count_of(last, 'pulse')} in run "
        f"{RUNS_IN_A_ROW}"
    )


def _single_pulse_in_the_end(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for carried, every in (("P carried", evidence.series), ("P laid anew", evidence.anew)):
        for reading in _READINGS:
            counts = _counts(every[PAPWC, reading, UNBOUNDED])
            numbers[f"{KEYS[reading]}_{carried.lower().replace(' ', '_')}"] = counts[_LAST]
            found[f"{reading}, {carried}"] = (counts[_LAST] == 1, count_of(counts[_LAST], "pulse"))
    return by_reading(
        place="3.1; 4, Fig. 4",
        statement="If the error is the same every time, no t_p,max is needed: b̂ will not converge "
        "to b, but such that one pulse does it.",
        criterion=f"run {RUNS_IN_A_ROW} of PAPWC without a bound takes a single pulse",
        found=found,
        why="With P carried from run to run, as section 4 has it, adaptation slows down before "
        "the first pulse hits. With P laid anew before each run it goes on, and from then on one "
        "pulse does it indeed.",
        numbers=numbers,
    )


def _pulses_die_out(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in _READINGS:
        for bound, series in zip(
            ("unbounded", "bounded"), evidence.by_bound(PAPWC, reading), strict=True
        ):
            times = [series.settling_time(run) for run in (_FIRST, _LAST)]
            numbers |= {f"{KEYS[reading]}_{bound}_s": times[1]}
            found[f"{reading}, {BOUND_WORDS[bound]}"] = (
                bool(np.all(np.isfinite(times))),
                " and ".join("never" if np.isnan(t) else f"after {t:.2f} s" for t in times),
            )
    return by_reading(
        place="4, Fig. 6",
        statement="The pulses of PAPWC die out after a short period.",
        criterion=f"in runs 1 and {RUNS_IN_A_ROW} the mass comes to rest within the tolerance",
        found=found,
        why="As for the final error: without a bound, f̂_c becomes so large that the last pulses "
        "cycle.",
        numbers=numbers,
    )


def _positive_only(evidence: Evidence) -> Claim:
    def judge(_: Series, bound: Series) -> tuple[bool, str, Numbers]:
        negative = [bound.reversed_pulses(run) for run in (_FIRST, _LAST)]
        return (
            negative == [0, 0],
            _first_and_last(negative[0], negative[1], " back"),
            {"first": negative[0], "last": negative[1]},
        )

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 6",
        statement="With t_p,max, only positive pulses drive the system.",
        criterion=f"no pulse of runs 1 and {RUNS_IN_A_ROW} pushes back",
        found=found,
        why="With P(0) = 1e-5 I, b̂ falls slowly from above, so that pulses are too short and the "
        "target is approached from one side. With 1e5 I it is hit at once, and overshot once.",
        numbers=numbers,
    )


def _negative_without_bound(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        negative = [free.reversed_pulses(run) for run in (_FIRST, _LAST)]
        return (
            min(negative) > 0,
            _first_and_last(negative[0], negative[1], " back"),
            {"first": negative[0], "last": negative[1]},
        )

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 6",
        statement="Without a bound overshoot occurs, which results in negative pulses.",
        criterion=f"pulses of runs 1 and {RUNS_IN_A_ROW} push back",
        found=found,
        why="With P(0) = 1e-5 I, b̂ is above what short pulses need in run 1 and below it later.",
        numbers=numbers,
    )


def _two_pulses(evidence: Evidence) -> Claim:
    nearer = evidence.nearer
    counts = [len(run.pulses) if nearer.reached(k) else 0 for k, run in enumerate(nearer.runs)]

    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        count = _counts(free)[_LAST]
        words = count_of(count, "pulse") if free.reached(_LAST) else "it never reaches it"
        return count == 2 and free.reached(_LAST), words, {"pulses": count}

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 6",
        statement="After ten iterations two pulses take it to the reference, without a bound.",
        criterion="run 10 reaches the tolerance with two pulses",
        found=found,
        why=f"Not from {1e3 * START_ERROR:g} mm. From half of that, with P(0) = 1e-5 I, two pulses "
        f"do it in {counts.count(2)} of {RUNS_IN_A_ROW} runs; the source does not print its start.",
        numbers={**numbers, "nearer_runs_with_two": counts.count(2)},
    )


def _bounded_unchanged(evidence: Evidence) -> Claim:
    def judge(_: Series, bound: Series) -> tuple[bool, str, Numbers]:
        counts = _counts(bound)
        return (
            abs(counts[_FIRST] - counts[_LAST]) <= _SAME_NUMBER,
            _first_and_last(counts[_FIRST], counts[_LAST]),
            {"first": counts[_FIRST], "last": counts[_LAST]},
        )

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 6",
        statement="The input with the bound has not changed much after ten iterations.",
        criterion=f"the numbers of pulses differ by at most {_SAME_NUMBER}",
        found=found,
        why="The first six pulses are at the bound whatever b̂ is.",
        numbers=numbers,
    )
