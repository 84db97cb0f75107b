"""Estimating friction sample by sample while the axis runs, as a drive would.

Run it: python examples/03_estimate_on_line.py
"""

import numpy as np

from stickslip import CoulombViscousFriction, EnergyEstimator, Sensors, SingleMass, simulate

law = CoulombViscousFriction.symmetric(coulomb_friction=20.0, viscous_friction=200.0)
stage = SingleMass(mass=95.0, friction=law)
time = np.arange(0.0, 10.0, 0.001)
motion = simulate(stage, 70.0 * np.sin(2.0 * time) + 60.0 * np.sin(7.0 * time), sampling_time=0.001)
log = Sensors(position_noise=1e-6, velocity_noise=1e-3).measure(motion, np.random.default_rng(1))
velocity = log.measured_velocity
if velocity is None:
    raise RuntimeError("these sensors measure the velocity")

# The mass is known here; friction starts from zero and settles within the first reversals.
estimator = EnergyEstimator(inertia=95.0, offset=False)
state = estimator.init(sampling_time=log.sampling_time)
names = estimator.parameter_names(log.kind)
for k in range(len(log)):
    # effort, position, velocity, and position and velocity of a load that this axis has not
    sample = (log.effort[k], log.measured_position[k], velocity[k], 0.0, 0.0)
    state, values = estimator.step(state, sample)
    if k % 1000 == 500:
        shown = ", ".join(f"{name} {value:8.3f}" for name, value in zip(names, values, strict=True))
        print(f"{log.time[k]:5.1f} s: {shown}")

# The same in place, as a control loop would, and from an encoder alone: a state made without
# velocities does not read them. One made for them would learn nothing from zeros.
take = estimator.kernel
state = estimator.init(sampling_time=log.sampling_time, velocity_measured=False)
for k in range(len(log)):
    if not take(state, log.effort[k], log.measured_position[k], 0.0, 0.0, 0.0):
        raise RuntimeError(f"sample {k} is not finite")
coulomb, viscous = state[estimator.values_at]
print(f"from positions only: coulomb_friction {coulomb:.3f}, viscous_friction {viscous:.3f}")
