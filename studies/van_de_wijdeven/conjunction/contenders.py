"""The controllers that are compared on random arms, and the values that each is given."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi, sqrt
from types import MappingProxyType
from typing import Any, Literal

from stickslip.control import (
    PD,
    FeedbackController,
    LandingController,
    Move,
    PIDController,
    PointToPoint,
    PulseAmplitudeWidthController,
    RestDetection,
    TrackedLandingController,
    scaled_notch,
    scaled_pd,
)
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from studies.van_de_wijdeven.conjunction.cases import BOUND, Case
from studies.van_de_wijdeven.conjunction.random_arms import SAMPLING_TIME, RandomArm
from studies.van_de_wijdeven.conjunction.scoring import ARRIVAL, WATCH, Leg, Rival
from studies.van_de_wijdeven.conjunction.zero_vibration import ZeroVibrationController

LANDING = "landing"
"""Name of the controller of the conjunction."""

LANDINGS: Mapping[str, type[LandingController]] = MappingProxyType(
    {LANDING: LandingController, "tracked": TrackedLandingController}
)
"""Controllers that land an arm by series of pulses, by name; the second is that of `position`."""

_EFFORT_SHARE = 0.8
"""Of the limit that a reference may take; the rest is for the feedback."""
_FASTER = 1.02
_REST_SAMPLES = 10
_REST_STEP = 1e-9
"""Resolution by which rest is detected without noise [m]."""
_UNKNOWN = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
FASTEST = 2.0 * pi * 0.1 / SAMPLING_TIME
"""Pole of a feedback, at most [rad/s]: a tenth of the sampling rate."""


def landing_controller(arm: RandomArm, case: Case, name: str = LANDING) -> LandingController:
    """Return the controller in `LANDINGS` that lands the arm on one target after the other."""
    guessed, guess = case.guessed(arm), arm.guessed_friction
    first = {} if guess is None else {
        "coulomb_friction": guess.coulomb_friction_positive,
        "viscous_friction": guess.viscous_friction_positive,
    }  # fmt: skip
    return LANDINGS[name](
        sampling_time=SAMPLING_TIME,
        target=arm.targets[0],
        tolerance=0.5 * min(case.bound(way) for way in arm.ways),
        arm=replace(guessed, friction=_UNKNOWN if guess is None else guess),
        arm_uncertainty=case.parameter_error,
        effort_limit=arm.effort_limit,
        estimator=EnergyEstimator(
            force_noise=0.0,
            inertia=guessed.mass_1,
            load_inertia=guessed.mass_2,
            stiffness=guessed.stiffness,
            offset=False,
            initial_values=first,
        ),
        position_noise=case.position_noise,
        velocity_noise=case.velocity_noise,
    )


def _reference(leg: Leg) -> PointToPoint:
    """Return the fastest move of least jerk for which the rest of the effort is kept free.

    The largest acceleration is 10/sqrt(3) d/D^2, the largest velocity 15/8 d/D.
    """
    arm, way, limit = leg.guessed, leg.way, leg.arm.effort_limit
    m, law = arm.mass_1 + arm.mass_2, arm.friction
    duration = sqrt(way * m / limit)
    while (
        10.0 / sqrt(3.0) * m * way / duration**2
        + law.coulomb_friction_positive
        + 1.875 * law.viscous_friction_positive * way / duration
        > _EFFORT_SHARE * limit
    ):
        duration *= _FASTER
    return PointToPoint(start=leg.start, moves=(Move(target=leg.target, duration=duration),))


def _pd_and_notch(leg: Leg) -> FeedbackController:
    """Return the feedback phase of a landing alone, without any knowledge of friction."""
    guessed = leg.guessed
    return FeedbackController(
        sampling_time=SAMPLING_TIME,
        pd=scaled_pd(guessed),
        notch=scaled_notch(guessed),
        inertia=guessed.mass_1 + guessed.mass_2,
        effort_limit=leg.arm.effort_limit,
        reference=_reference(leg),
    )


@dataclass(frozen=True, kw_only=True)
class PIDTuning:
    """PID on the driven mass, its poles placed for a rigid axis of the whole mass."""

    frequency: float  #: Of the double pole, over that of mass 2 on its spring [-].
    integral: float  #: The third pole over the other two [-].

    def __call__(self, leg: Leg) -> PIDController:
        """Return the controller: its characteristic polynomial is (s + w)^2 (s + b w)."""
        guessed = leg.guessed
        m = guessed.mass_1 + guessed.mass_2
        w, b = self.frequency * sqrt(guessed.stiffness / guessed.mass_2), self.integral
        return PIDController(
            sampling_time=SAMPLING_TIME,
            target=leg.target,
            position_gain=m * w**2 * (1.0 + 2.0 * b),
            integral_gain=m * b * w**3,
            velocity_gain=m * w * (2.0 + b),
            effort_limit=leg.arm.effort_limit,
            velocity="measured",
        )


@dataclass(frozen=True, kw_only=True)
class ZeroVibrationTuning:
    """Zero vibration, its feedback a double pole of mass 1 alone."""

    #: ``"known"`` is the truth, ``"guessed"`` the first guess; where there is none, no friction.
    friction: Literal["known", "guessed"]
    frequency: float  #: Of the double pole [rad/s].

    def __call__(self, leg: Leg) -> ZeroVibrationController:
        """Return the controller."""
        guessed = leg.guessed
        reference = _reference(leg)
        if self.friction == "guessed":
            guessed = replace(guessed, friction=leg.arm.guessed_friction or _UNKNOWN)
        w = self.frequency
        return ZeroVibrationController(
            sampling_time=SAMPLING_TIME,
            arm=guessed,
            pd=PD(position_gain=guessed.mass_1 * w**2, velocity_gain=2.0 * guessed.mass_1 * w),
            reference=reference,
            effort_limit=leg.arm.effort_limit,
        )


def _by_noise(without: Rival, noisy: Rival) -> Rival:
    """Return what makes controllers tuned for sensors without noise, or with it."""

    def make(leg: Leg) -> Any:  # a Controller, which cannot be checked at run time
        chosen = noisy if leg.case.position_noise > 0.0 else without
        return chosen(leg)

    return make


def _papwc(leg: Leg) -> PulseAmplitudeWidthController:
    """Return PAPWC of the whole mass; it looks at mass 1 alone, its first guess is the truth."""
    guessed = leg.guessed
    controller = PulseAmplitudeWidthController.from_friction(
        mass=guessed.mass_1 + guessed.mass_2,
        coulomb_friction=guessed.friction.coulomb_friction_positive,
        pulse_effort=leg.arm.effort_limit,
        sampling_time=SAMPLING_TIME,
        target=leg.target,
        tolerance=0.5 * leg.case.bound(leg.way),
        rest=RestDetection.for_encoder(
            resolution=_REST_STEP, noise=leg.case.position_noise, samples=_REST_SAMPLES
        ),
    )
    controller = replace(controller, max_idle_pulses=None)
    return controller if leg.learned is None else controller.resumed(leg.learned)


RIVALS: Mapping[str, Rival] = MappingProxyType(
    {
        "PD and notch": _pd_and_notch,
        "PID": _by_noise(
            PIDTuning(frequency=0.5, integral=0.2), PIDTuning(frequency=0.3, integral=0.8)
        ),
        "PAPWC, as if rigid": _papwc,
        "zero vibration, friction as guessed": _by_noise(
            ZeroVibrationTuning(friction="guessed", frequency=28.0),
            ZeroVibrationTuning(friction="guessed", frequency=28.0),
        ),
        "zero vibration, friction known": _by_noise(
            ZeroVibrationTuning(friction="known", frequency=28.0),
            ZeroVibrationTuning(friction="known", frequency=10.0),
        ),
    }
)
"""By name; the tuned ones are the best that studies.documentation.arm_tuning found on 40 arms."""

HOW_COMPARED = (
    "Every controller brings each arm from rest to its first target and on to the second. A move "
    f"lasts {ARRIVAL + WATCH:g} s; it has landed if both masses were within the bound during all "
    f"of the last {WATCH:g} s, by their true positions (with `landing` and `tracked`, during "
    f"{WATCH:g} s after they have ended). The bound is {BOUND:g} of the move without noise, and "
    "three standard deviations of a measured position with noise. PD and notch are those of the "
    "feedback of `landing`; they and zero vibration follow the fastest reference of least jerk "
    f"that takes {100 * _EFFORT_SHARE:g} % of the effort limit. The PID is placed for a rigid axis "
    "of the whole mass, PAPWC plans for such a one, looks at mass 1 alone and begins with the true "
    "friction. Zero vibration has the spring's force balanced as measured. It comes in two rows: "
    "with the first guess of friction that `landing` and `tracked` have, or no friction where "
    "there is none; and with the true friction, which is better than whatever could be learned. "
    "The poles of PID and zero vibration are what landed most of 40 other arms, without and with "
    f"noise apart, at no more than {FASTEST:.3g} rad/s, a tenth of the sampling rate."
)
