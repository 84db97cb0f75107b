"""Pulse series of a flexible arm against the exact simulator, and an optimum found another way."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import uneven
from pulse_series import ARM, LAW, REST, State, ends, final_state, with_friction
from refusals import refuses

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import NoPulseSeriesError, PulseSeries, PulseSeriesPlanner, SeriesLimit
from stickslip.plants import FlexibleArm
from stickslip.simulation import simulate

PLANNER = PulseSeriesPlanner(arm=ARM, sampling_time=0.05, effort_limit=1.0)
ROUNDING = 1e-11  # of the move: some hundred samples, each with a rounding error of 1e-16 or so
PROVEN = 1.05  # the impulse over the least one: the planner aims at 1.02
REFERENCE = 5e-4  # of the move: half of the last digit with which the reference residuals are given


def check(series: PulseSeries, planner: PulseSeriesPlanner, state: State) -> None:
    """Check a series by what the simulator says of it and by every limit."""
    way = abs(series.target - state[0])
    distance, swing = ends(series, planner.arm, state)
    assert abs(distance) < ROUNDING * way
    assert swing < ROUNDING * way
    assert series.peak_effort <= planner.effort_limit
    assert series.breakaway_margin > 0
    assert series.slowest > 0
    assert series.least_impulse <= series.impulse * (1 + ROUNDING)
    moving = simulate(
        planner.arm, series.effort, sampling_time=planner.sampling_time, initial_state=state
    )
    # It breaks away at once and does not stick or turn back before the last sample.
    assert moving.event_mode[0] == series.direction
    assert moving.event_time[0] == 0.0
    assert np.all(moving.event_time[1:] > series.duration - planner.sampling_time)
    np.testing.assert_allclose(series.position, moving.position, atol=ROUNDING * way)
    np.testing.assert_allclose(series.load_position, moving.load_position, atol=ROUNDING * way)
    assert np.all(series.velocity[1:-1] * series.direction >= series.slowest)


@pytest.mark.parametrize(
    ("sampling_time", "samples", "pulses", "duration"),
    [
        (0.05, 1, 92, 4.6),
        (0.05, 10, 10, 5.0),
        (0.05, 20, 6, 6.0),
        (0.05, 30, 4, 6.0),
        (0.5, 1, 10, 5.0),
        (1.5, 1, 4, 6.0),
    ],
)
def test_the_shortest_times_are_those_of_the_reference_points(
    sampling_time: float, samples: int, pulses: int, duration: float
) -> None:
    planner = replace(PLANNER, sampling_time=sampling_time, pulse_samples=samples)
    series = planner.plan(REST, 1.0)
    assert series.amplitudes.size == pulses
    assert series.duration == pytest.approx(duration)
    check(series, planner, REST)
    if pulses > 4:
        with pytest.raises(NoPulseSeriesError):
            planner.plan(REST, 1.0, pulses=pulses - 1)


@pytest.mark.parametrize(
    ("error", "distance", "swing"),
    [(-0.01, 0.0049, 0.0020), (-0.05, 0.025, 0.0099)],
)
def test_too_little_friction_leaves_what_the_reference_says(
    error: float, distance: float, swing: float
) -> None:
    """Mass 1 then sticks nowhere on the way, so that the final error depends on the time only."""
    series = PLANNER.plan(REST, 1.0)
    found = ends(series, with_friction(0.1 * (1 + error)), REST)
    assert found[0] == pytest.approx(distance, abs=REFERENCE)
    assert found[1] == pytest.approx(swing, abs=REFERENCE)


@pytest.mark.parametrize(
    ("error", "distance", "swing"), [(0.01, 0.0020, 0.0005), (0.05, 0.011, 0.0023)]
)
def test_too_much_friction_leaves_about_what_the_reference_says(
    error: float, distance: float, swing: float
) -> None:
    """How far mass 1 gets before it sticks depends on the plan, so that only the size agrees."""
    series = replace(PLANNER, sampling_time=0.0046).plan(REST, 1.0, pulses=1000)
    found = ends(series, with_friction(0.1 * (1 + error)), REST)
    assert 0.5 * distance < -found[0] < 2.0 * distance
    assert 0.5 * swing < found[1] < 2.0 * swing


def test_each_series_leaves_a_small_part_of_what_it_had_to_go() -> None:
    true = with_friction(0.101)
    state, error = REST, 1.0
    for _ in range(2):
        series = PLANNER.plan(state, 1.0)
        effort = np.append(series.effort, np.zeros(20))
        state = final_state(simulate(true, effort, sampling_time=0.05, initial_state=state))
        before, error = error, abs(state[0] - 1.0)
        assert error < 0.01 * before


@pytest.mark.parametrize("target", [1.0, -1.0])
@pytest.mark.parametrize(
    "state", [(0.0, 0.0, 0.08, 0.0), (0.0, 0.0, -0.05, 0.2), (0.2, 0.0, 0.2, -0.6)]
)
def test_mass_2_may_swing_at_the_begin(state: State, target: float) -> None:
    check(PLANNER.plan(state, target), PLANNER, state)


def test_a_moving_mass_1_is_taken_over() -> None:
    state = (0.0, 0.3, -0.1, 0.2)
    series = PLANNER.plan(state, 1.5)
    distance, swing = ends(series, ARM, state)
    assert abs(distance) < 1.5 * ROUNDING
    assert swing < 1.5 * ROUNDING
    assert series.breakaway_margin == np.inf


def test_each_direction_has_its_own_friction() -> None:
    law = uneven(coulomb=(0.1, 0.2), static=(0.15, 0.22), viscous=(0.1, 0.3), offset=0.05)
    planner = replace(PLANNER, arm=replace(ARM, friction=law))
    times = []
    for target in (1.0, -1.0):
        series = planner.plan(REST, target)
        check(series, planner, REST)
        times.append(series.duration)
    mirrored = replace(planner, arm=replace(ARM, friction=law.mirrored()))
    assert [mirrored.plan(REST, target).duration for target in (-1.0, 1.0)] == times


factors = st.floats(1 / 3, 3.0)


@pytest.mark.slow
@settings(max_examples=15)
@given(
    masses=st.tuples(factors, factors),
    stiffness=factors,
    coulomb=factors,
    viscous=factors,
    static=st.floats(1.0, 1.3),
    target=st.floats(0.3, 3.0),
    forward=st.booleans(),
    longer=st.floats(1.0, 1.5),
)
def test_random_arms_come_to_rest_on_the_target(
    masses: tuple[float, float],
    stiffness: float,
    coulomb: float,
    viscous: float,
    static: float,
    target: float,
    forward: bool,
    longer: float,
) -> None:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=0.1 * coulomb,
        viscous_friction=0.1 * viscous,
        static_friction=0.1 * coulomb * static,
    )
    arm = FlexibleArm(mass_1=masses[0], mass_2=masses[1], stiffness=stiffness, friction=law)
    planner = replace(PLANNER, arm=arm)
    goal = target if forward else -target
    shortest = planner.plan(REST, goal)
    check(shortest, planner, REST)
    pulses = shortest.effort.size
    # More time never makes it impossible, and a sample less does.
    series = planner.plan(REST, goal, pulses=round(pulses * longer))
    check(series, planner, REST)
    if longer > 1.05:
        assert series.impulse <= series.least_impulse * PROVEN
    with pytest.raises(NoPulseSeriesError):
        planner.plan(REST, goal, pulses=pulses - 1)


def test_more_time_takes_less_effort() -> None:
    impulses = [PLANNER.plan(REST, 1.0, pulses=n).least_impulse for n in (93, 100, 120, 160)]
    assert impulses == sorted(impulses, reverse=True)


def test_a_finer_plan_proves_the_same_least_impulse() -> None:
    coarse = PLANNER.plan(REST, 1.0, pulses=100)
    fine = replace(PLANNER, impulse_gap=1e-3).plan(REST, 1.0, pulses=100)
    assert fine.impulse <= fine.least_impulse * 1.001 / 0.999
    assert coarse.least_impulse <= fine.impulse <= coarse.impulse * 1.001


@pytest.mark.parametrize(("target", "pulses"), [(1.0, 92), (-1.0, 94), (1.0, 100)])
def test_mass_1_rests_on_the_way(target: float, pulses: int) -> None:
    law = replace(LAW, static_friction_positive=0.12, static_friction_negative=0.13, offset=0.02)
    planner = replace(PLANNER, arm=replace(ARM, friction=law), rest_on_the_way=True)
    series = planner.plan(REST, target, pulses=pulses)
    distance, swing = ends(series, planner.arm, REST)
    assert abs(distance) < ROUNDING
    assert swing < ROUNDING
    assert series.peak_effort <= planner.effort_limit
    assert series.rest is not None
    motion = simulate(planner.arm, series.effort, sampling_time=0.05)
    begin, end = (round(t / 0.05) for t in series.rest)
    assert motion.stuck[begin + 1 : end + 1].all()
    assert np.all(motion.velocity * series.direction > -ROUNDING)
    np.testing.assert_allclose(series.position, motion.position, atol=ROUNDING)
    np.testing.assert_allclose(series.load_velocity, motion.load_velocity, atol=ROUNDING)


def test_a_rest_on_the_way_leaves_less_of_a_friction_error() -> None:
    planner = replace(PLANNER, sampling_time=0.01)
    weaker = with_friction(0.095)
    creeping, resting = (
        ends(replace(planner, rest_on_the_way=rest).plan(REST, 1.0), weaker, REST)
        for rest in (False, True)
    )
    assert abs(resting[0]) < 0.6 * abs(creeping[0])
    assert resting[1] < 0.4 * creeping[1]


@pytest.mark.parametrize(
    ("changes", "state", "target", "pulses", "limit", "code"),
    [
        ({}, REST, 1.0, 91, SeriesLimit.EFFORT, "series_needs_effort"),
        ({}, REST, 1.0, 3, SeriesLimit.PULSES, "series_too_short"),
        (
            {"effort_limit": 0.09},
            REST,
            1.0,
            None,
            SeriesLimit.BREAKAWAY,
            "series_cannot_break_away",
        ),
        ({}, (0.0, 0.0, -0.95, 0.0), 1.0, 100, SeriesLimit.BREAKAWAY, "series_cannot_break_away"),
        ({}, (0.0, 0.0, 0.0, 2.0), 0.5, 150, SeriesLimit.DIRECTION, "series_swings_too_far"),
    ],
)
def test_a_refusal_names_the_limit_that_binds(
    changes: dict[str, float],
    state: State,
    target: float,
    pulses: int | None,
    limit: SeriesLimit,
    code: str,
) -> None:
    with refuses(code, NoPulseSeriesError, limit=limit):
        replace(PLANNER, **changes).plan(state, target, pulses=pulses)


def test_the_effort_said_to_be_enough_is_enough() -> None:
    with refuses("series_needs_effort", NoPulseSeriesError, effort_unit="N") as refusal:
        PLANNER.plan(REST, 1.0, pulses=88)
    enough = refusal.value.quantities["effort"]
    stronger = replace(PLANNER, effort_limit=enough * 1.01)
    check(stronger.plan(REST, 1.0, pulses=88), stronger, REST)


@pytest.mark.parametrize(
    ("state", "target", "code"),
    [
        ((1.0, 0.0, 1.0, 0.0), 1.0, "on_the_target"),
        ((0.0, -0.1, 0.0, 0.0), 1.0, "away_from_target"),
        ((0.0, 0.0, np.nan, 0.0), 1.0, "not_finite"),
        (REST, np.inf, "not_finite"),
    ],
)
def test_a_request_that_makes_no_sense_is_refused(state: State, target: float, code: str) -> None:
    with refuses(code):
        PLANNER.plan(state, target)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"sampling_time": 0.0}, "not_positive"),
        ({"effort_limit": -1.0}, "not_positive"),
        ({"pulse_samples": 0}, "not_whole"),
        ({"slowest": 1.0}, "not_below"),
        ({"impulse_gap": 0.0}, "not_positive"),
        ({"excess": -0.1}, "negative"),
        *(({"excess": excess}, "not_finite") for excess in (np.inf, np.nan)),
        ({"arm": replace(ARM, friction=replace(LAW, offset=0.2))}, "offset_moves_arm"),
    ],
)
def test_settings_out_of_range_are_refused(changes: dict[str, object], code: str) -> None:
    with refuses(code, of=changes):
        replace(PLANNER, **changes)  # type: ignore[arg-type]
