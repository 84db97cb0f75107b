"""The servo of an axis that vibrates, where the samples are short enough for one.

A vibration that lasts many samples disturbs what a move learns, and swings the axis off its target
after a stop. The feedback of a servo damps it. At long sampling times it could not.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.feedback import profile_kernels as servo
from stickslip.control.feedback.profile import ProfileController
from stickslip.control.precise.learning import SERVO
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.control.pulses.exact_state import law_of
from stickslip.friction import CoulombViscousFriction

_STRONGEST = 0.9  # of the effort limit: friction
_SURELY = 4.0  # standard deviations of a position: its largest error
_SHORT = 0.05  # of the tolerance: F T^2/(2 m) at most, the way of friction in a sample
_NOISE = 0.1  # of the effort limit: the effort by noise at most
_LONGEST, _LEAST_TIME = 20.0, 1.0  # times a move, and [s]: off the target for so long it has failed


def servo_for(
    pulses: ExactPulseController, own: Any, delay: float | None
) -> tuple[Float[np.ndarray, " s"], bool]:
    """Return the state of a servo for what pulses know, and whether the samples are short enough.

    ``own`` are the fields of their first state.
    """
    T, limit = pulses.sampling_time, pulses.effort_limit
    m, coulomb, _ = law_of(own, 0)
    friction = min(coulomb, _STRONGEST * limit)
    controller = ProfileController(
        sampling_time=T,
        target=pulses.target,
        tolerance=pulses.tolerance,
        mass=m,
        friction=CoulombViscousFriction.symmetric(coulomb_friction=friction, viscous_friction=0.0),
        effort_limit=limit,
        delay=delay or 0.0,
        position_noise=_SURELY * pulses.position_noise,
    )
    state = controller.init()
    s = servo.fields(state)
    s.holds = 1  # what swings would pull the axis out of the dead band again
    noise = (s.K_p + 2.0 * s.K_d / (2.0 * s.filter_time + T)) * pulses.position_noise
    short = 0.5 * friction * T * T <= _SHORT * m * pulses.tolerance
    return state, bool(short and noise <= _NOISE * limit)


@compiled()
def can_serve(p: Any) -> bool:
    """Return whether the axis can be left to the servo."""
    return p.fast == 1 and p.failed == 0


@compiled()
def start_serving(p: Any, own: Any, target: float, x: float, v: float) -> None:
    """Begin with the servo at a position and a velocity, with the friction known so far."""
    s = p.servo
    s.target, s.mass = target, math.exp(own.values[0])
    for side in range(2):
        _, s.coulomb[side], s.viscous[side] = law_of(own, side)
    servo.begin(s, x, v)
    p.moving, p.served, p.leavings = SERVO, 0, 0


@compiled()
def serve(p: Any, x: float) -> float:
    """Return the effort of the servo until the next sample; it ends with `moving` 0."""
    s = p.servo
    u = servo.go_on(s, x, math.nan)
    p.served = 0 if servo.rests_at_target(s) else p.served + 1
    if p.served > _LONGEST * p.shortest and p.served * p.period > _LEAST_TIME:
        p.moving, p.failed = 0, 1
        return 0.0
    return u
