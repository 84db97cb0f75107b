"""Draw a log: position, velocity and effort over time, and its friction over velocity."""

from pathlib import Path

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np

from studies.real_axes.logs import RealLog
from studies.real_axes.reference import TERMS, find_delay, fit_rows

_ROWS_SHOWN = 6000
_DETAIL = 0.06


def draw(real: RealLog, folder: Path) -> Path:
    """Draw one log and return the path of the PNG.

    The left column shows the whole log, the middle one a detail from its middle. The friction on
    the right is the effort without the inertia, gravity and offset terms of the reference fit.
    """
    log, filtered = real.log, real.filtered()
    delay = find_delay(filtered, real.terms)
    rows = filtered.rows(delay)
    fit = fit_rows(rows, real.terms)
    velocity = np.gradient(log.measured_position, log.time)
    figure, axes = plt.subplots(3, 3, figsize=(17, 9), constrained_layout=True)
    middle, half = (log.time[0] + log.time[-1]) / 2, _DETAIL * np.ptp(log.time) / 2
    for column, shown in enumerate(
        (np.ones(len(log), dtype=bool), np.abs(log.time - middle) < half)
    ):
        every = max(1, int(np.count_nonzero(shown)) // _ROWS_SHOWN)
        t = log.time[shown][::every]
        style = "-" if column == 0 else ".-"
        for row, values in enumerate((log.measured_position, velocity, log.effort)):
            axes[row, column].plot(t, values[shown][::every], style, lw=0.6, ms=2, color="C7")
        if log.measured_velocity is not None:
            axes[1, column].plot(
                t, log.measured_velocity[shown][::every], lw=0.6, color="C1", label="measured"
            )
        inside = (rows.time >= t[0]) & (rows.time <= t[-1])
        axes[1, column].plot(rows.time[inside], rows.velocity[inside], lw=0.8, color="C0")
        axes[2, column].plot(rows.time[inside], rows.effort[inside], lw=0.8, color="C0")
        if fit is not None:
            predicted = np.where(rows.moving, fit.predict(rows), np.nan)[inside]
            axes[2, column].plot(rows.time[inside], predicted, lw=0.8, color="C3")
    for axis, name in zip(
        axes[:, 0], ("position", "velocity", f"effort [{real.effort_unit}]"), strict=True
    ):
        axis.set_ylabel(name)
    if fit is not None:
        taken = ("inertia", "offset", "gravity_sine", "gravity_cosine")
        other = sum(
            (fit.values[n] * TERMS[n](rows, {}) for n in fit.terms if n in taken), np.zeros(1)
        )
        residual = np.where(rows.moving, rows.effort - fit.predict(rows), np.nan)
        color = np.where(rows.velocity > 0, "C3", "C0")
        for axis, values, over in (
            (axes[0, 2], rows.effort - other, rows.velocity),
            (axes[1, 2], residual, rows.position),
            (axes[2, 2], residual, rows.time),
        ):
            axis.scatter(over, values, s=2, c=color, alpha=0.5)
        axes[0, 2].set_xlabel("velocity: friction")
        axes[1, 2].set_xlabel("position: residual")
        axes[2, 2].set_xlabel("time: residual")
    steps = np.diff(log.time)
    figure.suptitle(
        f"{real.name}: {real.machine}; {len(log)} samples, steps {1e3 * np.median(steps):.2f} ms "
        f"({1e3 * steps.min():.2f} to {1e3 * steps.max():.1f}), delay {1e3 * delay:.1f} ms"
        + ("" if fit is None else f", residual {100 * fit.relative_residual:.1f} %")
    )
    path = folder / f"{real.name}.png"
    figure.savefig(path, dpi=65)
    plt.close(figure)
    return path
