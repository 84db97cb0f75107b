"""Minimum of a cost over one number on a logarithmic scale, such as a variance."""

from collections.abc import Callable

import numpy as np
from scipy.optimize import minimize_scalar


def least_decades(
    cost: Callable[[float], float], decades: tuple[float, float], *, grid: int, tolerance: float
) -> float:
    """Return the decimal logarithm at which a cost is least: on a grid, then between its points.

    Likelihoods over many decades can have several maxima, so that a search from one point is not
    enough. ``decades`` are the bounds, ``tolerance`` is that of the result, both as decimal
    logarithms.
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
