"""Content of exported C code: one made in Python with a velocity sensor, one of an estimate."""

from stickslip.control import ExactPulseController, RestDetection
from stickslip.estimation import EnergyEstimator
from stickslip.estimation.online.kalman.extended_kalman import ExtendedKalmanFilter
from stickslip.export import ExportParameters
from stickslip.export.c.content import CodeContent, derived_content
from stickslip.export.c.law import CodeLaw
from stickslip.friction import CoulombViscousFriction, StribeckFriction

LAW = StribeckFriction(
    coulomb_friction_positive=100.0,
    coulomb_friction_negative=90.0,
    static_friction_positive=130.0,
    static_friction_negative=95.0,
    viscous_friction_positive=700.0,
    viscous_friction_negative=650.0,
    offset=4.0,
    stribeck_velocity=0.01,
)
MEASURED = CodeContent(
    axis="stage",
    kind="linear",
    law=CodeLaw.of(LAW),
    inertia=150.0,
    dead_band=1e-4,
    controller=ExactPulseController(
        sampling_time=0.01,
        target=0.01,
        tolerance=1e-6,
        effort_limit=300.0,
        mass=150.0,
        friction=CoulombViscousFriction.symmetric(coulomb_friction=80.0, viscous_friction=500.0),
        rest=RestDetection(samples=3, spread=1e-7, speed=0.0),
    ),
    energy=EnergyEstimator(inertia=150.0, offset=True),
    kalman=ExtendedKalmanFilter(
        inertia=150.0,
        offset=True,
        position_noise=1e-6,
        velocity_noise=1e-4,
        rest_speed=0.01,
        rest_force=100.0,
        initial_deviations={
            "coulomb_friction": 100.0, "viscous_friction": 500.0, "offset": 50.0
        },
        memory=64,
    ),
)  # fmt: skip
ROTARY = derived_content(
    "elbow",
    ExportParameters(
        kind="rotary",
        values={
            "inertia": 0.02,
            "coulomb_friction_positive": 0.15,
            "coulomb_friction_negative": 0.11,
            "viscous_friction_positive": 0.02,
            "viscous_friction_negative": 0.03,
        },
    ),
    sampling_time=0.0005,
).content
CONTENTS = {"measured": MEASURED, "rotary": ROTARY}
