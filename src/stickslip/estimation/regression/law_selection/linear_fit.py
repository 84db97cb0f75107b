"""Least squares with honest intervals, for parameters that have no name of their own elsewhere."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.diagnostics import determined
from stickslip.estimation.fit.intervals import robust_uncertainty, t_quantile
from stickslip.records import InputError

__all__ = ["LinearFit", "fit_rows"]


@dataclass(frozen=True, kw_only=True)
class LinearFit:
    """Parameters that enter linearly, and how well they are known.

    Attributes
    ----------
    values
        By name [SI].
    std
        Standard deviations, which allow for residuals that are correlated in time [SI].
    ci95
        95 % intervals (low, high) [SI].
    relative_residual
        Norm of the residual over that of the target [-].
    """

    values: Mapping[str, float]
    std: Mapping[str, float]
    ci95: Mapping[str, tuple[float, float]]
    relative_residual: float

    def __post_init__(self) -> None:
        for name in ("values", "std", "ci95"):
            object.__setattr__(self, name, MappingProxyType(dict(getattr(self, name))))


def fit_rows(
    names: tuple[str, ...], regressors: Float[np.ndarray, "n p"], target: Float[np.ndarray, " n"]
) -> LinearFit:
    """Fit by least squares.

    Raises
    ------
    InputError
        If the rows do not tell some of the parameters apart.
    """
    found = determined(regressors, np.zeros(len(names)))
    if found.undetermined:
        group = sorted(names[k] for each in found.undetermined for k in each)
        raise InputError(
            f"the log does not determine {', '.join(dict.fromkeys(group))}",
            remedy="take a form with fewer terms, or record a motion with more speeds",
        )
    to_values = (found.right.T / found.singular) / found.norms[:, None]
    values = to_values @ (found.left.T @ target)
    residual = target - regressors @ values
    spread = robust_uncertainty(found.left, to_values, residual)
    std = np.sqrt(np.diag(spread.covariance))
    half = std * [t_quantile(float(d)) for d in spread.degrees_of_freedom]
    return LinearFit(
        values={name: float(value) for name, value in zip(names, values, strict=True)},
        std={name: float(value) for name, value in zip(names, std, strict=True)},
        ci95={
            name: (float(value - h), float(value + h))
            for name, value, h in zip(names, values, half, strict=True)
        },
        relative_residual=float(np.linalg.norm(residual) / np.linalg.norm(target)),
    )
