"""Columns of the force balance: functions of the motion, one for each coefficient."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.weak_form.motion import SlipMotion

__all__ = ["ANY", "Column", "Shape"]

Column = Callable[[SlipMotion], Float[np.ndarray, " n"]]
"""A part of the effort per unit of its coefficient, sample by sample."""

ANY = (-np.inf, np.inf)
"""Bounds of a coefficient of either sign."""


@dataclass(frozen=True, kw_only=True)
class Shape:
    """One member of a family of terms.

    Attributes
    ----------
    names
        Parameter of each column.
    columns
        The columns, sample by sample, each a function of the motion.
    value
        What makes the shape, such as a Stribeck velocity [SI]; 0 if there is one shape only.
    bounds
        Between which the coefficients must lie for the term to be what it is named after [SI].
    slope
        Parameter that ``value`` is, and the derivative of the effort with respect to it as a
        function of the coefficients; None where it is not reported so.
    """

    names: tuple[str, ...]
    columns: tuple[Column, ...]
    value: float = 0.0
    bounds: tuple[float, float] = ANY
    slope: tuple[str, Callable[[Float[np.ndarray, " p"]], Column]] | None = None

    def allows(self, values: Float[np.ndarray, " p"]) -> bool:
        """Return whether the term can have these coefficients."""
        return bool(np.all((values > self.bounds[0]) & (values < self.bounds[1])))
