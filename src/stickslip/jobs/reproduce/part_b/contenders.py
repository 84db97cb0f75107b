"""The controllers that are compared on random axes, and what each is told of them."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from stickslip.control import (
    PulseAmplitudeWidthController,
    PulseWidthController,
    RestDetection,
)
from stickslip.jobs.reproduce.part_b.pid_tuning import PIDTuning
from stickslip.jobs.reproduce.part_b.random_axes import (
    ENCODER_STEP,
    POSITION_NOISE,
    RandomAxis,
)
from stickslip.jobs.reproduce.part_b.scoring import Make
from stickslip.jobs.reproduce.part_b.setting import SAMPLING_TIME, TOLERANCE

__all__ = ["CONTENDERS", "PID_TUNINGS"]

_REST = RestDetection.for_encoder(resolution=ENCODER_STEP, noise=POSITION_NOISE, samples=10)
"""While it coasts out an axis moves by more than its spread within a few samples."""


def _as_printed(axis: RandomAxis) -> dict[str, Any]:
    """Return what the two controllers of the report are told of an axis."""
    return {
        "mass": axis.believed_mass,
        "coulomb_friction": axis.believed_friction.coulomb_friction_positive,
        "pulse_effort": axis.effort_limit,
        "sampling_time": SAMPLING_TIME,
        "target": axis.start_error,
        "tolerance": TOLERANCE,
        "rest": _REST,
        "patience": None,
    }


def _pulse_width(axis: RandomAxis) -> PulseWidthController:
    return PulseWidthController.from_friction(**_as_printed(axis))


def _pulse_amplitude_width(axis: RandomAxis) -> PulseAmplitudeWidthController:
    return PulseAmplitudeWidthController.from_friction(**_as_printed(axis))


PID_TUNINGS: Mapping[str, PIDTuning] = MappingProxyType(
    {
        "PID": PIDTuning(bandwidth=2.0, phase_margin=30.0, integral_ratio=10.0),
        "PID, integral with dead band": PIDTuning(
            bandwidth=10.0, phase_margin=30.0, integral_ratio=3.0, dead_band=0.9
        ),
        "PID with dither": PIDTuning(
            bandwidth=10.0,
            phase_margin=30.0,
            integral_ratio=5.0,
            dead_band=0.9,
            dither=0.3,
            dither_frequency=50.0,
        ),
        "reset-integrator PID (Coulomb)": PIDTuning(
            bandwidth=10.0, phase_margin=30.0, integral_ratio=3.0, dead_band=0.9, reset="coulomb"
        ),
        "reset-integrator PID (Stribeck)": PIDTuning(
            bandwidth=8.0, phase_margin=30.0, integral_ratio=3.0, dead_band=0.9, reset="stribeck"
        ),
    }
)
"""The best that `tune` has found for each on 200 axes."""

CONTENDERS: Mapping[str, Make] = MappingProxyType(
    {
        "PWC": _pulse_width,
        "PAPWC": _pulse_amplitude_width,
        **PID_TUNINGS,
    }
)
