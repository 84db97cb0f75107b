"""How near the target pulses can bring an axis, and what bounds it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import sqrt

import numpy as np
from jaxtyping import Float

from stickslip.control import ExactPulseController, RestDetection
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseLaw
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.simulation import PlantStepper
from stickslip.tasks.parallel import in_parallel
from studies.van_de_wijdeven.part_b.setting import (
    COULOMB_FRICTION,
    MASS,
    PULSE_EFFORT,
    SAMPLING_TIME,
    VISCOUS_FRICTION,
)
from studies.van_de_wijdeven.records import ResolutionScore

_WINDOW = 10  # samples in which rest is looked for
_LONGEST = 2000  # samples of a run, as many as the most pulses take
_GUESS = 0.3  # of the friction: the first guess is wrong by up to this part
_START = (0.5e-3, 20e-3)  # distance from the target [m]


@dataclass(frozen=True, kw_only=True)
class _Case:
    """Conditions of a cell of the study, as in `ResolutionScore`."""

    encoder_step: float = 1e-8
    static_ratio: float = 1.3
    friction_change: float = 0.0
    sampling_time: float = SAMPLING_TIME


_CASES = (
    *(_Case(static_ratio=ratio) for ratio in (1.05, 1.3, 1.5, 2.0)),
    *(_Case(encoder_step=step) for step in (1e-6, 1e-7, 1e-9)),
    *(_Case(friction_change=change) for change in (0.001, 0.01, 0.05)),
    *(_Case(friction_change=0.01, sampling_time=time) for time in (5e-3, 2e-3, 1e-3)),
)
"""Around one with an encoder of 10 nm and static friction 1.3 times the Coulomb friction."""


def resolution_scores(
    axes: int, seed: int, *, workers: int, advance: Callable[[], None]
) -> tuple[ResolutionScore, ...]:
    """Bring the mass of Table 1 as near to its target as its encoder resolves, in several cases.

    ``axes`` is the number of starts and first guesses in each case; ``workers`` cases are worked on
    at once; ``advance`` is called `resolution_pieces` times.
    """
    return tuple(
        in_parallel(
            [partial(_score, case, axes, seed) for case in _CASES],
            workers=workers,
            advance=advance,
        )
    )


def resolution_pieces() -> int:
    """Return how often `resolution_scores` calls ``advance``."""
    return len(_CASES)


def _score(case: _Case, axes: int, seed: int) -> ResolutionScore:
    generator = np.random.default_rng(seed)
    ends = [_one(case, generator) for _ in range(axes)]
    errors = np.array([error for error, _, _ in ends])
    law = PulseLaw.of(_plant(case.static_ratio))
    return ResolutionScore(
        encoder_step=case.encoder_step,
        static_ratio=case.static_ratio,
        friction_change=case.friction_change,
        sampling_time=case.sampling_time,
        axes=axes,
        smallest_step=float(law.smallest_displacement(case.sampling_time)),
        median_error=float(np.median(errors)),
        error_95=float(np.quantile(errors, 0.95)),
        within_a_step=float(np.mean(errors <= case.encoder_step)),
        median_pulses=float(np.median([pulses for _, pulses, _ in ends])),
        still_moving=sum(outcome is PositioningOutcome.MOVING for _, _, outcome in ends),
    )


def _plant(static_ratio: float, changes: Sequence[float] = (1.0, 1.0)) -> SingleMass:
    """Return the mass of Table 1 with another static friction, and changed friction each way."""
    up, down = changes
    coulomb = COULOMB_FRICTION
    return SingleMass(
        mass=MASS,
        friction=CoulombViscousFriction(
            coulomb_friction_positive=coulomb * up,
            coulomb_friction_negative=coulomb * down,
            static_friction_positive=coulomb * up * static_ratio,
            static_friction_negative=coulomb * down * static_ratio,
            viscous_friction_positive=VISCOUS_FRICTION,
            viscous_friction_negative=VISCOUS_FRICTION,
        ),
    )


def _one(case: _Case, generator: np.random.Generator) -> tuple[float, int, PositioningOutcome]:
    """Return the error at the end of one run, its pulses and its outcome.

    Friction is drawn anew for every pulse.
    """
    wrong = 1.0 + generator.uniform(-_GUESS, _GUESS, 2)
    target = float(generator.uniform(*_START) * generator.choice((-1.0, 1.0)))
    step = case.encoder_step
    controller = ExactPulseController(
        sampling_time=case.sampling_time,
        target=target,
        tolerance=step,
        rest=RestDetection.for_encoder(resolution=step, samples=_WINDOW),
        effort_limit=PULSE_EFFORT,
        mass=MASS,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=COULOMB_FRICTION * wrong[0],
            viscous_friction=VISCOUS_FRICTION * wrong[1],
            static_friction=COULOMB_FRICTION * wrong[0] * case.static_ratio,
        ),
        position_noise=step / sqrt(12.0),
    )
    state, advance = controller.init(), controller.step
    position, pulses = 0.0, 0
    stepper, plant_state = _anew(case, generator, position)
    for k in range(_LONGEST):
        measured = step * round(position / step)
        sample = SensorSample(k * case.sampling_time, measured, np.nan, np.nan, np.nan)
        state, effort = advance(state, sample)
        if controller.outcome(state) is not PositioningOutcome.MOVING:
            break
        if controller.pulse_count(state) != pulses:  # it rests: the next pulse finds other friction
            pulses = controller.pulse_count(state)
            stepper, plant_state = _anew(case, generator, position)
        plant_state, output = stepper.step(plant_state, effort)
        position = output[0]
    return abs(target - position), controller.pulse_count(state), controller.outcome(state)


def _anew(
    case: _Case, generator: np.random.Generator, position: float
) -> tuple[PlantStepper, tuple[float, ...]]:
    """Return the plant at rest with the friction of the next pulse."""
    changes: Float[np.ndarray, " 2"] = np.exp(case.friction_change * generator.standard_normal(2))
    stepper = PlantStepper(
        _plant(case.static_ratio, changes.tolist()), sampling_time=case.sampling_time
    )
    return stepper, stepper.init((position, 0.0))
