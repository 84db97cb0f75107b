"""The arm that is landed, and the one of the reference points."""

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.conjunction.cases import BOUND, NOISY

TARGETS = (1.0, 0.0)
"""Of the landings, one after the other [m]."""
TIME = 40.0
"""For each of them [s]."""
EFFORT_LIMIT = 2.0
"""Of the landings [N]."""

FRICTION = 0.1
"""Coulomb [N] and viscous friction [N s/m] of the arm of the reference points."""
MOVE = 1.0
"""Its way [m]."""
REFERENCE_LIMIT = 1.0
"""Largest effort on it [N]."""
REFERENCE_TIME = 0.05
"""Its sampling time [s]."""

SETTING = (
    f"The landings: masses {surrogate.MASS_1:g} and {surrogate.MASS_2:g} kg, spring "
    f"{surrogate.STIFFNESS:g} N/m (all known to the controller), Coulomb friction "
    f"{surrogate.COULOMB_FRICTION:g} N and viscous friction {surrogate.VISCOUS_FRICTION:g} N s/m "
    f"(unknown to it: it begins without any), at most {EFFORT_LIMIT:g} N, without sensor noise and "
    f"with {NOISY.position_noise:g} m and {NOISY.velocity_noise:g} m/s. The series of pulses: the "
    f"same masses and spring, both frictions {FRICTION:g}, at most {REFERENCE_LIMIT:g} N, "
    f"{MOVE:g} m. These are surrogate values, as the source has none. One of its remarks is not "
    "judged: that adapting the pulses of a flexible arm as PWC does would be too complex"
)


def setting_values() -> dict[str, dict[str, tuple[float | tuple[float, ...], str]]]:
    """Return what `SETTING` says, by group and name, each with its unit."""
    masses: dict[str, tuple[float | tuple[float, ...], str]] = {
        "mass_1": (surrogate.MASS_1, "kg"),
        "mass_2": (surrogate.MASS_2, "kg"),
        "stiffness": (surrogate.STIFFNESS, "N/m"),
    }
    return {
        "landings": {
            **masses,
            "coulomb_friction": (surrogate.COULOMB_FRICTION, "N"),
            "viscous_friction": (surrogate.VISCOUS_FRICTION, "N s/m"),
            "effort_limit": (EFFORT_LIMIT, "N"),
            "targets": (TARGETS, "m"),
            "time_for_each": (TIME, "s"),
            "bound": (BOUND, "of the move"),
        },
        "noise": {
            "position": (NOISY.position_noise, "m"),
            "velocity": (NOISY.velocity_noise, "m/s"),
        },
        "series": {
            **masses,
            "coulomb_friction": (FRICTION, "N"),
            "viscous_friction": (FRICTION, "N s/m"),
            "effort_limit": (REFERENCE_LIMIT, "N"),
            "move": (MOVE, "m"),
            "sampling_time": (REFERENCE_TIME, "s"),
        },
    }


def reference_arm(coulomb_friction: float = FRICTION) -> FlexibleArm:
    """Return the arm of the reference points, with a Coulomb friction [N]."""
    return FlexibleArm(
        mass_1=surrogate.MASS_1,
        mass_2=surrogate.MASS_2,
        stiffness=surrogate.STIFFNESS,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=coulomb_friction, viscous_friction=FRICTION
        ),
    )


def unknown_friction() -> CoulombViscousFriction:
    """Return the friction of an arm of which none is known."""
    return CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
