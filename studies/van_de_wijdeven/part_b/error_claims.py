"""What sections 4 and 5 claim of the errors that amplitude and width control (PAPWC) leaves."""

import numpy as np

from studies.van_de_wijdeven.part_b.cases import (
    BOUNDED,
    CALCULATED,
    KEYS,
    PAPWC,
    PWC,
    READINGS,
    UNBOUNDED,
)
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import (
    BOUND_WORDS,
    Found,
    Numbers,
    by_reading,
    in_both_readings,
    judged,
    lengths,
)
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import (
    PULSE_EFFORT,
    RUNS_IN_A_ROW,
    SAMPLING_TIME,
    START_ERROR,
    STATIC_FRICTION,
    TOLERANCE,
)
from studies.van_de_wijdeven.records import Claim

__all__ = ["error_claims"]

_FIRST, _LAST = 0, RUNS_IN_A_ROW - 1
_VERY_CLOSE = 0.02  # of the start error: 0.2 mm, about the least displacement of PWC
_BETTER = 10.0  # by how many times an error must be smaller to be so significantly
_RESTING = 50  # samples at the end of a run
_READINGS = READINGS[PAPWC]


def error_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims on the errors of PAPWC, with their verdicts."""
    return (
        _takes_longer(evidence),
        _error_around_zero(evidence),
        _rests_exactly(evidence),
        _stiction_bounds(evidence),
        _smaller_than_pwc(evidence),
        _one_pulse_very_close(evidence),
        _never_zero(evidence),
        _final_error_begun_anew(evidence),
        _significant_reduction(evidence),
    )


def _left(series: Series, run: int) -> float:
    """Return the error that the first pulse of a run leaves [m]."""
    first = series.runs[run].pulses[0]
    return first.error - first.achieved_displacement


def _takes_longer(evidence: Evidence) -> Claim:
    def judge(free: Series, bound: Series) -> tuple[bool, str, Numbers]:
        times = free.settling_time(_FIRST), bound.settling_time(_FIRST)
        return (
            times[1] > times[0],
            f"{times[1]:.2f} s with the bound, {times[0]:.2f} s without",
            {"bounded_s": times[1], "unbounded_s": times[0]},
        )

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="3.1",
        statement="A drawback of t_p,max is that the system takes longer to the final position.",
        criterion="in run 1, PAPWC comes within the tolerance later with the bound",
        found=found,
        why="One wide pulse goes farther than several short ones in the same time.",
        numbers=numbers,
    )


def _error_around_zero(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in _READINGS:
        for bound, series in zip(
            ("unbounded", "bounded"), evidence.by_bound(PAPWC, reading), strict=True
        ):
            errors = [abs(series.final_error(run)) for run in range(RUNS_IN_A_ROW)]
            reached = sum(series.reached(run) for run in range(RUNS_IN_A_ROW))
            numbers |= {
                f"{KEYS[reading]}_{bound}_m": max(errors),
                f"{KEYS[reading]}_{bound}_reached": reached,
            }
            found[f"{reading}, {BOUND_WORDS[bound]}"] = (
                reached == RUNS_IN_A_ROW,
                f"{reached} of {RUNS_IN_A_ROW} runs, at most {lengths([max(errors)])}",
            )
    return by_reading(
        place="4, Fig. 4",
        statement="The final error of PAPWC is around zero; it is at most 2e-5 m, where the input "
        "is set to zero.",
        criterion=f"all ten runs end at rest within {1e6 * TOLERANCE:g} µm",
        found=found,
        why="Without a bound, viscous friction is taken up as an f̂_c far above f_c. The closer f "
        "comes to f̂_c, the larger is the loop gain [f (f − f_c)/(2 m f_c)]/[A_1 f (f − f̂_c)], "
        "and PAPWC cycles just outside the tolerance.",
        numbers=numbers,
    )


def _rests_exactly(evidence: Evidence) -> Claim:
    moving = [
        float(np.max(np.abs(series.runs[0].run.motion.velocity[-_RESTING:])))
        for series in evidence.tight.values()
        if not series.runs[0].pulses[-1].moved
    ]
    return judged(
        place="4, Fig. 4",
        statement="Fluctuations with small velocities around zero make a tolerance necessary, as "
        "they are a numerical problem.",
        criterion="with a tolerance of 1 nm the mass still has a velocity after its last motion",
        found=(
            max(moving) > 0.0,
            f"the largest velocity of the last {_RESTING} samples is {max(moving):g} m/s",
        ),
        why="It is a problem of integrating with steps. Propagated from event to event, the mass "
        "stops at the zero of its velocity and stays. Without a tolerance PAPWC fires on, in vain "
        "or around the target, within d_min.",
        numbers={"largest_m_per_s": max(moving)},
    )


def _stiction_bounds(evidence: Evidence) -> Claim:
    law = evidence.law
    smallest = float(law.smallest_displacement(SAMPLING_TIME))
    least = min(
        abs(pulse.achieved_displacement)
        for series in evidence.tight.values()
        for pulse in series.runs[0].pulses
        if pulse.moved
    )
    weak = [
        abs(pulse.levels[0][0])
        for series in evidence.tight.values()
        for pulse in series.runs[0].pulses
        if not pulse.moved
    ]
    return judged(
        place="4, Eq. 24",
        statement="d_min of PAPWC is caused by stiction: when the calculated amplitude becomes "
        "smaller than it, the mass does not move.",
        criterion="with a tolerance of 1 nm no pulse moves the mass by less than d_min, and every "
        "pulse that does not move it has at most f_s",
        found=(
            least >= smallest and bool(weak) and max(weak) <= STATIC_FRICTION,
            f"d_min is {lengths([smallest])}, the least motion {lengths([least])}; "
            f"{len(weak)} pulses did not move it, of at most {max(weak, default=0.0):.1f} N",
        ),
        why="The effort must exceed f_s for a whole sample. The algorithm does not notice: having "
        "learned nothing, it fires the same vain pulse again.",
        numbers={
            "smallest_m": smallest,
            "least_m": least,
            "strongest_in_vain_N": max(weak, default=0.0),
        },
    )


def _smaller_than_pwc(evidence: Evidence) -> Claim:
    law = evidence.law
    with_width = float(law.displacement(PULSE_EFFORT, SAMPLING_TIME))
    with_both = float(law.smallest_displacement(SAMPLING_TIME))
    return judged(
        place="4, Eqs. 23, 24",
        statement="PWC has a d_min of 1.9e-4 m, PAPWC one of 1.3e-5 m.",
        criterion="ours are the same to the digits printed",
        found=(
            f"{with_width:.1e} {with_both:.1e}" == "1.9e-04 1.3e-05",
            f"{with_width:.3e} m and {with_both:.3e} m".replace("e-", "e−"),
        ),
        why=f"Effort f_p = {PULSE_EFFORT:g} N and f_s = {STATIC_FRICTION:g} N for one sample.",
        numbers={"width_m": with_width, "both_m": with_both},
    )


def _one_pulse_very_close(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        left = _left(free, _LAST)
        return abs(left) <= _VERY_CLOSE * START_ERROR, lengths([left]) + " left", {"left_m": left}

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 4",
        statement="In run 10 without a bound, one pulse gets the system very close to zero error.",
        criterion=f"the first pulse leaves at most {100 * _VERY_CLOSE:g} % of the start error",
        found=found,
        why="A larger P adapts to the first pulse at once; with P(0) = 1e-5 I, carried on, ten "
        "runs are not enough.",
        numbers=numbers,
    )


def _never_zero(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        left = [abs(_left(free, run)) for run in range(1, RUNS_IN_A_ROW)]
        return (
            min(left) > TOLERANCE,
            f"at least {lengths([min(left)])} in runs 2 to {RUNS_IN_A_ROW}",
            {"least_m": min(left)},
        )

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 4",
        statement="The error after the first pulse will practically never be zero, as the small "
        "pulses that follow modify b̂.",
        criterion="from run 2 on, the first pulse without a bound never ends within the tolerance",
        found=found,
        why="With P carried. Laid anew before each run, it does hit: then no pulse follows, and "
        "nothing modifies b̂ any more.",
        numbers=numbers,
    )


def _final_error_begun_anew(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in _READINGS:
        for bound, longest in (("unbounded", UNBOUNDED), ("bounded", BOUNDED)):
            carried, anew = (
                abs(every[PAPWC, reading, longest].final_error(_LAST))
                for every in (evidence.series, evidence.anew)
            )
            numbers |= {
                f"{KEYS[reading]}_{bound}_carried_m": carried,
                f"{KEYS[reading]}_{bound}_anew_m": anew,
            }
            found[f"{reading}, {BOUND_WORDS[bound]}"] = (
                (carried <= TOLERANCE) == (anew <= TOLERANCE),
                f"{lengths([anew])}, and {lengths([carried])} with P carried",
            )
    return by_reading(
        place="4",
        statement="That does not influence the final error significantly.",
        criterion="run 10 ends within the tolerance with P laid anew just if it does with P "
        "carried",
        found=found,
        why="Where PAPWC cycles with P carried, laying it anew takes it out of the cycle.",
        numbers=numbers,
    )


def _significant_reduction(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in _READINGS:
        worst = {
            controller: max(
                abs(series.final_error(run))
                for series in evidence.by_bound(controller, own)
                for run in range(RUNS_IN_A_ROW)
            )
            for controller, own in ((PWC, CALCULATED), (PAPWC, reading))
        }
        numbers |= {
            f"{KEYS[reading]}_papwc_m": worst[PAPWC],
            f"{KEYS[reading]}_pwc_m": worst[PWC],
        }
        found[reading] = (
            worst[PWC] >= _BETTER * worst[PAPWC],
            f"{lengths([worst[PAPWC]])}, and {lengths([worst[PWC]])} of PWC",
        )
    return by_reading(
        place="Abstract; 5",
        statement="PAPWC reduces the final error of PWC significantly.",
        criterion=f"over ten runs, with and without a bound, its worst final error is at least "
        f"{_BETTER:g} times smaller",
        found=found,
        why="Its least displacement is that of f_s, not of f_p.",
        numbers=numbers,
    )
