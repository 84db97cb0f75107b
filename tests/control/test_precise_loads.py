"""How `precise` tells a load from a swing, a glitch and a delay: its thresholds, on both sides."""

from typing import Any

import numpy as np
import pytest

from stickslip import CoulombViscousFriction, ExactPulseController
from stickslip.control import PreciseController, RestDetection
from stickslip.control.precise import braking, moving
from stickslip.control.precise import learning as at

MASS, FRICTION, LIMIT, NOISE = 2.0, 1.0, 10.0, 1e-6


def state_of(period: float) -> Any:
    """Return the fields of the state of an axis."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=FRICTION, viscous_friction=0.0)
    rest = RestDetection.for_encoder(resolution=NOISE, noise=NOISE, samples=10)
    pulses = ExactPulseController(
        sampling_time=period,
        target=0.01,
        tolerance=2e-5,
        effort_limit=LIMIT,
        mass=MASS,
        friction=law,
        rest=rest,
        position_noise=NOISE,
    )
    return at.own_fields(PreciseController(pulses=pulses).init())


@pytest.mark.parametrize(
    ("period", "least"),
    [(1e-3, 60), (2e-3, 30), (1e-2, 6), (0.1, 6)],  # 60 ms, or twice the three samples of a speed
)
def test_an_axis_that_has_swung_falls_if_it_moves_to_one_side_for_long(
    period: float, least: int
) -> None:
    p = state_of(period)
    for swung in (0, 1):
        p.swung = swung
        p.one_way = least - 1
        assert not braking.is_falling(p)
        p.one_way = least
        assert braking.is_falling(p) == bool(swung)


def test_a_turn_by_more_than_the_noise_begins_another_way() -> None:
    p = state_of(1e-3)
    for k in range(20):
        braking.remember(p, k * 1e-5)
    before = int(p.one_way)
    assert before > 10
    braking.remember(p, 19e-5 - 9.0 * p.noise)
    assert p.one_way == before + 1
    braking.remember(p, 19e-5 - 11.0 * p.noise)
    assert p.one_way == 0


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("positions", "holds"),
    [
        ((0.0, 0.0, -1e-5, -4e-5), True),
        ((0.0, 0.0, 0.0, -5e-5), False),  # one step may be a glitch
        ((0.0, 0.0, -1e-6, -4e-6), False),  # noise
        ((0.0, 0.0, -4e-5, -5e-5), False),  # it slows
        ((0.0, 0.0, 1e-5, 4e-5), False),
    ],
)
def test_a_move_that_a_load_drives_back_is_held(
    positions: tuple[float, ...], holds: bool, sign: float
) -> None:
    p = state_of(1e-2)
    values, covariance = np.array([np.log(MASS), 1.0, 1.0, 0.0, 0.0, 0.0]), 0.01 * np.eye(6)
    moving.start_move(p, 0.0, sign * 0.01, values, covariance)
    for position in positions:
        braking.remember(p, sign * position)
    moving.go_on(p, sign * positions[-1], True)
    assert (p.moving == at.HOLDING) == holds


def test_an_effort_that_is_let_go_outlasts_a_lost_sample() -> None:
    period = 1e-2
    p = state_of(period)
    for _ in range(at.PAST):
        braking.remember(p, 0.0)
    effort = -0.9 * LIMIT
    braking.start_letting_go(p, MASS, effort)
    for _ in range(at.HISTORY):
        at.sent(p, effort)
    assert braking.hold(p, MASS, FRICTION, False) == pytest.approx(effort, rel=1e-9)


@pytest.mark.parametrize(("period", "samples"), [(1e-3, 10.0), (1e-2, 3.0), (0.1, 3.0)])
def test_an_effort_at_rest_falls_with_ten_milliseconds_or_three_samples(
    period: float, samples: float
) -> None:
    p = state_of(period)
    effort = LIMIT
    for _ in range(round(samples)):
        effort = braking.lowered(p, effort)
    assert effort == pytest.approx(LIMIT * (samples / (samples + 1.0)) ** samples)


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize(
    ("travels", "effort", "holds"),
    [
        ((2.0, 4.0, 6.0), 0.0, True),
        ((2.0, 4.0, 6.0), -0.1, True),  # a weak braking
        ((2.0, 4.0, 6.0), 0.1, False),  # the effort itself may have moved it
        ((2.0, 6.0, 4.0), 0.0, False),  # it slows
        ((-2.0, 4.0, 6.0), 0.0, False),  # it has turned round since, as on a spring
        ((0.01, 0.02, 0.03), 0.0, False),  # noise
        ((0.1, 0.2, 6.0), 0.0, False),  # a glitch
    ],
)
@pytest.mark.parametrize("period", [1e-3, 1e-2])
def test_an_axis_that_falls_against_its_braking_is_held(
    period: float, travels: tuple[float, ...], effort: float, holds: bool, side: float
) -> None:
    """The travels of 10 ms, or of 5 samples of 1 ms, in hundredths of a millimetre."""
    p, x, each = state_of(period), 0.0, 1 if period > 5e-3 else 5
    for _ in range(2):
        braking.remember(p, x)
    for travel in travels:
        for _ in range(each):
            x += side * 1e-5 * travel / each
            braking.remember(p, x)
            at.sent(p, side * effort * LIMIT)
    braking.start_braking(p)
    braking.brake(p, MASS, FRICTION, True)
    assert (p.moving == at.HOLDING) == holds


def test_a_vibration_is_no_fall() -> None:
    p = state_of(1e-2)
    for x in (0.0, 0.0, -2e-5, -6e-5, -12e-5):
        braking.remember(p, x)
    assert braking.accelerates_against_effort(p)
    p.shakes = 1
    assert braking.accelerates_against_effort(p)
    p.shakes = 2
    assert not braking.accelerates_against_effort(p)
