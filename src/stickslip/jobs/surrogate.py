"""The arm of the report's part A with surrogate values: its plant, its input and its sensors.

The report's table of parameters is lost. These values reproduce what its text says of the motion;
they are called surrogate wherever they are shown.
"""

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from stickslip.control import FeedbackController
    from stickslip.estimation import PublishedEnergyEstimator
    from stickslip.plants import FlexibleArm
    from stickslip.simulation import Sensors

__all__ = [
    "COULOMB_FRICTION",
    "DURATION",
    "FORGETTING_FACTOR",
    "INITIAL_VARIANCE",
    "LOOPS_SETTING",
    "MASS_1",
    "MASS_2",
    "POSITION_NOISE",
    "SAMPLING_TIME",
    "SETTING",
    "STIFFNESS",
    "TRUTH",
    "VELOCITY_NOISE",
    "VISCOUS_FRICTION",
    "bang_bang_effort",
    "feedback_controller",
    "setting_values",
    "surrogate_arm",
    "surrogate_sensors",
]

# Masses [kg], stiffness [N/m], friction [N, N s/m], times [s], effort [N], noise [m, m/s].
MASS_1 = 1.0
MASS_2 = 1.0
STIFFNESS = 1.0
COULOMB_FRICTION = 0.15
VISCOUS_FRICTION = 0.1
SAMPLING_TIME = 0.01
DURATION = 60.0
POSITION_NOISE = 0.005
VELOCITY_NOISE = 0.05
# Of the report's recursion: P(0) = INITIAL_VARIANCE I whatever the parameters' units.
INITIAL_VARIANCE = 1e3
FORGETTING_FACTOR = 1.0
TRUTH = MappingProxyType(
    {"coulomb_friction": COULOMB_FRICTION, "viscous_friction": VISCOUS_FRICTION}
)
SETTING = (
    f"masses {MASS_1:g} and {MASS_2:g} kg, spring {STIFFNESS:g} N/m (known to the estimator); "
    f"Coulomb friction {COULOMB_FRICTION:g} N, viscous friction {VISCOUS_FRICTION:g} N s/m (to be "
    f"found); sensor noise {POSITION_NOISE:g} m and {VELOCITY_NOISE:g} m/s"
)

_EFFORT = 1.0
_SWITCHING_TIME = 5.0

# The report says of its feedback only what it consists of: PD, a notch, and compensation of
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
    f"Feedforward: {_EFFORT:g} N one way for {_SWITCHING_TIME:g} s, the other way for as long, "
    f"then none. Feedback: K_p = {_POSITION_GAIN:g} N/m and K_d = {_VELOCITY_GAIN:g} N s/m through "
    f"a notch at the arm's resonance (depth {_NOTCH_DEPTH:g}, damping {_NOTCH_DAMPING:g}), at "
    f"most {_EFFORT_LIMIT:g} N, along a reference that moves to {_PLACES} m, whose acceleration of "
    "both masses is fed forward (not in the report) and whose friction is compensated. "
    f"Both for {DURATION:g} s, sampled every {SAMPLING_TIME:g} s. The report's recursion begins "
    f"with first guesses of zero and P(0) = {INITIAL_VARIANCE:g} I; its forgetting factor is "
    f"{FORGETTING_FACTOR:g}"
)
"""What both loops of chapter 6 do, and what the recursion begins with."""


def setting_values() -> dict[str, dict[str, tuple[float | tuple[float, ...], str]]]:
    """Return what `SETTING` and `LOOPS_SETTING` say, by group and name, each with its unit."""
    targets, durations, dwells = zip(*_MOVES, strict=True)
    return {
        "truth": {
            "coulomb_friction": (COULOMB_FRICTION, "N"),
            "viscous_friction": (VISCOUS_FRICTION, "N s/m"),
        },
        "known": {
            "mass_1": (MASS_1, "kg"),
            "mass_2": (MASS_2, "kg"),
            "stiffness": (STIFFNESS, "N/m"),
        },
        "noise": {"position": (POSITION_NOISE, "m"), "velocity": (VELOCITY_NOISE, "m/s")},
        "sampling": {"sampling_time": (SAMPLING_TIME, "s"), "duration": (DURATION, "s")},
        "feedforward": {"effort": (_EFFORT, "N"), "switching_time": (_SWITCHING_TIME, "s")},
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


def surrogate_arm() -> "FlexibleArm":
    """Return the arm: two masses and a spring, friction on the first, static equal to Coulomb."""
    # Imported here, as the compiler behind the plants takes a second to load.
    from stickslip.friction import CoulombViscousFriction
    from stickslip.plants import FlexibleArm

    return FlexibleArm(
        mass_1=MASS_1,
        mass_2=MASS_2,
        stiffness=STIFFNESS,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=COULOMB_FRICTION, viscous_friction=VISCOUS_FRICTION
        ),
    )


def bang_bang_effort(sampling_time: float = SAMPLING_TIME) -> Float[np.ndarray, " n"]:
    """Return the effort held over each sample [N]: one way, the other way, then none.

    Parameters
    ----------
    sampling_time
        [s].
    """
    held = round(_SWITCHING_TIME / sampling_time)
    effort = np.zeros(round(DURATION / sampling_time))
    effort[:held] = _EFFORT
    effort[held : 2 * held] = -_EFFORT
    return effort


def surrogate_sensors(noise: float = 1.0) -> "Sensors":
    """Return the sensors of both masses.

    Parameters
    ----------
    noise
        Their noise, over that of the surrogate values [-]; 0 for ideal sensors.
    """
    from stickslip.simulation import Sensors

    return Sensors(position_noise=noise * POSITION_NOISE, velocity_noise=noise * VELOCITY_NOISE)


def feedback_controller(
    estimator: "PublishedEnergyEstimator", state: Float[np.ndarray, " s"]
) -> "FeedbackController":
    """Return the feedback of section 6.2, which compensates what an estimator finds on the way.

    Parameters
    ----------
    estimator
        Whose estimates are compensated.
    state
        What it begins with [units of the estimator].
    """
    from stickslip.control import (
        PD,
        FeedbackController,
        FrictionCompensation,
        Move,
        Notch,
        OnlineFriction,
        PointToPoint,
    )

    return FeedbackController(
        sampling_time=SAMPLING_TIME,
        pd=PD(position_gain=_POSITION_GAIN, velocity_gain=_VELOCITY_GAIN),
        notch=Notch.at_resonance(
            mass_1=MASS_1,
            mass_2=MASS_2,
            stiffness=STIFFNESS,
            depth=_NOTCH_DEPTH,
            damping=_NOTCH_DAMPING,
        ),
        compensation=FrictionCompensation(
            friction=OnlineFriction(
                kernel=estimator.kernel,
                first_state=state,
                sampling_time=SAMPLING_TIME,
                values_at=estimator.values_at,
                needs_load=True,
            )
        ),
        inertia=MASS_1 + MASS_2,
        effort_limit=_EFFORT_LIMIT,
        reference=PointToPoint(
            moves=tuple(
                Move(target=target, duration=duration, dwell=dwell)
                for target, duration, dwell in _MOVES
            )
        ),
    )
