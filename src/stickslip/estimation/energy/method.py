"""What the energy methods with known and with unknown inertia have in common."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.stretches import reconstructed
from stickslip.estimation.energy.levels import AxisModel, EnergyLevels, energy_levels
from stickslip.estimation.energy.unknown_inertia.level_regression import noise_of_longest
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.fit.solve import long_stretches
from stickslip.estimation.online.faults.health import OnlineHealth
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.prepare import repaired
from stickslip.estimation.settings import (
    check_arm,
    check_forgetting_factor,
    check_given,
    first_guesses,
)
from stickslip.estimation.signals.kinematics import LowPass, default_cutoff
from stickslip.estimation.signals.velocity_delay import without_wrong_velocity
from stickslip.friction import FrictionTerms, StribeckEffect
from stickslip.records import AxisKind, AxisLog, InputError, non_negative, positive

__all__ = ["LEAST_ROWS", "EnergyMethod", "EnergySettings", "UsableLog"]

LEAST_ROWS = 50
"""Rows that a stretch without gaps must give."""


@dataclass(frozen=True, kw_only=True)
class EnergySettings:
    """Settings of the energy estimator, whether the inertia is known or not.

    Attributes
    ----------
    load_inertia, stiffness
        Of a flexible arm [kg or kg m^2, N/m or N m/rad]; None for a rigid axis. With a known
        inertia the log need not hold the load: its motion is then reconstructed from that of the
        driven mass, wherever it began. With an unknown inertia it must hold its position.
    per_direction
        Whether Coulomb and viscous friction are estimated for each direction separately.
    offset
        Whether a constant offset is estimated; None estimates it unless ``per_direction``.
    stribeck
        How the step from static to Coulomb friction fades with speed, to estimate static friction
        too; None does not. Several, of which each has a step of its own, are for
        `StribeckEstimator`, which finds the one that fits.
    cutoff
        Cutoff frequency of the low-pass for noisy signals [Hz]; None for a tenth of the sampling
        rate and at most 100 Hz; a fit with unknown inertia lowers it where velocities from noisy
        positions need it.
    filter_order
        Order of one pass of that low-pass.
    forgetting_factor
        Forgetting factor of the recursion per sample, in (0, 1] [-]; 1 forgets nothing. `fit` does
        not use it.
    initial_values
        First guesses of the recursion by parameter name [SI]; 0 for those not named.
    initial_variance
        Diagonal of P(0) of the recursion [squared unit of the parameters; over that of the level
        noise with an unknown inertia]; None for one that follows the size of the regressors and
        weighs nothing against them, whatever the units.
    force_noise
        For the recursion only: standard deviation of a disturbance force [N or N m]. None
        estimates it from the innovations if nothing is forgotten, and takes none otherwise.
    effort_delay
        For the recursion only: samples by which the effort acts after it is logged [-], also a
        fraction; negative if the effort is logged late. At most 30.
    position_noise, velocity_noise
        For the recursion only: standard deviation of the sensors' noise [m or rad, m/s or rad/s];
        None estimates it from the samples. With a known inertia it is estimated in any case, and
        this is its first guess.
    """

    load_inertia: float | None = None
    stiffness: float | None = None
    per_direction: bool = False
    offset: bool | None = None
    stribeck: StribeckEffect | tuple[StribeckEffect, ...] | None = None
    cutoff: float | None = None
    filter_order: int = 4
    forgetting_factor: float = 1.0
    initial_values: Mapping[str, float] | None = None
    initial_variance: float | None = None
    force_noise: float | None = None
    effort_delay: float = 0.0
    position_noise: float | None = None
    velocity_noise: float | None = None

    @property
    def terms(self) -> FrictionTerms:
        """The friction parameters that are estimated."""
        return FrictionTerms.asked(
            per_direction=self.per_direction, offset=self.offset, stribeck=self.stribeck
        )


@dataclass(frozen=True, kw_only=True)
class UsableLog:
    """A log with even samples and credible velocities.

    Attributes
    ----------
    log
        The samples.
    low_pass
        Low-pass for noisy signals.
    changes
        What was done to the log, one sentence each.
    lowered
        Why the cutoff is lower than the default one.
    clipped
        Whether the effort looks clipped.
    """

    log: AxisLog
    low_pass: LowPass
    changes: tuple[str, ...]
    lowered: tuple[str, ...] = ()
    clipped: bool = False


@dataclass(frozen=True, kw_only=True)
class EnergyMethod(EnergySettings, ABC):
    """One of the two energy methods: rows of a whole log, and a recursion."""

    def __post_init__(self) -> None:
        check_given(
            self,
            positive,
            {
                "load_inertia": "kg or kg m^2",
                "stiffness": "N/m or N m/rad",
                "cutoff": "Hz",
                "initial_variance": "(unit of the parameter)^2/J^2",
            },
        )
        check_arm(self.load_inertia, self.stiffness)
        if not (self.filter_order >= 1 and float(self.filter_order).is_integer()):
            raise InputError(
                f"filter_order is {self.filter_order}, it must be a whole number, 1 or more",
                remedy="leave it at its default",
            )
        check_given(
            self,
            non_negative,
            {
                "force_noise": "N or N m",
                "position_noise": "m or rad",
                "velocity_noise": "m/s or rad/s",
            },
        )
        check_forgetting_factor(self.forgetting_factor)
        kinds: tuple[AxisKind, ...] = ("linear", "rotary")
        known = dict.fromkeys(name for kind in kinds for name in self.parameter_names(kind))
        guesses = first_guesses(self.initial_values, tuple(known))
        object.__setattr__(self, "initial_values", guesses)

    @property
    @abstractmethod
    def model(self) -> AxisModel:
        """Known parameters of the axis, and the friction terms."""

    @property
    @abstractmethod
    def kernel(self) -> Kernel:
        """The compiled step."""

    @abstractmethod
    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the names of the parameters, in the order of the online estimates."""

    @abstractmethod
    def usable(self, log: AxisLog) -> UsableLog:
        """Return a log with even samples and credible velocities."""

    @abstractmethod
    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows of the balance over stretches without gaps."""

    @abstractmethod
    def init(self, *, sampling_time: float, velocity_measured: bool, load_measured: bool) -> State:
        """Return the state before the first sample."""

    @abstractmethod
    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates."""

    @abstractmethod
    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return the covariance of the recursion."""

    @abstractmethod
    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals of the online estimates."""

    @abstractmethod
    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""

    @abstractmethod
    def _least_samples(self, low_pass: LowPass, sampling_time: float) -> int:
        """Return how many samples a stretch without gaps must hold."""

    def regression(self, log: AxisLog) -> Regression:
        """Return the whitened rows of the balance.

        Parameters
        ----------
        log
            Any log in which something moves.
        """
        usable = self.usable(log)
        parts = long_stretches(
            usable.log,
            self._least_samples(usable.low_pass, usable.log.sampling_time),
            needed_by="",
            remedy="record a longer log, or raise the cutoff frequency",
        )
        rows = self.rows(usable, parts)
        return replace(rows, biased=rows.biased or usable.clipped)

    def levels(self, log: AxisLog) -> list[tuple[EnergyLevels, AxisLog]]:
        """Return the energies of every stretch without gaps, beside that stretch of the log.

        Parameters
        ----------
        log
            As `regression` takes it.
        """
        usable = self.usable(log)
        low_pass, T = usable.low_pass, usable.log.sampling_time
        least = self._least_samples(low_pass, T)
        long = [part for part in usable.log.segments() if len(part) >= least]
        parts = reconstructed(long, self.model, low_pass)
        noise = noise_of_longest(parts, low_pass)
        return [(energy_levels(part, self.model, low_pass, noise, T), part) for part in parts]

    def low_pass(self, sampling_time: float) -> LowPass:
        """Return the low-pass of the settings.

        Parameters
        ----------
        sampling_time
            [s].
        """
        cutoff = default_cutoff(sampling_time) if self.cutoff is None else self.cutoff
        return LowPass(order=self.filter_order, cutoff=cutoff)

    def first_values(self) -> list[float]:
        """Return the first guesses, in the order of `parameter_names`."""
        guesses = self.initial_values or {}
        mass = guesses.get("mass", guesses.get("inertia", 0.0))
        return [
            mass if name in {"mass", "inertia"} else guesses.get(name, 0.0) for name in self.names
        ]

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters of a linear axis."""
        return self.parameter_names("linear")

    def _even(self, log: AxisLog) -> UsableLog:
        whole = repaired(log)
        low_pass = self.low_pass(whole.sampling_time)
        log, wrong = without_wrong_velocity(whole, low_pass, load=self.load_inertia is not None)
        return UsableLog(
            log=log,
            low_pass=low_pass,
            changes=(*whole.notes, *wrong),
            clipped=whole.clipped,
        )
