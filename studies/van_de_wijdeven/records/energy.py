"""Part A of the source, reproduced: what estimators learn in a row, and how their variants do."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from studies.van_de_wijdeven.records.reproduction import Reproduction

Loop = Literal["feedforward", "feedback"]

_LEGEND = {
    "loop": "feedforward: the bang-bang input; feedback: the controller along its moves",
    "five_runs.values": "estimates at the end of each consecutive run [N, N s/m]",
    "five_runs.itse": "integral of time-multiplied squared prediction error of each run (Eq. 6.3), "
    "over that of the first run without noise in the same loop [-]",
    "variants.noise": "of the sensors, over setting.noise [-]",
    "variants.assumed": "standard deviations that the variant was given, over the true ones [-]; "
    "null: given none",
    "variants.bias": "mean error, a fraction of the true value [-]",
    "variants.rmse": "root mean square error, a fraction of the true value [-]",
    "variants.coverage": "share of the runs whose 95 % interval holds the true value [-]; null: "
    "the variant gives no interval",
    "variants.failed": "runs in which nothing was identified; they count in nothing else",
}


@dataclass(frozen=True, kw_only=True)
class FiveRuns:
    """Consecutive runs of one case, each beginning with what the one before had learned."""

    loop: Loop  #: ``"feedforward"`` or ``"feedback"``.
    case: str  #: What is compensated, and with which standard deviations.
    #: Estimates at the end of each run by parameter name, shape (runs,) each [SI].
    values: Mapping[str, Float[np.ndarray, " runs"]]
    #: Of the prediction error of each run (Eq. 6.3), over that of the first run without noise in
    #: the same loop, shape (runs,) [-].
    itse: Float[np.ndarray, " runs"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", MappingProxyType(dict(self.values)))


@dataclass(frozen=True, kw_only=True)
class VariantScore:
    """How one variant of the estimator does over many runs with noise."""

    loop: Loop  #: ``"feedforward"`` or ``"feedback"``.
    variant: str  #: What it is called.
    noise: float  #: Of the sensors, over that of the surrogate values [-].
    #: Standard deviations that the variant was given, over the true ones [-]; None if it was given
    #: none.
    assumed: float | None
    runs: int  #: How many there were.
    failed: int  #: In how many of them nothing was identified; they count in nothing else.
    #: Mean error and root mean square error by parameter name, over the truth [-].
    bias: Mapping[str, float]
    rmse: Mapping[str, float]
    #: Share of runs whose 95 % interval holds the truth, by parameter name [-]; None for a variant
    #: that gives no interval.
    coverage: Mapping[str, float] | None

    def __post_init__(self) -> None:
        for name in ("bias", "rmse", "coverage"):
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, MappingProxyType(dict(values)))


@dataclass(frozen=True, kw_only=True)
class EnergyReproduction(Reproduction):
    """Part A of the source, reproduced."""

    #: Results beside figures and claims.
    five_runs: tuple[FiveRuns, ...]
    variants: tuple[VariantScore, ...]

    @property
    def part(self) -> Literal["A"]:
        """Which part of the source."""
        return "A"

    def legend(self) -> dict[str, str]:
        """Return what the keys of this part's own results mean."""
        return dict(_LEGEND)

    def results(self) -> dict[str, Any]:
        """Return this part's own results, by their key, as plain JSON types."""
        return {
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
        }
