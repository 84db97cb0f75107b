"""Series for an arm whose spring is damped and whose load has friction, on integrated equations."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import LoadLosses, PulseSeriesPlanner
from stickslip.plants import FlexibleArm

T = 0.02
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=0.15, viscous_friction=0.1, static_friction=0.18
)
ARM = FlexibleArm(mass_1=1.2, mass_2=0.8, stiffness=1.5, friction=LAW)
LOSSES = LoadLosses(damping=0.05, coulomb_friction=0.004, viscous_friction=0.01)
INTEGRATED = 1e-7  # of the move: tolerance of the integrator


@pytest.mark.parametrize(("target", "rests"), [(1.0, False), (-0.7, True)])
def test_both_masses_rest_on_the_target_with_losses(target: float, rests: bool) -> None:
    planner = PulseSeriesPlanner(
        arm=ARM,
        sampling_time=T,
        effort_limit=1.0,
        losses=LOSSES,
        excess=0.1,
        impulse_gap=0.3,
        rest_on_the_way=rests,
    )
    # Mass 2 moves along from the begin, as its Coulomb friction is planned with
    way = np.sign(target)
    start = (0.0, 0.0, 0.05 * way, 0.02 * way)
    series = planner.plan(start, target)
    d, dry, viscous = LOSSES
    held = (-1.0, -1.0) if series.rest is None else series.rest

    def rates(_: float, y: np.ndarray, u: float, resting: bool) -> list[float]:
        x1, v1, x2, v2 = y
        pull = ARM.stiffness * (x1 - x2) + d * (v1 - v2)
        on_load = (pull - viscous * v2 - dry * way) / ARM.mass_2
        on_drive = 0.0 if resting else (u - 0.15 * way - 0.1 * v1 - pull) / ARM.mass_1
        return [0.0 if resting else v1, on_drive, v2, on_load]

    y = np.array(start)
    for k, u in enumerate(series.effort):
        resting = held[0] - 1e-9 <= k * T < held[1] - 1e-9
        y = solve_ivp(rates, (0.0, T), y, args=(u, resting), rtol=1e-10, atol=1e-13).y[:, -1]
        assert np.abs(y[0] - series.position[k + 1]) < INTEGRATED
        assert np.abs(y[2] - series.load_position[k + 1]) < INTEGRATED
    np.testing.assert_allclose(y, [target, 0.0, target, 0.0], atol=INTEGRATED)
    assert np.all(way * series.velocity[1:-1] > -1e-9)
