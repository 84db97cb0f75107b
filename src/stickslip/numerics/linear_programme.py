"""Linear programmes solved by HiGHS, with every status looked at."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.errors import StickslipError

_SOLVED, _INFEASIBLE = 0, 2
_FEASIBILITY = 1e-10  # the smallest that HiGHS takes; constraints are scaled to about 1
_METHODS = (
    # Without presolve the dual simplex is fastest by far on the small dense programmes of here.
    ("highs-ds", False),
    ("highs-ds", True),
    ("highs-ipm", True),
)


class Optimum(NamedTuple):
    """Solution of a linear programme, and the prices of its constraints."""

    x: Float[np.ndarray, " n"]
    cost: float
    equal_price: Float[np.ndarray, " e"]
    at_most_price: Float[np.ndarray, " r"]  # change of the cost with what is allowed, never above 0


def minimise(
    cost: Float[np.ndarray, " n"],
    *,
    at_most: tuple[Float[np.ndarray, "r n"], Float[np.ndarray, " r"]],
    equal: tuple[Float[np.ndarray, "e n"], Float[np.ndarray, " e"]],
    bounds: Float[np.ndarray, "n 2"],
) -> Optimum | None:
    """Minimise a linear cost; None if no point meets the constraints.

    Only a verdict counts, optimal or infeasible. Anything else (a numerical difficulty, which
    HiGHS reports for some infeasible programmes too) is followed by the next method. If none comes
    to a verdict, a StickslipError is raised.
    """
    from scipy import optimize

    linprog: Any = optimize.linprog  # whose stubs have bounds as a list of pairs only

    failures: list[str] = []
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
            prices = result.eqlin.marginals, result.ineqlin.marginals
            return Optimum(result.x, float(result.fun), *prices)
        failures.append(f"{method}: status {result.status}, {result.message}")
    raise StickslipError("programme_unsolved", failures=failures)
