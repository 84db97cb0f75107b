"""Claims of section 3.2 on its equations (PAPWC), judged by formulas and by single runs."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_b.cases import (
    BOUNDED,
    COVARIANCE,
    LARGE,
    PAPWC,
    READINGS,
    SMALL,
    UNBOUNDED,
)
from studies.van_de_wijdeven.part_b.evidence import GUESSES, Evidence
from studies.van_de_wijdeven.part_b.judging import LAST, RUNS, Quantity, Row, by_reading
from studies.van_de_wijdeven.part_b.runs import Series
from studies.van_de_wijdeven.part_b.setting import (
    COULOMB_FRICTION,
    LONGEST_PULSE,
    PULSE_EFFORT,
    SAMPLING_TIME,
    STATIC_FRICTION,
    TOLERANCE,
)

_SAME = 0.01  # of two displacements that count as the same
_EXACT = 1e-6  # relative; of two solutions of the same least squares, with P(0) up to 1e5
_ONE_SHAPE = 6  # pulses of run 1 with the bound before the error is below it: all alike
_RANK_ONE = 1e-9  # ratio of singular values below which a matrix has rank one
_NEAR = 0.05  # error of an estimate that counts as one of its true value, of it
_WRONG = tuple(guess for guess in GUESSES if guess != 1.0)


def _each_reading(
    measure: Callable[[Evidence, str], float],
) -> Callable[[Evidence], dict[str, float]]:
    return lambda e: {reading: measure(e, reading) for reading in READINGS[PAPWC]}


def _trimmed(width: float, friction: float) -> tuple[float, float]:
    """Return the effort of Eq. 15 for a width at full effort, and the width of whole samples."""
    whole = np.ceil(width / SAMPLING_TIME - 1e-9) * SAMPLING_TIME
    f_p = PULSE_EFFORT
    root = np.sqrt(friction**2 + 4.0 * f_p * (f_p - friction) * (width / whole) ** 2)
    return float(0.5 * (friction + root)), float(whole)


def _largest_effort(_: Evidence, *both: Series) -> float:
    return max(float(np.max(np.abs(series.efforts(run)))) for series in both for run in RUNS)


def _trimming_error(evidence: Evidence) -> float:
    """Return how far trimmed pulses differ in displacement, with the true friction."""
    law = evidence.law
    worst = 0.0
    for width in np.arange(0.0005, 0.1, 0.0005).tolist():
        effort, whole = _trimmed(width, law.coulomb_friction)
        if effort > STATIC_FRICTION:
            before = float(law.displacement(PULSE_EFFORT, width))
            worst = max(worst, abs(float(law.displacement(effort, whole)) / before - 1.0))
    return worst


def _minus_root(evidence: Evidence) -> float:
    """Return the relative difference of the minus root of Eq. 15 to the mirrored pulse."""
    law = evidence.law
    effort, whole = _trimmed(LONGEST_PULSE, law.coulomb_friction)
    minus = law.coulomb_friction - effort  # the sum of both roots is f_c
    mirrored, printed = (float(law.displacement(each, whole)) for each in (effort, abs(minus)))
    return abs(printed / mirrored - 1.0)


def _friction_error(_: Evidence, *both: Series) -> float:
    ends = [float(series.estimate(LAST, "coulomb_friction")[-1]) for series in both]
    return max(abs(end / COULOMB_FRICTION - 1.0) for end in ends)


def _regressors(series: Series) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, " n"]]:
    """Return rows T_x^2 [f abs(f), -f] and displacements of the pulses of run 1 that moved."""
    moved = [pulse for pulse in series.runs[0].pulses if pulse.moved]
    effort, width = np.array([pulse.levels[0] for pulse in moved]).T
    rows = np.column_stack([width**2 * effort * np.abs(effort), -(width**2) * effort])
    return rows, np.array([pulse.achieved_displacement for pulse in moved])


def _batch_difference(evidence: Evidence, reading: str) -> float:
    """Return how far b_hat after run 1 differs from batch least squares with P(0) as prior."""
    series = evidence.series[PAPWC, reading, BOUNDED]
    rows, d = _regressors(series)
    a_0 = np.array([series.estimate(0, "gain_1")[0], series.estimate(0, "gain_2")[0]])
    prior = np.eye(2) / COVARIANCE[reading]
    batch = a_0 + np.linalg.solve(prior + rows.T @ rows, rows.T @ (d - rows @ a_0))
    recursive = float(series.estimate(0, "pulse_gain")[-1])
    return abs(recursive / float(np.array([PULSE_EFFORT**2, -PULSE_EFFORT]) @ batch) - 1.0)


def _lowest_printed(evidence: Evidence, reading: str) -> float:
    return float(np.min(evidence.printed[reading].estimate(0, "pulse_gain"))) / evidence.gain


def _condition(rows: Float[np.ndarray, "n 2"]) -> float:
    """Return the least singular value over the largest."""
    values = np.linalg.svd(rows, compute_uv=False)
    return float(values[-1] / values[0])


def _nominal_condition(evidence: Evidence) -> float:
    nominal = evidence.nominal[LARGE]
    gains = nominal.estimate(0, "pulse_gain")
    rows = [
        np.sign(pulse.error) * abs(pulse.error) / float(gain) * np.array([PULSE_EFFORT, -1.0])
        for pulse, gain in zip(nominal.runs[0].pulses, gains, strict=False)
    ]
    return _condition(np.array(rows))


def _applied_condition(series: Series, pulses: int | None = None) -> float:
    return _condition(_regressors(series)[0][:pulses] / [PULSE_EFFORT, 1.0])


def _free_friction(evidence: Evidence, reading: str) -> Float[np.ndarray, " k"]:
    """Return the estimated friction of all runs without projection [N]."""
    series = evidence.free[reading]
    runs = range(len(series.runs))
    return np.concatenate([series.estimate(run, "coulomb_friction") for run in runs])


FORM_CLAIMS = (
    Row(
        "effort below the limit",
        "3.2",
        "Rounding the width up makes the amplitude at most the maximum f_p.",
        "Eq. 15 is f_p for t_p = T_x and falls with t_p, as long as 0 < f̂_c < f_p.",
        Quantity(
            "largest effort of any run", "N", by_reading(PAPWC, _largest_effort), high=PULSE_EFFORT
        ),
    ),
    Row(
        "same displacement",
        "3.2, Eq. 14",
        "The trimmed pulse causes the same displacement as the one before rounding.",
        "Eq. 14 holds without viscous friction, whose effect on both is nearly the same. Static "
        "friction is in no equation of section 3.2.",
        Quantity(
            "largest relative difference by Eq. 3, up to 0.1 s, of pulses that move the mass",
            "1",
            _trimming_error,
            high=_SAME,
        ),
    ),
    Row(
        "minus root",
        "3.2, Eq. 15",
        "For a negative pulse the ± of Eq. 15 is a minus.",
        "Eq. 14 is one for |f|. Its minus root is the plus root less f_c; the mirror image is "
        "−(plus root), which is used here.",
        Quantity(
            "relative difference in displacement to the mirrored pulse of 0.03 s",
            "1",
            _minus_root,
            high=_SAME,
        ),
    ),
    Row(
        "known friction",
        "3.2",
        "With a known Coulomb friction the algorithm works, without adaptation.",
        "Each pulse removes most of the error that is left, as 0 < b/b̂ < 2.",
        Quantity(
            "runs from the true f_c, without learning, that end within the tolerance",
            "runs",
            lambda e: e.unlearned[1.0].reached(0),
            low=1.0,
        ),
        Quantity("final error", "m", lambda e: e.unlearned[1.0].final_error(0)),
    ),
    Row(
        "adaptation is needed",
        "Abstract; 3.2",
        "With an uncertain friction, adaptation is necessary to track the desired position "
        "accurately.",
        "With a guess too low the last pulses become weaker than the static friction and it "
        f"stands, close to the tolerance of {1e6 * TOLERANCE:g} µm; with one too high it cycles, "
        "as its loop gain is too large for small errors.",
        Quantity(
            "runs from wrong guesses, without learning, that end within the tolerance",
            "runs",
            lambda e: sum(e.unlearned[guess].reached(0) for guess in _WRONG),
            high=0.0,
        ),
        Quantity(
            "least final error of these runs",
            "m",
            lambda e: min(abs(e.unlearned[guess].final_error(0)) for guess in _WRONG),
        ),
    ),
    Row(
        "estimate of the friction",
        "3.2; 4, Fig. 9",
        "Â_2/Â_1 is an estimate of the Coulomb friction.",
        "Viscous friction is in no equation. With P(0) = 1e-5 I it is estimated as Coulomb "
        "friction; with 1e5 I both parameters contain it, as pulses of one shape do not "
        "distinguish them.",
        Quantity(
            "larger relative error after ten runs, with and without a bound",
            "1",
            by_reading(PAPWC, _friction_error),
            high=_NEAR,
        ),
    ),
    Row(
        "no inversion",
        "3.2, Eqs. 17-21",
        "The recursion does not need to invert F, and gives the same estimates.",
        "It is the matrix inversion lemma: one division by a number replaces the inverse.",
        Quantity(
            "relative difference of b̂ after run 1 with the bound to batch least squares",
            "1",
            _each_reading(_batch_difference),
            high=_EXACT,
        ),
    ),
    Row(
        "printed regressor",
        "3.2, Eq. 22",
        "The regressor of A_1 and A_2 is [f_p² t_p², f_p t_p²].",
        "By Eq. 16 the second entry is −f_p t_p², and of odd sign. With the printed sign the "
        "recursion raises A_2 where it should lower it.",
        Quantity(
            "least b̂/b with it in run 1 without a bound",
            "1",
            _each_reading(_lowest_printed),
            low=_RANK_ONE,
        ),
    ),
    Row(
        "nominal regressor",
        "3.2, Eq. 22",
        "Its f_p and t_p are those before rounding, and two parameters are estimated with it.",
        "The nominal effort is always f_p, so all regressors are multiples of [f_p, −1]: only b is "
        "estimated, and f̂_c is that of the first guess. The applied effort and width of Eq. 15, "
        "used here, distinguish the two after pulses of several shapes.",
        Quantity(
            "ratio of the singular values of the regressors of run 1 without a bound, nominal",
            "1",
            _nominal_condition,
            low=_RANK_ONE,
        ),
        Quantity(
            "ratio with the applied efforts and widths",
            "1",
            lambda e: _applied_condition(e.series[PAPWC, LARGE, UNBOUNDED]),
        ),
        Quantity(
            "ratio of the first 6 pulses with the bound, which are alike",
            "1",
            lambda e: _applied_condition(e.series[PAPWC, SMALL, BOUNDED], _ONE_SHAPE),
        ),
    ),
    Row(
        "choice of delta",
        "3.2; 4",
        "δ can be small without noise; therefore δ⁻¹ = 1e-5 in section 4.",
        "The two sections contradict each other: δ⁻¹ = 1e-5 is a large δ. Only read as δ = 1e-5 "
        "does it follow the rule, and then the estimate leaves 0 < f̂_c < f_p; it is kept in that "
        "range here. With P(0) = 1e-5 I, A_2 hardly moves and nothing needs to be kept.",
        Quantity(
            "δ", "1", _each_reading(lambda _, reading: 1.0 / COVARIANCE[reading]), high=1.0 - _SAME
        ),
        Quantity(
            "least f̂_c without projection",
            "N",
            _each_reading(lambda e, reading: float(np.min(_free_friction(e, reading)))),
        ),
        Quantity(
            "largest f̂_c without projection",
            "N",
            _each_reading(lambda e, reading: float(np.max(_free_friction(e, reading)))),
        ),
    ),
)
