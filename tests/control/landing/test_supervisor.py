"""Common part of both landings: settings, gaps, and the clock of each phase.

The clock is tested on samples whose times are exact in binary.
"""

from collections.abc import Callable
from dataclasses import replace
from math import ceil
from typing import Any

import numpy as np
import pytest
from refusals import refuses

from stickslip.control import AxisLandingController, LandingController
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import PositioningOutcome, SensorSample

T = 1.0 / 128.0
LIMIT = 16  # samples that the mass may take to come to rest after the reference
SETTLED = 5  # samples at rest
SMOOTHED = 80  # samples at rest that an arm's plan waits for beyond the limit
STARTS = [0.0, 4.0]
LAW = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=2.0)
AXIS = AxisLandingController(
    sampling_time=T,
    target=0.5,
    tolerance=1e-3,
    axis=SingleMass(mass=1.0, friction=LAW),
    effort_limit=10.0,
    estimator=EnergyEstimator(inertia=1.0, offset=False),
    wait_limit=LIMIT * T,
)
ARM = LandingController(
    sampling_time=T,
    target=0.5,
    tolerance=1e-3,
    arm=FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=100.0, friction=LAW),
    effort_limit=10.0,
    estimator=EnergyEstimator(inertia=1.0, load_inertia=1.0, stiffness=100.0, offset=False),
    wait_limit=LIMIT * T,
)


def rests(k: int) -> float:
    return 0.0


def moves(k: int) -> float:
    """Return another position in each sample [m]."""
    return 1e-3 * (k % 2)


def steps(
    landing: Any, start: float, position: Callable[[int], float], samples: int, state: Any = None
) -> tuple[Any, list[float]]:
    """Return the state after samples of a driven mass at given positions, and the efforts."""
    state, efforts = landing.init() if state is None else state, []
    for k in range(samples):
        x = position(k)
        sample = SensorSample(
            time=start + k * T,
            measured_position=x,
            measured_velocity=0.0,
            measured_load_position=x,
            measured_load_velocity=0.0,
        )
        state, effort = landing.step(state, sample)
        efforts.append(effort)
    return state, efforts


def reference_samples(landing: Any) -> int:
    """Return with which sample the reference of the feedback has ended."""
    (move,) = steps(landing, 0.0, rests, 1)[0].feedback.reference.moves
    return ceil(move.duration / T)


@pytest.mark.parametrize("landing", [AXIS, ARM])
def test_the_efforts_do_not_depend_on_when_it_begins(landing: Any) -> None:
    runs = [steps(landing, start, rests, 40)[1] for start in STARTS]
    np.testing.assert_array_equal(*runs)
    assert np.ptp(runs[0]) > 0.1


@pytest.mark.parametrize("start", STARTS)
def test_feedback_ends_with_its_reference_if_the_mass_rests(start: float) -> None:
    last = reference_samples(AXIS)
    before, _ = steps(AXIS, start, rests, last)
    assert [phase.start for phase in before.phases] == [start]
    after, _ = steps(AXIS, start, rests, last + 1)
    assert [phase.name for phase in after.phases] == ["feedback", "pulses"]
    assert after.phase.start == start + last * T


@pytest.mark.parametrize("start", STARTS)
def test_feedback_ends_with_the_fifth_sample_at_rest(start: float) -> None:
    first = reference_samples(AXIS) + 3

    def position(k: int) -> float:
        return moves(k) if k < first else 1.0

    assert len(steps(AXIS, start, position, first + SETTLED - 1)[0].phases) == 1
    state, _ = steps(AXIS, start, position, first + SETTLED)
    assert state.phase.start == start + (first + SETTLED - 1) * T


@pytest.mark.parametrize("start", STARTS)
def test_feedback_ends_at_the_wait_limit_if_the_mass_moves(start: float) -> None:
    last = reference_samples(AXIS) + LIMIT
    assert len(steps(AXIS, start, moves, last)[0].phases) == 1
    state, _ = steps(AXIS, start, moves, last + 1)
    assert state.phase.start == start + last * T
    assert "did not come to rest" in state.phase.reason


@pytest.mark.parametrize("start", STARTS)
def test_a_new_target_begins_a_phase_with_a_clock_of_its_own(start: float) -> None:
    last = reference_samples(AXIS)
    state, _ = steps(AXIS, start, rests, last + 10)
    again = start + (last + 10) * T
    state = AXIS.retargeted(state, AXIS.target)
    assert len(state.phases) == 2
    before, _ = steps(AXIS, again, rests, last, state)
    assert [phase.name for phase in before.phases] == ["feedback", "pulses", "feedback"]
    assert before.phase.start == again
    after, _ = steps(AXIS, again, rests, last + 1, state)
    assert after.phase.start == again + last * T


@pytest.mark.parametrize("start", STARTS)
def test_an_arm_stops_when_its_driven_mass_does_not_come_to_rest(start: float) -> None:
    resting = reference_samples(ARM) + LIMIT
    stopped = resting + LIMIT + SMOOTHED
    before, _ = steps(ARM, start, moves, stopped)
    assert [phase.name for phase in before.phases] == ["feedback", "resting"]
    assert before.phase.start == start + resting * T
    after, _ = steps(ARM, start, moves, stopped + 1)
    assert after.phase.name == "stopped"
    assert after.phase.start == start + stopped * T


@pytest.mark.parametrize("start", STARTS)
def test_an_arm_plans_with_the_eightieth_sample_of_a_resting_phase(start: float) -> None:
    """The samples at rest of the feedback phase do not count."""
    planned = reference_samples(ARM) + SMOOTHED
    before, _ = steps(ARM, start, rests, planned)
    assert [phase.name for phase in before.phases] == ["feedback", "resting"]
    after, _ = steps(ARM, start, rests, planned + 1)
    assert len(after.phases) == 3
    assert after.phase.start == start + planned * T


BOTH = pytest.mark.parametrize("landing", [AXIS, ARM], ids=["axis", "arm"])
SHARED = [
    ({"sampling_time": 0.0}, "not_positive"),
    ({"tolerance": -1e-5}, "not_positive"),
    ({"target": np.inf}, "not_finite"),
    ({"target": np.nan}, "not_finite"),
    ({"effort_limit": 0.0}, "not_positive"),
    ({"effort_limit": 1.0}, "effort_below_breakaway"),
    ({"position_noise": -1.0}, "negative"),
    ({"velocity_noise": np.nan}, "not_finite"),
    ({"wait_limit": 0.0}, "not_positive"),
]


@pytest.mark.parametrize(
    ("landing", "settings", "code"),
    [
        *((landing, *row) for landing in (AXIS, ARM) for row in SHARED),
        (AXIS, {"mass_uncertainty": -0.1}, "negative"),
        (AXIS, {"longest_width": 1e-4}, "pulse_below_sample"),
        (ARM, {"most_series": 0}, "not_whole"),
    ],
)
def test_settings_out_of_range_are_rejected(
    landing: Any, settings: dict[str, float], code: str
) -> None:
    with refuses(code, of=settings):
        replace(landing, **settings)


@BOTH
def test_a_sample_with_a_gap_changes_nothing(landing: Any) -> None:
    state, _ = steps(landing, 0.0, rests, 20)
    for channel in range(1, 5 if landing is ARM else 3):
        values = [20 * T, 0.0, 0.0, 0.0, 0.0]
        values[channel] = np.nan
        after, effort = landing.step(state, SensorSample(*values))
        assert after is state
        assert np.isnan(effort)


@BOTH
def test_before_it_has_moved_nothing_is_learned(landing: Any) -> None:
    state = landing.init()
    assert landing.outcome(state) is PositioningOutcome.MOVING
    with refuses("nothing_learned"):
        landing.learned(state)
    with refuses("not_finite", name="target"):
        landing.retargeted(state, np.nan)
