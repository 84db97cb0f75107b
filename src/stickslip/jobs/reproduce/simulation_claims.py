"""What the report claims of its simulations in chapters 6 and 7, judged by measurements."""

from collections.abc import Mapping
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.jobs import surrogate
from stickslip.jobs.reproduce.evidence import Evidence
from stickslip.jobs.reproduce.runs import LOOPS, Loop
from stickslip.records import Claim, VariantScore

__all__ = ["simulation_claims"]

_TRUTH = np.array(list(surrogate.TRUTH.values()))
_NAMES = ("f_c", "c")

_REST_TIME = 25.0  # of the report [s]
_REST_TOLERANCE = 0.1  # of it
_SWINGS = 0.01  # amplitude from which the load is called oscillating [m]
_VISIBLE = 0.001  # error that counts as one, of the truth
_FINER = 5.0  # by which an error of first order falls at least, when T is ten times shorter
_VERY_CLOSE = 0.05  # of the truth
_DRIFT = 5.0  # times as much as without noise
_INSENSITIVE = 0.25  # of the change without B and S
_RAPIDLY = 0.2  # of the truth, after ten seconds
_SLOWLY = 0.02  # of the truth, over the last run
_LINE = 3.0  # times the line through e_y without noise
_COMPENSATED = 0.25  # of the line through e_y that is left
_CHANCE = 2.0  # standard errors of a mean over sequences
_STABLE = 1.25  # by which an ITSE may differ

_NOISY = ("noisy", "full", "wrong", "terms", "wrong-terms")


def simulation_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims of chapters 6 and 7 with their verdicts."""
    return (
        first_mass_rests(evidence),
        second_mass_swings(evidence),
        biased_without_noise(evidence),
        sampling_is_to_blame(evidence),
        noise_does_harm(evidence),
        end_time_matters(evidence),
        exact_sigma(evidence),
        wrong_sigma(evidence),
        rapid_convergence(evidence),
        *(insensitive(loop, evidence) for loop in LOOPS),
        bias_and_slope(evidence),
        *(line_compensated(loop, evidence) for loop in LOOPS),
        *(stable_error(loop, evidence) for loop in LOOPS),
        feedback_without_noise(evidence),
        feedback_with_noise(evidence),
        *(most_stable(loop, evidence) for loop in LOOPS),
        *(accurate(loop, evidence) for loop in LOOPS),
    )


def _errors(values: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 2"]:
    return values / _TRUTH - 1.0


def _percent(values: Float[np.ndarray, " 2"], sign: Literal["+", ""] = "+") -> str:
    """Return relative errors of both parameters in words; root mean squares need no sign."""
    return " and ".join(
        f"{100 * value:{sign}.3g} %".replace("-", "−") + f" of {name}"
        for value, name in zip(values.tolist(), _NAMES, strict=True)
    )


def _pair(values: Float[np.ndarray, " 2"]) -> str:
    return " and ".join(f"{100 * value:.3g}" for value in values.tolist()) + " %"


def _numbers(what: str, values: Float[np.ndarray, " 2"]) -> dict[str, float]:
    return {f"{what}_{name}": value for name, value in zip(_NAMES, values.tolist(), strict=True)}


def _final(evidence: Evidence, loop: Loop, case: str) -> Float[np.ndarray, " 2"]:
    """Return the mean error after the last run, over the truth."""
    return _errors(np.mean(evidence.sequences[loop, case].values[:, -1], axis=0))


def _spread(evidence: Evidence, loop: Loop, case: str) -> Float[np.ndarray, " 2"]:
    """Return the root mean square error after the last run, over the truth."""
    errors = evidence.sequences[loop, case].values[:, -1] / _TRUTH - 1.0
    return np.sqrt(np.mean(errors**2, axis=0))


def _score(evidence: Evidence, variant: str, assumed: float | None) -> VariantScore:
    """Return a variant's score in the feedforward, at the noise of the surrogate values."""
    return next(
        each
        for each in evidence.study.scores
        if (each.loop, each.variant, each.noise, each.assumed)
        == ("feedforward", variant, 1.0, assumed)
    )


def _vector(values: Mapping[str, float]) -> Float[np.ndarray, " 2"]:
    return np.array([values[name] for name in surrogate.TRUTH])


def first_mass_rests(evidence: Evidence) -> Claim:
    """Judge when the first mass rests."""
    found = evidence.rest.time
    return Claim(
        place="6.1",
        statement=f"The first mass comes to rest after approximately {_REST_TIME:g} s.",
        criterion=f"within {100 * _REST_TOLERANCE:g} % of it",
        measured=f"{found:.1f} s",
        agrees=abs(found - _REST_TIME) <= _REST_TOLERANCE * _REST_TIME,
        why="The report's table of parameters is lost: this is a property of the surrogate values, "
        "not of the method.",
        numbers={"rest_time": found},
    )


def second_mass_swings(evidence: Evidence) -> Claim:
    """Judge what the second mass does then."""
    found = evidence.rest.swing
    force = surrogate.STIFFNESS * found
    return Claim(
        place="6.1",
        statement="The second mass keeps oscillating.",
        criterion=f"its amplitude over the last 20 s is at least {_SWINGS:g} m",
        measured=f"amplitude {found:.3f} m",
        agrees=found >= _SWINGS,
        why=f"Nothing damps it, and the spring's {force:.3f} N cannot free the first mass, whose "
        f"friction is {surrogate.COULOMB_FRICTION:g} N.",
        numbers={"swing": found},
    )


def biased_without_noise(evidence: Evidence) -> Claim:
    """Judge the bias without noise."""
    found = _final(evidence, "feedforward", "clean")
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="Without noise the estimates do not converge to the true values.",
        criterion=f"after five runs each is off by more than {100 * _VISIBLE:g} % of the truth",
        measured=_percent(found),
        agrees=bool(np.min(np.abs(found)) > _VISIBLE),
        why="The printed sums are backward Euler: they multiply a velocity by the input that "
        "begins at its instant, not by the one that led to it.",
        numbers=_numbers("error", found),
    )


def sampling_is_to_blame(evidence: Evidence) -> Claim:
    """Judge where the bias without noise comes from."""
    found = evidence.sampling
    ratio = np.abs(found.printed) / np.abs(found.finer)
    return Claim(
        place="6.1",
        statement="That bias comes from zero-order hold and discrete integration: in continuous "
        "time the estimates converge to the true values.",
        criterion=f"a sampling time ten times shorter makes it at least {_FINER:g} times smaller",
        measured=(
            f"with T = {surrogate.SAMPLING_TIME:g} s {_percent(found.printed)}; ten times shorter "
            f"{_percent(found.finer)}; exact sums at the same T {_percent(found.exact)}"
        ),
        agrees=bool(np.min(ratio) >= _FINER),
        why="The error is of first order in T. The hold itself is not to blame: with sums that are "
        "exact under it, the bias is gone at the same T.",
        numbers={
            **_numbers("printed", found.printed),
            **_numbers("finer", found.finer),
            **_numbers("exact", found.exact),
        },
    )


def noise_does_harm(evidence: Evidence) -> Claim:
    """Judge what noise does to the estimates."""
    clean = np.abs(_final(evidence, "feedforward", "clean"))
    noisy = _spread(evidence, "feedforward", "noisy")
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="Noise has a negative influence on the estimates.",
        criterion="the root mean square error after five runs is larger than without noise",
        measured=f"{_percent(noisy, '')} with noise, {_percent(clean, '')} without",
        agrees=bool(np.all(noisy > clean)),
        why="Noise lengthens both regressors, most at rest, while nothing is dissipated then: "
        "Coulomb friction comes out too small, and viscous friction takes up the rest.",
        numbers={**_numbers("noisy", noisy), **_numbers("clean", clean)},
    )


def end_time_matters(evidence: Evidence) -> Claim:
    """Judge whether the end time matters."""

    def drift(case: str) -> Float[np.ndarray, " 2"]:
        found = evidence.sequences["feedforward", case]
        return np.mean(found.values[:, 0] - found.halfway, axis=0) / _TRUTH

    noisy, clean = drift("noisy"), drift("clean")
    return Claim(
        place="6.1",
        statement="With noise, the final estimates vary with the time at which the simulation "
        "ends.",
        criterion=f"from 30 s to 60 s of the first run they change at least {_DRIFT:g} times as "
        "much as without noise",
        measured=f"{_percent(noisy)} with noise, {_percent(clean)} without",
        agrees=bool(np.all(np.abs(noisy) >= _DRIFT * np.abs(clean))),
        why="At rest the regressors go on growing with noise alone, so each further second biases "
        "the estimates more.",
        numbers={**_numbers("noisy", noisy), **_numbers("clean", clean)},
    )


_PRINTED = "printed sums, printed compensation"
_WITH_TERMS = f"{_PRINTED}, B and S"


def exact_sigma(evidence: Evidence) -> Claim:
    """Judge the compensation with the true standard deviations."""
    found = _vector(_score(evidence, _PRINTED, 1.0).bias)
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="With precise standard deviations the estimates are very close to the true "
        "values.",
        criterion=f"the bias of each over many runs is at most {100 * _VERY_CLOSE:g} % of the "
        "truth",
        measured=_percent(found),
        agrees=bool(np.max(np.abs(found)) <= _VERY_CLOSE),
        why="What the double expectation leaves at rest, and takes too much in slow motion, "
        "remains; so does the bias of the sums.",
        numbers=_numbers("bias", found),
    )


def wrong_sigma(evidence: Evidence) -> Claim:
    """Judge the compensation with wrong standard deviations."""
    exact, wrong = (_vector(_score(evidence, _PRINTED, scale).rmse) for scale in (1.0, 0.5))
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="With standard deviations 50 % off, the estimates are less accurate.",
        criterion="the root mean square error of both is larger",
        measured=(
            f"{_percent(wrong, '')} with half of each, {_percent(exact, '')} with the true ones"
        ),
        agrees=bool(np.all(wrong > exact)),
        why="The bias grows with the square of σ in the energies and with σ in the Coulomb "
        "regressor; half of it compensates half or less.",
        numbers={**_numbers("wrong", wrong), **_numbers("exact", exact)},
    )


def rapid_convergence(evidence: Evidence) -> Claim:
    """Judge how the estimates converge, on which B and S rest."""
    found = evidence.sequences["feedforward", "terms"]
    early = _errors(np.mean(found.early, axis=0))
    last = np.mean(found.values[:, -1] - found.values[:, -2], axis=0) / _TRUTH
    return Claim(
        place="6.1",
        statement="f_c and c converge rapidly to values close to the true ones and only slowly "
        "from then on.",
        criterion=f"10 s after the beginning they are within {100 * _RAPIDLY:g} % of the truth, "
        f"and over the fifth run they change by at most {100 * _SLOWLY:g} % of it",
        measured=f"after 10 s {_percent(early)}; over the fifth run {_percent(last)}",
        agrees=bool(np.max(np.abs(early)) <= _RAPIDLY and np.max(np.abs(last)) <= _SLOWLY),
        why="P falls with the square of what the regressors have gathered, and with it what "
        "further samples can change.",
        numbers={**_numbers("early", early), **_numbers("last_run", last)},
    )


def insensitive(loop: Loop, evidence: Evidence) -> Claim:
    """Judge whether B and S make the estimates insensitive to wrong standard deviations."""

    def change(exact: str, wrong: str) -> Float[np.ndarray, " 2"]:
        return _final(evidence, loop, wrong) - _final(evidence, loop, exact)

    without, with_terms = change("full", "wrong"), change("terms", "wrong-terms")
    where = {"feedforward": "6.1", "feedback": "6.2"}[loop]
    return Claim(
        place=f"{where}, {loop}",
        statement="With B and S, errors in the standard deviations do not influence the estimates.",
        criterion=f"halving them changes both by at most {_INSENSITIVE:g} of the change without "
        "B and S",
        measured=f"{_percent(with_terms)} with B and S, {_percent(without)} without",
        agrees=bool(np.all(np.abs(with_terms) <= _INSENSITIVE * np.abs(without))),
        why="A wrong σ leaves a constant in the energies and a part of W_c in the regressor: just "
        "what B and S multiply. Around which value they make the estimates insensitive is another "
        "question.",
        numbers={**_numbers("with", with_terms), **_numbers("without", without)},
    )


def bias_and_slope(evidence: Evidence) -> Claim:
    """Judge what noise does to the prediction error."""
    noisy, clean = (evidence.sequences["feedforward", case] for case in ("noisy", "clean"))
    level, rise = (float(np.mean(each[:, 0])) for each in (noisy.level, noisy.rise))
    clean_level, clean_rise = (float(np.mean(each[:, 0])) for each in (clean.level, clean.rise))
    return Claim(
        place="6.1, Fig. 6.3",
        statement="Noise results in a bias and a slope in e_y.",
        criterion="mean and rise of the straight line through e_y of the first run are both at "
        f"least {_LINE:g} times those without noise",
        measured=(
            f"mean {level:.4f} J and rise {rise:.4f} J with noise, {clean_level:.4f} J and "
            f"{clean_rise:.4f} J without"
        ).replace("-", "−"),
        agrees=abs(level) >= _LINE * abs(clean_level) and abs(rise) >= _LINE * abs(clean_rise),
        why="The level of the stored energies is too high, and the regressors grow while nothing "
        "is dissipated. Later runs trade the bias for more slope, as the estimates move to "
        "balance it.",
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
    left = max(size - _CHANCE * chance for size, chance in (terms, wrong)) / noisy[0]
    figure = {"feedforward": "6.1, Fig. 6.5", "feedback": "6.2, Fig. 6.10"}[loop]
    return Claim(
        place=figure,
        statement="With B and S, bias and slope of e_y are almost fully compensated after five "
        f"simulations ({loop}).",
        criterion="of the line through e_y of the fifth run, in the mean over many sequences, at "
        f"most {_COMPENSATED:g} is left, with true and with half σ, once {_CHANCE:g} standard "
        "errors are allowed for",
        measured=(
            f"root mean square {terms[0]:.4f} J with true σ and {wrong[0]:.4f} J with half, of "
            f"{noisy[0]:.4f} J; standard error {terms[1]:.4f} J"
        ),
        agrees=left <= _COMPENSATED,
        why="B takes up a constant and S what grows with time at rest. In a single run a bias "
        "remains that differs from run to run: the noise of the input energy while the input acts, "
        "which no constant shared by all runs can take up.",
        numbers={
            "noisy": noisy[0],
            "terms": terms[0],
            "wrong_terms": wrong[0],
            "standard_error": terms[1],
        },
    )


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
    open_loop, closed = (np.abs(_final(evidence, loop, "clean")) for loop in LOOPS)
    return Claim(
        place="6.2, without noise",
        statement="The feedback gives more accurate estimates than the feedforward even without "
        "noise.",
        criterion="the errors of both parameters after five runs are smaller",
        measured=f"{_percent(closed, '')} in the feedback, {_percent(open_loop, '')} in the "
        "feedforward",
        agrees=bool(np.all(closed < open_loop)),
        why="The feedback's input has no steps, so that multiplying a velocity by the input that "
        "begins at its instant matters less.",
        numbers={**_numbers("feedback", closed), **_numbers("feedforward", open_loop)},
    )


def feedback_with_noise(evidence: Evidence) -> Claim:
    """Judge the two loops with noise."""
    open_loop, closed = (
        np.array([_spread(evidence, loop, case) for case in _NOISY]) for loop in LOOPS
    )
    compared = "; ".join(
        f"{label} {_pair(ours)} against {_pair(theirs)}"
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
        "absorb what it loses. No compensation of the report knows of that; S takes up part of it. "
        "How large it is depends on the velocity gain and on the sampling, which the report does "
        "not give.",
        numbers={
            f"{loop}_{case}_{name}": float(values[k, p])
            for loop, values in zip(LOOPS, (open_loop, closed), strict=True)
            for k, case in enumerate(_NOISY)
            for p, name in enumerate(_NAMES)
        },
    )


def most_stable(loop: Loop, evidence: Evidence) -> Claim:
    """Judge which estimator is the most stable one."""
    largest = {case: float(np.max(_spread(evidence, loop, case))) for case in _NOISY}
    unsure = {case: largest[case] for case in ("noisy", "wrong", "wrong-terms")}
    return Claim(
        place=f"6.2, 7, {loop}",
        statement="The estimator with B and S gives the most stable results under uncertain "
        "standard deviations.",
        criterion="with half σ, the larger of its two root mean square errors after five runs is "
        "smaller than with half σ alone, and than without compensation",
        measured=(
            f"{100 * unsure['wrong-terms']:.3g} % of the truth with B and S, "
            f"{100 * unsure['wrong']:.3g} % without them, {100 * unsure['noisy']:.3g} % without "
            "compensation"
        ),
        agrees=min(unsure, key=lambda case: unsure[case]) == "wrong-terms",
        why="What a wrong σ leaves, B and S take up.",
        numbers={f"largest_rmse_{case}": value for case, value in largest.items()},
    )


def accurate(loop: Loop, evidence: Evidence) -> Claim:
    """Judge how accurate the estimator with B and S is."""
    terms, wrong = (_final(evidence, loop, case) for case in ("terms", "wrong-terms"))
    return Claim(
        place=f"7, {loop}",
        statement="B and S absorb what noise does to the energies, resulting in accurate "
        "estimates.",
        criterion="the bias of both after five runs is at most "
        f"{100 * _VERY_CLOSE:g} % of the truth, with true and with half σ",
        measured=f"{_percent(terms)} with true σ, {_percent(wrong)} with half",
        agrees=bool(max(np.max(np.abs(terms)), np.max(np.abs(wrong))) <= _VERY_CLOSE),
        why="What stays: W_c also grows in slow motion, where noise adds less than it says, so S "
        "trades a part of it against friction; the bias of the printed sums; and in the feedback "
        "that of the input energy. Nothing in Eq. 6.2 has the shape of those.",
        numbers={**_numbers("terms", terms), **_numbers("wrong_terms", wrong)},
    )
