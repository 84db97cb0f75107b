"""A positioning task from a scenario file: run it on its simulated axis, and judge it."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip import __version__
from stickslip.control import LandingState, PositionController
from stickslip.records import (
    ArmRun,
    ArmSeries,
    Ending,
    InputError,
    LearnedPulses,
    Positioning,
    PositioningMove,
    PositioningRun,
)
from stickslip.scenario import Axis, Scenario, ScenarioFile, TaskTable, read_scenario
from stickslip.simulation import ClosedLoopRun, simulate_closed_loop
from stickslip.tasks.positioning.judging import arm_ending, ending, settling_time
from stickslip.tasks.positioning.recorder import Recorder


def position(
    scenario: ScenarioFile | Path | str, *, progress: Callable[[int, int], None] | None = None
) -> Positioning:
    """Run the positioning task of a scenario file on its simulated axis.

    Parameters
    ----------
    scenario
        The TOML file (see the guide on positioning), or what `read_scenario` read from it.
    progress
        Called now and then with the number of samples done, and of all.

    Returns
    -------
    Every run with its moves and pulses, the learned values, and the ending.

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
    try:
        return _positioned(read, progress or (lambda _done, _every: None))
    except InputError as error:
        raise error.at(str(read.path), keys=True) from None


def _positioned(read: ScenarioFile, progress: Callable[[int, int], None]) -> Positioning:
    scenario, folder = read.scenario, read.path.parent
    task, axis, table = scenario.task, scenario.axis, scenario.controller
    built = scenario.build(folder)
    sources, notes = built.sources, (*axis.notes(), *built.notes)
    generator = np.random.default_rng(scenario.sensors.seed) if scenario.sensors.noisy else None
    samples = len(task.all_targets) * task.samples
    runs: list[PositioningRun] = []
    learned: LearnedPulses | None = None
    for number in range(1, task.runs + 1):

        def advance(k: int, done: int = (number - 1) * samples) -> None:
            progress(done + k, task.runs * samples)

        recorder = Recorder(
            built.guarded,
            task.all_targets,
            task.samples,
            flexible=axis.flexible,
            advance=advance,
        )
        run: ClosedLoopRun[Any] = simulate_closed_loop(
            axis.build(),
            recorder,
            sampling_time=task.sampling_time,
            samples=samples,
            sensors=scenario.sensors.build(),
            generator=generator,
            initial_state=(task.start, 0.0) * (2 if axis.flexible else 1),
            name=read.name,
        )
        recorder.end_move(run.controller_state)
        runs.append(_judged(number, run, recorder, built.guarded, scenario))
        try:
            found = built.guarded.learned(run.controller_state)
        except InputError as error:
            notes += (f"Run {number} has learned nothing: {error.what}.",)
            continue
        learned = found or learned
        if found is not None and number < task.runs:
            try:
                built = scenario.build(folder, found)
            except InputError as error:
                notes += (
                    f"Run {number + 1} begins as run {number} did, whose learned values cannot be "
                    f"used: {error.what}.",
                )
    progress(task.runs * samples, task.runs * samples)
    return Positioning(
        name=read.name,
        kind=axis.kind,
        method=table.method,
        controller=table.title,
        tolerance=task.tolerance,
        scenario=scenario.tables(),
        truth=_truth(axis, table.effort_limit, runs[0].estimates),
        first_guess_sources=sources,
        runs=tuple(runs),
        limits=_limits(learned, table.effort_limit),
        learned=learned,
        notes=notes,
        file=read.path.name,
        sha256=read.sha256,
        stickslip_version=__version__,
    )


def _judged(
    number: int,
    run: ClosedLoopRun[Any],
    recorder: Recorder,
    controller: PositionController[Any],
    scenario: Scenario,
) -> PositioningRun:
    """Return a run with its moves, each judged by the truth."""
    task, motion = scenario.task, run.motion
    targets = np.append(np.repeat(task.all_targets, task.samples), task.all_targets[-1])
    arm = swing = None
    if scenario.axis.flexible:
        swing = _swings(run, scenario)
        arm = _arm_run(run, targets, swing, task)
    integrates = controller.integrates(task.tolerance)
    moves: list[PositioningMove] = []
    for k, outcome in enumerate(recorder.outcomes):
        # The move's last sample is the first of the next one, but for the target
        there = slice(k * task.samples, (k + 1) * task.samples + 1)
        error = driven = task.all_targets[k] - motion.position[there]
        if arm is not None:
            load = task.all_targets[k] - arm.load_position[there]
            error = np.where(np.abs(load) > np.abs(driven), load, driven)
            ended = arm_ending(error, driven, task.tolerance, outcome)
        else:
            ended = ending(
                error,
                task.tolerance,
                outcome,
                integrates=integrates,
                rest_motion=scenario.rest_motion,
            )
        moved = _moved(k, run, recorder, scenario, error, ended)
        moves.append(moved if swing is None else replace(moved, swing=float(swing[there.stop - 1])))
    return PositioningRun(
        number=number,
        time=motion.time,
        error=targets - motion.position if arm is None else arm.error,
        measured_error=targets - run.log.measured_position if arm is None else arm.measured_error,
        effort=motion.commanded_effort,
        estimate_time=recorder.times,
        estimates=recorder.estimates,
        moves=tuple(moves),
        arm=arm,
        phases=recorder.phases(run.controller_state, float(motion.time[-1])),
        deviations=recorder.deviations,
    )


def _moved(
    k: int,
    run: ClosedLoopRun[Any],
    recorder: Recorder,
    scenario: Scenario,
    error: Float[np.ndarray, " n"],
    ended: Ending,
) -> PositioningMove:
    """Return a move with its true error and its ending."""
    task, n, motion = scenario.task, scenario.task.samples, run.motion
    time = motion.time[k * n : (k + 1) * n + 1]
    begin, end = float(time[0]), float(time[-1])
    last = k == len(task.all_targets) - 1
    late = error[n // 2 :]
    return PositioningMove(
        number=k + 1,
        start_time=begin,
        end_time=end,
        start=float(motion.position[k * n]),
        target=task.all_targets[k],
        ending=ended,
        reason=recorder.reasons[k],
        late_errors=(float(np.min(late)), float(np.max(late))),
        final_error=float(error[-1]),
        settling_time=settling_time(time, error, task.tolerance, rest_motion=scenario.rest_motion),
        peak_effort=float(np.max(np.abs(motion.commanded_effort[k * n : (k + 1) * n]))),
        pulses=tuple(
            pulse
            for pulse in recorder.pulses
            if pulse.time >= begin - 0.5 * task.sampling_time
            and (last or pulse.time < end - 0.5 * task.sampling_time)
        ),
    )


def _limits(
    learned: LearnedPulses | None, effort_limit: float
) -> dict[str, tuple[float | None, float | None]]:
    """Return the limits of the static friction that pulses have shown."""
    values = {} if learned is None else learned.values
    limits: dict[str, tuple[float | None, float | None]] = {}
    for side in ("positive", "negative"):
        held, freed = values.get(f"holding_effort_{side}"), values.get(f"freeing_effort_{side}")
        if held is not None and freed is not None:
            limits[f"static_friction_{side}"] = (
                held if held > 0.0 else None,
                freed if freed < effort_limit else None,
            )
    return limits


def _truth(axis: Axis, effort: float, estimates: Mapping[str, object]) -> dict[str, float]:
    """Return the true values of the estimates, as far as the axis has them."""
    every, mass = axis.truth(), axis.body or 0.0
    if axis.flexible:
        parts = {"load_mass": axis.load or 0.0, "stiffness": axis.stiffness or 0.0}
        return {name: (every | parts)[name] for name in estimates}
    # Pulses count the offset with the friction of the direction that it opposes
    for name in ("coulomb_friction", "static_friction"):
        every[f"{name}_positive"] += every["offset"]
        every[f"{name}_negative"] -= every["offset"]
    mean = 0.5 * (every["coulomb_friction_positive"] + every["coulomb_friction_negative"])
    every |= {"coulomb_friction": mean, "gain_2": 1.0 / (2.0 * mass)}
    if mean > 0.0:
        # Eqs. 4 and 16
        every["pulse_gain"] = effort * (effort - mean) / (2.0 * mass * mean)
        every["gain_1"] = 1.0 / (2.0 * mass * mean)
    return {name: value for name, value in every.items() if name in estimates}


def _swings(run: ClosedLoopRun[Any], scenario: Scenario) -> Float[np.ndarray, " n"]:
    """Return the amplitude of mass 2 from each sample on if mass 1 rested there [m or rad]."""
    motion, axis = run.motion, scenario.axis
    frequency = sqrt((axis.stiffness or 0.0) / (axis.load or 1.0))
    apart = _load(motion.load_position) - motion.position
    return np.hypot(apart, (_load(motion.load_velocity) - motion.velocity) / frequency)


def _load(values: Float[np.ndarray, " n"] | None) -> Float[np.ndarray, " n"]:
    """Return a channel of the second mass, which every arm of a scenario has."""
    return np.empty(0) if values is None else values


def _arm_run(
    run: ClosedLoopRun[Any],
    targets: Float[np.ndarray, " n"],
    swing: Float[np.ndarray, " n"],
    task: TaskTable,
) -> ArmRun:
    """Return both masses of an arm, and the series with the true motion at their ends."""
    motion, state = run.motion, run.controller_state.inner
    flights = state.flights if isinstance(state, LandingState) else ()
    samples, step, last = task.samples, task.sampling_time, motion.time.size - 1
    series: list[ArmSeries] = []
    for k, flight in enumerate(flights):
        planned, start = flight.planned, round(flight.start / step)
        # The rest after it lasts until the next series or the next move begins
        move = start // samples + 1
        until = min(move * samples, last)
        if k + 1 < len(flights):
            until = min(until, round(flights[k + 1].start / step))
        rests = until >= start + planned.effort.size and bool(motion.stuck[until])
        series.append(
            ArmSeries(
                move=move,
                start_time=flight.start,
                sampling_time=step,
                pulses=planned.amplitudes.size,
                target=planned.target,
                coulomb_friction=flight.coulomb_friction,
                viscous_friction=flight.viscous_friction,
                effort=planned.effort,
                position=planned.position,
                load_position=planned.load_position,
                start_swing=float(swing[start]),
                final_position=float(motion.position[until]) if rests else None,
                final_swing=float(swing[until]) if rests else None,
            )
        )
    return ArmRun(
        target=targets,
        position=motion.position,
        load_position=_load(motion.load_position),
        measured_position=run.log.measured_position,
        measured_load_position=_load(run.log.measured_load_position),
        resting=motion.stuck,
        series=tuple(series),
    )
