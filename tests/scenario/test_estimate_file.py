"""What an estimate's file tells whoever begins with it."""

from pathlib import Path

import numpy as np
import pytest

from stickslip.friction import StribeckFriction
from stickslip.plants import SingleMass
from stickslip.records import Status
from stickslip.scenario import estimate_in
from stickslip.simulation import Sensors, simulate
from stickslip.tasks import identify, write_json

MASS = 1.5
CLOSE = 0.05  # relative, of ten seconds with little noise
T = 0.002


@pytest.mark.parametrize("stribeck", [False, True])
def test_a_mass_that_was_known_is_found_in_it(stribeck: bool, tmp_path: Path) -> None:
    law = StribeckFriction.symmetric(
        coulomb_friction=1.0, static_friction=1.6, viscous_friction=2.0, stribeck_velocity=0.05
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
