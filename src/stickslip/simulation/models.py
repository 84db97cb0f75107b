"""From a plant and a sampling time to the numbers its compiled kernel works with."""

import math

import numpy as np
from jaxtyping import Float

from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import InputError
from stickslip.simulation.kernels import arm_events as arm
from stickslip.simulation.kernels.single_mass import mass_model
from stickslip.simulation.transition import arm_increment

__all__ = [
    "exact_arm_model",
    "exact_arm_state",
    "exact_mass_model",
    "exact_mass_state",
    "law_state",
]

_LONGEST = 10_000.0
"""Fastest time constants of an arm in a sample: so many Taylor polynomials may have to be taken."""

_SHORT = 0.1
"""Radians a sample up to which increments rounded to doubles are exact enough while slipping."""

_LONGEST_STEP = 1e300
"""Seconds: the first step of integration is tried as long as its sample."""


def exact_mass_model(plant: SingleMass, T: float, _event_budget: int) -> Float[np.ndarray, " p"]:
    """Return the numbers that the kernels of a single mass with affine friction work with."""
    law = plant.friction
    return mass_model(
        plant.mass,
        law.coulomb_friction_negative,
        law.coulomb_friction_positive,
        law.static_friction_negative,
        law.static_friction_positive,
        law.viscous_friction_negative,
        law.viscous_friction_positive,
        law.offset,
        T,
    )


def exact_arm_model(plant: FlexibleArm, T: float, event_budget: int) -> Float[np.ndarray, " p"]:
    """Return the numbers that the kernels of a flexible arm with affine friction work with.

    Raises
    ------
    InputError
        If the sampling time is too long for the fastest time constant.
    """
    law = plant.friction
    m1, m2, ks = plant.mass_1, plant.mass_2, plant.stiffness
    cs = (law.viscous_friction_negative, 0.0, law.viscous_friction_positive)
    c = max(cs)
    norm = math.sqrt(ks / m1 + ks / m2) + c / m1
    if not norm * T <= _LONGEST:
        raise InputError(
            f"the sampling time {T:g} s is {norm * T:.3g} times the arm's fastest time constant, "
            f"{1.0 / norm:.3g} s, it must be at most {_LONGEST:g} times that long",
            remedy="shorten the sampling time, or leave out what is so stiff (SingleMass)",
        )
    model = np.zeros(arm.MODEL_SIZE)
    for mode, c in zip((-1, 0, 1), cs, strict=True):
        high, low = arm_increment(m1, m2, ks, c, T, slipping=mode != 0)
        place = arm.BLOCK_SIZE * (mode + 1)
        model[place : place + arm.BLOCK_SIZE] = high.ravel()
        place += arm.LOW_PART
        model[place : place + arm.BLOCK_SIZE] = low.ravel()
    root_m1, root_m2, root_ks = math.sqrt(m1), math.sqrt(m2), math.sqrt(ks)
    omega = math.sqrt(ks / m2)
    # |v1| <= R/sqrt(m1), |v2| <= R/sqrt(m2), ks |d| <= sqrt(ks) R bound
    # v1'' = (-c v1' - ks (v1 - v2))/m1 with v1' = (F - c v1 - ks d)/m1
    bend = (c / m1) * (c / root_m1 + root_ks) / m1 + ks / m1 * (1.0 / root_m1 + 1.0 / root_m2)
    fc_n, fc_p = law.coulomb_friction_negative, law.coulomb_friction_positive
    model[arm.TIME] = T
    model[arm.M1], model[arm.M2], model[arm.KS] = m1, m2, ks
    model[arm.FC_N], model[arm.FC_P] = fc_n, fc_p
    model[arm.FS_N] = law.static_friction_negative
    model[arm.FS_P] = law.static_friction_positive
    model[arm.C_N], model[arm.C_P] = cs[0], cs[2]
    model[arm.OFFSET] = law.offset
    model[arm.OMEGA] = omega
    model[arm.NORM] = norm
    model[arm.GROWTH] = T / root_m1
    model[arm.BOUND_R] = bend * T * T / 8
    model[arm.BOUND_U] = c / m1 / m1 * T * T / 8
    model[arm.SAG] = root_ks * (omega * T) ** 2 / 8
    model[arm.FC_MAX] = max(fc_n, fc_p)
    # What the low parts add in n samples is n eps/2 of NORM T: nothing where samples are short
    model[arm.FINE] = model[arm.NORM] * T > _SHORT
    model[arm.BUDGET] = event_budget
    model[arm.ROOT_M1], model[arm.ROOT_KS] = root_m1, root_ks
    return model


def exact_mass_state(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return the kernel's state of a single mass with affine friction."""
    x, v = values
    return x, v, 0.0, 0.0, float(np.sign(v))


def exact_arm_state(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return the kernel's state of a flexible arm with affine friction."""
    x, v, x2, v2 = values
    # x1 - x2 exactly, as a double and what it rounds away
    d = x - x2
    b = d - x
    low = (x - (d - b)) + (-x2 - b)
    return x, v, d, v2, x2, 0.0, 0.0, low, 0.0, 0.0, float(np.sign(v))


def law_state(values: tuple[float, ...]) -> tuple[float, ...]:
    """Return the kernel's state of a plant whose friction is integrated; bristles are straight."""
    x, v, x2, v2 = (*values, 0.0, 0.0)[:4]
    return x, v, 0.0, v2, x2, _LONGEST_STEP, float(np.sign(v))
