"""What one position and velocity sensor shows, sample by sample."""

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

__all__ = ["measure_all", "measure_one"]

Vector = NDArray[np.float64]
Settings = tuple[float, float, float, float, float]


@compiled()
def measure_one(
    settings: Settings, last: float, x: float, v: float, noise_x: float, noise_v: float
) -> tuple[float, float]:
    """Return the position and velocity sample of one instant.

    Parameters
    ----------
    settings
        (sigma_w, sigma_v, encoder step, 1 for velocity from differences else 0, T).
    last
        The position sample before.
    x, v
        True position and velocity.
    noise_x, noise_v
        Standard normal numbers.
    """
    sigma_w, sigma_v, step, differences, T = settings
    position = x + sigma_w * noise_x
    if step > 0.0:
        position = step * np.floor(position / step + 0.5)
    velocity = (position - last) / T if differences > 0.0 else v + sigma_v * noise_v
    return position, velocity


@compiled()
def measure_all(
    settings: Settings, delay: int, x: Vector, v: Vector, noise_x: Vector, noise_v: Vector
) -> tuple[Vector, Vector]:
    """Return the samples of a whole run, shape (n+1,) each, late by ``delay`` samples.

    At time 0 a velocity from differences is 0: the axis is taken to have been there before.
    """
    n = x.size
    position, velocity = np.empty(n), np.empty(n)
    for k in range(n):
        last = position[k - 1] if k > 0 else 0.0
        position[k], velocity[k] = measure_one(settings, last, x[k], v[k], noise_x[k], noise_v[k])
        if k == 0 and settings[3] > 0.0:
            velocity[k] = 0.0
    if delay > 0:
        for k in range(n - 1, -1, -1):
            seen = max(k - delay, 0)
            position[k], velocity[k] = position[seen], velocity[seen]
    return position, velocity
