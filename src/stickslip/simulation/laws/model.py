"""From a plant whose friction law is not affine to the numbers that its kernel works with."""

import math

import numpy as np
from jaxtyping import Float

from stickslip.friction import (
    DahlFriction,
    ElastoPlasticFriction,
    LuGreFriction,
    StribeckFriction,
)
from stickslip.plants import Plant, SingleMass
from stickslip.records import InputError
from stickslip.simulation.laws import rates as at

__all__ = ["has_bristles", "law_model"]

_BRISTLES = (DahlFriction, LuGreFriction, ElastoPlasticFriction)


def has_bristles(plant: Plant) -> bool:
    """Return whether a plant's friction law has bristles."""
    return isinstance(plant.friction, _BRISTLES)


def law_model(plant: Plant, sampling_time: float, event_budget: int) -> Float[np.ndarray, " p"]:
    """Return the vector of numbers that the kernel works with.

    Parameters
    ----------
    plant
        With a friction law that is not affine.
    sampling_time
        [s].
    event_budget
        Steps and events allowed in one sample.

    Raises
    ------
    InputError
        If the friction law is none that can be simulated.
    """
    law = plant.friction
    bristles = isinstance(law, _BRISTLES)
    if not bristles and not isinstance(law, StribeckFriction):
        raise InputError(
            f"the friction law {type(law).__name__} cannot be simulated",
            remedy="use one of those in stickslip.friction",
        )
    sliding = law.sliding if bristles else law
    model = np.zeros(at.MODEL_SIZE)
    model[at.TIME], model[at.BUDGET] = sampling_time, event_budget
    if isinstance(plant, SingleMass):
        model[at.M1], model[at.M2] = plant.mass, 1.0
    else:
        model[at.M1], model[at.M2], model[at.KS] = plant.mass_1, plant.mass_2, plant.stiffness
    model[at.FC_N] = sliding.coulomb_friction_negative
    model[at.FC_P] = sliding.coulomb_friction_positive
    model[at.FS_N] = sliding.static_friction_negative
    model[at.FS_P] = sliding.static_friction_positive
    model[at.C_N] = sliding.viscous_friction_negative
    model[at.C_P] = sliding.viscous_friction_positive
    model[at.OFFSET] = law.offset
    model[at.STRIBECK], model[at.DELTA] = 1.0, 2.0
    model[at.EXPONENT], model[at.ELASTIC] = 1.0, -1.0
    strongest = max(sliding.breakaway())
    feature = math.inf
    if isinstance(sliding, StribeckFriction):
        model[at.STRIBECK], model[at.DELTA] = sliding.stribeck_velocity, sliding.effect.exponent
        feature = sliding.stribeck_velocity
    if bristles:
        model[at.SIGMA_0] = law.bristle_stiffness
        bend = strongest / law.bristle_stiffness
        model[at.TYPICAL_Z], model[at.FEATURE_Z] = bend, 0.5 * bend
        # Bristles swing with this speed when the mass lets go of its breakaway force
        feature = min(feature, strongest / math.sqrt(law.bristle_stiffness * model[at.M1]))
        if isinstance(law, DahlFriction):
            model[at.EXPONENT] = law.exponent
        else:
            model[at.SIGMA_1] = law.bristle_damping
        if isinstance(law, ElastoPlasticFriction):
            model[at.ELASTIC] = law.elastic_deflection
            weakest = min(sliding.coulomb_friction_negative, sliding.coulomb_friction_positive)
            narrow = weakest / law.bristle_stiffness - law.elastic_deflection
            model[at.FEATURE_Z] = 0.5 * narrow
    model[at.FEATURE_V] = feature
    # Errors are small against that, or what a sample of the breakaway force would give it
    typical = min(feature, strongest * sampling_time / model[at.M1])
    model[at.TYPICAL_V] = max(typical, 1e-300)
    return model
