"""Forces and energies of a log, as a selected model explains them, for its report."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from stickslip.estimation.figures import EnergyStretch, ForceRows, VelocityLaw
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.terms import DELAY, ELASTIC, SATURATION
from stickslip.estimation.weak_form.motion import SlipMotion
from stickslip.friction.estimated_law import (
    SHAPES,
    is_velocity_term,
    law_columns,
    law_effort,
)
from stickslip.records import FrictionEstimate


def force_rows(estimate: FrictionEstimate, model: Model, regression: Regression) -> ForceRows:
    """Return the effort of each window less inertia, delay and forces of position.

    All parameters of the law must be identified.
    """
    values = _values(estimate)
    other = [k for k, name in enumerate(regression.names) if not is_velocity_term(name)]
    explained = regression.regressors[:, other] @ np.array(
        [values[regression.names[k]] for k in other]
    )
    friction = regression.target - explained
    for name in SHAPES:
        if name in values:  # its column is a derivative; the law is in the others
            k = regression.names.index(name)
            friction = friction - regression.regressors[:, k] * values[name]
    residual = regression.target - regression.regressors @ np.array(
        [values[name] for name in regression.names]
    )
    return ForceRows(
        time=model.rows.time,
        velocity=model.rows.velocity,
        friction=friction,
        residual=residual,
        effort=model.rows.own_effort,
    )


def velocity_law(estimate: FrictionEstimate) -> VelocityLaw:
    """Return the friction law of an estimate.

    All parameters of the law must be identified.
    """
    values = _values(estimate)
    names = [name for name in estimate.parameters if is_velocity_term(name)]
    return VelocityLaw(
        names=names,
        effort=lambda velocity, sign: law_effort(values, velocity, sign),
        columns=lambda velocity, sign: law_columns(names, velocity, sign, values),
    )


def energy_stretches(estimate: FrictionEstimate, model: Model) -> list[EnergyStretch]:
    """Return the energies of each stretch without gaps.

    All parameters must be identified.
    """
    values = _values(estimate)
    inertia = values.get("mass", values.get("inertia", model.inertia or 0.0))
    T = model.rows.weight.sampling_time
    stretches: list[EnergyStretch] = []
    for motion in model.rows.motions:
        at = motion.time - (model.rows.delay - model.rows.weight.lead) * T
        steps = np.diff(motion.position)
        held = motion.effort[np.clip(np.searchsorted(motion.time, at, "right") - 1, 0, None)]
        stated = 0.5 * (motion.model_effort[1:] + motion.model_effort[:-1])
        kinetic = 0.5 * inertia * motion.velocity**2
        effort = _explained(values, model, motion)
        stretches.append(
            EnergyStretch(
                time=motion.time,
                kinetic=kinetic,
                potential=0.0 * kinetic,
                dissipated=_summed((held[:-1] - stated) * steps) - kinetic,
                explained=_summed(0.5 * (effort[1:] + effort[:-1]) * steps),
            )
        )
    return stretches


def _values(estimate: FrictionEstimate) -> dict[str, float]:
    return {name: p.value for name, p in estimate.parameters.items() if p.value is not None}


def _summed(increments: Float[np.ndarray, " m"]) -> Float[np.ndarray, " n"]:
    return np.concatenate([[0.0], np.cumsum(increments)])


def _explained(
    values: Mapping[str, float], model: Model, motion: SlipMotion
) -> Float[np.ndarray, " n"]:
    """Return the effort of all terms but the inertia's, sample by sample [N or N m]."""
    effort = law_effort(values, motion.velocity, np.sign(motion.velocity))
    for term, shape in model.chosen:
        if term.name in {DELAY, ELASTIC, SATURATION} or any(
            is_velocity_term(n) for n in shape.names
        ):
            continue
        for name, column in zip(shape.names, shape.columns, strict=True):
            effort = effort + values.get(name, 0.0) * column(motion)
    return effort
