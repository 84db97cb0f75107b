"""Kernels of the exported friction law: the force at a velocity, and the feedforward."""

import math
from typing import Any

import numpy as np

from stickslip.compiled import compiled
from stickslip.control.feedback.friction_compensation import compensating_effort

_BOTH = ("f8", 2)  # positive direction, negative direction
LAW = np.dtype(
    [
        ("inertia", "f8"),  # moving mass [kg] or inertia [kg m^2]
        ("coulomb", *_BOTH),  # Coulomb friction [N or N m], positive and negative direction
        ("excess", *_BOTH),  # static less Coulomb friction [N or N m]
        ("viscous", *_BOTH),  # viscous friction [N s/m or N m s/rad]
        ("offset", "f8"),  # constant effort lost whatever the motion [N or N m]
        ("stribeck_velocity", "f8"),  # 1/e of the excess is left there [m/s or rad/s]
        ("exponent", "f8"),  # of the Stribeck effect: 2 or 1
        ("quadratic", "f8"),  # friction per squared speed [N s^2/m^2 or N m s^2/rad^2]
        ("two_thirds", "f8"),  # friction per speed^(2/3) [SI]
        ("low_speed", "f8"),  # friction at low speeds [N or N m]
        ("low_speed_velocity", "f8"),  # 1/e of it is left there [m/s or rad/s]
        ("dead_band", "f8"),  # speed up to which nothing is compensated [m/s or rad/s]
    ]
)
"""A friction law of velocity, as exported code holds it."""


@compiled(inline=True)
def _left(speed: float, width: float, exponent: float) -> float:
    """Return exp(-(speed/width)^exponent), with the exponent 2 or 1."""
    r = speed / width
    return math.exp(-r * r if exponent == 2.0 else -r)


@compiled()
def friction_force(law: Any, v: float) -> float:
    """Return the friction force at a velocity, 0 at rest.

    F = f_c + (f_s - f_c) exp(-(v/v_s)^delta) + c v while v > 0, mirrored for v < 0 with the values
    of that direction. The offset is not contained.
    """
    if v == 0.0:
        return 0.0
    side = 0 if v > 0.0 else 1
    speed = abs(v)
    strength = law.coulomb[side]
    if law.excess[side] != 0.0:
        strength += law.excess[side] * _left(speed, law.stribeck_velocity, law.exponent)
    if law.low_speed != 0.0:
        strength += law.low_speed * _left(speed, law.low_speed_velocity, 2.0)
    if law.two_thirds != 0.0:
        strength += law.two_thirds * speed ** (2.0 / 3.0)
    strength += law.quadratic * speed * speed
    return (strength if v > 0.0 else -strength) + law.viscous[side] * v


@compiled()
def feedforward(law: Any, v: float, a: float) -> float:
    """Return the effort for a reference motion: m a + offset + Coulomb and viscous friction.

    Static friction is left out: its peak at zero speed would make the axis hunt.
    """
    friction = compensating_effort(
        law.coulomb[0], law.coulomb[1], law.viscous[0], law.viscous[1], v, law.dead_band
    )
    return law.inertia * a + law.offset + friction
