"""Figure of a recorded log, to check that it agrees with its case."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from studies.mismatch.axes import motion_of, physical
from studies.mismatch.cases import CASES, Recorded


def draw(recorded: Recorded, file: Path) -> None:
    """Write a PNG of position, velocity and effort of a log, and of friction over velocity."""
    log, run, plant = recorded.log, recorded.run, physical(recorded.setup)
    figure = Figure(figsize=(15, 11), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplot_mosaic([["x", "x"], ["v", "v"], ["u", "u"], ["zoom", "curve"]])
    motion = motion_of(recorded.setup, run.time)
    axes["x"].plot(run.time, motion.position, color="tab:gray", label="reference")
    axes["x"].plot(log.time, log.measured_position, label="logged")
    axes["v"].plot(run.time, run.velocity, label="true")
    if log.measured_velocity is not None:
        axes["v"].plot(log.time, log.measured_velocity, linewidth=0.7, label="logged")
    axes["u"].plot(log.time, log.effort, color="tab:orange", linewidth=0.7, label="logged")
    axes["u"].plot(run.time, run.effort, color="tab:blue", linewidth=0.7, label="acting")
    axes["u"].axhline(plant.limit, color="tab:red", linewidth=0.7)
    axes["u"].axhline(-plant.limit, color="tab:red", linewidth=0.7)
    moving = np.flatnonzero(np.abs(run.velocity) > 0.02 * recorded.setup.top_speed)
    start = run.time[moving[0]] if moving.size else 0.0
    part = (run.time > start - 0.1) & (run.time < start + 0.9)
    axes["zoom"].plot(run.time[part], run.velocity[part])
    axes["zoom"].set(xlabel="time [s]", ylabel="true velocity, first move")
    # Over each sample, in which the effort is held.
    mean = 0.5 * (run.velocity[:-1] + run.velocity[1:])
    acceleration = np.diff(run.velocity) / np.diff(run.time)
    friction = run.effort[:-1] - recorded.setup.mass * acceleration
    axes["curve"].plot(mean, friction, ".", markersize=1, label="effort - m a")
    top = recorded.speed_range[1]
    for side in (-1, 1):
        velocity = side * np.linspace(1e-3 * top, top, 300)
        axes["curve"].plot(velocity, recorded.curve(velocity), color="tab:red")
    axes["curve"].set(xlabel="velocity", ylabel="friction")
    scale = 3.0 * float(np.max(np.abs(recorded.curve(np.array([-top, top])))))
    axes["curve"].set_ylim(-scale, scale)
    for name, label in (("x", "position"), ("v", "velocity"), ("u", "effort")):
        axes[name].set(ylabel=f"{label} [{log.unit(label)}]")
        axes[name].legend(loc="upper right")
    case = CASES[log.name.split()[0]]
    figure.suptitle(f"{log.name}: {case.description}; m = {recorded.setup.mass:.3g}")
    figure.savefig(file, dpi=60)
