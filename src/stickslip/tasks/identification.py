"""Identification of friction from logs: reading, fitting and examining in one call."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path

from stickslip.estimation.base import EstimationTask, Estimator
from stickslip.estimation.registry import ESTIMATORS, EstimatorEntry, entry_of
from stickslip.logs import AxisSchema, LogSchema
from stickslip.records import AxisLog, EffortKind, Identification, InputError
from stickslip.tasks.reading import log_at, logs_at


def identify(
    log: AxisLog | Path | str | Sequence[AxisLog | Path | str],
    *,
    schema: Path | str | LogSchema | None = None,
    axis: str | int | None = None,
    columns: AxisSchema | None = None,
    estimator: str | Estimator = "auto",
    inertia: float | None = None,
    mass: float | None = None,
    load_inertia: float | None = None,
    load_mass: float | None = None,
    stiffness: float | None = None,
    per_direction: bool = False,
    offset: bool | None = None,
    stribeck: bool = False,
    cutoff: float | None = None,
    forgetting_factor: float | None = None,
    initial_variance: float | None = None,
    include: Sequence[str] = (),
    exclude: Sequence[str] = (),
    select: bool = True,
    effort_delay: float | Mapping[str, float] | None = None,
    effort_kind: EffortKind | None = None,
    known_load: tuple[float, float] | None = None,
    truth: Mapping[str, float] | None = None,
) -> Identification:
    """Identify the friction of an axis from a log, or from several logs jointly.

    Parameters
    ----------
    log
        A log, or the path of one; or several of one rigid axis, with estimator ``"auto"``. Several
        logs share inertia and friction. Each has its own offset, delay and drift, with its name in
        brackets, as in ``"offset[morning]"``.
    schema, axis
        How to read it, if it is a path (see `stickslip.logs.read_log`).
    columns
        Definitions of single columns, which take precedence over the schema.
    estimator
        Name in `stickslip.estimation.ESTIMATORS`, or an estimator, which has its own settings: none
        can be given beside it. An estimate by name that the default estimator contradicts is a
        ``model_mismatch``.
    inertia, mass
        Moving inertia or mass, whichever name, of the first body of a flexible arm [kg or kg m^2];
        None estimates it.
    load_inertia, load_mass
        Inertia or mass of the second body of a flexible arm [kg or kg m^2]; None for a rigid
        axis.
    stiffness
        Of the spring between the two [N/m or N m/rad]; None for a rigid axis.
    per_direction
        Whether each direction gets its own Coulomb and viscous friction.
    offset
        Whether a constant offset is estimated; None estimates it unless ``per_direction``.
    stribeck
        Whether static friction and Stribeck velocity are estimated too, with a Gaussian law
        (`stickslip.estimation.StribeckEstimator` has the exponential one); ``"energy"`` then stands
        for ``"stribeck-energy"``, ``"idim-ls"`` for ``"stribeck-idim-ls"``.
    cutoff
        Cutoff frequency of the low-pass for noisy signals [Hz]; None takes a tenth of the sampling
        rate and at most 100 Hz.
    forgetting_factor
        Of ``"published-energy"``, in (0, 1] [-]; None takes 1, without forgetting.
    initial_variance
        Of ``"published-energy"``: diagonal of P(0) [squared unit of the parameters over that of the
        energy]; None takes 1e3.
    include, exclude
        Of ``"auto"``: terms that the model has, whatever the log supports, and terms that it does
        not have (`stickslip.estimation.SelectedModelEstimator`).
    select
        Of ``"auto"``: whether further terms are selected.
    effort_delay
        Of ``"auto"``: known time by which the effort acts later than it is logged [s]; None
        estimates it if the log shows one. Of several logs also a mapping from the names of those
        whose delay is known.
    effort_kind
        Of ``"auto"``: ``"held"``, ``"sampled"`` or ``"mean"`` for an effort that is held from its
        time stamp to the next, the value at its time stamp, or the mean since the time stamp
        before; None takes it for held, or for what explains most if the time stamps are uneven.
    known_load
        Of ``"auto"``: mass [kg] and radius [m] of a weight on a lever that turns about a horizontal
        axis, where all else is balanced. Its gravity gives the torque constant of an effort in
        ampere; results are in N m and have the uncertainty of the constant in them.
    truth
        True values by parameter name [SI], for a log that was simulated; they are shown beside the
        estimates and used for nothing else.

    Returns
    -------
    The estimate with the data of its report.

    Raises
    ------
    InputError
        If the log cannot be read or used, a known value is impossible, there is no such estimator,
        or the estimator does not apply to the axis or does not use a setting, or the log does not
        determine the torque constant from a known load to 10 %; of several logs
        also if they are not of one rigid axis, or two of them are the same.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip.records import AxisLog
    >>> time = np.arange(0, 10, 0.001)
    >>> velocity = 0.1 * np.sin(2 * time) + 0.05 * np.sin(5 * time)
    >>> acceleration = 0.2 * np.cos(2 * time) + 0.25 * np.cos(5 * time)
    >>> position = -0.05 * np.cos(2 * time) - 0.01 * np.cos(5 * time)
    >>> effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity
    >>> log = AxisLog(name="stage", kind="linear", time=time, effort=effort,
    ...               measured_position=position)
    >>> found = identify(log)
    >>> found.estimate.status.value, round(found.estimate.value("coulomb_friction"), 1)
    ('ok', 1.5)

    Two logs of the same axis:

    >>> from dataclasses import replace
    >>> found = identify([log, replace(log, name="later", effort=effort + 0.2)])
    >>> found.estimate.joint.consistent, round(found.estimate.value("offset[later]"), 1)
    (True, 0.2)
    """
    if isinstance(estimator, str):
        entry_of(estimator)
    if mass is not None or load_mass is not None:
        if inertia is not None or load_inertia is not None:
            raise InputError("both_given", names=("mass", "inertia"))
        inertia, load_inertia = mass, load_mass
    # The log is read first: an error in its name comes before libraries that load for seconds.
    logs = logs_of(log, schema, axis, columns)
    delays = effort_delay if isinstance(effort_delay, Mapping) else {}
    task = EstimationTask(
        inertia=inertia,
        load_inertia=load_inertia,
        stiffness=stiffness,
        per_direction=per_direction,
        offset=offset,
        stribeck=stribeck,
        cutoff=cutoff,
        forgetting_factor=forgetting_factor,
        initial_variance=initial_variance,
        include=(include,) if isinstance(include, str) else tuple(include),
        exclude=(exclude,) if isinstance(exclude, str) else tuple(exclude),
        select=select,
        effort_delay=None if isinstance(effort_delay, Mapping) else effort_delay,
        effort_kind=effort_kind,
    )
    return identified(logs, estimator, task, delays=delays, known_load=known_load, truth=truth)


def identified(
    logs: Sequence[AxisLog],
    estimator: str | Estimator,
    task: EstimationTask,
    *,
    delays: Mapping[str, float] | None = None,
    known_load: tuple[float, float] | None = None,
    truth: Mapping[str, float] | None = None,
) -> Identification:
    """Identify the friction of an axis from logs that are read; see `identify`."""
    if known_load is not None and "gravity" not in task.include:
        task = replace(task, include=(*task.include, "gravity"))
    if len(logs) > 1 and task.flexible:
        raise InputError("joint_fit_of_arm")
    if isinstance(estimator, str):
        chosen = _named(estimator, task).make(task, logs[0].kind)
    else:
        chosen = _checked(estimator, task)
    if any(each.model_effort is not None for each in logs) and chosen.name != "auto":
        raise InputError("estimator_without_model_effort", estimator=chosen.name)
    if known_load is not None:
        return _with_load(logs, chosen, known_load, truth)
    if len(logs) > 1 or delays:
        return _jointly(logs, chosen, delays or {}, truth)
    from stickslip.estimation import examine

    found = examine(logs[0], chosen, truth=truth)
    if not isinstance(estimator, str) or task.flexible or chosen.name == "auto":
        return found
    from stickslip.tasks.second_opinion import checked

    return checked(found, task)


def _with_load(
    logs: Sequence[AxisLog],
    estimator: Estimator,
    known_load: tuple[float, float],
    truth: Mapping[str, float] | None,
) -> Identification:
    """Return the identification of a log in ampere, in N m by the gravity of a known load."""
    from stickslip.estimation import examine
    from stickslip.estimation.known_load import KnownLoad

    load = KnownLoad(mass=known_load[0], radius=known_load[1])
    if len(logs) > 1:
        raise InputError("known_load_of_several_logs")
    (log,) = logs
    if log.kind != "rotary" or not log.effort_unit:
        raise InputError("known_load_needs_current", where=log.name)
    found = examine(load.converted(log, estimator.fit(log)), estimator, truth=truth)
    return replace(found, estimate=load.widened(found.estimate))


def logs_of(
    log: AxisLog | Path | str | Sequence[AxisLog | Path | str],
    schema: Path | str | LogSchema | None,
    axis: str | int | None,
    columns: AxisSchema | None,
) -> list[AxisLog]:
    """Return a log, or several, as a list of logs that are read."""
    if isinstance(log, AxisLog):
        return [log]
    if not isinstance(log, Sequence) or isinstance(log, str | bytes):
        return [log_at(log, schema, axis, columns)]
    if not log:
        raise InputError("no_log")
    if len(log) == 1:
        return logs_of(log[0], schema, axis, columns)
    return logs_at(log, schema, axis, columns)


def _jointly(
    logs: Sequence[AxisLog],
    estimator: Estimator,
    delays: Mapping[str, float],
    truth: Mapping[str, float] | None,
) -> Identification:
    """Return the joint fit of several logs."""
    from stickslip.estimation import SelectedModelEstimator
    from stickslip.estimation.joint.estimator import JointEstimator
    from stickslip.estimation.joint.examine import examine_jointly

    if not isinstance(estimator, SelectedModelEstimator):
        raise InputError("estimator_of_one_log", estimator=estimator.name, logs=len(logs))
    if len(logs) == 1:
        raise InputError("delays_of_one_log")
    return examine_jointly(logs, JointEstimator(single=estimator, delays=delays), truth=truth)


def _named(name: str, task: EstimationTask) -> EstimatorEntry:
    """Return the entry of a name, with the Stribeck effect if the task asks for it."""
    entry = entry_of(name)
    if not task.stribeck or not entry.with_stribeck:
        return entry
    return ESTIMATORS[entry.with_stribeck]


def _checked(estimator: Estimator, task: EstimationTask) -> Estimator:
    """Validate an estimator object, and that no setting is given beside it."""
    if not isinstance(estimator, Estimator):  # pyright: ignore[reportUnnecessaryIsInstance]
        raise InputError("no_estimator_object", found=type(estimator).__name__)
    given = [field.name for field in fields(task) if getattr(task, field.name) != field.default]
    if given:
        raise InputError("setting_beside_estimator", name=given[0])
    return estimator
