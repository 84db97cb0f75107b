"""Kernels of the pulse series, against matrix exponentials and dense sampling."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import LoadLosses
from stickslip.planning.arm_motion import ArmMotion, short_response, steps_per_sample
from stickslip.planning.programme import spread_over_rests
from stickslip.plants import FlexibleArm

ROUNDING = 1e-13  # of values of about 1, after some tens of products
DENSE = 400  # instants in each step that is looked at densely

LOSSES = LoadLosses(damping=0.08, coulomb_friction=0.02, viscous_friction=0.05)
OF_LOAD = (LOSSES.damping, LOSSES.viscous_friction)

sizes = st.floats(0.3, 3.0)


def generator(
    m1: float, m2: float, ks: float, c: float, d: float = 0.0, c2: float = 0.0
) -> np.ndarray:
    """The arm's equations with the net forces on both masses as further, constant states."""
    A = np.zeros((6, 6))
    A[0, 1] = A[2, 3] = 1.0
    A[1] = np.array([-ks, -c - d, ks, d, 1.0, 0.0]) / m1
    A[3] = np.array([ks, d, -ks, -d - c2, 0.0, 1.0]) / m2
    return A


def motion(m1: float, m2: float, ks: float, c: float, T: float, samples: int) -> ArmMotion:
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=c)
    arm = FlexibleArm(mass_1=m1, mass_2=m2, stiffness=ks, friction=law)
    parts = steps_per_sample(arm, T)
    return ArmMotion(
        arm=arm,
        resistance=0.1,
        viscous_friction=c,
        step=T / parts,
        steps=samples * parts,
        start=np.array([0.0, 0.0, 0.05, -0.1]),
        losses=LOSSES,
    )


@given(sizes, sizes, sizes, st.floats(0.0, 3.0), st.floats(0.0, 0.15), st.floats(0.0, 0.3))
def test_the_short_response_is_the_matrix_exponential(
    m1: float, m2: float, ks: float, c: float, t: float, d: float
) -> None:
    np.testing.assert_allclose(
        short_response((m1, m2, ks, c, d, 0.1), t),
        expm(generator(m1, m2, ks, c, d, 0.1) * t)[1],
        atol=ROUNDING,
    )


@settings(max_examples=30)
@given(sizes, sizes, sizes, st.floats(0.0, 3.0), st.floats(0.05, 2.0), st.integers(0, 2**31))
def test_every_dip_of_the_velocity_is_found(
    m1: float, m2: float, ks: float, c: float, T: float, seed: int
) -> None:
    """Also those between samples that the samples at both ends do not show."""
    moving = motion(m1, m2, ks, c, T, 12)
    generate = np.random.default_rng(seed)
    effort = np.repeat(generate.uniform(-1.0, 1.0, 12), moving.steps // 12)
    states = moving.states(effort)
    found = moving.minima(effort, states)
    A = generator(m1, m2, ks, c, *OF_LOAD)
    fine = expm(A * moving.step / DENSE)
    velocities = []
    for state, u in zip(states, effort, strict=False):
        each = np.append(state, (u - 0.1, -LOSSES.coulomb_friction))
        for _ in range(DENSE):
            velocities.append(each[1])
            each = fine @ each
    v = np.array([*velocities, states[-1, 1]])
    dips = np.flatnonzero((v[1:-1] < v[:-2]) & (v[1:-1] <= v[2:])) + 1
    # No deeper by more than a dense step can hide, and none missed.
    hidden = np.abs(np.diff(v, 2)).max() + ROUNDING
    at = (found[:, 0] + found[:, 1] / moving.step) * DENSE
    for dip in dips:
        nearest = int(np.argmin(np.abs(at - dip)))
        assert abs(at[nearest] - dip) <= 1.0 + 1e-6
        assert v[dip] - hidden <= found[nearest, 2] <= v[dip] + hidden


@given(sizes, sizes, sizes, st.integers(0, 2**31))
def test_rows_and_prices_are_those_of_the_motion(
    m1: float, m2: float, ks: float, seed: int
) -> None:
    moving = motion(m1, m2, ks, 0.2, 0.1, 20)
    generate = np.random.default_rng(seed)
    effort = generate.uniform(-1.0, 1.0, moving.steps)
    states = moving.states(effort)
    edges = np.arange(moving.steps + 1)
    steps = generate.integers(1, moving.steps, 6)
    within = np.array([0.0, 0.0, 0.0, 0.3, 0.6, 0.9]) * moving.step
    rows, without = moving.velocity_rows(np.column_stack([steps, within]), edges)
    for k, t, v in zip(steps, within, rows @ effort + without, strict=True):
        state = np.append(states[k], (effort[k] - 0.1, -LOSSES.coulomb_friction))
        A = generator(m1, m2, ks, 0.2, *OF_LOAD)
        assert v == pytest.approx(expm(A * t)[1] @ state, abs=1e-12)
    final, price = generate.uniform(-1.0, 1.0, 4), generate.uniform(0.0, 1.0, 6)
    worth = moving.worth(final, np.column_stack([steps, within]), price)
    effects = (moving.forced[::-1][:-1] - moving.forced[::-1][1:]) @ final
    np.testing.assert_allclose(worth, effects + price @ rows, atol=1e-12)


def test_prices_are_spread_but_not_lost() -> None:
    at, price = np.array([3.0, 20.5, 25.0, 31.0, 36.5, 80.0]), np.array([1.0, 2, 3, 4, 5, 6])
    spread, left = spread_over_rests(at, price, 100, 8.0)
    assert spread.sum() + left.sum() == pytest.approx(price.sum())
    assert np.all(spread >= 0)
    assert np.all(left >= 0)
    assert left[[0, 5]].tolist() == [1.0, 6.0]  # alone
    assert left[[2, 3]].tolist() == [0.0, 0.0]  # within a rest
    assert set(np.flatnonzero(spread)) <= set(range(20, 38))
