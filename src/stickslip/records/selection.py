"""The model that was selected for a log, and the score of every term that was tested."""

from dataclasses import dataclass
from typing import Literal

from stickslip.records.record import Record

__all__ = ["EffortKind", "ModelSelection", "TermScore"]

EffortKind = Literal["held", "sampled", "mean"]
"""What a logged effort is: held from its time stamp to the next, the value at its time stamp, or
the mean since the time stamp before (or held since then)."""


@dataclass(frozen=True, kw_only=True)
class TermScore(Record):
    """What one term would add to the selected model, or what it adds as a part of it.

    Attributes
    ----------
    term
        Name of the term, such as ``"stribeck"``.
    text
        What it means for the axis, in words.
    selected
        Whether the model contains it.
    p_value
        Of the hypothesis that its coefficients are zero, under correlated residuals [-].
    gain, gain_std
        Relative decrease of the squared error on moves left out of the fit, and its standard error
        [-].
    share
        Root mean square of what only this term explains, relative to that of the effort [-].
    shape
        What makes its shape [SI]: the period of a ripple, the distance of presliding, the Stribeck
        velocity; 0 if it has no shape.
    """

    term: str
    text: str
    selected: bool
    p_value: float
    gain: float
    gain_std: float
    share: float
    shape: float = 0.0


@dataclass(frozen=True, kw_only=True)
class ModelSelection(Record):
    """Which terms a log supports beyond inertia, viscous friction, Coulomb friction and offset.

    Attributes
    ----------
    summary
        One paragraph: what was selected and why.
    scores
        One a term: the selected ones in the order of their selection, then the others.
    effort_delay
        Time by which the effort acts later than it is logged [s].
    reference_time
        Time at which drifting parameters have the values given [s].
    reference_position
        Position at which a spring has no effort [m or rad].
    effort_kind
        What a logged effort was taken for: ``"held"``, ``"sampled"`` or ``"mean"``.
    """

    summary: str
    scores: tuple[TermScore, ...]
    effort_delay: float = 0.0
    reference_time: float = 0.0
    reference_position: float = 0.0
    effort_kind: EffortKind = "held"

    @property
    def selected(self) -> tuple[str, ...]:
        """Names of the selected terms, in the order of their selection."""
        return tuple(score.term for score in self.scores if score.selected)
