"""Series of pulses by themselves: their shortest durations, and what wrong friction leaves."""

from collections.abc import Callable
from dataclasses import dataclass
from math import hypot

import numpy as np

from stickslip.estimation import EnergyEstimator
from stickslip.planning import NoPulseSeriesError, PulseSeries, PulseSeriesPlanner
from stickslip.simulation import SimulatedMotion, simulate
from stickslip.tasks import surrogate
from studies.van_de_wijdeven.conjunction.setting import (
    FRICTION,
    MOVE,
    REFERENCE_LIMIT,
    REFERENCE_TIME,
    reference_arm,
)
from studies.van_de_wijdeven.records import FrictionErrorEffect, ReferenceSeries, SuccessiveSeries

_REST = (0.0, 0.0, 0.0, 0.0)
_AFTER = 8.0  # simulated after a series: more than a swing of mass 2 [s]
_WAIT = 0.1  # for a better instant, where no series begins now [s]
_WAITS = 70  # at most: more than a swing

# Width of a pulse in samples, and the duration to be reached [s]
_EXPECTED = ((1, 4.6), (10, 5.0), (20, 6.0), (30, 6.0))

# True friction over the guessed one, less 1, and what it leaves of the way: of mass 1, and
# swinging. Known for another series of 4.6 s
_LEFT = (
    (-0.05, 0.025, 0.0099),
    (-0.01, 0.0049, 0.0020),
    (0.01, -0.0020, 0.0005),
    (0.05, -0.011, 0.0023),
)
_WRONG = (-0.05, -0.01, 0.01, 0.05)
_SERIES = 3
SERIES_PIECES = len(_EXPECTED) + len(_LEFT) + 2 * len(_WRONG)
"""Pieces of work of `gather_series`."""

State = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class Planned:
    """A series and its true motion."""

    series: PulseSeries  #: As planned.
    #: Motion of the arm as guessed, simulated exactly, and for a while after it.
    motion: SimulatedMotion
    numbers: ReferenceSeries  #: What a table holds of it.


@dataclass(frozen=True, kw_only=True)
class SeriesEvidence:
    """Measurements of series by themselves."""

    planned: tuple[Planned, ...]  #: The series of the reference points.
    effects: tuple[FrictionErrorEffect, ...]  #: Of friction that is not as guessed.
    #: Successive series, with constant and with updated estimates.
    successive: tuple[SuccessiveSeries, ...]


def gather_series(advance: Callable[[], None]) -> SeriesEvidence:
    """Plan and simulate everything; ``advance`` is called `SERIES_PIECES` times."""
    planned: list[Planned] = []
    for samples, expected in _EXPECTED:
        planned.append(_planned(samples, expected))
        advance()
    effects: list[FrictionErrorEffect] = []
    for error, left, swinging in _LEFT:
        state = _last(_simulated(planned[0].series, _REST, FRICTION * (1.0 + error)))
        effects.append(
            FrictionErrorEffect(
                friction_error=error,
                expected_error=left * MOVE,
                expected_swing=swinging * MOVE,
                error=state[0] - MOVE,
                swing=_swing(state),
            )
        )
        advance()
    successive: list[SuccessiveSeries] = []
    for learning in (False, True):
        for error in _WRONG:
            successive.append(_successive(error, learning=learning))
            advance()
    return SeriesEvidence(
        planned=tuple(planned), effects=tuple(effects), successive=tuple(successive)
    )


def _planner(coulomb: float, samples: int = 1) -> PulseSeriesPlanner:
    return PulseSeriesPlanner(
        arm=reference_arm(coulomb),
        sampling_time=REFERENCE_TIME,
        effort_limit=REFERENCE_LIMIT,
        pulse_samples=samples,
    )


def _simulated(
    series: PulseSeries, start: State, coulomb: float, after: float = _AFTER
) -> SimulatedMotion:
    effort = np.concatenate((series.effort, np.zeros(round(after / REFERENCE_TIME))))
    return simulate(
        reference_arm(coulomb), effort, sampling_time=REFERENCE_TIME, initial_state=start
    )


def _columns(motion: SimulatedMotion) -> list[np.ndarray]:
    columns = (motion.position, motion.velocity, motion.load_position, motion.load_velocity)
    return [each for each in columns if each is not None]


def _last(motion: SimulatedMotion) -> State:
    x1, v1, x2, v2 = (float(each[-1]) for each in _columns(motion))
    return x1, v1, x2, v2


def _swing(state: State) -> float:
    """Return the amplitude of mass 2 about a resting mass 1 [m]."""
    return hypot(state[2] - state[0], state[3] * (surrogate.MASS_2 / surrogate.STIFFNESS) ** 0.5)


def _planned(samples: int, expected: float) -> Planned:
    series = _planner(FRICTION, samples).plan(_REST, MOVE)
    motion = _simulated(series, _REST, FRICTION)
    state = _last(motion)
    return Planned(
        series=series,
        motion=motion,
        numbers=ReferenceSeries(
            pulse_width=samples * REFERENCE_TIME,
            pulses=series.amplitudes.size,
            expected_duration=expected,
            duration=series.duration,
            impulse=series.impulse,
            peak_effort=series.peak_effort,
            residual=max(abs(state[0] - MOVE), abs(state[2] - MOVE), _swing(state)),
        ),
    )


def _successive(error: float, *, learning: bool) -> SuccessiveSeries:
    """Fire series after series from wherever the one before has left both masses."""
    coulomb, viscous = FRICTION * (1.0 + error), FRICTION
    estimator = EnergyEstimator(
        force_noise=0.0,
        inertia=surrogate.MASS_1,
        load_inertia=surrogate.MASS_2,
        stiffness=surrogate.STIFFNESS,
        offset=False,
        initial_values={"coulomb_friction": coulomb, "viscous_friction": viscous},
    )
    memory = estimator.init(sampling_time=REFERENCE_TIME)
    state, errors, swings = _REST, list[float](), list[float]()
    for _ in range(_SERIES):
        for _ in range(_WAITS):
            try:
                series = _planner(coulomb).plan(state, MOVE)
            except NoPulseSeriesError:
                state = _last(_rested(state))
                continue
            motion = _simulated(series, state, FRICTION)
            break
        else:
            break
        if learning:
            rows = zip(motion.commanded_effort, *_columns(motion), strict=False)
            for effort, *sample in rows:
                estimator.kernel(memory, float(effort), *map(float, sample))
            coulomb = max(float(memory[estimator.values_at][0]), 0.0)
        state = _last(motion)
        errors.append(state[0] - MOVE)
        swings.append(_swing(state))
    return SuccessiveSeries(
        friction_error=error, learning=learning, error=np.array(errors), swing=np.array(swings)
    )


def _rested(state: State) -> SimulatedMotion:
    return simulate(
        reference_arm(),
        np.zeros(round(_WAIT / REFERENCE_TIME)),
        sampling_time=REFERENCE_TIME,
        initial_state=state,
    )
