"""Properties of each friction law: drift, memory, breakaway, energy."""

import dataclasses

import numpy as np
import pytest
from law_plants import DAHL, LAWS, LUGRE, PLASTIC, STIFFNESS, STRIBECK, plant_of
from numpy.random import default_rng

from stickslip.simulation import SimulatedMotion, simulate

T = 1e-3
PERIOD = 100  # samples
AT_REST = 1e-12  # m: a millionth of the bristles' deflection, which is some 1e-6 m
ROUNDING = 1e-13  # J, beside energies of 1e-3 J
BRISTLES = {name: LAWS[name] for name in ("Dahl", "LuGre", "elasto-plastic")}


def cycled(law, mean: float, amplitude: float, cycles: int = 200) -> SimulatedMotion:
    """A mass of 1 kg under an effort that swings around a mean at 10 Hz."""
    time = np.arange(cycles * PERIOD) * T
    effort = mean + amplitude * np.sin(2 * np.pi * time / (PERIOD * T))
    return simulate(plant_of(law, arm=False), effort, sampling_time=T)


@pytest.mark.parametrize(("name", "drifts"), [("Dahl", True), ("LuGre", True)])
def test_bristles_that_slip_from_the_first_drift_below_breakaway(name, drifts):
    # Dupont et al. (2002): an effort between 0.15 and 0.65 N, which 1 N should hold
    position = cycled(LAWS[name], 0.4, 0.25).position[::PERIOD]
    late = np.diff(position[100:])
    assert np.all(late > 1e-6)  # for ever, by the same way a period
    assert np.ptp(late) < 1e-4 * late.mean()


@pytest.mark.parametrize("law", [PLASTIC, STRIBECK], ids=["elasto-plastic", "Stribeck"])
def test_elastic_bristles_and_stiction_do_not_drift(law):
    # 0.65 N is below what frees the bristles, 1e5 N/m * 7 um = 0.7 N
    position = cycled(law, 0.4, 0.25).position[::PERIOD]
    assert np.abs(np.diff(position[100:])).max() <= AT_REST


def test_elasto_plastic_bristles_drift_beyond_their_elastic_limit():
    position = cycled(PLASTIC, 0.6, 0.25).position[::PERIOD]
    assert np.all(np.diff(position[100:]) > 1e-8)


def test_stiction_holds_bitwise():
    motion = simulate(plant_of(STRIBECK, arm=False), np.full(60_000, 1.499), sampling_time=T)
    assert np.all(motion.position == 0.0)
    assert motion.event_count == 0


@pytest.mark.parametrize("name", BRISTLES)
def test_loops_of_a_symmetric_effort_close(name):
    motion = cycled(LAWS[name], 0.0, 0.8)
    last, before = motion.position[-PERIOD - 1 :], motion.position[-2 * PERIOD - 1 : -PERIOD]
    assert np.ptp(last) > 1.01 * 2 * 0.8 / STIFFNESS  # more than springs would give: a loop
    assert np.abs(last - before).max() <= AT_REST


@pytest.mark.parametrize(("name", "remembers"), [("elasto-plastic", True), ("Dahl", False)])
def test_return_to_where_a_small_cycle_began(name, remembers):
    # A solid returns to the point at which a small cycle of the force left the larger one
    # (return-point memory); Dahl's has none, and an elastic one need not have
    force = np.concatenate([np.linspace(a, b, 2000) for a, b in ((0, 0.6), (0.6, 0.2), (0.2, 0.6))])
    motion = simulate(plant_of(LAWS[name], arm=False), force, sampling_time=T)
    left, returned = motion.position[2000], motion.position[6000]
    assert (abs(returned - left) < 1e-3 * left) == remembers


def breakaway_force(law, rate: float) -> float:
    """Largest friction until the mass slides, under an effort that rises at a rate [N/s]."""
    step = min(T, 1e-2 / rate)
    effort = rate * step * np.arange(int(2.5 / (rate * step)))
    motion = simulate(plant_of(law, arm=False), effort, sampling_time=step)
    friction = effort - np.diff(motion.velocity) / step
    slides = np.flatnonzero(motion.velocity > 0.01)
    return float(friction[: slides[0] if slides.size else None].max())


def test_breakaway_force_of_lugre_falls_with_the_rate_of_the_effort():
    # Canudas de Wit et al. (1995): from near the static friction down to the Coulomb one
    forces = [breakaway_force(LUGRE, rate) for rate in (0.1, 1.0, 5.0, 10.0, 20.0)]
    assert np.all(np.diff(forces) < -0.03)
    assert 1.45 < forces[0] < 1.5
    assert 1.0 < forces[-1] < 1.15


def test_breakaway_force_of_stiction_is_the_static_friction_at_any_rate():
    assert [round(breakaway_force(STRIBECK, rate), 6) for rate in (0.1, 10.0)] == [1.5, 1.5]


@pytest.mark.parametrize("rate", [0.5, 20.0])
def test_dahl_has_no_static_peak(rate):
    without = dataclasses.replace(
        DAHL, sliding=dataclasses.replace(
            DAHL.sliding, viscous_friction_positive=0.0, viscous_friction_negative=0.0
        )
    )  # fmt: skip
    assert breakaway_force(without, rate) <= 1.0 + 1e-9  # which it never reaches


def dissipated(motion: SimulatedMotion) -> np.ndarray:
    """Work of the effort in each sample less what mass and bristles have stored more [J]."""
    stored = 0.5 * motion.velocity**2
    if motion.bristle_deflection is not None:
        stored = stored + 0.5 * STIFFNESS * motion.bristle_deflection**2
    return motion.commanded_effort * np.diff(motion.position) - np.diff(stored)


@pytest.mark.parametrize("name", LAWS)
def test_friction_gives_back_no_more_than_it_has_stored(name):
    law = LAWS[name]
    if hasattr(law, "bristle_damping"):
        law = dataclasses.replace(law, bristle_damping=0.8)  # passive just so
    effort = np.repeat(default_rng(1).uniform(-3.0, 3.0, 200), 20)
    motion = simulate(plant_of(law, arm=False), effort, sampling_time=T)
    lost = dissipated(motion)
    assert lost.min() >= -ROUNDING
    assert lost.sum() > 0.05


@pytest.mark.parametrize(("damping", "passive"), [(0.8, True), (316.0, False)])
def test_a_kick_shows_whether_lugre_is_passive(damping, passive):
    # With its bristles bent by more than they bear in motion, and then thrust to 0.05 m/s at once
    law = dataclasses.replace(LUGRE, bristle_damping=damping)
    assert law.passive == passive
    effort = np.r_[np.linspace(0.0, 1.2, 60_000), np.full(10, 1000.0)]
    motion = simulate(plant_of(law, arm=False), effort, sampling_time=5e-6)
    assert (dissipated(motion)[-10:].min() >= -ROUNDING) == passive
