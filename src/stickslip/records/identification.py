"""Everything the report of an identification draws, computed beforehand."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.records.axis_log import AxisLog
from stickslip.records.estimate import FrictionEstimate
from stickslip.records.record import Record

__all__ = [
    "EnergyBalance",
    "EstimateEvolution",
    "FrictionCurve",
    "Identification",
    "Residuals",
    "Resimulation",
]


@dataclass(frozen=True, kw_only=True)
class FrictionCurve:
    """Friction force against velocity: what the log shows and what was fitted.

    Attributes
    ----------
    velocity, friction
        The data cloud, shape (n,): velocity [m/s or rad/s] and effort minus inertia force
        [N or N m].
    fitted_velocity, fitted_friction
        The fitted law with its offset, shape (p,) [m/s or rad/s, N or N m]; NaN separates the two
        directions.
    band_low, band_high
        95 % band of the law, shape (p,) [N or N m].
    """

    velocity: Float[np.ndarray, " n"]
    friction: Float[np.ndarray, " n"]
    fitted_velocity: Float[np.ndarray, " p"]
    fitted_friction: Float[np.ndarray, " p"]
    band_low: Float[np.ndarray, " p"]
    band_high: Float[np.ndarray, " p"]


@dataclass(frozen=True, kw_only=True)
class EnergyBalance:
    """Energies [J] over time [s] (van de Wijdeven 2002, Eqs. 3.1-3.9), shape (n,) each.

    Attributes
    ----------
    time
        Time stamps [s].
    input, kinetic, potential
        Input, kinetic and potential energy [J]; potential is zero for a rigid axis.
    measured_dissipation
        Input minus kinetic minus potential energy [J].
    explained_dissipation
        What the fitted friction and offset dissipate [J].
    """

    time: Float[np.ndarray, " n"]
    input: Float[np.ndarray, " n"]
    kinetic: Float[np.ndarray, " n"]
    potential: Float[np.ndarray, " n"]
    measured_dissipation: Float[np.ndarray, " n"]
    explained_dissipation: Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class EstimateEvolution(Record):
    """How the estimates settle as the log goes on.

    Attributes
    ----------
    time
        Time stamps [s], shape (n,).
    values, stds
        By parameter name, each of shape (n,) [SI].
    """

    time: Float[np.ndarray, " n"]
    values: Mapping[str, Float[np.ndarray, " n"]]
    stds: Mapping[str, Float[np.ndarray, " n"]]


@dataclass(frozen=True, kw_only=True)
class Residuals:
    """The effort that the identified terms do not explain while the axis moves.

    Attributes
    ----------
    time, residual
        In the band of the estimator's low-pass or windows, shape (n,) [s, N or N m].
    share
        Norm of the residual over norm of the effort in the same band [-].
    lag, autocorrelation
        Shape (l,); lag [s] and autocorrelation [-] of the residual.
    white_bound
        Half-width of the 95 % band within which a white residual's autocorrelation stays [-].
    """

    time: Float[np.ndarray, " n"]
    residual: Float[np.ndarray, " n"]
    share: float
    lag: Float[np.ndarray, " l"]
    autocorrelation: Float[np.ndarray, " l"]
    white_bound: float


@dataclass(frozen=True, kw_only=True)
class Resimulation:
    """The measured motion beside the motion of the identified model under the logged effort.

    Attributes
    ----------
    time, measured_position, simulated_position, measured_velocity, simulated_velocity
        Shape (n,) [SI]; velocity is the measured one or the difference of positions.
    horizon
        Time [s] after which the simulation is started anew from the measurement.
    fit
        1 - norm(measured - simulated) / norm(measured - mean) of the position [-].
    """

    time: Float[np.ndarray, " n"]
    measured_position: Float[np.ndarray, " n"]
    simulated_position: Float[np.ndarray, " n"]
    measured_velocity: Float[np.ndarray, " n"]
    simulated_velocity: Float[np.ndarray, " n"]
    horizon: float
    fit: float


@dataclass(frozen=True, kw_only=True)
class Identification:
    """An identified axis with all that its report shows.

    Attributes
    ----------
    log
        The input.
    estimate
        The result.
    truth
        True parameter values by name [SI] where the log was simulated, else None.
    curve, energy, evolution, residuals, resimulation
        What the report draws; None where the estimate is not good enough to make it.
    further
        The other logs of a joint fit, whose first one is ``log``.
    """

    log: AxisLog
    estimate: FrictionEstimate
    truth: Mapping[str, float] | None = None
    curve: FrictionCurve | None = None
    energy: EnergyBalance | None = None
    evolution: EstimateEvolution | None = None
    residuals: Residuals | None = None
    resimulation: Resimulation | None = None
    further: tuple[AxisLog, ...] = ()

    def __repr__(self) -> str:
        """Return name, status and parameters on one line; the signals are left out."""
        values = ", ".join(
            f"{name}={p.value:.6g}" + ("" if p.std is None else f" ± {p.std:.2g}")
            if p.value is not None
            else f"{name}=None"
            for name, p in self.estimate.parameters.items()
        )
        return f"Identification({self.name!r}, {self.estimate.status.value}: {values})"

    @property
    def logs(self) -> tuple[AxisLog, ...]:
        """All logs."""
        return (self.log, *self.further)

    @property
    def name(self) -> str:
        """What was identified, in words."""
        if not self.further:
            return self.log.name
        names = [log.name for log in self.logs]
        shown = names if len(names) <= _MOST_NAMES else [*names[: _MOST_NAMES - 1], "others"]
        return f"{', '.join(shown[:-1])} and {shown[-1]}"


_MOST_NAMES = 4
