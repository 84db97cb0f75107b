"""The balance of work on line: its first state, and the covariance of its estimates."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.known_inertia.innovations import HeldAxis
from stickslip.estimation.energy.known_inertia.online import layout as at
from stickslip.estimation.energy.levels import AxisModel
from stickslip.estimation.online import recursion
from stickslip.estimation.online.faults.admission import lay_admission
from stickslip.estimation.online.faults.guard import RESETS, lay_guard
from stickslip.estimation.online.faults.health import OnlineHealth, health_of
from stickslip.estimation.online.intervals.batches import lay_batches
from stickslip.estimation.online.intervals.contrasts import intervals_in
from stickslip.estimation.online.recursion import covariance_in

__all__ = ["first_work_state", "work_covariance", "work_health", "work_intervals"]

_GUESS_SAMPLES = 10.0
"""A guess of the noise counts for so many samples: it serves the start, and a wrong one is soon
outvoted."""


def first_work_state(
    *,
    model: AxisModel,
    inertia: float,
    sampling_time: float,
    velocity_measured: bool,
    load_measured: bool,
    forgetting_factor: float,
    initial_values: Sequence[float],
    initial_variance: float | None,
    force_noise: float | None,
    effort_delay: float = 0.0,
    position_noise: float | None,
    velocity_noise: float | None,
) -> Float[np.ndarray, " s"]:
    """Return the state of the recursion before the first sample.

    Parameters
    ----------
    model
        What is known of the axis, and what is sought.
    inertia
        Of the driven mass [kg or kg m^2].
    sampling_time
        [s].
    velocity_measured
        Whether the samples hold velocities.
    load_measured
        Whether they hold the load of a flexible arm.
    forgetting_factor
        In (0, 1], of a sample [-].
    initial_values
        First guesses [SI].
    initial_variance
        Diagonal of P(0) [squared unit of the parameters]; None for one that follows the size of the
        regressors.
    force_noise
        Standard deviation of a disturbance force, white from sample to sample [N or N m]; None
        estimates it from the innovations, unless samples are forgotten (large innovations then show
        that friction has changed).
    effort_delay
        Samples by which the effort acts after it is logged [-].
    position_noise, velocity_noise
        Guesses of the standard deviations [m or rad, m/s or rad/s].
    """
    load = model.load_inertia is not None and load_measured
    seen = np.array([True, velocity_measured, load, load and velocity_measured])
    p = len(initial_values)
    s = np.zeros(at.STATE_SIZE)
    s[recursion.PARAMETERS] = p
    # A sample brings one row a sensor, and all of them together forget once
    s[recursion.FORGETTING] = forgetting_factor ** (1.0 / int(np.sum(seen)))
    s[recursion.SAMPLING_TIME] = sampling_time
    s[at.INERTIA] = inertia
    s[recursion.LOAD_INERTIA] = model.load_inertia or 0.0
    s[recursion.STIFFNESS] = model.stiffness or 0.0
    recursion.lay_friction(s, model.terms)
    s[recursion.DERIVED] = not velocity_measured
    s[at.DISTURBANCE] = force_noise or 0.0
    s[at.ADAPTED] = force_noise is None and forgetting_factor == 1.0
    s[at.GATE_SCALE] = 1.0
    lay_batches(s, at.BATCHES)
    lay_admission(
        at.admission(s),
        sampling_time=sampling_time,
        effort_delay=effort_delay,
        inertia=inertia,
        measured=(velocity_measured, load, load and velocity_measured),
    )
    s[at.SEEN : at.SEEN + 4] = seen
    for channel, guess in enumerate([position_noise, velocity_noise] * 2):
        s[at.GUESSED + channel] = 0.0 if guess is None else _GUESS_SAMPLES
        s[at.GUESS + channel] = 0.0 if guess is None else guess**2
    axis = HeldAxis.of(
        inertia=inertia,
        load_inertia=model.load_inertia,
        stiffness=model.stiffness,
        sampling_time=sampling_time,
    )
    states = axis.held.size
    transition = np.eye(4)  # a rigid axis has a load that stays where it is
    transition[:states, :states] = axis.transition
    s[at.AXIS : at.AXIS + 16] = transition.ravel()
    s[at.AXIS + 16 : at.AXIS + 16 + states] = axis.held
    s[at.AXIS + 20 : at.AXIS + 20 + states] = axis.ramped
    recursion.lay_prior(s, initial_values, initial_variance)
    recursion.lay_information(s, at.INFORMATION, at.MOST, initial_values, initial_variance)
    lay_guard(s, at.GUARD, at.GUARD)
    return s


def work_covariance(state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
    """Return P times the mean squared prediction error over its variance.

    With the noise known that factor is 1; otherwise it puts right what P takes for granted.
    """
    if state[at.ROWS] == 0.0:
        return covariance_in(state)
    return covariance_in(state) * state[at.RESIDUALS] / state[at.ROWS]


def work_intervals(state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p 2"]:
    """Return 95 % intervals that allow for correlated residuals and errors of the model [SI]."""
    return intervals_in(
        state,
        information=at.INFORMATION,
        batches=at.BATCHES,
        contrasts=at.CONTRASTS,
        most=at.MOST,
    )


def work_health(state: Float[np.ndarray, " s"]) -> OnlineHealth:
    """Return what was missing, rejected and reset so far."""
    return health_of(
        at.admission(state),
        force_events=state[at.FORCE_EVENTS],
        resets=state[at.GUARD + RESETS],
        force_noise=state[at.DISTURBANCE],
    )
