"""Online energy estimator with an unknown inertia: first state, intervals and health."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.energy.unknown_inertia.online import layout as at
from stickslip.estimation.online import recursion
from stickslip.estimation.online.faults.admission import lay_admission
from stickslip.estimation.online.faults.guard import RESETS, lay_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.intervals.batches import lay_batches
from stickslip.estimation.online.intervals.contrasts import intervals_in
from stickslip.estimation.online.recursion import MOST_PARAMETERS
from stickslip.estimation.signals.observation import HYSTERESIS

__all__ = ["first_state", "level_covariance", "level_health", "level_intervals"]

_UNIT_LEVEL = 1.0  # [J]; without a disturbing force the estimates do not depend on it
_EDGE_PERIODS = 2.0
"""Periods of the cutoff that the low-pass remembers how it began: two stages with a pole of
exp(-2 pi cutoff T) leave 5e-5 of it."""


def _square_bias(pole: float, sampling_time: float) -> float:
    """Return what white noise on a position adds to its squared derivative, over its variance.

    The derivative is the central difference after two first-order stages, with autocorrelation R;
    the integral over a sample is T (v_- v + dv^2 / 3), whose mean is T (2 R(0) + R(1)) / 3.

    Parameters
    ----------
    pole
        Of each stage [-].
    sampling_time
        [s].
    """
    q = pole**2

    def smoothed(lag: int) -> float:
        return (1 - pole) ** 4 * pole**lag * ((1 + q) / (1 - q) ** 3 + lag / (1 - q) ** 2)

    at_once = 2 * smoothed(0) - 2 * smoothed(2)
    one_later = smoothed(1) - smoothed(3)
    return (2 * at_once + one_later) / 3 / (2 * sampling_time) ** 2


def first_state(
    *,
    model: AxisModel,
    sampling_time: float,
    velocity_measured: bool,
    cutoff: float,
    forgetting_factor: float,
    initial_values: Sequence[float],
    initial_variance: float | None,
    level_noise: float | None,
    force_noise: float | None,
    effort_delay: float,
    position_noise: float | None,
    velocity_noise: float | None,
) -> Float[np.ndarray, " s"]:
    """Return the state of the recursion before the first sample.

    Parameters
    ----------
    model
        What is known of the axis, and what is sought.
    sampling_time
        [s].
    velocity_measured
        Whether the samples hold velocities.
    cutoff
        Of the low-pass before positions are differentiated [Hz].
    forgetting_factor
        In (0, 1] [-].
    initial_values
        First guesses [SI].
    initial_variance
        Diagonal of P(0) [squared unit of the parameters over the level noise]; None for one that
        follows the size of the regressors.
    level_noise, force_noise
        Standard deviations [J, N or N m]. A force noise of None is estimated, or taken as zero if
        samples are forgotten.
    effort_delay
        Samples by which the effort acts after it is logged [-].
    position_noise, velocity_noise
        Standard deviations [m or rad, m/s or rad/s]; None estimates them on the way.
    """
    T = sampling_time
    p = len(initial_values)
    s = np.zeros(at.STATE_SIZE)
    s[recursion.SAMPLING_TIME] = T
    s[recursion.FORGETTING] = forgetting_factor
    s[recursion.PARAMETERS] = p
    s[recursion.LOAD_INERTIA] = model.load_inertia or 0.0
    s[recursion.STIFFNESS] = model.stiffness or 0.0
    recursion.lay_friction(s, model.terms)
    s[recursion.DERIVED] = not velocity_measured
    s[at.POLE] = np.exp(-2.0 * np.pi * cutoff * T)
    s[at.POSITION_NOISE] = -1.0 if position_noise is None else position_noise
    s[at.VELOCITY_NOISE] = -1.0 if velocity_noise is None else velocity_noise
    s[at.ROW_VARIANCE] = (_UNIT_LEVEL if level_noise is None else level_noise) ** 2
    s[at.LEVEL_VARIANCE] = s[at.ROW_VARIANCE]
    s[at.FORCE_VARIANCE] = (force_noise or 0.0) ** 2
    s[at.ADAPTED] = force_noise is None and forgetting_factor == 1.0
    s[at.SETTLE] = 1.0 if velocity_measured else np.ceil(_EDGE_PERIODS / (cutoff * T))
    s[at.HYSTERESIS] = HYSTERESIS
    s[at.SQUARE_BIAS] = _square_bias(s[at.POLE], T)
    recursion.lay_prior(s, initial_values, initial_variance)
    recursion.lay_information(s, at.INFORMATION, MOST_PARAMETERS, initial_values, initial_variance)
    load = model.stiffness is not None
    lay_admission(
        at.admission(s),
        sampling_time=T,
        effort_delay=effort_delay,
        inertia=None,
        measured=(velocity_measured, load, load and velocity_measured),
    )
    lay_batches(s, at.BATCHES)
    lay_guard(s, at.GUARD, at.GUARD)
    return s


def level_covariance(state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
    """Return P times the mean squared innovation, which puts the arbitrary level noise right."""
    covariance = recursion.covariance_in(state)
    return covariance * state[at.GATE_SCALE] if state[at.ROWS] > 0.0 else covariance


def level_intervals(state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p 2"]:
    """Return 95 % intervals that allow for correlated residuals and errors of the model [SI]."""
    return intervals_in(
        state,
        information=at.INFORMATION,
        batches=at.BATCHES,
        contrasts=at.CONTRASTS,
        most=MOST_PARAMETERS,
    )


def level_health(state: Float[np.ndarray, " s"]) -> OnlineHealth:
    """Return what was missing, rejected and reset so far."""
    unit = state[at.GATE_SCALE] if state[at.ADAPTED] > 0.0 else 1.0
    return health_of(
        at.admission(state),
        resets=state[at.GUARD + RESETS],
        force_events=state[at.FORCE_EVENTS],
        force_noise=float(np.sqrt(unit * state[at.FORCE_VARIANCE])),
    )
