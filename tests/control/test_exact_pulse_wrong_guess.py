"""The exact pulse controller with first guesses that are wrong by orders of magnitude."""

import math
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from exact_pulses import ENCODER, ENCODER_ONLY, IDEAL, PLANT, SAMPLE_NOISE, T
from pulse_runs import run_pulses
from refusals import refuses

from stickslip.control import ExactPulseController
from stickslip.control.pulses import exact_learning
from stickslip.control.pulses import kernel as pulse
from stickslip.friction import CoulombViscousFriction
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import Sensors

MOVE, LIMIT = 0.01, 300.0
MOST_PULSES = 16  # efforts grow by half at a time: eleven from a hundredth of what frees the axis
BEYOND = 1.0  # of the move: how far such a first guess may take the axis beyond its target


def controller(mass=1.0, coulomb=1.0, viscous=1.0, *, rest=IDEAL, **changes):
    """Return one whose first guess, otherwise near, is wrong by these factors."""
    guess = CoulombViscousFriction.symmetric(
        coulomb_friction=min(80.0 * coulomb, 0.97 * LIMIT), viscous_friction=500.0 * viscous
    )
    ideal = rest is IDEAL
    settings = {
        "sampling_time": T,
        "target": MOVE,
        "tolerance": 1e-6 if ideal else 2e-5,
        "rest": rest,
        "effort_limit": LIMIT,
        "mass": 150.0 * mass,
        "friction": guess,
        "position_noise": 0.0 if ideal else SAMPLE_NOISE,
    }
    return ExactPulseController(**(settings | changes))


def moved(to_try):
    """Return how far beyond the target the axis went, over the move; and the run."""
    sensors = ENCODER_ONLY if to_try.rest is ENCODER else Sensors()
    done = run_pulses(
        PLANT, to_try, sampling_time=T, duration=20.0,
        sensors=sensors, generator=np.random.default_rng(1),
    )  # fmt: skip
    x = done.run.motion.position
    return max(x.max() - MOVE, -x.min()) / MOVE, done


FACTORS = [
    (1000.0, 1.0, 1.0),
    (100.0, 1.0, 1.0),
    (10.0, 1.0, 1.0),
    (1.0, 1e-3, 1.0),
    (1.0, 1.0 / 80.0, 1.0),
    (1.0, 1.0, 2000.0),
    (1.0, 1.0, 14.0),
    *product((1e-3, 1e3), (1e-3, 1.0, 3.5), (1e-3, 1.0, 1e3)),
]
"""Guessed mass, Coulomb friction and viscous friction over the true ones."""


@pytest.mark.parametrize("rest", [IDEAL, ENCODER], ids=["ideal", "encoder"])
@pytest.mark.parametrize(
    "factors",
    [
        pytest.param(each, marks=[] if each in FACTORS[::5] else pytest.mark.slow)
        for each in FACTORS
    ],
)
def test_a_guess_wrong_by_orders_of_magnitude_is_overcome(factors, rest):
    beyond, done = moved(controller(*factors, rest=rest))
    assert beyond < BEYOND
    assert done.outcome is PositioningOutcome.REACHED
    assert len(done.pulses) <= MOST_PULSES


def test_a_pulse_ends_where_the_effort_was_to_take_the_axis():
    heavy = controller(mass=1000.0)
    _, done = moved(heavy)
    first = done.pulses[0]
    # Without viscous friction the displacement would be as predicted, whatever the mass
    assert first.duration < 0.2
    assert 0.3 < first.achieved_displacement / first.predicted_displacement < 1.5


def test_a_contradicted_guess_is_corrected_all_the_way_by_one_pulse():
    heavy = controller(mass=1000.0)
    _, done = moved(heavy)
    assert len(done.pulses) == 2
    learned = heavy.estimates(done.run.controller_state)
    assert learned["mass"] == pytest.approx(150.0, rel=1e-2)
    assert learned["coulomb_friction_positive"] == pytest.approx(100.0, rel=1e-2)


def test_what_the_pulse_did_not_show_is_known_no_worse():
    """Of the direction that has not moved, what it has not in common with the other."""
    P = np.diag([0.05, 0.2, 0.2, 0.2, 0.2]) ** 2
    P[1:3, 1:3] += 0.25
    P[3:, 3:] += 0.25
    left = np.empty((5, 5))
    exact_learning._unseen(P, 0, left)  # pyright: ignore[reportPrivateUsage]
    seen, unseen = [0, 1, 3], [2, 4]
    expected = np.zeros((5, 5))
    expected[np.ix_(unseen, unseen)] = P[np.ix_(unseen, unseen)] - P[np.ix_(unseen, seen)] @ (
        np.linalg.solve(P[np.ix_(seen, seen)], P[np.ix_(seen, unseen)])
    )
    np.testing.assert_allclose(left, expected, atol=1e-15)


def test_where_the_law_does_not_hold_pulses_grow_step_by_step():
    """An axis against a stop gives way a little, whatever the pulse."""
    blocked = controller()
    state, x, k, widths = blocked.init(), 0.0, 0, []
    while len(widths) < 4:
        v = 0.0
        state, effort = blocked.step(state, SensorSample(k * T, x, v, math.nan, math.nan))
        k += 1
        if effort == 0.0:
            break
        width, aim = 1, x + 1e-7
        while pulse.head(state).phase == pulse.PULSING:
            x += 0.5 * (aim - x)
            state, _ = blocked.step(state, SensorSample(k * T, x, 0.1, math.nan, math.nan))
            k, width = k + 1, width + 1
        x = aim
        widths.append(width)
    assert len(widths) == 4
    assert all(after <= 10 * before for before, after in pairwise(widths))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("static_friction_positive", -1.0),
        ("freeing_effort_negative", -5.0),
        ("freeing_effort_positive", 0.0),
        ("holding_effort_positive", -1.0),
        ("friction_walk", -1.0),
    ],
)
def test_what_no_axis_teaches_is_refused(name, value):
    known = controller().learned(controller().init())
    damaged = replace(known, values={**known.values, name: value})
    code = "not_positive" if name.startswith("freeing") else "negative"
    with refuses(code, where="values", name=name, value=value):
        controller().resumed(damaged)
    with refuses("saved_value_too_large"):
        replace(known, values={**known.values, name: 1e300})
