"""Make the figures of pulse control: ``python -m studies.documentation.pulse_figures``."""

from dataclasses import replace
from math import sqrt

import matplotlib.pyplot as plt
import numpy as np
from rich.progress import Progress

from stickslip.control import (
    ExactPulseController,
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
    RestDetection,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome
from stickslip.simulation import Sensors
from studies.documentation.style import BLUE, GREEN, GREY, ORANGE, no_arguments, save, style
from studies.pulse_run import PulseRun, run_pulses
from studies.van_de_wijdeven.part_b.resolution import resolution_pieces, resolution_scores

# Table 1 of the source, part B, with an offset and uneven friction that it does not have
MASS, EFFORT, T = 150.0, 300.0, 0.01
FRICTION = CoulombViscousFriction(
    coulomb_friction_positive=105.0,
    coulomb_friction_negative=95.0,
    static_friction_positive=137.0,
    static_friction_negative=123.0,
    viscous_friction_positive=700.0,
    viscous_friction_negative=700.0,
    offset=10.0,
)
GUESS = CoulombViscousFriction.symmetric(
    coulomb_friction=80.0, viscous_friction=400.0, static_friction=150.0
)
STEP = 1e-6  # of the encoder, and its noise [m]
REST = RestDetection.for_encoder(resolution=STEP, noise=STEP, samples=10)
TOLERANCE, TARGET, DURATION = 2e-5, 0.012, 2.0
RESOLUTION_RUNS = 200


def law() -> None:
    """Draw how far pulses go, and what the smallest ones are."""
    table_1 = CoulombViscousFriction.symmetric(
        coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
    )
    exact = PulseLaw.of(SingleMass(mass=MASS, friction=table_1))
    plain = PulseLaw(mass=MASS, coulomb_friction=100.0, viscous_friction=0.0)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    width = np.linspace(0.0, 0.12, 200)
    for effort, alpha in ((300.0, 1.0), (220.0, 0.65), (160.0, 0.35)):
        label = f"{effort:.0f} N"
        left.plot(1e3 * width, 1e3 * exact.displacement(effort, width), color=BLUE,
                  alpha=alpha, label=label)  # fmt: skip
    left.plot(1e3 * width, 1e3 * plain.displacement(300.0, width), "--", color=ORANGE,
              label="300 N, viscous friction ignored")  # fmt: skip
    left.set(title="Displacement of a pulse", xlabel="width [ms]", ylabel="displacement [mm]")
    left.set_ylim(0, 15)
    left.legend(title="effort")
    effort = np.linspace(131.0, 300.0, 200)
    for samples, alpha in ((1, 1.0), (2, 0.65), (3, 0.35)):
        right.semilogy(effort, 1e6 * exact.displacement(effort, samples * T), color=BLUE,
                       alpha=alpha, label=f"{samples} sample{'s' * (samples > 1)}")  # fmt: skip
    smallest = 1e6 * float(exact.smallest_displacement(T))
    right.axhline(smallest, color=ORANGE, ls="--", lw=1)
    right.text(300.0, 0.93 * smallest, "smallest step: just above breakaway", ha="right", va="top",
               color=ORANGE)  # fmt: skip
    largest = 1e6 * float(exact.displacement(300.0, T))
    right.plot(300.0, largest, "o", color=ORANGE)
    line = {"arrowstyle": "-", "color": ORANGE}
    right.annotate("smallest step when\nonly the width varies", (300.0, largest), (285.0, 30.0),
                   ha="right", color=ORANGE, arrowprops=line)  # fmt: skip
    right.set_ylim(7, 5000)
    right.set(title="Displacement of short pulses", xlabel="effort [N]", ylabel="displacement [µm]")
    right.legend(title="width", loc="upper left", ncols=3)
    save(figure, "pulse-law.png")


def controllers() -> dict[str, PulseController]:
    """Return the three controllers, with the same guess."""
    common = {
        "mass": MASS,
        "coulomb_friction": GUESS.coulomb_friction_positive,
        "pulse_effort": EFFORT,
        "sampling_time": T,
        "target": TARGET,
        "tolerance": TOLERANCE,
        "rest": REST,
    }
    return {
        "PWC": replace(PulseWidthController.from_friction(**common), max_idle_pulses=None),
        "PAPWC": replace(
            PulseAmplitudeWidthController.from_friction(**common), max_idle_pulses=None
        ),
        "exact law": ExactPulseController(
            sampling_time=T,
            target=TARGET,
            tolerance=TOLERANCE,
            rest=REST,
            effort_limit=EFFORT,
            mass=MASS,
            friction=GUESS,
            position_noise=STEP * sqrt(1.0 + 1.0 / 12.0),
        ),
    }


def run(controller: PulseController) -> PulseRun:
    """Run a controller from rest at 0."""
    return run_pulses(
        SingleMass(mass=MASS, friction=FRICTION),
        controller,
        sampling_time=T,
        duration=DURATION,
        sensors=Sensors(position_noise=STEP, encoder_step=STEP, velocity="none"),
        generator=np.random.default_rng(1),
    )


def three_controllers() -> None:
    """Draw the three controllers on the same axis."""
    figure, axes = plt.subplots(
        2, 3, figsize=(11, 4.4), sharex=True, sharey="row", height_ratios=(3, 1.3),
        layout="constrained",
    )  # fmt: skip
    for (name, controller), (top, bottom) in zip(controllers().items(), axes.T, strict=True):
        done = run(controller)
        motion = done.run.motion
        error = 1e6 * (TARGET - motion.position)
        top.axhspan(-1e6 * TOLERANCE, 1e6 * TOLERANCE, color="#d1fae5")
        top.plot(motion.time, error, color=BLUE)
        top.set_yscale("symlog", linthresh=20.0, linscale=0.6)
        top.set_yticks([-100, -20, 0, 20, 100, 1000, 10000])
        top.set_yticklabels(["−100", "−20", "0", "20", "100", "1000", "10 000"])
        count = f"{len(done.pulses)} pulse{'s' * (len(done.pulses) != 1)}"
        ending = "hunts" if done.outcome is PositioningOutcome.MOVING else done.outcome.value
        top.set_title(f"{name}: {count}, {ending}")
        effort = np.append(motion.commanded_effort, 0.0)
        bottom.step(motion.time, effort, where="post", color=ORANGE, lw=1)
        bottom.set(xlabel="time [s]")
    axes[0, 0].set_ylabel("error [µm]")
    axes[1, 0].set_ylabel("effort [N]")
    save(figure, "three-pulse-controllers.png")


def learning() -> None:
    """Draw the first pulse, measured and predicted, and the estimates after each pulse."""
    controller = controllers()["exact law"]
    done = run(controller)
    names = {
        "mass": (MASS, "mass"),
        "coulomb_friction_positive": (115.0, "Coulomb friction and offset, forward"),
        "coulomb_friction_negative": (85.0, "Coulomb friction and offset, backward"),
        "viscous_friction_positive": (700.0, "viscous friction, forward"),
    }
    first = done.pulses[0]
    ((effort, width),) = first.levels
    time = np.linspace(0.0, done.pulses[1].time - first.time, 300)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")

    def expected(after: int) -> np.ndarray:
        from stickslip.planning.pulse_kernels import position_along, pulse_ends

        m, F, c = (
            float(done.estimates[name][after])
            for name in ("mass", "coulomb_friction_positive", "viscous_friction_positive")
        )
        pulse = (m, F, c, effort, width)
        ends = pulse_ends(*pulse)
        return 1e3 * np.array([position_along(*pulse, float(t), ends) for t in time])

    log = done.run.log
    since = log.time - first.time
    shown = (since >= 0) & (since <= time[-1])
    left.plot(1e3 * time, expected(0), color=GREY, ls="--", label="predicted, initial estimate")
    left.plot(1e3 * since[shown], 1e3 * log.measured_position[shown], "o", ms=3.5,
              color=ORANGE, label="measured")  # fmt: skip
    left.plot(1e3 * time, expected(1), color=BLUE, label="predicted, updated estimate")
    left.set(
        title="First pulse", xlabel="time since start of the pulse [ms]", ylabel="position [mm]"
    )
    left.legend()
    for (name, (truth, label)), color in zip(
        names.items(), (GREY, BLUE, GREEN, ORANGE), strict=True
    ):
        values = done.estimates[name]
        right.plot(range(values.size), values / truth, "o-", ms=4, color=color, label=label)
    right.axhline(1.0, color="black", lw=0.6)
    right.set(title="Estimates", xlabel="number of pulses", ylabel="estimate / true value [-]")
    right.set_xticks(range(len(done.pulses) + 1))
    right.legend(fontsize=8)
    save(figure, "pulse-learning.png")


def resolution() -> None:
    """Draw the error that alternating pulses reach, and its bounds."""
    with Progress() as bar:
        task = bar.add_task("resolution of pulses", total=resolution_pieces())
        scores = resolution_scores(RESOLUTION_RUNS, 1, workers=2, advance=lambda: bar.advance(task))
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")

    def draw(axes: plt.Axes, shown: list, x: list[float]) -> None:
        axes.loglog(x, [1e9 * each.smallest_step for each in shown], "--", color=ORANGE,
                    label="smallest single step")  # fmt: skip
        middle = [1e9 * each.median_error for each in shown]
        high = [1e9 * each.error_95 for each in shown]
        axes.loglog(x, middle, "o-", ms=4, color=BLUE, label="reached, median")
        axes.fill_between(x, middle, high, color=BLUE, alpha=0.2, label="to 95 %")

    by_step = sorted(
        (each for each in scores if (each.static_ratio, each.friction_change) == (1.3, 0.0)),
        key=lambda each: each.encoder_step,
    )
    x = [1e9 * each.encoder_step for each in by_step]
    draw(left, by_step, x)
    left.loglog(x, x, color="black", lw=0.6, label="step of the encoder")
    left.set(title="Friction that repeats", xlabel="step of the encoder [nm]", ylabel="error [nm]")
    left.legend(fontsize=8)
    by_change = sorted(
        (
            each
            for each in scores
            if (each.static_ratio, each.encoder_step, each.sampling_time) == (1.3, 1e-8, T)
            and each.friction_change > 0.0
        ),
        key=lambda each: each.friction_change,
    )
    draw(right, by_change, [100 * each.friction_change for each in by_change])
    right.set(
        title="Friction that does not (10 nm encoder)",
        xlabel="change of friction from pulse to pulse [%]",
    )
    save(figure, "pulse-resolution.png")


def main() -> None:
    """Make every figure."""
    style()
    law()
    three_controllers()
    learning()
    resolution()


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
