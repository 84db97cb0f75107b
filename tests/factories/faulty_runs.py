"""Random runs of guarded controllers with faulty samples."""

from math import isfinite
from typing import Any

import numpy as np

from stickslip.records import SensorSample

KINDS = (float, np.float32, np.float64, int, np.int64, bool, str, np.float16)
VALUES = (
    np.nan, np.inf, -np.inf, 0.0, -0.0, 1e308, -1e308, 1e-308, 1e30, -1e3, None, "", "x", 10**400,
    [], 1 + 2j, np.array([1.0, 2.0]),
)  # fmt: skip


def faulty_run(guarded: Any, generator: np.random.Generator, samples: int) -> None:
    """Step a guarded controller through a motion with random faults.

    The axis moves by a crude rigid model of the effort, so that controllers get on with their task;
    channels are then frozen, scaled, shifted, replaced by values that are no numbers, or of another
    type. An effort that is not finite or above the limit is an AssertionError.
    """
    limit, T = guarded.limits.effort, guarded.sampling_time
    low, high = guarded.limits.travel
    mass = limit / guarded.limits.acceleration * 3.0
    state, effort = guarded.init(), 0.0
    x, v, held = float(generator.uniform(0.0, 0.5) * high), 0.0, None
    rate = 10.0 ** generator.uniform(-3.0, 0.0)
    for k in range(samples):
        friction = 0.4 * limit
        force = (
            effort - np.sign(v) * friction
            if v
            else np.sign(effort) * max(abs(effort) - friction, 0)
        )
        moved = v + T * force / mass
        v = 0.0 if v * moved < 0.0 else moved
        x = min(max(x + T * v, 2.0 * low - 1.0), 2.0 * high + 1.0)
        values: list[Any] = [k * T, x, v, x, v]
        if held is not None:
            values = [k * T, *held[1:]]
            held = None if generator.uniform() < 0.1 else held
        if generator.uniform() < rate:
            fault, place = generator.integers(6), generator.integers(5)
            if fault == 0:
                values[place] = VALUES[generator.integers(len(VALUES))]
            elif fault == 1:
                held = list(values)
            elif fault == 2:
                values[place] = values[place] + float(
                    generator.normal()
                ) * 10.0 ** generator.uniform(-6, 6)
            elif fault == 3:
                kind = KINDS[generator.integers(len(KINDS))]
                values = [kind(value) for value in values]
            elif fault == 4:
                values[1:] = [np.nan] * 4
            else:
                state = guarded.retargeted(state, float(generator.uniform(low, high)))
        state, effort = guarded.step(state, SensorSample(*values))
        assert type(effort) is float
        assert isfinite(effort), (k, values)
        assert abs(effort) <= limit, (k, values)
