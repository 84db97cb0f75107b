"""An effort designed to identify an axis with, and what is expected of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records.quantities import AxisKind, quantity_field, unit_of
from stickslip.records.record import Record, Valued

__all__ = ["Excitation", "ExpectedParameter"]

_SCHEMA = 2
_NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class ExpectedParameter(Record):
    """How well a parameter can be found at best.

    Attributes
    ----------
    believed
        What it is believed to be [SI].
    std
        Cramer-Rao bound: standard deviation that no unbiased estimator falls below [SI].
    """

    json_form = ("believed std ci95",)

    believed: float
    std: float

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval that is expected at best [SI]."""
        return _NORMAL_95 * self.std

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % interval that is expected at best [SI]."""
        return self.believed - self.half_width, self.believed + self.half_width


@dataclass(frozen=True, kw_only=True)
class Excitation(Record):
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

    schema = _SCHEMA
    json_form = (
        "schema kind expected undetermined largest_speed largest_travel",
        "largest_effort duration sampling_time effort units options",
        {"provenance": ("stickslip_version",)},
    )

    kind: AxisKind
    sampling_time: float = quantity_field("sampling_time")
    effort: Float[np.ndarray, " n"] = quantity_field("effort")
    expected: Mapping[str, ExpectedParameter]
    largest_speed: float = quantity_field("velocity")
    largest_travel: float = quantity_field("position")
    options: Mapping[str, tuple[float | str, str]]
    stickslip_version: str

    def __post_init__(self) -> None:
        options = {name: Valued(*pair) for name, pair in self.options.items()}
        object.__setattr__(self, "options", options)
        super().__post_init__()

    @property
    def largest_effort(self) -> float:
        """Largest magnitude of the effort [N or N m]."""
        return float(np.max(np.abs(self.effort)))

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self.effort.size * self.sampling_time

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters whose expected interval contains 0.

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

    @property
    def units(self) -> dict[str, str]:
        """SI units of the numbers in the JSON form."""
        quantities = {
            "effort": "effort",
            "largest_effort": "effort",
            "largest_speed": "velocity",
            "largest_travel": "position",
            "duration": "time",
            "sampling_time": "sampling_time",
        }
        return {name: unit_of(quantity, self.kind) for name, quantity in quantities.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain JSON types (schema 1), with the unit of each parameter."""
        document = super().to_dict()
        for name, each in document["expected"].items():
            each["unit"] = unit_of(name, self.kind)
        return document
