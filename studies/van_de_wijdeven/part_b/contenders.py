"""The controllers that are compared on random axes, and the values that each is given."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import sqrt
from types import MappingProxyType

from stickslip.control import (
    ExactPulseController,
    PreciseController,
    PulseAmplitudeWidthController,
    PulseWidthController,
    RestDetection,
)
from studies.van_de_wijdeven.part_b.pid_tuning import FASTEST, LEAST_MARGIN, PIDTuning
from studies.van_de_wijdeven.part_b.random_axes import (
    ENCODER_STEP,
    POSITION_NOISE,
    SAMPLE_NOISE,
    RandomAxis,
)
from studies.van_de_wijdeven.part_b.scoring import ARRIVAL, WATCH, Make
from studies.van_de_wijdeven.part_b.setting import LONGEST_PULSE, SAMPLING_TIME, TOLERANCE

_REST_SAMPLES = 5
_REST = RestDetection.for_encoder(
    resolution=ENCODER_STEP, noise=POSITION_NOISE, samples=_REST_SAMPLES
)
"""An axis that coasts out moves by more than its spread in so many samples, until the last 2."""

_AIM = TOLERANCE - 3.0 * SAMPLE_NOISE / sqrt(_REST_SAMPLES)
"""Tolerance of the measured rest position, by which the true one is within `TOLERANCE` [m]."""


@dataclass(frozen=True, kw_only=True)
class _Adaptive:
    """PWC or PAPWC for any axis, as the source has them: they never give up."""

    method: type[PulseWidthController] | type[PulseAmplitudeWidthController]
    longest_width: float | None = None
    initial_covariance: float | None = None

    def __call__(self, axis: RandomAxis) -> PulseWidthController | PulseAmplitudeWidthController:
        controller = self.method.from_friction(
            mass=axis.guessed_mass,
            coulomb_friction=axis.guessed_friction.coulomb_friction_positive,
            pulse_effort=axis.effort_limit,
            sampling_time=SAMPLING_TIME,
            target=axis.start_error,
            tolerance=_AIM,
            rest=_REST,
        )
        controller = replace(controller, longest_width=self.longest_width, max_idle_pulses=None)
        if self.initial_covariance is None:
            return controller
        return replace(controller, initial_covariance=self.initial_covariance)


def _exact_pulse(axis: RandomAxis) -> ExactPulseController:
    return ExactPulseController(
        sampling_time=SAMPLING_TIME,
        target=axis.start_error,
        tolerance=_AIM,
        rest=_REST,
        effort_limit=axis.effort_limit,
        mass=axis.guessed_mass,
        friction=axis.guessed_friction,
        position_noise=SAMPLE_NOISE,
    )


def _precise_move(axis: RandomAxis) -> PreciseController:
    return PreciseController(pulses=_exact_pulse(axis))


PID_TUNINGS: Mapping[str, PIDTuning] = MappingProxyType(
    {
        "PID": PIDTuning(bandwidth=2.0, phase_margin=30.0, integral_ratio=10.0),
        "PID with dead band": PIDTuning(
            bandwidth=10.0, phase_margin=30.0, integral_ratio=3.0, dead_band=0.9
        ),
        "PID with dither": PIDTuning(
            bandwidth=8.0,
            phase_margin=30.0,
            integral_ratio=3.0,
            dead_band=0.75,
            dither=0.6,
            dither_frequency=50.0,
        ),
        "PID with dither, tuned to the edge": PIDTuning(
            bandwidth=16.0,
            phase_margin=20.0,
            integral_ratio=10.0,
            dead_band=0.75,
            dither=0.6,
            dither_frequency=50.0,
        ),
        "reset PID, Coulomb": PIDTuning(
            bandwidth=10.0, phase_margin=30.0, integral_ratio=3.0, dead_band=0.9, reset="coulomb"
        ),
        "reset PID, Stribeck": PIDTuning(
            bandwidth=8.0, phase_margin=30.0, integral_ratio=3.0, dead_band=0.9, reset="stribeck"
        ),
    }
)
"""The best that `tune` has found for each on 200 axes (studies.documentation.pid_tuning)."""

LONG_WATCH = 1200.0
"""[s]."""

LONG_WATCHED: Mapping[str, Make] = MappingProxyType(
    {f"PID, watched for {LONG_WATCH / 60:g} min": PID_TUNINGS["PID"]}
)
"""Controllers that hunt so slowly that the usual watch does not show it."""

LONG_WATCHED_AXES = 200
"""On no more axes than these."""

HOW_TUNED = (
    f"A run lasts {ARRIVAL + WATCH:g} s; on target is what was within {1e6 * TOLERANCE:g} µm "
    f"during all of the last {WATCH:g} s, by its true position, and hunting what turned round "
    "twice in them, by more than the tolerance each time. Each PID is shaped for the guessed mass "
    "by bandwidth, phase margin and the place of the integral; these, and what else a variant has "
    "(dead band of the integral, amplitude and frequency of the dither), are what kept most of 200 "
    "other axes on target, and of equals what was there soonest, with at most "
    f"{FASTEST:g} Hz and at least {LEAST_MARGIN:g}° of phase margin. Tuned to the edge is without "
    "these limits: on a real axis no margin would be left for delay and for what is not rigid. "
    "The PID without a dead band seldom rests for good where static friction exceeds Coulomb "
    "friction: stuck off its target, its integral winds up until the axis slips again. Tuned so, "
    f"that takes minutes, which is why it is also watched for {LONG_WATCH / 60:g} min, on no more "
    f"than {LONG_WATCHED_AXES} of the axes."
)

SUCCESSOR = "exact pulses"
"""Name of the controller that is to beat the others."""

CONTENDERS: Mapping[str, Make] = MappingProxyType(
    {
        "PWC": _Adaptive(method=PulseWidthController),
        f"PWC, t_p ≤ {LONGEST_PULSE:g} s": _Adaptive(
            method=PulseWidthController, longest_width=LONGEST_PULSE
        ),
        "PAPWC": _Adaptive(method=PulseAmplitudeWidthController),
        f"PAPWC, t_p ≤ {LONGEST_PULSE:g} s": _Adaptive(
            method=PulseAmplitudeWidthController, longest_width=LONGEST_PULSE
        ),
        "PAPWC, P(0) = 1e5 I": _Adaptive(
            method=PulseAmplitudeWidthController, initial_covariance=1e5
        ),
        **PID_TUNINGS,
        SUCCESSOR: _exact_pulse,
        "precise move, then exact pulses": _precise_move,
    }
)
