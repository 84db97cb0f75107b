"""Claims on B and S and on both loops, judged by measurements."""

from functools import partial
from itertools import chain

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.judging import VERY_CLOSE, Quantity, Row, both, final, spread
from studies.van_de_wijdeven.part_a.runs import LOOPS, Loop

_LESS = 1.0 - 1e-9  # ratio up to which a value is smaller than another
_STABLE = 1.25  # by which an ITSE may differ
_NOISY = {
    "noisy": "not compensated",
    "full": "compensated",
    "wrong": "half σ",
    "terms": "B and S",
    "wrong-terms": "half σ, B and S",
}


def _change(evidence: Evidence, loop: Loop, exact: str, wrong: str) -> Float[np.ndarray, " 2"]:
    """Return the change of the estimates by half the standard deviations, over the truth."""
    return np.abs(final(evidence, loop, wrong) - final(evidence, loop, exact))


def _line_ratio(evidence: Evidence, loop: Loop, part: str) -> float:
    """Return the mean level or rise of e_y in the first run, over that without noise."""
    noisy, clean = (
        abs(float(np.mean(getattr(evidence.sequences[loop, case], part)[:, 0])))
        for case in ("noisy", "clean")
    )
    return noisy / clean


def _line_left(evidence: Evidence, loop: Loop, case: str) -> float:
    """Return the line through e_y of the fifth run, over that without compensation."""
    own, noisy = (evidence.sequences[loop, each].line(-1) for each in (case, "noisy"))
    return own.size / noisy.size


def _itse_ratio(evidence: Evidence, loop: Loop, reference: str) -> float:
    """Return the median ITSE of the fifth run with half σ, B and S, over another."""
    own, other = (
        float(np.median(evidence.sequences[loop, case].itse[:, -1]))
        for case in ("wrong-terms", reference)
    )
    return own / other


def _largest_ratio(evidence: Evidence, loop: Loop, reference: str) -> float:
    """Return the larger error with half σ, B and S, over that of another estimator."""
    own, other = (
        float(np.max(spread(evidence, loop, case))) for case in ("wrong-terms", reference)
    )
    return own / other


def _of_loop(loop: Loop) -> tuple[Row, ...]:
    """Return the claims that are made of both loops."""
    feedforward = loop == "feedforward"
    chapter = "6.1" if feedforward else "6.2"
    compensated = "6.1, Fig. 6.5" if feedforward else "6.2, Fig. 6.10"
    return (
        Row(
            f"insensitive, {loop}",
            f"{chapter}, {loop}",
            "With B and S, errors in the standard deviations do not influence the estimates.",
            "A wrong σ leaves a constant in the energies and, at rest, a part of W_c in the "
            "regressor: just what B and S multiply. In slow motion it leaves another shape, as W_c "
            "ends at a lower speed with half σ; that stays. Around which value B and S make the "
            "estimates insensitive is another question.",
            *both(
                "change with half of them, over the truth",
                lambda e: _change(e, loop, "terms", "wrong-terms"),
                high=VERY_CLOSE,
            ),
            *both(
                "the same, over the change without B and S",
                lambda e: (
                    _change(e, loop, "terms", "wrong-terms") / _change(e, loop, "full", "wrong")
                ),
                high=0.25,
            ),
        ),
        Row(
            f"bias and slope, {loop}",
            "6.1, Fig. 6.3" if feedforward else "6.2, Fig. 6.8",
            f"Noise results in a bias and a slope in e_y ({loop}).",
            "The level of the stored energies is too high, and the regressors grow while nothing "
            "is dissipated; in the feedback the input energy drifts as well (Eq. 5.5).",
            Quantity(
                "mean of the line through e_y of the first run, over that without noise",
                "1",
                lambda e: _line_ratio(e, loop, "level"),
                low=3.0,
            ),
            Quantity(
                "rise of that line, over that without noise",
                "1",
                lambda e: _line_ratio(e, loop, "rise"),
                low=3.0,
            ),
        ),
        Row(
            f"line compensated, {loop}",
            compensated,
            "With B and S, bias and slope of e_y are almost fully compensated after five "
            f"simulations ({loop}).",
            "B stands for a constant and S for what grows with time at rest. In a single run a "
            "bias remains that differs from run to run: the noise of the input energy while the "
            "input acts, which is no constant shared by all runs.",
            Quantity(
                "line through e_y of the fifth run left with true σ, of that without",
                "1",
                lambda e: _line_left(e, loop, "terms"),
                high=0.25,
            ),
            Quantity(
                "the same with half σ", "1", lambda e: _line_left(e, loop, "wrong-terms"), high=0.25
            ),
        ),
        Row(
            f"stable error, {loop}",
            compensated,
            f"B and S stabilise e_y even when the variance of the noise is uncertain ({loop}).",
            "B and S absorb what a wrong σ leaves in e_y.",
            Quantity(
                "median ITSE of the fifth run with half σ, over that with true σ",
                "1",
                lambda e: _itse_ratio(e, loop, "terms"),
                1.0 / _STABLE,
                _STABLE,
            ),
            Quantity(
                "the same, over that without B and S",
                "1",
                lambda e: _itse_ratio(e, loop, "wrong"),
                high=_LESS,
            ),
        ),
    )


def _remarks(loop: Loop) -> tuple[Row, ...]:
    """Return the concluding claims that are made of both loops."""
    return (
        Row(
            f"most stable, {loop}",
            f"6.2, 7, {loop}",
            "The estimator with B and S gives the most stable results under uncertain standard "
            "deviations.",
            "B and S absorb what a wrong σ leaves. This ranks the three; whether the first is "
            "accurate is a claim of chapter 7, judged by itself.",
            Quantity(
                "larger error after five runs with half σ, over that without B and S",
                "1",
                lambda e: _largest_ratio(e, loop, "wrong"),
                high=_LESS,
            ),
            Quantity(
                "the same, over that without compensation",
                "1",
                lambda e: _largest_ratio(e, loop, "noisy"),
                high=_LESS,
            ),
        ),
        Row(
            f"accurate, {loop}",
            f"7, {loop}",
            "B and S absorb what noise does to the energies, resulting in accurate estimates.",
            "What stays: W_c also grows in slow motion, where noise adds less than it says, so S "
            "trades a part of it against friction; the bias of the printed sums; and in the "
            "feedback that of the input energy. Nothing in Eq. 6.2 has the shape of those.",
            *both(
                "bias after five runs with true σ, over the truth",
                lambda e: final(e, loop, "terms"),
                -VERY_CLOSE,
                VERY_CLOSE,
            ),
            *both(
                "the same with half σ",
                lambda e: final(e, loop, "wrong-terms"),
                -VERY_CLOSE,
                VERY_CLOSE,
            ),
        ),
    )


def _feedback_ratio(evidence: Evidence, case: str) -> Float[np.ndarray, " 2"]:
    """Return the error in the feedback over that in the feedforward."""
    open_loop, closed = (
        np.abs(final(evidence, loop, case)) if case == "clean" else spread(evidence, loop, case)
        for loop in LOOPS
    )
    return closed / open_loop


_INTERACTION = Row(
    "interaction",
    "6.1, after Eq. 6.2",
    "There is always some interaction between the estimates of f_c and c and those of B and S.",
    "W_c resembles the regressor of Coulomb friction wherever the mass is slow. So S does not "
    "absorb errors of σ alone: it trades against friction.",
    *both(
        "larger correlation with B or S in P after one run",
        lambda e: np.max(np.abs(e.interaction), axis=1),
        low=0.1,
    ),
)
_FEEDBACK = (
    Row(
        "feedback without noise",
        "6.2, without noise",
        "The feedback gives more accurate estimates than the feedforward even without noise.",
        "The feedback's input has no steps, so that multiplying a velocity by the input that "
        "begins at its instant matters less.",
        *both(
            "error after five runs, over that in the feedforward",
            lambda e: _feedback_ratio(e, "clean"),
            high=_LESS,
        ),
    ),
    Row(
        "feedback with noise",
        "6.2, with noise",
        "The feedback gives more accurate estimates than the feedforward.",
        "The printed input energy is biased in the feedback (Eq. 5.5), and the estimates absorb "
        "that. No compensation of the source corrects it; S absorbs a part. How large it is "
        "depends on the velocity gain and on the sampling, which the source does not give.",
        *tuple(
            quantity
            for case, words in _NOISY.items()
            for quantity in both(
                f"root mean square error, over that in the feedforward, {words}",
                partial(_feedback_ratio, case=case),
                high=_LESS,
            )
        ),
    ),
)
LOOP_CLAIMS = (
    _INTERACTION,
    *chain(*zip(*map(_of_loop, LOOPS), strict=True)),
    *_FEEDBACK,
    *chain(*zip(*map(_remarks, LOOPS), strict=True)),
)
