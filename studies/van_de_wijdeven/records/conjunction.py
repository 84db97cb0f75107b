"""The conjunction of the source, worked out: series of pulses, landings, and its rivals."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.records import quantity_field
from stickslip.records.record import Record
from studies.van_de_wijdeven.records.landing_score import LandingScore
from studies.van_de_wijdeven.records.reproduction import Reproduction, form_with

_LEGEND = {
    "reference_series": "series that take the arm of the reference points 1 m from rest to rest",
    "reference_series.expected_duration": "the duration to be reached [s]",
    "reference_series.residual": "what the exact simulation leaves, of either mass's position and "
    "of the swing, the largest [m]",
    "friction_errors": "what the fastest of them leaves if the Coulomb friction is not as guessed",
    "friction_errors.friction_error": "true Coulomb friction over the guessed one, less 1",
    "friction_errors.expected_error": "the final position of mass 1 less the target, as known for "
    "another series of the same duration [m]",
    "friction_errors.expected_swing": "the same of the amplitude of mass 2 about mass 1 [m]",
    "successive_series": "series after series to the same target, the first Coulomb friction "
    "guessed wrong",
    "successive_series.friction_error": "initial Coulomb friction over the true one, less 1",
    "successive_series.learning": "whether the estimates are updated after each series",
    "successive_series.error": "of mass 1 after each series [m]",
    "successive_series.swing": "of mass 2 about mass 1 after each series [m]",
    "landing_scores": "controllers on random arms",
    "landing_scores.error_1": "the farthest that mass 1 was from the target while watched, over "
    "the move",
    "landing_scores.time_ratio": "time to land over the shortest possible; null: none landed",
}


@dataclass(frozen=True, kw_only=True)
class ReferenceSeries(Record):
    """A series whose shortest duration is known."""

    pulse_width: float = quantity_field("time")  #: Of each pulse.
    pulses: int  #: How many.
    #: Known, and planned.
    expected_duration: float = quantity_field("time")
    duration: float = quantity_field("time")
    impulse: float  #: Time integral of the effort's magnitude [N s].
    peak_effort: float = quantity_field("effort")  #: Its largest magnitude.
    #: Largest error of the exact simulation, of either mass's position and of the swing.
    residual: float = quantity_field("position")


@dataclass(frozen=True, kw_only=True)
class FrictionErrorEffect(Record):
    """Error after a series if the Coulomb friction is not as guessed."""

    friction_error: float  #: True Coulomb friction over the guessed one, less 1 [-].
    #: Values of another series of the same duration.
    expected_error: float = quantity_field("position")
    expected_swing: float = quantity_field("position")
    error: float = quantity_field("position")  #: Final position of mass 1 less the target.
    swing: float = quantity_field("position")  #: Amplitude of mass 2 about mass 1.


@dataclass(frozen=True, kw_only=True)
class SuccessiveSeries(Record):
    """Successive series to one target with a wrong initial Coulomb friction."""

    friction_error: float  #: Initial Coulomb friction over the true one, less 1 [-].
    #: Whether the estimates are updated after each series; otherwise they are constant.
    learning: bool
    #: Of mass 1, and of mass 2 about it, after each series, shape (k,).
    error: Float[np.ndarray, " k"] = quantity_field("position")
    swing: Float[np.ndarray, " k"] = quantity_field("position")


@dataclass(frozen=True, kw_only=True)
class ConjunctionReproduction(Reproduction):
    """Method that the concluding remarks of the source sketch, reproduced."""

    part, own_legend = "conjunction", _LEGEND
    json_form = form_with(
        "reference_series friction_errors successive_series landing_scores how_compared"
    )

    reference_series: tuple[ReferenceSeries, ...]  #: Series whose shortest durations are known.
    #: Error of the fastest of them if the Coulomb friction is not as guessed.
    friction_errors: tuple[FrictionErrorEffect, ...]
    #: Successive series, with constant and with updated estimates.
    successive_series: tuple[SuccessiveSeries, ...]
    landing_scores: tuple[LandingScore, ...]  #: Controllers on random arms.
    how_compared: str  #: How those were tuned and judged, in words.
