"""Both sides of the thresholds of pulse series: breakaway, rests on the way, and stops."""

from dataclasses import replace

import numpy as np
import pytest
from pulse_series import REST
from refusals import refuses

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import NoPulseSeriesError, PulseSeries, PulseSeriesPlanner, SeriesLimit
from stickslip.planning.move import Move
from stickslip.planning.rest import _holding, _stopped
from stickslip.plants import FlexibleArm

STATIC, OFFSET = 0.2, 0.03125
HELD = 0.9  # of static friction, at most, holds mass 1
CREEPS = 0.02  # of the highest velocity, below which mass 1 only creeps
ROUNDING = 1e-12
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=0.005, static_friction=STATIC, viscous_friction=0.1, offset=0.001
)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=LAW)
PLANNER = PulseSeriesPlanner(arm=ARM, sampling_time=0.05, effort_limit=1.0, rest_on_the_way=True)
WAYS = pytest.mark.parametrize("target", [1.0, -1.0])
SIDES = pytest.mark.parametrize(("side", "beyond"), [(0.999, False), (1.001, True)])


def planner_of(**friction: float) -> PulseSeriesPlanner:
    return replace(PLANNER, arm=replace(ARM, friction=replace(LAW, **friction)))


def resting(series: PulseSeries) -> tuple[np.ndarray, np.ndarray]:
    """Return the efforts of a rest, and the force of the spring at its samples."""
    assert series.rest is not None
    begin, end = (round(t / series.sampling_time) for t in series.rest)
    assert not series.velocity[begin : end + 1].any()
    spring = ARM.stiffness * (series.position - series.load_position)
    return series.effort[begin:end], spring[begin : end + 1]


@WAYS
@SIDES
def test_the_first_effort_exceeds_static_friction_and_the_offset(
    target: float, side: float, beyond: bool
) -> None:
    held = {1.0: STATIC + OFFSET, -1.0: 1.5 * STATIC - OFFSET}[target]
    planner = planner_of(static_friction_negative=1.5 * STATIC, offset=OFFSET)
    planner = replace(planner, effort_limit=held * side, excess=0.5)
    if beyond:
        series = planner.plan(REST, target)
        first = abs(float(series.effort[0]))
        assert held < first <= planner.effort_limit
        assert series.breakaway_margin == pytest.approx(first - held, abs=ROUNDING)
    else:
        with pytest.raises(NoPulseSeriesError) as refusal:
            planner.plan(REST, target)
        assert refusal.value.limit is SeriesLimit.BREAKAWAY


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_an_offset_up_to_static_friction_lets_mass_1_rest(direction: float) -> None:
    held = {"static_friction_negative": 0.5, "static_friction_positive": 0.25}
    most = 0.5 if direction > 0 else -0.25
    planner_of(**held, offset=most)
    with refuses("offset_moves_arm"):
        planner_of(**held, offset=np.nextafter(most, 2.0 * most))


@WAYS
def test_a_rest_is_held_in_the_middle_of_the_spring_force_and_the_offset(target: float) -> None:
    effort, spring = resting(planner_of(offset=OFFSET).plan(REST, target))
    middle = 0.5 * (spring[1:] + spring[:-1])  # it does not turn within a sample
    assert np.all(np.diff(spring) * target < 0.0)
    np.testing.assert_allclose(effort, middle + OFFSET, atol=ROUNDING)


@WAYS
@SIDES
@pytest.mark.parametrize("way", ["positive", "negative"])
def test_a_rest_takes_nine_tenths_of_static_friction(
    target: float, side: float, beyond: bool, way: str
) -> None:
    """An effort in the middle leaves half of what the spring force changes by in a sample."""
    series = PLANNER.plan(REST, target)
    _, spring = resting(series)
    push = 0.5 * float(np.abs(np.diff(spring)).max())
    weaker = planner_of(**{f"static_friction_{way}": side * push / HELD})
    again = weaker.plan(REST, target, pulses=series.effort.size)
    if beyond:
        assert again.rest == series.rest
    elif again.rest is not None:  # a shorter one, where mass 2 is slower
        assert np.abs(np.diff(resting(again)[1])).max() < 2.0 * push


@SIDES
@pytest.mark.parametrize("way", [1.0, -1.0])
def test_each_static_friction_holds_against_one_way(side: float, beyond: bool, way: float) -> None:
    """A limit of 1 balances that much of the spring force; friction holds the rest."""
    law = replace(LAW, static_friction_positive=0.5, static_friction_negative=0.25, offset=OFFSET)
    static = 0.25 if way > 0.0 else 0.5
    move = move_of(law)
    force = way * (move.effort_limit + HELD * static * side) - law.offset
    states = np.zeros((3, 4))
    states[:, 0] = force / move.arm.stiffness
    held = _holding(move, states, 1)
    assert (held is None) == beyond
    if held is not None:
        np.testing.assert_array_equal(held, [way, way])


@pytest.mark.parametrize(("side", "rests"), [(0.9, True), (1.1, False)])
def test_mass_1_creeps_below_a_fiftieth_of_its_highest_velocity(side: float, rests: bool) -> None:
    pulses = 95
    mean = 1.0 / (pulses * PLANNER.sampling_time)
    plain = replace(PLANNER, rest_on_the_way=False, slowest=0.05).plan(REST, 1.0, pulses=pulses)
    slowest = side * CREEPS * float(plain.velocity.max()) / mean
    series = replace(PLANNER, slowest=slowest).plan(REST, 1.0, pulses=pulses)
    assert (series.rest is not None) == rests


def move_of(law: CoulombViscousFriction, stiffness: float = 1.0) -> Move:
    return Move(
        arm=FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=stiffness, friction=law),
        sampling_time=1.0,
        pulse_samples=1,
        effort_limit=1.0,
        slowest=1e-3,
        start=REST,
        travel=1.0,
    )


@pytest.mark.parametrize(
    ("efforts", "stops"),
    [
        ((0.649, 0.649), True),  # to stop takes 3 F - 2 u, -0.998
        ((0.651, 0.651), False),  # and here -1.002, above the limit
        ((0.6, -0.399), True),  # v = 0.001 before the last pulse
        ((0.6, -0.401), False),  # v = -0.001: mass 1 has turned back
    ],
)
def test_mass_1_stops_within_the_limit_and_without_turning_back(
    efforts: tuple[float, float], stops: bool
) -> None:
    """A mass of 1, pushed for 1 s against F = 0.1; the spring is as good as none."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.0)
    move = move_of(law, stiffness=1e-12)
    found = _stopped(move, move.programme(4), np.array([*efforts, 0.0]))
    assert (found is not None) == stops
    if found is not None:
        np.testing.assert_allclose(found, [*efforts, 0.3 - sum(efforts)], atol=1e-9)
