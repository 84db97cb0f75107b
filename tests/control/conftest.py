"""The loops that the tests of controllers share: the surrogate arm, and the axis of part B."""

from collections.abc import Callable

import pytest
from pulse_runs import PulseRun, run_pulses

from stickslip.control import (
    PD,
    FeedbackController,
    FrictionCompensation,
    Move,
    Notch,
    OnlineFriction,
    PointToPoint,
    PulseController,
)
from stickslip.estimation import EnergyEstimator
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass

SAMPLING_TIME = 0.01
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)


@pytest.fixture(scope="session")
def arm() -> FlexibleArm:
    return FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=LAW)


@pytest.fixture(scope="session")
def controller() -> FeedbackController:
    """The feedback loop of the surrogate arm, with its friction known."""
    return FeedbackController(
        sampling_time=SAMPLING_TIME,
        pd=PD(position_gain=1.5, velocity_gain=2.5),
        notch=Notch.at_resonance(mass_1=1.0, mass_2=1.0, stiffness=1.0, depth=0.5, damping=0.4),
        compensation=FrictionCompensation(friction=LAW),
        inertia=2.0,
        effort_limit=2.0,
        reference=PointToPoint(
            moves=(
                Move(target=1.5, duration=5.0, dwell=0.5),
                Move(target=-1.0, duration=7.0, dwell=0.5),
                Move(target=0.5, duration=5.0, dwell=0.5),
                Move(target=0.0, duration=5.0),
            )
        ),
    )


@pytest.fixture(scope="session")
def online() -> OnlineFriction:
    """A running estimate of the arm's friction, of which the size is known beforehand."""
    estimator = EnergyEstimator(
        inertia=1.0, load_inertia=1.0, stiffness=1.0, offset=False, initial_variance=0.3**2
    )
    return OnlineFriction.of(estimator, sampling_time=SAMPLING_TIME, needs_load=True)


@pytest.fixture(scope="session")
def sliding_mass() -> SingleMass:
    """The axis of van de Wijdeven (2002), part B, Table 1."""
    friction = CoulombViscousFriction.symmetric(
        coulomb_friction=100.0, static_friction=130.0, viscous_friction=700.0
    )
    return SingleMass(mass=150.0, friction=friction)


@pytest.fixture(scope="session")
def consecutive_runs(
    sliding_mass: SingleMass,
) -> Callable[..., list[PulseRun]]:
    """Return a function that runs a controller so often, each time with what it has learned."""

    def run(
        controller: PulseController, count: int, *, keep_covariance: bool = True
    ) -> list[PulseRun]:
        done: list[PulseRun] = []
        for _ in range(count):
            done.append(
                run_pulses(sliding_mass, controller, sampling_time=SAMPLING_TIME, duration=2.0)
            )
            learned = controller.learned(done[-1].run.controller_state)
            controller = controller.resumed(learned, keep_covariance=keep_covariance)
        return done

    return run
