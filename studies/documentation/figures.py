"""Make the figures of the README and of energies: ``python -m studies.documentation.figures``."""

from dataclasses import replace
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.axes import Axes
from rich.progress import track
from scipy import signal

from stickslip.estimation import EnergyEstimator, IdimLeastSquares, PublishedEnergyEstimator
from stickslip.estimation.energy.known_inertia.free_friction import DrivenMotion, FreeAxis
from stickslip.estimation.energy.levels import AxisModel
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import Sensors, SimulatedMotion, simulate
from stickslip.tasks import demonstrate
from stickslip.tasks.surrogate import (
    MASS_1,
    MASS_2,
    POSITION_NOISE,
    SAMPLING_TIME,
    STIFFNESS,
    TRUTH,
    VELOCITY_NOISE,
    bang_bang_effort,
    surrogate_arm,
    surrogate_sensors,
)
from studies.documentation.style import BLUE, GREEN, GREY, ORANGE, no_arguments, save, style


def surrogate_motion() -> SimulatedMotion:
    """Simulate the surrogate arm of the demonstration for as long as its first mass moves."""
    effort = bang_bang_effort(SAMPLING_TIME)[:3000]
    return simulate(surrogate_arm(), effort, sampling_time=SAMPLING_TIME)


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
    left.set(title="Simulated motion", xlabel="time [s]", ylabel="position [m]")
    left.legend(loc="lower right")

    shown = energy.time <= motion.time[-1]
    time = energy.time[shown]
    middle.plot(time, energy.input[shown], color=GREY, lw=1, label="input")
    stored = energy.kinetic + energy.potential
    middle.plot(time, stored[shown], color=GREEN, lw=0.5, label="stored (noisy)")
    middle.plot(
        time, energy.measured_dissipation[shown], color=ORANGE, lw=0.5, label="dissipated, measured"
    )
    middle.plot(
        time, energy.explained_dissipation[shown], color=BLUE, label="dissipated, fitted friction"
    )
    middle.set(title="Energy balance", xlabel="time [s]", ylabel="energy [J]")
    middle.set_ylim(-0.2, 5.4)
    middle.legend(loc="upper right")

    right.plot(curve.velocity, curve.friction, ".", color="#d1d5db", ms=1.5, label="log")
    right.plot(curve.fitted_velocity, curve.fitted_friction, color=BLUE, label="identified")
    right.fill_between(
        curve.fitted_velocity, curve.band_low, curve.band_high, color=BLUE, alpha=0.2
    )
    speed, truth = curve.fitted_velocity, result.truth
    direction = np.sign(curve.fitted_friction)  # of a speed of 0, each branch has its own
    right.plot(
        speed,
        truth["coulomb_friction"] * direction + truth["viscous_friction"] * speed,
        "--",
        color=ORANGE,
        lw=1,
        label="truth",
    )
    coulomb, viscous = (
        estimate.parameters[name] for name in ("coulomb_friction", "viscous_friction")
    )
    right.set(
        title=f"Identified: {coulomb.value:.4f} N, {viscous.value:.4f} N s/m",
        xlabel="velocity [m/s]",
        ylabel="friction [N]",
        ylim=(-0.6, 0.6),
    )
    right.legend(loc="upper left")
    save(figure, "overview.png")


def sampling_bias() -> None:
    """Draw the error of the published and of the exact sums, without noise."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    intervals = np.array([0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1])
    figure, axes = plt.subplots(1, 2, figsize=(8, 3), sharey=True, layout="constrained")
    known = {"inertia": 1.0, "load_inertia": 1.0, "stiffness": 1.0}
    variants = (
        (PublishedEnergyEstimator(**known), ORANGE, "published sums"),
        (PublishedEnergyEstimator(**known, sums="settled"), GREEN, "sums for a held input"),
        (EnergyEstimator(**known, offset=False), BLUE, "balance of work"),
    )
    for estimator, color, label in variants:
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
    handles, labels = axes[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3)
    save(figure, "sampling-bias.png")


def balance_of_work() -> None:
    """Draw the signals of the estimator on the surrogate arm, and its convergence."""
    motion = surrogate_motion()
    generator = np.random.default_rng(1)
    log = surrogate_sensors().measure(motion, generator)
    x, v, x2 = log.measured_position, log.measured_velocity, log.measured_load_position
    if v is None or x2 is None or motion.load_position is None:
        raise RuntimeError("the arm's sensors measure everything")
    T, noise = log.sampling_time, (POSITION_NOISE, VELOCITY_NOISE)
    force = log.effort - STIFFNESS * (x - x2)
    measured = DrivenMotion.of(x, v, force, MASS_1, T, noise)
    axis = FreeAxis.of(AxisModel(inertia=MASS_1), T)
    seen = axis.motion(measured, axis.likeliest_rate([measured]))
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(11, 3.1), layout="constrained")

    left.plot(log.time, v, ".", ms=2, color="#d1d5db", label="measured")
    left.plot(log.time, motion.velocity, "--", color=ORANGE, lw=1.2, label="true")
    left.plot(log.time, seen.velocity, color=BLUE, lw=1, label="smoothed, no friction model")
    left.set(title="Velocity", xlabel="time [s]", xlim=(4, 12))
    left.set_ylabel("velocity [m/s]")
    left.legend(loc="lower left")

    law = surrogate_arm().friction
    sliding = ~motion.stuck
    true = np.where(sliding, law.friction(motion.velocity), np.nan)
    middle.plot(log.time, seen.friction, color=BLUE, lw=1, label="estimated, no friction model")
    middle.plot(motion.time, true, "--", color=ORANGE, lw=1.2, label="true, sliding")
    middle.set(title="Friction", xlabel="time [s]", xlim=(4, 12))
    middle.set_ylabel("friction [N]")
    middle.legend(loc="lower left")

    estimator = EnergyEstimator(
        inertia=MASS_1, load_inertia=MASS_2, stiffness=STIFFNESS, offset=False
    )
    state = estimator.init(sampling_time=T)
    times, errors, spreads = [], [], []
    truth = np.array([TRUTH[name] for name in estimator.parameter_names(log.kind)])
    for start in range(0, 2000, 10):
        state, values = estimator.run(state, log.part(start, start + 10))
        if start >= 200:
            times.append(log.time[start + 9])
            errors.append(100.0 * (values[-1] / truth - 1.0))
            spreads.append(196.0 * np.sqrt(np.diag(estimator.covariance(state))) / truth)
    for k, (color, label) in enumerate(((ORANGE, "viscous"), (BLUE, "Coulomb"))):
        error, spread = np.array(errors)[:, k], np.array(spreads)[:, k]
        right.plot(times, error, color=color, lw=1.2, label=label)
        right.fill_between(times, error - spread, error + spread, color=color, alpha=0.2, lw=0)
    right.set(title="Online estimates, 95 % band", xlabel="time [s]", ylim=(-4, 4))
    right.set_ylabel("error [% of the truth]")
    right.legend(loc="upper right")
    save(figure, "balance-of-work.png")


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
    balance_of_work()
    coverage()


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
