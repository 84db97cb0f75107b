"""Online estimators whose first samples are wrong, or that do not get every sample."""

from collections.abc import Callable

import numpy as np
import pytest
from jaxtyping import Float

from stickslip.estimation import EnergyEstimator, ExtendedKalmanFilter

MASS, VISCOUS, COULOMB, OFFSET = 3.0, 4.0, 1.5, 0.3
T = 1e-3
STEP = 1e-7  # of the encoder [m]
REST = 150  # samples before the first move

SAME = 0.01
"""Relative difference from the run without a fault; the intervals are wider."""

Samples = Float[np.ndarray, "n 5"]
Method = ExtendedKalmanFilter | EnergyEstimator


def samples(seed: int) -> Samples:
    """Return moves to and fro after a rest, in closed form: noisy effort, counted position."""
    rng = np.random.default_rng([seed, 271])
    stroke = 0.8 + 0.4 * rng.random(12)  # s
    size = rng.uniform(0.02, 0.1, 12) * np.resize([1.0, -1.0], 12)
    position, effort = [np.zeros(REST)], [np.full(REST, 0.4 * COULOMB)]
    at = 0.0
    for duration, travel in zip(stroke, size, strict=True):
        time = np.arange(0.0, duration, T)
        place, middle = time / duration, (time + 0.5 * T) / duration
        # x = travel (s - sin(2 pi s) / (2 pi)): velocity and acceleration begin and end at zero
        velocity = travel / duration * (1.0 - np.cos(2.0 * np.pi * middle))
        acceleration = 2.0 * np.pi * travel / duration**2 * np.sin(2.0 * np.pi * middle)
        position.append(at + travel * (place - np.sin(2.0 * np.pi * place) / (2.0 * np.pi)))
        effort.append(MASS * acceleration + VISCOUS * velocity + COULOMB * np.sign(travel) + OFFSET)
        at += travel
    x, u = np.concatenate(position), np.concatenate(effort)
    table = np.zeros((x.size, 5))
    table[:, 0] = u + 0.02 * rng.standard_normal(u.size)
    table[:, 1] = STEP * np.floor((x + 0.3 * STEP) / STEP)
    return table


def methods() -> dict[str, Method]:
    ekf = ExtendedKalmanFilter(
        inertia=MASS,
        offset=True,
        position_noise=STEP / np.sqrt(12.0),
        rest_speed=2e-3,
        rest_force=5.0,
        initial_deviations={"viscous_friction": 50.0, "coulomb_friction": 5.0, "offset": 5.0},
    )
    return {
        "ekf": ekf,
        "energy": EnergyEstimator(inertia=MASS, offset=True),
        "energy, inertia unknown": EnergyEstimator(offset=True),
    }


def wrong_first(table: Samples) -> Samples:
    table[0, 1] += 1.0
    return table


def wrong_at_rest(table: Samples) -> Samples:
    table[60:62, 1] += 1.0
    table[110, 1] += 1.0
    return table


def one_lost(table: Samples) -> Samples:
    return np.delete(table, REST + 2500, axis=0)


def five_lost(table: Samples) -> Samples:
    return np.delete(table, np.arange(REST + 2500, REST + 2505), axis=0)


def outcome(
    method: Method, table: Samples
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"], int]:
    """Return estimates, half widths of their intervals, and the number of resets."""
    state = method.init(sampling_time=T, velocity_measured=False)
    for sample in table.tolist():
        method.kernel(state, *sample)
        assert np.isfinite(state[method.values_at]).all()
    low, high = method.intervals(state)[-3:].T
    return 0.5 * (low + high), 0.5 * (high - low), method.health(state).resets


@pytest.mark.parametrize("fault", [wrong_first, wrong_at_rest, one_lost, five_lost])
@pytest.mark.parametrize("name", list(methods()))
@pytest.mark.parametrize("seed", [1, 2])
def test_wrong_first_samples_and_lost_ones_leave_the_estimates(
    name: str, fault: Callable[[Samples], Samples], seed: int
) -> None:
    method, table = methods()[name], samples(seed)
    values, half, _ = outcome(method, table)
    assert values == pytest.approx([VISCOUS, COULOMB, OFFSET], rel=0.05)
    found, wide, resets = outcome(method, fault(table.copy()))
    assert resets == 0
    assert found == pytest.approx(values, rel=SAME)
    assert np.all(wide < 1.5 * half)


@pytest.mark.parametrize("name", ["ekf", "energy"])
@pytest.mark.parametrize(("seed", "lost"), [(1, 1130), (1, 1290), (2, 970), (2, 1090)])
def test_a_jump_within_the_tolerance_of_the_admission_is_a_single_force_event(
    name: str, seed: int, lost: int
) -> None:
    # A held force gives a velocity that is wrong for certain, with the other sign in every sample
    method, table = methods()[name], np.delete(samples(seed), lost, axis=0)
    state = method.init(sampling_time=T, velocity_measured=False)
    for sample in table[: lost + 100].tolist():
        method.kernel(state, *sample)
    health = method.health(state)
    assert (health.motion_steps, health.force_events) == (0, 1)
