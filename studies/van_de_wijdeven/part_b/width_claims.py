"""What the source claims of pulse width control (PWC), judged by ten runs of each case."""

import math

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_b.cases import (
    APPLIED,
    BOUNDED,
    CALCULATED,
    KEYS,
    PWC,
    READINGS,
    UNBOUNDED,
)
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import (
    Numbers,
    by_reading,
    in_both_readings,
    judged,
    lengths,
    percent,
    ratios,
)
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import (
    PULSE_EFFORT,
    RUNS_IN_A_ROW,
    SAMPLING_TIME,
    TOLERANCE,
)
from studies.van_de_wijdeven.records import Claim

__all__ = ["width_claims"]

FIRST, LAST = 0, RUNS_IN_A_ROW - 1
_STILL = 4  # last pulses of a run, over which a limit cycle goes to and fro
_MINIMAL = 0.05  # change of an estimate that counts as minimal, of the first change
_LOWEST, _HIGHEST = 0.805, 1.0  # b_hat/b, 81 % to its two digits


def width_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims on pulse width control, with their verdicts."""
    return (
        _limit_cycle(evidence),
        _rounded_up(evidence),
        _minimal_adaptation(evidence),
        _closer_estimate(evidence),
        _less_overshoot(evidence),
        _estimate_in_range(evidence),
        _overshoot_as_predicted(evidence),
        _overshoot_with_bound(evidence),
        _maximum_final_error(evidence),
        _two_samples(evidence),
        _poor_estimate(evidence),
        _full_effort(evidence),
    )


def _cycles(series: Series, run: int) -> bool:
    """Return whether the last pulses of a run go to and fro."""
    last = np.sign(series.efforts(run)[-_STILL:])
    return bool(last.size == _STILL and np.all(last[1:] == -last[:-1]))


def _samples(series: Series, run: int) -> int:
    """Return how many samples the last pulse of a run lasts."""
    return round(series.runs[run].pulses[-1].duration / SAMPLING_TIME)


def _rests(series: Series, run: int) -> tuple[float, float]:
    """Return the errors at rest before and after the last pulse of a run [m]."""
    last = series.runs[run].pulses[-1]
    return last.error, last.error - last.achieved_displacement


def _gains(evidence: Evidence, series: Series, run: int) -> Float[np.ndarray, " k"]:
    """Return b_hat/b at the start of a run and after each of its pulses."""
    return series.estimate(run, "pulse_gain") / evidence.gain


def _limit_cycle(evidence: Evidence) -> Claim:
    found = {
        reading: [
            all(_cycles(series, run) for run in range(RUNS_IN_A_ROW))
            for series in evidence.by_bound(PWC, reading)
        ]
        for reading in READINGS[PWC]
    }
    first = _rests(evidence.series[PWC, CALCULATED, UNBOUNDED], FIRST)
    last = _rests(evidence.series[PWC, CALCULATED, UNBOUNDED], LAST)
    return judged(
        place="1; 4, Fig. 3",
        statement="PWC in discrete time ends in a limit cycle around the reference, as the "
        "required width and the permitted one differ.",
        criterion="in all ten runs, with and without a bound, the last four pulses go to and fro",
        found=(
            all(all(each) for each in found.values()),
            f"without a bound, between {' and '.join(map(_signed, first))} at the end of run 1 "
            f"and {' and '.join(map(_signed, last))} at that of run {RUNS_IN_A_ROW}",
        ),
        why="One sample at full effort is the least that it can do, and that is far more than the "
        "tolerance. It never gives up.",
        numbers={
            "first_from_m": first[0],
            "first_to_m": first[1],
            "last_from_m": last[0],
            "last_to_m": last[1],
        },
    )


def _signed(error: float) -> str:
    text = lengths([error])
    return text if error < 0 else f"+{text}"


def _rounded_up(evidence: Evidence) -> Claim:
    series = evidence.series[PWC, CALCULATED, UNBOUNDED]
    pulses = series.runs[FIRST].pulses
    gains = series.estimate(FIRST, "pulse_gain")
    calculated = np.sqrt([abs(p.error) / b for p, b in zip(pulses, gains, strict=False)])
    applied = np.array([p.duration for p in pulses])
    surplus = applied**2 / calculated**2 - 1.0
    upwards = bool(np.all((applied >= calculated) & (applied - calculated < SAMPLING_TIME)))
    return judged(
        place="2.2",
        statement="The pulse width is rounded up to whole samples, so that the calculated pulse is "
        "not the real input.",
        criterion="every pulse of run 1 is longer than calculated, by less than a sample",
        found=(
            upwards and bool(np.all(surplus > 0.0)),
            f"the first is {percent(applied[0] / calculated[0] - 1.0)} longer, the last "
            f"{percent(applied[-1] / calculated[-1] - 1.0)}",
        ),
        why="Displacement goes with the square of the width: what is a small surplus for a wide "
        f"pulse is {percent(float(surplus[-1]))} for the last, which keeps the limit cycle up.",
        numbers={"first_surplus": float(surplus[0]), "last_surplus": float(surplus[-1])},
    )


def _minimal_adaptation(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        steps = np.abs(np.diff(_gains(evidence, free, FIRST)))
        share = float(steps[-1] / steps[0])
        return share <= _MINIMAL, f"{percent(share)} of the first pulse's", {"share": share}

    found, numbers = in_both_readings(evidence, PWC, judge)
    return by_reading(
        place="3.1",
        statement="As the residual error decreases with subsequent pulses, b̂ is hardly adapted any "
        "more.",
        criterion="the last pulse of run 1 without a bound changes b̂ by at most "
        f"{100 * _MINIMAL:g} % of what the first does",
        found=found,
        why="The correction goes with the square of the width squared, which has become small; not "
        "because b̂ predicts small displacements well.",
        numbers=numbers,
    )


def _closer_estimate(evidence: Evidence) -> Claim:
    def judge(free: Series, bound: Series) -> tuple[bool, str, Numbers]:
        without, with_it = (float(_gains(evidence, each, LAST)[-1]) for each in (free, bound))
        return (
            abs(with_it - 1.0) < abs(without - 1.0),
            f"{ratios([with_it])} b with the bound, {ratios([without])} b without",
            {"unbounded": without, "bounded": with_it},
        )

    found, numbers = in_both_readings(evidence, PWC, judge)
    return by_reading(
        place="3.1; 4, Fig. 7",
        statement="With a finite t_p,max, b̂ of PWC is closer to the theoretical b.",
        criterion=f"at the end of run {RUNS_IN_A_ROW} it is",
        found=found,
        why="Its pulses are shorter, and viscous friction takes less from them.",
        numbers=numbers,
    )


def _less_overshoot(evidence: Evidence) -> Claim:
    found: dict[str, tuple[bool, str]] = {}
    numbers: dict[str, float | int] = {}
    for controller, readings in READINGS.items():
        for reading in readings:
            free, bound = (
                sum(float(np.min(series.error(run))) < -TOLERANCE for run in range(RUNS_IN_A_ROW))
                for series in evidence.by_bound(controller, reading)
            )
            numbers |= {
                f"{KEYS[reading]}_{controller.lower()}_unbounded": free,
                f"{KEYS[reading]}_{controller.lower()}_bounded": bound,
            }
            found[f"{controller}, {reading}"] = (
                bound < free,
                f"{bound} runs with the bound, {free} without",
            )
    return by_reading(
        place="3.1",
        statement="With a finite t_p,max, overshoot is less likely.",
        criterion="fewer of ten runs overshoot by more than the tolerance",
        found=found,
        why="PAPWC with the bound comes from one side, in small steps. PWC overshoots with either, "
        "as its last pulses, of one or two samples, go too far whatever led to them.",
        numbers=numbers,
    )


def _estimate_in_range(evidence: Evidence) -> Claim:
    found: dict[str, tuple[bool, str]] = {}
    numbers: dict[str, float | int] = {}
    for controller, readings in READINGS.items():
        for reading in readings:
            series = evidence.series[controller, reading, BOUNDED]
            gain = float(_gains(evidence, series, LAST)[-1])
            numbers[f"{KEYS[reading]}_{controller.lower()}"] = gain
            found[f"{controller}, {reading}"] = (
                _LOWEST <= gain <= _HIGHEST,
                f"{percent(gain)}",
            )
    return by_reading(
        place="3.1; 4, Figs. 7, 8",
        statement="With t_p,max = 0.03 s the estimate b̂ of the controllers is between 81 % and "
        "100 % of b.",
        criterion=f"it is, at the end of run {RUNS_IN_A_ROW}",
        found=found,
        why="PWC that learns from the calculated width lays the surplus of the whole samples on b, "
        "so that its b̂ is too large for a width that is applied.",
        numbers=numbers,
    )


def _overshoot_as_predicted(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        worst = [float(-np.min(free.error(run))) for run in (FIRST, LAST)]
        return (
            min(worst) > 0.0,
            f"{lengths(worst[:1])} in run 1, {lengths(worst[1:])} in run {RUNS_IN_A_ROW}",
            {"first_m": worst[0], "last_m": worst[1]},
        )

    found, numbers = in_both_readings(evidence, PWC, judge)
    return by_reading(
        place="4, Fig. 3",
        statement="PWC overshoots when t_p,max is not bounded, as predicted.",
        criterion=f"the error changes its sign in runs 1 and {RUNS_IN_A_ROW}",
        found=found,
        why="In run 1 b̂ is still too large, so the pulses are too short and only the last ones, "
        "rounded up, go too far; later b̂ is too small for short pulses, as section 3.1 predicts.",
        numbers=numbers,
    )


def _overshoot_with_bound(evidence: Evidence) -> Claim:
    one, two = (float(evidence.law.displacement(PULSE_EFFORT, n * SAMPLING_TIME)) for n in (1, 2))

    def judge(_: Series, bound: Series) -> tuple[bool, str, Numbers]:
        worst, samples = float(-np.min(bound.error(LAST))), _samples(bound, LAST)
        return (
            worst > 0.0 and samples == 1,
            f"{lengths([worst])}, and the pulses that go to and fro last {samples} samples",
            {"overshoot_m": worst, "samples": samples},
        )

    found, numbers = in_both_readings(evidence, PWC, judge)
    return by_reading(
        place="4, Fig. 3",
        statement="It overshoots with the bound too, because of the least width of one sample.",
        criterion="the error changes its sign, and the pulses of the limit cycle last one sample",
        found=found,
        why=f"It overshoots, but not for the reason given: an error above b̂ T², about "
        f"{lengths([evidence.gain * SAMPLING_TIME**2])}, takes two samples, and these move the "
        f"mass by {lengths([two])}, not by {lengths([one])}.",
        numbers=numbers,
    )


def _maximum_final_error(evidence: Evidence) -> Claim:
    smallest = float(evidence.law.displacement(PULSE_EFFORT, SAMPLING_TIME))

    def judge(free: Series, bound: Series) -> tuple[bool, str, Numbers]:
        errors = [
            abs(series.final_error(run)) for series in (free, bound) for run in range(RUNS_IN_A_ROW)
        ]
        return (
            max(errors) <= smallest,
            f"final errors from {lengths([min(errors)])} to {lengths([max(errors)])}",
            {"least_m": min(errors), "largest_m": max(errors)},
        )

    found, numbers = in_both_readings(evidence, PWC, judge)
    return by_reading(
        place="4, Eq. 23",
        statement=f"d_min, {lengths([smallest])}, is the maximum final error.",
        criterion="no final error of any run exceeds it",
        found=found,
        why="It bounds a limit cycle of single samples only. Rounding up gives errors above b̂ T² "
        "two samples, and a cycle of two samples is stable as well.",
        numbers={"smallest_m": smallest, **numbers},
    )


def _two_samples(evidence: Evidence) -> Claim:
    smallest = float(evidence.law.displacement(PULSE_EFFORT, SAMPLING_TIME))

    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        worst, samples = max(map(abs, _rests(free, LAST))), _samples(free, LAST)
        return (
            worst > smallest and samples == 2,
            f"{lengths([worst])}, with pulses of {samples} samples",
            {"error_m": worst, "samples": samples},
        )

    found, numbers = in_both_readings(evidence, PWC, judge)
    return by_reading(
        place="4, Fig. 3",
        statement="In run 10 without a bound the overshoot exceeds d_min, as pulses last two "
        "samples now.",
        criterion="the error at rest exceeds d_min, and the last pulse lasts two samples",
        found=found,
        why="The first pulses leave it in the cycle of two samples, in which it remains.",
        numbers={"smallest_m": smallest, **numbers},
    )


def _poor_estimate(evidence: Evidence) -> Claim:
    series = evidence.series[PWC, APPLIED, UNBOUNDED]
    error = min(map(abs, _rests(series, LAST)))
    with_truth = math.sqrt(error / evidence.gain)
    exact = float(evidence.law.width_for(error, effort=PULSE_EFFORT))
    samples = [math.ceil(width / SAMPLING_TIME) for width in (with_truth, exact)]
    return judged(
        place="4, Fig. 3",
        statement="That the pulses last two samples is the result of the poor estimate b̂.",
        criterion="with the true b they would last one sample",
        found=(
            samples[0] == 1,
            f"for the smaller error of the cycle, {lengths([error])}, the true b asks for "
            f"{1e3 * with_truth:.1f} ms and Eq. 3 itself for {1e3 * exact:.1f} ms, both rounded up "
            f"to {samples[0]} samples",
        ),
        why="Rounding up is to blame: no estimate, however good, leads out of this cycle.",
        numbers={"error_m": error, "with_truth_s": with_truth, "exact_s": exact},
    )


def _full_effort(evidence: Evidence) -> Claim:
    efforts = {
        abs(float(effort))
        for (controller, _, _), series in evidence.series.items()
        if controller == PWC
        for run in range(RUNS_IN_A_ROW)
        for effort in series.efforts(run)
    }
    both = all(
        len(set(np.sign(evidence.series[PWC, CALCULATED, bound].efforts(run)).tolist())) == 2
        for bound in (UNBOUNDED, BOUNDED)
        for run in (FIRST, LAST)
    )
    return judged(
        place="4, Fig. 5",
        statement="The input of PWC contains only maximum positive and negative pulses, which the "
        "limit cycle switches between.",
        criterion="every pulse has the effort f_p, and both signs occur in every run drawn",
        found=(
            both and efforts == {PULSE_EFFORT},
            f"every pulse has {', '.join(f'{each:g}' for each in sorted(efforts))} N",
        ),
        why="The effort is not a variable of PWC.",
        numbers={"least_N": min(efforts), "largest_N": max(efforts)},
    )
