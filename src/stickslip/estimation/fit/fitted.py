"""An estimate together with the rows and the model that it was fitted with."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import provenance_of, solve
from stickslip.estimation.settings import options_of
from stickslip.friction import StribeckEffect
from stickslip.records import AxisLog, FrictionEstimate, InputError

if TYPE_CHECKING:
    from stickslip.estimation.selection.model import Model

_KNOWN = ("inertia", "load_inertia", "stiffness", "stribeck", "cutoff", "filter_order")
"""Settings of estimators that a report needs."""


@dataclass(frozen=True, kw_only=True)
class Fit:
    """An estimate, its least-squares rows, and the known parameters of the axis."""

    estimate: FrictionEstimate  #: The result.
    rows: Regression  #: Rows whose least-squares solution is the estimate.
    #: Known mass or inertia, of a flexible arm that of the driven side [kg or kg m^2]; None if it
    #: was estimated.
    inertia: float | None = None
    #: Known mass or inertia of the load of a flexible arm [kg or kg m^2]; None for a rigid axis, or
    #: if it was estimated.
    load_inertia: float | None = None
    #: Known stiffness of a flexible arm [N/m or N m/rad]; None for a rigid axis, or if it was
    #: estimated.
    stiffness: float | None = None
    #: Known Stribeck effect; None if there is none, or if it was estimated.
    stribeck: StribeckEffect | None = None
    #: Cutoff frequency of the low-pass of the estimator [Hz]; None for the default one.
    cutoff: float | None = None
    filter_order: int = 4  #: Order of one pass of that low-pass.
    #: The selected model of `SelectedModelEstimator`; None for the others.
    model: "Model | None" = None


class RowsEstimator(ABC):
    """Base of the estimators whose estimate is that of rows."""

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log; see `Estimator.fit`."""
        return self.details(log).estimate

    @abstractmethod
    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report; raises as `fit`."""


class LeastSquaresEstimator(RowsEstimator):
    """Base of the estimators whose estimate is the least-squares solution of their rows."""

    name: ClassVar[str]

    @abstractmethod
    def regression(self, log: AxisLog) -> Regression:
        """Return the rows; raises as `fit`."""

    @property
    def options(self) -> dict[str, Any]:
        """Name and settings as plain values, for a result's provenance."""
        return options_of(self)

    def details(self, log: AxisLog) -> Fit:
        """Return the estimate with its rows, for a report; raises as `fit`.

        Several Stribeck effects are an error: rows have them for `StribeckEstimator`.
        """
        effects = getattr(self, "stribeck", None)
        if isinstance(effects, tuple) and len(effects) > 1:
            raise InputError("several_stribeck_effects", method=self.name)
        rows = self.regression(log)
        provenance = provenance_of(log, self.options)
        return self.fitted(solve(rows, estimator=self.name, provenance=provenance), rows)

    def fitted(self, estimate: FrictionEstimate, rows: Regression) -> Fit:
        """Return an estimate and its rows with the known parameters of the axis."""
        known = {name: getattr(self, name) for name in _KNOWN if hasattr(self, name)}
        stribeck = known.pop("stribeck", None)
        one = stribeck if isinstance(stribeck, StribeckEffect) else None
        return Fit(estimate=estimate, rows=rows, stribeck=one, **known)
