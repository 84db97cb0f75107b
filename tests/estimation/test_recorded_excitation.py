"""Predicted precision against the intervals of fits, on axes that the test itself simulates."""

import numpy as np
import pytest
from axis_logs import axis_log

from stickslip import identify
from stickslip.estimation.recorded_excitation import expected_precision

pytestmark = pytest.mark.slow

LIMIT = 0.05
STEP, EVERY = 2e-4, 10  # s; samples are 2 ms
PARAMETERS = ("mass", "viscous_friction", "coulomb_friction")


def random_logs(runs: int, seed: int, *, creep: bool = False):
    """Return logs of axes that follow motions from rich to poor; no code of the package is used.

    With ``creep`` the target moves slowly to and fro, so that the axis sticks and slips.
    """
    generator = np.random.default_rng(seed)
    mass = generator.uniform(0.5, 3.0, runs)
    coulomb = generator.uniform(0.5, 3.0, runs)
    static = coulomb * generator.uniform(1.0, 1.6, runs)
    viscous = generator.uniform(0.5, 5.0, runs)
    stribeck = 0.01
    duration = 10 ** generator.uniform(0.5, 1.2)  # s
    n = int((32.0 if creep else duration) / (STEP * EVERY))
    sizes = 10 ** generator.uniform(-2.0, -0.5, (3, runs))  # m
    rates = 2 * np.pi * 10 ** generator.uniform(-0.9, 0.6, (3, runs))
    phases = generator.uniform(0, 2 * np.pi, (3, runs))
    stops = generator.random(runs) < 0.5
    position_noise = 10 ** generator.uniform(-6, -4.3, runs)
    effort_noise = 10 ** generator.uniform(-2.3, -0.5, runs)
    q, u = np.zeros((n, runs)), np.zeros((n, runs))
    x, dx = np.zeros(runs), np.zeros(runs)
    held = np.zeros(runs)
    for k in range(n):
        t = k * STEP * EVERY
        clock = np.where(stops, 0.5 * np.floor(t / 1.0) + np.minimum(t % 1.0, 0.5), t)
        wave = sizes * (np.sin(rates * clock + phases) - np.sin(phases))
        target = wave.sum(axis=0)
        if creep:
            target = 0.02 * (1.0 - np.abs(t % 4.0 - 2.0)) * np.ones(runs)
        held = 400 * mass * (target - x) - 35 * mass * dx
        q[k], u[k] = x, held
        for _ in range(EVERY):
            friction = coulomb + (static - coulomb) * np.exp(-((dx / stribeck) ** 2))
            free = dx + STEP * (held - viscous * dx) / mass
            stop = mass * free / STEP  # the friction that would end the motion in this step
            sticks = np.abs(stop) <= np.where(dx == 0.0, static, friction)
            new = np.where(sticks, 0.0, free - STEP * np.sign(stop) * friction / mass)
            new = np.where(new * np.sign(stop) < 0.0, 0.0, new)
            x, dx = x + STEP * new, new
    time = np.arange(n) * STEP * EVERY
    for k in range(runs):
        log = axis_log(
            time,
            u[:, k] + effort_noise[k] * generator.normal(size=n),
            q[:, k] + position_noise[k] * generator.normal(size=n),
            name=f"run {k}",
        )
        yield (
            log,
            {
                "mass": mass[k],
                "viscous_friction": viscous[k],
                "coulomb_friction": coulomb[k],
                "static_friction": static[k],
            },
        )


def verdicts(runs: int, seeds: int):
    """Return predictions and outcomes: (predicted, within, parameter, relative, actual)."""
    for seed in range(seeds):
        for log, _ in random_logs(runs, seed):
            expected = {each.parameter: each for each in expected_precision(log, limit=LIMIT)}
            estimate = identify(log).estimate
            for name in PARAMETERS:
                found = estimate.parameters.get(name)
                if found is None or found.ci95 is None:  # by direction, or not identified
                    actual = np.inf
                    if f"{name}_positive" in estimate.parameters:
                        continue
                else:
                    actual = (found.ci95[1] - found.ci95[0]) / 2 / abs(found.value)
                each = expected[name]
                yield each.sufficient, actual <= LIMIT, name, each.relative, actual


def test_the_prediction_agrees_with_the_fit():
    """Few predictions are wrong; the tuning states how many of a larger number."""
    every = list(verdicts(runs=6, seeds=2))
    yes = [within for predicted, within, *_ in every if predicted]
    no = [within for predicted, within, *_ in every if not predicted]
    assert len(yes) > 20
    assert len(no) > 0
    assert np.mean(yes) >= 0.85
    ratios = [actual / relative for *_, relative, actual in every if relative and actual < np.inf]
    assert 0.5 < np.median(ratios) < 2.0


def test_static_friction_of_an_axis_that_sticks_and_slips():
    found = []
    for log, truth in random_logs(8, 0, creep=True):
        expected = {each.parameter: each for each in expected_precision(log, limit=LIMIT)}
        static = expected["static_friction"]
        if static.sufficient:
            found.append(abs(static.value / truth["static_friction"] - 1))
    assert len(found) >= 3
    assert np.median(found) < LIMIT
    assert max(found) < 2 * LIMIT


def test_static_friction_needs_starts_from_rest():
    time = np.arange(0, 8, 0.002)
    velocity = 1.5 * np.sin(2 * time) + np.sin(5 * time)
    acceleration = 3.0 * np.cos(2 * time) + 5.0 * np.cos(5 * time)
    position = -0.75 * np.cos(2 * time) - 0.2 * np.cos(5 * time)
    noise = np.random.default_rng(1).normal(scale=0.01, size=time.size)
    log = axis_log(time, acceleration + 2 * np.sign(velocity) + velocity + noise, position)
    found = {each.parameter: each for each in expected_precision(log)}
    assert found["mass"].sufficient
    assert found["coulomb_friction"].sufficient
    assert not found["static_friction"].sufficient
    assert "resolved starts from rest: 0" in found["static_friction"].advice
