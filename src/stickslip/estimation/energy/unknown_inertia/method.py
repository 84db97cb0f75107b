"""The energy method with an unknown inertia: levels of energy, then work with one more column."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.balance import sought_regression
from stickslip.estimation.energy.method import LEAST_ROWS, EnergyMethod, UsableLog
from stickslip.estimation.energy.unknown_inertia.level_regression import (
    block_size,
    level_regression,
)
from stickslip.estimation.energy.unknown_inertia.online import state as at
from stickslip.estimation.energy.unknown_inertia.online.recursion import energy_run, energy_step
from stickslip.estimation.fit.rows import Regression
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import covariance_in
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

    kernel = staticmethod(energy_step)
    run_kernel = staticmethod(energy_run)
    fields = staticmethod(at.fields)
    state_size = at.STATE_SIZE

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

    def initialise(self, own: Any, sampling_time: float, measured: tuple[bool, bool, bool]) -> None:
        """Write the settings of the method into the fields of a first state."""
        settings, T = self.settings, sampling_time
        velocity_measured, load_measured, _ = measured
        if settings.load_inertia is not None and not load_measured:
            raise InputError("load_not_measured")
        cutoff = settings.low_pass(T).cutoff
        position, velocity = settings.position_noise, settings.velocity_noise
        level = _UNIT_LEVEL if settings.level_noise is None else settings.level_noise
        own.pole = np.exp(-2.0 * np.pi * cutoff * T)
        own.position_noise = -1.0 if position is None else position
        own.velocity_noise = -1.0 if velocity is None else velocity
        own.row_variance = own.level_variance = level**2
        own.force_variance = (settings.force_noise or 0.0) ** 2
        own.adaptations = settings.force_noise is None and settings.forgetting_factor == 1.0
        own.settle = 1.0 if velocity_measured else np.ceil(_EDGE_PERIODS / (cutoff * T))
        own.square_bias = _square_bias(own.pole, T)

    def covariance(self, state: State) -> Float[np.ndarray, "p p"]:
        """Return P times the mean squared innovation, which corrects the arbitrary level noise."""
        own, covariance = at.fields(state), covariance_in(state)
        return covariance * own.gate_scale if own.rows > 0.0 else covariance

    def force_noise(self, own: Any) -> float:
        """Return the standard deviation of the disturbance force [N or N m]."""
        unit = own.gate_scale if own.adaptations > 0.0 else 1.0
        return float(np.sqrt(unit * own.force_variance))


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
