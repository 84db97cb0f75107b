"""The compiled kernels that propagate a plant: one table for steps, runs, loops and batches."""

import math
from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.errors import check_class
from stickslip.friction.registry import LAWS
from stickslip.numerics.named_fields import places
from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.plants.registry import PLANTS
from stickslip.records import InputError, positive, whole
from stickslip.simulation.kernels.arm import ARM_MODEL, arm_fields, arm_run, arm_step
from stickslip.simulation.kernels.arm_batch import arm_batch
from stickslip.simulation.kernels.double_double import arm_increment
from stickslip.simulation.kernels.law import law_batch, law_mass_step, law_run, law_step
from stickslip.simulation.kernels.law_step import LAW_MODEL, law_fields
from stickslip.simulation.kernels.single_mass import (
    MASS_MODEL,
    fill_increments,
    mass_batch,
    mass_fields,
    mass_run,
    mass_step,
)

EVENT_BUDGET = 10_000  # events allowed in one sample
_LONGEST = 10_000.0  # samples over the fastest time constant of an arm: Taylor polynomials in each
_SHORT = 0.1  # radians a sample up to which increments rounded to doubles do while slipping
_LONGEST_STEP = 1e300  # [s]: the first step of integration is tried as long as its sample

Vector = NDArray[np.float64]
State = tuple[float, ...]


class PlantKernels(NamedTuple):
    """The kernels of one kind of plant. Shared arguments: the model and a state of the plant."""

    step: Any  #: ``(model, state, effort) -> (state, output)`` over one sample.
    loop_step: Any  #: The same with the output of an arm; NaN for the load of a rigid axis.
    run: Callable[..., tuple[int, int]]
    """``(model, state, effort, out, grazing, event_time, event_mode) -> (count, failed)``.

    Propagate a trajectory. ``effort`` has shape (n,); ``out`` is written: rows of the outputs and,
    the last, the deflection of bristles, shape (3 or 5, n + 1); ``grazing``, shape (n,), zero on
    entry, marks samples with an event too close to call; events are written as far as there is
    room. ``count`` is their number, ``failed`` the sample in which the event budget was exceeded or
    -1.
    """
    batch: Any
    """``(models, states, efforts, every, out, first, last) -> (trajectory, sample)``.

    Propagate the trajectories ``first`` to ``last`` (exclusive). ``models`` has shape (1 or batch,
    p), ``efforts`` (1 or batch, n); ``states``, shape (batch, k), are replaced by the last ones;
    outputs are stored after ``every`` so many samples (0: none) in ``out``, shape (batch, n //
    every, 2 or 4). Returns where the event budget was exceeded, or (-1, -1).
    """
    model: Callable[[Any, float, int], Vector]
    """``(plant, sampling_time, event_budget) -> model``."""
    initial: Callable[[State], State]  #: ``values -> state`` from the plant's state.


@compiled()
def _mass_loop_step(
    model: Vector, state: State, effort: float
) -> tuple[State, tuple[float, float, float, float]]:
    """`mass_step` with the output of an arm, of which the second half does not exist."""
    state, output = mass_step(model, state, effort)
    return state, (output[0], output[1], np.nan, np.nan)


def _mass_model(plant: SingleMass, T: float, _event_budget: int) -> Vector:
    """Return the model of a single mass with affine friction."""
    law = plant.friction
    model = np.zeros(places(MASS_MODEL))
    m = mass_fields(model)
    m.sampling_time, m.mass, m.offset = T, plant.mass, law.offset
    for name in ("coulomb", "static", "viscous"):
        m[name] = [getattr(law, f"{name}_friction_{side}") for side in ("negative", "positive")]
    fill_increments(model)
    return model


def _fill_friction(m: Any, law: Any) -> None:
    """Fill in the parameters of both directions."""
    for side in ("negative", "positive"):
        for short, name in (("fc", "coulomb"), ("fs", "static"), ("c", "viscous")):
            m[f"{short}_{side[0]}"] = getattr(law, f"{name}_friction_{side}")
    m.offset = law.offset


def _arm_model(plant: FlexibleArm, T: float, event_budget: int) -> Vector:
    """Return the model of a flexible arm with affine friction."""
    law = plant.friction
    m1, m2, ks = plant.mass_1, plant.mass_2, plant.stiffness
    viscous = (law.viscous_friction_negative, 0.0, law.viscous_friction_positive)
    c = max(viscous)
    norm = math.sqrt(ks / m1 + ks / m2) + c / m1
    if not norm * T <= _LONGEST:
        raise InputError(
            "arm_too_stiff",
            sampling_time=T,
            ratio=norm * T,
            time_constant=1.0 / norm,
            limit=_LONGEST,
        )
    model = np.zeros(places(ARM_MODEL))
    m = arm_fields(model)
    for mode in (-1, 0, 1):
        constants = (m1, m2, ks, viscous[mode + 1])
        high, low = arm_increment(constants, T, slipping=mode != 0)
        m.high[mode + 1], m.low[mode + 1] = high.ravel(), low.ravel()
    root_m1, root_m2, root_ks = math.sqrt(m1), math.sqrt(m2), math.sqrt(ks)
    omega = math.sqrt(ks / m2)
    # |v1| <= R/sqrt(m1), |v2| <= R/sqrt(m2), ks |d| <= sqrt(ks) R bound
    # v1'' = (-c v1' - ks (v1 - v2))/m1 with v1' = (F - c v1 - ks d)/m1
    bend = (c / m1) * (c / root_m1 + root_ks) / m1 + ks / m1 * (1.0 / root_m1 + 1.0 / root_m2)
    m.sampling_time = T
    m.m1, m.m2, m.ks = m1, m2, ks
    _fill_friction(m, law)
    m.omega, m.norm = omega, norm
    m.growth = T / root_m1
    m.bound_r = bend * T * T / 8
    m.bound_u = c / m1 / m1 * T * T / 8
    m.sag = root_ks * (omega * T) ** 2 / 8
    m.fc_max = max(m.fc_n, m.fc_p)
    # What the low parts add in n samples is n eps/2 of norm T: nothing where samples are short
    m.fine = norm * T > _SHORT
    m.budget = event_budget
    m.root_m1, m.root_ks = root_m1, root_ks
    return model


def _law_model(plant: Plant, T: float, event_budget: int) -> Vector:
    """Return the model of a plant whose friction law is not affine.

    Static friction may exceed Coulomb friction only with a Stribeck effect between them.
    """
    law: Any = plant.friction
    sliding, bristles = law.sliding, law.bristles
    model = np.zeros(places(LAW_MODEL))
    m = law_fields(model)
    m.sampling_time, m.budget = T, event_budget
    m.m2 = 1.0  # of a rigid axis, on a spring without stiffness
    for short, name in zip(("m1", "m2", "ks"), plant.parameter_names, strict=False):
        m[short] = getattr(plant, name)
    _fill_friction(m, sliding)
    m.stribeck_velocity, m.delta = 1.0, 2.0
    m.exponent, m.elastic_deflection = 1.0, -1.0
    strongest = max(sliding.breakaway())
    feature = math.inf
    effect = sliding.effect
    if effect is not None:
        m.stribeck_velocity, m.delta = effect.velocity, effect.exponent
        feature = effect.velocity
    elif m.fs_n != m.fc_n or m.fs_p != m.fc_p:
        raise InputError("static_friction_without_stribeck", law=type(law).__name__)
    if bristles is not None:
        m.sigma_0, m.sigma_1 = bristles.stiffness, bristles.damping
        m.exponent = bristles.exponent
        bend = strongest / bristles.stiffness
        m.typical_z, m.feature_z = bend, 0.5 * bend
        # Bristles swing with this speed when the mass lets go of its breakaway force
        feature = min(feature, strongest / math.sqrt(bristles.stiffness * m.m1))
        if bristles.elastic_deflection is not None:
            m.elastic_deflection = bristles.elastic_deflection
            weakest = min(sliding.coulomb_friction_negative, sliding.coulomb_friction_positive)
            narrow = weakest / bristles.stiffness - bristles.elastic_deflection
            m.feature_z = 0.5 * narrow
    m.feature_v = feature
    # Errors are small against that, or what a sample of the breakaway force would give it
    m.typical_v = max(min(feature, strongest * T / m.m1), 1e-300)
    return model


def _mass_state(values: State) -> State:
    """Return the state (x, v, their low parts, mode) of a single mass with affine friction."""
    x, v = values
    return x, v, 0.0, 0.0, float(np.sign(v))


def _arm_state(values: State) -> State:
    """Return the state (x1, v1, d, v2, x2, low parts, mode) of an arm with affine friction."""
    x, v, x2, v2 = values
    # x1 - x2 exactly, as a double and what it rounds away
    d = x - x2
    b = d - x
    low = (x - (d - b)) + (-x2 - b)
    return x, v, d, v2, x2, 0.0, 0.0, low, 0.0, 0.0, float(np.sign(v))


def _law_state(values: State) -> State:
    """Return the state of a plant whose friction is integrated; bristles are straight."""
    x, v, x2, v2 = (*values, 0.0, 0.0)[:4]
    return x, v, 0.0, v2, x2, _LONGEST_STEP, float(np.sign(v))


_LAW_ON_ARM = PlantKernels(law_step, law_step, law_run, law_batch, _law_model, _law_state)
_KERNELS: Mapping[tuple[type, bool], PlantKernels] = {
    (SingleMass, True): PlantKernels(
        mass_step, _mass_loop_step, mass_run, mass_batch, _mass_model, _mass_state
    ),
    (FlexibleArm, True): PlantKernels(
        arm_step, arm_step, arm_run, arm_batch, _arm_model, _arm_state
    ),
    (SingleMass, False): _LAW_ON_ARM._replace(step=law_mass_step),
    (FlexibleArm, False): _LAW_ON_ARM,
}
"""By the class of the plant, and whether its friction is affine."""


def kernels_of(plant: Plant) -> PlantKernels:
    """Return the kernels that propagate a plant, by its class and its friction law."""
    check_class("plant", plant, *PLANTS.values())
    law = plant.friction
    if not isinstance(law, tuple(LAWS.values())):
        raise InputError("law_not_simulated", law=type(law).__name__)
    kernels = _KERNELS.get((type(plant), law.affine))
    if kernels is None:
        raise InputError("plant_not_simulated", plant=type(plant).__name__)
    return kernels


@lru_cache(maxsize=256)
def kernel_model(plant: Plant, sampling_time: float, event_budget: int = EVENT_BUDGET) -> Vector:
    """Return the vector of numbers that the plant's kernel works with, read-only.

    Refused are a sampling time too long for the fastest time constant of an arm, and a friction law
    that cannot be simulated.
    """
    T = positive("sampling_time", sampling_time, "s")
    whole("event_budget", event_budget, least=1)
    model = kernels_of(plant).model(plant, T, event_budget)
    model.flags.writeable = False
    return model


def initial_kernel_state(plant: Plant, initial_state: State | None) -> State:
    """Return the kernel's state for a plant's state (`Plant.state_names`); at rest at 0 if None.

    Bristles are straight at first. It is an `InputError` if the length is wrong or a value is not
    finite.
    """
    names = plant.state_names
    values = (0.0,) * len(names) if initial_state is None else tuple(map(float, initial_state))
    if len(values) != len(names):
        raise InputError(
            "wrong_length", name="initial_state", length=len(values), parts=len(names), names=names
        )
    for name, value in zip(names, values, strict=True):
        if not math.isfinite(value):
            raise InputError("not_finite", name=f"initial {name}", value=value, unit="")
    return kernels_of(plant).initial(values)
