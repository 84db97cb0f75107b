"""Where a cost of one number is least, such as a variance that makes a log likeliest."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar


def least_decades(
    cost: Callable[[float], float], decades: tuple[float, float], *, grid: int, tolerance: float
) -> float:
    """Return the decades at which a cost is least: on a grid, then between its points.

    Likelihoods have more than one hump over many decades, so that a search from one place is not
    enough. The cost is of a decimal logarithm.
    """
    low, high = decades
    places = np.linspace(low, high, grid)
    best = float(places[int(np.argmin([cost(float(place)) for place in places]))])
    step = float(places[1] - places[0])
    found = minimize_scalar(
        cost,
        bounds=(max(best - step, low), min(best + step, high)),
        method="bounded",
        options={"xatol": tolerance},
    )
    return float(found.x)
