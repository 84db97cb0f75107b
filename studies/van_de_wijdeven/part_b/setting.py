"""Table 1 of the source's part B, and what else its simulations are run with."""

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from stickslip.planning import PulseLaw
    from stickslip.plants import SingleMass

# Table 1 [kg, N, N s/m, N, N, s].
MASS = 150.0
COULOMB_FRICTION = 100.0
VISCOUS_FRICTION = 700.0
STATIC_FRICTION = 130.0
PULSE_EFFORT = 300.0
SAMPLING_TIME = 0.01

TOLERANCE = 2e-5
"""Inside it the input is zero [m]."""
LONGEST_PULSE = 0.03
"""The bound t_p,max, where there is one [s]."""
GUESS = 0.8
"""First guess of the Coulomb friction over the true one [-]."""
RUNS_IN_A_ROW = 10

# What the source does not print: the start, which only Figure 1 suggests [m], and how long a run
# is [s].
START_ERROR = 0.01
DURATION = 2.0

SETTING = (
    "Simulated with the values of the source's Table 1, exactly (event by event), with ideal "
    f"sensors. The start is {1e3 * START_ERROR:g} mm off the target and a run lasts {DURATION:g} "
    "s, which the source does not print. The first guess of the mass is right, that of the Coulomb "
    f"friction is {GUESS:g} f_c; K_c = 1, nothing is forgotten, and inside ±{1e6 * TOLERANCE:g} µm "
    "the input is zero. Two passages can be read in two ways, and all is shown in both: "
    "P(0) = 1e-5 I or 1e5 I, as the source prints δ⁻¹ = 1e-5; and whether the u_p = t_p² that "
    "pulse width control learns from is the one calculated or that of the whole samples applied"
)


def source_plant() -> "SingleMass":
    """Return the mass of Table 1 with its friction."""
    from stickslip.friction import CoulombViscousFriction
    from stickslip.plants import SingleMass

    friction = CoulombViscousFriction.symmetric(
        coulomb_friction=COULOMB_FRICTION,
        viscous_friction=VISCOUS_FRICTION,
        static_friction=STATIC_FRICTION,
    )
    return SingleMass(mass=MASS, friction=friction)


def source_law() -> "PulseLaw":
    """Return what a pulse does to it."""
    from stickslip.planning import PulseLaw

    return PulseLaw.of(source_plant())


def setting_values() -> dict[str, dict[str, tuple[float | tuple[float, ...], str]]]:
    """Return what `SETTING` says and Table 1, by group and name, each with its unit."""
    return {
        "table_1": {
            "mass": (MASS, "kg"),
            "coulomb_friction": (COULOMB_FRICTION, "N"),
            "viscous_friction": (VISCOUS_FRICTION, "N s/m"),
            "static_friction": (STATIC_FRICTION, "N"),
            "pulse_effort": (PULSE_EFFORT, "N"),
            "sampling_time": (SAMPLING_TIME, "s"),
        },
        "controllers": {
            "tolerance": (TOLERANCE, "m"),
            "longest_pulse": (LONGEST_PULSE, "s"),
            "first_coulomb_friction": (GUESS * COULOMB_FRICTION, "N"),
            "loop_gain": (1.0, "1"),
            "forgetting_factor": (1.0, "1"),
        },
        "runs": {
            "start_error": (START_ERROR, "m"),
            "duration": (DURATION, "s"),
            "runs_in_a_row": (float(RUNS_IN_A_ROW), "1"),
        },
    }
