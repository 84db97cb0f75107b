"""A reproduced part of the source: its figures, and its claims beside measurements."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

__all__ = [
    "Claim",
    "Curve",
    "CurveRole",
    "Panel",
    "Reading",
    "ReproducedFigure",
    "Reproduction",
    "Sketch",
]

REPRODUCTION_SCHEMA = 1

_LEGEND = {
    "claims.agrees": "whether the criterion is met, in every reading",
    "claims.readings": "the same, and what was measured, in each way in which the source can be "
    "read, or in each case; none where there is one only",
    "setting": "values that were simulated with; lists of moves in their order",
    "figures.panels.curves": "what is drawn, in the units of the labels of the axes; a staircase "
    "keeps each value until the next",
}
"""What the keys of the JSON document mean, as far as their names do not say it."""

CurveRole = Literal["truth", "first", "second", "third", "fourth"]
"""What a curve is in its panel, on which its look depends."""

Sketch = Literal["mass with friction"]
"""A drawing of a system, of which only the source's parts are shown."""

SettingValues = Mapping[str, Mapping[str, tuple[float | tuple[float, ...], str]]]


@dataclass(frozen=True, kw_only=True)
class Curve:
    """One line of a panel.

    Attributes
    ----------
    label
        Its name in the legend.
    role
        ``"truth"`` for what an estimate should be, else its place among the panel's lines.
    x, y
        Shape (n,), in the units [of the panel's axes].
    staircase
        Whether each value holds until the next, as a held input does.
    """

    label: str
    role: CurveRole
    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]
    staircase: bool = False


@dataclass(frozen=True, kw_only=True)
class Panel:
    """One plot of a figure.

    Attributes
    ----------
    title
        What it shows.
    x_label, y_label
        Of the axes, with units.
    y_range
        Ends of the vertical axis [its unit]; None for as much as the curves need.
    curves
        What is drawn, in this order.
    """

    title: str
    x_label: str
    y_label: str
    y_range: tuple[float, float] | None = None
    curves: tuple[Curve, ...]


@dataclass(frozen=True, kw_only=True)
class ReproducedFigure:
    """A figure of the source, reproduced.

    Attributes
    ----------
    number
        The source's number, such as ``"6.3"``.
    title
        What it shows, in a few words.
    caption
        What each panel and line means, and what the source leaves open.
    columns
        How many panels stand beside each other.
    panels
        Row by row; none of a sketch.
    sketch
        The system that is drawn instead of panels.
    """

    number: str
    title: str
    caption: str
    columns: int
    panels: tuple[Panel, ...]
    sketch: Sketch | None = None

    @property
    def file_name(self) -> str:
        """Name of its picture."""
        return f"figure-{self.number}.png"


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A claim in one of the ways in which the source can be read, or in one of its cases.

    Attributes
    ----------
    name
        Which one.
    agrees
        Whether the claim's criterion is met in it.
    measured
        What was measured, in words and numbers.
    """

    name: str
    agrees: bool
    measured: str


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A statement of the source beside what was measured.

    Attributes
    ----------
    place
        Where the source makes it, such as ``"6.1"`` or ``"Eq. 5.5"``.
    statement
        What it says, in own words.
    criterion
        When it is taken to agree with the measurement.
    measured
        What was measured, in words and numbers.
    agrees
        Whether the criterion is met, in every reading.
    why
        What explains it.
    numbers
        The numbers on which the verdict rests, by name [SI or -].
    readings
        The same in each way in which the source can be read, or in each case; none where there is
        one only.
    """

    place: str
    statement: str
    criterion: str
    measured: str
    agrees: bool
    why: str
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])
    readings: tuple[Reading, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", MappingProxyType(dict(self.numbers)))

    @property
    def agrees_partly(self) -> bool:
        """Whether the criterion is met in some readings, but not in all."""
        return not self.agrees and any(each.agrees for each in self.readings)


@dataclass(frozen=True, kw_only=True)
class Reproduction(ABC):
    """A part of the source, reproduced: what all parts have.

    Attributes
    ----------
    title
        What the part is about.
    setting
        With which values, in words.
    values
        The same as numbers, each with its unit [as told beside it], by group and name.
    figures, claims
        What was reproduced.
    options
        What it was asked with, such as runs and seed.
    stickslip_version
        Version of this package.
    """

    title: str
    setting: str
    values: SettingValues
    figures: tuple[ReproducedFigure, ...]
    claims: tuple[Claim, ...]
    options: Mapping[str, int]
    stickslip_version: str

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
                    "place": each.place,
                    "statement": each.statement,
                    "criterion": each.criterion,
                    "measured": each.measured,
                    "agrees": each.agrees,
                    "readings": [asdict(reading) for reading in each.readings],
                    "why": each.why,
                    "numbers": dict(each.numbers),
                }
                for each in self.claims
            ],
            **self.results(),
            "figures": [_figure_to_dict(each) for each in self.figures],
        }


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
