"""Protocols of the estimators, and the task that each of them is made for."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from stickslip.records import (
    AxisKind,
    AxisLog,
    EffortKind,
    FrictionEstimate,
    InputError,
    mass_name,
    positive,
    unit_of,
)

if TYPE_CHECKING:
    from stickslip.estimation.fit.fitted import Fit
    from stickslip.estimation.online.faults.health import OnlineHealth

State = Float[np.ndarray, " s"]

_FLAGS = ("per_direction", "offset", "stribeck", "select")
LARGEST_DELAY = 100
"""Largest delay of the effort that can be searched [samples]: each delay takes a fit."""


@runtime_checkable
class Estimator(Protocol):
    """An estimator of friction from a whole log."""

    @property
    def name(self) -> str:
        """Name in the registry."""
        ...

    def fit(self, log: AxisLog) -> FrictionEstimate:
        """Estimate the parameters from a whole log.

        Raises
        ------
        InputError
            If the log is too short, has no motion or no effort, or lacks a signal that the
            estimator needs.
        """
        ...


@runtime_checkable
class DetailedEstimator(Estimator, Protocol):
    """An estimator whose estimate is the least-squares solution of rows."""

    def details(self, log: AxisLog) -> "Fit":
        """Return the estimate with its rows, for a report."""
        ...


@runtime_checkable
class OnlineEstimator(Estimator, Protocol):
    """An estimator that also takes samples one by one; its memory is one vector of fixed size."""

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of the parameters, in the order of the online estimates."""
        ...

    def init(self, *, sampling_time: float) -> State:
        """Return the state before the first sample; the sampling time is in s."""
        ...

    def step(
        self, state: State, sample: tuple[float, float, float, float, float]
    ) -> tuple[State, Float[np.ndarray, " p"]]:
        """Take one sample; return the new state and the estimates."""
        ...

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take a log without gaps; return the new state and the estimates after each sample."""
        ...

    def health(self, state: State) -> "OnlineHealth":
        """Return what was missing, rejected and reset so far."""
        ...


@runtime_checkable
class OnlineIntervalEstimator(OnlineEstimator, Protocol):
    """An online estimator that also gives confidence intervals."""

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals, in the order of the online estimates."""
        ...


@dataclass(frozen=True, kw_only=True)
class EstimationTask:
    """Known parameters of an axis, the friction terms to estimate, and settings of the fit."""

    #: Mass or inertia, of the first body of a flexible arm [kg or kg m^2]; None estimates it.
    inertia: float | None = None
    #: First guess of an unknown inertia [kg or kg m^2]; None for none.
    inertia_guess: float | None = None
    #: Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis.
    load_inertia: float | None = None
    #: Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis.
    stiffness: float | None = None
    #: Whether Coulomb and viscous friction are estimated for each direction separately.
    per_direction: bool = False
    #: Whether a constant offset is estimated; None estimates it unless ``per_direction``.
    offset: bool | None = None
    stribeck: bool = False  #: Whether static friction and Stribeck velocity are estimated too.
    #: Cutoff frequency of the low-pass for noisy signals [Hz]; None for the default one.
    cutoff: float | None = None
    largest_delay: int = 0  #: Effort delays of 0 to this many samples are compared.
    #: Forgetting factor of the published recursion, in (0, 1] [-]; None for 1.
    forgetting_factor: float | None = None
    #: Diagonal of P(0) of the published recursion [squared unit of the parameters over that of the
    #: energy]; None for 1e3.
    initial_variance: float | None = None
    #: Terms that a `stickslip.estimation.SelectedModelEstimator` has in any case.
    include: tuple[str, ...] = ()
    exclude: tuple[str, ...] = ()  #: Terms that it never has.
    select: bool = True  #: Whether further terms are selected.
    #: Known time by which the effort acts later than it is logged [s]; None for unknown.
    effort_delay: float | None = None
    #: Meaning of a logged effort, ``"held"``, ``"sampled"`` or ``"mean"``
    #: (`stickslip.estimation.SelectedModelEstimator`); None for unknown.
    effort_kind: EffortKind | None = None

    @property
    def has_offset(self) -> bool:
        """Whether a constant offset is estimated."""
        return not self.per_direction if self.offset is None else self.offset

    @property
    def flexible(self) -> bool:
        """Whether the axis is a flexible arm."""
        return self.load_inertia is not None or self.stiffness is not None

    @property
    def settings(self) -> Mapping[str, float | int | bool | str]:
        """Settings that are given and that not every estimator has, by name."""
        given = {
            "offset": self.offset or None,
            "stribeck": self.stribeck or None,
            "cutoff": self.cutoff,
            "largest_delay": self.largest_delay or None,
            "forgetting_factor": self.forgetting_factor,
            "initial_variance": self.initial_variance,
            "include": ", ".join(self.include) or None,
            "exclude": ", ".join(self.exclude) or None,
            "select": None if self.select else "none",
            "effort_delay": self.effort_delay,
            "effort_kind": self.effort_kind,
        }
        return {name: value for name, value in given.items() if value is not None}

    def check(self, kind: AxisKind) -> None:
        """Validate the known parameters.

        Parameters
        ----------
        kind
            ``"linear"`` or ``"rotary"``.

        Raises
        ------
        InputError
            If a flag is no bool, a value is not positive, only one of load inertia and stiffness is
            given, an offset is combined with friction per direction, or the largest delay is out of
            range.
        """
        for name in _FLAGS:
            flag = getattr(self, name)
            if not isinstance(flag, bool | np.bool_) and not (name == "offset" and flag is None):
                found = type(flag).__name__
                raise InputError("wrong_type", name=name, found=found, needed=("bool",))
        body = mass_name(kind)
        for what, quantity, value in (
            (body, body, self.inertia),
            (f"load_{body}", body, self.load_inertia),
            ("stiffness", "stiffness", self.stiffness),
        ):
            if value is not None:
                positive(what, value, unit_of(quantity, kind))
        if (self.load_inertia is None) != (self.stiffness is None):
            raise InputError("half_an_arm")
        if self.per_direction and self.offset:
            raise InputError("offset_and_directions")
        if not 0 <= self.largest_delay <= LARGEST_DELAY:
            raise InputError(
                "out_of_range",
                name="largest_delay",
                value=self.largest_delay,
                least=0,
                most=LARGEST_DELAY,
                unit="samples",
            )
