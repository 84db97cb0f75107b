"""Friction laws of several forms, judged by moves that they were not fitted to."""

from stickslip.estimation.regression.law_selection.fitted_law import FittedLaw
from stickslip.estimation.regression.law_selection.friction_form import FrictionForm
from stickslip.estimation.regression.law_selection.linear_fit import LinearFit
from stickslip.estimation.regression.law_selection.moves import find_moves
from stickslip.estimation.regression.law_selection.ripple import ForceRipple, force_ripple
from stickslip.estimation.regression.law_selection.selection import (
    LawCandidate,
    LawScore,
    LawSelection,
    law_candidates,
    select_friction_law,
)
from stickslip.estimation.regression.law_selection.smooth_motion import RowSettings

__all__ = [
    "FittedLaw",
    "ForceRipple",
    "FrictionForm",
    "LawCandidate",
    "LawScore",
    "LawSelection",
    "LinearFit",
    "RowSettings",
    "find_moves",
    "force_ripple",
    "law_candidates",
    "select_friction_law",
]
