"""An identified axis with all that its report draws, computed beforehand."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.records.axis_log import AxisLog
from stickslip.records.estimate import SCHEMA_VERSION, FrictionEstimate
from stickslip.records.record import Comparable, Exportable, ReadOnlyMapping, Record

_MOST_NAMES = 4  # of logs, in the name of an identification


@dataclass(frozen=True, kw_only=True)
class FrictionCurve(Comparable):
    """Friction force against velocity: the data cloud and the fitted law."""

    velocity: Float[np.ndarray, " n"]  #: Of the data cloud [m/s or rad/s].
    friction: Float[np.ndarray, " n"]  #: Effort less inertia force [N or N m].
    fitted_velocity: Float[np.ndarray, " p"]  #: [m/s or rad/s]; NaN separates the directions.
    fitted_friction: Float[np.ndarray, " p"]  #: The fitted law with its offset [N or N m].
    band_low: Float[np.ndarray, " p"]  #: Lower end of the law's 95 % band [N or N m].
    band_high: Float[np.ndarray, " p"]  #: Upper end of the law's 95 % band [N or N m].


@dataclass(frozen=True, kw_only=True)
class EnergyBalance(Comparable):
    """Energies over time (van de Wijdeven 2002, Eqs. 3.1-3.9)."""

    time: Float[np.ndarray, " n"]  #: Time stamps [s].
    input: Float[np.ndarray, " n"]  #: Input energy [J].
    kinetic: Float[np.ndarray, " n"]  #: Kinetic energy [J].
    potential: Float[np.ndarray, " n"]  #: Potential energy [J]; zero for a rigid axis.
    #: Input less kinetic less potential energy [J].
    measured_dissipation: Float[np.ndarray, " n"]
    #: Energy that the fitted friction and offset dissipate [J].
    explained_dissipation: Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class EstimateEvolution(Record):
    """The estimates from the samples up to each instant of the log."""

    time: Float[np.ndarray, " n"]  #: Time stamps [s].
    values: Mapping[str, Float[np.ndarray, " n"]]  #: By parameter name [SI].
    stds: Mapping[str, Float[np.ndarray, " n"]]  #: Standard deviations by parameter name [SI].


@dataclass(frozen=True, kw_only=True)
class Residuals(Comparable):
    """The effort that the identified terms do not explain while the axis moves."""

    time: Float[np.ndarray, " n"]  #: Time stamps [s].
    #: In the band of the estimator's low-pass or windows [N or N m].
    residual: Float[np.ndarray, " n"]
    share: float  #: Norm of the residual over norm of the effort in the same band [-].
    lag: Float[np.ndarray, " l"]  #: Lags of the autocorrelation [s].
    autocorrelation: Float[np.ndarray, " l"]  #: Of the residual [-].
    white_bound: float  #: Half-width of the 95 % band of a white residual's autocorrelation [-].


@dataclass(frozen=True, kw_only=True)
class Resimulation(Comparable):
    """The measured motion beside the motion of the identified model under the logged effort."""

    time: Float[np.ndarray, " n"]  #: Time stamps [s].
    measured_position: Float[np.ndarray, " n"]  #: [m or rad]
    simulated_position: Float[np.ndarray, " n"]  #: [m or rad]
    measured_velocity: Float[np.ndarray, " n"]  #: As logged, or of the positions [m/s or rad/s].
    simulated_velocity: Float[np.ndarray, " n"]  #: [m/s or rad/s]
    horizon: float  #: Time after which the simulation starts anew from the measurement [s].
    fit: float  #: 1 - norm(measured - simulated) / norm(measured - mean) of the position [-].


@dataclass(frozen=True, kw_only=True)
class Validation(Record):
    """Prediction of the effort of another log by an identified model."""

    log: str  #: Name of the other log.
    #: Norm of the residual over that of the effort, in slip [-]; None without a prediction.
    error: float | None
    reason: str = ""  #: Why there is no prediction.


@dataclass(frozen=True, kw_only=True)
class Identification(Exportable):
    """An identified axis with all that its report shows."""

    log: AxisLog  #: The input.
    estimate: FrictionEstimate  #: The result.
    #: True parameter values by name [SI] where the log was simulated, else None.
    truth: Mapping[str, float] | None = None
    # Drawn by the report; each is None where the estimate is not good enough to make it
    curve: FrictionCurve | None = None  #: Friction against velocity; or None.
    energy: EnergyBalance | None = None  #: Energies over time; or None.
    evolution: EstimateEvolution | None = None  #: How the estimates settle; or None.
    residuals: Residuals | None = None  #: Effort that is not explained; or None.
    resimulation: Resimulation | None = None  #: Motion of the identified model; or None.
    further: tuple[AxisLog, ...] = ()  #: The other logs of a joint fit, whose first one is ``log``.
    validation: Validation | None = None  #: Prediction of another log; None if none was given.

    def to_dict(self) -> dict[str, Any]:
        """Return the estimate, and the validation if there is one, as plain JSON types."""
        document = self.estimate.to_dict()
        if self.validation is not None:
            document["validation"] = self.validation.to_dict()
        return document

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
        """Name of the log, or of several."""
        if not self.further:
            return self.log.name
        names = [log.name for log in self.logs]
        if len(names) > _MOST_NAMES:
            names[_MOST_NAMES - 1 :] = ["others"]
        return f"{', '.join(names[:-1])} and {names[-1]}"


@dataclass(frozen=True, kw_only=True)
class AxesIdentification(Exportable):
    """The identified axes of one log."""

    name: str  #: Name of the log.
    axes: Mapping[str, Identification]  #: Identification of each axis by its name.
    #: Reasons why axes are not identified, by their names.
    unread: Mapping[str, str] = field(default_factory=dict[str, str])

    def __post_init__(self) -> None:
        object.__setattr__(self, "axes", ReadOnlyMapping(self.axes))
        object.__setattr__(self, "unread", ReadOnlyMapping(self.unread))

    @property
    def trusted(self) -> bool:
        """Whether every axis has an estimate that can be trusted."""
        return not self.unread and all(each.estimate.status.trusted for each in self.axes.values())

    def to_dict(self) -> dict[str, Any]:
        """Return the estimates by axis as plain JSON types."""
        return {
            "schema": SCHEMA_VERSION,
            "axes": {name: each.to_dict() for name, each in self.axes.items()},
            "not_identified": dict(self.unread),
        }
