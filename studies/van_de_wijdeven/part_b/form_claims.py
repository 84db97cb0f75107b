"""What section 3.2 claims of its equations (PAPWC), judged by formulas and by single runs."""

import numpy as np

from studies.van_de_wijdeven.part_b.cases import (
    BOUNDED,
    COVARIANCE,
    KEYS,
    LARGE,
    PAPWC,
    READINGS,
    SMALL,
    UNBOUNDED,
)
from studies.van_de_wijdeven.part_b.evidence import GUESSES, Evidence
from studies.van_de_wijdeven.part_b.judging import (
    by_reading,
    judged,
    lengths,
    percent,
    ratios,
)
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import (
    COULOMB_FRICTION,
    LONGEST_PULSE,
    PULSE_EFFORT,
    RUNS_IN_A_ROW,
    SAMPLING_TIME,
    STATIC_FRICTION,
    TOLERANCE,
)
from studies.van_de_wijdeven.records import Claim

__all__ = ["form_claims"]

_SAME = 0.01  # of two displacements that count as the same
_EXACT = 1e-6  # relative; of two solutions of the same least squares, with P(0) up to 1e5
_ONE_SHAPE = 6  # pulses of run 1 with the bound before the error is below it: all alike
_RANK_ONE = 1e-9  # ratio of singular values below which a matrix has rank one
_NEAR = 0.05  # error of an estimate that counts as one of its true value, of it
_PAPWC_READINGS = READINGS[PAPWC]


def form_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims on the equations of PAPWC, with their verdicts."""
    return (
        _effort_below_limit(evidence),
        _same_displacement(evidence),
        _minus_root(evidence),
        _works_with_known_friction(evidence),
        _adaptation_is_needed(evidence),
        _estimates_friction(evidence),
        _no_inversion(evidence),
        _printed_regressor(evidence),
        _nominal_regressor(evidence),
        _choice_of_delta(evidence),
    )


def _trimmed(width: float, friction: float) -> tuple[float, float]:
    """Return the effort of Eq. 15 for a width at full effort, and the width of whole samples."""
    whole = np.ceil(width / SAMPLING_TIME - 1e-9) * SAMPLING_TIME
    f_p = PULSE_EFFORT
    root = np.sqrt(friction**2 + 4.0 * f_p * (f_p - friction) * (width / whole) ** 2)
    return float(0.5 * (friction + root)), float(whole)


def _all_runs(evidence: Evidence, reading: str) -> list[tuple[Series, int]]:
    return [
        (series, run)
        for series in evidence.by_bound(PAPWC, reading)
        for run in range(RUNS_IN_A_ROW)
    ]


def _effort_below_limit(evidence: Evidence) -> Claim:
    largest = max(
        float(np.max(np.abs(series.efforts(run))))
        for reading in _PAPWC_READINGS
        for series, run in _all_runs(evidence, reading)
    )
    return judged(
        place="3.2",
        statement="Rounding the width up makes the amplitude at most the maximum f_p.",
        criterion="no pulse of any run exceeds f_p",
        found=(largest <= PULSE_EFFORT, f"at most {largest:g} N"),
        why="Eq. 15 is f_p for t_p = T_x and falls with t_p, as long as 0 < f̂_c < f_p.",
        numbers={"largest_N": largest},
    )


def _same_displacement(evidence: Evidence) -> Claim:
    law = evidence.law
    widths = [
        width
        for width in np.arange(0.0005, 0.1, 0.0005).tolist()
        if _trimmed(width, law.coulomb_friction)[0] > STATIC_FRICTION
    ]
    worst = max(
        abs(
            float(law.displacement(*_trimmed(width, law.coulomb_friction)))
            / float(law.displacement(PULSE_EFFORT, width))
            - 1.0
        )
        for width in widths
    )
    return judged(
        place="3.2, Eq. 14",
        statement="The trimmed pulse causes the same displacement as the one before rounding.",
        criterion=f"with the true f_c, and by Eq. 3, the two differ by at most {100 * _SAME:g} % "
        "for all widths up to 0.1 s whose trimmed pulse moves the mass",
        found=(
            worst <= _SAME,
            f"by at most {percent(worst)}; below {1e3 * widths[0]:.1f} ms the trimmed effort does "
            "not exceed f_s",
        ),
        why="Eq. 14 holds without viscous friction, which takes nearly the same from both. Static "
        "friction is in no equation of section 3.2.",
        numbers={"difference": worst, "shortest_s": widths[0]},
    )


def _minus_root(evidence: Evidence) -> Claim:
    law, width = evidence.law, LONGEST_PULSE
    f_c, f_p = law.coulomb_friction, PULSE_EFFORT
    effort, whole = _trimmed(width, f_c)
    minus = f_c - effort  # the sum of both roots is f_c
    mirrored, printed = (float(law.displacement(each, whole)) for each in (effort, abs(minus)))
    return judged(
        place="3.2, Eq. 15",
        statement="For a negative pulse the ± of Eq. 15 is a minus.",
        criterion=f"the pulse of {width:g} s is then as strong as the positive one",
        found=(
            abs(printed / mirrored - 1.0) <= _SAME,
            f"{minus:.0f} N instead of {-f_p:.0f} N, and {lengths([printed])} instead of "
            f"{lengths([mirrored])}".replace("-", "−"),
        ),
        why="Eq. 14 is one for |f|. Its minus root is the plus root less f_c; the mirror image is "
        "−(plus root), which is used here.",
        numbers={"minus_root_N": minus, "printed_m": printed, "mirrored_m": mirrored},
    )


def _works_with_known_friction(evidence: Evidence) -> Claim:
    series = evidence.unlearned[1.0]
    return judged(
        place="3.2",
        statement="With a known Coulomb friction the algorithm works, without adaptation.",
        criterion="from the true f_c, and learning nothing, it ends within the tolerance",
        found=(
            series.reached(0),
            f"{lengths([series.final_error(0)])} after {len(series.runs[0].pulses)} pulses",
        ),
        why="Each pulse takes most of the error that is left, as 0 < b/b̂ < 2.",
        numbers={"final_m": series.final_error(0), "pulses": len(series.runs[0].pulses)},
    )


def _adaptation_is_needed(evidence: Evidence) -> Claim:
    wrong = [guess for guess in GUESSES if guess != 1.0]
    finals = {guess: evidence.unlearned[guess].final_error(0) for guess in wrong}
    return judged(
        place="Abstract; 3.2",
        statement="With an uncertain friction, adaptation is necessary to track the desired "
        "position accurately.",
        criterion="from wrong guesses of f_c, and learning nothing, PAPWC does not end within the "
        "tolerance",
        found=(
            not any(evidence.unlearned[guess].reached(0) for guess in wrong),
            ", ".join(
                f"{lengths([abs(final)])} with {guess:g} f_c" for guess, final in finals.items()
            ),
        ),
        why="With a guess too low the last pulses become weaker than the static friction and it "
        f"stands, close to the tolerance of {1e6 * TOLERANCE:g} µm; with one too high it cycles, "
        "as its loop gain is too large for small errors.",
        numbers={f"with_{guess:g}_m": final for guess, final in finals.items()},
    )


def _estimates_friction(evidence: Evidence) -> Claim:
    last = RUNS_IN_A_ROW - 1
    found: dict[str, tuple[bool, str]] = {}
    numbers: dict[str, float | int] = {}
    for reading in _PAPWC_READINGS:
        free, bound = (
            float(series.estimate(last, "coulomb_friction")[-1])
            for series in evidence.by_bound(PAPWC, reading)
        )
        numbers |= {f"{KEYS[reading]}_unbounded_N": free, f"{KEYS[reading]}_bounded_N": bound}
        worst = max(abs(value / COULOMB_FRICTION - 1.0) for value in (free, bound))
        anew = evidence.anew[PAPWC, reading, UNBOUNDED].estimate(last, "coulomb_friction")[-1]
        numbers[f"{KEYS[reading]}_anew_N"] = float(anew)
        found[reading] = (
            worst <= _NEAR,
            f"{free:.1f} N without a bound ({anew:.1f} N with P laid anew before each run) and "
            f"{bound:.1f} N with it",
        )
    return by_reading(
        place="3.2; 4, Fig. 9",
        statement="Â_2/Â_1 is an estimate of the Coulomb friction.",
        criterion=f"after ten runs it is within {100 * _NEAR:g} % of the true "
        f"{COULOMB_FRICTION:g} N, with and without a bound",
        found=found,
        why="Viscous friction is in no equation. With P(0) = 1e-5 I the estimate takes it up as "
        "Coulomb friction; with 1e5 I it goes to both parameters, which pulses of one shape cannot "
        "tell apart.",
        numbers=numbers,
    )


def _regressors(series: Series, run: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the rows T_x^2 [f abs(f), -f] of the pulses that moved, and their displacements."""
    rows, displacements = [], []
    for pulse in series.runs[run].pulses:
        ((effort, width),) = pulse.levels
        if pulse.moved:
            rows.append([width**2 * effort * abs(effort), -(width**2) * effort])
            displacements.append(pulse.achieved_displacement)
    return np.array(rows), np.array(displacements)


def _no_inversion(evidence: Evidence) -> Claim:
    found: dict[str, tuple[bool, str]] = {}
    numbers: dict[str, float | int] = {}
    for reading in _PAPWC_READINGS:
        series = evidence.series[PAPWC, reading, BOUNDED]
        rows, d = _regressors(series, 0)
        a_0 = np.array([series.estimate(0, "gain_1")[0], series.estimate(0, "gain_2")[0]])
        prior = np.eye(2) / COVARIANCE[reading]
        batch = a_0 + np.linalg.solve(prior + rows.T @ rows, rows.T @ (d - rows @ a_0))
        b = np.array([PULSE_EFFORT**2, -PULSE_EFFORT])
        recursive = float(series.estimate(0, "pulse_gain")[-1])
        difference = abs(recursive / float(b @ batch) - 1.0)
        numbers[f"{KEYS[reading]}_difference"] = difference
        found[reading] = (difference <= _EXACT, f"{difference:.1e}")
    return by_reading(
        place="3.2, Eqs. 17-21",
        statement="The recursion does not need to invert F, and gives the same estimates.",
        criterion=f"b̂ after run 1 with the bound is that of batch least squares with P(0) as its "
        f"prior, within {_EXACT:g}",
        found=found,
        why="It is the matrix inversion lemma: one division by a number replaces the inverse.",
        numbers=numbers,
    )


def _printed_regressor(evidence: Evidence) -> Claim:
    found: dict[str, tuple[bool, str]] = {}
    numbers: dict[str, float | int] = {}
    for reading in _PAPWC_READINGS:
        gains = evidence.printed[reading].estimate(0, "pulse_gain") / evidence.gain
        lowest = float(np.min(gains))
        numbers[f"{KEYS[reading]}_lowest"] = lowest
        if lowest > 0.0:
            found[reading] = (True, f"b̂ stays above {ratios([lowest])} b")
        else:
            pulse = int(np.argmax(gains <= 0.0))
            found[reading] = (False, f"b̂ is {ratios([gains[pulse]])} b after pulse {pulse}")
    return by_reading(
        place="3.2, Eq. 22",
        statement="The regressor of A_1 and A_2 is [f_p² t_p², f_p t_p²].",
        criterion="b̂ stays positive with it in run 1 without a bound",
        found=found,
        why="By Eq. 16 the second entry is −f_p t_p², and of odd sign. With the printed sign the "
        "recursion raises A_2 where it should lower it.",
        numbers=numbers,
    )


def _nominal_regressor(evidence: Evidence) -> Claim:
    nominal = evidence.nominal[LARGE]
    gains = nominal.estimate(0, "pulse_gain")
    rows = []
    for pulse, gain in zip(nominal.runs[0].pulses, gains, strict=False):
        square = abs(pulse.error) / float(gain)
        sign = np.sign(pulse.error)
        rows.append([sign * square * PULSE_EFFORT, -sign * square])
    nominal_ratio = _condition(np.array(rows))
    applied = _regressors(evidence.series[PAPWC, LARGE, UNBOUNDED], 0)[0] / [PULSE_EFFORT, 1.0]
    applied_ratio = _condition(applied)
    alike = _regressors(evidence.series[PAPWC, SMALL, BOUNDED], 0)[0][:_ONE_SHAPE]
    alike_ratio = _condition(alike / [PULSE_EFFORT, 1.0])
    return judged(
        place="3.2, Eq. 22",
        statement="Its f_p and t_p are those before rounding, and two parameters are estimated "
        "with it.",
        criterion="the regressors of run 1 without a bound have rank two: their second singular "
        f"value is above {_RANK_ONE:g} of the first",
        found=(
            nominal_ratio > _RANK_ONE,
            f"{nominal_ratio:.1e} with the nominal effort and width, {applied_ratio:.2g} with the "
            f"applied ones, and {alike_ratio:.1e} for the first {_ONE_SHAPE} pulses with the "
            "bound, which are all alike",
        ),
        why="The nominal effort is always f_p, so all regressors are multiples of [f_p, −1]: only "
        "b is estimated, and f̂_c comes from the first guess. The applied effort and width of "
        "Eq. 15, used here, tell the two apart, once pulses of several shapes have been fired.",
        numbers={
            "nominal": nominal_ratio,
            "applied": applied_ratio,
            "alike": alike_ratio,
        },
    )


def _condition(rows: np.ndarray) -> float:
    """Return the least singular value over the largest."""
    values = np.linalg.svd(rows, compute_uv=False)
    return float(values[-1] / values[0])


def _choice_of_delta(evidence: Evidence) -> Claim:
    found: dict[str, tuple[bool, str]] = {}
    numbers: dict[str, float | int] = {}
    for reading in _PAPWC_READINGS:
        delta = 1.0 / COVARIANCE[reading]
        series = evidence.free[reading]
        friction = np.concatenate(
            [series.estimate(run, "coulomb_friction") for run in range(len(series.runs))]
        )
        lowest, highest = float(np.min(friction)), float(np.max(friction))
        numbers |= {
            f"{KEYS[reading]}_delta": delta,
            f"{KEYS[reading]}_lowest_N": lowest,
            f"{KEYS[reading]}_highest_N": highest,
        }
        kept = lowest > 0.0 and highest < PULSE_EFFORT
        found[reading] = (
            delta < 1.0,
            f"δ = {delta:.0e}; without projection f̂_c goes from {ratios([lowest], 4)} to "
            f"{ratios([highest], 4)} N in {len(series.runs)} runs without a bound"
            + ("" if kept else ", which is impossible"),
        )
    return by_reading(
        place="3.2; 4",
        statement="δ can be small without noise; therefore δ⁻¹ = 1e-5 in section 4.",
        criterion="δ is below 1",
        found=found,
        why="The two sections contradict each other: δ⁻¹ = 1e-5 is a large δ. Only read as δ = "
        "1e-5 does it follow the rule, and then the estimate leaves 0 < f̂_c < f_p; it is kept in "
        "that range here. With P(0) = 1e-5 I, A_2 hardly moves and nothing needs to be kept.",
        numbers=numbers,
    )
