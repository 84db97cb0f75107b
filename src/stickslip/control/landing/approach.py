"""The feedback phase of a landing: gains and reference for an arm, where they are not given."""

from math import pi, sqrt

import numpy as np
from jaxtyping import Float

from stickslip.control.feedback.controller import FeedbackController
from stickslip.control.feedback.friction_compensation import (
    FrictionCompensation,
    OnlineFriction,
    RunningEstimator,
)
from stickslip.control.feedback.linear_parts import PD, Notch
from stickslip.control.feedback.reference import Move, PointToPoint
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass

__all__ = ["arm_approach", "scaled_notch", "scaled_pd"]

# The gains of the surrogate arm of the demonstration, without units
_STIFFNESS_SHARE = 1.5  # of the position gain
_DAMPING_SHARE = 2.5  # of the velocity gain, over the root of stiffness times mean mass
_NOTCH_DEPTH, _NOTCH_DAMPING = 0.5, 0.4

_EFFORT_SHARE = 0.4  # of the limit that the reference's acceleration may take
_PEAK = 5.7735  # peak acceleration of a minimum-jerk move over length/duration^2: 10/sqrt(3)
_PERIODS = 1.5  # of the free arm that the reference takes at least
_SAMPLES = 40.0  # that the reference of a single mass takes at least
_POLE = 20.0  # of the feedback of a single mass, over the reference's duration
_FASTEST = 0.3  # that pole at most, over the sampling rate


def scaled_pd(arm: FlexibleArm) -> PD:
    """Return the gains of the surrogate arm, scaled with this arm's spring and masses.

    Parameters
    ----------
    arm
        As it is believed to be.
    """
    mean = 0.5 * (arm.mass_1 + arm.mass_2)
    return PD(
        position_gain=_STIFFNESS_SHARE * arm.stiffness,
        velocity_gain=_DAMPING_SHARE * sqrt(arm.stiffness * mean),
    )


def scaled_notch(arm: FlexibleArm) -> Notch:
    """Return the shallow notch of the surrogate arm at this arm's resonance.

    Parameters
    ----------
    arm
        As it is believed to be.
    """
    return Notch.at_resonance(
        mass_1=arm.mass_1,
        mass_2=arm.mass_2,
        stiffness=arm.stiffness,
        depth=_NOTCH_DEPTH,
        damping=_NOTCH_DAMPING,
    )


def arm_approach(
    arm: FlexibleArm,
    *,
    sampling_time: float,
    effort_limit: float,
    start: float,
    target: float,
    pd: PD,
    notch: Notch,
    estimator: RunningEstimator,
    estimator_state: Float[np.ndarray, " e"],
) -> FeedbackController:
    """Return the feedback that takes mass 1 from a place to another along a smooth reference.

    The reference takes long enough that its acceleration of both masses needs no more than a part
    of the effort limit, and does not excite the resonance.

    Parameters
    ----------
    arm
        As it is believed to be.
    sampling_time
        [s].
    effort_limit
        [N or N m].
    start, target
        Of mass 1 [m or rad].
    pd, notch
        Of the feedback.
    estimator, estimator_state
        What compensates the friction, and what it has learned so far [its own units].
    """
    m = arm.mass_1 + arm.mass_2
    resonance = sqrt(arm.stiffness * (1.0 / arm.mass_1 + 1.0 / arm.mass_2))
    duration = max(_lightly(m, target - start, effort_limit), _PERIODS * 2.0 * pi / resonance)
    return FeedbackController(
        sampling_time=sampling_time,
        pd=pd,
        notch=notch,
        compensation=_compensation(estimator, estimator_state, sampling_time, load=True),
        inertia=m,
        effort_limit=effort_limit,
        reference=PointToPoint(start=start, moves=(Move(target=target, duration=duration),)),
    )


def axis_approach(
    axis: SingleMass[CoulombViscousFriction],
    *,
    sampling_time: float,
    effort_limit: float,
    start: float,
    target: float,
    pd: PD | None,
    estimator: RunningEstimator,
    estimator_state: Float[np.ndarray, " e"],
) -> FeedbackController:
    """Return the feedback that takes a single mass from a place to another.

    Parameters
    ----------
    axis
        As it is believed to be.
    sampling_time, effort_limit, start, target, estimator, estimator_state
        As of `arm_approach`.
    pd
        Of the feedback; None for a double pole that is fast beside the reference.
    """
    m = axis.mass
    duration = max(_lightly(m, target - start, effort_limit), _SAMPLES * sampling_time)
    w = min(_POLE / duration, _FASTEST / sampling_time)
    return FeedbackController(
        sampling_time=sampling_time,
        pd=PD(position_gain=m * w**2, velocity_gain=2.0 * m * w) if pd is None else pd,
        compensation=_compensation(estimator, estimator_state, sampling_time, load=False),
        inertia=m,
        effort_limit=effort_limit,
        reference=PointToPoint(start=start, moves=(Move(target=target, duration=duration),)),
    )


def _lightly(mass: float, way: float, effort_limit: float) -> float:
    """Return how long a reference must take for its acceleration to need a part of the effort."""
    return sqrt(_PEAK * abs(way) * mass / (_EFFORT_SHARE * effort_limit))


def _compensation(
    estimator: RunningEstimator,
    state: Float[np.ndarray, " e"],
    sampling_time: float,
    *,
    load: bool,
) -> FrictionCompensation:
    return FrictionCompensation(
        friction=OnlineFriction(
            kernel=estimator.kernel,
            first_state=state,
            sampling_time=sampling_time,
            values_at=estimator.values_at,
            needs_load=load,
            covariance=estimator.covariance,
        )
    )
