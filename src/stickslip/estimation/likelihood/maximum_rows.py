"""The likelihood around its maximum as a linear problem, for intervals and verdicts."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.rows import Regression, summarise_motion
from stickslip.estimation.likelihood.axis_parameters import AxisParameters
from stickslip.estimation.likelihood.noise_model import whitened
from stickslip.estimation.likelihood.search.maximum import Maximum
from stickslip.estimation.likelihood.windows import Window
from stickslip.estimation.signals.sensor_noise import position_noise
from stickslip.records import AxisKind

__all__ = ["rows_at"]

LARGEST_CORRELATION = 0.2
"""Of successive errors after whitening, beyond which they are not those of the sensors alone: a
force that the model lacks adds up in them, and biases the parameters."""

_ROUNDING = 1e-6  # of the range: errors that small have the colour of rounding

_SMALLEST_RATIO = 1e-7
_LARGEST_SHARE = 2.0
"""A combination of columns is determined by the log if its standard deviation is less than half of
what the whole motion would make of the strongest one."""


def rows_at(
    windows: Sequence[Window],
    parameters: AxisParameters,
    maximum: Maximum,
    *,
    kind: AxisKind,
    samples: int,
    notes: tuple[str, ...],
) -> Regression:
    """Return errors and their derivatives at the likeliest parameters, whitened, in time's order.

    What the first states explain is projected out, so that the Gramian of the rows is the Fisher
    information of the parameters with the states unknown (Schur complement). All rows are in the
    unit of the position.

    Parameters
    ----------
    windows, parameters
        What was searched.
    maximum
        What was found.
    kind
        ``"linear"`` or ``"rotary"``.
    samples
        Of the log.
    notes
        What a user should know, one sentence each.
    """
    p = maximum.values.size
    scale = maximum.noise[0].std  # the position's
    blocks: list[Float[np.ndarray, "n columns"]] = []
    velocities: list[Float[np.ndarray, " n"]] = []
    effect = 0.0
    sums = np.zeros((len(maximum.noise), 2))
    for window, state in zip(windows, maximum.states, strict=True):
        errors, changes = window.linearised(parameters, maximum.values, state)
        parts: list[Float[np.ndarray, "n columns"]] = []
        for c, (error, change, of, time) in enumerate(
            zip(errors, changes, maximum.noise, window.row_times(), strict=True)
        ):
            rows = whitened(np.column_stack([error, change]), of.correlation) * (scale / of.std)
            parts.append(np.column_stack([time, rows]))
            if np.sqrt(np.mean(error**2)) > _ROUNDING * np.ptp(window.channels[c].readings):
                sums[c] += rows[1:, 0] @ rows[:-1, 0], rows[:, 0] @ rows[:, 0]
        stacked = np.concatenate(parts)
        local = stacked[:, 2 + p :]
        local = local[:, np.any(local != 0.0, axis=0)]
        basis = np.linalg.qr(local)[0] if local.shape[1] else local
        kept = stacked[:, 1 : 2 + p] - basis @ (basis.T @ stacked[:, 1 : 2 + p])
        blocks.append(np.column_stack([stacked[:, 0], kept]))
        motion = window.simulated(parameters, maximum.values, state)
        velocities.append(motion.velocity)
        shown = window.channels[0].errors(np.full(window.time.size, np.mean(motion.position)))
        effect += float(np.sum(whitened(shown, maximum.noise[0].correlation) ** 2))
    correlation = float(np.max(np.abs(sums[:, 0]) / np.where(sums[:, 1] > 0, sums[:, 1], np.inf)))
    biased = correlation > LARGEST_CORRELATION
    if biased:
        notes = (
            *notes,
            f"successive errors are still correlated ({correlation:.2g}) when a first-order "
            "autoregression is taken out: a disturbing force, or another law of friction, moves "
            "the axis besides what is modelled, or the effort acts later than is looked for "
            "(largest_delay, or --largest-delay of stickslip compare)",
        )
    rows = np.concatenate(blocks)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    regressors = rows[:, 2:]
    target = rows[:, 1] + regressors @ maximum.values
    noise = float(np.sqrt(np.mean(rows[:, 1] ** 2)))
    size = float(np.linalg.norm(target))
    ratio = _LARGEST_SHARE * noise / size if size > 0 else 1.0
    positions = [window.channels[0].readings for window in windows]
    return Regression(
        kind=kind,
        names=parameters.names,
        time=rows[:, 0],
        target=target,
        regressors=regressors,
        regressor_noise=np.zeros(p),
        quantity="position",
        motion=summarise_motion(
            positions,
            velocities,
            windows[0].sampling_time,
            (max(position_noise(x) for x in positions), 0.0),
        ),
        samples=samples,
        notes=notes,
        effect=float(np.sqrt(effect)),
        smallest_singular_ratio=max(ratio, _SMALLEST_RATIO),
        resolution=0.0,
        biased=biased,
    )
