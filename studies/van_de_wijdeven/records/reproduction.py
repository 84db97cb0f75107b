"""A reproduced part of the source: its figures, and its claims beside measurements."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from stickslip.presentation.words import prefixed
from stickslip.records.record import JsonForm, Record, valued_tables

_LEGEND = {
    "claims.verdict": "agrees: all values are within their limits; partly: in some cases; differs: "
    "in none",
    "claims.measures": "what was measured [unit]: by case where the source can be read in several "
    "ways; without a limit where it does not decide the verdict",
    "setting": "values that were simulated with; lists of moves in their order",
    "figures.panels.curves": "what is drawn, in the units of the labels of the axes; a staircase "
    "keeps each value until the next",
}

CurveRole = Literal["truth", "first", "second", "third", "fourth"]
"""Role of a curve in its panel, on which its look depends."""

Sketch = Literal["mass with friction"]
"""A drawing of a system, of which only the source's parts are shown."""

SettingValues = Mapping[str, Mapping[str, tuple[float | tuple[float, ...], str]]]


@dataclass(frozen=True, kw_only=True)
class Curve(Record):
    """One line of a panel."""

    label: str  #: Its name in the legend.
    #: ``"truth"`` for what an estimate should be, else its place among the panel's lines.
    role: CurveRole
    #: Shape (n,), in the units [of the panel's axes].
    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]
    staircase: bool = False  #: Whether each value holds until the next, as a held input does.

    def to_dict(self) -> dict[str, Any]:
        """Return the curve as plain JSON types."""
        points = {"x": _rounded(self.x), "y": _rounded(self.y)}
        return {"label": self.label, "staircase": self.staircase, **points}


@dataclass(frozen=True, kw_only=True)
class Panel(Record):
    """One plot of a figure."""

    json_form = ("title x_label y_label curves",)

    title: str  #: What it shows.
    #: Of the axes, with units.
    x_label: str
    y_label: str
    #: Ends of the vertical axis [its unit]; None for as much as the curves need.
    y_range: tuple[float, float] | None = None
    #: Names of the values 0, 1, ... of the vertical axis; empty for numbers.
    y_ticks: tuple[str, ...] = ()
    curves: tuple[Curve, ...]  #: What is drawn, in this order.


@dataclass(frozen=True, kw_only=True)
class ReproducedFigure(Record):
    """A figure of the source, reproduced."""

    json_form = ("number title caption file=file_name panels",)

    number: str  #: The source's number, such as ``"6.3"``.
    title: str  #: What it shows, in a few words.
    caption: str  #: What each panel and line means, and what the source leaves open.
    columns: int  #: How many panels stand beside each other.
    panels: tuple[Panel, ...]  #: Row by row; none of a sketch.
    sketch: Sketch | None = None  #: The system that is drawn instead of panels.

    @property
    def file_name(self) -> str:
        """Name of its picture."""
        return f"figure-{self.number}.png"


@dataclass(frozen=True, kw_only=True)
class Measure(Record):
    """A quantity of a claim as measured, and the limits within which the claim holds."""

    json_form = ("case quantity unit value low high agrees",)

    #: Way in which the source can be read, or case in which it was measured; empty for one only.
    case: str
    quantity: str  #: Name of the quantity.
    unit: str  #: Of the value and its limits; ``"1"`` for a ratio.
    #: Measured value, and its limits [unit]; infinite where there is none.
    value: float
    low: float = -np.inf
    high: float = np.inf

    @property
    def decides(self) -> bool:
        """Whether there is a limit."""
        return self.low > -np.inf or self.high < np.inf

    @property
    def agrees(self) -> bool:
        """Whether the value is within its limits."""
        return not self.decides or self.low <= self.value <= self.high

    @property
    def limits(self) -> str:
        """The limits in words; empty without one."""
        low, high = self._number(self.low), self._number(self.high)
        if self.low == self.high:
            return low
        if np.isinf(self.low):
            return f"at most {high}" if self.decides else ""
        return f"at least {low}" if np.isinf(self.high) else f"{low} to {high}"

    @property
    def value_text(self) -> str:
        """The value in words."""
        return self._number(self.value)

    def to_dict(self) -> dict[str, Any]:
        """Return the measure as plain JSON types: null for no value and no limit."""
        numbers = {name: getattr(self, name) for name in ("value", "low", "high")}
        finite = {name: value if np.isfinite(value) else None for name, value in numbers.items()}
        return super().to_dict() | finite

    def _number(self, value: float) -> str:
        if np.isnan(value):
            return "none"
        if self.unit in {"m", "s"} and np.isfinite(value):
            return prefixed(value, self.unit).replace("-", "−")
        number = f"{value:.4g}".replace("-", "−")
        return number if self.unit == "1" else f"{number} {self.unit}"


@dataclass(frozen=True, kw_only=True)
class Claim(Record):
    """A statement of the source beside what was measured."""

    json_form = ("name place statement verdict measures why",)

    name: str  #: A short name.
    place: str  #: Where the source makes it, such as ``"6.1"`` or ``"Eq. 5.5"``.
    statement: str  #: What it says, in own words.
    #: The quantities that decide it, in each case, and others that belong to it.
    measures: tuple[Measure, ...]
    why: str  #: What explains the verdict.

    @property
    def agrees(self) -> bool:
        """Whether all quantities are within their limits."""
        return all(each.agrees for each in self.measures)

    @property
    def cases(self) -> dict[str, tuple[Measure, ...]]:
        """The measures of each case."""
        names = dict.fromkeys(each.case for each in self.measures if each.decides)
        return {name: tuple(each for each in self.measures if each.case == name) for name in names}

    @property
    def verdicts(self) -> dict[str, bool]:
        """Whether the claim holds in each case."""
        return {
            case: all(each.agrees for each in measures) for case, measures in self.cases.items()
        }

    @property
    def agrees_partly(self) -> bool:
        """Whether the claim holds in some cases, but not in all."""
        return not self.agrees and any(self.verdicts.values())

    @property
    def verdict(self) -> Literal["agrees", "partly", "differs"]:
        """The verdict."""
        if self.agrees:
            return "agrees"
        return "partly" if self.agrees_partly else "differs"


@dataclass(frozen=True, kw_only=True)
class Reproduction(Record):
    """A part of the source, reproduced: what all parts have."""

    schema = 2
    part: ClassVar[Literal["A", "B", "conjunction"]]  # of the source
    own_legend: ClassVar[Mapping[str, str]]  # meaning of the keys of the part's own results

    title: str  #: What the part is about.
    setting: str  #: With which values, in words.
    #: The same as numbers, each with its unit [as stated beside it], by group and name.
    values: SettingValues
    #: Figures of the source, and its claims.
    figures: tuple[ReproducedFigure, ...]
    claims: tuple[Claim, ...]
    options: Mapping[str, int]  #: What it was asked with, such as runs and seed.
    stickslip_version: str  #: Version of this package.

    @property
    def setting_values(self) -> dict[str, Any]:
        """The setting in words, and its values with their units."""
        return {"words": self.setting, **valued_tables(self.values)}

    @property
    def legend(self) -> dict[str, str]:
        """Meaning of the keys of the JSON document, as far as their names do not say it."""
        return {**_LEGEND, **self.own_legend}


def form_with(results: str) -> JsonForm:
    """Return the JSON form of a part with the keys of its own results."""
    return (
        "schema part title setting=setting_values legend",
        {"provenance": ("stickslip_version options",)},
        f"claims {results} figures",
    )


def _rounded(values: Float[np.ndarray, " n"]) -> list[float]:
    """Return values with the digits that a drawing needs."""
    return [float(f"{value:.6g}") for value in values.tolist()]
