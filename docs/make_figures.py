"""Make the figures of the documentation and of the README: ``python docs/make_figures.py``."""

from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib as mpl
import numpy as np

from stickslip.friction import CoulombViscousFriction
from stickslip.jobs import demonstrate
from stickslip.plants import FlexibleArm
from stickslip.simulation import SimulatedMotion, simulate

mpl.use("agg")

import matplotlib.pyplot as plt  # the backend is chosen first
from matplotlib.axes import Axes

FIGURES = Path(__file__).parent / "figures"
BLUE, ORANGE, GREEN, GREY = "#0072b2", "#d55e00", "#009e73", "#6b7280"


def style() -> None:
    """Set the look that all figures share."""
    plt.rcParams.update(
        {
            "font.size": 9,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.titlesize": 10,
            "axes.titlelocation": "left",
            "axes.titleweight": "bold",
            "axes.grid": True,
            "grid.color": "#e5e7eb",
            "grid.linewidth": 0.6,
            "legend.frameon": False,
            "figure.dpi": 150,
            "savefig.bbox": "tight",
        }
    )


def save(figure: plt.Figure, name: str) -> None:
    """Write one figure; no date inside, so that the same picture is the same file."""
    FIGURES.mkdir(exist_ok=True)
    figure.savefig(FIGURES / name, metadata={"Software": None})
    plt.close(figure)


def surrogate_motion() -> SimulatedMotion:
    """Simulate the surrogate arm of the demonstration for as long as its first mass moves."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    effort = np.repeat([1.0, -1.0, 0.0], [500, 500, 2000])
    return simulate(arm, effort, sampling_time=0.01)


def shade_rests(axes: Axes, motion: SimulatedMotion) -> None:
    """Shade where the first mass sticks."""
    stuck = np.concatenate(([False], motion.stuck, [False])).astype(int)
    for start, stop in zip(
        np.flatnonzero(np.diff(stuck) == 1), np.flatnonzero(np.diff(stuck) == -1), strict=True
    ):
        axes.axvspan(motion.time[start], motion.time[stop - 1], color="#f3f4f6", lw=0)


def overview() -> None:
    """Draw what the package does in one row: simulate, balance the energy, identify."""
    motion = surrogate_motion()
    with TemporaryDirectory() as folder:
        result = demonstrate(folder).identification
    energy, curve, estimate = result.energy, result.curve, result.estimate
    if energy is None or curve is None or result.truth is None:
        raise RuntimeError("the demonstration could not be identified")
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.1), layout="constrained")

    shade_rests(left, motion)
    left.plot(motion.time, motion.position, color=BLUE, label="driven mass, with friction")
    left.plot(motion.time, motion.load_position, color=ORANGE, lw=1, label="load, on a spring")
    left.set(title="Simulate exactly", xlabel="time [s]", ylabel="position [m]")
    left.legend(loc="lower right")

    shown = energy.time <= motion.time[-1]
    time = energy.time[shown]
    middle.plot(time, energy.input[shown], color=GREY, lw=1, label="input")
    stored = energy.kinetic + energy.potential
    middle.plot(time, stored[shown], color=GREEN, lw=0.5, label="stored (noisy)")
    middle.plot(time, energy.measured_dissipation[shown], color=ORANGE, lw=0.5, label="the rest …")
    middle.plot(
        time, energy.explained_dissipation[shown], color=BLUE, label="… explained by friction"
    )
    middle.set(title="Balance the energy", xlabel="time [s]", ylabel="energy [J]")
    middle.set_ylim(-0.2, 5.4)
    middle.legend(loc="center right", bbox_to_anchor=(1.0, 0.3))

    right.plot(curve.velocity, curve.friction, ".", color="#d1d5db", ms=1.5, label="log")
    right.plot(curve.fitted_velocity, curve.fitted_friction, color=BLUE, label="identified")
    right.fill_between(
        curve.fitted_velocity, curve.band_low, curve.band_high, color=BLUE, alpha=0.2
    )
    speed = curve.fitted_velocity
    truth = result.truth
    right.plot(
        speed,
        truth["coulomb_friction"] * np.sign(speed) + truth["viscous_friction"] * speed,
        "--",
        color=ORANGE,
        lw=1,
        label="truth",
    )
    coulomb, viscous = (
        estimate.parameters[name] for name in ("coulomb_friction", "viscous_friction")
    )
    right.set(
        title=f"Identify: {coulomb.value:.4f} N and {viscous.value:.4f} N s/m",
        xlabel="velocity [m/s]",
        ylabel="friction [N]",
        ylim=(-0.6, 0.6),
    )
    right.legend(loc="upper left")
    save(figure, "overview.png")


def main() -> None:
    """Make every figure."""
    style()
    overview()


if __name__ == "__main__":
    main()
