"""First guesses from the file of an estimate."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from stickslip.friction import StribeckFriction
from stickslip.plants import SingleMass
from stickslip.records import SCHEMA_VERSION, Status
from stickslip.scenario import (
    AXES,
    AXIS_CONTROLLERS,
    GuessTable,
    Scenario,
    SensorsTable,
    TaskTable,
    estimate_in,
    table_from,
)
from stickslip.simulation import Sensors, simulate
from stickslip.tasks import identify, write_json

AXIS = {"mass": 2.0, "coulomb_friction": 5.0, "viscous_friction": 10.0}
MASS = 1.5
CLOSE = 0.05  # relative, of ten seconds with little noise
T = 0.002


@pytest.mark.parametrize("stribeck", [False, True])
def test_a_mass_that_was_known_is_found_in_it(stribeck: bool, tmp_path: Path) -> None:
    law = StribeckFriction.symmetric(
        coulomb_friction=1.0,
        static_friction=1.6 if stribeck else 1.0,
        viscous_friction=2.0,
        stribeck_velocity=0.05,
    )
    time = T * np.arange(5000)
    effort = 2.5 * np.sin(np.pi * time) + np.sin(2.6 * np.pi * time)
    motion = simulate(SingleMass(mass=MASS, friction=law), effort, sampling_time=T)
    log = Sensors(position_noise=2e-5, velocity_noise=2e-3).measure(
        motion, np.random.default_rng(1)
    )
    estimate = identify(log, estimator="energy", inertia=MASS, stribeck=stribeck).estimate
    assert estimate.status is Status.OK
    path = tmp_path / "estimate.json"
    write_json(estimate.to_dict(), path)
    held = estimate_in(path, "linear")
    assert held.values["mass"] == (MASS, MASS)
    assert ("static_friction" in held.values) == stribeck
    if stribeck:
        assert held.values["static_friction"][0] == pytest.approx(1.6, rel=CLOSE)


def test_a_running_estimator_begins_with_values_and_covariance_of_the_log(tmp_path: Path) -> None:
    entry = {"std": 1.0, "unit": "N"}
    document = {
        "schema": SCHEMA_VERSION,
        "kind": "linear",
        "status": "ok",
        "parameters": {
            "mass": {"value": 2.0, "std": 0.1, "unit": "kg"},
            "coulomb_friction_positive": {"value": 4.0, **entry},
            "coulomb_friction_negative": {"value": 6.0, **entry},
            "offset": {"value": None, "unit": "N"},
            "viscous_friction": {"value": 10.0, "std": 1.0, "unit": "N s/m"},
        },
        # Of what was identified, in this order
        "covariance": [
            [0.01, 0.0, 0.0, 0.0],
            [0.0, 0.5, 0.1, -0.2],
            [0.0, 0.1, 0.7, -0.3],
            [0.0, -0.2, -0.3, 2.0],
        ],
    }
    (tmp_path / "estimate.json").write_text(json.dumps(document))

    def prior(**guess: Any) -> Any:
        built = Scenario(
            axis=table_from(AXES, AXIS, name="axis", kind="linear"),
            task=TaskTable(target=1.0, tolerance=1e-3, duration=4.0, sampling_time=0.01),
            sensors=SensorsTable(),
            controller=table_from(
                AXIS_CONTROLLERS,
                {"method": "landing", "effort_limit": 30.0},
                name="controller",
                kind="linear",
            ),
            guess=GuessTable(**guess),
        ).build(tmp_path)
        controller: Any = built.controller
        state = controller.init()
        assert controller.estimates(state)["viscous_friction"] == pytest.approx(
            guess.get("viscous_friction", 10.0)
        )
        return controller.estimator.covariance(state.estimator_state)

    drift = 0.05  # of friction since the log
    coulomb = (0.5 + 0.7 + 2.0 * 0.1) / 4.0 + (drift * 5.0) ** 2
    expected = [[2.0 + (drift * 10.0) ** 2, -0.25], [-0.25, coulomb]]
    np.testing.assert_allclose(prior(estimate="estimate.json"), expected)
    np.testing.assert_allclose(prior(**AXIS), np.diag([5.0**2, 2.5**2]))
    np.testing.assert_allclose(prior(**AXIS, friction_uncertainty=0.1), np.diag([1.0**2, 0.5**2]))
