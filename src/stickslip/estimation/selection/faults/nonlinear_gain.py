"""A gain from logged to true effort that changes with its size, or friction that does."""

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
    """Return a note on effort that the axis loses at large efforts; empty if none that matters.

    Either the gain changes with the effort, or friction grows with it. The column
    ``u |u| / u_max`` or ``|u| sign(v)``, whichever explains more, is added to those of the model,
    with the effort u of the fit, as noise of the logged effort would correlate with its own square.
    It matters if it moves inertia or friction out of their intervals.
    """
    if not testable(model):
        return ""
    effort, basis = model.fitted_effort(), model.basis()
    largest = max(float(np.max(np.abs(effort))), _TINY)
    curves = {
        _GAIN: effort * np.abs(effort) / largest,
        _FRICTION: model.rows.direction * np.abs(effort),
    }
    explained = {text: basis.partial(curve[:, None]) for text, curve in curves.items()}
    lossy = explained[_FRICTION]
    if lossy is None or lossy.values[0] < 0.0:
        del explained[_FRICTION]
    text, partial = max(
        explained.items(), key=lambda each: 0.0 if each[1] is None else basis.share(each[1])
    )
    added = significant_value(basis, partial, tuning.largest_p_value, tuning.smallest_share)
    if added is None or abs(added) < tuning.smallest_change:
        return ""
    names = [] if model.inertia is not None else [mass_name(estimate.kind)]
    names += [*(["viscous_friction"] if model.viscous else []), "coulomb_friction"]
    columns = np.column_stack([model.columns(), curves[text]])
    values = dict(zip(names, least_squares(columns, model.target()), strict=False))
    intervals = {
        name: parameter.ci95
        for name in names
        if (parameter := estimate.parameters.get(name)) is not None and parameter.ci95 is not None
    }
    if all(low <= values[name] <= high for name, (low, high) in intervals.items()):
        return ""
    kind = "smaller" if added > 0.0 else "larger"
    return text.format(share=100 * abs(added), kind=kind)


_GAIN = (
    "at the largest effort the gain from logged to true effort is {share:.2g} % {kind} than at "
    "small ones, or a force is nonlinear in the position; check the torque or force constant and "
    "the limits of the drive, or record moves with smaller efforts"
)
_FRICTION = (
    "friction grows by {share:.2g} % of the effort, as that of a worm gear or of a screw does, "
    "which no term describes; record moves with smaller accelerations and loads"
)
