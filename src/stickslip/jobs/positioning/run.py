"""Run a positioning task on its simulated axis, and judge how it went."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stickslip import __version__
from stickslip.control import (
    AxisLandingController,
    ExactPulseController,
    PIDController,
    PulseController,
)
from stickslip.jobs.positioning.arm_run import run_arm
from stickslip.jobs.positioning.axis_table import AxisTable
from stickslip.jobs.positioning.control_table import CONTROLLERS
from stickslip.jobs.positioning.controllers import Chosen, choose_controller, gone_on
from stickslip.jobs.positioning.judging import ending, settling_time
from stickslip.jobs.positioning.landing_notes import LandingNotes, landing_phases
from stickslip.jobs.positioning.scenario import Scenario, ScenarioFile, read_scenario
from stickslip.jobs.pulse_run import PulseNotes
from stickslip.records import (
    InputError,
    LearntPulses,
    Positioning,
    PositioningMove,
    PositioningOutcome,
    PositioningRun,
    SensorSample,
)
from stickslip.simulation import ClosedLoopRun, simulate_closed_loop

__all__ = ["position"]

_TOLD = 200
"""Samples between two calls of the progress."""


class _Recorder:
    """A controller that does what another does, sets its targets, and notes what it finds out.

    It runs in Python, so that nothing has to be compiled for a single short run.
    """

    def __init__(
        self, controller: Chosen, scenario: Scenario, advance: Callable[[int], None]
    ) -> None:
        self._controller: Any = controller
        self._step: Any = controller.step
        self._goals = scenario.task.goals
        self._samples = scenario.task.samples
        self._advance = advance
        self._k = 0
        self.sampling_time = controller.sampling_time
        self.notes: PulseNotes | LandingNotes | None = None
        if isinstance(controller, PulseController):
            self.notes = PulseNotes(controller)
        elif isinstance(controller, AxisLandingController):
            self.notes = LandingNotes(controller, len(self._goals) * self._samples)
        self.outcomes: list[PositioningOutcome | None] = []
        self.reasons: list[str | None] = []

    def init(self) -> Any:
        """Return the state before the first sample."""
        return self._controller.init()

    def step(self, state: Any, sample: SensorSample) -> tuple[Any, float]:
        """Step the other controller, to the next target when it is time."""
        move, k = divmod(self._k, self._samples)
        if k == 0 and move > 0:
            self.end_move(state)
            state = self._controller.retargeted(state, self._goals[move])
        if k % _TOLD == 0:
            self._advance(k + move * self._samples)
        self._k += 1
        state, effort = self._step(state, sample)
        if self.notes is not None:
            self.notes.take(state, sample.time)
        return state, effort

    def end_move(self, state: Any) -> None:
        """Ask how far positioning has come, at the end of a move."""
        controller = self._controller
        ends = isinstance(controller, PulseController | AxisLandingController)
        self.outcomes.append(controller.outcome(state) if ends else None)
        tells = isinstance(controller, ExactPulseController | AxisLandingController)
        self.reasons.append(controller.why(state) if tells else None)

    def integrates(self, tolerance: float) -> bool:
        """Return whether the effort grows for as long as the axis rests outside the tolerance."""
        controller = self._controller
        if not isinstance(controller, PIDController):
            return False
        return controller.integral_gain > 0.0 and controller.dead_band <= tolerance


def position(
    scenario: ScenarioFile | Path | str, *, progress: Callable[[int, int], None] | None = None
) -> Positioning:
    """Run the positioning task of a scenario file on its simulated axis.

    Parameters
    ----------
    scenario
        The TOML file (see the guide on positioning), or what `read_scenario` read from it.
    progress
        Called now and then with how many samples are done, of how many.

    Returns
    -------
    Every run with its moves and pulses, what was learnt, and how it ended.

    Raises
    ------
    InputError
        If the scenario or a file that it names cannot be used; the message says what, where, and
        the remedy.

    Examples
    --------
    >>> result = position("examples/scenarios/papwc.toml")
    >>> result.ending.value
    'reached'
    """
    read = scenario if isinstance(scenario, ScenarioFile) else read_scenario(scenario)
    asked, folder = read.scenario, read.path.parent
    if asked.axis.flexible:
        return _position_arm(read, progress)
    try:
        controller, believed, notes = choose_controller(asked, folder)
    except InputError as error:
        # One that names a table is of the scenario; others name a file beside it
        raise error.at(str(read.path)) if error.where.startswith("[") else error from None
    generator = np.random.default_rng(asked.sensors.seed) if asked.sensors.noisy else None
    task = asked.task
    every = task.runs * len(task.goals) * task.samples
    runs: list[PositioningRun] = []
    learnt: LearntPulses | None = None
    for number in range(1, task.runs + 1):
        done = (number - 1) * len(task.goals) * task.samples

        def advance(samples: int, done: int = done) -> None:
            if progress is not None:
                progress(done + samples, every)

        recorder = _Recorder(controller, asked, advance)
        try:
            run = simulate_closed_loop(
                asked.axis.rigid(),
                recorder,
                sampling_time=task.sampling_time,
                samples=len(task.goals) * task.samples,
                sensors=asked.sensors.sensors(),
                generator=generator,
                initial_state=(task.start, 0.0),
                name=read.name,
            )
        except InputError as error:
            raise error.at(str(read.path)) from None
        recorder.end_move(run.controller_state)
        runs.append(_judged(number, run, recorder, asked))
        if not isinstance(controller, PIDController):
            try:
                learnt = controller.learnt(run.controller_state)
            except InputError as error:
                notes += (f"Run {number} has learnt nothing: {error.what}.",)
                continue
            if number < task.runs:
                try:
                    controller = gone_on(asked, controller, learnt)
                except InputError as error:
                    notes += (
                        f"What run {number} has learnt cannot be gone on from ({error.what}); the "
                        "next run begins as this one did.",
                    )
    if progress is not None:
        progress(every, every)
    return _positioning(
        read,
        truth=_truth(asked.axis, asked.controller.effort_limit, runs[0].estimates),
        believed=believed,
        runs=tuple(runs),
        limits=_limits(learnt, asked.controller.effort_limit),
        learnt=learnt,
        notes=notes,
    )


def _position_arm(read: ScenarioFile, progress: Callable[[int, int], None] | None) -> Positioning:
    """Run the task of a scenario with a flexible arm."""
    asked, path = read.scenario, str(read.path)
    task = asked.task
    every = task.runs * len(task.goals) * task.samples

    def advance(samples: int) -> None:
        if progress is not None:
            progress(samples, every)

    try:
        outcome = run_arm(asked, read.path.parent, name=read.name, progress=advance)
    except InputError as error:
        raise error if error.where and not error.where.startswith("[") else error.at(path) from None
    advance(every)
    arm = asked.axis.arm()
    law = asked.axis.friction()
    truth = {
        "coulomb_friction": 0.5 * (law.coulomb_friction_positive + law.coulomb_friction_negative),
        "viscous_friction": 0.5 * (law.viscous_friction_positive + law.viscous_friction_negative),
        "mass": arm.mass_1,
        "load_mass": arm.mass_2,
        "stiffness": arm.stiffness,
    }
    return _positioning(
        read,
        truth={name: truth[name] for name in outcome.runs[0].estimates},
        believed=outcome.believed,
        runs=outcome.runs,
        limits={},
        learnt=outcome.learnt,
        notes=outcome.notes,
    )


def _positioning(
    read: ScenarioFile,
    *,
    truth: Mapping[str, float],
    believed: Mapping[str, str],
    runs: tuple[PositioningRun, ...],
    limits: Mapping[str, tuple[float | None, float | None]],
    learnt: LearntPulses | None,
    notes: tuple[str, ...],
) -> Positioning:
    """Return what came of a scenario, with what it says."""
    asked = read.scenario
    return Positioning(
        name=read.name,
        kind=asked.axis.kind,
        method=asked.controller.method,
        controller=CONTROLLERS[asked.controller.method],
        tolerance=asked.task.tolerance,
        scenario=asked.tables(),
        truth=truth,
        believed=believed,
        runs=runs,
        limits=limits,
        learnt=learnt,
        notes=(*asked.axis.about_law(), *notes),
        file=read.path.name,
        sha256=read.sha256,
        stickslip_version=__version__,
    )


def _judged(
    number: int, run: ClosedLoopRun[Any], recorder: _Recorder, scenario: Scenario
) -> PositioningRun:
    """Return a run with its moves, each judged by the truth."""
    task, n = scenario.task, scenario.task.samples
    goals = np.append(np.repeat(task.goals, n), task.goals[-1])
    motion, notes = run.motion, recorder.notes
    error = goals - motion.position
    moves: list[PositioningMove] = []
    ends = zip(task.goals, recorder.outcomes, recorder.reasons, strict=True)
    for k, (goal, outcome, reason) in enumerate(ends):
        # The move's last sample is the first of the next one, but for the target
        there = slice(k * n, (k + 1) * n + 1)
        own = goal - motion.position[there]
        begin, end = float(motion.time[k * n]), float(motion.time[(k + 1) * n])
        last = k == len(task.goals) - 1
        moves.append(
            PositioningMove(
                number=k + 1,
                start_time=begin,
                end_time=end,
                start=float(motion.position[k * n]),
                target=goal,
                ending=ending(
                    own,
                    task.tolerance,
                    outcome,
                    integrates=recorder.integrates(task.tolerance),
                    still=scenario.still,
                ),
                reason=reason,
                late_errors=(float(np.min(own[n // 2 :])), float(np.max(own[n // 2 :]))),
                final_error=float(own[-1]),
                settling_time=settling_time(
                    motion.time[there], own, task.tolerance, still=scenario.still
                ),
                peak_effort=float(np.max(np.abs(motion.commanded_effort[k * n : (k + 1) * n]))),
                pulses=tuple(
                    pulse
                    for pulse in (() if notes is None else notes.pulses)
                    if pulse.time >= begin - 0.5 * task.sampling_time
                    and (last or pulse.time < end - 0.5 * task.sampling_time)
                ),
            )
        )
    return PositioningRun(
        number=number,
        time=motion.time,
        error=error,
        measured_error=goals - run.log.measured_position,
        effort=motion.commanded_effort,
        estimate_time=np.empty(0) if notes is None else notes.times,
        estimates={} if notes is None else notes.estimates,
        moves=tuple(moves),
        phases=landing_phases(run),
        deviations=notes.deviations if isinstance(notes, LandingNotes) else {},
    )


def _limits(
    learnt: LearntPulses | None, effort_limit: float
) -> dict[str, tuple[float | None, float | None]]:
    """Return between which efforts pulses have shown the static friction to lie."""
    values = {} if learnt is None else learnt.values
    limits: dict[str, tuple[float | None, float | None]] = {}
    for way in ("positive", "negative"):
        held, freed = values.get(f"holding_effort_{way}"), values.get(f"freeing_effort_{way}")
        if held is not None and freed is not None:
            limits[f"static_friction_{way}"] = (
                held if held > 0.0 else None,
                freed if freed < effort_limit else None,
            )
    return limits


def _truth(axis: AxisTable, effort: float, estimates: Mapping[str, object]) -> dict[str, float]:
    """Return what the estimates should be, as far as the axis has such a value."""
    law, mass = axis.friction(), axis.rigid().mass
    forward = law.coulomb_friction_positive + law.offset
    backward = law.coulomb_friction_negative - law.offset
    mean = 0.5 * (forward + backward)
    every = {
        "mass": mass,
        "coulomb_friction": mean,
        "coulomb_friction_positive": forward,
        "coulomb_friction_negative": backward,
        "viscous_friction": 0.5 * (law.viscous_friction_positive + law.viscous_friction_negative),
        "viscous_friction_positive": law.viscous_friction_positive,
        "viscous_friction_negative": law.viscous_friction_negative,
        "static_friction_positive": law.static_friction_positive + law.offset,
        "static_friction_negative": law.static_friction_negative - law.offset,
        "offset": law.offset,
        "gain_2": 1.0 / (2.0 * mass),
    }
    if mean > 0.0:
        # Eqs. 4 and 16
        every["pulse_gain"] = effort * (effort - mean) / (2.0 * mass * mean)
        every["gain_1"] = 1.0 / (2.0 * mass * mean)
    return {name: value for name, value in every.items() if name in estimates}
