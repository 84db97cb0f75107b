"""The simulator against the 30-digit event-driven reference, in every stored case and at random.

The stored cases have plants of round numbers; the random ones have masses over four decades, a
spring over six, viscous friction over thirteen and sampling times with omega T from 0.001 to 6.
Their reference runs anew, with fewer digits than for storing.
"""

import random

import pytest
from against_reference import REFERENCE_TOLERANCE, largest_error, motion_of
from make_reference import compute
from reference_cases import Case, StoredRun, read, runs_of

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.simulation import simulate

RUNS = [run for name in ("single_mass", "flexible_arm", "design_case") for run in read(name)]
DIGITS = 70  # of the random cases
SEEDS = range(120)


@pytest.mark.parametrize("stored", RUNS, ids=lambda run: run.case.name)
def test_run_agrees_with_the_reference(stored: StoredRun) -> None:
    motion = motion_of(stored.case)
    assert largest_error(stored, motion) <= REFERENCE_TOLERANCE
    assert {k: bool(motion.stuck[k]) for k in stored.at_rest} == stored.at_rest
    if not stored.events["touch"]:  # a stop of no duration may be counted as none
        assert motion.event_count == sum(stored.events.values())


@pytest.mark.parametrize(
    ("load_velocity", "flagged"), [(0.0, True), (2.0**-20, False), (-(2.0**-20), False)]
)
def test_a_velocity_that_grazes_zero_is_flagged(load_velocity: float, flagged: bool) -> None:
    """v1 = 1 + (1 - v2(0)) cos(omega t) touches zero if the load starts at rest, else it does not.

    With static friction above Coulomb friction, staying and going on are then equally right.
    """
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=0.125, static_friction=0.1875, viscous_friction=0.0
    )
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    start = (0.0, 2.0 - load_velocity, 0.0, load_velocity)
    motion = simulate(arm, [0.125] * 4, sampling_time=1.0, initial_state=start)
    assert motion.any_grazing == flagged


def _log_uniform(draw: random.Random, low: float, high: float) -> float:
    return float(low * (high / low) ** draw.random())


def _draw(seed: int) -> Case:
    draw = random.Random(seed)  # noqa: S311  (a test input, not a secret)
    force = _log_uniform(draw, 1e-3, 1e3)
    if seed % 5:
        plant = {
            "mass_1": _log_uniform(draw, 0.01, 100),
            "mass_2": _log_uniform(draw, 0.01, 100),
            "stiffness": _log_uniform(draw, 0.01, 1e4),
        }
        omega = (plant["stiffness"] * (1 / plant["mass_1"] + 1 / plant["mass_2"])) ** 0.5
        omega_time = _log_uniform(draw, 0.001, 6) if seed % 2 else draw.uniform(0.5, 6)
        time, mass = omega_time / omega, plant["mass_1"] + plant["mass_2"]
        damping, stretch = plant["mass_1"] * omega, force / plant["stiffness"]
    else:
        plant = {"mass": _log_uniform(draw, 0.01, 100)}
        time, mass = _log_uniform(draw, 0.001, 2), plant["mass"]
        damping, stretch = mass / time, 0.0
    coulomb = (force * draw.random(), force * draw.random())
    ratio = draw.choice((1.0, 1.0, 1.5, 3.0))
    viscous = draw.choice((0.0, _log_uniform(draw, 1e-12, 1e-2), _log_uniform(draw, 1e-2, 10)))
    effort: list[float] = []
    while len(effort) < 30:
        level = draw.choice((0.0, draw.uniform(-1, 1), draw.uniform(-2, 2)))
        effort += [level * force] * draw.randint(1, 6)
    speed = force * time / mass
    start = (0.0, draw.choice((0.0, draw.uniform(-3, 3) * speed)))
    if "mass" not in plant:
        start += (draw.uniform(-1, 1) * stretch, draw.uniform(-3, 3) * speed)
    return Case(
        name=f"random-{seed}",
        about="drawn at random",
        plant=plant,
        coulomb=coulomb,
        static=(ratio * coulomb[0], ratio * coulomb[1]),
        viscous=(viscous * damping, viscous * damping * draw.choice((1.0, 0.0, 3.0))),
        offset=draw.choice((0.0, 0.1 * draw.uniform(-1, 1) * force)),
        sampling_time=time,
        initial_state=start,
        effort_runs=runs_of(effort),
        kept=len(effort),
    )


@pytest.mark.parametrize("seed", SEEDS)
def test_random_run_agrees_with_the_reference(seed: int) -> None:
    stored = compute(_draw(seed), digits=DIGITS, conditioning=False)
    assert largest_error(stored, motion_of(stored.case)) <= REFERENCE_TOLERANCE
