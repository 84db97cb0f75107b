"""Random arms, how landings on them are scored, and what a reduced comparison must show."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from stickslip import CoulombViscousFriction, FlexibleArm
from stickslip.planning import PulseSeriesPlanner
from stickslip.records import SensorSample
from studies.van_de_wijdeven.conjunction.cases import BOUND, CASES, EXACT, NOISY, WRONG, Case
from studies.van_de_wijdeven.conjunction.contenders import (
    FASTEST,
    LANDING,
    LANDINGS,
    RIVALS,
    PIDTuning,
    ZeroVibrationTuning,
    landing_controller,
)
from studies.van_de_wijdeven.conjunction.random_arms import (
    EFFORT_LIMIT,
    SAMPLING_TIME,
    RandomArm,
    random_arms,
)
from studies.van_de_wijdeven.conjunction.scoring import (
    ARRIVAL,
    WATCH,
    Leg,
    MoveOutcome,
    landed_moves,
    rival_moves,
    score,
)
from studies.van_de_wijdeven.conjunction.study import landing_scores, shortest_times
from studies.van_de_wijdeven.records import LandingScore, Spread

pytestmark = pytest.mark.slow

ROUNDING = 1e-12  # of products and ratios of drawn numbers

REQUIRED, REQUIRED_NOISY = 0.99, 0.95
"""Shares of the arms that must land in at most four series, without and with noise."""

SURPRISE = 1e-3
"""Probability below which what is counted speaks against a share."""

QUICK_SEED = 81
"""Of which the first arm has a load that swings fast: its plans are short."""


def arms(n: int, seed: int = 11) -> list[RandomArm]:
    return random_arms(np.random.default_rng(seed), n)


@given(seed=st.integers(0, 2**32))
def test_every_arm_is_in_the_ranges_asked_for(seed: int) -> None:
    (drawn,) = arms(1, seed)
    arm, law, near = drawn.arm, drawn.arm.friction, 1.0 + ROUNDING
    coulomb, viscous = law.coulomb_friction_positive, law.viscous_friction_positive
    assert law == law.mirrored()
    for value, middle in (
        (arm.mass_1, 1.0),
        (arm.mass_2, 1.0),
        (arm.stiffness, 1.0),
        (coulomb, 0.1),
        (viscous, 0.1),
    ):
        assert 1.0 / 3.0 / near <= value / middle <= 3.0 * near
    assert 1.0 / near <= law.static_friction_positive / coulomb <= 1.3 * near
    assert drawn.effort_limit == EFFORT_LIMIT > 2.5 * law.static_friction_positive
    guessed = drawn.guessed_friction
    if guessed is not None:
        assert 0.5 / near <= guessed.coulomb_friction_positive / coulomb <= 1.5 * near
        assert 0.5 / near <= guessed.viscous_friction_positive / viscous <= 1.5 * near
        static = guessed.static_friction_positive / law.static_friction_positive
        assert 0.5 / near <= static <= 1.5 * near
    assert len(drawn.targets) == len(drawn.ways) == 2
    assert all(0.7 <= way <= 1.3 for way in drawn.ways)
    assert drawn.ways[1] == abs(drawn.targets[1] - drawn.targets[0])


def test_the_ranges_are_filled() -> None:
    drawn = arms(400)
    uniform = stats.uniform(-1.0, 2.0)
    for values in (
        [each.arm.mass_1 for each in drawn],
        [each.arm.mass_2 for each in drawn],
        [each.arm.stiffness for each in drawn],
        [each.arm.friction.coulomb_friction_positive / 0.1 for each in drawn],
        [each.arm.friction.viscous_friction_positive / 0.1 for each in drawn],
    ):
        logarithms = np.log(values) / np.log(3.0)
        assert stats.kstest(logarithms, uniform.cdf).pvalue > SURPRISE
    ways = [np.sign(np.diff((0.0, *each.targets))) for each in drawn]
    for k in (0, 1):
        forward = sum(each[k] > 0 for each in ways)
        assert stats.binomtest(forward, 400).pvalue > SURPRISE
    back = sum(each[0] != each[1] for each in ways)
    assert stats.binomtest(back, 400).pvalue > SURPRISE
    unknown = sum(each.guessed_friction is None for each in drawn)
    assert stats.binomtest(unknown, 400).pvalue > SURPRISE


def test_the_first_arms_do_not_depend_on_how_many_are_drawn() -> None:
    assert arms(5) == arms(20)[:5]
    assert len({each.seed for each in arms(20)}) == 20


def test_what_is_guessed_is_wrong_by_the_error() -> None:
    drawn = arms(200)
    assert all(EXACT.guessed(each) == NOISY.guessed(each) == each.arm for each in drawn)
    for name in ("mass_1", "mass_2", "stiffness"):
        ratios = np.array([getattr(WRONG.guessed(e), name) / getattr(e.arm, name) for e in drawn])
        assert np.allclose(np.abs(ratios - 1.0), 0.02, rtol=1e-9)
        assert stats.binomtest(int((ratios > 1.0).sum()), 200).pvalue > SURPRISE


def test_the_bound_follows_the_move_or_the_noise() -> None:
    assert EXACT.bound(1.2) == pytest.approx(1.2 * BOUND)
    assert NOISY.bound(1.2) == pytest.approx(3e-4)
    assert [case.name for case in CASES] == sorted({case.name for case in CASES}, key=[
        case.name for case in CASES].index)  # fmt: skip


@pytest.mark.parametrize("name", [*RIVALS, *LANDINGS])
def test_a_controller_is_made_from_what_is_guessed_alone(name: str) -> None:
    drawn = next(each for each in arms(10) if each.guessed_friction is not None)
    law = drawn.arm.friction
    other = replace(drawn, arm=replace(drawn.arm, mass_1=9.0, stiffness=9.0))
    guessed = drawn.arm

    class Informed(Case):
        def guessed(self, _: RandomArm) -> FlexibleArm:
            return guessed

    informed = Informed(name="informed")
    if name in LANDINGS:
        changed = replace(law, coulomb_friction_positive=1e-3)
        other = replace(other, arm=replace(other.arm, friction=changed))
        made = [landing_controller(each, informed, name) for each in (drawn, other)]
        assert made[0] == made[1]
        assert made[0].arm.friction == drawn.guessed_friction
        return
    made_for = [
        RIVALS[name](Leg(arm=each, case=informed, start=0.0, target=each.targets[0], learned=None))
        for each in (drawn, other)
    ]
    assert np.array_equal(made_for[0].init(), made_for[1].init(), equal_nan=True)


class Scripted:
    """Pushes as a list says, whatever it sees."""

    def __init__(self, efforts: list[float]) -> None:
        self._efforts = efforts

    def init(self) -> int:
        return 0

    def step(self, state: int, _sample: SensorSample) -> tuple[int, float]:
        return state + 1, self._efforts[state] if state < len(self._efforts) else 0.0


SIMPLE = RandomArm(
    arm=FlexibleArm(
        mass_1=1.0,
        mass_2=1.0,
        stiffness=1.0,
        friction=CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=0.1),
    ),
    guessed_friction=None,
    targets=(1.0, 0.0),
    effort_limit=1.0,
    seed=1,
)


def planned(leg: Leg) -> Scripted:
    planner = PulseSeriesPlanner(arm=leg.arm.arm, sampling_time=SAMPLING_TIME, effort_limit=1.0)
    series = planner.plan((leg.start, 0.0, leg.start, 0.0), leg.target)
    return Scripted(series.effort.tolist())


def test_a_series_with_everything_known_lands_in_the_shortest_time() -> None:
    shortest = shortest_times(SIMPLE)
    assert shortest[0] == pytest.approx(shortest[1])
    for move, least in zip(rival_moves(SIMPLE, EXACT, planned), shortest, strict=True):
        assert move.landed
        assert max(move.error_1, move.error_2) < BOUND
        assert move.swing < BOUND
        assert move.time == pytest.approx(least, abs=0.1)
        assert move.farthest < 1e-3
        assert move.peak_effort == pytest.approx(1.0, rel=1e-5)
        assert (move.series, move.reported) == (None, None)


def test_what_stays_or_swings_on_has_not_landed() -> None:
    still = rival_moves(SIMPLE, EXACT, lambda _: Scripted([]))
    assert (still[0].error_1, still[0].error_2, still[0].swing) == (1.0, 1.0, 0.0)
    assert not still[0].landed
    assert still[0].time is None
    assert still[1].landed  # its target is where it has stayed
    assert still[1].time == 0.0
    # A push that leaves mass 2 swinging about mass 1, which sticks
    pushed = rival_moves(SIMPLE, EXACT, lambda _: Scripted([0.3] * 50))
    stuck = SIMPLE.arm.friction.static_friction_positive / SIMPLE.arm.stiffness
    assert 0.1 * stuck < pushed[0].swing <= 1.01 * stuck  # what is above ebbs away slowly
    assert pushed[0].error_2 == pytest.approx(pushed[0].error_1 + pushed[0].swing, rel=1e-4)


def test_a_push_while_it_is_watched_undoes_a_landing() -> None:
    late = round((ARRIVAL + 0.5 * WATCH) / SAMPLING_TIME)

    def disturbed(leg: Leg) -> Scripted:
        script = planned(leg)
        silence = [0.0] * (late - len(script._efforts))
        return Scripted([*script._efforts, *silence, *[0.5] * 5])

    first, _ = rival_moves(SIMPLE, EXACT, disturbed)
    assert not first.landed
    assert first.time is None


def test_a_score_counts_what_the_outcomes_say() -> None:
    good = MoveOutcome(
        error_1=1e-6, error_2=2e-6, swing=1e-6, landed=True, time=8.0, series=2, reported=True,
        farthest=0.1, peak_effort=0.9,
    )  # fmt: skip
    many = replace(good, series=5, time=20.0)
    lost = replace(
        good, landed=False, time=None, series=6, reported=False, error_2=0.1, farthest=0.4
    )
    wrong = replace(lost, reported=True)
    found = score("x", WRONG, [[good, good], [good, many], [good, lost], [wrong, good]],
                  [[4.0, 4.0]] * 4)  # fmt: skip
    assert (found.controller, found.case, found.arms, found.moves) == ("x", WRONG.name, 4, 8)
    assert (found.landed, found.landed_in_four, found.misjudged) == (0.5, 0.25, 0.125)
    assert found.time_ratio == Spread.of([2.0] * 5 + [5.0])
    assert found.series == Spread.of([2.0, 2.0, 2.0, 5.0, 2.0, 6.0, 6.0, 2.0])
    assert (found.error_2.worst, found.farthest, found.peak_effort) == (0.1, 0.4, 0.9)
    blind = replace(lost, series=None, reported=None)
    none = score("y", EXACT, [[blind]], [[4.0]])
    assert none.landed_in_four is none.series is none.misjudged is none.time_ratio is None


def test_what_was_tuned_keeps_to_its_limits() -> None:
    noisy = replace(NOISY, name="noisy")
    for case in (EXACT, noisy):
        for each in arms(20):
            leg = Leg(arm=each, case=case, start=0.0, target=1.0, learned=None)
            for name in ("zero vibration, friction known", "zero vibration, friction as guessed"):
                pd = RIVALS[name](leg).pd
                assert sqrt(pd.position_gain / each.arm.mass_1) < FASTEST
    tuning = PIDTuning(frequency=0.5, integral=0.2)
    made = tuning(Leg(arm=SIMPLE, case=EXACT, start=0.0, target=1.0, learned=None))
    # m s^3 + K_d s^2 + K_p s + K_i, the whole mass
    roots = np.roots([2.0, made.velocity_gain, made.position_gain, made.integral_gain])
    assert np.allclose(sorted(roots.real), [-0.5, -0.5, -0.1], rtol=1e-6)
    known = ZeroVibrationTuning(friction="known", frequency=5.0)
    leg = Leg(arm=SIMPLE, case=EXACT, start=0.0, target=1.0, learned=None)
    assert known(leg).arm.friction == SIMPLE.arm.friction


def quick_arms(n: int) -> list[RandomArm]:
    """Return those of twelve arms whose loads swing fastest: their plans are the shortest."""
    return sorted(arms(12), key=lambda each: each.arm.mass_2 / each.arm.stiffness)[:n]


def share_holds(found: LandingScore, share: float) -> bool:
    """Whether so many outside, or more, would not be too rare if the share were there."""
    outside = round(found.arms * (1.0 - found.landed_in_four))
    return bool(stats.binom.sf(outside - 1, found.arms, 1.0 - share) > SURPRISE)


@pytest.mark.parametrize(("case", "share"), [(EXACT, REQUIRED), (NOISY, REQUIRED_NOISY)])
def test_arms_land(case: Case, share: float) -> None:
    drawn = quick_arms(3)
    moves = [landed_moves(each, case, landing_controller(each, case)) for each in drawn]
    found = score(LANDING, case, moves, [shortest_times(each) for each in drawn])
    assert share_holds(found, share)
    assert found.misjudged == 0.0
    assert found.peak_effort <= 1.0
    assert found.series.worst <= 4
    assert found.time_ratio.median > 1.0


def test_wrong_masses_and_a_wrong_spring_do_no_harm() -> None:
    (drawn,) = quick_arms(1)
    drawn = replace(drawn, targets=drawn.targets[:1])
    (move,) = landed_moves(drawn, WRONG, landing_controller(drawn, WRONG))
    assert max(move.error_1, move.error_2) < 0.05
    assert move.farthest < 1.0
    assert move.peak_effort <= 1.0
    assert move.reported == move.landed


def test_rivals_swing_on_or_miss_unless_all_is_known() -> None:
    drawn = arms(30)

    def tried(name: str, case: Case) -> LandingScore:
        moves = [rival_moves(each, case, RIVALS[name]) for each in drawn]
        return score(name, case, moves, [[1.0, 1.0]] * len(drawn))

    for name, case in (
        ("PD and notch", EXACT),
        ("PAPWC, as if rigid", EXACT),
        ("PID", EXACT),
        ("PID", NOISY),
        ("zero vibration, friction as guessed", EXACT),
        ("zero vibration, friction as guessed", NOISY),
        ("zero vibration, friction known", WRONG),
    ):
        found = tried(name, case)
        # So many landed, or fewer, would be too rare if the share asked for were there
        share = REQUIRED_NOISY if case is NOISY else REQUIRED
        landed = round(found.arms * found.landed)
        assert stats.binom.cdf(landed, found.arms, share) < SURPRISE, (name, case)
        assert found.peak_effort <= 1.0, name
    assert tried("zero vibration, friction known", EXACT).landed > 0.8


def test_the_study_depends_on_the_seed_alone() -> None:
    calls: list[None] = []
    cases = (EXACT,)
    one = landing_scores(1, QUICK_SEED, cases=cases, workers=1, advance=lambda: calls.append(None))
    assert len(calls) == 1
    names = [(each.controller, each.case) for each in one]
    assert names[0] == (LANDING, EXACT.name)
    assert len(set(names)) == len(names) == len(LANDINGS) + len(RIVALS)
    assert one == landing_scores(1, QUICK_SEED, cases=cases, workers=2, advance=lambda: None)
