"""The energy estimator on line: its first state, and the samples of a log for it."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy import streaming_layout as at
from stickslip.estimation.energy.levels import AxisModel, load_position
from stickslip.estimation.online import recursion
from stickslip.estimation.signals.observation import HYSTERESIS
from stickslip.records import AxisLog, InputError

__all__ = ["first_state", "samples_of"]

_UNIT_LEVEL = 1.0  # [J]; without a disturbing force the estimates do not depend on it
_SAME_SAMPLING_TIME = 0.01  # relative


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
    force_noise: float,
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
        Standard deviations [J, N or N m].
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
    s[at.LEVEL_VARIANCE] = (_UNIT_LEVEL if level_noise is None else level_noise) ** 2
    s[at.FORCE_VARIANCE] = force_noise**2
    s[at.HYSTERESIS] = HYSTERESIS
    s[at.SQUARE_BIAS] = _square_bias(s[at.POLE], T)
    recursion.lay_prior(s, initial_values, initial_variance)
    return s


def samples_of(
    state: Float[np.ndarray, " s"], log: AxisLog, *, load: bool
) -> Float[np.ndarray, "n 5"]:
    """Return the samples of a log without gaps, in the form that a kernel takes.

    Parameters
    ----------
    state
        That the samples are for.
    log
        Without gaps.
    load
        Whether the state was made for measurements of the load.

    Raises
    ------
    InputError
        If the log has a gap or another sampling time than the state, or lacks a signal that the
        state was made for.
    """
    T, own = float(state[recursion.SAMPLING_TIME]), log.sampling_time
    if log.segment_starts.size > 1:
        k = int(log.segment_starts[1])
        raise InputError(
            f"the log has a gap of {log.time[k] - log.time[k - 1]:.6g} s before sample {k}",
            where=log.name,
            remedy="run its segments one by one, each from a new state with the last estimates as "
            "initial_values, or use fit",
        )
    if abs(own - T) > _SAME_SAMPLING_TIME * T:
        raise InputError(
            f"the log has a sampling time of {own:.6g} s, the state was made for {T:.6g} s",
            where=log.name,
            remedy=f"make the state with init(sampling_time={own:.6g})",
        )
    derived = state[recursion.DERIVED] > 0.0
    if log.measured_velocity is None and not derived:
        raise InputError(
            "the log holds no velocity, the state was made for a measured one",
            where=log.name,
            remedy="make the state with init(velocity_measured=False)",
        )
    if load:
        load_position(log)
        if log.measured_load_velocity is None and not derived:
            raise InputError(
                "the log holds no velocity of the load, the state was made for a measured one",
                where=log.name,
                remedy="make the state with init(velocity_measured=False)",
            )
    absent = np.zeros(len(log))
    columns = [
        log.effort,
        log.measured_position,
        absent if log.measured_velocity is None else log.measured_velocity,
        absent if log.measured_load_position is None else log.measured_load_position,
        absent if log.measured_load_velocity is None else log.measured_load_velocity,
    ]
    return np.column_stack(columns)
