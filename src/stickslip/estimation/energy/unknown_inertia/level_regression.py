"""The energy balance of an axis whose mass is sought: levels, weighted, as rows to regress."""

from collections.abc import Sequence

import numpy as np

from stickslip.estimation.energy.levels import AxisModel, energy_levels
from stickslip.estimation.energy.unknown_inertia.level_weighting import (
    block_means,
    likeliest_ratio,
    quiet_block_size,
    velocity_noise_of_block,
    whitened,
)
from stickslip.estimation.fit.diagnostics import hardly_moves
from stickslip.estimation.fit.rows import MotionSummary, Regression, summarise_motion
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.observation import MotionNoise, motion_noise
from stickslip.estimation.signals.sensor_noise import longest_in_motion
from stickslip.records import AxisLog

__all__ = ["block_size", "level_regression", "noise_of_longest"]

_EDGE_PERIODS = 2.0  # of the cutoff, at both ends
_ROWS_PER_PERIOD = 2.0  # of the cutoff: the rate that a signal filtered there can be sampled at


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
    """Return the whitened rows of the energy balance.

    Parameters
    ----------
    parts
        Stretches of a log without gaps.
    model
        What is known of the axis; its inertia is not.
    names
        Of the parameters, the inertia first.
    low_pass
        What smooths what is noisy.
    sampling_time
        Of the whole log [s].
    samples
        Of the whole log.
    notes
        What was done to the log before.

    Raises
    ------
    InputError
        If the model has a load and the log does not hold its position.
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
    if hardly_moves(motion):
        return _nothing(parts, names, motion, samples, notes)
    # A filter knows nothing beyond the ends, so velocities made by one are wrong there
    derived = parts[0].measured_velocity is None or (
        model.load_inertia is not None and parts[0].measured_load_velocity is None
    )
    edge = round(_EDGE_PERIODS / (low_pass.cutoff * T)) if derived else 0
    shortest = block_size(low_pass, T)
    size = quiet_block_size(levels, shortest, noise, T)
    blocks = [block_means(level, size, edge) for level in levels]
    ratio = likeliest_ratio(blocks)
    white, variances, times = whitened(blocks, ratio)
    scale = float(np.sqrt(np.mean(variances)))
    # Noise of the kinetic energy of a unit inertia, in the difference of two blocks
    squares = np.concatenate([b.speed_squared for b in blocks])
    column_noise = np.zeros(len(names))
    column_noise[0] = (
        scale
        * velocity_noise_of_block(noise, size, shortest, T)
        * float(np.sqrt(np.mean(squares / variances)))
    )
    return Regression(
        kind=parts[0].kind,
        names=names,
        time=times,
        target=white[:, 0] * scale,
        regressors=white[:, 1:] * scale,
        regressor_noise=column_noise,
        quantity="energy",
        motion=motion,
        samples=samples,
        notes=(
            f"energies averaged over {size} samples; noise of the energy level is taken as "
            f"{ratio:.2g} of what a disturbing force adds in a typical row (maximum "
            "likelihood)",
            *notes,
        ),
    )


def _nothing(
    parts: Sequence[AxisLog],
    names: tuple[str, ...],
    motion: MotionSummary,
    samples: int,
    notes: tuple[str, ...],
) -> Regression:
    """Return no rows: an axis at rest dissipates nothing that could be weighed."""
    return Regression(
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
