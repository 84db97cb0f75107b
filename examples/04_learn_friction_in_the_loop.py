"""A flexible arm follows its reference while a controller learns the friction and compensates it.

Run it: python examples/04_learn_friction_in_the_loop.py
"""

import numpy as np

from stickslip import (
    PD,
    CoulombViscousFriction,
    EnergyEstimator,
    FeedbackController,
    FlexibleArm,
    FrictionCompensation,
    Move,
    Notch,
    OnlineFriction,
    PointToPoint,
    Sensors,
    simulate_closed_loop,
)

T = 0.01  # s
law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
sensors = Sensors(position_noise=0.005, velocity_noise=0.05)

# Masses and spring are known, noise is not, and friction only by its size: some tenths of N and of
# N s/m. Without that the first samples may ask for anything, and the controller would do it.
estimator = EnergyEstimator(
    inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False, initial_variance=0.3**2
)
learning = OnlineFriction.of(estimator, sampling_time=T, needs_load=True)
to_and_fro = (Move(target=1.0, duration=4.0), Move(target=0.0, duration=4.0)) * 2
controllers = {
    name: FeedbackController(
        sampling_time=T,
        pd=PD(position_gain=1.5, velocity_gain=2.5),
        notch=Notch.at_resonance(mass_1=1.0, mass_2=1.0, stiffness=1.0, depth=0.5, damping=0.4),
        compensation=compensation,
        inertia=2.0,
        effort_limit=2.0,
        reference=PointToPoint(moves=to_and_fro),
    )
    for name, compensation in (
        ("not compensated", None),
        ("learned on the way", FrictionCompensation(friction=learning)),
        ("known beforehand", FrictionCompensation(friction=law)),
    )
}
for name, controller in controllers.items():
    run = simulate_closed_loop(
        arm,
        controller,
        sampling_time=T,
        samples=1600,
        sensors=sensors,
        generator=np.random.default_rng(1),
    )
    wanted = controller.reference.at(run.motion.time).position
    error = (run.motion.position - wanted)[800:]  # of the second move to and fro
    print(f"{name}: rms error {1000 * np.sqrt(np.mean(error**2)):.0f} mm")
    if controller.online is not None:
        state = controller.estimator_state(run.controller_state)
        names = estimator.parameter_names("linear")
        std = dict(zip(names, np.sqrt(np.diag(estimator.covariance(state))), strict=True))
        coulomb, viscous = state[estimator.values_at]
        print(f"  Coulomb friction {coulomb:.4f} ± {std['coulomb_friction']:.1g} N")
        print(f"  viscous friction {viscous:.4f} ± {std['viscous_friction']:.1g} N s/m")
