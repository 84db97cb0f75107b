"""Data of the reports of all estimators: friction over velocity, energies, residual effort."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.fit.intervals import autocorrelation
from stickslip.records import EnergyBalance, FrictionCurve, FrictionEstimate, Residuals

LARGEST_PLOT = 4000
"""Most points of a curve [-]: more make the page larger, and are not visible."""

_CURVE_POINTS = 100  # of the fitted law in each direction [-]
_LARGEST_LAG = 100  # of the autocorrelation [rows]
_NORMAL_95 = 1.959963984540054  # half of a 95 % interval over the standard deviation [-]


@dataclass(frozen=True, kw_only=True)
class ForceRows:
    """The force balance of an axis in motion, in the band of a low-pass or of windows."""

    time: Float[np.ndarray, " n"]  #: Shape (n,) [s].
    velocity: Float[np.ndarray, " n"]  #: Shape (n,) [m/s or rad/s].
    #: Effort less all forces but friction, shape (n,) [N or N m].
    friction: Float[np.ndarray, " n"]
    #: Effort that the estimate does not explain, shape (n,) [N or N m].
    residual: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n"]  #: Shape (n,) [N or N m].


@dataclass(frozen=True, kw_only=True)
class VelocityLaw:
    """Friction as a function of velocity."""

    names: Sequence[str]  #: Its parameters.
    #: Friction at velocities and directions, shapes (n,) [N or N m].
    effort: Callable[[Float[np.ndarray, " n"], Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]
    #: Its derivatives by the parameters there, shape (n, p) [SI].
    columns: Callable[[Float[np.ndarray, " n"], Float[np.ndarray, " n"]], Float[np.ndarray, "n p"]]


@dataclass(frozen=True, kw_only=True)
class EnergyStretch:
    """Energies of one stretch without gaps."""

    time: Float[np.ndarray, " n"]  #: Shape (n,) [s].
    kinetic: Float[np.ndarray, " n"]  #: Shape (n,) [J].
    potential: Float[np.ndarray, " n"]  #: Shape (n,) [J].
    #: Work less kinetic and potential energy, up to a constant, shape (n,) [J].
    dissipated: Float[np.ndarray, " n"]
    #: Energy dissipated by the identified terms since the start, shape (n,) [J].
    explained: Float[np.ndarray, " n"]


def friction_curve(rows: ForceRows, law: VelocityLaw, estimate: FrictionEstimate) -> FrictionCurve:
    """Return friction against velocity, and the law with its 95 % band; the law is identified."""
    identified = [name for name, p in estimate.parameters.items() if p.identified]
    keep = [identified.index(name) for name in law.names]
    covariance = estimate.covariance[np.ix_(keep, keep)]
    # The quantile of an interval that contains another law's value may be below the normal one
    quantile = max(_NORMAL_95, *(estimate.parameters[name].quantile for name in law.names))
    parts: list[Float[np.ndarray, "p 4"]] = []
    ends = [float(np.min(rows.velocity)), float(np.max(rows.velocity))]
    for end in (end for end, way in zip(ends, (-1.0, 1.0), strict=True) if end * way > 0):
        grid = np.linspace(end, 0.0, _CURVE_POINTS)
        sign = np.full(grid.size, np.sign(end))
        friction, columns = law.effort(grid, sign), law.columns(grid, sign)
        variance = np.einsum("ij,jk,ik->i", columns, covariance, columns)
        half = quantile * np.sqrt(np.maximum(variance, 0.0))
        block = np.column_stack([grid, friction, friction - half, friction + half])
        parts.append(block if end < 0 else block[::-1])
    if len(parts) > 1:
        parts.insert(1, np.full((1, 4), np.nan))
    grid, fitted, low, high = np.vstack(parts).T
    step = _step(rows.velocity.size)
    return FrictionCurve(
        velocity=rows.velocity[::step],
        friction=rows.friction[::step],
        fitted_velocity=grid,
        fitted_friction=fitted,
        band_low=low,
        band_high=high,
    )


def energy_balance(stretches: Sequence[EnergyStretch]) -> EnergyBalance:
    """Return the energies over time; each stretch continues from the end of the one before."""
    columns: list[Float[np.ndarray, "5 n"]] = []
    reached = 0.0
    for part in stretches:
        explained = reached + part.explained
        # The level of the measured energy is a constant of its own in every stretch
        measured = part.dissipated - float(np.mean(part.dissipated - explained))
        reached = float(explained[-1])
        columns.append(np.vstack([part.time, part.kinetic, part.potential, measured, explained]))
    time, kinetic, potential, measured, explained = np.hstack(columns)
    chosen = slice(None, None, _step(time.size))
    return EnergyBalance(
        time=time[chosen],
        input=(measured + kinetic + potential)[chosen],
        kinetic=kinetic[chosen],
        potential=potential[chosen],
        measured_dissipation=measured[chosen],
        explained_dissipation=explained[chosen],
    )


def effort_residuals(rows: ForceRows) -> Residuals:
    """Return the unexplained effort and its autocorrelation.

    The rows, at least eight, are evenly spaced except at rests and gaps.
    """
    residual = rows.residual
    lags = min(_LARGEST_LAG, residual.size // 4)
    spacing = float(np.median(np.diff(rows.time)))
    step = _step(residual.size)
    return Residuals(
        time=rows.time[::step],
        residual=residual[::step],
        share=float(np.linalg.norm(residual) / np.linalg.norm(rows.effort)),
        lag=spacing * np.arange(lags + 1),
        autocorrelation=autocorrelation(residual, lags),
        white_bound=_NORMAL_95 / float(np.sqrt(residual.size)),
    )


def _step(points: int) -> int:
    return max(-(-points // LARGEST_PLOT), 1)
