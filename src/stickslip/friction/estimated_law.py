"""The friction law of an estimate: effort over velocity."""

from collections.abc import Mapping, Sequence

import numpy as np
from jaxtyping import Float

from stickslip.records import quantity_name, shared_name

Values = Float[np.ndarray, " n"]

_TERMS = (
    "viscous_friction",
    "coulomb_friction",
    "static_friction",
    "offset",
    "quadratic_friction",
    "two_thirds_friction",
    "stribeck_velocity",
    "low_speed_friction",
    "low_speed_velocity",
)
SHAPES = ("stribeck_velocity", "low_speed_velocity")
"""Parameters that enter the law nonlinearly; their columns are derivatives."""


def is_velocity_term(name: str) -> bool:
    """Return whether a parameter belongs to the law of effort over velocity of every log."""
    return quantity_name(name) in _TERMS and name == shared_name(name)


def law_columns(
    names: Sequence[str], velocity: Values, direction: Values, values: Mapping[str, float]
) -> Float[np.ndarray, "n p"]:
    """Return the effort per unit of each velocity term, and its derivative for one of `SHAPES`.

    The direction is the sign of the velocity, and distinguishes the two ends of zero. The Stribeck
    effect and the friction of low speeds are taken at the values of all parameters [SI].
    """
    width, slow = values.get("stribeck_velocity", 0.0), values.get("low_speed_velocity", 0.0)
    rise = _near_zero(velocity, width)
    columns: list[Values] = []
    for name in names:
        base = quantity_name(name)
        side = {"_positive": 1.0, "_negative": -1.0}.get(name.removeprefix(base), 0.0)
        on = np.ones(velocity.size) if side == 0.0 else (direction == side).astype(float)
        if base == "viscous_friction":
            column = velocity
        elif base == "coulomb_friction":
            column = direction * (1.0 - rise)
        elif base == "static_friction":
            column = direction * rise
        elif base == "quadratic_friction":
            column = velocity * np.abs(velocity)
        elif base == "two_thirds_friction":
            column = direction * np.abs(velocity) ** (2.0 / 3.0)
        elif base == "stribeck_velocity":
            excess = np.zeros(velocity.size)
            for way, sign in (("", 0.0), ("_positive", 1.0), ("_negative", -1.0)):
                if f"static_friction{way}" in values:
                    height = values[f"static_friction{way}"] - values[f"coulomb_friction{way}"]
                    excess += height * (np.ones(velocity.size) if sign == 0 else direction == sign)
            column = direction * excess * rise * 2.0 * velocity**2 / max(width, 1e-300) ** 3
        elif base == "low_speed_friction":
            column = direction * _near_zero(velocity, slow)
        elif base == "low_speed_velocity":
            share = _near_zero(velocity, slow) * 2.0 * velocity**2 / max(slow, 1e-300) ** 3
            column = direction * values["low_speed_friction"] * share
        else:
            column = np.ones(velocity.size)
        columns.append(column * on)
    return np.column_stack(columns)


def _near_zero(velocity: Values, width: float) -> Values:
    """Return ``exp(-(v / width)^2)``, and 0 without a width."""
    return np.exp(-((velocity / width) ** 2)) if width > 0 else np.zeros(velocity.size)


def law_effort(values: Mapping[str, float], velocity: Values, direction: Values) -> Values:
    """Return the effort of the law at each velocity [N or N m]; the direction is its sign."""
    names = [n for n in values if is_velocity_term(n) and n not in SHAPES]
    return law_columns(names, velocity, direction, values) @ np.array([values[n] for n in names])
