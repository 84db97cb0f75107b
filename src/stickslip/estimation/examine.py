"""Data of the report of an identification."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
from jaxtyping import Float
from threadpoolctl import threadpool_limits

from stickslip.estimation.base import DetailedEstimator, Estimator
from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.energy.levels import EnergyLevels
from stickslip.estimation.figures import (
    EnergyStretch,
    ForceRows,
    VelocityLaw,
    effort_residuals,
    energy_balance,
    friction_curve,
)
from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.regression.resimulation import (
    OPTIONAL,
    can_simulate,
    identified_balance,
    identified_plant,
    resimulate,
)
from stickslip.estimation.selection.evaluation.figures import (
    energy_stretches,
    force_rows,
    velocity_law,
)
from stickslip.estimation.selection.model import Model
from stickslip.estimation.signals.kinematics import (
    LowPass,
    central_difference,
    default_cutoff,
    noise_level,
)
from stickslip.records import AxisLog, EstimateEvolution, FrictionEstimate, Identification

Stretches = Sequence[tuple[EnergyLevels, AxisLog]]
"""As `EnergyEstimator.levels` returns them."""

_EDGE_PERIODS = 2.0  # of the cutoff, at both ends of a stretch: the filter extrapolates there
_EVOLUTION_POINTS = 200  # of the evolution of an estimate [-]
_LEAST_CUTOFF = 0.02  # lowest cutoff of the data cloud over the sampling rate [-]
_CLOUD_NOISE = 0.25
"""Largest noise of the inertia force in the data cloud, over friction [-]."""


# Matrices have some ten columns: several threads of the linear algebra take longer than one, four
# times as long on a busy machine
@threadpool_limits.wrap(limits=1, user_api="blas")
def examine(
    log: AxisLog,
    estimator: Estimator,
    truth: Mapping[str, float] | None = None,
) -> Identification:
    """Fit a log and compute the data of its report.

    Parameters
    ----------
    log
        The measurement.
    estimator
        Any offline estimator. One without `details` gives the estimate only.
    truth
        True parameter values by name [SI], where the log was simulated; only passed on.

    Returns
    -------
    The estimate with friction curve, energy balance, evolution, residuals and re-simulation. They
    are absent if a parameter is not identified or the inertia is not positive. If the axis has a
    load that is not simulated, only the evolution is present. A Stribeck effect that is not
    identified is left out of them. The load of a flexible arm that is not measured is reconstructed
    from the driven mass.

    Raises
    ------
    InputError
        As ``estimator.fit`` does.
    """
    if not isinstance(estimator, DetailedEstimator):
        return Identification(log=log, estimate=estimator.fit(log), truth=truth)
    fit = estimator.details(log)
    estimate = fit.estimate
    values = {name: p.value for name, p in estimate.parameters.items() if p.value is not None}
    if fit.model is not None:
        return _with_selection(log, fit, fit.model, truth)
    needed = {name for name in estimate.parameters if not name.startswith(OPTIONAL)}
    balance = identified_balance(
        estimate,
        inertia=fit.inertia,
        load_inertia=fit.load_inertia,
        stiffness=fit.stiffness,
        stribeck=fit.stribeck,
        cutoff=fit.cutoff,
        filter_order=fit.filter_order,
    )
    if balance is None or not needed <= set(values):
        return Identification(log=log, estimate=estimate, truth=truth)
    regression = _with_columns(fit.rows, [name in values for name in fit.rows.names])
    if not can_simulate(estimate):
        evolution = _evolution(regression, estimate)
        return Identification(log=log, estimate=estimate, truth=truth, evolution=evolution)
    stretches = balance.levels(log)
    rows = _force_rows(log, estimate, balance, stretches)
    return Identification(
        log=log,
        estimate=estimate,
        truth=truth,
        curve=friction_curve(rows, _velocity_law(estimate, balance), estimate),
        energy=energy_balance(_energies(values, balance, stretches)),
        evolution=_evolution(regression, estimate),
        residuals=effort_residuals(rows),
        resimulation=resimulate(identified_plant(estimate, balance), stretches),
    )


def _with_selection(
    log: AxisLog, fit: Fit, model: Model, truth: Mapping[str, float] | None
) -> Identification:
    """Return the data of the report of a selected model.

    The motion is re-simulated only if the simulator has all terms of the model.
    """
    estimate = fit.estimate
    if not all(parameter.identified for parameter in estimate.parameters.values()):
        return Identification(log=log, estimate=estimate, truth=truth)
    rows = force_rows(estimate, model, fit.rows)
    resimulation = None
    simulated = {"direction", "stribeck"} >= set(model.names) and model.viscous
    balance = identified_balance(estimate, inertia=fit.inertia) if simulated else None
    if balance is not None:
        stretches = balance.levels(log)
        resimulation = resimulate(identified_plant(estimate, balance), stretches)
    return Identification(
        log=log,
        estimate=estimate,
        truth=truth,
        curve=friction_curve(rows, velocity_law(estimate), estimate),
        energy=energy_balance(energy_stretches(estimate, model)),
        evolution=_evolution(fit.rows, estimate),
        residuals=effort_residuals(rows),
        resimulation=resimulation,
    )


def _with_columns(regression: Regression, kept: Sequence[bool]) -> Regression:
    """Return the rows with some of their columns only."""
    return replace(
        regression,
        names=tuple(compress(regression.names, kept)),
        regressors=regression.regressors[:, kept],
        regressor_noise=regression.regressor_noise[kept],
    )


def _force_rows(
    log: AxisLog, estimate: FrictionEstimate, balance: EnergyEstimator, stretches: Stretches
) -> ForceRows:
    """Return the force balance in motion: effort less inertia and spring force, and the law."""
    T = log.sampling_time
    law = _velocity_law(estimate, balance)
    low_pass = _cloud_filter(log, estimate, balance)
    columns: list[Float[np.ndarray, "4 n"]] = []
    for levels, part in stretches:
        measured = part.measured_velocity
        if measured is None:
            velocity = central_difference(low_pass.apply(part.measured_position, T), T)
        else:
            velocity = low_pass.apply(measured, T)
        # The effort of a sample acts after it: the mean of two is the effort around it
        held = 0.5 * (part.effort + np.concatenate([part.effort[:1], part.effort[:-1]]))
        force = low_pass.apply(held - levels.spring_force, T)
        friction = force - (balance.inertia or 0.0) * central_difference(velocity, T)
        moving = ~levels.motion.resting
        edge = round(_EDGE_PERIODS / (low_pass.cutoff * T))
        moving[:edge] = False
        moving[moving.size - edge :] = False
        rows = np.vstack([part.time, velocity, friction, low_pass.apply(held, T)])
        columns.append(rows[:, moving])
    time, velocity, friction, effort = np.hstack(columns)
    return ForceRows(
        time=time,
        velocity=velocity,
        friction=friction,
        residual=friction - law.effort(velocity, np.sign(velocity)),
        effort=effort,
    )


def _velocity_law(estimate: FrictionEstimate, balance: EnergyEstimator) -> VelocityLaw:
    """Return the friction law of an estimate."""
    names = balance.terms.names
    values = np.array([estimate.value(name) for name in names])
    columns = balance.terms.force_columns
    return VelocityLaw(
        names=names, effort=lambda v, sign: columns(v, sign) @ values, columns=columns
    )


def _cloud_filter(log: AxisLog, estimate: FrictionEstimate, balance: EnergyEstimator) -> LowPass:
    """Return a low-pass under which the noise of the inertia force is small beside the friction."""
    T = log.sampling_time
    cutoff = default_cutoff(T) if balance.cutoff is None else balance.cutoff
    friction = max(
        abs(estimate.value(name)) for name in estimate.parameters if name.startswith("coulomb")
    )
    measured = log.measured_velocity
    noise = noise_level(log.measured_position if measured is None else measured)
    order = 2 if measured is None else 1
    while True:
        low_pass = LowPass(order=balance.filter_order, cutoff=cutoff)
        gain = low_pass.noise_gain(T, derivatives=order)
        small = (balance.inertia or 0.0) * noise * gain <= _CLOUD_NOISE * friction
        if small or 0.5 * cutoff * T < _LEAST_CUTOFF:
            return low_pass
        cutoff *= 0.5


def _energies(
    values: Mapping[str, float], balance: EnergyEstimator, stretches: Stretches
) -> list[EnergyStretch]:
    """Return the energies of each stretch without gaps."""
    coefficients = np.array([values[name] for name in balance.terms.names])
    return [
        EnergyStretch(
            time=part.time,
            kinetic=levels.kinetic,
            potential=levels.potential,
            dissipated=levels.dissipated,
            explained=levels.regressors @ coefficients,
        )
        for levels, part in stretches
    ]


def _evolution(regression: Regression, estimate: FrictionEstimate) -> EstimateEvolution:
    """Return the estimates from the rows up to each time, once these determine the parameters.

    Their standard deviations are those of white residuals times the factor by the correlation of
    the residuals of the whole log.
    """
    target, regressors = regression.target, regression.regressors
    n, p = regressors.shape
    columns = np.column_stack([regressors, target])
    products = np.cumsum(columns[:, :, None] * columns[:, None, :], axis=0)
    ends = np.unique(np.linspace(3 * p, n - 1, _EVOLUTION_POINTS).astype(int))
    classical = np.array([estimate.diagnostics.classical_std[name] for name in regression.names])
    honest = np.array([estimate.parameters[name].std or 0.0 for name in regression.names])
    factor = np.divide(honest, classical, out=np.ones(p), where=classical > 0)
    times: list[float] = []
    values: list[Float[np.ndarray, " p"]] = []
    stds: list[Float[np.ndarray, " p"]] = []
    for end in ends.tolist():
        gram, cross, square = products[end, :p, :p], products[end, :p, p], products[end, p, p]
        norms = np.sqrt(np.diag(gram))
        if np.any(norms == 0):
            continue
        strength, directions = np.linalg.eigh(gram / np.outer(norms, norms))
        if strength[0] < regression.smallest_singular_ratio**2 * strength[-1]:
            continue
        inverse = (directions / strength) @ directions.T / np.outer(norms, norms)
        solution = inverse @ cross
        spread = max(float(square - cross @ solution), 0.0) / (end + 1 - p)
        times.append(float(regression.time[end]))
        values.append(solution)
        stds.append(factor * np.sqrt(spread * np.diag(inverse)))
    history = np.array(values).reshape(-1, p)
    spreads = np.array(stds).reshape(-1, p)
    return EstimateEvolution(
        time=np.array(times),
        values={name: history[:, k] for k, name in enumerate(regression.names)},
        stds={name: spreads[:, k] for k, name in enumerate(regression.names)},
    )
