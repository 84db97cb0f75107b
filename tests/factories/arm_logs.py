"""Logs of the demonstration's arm: driven by a fixed input, and by feedback that compensates."""

from typing import Literal

import numpy as np

from stickslip.control import (
    PD,
    FeedbackController,
    FrictionCompensation,
    Move,
    Notch,
    OnlineFriction,
    PointToPoint,
)
from stickslip.estimation import EnergyEstimator, PublishedEnergyEstimator
from stickslip.records import AxisLog
from stickslip.simulation import simulate, simulate_closed_loop
from stickslip.tasks import surrogate

Loop = Literal["feedforward", "feedback"]
T = surrogate.SAMPLING_TIME
ARM = {
    "inertia": surrogate.MASS_1,
    "load_inertia": surrogate.MASS_2,
    "stiffness": surrogate.STIFFNESS,
}
# Target [m], duration [s] and dwell [s]
MOVES = ((1.5, 5.0, 0.5), (-1.0, 7.0, 0.5), (0.5, 5.0, 0.5), (0.0, 5.0, 0.0))


def energy_estimator() -> EnergyEstimator:
    """Return the energy estimator with masses and spring given."""
    return EnergyEstimator(**ARM, offset=False)


def arm_log(loop: Loop, noise: float, generator: np.random.Generator) -> AxisLog:
    """Return the log of one run from rest, with noise relative to that of the demonstration [-].

    The loop is the to-and-fro input of the demonstration, or feedback whose friction compensation
    uses the running estimates of the published estimator.
    """
    sensors = surrogate.surrogate_sensors(noise)
    if loop == "feedforward":
        effort = surrogate.bang_bang_effort()
        motion = simulate(surrogate.surrogate_arm(), effort, sampling_time=T)
        return sensors.measure(motion, generator)
    return simulate_closed_loop(
        surrogate.surrogate_arm(),
        _feedback(noise),
        sampling_time=T,
        samples=round(surrogate.DURATION / T),
        sensors=sensors,
        generator=generator,
    ).log


def _feedback(noise: float) -> FeedbackController:
    published = PublishedEnergyEstimator(
        **ARM,
        compensation="printed",
        position_noise=noise * surrogate.POSITION_NOISE,
        velocity_noise=noise * surrogate.VELOCITY_NOISE,
        error_terms=True,
        initial_variance=1e3,
    )
    return arm_feedback(published)


def arm_feedback(estimator: EnergyEstimator | PublishedEnergyEstimator) -> FeedbackController:
    """Return the feedback of the arm, which compensates the friction of a running estimator."""
    friction = OnlineFriction(
        kernel=estimator.kernel,
        first_state=estimator.init(sampling_time=T),
        sampling_time=T,
        values_at=estimator.values_at,
        needs_load=True,
    )
    return FeedbackController(
        sampling_time=T,
        pd=PD(position_gain=1.5, velocity_gain=2.5),
        notch=Notch.at_resonance(
            mass_1=surrogate.MASS_1,
            mass_2=surrogate.MASS_2,
            stiffness=surrogate.STIFFNESS,
            depth=0.5,
            damping=0.4,
        ),
        compensation=FrictionCompensation(friction=friction),
        inertia=surrogate.MASS_1 + surrogate.MASS_2,
        effort_limit=2.0,
        reference=PointToPoint(
            moves=tuple(
                Move(target=target, duration=duration, dwell=dwell)
                for target, duration, dwell in MOVES
            )
        ),
    )
