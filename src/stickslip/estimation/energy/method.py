"""Settings of the energy estimator, and the common part of its methods."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.stretches import reconstructed
from stickslip.estimation.energy.levels import AxisModel, EnergyLevels, energy_levels
from stickslip.estimation.energy.unknown_inertia.level_regression import noise_of_longest
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import long_stretches
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.online.recursion import Variance
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import (
    check_arm,
    check_forgetting_factor,
    check_given,
    checked_variance,
    first_guesses,
)
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms, StribeckEffect
from stickslip.records import AxisKind, AxisLog, InputError, mass_name, non_negative, positive

LEAST_ROWS = 50
"""Rows that a stretch without gaps must give."""


@dataclass(frozen=True, kw_only=True)
class EnergySettings:
    """Settings of `EnergyEstimator`, which documents them."""

    load_inertia: float | None = None
    stiffness: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    stribeck: StribeckEffect | tuple[StribeckEffect, ...] | None = None
    cutoff: float | None = None
    filter_order: int = 4
    forgetting_factor: float = 1.0
    initial_values: Mapping[str, float] | None = None
    initial_variance: Variance | None = None
    force_noise: float | None = None
    effort_delay: float = 0.0
    position_noise: float | None = None
    velocity_noise: float | None = None
    inertia: float | None = None
    level_noise: float | None = None

    def __post_init__(self) -> None:
        units = {
            "level_noise": "J",
            "inertia": "kg or kg m^2",
            "load_inertia": "kg or kg m^2",
            "stiffness": "N/m or N m/rad",
            "cutoff": "Hz",
        }
        check_given(self, positive, units)
        check_arm(self.load_inertia, self.stiffness)
        if not (self.filter_order >= 1 and float(self.filter_order).is_integer()):
            raise InputError(
                "not_whole", name="filter_order", value=self.filter_order, least=1, unit=""
            )
        units = {
            "force_noise": "N or N m",
            "position_noise": "m or rad",
            "velocity_noise": "m/s or rad/s",
        }
        check_given(self, non_negative, units)
        check_forgetting_factor(self.forgetting_factor)
        if self.initial_variance is not None:
            count = len(self.parameter_names("linear"))
            object.__setattr__(
                self, "initial_variance", checked_variance(self.initial_variance, count)
            )
        names = (*self.parameter_names("linear"), *self.parameter_names("rotary"))
        guesses = first_guesses(self.initial_values, tuple(dict.fromkeys(names)))
        object.__setattr__(self, "initial_values", guesses)
        if self.inertia is None and self.force_noise and self.level_noise is None:
            raise InputError("no_level_noise", value=self.force_noise, unit="N or N m")

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(
            per_direction=self.per_direction, offset=self.offset, stribeck=self.stribeck
        )

    @property
    def model(self) -> AxisModel:
        """Known parameters of the axis, and the friction terms."""
        return AxisModel(
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
            terms=self.terms,
        )

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of what is estimated, in the order of the online estimates.

        Viscous friction comes before Coulomb friction here; `values_at` has them the other way
        round.
        """
        if self.inertia is not None:
            return self.terms.names
        return (mass_name(kind), *self.terms.names)

    def low_pass(self, sampling_time: float) -> LowPass:
        """Return the low-pass of the settings for a sampling time [s]."""
        return LowPass.of(sampling_time, self.cutoff, self.filter_order)


@dataclass(frozen=True, kw_only=True)
class UsableLog:
    """A log with even samples and credible velocities."""

    log: AxisLog
    low_pass: LowPass  # for noisy signals
    changes: tuple[str, ...]  # what was done to the log, one sentence each
    lowered: tuple[str, ...] = ()  # why the cutoff is lower than the default one
    clipped: bool = False  # whether the effort looks clipped


@dataclass(frozen=True)
class EnergyMethod(ABC):
    """One of the two energy methods: the rows of a whole log, and the kernels of a recursion."""

    settings: EnergySettings
    kernel: ClassVar[Kernel]  # for one sample
    run_kernel: ClassVar[Callable[[State, Any], tuple[State, Float[np.ndarray, "n p"]]]]
    fields: ClassVar[Callable[[State], Any]]  # of a state
    state_size: ClassVar[int]

    @abstractmethod
    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows of the balance over stretches without gaps."""

    @abstractmethod
    def least_samples(self, low_pass: LowPass, sampling_time: float) -> int:
        """Return how many samples a stretch without gaps must hold."""

    @abstractmethod
    def initialise(self, own: Any, sampling_time: float, measured: tuple[bool, bool, bool]) -> None:
        """Write the settings of the method into the fields of a first state.

        ``measured`` is whether velocity, load position and load velocity are.
        """

    @abstractmethod
    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return the covariance of the recursion, scaled by the mean squared innovation."""

    @abstractmethod
    def force_noise(self, own: Any) -> float:
        """Return the standard deviation of the disturbance force [N or N m]."""

    def usable(self, log: AxisLog) -> UsableLog:
        """Return a log with even samples and credible velocities."""
        whole = repaired(log)
        low_pass = self.settings.low_pass(whole.sampling_time)
        load = self.settings.load_inertia is not None
        log, wrong = without_wrong_velocity(whole, low_pass, load=load)
        return UsableLog(
            log=log,
            low_pass=low_pass,
            changes=(*whole.notes, *wrong),
            clipped=whole.clipped,
        )

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the balance of a log in which something moves."""
        usable = self.usable(log)
        least = self.least_samples(usable.low_pass, usable.log.sampling_time)
        rows = self.rows(usable, long_stretches(usable.log, least))
        return replace(rows, biased=rows.biased or usable.clipped)

    def levels(self, log: AxisLog) -> list[tuple[EnergyLevels, AxisLog]]:
        """Return the energies of every stretch without gaps, beside that stretch of the log."""
        usable, model = self.usable(log), self.settings.model
        low_pass, T = usable.low_pass, usable.log.sampling_time
        least = self.least_samples(low_pass, T)
        long = [part for part in usable.log.segments() if len(part) >= least]
        parts = reconstructed(long, model, low_pass)
        noise = noise_of_longest(parts, low_pass)
        return [(energy_levels(part, model, low_pass, noise, T), part) for part in parts]
