"""Linear programmes solved by HiGHS, with every status looked at."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records import StickslipError

__all__ = ["Optimum", "minimise"]

_SOLVED, _INFEASIBLE = 0, 2
_FEASIBILITY = 1e-10  # the smallest that HiGHS takes; constraints are scaled to about 1
_METHODS = (
    # Without presolve the dual simplex is fastest by far on the small dense programmes of here.
    ("highs-ds", False),
    ("highs-ds", True),
    ("highs-ipm", True),
)


@dataclass(frozen=True, kw_only=True)
class Optimum:
    """What solves a linear programme, and the prices of its constraints.

    ``at_most_price`` is not positive: by how much the cost changes with what is allowed.
    """

    x: Float[np.ndarray, " n"]
    cost: float
    equal_price: Float[np.ndarray, " e"]
    at_most_price: Float[np.ndarray, " r"]


def minimise(
    cost: Float[np.ndarray, " n"],
    *,
    at_most: tuple[Float[np.ndarray, "r n"], Float[np.ndarray, " r"]],
    equal: tuple[Float[np.ndarray, "e n"], Float[np.ndarray, " e"]],
    bounds: Float[np.ndarray, "n 2"],
) -> Optimum | None:
    """Minimise a linear cost; None if no point meets the constraints.

    Only a verdict counts, optimal or infeasible. Anything else (a numerical difficulty, which
    HiGHS reports for some infeasible programmes too) goes on to the next method.

    Raises
    ------
    StickslipError
        If no method comes to a verdict.
    """
    from scipy import optimize

    linprog: Any = optimize.linprog  # whose stubs know bounds as a list of pairs only

    said: list[str] = []
    for method, presolve in _METHODS:
        options = {
            "presolve": presolve,
            "primal_feasibility_tolerance": _FEASIBILITY,
            "dual_feasibility_tolerance": _FEASIBILITY,
        }
        result = linprog(
            cost,
            A_ub=at_most[0],
            b_ub=at_most[1],
            A_eq=equal[0],
            b_eq=equal[1],
            bounds=bounds,
            method=method,
            options=options,
        )
        if result.status == _INFEASIBLE:
            return None
        if result.status == _SOLVED:
            return Optimum(
                x=result.x,
                cost=float(result.fun),
                equal_price=result.eqlin.marginals,
                at_most_price=result.ineqlin.marginals,
            )
        said.append(f"{method}: status {result.status}, {result.message}")
    raise StickslipError("HiGHS found neither an optimum nor a contradiction: " + "; ".join(said))
