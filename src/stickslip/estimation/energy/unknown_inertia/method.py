"""The energy method with an unknown inertia: levels of energy, then work with one more column."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import sought_regression
from stickslip.estimation.energy.method import LEAST_ROWS, EnergyMethod, UsableLog
from stickslip.estimation.energy.samples import samples_of
from stickslip.estimation.energy.unknown_inertia.level_regression import (
    block_size,
    level_regression,
)
from stickslip.estimation.energy.unknown_inertia.online import state as at
from stickslip.estimation.energy.unknown_inertia.online.recursion import energy_run, energy_step
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.online import recursion
from stickslip.estimation.online.faults.admission import set_admission
from stickslip.estimation.online.faults.guard import set_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.intervals.batches import clear_batches
from stickslip.estimation.online.intervals.contrasts import intervals_in
from stickslip.estimation.online.method import Kernel, State
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.sensor_noise import chosen_cutoff
from stickslip.records import AxisLog, InputError

_UNIT_LEVEL = 1.0  # [J]; without a disturbing force the estimates do not depend on it
_EDGE_PERIODS = 2.0
"""Periods of the cutoff that the low-pass remembers how it began: two stages with a pole of
exp(-2 pi cutoff T) leave 5e-5 of it."""


@dataclass(frozen=True)
class UnknownInertiaMethod(EnergyMethod):
    """Levels of energy give the first guess of the inertia; the balance of work refines it."""

    @property
    def kernel(self) -> Kernel:
        """The compiled step."""
        return energy_step

    def usable(self, log: AxisLog) -> UsableLog:
        """Return a log with even samples and credible velocities, and a low-pass that fits it."""
        settings, usable = self.settings, super().usable(log)
        if settings.cutoff is not None:
            return usable
        cutoff, lowered = chosen_cutoff(
            usable.log, usable.low_pass, LEAST_ROWS, load=settings.load_inertia is not None
        )
        low_pass = LowPass(order=settings.filter_order, cutoff=cutoff)
        return replace(usable, low_pass=low_pass, lowered=lowered)

    def rows(self, usable: UsableLog, parts: list[AxisLog]) -> Regression:
        """Return the whitened rows: of work, or of levels where samples are explained badly."""
        log, settings = usable.log, self.settings
        levels = level_regression(
            parts,
            settings.model,
            settings.parameter_names(log.kind),
            usable.low_pass,
            sampling_time=log.sampling_time,
            samples=len(log),
            notes=(*usable.changes, *usable.lowered),
        )
        low_pass = settings.low_pass(log.sampling_time)
        return sought_regression(levels, parts, settings.model, low_pass, notes=usable.changes)

    def least_samples(self, low_pass: LowPass, sampling_time: float) -> int:
        """Return how many samples a stretch without gaps must hold."""
        return LEAST_ROWS * block_size(low_pass, sampling_time)

    def init(self, *, sampling_time: float, velocity_measured: bool, load_measured: bool) -> State:
        """Return the state before the first sample."""
        settings, T = self.settings, sampling_time
        if settings.load_inertia is not None and not load_measured:
            raise InputError("load_not_measured")
        cutoff = settings.low_pass(T).cutoff
        position, velocity = settings.position_noise, settings.velocity_noise
        level = _UNIT_LEVEL if settings.level_noise is None else settings.level_noise
        s = np.zeros(at.STATE_SIZE)
        own = at.fields(s)
        self._set_recursion(own, sampling_time, velocity_measured=velocity_measured)
        own.pole = np.exp(-2.0 * np.pi * cutoff * T)
        own.position_noise = -1.0 if position is None else position
        own.velocity_noise = -1.0 if velocity is None else velocity
        own.row_variance = own.level_variance = level**2
        own.force_variance = (settings.force_noise or 0.0) ** 2
        own.adaptations = settings.force_noise is None and settings.forgetting_factor == 1.0
        own.settle = 1.0 if velocity_measured else np.ceil(_EDGE_PERIODS / (cutoff * T))
        own.square_bias = _square_bias(own.pole, T)
        load = settings.stiffness is not None
        set_admission(
            own.admission,
            sampling_time=T,
            effort_delay=settings.effort_delay,
            inertia=None,
            measured=(velocity_measured, load, load and velocity_measured),
        )
        clear_batches(own.batches)
        set_guard(s, own.guard)
        return s

    def run(self, state: State, log: AxisLog) -> tuple[State, Float[np.ndarray, "n p"]]:
        """Take the samples of a log without gaps; return the state and the estimates."""
        load = self.settings.load_inertia is not None
        return energy_run(state, samples_of(state, log, load=load))

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P times the mean squared innovation, which corrects the arbitrary level noise."""
        own, covariance = at.fields(state), recursion.covariance_in(state)
        return covariance * own.gate_scale if own.rows > 0.0 else covariance

    def intervals(self, state: State) -> Float[np.ndarray, "p 2"]:
        """Return 95 % intervals that allow for correlated residuals and errors of the model."""
        return intervals_in(at.fields(state))

    def health(self, state: State) -> OnlineHealth:
        """Return what was missing, rejected and reset so far."""
        own = at.fields(state)
        unit = own.gate_scale if own.adaptations > 0.0 else 1.0
        return health_of(
            own.admission,
            resets=int(own.guard.resets),
            force_events=own.force_events,
            force_noise=float(np.sqrt(unit * own.force_variance)),
        )


def _square_bias(pole: float, sampling_time: float) -> float:
    """Return what white noise on a position adds to its squared derivative, over its variance.

    The derivative is the central difference after two first-order stages with the pole, with
    autocorrelation R; the integral over a sample is T (v_- v + dv^2 / 3), whose mean is
    T (2 R(0) + R(1)) / 3.
    """
    q = pole**2

    def smoothed(lag: int) -> float:
        return (1 - pole) ** 4 * pole**lag * ((1 + q) / (1 - q) ** 3 + lag / (1 - q) ** 2)

    at_once = 2 * smoothed(0) - 2 * smoothed(2)
    one_later = smoothed(1) - smoothed(3)
    return (2 * at_once + one_later) / 3 / (2 * sampling_time) ** 2
