"""Friction over velocity and energies over time, as a selected model explains them."""

from collections.abc import Mapping

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.selection.law import is_velocity_term, law_columns, law_effort
from stickslip.estimation.selection.motion import SlipMotion
from stickslip.estimation.selection.search import Model
from stickslip.estimation.selection.terms import DELAY, SATURATION
from stickslip.records import EnergyBalance, FrictionCurve, FrictionEstimate

__all__ = ["energy_balance", "friction_curve"]

_CURVE_POINTS = 100
_LARGEST_PLOT = 4000  # points: more than a screen shows


def friction_curve(
    estimate: FrictionEstimate, model: Model, regression: Regression
) -> FrictionCurve:
    """Return the effort of each window less inertia, delay and forces of position, and the law.

    Parameters
    ----------
    estimate
        With all parameters of the law identified.
    model, regression
        Behind it.
    """
    values = _values(estimate)
    velocity = model.rows.velocity
    other = [k for k, name in enumerate(regression.names) if not is_velocity_term(name)]
    explained = regression.regressors[:, other] @ np.array(
        [values[regression.names[k]] for k in other]
    )
    friction = regression.target - explained
    if "stribeck_velocity" in values:  # its column is a derivative; the law is in the others
        k = regression.names.index("stribeck_velocity")
        friction = friction - regression.regressors[:, k] * values["stribeck_velocity"]
    names = [name for name in estimate.parameters if is_velocity_term(name)]
    identified = [name for name, p in estimate.parameters.items() if p.identified]
    keep = [identified.index(name) for name in names]
    covariance = estimate.covariance[np.ix_(keep, keep)]
    quantile = max(estimate.parameters[name].quantile for name in names)
    parts: list[Float[np.ndarray, "p 4"]] = []
    ends = [float(np.min(velocity)), float(np.max(velocity))]
    for end in (end for end, way in zip(ends, (-1.0, 1.0), strict=True) if end * way > 0):
        grid = np.linspace(end, 0.0, _CURVE_POINTS)
        sign = np.full(grid.size, np.sign(end))
        law = law_effort(values, grid, sign)
        columns = law_columns(names, grid, sign, values)
        variance = np.einsum("ij,jk,ik->i", columns, covariance, columns)
        half = quantile * np.sqrt(np.maximum(variance, 0.0))
        block = np.column_stack([grid, law, law - half, law + half])
        parts.append(block if end < 0 else block[::-1])
    if len(parts) > 1:
        parts.insert(1, np.full((1, 4), np.nan))
    grid, law, low, high = np.vstack(parts).T
    step = -(-velocity.size // _LARGEST_PLOT)
    return FrictionCurve(
        velocity=velocity[::step],
        friction=friction[::step],
        fitted_velocity=grid,
        fitted_friction=law,
        band_low=low,
        band_high=high,
    )


def energy_balance(estimate: FrictionEstimate, model: Model) -> EnergyBalance:
    """Return the energies over time; each stretch goes on where the one before ended.

    Parameters
    ----------
    estimate
        With all parameters identified.
    model
        Behind it.
    """
    values = _values(estimate)
    inertia = values.get("mass", values.get("inertia", model.inertia or 0.0))
    T = model.rows.weight.sampling_time
    parts: list[Float[np.ndarray, "5 n"]] = []
    reached = 0.0
    for motion in model.rows.motions:
        at = motion.time - model.rows.delay * T
        steps = np.diff(motion.position)
        held = motion.effort[np.clip(np.searchsorted(motion.time, at, "right") - 1, 0, None)]
        work = _summed(held[:-1] * steps)
        kinetic = 0.5 * inertia * motion.velocity**2
        effort = _explained(values, model, motion)
        explained = reached + _summed(0.5 * (effort[1:] + effort[:-1]) * steps)
        dissipated = work - kinetic
        # The level of the measured energy is a constant of its own in every stretch
        measured = dissipated - float(np.mean(dissipated - explained))
        reached = float(explained[-1])
        parts.append(np.vstack([motion.time, kinetic, 0.0 * kinetic, measured, explained]))
    time, kinetic, potential, measured, explained = np.hstack(parts)
    chosen = slice(None, None, -(-time.size // _LARGEST_PLOT))
    return EnergyBalance(
        time=time[chosen],
        input=(measured + kinetic + potential)[chosen],
        kinetic=kinetic[chosen],
        potential=potential[chosen],
        measured_dissipation=measured[chosen],
        explained_dissipation=explained[chosen],
    )


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
        if term.name in {DELAY, SATURATION} or any(is_velocity_term(n) for n in shape.names):
            continue
        for name, column in zip(shape.names, shape.columns, strict=True):
            effort = effort + values.get(name, 0.0) * column(motion)
    return effort
