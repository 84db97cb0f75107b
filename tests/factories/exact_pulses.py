"""The exact pulse controller, an axis and sensors for it, and its runs on random axes."""

import math
from typing import Any

import numpy as np
from random_axes import ENCODER_STEP, POSITION_NOISE, RandomAxis

from stickslip.control import ExactPulseController, RestDetection
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.simulation import ClosedLoopRun, Sensors, simulate_closed_loop

T = 0.01
IDEAL = RestDetection(samples=1, spread=0.0, speed=0.0)
ENCODER = RestDetection.for_encoder(resolution=ENCODER_STEP, noise=POSITION_NOISE, samples=10)
ENCODER_ONLY = Sensors(position_noise=POSITION_NOISE, encoder_step=ENCODER_STEP, velocity="none")
SAMPLE_NOISE = math.sqrt(POSITION_NOISE**2 + ENCODER_STEP**2 / 12.0)  # [m], with that of rounding


def symmetric(coulomb: float, static: float, viscous: float) -> CoulombViscousFriction:
    """Return friction that is equal in both directions [N, N, N s/m]."""
    return CoulombViscousFriction.symmetric(
        coulomb_friction=coulomb, static_friction=static, viscous_friction=viscous
    )


PLANT = SingleMass(mass=150.0, friction=symmetric(100.0, 130.0, 700.0))
"""The axis of Table 1 of van de Wijdeven (2002), part B."""
GUESS = symmetric(80.0, 80.0, 500.0)
CONTROLLER = ExactPulseController(
    sampling_time=T,
    target=0.01,
    tolerance=1e-6,
    rest=IDEAL,
    effort_limit=300.0,
    mass=150.0,
    friction=GUESS,
)


def controller_for(axis: RandomAxis, **settings: Any) -> ExactPulseController:
    """Return the controller for a random axis, with the first guess of that axis."""
    known = {
        "sampling_time": T,
        "target": axis.start_error,
        "tolerance": 2e-5 - ENCODER_STEP,
        "rest": ENCODER,
        "position_noise": SAMPLE_NOISE,
        "effort_limit": axis.effort_limit,
        "mass": axis.guessed_mass,
        "friction": axis.guessed_friction,
    }
    return ExactPulseController(**known | settings)


def driven(
    axis: RandomAxis,
    controller: ExactPulseController,
    samples: int = 1000,
    sensors: Sensors = ENCODER_ONLY,
) -> ClosedLoopRun[Any]:
    """Run a controller on a random axis, with the noise of its seed."""
    return simulate_closed_loop(
        axis.plant,
        controller,
        sampling_time=controller.sampling_time,
        samples=samples,
        sensors=sensors,
        generator=np.random.default_rng(axis.seed),
    )
