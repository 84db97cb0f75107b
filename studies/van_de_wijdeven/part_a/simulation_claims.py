"""What the source claims of its feedforward simulations, judged by measurements."""

import numpy as np
from jaxtyping import Float

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.cases import PRINTED_COMPENSATED
from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.judging import (
    TRUTH,
    VERY_CLOSE,
    errors,
    final,
    numbers,
    percent,
    score,
    spread,
)
from studies.van_de_wijdeven.records import Claim

__all__ = ["simulation_claims"]

_REST_TIME = 25.0  # of the source [s]
_REST_TOLERANCE = 0.1  # of it
_SWINGS = 0.01  # amplitude from which the load is called oscillating [m]
_VISIBLE = 0.001  # error that counts as one, of the truth
_FINER = 5.0  # by which an error of first order falls at least, when T is ten times shorter
_DRIFT = 5.0  # times as much as without noise
_RAPIDLY = 0.2  # of the truth, after ten seconds
_SLOWLY = 0.02  # of the truth, over the last run


def simulation_claims(evidence: Evidence) -> tuple[Claim, ...]:
    """Return the claims of section 6.1 on the arm and on noise, with their verdicts."""
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
    )


def first_mass_rests(evidence: Evidence) -> Claim:
    """Judge when the first mass rests."""
    found = evidence.rest.time
    return Claim(
        place="6.1",
        statement=f"The first mass comes to rest after approximately {_REST_TIME:g} s.",
        criterion=f"within {100 * _REST_TOLERANCE:g} % of it",
        measured=f"{found:.1f} s",
        agrees=abs(found - _REST_TIME) <= _REST_TOLERANCE * _REST_TIME,
        why="The source's table of parameters is lost: this is a property of the surrogate values, "
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
    found = final(evidence, "feedforward", "clean")
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="Without noise the estimates do not converge to the true values.",
        criterion=f"after five runs each is off by more than {100 * _VISIBLE:g} % of the truth",
        measured=percent(found),
        agrees=bool(np.min(np.abs(found)) > _VISIBLE),
        why="The printed sums are backward Euler: they multiply a velocity by the input that "
        "begins at its instant, not by the one that led to it.",
        numbers=numbers("error", found),
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
            f"with T = {surrogate.SAMPLING_TIME:g} s {percent(found.printed)}; ten times shorter "
            f"{percent(found.finer)}; exact sums at the same T {percent(found.exact)}"
        ),
        agrees=bool(np.min(ratio) >= _FINER),
        why="The error is of first order in T. The hold itself is not to blame: with sums that are "
        "exact under it, the bias is gone at the same T.",
        numbers={
            **numbers("printed", found.printed),
            **numbers("finer", found.finer),
            **numbers("exact", found.exact),
        },
    )


def noise_does_harm(evidence: Evidence) -> Claim:
    """Judge what noise does to the estimates."""
    clean = np.abs(final(evidence, "feedforward", "clean"))
    noisy = spread(evidence, "feedforward", "noisy")
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="Noise has a negative influence on the estimates.",
        criterion="the root mean square error after five runs is larger than without noise",
        measured=f"{percent(noisy, '')} with noise, {percent(clean, '')} without",
        agrees=bool(np.all(noisy > clean)),
        why="Noise lengthens both regressors, most at rest, while nothing is dissipated then: "
        "Coulomb friction comes out too small, and viscous friction takes up the rest.",
        numbers={**numbers("noisy", noisy), **numbers("clean", clean)},
    )


def end_time_matters(evidence: Evidence) -> Claim:
    """Judge whether the end time matters."""

    def drift(case: str) -> Float[np.ndarray, " 2"]:
        found = evidence.sequences["feedforward", case]
        return np.mean(found.values[:, 0] - found.halfway, axis=0) / TRUTH

    noisy, clean = drift("noisy"), drift("clean")
    return Claim(
        place="6.1",
        statement="With noise, the final estimates vary with the time at which the simulation "
        "ends.",
        criterion=f"from 30 s to 60 s of the first run they change at least {_DRIFT:g} times as "
        "much as without noise",
        measured=f"{percent(noisy)} with noise, {percent(clean)} without",
        agrees=bool(np.all(np.abs(noisy) >= _DRIFT * np.abs(clean))),
        why="At rest the regressors go on growing with noise alone, so each further second biases "
        "the estimates more.",
        numbers={**numbers("noisy", noisy), **numbers("clean", clean)},
    )


def exact_sigma(evidence: Evidence) -> Claim:
    """Judge the compensation with the true standard deviations."""
    found = score(evidence, PRINTED_COMPENSATED, 1.0, "bias")
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="With precise standard deviations the estimates are very close to the true "
        "values.",
        criterion=f"the bias of each over many runs is at most {100 * VERY_CLOSE:g} % of the truth",
        measured=percent(found),
        agrees=bool(np.max(np.abs(found)) <= VERY_CLOSE),
        why="What the double expectation leaves at rest, and takes too much in slow motion, "
        "remains; so does the bias of the sums.",
        numbers=numbers("bias", found),
    )


def wrong_sigma(evidence: Evidence) -> Claim:
    """Judge the compensation with wrong standard deviations."""
    exact, wrong = (score(evidence, PRINTED_COMPENSATED, scale, "rmse") for scale in (1.0, 0.5))
    return Claim(
        place="6.1, Figs. 6.1, 6.2",
        statement="With standard deviations 50 % off, the estimates are less accurate.",
        criterion="the root mean square error of both is larger",
        measured=(
            f"{percent(wrong, '')} with half of each, {percent(exact, '')} with the true ones"
        ),
        agrees=bool(np.all(wrong > exact)),
        why="The bias grows with the square of σ in the energies and with σ in the Coulomb "
        "regressor; half of it compensates half or less.",
        numbers={**numbers("wrong", wrong), **numbers("exact", exact)},
    )


def rapid_convergence(evidence: Evidence) -> Claim:
    """Judge how the estimates converge, on which B and S rest."""
    found = evidence.sequences["feedforward", "terms"]
    early = errors(np.mean(found.early, axis=0))
    last = np.mean(found.values[:, -1] - found.values[:, -2], axis=0) / TRUTH
    return Claim(
        place="6.1",
        statement="f_c and c converge rapidly to values close to the true ones and only slowly "
        "from then on.",
        criterion=f"10 s after the beginning they are within {100 * _RAPIDLY:g} % of the truth, "
        f"and over the fifth run they change by at most {100 * _SLOWLY:g} % of it",
        measured=f"after 10 s {percent(early)}; over the fifth run {percent(last)}",
        agrees=bool(np.max(np.abs(early)) <= _RAPIDLY and np.max(np.abs(last)) <= _SLOWLY),
        why="P falls with the square of what the regressors have gathered, and with it what "
        "further samples can change.",
        numbers={**numbers("early", early), **numbers("last_run", last)},
    )
