"""Plants with friction laws that are not affine, integrated by SciPy from the papers' equations.

Written apart from the package: absolute values and signs as the papers have them, restarted in
every sample, Radau IIA for bristles and DOP853 with events for a law that sticks.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from stickslip.friction import DahlFriction, ElastoPlasticFriction, LuGreFriction, StribeckFriction
from stickslip.plants import Plant, SingleMass

RTOL, ATOL = 1e-11, 1e-15
FINEST_RTOL, FINEST_ATOL = 1e-13, 1e-16  # at a breakaway an error grows like the motion itself
KICK = 1e-15  # a speed that takes the reference past the event it has just found


def side(law: Any, name: str, v: float) -> float:
    return getattr(law, f"{name}_{'positive' if v >= 0 else 'negative'}")


def stribeck_curve(law: StribeckFriction, v: float) -> float:
    """Return the Stribeck curve without its viscous part, in magnitude."""
    fc, fs = side(law, "coulomb_friction", v), side(law, "static_friction", v)
    delta = 2 if law.shape == "gaussian" else 1
    return fc + (fs - fc) * np.exp(-((abs(v) / law.stribeck_velocity) ** delta))


def bristle_rate(law: Any, v: float, z: float) -> float:
    """Return z' of each law as its paper has it."""
    s0 = law.bristle_stiffness
    if isinstance(law, DahlFriction):
        left = 1.0 - s0 * z / side(law.sliding, "coulomb_friction", v) * np.sign(v)
        return v * abs(left) ** law.exponent * np.sign(left)
    g = stribeck_curve(law.sliding, v)
    if isinstance(law, LuGreFriction):
        return v - s0 * abs(v) / g * z
    assert isinstance(law, ElastoPlasticFriction)
    z_ss, z_ba = g / s0, law.elastic_deflection
    alpha = 0.0
    if np.sign(z) == np.sign(v) and abs(z) > z_ba:
        middle = 0.5 * np.sin(np.pi * (abs(z) - (z_ss + z_ba) / 2) / (z_ss - z_ba)) + 0.5
        alpha = middle if abs(z) < z_ss else 1.0
    return v * (1.0 - alpha * z / z_ss * np.sign(v))


def with_bristles(plant: Plant, effort: np.ndarray, T: float) -> np.ndarray:
    """Return (x1, v1, z, x2, v2) at every sample."""
    law: Any = plant.friction
    m1, m2, ks = masses(plant)
    damping = getattr(law, "bristle_damping", 0.0)

    def rate(_: float, y: np.ndarray, U: float) -> list[float]:
        x, v, z, x2, v2 = y
        dz = bristle_rate(law, v, z)
        c = side(law.sliding, "viscous_friction", v)
        friction = law.bristle_stiffness * z + damping * dz + c * v
        spring = ks * (x - x2)
        return [v, (U - spring - friction) / m1, dz, v2, spring / m2]

    states = [np.zeros(5)]
    for u in effort:
        solved = solve_ivp(
            rate, (0.0, T), states[-1], "Radau", rtol=RTOL, atol=ATOL, args=(u - law.offset,)
        )
        states.append(solved.y[:, -1])
    return np.array(states)


def with_stiction(plant: Plant, effort: np.ndarray, T: float) -> tuple[np.ndarray, int]:
    """Return (x1, v1, x2, v2) at every sample, and how often the first mass changed its mode."""
    law: Any = plant.friction
    m1, m2, ks = masses(plant)
    limits = law.static_friction_negative, law.static_friction_positive
    y, mode, changes = np.zeros(4), 0, 0
    states = [y]
    for u in effort:
        U = u - law.offset
        t = 0.0
        while t < T:
            w = U - ks * (y[0] - y[2])
            if mode == 0 and not -limits[0] <= w <= limits[1]:
                mode, changes = int(np.sign(w)), changes + 1
            event, way = _event(mode, U, ks, limits)
            event.terminal, event.direction = True, way
            rate = _rate(law, mode, U, m1, m2, ks)
            solved = solve_ivp(
                rate,
                (t, T),
                y,
                "DOP853",
                rtol=FINEST_RTOL,
                atol=FINEST_ATOL,
                events=event,
                max_step=T / 4,
            )
            t, y = float(solved.t[-1]), solved.y[:, -1].copy()
            if solved.status == 1:
                changes += 1
                if mode == 0:
                    mode = int(np.sign(U - ks * (y[0] - y[2])))
                    y[1] = mode * KICK
                else:
                    w, y[1] = U - ks * (y[0] - y[2]), 0.0
                    mode = 0 if -limits[0] <= w <= limits[1] else int(np.sign(w))
                    y[1] = mode * KICK
        states.append(y)
    return np.array(states), changes


def _event(
    mode: int, U: float, ks: float, limits: tuple[float, float]
) -> tuple[Callable[[float, np.ndarray], float], float]:
    if mode != 0:
        return (lambda _, y: mode * y[1]), -1.0

    def room(_: float, y: np.ndarray) -> float:
        w = U - ks * (y[0] - y[2])
        return min(limits[1] - w, w + limits[0])

    return room, -1.0


def _rate(law: Any, mode: int, U: float, m1: float, m2: float, ks: float) -> Any:
    def rate(_: float, y: np.ndarray) -> list[float]:
        x, v, x2, v2 = y
        spring = ks * (x - x2)
        if mode == 0:
            return [0.0, 0.0, v2, spring / m2]
        name = "positive" if mode > 0 else "negative"
        fc = getattr(law, f"coulomb_friction_{name}")
        fs = getattr(law, f"static_friction_{name}")
        delta = 2 if law.shape == "gaussian" else 1
        left = np.exp(-((mode * v / law.stribeck_velocity) ** delta))
        friction = mode * (fc + (fs - fc) * left) + getattr(law, f"viscous_friction_{name}") * v
        return [v, (U - spring - friction) / m1, v2, spring / m2]

    return rate


def masses(plant: Plant) -> tuple[float, float, float]:
    if isinstance(plant, SingleMass):
        return plant.mass, 1.0, 0.0
    return plant.mass_1, plant.mass_2, plant.stiffness
