import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from refusals import refuses

from stickslip.control import Move, PointToPoint

ROUNDING = 1e-12
MOVES = st.lists(
    st.builds(
        Move,
        target=st.floats(-10.0, 10.0),
        duration=st.floats(0.1, 10.0),
        dwell=st.floats(0.0, 2.0),
    ),
    min_size=1,
    max_size=9,
)


def test_a_move_is_the_quintic_at_rest_at_both_ends():
    # The polynomial from its six conditions, not from its formula
    D, r0, r1 = 1.7, -0.4, 2.3
    powers = np.arange(6)
    conditions = np.zeros((6, 6))
    for row, (t, order) in enumerate([(t, k) for t in (0.0, D) for k in range(3)]):
        for n in powers[order:]:
            factor = np.prod(np.arange(n - order + 1, n + 1))
            conditions[row, n] = factor * t ** (n - order)
    law = np.polynomial.Polynomial(np.linalg.solve(conditions, [r0, 0, 0, r1, 0, 0]))
    t = np.linspace(0.0, D, 101)
    found = PointToPoint(moves=[Move(target=r1, duration=D)], start=r0).at(t)
    for order, name in enumerate(("position", "velocity", "acceleration")):
        expected = law.deriv(order)(t) if order else law(t)
        np.testing.assert_allclose(getattr(found, name), expected, rtol=0, atol=1e-11)


def test_the_largest_velocity_and_acceleration_are_those_documented():
    D, d = 2.0, 3.0
    found = PointToPoint(moves=[Move(target=d, duration=D)]).at(np.linspace(0, D, 200_001))
    assert found.velocity.max() == pytest.approx(15 / 8 * d / D, rel=1e-12)
    assert abs(found.acceleration).max() == pytest.approx(10 / np.sqrt(3) * d / D**2, rel=1e-9)


@given(moves=MOVES, start=st.floats(-5.0, 5.0), shares=st.lists(st.floats(-0.2, 1.2), min_size=5))
def test_any_moves_go_from_place_to_place_and_nowhere_else(moves, start, shares):
    profile = PointToPoint(moves=moves, start=start)
    begin, place = 0.0, start
    for move in profile.moves:
        end = begin + move.duration
        rest = profile.at([begin, end, end + 0.5 * move.dwell])
        np.testing.assert_allclose(
            rest.position, [place, move.target, move.target], rtol=0, atol=ROUNDING * 20
        )
        inside = profile.at(begin + np.linspace(0.01, 0.99, 33) * move.duration)
        low, high = sorted((place, move.target))
        assert np.all((inside.position >= low - 1e-9) & (inside.position <= high + 1e-9))
        assert np.all(np.sign(move.target - place) * inside.velocity >= 0)
        begin, place = end + move.dwell, move.target
    assert profile.duration == pytest.approx(begin)
    t = np.array(shares) * profile.duration
    at_once = profile.at(t).position
    np.testing.assert_array_equal(at_once, [profile.at(one).position[0] for one in t])


@given(moves=MOVES)
def test_velocity_and_acceleration_are_derivatives(moves):
    profile = PointToPoint(moves=moves)
    h = 1e-5
    t = np.linspace(0.0, profile.duration, 57)
    before, here, after = profile.at(t - h), profile.at(t), profile.at(t + h)
    slowest = min(move.duration for move in moves)
    jump = 60.0 * 20.0 / slowest**3 * h  # the jerk at the ends of a move, for half a difference
    for low, high in (("position", "velocity"), ("velocity", "acceleration")):
        slope = (getattr(after, low) - getattr(before, low)) / (2 * h)
        np.testing.assert_allclose(slope, getattr(here, high), rtol=0, atol=jump + 1e-8)


def test_it_rests_before_and_after():
    profile = PointToPoint(moves=[Move(target=1.0, duration=2.0)], start=-1.0)
    found = profile.at([-3.0, 0.0, 2.0, 99.0])
    assert found.position.tolist() == [-1.0, -1.0, 1.0, 1.0]
    assert not found.velocity.any()
    assert not found.acceleration.any()


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: PointToPoint(moves=[]), "no_move"),
        (
            lambda: PointToPoint(moves=[Move(target=1.0, duration=1.0)], start=np.inf),
            "not_finite",
        ),
        (lambda: Move(target=np.nan, duration=1.0), "not_finite"),
        (lambda: Move(target=1.0, duration=0.0), "not_positive"),
        (lambda: Move(target=1.0, duration=1.0, dwell=-1.0), "negative"),
    ],
)
def test_refuses_what_is_no_profile(make, code):
    with refuses(code):
        make()
