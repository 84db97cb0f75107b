"""Analytic sensitivities through stick and slip against differences in high precision."""

from dataclasses import replace

import exact_plants
import numpy as np
import pytest
from event_driven import Run
from event_driven import simulate as reference
from hypothesis import given
from hypothesis import strategies as st
from laws import uneven
from mpmath import mp, mpf

from stickslip.plants import FlexibleArm, Plant, SingleMass
from stickslip.simulation import MotionSensitivity, simulate, simulate_sensitivity

DIGITS = 40

STEP = mpf(10) ** -14
"""Central differences err by its square times third derivatives: 1e-28."""

SENSITIVITY_TOLERANCE = 1e-9
"""Of the largest value of a parameter's sensitivity; rounding of the states (1e-14) is divided by
accelerations and spring forces at events, which are some hundredths of the largest."""

SAMPLING_TIME = 0.25  # coarse, so that several events fall into a sample
SAMPLES = 24
STATE = {
    "initial_position": 0,
    "initial_velocity": 1,
    "initial_load_position": 2,
    "initial_load_velocity": 3,
}


def random_case(seed: int, *, arm: bool, sticky: bool) -> tuple[Plant, list[float], list[float]]:
    generator = np.random.default_rng(seed)
    coulomb = generator.uniform(0.15, 0.35, 2)
    static = coulomb * (generator.uniform(1.1, 1.6, 2) if sticky else 1.0)
    law = uneven(
        coulomb=coulomb,
        static=static,
        viscous=(generator.uniform(0.0, 0.4), generator.uniform(0.0, 0.4)),
        offset=generator.uniform(-0.1, 0.1),
    )
    levels = generator.uniform(0.0, 1.0, SAMPLES // 3) * (-1.0) ** np.arange(SAMPLES // 3)
    effort = np.repeat(levels, 3).tolist()
    state = generator.uniform(-0.5, 0.5, 4 if arm else 2).tolist()
    masses = generator.uniform(0.5, 1.5, 3)
    if not arm:
        return SingleMass(mass=masses[0], friction=law), effort, state
    plant = FlexibleArm(mass_1=masses[0], mass_2=masses[1], stiffness=4 * masses[2], friction=law)
    return plant, effort, state


def reference_plant(plant: Plant, name: str, shift: mpf) -> exact_plants.Plant:
    def value(of: str) -> mpf:
        holder = plant if hasattr(plant, of) else plant.friction
        return mpf(getattr(holder, of)) + (shift if of == name else 0)

    def sides(of: str) -> tuple[mpf, mpf]:
        return value(f"{of}_positive"), value(f"{of}_negative")

    friction = exact_plants.Friction(
        coulomb=sides("coulomb_friction"),
        static=sides("static_friction"),
        viscous=sides("viscous_friction"),
        offset=value("offset"),
    )
    if isinstance(plant, SingleMass):
        return exact_plants.SingleMass(mass=value("mass"), friction=friction)
    return exact_plants.FlexibleArm(
        mass_1=value("mass_1"),
        mass_2=value("mass_2"),
        stiffness=value("stiffness"),
        friction=friction,
    )


def reference_run(
    plant: Plant, effort: list[float], state: list[float], name: str, shift: mpf
) -> Run:
    with mp.workdps(DIGITS):
        start = [mpf(value) for value in state]
        if name in STATE:
            start[STATE[name]] += shift
        return reference(
            reference_plant(plant, name, shift), effort, SAMPLING_TIME, start, digits=DIGITS
        )


def columns_of(found: MotionSensitivity) -> np.ndarray:
    columns = [found.position, found.velocity]
    if found.load_position is not None and found.load_velocity is not None:
        columns += [found.load_position, found.load_velocity]
    return np.stack(columns, axis=1)


def check_against_reference(
    plant: Plant, effort: list[float], state: list[float], names: tuple[str, ...]
) -> MotionSensitivity:
    found = simulate_sensitivity(
        plant, effort, sampling_time=SAMPLING_TIME, initial_state=tuple(state)
    )
    columns = columns_of(found)
    for name in names:
        ahead, back = (reference_run(plant, effort, state, name, s * STEP) for s in (1, -1))
        assert ahead.count("touch") == back.count("touch") == 0
        with mp.workdps(DIGITS):
            expected = np.array(
                [
                    [float((a - b) / (2 * STEP)) for a, b in zip(one, other, strict=True)]
                    for one, other in zip(ahead.states, back.states, strict=True)
                ]
            )
        size = max(float(np.max(np.abs(expected))), 1e-3)
        error = float(np.max(np.abs(columns[:, :, found.names.index(name)] - expected)))
        assert error < SENSITIVITY_TOLERANCE * size, name
    return found


@pytest.mark.parametrize("sticky", [False, True])
@pytest.mark.parametrize("seed", range(3))
def test_a_single_mass_against_differences_in_high_precision(seed: int, sticky: bool) -> None:
    plant, effort, state = random_case(seed, arm=False, sticky=sticky)
    names = ("mass", "viscous_friction_positive", "viscous_friction_negative", "offset", *STATE)
    # With fs = fc a Coulomb friction above its static friction would be no plant
    coulomb = ("coulomb_friction_positive", "coulomb_friction_negative") if sticky else ()
    found = check_against_reference(plant, effort, state, (*names[:6], *coulomb))
    assert found.motion.event_count >= 3


@pytest.mark.slow
@pytest.mark.parametrize("seed", [11, 19])
def test_a_sticky_arm_against_differences_in_high_precision(seed: int) -> None:
    plant, effort, state = random_case(seed, arm=True, sticky=True)
    names = simulate_sensitivity(plant, effort, sampling_time=SAMPLING_TIME).names
    found = check_against_reference(plant, effort, state, names)
    within = found.motion.event_time % SAMPLING_TIME > 0
    modes = found.motion.event_mode
    assert np.count_nonzero(within[1:] & (modes[:-1] == 0) & (modes[1:] != 0)) >= 2


def test_an_arm_without_extra_static_friction_against_differences_in_high_precision() -> None:
    plant, effort, state = random_case(9, arm=True, sticky=False)
    names = ("mass_1", "stiffness", "viscous_friction_positive", "offset", "initial_velocity")
    check_against_reference(plant, effort, state, names)


@given(seed=st.integers(0, 10_000), arm=st.booleans())
def test_sensitivities_predict_a_small_change_of_everything(seed: int, arm: bool) -> None:
    """A step of all parameters at once in floating point: the rest is of second order."""
    plant, effort, state = random_case(seed, arm=arm, sticky=True)
    generator = np.random.default_rng(seed + 1)
    found = simulate_sensitivity(
        plant, effort, sampling_time=SAMPLING_TIME, initial_state=tuple(state)
    )
    step = generator.normal(size=len(found.names))
    step /= np.linalg.norm(step)
    values = dict(zip(found.names, step.tolist(), strict=True))

    def moved(h: float) -> np.ndarray:
        law = replace(
            plant.friction,
            **{
                name: getattr(plant.friction, name) + h * values[name]
                for name in plant.friction.__dataclass_fields__
            },
        )
        own = [name for name in values if name in plant.__dataclass_fields__]
        changed = replace(
            plant, friction=law, **{name: getattr(plant, name) + h * values[name] for name in own}
        )
        start = tuple(state[i] + h * values[name] for name, i in list(STATE.items())[: len(state)])
        motion = simulate(changed, effort, sampling_time=SAMPLING_TIME, initial_state=start)
        rows = [motion.position, motion.velocity]
        if arm:
            rows += [motion.load_position, motion.load_velocity]
        return np.stack(rows, axis=1)

    predicted = columns_of(found) @ step
    errors = []
    for h in (1e-6, 1e-7):
        difference = (moved(h) - moved(-h)) / (2 * h)
        errors.append(float(np.max(np.abs(difference - predicted))))
    # Near a graze the second derivative is large or the motion jumps: then only the finer step,
    # or none, matters; the cases against high precision do not graze.
    size = float(np.max(np.abs(predicted)))
    tame = size < 30 and not found.motion.any_grazing
    assert not tame or min(errors) < 1e-3 * max(size, 1.0)


def test_a_mass_that_rests_does_not_depend_on_its_friction() -> None:
    plant, _, _ = random_case(0, arm=False, sticky=True)
    found = simulate_sensitivity(plant, [0.0] * 5, sampling_time=0.1, initial_state=(1.0, 0.0))
    initial = found.names.index("initial_position")
    np.testing.assert_array_equal(found.position[:, initial], 1.0)
    np.testing.assert_array_equal(np.delete(found.position, initial, axis=1), 0.0)
    np.testing.assert_array_equal(found.velocity[1:], 0.0)


def test_static_friction_of_a_single_mass_leaves_the_motion_between_its_jumps() -> None:
    plant, effort, state = random_case(1, arm=False, sticky=True)
    found = simulate_sensitivity(
        plant, effort, sampling_time=SAMPLING_TIME, initial_state=tuple(state)
    )
    static = [name.startswith("static") for name in found.names]
    np.testing.assert_array_equal(found.position[:, static], 0.0)
