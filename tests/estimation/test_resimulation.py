"""Any estimate held against its log: the effort it leaves, and the motion it makes."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from two_sines import MIDDLE, TIME, Motion

from stickslip.estimation import (
    EnergyEstimator,
    ExtendedKalmanFilter,
    IdimLeastSquares,
    SelectedModelEstimator,
    replay,
    unexplained_effort,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, simulate

SAME = 1e-9  # relative; the same residual, once as the solver has it
EXACT_FIT = 0.999
LEFT = 0.05
"""Of the effort: low-pass and decimation smear the reversals of friction."""


@pytest.fixture(scope="module")
def log() -> AxisLog:
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0, offset=0.3)
    time = 0.002 * np.arange(5000)
    effort = 5.0 * np.sin(3.0 * time) + 3.0 * np.sin(7.1 * time)
    motion = simulate(SingleMass(mass=1.5, friction=law), effort, sampling_time=0.002)
    return Sensors(position_noise=1e-6, velocity="none").measure(motion, np.random.default_rng(4))


@pytest.mark.parametrize("per_direction", [False, True])
def test_what_idim_leaves_is_its_own_residual(log: AxisLog, per_direction: bool) -> None:
    estimate = IdimLeastSquares(per_direction=per_direction).fit(log)
    left = unexplained_effort(log, estimate)
    assert left == pytest.approx(estimate.diagnostics.relative_residual, rel=SAME)
    others = EnergyEstimator(per_direction=per_direction).fit(log)
    other = unexplained_effort(log, others)
    assert left is not None
    assert other is not None
    assert left <= other < LEFT  # least squares is least


def test_the_identified_axis_moves_as_the_true_one(log: AxisLog) -> None:
    again = replay(log, EnergyEstimator().fit(log))
    assert again is not None
    assert again.fit > EXACT_FIT


def test_a_mass_that_the_estimate_does_not_hold_is_needed(log: AxisLog) -> None:
    estimate = ExtendedKalmanFilter(inertia=1.5, offset=True).fit(log)
    assert replay(log, estimate) is None
    assert unexplained_effort(log, estimate) is None
    again = replay(log, estimate, inertia=1.5)
    assert again is not None
    assert again.fit > EXACT_FIT
    wrong = replay(log, estimate, inertia=3.0)
    assert wrong is not None
    assert wrong.fit < again.fit
    assert (unexplained_effort(log, estimate, inertia=1.5) or 1.0) < LEFT


def test_what_is_left_counts_every_term_of_the_estimate() -> None:
    """A spring, which the simulator lacks; without it half of the effort would be left."""
    acts = Motion(time=MIDDLE)
    effort = acts.effort() + 60.0 * acts.position
    sprung = axis_log(TIME, effort, Motion(time=TIME).position)
    estimate = SelectedModelEstimator().fit(sprung)
    assert "spring_stiffness" in estimate.parameters
    left = unexplained_effort(sprung, estimate)
    assert left is not None
    assert left < 0.01
    assert replay(sprung, estimate) is None
    # Lost samples are resampled, clipped ones are left out
    kept = np.random.default_rng(2).uniform(size=TIME.size) > 0.003
    uneven = replace(
        sprung,
        time=TIME[kept],
        effort=np.clip(effort[kept], -4.5, 4.5),
        measured_position=sprung.measured_position[kept],
    )
    again = unexplained_effort(uneven, estimate)
    assert again is not None
    assert again < 0.01


def test_what_is_not_identified_cannot_be_replayed(log: AxisLog) -> None:
    one_way = replace(log, effort=np.full(len(log), 5.0), measured_position=0.1 * log.time)
    estimate = EnergyEstimator().fit(one_way)
    assert replay(one_way, estimate) is None
    assert unexplained_effort(one_way, estimate) is None
