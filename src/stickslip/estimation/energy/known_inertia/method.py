"""The energy method with a known inertia: work along motions without noise."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import work_regression
from stickslip.estimation.energy.known_inertia.free_friction import HeldAxis
from stickslip.estimation.energy.known_inertia.online import state as at
from stickslip.estimation.energy.known_inertia.online.recursion import work_run, work_step
from stickslip.estimation.energy.method import LEAST_ROWS, EnergyMethod, UsableLog
from stickslip.estimation.energy.samples import samples_of
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.online import recursion
from stickslip.estimation.online.faults.admission import set_admission
from stickslip.estimation.online.faults.guard import set_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.intervals.batches import clear_batches
from stickslip.estimation.online.intervals.contrasts import intervals_in
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import AxisLog

_GUESS_SAMPLES = 10.0
"""A guess of the noise counts for so many samples: it serves the start, and a wrong one is soon
outvoted."""


@dataclass(frozen=True)
class KnownInertiaMethod(EnergyMethod):
    """The balance of work, whitened by the Kalman filter of the known masses."""

    @property
    def kernel(self) -> Kernel:
        """The compiled step."""
        return work_step

    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows of the balance of work."""
        model, samples = self.settings.model, len(usable.log)
        return work_regression(parts, model, usable.low_pass, samples=samples, notes=usable.changes)

    def least_samples(self, low_pass: LowPass, sampling_time: float) -> int:  # noqa: ARG002
        """Return how many samples a stretch without gaps must hold."""
        return LEAST_ROWS

    def init(self, *, sampling_time: float, velocity_measured: bool, load_measured: bool) -> State:
        """Return the state before the first sample."""
        settings, model = self.settings, self.settings.model
        load = model.load_inertia is not None and load_measured
        measured = (True, velocity_measured, load, load and velocity_measured)
        s = np.zeros(at.STATE_SIZE)
        own = at.fields(s)
        self._set_recursion(own, sampling_time, velocity_measured=velocity_measured)
        # A sample brings one row a sensor, and all of them together forget once
        own.recursion.forgetting = settings.forgetting_factor ** (1.0 / sum(measured))
        own.inertia = model.driven
        own.disturbance = settings.force_noise or 0.0
        # Where samples are forgotten, large innovations show that friction has changed
        own.adaptations = settings.force_noise is None and settings.forgetting_factor == 1.0
        own.gate_scale = 1.0
        own.is_measured[:] = measured
        for c, guess in enumerate([settings.position_noise, settings.velocity_noise] * 2):
            own.guess_samples[c] = 0.0 if guess is None else _GUESS_SAMPLES
            own.guess[c] = 0.0 if guess is None else guess**2
        axis = HeldAxis.of(model, sampling_time)
        states = axis.held.size
        own.transition[:] = np.eye(4)  # a rigid axis has a load that stays where it is
        own.transition[:states, :states] = axis.transition
        own.held[:states], own.ramped[:states] = axis.held, axis.ramped
        set_admission(
            own.admission,
            sampling_time=sampling_time,
            effort_delay=settings.effort_delay,
            inertia=model.driven,
            measured=measured[1:],
        )
        clear_batches(own.batches)
        set_guard(s, own.guard)
        return s

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates."""
        load = self.settings.load_inertia is not None and at.fields(state).is_measured[2] > 0
        return work_run(state, samples_of(state, log, load=bool(load)))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P of the recursion times the mean squared prediction error over its variance.

        With the noise known that factor is 1; otherwise it corrects the noise that P assumes.
        """
        own, covariance = at.fields(state), recursion.covariance_in(state)
        return covariance * own.residual_squares / own.rows if own.rows else covariance

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals that allow for correlated residuals and errors of the model."""
        return intervals_in(at.fields(state))

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""
        own = at.fields(state)
        return health_of(
            own.admission,
            force_events=own.force_events,
            resets=int(own.guard.resets),
            force_noise=own.disturbance,
        )
