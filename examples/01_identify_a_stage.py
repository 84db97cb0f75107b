"""A stage with an encoder, friction that differs between the directions, and what its log tells.

Run it: python examples/01_identify_a_stage.py
"""

import numpy as np

from stickslip import CoulombViscousFriction, Sensors, SingleMass, identify, simulate

law = CoulombViscousFriction(
    coulomb_friction_positive=18.0,
    coulomb_friction_negative=22.0,
    static_friction_positive=25.0,
    static_friction_negative=30.0,
    viscous_friction_positive=160.0,
    viscous_friction_negative=240.0,
    offset=0.0,
)
stage = SingleMass(mass=95.0, friction=law)

# Two sines: several speeds, reversals and accelerations. The effort is held over each millisecond.
time = np.arange(0.0, 20.0, 0.001)
effort = 70.0 * np.sin(2.0 * time) + 60.0 * np.sin(7.0 * time)
motion = simulate(stage, effort, sampling_time=0.001)

# What a user has: positions in whole encoder steps, no velocity. The truth stays in `motion`.
sensors = Sensors(encoder_step=1e-6, position_noise=0.5e-6, velocity="none")
log = sensors.measure(motion, np.random.default_rng(1))

found = identify(log, per_direction=True).estimate
print(f"status: {found.status.value}; {motion.event_count} sticks and slips in the motion")
for name, parameter in found.parameters.items():
    if parameter.ci95 is not None:
        low, high = parameter.ci95
        print(f"{name:28s} {parameter.value:9.4f}  [{low:.4f}, {high:.4f}] {parameter.unit}")
