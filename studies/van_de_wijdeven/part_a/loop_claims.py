"""What the source claims of B and S and of its two loops, judged by measurements."""

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.judging import (
    NAMES,
    VERY_CLOSE,
    final,
    numbers,
    pair,
    percent,
    spread,
)
from studies.van_de_wijdeven.part_a.runs import LOOPS, Loop
from studies.van_de_wijdeven.part_a.sequences import MeanLine
from studies.van_de_wijdeven.records import Claim

__all__ = ["loop_claims"]

_INSENSITIVE = 0.25  # of the change without B and S
_LINE = 3.0  # times the line through e_y without noise
_COMPENSATED = 0.25  # of the line through e_y that is left
_INTERACTS = 0.1  # correlation from which two estimates are said to interact
_STABLE = 1.25  # by which an ITSE may differ
_NOISY = ("noisy", "full", "wrong", "terms", "wrong-terms")


def loop_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims of chapters 6 and 7 on B and S and on the feedback, with their verdicts."""
    return (
        interaction(evidence),
        *(insensitive(loop, evidence) for loop in LOOPS),
        *(bias_and_slope(loop, evidence) for loop in LOOPS),
        *(line_compensated(loop, evidence) for loop in LOOPS),
        *(stable_error(loop, evidence) for loop in LOOPS),
        feedback_without_noise(evidence),
        feedback_with_noise(evidence),
        *(most_stable(loop, evidence) for loop in LOOPS),
        *(accurate(loop, evidence) for loop in LOOPS),
    )


def interaction(evidence: Evidence) -> Claim:
    """Judge whether B and S interact with the estimates of friction."""
    found = {
        f"{name}_{term}": value
        for name, row in zip(NAMES, evidence.interaction.tolist(), strict=True)
        for term, value in zip("BS", row, strict=True)
    }
    return Claim(
        place="6.1, after Eq. 6.2",
        statement="There is always some interaction between the estimates of f_c and c and those "
        "of B and S.",
        criterion=f"P after one run correlates each of f_c and c with B or S by {_INTERACTS:g} or "
        "more",
        measured=", ".join(
            f"{name} with B {b:+.2f} and with S {s:+.2f}"
            for name, (b, s) in zip(NAMES, evidence.interaction.tolist(), strict=True)
        ).replace("-", "−"),
        agrees=bool(np.all(np.max(np.abs(evidence.interaction), axis=1) >= _INTERACTS)),
        why="W_c resembles the regressor of Coulomb friction wherever the mass is slow. So S does "
        "not take up errors of σ alone: it trades against friction.",
        numbers=found,
    )


def insensitive(loop: Loop, evidence: Evidence) -> Claim:
    """Judge whether B and S make the estimates insensitive to wrong standard deviations."""

    def change(exact: str, wrong: str) -> Float[np.ndarray, " 2"]:
        return final(evidence, loop, wrong) - final(evidence, loop, exact)

    without, with_terms = change("full", "wrong"), change("terms", "wrong-terms")
    where = {"feedforward": "6.1", "feedback": "6.2"}[loop]
    return Claim(
        place=f"{where}, {loop}",
        statement="With B and S, errors in the standard deviations do not influence the estimates.",
        criterion=f"halving them changes each by at most {100 * VERY_CLOSE:g} % of the truth, and "
        f"by at most {_INSENSITIVE:g} of the change without B and S",
        measured=f"{percent(with_terms)} with B and S, {percent(without)} without",
        agrees=bool(
            np.all(np.abs(with_terms) <= _INSENSITIVE * np.abs(without))
            and np.max(np.abs(with_terms)) <= VERY_CLOSE
        ),
        why="A wrong σ leaves a constant in the energies and, at rest, a part of W_c in the "
        "regressor: just what B and S multiply. In slow motion it leaves another shape, as W_c "
        "ends at a lower speed with half σ; that stays. Around which value B and S make the "
        "estimates insensitive is another question.",
        numbers={**numbers("with", with_terms), **numbers("without", without)},
    )


def bias_and_slope(loop: Loop, evidence: Evidence) -> Claim:
    """Judge what noise does to the prediction error."""
    noisy, clean = (evidence.sequences[loop, case] for case in ("noisy", "clean"))
    level, rise = (float(np.mean(each[:, 0])) for each in (noisy.level, noisy.rise))
    clean_level, clean_rise = (float(np.mean(each[:, 0])) for each in (clean.level, clean.rise))
    return Claim(
        place={"feedforward": "6.1, Fig. 6.3", "feedback": "6.2, Fig. 6.8"}[loop],
        statement=f"Noise results in a bias and a slope in e_y ({loop}).",
        criterion="mean and rise of the straight line through e_y of the first run are both at "
        f"least {_LINE:g} times those without noise",
        measured=(
            f"mean {level:.4f} J and rise {rise:.4f} J with noise, {clean_level:.4f} J and "
            f"{clean_rise:.4f} J without"
        ).replace("-", "−"),
        agrees=abs(level) >= _LINE * abs(clean_level) and abs(rise) >= _LINE * abs(clean_rise),
        why="The level of the stored energies is too high, and the regressors grow while nothing "
        "is dissipated; in the feedback the input energy drifts as well (Eq. 5.5).",
        numbers={
            "level": level,
            "rise": rise,
            "clean_level": clean_level,
            "clean_rise": clean_rise,
        },
    )


def line_compensated(loop: Loop, evidence: Evidence) -> Claim:
    """Judge whether B and S take bias and slope out of the prediction error."""
    noisy, terms, wrong = (
        evidence.sequences[loop, case].line(-1) for case in ("noisy", "terms", "wrong-terms")
    )
    left = max(terms.size, wrong.size) / noisy.size
    figure = {"feedforward": "6.1, Fig. 6.5", "feedback": "6.2, Fig. 6.10"}[loop]
    return Claim(
        place=figure,
        statement="With B and S, bias and slope of e_y are almost fully compensated after five "
        f"simulations ({loop}).",
        criterion="of the line through e_y of the fifth run, in the mean over many sequences and "
        f"by the best estimate, at most {_COMPENSATED:g} is left, with true and with half σ",
        measured=(
            f"root mean square {_size(noisy)} without compensation, {_size(terms)} with true σ, "
            f"{_size(wrong)} with half (standard error {terms.chance:.2g} J)"
        ),
        agrees=left <= _COMPENSATED,
        why="B takes up a constant and S what grows with time at rest. In a single run a bias "
        "remains that differs from run to run: the noise of the input energy while the input acts, "
        "which no constant shared by all runs can take up.",
        numbers={
            "noisy": noisy.size,
            "terms": terms.size,
            "terms_limit": terms.limit,
            "wrong_terms": wrong.size,
            "wrong_terms_limit": wrong.limit,
            "standard_error": terms.chance,
        },
    )


def _size(line: MeanLine) -> str:
    if line.told_from_zero:
        return f"{line.size:.2g} J"
    best = f"{line.size:.2g} J" if line.size > 0.0 else "zero"
    return f"below {line.limit:.2g} J (best estimate {best}, not to be told from zero)"


def stable_error(loop: Loop, evidence: Evidence) -> Claim:
    """Judge the ITSE with B and S."""
    terms, wrong_terms, wrong = (
        float(np.median(evidence.sequences[loop, case].itse[:, -1]))
        for case in ("terms", "wrong-terms", "wrong")
    )
    ratio = wrong_terms / terms
    place = {"feedforward": "6.1, Fig. 6.5", "feedback": "6.2, Fig. 6.10"}[loop]
    return Claim(
        place=place,
        statement="B and S stabilise e_y even when the variance of the noise is uncertain "
        f"({loop}).",
        criterion="the median ITSE of the fifth run with half σ is within a factor "
        f"{_STABLE:g} of that with true σ, and lower than without B and S",
        measured=(
            f"{ratio:.2f} of that with true σ, and {wrong_terms / wrong:.2f} of that without "
            "B and S"
        ),
        agrees=1.0 / _STABLE <= ratio <= _STABLE and wrong_terms < wrong,
        why="What a wrong σ leaves in e_y is taken up by B and S.",
        numbers={"terms": terms, "wrong_terms": wrong_terms, "wrong": wrong},
    )


def feedback_without_noise(evidence: Evidence) -> Claim:
    """Judge the two loops without noise."""
    open_loop, closed = (np.abs(final(evidence, loop, "clean")) for loop in LOOPS)
    return Claim(
        place="6.2, without noise",
        statement="The feedback gives more accurate estimates than the feedforward even without "
        "noise.",
        criterion="the errors of both parameters after five runs are smaller",
        measured=f"{percent(closed, '')} in the feedback, {percent(open_loop, '')} in the "
        "feedforward",
        agrees=bool(np.all(closed < open_loop)),
        why="The feedback's input has no steps, so that multiplying a velocity by the input that "
        "begins at its instant matters less.",
        numbers={**numbers("feedback", closed), **numbers("feedforward", open_loop)},
    )


def feedback_with_noise(evidence: Evidence) -> Claim:
    """Judge the two loops with noise."""
    open_loop, closed = (
        np.array([spread(evidence, loop, case) for case in _NOISY]) for loop in LOOPS
    )
    compared = "; ".join(
        f"{label} {pair(ours)} against {pair(theirs)}"
        for label, ours, theirs in zip(
            ("not compensated", "compensated", "half σ", "B and S", "half σ, B and S"),
            closed,
            open_loop,
            strict=True,
        )
    )
    return Claim(
        place="6.2, with noise",
        statement="The feedback gives more accurate estimates than the feedforward.",
        criterion="the root mean square errors of both parameters after five runs are smaller in "
        "every case with noise",
        measured=f"f_c and c in the feedback against the feedforward: {compared}",
        agrees=bool(np.all(closed < open_loop)),
        why="The printed input energy is biased in the feedback (Eq. 5.5), and the estimates "
        "absorb what it loses. No compensation of the source knows of that; S takes up part of it. "
        "How large it is depends on the velocity gain and on the sampling, which the source does "
        "not give.",
        numbers={
            f"{loop}_{case}_{name}": float(values[k, p])
            for loop, values in zip(LOOPS, (open_loop, closed), strict=True)
            for k, case in enumerate(_NOISY)
            for p, name in enumerate(NAMES)
        },
    )


def most_stable(loop: Loop, evidence: Evidence) -> Claim:
    """Judge which estimator is the most stable one."""
    largest = {case: float(np.max(spread(evidence, loop, case))) for case in _NOISY}
    names = {
        "noisy": "without compensation",
        "wrong": "with half σ alone",
        "wrong-terms": "with B and S and half σ",
    }
    unsure = {case: largest[case] for case in names}
    ranking = sorted(unsure, key=lambda case: unsure[case])
    return Claim(
        place=f"6.2, 7, {loop}",
        statement="The estimator with B and S gives the most stable results under uncertain "
        "standard deviations.",
        criterion="of the three it has the smallest error, whatever its size: with half σ, the "
        "larger of its two root mean square errors after five runs is smaller than with half σ "
        "alone, and than without compensation",
        measured="from the smallest to the largest: "
        + ", ".join(f"{names[case]} {100 * unsure[case]:.3g} % of the truth" for case in ranking),
        agrees=ranking[0] == "wrong-terms",
        why="What a wrong σ leaves, B and S take up. This ranks the three; whether the first is "
        "accurate is a claim of chapter 7, judged by itself.",
        numbers={f"largest_rmse_{case}": value for case, value in largest.items()},
    )


def accurate(loop: Loop, evidence: Evidence) -> Claim:
    """Judge how accurate the estimator with B and S is."""
    terms, wrong = (final(evidence, loop, case) for case in ("terms", "wrong-terms"))
    return Claim(
        place=f"7, {loop}",
        statement="B and S absorb what noise does to the energies, resulting in accurate "
        "estimates.",
        criterion="the bias of both after five runs is at most "
        f"{100 * VERY_CLOSE:g} % of the truth, with true and with half σ",
        measured=f"{percent(terms)} with true σ, {percent(wrong)} with half",
        agrees=bool(max(np.max(np.abs(terms)), np.max(np.abs(wrong))) <= VERY_CLOSE),
        why="What stays: W_c also grows in slow motion, where noise adds less than it says, so S "
        "trades a part of it against friction; the bias of the printed sums; and in the feedback "
        "that of the input energy. Nothing in Eq. 6.2 has the shape of those.",
        numbers={**numbers("terms", terms), **numbers("wrong_terms", wrong)},
    )
