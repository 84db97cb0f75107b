"""Everything a report of an identification draws."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import compress

import numpy as np
from jaxtyping import Float

from stickslip.estimation.base import DetailedEstimator, Estimator
from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.energy.levels import EnergyLevels
from stickslip.estimation.fit.fitted import Fit
from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.regression.resimulation import (
    LARGEST_PLOT,
    OPTIONAL,
    identified_balance,
    identified_plant,
    resimulate,
)
from stickslip.estimation.selection.figures import energy_balance, friction_curve
from stickslip.estimation.selection.search import Model
from stickslip.estimation.signals.kinematics import (
    LowPass,
    central_difference,
    default_cutoff,
    noise_level,
)
from stickslip.records import (
    AxisLog,
    EnergyBalance,
    EstimateEvolution,
    FrictionCurve,
    FrictionEstimate,
    Identification,
    Residuals,
)

__all__ = ["examine"]

Stretches = Sequence[tuple[EnergyLevels, AxisLog]]
"""As `EnergyEstimator.levels` returns them."""

_EDGE_PERIODS = 2.0  # of the cutoff: the filter knows nothing beyond the ends
_CURVE_POINTS = 100
_EVOLUTION_POINTS = 200
_LARGEST_LAG = 100
_NORMAL_95 = 1.959963984540054
_LEAST_CUTOFF = 0.02
"""Lowest cutoff of the data cloud, as a fraction of the sampling rate."""
_CLOUD_NOISE = 0.25
"""Noise of the inertia force allowed in the data cloud, as a fraction of the friction."""


def examine(
    log: AxisLog,
    estimator: Estimator,
    truth: Mapping[str, float] | None = None,
) -> Identification:
    """Fit a log and compute all that its report shows.

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
    are left out where a parameter is not identified or the inertia is not positive; where it is a
    Stribeck effect that is not, they are drawn without one. The load of a flexible arm that is not
    measured is shown as reconstructed from the driven mass.

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
    stretches = balance.levels(log)
    return Identification(
        log=log,
        estimate=estimate,
        truth=truth,
        curve=_curve(log, estimate, balance, stretches),
        energy=_energy(values, balance, stretches),
        evolution=_evolution(regression, estimate),
        residuals=_residuals(regression, values),
        resimulation=resimulate(identified_plant(estimate, balance), stretches),
    )


def _with_selection(
    log: AxisLog, fit: Fit, model: Model, truth: Mapping[str, float] | None
) -> Identification:
    """Return what the report of a selected model shows.

    The motion is simulated anew only if the simulator has all of the model's terms.
    """
    estimate = fit.estimate
    if not all(parameter.identified for parameter in estimate.parameters.values()):
        return Identification(log=log, estimate=estimate, truth=truth)
    values = {name: estimate.value(name) for name in estimate.parameters}
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
        curve=friction_curve(estimate, model, fit.rows),
        energy=energy_balance(estimate, model),
        evolution=_evolution(fit.rows, estimate),
        residuals=_residuals(fit.rows, values),
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


def _curve(
    log: AxisLog, estimate: FrictionEstimate, balance: EnergyEstimator, stretches: Stretches
) -> FrictionCurve:
    """Return effort less inertia and spring force against velocity, and the fitted law."""
    T = log.sampling_time
    names = balance.terms.names
    values = np.array([estimate.value(name) for name in names])
    low_pass = _cloud_filter(log, estimate, balance)
    velocities: list[Float[np.ndarray, " n"]] = []
    frictions: list[Float[np.ndarray, " n"]] = []
    for levels, part in stretches:
        measured = part.measured_velocity
        if measured is None:
            velocity = central_difference(low_pass.apply(part.measured_position, T), T)
        else:
            velocity = low_pass.apply(measured, T)
        # The effort of a sample acts from then on: the mean of two is what acts around it
        held = 0.5 * (part.effort + np.concatenate([part.effort[:1], part.effort[:-1]]))
        force = low_pass.apply(held - levels.spring_force, T)
        friction = force - (balance.inertia or 0.0) * central_difference(velocity, T)
        moving = ~levels.motion.resting
        edge = round(_EDGE_PERIODS / (low_pass.cutoff * T))
        moving[:edge] = False
        moving[moving.size - edge :] = False
        velocities.append(velocity[moving])
        frictions.append(friction[moving])
    velocity, friction = np.concatenate(velocities), np.concatenate(frictions)
    step = max(-(-velocity.size // LARGEST_PLOT), 1)
    quantile = max(estimate.parameters[name].quantile for name in names)
    identified = [name for name, p in estimate.parameters.items() if p.identified]
    keep = [identified.index(name) for name in names]
    parts: list[Float[np.ndarray, "p 4"]] = []
    for end in (float(np.min(velocity)), float(np.max(velocity))):
        grid = np.linspace(end, 0.0, _CURVE_POINTS)
        columns = balance.terms.force_columns(grid, np.full(grid.size, np.sign(end)))
        law = columns @ values
        covariance = estimate.covariance[np.ix_(keep, keep)]
        variance = np.einsum("ij,jk,ik->i", columns, covariance, columns)
        half = quantile * np.sqrt(np.maximum(variance, 0.0))
        block = np.column_stack([grid, law, law - half, law + half])
        parts.append(block if end < 0 else block[::-1])
    gap = np.full((1, 4), np.nan)
    grid, law, low, high = np.vstack([parts[0], gap, parts[1]]).T
    return FrictionCurve(
        velocity=velocity[::step],
        friction=friction[::step],
        fitted_velocity=grid,
        fitted_friction=law,
        band_low=low,
        band_high=high,
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


def _energy(
    values: Mapping[str, float], balance: EnergyEstimator, stretches: Stretches
) -> EnergyBalance:
    """Return the energies over time; each stretch goes on where the one before ended."""
    coefficients = np.array([values[name] for name in balance.terms.names])
    columns: list[Float[np.ndarray, "5 n"]] = []
    reached = 0.0
    for levels, part in stretches:
        explained = reached + levels.regressors @ coefficients
        # The level of the measured energy is a constant of its own in every stretch
        measured = levels.dissipated - float(np.mean(levels.dissipated - explained))
        reached = float(explained[-1])
        columns.append(
            np.vstack([part.time, levels.kinetic, levels.potential, measured, explained])
        )
    time, kinetic, potential, measured, explained = np.hstack(columns)
    step = -(-time.size // LARGEST_PLOT)
    chosen = slice(None, None, step)
    return EnergyBalance(
        time=time[chosen],
        input=(measured + kinetic + potential)[chosen],
        kinetic=kinetic[chosen],
        potential=potential[chosen],
        measured_dissipation=measured[chosen],
        explained_dissipation=explained[chosen],
    )


def _evolution(regression: Regression, estimate: FrictionEstimate) -> EstimateEvolution:
    """Return the estimates from the rows up to each time, from when on they can be told apart.

    Their standard deviations are those of white residuals times the factor that the correlation of
    the residuals gives in the whole log.
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


def _residuals(regression: Regression, values: Mapping[str, float]) -> Residuals:
    """Return what the fit leaves unexplained, and how it is correlated in time.

    The rows of one instant, one a sensor, are put together as one of the same variance.
    """
    target, regressors = regression.target, regression.regressors
    residual = target - regressors @ np.array([values[name] for name in regression.names])
    _, counts = np.unique(regression.time, return_counts=True)
    sensors = int(counts[0]) if np.all(counts == counts[0]) else 1
    residual = residual.reshape(-1, sensors).sum(axis=1) / np.sqrt(sensors)
    time = regression.time[::sensors]
    lags = min(_LARGEST_LAG, residual.size // 4)
    spacing = float(np.median(np.diff(time)))
    step = -(-residual.size // LARGEST_PLOT)
    return Residuals(
        quantity=regression.quantity,
        time=time[::step],
        residual=residual[::step],
        lag=spacing * np.arange(lags + 1),
        autocorrelation=autocorrelation(residual, lags),
        white_bound=_NORMAL_95 / float(np.sqrt(residual.size)),
    )
