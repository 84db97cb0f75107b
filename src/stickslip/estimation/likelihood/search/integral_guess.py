"""A quick first guess from the balance of momenta, integrated once more: no filter, short logs."""

from itertools import pairwise

import numpy as np
from jaxtyping import Float

from stickslip.records import AxisLog

__all__ = ["integral_guess"]

_REACHES = (1, 2, 4, 8, 16, 32)
"""Samples to each side that a velocity's sign is taken over: the one that explains most is kept."""

_NAMES: tuple[str, ...] = ("mass", "viscous_friction", "coulomb_friction", "offset")
_PIECES = 16
_LEAST_PIECE = 100  # samples
_STILL = 4.0
"""Standard deviations of a velocity's noise below which the axis counts as at rest."""

_STEPS = 1.5  # of an encoder, the same
_MEDIAN = 0.6745  # of the magnitude of a standard normal variable


def integral_guess(log: AxisLog) -> dict[str, float]:
    """Return mass, viscous and Coulomb friction and offset [SI], alike in both directions.

    The balance of forces is integrated twice over each piece of the log:
    m x + c ∫x + f_c ∬sgn v + f_0 ∬1 = ∬u + a + b t, with integrals over motion only, where a and b
    are of that piece. It is linear in what is sought, positions stand in it as they are measured,
    and the only derivative is in a sign. A disturbing force adds up over a piece only.

    Parameters
    ----------
    log
        Uniformly sampled but for gaps.

    Returns
    -------
    Values by name, the mass as ``"mass"``; empty if nothing moves, or if no mass or a negative
    friction would come out. What the log does not separate, such as Coulomb friction and offset
    while all motion is one way, is shared among them.
    """
    best: dict[str, float] = {}
    least = np.inf
    for reach in _REACHES:
        values, unexplained = _solved(log, reach)
        if values is not None and unexplained < least:
            best, least = dict(zip(_NAMES, values.tolist(), strict=True)), unexplained
    return best


def _solved(log: AxisLog, reach: int) -> tuple[Float[np.ndarray, " 4"] | None, float]:
    """Return the four values, None if they make no axis, and the sum of squares left over."""
    grams, sums, total = np.zeros((4, 4)), np.zeros(4), 0.0
    for part in log.segments():
        if len(part) < 4 * reach + 2:
            continue
        pieces = max(min(_PIECES, len(part) // _LEAST_PIECE), 1)
        bounds = np.linspace(0, len(part), pieces + 1).astype(int).tolist()
        position = part.measured_position
        sign = _sign(position, reach)
        for start, stop in pairwise(bounds):
            rows, target = _rows(
                position[start:stop], part.effort[start:stop], sign[start:stop], log.sampling_time
            )
            grams += rows.T @ rows
            sums += rows.T @ target
            total += float(target @ target)
    scale = np.sqrt(np.diag(grams))
    if np.any(scale == 0.0):
        return None, np.inf
    values = np.linalg.lstsq(grams / np.outer(scale, scale), sums / scale, rcond=1e-10)[0] / scale
    if not np.all(np.isfinite(values)) or values[0] <= 0.0 or np.min(values[1:3]) < 0.0:
        return None, np.inf
    # Over the mass, as errors are those of positions: a heavy axis would leave more forces over.
    left = total - 2.0 * float(values @ sums) + float(values @ grams @ values)
    return values, left / float(values[0]) ** 2


def _sign(position: Float[np.ndarray, " n"], reach: int) -> Float[np.ndarray, " n"]:
    """Return the direction of motion, 0 at rest."""
    change = np.zeros(position.size)
    change[reach:-reach] = position[2 * reach :] - position[: -2 * reach]
    noise = float(np.median(np.abs(np.diff(position, 3)))) / _MEDIAN / np.sqrt(20.0)
    steps = np.abs(np.diff(position))
    step = float(np.min(steps[steps > 0.0], initial=np.inf))
    least = _STILL * np.sqrt(2.0) * noise
    if np.isfinite(step) and np.median(steps) == 0.0:  # an encoder that mostly shows the same
        least = max(least, _STEPS * step)
    moving = np.abs(change) > least
    return np.where(moving, np.sign(change), 0.0)


def _rows(
    position: Float[np.ndarray, " n"],
    effort: Float[np.ndarray, " n"],
    sign: Float[np.ndarray, " n"],
    sampling_time: float,
) -> tuple[Float[np.ndarray, "n 4"], Float[np.ndarray, " n"]]:
    """Return the twice integrated balance of a piece, with a line in time taken out."""
    T = sampling_time
    moving = np.abs(sign)
    here = position - position[0]
    columns = np.column_stack([effort * moving, sign, moving])
    # Forces are held over a sample: velocity by one sum, position by that of means of velocities.
    once = np.zeros((effort.size, 3))
    once[1:] = T * np.cumsum(columns[:-1], axis=0)
    twice = np.zeros_like(once)
    twice[1:] = T * np.cumsum(0.5 * (once[1:] + once[:-1]), axis=0)
    way = np.zeros(effort.size)
    way[1:] = T * np.cumsum(0.5 * (here[1:] + here[:-1]))
    whole = np.column_stack([here, way, twice[:, 1], twice[:, 2], twice[:, 0]])
    time = np.arange(effort.size) * T
    line = np.linalg.qr(np.column_stack([np.ones(effort.size), time]))[0]
    kept = whole - line @ (line.T @ whole)
    return kept[:, :4], kept[:, 4]
