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
from stickslip.records import InputError, finite_vector, one_of, positive

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
        one_of("forgetting", self.forgetting, ("restricted", "exponential"))

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
            raise InputError("guesses_out_of_range", count=p, most=MOST_PARAMETERS)
        guesses = finite_vector("initial_values", initial_values, "unit of each parameter")
        variance = positive("initial_variance", initial_variance, "(unit of the parameter)^2")
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
                "rows_do_not_fit", rows=table.shape, targets=sought.shape, parameters=p
            )
        bad = np.flatnonzero(~(np.isfinite(sought) & np.all(np.isfinite(table), axis=1)))
        if bad.size:
            raise InputError("rows_not_finite", row=int(bad[0]), count=bad.size)
        return after, rls_run(after, table, sought)

    def covariance(self, state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
        """Return P, the inverse of the information."""
        return covariance_in(state)


def _parameters(state: State) -> int:
    return int(recursion_fields(state).parameters)


def _refused(row: Float[np.ndarray, "..."], target: float, parameters: int) -> InputError:
    """Return why a row was not taken."""
    if row.shape != (parameters,):
        return InputError("row_does_not_fit", shape=row.shape, parameters=parameters)
    return InputError("row_not_finite", row=row.tolist(), target=target)
