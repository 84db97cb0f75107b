"""The energy method with a known inertia: work along motions without noise."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import work_regression
from stickslip.estimation.energy.known_inertia.free_friction import HeldAxis
from stickslip.estimation.energy.known_inertia.online import state as at
from stickslip.estimation.energy.known_inertia.online.recursion import work_run, work_step
from stickslip.estimation.energy.method import LEAST_ROWS, EnergyMethod, UsableLog
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import covariance_in
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import AxisLog

_GUESS_SAMPLES = 10.0
"""Samples that a guess of the noise counts for [-]: enough for the start, few enough that a wrong
guess soon has no effect."""


@dataclass(frozen=True)
class KnownInertiaMethod(EnergyMethod):
    """The balance of work, whitened by the Kalman filter of the known masses."""

    kernel = staticmethod(work_step)
    run_kernel = staticmethod(work_run)
    fields = staticmethod(at.fields)
    state_size = at.STATE_SIZE

    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows of the balance of work."""
        model, samples = self.settings.model, len(usable.log)
        return work_regression(parts, model, usable.low_pass, samples=samples, notes=usable.changes)

    def least_samples(self, low_pass: LowPass, sampling_time: float) -> int:  # noqa: ARG002
        """Return how many samples a stretch without gaps must hold."""
        return LEAST_ROWS

    def initialise(self, own: Any, sampling_time: float, measured: tuple[bool, bool, bool]) -> None:
        """Write the settings of the method into the fields of a first state."""
        settings, model = self.settings, self.settings.model
        # A sample brings one row a sensor, and all of them together forget once
        own.recursion.forgetting = settings.forgetting_factor ** (1.0 / (1 + sum(measured)))
        own.inertia = model.driven
        own.disturbance = settings.force_noise or 0.0
        # Where samples are forgotten, large innovations show that friction has changed
        own.adaptations = settings.force_noise is None and settings.forgetting_factor == 1.0
        own.gate_scale = 1.0
        own.is_measured[:] = True, *measured
        for c, guess in enumerate([settings.position_noise, settings.velocity_noise] * 2):
            own.guess_samples[c] = 0.0 if guess is None else _GUESS_SAMPLES
            own.guess[c] = 0.0 if guess is None else guess**2
        axis = HeldAxis.of(model, sampling_time)
        states = axis.held.size
        own.transition[:] = np.eye(4)  # a rigid axis has a load that stays where it is
        own.transition[:states, :states] = axis.transition
        own.held[:states], own.ramped[:states] = axis.held, axis.ramped

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P of the recursion times the mean squared prediction error over its variance.

        With the noise known that factor is 1; otherwise it corrects the noise that P assumes.
        """
        own, covariance = at.fields(state), covariance_in(state)
        return covariance * own.residual_squares / own.rows if own.rows else covariance

    def force_noise(self, own: Any) -> float:
        """Return the standard deviation of the disturbance force [N or N m]."""
        return own.disturbance
