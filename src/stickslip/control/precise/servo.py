"""The servo of an axis that vibrates, at short sampling times.

A vibration with a period of many samples disturbs the parameters that are learned in a move, and
moves the axis off its target after a stop. The feedback of a servo damps it. At long sampling times
feedback is too slow for that.
"""

import math
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.feedback import profile_kernels as profile
from stickslip.control.feedback.profile import ProfileController
from stickslip.control.precise.learning import SERVO, delay_of, lag_of
from stickslip.control.pulses.exact import ExactPulseController
from stickslip.control.pulses.exact_state import law_of
from stickslip.friction import CoulombViscousFriction

_STRONGEST = 0.9  # of the effort limit: friction
_SURELY = 4.0  # standard deviations of a position: its largest error
_SHORT = 0.2  # of the tolerance: F T^2/(2 m) at most, the displacement by friction in a sample
_NOISE = 0.1  # of the effort limit: the effort by noise at most
# Durations of the first profile, and [s]: a servo that has not settled after both has failed
_LONGEST, _LEAST_TIME = 8.0, 0.3
# Factor of the Coulomb friction that profiles feed forward after one in their direction that ended
# beyond its target: friction estimated too large makes the servo hunt
_TOO_FAR = 0.5
# Of the travel of the move: error to the reference above which a resting axis is blocked
_BLOCKED = 0.1
# Changes of sign of a saturated effort without a rest at the target: a servo with more is unstable
_MOST_SWINGS = 6
_MOST_PROFILES = 20  # after the first: an axis that hunts for so long is under a load


def servo_for(
    pulses: ExactPulseController, own: Any, delay: float | None
) -> tuple[Float[np.ndarray, " s"], bool]:
    """Return the state of a servo for the axis of the pulses, and whether it may be used.

    It may if samples are short, and if noise causes little effort. ``own`` are the fields of the
    first state of the pulses.
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
    s = profile.fields(state)
    s.holds = 1  # a vibration would move the axis out of the dead band again
    noise = (s.K_p + 2.0 * s.K_d / (2.0 * s.filter_time + T)) * pulses.position_noise
    short = 0.5 * friction * T * T <= _SHORT * m * pulses.tolerance
    return state, bool(short and noise <= _NOISE * limit)


@compiled()
def servo_allowed(p: Any) -> bool:
    """Return whether the servo may be used, and has not failed."""
    return p.fast == 1 and p.servo_failed == 0


@compiled()
def _patience(s: Any) -> float:
    """Return the time in which the servo has to bring the axis to the target of its profile [s]."""
    return max(_LONGEST * profile.duration(s), _LEAST_TIME)


@compiled()
def start_servo(p: Any, own: Any, target: float, x: float, v: float) -> None:
    """Start the servo at position x and velocity v, with the parameters learned so far."""
    s = p.servo
    s.target, s.mass = target, math.exp(own.values[0])
    seen = (delay_of(p.best) + lag_of(p.best)) * p.period
    if p.rows > 0 and seen > s.delay:  # the gains of a smaller one were not checked for noise
        profile.set_delay(s, seen)
    for side in range(2):
        _, s.coulomb[side], s.viscous[side] = law_of(own, side)
    profile.begin(s, x, v)
    p.moving, p.unsettled, p.leavings = SERVO, 0, 0
    p.saturated = p.swings = p.profiles = 0
    p.patience = _patience(s)


@compiled()
def retarget_servo(p: Any, target: float) -> None:
    """Let the servo under way go on to another target."""
    s = p.servo
    s.target, s.phase = target, profile.RETARGETED
    p.way = abs(target - s.x)
    p.unsettled = p.swings = p.profiles = 0


@compiled()
def servo_effort(p: Any, x: float) -> float:
    """Return the effort of the servo until the next sample; one that fails ends with `moving` 0."""
    s = p.servo
    if profile.rests_off_target(s):
        if (s.target - x) * (s.target - s.start) < 0.0:
            s.coulomb[s.backward] *= _TOO_FAR
        profile.begin(s, x, 0.0)
        p.profiles += 1
    retargeted = s.phase == profile.RETARGETED
    u = profile.next_effort(s, x, math.nan)
    if retargeted:
        p.patience = _patience(s)
    p.unsettled = 0 if profile.rests_at_target(s) else p.unsettled + 1
    if abs(u) >= s.effort_limit:
        sign = 1 if u > 0.0 else -1
        p.swings += 1 if sign == -p.saturated else 0
        p.saturated = sign
    elif p.unsettled == 0:
        p.swings = 0
    travel = max(p.way, abs(s.target - s.start))  # that of a later profile may be very short
    blocked = s.rested >= s.rest_samples and abs(s.e) > _BLOCKED * travel
    slow = p.unsettled * p.period > p.patience
    many = p.swings > _MOST_SWINGS or p.profiles > _MOST_PROFILES
    if slow or many or (blocked and p.unsettled > 0):
        p.moving, p.servo_failed = 0, 1
        return 0.0
    return u
