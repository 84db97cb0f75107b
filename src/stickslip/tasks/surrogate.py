"""The flexible arm of van de Wijdeven (2002), part A: plant, input and sensors.

The source's table of parameters is lost. These surrogate values give the motion that its text
describes; they are called surrogate wherever they are shown.
"""

from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

if TYPE_CHECKING:
    from stickslip.plants import FlexibleArm
    from stickslip.simulation import Sensors

# Masses [kg], stiffness [N/m], friction [N, N s/m], times [s], effort [N], noise [m, m/s].
MASS_1 = 1.0
MASS_2 = 1.0
STIFFNESS = 1.0
COULOMB_FRICTION = 0.15
VISCOUS_FRICTION = 0.1
SAMPLING_TIME = 0.01
DURATION = 60.0
POSITION_NOISE = 0.005
VELOCITY_NOISE = 0.05
TRUTH = MappingProxyType(
    {"coulomb_friction": COULOMB_FRICTION, "viscous_friction": VISCOUS_FRICTION}
)
SETTING = (
    f"masses {MASS_1:g} and {MASS_2:g} kg, spring {STIFFNESS:g} N/m (known to the estimator); "
    f"Coulomb friction {COULOMB_FRICTION:g} N, viscous friction {VISCOUS_FRICTION:g} N s/m (to be "
    f"found); sensor noise {POSITION_NOISE:g} m and {VELOCITY_NOISE:g} m/s"
)

# Of the input, which is positive, then negative for as long
EFFORT = 1.0
SWITCHING_TIME = 5.0


def surrogate_arm() -> "FlexibleArm":
    """Return the arm: two masses and a spring, friction on the first, static equal to Coulomb."""
    # Imported here, as the compiler behind the plants takes a second to load.
    from stickslip.friction import CoulombViscousFriction
    from stickslip.plants import FlexibleArm

    return FlexibleArm(
        mass_1=MASS_1,
        mass_2=MASS_2,
        stiffness=STIFFNESS,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=COULOMB_FRICTION, viscous_friction=VISCOUS_FRICTION
        ),
    )


def bang_bang_effort(sampling_time: float = SAMPLING_TIME) -> Float[np.ndarray, " n"]:
    """Return the effort held over each sample [N]: positive, negative, then none."""
    held = round(SWITCHING_TIME / sampling_time)
    effort = np.zeros(round(DURATION / sampling_time))
    effort[:held] = EFFORT
    effort[held : 2 * held] = -EFFORT
    return effort


def surrogate_sensors(noise: float = 1.0) -> "Sensors":
    """Return the sensors of both masses; ``noise`` scales that of the surrogate values [-]."""
    from stickslip.simulation import Sensors

    return Sensors(position_noise=noise * POSITION_NOISE, velocity_noise=noise * VELOCITY_NOISE)
