"""Recursive least squares with forgetting and without windup.

Van de Wijdeven (2002), part A, Eqs. 4.6-4.10.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import (
    MOST_PARAMETERS,
    RECURSION,
    VALUES,
    covariance_in,
    recursion_fields,
    rls_run,
    rls_step,
    set_prior,
)
from stickslip.estimation.settings import check_forgetting_factor
from stickslip.numerics.named_fields import places
from stickslip.records import InputError, finite_vector, positive

_DOUBLE = np.dtype(np.float64)


@dataclass(frozen=True, kw_only=True)
class RecursiveLeastSquares:
    """Least squares that takes one row at a time.

    Attributes
    ----------
    forgetting_factor
        In (0, 1]; 1 forgets nothing [-].
    forgetting
        ``"restricted"`` forgets only what the new row is informative about; ``"exponential"``
        forgets everything, as printed. Both keep P bounded by what it was at the start.

    Examples
    --------
    >>> import numpy as np
    >>> rls = RecursiveLeastSquares()
    >>> state = rls.init(initial_values=[0.0], initial_variance=1e9)
    >>> for y in (1.0, 2.0, 6.0):
    ...     state, values = rls.step(state, (np.array([1.0]), y))
    >>> round(float(values[0]), 6)
    3.0
    """

    forgetting_factor: float = 1.0
    forgetting: Literal["restricted", "exponential"] = "restricted"

    def __post_init__(self) -> None:
        check_forgetting_factor(self.forgetting_factor)
        if self.forgetting not in {"restricted", "exponential"}:
            raise InputError(
                f"forgetting is {self.forgetting!r}, there is no such kind",
                remedy="use 'restricted' or 'exponential'",
            )

    def init(
        self, *, initial_values: Sequence[float], initial_variance: float
    ) -> Float[np.ndarray, " s"]:
        """Return the state before the first row.

        Parameters
        ----------
        initial_values
            First guesses [unit of each parameter], five at most.
        initial_variance
            Diagonal of P(0) [squared unit of the parameters, over that of the target].
        """
        p = len(initial_values)
        if not 1 <= p <= MOST_PARAMETERS:
            raise InputError(
                f"{p} first guesses are given, there can be 1 to {MOST_PARAMETERS}",
                remedy="give one a parameter",
            )
        guesses = finite_vector("initial values", initial_values, "unit of each parameter")
        variance = positive("initial variance", initial_variance, "(unit of the parameter)^2")
        state = np.zeros(places(RECURSION))
        s = recursion_fields(state)
        s.forgetting, s.exponential = self.forgetting_factor, self.forgetting == "exponential"
        set_prior(s, guesses.tolist(), variance)
        return state

    def step(
        self, state: Float[np.ndarray, " s"], sample: tuple[Float[np.ndarray, " p"], float]
    ) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, " p"]]:
        """Take one row and its target; return the new state and the estimates.

        Parameters
        ----------
        state
            From `init` or an earlier step; it is left as it is.
        sample
            The regressors, one a parameter, and what they explain [any consistent units]; finite.
        """
        row, target = sample
        if getattr(row, "dtype", None) is not _DOUBLE:  # faster than to leave it to np.asarray
            row = np.asarray(row, np.float64)
        after = state.copy()
        if row.ndim != 1 or not rls_step(after, row, float(target)):
            raise _refused(row, target, _parameters(after))
        return after, after[VALUES : VALUES + row.size]

    def run(
        self,
        state: Float[np.ndarray, " s"],
        rows: Float[np.ndarray, "n p"],
        targets: Float[np.ndarray, " n"],
    ) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, "n p"]]:
        """Take many rows; return the new state and the estimates after each.

        Parameters
        ----------
        state
            From `init` or an earlier step; it is left as it is.
        rows, targets
            Regressors and what they explain [any consistent units]; finite.
        """
        after = state.copy()
        table = np.ascontiguousarray(rows, dtype=np.float64)
        sought = np.ascontiguousarray(targets, dtype=np.float64)
        p = _parameters(state)
        if table.shape != (sought.size, p) or sought.ndim != 1:
            raise InputError(
                f"the rows have shape {table.shape} and the targets {sought.shape}, there are "
                f"{p} parameters",
                remedy="give one target a row, and one regressor a parameter",
            )
        bad = np.flatnonzero(~(np.isfinite(sought) & np.all(np.isfinite(table), axis=1)))
        if bad.size:
            raise InputError(
                f"row {bad[0]} or its target is not finite ({bad.size} such rows)",
                remedy="leave such rows out",
            )
        return after, rls_run(after, table, sought)

    def covariance(self, state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
        """Return P, the inverse of the information."""
        return covariance_in(state)


def _parameters(state: State) -> int:
    return int(recursion_fields(state).parameters)


def _refused(row: Float[np.ndarray, "..."], target: float, parameters: int) -> InputError:
    """Return why a row was not taken."""
    if row.shape != (parameters,):
        return InputError(
            f"the row has shape {row.shape}, there are {parameters} parameters",
            remedy="give one regressor a parameter, in the order of the first guesses",
        )
    return InputError(
        f"the row is {row.tolist()} and its target {target}, they must be finite",
        remedy="leave the row out: the state is as it was",
    )
