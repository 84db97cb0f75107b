"""An effort designed to identify an axis with, and the accuracy to expect of it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records.quantities import AxisKind, quantity_field, unit_of
from stickslip.records.record import Record, Valued

_SCHEMA = 3  # version of the JSON form
_NORMAL_95 = 1.959963984540054  # standard deviations of a 95 % interval
_QUANTITIES = {
    "effort": "effort",
    "largest_effort": "effort",
    "largest_speed": "velocity",
    "largest_travel": "position",
    "duration": "time",
    "sampling_time": "sampling_time",
}


@dataclass(frozen=True, kw_only=True)
class ExpectedParameter(Record):
    """The accuracy of a parameter at best."""

    json_form = ("first_guess std ci95",)

    first_guess: float  #: [SI].
    std: float  #: Cramer-Rao bound: no unbiased estimator has a smaller standard deviation [SI].

    @property
    def half_width(self) -> float:
        """Half of the 95 % interval that is expected at best [SI]."""
        return _NORMAL_95 * self.std

    @property
    def ci95(self) -> tuple[float, float]:
        """95 % interval that is expected at best [SI]."""
        return self.first_guess - self.half_width, self.first_guess + self.half_width


@dataclass(frozen=True, kw_only=True)
class Excitation(Record):
    """An effort designed to identify an axis with."""

    schema = _SCHEMA
    json_form = (
        "schema kind expected undetermined largest_speed largest_travel",
        "largest_effort duration sampling_time effort units options",
        {"provenance": ("stickslip_version",)},
    )

    kind: AxisKind  #: Decides the units.
    sampling_time: float = quantity_field("sampling_time")  #: Time that each effort is held.
    effort: Float[np.ndarray, " n"] = quantity_field("effort")  #: Held over each sample.
    expected: Mapping[str, ExpectedParameter]  #: By parameter name.
    largest_speed: float = quantity_field("velocity")  #: That the axis reaches by the first guess.
    largest_travel: float = quantity_field("position")  #: From its start, by the first guess.
    options: Mapping[str, tuple[float | str, str]]  #: By name, each a value [its unit] and a unit.
    stickslip_version: str  #: Version of this package.

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
        """Length of the whole effort [s]."""
        return self.effort.size * self.sampling_time

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of the parameters whose expected interval contains 0.

        A parameter with a first guess of 0 is none of them. Nor is an offset whose interval is
        narrower than Coulomb friction is large: an axis may well have next to none.
        """
        coulomb = [
            abs(each.first_guess)
            for name, each in self.expected.items()
            if name.startswith("coulomb_friction")
        ]
        return tuple(
            name
            for name, each in self.expected.items()
            if each.first_guess != 0.0
            and each.half_width >= abs(each.first_guess)
            and (name != "offset" or each.half_width >= max(coulomb, default=0.0))
        )

    @property
    def units(self) -> dict[str, str]:
        """SI units of the numbers in the JSON form."""
        return {name: unit_of(quantity, self.kind) for name, quantity in _QUANTITIES.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain JSON types (schema 3), with the unit of each parameter."""
        document = super().to_dict()
        for name, each in document["expected"].items():
            each["unit"] = unit_of(name, self.kind)
        return document
