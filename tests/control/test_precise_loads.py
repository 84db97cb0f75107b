"""Thresholds by which `precise` distinguishes a load from a swing, a glitch and a delay."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest

from stickslip import CoulombViscousFriction, ExactPulseController
from stickslip.control import PreciseController, RestDetection
from stickslip.control.precise import braking, holding, moving
from stickslip.control.precise import learning as at

MASS, FRICTION, LIMIT, NOISE = 2.0, 1.0, 10.0, 1e-6


def precise(period: float) -> PreciseController:
    """Return a controller with this sampling time."""
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
    return PreciseController(pulses=pulses)


def state_of(period: float) -> Any:
    """Return the fields of the state of an axis."""
    return at.own_fields(precise(period).init())


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
    holding.start_letting_go(p, MASS, effort)
    for _ in range(at.HISTORY):
        at.sent(p, effort)
    assert holding.hold(p, MASS, FRICTION, False) == pytest.approx(effort, rel=1e-9)


@pytest.mark.parametrize(("period", "samples"), [(1e-3, 10.0), (1e-2, 3.0), (0.1, 3.0)])
def test_an_effort_at_rest_falls_with_ten_milliseconds_or_three_samples(
    period: float, samples: float
) -> None:
    p = state_of(period)
    effort = LIMIT
    for _ in range(round(samples)):
        effort = holding.lowered(p, effort)
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


def advanced(x: float, v: float, force: float) -> tuple[float, float]:
    """Return position and speed of the mass after 10 ms of a force and Coulomb friction."""
    if v == 0.0 and abs(force) <= FRICTION:
        return x, v
    after = v + (force - np.sign(v or force) * FRICTION) * 1e-2 / MASS
    after = 0.0 if v * after < 0.0 else after
    return x + 0.5 * (v + after) * 1e-2, after


def held_run(true: int, learned: float, forces: Sequence[float], *, known: bool) -> tuple[Any, int]:
    """Simulate a hold under given forces, one a sample, with a delay of the effort.

    Delays are in samples of 10 ms. The axis starts from rest. The run ends with the hold. Returns
    the fields of the state, and 1 if the delay was rejected in any sample.
    """
    p, rejected = state_of(1e-2), 0
    p.shown, p.seen, p.best = 1, 1, round(learned * at.PER_SAMPLE)
    p.known, p.delay = int(known), learned
    x = v = 0.0
    sent = [0.0] * len(forces)
    for k, force in enumerate(forces):
        x, v = advanced(x, v, force + (sent[k - 1 - true] if k > true else 0.0))
        braking.remember(p, x)
        if k == 3:
            holding.start_holding_moving(p, MASS)
        if p.moving == at.HOLDING:
            sent[k] = holding.hold(p, MASS, FRICTION, True)
        elif k > 3:
            break
        at.sent(p, sent[k])
        rejected = max(rejected, int(p.undelayed))
    return p, rejected


def test_a_hold_rejects_a_wrong_delay() -> None:
    """A load looks like a delay in a short move. The effort against it shows that there is none."""
    p, rejected = held_run(0, 2.0, [-2.5 * FRICTION] * 16, known=False)
    assert rejected == 1
    assert p.swung == 0
    assert p.moving == at.HOLDING
    assert p.seen == 0  # nothing is learned from the move


def test_a_hold_keeps_a_true_delay() -> None:
    p, rejected = held_run(2, 2.0, [-2.5 * FRICTION] * 16, known=False)
    assert rejected == 0
    assert p.moving == at.HOLDING


@pytest.mark.parametrize("known", [False, True])
def test_a_known_delay_is_kept(known: bool) -> None:
    """The start and the end of a push look like another delay."""
    rejected = [
        held_run(delay, delay, [-push] * lasts + [0.0] * 20, known=known)[1]
        for delay in (1, 2, 4, 8)
        for lasts in (5, 7, 9)
        for push in (2.0, 4.0, 6.0)
    ]
    assert any(rejected) is not known


@pytest.mark.parametrize(("let_go", "loaded"), [(0, 0), (1, 0), (2, 1)])
@pytest.mark.parametrize(("period", "still"), [(1e-2, 1), (1e-3, 3), (1e-3, 2)])
def test_a_load_that_moves_the_axis_whenever_it_is_let_go_is_held_for_good(
    period: float, still: int, let_go: int, loaded: int
) -> None:
    """It is held after 0.3 s if it has moved twice, its effort lowered by a fifth or more."""
    p = state_of(period)
    for _ in range(at.PAST):
        braking.remember(p, 0.0)
    holding.start_letting_go(p, MASS, 2.0)
    x, moves, rests = 0.0, 0, 0
    for _ in range(round(0.3 / period)):
        rests = int(p.quiet)
        if rests == still and moves < let_go:
            x, moves = x - 20.0 * NOISE, moves + 1  # more than noise
        braking.remember(p, x)
        p.brake = 2.0  # keeps the lowered effort from ending the hold
        holding.hold(p, MASS, 0.0, True)
    lowered_enough = period > 5e-3 or still > 2
    assert p.loaded == (loaded if lowered_enough else 0)


@pytest.mark.parametrize(
    ("one_way", "backward", "holds"),
    [(5, 0, False), (6, 0, True), (6, 1, False)],  # the last one goes on in its move
)
def test_a_failed_braking_becomes_a_hold_after_half_a_swing(
    one_way: int, backward: int, holds: bool
) -> None:
    """The move has vibrated. Six samples are 60 ms."""
    p, x = state_of(1e-2), 0.0
    p.shakes, p.way, p.misfit[:], p.backward = at.SHAKES, 0.01, 1e9, backward
    for k in range(at.KEPT):
        x -= 1e-3 if k > at.KEPT - 4 else 9e-4  # it does not become slower
        braking.remember(p, x)
    p.one_way, p.brakings, p.brake, p.braked_speed = one_way, 1, 1.0, 0.1
    p.moving = at.BRAKING
    braking.brake(p, MASS, FRICTION, True)
    assert (p.moving == at.HOLDING) == holds


def creeping(share: float, period: float = 1e-2) -> Any:
    """Return an axis at a share of the fastest creeping: friction stops that one in 20 bends."""
    p = state_of(period)
    speed = share * np.sqrt(2.0 * FRICTION * 20.0 * p.bend / MASS)
    for k in range(-at.PAST, 1):
        braking.remember(p, speed * period * k)
    return p


@pytest.mark.parametrize(
    ("share", "friction", "fault", "holds"),
    [
        (0.97, FRICTION, "", True),
        (1.03, FRICTION, "", False),
        (0.97, FRICTION, "shakes", False),
        (0.97, FRICTION, "glitch", False),
        (0.97, FRICTION, "fast", False),  # the servo continues the move
        (1.55, 8.0 * FRICTION, "", True),  # friction counts up to a quarter of the limit
        (1.61, 8.0 * FRICTION, "", False),
    ],
)
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_axis_that_creeps_and_does_not_follow_its_plan_is_held(
    share: float, friction: float, fault: str, holds: bool, side: float
) -> None:
    p = creeping(side * share)
    values = np.array([np.log(MASS), *np.log([friction] * 2), -9.0, -9.0])
    moving.start_move(p, p.past[0] - side * 1e-6, side * 0.01, values, 1e-6 * np.eye(5))
    p.seen, p.open, p.wild, p.samples = 1, 0, moving.WILD + 1, 8
    if fault:
        setattr(p, fault, at.SHAKES)
    at.sent(p, side * 3.0)
    moving.go_on(p, p.past[0], fault != "glitch")
    assert p.moving == (at.HOLDING if holds else at.BRAKING)
    assert not holds or p.brake == side * 3.0


@pytest.mark.parametrize("load", [0.0, -2.0 * FRICTION])
def test_a_creeping_axis_is_stopped_without_a_swing(load: float) -> None:
    """It creeps as fast as it may, under an effort of which the load takes a part."""
    p = creeping(0.99)
    assert braking.creeps(p, MASS, FRICTION)
    x, v, effort, farthest = 0.0, float(p.past[0] - p.past[1]) / 1e-2, FRICTION - load, 0.0
    at.sent(p, effort)
    holding.start_holding_creeping(p, MASS, effort)
    effort = holding.hold(p, MASS, FRICTION, True)
    for _ in range(30):
        at.sent(p, effort)
        x, v = advanced(x, v, effort + load)
        braking.remember(p, x)
        effort = holding.hold(p, MASS, FRICTION, True) if p.moving == at.HOLDING else 0.0
        farthest = max(farthest, abs(x))
    assert p.swung == 0
    assert v == 0.0
    assert farthest < 0.2 * 0.01  # of the way, from where an axis is braked at once


def test_another_target_begins_to_let_a_load_go() -> None:
    controller = precise(1e-2)
    state = controller.init()
    p = at.own_fields(state)
    p.moving, p.loaded, p.held, p.restarts = at.HOLDING, 1, 3, 8
    after = at.own_fields(controller.retargeted(state, -0.01))
    assert (after.loaded, after.held, after.restarts) == (0, 0, 0)
