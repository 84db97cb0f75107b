"""How much work a search takes, how much longer a quick series is, and what needs no search."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from pulse_series import ARM, LAW, REST, State, ends
from scipy import optimize

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import NoPulseSeriesError, PulseSeries, PulseSeriesPlanner, SeriesLimit
from stickslip.planning.move import swing_time
from stickslip.plants import FlexibleArm

EXACTLY = PulseSeriesPlanner(arm=ARM, sampling_time=0.02, effort_limit=1.0)
EXCESS = 0.1
ROUNDING = 1e-9  # of the way, over some hundred samples
MOST_PROGRAMMES, MOST_ENTRIES = 150, 8e6  # twice what hundreds of random requests took
QUICK_PROGRAMMES, QUICK_ENTRIES = 40, 1e6  # likewise


class Counted:
    """Programmes solved, and entries of their matrices."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.programmes, self.entries = 0, 0
        solve = optimize.linprog

        def counted(*args: object, **options: object) -> object:
            self.programmes += 1
            self.entries += np.asarray(options["A_ub"]).size
            return solve(*args, **options)  # type: ignore[arg-type]

        monkeypatch.setattr(optimize, "linprog", counted)


def requests(seed: int, n: int) -> list[tuple[PulseSeriesPlanner, State, float]]:
    """Return random arms, ways and swings."""
    generator = np.random.default_rng(seed)
    made = []
    for _ in range(n):
        mass_1, mass_2, stiffness, coulomb, viscous = 3.0 ** generator.uniform(-1.0, 1.0, 5)
        law = CoulombViscousFriction.symmetric(
            coulomb_friction=0.1 * coulomb,
            viscous_friction=0.1 * viscous,
            static_friction=0.1 * coulomb * generator.uniform(1.0, 1.3),
        )
        arm = FlexibleArm(mass_1=mass_1, mass_2=mass_2, stiffness=stiffness, friction=law)
        way = 10.0 ** generator.uniform(-4.0, 0.0)
        swing = 0.8 * way * generator.uniform() * cmath.exp(2j * math.pi * generator.uniform())
        state = (0.0, 0.0, swing.real, swing.imag * math.sqrt(stiffness / mass_2))
        made.append((replace(EXACTLY, arm=arm), state, way))
    return made


def plan_or_none(planner: PulseSeriesPlanner, state: State, way: float) -> PulseSeries | None:
    try:
        return planner.plan(state, way)
    except NoPulseSeriesError:
        return None


@pytest.mark.slow
def test_a_quick_series_is_little_longer_and_lands_as_exactly(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = proven = 0
    for planner, state, way in requests(3, 14):
        shortest = plan_or_none(planner, state, way)
        with monkeypatch.context() as patch:
            counted = Counted(patch)
            quick = plan_or_none(replace(planner, excess=EXCESS, impulse_gap=0.3), state, way)
        assert (quick is None) == (shortest is None)
        if quick is None or shortest is None:
            continue
        found += 1
        assert counted.programmes <= QUICK_PROGRAMMES
        assert counted.entries <= QUICK_ENTRIES
        assert shortest.least_duration <= shortest.duration <= quick.duration
        assert quick.least_duration <= shortest.duration
        if math.isclose(shortest.least_duration, shortest.duration):
            proven += 1
            assert quick.duration <= (1.0 + EXCESS) * shortest.duration
        for series in (quick, shortest):
            assert np.abs(ends(series, planner.arm, state)).max() < ROUNDING * way
            assert series.slowest > 0.0
    assert found > 8
    assert proven > 0.7 * found


@pytest.mark.slow
def test_every_search_takes_a_bounded_amount_of_work(monkeypatch: pytest.MonkeyPatch) -> None:
    hard = [(EXACTLY, REST, way) for way in (1e-5, 1e-4)]
    for planner, state, way in [*requests(4, 5), *hard]:
        with monkeypatch.context() as patch:
            counted = Counted(patch)
            first = plan_or_none(planner, state, way)
        assert counted.programmes <= MOST_PROGRAMMES
        assert counted.entries <= MOST_ENTRIES
        if first is not None:
            np.testing.assert_array_equal(planner.plan(state, way).effort, first.effort)


@pytest.mark.parametrize(
    ("state", "way", "limit"),
    [
        # Mass 2 swings farther than mass 1 may go.
        ((0.0, 0.0, 0.11, 0.0), 0.1, SeriesLimit.DIRECTION),
        ((0.0, 0.0, 0.0, 0.3), 0.1, SeriesLimit.DIRECTION),
        # Static friction is so much larger that mass 1, once freed, goes too far at any effort.
        (REST, 1e-6, SeriesLimit.BREAKAWAY),
    ],
)
def test_what_is_hopeless_is_refused_without_a_search(
    state: State, way: float, limit: SeriesLimit, monkeypatch: pytest.MonkeyPatch
) -> None:
    law = replace(LAW, static_friction_positive=0.12)
    counted = Counted(monkeypatch)
    with pytest.raises(NoPulseSeriesError) as refusal:
        replace(EXACTLY, arm=replace(ARM, friction=law)).plan(state, way)
    assert refusal.value.limit is limit
    assert counted.programmes <= 10


@pytest.mark.parametrize("mean", [0.0, 0.5 + 0.3j, -0.4 - 0.7j, 0.9j, -0.2 + 0.1j])
def test_the_swing_takes_as_long_as_an_arc_that_has_it_as_a_mean(mean: complex) -> None:
    """Whether weights on the arc's points have the mean is a linear programme of its own."""
    way, frequency = 0.3, math.sqrt(2.0)
    arm = replace(ARM, mass_1=0.7, stiffness=2.0)
    state = (0.0, 0.0, way * mean.real, way * mean.imag * frequency)
    angle = swing_time(arm, state, way) * frequency

    def reached(end: float) -> bool:
        angles = np.linspace(0.0, end, 2001)
        result = optimize.linprog(
            np.zeros(angles.size),
            A_eq=np.vstack([np.cos(angles), np.sin(angles), np.ones(angles.size)]),
            b_eq=[mean.real, mean.imag, 1.0],
        )
        return result.status == 0

    assert reached(angle * 1.001)
    assert not reached(angle * 0.999)


@pytest.mark.parametrize("state", [REST, (0.0, 0.0, 0.03, 0.05)])
def test_with_effort_in_plenty_only_the_swing_takes_time(state: State) -> None:
    strong = replace(EXACTLY, effort_limit=300.0, slowest=1e-4)
    series = strong.plan(state, 0.1)
    least = swing_time(ARM, state, 0.1)
    assert least < series.duration < least + 6 * EXACTLY.sampling_time
