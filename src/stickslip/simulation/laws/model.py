"""From a plant whose friction law is not affine to the numbers that its kernel works with."""

import math

import numpy as np
from jaxtyping import Float

from stickslip.plants import Plant
from stickslip.records import InputError
from stickslip.simulation.laws import rates as at

__all__ = ["law_model"]


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
        If static friction exceeds Coulomb friction without a Stribeck effect between them.
    """
    law = plant.friction
    sliding, bristles = law.sliding, law.bristles
    model = np.zeros(at.MODEL_SIZE)
    model[at.TIME], model[at.BUDGET] = sampling_time, event_budget
    model[at.M2] = 1.0
    parameters = [getattr(plant, name) for name in plant.parameter_names]
    for place, value in zip((at.M1, at.M2, at.KS), parameters, strict=False):
        model[place] = value
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
    effect = sliding.effect
    if effect is not None:
        model[at.STRIBECK], model[at.DELTA] = effect.velocity, effect.exponent
        feature = effect.velocity
    elif model[at.FS_N] != model[at.FC_N] or model[at.FS_P] != model[at.FC_P]:
        raise InputError(
            f"a {type(law).__name__} whose static friction exceeds its Coulomb friction needs a "
            "Stribeck velocity to be simulated",
            remedy="give a StribeckFriction as its friction of steady motion, or leave the static "
            "friction out",
        )
    if bristles is not None:
        model[at.SIGMA_0], model[at.SIGMA_1] = bristles.stiffness, bristles.damping
        model[at.EXPONENT] = bristles.exponent
        bend = strongest / bristles.stiffness
        model[at.TYPICAL_Z], model[at.FEATURE_Z] = bend, 0.5 * bend
        # Bristles swing with this speed when the mass lets go of its breakaway force
        feature = min(feature, strongest / math.sqrt(bristles.stiffness * model[at.M1]))
        if bristles.elastic_deflection is not None:
            model[at.ELASTIC] = bristles.elastic_deflection
            weakest = min(sliding.coulomb_friction_negative, sliding.coulomb_friction_positive)
            narrow = weakest / bristles.stiffness - bristles.elastic_deflection
            model[at.FEATURE_Z] = 0.5 * narrow
    model[at.FEATURE_V] = feature
    # Errors are small against that, or what a sample of the breakaway force would give it
    typical = min(feature, strongest * sampling_time / model[at.M1])
    model[at.TYPICAL_V] = max(typical, 1e-300)
    return model
