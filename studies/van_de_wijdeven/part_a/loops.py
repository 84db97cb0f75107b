"""The two loops of chapter 6 for the surrogate arm: their settings and the feedback controller."""

import numpy as np
from jaxtyping import Float

from stickslip.control import (
    PD,
    FeedbackController,
    FrictionCompensation,
    Move,
    Notch,
    OnlineFriction,
    PointToPoint,
)
from stickslip.estimation import PublishedEnergyEstimator
from stickslip.tasks import surrogate

# Of the source's recursion: P(0) = INITIAL_VARIANCE I whatever the parameters' units.
INITIAL_VARIANCE = 1e3
FORGETTING_FACTOR = 1.0

# The source says of its feedback only what it consists of: PD, a notch, and compensation of
# friction. These gains let noise alone, K_d sigma_v = 0.125 N, not free the resting mass, and damp
# the load's swing as well as a loop around the first mass can.
_POSITION_GAIN = 1.5
_VELOCITY_GAIN = 2.5
_NOTCH_DEPTH = 0.5
_NOTCH_DAMPING = 0.4
_EFFORT_LIMIT = 2.0
# Target [m], duration [s] and dwell [s]; as long as the bang-bang input moves the arm.
_MOVES = ((1.5, 5.0, 0.5), (-1.0, 7.0, 0.5), (0.5, 5.0, 0.5), (0.0, 5.0, 0.0))

_PLACES = ", ".join(f"{target:g}" for target, _, _ in _MOVES).replace("-", "−")
LOOPS_SETTING = (
    f"Feedforward: {surrogate.EFFORT:g} N one way for {surrogate.SWITCHING_TIME:g} s, the other "
    f"way for as long, then none. Feedback: K_p = {_POSITION_GAIN:g} N/m and "
    f"K_d = {_VELOCITY_GAIN:g} N s/m through a notch at the arm's resonance (depth "
    f"{_NOTCH_DEPTH:g}, damping {_NOTCH_DAMPING:g}), at most {_EFFORT_LIMIT:g} N, along a "
    f"reference that moves to {_PLACES} m, whose acceleration of both masses is fed forward (not "
    "in the source) and whose friction is compensated. "
    f"Both for {surrogate.DURATION:g} s, sampled every {surrogate.SAMPLING_TIME:g} s. The source's "
    f"recursion begins with first guesses of zero and P(0) = {INITIAL_VARIANCE:g} I; its "
    f"forgetting factor is {FORGETTING_FACTOR:g}"
)
"""Common values of both loops of chapter 6, and the begin of the recursion."""


def setting_values() -> dict[str, dict[str, tuple[float | tuple[float, ...], str]]]:
    """Return what `SETTING` and `LOOPS_SETTING` say, by group and name, each with its unit."""
    targets, durations, dwells = zip(*_MOVES, strict=True)
    return {
        "truth": {
            "coulomb_friction": (surrogate.COULOMB_FRICTION, "N"),
            "viscous_friction": (surrogate.VISCOUS_FRICTION, "N s/m"),
        },
        "known": {
            "mass_1": (surrogate.MASS_1, "kg"),
            "mass_2": (surrogate.MASS_2, "kg"),
            "stiffness": (surrogate.STIFFNESS, "N/m"),
        },
        "noise": {
            "position": (surrogate.POSITION_NOISE, "m"),
            "velocity": (surrogate.VELOCITY_NOISE, "m/s"),
        },
        "sampling": {
            "sampling_time": (surrogate.SAMPLING_TIME, "s"),
            "duration": (surrogate.DURATION, "s"),
        },
        "feedforward": {
            "effort": (surrogate.EFFORT, "N"),
            "switching_time": (surrogate.SWITCHING_TIME, "s"),
        },
        "feedback": {
            "position_gain": (_POSITION_GAIN, "N/m"),
            "velocity_gain": (_VELOCITY_GAIN, "N s/m"),
            "notch_depth": (_NOTCH_DEPTH, "-"),
            "notch_damping": (_NOTCH_DAMPING, "-"),
            "effort_limit": (_EFFORT_LIMIT, "N"),
            "move_targets": (targets, "m"),
            "move_durations": (durations, "s"),
            "move_dwells": (dwells, "s"),
        },
        "recursion": {
            "initial_variance": (INITIAL_VARIANCE, "parameter squared"),
            "forgetting_factor": (FORGETTING_FACTOR, "-"),
        },
    }


def feedback_controller(
    estimator: PublishedEnergyEstimator, state: Float[np.ndarray, " s"]
) -> FeedbackController:
    """Return the feedback of section 6.2, which compensates the running estimates of an estimator.

    ``state`` is that with which the estimator begins.
    """
    return FeedbackController(
        sampling_time=surrogate.SAMPLING_TIME,
        pd=PD(position_gain=_POSITION_GAIN, velocity_gain=_VELOCITY_GAIN),
        notch=Notch.at_resonance(
            mass_1=surrogate.MASS_1,
            mass_2=surrogate.MASS_2,
            stiffness=surrogate.STIFFNESS,
            depth=_NOTCH_DEPTH,
            damping=_NOTCH_DAMPING,
        ),
        compensation=FrictionCompensation(
            friction=OnlineFriction(
                kernel=estimator.kernel,
                first_state=state,
                sampling_time=surrogate.SAMPLING_TIME,
                values_at=estimator.values_at,
                needs_load=True,
            )
        ),
        inertia=surrogate.MASS_1 + surrogate.MASS_2,
        effort_limit=_EFFORT_LIMIT,
        reference=PointToPoint(
            moves=tuple(
                Move(target=target, duration=duration, dwell=dwell)
                for target, duration, dwell in _MOVES
            )
        ),
    )
