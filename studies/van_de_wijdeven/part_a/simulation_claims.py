"""Claims on the feedforward simulations, judged by measurements."""

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.part_a.cases import PRINTED_COMPENSATED
from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.judging import (
    TRUTH,
    VERY_CLOSE,
    Quantity,
    Row,
    both,
    errors,
    final,
    score,
    spread,
)

_LOOP = "feedforward"
_LARGER = 1.0 + 1e-9  # ratio from which a value is larger than another


def _drift_ratio(evidence: Evidence) -> Float[np.ndarray, " 2"]:
    """Return the change from 30 s to 60 s of the first run with noise, over that without."""

    def drift(case: str) -> Float[np.ndarray, " 2"]:
        found = evidence.sequences[_LOOP, case]
        return np.abs(np.mean(found.values[:, 0] - found.halfway, axis=0))

    return drift("noisy") / drift("clean")


def _rmse_ratio(evidence: Evidence) -> Float[np.ndarray, " 2"]:
    wrong, exact = (score(evidence, PRINTED_COMPENSATED, scale, "rmse") for scale in (0.5, 1.0))
    return wrong / exact


def _last_change(evidence: Evidence) -> Float[np.ndarray, " 2"]:
    """Return the change over the fifth run, over the truth."""
    values = evidence.sequences[_LOOP, "terms"].values
    return np.abs(np.mean(values[:, -1] - values[:, -2], axis=0) / TRUTH)


SIMULATION_CLAIMS = (
    Row(
        "first mass rests",
        "6.1",
        "The first mass comes to rest after approximately 25 s.",
        "The source's table of parameters is lost: this is a property of the surrogate values, not "
        "of the method.",
        Quantity("time of rest", "s", lambda e: e.rest.time, 22.5, 27.5),
    ),
    Row(
        "second mass swings",
        "6.1",
        "The second mass keeps oscillating.",
        "Nothing damps it, and the force of the spring is too small to free the first mass.",
        Quantity("amplitude over the last 20 s", "m", lambda e: e.rest.swing, low=0.01),
    ),
    Row(
        "bias without noise",
        "6.1, Figs. 6.1, 6.2",
        "Without noise the estimates do not converge to the true values.",
        "The printed sums are backward Euler: they multiply a velocity by the input that begins at "
        "its instant, not by the one before it.",
        *both(
            "error after five runs, over the truth",
            lambda e: np.abs(final(e, _LOOP, "clean")),
            low=0.001,
        ),
    ),
    Row(
        "bias by sampling",
        "6.1",
        "That bias comes from zero-order hold and discrete integration: in continuous time the "
        "estimates converge to the true values.",
        "The error is of first order in T. The hold itself is not to blame: with sums that are "
        "exact under it, the bias is gone at the same T.",
        *both(
            "reduction of the error by a sampling time ten times shorter",
            lambda e: np.abs(e.sampling.printed) / np.abs(e.sampling.finer),
            low=5.0,
        ),
        *both("error of exact sums at the same T", lambda e: e.sampling.exact),
    ),
    Row(
        "noise does harm",
        "6.1, Figs. 6.1, 6.2",
        "Noise has a negative influence on the estimates.",
        "Noise lengthens both regressors, most at rest, while nothing is dissipated then: Coulomb "
        "friction is estimated too small, and viscous friction too large.",
        *both(
            "root mean square error after five runs, over the error without noise",
            lambda e: spread(e, _LOOP, "noisy") / np.abs(final(e, _LOOP, "clean")),
            low=_LARGER,
        ),
    ),
    Row(
        "end time matters",
        "6.1",
        "With noise, the final estimates vary with the time at which the simulation ends.",
        "At rest the regressors go on growing with noise alone, so each further second biases the "
        "estimates more.",
        *both(
            "change from 30 s to 60 s of the first run, over that without", _drift_ratio, low=5.0
        ),
    ),
    Row(
        "true standard deviations",
        "6.1, Figs. 6.1, 6.2",
        "With precise standard deviations the estimates are very close to the true values.",
        "What the double expectation leaves at rest, and subtracts too much in slow motion, "
        "remains; so does the bias of the sums.",
        *both(
            "bias over many runs, over the truth",
            lambda e: score(e, PRINTED_COMPENSATED, 1.0, "bias"),
            -VERY_CLOSE,
            VERY_CLOSE,
        ),
    ),
    Row(
        "wrong standard deviations",
        "6.1, Figs. 6.1, 6.2",
        "With standard deviations 50 % off, the estimates are less accurate.",
        "The bias grows with the square of σ in the energies and with σ in the Coulomb regressor; "
        "half of it compensates half or less.",
        *both("root mean square error with half of each, over the true", _rmse_ratio, low=_LARGER),
    ),
    Row(
        "rapid convergence",
        "6.1",
        "f_c and c converge rapidly to values close to the true ones and only slowly from then on.",
        "P falls with the square of the sums of the regressors, and with it the change by further "
        "samples.",
        *both(
            "error after 10 s, over the truth",
            lambda e: errors(np.mean(e.sequences[_LOOP, "terms"].early, axis=0)),
            -0.2,
            0.2,
        ),
        *both("change over the fifth run, over the truth", _last_change, high=0.02),
    ),
)
