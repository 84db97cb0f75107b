"""A reproduced part of the report: its figures, its tables, and its claims beside measurements."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

__all__ = [
    "Claim",
    "Curve",
    "CurveRole",
    "FiveRuns",
    "Panel",
    "ReproducedFigure",
    "Reproduction",
    "VariantScore",
]

REPRODUCTION_SCHEMA = 1

_LEGEND = {
    "setting": "values that were simulated with; lists of moves in their order",
    "loop": "feedforward: the bang-bang input; feedback: the controller along its moves",
    "claims.numbers": "what the verdict is computed from. Names that end in f_c and c, and those "
    "of bias, rmse and error, are fractions of the true value (0.01 is 1 %); lines through e_y and "
    "energies are in J, times in s, lengths in m, correlations without unit",
    "five_runs.values": "estimates at the end of each consecutive run [N, N s/m]",
    "five_runs.itse": "integral of time-multiplied squared prediction error of each run (Eq. 6.3), "
    "over that of the first run without noise in the same loop [-]",
    "variants.noise": "of the sensors, over setting.noise [-]",
    "variants.assumed": "standard deviations that the variant was told, over the true ones [-]; "
    "null: told none",
    "variants.bias": "mean error, a fraction of the true value [-]",
    "variants.rmse": "root mean square error, a fraction of the true value [-]",
    "variants.coverage": "share of the runs whose 95 % interval holds the true value [-]; null: "
    "the variant gives no interval",
    "variants.failed": "runs in which nothing was identified; they count in nothing else",
    "figures.panels.curves": "what is drawn, in the units of the labels of the axes",
}
"""What the keys of the JSON document mean, as far as their names do not say it."""

CurveRole = Literal["truth", "first", "second", "third", "fourth"]
"""What a curve is in its panel, on which its look depends."""

Loop = Literal["feedforward", "feedback"]

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
    """

    label: str
    role: CurveRole
    x: Float[np.ndarray, " n"]
    y: Float[np.ndarray, " n"]


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
    """A figure of the report, made anew.

    Attributes
    ----------
    number
        The report's number, such as ``"6.3"``.
    title
        What it shows, in a few words.
    caption
        What each panel and line means, and what the report leaves open.
    columns
        How many panels stand beside each other.
    panels
        Row by row.
    """

    number: str
    title: str
    caption: str
    columns: int
    panels: tuple[Panel, ...]

    @property
    def file_name(self) -> str:
        """Name of its picture."""
        return f"figure-{self.number}.png"


@dataclass(frozen=True, kw_only=True)
class FiveRuns:
    """Consecutive runs of one case, each beginning with what the one before had learned.

    Attributes
    ----------
    loop
        ``"feedforward"`` or ``"feedback"``.
    case
        What is compensated, and with which standard deviations.
    values
        Estimates at the end of each run by parameter name, shape (runs,) each [SI].
    itse
        Of the prediction error of each run (Eq. 6.3), over that of the first run without noise in
        the same loop, shape (runs,) [-].
    """

    loop: Loop
    case: str
    values: Mapping[str, Float[np.ndarray, " runs"]]
    itse: Float[np.ndarray, " runs"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))


@dataclass(frozen=True, kw_only=True)
class VariantScore:
    """How one variant of the estimator does over many runs with noise.

    Attributes
    ----------
    loop
        ``"feedforward"`` or ``"feedback"``.
    variant
        What it is called.
    noise
        Of the sensors, over that of the surrogate values [-].
    assumed
        Standard deviations that the variant was told, over the true ones [-]; None if it was told
        none.
    runs
        How many there were.
    failed
        In how many of them nothing was identified; they count in nothing else.
    bias, rmse
        Mean error and root mean square error by parameter name, over the truth [-].
    coverage
        Share of runs whose 95 % interval holds the truth, by parameter name [-]; None for a variant
        that gives no interval.
    """

    loop: Loop
    variant: str
    noise: float
    assumed: float | None
    runs: int
    failed: int
    bias: Mapping[str, float]
    rmse: Mapping[str, float]
    coverage: Mapping[str, float] | None

    def __post_init__(self) -> None:
        for name in ("bias", "rmse", "coverage"):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, MappingProxyType(dict(values)))


@dataclass(frozen=True, kw_only=True)
class Claim:
    """A statement of the report beside what was measured.

    Attributes
    ----------
    place
        Where the report makes it, such as ``"6.1"`` or ``"Eq. 5.5"``.
    statement
        What it says, in own words.
    criterion
        When it is taken to agree with the measurement.
    measured
        What was measured, in words and numbers.
    agrees
        Whether the criterion is met.
    why
        What explains it.
    numbers
        The numbers on which the verdict rests, by name [SI or -].
    """

    place: str
    statement: str
    criterion: str
    measured: str
    agrees: bool
    why: str
    numbers: Mapping[str, float] = field(default_factory=dict[str, float])

    def __post_init__(self) -> None:
        object.__setattr__(self, "numbers", MappingProxyType(dict(self.numbers)))


@dataclass(frozen=True, kw_only=True)
class Reproduction:
    """A part of the report, reproduced.

    Attributes
    ----------
    title
        Which part.
    setting
        With which values, in words.
    values
        The same as numbers, each with its unit [as told beside it], by group and name.
    figures, five_runs, variants, claims
        What was reproduced.
    options
        What it was asked with: runs and seed.
    stickslip_version
        Version of this package.
    """

    title: str
    setting: str
    values: SettingValues
    figures: tuple[ReproducedFigure, ...]
    five_runs: tuple[FiveRuns, ...]
    variants: tuple[VariantScore, ...]
    claims: tuple[Claim, ...]
    options: Mapping[str, int]
    stickslip_version: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))
        values = {group: MappingProxyType(dict(of)) for group, of in self.values.items()}
        object.__setattr__(self, "values", MappingProxyType(values))

    def to_dict(self) -> dict[str, Any]:
        """Return everything as plain JSON types."""
        return {
            "schema": REPRODUCTION_SCHEMA,
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
            "legend": dict(_LEGEND),
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
                    "why": each.why,
                    "numbers": dict(each.numbers),
                }
                for each in self.claims
            ],
            "five_runs": [
                {
                    "loop": each.loop,
                    "case": each.case,
                    "values": {name: value.tolist() for name, value in each.values.items()},
                    "itse": each.itse.tolist(),
                }
                for each in self.five_runs
            ],
            "variants": [
                {
                    "loop": each.loop,
                    "variant": each.variant,
                    "noise": each.noise,
                    "assumed": each.assumed,
                    "runs": each.runs,
                    "failed": each.failed,
                    "bias": dict(each.bias),
                    "rmse": dict(each.rmse),
                    "coverage": None if each.coverage is None else dict(each.coverage),
                }
                for each in self.variants
            ],
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
