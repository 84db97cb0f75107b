"""Expected precision of friction parameters from a recorded motion, before a full fit."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.point_estimate import NORMAL_95
from stickslip.estimation.selection.dwell import (
    Breakaway,
    DwellTuning,
    RestedLog,
    breakaways,
    rests_of,
)
from stickslip.estimation.selection.estimator import SelectedModelEstimator
from stickslip.estimation.weak_form.motion import slip_motions
from stickslip.records import AxisLog, ExpectedPrecision, FrictionEstimate, InputError, mass_name


@dataclass(frozen=True, kw_only=True)
class CheckTuning:
    """Tuning of the prediction."""

    margin: float = 2.0
    """Interval of the default estimator over the bound, the median over 30 simulated axes [-]. With
    it 6 of 82 predictions that a parameter is identified to 5 % were wrong, and 2 of 8 that it is
    not; with 1.6 these are 7 of 83 and 2 of 7, with 3 they are 4 of 78 and 4 of 12."""
    fewest_breakaways: int = 6  #: Fewest starts from rest for a prediction of static friction [-].
    longer: float = 6.0  #: Largest factor of the duration with which a longer log is advised [-].
    most_lags: int = 200  #: Lags of the residual for its correlation time [rows].
    smallest_ratio: float = 1e-9
    """Smallest over largest singular value of the regressors [-]: below it nothing is predicted."""


_DEFAULT = CheckTuning()


def expected_precision(
    log: AxisLog, *, limit: float = 0.05, tuning: CheckTuning = _DEFAULT
) -> tuple[ExpectedPrecision, ...]:
    """Return the expected precision of mass, viscous, Coulomb and static friction, in this order.

    The bound of a mass and Coulomb and viscous friction is that of the regression of the effort on
    acceleration, velocity and direction over the recorded motion, with a Gaussian residual of the
    spectral density of that of a first fit: ``(X' X)^-1 s^2 tau``, where ``tau`` is the
    correlation time of the residual in rows. Its half width is multiplied by the ratio of the
    intervals of the default estimator to it. Static friction is bounded by the efforts at which the
    axis starts from rest, with the uncertainty of the time of each start. A half width of at most
    ``limit`` of the value is sufficient.
    """
    estimator = SelectedModelEstimator(select=False)
    found = estimator.details(log)
    rows, mass = found.rows, mass_name(log.kind)
    names = list(rows.names)
    values, half = _bound(rows, tuning)
    result: list[ExpectedPrecision] = []
    for name in (mass, "viscous_friction", "coulomb_friction"):
        if name not in names:
            result.append(_unknown(name, _ADVICE[name]))
            continue
        k = names.index(name)
        result.append(_judged(name, float(values[k]), float(half[k]), log, limit, tuning))
    result.append(_static(log, estimator, found.estimate, limit, tuning))
    return tuple(result)


_ADVICE = {
    "mass": "reverse more sharply: the inertia force should be a third of the effort",
    "inertia": "reverse more sharply: the inertia torque should be a third of the effort",
    "viscous_friction": "move at several speeds, of which the fastest is five times the slowest",
    "coulomb_friction": "move in both directions, also slowly",
    "static_friction": "stop the axis ten times or more for 0.2 s, and raise the effort slowly "
    "until it starts",
}
"""Motion that excites each parameter."""


def _bound(
    rows: Regression, tuning: CheckTuning
) -> tuple[Float[np.ndarray, " p"], Float[np.ndarray, " p"]]:
    """Return least-squares parameters and expected half widths of 95 % intervals [SI]."""
    columns, target = rows.regressors, rows.target
    n, p = columns.shape
    if n <= 2 * p:
        return np.zeros(p), np.full(p, np.inf)
    norms = np.linalg.norm(columns, axis=0)
    norms[norms == 0.0] = 1.0
    left, singular, right = np.linalg.svd(columns / norms, full_matrices=False)
    if singular[-1] < tuning.smallest_ratio * singular[0]:
        return np.zeros(p), np.full(p, np.inf)
    values = (right.T / singular) @ (left.T @ target) / norms
    residual = target - columns @ values
    lags = min(n - 1, tuning.most_lags)
    correlation = np.asarray(autocorrelation(residual, lags))[1:]
    ends = np.flatnonzero(correlation <= 0.0)  # noise beyond
    correlation = correlation[: ends[0]] if ends.size else correlation
    variance = float(residual @ residual) / (n - p) * (1.0 + 2.0 * float(np.sum(correlation)))
    covariance = (right.T / singular**2) @ right * variance
    half = tuning.margin * NORMAL_95 * np.sqrt(np.diag(covariance)) / norms
    return values, half


def _judged(
    name: str, value: float, half: float, log: AxisLog, limit: float, tuning: CheckTuning
) -> ExpectedPrecision:
    """Return the precision of a parameter, with advice if it is insufficient."""
    if not np.isfinite(half) or value <= 0.0:
        return _unknown(name, _ADVICE[name])
    relative = half / value
    advice = ""
    if relative > limit:
        factor = (relative / limit) ** 2
        advice = _ADVICE[name]
        if factor <= tuning.longer:
            advice = f"record {factor * log.duration:.2g} s of such a motion, or {advice}"
    return ExpectedPrecision(
        parameter=name,
        value=value,
        half_width=half,
        relative=relative,
        sufficient=relative <= limit,
        advice=advice,
    )


def _unknown(name: str, advice: str) -> ExpectedPrecision:
    return ExpectedPrecision(
        parameter=name, value=None, half_width=None, relative=None, sufficient=False, advice=advice
    )


def _static(
    log: AxisLog,
    estimator: SelectedModelEstimator,
    estimate: FrictionEstimate,
    limit: float,
    tuning: CheckTuning,
) -> ExpectedPrecision:
    """Return the precision of static friction from the starts of the axis from rest."""
    name = "static_friction"
    coulomb = estimate.parameters.get("coulomb_friction")
    if coulomb is None or coulomb.value is None:
        return _unknown(name, f"resolved starts from rest: 0; {_ADVICE[name]}")
    found = _starts(log, estimator, estimate)
    if len(found) < tuning.fewest_breakaways:
        return _unknown(name, f"resolved starts from rest: {len(found)}; {_ADVICE[name]}")
    levels = np.array([each.level for each in found])
    stds = np.array([each.std for each in found])
    value = float(np.mean(levels)) + coulomb.value
    spread = float(np.std(levels, ddof=1))
    std = max(spread, float(np.sqrt(np.mean(stds**2)))) / np.sqrt(levels.size)
    half = tuning.margin * NORMAL_95 * float(np.hypot(std, coulomb.std or 0.0))
    return _judged(name, value, half, log, limit, tuning)


def _starts(
    log: AxisLog, estimator: SelectedModelEstimator, estimate: FrictionEstimate
) -> list[Breakaway]:
    """Return the resolved starts from rest; none if a parameter of the model is not identified."""
    mass = estimate.parameters[mass_name(log.kind)].value
    if mass is None:
        return []
    prepared, tuning = estimator.prepared(log), DwellTuning()
    motions = slip_motions(prepared, estimator.tuning.motion)
    own = RestedLog(log=prepared, motions=motions, estimate=estimate)
    try:
        return breakaways([*rests_of(own, tuning)], mass, tuning)
    except InputError:
        return []
