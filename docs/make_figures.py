"""Make the figures of the documentation and of the README: ``python docs/make_figures.py``."""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal

import matplotlib as mpl
import numpy as np
from rich.progress import track
from scipy import signal

from stickslip.estimation import EnergyEstimator, IdimLeastSquares
from stickslip.friction import CoulombViscousFriction
from stickslip.jobs import demonstrate
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import Sensors, SimulatedMotion, simulate

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


def sampling_bias() -> None:
    """Draw how far the printed and the exact sums miss the truth, without any noise."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    intervals = np.array([0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1])
    figure, axes = plt.subplots(1, 2, figsize=(8, 3), sharey=True, layout="constrained")
    variants: tuple[tuple[Literal["report", "held_effort"], str, str], ...] = (
        ("report", ORANGE, "printed sums"),
        ("held_effort", BLUE, "exact under a held input"),
    )
    for variant, color, label in variants:
        estimator = EnergyEstimator(
            inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False, variant=variant
        )
        errors: list[tuple[float, ...]] = []
        for T in intervals:
            held = round(5.0 / T)
            effort = np.repeat([1.0, -1.0, 0.0], [held, held, 4 * held])
            estimate = estimator.fit(Sensors().measure(simulate(arm, effort, sampling_time=T)))
            errors.append(
                tuple(
                    100.0 * abs(estimate.value(name) / 0.1 - 1.0)
                    for name in ("coulomb_friction", "viscous_friction")
                )
            )
        for axis, error in zip(axes, np.array(errors).T, strict=True):
            axis.loglog(intervals, error, "o-", ms=3, color=color, label=label)
    for axis, title in zip(axes, ("Coulomb friction", "viscous friction"), strict=True):
        axis.set(title=title, xlabel="sampling time [s]")
    axes[0].set_ylabel("error without noise [%]")
    axes[0].legend(loc="upper left")
    save(figure, "sampling-bias.png")


def coverage() -> None:
    """Draw how often a 95 % interval holds the truth when a disturbance is slow."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=20.0, viscous_friction=200.0)
    stage = SingleMass(mass=95.0, friction=law)
    time = np.arange(0.0, 20.0, 0.001)
    effort = 70.0 * np.sin(2.0 * time) + 60.0 * np.sin(7.0 * time)
    sensors = Sensors(position_noise=1e-6, velocity="none")
    generator = np.random.default_rng(1)
    runs, names = 200, ("mass", "viscous_friction", "coulomb_friction")
    correlations = np.array([0.0, 0.9, 0.97, 0.99, 0.997, 0.999])
    estimators = {"energy": EnergyEstimator(), "idim-ls": IdimLeastSquares()}
    truth = np.array([95.0, 200.0, 20.0])
    honest, classical = (
        {name: np.zeros(correlations.size) for name in estimators} for _ in range(2)
    )
    for k, rho in enumerate(track(correlations, "coverage of the intervals")):
        for _ in range(runs):
            white = generator.standard_normal(time.size) * np.sqrt(1.0 - rho**2)
            disturbance = signal.lfilter([1.0], [1.0, -rho], white)
            log = sensors.measure(
                simulate(stage, effort + disturbance, sampling_time=0.001), generator
            )
            log = replace(log, effort=np.concatenate([effort, effort[-1:]]))
            for name, estimator in estimators.items():
                found = estimator.fit(log)
                error = np.array([found.value(parameter) for parameter in names]) - truth
                bounds = np.array([found.parameters[parameter].ci95 for parameter in names])
                inside = (bounds[:, 0] <= truth) & (truth <= bounds[:, 1])
                std = np.array([found.diagnostics.classical_std[parameter] for parameter in names])
                honest[name][k] += np.mean(inside) / runs
                classical[name][k] += np.mean(np.abs(error) <= 1.96 * std) / runs
    figure, axes = plt.subplots(figsize=(5, 3), layout="constrained")
    place = np.arange(correlations.size)
    axes.axhline(95.0, color=GREY, lw=0.8)
    for name, color in (("energy", BLUE), ("idim-ls", ORANGE)):
        axes.plot(place, 100 * honest[name], "o-", ms=3, color=color, label=f"{name}, given")
        axes.plot(place, 100 * classical[name], "o:", ms=3, color=color, label=f"{name}, classical")
    axes.set(
        title="How often a 95 % interval holds the truth",
        xlabel="correlation of a disturbing force from sample to sample (1 ms)",
        ylabel="coverage [%]",
        ylim=(0, 105),
    )
    axes.set_xticks(place, [f"{rho:g}" for rho in correlations])
    axes.legend(loc="lower left")
    save(figure, "coverage.png")


def main() -> None:
    """Make every figure."""
    style()
    overview()
    sampling_bias()
    coverage()


if __name__ == "__main__":
    main()
