"""What claims on simulations are judged with: errors over the truth, in numbers and words."""

from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.part_a.evidence import Evidence
from studies.van_de_wijdeven.part_a.runs import Loop

__all__ = [
    "NAMES",
    "TRUTH",
    "VERY_CLOSE",
    "errors",
    "final",
    "numbers",
    "pair",
    "percent",
    "score",
    "spread",
]

TRUTH = np.array(list(surrogate.TRUTH.values()))
NAMES = ("f_c", "c")
VERY_CLOSE = 0.05
"""Error up to which an estimate counts as very close to the truth, of it."""


def errors(values: Float[np.ndarray, " 2"]) -> Float[np.ndarray, " 2"]:
    """Return the errors of Coulomb and viscous friction over the truth."""
    return values / TRUTH - 1.0


def percent(values: Float[np.ndarray, " 2"], sign: Literal["+", ""] = "+") -> str:
    """Return relative errors of both parameters in words; root mean squares need no sign."""
    return " and ".join(
        f"{100 * value:{sign}.3g} %".replace("-", "−") + f" of {name}"
        for value, name in zip(values.tolist(), NAMES, strict=True)
    )


def pair(values: Float[np.ndarray, " 2"]) -> str:
    """Return two root mean square errors in words, for a list of many."""
    return " and ".join(f"{100 * value:.3g}" for value in values.tolist()) + " %"


def numbers(what: str, values: Float[np.ndarray, " 2"]) -> dict[str, float]:
    """Return the errors of both parameters by name, for the record of a claim."""
    return {f"{what}_{name}": value for name, value in zip(NAMES, values.tolist(), strict=True)}


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
