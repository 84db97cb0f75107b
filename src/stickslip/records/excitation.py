"""An effort designed to identify an axis with, and what is expected of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records.quantities import AxisKind, quantity_field, unit_of
from stickslip.records.read_only import ReadOnlyMapping

__all__ = ["Excitation", "ExpectedParameter"]

_SCHEMA = 1
_NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class ExpectedParameter:
    """How well a parameter can be found at best.

    Attributes
    ----------
    believed
        What it is believed to be [SI].
    std
        Cramer-Rao bound: standard deviation that no unbiased estimator falls below [SI].
    """

    believed: float
    std: float

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval that is expected at best [SI]."""
        return _NORMAL_95 * self.std


@dataclass(frozen=True, kw_only=True)
class Excitation:
    """An effort designed to identify an axis with.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``; decides the units.
    sampling_time, effort
        Effort held over each sample, shape (n,).
    expected
        By parameter name.
    largest_speed, largest_travel
        That the axis reaches if it is as believed.
    options
        What was asked for, by name: value [unit beside it] and unit.
    stickslip_version
        Version of this package.
    """

    kind: AxisKind
    sampling_time: float = quantity_field("sampling_time")
    effort: Float[np.ndarray, " n"] = quantity_field("effort")
    expected: Mapping[str, ExpectedParameter]
    largest_speed: float = quantity_field("velocity")
    largest_travel: float = quantity_field("position")
    options: Mapping[str, tuple[float | str, str]]
    stickslip_version: str

    def __post_init__(self) -> None:
        for name in ("expected", "options"):
            object.__setattr__(self, name, ReadOnlyMapping(dict(getattr(self, name))))

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self.effort.size * self.sampling_time

    @property
    def untold(self) -> tuple[str, ...]:
        """Names of what it does not tell: not even at best does the interval keep away from 0.

        A parameter that is believed to be 0 is none of them. Nor is an offset that is known better
        than Coulomb friction is large: an axis may well have next to none.
        """
        coulomb = [
            abs(each.believed)
            for name, each in self.expected.items()
            if name.startswith("coulomb_friction")
        ]

        def enough(name: str, believed: float) -> float:
            return max(abs(believed), *coulomb) if name == "offset" and coulomb else abs(believed)

        return tuple(
            name
            for name, each in self.expected.items()
            if each.believed != 0.0 and each.half_width >= enough(name, each.believed)
        )

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain JSON types (schema 1)."""
        return {
            "schema": _SCHEMA,
            "kind": self.kind,
            "expected": {
                name: {
                    "believed": each.believed,
                    "std": each.std,
                    "ci95": [each.believed - each.half_width, each.believed + each.half_width],
                    "unit": unit_of(name, self.kind),
                }
                for name, each in self.expected.items()
            },
            "untold": list(self.untold),
            "largest_speed": self.largest_speed,
            "largest_travel": self.largest_travel,
            "largest_effort": float(np.max(np.abs(self.effort))),
            "duration": self.duration,
            "sampling_time": self.sampling_time,
            "effort": self.effort.tolist(),
            "units": {
                "effort": unit_of("effort", self.kind),
                "largest_effort": unit_of("effort", self.kind),
                "largest_speed": unit_of("velocity", self.kind),
                "largest_travel": unit_of("position", self.kind),
                "duration": "s",
                "sampling_time": "s",
            },
            "options": {
                name: {"value": value, "unit": unit} for name, (value, unit) in self.options.items()
            },
            "provenance": {"stickslip_version": self.stickslip_version},
        }
