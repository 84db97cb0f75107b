"""The energy method with a known inertia: work along motions without noise."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import work_regression
from stickslip.estimation.energy.known_inertia.online.layout import SEEN
from stickslip.estimation.energy.known_inertia.online.recursion import work_run, work_step
from stickslip.estimation.energy.known_inertia.online.state import (
    first_work_state,
    work_covariance,
    work_health,
    work_intervals,
)
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.energy.method import LEAST_ROWS, EnergyMethod, UsableLog
from stickslip.estimation.energy.samples import samples_of
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.online.faults.health import OnlineHealth
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import AxisKind, AxisLog, positive

__all__ = ["KnownInertiaMethod"]


@dataclass(frozen=True, kw_only=True)
class KnownInertiaMethod(EnergyMethod):
    """The balance of work, whitened by the Kalman filter of the known masses.

    Attributes
    ----------
    inertia
        Moving mass or inertia, of a flexible arm that of the driven side [kg or kg m^2].
    """

    inertia: float

    def __post_init__(self) -> None:
        positive("inertia", self.inertia, "kg or kg m^2")
        super().__post_init__()

    @property
    def model(self) -> AxisModel:
        """Known parameters of the axis, and the friction terms."""
        return AxisModel(
            inertia=self.inertia,
            load_inertia=self.load_inertia,
            stiffness=self.stiffness,
            terms=self.terms,
        )

    @property
    def kernel(self) -> Kernel:
        """The compiled step."""
        return work_step

    def parameter_names(self, kind: AxisKind) -> tuple[str, ...]:  # noqa: ARG002
        """Return the names of the friction parameters."""
        return self.terms.names

    def usable(self, log: AxisLog) -> UsableLog:
        """Return a log with even samples and credible velocities."""
        return self._even(log)

    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows of the balance of work."""
        return work_regression(
            parts, self.model, usable.low_pass, samples=len(usable.log), notes=usable.changes
        )

    def init(self, *, sampling_time: float, velocity_measured: bool, load_measured: bool) -> State:
        """Return the state before the first sample."""
        return first_work_state(
            model=self.model,
            inertia=self.inertia,
            sampling_time=sampling_time,
            velocity_measured=velocity_measured,
            load_measured=load_measured,
            forgetting_factor=self.forgetting_factor,
            initial_values=self.first_values(),
            initial_variance=self.initial_variance,
            force_noise=self.force_noise,
            effort_delay=self.effort_delay,
            position_noise=self.position_noise,
            velocity_noise=self.velocity_noise,
        )

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates."""
        load = self.load_inertia is not None and bool(state[SEEN + 2] > 0.0)
        return work_run(state, samples_of(state, log, load=load))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P of the recursion times the mean squared prediction error over its variance."""
        return work_covariance(state)

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals of the online estimates."""
        return work_intervals(state)

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""
        return work_health(state)

    def _least_samples(self, low_pass: LowPass, sampling_time: float) -> int:  # noqa: ARG002
        return LEAST_ROWS
