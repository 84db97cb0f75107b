"""Make the figures of friction laws: ``python -m studies.documentation.friction_laws``."""

from dataclasses import replace
from itertools import pairwise

import matplotlib.pyplot as plt
import numpy as np

from stickslip.estimation import EnergyEstimator, StribeckEstimator
from stickslip.friction import (
    CoulombViscousFriction,
    DahlFriction,
    ElastoPlasticFriction,
    FrictionLaw,
    LuGreFriction,
    StribeckEffect,
    StribeckFriction,
)
from stickslip.plants import SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, SimulatedMotion, simulate
from studies.documentation.style import BLUE, GREEN, GREY, ORANGE, no_arguments, save, style

# The values of Canudas de Wit et al. (1995), with a mass of 1 kg
FRICTION = {"coulomb_friction": 1.0, "static_friction": 1.5, "viscous_friction": 0.4}
STRIBECK = StribeckFriction.symmetric(**FRICTION, stribeck_velocity=1e-3)
EXPONENTIAL = StribeckFriction.symmetric(**FRICTION, stribeck_velocity=1e-3, shape="exponential")
COULOMB = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=0.4)
STIFFNESS, DAMPING = 1e5, float(np.sqrt(1e5))
# Dahl's bristles have no damping of their own: without this they ring for seconds, and creep
DAMPED = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=DAMPING)
DAHL = DahlFriction(sliding=DAMPED, bristle_stiffness=STIFFNESS)
LUGRE = LuGreFriction(sliding=STRIBECK, bristle_stiffness=STIFFNESS, bristle_damping=DAMPING)
PLASTIC = ElastoPlasticFriction(
    sliding=STRIBECK, bristle_stiffness=STIFFNESS, bristle_damping=DAMPING, elastic_deflection=7e-6
)
T = 1e-3
BRISTLES = (("Dahl", DAHL, ORANGE), ("LuGre", LUGRE, BLUE),
            ("elasto-plastic", PLASTIC, GREEN))  # fmt: skip


def moved(law: FrictionLaw, effort: np.ndarray, step: float = T) -> SimulatedMotion:
    """Simulate a mass of 1 kg."""
    return simulate(SingleMass(mass=1.0, friction=law), effort, sampling_time=step)


def steady() -> None:
    """Draw each law's friction in steady motion, and the force at which it breaks away."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    speed = np.linspace(1e-9, 5e-3, 400)
    for law, label, color in (
        (STRIBECK, "Stribeck, Gaussian; LuGre; elasto-plastic", BLUE),
        (EXPONENTIAL, "Stribeck, exponential", GREEN),
        (COULOMB, "Coulomb; Dahl", ORANGE),
    ):
        velocity = np.concatenate([-speed[::-1], [np.nan], speed])
        left.plot(1e3 * velocity, law.friction(velocity), color=color, label=label)
    left.set(title="Steady motion", xlabel="velocity [mm/s]", ylabel="friction [N]")
    left.legend(loc="center", fontsize=8)
    rates = np.geomspace(0.1, 50.0, 12)
    for name, law, color in (("Stribeck", STRIBECK, GREY), *BRISTLES[1:]):
        force = [breakaway_force(law, float(rate)) for rate in rates]
        right.semilogx(rates, force, "o-", ms=3, color=color, label=name)
    right.set(title="Breakaway", xlabel="rate of the effort [N/s]", ylabel="largest friction [N]")
    right.set_ylim(0.9, 1.6)
    right.legend(loc="lower left")
    save(figure, "friction-steady.png")


def breakaway_force(law: FrictionLaw, rate: float) -> float:
    """Return the largest friction until a mass slides, under an effort that rises."""
    step = min(T, 1e-2 / rate)
    effort = rate * step * np.arange(int(2.5 / (rate * step)))
    motion = moved(law, effort, step)
    friction = effort - np.diff(motion.velocity) / step
    slides = np.flatnonzero(motion.velocity > 0.01)
    return float(friction[: slides[0]].max())


def presliding() -> None:
    """Draw friction against displacement below breakaway: single and nested loops."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    time = np.arange(8000) * T
    swing = 0.8 * np.sin(np.pi * time)
    corners = (0.0, 0.6, 0.2, 0.6, 0.2, 0.6, 0.8)
    nested = np.concatenate([np.linspace(a, b, 2000) for a, b in pairwise(corners)])
    for name, law, color in BRISTLES:
        motion = moved(law, swing)
        left.plot(1e6 * motion.position[2000:-1], swing[2000:], color=color, label=name)
        motion = moved(law, nested)
        right.plot(1e6 * motion.position[:-1], nested, color=color, label=name)
    left.set(title="Hysteresis, one amplitude", xlabel="position [µm]", ylabel="effort [N]")
    right.set(title="Hysteresis, nested loops", xlabel="position [µm]", ylabel="effort [N]")
    left.legend()
    save(figure, "friction-presliding.png")


def drift() -> None:
    """Draw the creep of an axis under an oscillating effort below breakaway."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    time = np.arange(3000) * T
    effort = 0.4 + 0.25 * np.sin(20 * np.pi * time)
    for name, law, color in (("Stribeck", STRIBECK, GREY), *BRISTLES):
        motion = moved(law, effort)
        left.plot(motion.time, 1e6 * motion.position, color=color, label=name, lw=1)
    left.set(title="Effort 0.4 N + 0.25 N sin at 10 Hz", xlabel="time [s]", ylabel="position [µm]")
    left.legend()
    means = np.linspace(0.05, 1.0, 39)
    for name, law, color in BRISTLES:
        way = []
        for mean in means:
            long = mean + 0.25 * np.sin(20 * np.pi * np.arange(6000) * T)
            position = moved(law, long).position[::100]
            way.append(1e6 * max(position[-1] - position[-11], 0.0))  # in the last second
        right.semilogy(means + 0.25, np.maximum(way, 1e-6), color=color, label=name)
    right.axvline(0.7, color="black", lw=0.6)
    right.text(0.71, 1e-5, "elastic limit, 0.7 N")
    right.set(title="Creep", xlabel="largest effort [N]", ylabel="displacement per second [µm/s]")
    save(figure, "friction-drift.png")


def measured() -> tuple[AxisLog, StribeckFriction]:
    """Return a log of an axis with a Stribeck effect, and its law."""
    law = StribeckFriction.symmetric(
        coulomb_friction=1.0, static_friction=1.6, viscous_friction=2.0, stribeck_velocity=0.05,
        offset=0.1,
    )  # fmt: skip
    time = np.arange(20_000) * T
    effort = 2.2 * np.sin(np.pi * time) + 1.2 * np.sin(3.4 * np.pi * time + 1.0)
    motion = moved(law, effort)
    sensors = Sensors(position_noise=2e-5, velocity_noise=2e-3)
    return sensors.measure(motion, generator=np.random.default_rng(1)), law


def estimated() -> None:
    """Draw the estimates and the residual against the assumed Stribeck velocity."""
    log, law = measured()
    known = EnergyEstimator(inertia=1.0, offset=True)
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    ratios = np.geomspace(0.3, 1.0 / 0.3, 17)
    names = {"coulomb_friction": ORANGE, "viscous_friction": GREEN,
             "static_friction": BLUE}  # fmt: skip
    fits = [
        replace(known, stribeck=StribeckEffect(velocity=0.05 * float(ratio))).fit(log)
        for ratio in ratios
    ]
    for name, color in names.items():
        truth = getattr(law, f"{name}_positive")
        label = name.replace("_", " ").replace("coulomb", "Coulomb")
        error = [100 * ((fit.parameters[name].value or np.nan) / truth - 1) for fit in fits]
        left.semilogx(ratios, error, "o-", ms=3, color=color, label=label)
    left.set(
        title="Fixed Stribeck velocity",
        xlabel="Stribeck velocity / true value [-]",
        ylabel="error [%]",
    )
    left.legend()
    residual = [fit.diagnostics.relative_residual for fit in fits]
    right.loglog(ratios, residual, "o-", ms=3, color=GREY)
    found = StribeckEstimator(method=known).fit(log)
    interval = found.parameters["stribeck_velocity"].ci95
    if interval is None:
        raise RuntimeError("the Stribeck velocity was not found")
    right.axvspan(*(end / 0.05 for end in interval), color=BLUE, alpha=0.5)
    right.set(title="Fitted Stribeck velocity", xlabel="Stribeck velocity / true value [-]",
              ylabel="relative residual [-]")  # fmt: skip
    right.text(0.95, min(residual), "95 % interval of\nStribeckEstimator", va="bottom",
               ha="right", color=BLUE)  # fmt: skip
    for axes in (left, right):
        axes.set_xticks([0.3, 0.5, 1.0, 2.0, 3.0], ["0.3", "0.5", "1", "2", "3"])
        axes.minorticks_off()
    save(figure, "friction-stribeck.png")
    for name, parameter in found.parameters.items():
        print(name, parameter.value, parameter.ci95)
    plain = known.fit(log)
    print("without:", {name: p.value for name, p in plain.parameters.items()})


def main() -> None:
    """Make every figure."""
    style()
    steady()
    presliding()
    drift()
    estimated()


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
