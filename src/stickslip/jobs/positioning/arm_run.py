"""A positioning task on a flexible arm: run it, and judge it by where both masses truly are."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import ceil, sqrt
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import LandingController, LandingState
from stickslip.friction import FrictionLaw
from stickslip.jobs.positioning.arm_controllers import ArmChoice, choose_arm_controller
from stickslip.jobs.positioning.judging import arm_ending, settling_time
from stickslip.jobs.positioning.landing_notes import NOTED, by_name, landing_phases
from stickslip.jobs.positioning.scenario import Scenario
from stickslip.plants import FlexibleArm
from stickslip.records import (
    ArmRun,
    ArmSeries,
    InputError,
    LearntPulses,
    PositioningMove,
    PositioningOutcome,
    PositioningRun,
    SensorSample,
)
from stickslip.simulation import ClosedLoopRun, simulate_closed_loop

__all__ = ["ArmOutcome", "run_arm"]

_TOLD = 50
"""Samples between two calls of the progress."""


@dataclass(frozen=True, kw_only=True)
class ArmOutcome:
    """What all runs on an arm have left behind.

    Attributes
    ----------
    runs
        Each with its moves.
    learnt
        After the last; None if nothing was.
    believed
        Where each first guess of the first run came from, by name.
    notes
        For the user.
    """

    runs: tuple[PositioningRun, ...]
    learnt: LearntPulses | None
    believed: Mapping[str, str]
    notes: tuple[str, ...]


class _Recorder:
    """A controller that does what another does, sets its targets, and notes what it believes."""

    def __init__(
        self, choice: ArmChoice, scenario: Scenario, advance: Callable[[int], None]
    ) -> None:
        self._controller = choice.controller
        self._estimator = choice.estimator
        self._goals = scenario.task.goals
        self._samples = scenario.task.samples
        self._advance = advance
        self._k = 0
        self._every = ceil(len(self._goals) * self._samples / NOTED)
        self.sampling_time = choice.controller.sampling_time
        self.times: list[float] = []
        self.values: list[dict[str, float]] = []
        self.deviations: list[dict[str, float]] = []
        self.outcomes: list[PositioningOutcome | None] = []
        self.reasons: list[str | None] = []

    def init(self) -> Any:
        """Return the state before the first sample."""
        return self._controller.init()

    def step(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        """Step the other controller, to the next target when it is time."""
        controller = self._controller
        move, k = divmod(self._k, self._samples)
        if k == 0 and move > 0:
            self.end_move(state)
            if isinstance(controller, LandingController):
                state = controller.retargeted(state, self._goals[move])
        if k % _TOLD == 0:
            self._advance(self._k)
        state, effort = controller.step(state, sample)
        if self._k % self._every == 0:
            self.times.append(sample.time)
            self._note(state)
        self._k += 1
        return state, effort

    def _note(self, state: Any) -> None:
        """Note what is believed, with how sure it is."""
        controller = self._controller
        if isinstance(controller, LandingController):
            spread, values = controller.deviations(state), controller.estimates(state)
        else:
            own = controller.estimator_state(state)
            coulomb, viscous = own[self._estimator.values_at].tolist()
            values = {"coulomb_friction": coulomb, "viscous_friction": viscous}
            # In the order of the estimator's names, which has viscous friction first
            known = np.sqrt(np.diag(self._estimator.covariance(own))).tolist()
            by_name = dict(zip(self._estimator.parameter_names("linear"), known, strict=True))
            spread = {name: by_name[name] for name in values}
        self.values.append({name: values[name] for name in spread})
        self.deviations.append(spread)

    def end_move(self, state: Any) -> None:
        """Ask how far positioning has come, at the end of a move."""
        controller = self._controller
        lands = isinstance(controller, LandingController)
        self.outcomes.append(controller.outcome(state) if lands else None)
        self.reasons.append(controller.why(state) if lands else None)


def run_arm(
    scenario: Scenario,
    folder: Path,
    *,
    name: str,
    progress: Callable[[int], None],
) -> ArmOutcome:
    """Run a task on its simulated arm.

    Parameters
    ----------
    scenario
        The task.
    folder
        Where files that it names are looked for.
    name
        Of the task.
    progress
        Called now and then with how many samples are done.

    Raises
    ------
    InputError
        If the controller cannot be made, or commands what cannot be.
    """
    task, sensors = scenario.task, scenario.sensors
    generator = np.random.default_rng(sensors.seed) if sensors.noisy else None
    samples = len(task.goals) * task.samples
    choice = choose_arm_controller(scenario, folder)
    believed, notes = choice.believed, choice.notes
    runs: list[PositioningRun] = []
    learnt: LearntPulses | None = None
    for number in range(1, task.runs + 1):
        done = (number - 1) * samples

        def advance(k: int, done: int = done) -> None:
            progress(done + k)

        recorder = _Recorder(choice, scenario, advance)
        run: ClosedLoopRun[Any] = simulate_closed_loop(
            scenario.axis.arm(),
            recorder,
            sampling_time=task.sampling_time,
            samples=samples,
            sensors=sensors.sensors(),
            generator=generator,
            initial_state=(task.start, 0.0, task.start, 0.0),
            name=name,
        )
        recorder.end_move(run.controller_state)
        runs.append(_judged(number, run, recorder, scenario))
        if isinstance(choice.controller, LandingController):
            try:
                learnt = choice.controller.learnt(run.controller_state)
            except InputError as error:
                notes += (f"Run {number} has learnt nothing: {error.what}.",)
            else:
                if number < task.runs:
                    choice = choose_arm_controller(scenario, folder, learnt)
    return ArmOutcome(runs=tuple(runs), learnt=learnt, believed=believed, notes=notes)


def _judged(
    number: int, run: ClosedLoopRun[Any], recorder: _Recorder, scenario: Scenario
) -> PositioningRun:
    """Return a run with its moves, each judged by the truth."""
    task, n, motion = scenario.task, scenario.task.samples, run.motion
    swing = _swings(run, scenario.axis.arm())
    goals = np.append(np.repeat(task.goals, n), task.goals[-1])
    arm = ArmRun(
        target=goals,
        position=motion.position,
        load_position=_load(motion.load_position),
        measured_position=run.log.measured_position,
        measured_load_position=_load(run.log.measured_load_position),
        resting=motion.stuck,
        series=_series(run, swing, scenario),
    )
    moves: list[PositioningMove] = []
    ends = zip(task.goals, recorder.outcomes, recorder.reasons, strict=True)
    for k, (goal, outcome, reason) in enumerate(ends):
        # The move's last sample is the first of the next one, but for the target
        there = slice(k * n, (k + 1) * n + 1)
        driven = goal - motion.position[there]
        load = goal - arm.load_position[there]
        own = np.where(np.abs(load) > np.abs(driven), load, driven)
        moves.append(
            PositioningMove(
                number=k + 1,
                start_time=float(motion.time[k * n]),
                end_time=float(motion.time[(k + 1) * n]),
                start=float(motion.position[k * n]),
                target=goal,
                ending=arm_ending(own, driven, task.tolerance, outcome),
                reason=reason,
                late_errors=(float(np.min(own[n // 2 :])), float(np.max(own[n // 2 :]))),
                final_error=float(own[-1]),
                settling_time=settling_time(motion.time[there], own, task.tolerance),
                peak_effort=float(np.max(np.abs(motion.commanded_effort[k * n : (k + 1) * n]))),
                pulses=(),
                swing=float(swing[(k + 1) * n]),
            )
        )
    return PositioningRun(
        number=number,
        time=motion.time,
        error=arm.error,
        measured_error=arm.measured_error,
        effort=motion.commanded_effort,
        estimate_time=np.array(recorder.times),
        estimates=by_name(recorder.values),
        moves=tuple(moves),
        arm=arm,
        phases=landing_phases(run),
        deviations=by_name(recorder.deviations),
    )


def _load(values: Float[np.ndarray, " n"] | None) -> Float[np.ndarray, " n"]:
    """Return a channel of the second mass, which every arm of a scenario has."""
    return np.empty(0) if values is None else values


def _swings(run: ClosedLoopRun[Any], plant: FlexibleArm[FrictionLaw]) -> Float[np.ndarray, " n"]:
    """Return with which amplitude mass 2 would swing on at each sample, if mass 1 rested."""
    motion, frequency = run.motion, sqrt(plant.stiffness / plant.mass_2)
    apart = _load(motion.load_position) - motion.position
    return np.hypot(apart, (_load(motion.load_velocity) - motion.velocity) / frequency)


def _series(
    run: ClosedLoopRun[Any], swing: Float[np.ndarray, " n"], scenario: Scenario
) -> tuple[ArmSeries, ...]:
    """Return the series of a run, with where they truly left the arm."""
    state = run.controller_state
    flights = state.flights if isinstance(state, LandingState) else ()
    T, motion = scenario.task.sampling_time, run.motion
    last = motion.time.size - 1
    series: list[ArmSeries] = []
    for k, flight in enumerate(flights):
        start = round(flight.start / T)
        # The rest after it lasts until the next series or the next move begins
        move = start // scenario.task.samples + 1
        until = min(move * scenario.task.samples, last)
        if k + 1 < len(flights):
            until = min(until, round(flights[k + 1].start / T))
        rests = until >= start + flight.planned.effort.size and bool(motion.stuck[until])
        series.append(
            ArmSeries(
                move=move,
                start_time=flight.start,
                sampling_time=T,
                pulses=flight.planned.amplitudes.size,
                target=flight.planned.target,
                coulomb_friction=flight.coulomb_friction,
                viscous_friction=flight.viscous_friction,
                effort=flight.planned.effort,
                position=flight.planned.position,
                load_position=flight.planned.load_position,
                start_swing=float(swing[start]),
                final_position=float(motion.position[until]) if rests else None,
                final_swing=float(swing[until]) if rests else None,
            )
        )
    return tuple(series)
