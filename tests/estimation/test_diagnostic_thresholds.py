"""Both sides of every threshold of the diagnostics, on rows made for it."""

from typing import Any

import numpy as np
import pytest

from stickslip.estimation.fit.diagnostics import (
    INVOLVED,
    LEAST_RANGE,
    LEAST_SHARE_OF_TRAVEL,
    LEAST_SIGNAL_TO_NOISE,
    LEAST_SPEED_VARIATION,
    POOR_FIT,
    cross_validation_residual,
    determined,
    hardly_moves,
    status_of,
    unidentifiable_reason,
)
from stickslip.estimation.fit.rows import MotionSummary, Regression
from stickslip.records import ParameterEstimate, Status

BELOW, ABOVE = 0.99, 1.01
SIDES = pytest.mark.parametrize(("side", "beyond"), [(BELOW, False), (ABOVE, True)])


def motion(**changes: float) -> MotionSummary:
    """Return what a good log excites, with changes."""
    good: dict[str, Any] = {
        "largest_speed": 1.0,
        "speed_noise": 1e-3,
        "position_range": 1.0,
        "position_noise": 1e-4,
        "forward_travel": 5.0,
        "backward_travel": 5.0,
        "speed_variation": 0.5,
    }
    return MotionSummary(**{**good, **changes})


def regression(**changes: Any) -> Regression:
    rows = np.random.default_rng(0).standard_normal((100, 2))
    plain: dict[str, Any] = {
        "kind": "linear",
        "names": ("viscous_friction", "coulomb_friction"),
        "time": np.arange(100.0),
        "target": rows @ [1.0, 2.0],
        "regressors": rows,
        "regressor_noise": np.zeros(2),
        "quantity": "effort",
        "motion": motion(),
        "samples": 100,
    }
    return Regression(**{**plain, **changes})


def parameter(name: str, value: float | None, interval: tuple[float, float] | None = None):
    std = None if interval is None else 0.1
    return ParameterEstimate(name=name, value=value, std=std, ci95=interval, unit="N")


def status(*parameters: ParameterEstimate, residual: float = 0.1, **more: Any) -> Status:
    left_out = more.pop("left_out", 0.1)
    return status_of(parameters, residual, left_out, regression(**more))


@SIDES
def test_a_column_counts_from_five_times_its_noise(side, beyond):
    rows = np.zeros((100, 2))
    rows[:50, 0], rows[50:, 1] = 1.0, 1.0
    rms = np.sqrt(0.5)
    noise = np.array([0.0, rms / (LEAST_SIGNAL_TO_NOISE * side)])
    assert bool(determined(rows, noise).mask(2)[1]) == beyond


@SIDES
def test_a_combination_counts_from_five_times_its_noise(side, beyond):
    # Orthogonal sum and difference of two columns; the difference has the smaller singular value
    angle = 0.3
    rows = np.array([[np.cos(angle), np.sin(angle)], [np.cos(angle), -np.sin(angle)]]).T
    weak = float(np.linalg.svd(rows, compute_uv=False)[-1])
    noise = weak / (LEAST_SIGNAL_TO_NOISE * side) / np.sqrt(2.0)
    found = determined(np.vstack([rows, np.zeros((0, 2))]), np.full(2, noise))
    assert bool(found.mask(2).all()) == beyond


@SIDES
def test_a_parameter_takes_part_from_one_per_cent_of_a_null_direction(side, beyond):
    # Three unit columns whose multiples close a triangle with sides a, b and b
    a = INVOLVED * side
    b = np.sqrt(0.5 * (1.0 - a**2))
    angle = np.arccos(-0.5 * a / b)  # between the short side and the next
    columns = np.array(
        [[1.0, np.cos(angle), np.cos(angle)], [0.0, np.sin(angle), -np.sin(angle)], [0.0] * 3]
    )
    np.testing.assert_allclose(columns @ [a, b, b], 0.0, atol=1e-15)
    assert bool(determined(columns, np.zeros(3)).mask(3)[0]) == (not beyond)


@SIDES
def test_speed_varies_from_five_per_cent_on(side, beyond):
    pair = ("coulomb_friction", "viscous_friction")
    found = motion(speed_variation=LEAST_SPEED_VARIATION * side)
    reason = unidentifiable_reason("coulomb_friction", pair, found)
    assert ("the speed varies by" in reason) == (not beyond)


@SIDES
@pytest.mark.parametrize("way", ["forward", "backward"])
def test_a_direction_counts_from_two_per_cent_of_the_travel(side, beyond, way):
    share, other = LEAST_SHARE_OF_TRAVEL * side, 5.0
    found = motion(**{f"{way}_travel": other * share / (1.0 - share)})
    side_name = {"forward": "positive", "backward": "negative"}[way]
    name = f"coulomb_friction_{side_name}"
    reason = unidentifiable_reason(name, (name,), found)
    assert (f"hardly moves in the {side_name} direction" in reason) == (not beyond)
    pair = ("coulomb_friction", "offset")
    one_way = "moves one way only" in unidentifiable_reason("offset", pair, found)
    assert one_way == (not beyond)


@SIDES
def test_an_axis_moves_from_thirty_noises_on(side, beyond):
    found = motion(position_range=LEAST_RANGE * 1e-4 * side)
    assert hardly_moves(found) == (not beyond)
    expected = Status.OK if beyond else Status.INSUFFICIENT_EXCITATION
    assert status(parameter("offset", 1.0), motion=found) is expected


@SIDES
@pytest.mark.parametrize("which", ["residual", "left_out"])
def test_a_fit_is_poor_from_half_of_the_signal_on(side, beyond, which):
    found = status(parameter("offset", 1.0), **{which: POOR_FIT * side})
    assert found is (Status.POOR_FIT if beyond else Status.OK)


@pytest.mark.parametrize(
    ("name", "interval", "expected"),
    [
        ("coulomb_friction", (-0.3, -1e-9), Status.UNPHYSICAL),
        ("coulomb_friction", (-0.3, 1e-9), Status.OK),
        ("offset", (-0.3, -0.1), Status.OK),  # may be negative
        ("mass", (-0.1, 0.3), Status.OK),
    ],
)
def test_an_interval_below_zero_is_unphysical(name, interval, expected):
    assert status(parameter(name, 0.1, interval)) is expected


@pytest.mark.parametrize(("value", "expected"), [(0.0, False), (1e-12, True)])
@pytest.mark.parametrize("name", ["mass", "inertia"])
def test_an_inertia_is_above_zero(name, value, expected):
    assert (status(parameter(name, value, (-1.0, 1.0))) is Status.OK) == expected


def test_what_is_missing_goes_before_what_is_biased():
    known, missing = parameter("offset", 1.0), parameter("mass", None)
    assert status(known, biased=True) is Status.BIASED
    assert status(known, missing, biased=True) is Status.NOT_IDENTIFIABLE
    assert status(known, biased=False) is Status.OK


@pytest.mark.parametrize(("rows", "given"), [(19, False), (20, True)])
def test_cross_validation_needs_four_rows_a_fifth(rows, given):
    short = regression(
        time=np.arange(float(rows)),
        target=regression().target[:rows],
        regressors=regression().regressors[:rows],
    )
    assert (cross_validation_residual(short) is not None) == given
