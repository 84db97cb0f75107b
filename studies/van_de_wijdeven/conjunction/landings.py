"""Landings of the surrogate arm, there and back, with all that is looked at along them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from stickslip.control import Flight, LandingController, LandingState, Phase
from stickslip.estimation import EnergyEstimator
from stickslip.plants import FlexibleArm
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import SimulatedMotion, simulate_closed_loop
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.conjunction.cases import EXACT, NOISY, Case
from studies.van_de_wijdeven.conjunction.contenders import RIVALS
from studies.van_de_wijdeven.conjunction.random_arms import SAMPLING_TIME, RandomArm
from studies.van_de_wijdeven.conjunction.scoring import MoveOutcome, rival_moves
from studies.van_de_wijdeven.conjunction.setting import (
    EFFORT_LIMIT,
    TARGETS,
    TIME,
    unknown_friction,
)

FEEDBACK, RIGID = "PD and notch", "PAPWC, as if rigid"
"""Of the rivals, those that the source speaks of."""
_CASES = (EXACT, NOISY)
LANDING_PIECES = 2 * len(_CASES) + 2
"""Pieces of work of `gather_landings`."""

_NOTED = 10  # samples between two notes of the estimates


class Estimates(NamedTuple):
    """Guesses of friction at an instant [s, N, N s/m], with standard deviations."""

    time: float
    coulomb: float
    viscous: float
    coulomb_std: float
    viscous_std: float


@dataclass(frozen=True, kw_only=True)
class Landing:
    """A landing there and back."""

    case: Case  #: Its sensors.
    motion: SimulatedMotion  #: The truth.
    #: Of the controller, of both moves.
    phases: tuple[Phase, ...]
    flights: tuple[Flight, ...]
    estimates: tuple[Estimates, ...]  #: Along it.
    outcomes: tuple[PositioningOutcome, ...]  #: Of each move.

    @property
    def states(self) -> Float[np.ndarray, "n 4"]:
        """Positions and velocities of mass 1 and mass 2 [m, m/s], at each sample."""
        motion = self.motion
        columns = (motion.position, motion.velocity, motion.load_position, motion.load_velocity)
        return np.column_stack([each for each in columns if each is not None])

    def left(self, move: int) -> tuple[float, float]:
        """Return what a move leaves: the error of mass 1, and the swing of mass 2 about it [m]."""
        x1, _, x2, v2 = self.states[round((move + 1) * TIME / SAMPLING_TIME)]
        swing = np.hypot(x2 - x1, v2 * sqrt(surrogate.MASS_2 / surrogate.STIFFNESS))
        return float(x1 - TARGETS[move]), float(swing)

    def at(self, time: float) -> Estimates:
        """Return the guesses at an instant [s]."""
        return next(each for each in reversed(self.estimates) if each.time <= time)

    def of_move(self, move: int) -> tuple[Phase, ...]:
        """Return the phases of move 0 or 1."""
        begin = move * TIME - 0.5 * SAMPLING_TIME
        return tuple(each for each in self.phases if begin <= each.start < begin + TIME)


@dataclass(frozen=True, kw_only=True)
class LandingEvidence:
    """Measurements of landings."""

    #: Without and with sensor noise.
    exact: Landing
    noisy: Landing
    #: How far from the target the feedback of a landing leaves mass 1 when it is sent there itself,
    #: without and with noise [m].
    feedback_errors: tuple[float, ...]
    #: Errors of others after the first move, without noise, by name.
    rivals: Mapping[str, MoveOutcome]


class _Recorder:
    """The landing controller, sent to the next target when it is time, and what it estimates."""

    def __init__(self, controller: LandingController) -> None:
        self._controller = controller
        self.sampling_time = controller.sampling_time
        self._k = 0
        self.estimates: list[Estimates] = []
        self.outcomes: list[PositioningOutcome] = []

    def init(self) -> LandingState:
        """Return the state before the first sample."""
        return self._controller.init()

    def step(self, state: LandingState, sample: SensorSample) -> tuple[LandingState, float]:
        """Step the controller."""
        move, k = divmod(self._k, round(TIME / self.sampling_time))
        if k == 0 and move > 0:
            self.outcomes.append(self._controller.outcome(state))
            state = self._controller.retargeted(state, TARGETS[move])
        state, effort = self._controller.step(state, sample)
        if k % _NOTED == 0:
            value, std = self._controller.estimates(state), self._controller.deviations(state)
            names = ("coulomb_friction", "viscous_friction")
            self.estimates.append(
                Estimates(sample.time, *(of[name] for of in (value, std) for name in names))
            )
        self._k += 1
        return state, effort

    def end(self, state: LandingState) -> None:
        """Note how the last move has ended."""
        self.outcomes.append(self._controller.outcome(state))


def gather_landings(seed: int, advance: Callable[[], None]) -> LandingEvidence:
    """Land the arm, and let others try; ``advance`` is called `LANDING_PIECES` times."""
    landings: list[Landing] = []
    for case in _CASES:
        landings.append(_landing(case, seed))
        advance()
    feedback_errors: list[float] = []
    for case in _CASES:
        feedback_errors.append(_feedback_error(case, seed))
        advance()
    arm = RandomArm(
        arm=surrogate.surrogate_arm(),
        guessed_friction=None,
        targets=TARGETS[:1],
        effort_limit=EFFORT_LIMIT,
        seed=seed,
    )
    rivals: dict[str, MoveOutcome] = {}
    for name in (FEEDBACK, RIGID):
        (rivals[name],) = rival_moves(arm, EXACT, RIVALS[name])
        advance()
    exact, noisy = landings
    return LandingEvidence(
        exact=exact, noisy=noisy, feedback_errors=tuple(feedback_errors), rivals=rivals
    )


def _controller(case: Case) -> LandingController:
    """Return the landing controller, set to the first target."""
    true, way = surrogate.surrogate_arm(), abs(TARGETS[0])
    return LandingController(
        sampling_time=SAMPLING_TIME,
        target=TARGETS[0],
        tolerance=0.5 * case.bound(way),
        arm=FlexibleArm(
            mass_1=true.mass_1,
            mass_2=true.mass_2,
            stiffness=true.stiffness,
            friction=unknown_friction(),
        ),
        effort_limit=EFFORT_LIMIT,
        estimator=EnergyEstimator(
            force_noise=0.0,
            inertia=true.mass_1,
            load_inertia=true.mass_2,
            stiffness=true.stiffness,
            offset=False,
        ),
        position_noise=case.position_noise,
        velocity_noise=case.velocity_noise,
    )


def _feedback_error(case: Case, seed: int) -> float:
    """Return how far from the first target feedback alone brings mass 1 to rest [m]."""
    controller = _controller(case)
    feedback = controller.approach(0.0, TARGETS[0], controller.init().estimator_state)
    run = simulate_closed_loop(
        surrogate.surrogate_arm(),
        feedback,
        sampling_time=SAMPLING_TIME,
        samples=round(TIME / SAMPLING_TIME),
        sensors=case.sensors(),
        generator=np.random.default_rng(seed),
    )
    return abs(float(run.motion.position[-1]) - TARGETS[0])


def _landing(case: Case, seed: int) -> Landing:
    recorder = _Recorder(_controller(case))
    run = simulate_closed_loop(
        surrogate.surrogate_arm(),
        recorder,
        sampling_time=SAMPLING_TIME,
        samples=round(len(TARGETS) * TIME / SAMPLING_TIME),
        sensors=case.sensors(),
        generator=np.random.default_rng(seed),
    )
    state = run.controller_state
    recorder.end(state)
    return Landing(
        case=case,
        motion=run.motion,
        phases=state.phases,
        flights=state.flights,
        estimates=tuple(recorder.estimates),
        outcomes=tuple(recorder.outcomes),
    )
