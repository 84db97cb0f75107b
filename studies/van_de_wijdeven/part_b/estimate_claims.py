"""What section 4 claims of the estimates of PAPWC, judged by ten runs of each case."""

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_b.cases import (
    BOUNDED,
    CALCULATED,
    KEYS,
    PAPWC,
    PWC,
    READINGS,
    SMALL,
    UNBOUNDED,
)
from studies.van_de_wijdeven.part_b.evidence import FINER, Evidence
from studies.van_de_wijdeven.part_b.judging import (
    BOUND_WORDS,
    Found,
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
    START_ERROR,
)
from studies.van_de_wijdeven.records import Claim

_FIRST, _LAST = 0, RUNS_IN_A_ROW - 1
_LARGE_PULSE = 0.2  # of the start error, from which a pulse counts as large
_HARDLY = 0.01  # change of an estimate that counts as almost none, of it
_FASTER = 2.0  # from which one adaptation counts as much faster than another
_READINGS = READINGS[PAPWC]


def estimate_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims on what PAPWC estimates, with their verdicts."""
    return (
        _same_first_estimate(evidence),
        _faster_adaptation(evidence),
        _gain_above_truth(evidence),
        _one_large_pulse(evidence),
        _small_errors_teach_little(evidence),
        _only_the_ratio(evidence),
        _finer_sampling(evidence),
        _opposite_changes(evidence),
        _begun_anew(evidence),
    )


def _gain(evidence: Evidence, series: Series, run: int) -> Float[np.ndarray, " k"]:
    return series.estimate(run, "pulse_gain") / evidence.gain


def _same_first_estimate(evidence: Evidence) -> Claim:
    gains = {
        controller: float(
            evidence.series[controller, reading, UNBOUNDED].estimate(_FIRST, "pulse_gain")[0]
        )
        / evidence.gain
        for controller, reading in ((PWC, CALCULATED), (PAPWC, SMALL))
    }
    return judged(
        place="4",
        statement="Both algorithms begin with the same b̂(0), 1.375 b, for f_c,est = 0.8 f_c.",
        criterion="they do, within rounding",
        found=(
            all(abs(gain - 1.375) < 1e-9 for gain in gains.values()),
            ", ".join(f"{name} {gain:.4f} b" for name, gain in gains.items()),
        ),
        why="Eqs. 4 and 16 with the same mass and friction.",
        numbers={f"{name.lower()}": gain for name, gain in gains.items()},
    )


def _step_taken(series: Series) -> float:
    """Return the share of a first prediction error that the first pulse's update takes away."""
    pulse = series.runs[_FIRST].pulses[0]
    before, after = series.estimate(_FIRST, "pulse_gain")[:2].tolist()
    fitted = before * pulse.achieved_displacement / pulse.predicted_displacement
    return (before - after) / (before - fitted)


def _faster_adaptation(evidence: Evidence) -> Claim:
    width = _step_taken(evidence.series[PWC, CALCULATED, BOUNDED])
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {"pwc": width}
    for reading in _READINGS:
        share = _step_taken(evidence.series[PAPWC, reading, BOUNDED])
        numbers[f"{KEYS[reading]}_papwc"] = share
        found[reading] = (
            share >= _FASTER * width,
            f"{percent(share)}, and {percent(width)} of PWC",
        )
    return by_reading(
        place="4, Figs. 7, 8",
        statement="PAPWC adapts much faster than PWC, although both begin with the same inverse "
        "covariance.",
        criterion="of the first error of prediction with the bound, the first pulse takes away at "
        f"least {_FASTER:g} times as much",
        found=found,
        why="PWC weighs its first pulse by F(0) t_p⁴, PAPWC by about P(0) f_p⁴ T_x⁴. With F(0) = "
        "1e5 and P(0) = 1e-5 I that is nearly the same by chance, as f_p⁴ = 0.81e10 N⁴. The "
        "sentence is true of P(0) = 1e5 I only, which speaks for that reading.",
        numbers=numbers,
    )


def _gain_above_truth(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        gain = float(_gain(evidence, free, _LAST)[0])
        return gain > 1.0, f"{ratios([gain])} b", {"gain": gain}

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    starts = np.arange(1e-4, START_ERROR + 1e-9, 1e-4)
    widest = np.ceil(np.sqrt(starts / evidence.gain) / SAMPLING_TIME) * SAMPLING_TIME
    farthest = evidence.law.displacement(PULSE_EFFORT, widest)
    possible = float(np.max(starts[farthest >= starts]))
    return by_reading(
        place="4, Fig. 8",
        statement="In run 10 without a bound, b̂ is larger than the theoretical b, and yet the "
        "first pulse nearly reaches the target.",
        criterion="b̂ at the start of run 10 is above b",
        found=found,
        why=f"It cannot be, from {1e3 * START_ERROR:g} mm, in any reading: a b̂ above b asks for at "
        f"most {widest[-1]:.2g} s, rounded up, and f_p moves the mass by {lengths(farthest[-1:])} "
        "in that time. The source calls it unexpected and does not print its start; from up to "
        f"{lengths([possible])} it is possible.",
        numbers={
            **numbers,
            "widest_s": float(widest[-1]),
            "farthest_m": float(farthest[-1]),
            "possible_m": possible,
        },
    )


def _one_large_pulse(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        moved = [abs(p.achieved_displacement) for p in free.runs[_LAST].pulses]
        large = sum(each >= _LARGE_PULSE * START_ERROR for each in moved)
        return (
            large == 1,
            f"{large}, then at most {lengths([max(moved[1:], default=0.0)])}",
            {"large": large},
        )

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 8",
        statement="In run 10 without a bound, only one large pulse is driving the system.",
        criterion=f"one pulse moves it by more than {100 * _LARGE_PULSE:g} % of the start error",
        found=found,
        why="By then b̂ has become what a pulse of 10 mm needs.",
        numbers=numbers,
    )


def _small_errors_teach_little(evidence: Evidence) -> Claim:
    def judge(free: Series, _: Series) -> tuple[bool, str, Numbers]:
        gains = _gain(evidence, free, _LAST)
        change = float(np.max(np.abs(gains[2:] / gains[1] - 1.0)))
        return change <= _HARDLY, f"by at most {percent(change)}", {"change": change}

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 8",
        statement="Small errors of position result in a small ξ and almost no update.",
        criterion="the pulses after the first of run 10 without a bound change b̂ by at most "
        f"{100 * _HARDLY:g} %",
        found=found,
        why="ξ is small with the displacement, and the regressor with it.",
        numbers=numbers,
    )


def _only_the_ratio(evidence: Evidence) -> Claim:
    series = evidence.series[PAPWC, READINGS[PAPWC][1], BOUNDED]
    f_p = PULSE_EFFORT
    gain = series.estimate(_FIRST, "pulse_gain")[1:7] / evidence.gain
    friction = series.estimate(_FIRST, "coulomb_friction")[[1, -1]]
    fitted = series.runs[_FIRST].pulses[0]
    truth = fitted.achieved_displacement / (fitted.duration**2 * evidence.gain)
    known = bool(np.max(np.abs(gain / truth - 1.0)) <= _HARDLY)
    same = bool(abs(friction[1] / friction[0] - 1.0) <= _HARDLY)
    return judged(
        place="4, Fig. 8",
        statement="Two parameters are estimated from one equation, so only their ratio can be "
        "derived.",
        criterion="from pulses of one shape the ratio Â_2/Â_1 = f̂_c is found, that is, a pulse of "
        f"another shape changes it by at most {100 * _HARDLY:g} %",
        found=(
            same,
            f"six equal pulses give {ratios([float(gain[-1])])} b, "
            f"{'as' if known else 'and not as'} they went, with f̂_c = {friction[0]:.0f} N; after "
            f"two others f̂_c = {friction[1]:.0f} N",
        ),
        why=f"What equal pulses tell is the combination A_1 f² − A_2 f at their own effort, here b "
        f"at {f_p:g} N. The ratio is just what they leave open; it stays where the first guess and "
        "P(0) put it.",
        numbers={
            "gain": float(gain[-1]),
            "friction_one_shape_N": float(friction[0]),
            "friction_more_shapes_N": float(friction[1]),
        },
    )


def _finer_sampling(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in _READINGS:
        gains = [float(_gain(evidence, evidence.finer[reading, T], _LAST)[-1]) for T in FINER]
        numbers |= {
            f"{KEYS[reading]}_gain_at_{T * 1e3:g}ms": gain
            for T, gain in zip(FINER, gains, strict=True)
        }
        found[reading] = (
            max(gains) < 1.0,
            ", ".join(
                f"{gain:.3f} b at {1e3 * T:g} ms" for T, gain in zip(FINER, gains, strict=True)
            ),
        )
    return by_reading(
        place="4, Fig. 8",
        statement="If the sampling time is decreased, b̂ is smaller than the theoretical b again.",
        criterion=f"at the end of run {RUNS_IN_A_ROW} without a bound it is, at "
        f"{' and '.join(f'{1e3 * T:g} ms' for T in FINER)}",
        found=found,
        why="Viscous friction lowers what a wide pulse teaches, at any sampling time.",
        numbers=numbers,
    )


def _opposite_changes(evidence: Evidence) -> Claim:
    def judge(free: Series, bound: Series) -> tuple[bool, str, Numbers]:
        opposite, changes = 0, 0
        for series in (free, bound):
            for run in range(RUNS_IN_A_ROW):
                gain = np.diff(series.estimate(run, "pulse_gain"))
                friction = np.diff(series.estimate(run, "coulomb_friction"))
                opposite += int(np.sum(gain * friction < 0.0))
                changes += int(np.sum(gain * friction != 0.0))
        share = opposite / changes
        return share == 1.0, f"{percent(share)} of {changes} updates", {"share": share}

    found, numbers = in_both_readings(evidence, PAPWC, judge)
    return by_reading(
        place="4, Fig. 9",
        statement="b̂ increases when f̂_c decreases and vice versa.",
        criterion="they do, in every update of all runs",
        found=found,
        why="True if A_2 stays as it is, which P(0) = 1e-5 I sees to: A_1 changes f_p² times as "
        "much. With 1e5 I both are learned, and b̂ can rise with f̂_c.",
        numbers=numbers,
    )


def _begun_anew(evidence: Evidence) -> Claim:
    found: dict[str, Found] = {}
    numbers: dict[str, float | int] = {}
    for reading in _READINGS:
        for bound, longest in (("unbounded", UNBOUNDED), ("bounded", BOUNDED)):
            spread = [
                float(np.ptp(_gain(evidence, every[PAPWC, reading, longest], _LAST)))
                for every in (evidence.series, evidence.anew)
            ]
            numbers |= {
                f"{KEYS[reading]}_{bound}_carried": spread[0],
                f"{KEYS[reading]}_{bound}_anew": spread[1],
            }
            found[f"{reading}, {BOUND_WORDS[bound]}"] = (
                spread[1] > spread[0],
                f"{spread[1]:.2g} b, and {spread[0]:.2g} b with P carried",
            )
    return by_reading(
        place="4",
        statement="Without carrying P from run to run, b̂ and f̂_c fluctuate more in run 10, with "
        "more overshoot.",
        criterion="the range of b̂ over run 10 is larger than with P carried",
        found=found,
        why="There is no noise to fluctuate with. Without a bound, adapting anew leads to the b̂ "
        "that hits at once, and then nothing is left to adapt; with the bound it is still on its "
        "way.",
        numbers=numbers,
    )
