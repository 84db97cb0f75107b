"""The energy balance of an axis whose inertia is sought: levels, weighted, as rows to regress.

Levels are weighed by the noise that sensors and disturbing forces put into them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.levels import AxisModel, EnergyLevels, energy_levels, summed
from stickslip.estimation.fit.diagnostics import hardly_moves
from stickslip.estimation.fit.least_cost import least_decades
from stickslip.estimation.fit.rows import Regression, least_squares, summarise_motion
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.observation import MotionNoise, motion_noise
from stickslip.estimation.signals.sensor_noise import longest_in_motion
from stickslip.records import AxisLog

_EDGE_PERIODS = 2.0  # of the cutoff, at both ends
_ROWS_PER_PERIOD = 2.0  # of the cutoff: the rate that a signal filtered there can be sampled at
_QUIET = 0.01
"""Noise of the kinetic energy, relative to how much it changes from block to block, above which
blocks are lengthened: it biases an estimated inertia to zero by its square."""
_FEWEST_BLOCKS = 200  # to lengthen blocks for the inertia's sake must not cost the rest
_RATIO_RANGE = (-6.0, 8.0)  # decades of level noise over force disturbance, in variance
_RATIO_GRID = 15  # places on that range where the search begins [-]
_RATIO_TOLERANCE = 1e-5  # of the search [decades]


def block_size(low_pass: LowPass, sampling_time: float) -> int:
    """Return how many samples make one row: what the low-pass leaves can be sampled at that."""
    return max(round(1.0 / (_ROWS_PER_PERIOD * low_pass.cutoff * sampling_time)), 1)


def noise_of_longest(parts: Sequence[AxisLog], low_pass: LowPass) -> MotionNoise:
    """Return the noise on the (first) mass, from the longest stretch in motion."""
    longest = longest_in_motion(parts)
    return motion_noise(
        longest.measured_position, longest.measured_velocity, low_pass, longest.sampling_time
    )


def level_regression(
    parts: Sequence[AxisLog],
    model: AxisModel,
    names: tuple[str, ...],
    low_pass: LowPass,
    *,
    sampling_time: float,
    samples: int,
    notes: tuple[str, ...],
) -> Regression:
    """Return the whitened rows of the energy balance; none for an axis that hardly moves.

    ``parts`` are stretches without gaps, ``names`` those of the parameters, the inertia first;
    sampling time, number of samples and notes (what was done to it before) are those of the whole
    log. Raises InputError if the model has a load and the log does not hold its position.
    """
    T = sampling_time
    noise = noise_of_longest(parts, low_pass)
    levels = [energy_levels(part, model, low_pass, noise, T) for part in parts]
    motion = summarise_motion(
        [part.measured_position for part in parts],
        [level.motion.smooth_velocity for level in levels],
        T,
        (noise.position, noise.smooth_velocity),
    )
    rows = Regression(
        kind=parts[0].kind,
        names=names,
        time=np.zeros(0),
        target=np.zeros(0),
        regressors=np.zeros((0, len(names))),
        regressor_noise=np.zeros(len(names)),
        quantity="energy",
        motion=motion,
        samples=samples,
        notes=notes,
    )
    if hardly_moves(motion):  # an axis at rest dissipates nothing that could be weighed
        return rows
    # A filter has no samples beyond the ends: differentiated velocities are wrong there
    derived = parts[0].measured_velocity is None or (
        model.load_inertia is not None and parts[0].measured_load_velocity is None
    )
    edge = round(_EDGE_PERIODS / (low_pass.cutoff * T)) if derived else 0
    return _with_blocks(rows, levels, low_pass, noise, T, edge)


def _with_blocks(
    rows: Regression,
    levels: Sequence[EnergyLevels],
    low_pass: LowPass,
    noise: MotionNoise,
    sampling_time: float,
    edge: int,
) -> Regression:
    """Return a regression with the whitened means of levels over blocks of samples."""
    T = sampling_time
    shortest = block_size(low_pass, T)
    size = _quiet_block_size(levels, shortest, noise, T)
    blocks = [_block_means(level, size, edge) for level in levels]
    ratio = _likeliest_ratio(blocks)
    white, variances, times = _whitened(blocks, ratio)
    scale = float(np.sqrt(np.mean(variances)))
    # Noise of the kinetic energy of a unit inertia, in the difference of two blocks
    squares = np.concatenate([b.speed_squared for b in blocks])
    column_noise = np.zeros(len(rows.names))
    column_noise[0] = (
        scale
        * _velocity_noise_of_block(noise, size, shortest, T)
        * float(np.sqrt(np.mean(squares / variances)))
    )
    return replace(
        rows,
        time=times,
        target=white[:, 0] * scale,
        regressors=white[:, 1:] * scale,
        regressor_noise=column_noise,
        notes=(
            f"energies averaged over {size} samples; noise of the energy level is taken as "
            f"{ratio:.2g} of what a disturbing force adds in a typical row (maximum "
            "likelihood)",
            *rows.notes,
        ),
    )


@dataclass(frozen=True, kw_only=True)
class _Blocks:
    """Means of the levels over blocks of samples."""

    time: Float[np.ndarray, " b"]  # [s]
    values: Float[np.ndarray, "b c"]  # measured energy, then its regressors
    noise: Float[np.ndarray, " b"]  # variance of the energy [J^2]
    walk: Float[np.ndarray, " b-1"]  # variance that adds up from block to block [J^2]
    disturbance: Float[np.ndarray, " b-1"]  # squared travel from block to block [m^2 or rad^2]
    resting: Bool[np.ndarray, " b-1"]
    speed_squared: Float[np.ndarray, " b-1"]  # sum of both blocks [m^2/s^2 or rad^2/s^2]


def _velocity_noise_of_block(
    noise: MotionNoise, size: int, shortest: int, sampling_time: float
) -> float:
    """Return the standard deviation of the mean velocity of a block [m/s or rad/s].

    ``size`` and ``shortest`` are the samples in it, and in a block as short as the cutoff allows.
    """
    if noise.velocity > 0:
        return noise.smooth_velocity * float(np.sqrt(shortest / size))
    # The mean of differences is the difference of the ends
    ends = float(np.sqrt(2.0)) * noise.smooth_position / (size * sampling_time)
    return min(noise.smooth_velocity, ends)


def _quiet_block_size(
    levels: Sequence[EnergyLevels], shortest: int, noise: MotionNoise, sampling_time: float
) -> int:
    """Return how many samples to average so that the kinetic energy stands out from its noise.

    The kinetic energy of a unit inertia is the first regressor of the levels; ``shortest`` is the
    number of samples in a block as short as the cutoff allows.
    """
    size = shortest
    samples = sum(level.time.size for level in levels)
    energies = [level.regressors[:, 0] for level in levels]
    speed = float(
        np.sqrt(np.mean(np.concatenate([level.motion.smooth_velocity**2 for level in levels])))
    )
    while samples // (2 * size) >= _FEWEST_BLOCKS:
        changes = np.concatenate([energy[size:] - energy[:-size] for energy in energies])
        block_noise = _velocity_noise_of_block(noise, size, shortest, sampling_time)
        if np.sqrt(2.0) * speed * block_noise <= _QUIET * float(np.sqrt(np.mean(changes**2))):
            break
        size *= 2
    return size


def _block_means(levels: EnergyLevels, size: int, edge: int) -> _Blocks:
    """Average over blocks: white noise shrinks, and the balance stays exact as it is linear.

    ``edge`` samples are left out at both ends of the stretch.
    """
    count = (levels.time.size - 2 * edge) // size
    used = slice(edge, edge + count * size)

    def mean(values: Float[np.ndarray, "n ..."]) -> Float[np.ndarray, "b ..."]:
        return values[used].reshape(count, size, *values.shape[1:]).mean(axis=1)

    squares = mean(levels.motion.smooth_velocity**2)
    rest = mean(levels.motion.resting.astype(float))
    disturbance = np.diff(mean(summed(levels.motion.path))) ** 2
    return _Blocks(
        time=mean(levels.time),
        values=mean(np.column_stack([levels.dissipated, levels.regressors])),
        noise=mean(levels.noise) / size,
        walk=np.diff(mean(summed(levels.walk))),
        disturbance=disturbance,
        resting=(rest[1:] + rest[:-1] >= 1.0) | (disturbance == 0.0),
        speed_squared=squares[1:] + squares[:-1],
    )


def _whitened(
    blocks: Sequence[_Blocks], ratio: float
) -> tuple[Float[np.ndarray, "n c"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return whitened rows, their variances and times.

    A disturbing force of unit variance adds the squared travel to the level's variance. At rest the
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


def _likeliest_ratio(blocks: Sequence[_Blocks]) -> float:
    """Return the variance ratio of level noise to disturbance that makes the levels likeliest."""

    def cost(decades: float) -> float:
        white, variances, _ = _whitened(blocks, 10.0**decades)
        values = least_squares(white[:, 1:], white[:, 0])
        squares = float(np.sum((white[:, 0] - white[:, 1:] @ values) ** 2))
        floor = np.finfo(float).eps ** 2 * float(np.sum(white[:, 0] ** 2))
        n = white.shape[0]
        return n * float(np.log(max(squares, floor) / n)) + float(np.sum(np.log(variances)))

    found = least_decades(cost, _RATIO_RANGE, grid=_RATIO_GRID, tolerance=_RATIO_TOLERANCE)
    return 10.0**found


@compiled()
def whiten_levels(
    levels: Float[np.ndarray, "n c"],
    disturbance: Float[np.ndarray, " n-1"],
    noise: Float[np.ndarray, " n"],
) -> tuple[Float[np.ndarray, "n-1 c"], Float[np.ndarray, " n-1"]]:
    """Whiten levels that carry white noise and the sum of a force disturbance.

    The level's error is B(k) + e(k): e white with the variances ``noise``, and B a random walk
    whose steps have the variances ``disturbance``. The Kalman filter of B, run over the measured
    energy and over every regressor alike, leaves innovations that are white, so that ordinary least
    squares on them is generalised least squares on the levels.

    Returns the innovations divided by their standard deviations, and their variances. The first
    level only sets the filter off; it holds the unknown constant.
    """
    n, c = levels.shape
    white = np.empty((n - 1, c))
    variance = np.empty(n - 1)
    b = levels[0].copy()
    p = noise[0]
    for k in range(1, n):
        p += disturbance[k - 1]
        S = p + noise[k]
        K = p / S
        root = np.sqrt(S)
        for j in range(c):
            e = levels[k, j] - b[j]
            white[k - 1, j] = e / root
            b[j] += K * e
        p = K * noise[k]
        variance[k - 1] = S
    return white, variance
