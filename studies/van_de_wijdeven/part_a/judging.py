"""Quantities of part A: errors of both parameters over the truth."""

from collections.abc import Callable
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.tasks import surrogate
from studies.van_de_wijdeven import judging
from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.runs import Loop

Quantity = judging.Quantity[Evidence]
Row = judging.Row[Evidence]

TRUTH = np.array(list(surrogate.TRUTH.values()))
VERY_CLOSE = 0.05
"""Error up to which an estimate counts as very close to the truth, of it."""


def both(
    name: str,
    measure: Callable[[Evidence], Float[np.ndarray, " 2"]],
    low: float = -np.inf,
    high: float = np.inf,
) -> tuple[Quantity, Quantity]:
    """Return a ratio of each of both parameters as quantities with the same limits."""
    coulomb = Quantity(f"{name}, f_c", "1", lambda e: float(measure(e)[0]), low, high)
    viscous = Quantity(f"{name}, c", "1", lambda e: float(measure(e)[1]), low, high)
    return coulomb, viscous


def errors(values: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 2"]:
    """Return the errors of Coulomb and viscous friction over the truth."""
    return values / TRUTH - 1.0


def final(evidence: Evidence, loop: Loop, case: str) -> Float[np.ndarray, " 2"]:
    """Return the mean error after the last run, over the truth."""
    return errors(np.mean(evidence.sequences[loop, case].values[:, -1], axis=0))


def spread(evidence: Evidence, loop: Loop, case: str) -> Float[np.ndarray, " 2"]:
    """Return the root mean square error after the last run, over the truth."""
    missed = evidence.sequences[loop, case].values[:, -1] / TRUTH - 1.0
    return np.sqrt(np.mean(missed**2, axis=0))


def score(
    evidence: Evidence, variant: str, assumed: float, quality: Literal["bias", "rmse"]
) -> Float[np.ndarray, " 2"]:
    """Return a variant's bias or root mean square error over the truth.

    In the feedforward, at the noise of the surrogate values.
    """
    wanted = ("feedforward", variant, 1.0, assumed)
    found = next(
        each
        for each in evidence.study.scores
        if (each.loop, each.variant, each.noise, each.assumed) == wanted
    )
    by_name = found.bias if quality == "bias" else found.rmse
    return np.array([by_name[name] for name in surrogate.TRUTH])
