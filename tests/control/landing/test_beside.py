"""Plans of a landing that are made beside the loop."""

from typing import Any

import numpy as np
from landing_runs import Waited
from refusals import refuses

from stickslip.control import LandingController, PlannedBeside
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import PositioningOutcome
from stickslip.simulation import simulate_closed_loop

T, SECONDS = 0.02, 40.0
PLANNING = 0.4  # [s]
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=LAW)
SETTINGS: dict[str, Any] = {
    "sampling_time": T,
    "target": 1.0,
    "tolerance": 1e-5,
    "arm": ARM,
    "effort_limit": 2.0,
    "estimator": EnergyEstimator(inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False),
    "planning_time": PLANNING,
}


def landed(controller: Any) -> Any:
    return simulate_closed_loop(ARM, controller, sampling_time=T, samples=round(SECONDS / T))


def test_a_plan_beside_the_loop_is_that_of_a_simulated_planning_time() -> None:
    inside = LandingController(**SETTINGS)
    simulated = landed(inside)
    beside = PlannedBeside(**SETTINGS)
    threaded = landed(Waited(beside))
    np.testing.assert_array_equal(threaded.log.effort, simulated.log.effort)
    for controller, run in ((inside, simulated), (beside, threaded)):
        state = run.controller_state
        assert controller.outcome(state) is PositioningOutcome.REACHED
        series = [phase.start for phase in state.phases if phase.name == "series"]
        assert len(series) == len(state.flights) > 0
        # No effort between the request and the series
        quiet = slice(round((series[0] - PLANNING) / T) + 1, round(series[0] / T))
        assert not run.log.effort[quiet].any()


def test_a_late_plan_is_asked_for_anew() -> None:
    beside = PlannedBeside(**SETTINGS | {"planning_time": T})
    run = landed(Waited(beside, 7))
    state = run.controller_state
    assert beside.outcome(state) is PositioningOutcome.REACHED
    assert state.request_count > len(state.flights) + 1


def test_planning_beside_takes_time() -> None:
    with refuses("no_planning_time"):
        PlannedBeside(**SETTINGS | {"planning_time": 0.0})
