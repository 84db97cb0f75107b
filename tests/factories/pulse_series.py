"""The flexible arm of the pulse series, and the end of a series in the simulator."""

from dataclasses import replace

import numpy as np

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseSeries
from stickslip.plants import FlexibleArm
from stickslip.simulation import SimulatedMotion, simulate

State = tuple[float, float, float, float]

LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=LAW)
REST: State = (0.0, 0.0, 0.0, 0.0)
SETTLING = 10.0  # [s] after the last pulse, in which nothing may move any more


def with_friction(coulomb: float) -> FlexibleArm:
    """Return the arm with another Coulomb friction [N]."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=coulomb, viscous_friction=0.1)
    return replace(ARM, friction=law)


def final_state(motion: SimulatedMotion) -> State:
    """Return where both masses end, and how fast."""
    assert motion.load_position is not None
    assert motion.load_velocity is not None
    signals = (motion.position, motion.velocity, motion.load_position, motion.load_velocity)
    x1, v1, x2, v2 = (float(signal[-1]) for signal in signals)
    return x1, v1, x2, v2


def ends(series: PulseSeries, arm: FlexibleArm, state: State) -> tuple[float, float]:
    """Simulate a series; return how far mass 1 is from the target, and mass 2's swing."""
    after = np.zeros(round(SETTLING / series.sampling_time))
    motion = simulate(
        arm,
        np.concatenate([series.effort, after]),
        sampling_time=series.sampling_time,
        initial_state=state,
    )
    x1, v1, x2, v2 = final_state(motion)
    assert v1 == 0.0
    frequency = np.sqrt(arm.stiffness / arm.mass_2)
    return x1 - series.target, float(np.hypot(x2 - x1, v2 / frequency))
