"""How `precise` tells a load from a swing, a glitch and a delay: its thresholds, on both sides."""

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


def held_run(true: int, learned: float, forces: Sequence[float], *, known: bool = False) -> Any:
    """Hold a mass that forces push, a value a sample, behind a delay; return the state's fields.

    The delays are in samples of 10 ms. It moves from rest, and friction slows it; in a sample its
    acceleration is constant. The fields stand as after the sample in which the hold has ended, or
    after the last one.
    """
    p, period = state_of(1e-2), 1e-2
    p.shown, p.best = 1, round(learned * at.PER_SAMPLE)
    p.known, p.delay = int(known), learned
    x = v = 0.0
    sent = [0.0] * len(forces)
    for k, force in enumerate(forces):
        effort = sent[k - 1 - true] if k > true else 0.0
        moves = v != 0.0 or abs(effort + force) > FRICTION
        side = np.sign(v) if v != 0.0 else np.sign(effort + force)
        a = (effort + force - side * FRICTION) / MASS if moves else 0.0
        after = v + a * period
        after = 0.0 if v * after < 0.0 else after
        x, v = x + 0.5 * (v + after) * period, after
        braking.remember(p, x)
        if p.moving == 0 and k == 3:
            holding.start_holding_moving(p, MASS)
        if p.moving == at.HOLDING:
            sent[k] = holding.hold(p, MASS, FRICTION, True)
        elif k > 3:
            break
        at.sent(p, sent[k])
    return p


def test_a_hold_finds_that_the_delay_of_the_move_was_wrong() -> None:
    """A load looks like a delay in a short move. The effort against it shows that there is none."""
    p = held_run(0, 2.0, [-2.5 * FRICTION] * 16)
    assert p.as_given == 1
    assert p.swung == 0
    assert p.moving == at.HOLDING


def test_a_hold_keeps_a_delay_that_is_true() -> None:
    p = held_run(2, 2.0, [-2.5 * FRICTION] * 16)
    assert p.as_given == 0
    assert p.moving == at.HOLDING


@pytest.mark.parametrize("push", [2.0, 4.0, 6.0, 9.0])
@pytest.mark.parametrize("lasts", [5, 7, 9, 20])
@pytest.mark.parametrize("delay", [1, 2, 4, 8])
def test_a_delay_that_is_known_is_not_doubted(delay: int, lasts: int, push: float) -> None:
    """The begin and the end of a push look like another delay."""
    p = held_run(delay, delay, [-push] * lasts + [0.0] * 20, known=True)
    assert p.as_given == 0


@pytest.mark.parametrize(("let_go", "loaded"), [(0, 0), (1, 0), (2, 1)])
def test_a_load_that_moves_the_axis_whenever_it_is_let_go_is_held_for_good(
    let_go: int, loaded: int
) -> None:
    """After the longest time of a push, 0.3 s, if the axis has been let go twice in it."""
    p, period = state_of(1e-2), 1e-2
    for _ in range(at.PAST):
        braking.remember(p, 0.0)
    holding.start_letting_go(p, MASS, 2.0)
    x = 0.0
    for k in range(round(0.3 / period)):
        if k in (5, 15)[:let_go]:
            x -= 20.0 * NOISE  # more than noise
        braking.remember(p, x)
        p.brake = 2.0  # no friction holds the axis
        holding.hold(p, MASS, 0.0, True)
    assert p.loaded == loaded


@pytest.mark.parametrize(
    ("one_way", "backward", "holds"),
    [(4, 0, False), (6, 0, True), (6, 1, False)],  # the last one goes on in its move
)
def test_a_braking_that_has_failed_for_longer_than_a_swing_is_a_hold(
    one_way: int, backward: int, holds: bool
) -> None:
    """Though the move had vibrated; 60 ms are six samples."""
    p, x = state_of(1e-2), 0.0
    p.shakes, p.way, p.misfit[:], p.backward = at.SHAKES, 0.01, 1e9, backward
    for k in range(at.KEPT):
        x -= 1e-3 if k > at.KEPT - 4 else 9e-4  # it does not become slower
        braking.remember(p, x)
    p.one_way, p.brakings, p.brake, p.braked_speed = one_way, 1, 1.0, 0.1
    p.moving = at.BRAKING
    braking.brake(p, MASS, FRICTION, True)
    assert (p.moving == at.HOLDING) == holds


@pytest.mark.parametrize(("step", "holds"), [(1e-6, True), (1e-3, False)])
@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_an_axis_that_creeps_under_its_effort_is_let_go_and_not_braked(
    step: float, holds: bool, side: float
) -> None:
    """It has moved, has stopped, and does not follow the plan; its last effort may hold a load."""
    p = state_of(1e-2)
    values, covariance = np.array([np.log(MASS), 0.0, -9.0, 0.0, -9.0, 0.0]), 0.01 * np.eye(6)
    moving.start_move(p, 0.0, side * 0.01, values, covariance)
    p.seen, p.open, p.wild, p.samples = 1, 0, moving.WILD + 1, 8
    for k in range(at.PAST):
        braking.remember(p, side * step * k)
    at.sent(p, side * 3.0)
    effort = moving.go_on(p, side * step * (at.PAST - 1), True)
    assert p.moving == (at.HOLDING if holds else at.BRAKING)
    assert effort == pytest.approx(side * 3.0 if holds else 0.0)


@pytest.mark.parametrize("load", [0.0, -2.0 * FRICTION])
def test_a_creeping_axis_is_stopped_without_a_swing(load: float) -> None:
    """It moves as fast as a creeping axis may, under an effort of which the load takes a part."""
    p, period = state_of(1e-2), 1e-2
    speed = 0.99 * np.sqrt(2.0 * FRICTION * 20.0 * p.bend / MASS)
    for k in range(-at.PAST, 1):
        braking.remember(p, speed * period * k)
    assert braking.creeps(p, MASS, FRICTION)
    x, v, effort, farthest = 0.0, speed, FRICTION - load, 0.0
    at.sent(p, effort)
    holding.start_holding_creeping(p, MASS, effort)
    effort = holding.hold(p, MASS, FRICTION, True)
    for _ in range(30):
        at.sent(p, effort)
        side = np.sign(v) if v != 0.0 else np.sign(effort + load)
        free = v != 0.0 or abs(effort + load) > FRICTION
        after = v + ((effort + load - side * FRICTION) * period / MASS if free else 0.0)
        after = 0.0 if v * after < 0.0 else after
        x, v = x + 0.5 * (v + after) * period, after
        braking.remember(p, x)
        effort = holding.hold(p, MASS, FRICTION, True) if p.moving == at.HOLDING else 0.0
        farthest = max(farthest, abs(x))
    assert p.swung == 0
    assert farthest < 2e-3


def test_another_target_lets_a_load_go_again() -> None:
    controller = precise(1e-2)
    state = controller.init()
    p = at.own_fields(state)
    p.moving, p.loaded, p.held, p.releases, p.as_given = at.HOLDING, 1, 3, 8, 1
    after = at.own_fields(controller.retargeted(state, -0.01))
    assert (after.loaded, after.held, after.releases, after.as_given) == (0, 0, 0, 0)
