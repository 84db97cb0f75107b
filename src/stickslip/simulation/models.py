"""From a plant and a sampling time to the numbers its compiled kernel works with."""

import math
from functools import lru_cache

import numpy as np
from jaxtyping import Float

from stickslip.friction import CoulombViscousFriction, FrictionLaw
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.records import InputError, positive
from stickslip.simulation.kernels import arm_events as arm
from stickslip.simulation.kernels.single_mass import mass_model
from stickslip.simulation.laws import law_model
from stickslip.simulation.transition import arm_increment

__all__ = ["EVENT_BUDGET", "initial_kernel_state", "kernel_model"]

EVENT_BUDGET = 10_000
"""Events allowed in one sample."""

_LONGEST = 10_000.0
"""Fastest time constants of an arm in a sample: so many Taylor polynomials may have to be taken."""

_SHORT = 0.1
"""Radians a sample up to which increments rounded to doubles are exact enough while slipping."""

_LONGEST_STEP = 1e300
"""Seconds: the first step of integration is tried as long as its sample."""


@lru_cache(maxsize=256)
def kernel_model(
    plant: Plant, sampling_time: float, event_budget: int = EVENT_BUDGET
) -> Float[np.ndarray, " p"]:
    """Return the vector of numbers that the plant's kernel works with, read-only.

    Raises
    ------
    InputError
        If the sampling time is not positive, or of an arm too long for its fastest time constant;
        if the event budget is not at least 1; or if the friction law is not one that can be
        simulated.
    """
    T = positive("sampling time", sampling_time, "s")
    if not event_budget >= 1:
        raise InputError(
            f"event_budget is {event_budget}, it must be at least 1", remedy="leave it at default"
        )
    law = plant.friction
    if not isinstance(law, CoulombViscousFriction):
        model = law_model(plant, T, event_budget)
    elif isinstance(plant, SingleMass):
        model = mass_model(
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
    else:
        model = _arm_model(plant, law, T, event_budget)
    model.flags.writeable = False
    return model


def _arm_model(
    plant: FlexibleArm[FrictionLaw], law: CoulombViscousFriction, T: float, event_budget: int
) -> Float[np.ndarray, " p"]:
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


def initial_kernel_state(
    plant: Plant, initial_state: tuple[float, ...] | None
) -> tuple[float, ...]:
    """Return the kernel's state for a plant's state; at rest at 0 if None.

    Bristles are straight at first.

    Parameters
    ----------
    plant
        Decides the state's length.
    initial_state
        ``(position, velocity)``, of the arm ``(position, velocity, load_position,
        load_velocity)``, in SI units.

    Raises
    ------
    InputError
        If the length is wrong or a value is not finite.
    """
    names = ("position", "velocity", "load_position", "load_velocity")
    names = names[:2] if isinstance(plant, SingleMass) else names
    values = (0.0,) * len(names) if initial_state is None else tuple(map(float, initial_state))
    if len(values) != len(names):
        raise InputError(
            f"the initial state has {len(values)} values, the plant's has {len(names)}",
            remedy=f"give ({', '.join(names)})",
        )
    for name, value in zip(names, values, strict=True):
        if not math.isfinite(value):
            raise InputError(f"initial {name} is {value}", remedy="give a finite value")
    x, v = values[:2]
    mode = float(np.sign(v))
    if not isinstance(plant.friction, CoulombViscousFriction):
        x2, v2 = values[2:] or (0.0, 0.0)
        return x, v, 0.0, v2, x2, _LONGEST_STEP, mode
    if isinstance(plant, SingleMass):
        return x, v, 0.0, 0.0, mode
    x2, v2 = values[2:]
    # x1 - x2 exactly, as a double and what it rounds away
    d = x - x2
    b = d - x
    low = (x - (d - b)) + (-x2 - b)
    return x, v, d, v2, x2, 0.0, 0.0, low, 0.0, 0.0, mode
