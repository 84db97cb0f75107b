"""Part A of the source, reproduced: what estimators learn in a row, and how their variants do."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np
from jaxtyping import Float

from stickslip.records.record import Record
from studies.van_de_wijdeven.records.reproduction import Reproduction, form_with

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
class FiveRuns(Record):
    """Consecutive runs of one case, each beginning with what the one before had learned."""

    loop: Loop  #: ``"feedforward"`` or ``"feedback"``.
    case: str  #: What is compensated, and with which standard deviations.
    #: Estimates at the end of each run by parameter name, shape (runs,) each [SI].
    values: Mapping[str, Float[np.ndarray, " runs"]]
    #: Of the prediction error of each run (Eq. 6.3), over that of the first run without noise in
    #: the same loop, shape (runs,) [-].
    itse: Float[np.ndarray, " runs"]


@dataclass(frozen=True, kw_only=True)
class VariantScore(Record):
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


@dataclass(frozen=True, kw_only=True)
class EnergyReproduction(Reproduction):
    """Part A of the source, reproduced."""

    part, own_legend = "A", _LEGEND
    json_form = form_with("five_runs variants")

    #: Results beside figures and claims.
    five_runs: tuple[FiveRuns, ...]
    variants: tuple[VariantScore, ...]
