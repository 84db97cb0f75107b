"""All axes of a log identified in one call, in two processes."""

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from queue import SimpleQueue
from typing import Any

from stickslip.child_process import ChildProcess, answer
from stickslip.estimation.base import EstimationTask
from stickslip.estimation.registry import entry_of
from stickslip.logs import AxisSchema, LogSchema, read_axes
from stickslip.logs.columns.assignment import one_axis as one_axis  # noqa: PLC0414 - of the front
from stickslip.logs.reading import schema_at
from stickslip.records import (
    AxesIdentification,
    AxisKind,
    AxisLog,
    Identification,
    InputError,
    StickslipError,
    Validation,
)
from stickslip.tasks.identification import identified

WORKERS = 2
"""Processes; each needs some 300 MB."""

_CHILD = "from stickslip.tasks.axes import serve; serve()"

Progress = Callable[[str, int, int], None]
"""Called with the name of an axis that is done, the number done and the number of all."""


def axes_at(
    path: Path | str,
    schema: Path | str | LogSchema | None = None,
    columns: AxisSchema | None = None,
    kind: AxisKind | None = None,
) -> dict[str, AxisLog | InputError]:
    """Read every axis of a log as `read_axes`; ``columns`` take precedence over the schema.

    ``kind`` is that of the axes if neither states it.
    """
    columns = None if columns == AxisSchema() else columns
    if columns is None and kind is None:
        return read_axes(path, schema)
    stated, _ = schema_at(schema)
    whole = stated if columns is None else stated.overridden(None, columns)
    return read_axes(path, replace(whole, kind=whole.kind or kind))


def kind_of_joints(urdf: Path | str, joints: Sequence[str] = ()) -> AxisKind | None:
    """Return the kind of the joints of a robot, or of those in ``joints``; None if kinds differ.

    ``joints`` are joints or ``AXIS=JOINT``, as in `axes_of_robot`; unknown ones are ignored.
    """
    from stickslip.estimation.robot.model import read_urdf

    kinds = read_urdf(urdf).joints
    wanted = [word.rpartition("=")[2] for word in joints] or list(kinds)
    found: set[AxisKind] = {kinds[joint] for joint in wanted if joint in kinds}
    return found.pop() if len(found) == 1 else None


def axes_of_robot(
    logs: Mapping[str, AxisLog | InputError], urdf: Path | str, joints: Sequence[str] = ()
) -> dict[str, AxisLog | InputError]:
    """Return the logs of a robot's joints with the efforts that a model of its links states.

    Gravity, the other joints and the changes of inertia then act on a joint as in the model
    (`stickslip.records.AxisLog.model_effort`). An axis is the joint of the same name, or the only
    joint whose name contains its name; numbered axes are the joints in their order, if there are as
    many.

    Parameters
    ----------
    logs
        By the name of the axis, as `stickslip.logs.read_axes` returns them; all joints that move.
    urdf
        Path of the URDF file, with masses and inertias [kg, kg m^2]. The base is upright.
    joints
        Names of the requested joints, or ``"AXIS=JOINT"`` for the joint that an axis is; for a log
        of one axis, the joint that it is. Without a requested joint, every axis is returned.

    Returns
    -------
    By the name of each axis, its log with the effort of the model, or why it has none.

    Raises
    ------
    InputError
        If the file is no URDF with masses, a joint is not in it or not in the log, or no axis is a
        joint of it.
    MissingExtraError
        If MuJoCo is not installed.
    """
    from stickslip.estimation.robot.efforts import joint_of_each, with_model_effort
    from stickslip.estimation.robot.model import read_urdf

    robot = read_urdf(urdf)
    readable = {axis: each for axis, each in logs.items() if isinstance(each, AxisLog)}
    if not readable:
        raise next(each for each in logs.values() if isinstance(each, InputError))
    pairs = [word.rpartition("=") for word in joints]
    stated = {axis: joint for axis, sign, joint in pairs if sign}
    wanted = [joint for _, sign, joint in pairs if not sign]
    if len(logs) == len(readable) == 1 and len(wanted) == 1 and not stated:
        stated = {next(iter(readable)): wanted[0]}
    names = list(robot.joints)
    for joint in wanted:
        if joint not in names:
            raise InputError("joint_not_in_model", joint=joint, joints=names)
    joint_of = joint_of_each(list(logs), names, stated)
    missing = [joint for joint in wanted if joint not in joint_of.values()]
    if missing or not joint_of:
        raise InputError(
            "joint_not_in_log", where=robot.name, joints=missing or names, axes=list(logs)
        )
    joints_read = {axis: readable[axis] for axis in joint_of if axis in readable}
    found = with_model_effort(joints_read, robot, joint_of)
    every: dict[str, AxisLog | InputError] = {}
    for axis, log in logs.items():
        if wanted and joint_of.get(axis) not in wanted:
            continue
        other = InputError("joint_not_in_log", where=robot.name, joints=names, axes=[axis])
        every[axis] = found.get(axis) or (log if isinstance(log, InputError) else other)
    return every


def identify_axes(
    log: Path | str | Mapping[str, AxisLog | InputError],
    *,
    name: str = "log",
    schema: Path | str | LogSchema | None = None,
    columns: AxisSchema | None = None,
    estimator: str = "auto",
    task: EstimationTask | None = None,
    progress: Progress | None = None,
) -> AxesIdentification:
    """Identify the friction of every axis of a log.

    Parameters
    ----------
    log
        The path of a log, or the logs of its axes by name.
    name
        Of the log in the result; that of the file if a path is given.
    schema, columns
        How to read it, if it is a path (see `identify`).
    estimator
        Name in `stickslip.estimation.ESTIMATORS`.
    task
        Known parameters and terms to estimate, for all axes; None for unknown rigid axes.
    progress
        Called with the name of each axis that is done, the number done and the number of all.

    Returns
    -------
    The identification of each axis by name, and the reason for each that has none.

    Raises
    ------
    InputError
        If the log cannot be read, no axis can be identified, or there is no such estimator.
    """
    from stickslip.estimation.prepare import with_common_times

    entry_of(estimator)
    if isinstance(log, Mapping):
        logs = dict(log)
    else:
        logs = axes_at(log, schema, columns)
        name = Path(log).stem
    task = task or EstimationTask()
    readable = {axis: each for axis, each in logs.items() if isinstance(each, AxisLog)}
    results = _identified(with_common_times(readable), estimator, task, progress)
    errors = {
        axis: result
        for axis in logs
        if isinstance(result := results.get(axis, logs[axis]), StickslipError)
    }
    found = {axis: each for axis, each in results.items() if isinstance(each, Identification)}
    if not found:
        raise next(iter(errors.values()))
    return AxesIdentification(
        name=name, axes=found, unread={axis: each.below(axis) for axis, each in errors.items()}
    )


def validated(
    found: Identification, other: AxisLog | InputError, name: str, inertia: float | None = None
) -> Identification:
    """Return an identification with the error of its prediction on another log.

    Parameters
    ----------
    found
        The identification.
    other
        Another log of the axis, or the error for which it cannot be read.
    name
        Of the other log.
    inertia
        Known mass or inertia, for an estimate without one [kg or kg m^2].
    """
    from stickslip.estimation.selection.evaluation.prediction import prediction_error

    error: float | None = None
    if isinstance(other, InputError):
        reason = other.below(name)
    elif other.kind != found.log.kind or other.effort_unit != found.log.effort_unit:
        reason = str(InputError("validation_of_another_axis"))
    else:
        try:
            error = prediction_error(found.estimate, other, inertia=inertia)
            reason = "" if error is not None else "the axis slips in no window of it"
        except InputError as problem:
            reason = problem.below(other.name)
    return replace(found, validation=Validation(log=name, error=error, reason=reason))


def axes_validated(
    found: AxesIdentification,
    others: Mapping[str, AxisLog | InputError],
    name: str,
    inertia: float | None = None,
) -> AxesIdentification:
    """Return the identification of all axes, each validated on the log of the same axis.

    Parameters
    ----------
    found
        The identification.
    others
        Other logs of the axes by name, or the errors for which they cannot be read.
    name
        Of the other log.
    inertia
        Known mass or inertia, for estimates without one [kg or kg m^2].
    """
    axes = {
        axis: validated(
            each,
            others.get(axis)
            or InputError("axis_not_found", where=name, axis=axis, axes=list(others)),
            name,
            inertia,
        )
        for axis, each in found.axes.items()
    }
    return replace(found, axes=axes)


def _identified(
    logs: Mapping[str, AxisLog], estimator: str, task: EstimationTask, progress: Progress | None
) -> dict[str, Identification | StickslipError]:
    """Return the identification of each log, or its error, from other processes."""
    workers: SimpleQueue[ChildProcess] = SimpleQueue()
    count, done = min(WORKERS, len(logs)), 0
    lock = threading.Lock()

    def one(axis: str) -> Identification | StickslipError:
        nonlocal done
        worker = workers.get()
        try:
            return _asked(worker, logs[axis], estimator, task)
        finally:
            workers.put(worker)
            with lock:
                done += 1
                if progress is not None:
                    progress(axis, done, len(logs))

    # After an interruption the processes end first, so that no thread waits for them
    with ThreadPoolExecutor(max(1, count)) as threads, ExitStack() as processes:
        for _ in range(count):
            worker = ChildProcess(_CHILD)
            processes.callback(worker.end)
            workers.put(worker)
        return dict(zip(logs, threads.map(one, logs), strict=True))


def _asked(
    worker: ChildProcess, log: AxisLog, estimator: str, task: EstimationTask
) -> Identification | StickslipError:
    """Return the result of a process, or its error."""
    found = worker.ask((log, estimator, task))
    if isinstance(found, Exception) and not isinstance(found, StickslipError):
        raise found
    return found


def serve() -> None:
    """Answer the requests of `identify_axes`."""

    def reply(request: Any) -> Any:
        log, estimator, task = request
        try:
            return identified([log], estimator, task)
        except Exception as error:  # noqa: BLE001 - raised again on the other side
            return error

    answer(reply)
