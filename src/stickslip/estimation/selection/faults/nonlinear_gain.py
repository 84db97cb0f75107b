"""A gain from logged to true effort that changes with the size of the effort."""

from dataclasses import dataclass

import numpy as np

from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.selection.model import Model, testable
from stickslip.estimation.selection.significance import significant_value
from stickslip.records import FrictionEstimate, mass_name

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, kw_only=True)
class NonlinearGainTuning:
    """Tuning of the test for a gain that changes with the effort."""

    smallest_change: float = 0.05
    """Relative change of the gain up to the largest effort [-], as for a sudden change."""
    smallest_share: float = 1e-3  #: Share of the effort that it must explain [-].
    largest_p_value: float = 1e-3  #: p-value of the change [-].


def nonlinear_gain(model: Model, estimate: FrictionEstimate, tuning: NonlinearGainTuning) -> str:
    """Return a note on a gain that changes with the effort; empty if there is none that matters.

    The column ``u |u| / u_max`` is added to those of the model, with the effort u of the fit, as
    noise of the logged effort would correlate with its own square. The change matters if it moves
    inertia or friction out of their intervals.
    """
    if not testable(model):
        return ""
    effort = model.fitted_effort()
    largest = max(float(np.max(np.abs(effort))), _TINY)
    curved = (effort * np.abs(effort) / largest)[:, None]
    basis = model.basis()
    partial = basis.partial(curved)
    added = significant_value(basis, partial, tuning.largest_p_value, tuning.smallest_share)
    if added is None or abs(added) < tuning.smallest_change:
        return ""
    names = [] if model.inertia is not None else [mass_name(estimate.kind)]
    names += [*(["viscous_friction"] if model.viscous else []), "coulomb_friction"]
    columns = np.column_stack([model.columns(), curved])
    values = dict(zip(names, least_squares(columns, model.target()), strict=False))
    intervals = {
        name: parameter.ci95
        for name in names
        if (parameter := estimate.parameters.get(name)) is not None and parameter.ci95 is not None
    }
    if all(low <= values[name] <= high for name, (low, high) in intervals.items()):
        return ""
    kind = "smaller" if added > 0.0 else "larger"
    return (
        f"at the largest effort the gain from logged to true effort is {100 * abs(added):.2g} % "
        f"{kind} than at small ones, or a force is nonlinear in the position; check the torque or "
        "force constant and the limits of the drive, or record moves with smaller efforts"
    )
