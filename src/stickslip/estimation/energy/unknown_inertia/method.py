"""The energy method with an unknown inertia: levels of energy, then work with one more column."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import sought_regression
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.energy.method import LEAST_ROWS, EnergyMethod, UsableLog
from stickslip.estimation.energy.samples import samples_of
from stickslip.estimation.energy.unknown_inertia.level_regression import (
    block_size,
    level_regression,
)
from stickslip.estimation.energy.unknown_inertia.online.recursion import energy_run, energy_step
from stickslip.estimation.energy.unknown_inertia.online.state import (
    first_state,
    level_covariance,
    level_health,
    level_intervals,
)
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.online.faults.health import OnlineHealth
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.settings import check_given
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.sensor_noise import chosen_cutoff
from stickslip.records import AxisKind, AxisLog, InputError, positive

__all__ = ["UnknownInertiaMethod"]


@dataclass(frozen=True, kw_only=True)
class UnknownInertiaMethod(EnergyMethod):
    """Levels of energy give the first guess of the inertia; the balance of work refines it.

    Attributes
    ----------
    level_noise
        For the recursion only: standard deviation of the energy level [J].
    """

    level_noise: float | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        check_given(self, positive, {"level_noise": "J"})
        if self.force_noise and self.level_noise is None:
            raise InputError(
                f"force_noise is {self.force_noise:g} N or N m and no level_noise is given",
                remedy="give level_noise [J] as well: their ratio decides",
            )

    @property
    def model(self) -> AxisModel:
        """Known parameters of the axis, and the friction terms."""
        return AxisModel(
            inertia=None,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
            terms=self.terms,
        )

    @property
    def kernel(self) -> Kernel:
        """The compiled step."""
        return energy_step

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:
        """Return the name of the inertia, and those of the friction parameters."""
        return ("mass" if kind == "linear" else "inertia", *self.terms.names)

    def usable(self, log: AxisLog) -> UsableLog:
        """Return a log with even samples and credible velocities, and a low-pass that fits it."""
        usable = self._even(log)
        if self.cutoff is not None:
            return usable
        cutoff, lowered = chosen_cutoff(
            usable.log, usable.low_pass, LEAST_ROWS, load=self.load_inertia is not None
        )
        low_pass = LowPass(order=self.filter_order, cutoff=cutoff)
        return replace(usable, low_pass=low_pass, lowered=lowered)

    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows: of work, or of levels where samples are explained badly."""
        log = usable.log
        levels = level_regression(
            parts,
            self.model,
            self.parameter_names(log.kind),
            usable.low_pass,
            sampling_time=log.sampling_time,
            samples=len(log),
            notes=(*usable.changes, *usable.lowered),
        )
        return sought_regression(
            levels, parts, self.model, self.low_pass(log.sampling_time), notes=usable.changes
        )

    def init(self, *, sampling_time: float, velocity_measured: bool, load_measured: bool) -> State:
        """Return the state before the first sample."""
        if self.load_inertia is not None and not load_measured:
            raise InputError(
                "the load of the arm is not measured, and the inertia is not given",
                remedy="give the inertia of the driven side: the load is then reconstructed",
            )
        return first_state(
            model=self.model,
            sampling_time=sampling_time,
            velocity_measured=velocity_measured,
            cutoff=self.low_pass(sampling_time).cutoff,
            forgetting_factor=self.forgetting_factor,
            initial_values=self.first_values(),
            initial_variance=self.initial_variance,
            level_noise=self.level_noise,
            force_noise=self.force_noise,
            effort_delay=self.effort_delay,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates."""
        return energy_run(state, samples_of(state, log, load=self.load_inertia is not None))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P of the recursion times the mean squared innovation."""
        return level_covariance(state)

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals of the online estimates."""
        return level_intervals(state)

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""
        return level_health(state)

    def _least_samples(self, low_pass: LowPass, sampling_time: float) -> int:
        return LEAST_ROWS * block_size(low_pass, sampling_time)
