"""Another law of viscous friction that explains a log as well."""

from dataclasses import dataclass, replace

import numpy as np

from stickslip.estimation.selection.search import BENDS, Model
from stickslip.estimation.selection.significance import held_out_errors
from stickslip.estimation.selection.terms import two_thirds_term

__all__ = ["RivalTuning", "rival_law"]


@dataclass(frozen=True, kw_only=True)
class RivalTuning:
    """Tuning of the search for a rival law."""

    largest_deviations: float = 1.0
    """Largest excess of the error on moves left out over that of the selected law, in standard
    errors [-] (one-standard-error rule)."""
    smallest_difference: float = 0.05
    """Of Coulomb friction [-]: a smaller one is not worth a note."""
    fewest_moves: int = 4
    """Of which one is left out at a time, for a standard error [-]."""


def rival_law(model: Model, unit: str, tuning: RivalTuning) -> str:
    """Return a note on the other of viscous friction and the 2/3 power of the speed.

    The two laws differ most below the driven speeds, so that Coulomb friction, the value at rest,
    depends on which of them is meant.

    Parameters
    ----------
    model
        As selected.
    unit
        Of the effort.
    tuning
        What makes a rival.

    Returns
    -------
    Empty if the log distinguishes the laws, or they agree about Coulomb friction.
    """
    rival = _other(model)
    if rival is None or model.rows.moves < tuning.fewest_moves:
        return ""
    if any(not shape.allows(rival.coefficients(term.name)) for term, shape in rival.chosen):
        return ""
    move = model.rows.folds
    worse = held_out_errors(rival.columns(), rival.target(), move)
    worse -= held_out_errors(model.columns(), model.target(), move)
    spread = float(np.std(worse, ddof=1)) * float(np.sqrt(worse.size))
    own, other = model.friction()[0], rival.friction()[0]
    far = float(np.sum(worse)) > tuning.largest_deviations * spread
    if far or abs(other - own) <= tuning.smallest_difference * abs(own):
        return ""
    law = "viscous friction" if rival.viscous else "friction with the 2/3 power of the speed"
    return (
        f"{law} explains this log as well, with Coulomb friction {other:.4g} {unit} instead of "
        f"{own:.4g} {unit}; record moves at more speeds to distinguish them"
    )


def _other(model: Model) -> Model | None:
    """Return the model with the other law; None if it has neither alone."""
    bends = [name for name in model.names if name in BENDS]
    if model.viscous and not bends:
        term = two_thirds_term()
        return replace(model, viscous=False, chosen=(*model.chosen, (term, term.shapes[0])))
    if not model.viscous and bends == ["two-thirds"]:
        chosen = tuple(pair for pair in model.chosen if pair[0].name != "two-thirds")
        return replace(model, viscous=True, chosen=chosen)
    return None
