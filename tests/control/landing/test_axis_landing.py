"""The landing of a single mass: random axes, targets, noise, and every reason."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from landing_runs import fly
from refusals import refuses

from stickslip.control import AxisLandingController, ExactPulseController, RestDetection
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import LearnedPulses, PositioningOutcome, SensorSample

T = 0.01
AXES = 18
BOUND = 1e-5  # of the way, without noise; 1e-8 is usual
NOISE = 1e-5  # of the way
DEVIATIONS = 3.0  # of a sample of the noise: the tolerance with noise
MOST = 16  # of 18 with noise: of a method that fails one time in 100, 999 of 1000 trials
LEARNED = 1e-4  # of friction along a way with stops in the middle of samples; 1e-5 is seen
LAW = CoulombViscousFriction.symmetric(
    coulomb_friction=100.0, viscous_friction=700.0, static_friction=130.0
)
AXIS = SingleMass(mass=150.0, friction=LAW)


def controller(
    axis: SingleMass[CoulombViscousFriction] = AXIS, *, guess: float = 0.5, **settings: Any
) -> AxisLandingController:
    """Return a controller with the mass, and a share of the friction as a first guess."""
    law = axis.friction
    values = {
        "coulomb_friction": guess * law.coulomb_friction_positive,
        "viscous_friction": guess * law.viscous_friction_positive,
    }
    usual: dict[str, Any] = {
        "sampling_time": T,
        "target": 0.3,
        "tolerance": 1e-6,
        "axis": replace(axis, friction=CoulombViscousFriction.symmetric(**values)),
        "effort_limit": 400.0,
        "estimator": EnergyEstimator(
            force_noise=0.0,
            inertia=axis.mass,
            offset=False,
            initial_values=values if guess else None,
        ),
    }
    return AxisLandingController(**(usual | settings))


def an_axis(generator: np.random.Generator) -> tuple[Any, float, float]:
    """Return an axis, the effort it may take, and a way there; masses over two decades."""
    m = 10.0 ** generator.uniform(0.0, 2.5)
    coulomb = m * generator.uniform(0.3, 1.3)
    static = coulomb * generator.uniform(1.0, 1.4)
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=coulomb,
        viscous_friction=m * generator.uniform(0.0, 10.0),
        static_friction=static,
    )
    way = generator.uniform(0.05, 0.5) * generator.choice([-1.0, 1.0])
    return SingleMass(mass=m, friction=law), static * generator.uniform(1.6, 4.0), float(way)


@pytest.mark.slow
def test_random_axes_land_there_and_on_the_next_target() -> None:
    generator = np.random.default_rng(2)
    for guess in np.repeat([0.0, 0.5, 1.5], AXES // 3):
        axis, limit, way = an_axis(generator)
        landing = controller(
            axis,
            guess=float(guess),
            target=way,
            tolerance=0.5 * BOUND * abs(way),
            effort_limit=limit,
        )
        second = -0.4 * way
        run = fly(axis, landing, (5.0, second), seconds=10.0)
        state, half = run.controller_state, round(5.0 / T)
        assert landing.outcome(state) is PositioningOutcome.REACHED
        assert abs(run.motion.position[half] - way) <= BOUND * abs(way)
        assert abs(run.motion.position[-1] - second) <= BOUND * abs(way)
        assert np.abs(run.motion.position).max() < 1.5 * abs(way)
        names = [phase.name for phase in state.phases]
        assert names == ["feedback", "pulses", "done"] * 2
        reasons = [phase.reason for phase in state.phases[:3]]
        assert reasons[0] == "the target is new"
        assert reasons[1].startswith(("the mass rests", "the mass did not come to rest"))
        assert reasons[2] == "the mass is within the tolerance"


@pytest.mark.slow
def test_random_axes_land_with_noise() -> None:
    generator = np.random.default_rng(3)
    landed = 0
    for k, guess in enumerate(np.repeat([0.0, 0.5, 1.5], AXES // 3)):
        axis, limit, way = an_axis(generator)
        noise = NOISE * abs(way)
        landing = controller(
            axis,
            guess=float(guess),
            target=way,
            tolerance=DEVIATIONS * noise,
            effort_limit=limit,
            position_noise=noise,
            velocity_noise=10.0 * noise,
            rest=RestDetection.for_encoder(resolution=1e-9 * noise, noise=noise, samples=10),
        )
        run = fly(axis, landing, seconds=5.0, noise=(noise, 10.0 * noise), seed=k)
        reached = landing.outcome(run.controller_state) is PositioningOutcome.REACHED
        # The place of rest is known to a third of a deviation or so
        error = abs(run.motion.position[-1] - way)
        landed += reached and error <= (DEVIATIONS + 1.0) * noise
    assert landed >= MOST


def test_the_estimate_goes_on_and_pulses_begin_with_it() -> None:
    landing = controller()
    run = fly(AXIS, landing, seconds=6.0)
    state = run.controller_state
    found, sure = landing.estimates(state), landing.deviations(state)
    assert found["coulomb_friction"] == pytest.approx(100.0, rel=LEARNED)
    assert found["viscous_friction"] == pytest.approx(700.0, rel=LEARNED)
    assert set(sure) == {"coulomb_friction", "viscous_friction"}
    assert found["coulomb_friction_positive"] == pytest.approx(100.0, rel=0.05)
    first = landing.estimates(landing.init())
    assert set(first) == set(found)
    assert first["coulomb_friction_positive"] == pytest.approx(50.0)
    assert landing.why(state) is None


def test_learned_values_are_those_of_the_pulses_and_are_resumed() -> None:
    landing = controller()
    state = fly(AXIS, landing, seconds=6.0).controller_state
    learned = LearnedPulses.from_dict(landing.learned(state).to_dict())
    assert learned.method == "exact"
    again = controller(guess=1.0).resumed(learned)
    assert again.learned(again.init()).values == pytest.approx(dict(learned.values))
    run = fly(AXIS, again, seconds=6.0)
    assert again.outcome(run.controller_state) is PositioningOutcome.REACHED
    pulses = ExactPulseController(
        sampling_time=T,
        target=0.3,
        tolerance=1e-6,
        rest=RestDetection(samples=1, spread=0.0, speed=0.0),
        effort_limit=400.0,
        mass=1.0,
        friction=LAW,
    )
    assert pulses.resumed(learned).experience is learned
    wrong = replace(learned, method="landing")
    with refuses("learned_otherwise", where="method", name="method"):
        controller().resumed(wrong)


def test_a_new_target_on_the_way_begins_anew() -> None:
    landing = controller()
    run = fly(AXIS, landing, (0.4, -0.1), seconds=6.0)
    state = run.controller_state
    assert landing.outcome(state) is PositioningOutcome.REACHED
    assert abs(run.motion.position[-1] + 0.1) <= 1e-6
    starts = [phase.start for phase in state.phases if phase.name == "feedback"]
    assert starts == pytest.approx([0.0, 0.4])


def test_a_mass_that_does_not_come_to_rest_is_left_to_the_pulses() -> None:
    shaking = 1e-3  # m; as an axis that never rests is seen
    landing = controller(wait_limit=0.5)
    state = landing.init()
    for k in range(300):
        place = 0.3 + shaking * (-1.0) ** k
        state, _ = landing.step(state, SensorSample(k * T, place, 0.0, np.nan, np.nan))
    names = [phase.name for phase in state.phases]
    assert names[:2] == ["feedback", "pulses"]
    assert "did not come to rest" in state.phases[1].reason


def test_pulses_do_not_wait_for_ever() -> None:
    landing = controller(wait_limit=0.5)
    state, effort = landing.init(), 1.0
    for k in range(900):  # a velocity that is never 0 is no rest
        place = 0.3 + 1e-3 * (-1.0) ** k
        state, effort = landing.step(state, SensorSample(k * T, place, 0.1, np.nan, np.nan))
    assert landing.why(state) == "the mass does not come to rest"
    assert state.phase.start - state.phases[-2].start == pytest.approx(10.0 * 0.5)
    assert effort == 0.0


def test_it_stops_where_no_pulse_can_help_and_says_why() -> None:
    landing = controller()
    state = landing.init()
    for k in range(2000):  # held fast, short of the target
        state, _ = landing.step(state, SensorSample(k * T, 0.299, 0.0, np.nan, np.nan))
    assert landing.outcome(state) is PositioningOutcome.STOPPED
    assert (
        landing.why(state)
        == "none of the last pulses has freed the axis: it is blocked, or a sensor is frozen"
    )
    _, effort = landing.step(state, SensorSample(20.0, 0.299, 0.0, np.nan, np.nan))
    assert effort == 0.0


def test_pulses_keep_to_their_longest_width() -> None:
    landing = controller(longest_width=0.02)
    state = fly(AXIS, landing, seconds=6.0).controller_state
    assert state.pulses is not None
    assert state.pulses.longest_width == 0.02
