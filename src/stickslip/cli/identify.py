"""``stickslip identify``: from logs to friction parameters with intervals and verdicts."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import Parameter

from stickslip.cli.arguments import (
    WANTED,
    EstimatedFriction,
    Flag,
    KnownAxis,
    KnownLoad,
    LogReading,
    RobotJoints,
    Words,
    wanted,
)
from stickslip.cli.outputs import ResultFiles
from stickslip.cli.terminal import axis_progress, working

if TYPE_CHECKING:
    from stickslip import EstimationTask
    from stickslip.errors import InputError
    from stickslip.records import AxisLog, Identification

EXAMPLES = """Examples:
  stickslip identify stage.csv --report stage.html
  stickslip identify DATA_EMPS.mat --schema examples/emps.toml --json -
  stickslip identify staubli_tx40 --schema examples/tx40.toml --axis 1
  stickslip identify log.csv --position "motor / 32" --effort "0.35 * amps"
  stickslip identify morning.csv noon.csv evening.csv --report joint.html
  stickslip identify robot.csv --kind rotary --report robot.html
  stickslip identify robot.mcap --urdf robot.urdf --torque-constant 0.11 --gear-ratio 101
  stickslip identify lever.csv --unit effort=A --known-load 2.5@0.3
  stickslip identify arm.csv --mass 1.2 --load-mass 0.8 --stiffness 450"""


@Parameter(name="*", group=WANTED)
@dataclass(frozen=True, kw_only=True)
class Model(EstimatedFriction):
    """Model to estimate, and settings of estimators."""

    stribeck: Flag = False
    """Estimate static friction and Stribeck velocity too, with estimator auto, energy or
    idim-ls."""
    cutoff: float | None = None
    """Cutoff frequency of the low-pass for noisy signals, in Hz, with estimator energy or idim-ls.
    [default: a tenth of the sampling rate, at most 100 Hz]"""
    forgetting_factor: float | None = None
    """Forgetting factor of estimator published-energy, in (0, 1]. [default: 1]"""
    initial_variance: float | None = None
    """Initial covariance P(0) of estimator published-energy, diagonal value. [default: 1000]"""
    include: Words = None
    """Term that the model of estimator auto has in any case, such as spring, gravity or stribeck;
    repeat the option for several."""
    exclude: Words = None
    """Term that the model of estimator auto does not have; repeat the option for several."""
    select: bool = True
    """Whether estimator auto selects the terms of its model."""
    effort_delay: Annotated[list[str] | None, Parameter(negative="", allow_leading_hyphen=True)] = (
        None
    )
    """Known time by which the effort acts later than it is logged, in s, with estimator auto; of
    one of several logs as in --effort-delay morning=0.002, repeated for others. [default:
    estimated, if the log shows one]"""
    effort_kind: Literal["held", "sampled", "mean"] | None = None
    """Meaning of a logged effort, with estimator auto: held from its time stamp to the next, the
    value sampled at its time stamp, or the mean since the time stamp before. [default: held; with
    uneven time stamps, what explains most]"""


def identify(
    log: Annotated[
        Path,
        Parameter(
            help="The log: text (CSV, TSV, TwinCAT Scope), MATLAB .mat, NPY, NPZ, Parquet, "
            "Feather, HDF5, ROS bag, MCAP, MDF, TDMS, LeRobot or SysId; - is standard input; or a "
            "folder with a schema that names its files. Several logs of one axis are fitted "
            "jointly."
        ),
    ],
    /,
    *others: Path,
    reading: LogReading | None = None,
    known: KnownAxis | None = None,
    robot: RobotJoints | None = None,
    weight: KnownLoad | None = None,
    estimator: Annotated[
        str,
        wanted(help="Name of the estimator: one that stickslip compare lists."),
    ] = "auto",
    model: Model | None = None,
    validate: Annotated[
        Path | None,
        wanted(
            help="Another log of the same axes, read in the same way: the error of the prediction "
            "of its effort is reported. Exit code 1 if it cannot be predicted."
        ),
    ] = None,
    files: ResultFiles | None = None,
) -> int:
    """Identify the friction of an axis from its log, or from several logs jointly.

    Of a log with several axes all are identified, in two processes, unless --axis chooses one.

    Prints each parameter with its 95 % interval and whether the log determines it at all. The
    interval allows for residuals that are correlated. Without a schema obvious columns are found,
    and what was assumed is printed.
    """
    from stickslip.errors import InputError

    reading, known = reading or LogReading(), known or KnownAxis()
    robot, weight = robot or RobotJoints(), weight or KnownLoad()
    model, files = model or Model(), files or ResultFiles()
    logs = [log, *others]
    read = logs if validate is None else [*logs, validate]
    if others and robot.urdf is not None:
        raise InputError("robot_of_several_logs")
    reading.units()  # options are refused before the files
    load = weight.load()
    delay = _effort_delay(model.effort_delay or [])
    settings: dict[str, Any] = {
        **vars(known),
        **vars(model),
        "include": tuple(model.include or ()),
        "exclude": tuple(model.exclude or ()),
        "effort_delay": None if isinstance(delay, dict) else delay,
    }
    files.check(inputs=[*robot.inputs, *(path for each in read for path in reading.inputs(each))])
    what = log.name if not others else f"{len(logs)} logs"
    delays = delay if isinstance(delay, dict) else {}
    given: list[Path | AxisLog] = list(logs)
    axes: Mapping[str, AxisLog | InputError] = {}
    with working(f"reading {what}"):
        from stickslip import EstimationTask

        task = EstimationTask(**settings)
        if not others and (reading.axis is None or robot.urdf is not None):
            axes = _axes(log, reading, robot)
    if len(axes) > 1:
        if load is not None:
            raise InputError("known_load_of_several_axes", where=log.name, axes=list(axes))
        if delays:
            raise InputError("effort_delays_of_axes")
        other = None
        if validate is not None:
            with working(f"reading {validate.name}"):
                other = validate.name, _axes(validate, reading, robot)
        return _all_axes(log.stem, axes, other, estimator, task, files)
    for only in axes.values():
        if isinstance(only, InputError):
            raise only
        given = [only]
    with working(f"identifying {what}"):
        from stickslip.tasks import validated
        from stickslip.tasks.identification import identified, logs_of

        found = identified(
            logs_of(given, reading.schema, reading.axis, reading.columns()),
            estimator,
            task,
            delays=delays,
            known_load=load,
        )
        if validate is not None:
            other = _other(validate, reading, robot)
            found = validated(found, other, validate.name, known.inertia)
        files.write_all(found)
    from stickslip.presentation.terminal import print_identification

    files.print(found, print_identification)
    return 0 if found.estimate.status.trusted and _predicted(found) else 1


def _all_axes(
    name: str,
    axes: "Mapping[str, AxisLog | InputError]",
    other: "tuple[str, Mapping[str, AxisLog | InputError]] | None",
    estimator: str,
    task: "EstimationTask",
    files: ResultFiles,
) -> int:
    """Identify every axis of a log, print and write the results, and return the exit code.

    ``other`` is the name of a log for the validation, and its axes.
    """
    with axis_progress(list(axes)) as progress:
        from stickslip.tasks.axes import axes_validated, identify_axes

        found = identify_axes(axes, name=name, estimator=estimator, task=task, progress=progress)
        if other is not None:
            found = axes_validated(found, other[1], other[0], task.inertia)
        files.write_all(found)
    from stickslip.presentation.terminal import print_axes

    files.print(found, print_axes)
    return 0 if found.trusted and all(map(_predicted, found.axes.values())) else 1


def _predicted(found: "Identification") -> bool:
    """Return whether the estimate predicts the log of its validation, if there is one."""
    return found.validation is None or found.validation.error is not None


def _axes(
    log: Path, reading: LogReading, robot: RobotJoints
) -> "Mapping[str, AxisLog | InputError]":
    """Return the axes of a log, with the efforts of a robot's links if there is a model of it."""
    from stickslip.tasks.axes import axes_at, axes_of_robot, kind_of_joints, one_axis

    joints = robot.joint or ()
    kind = None if robot.urdf is None else kind_of_joints(robot.urdf, joints)
    axes = axes_at(log, reading.schema, reading.columns(), kind)
    if robot.urdf is not None:
        axes = axes_of_robot(axes, robot.urdf, joints)
        if reading.axis is not None:
            axes = {reading.axis: one_axis(axes, reading.axis, label=log.name)}
    return axes


def _other(log: Path, reading: LogReading, robot: RobotJoints) -> "AxisLog | InputError":
    """Return another log of the axis that is identified."""
    if robot.urdf is not None:
        from stickslip.tasks.axes import one_axis

        return one_axis(_axes(log, reading, robot), None, label=log.name)
    from stickslip.tasks.reading import log_at

    return log_at(log, reading.schema, reading.axis, reading.columns())


def _effort_delay(words: list[str]) -> float | dict[str, float] | None:
    """Return the delay of all logs, or of some by name [s], from numbers and ``log=number``."""
    from stickslip.errors import InputError

    delays: dict[str, float] = {}
    for word in words:
        log, _, number = word.rpartition("=")
        if log and log in delays:
            raise InputError("delay_given_twice", log=log)
        try:
            delays[log] = float(number)
        except ValueError:
            raise InputError("delay_not_understood", word=word) from None
    if not delays:
        return None
    if "" in delays and len(words) > 1:
        raise InputError("delay_of_all_and_one")
    return delays.get("", delays)
