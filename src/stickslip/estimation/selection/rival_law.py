"""Another law of viscous friction that explains a log as well."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import robust_uncertainty
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.search import BENDS, Model
from stickslip.estimation.selection.terms import two_thirds_term

__all__ = ["Rival", "RivalTuning", "rival_law", "rival_note", "rival_shift"]


@dataclass(frozen=True, kw_only=True)
class RivalTuning:
    """Tuning of what a rival law changes."""

    smallest_difference: float = 0.05
    """Of Coulomb friction [-]: a smaller one is not worth a note."""


@dataclass(frozen=True, kw_only=True)
class Rival:
    """The model with the other law of viscous friction, and its weight.

    Attributes
    ----------
    model
        With the other of viscous friction and the 2/3 power of the speed.
    weight, std
        Least-squares weight w of the other law, and its standard error [-] (`rival_law`).
    """

    model: Model
    weight: float
    std: float

    @property
    def explains_as_well(self) -> bool:
        """Whether the log prefers the selected law by one standard error at most."""
        return self.weight > 0.5 - self.std

    @property
    def explains_more(self) -> bool:
        """Whether the residual decreases with the other law, by more than one standard error."""
        return self.weight > self.std


def rival_law(model: Model) -> Rival | None:
    """Return the model with the other of viscous friction and the 2/3 power of the speed.

    Both laws are nested in ``y = y_own + w (y_other - y_own)``, where y are the fitted efforts: the
    weight w is 0 where the selected law is right, 1 where the other one is, and one half where both
    leave the same residual (J test: R. Davidson and J. G. MacKinnon 1981, "Several tests for model
    specification in the presence of alternative hypotheses", Econometrica 49(3), 781-793). Its
    standard error is that of correlated residuals.

    Parameters
    ----------
    model
        As selected.

    Returns
    -------
    None if the other law has friction of the wrong sign or the fit of the selected one, or if the
    model has another bend of the friction curve.
    """
    rival = _other(model)
    if rival is None or model.rows.size <= model.columns().shape[1] + 1:
        return None
    signs = [shape.allows(rival.coefficients(term.name)) for term, shape in rival.chosen]
    if not all(signs) or rival.friction()[0] <= 0.0:
        return None
    basis, columns = model.basis(), rival.columns()
    partial = basis.partial((columns @ least_squares(columns, rival.target()))[:, None])
    if partial is None or partial.values[0] == 0.0:
        return None
    vectors = np.column_stack([basis.vectors, partial.vectors])
    residual = basis.residual - partial.vectors @ partial.coordinates
    size = float(partial.coordinates[0] / partial.values[0])
    to_weight = np.eye(vectors.shape[1])[-1:] / size
    found = robust_uncertainty(vectors, to_weight, residual, slow=True)
    std = float(np.sqrt(found.covariance[0, 0]))
    return Rival(model=rival, weight=float(partial.values[0]), std=std)


def rival_note(model: Model, rival: Rival, unit: str, tuning: RivalTuning) -> str:
    """Return a note on a law that explains the log as well.

    The laws differ most below the driven speeds, so that Coulomb friction, the value at rest,
    depends on which of them is meant.

    Parameters
    ----------
    model, rival
        As selected, and as `rival_law` returns it.
    unit
        Of the effort.
    tuning
        What is worth a note.

    Returns
    -------
    Empty if the log distinguishes the laws, or they agree about Coulomb friction.
    """
    own, other = model.friction()[0], rival.model.friction()[0]
    alike = abs(other - own) <= tuning.smallest_difference * abs(own)
    if alike or not rival.explains_as_well:
        return ""
    law = "viscous friction" if rival.model.viscous else "friction with the 2/3 power of the speed"
    return (
        f"{law} explains this log as well, with Coulomb friction {other:.4g} {unit} instead of "
        f"{own:.4g} {unit}; record moves at more speeds to distinguish them"
    )


def rival_shift(rows: ModelRows, other: ModelRows, rival: Rival) -> Float[np.ndarray, " p"] | None:
    """Return the difference to the parameters of the other law [SI].

    Half of its square is the variance between the models about the selected one (S. T. Buckland,
    K. P. Burnham and N. H. Augustin 1997, "Model selection: an integral part of inference",
    Biometrics 53(2), 603-618). A parameter that the other law lacks is zero there.

    Parameters
    ----------
    rows, other
        Of the selected model and of its rival.
    rival
        As `rival_law` returns it.

    Returns
    -------
    None if the log distinguishes the laws, or does not speak for the other one at all.
    """
    if not (rival.explains_as_well and rival.explains_more):
        return None
    values = dict(zip(other.names, other.values().tolist(), strict=True))
    return np.array([values.get(name, 0.0) for name in rows.names]) - rows.values()


def _other(model: Model) -> Model | None:
    """Return the model with the other law; None if it has neither alone."""
    bends = [name for name in model.names if name in BENDS]
    if model.viscous and not bends and "direction" not in model.names:
        term = two_thirds_term()
        return replace(model, viscous=False, chosen=(*model.chosen, (term, term.shapes[0])))
    if not model.viscous and bends == ["two-thirds"]:
        chosen = tuple(pair for pair in model.chosen if pair[0].name != "two-thirds")
        return replace(model, viscous=True, chosen=chosen)
    return None
