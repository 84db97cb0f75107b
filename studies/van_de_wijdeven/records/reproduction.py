"""A reproduced part of the source: its figures, and its claims beside measurements."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from stickslip.presentation.words import prefixed

REPRODUCTION_SCHEMA = 2

_LEGEND = {
    "claims.verdict": "agrees: all values are within their limits; partly: in some cases; differs: "
    "in none",
    "claims.measures": "what was measured [unit]: by case where the source can be read in several "
    "ways; without a limit where it does not decide the verdict",
    "setting": "values that were simulated with; lists of moves in their order",
    "figures.panels.curves": "what is drawn, in the units of the labels of the axes; a staircase "
    "keeps each value until the next",
}
"""Meaning of the keys of the JSON document, as far as their names do not say it."""

CurveRole = Literal["truth", "first", "second", "third", "fourth"]
"""Role of a curve in its panel, on which its look depends."""

Sketch = Literal["mass with friction"]
"""A drawing of a system, of which only the source's parts are shown."""

SettingValues = Mapping[str, Mapping[str, tuple[float | tuple[float, ...], str]]]


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One line of a panel."""

    label: str  #: Its name in the legend.
    #: ``"truth"`` for what an estimate should be, else its place among the panel's lines.
    role: CurveRole
    #: Shape (n,), in the units [of the panel's axes].
    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]
    staircase: bool = False  #: Whether each value holds until the next, as a held input does.


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One plot of a figure."""

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
class ReproducedFigure:
    """A figure of the source, reproduced."""

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
class Measure:
    """A quantity of a claim as measured, and the limits within which the claim holds."""

    #: Way in which the source can be read, or case in which it was measured; empty for one only.
    case: str
    quantity: str  #: Measurements.
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

    def _number(self, value: float) -> str:
        if np.isnan(value):
            return "none"
        if self.unit in {"m", "s"} and np.isfinite(value):
            return prefixed(value, self.unit).replace("-", "−")
        number = f"{value:.4g}".replace("-", "−")
        return number if self.unit == "1" else f"{number} {self.unit}"


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A statement of the source beside what was measured."""

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
class Reproduction(ABC):
    """A part of the source, reproduced: what all parts have."""

    title: str  #: What the part is about.
    setting: str  #: With which values, in words.
    #: The same as numbers, each with its unit [as told beside it], by group and name.
    values: SettingValues
    #: The reproduction.
    figures: tuple[ReproducedFigure, ...]
    claims: tuple[Claim, ...]
    options: Mapping[str, int]  #: What it was asked with, such as runs and seed.
    stickslip_version: str  #: Version of this package.

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))
        values = {group: MappingProxyType(dict(of)) for group, of in self.values.items()}
        object.__setattr__(self, "values", MappingProxyType(values))

    @property
    @abstractmethod
    def part(self) -> Literal["A", "B", "conjunction"]:
        """Which part of the source."""

    @abstractmethod
    def legend(self) -> dict[str, str]:
        """Return what the keys of this part's own results mean."""

    @abstractmethod
    def results(self) -> dict[str, Any]:
        """Return this part's own results, by their key, as plain JSON types."""

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain JSON types."""
        return {
            "schema": REPRODUCTION_SCHEMA,
            "part": self.part,
            "title": self.title,
            "setting": {
                "words": self.setting,
                **{
                    group: {
                        name: {"value": value, "unit": unit} for name, (value, unit) in of.items()
                    }
                    for group, of in self.values.items()
                },
            },
            "legend": {**_LEGEND, **self.legend()},
            "provenance": {
                "stickslip_version": self.stickslip_version,
                "options": dict(self.options),
            },
            "claims": [
                {
                    "name": each.name,
                    "place": each.place,
                    "statement": each.statement,
                    "verdict": each.verdict,
                    "measures": [_measure_to_dict(measure) for measure in each.measures],
                    "why": each.why,
                }
                for each in self.claims
            ],
            **self.results(),
            "figures": [_figure_to_dict(each) for each in self.figures],
        }


def _measure_to_dict(measure: Measure) -> dict[str, Any]:
    """Return a measure as plain JSON types: null for no value and no limit."""
    own = asdict(measure)
    for name in ("value", "low", "high"):
        own[name] = own[name] if np.isfinite(own[name]) else None
    return {**own, "agrees": measure.agrees}


def _figure_to_dict(figure: ReproducedFigure) -> dict[str, Any]:
    return {
        "number": figure.number,
        "title": figure.title,
        "caption": figure.caption,
        "file": figure.file_name,
        "panels": [
            {
                "title": panel.title,
                "x_label": panel.x_label,
                "y_label": panel.y_label,
                "curves": [
                    {
                        "label": curve.label,
                        "staircase": curve.staircase,
                        "x": _rounded(curve.x),
                        "y": _rounded(curve.y),
                    }
                    for curve in panel.curves
                ],
            }
            for panel in figure.panels
        ],
    }


def _rounded(values: Float[np.ndarray, " n"]) -> list[float]:
    """Return values with the digits that a drawing needs."""
    return [float(f"{value:.6g}") for value in values.tolist()]
