"""Weigh energy levels by the noise that sensors and disturbing forces put into them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.energy.balance import whiten_levels
from stickslip.estimation.energy.levels import EnergyLevels, summed
from stickslip.estimation.fit.least_cost import least_decades
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.signals.observation import MotionNoise

__all__ = [
    "LevelBlocks",
    "block_means",
    "likeliest_ratio",
    "quiet_block_size",
    "velocity_noise_of_block",
    "whitened",
]

QUIET = 0.01
"""Noise of the kinetic energy, relative to how much it changes from block to block, above which
blocks are lengthened: it biases an estimated inertia to zero by its square."""

_FEWEST_BLOCKS = 200  # to lengthen blocks for the inertia's sake must not cost the rest
_RATIO_RANGE = (-6.0, 8.0)  # decades of level noise over force disturbance, in variance
_RATIO_GRID = 15
_RATIO_TOLERANCE = 1e-5


@dataclass(frozen=True, kw_only=True)
class LevelBlocks:
    """Means of the levels over blocks of samples: measured energy, then its regressors."""

    time: Float[np.ndarray, " b"]
    values: Float[np.ndarray, "b c"]
    noise: Float[np.ndarray, " b"]
    walk: Float[np.ndarray, " b-1"]
    disturbance: Float[np.ndarray, " b-1"]
    resting: Bool[np.ndarray, " b-1"]
    speed_squared: Float[np.ndarray, " b-1"]


def velocity_noise_of_block(
    noise: MotionNoise, size: int, shortest: int, sampling_time: float
) -> float:
    """Return the standard deviation of the mean velocity of a block [m/s or rad/s].

    Parameters
    ----------
    noise
        Of the samples.
    size, shortest
        Samples in the block, and in one as short as the low-pass leaves sense in.
    sampling_time
        [s].
    """
    if noise.velocity > 0:
        return noise.smooth_velocity * float(np.sqrt(shortest / size))
    # The mean of differences is the difference of the ends
    ends = float(np.sqrt(2.0)) * noise.smooth_position / (size * sampling_time)
    return min(noise.smooth_velocity, ends)


def quiet_block_size(
    levels: Sequence[EnergyLevels], shortest: int, noise: MotionNoise, sampling_time: float
) -> int:
    """Return how many samples to average so that the kinetic energy stands out from its noise.

    Parameters
    ----------
    levels
        With the kinetic energy of a unit inertia as their first regressor.
    shortest
        Samples in a block as short as the low-pass leaves sense in.
    noise
        Of the motion.
    sampling_time
        [s].
    """
    size = shortest
    samples = sum(level.time.size for level in levels)
    energies = [level.regressors[:, 0] for level in levels]
    speed = float(
        np.sqrt(np.mean(np.concatenate([level.motion.smooth_velocity**2 for level in levels])))
    )
    while samples // (2 * size) >= _FEWEST_BLOCKS:
        changes = np.concatenate([energy[size:] - energy[:-size] for energy in energies])
        block_noise = velocity_noise_of_block(noise, size, shortest, sampling_time)
        if np.sqrt(2.0) * speed * block_noise <= QUIET * float(np.sqrt(np.mean(changes**2))):
            break
        size *= 2
    return size


def block_means(levels: EnergyLevels, size: int, edge: int) -> LevelBlocks:
    """Average over blocks: white noise shrinks, and the balance stays exact as it is linear.

    Parameters
    ----------
    levels
        Of one stretch.
    size
        Samples in a block.
    edge
        Samples left out at both ends.
    """
    count = (levels.time.size - 2 * edge) // size
    used = slice(edge, edge + count * size)

    def mean(values: Float[np.ndarray, "n c"]) -> Float[np.ndarray, "b c"]:
        return values[used].reshape(count, size, -1).mean(axis=1)

    columns = np.column_stack([levels.dissipated, levels.regressors])
    squares = mean(levels.motion.smooth_velocity[:, None] ** 2)[:, 0]
    rest = mean(levels.motion.resting[:, None].astype(float))[:, 0]
    disturbance = np.diff(mean(summed(levels.motion.path[:, None]))[:, 0]) ** 2
    return LevelBlocks(
        time=mean(levels.time[:, None])[:, 0],
        values=mean(columns),
        noise=mean(levels.noise[:, None])[:, 0] / size,
        walk=np.diff(mean(summed(levels.walk[:, None]))[:, 0]),
        disturbance=disturbance,
        resting=(rest[1:] + rest[:-1] >= 1.0) | (disturbance == 0.0),
        speed_squared=squares[1:] + squares[:-1],
    )


def whitened(
    blocks: Sequence[LevelBlocks], ratio: float
) -> tuple[Float[np.ndarray, "n c"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return whitened rows, their variances and times.

    A disturbing force of unit variance adds the squared way to the level's variance. At rest the
    friction force is unknown whatever the disturbance, so that a rest counts as a typical row.
    """
    typical = float(np.mean(np.concatenate([b.disturbance for b in blocks])))
    level = float(np.mean(np.concatenate([b.noise for b in blocks])))
    rows: list[Float[np.ndarray, "n c"]] = []
    variances: list[Float[np.ndarray, " n"]] = []
    for b in blocks:
        steps = np.where(b.resting, np.maximum(b.disturbance, typical), b.disturbance)
        noise = ratio * (b.noise / level if level > 0 else np.ones(b.noise.size))
        walk = ratio * (b.walk / level if level > 0 else np.zeros(b.walk.size))
        white, variance = whiten_levels(b.values, steps / typical + walk, noise)
        rows.append(white)
        variances.append(variance)
    return (
        np.concatenate(rows),
        np.concatenate(variances),
        np.concatenate([b.time[1:] for b in blocks]),
    )


def likeliest_ratio(blocks: Sequence[LevelBlocks]) -> float:
    """Return the variance ratio of level noise to disturbance that makes the levels likeliest."""

    def cost(decades: float) -> float:
        white, variances, _ = whitened(blocks, 10.0**decades)
        values = least_squares(white[:, 1:], white[:, 0])
        squares = float(np.sum((white[:, 0] - white[:, 1:] @ values) ** 2))
        floor = np.finfo(float).eps ** 2 * float(np.sum(white[:, 0] ** 2))
        n = white.shape[0]
        return n * float(np.log(max(squares, floor) / n)) + float(np.sum(np.log(variances)))

    found = least_decades(cost, _RATIO_RANGE, grid=_RATIO_GRID, tolerance=_RATIO_TOLERANCE)
    return 10.0**found
