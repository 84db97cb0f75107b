"""Every estimator on one log."""

import time
from collections.abc import Callable
from pathlib import Path

from stickslip import __version__
from stickslip.estimation.base import EstimationTask
from stickslip.logs import AxisSchema, LogSchema
from stickslip.records import AxisLog, ComparedEstimator, EstimatorComparison, StickslipError
from stickslip.tasks.compare.candidates import (
    Fitted,
    chosen_names,
    fitted,
    inertia_of,
)
from stickslip.tasks.reading import log_at

__all__ = ["compare_log", "timed"]

_LONG_FIT = 2.0  # s, beside which the time to load compiled code hardly counts


def compare_log(
    log: AxisLog | Path | str,
    *,
    schema: Path | str | LogSchema | None = None,
    axis: str | int | None = None,
    columns: AxisSchema | None = None,
    task: EstimationTask | None = None,
    only: tuple[str, ...] = (),
    progress: Callable[[int, int], None] | None = None,
) -> EstimatorComparison:
    """Let every estimator identify the friction of an axis from one log.

    One that does not apply says why. One that estimates no mass or inertia gets that of the energy
    estimator if none is given.

    Parameters
    ----------
    log
        A log, or the path of one.
    schema, axis
        How to read it, if it is a path (see `stickslip.logs.read_log`).
    columns
        What single columns are, in place of what the schema says of them.
    task
        What is known of the axis, and what to estimate; None for a rigid axis of which nothing is
        known.
    only
        Names of the estimators to compare; empty for all.
    progress
        Called before each estimator with how many are done, of how many.

    Returns
    -------
    What each found, how long it took, and how well it explains the log.

    Raises
    ------
    InputError
        If the log cannot be read, or what is known of the axis cannot be.

    Examples
    --------
    >>> import numpy as np
    >>> from stickslip.records import AxisLog
    >>> time = np.arange(0, 10, 0.002)
    >>> velocity = 0.1 * np.sin(2 * time) + 0.05 * np.sin(5 * time)
    >>> acceleration = 0.2 * np.cos(2 * time) + 0.25 * np.cos(5 * time)
    >>> position = -0.05 * np.cos(2 * time) - 0.01 * np.cos(5 * time)
    >>> effort = 3.0 * acceleration + 1.5 * np.sign(velocity) + 4.0 * velocity
    >>> log = AxisLog(name="stage", kind="linear", time=time, effort=effort,
    ...               measured_position=position)
    >>> compared = compare_log(log, only=("energy", "idim-ls")).compared
    >>> [each.name for each in compared]
    ['energy', 'idim-ls']
    """
    if not isinstance(log, AxisLog):
        log = log_at(log, schema, axis, columns)
    task = task or EstimationTask()
    names = chosen_names(only, task, log.kind)
    energy = fitted("energy", task, None, log)
    inertia = inertia_of(energy.estimate)
    compared: list[ComparedEstimator] = []
    for done, name in enumerate(names):
        if progress is not None:
            progress(done, len(names))
        found, seconds = timed(name, task, inertia, log)
        compared.append(_judged(log, task, name, found, seconds))
    return EstimatorComparison(log=log, compared=tuple(compared), stickslip_version=__version__)


def timed(
    name: str, task: EstimationTask, energy_inertia: float | None, log: AxisLog
) -> tuple[Fitted, float]:
    """Return what an estimator makes of a log, and the time of its fit over the samples [s].

    The second of two fits counts if the first is short, as that also loads compiled code.

    Parameters
    ----------
    name, task, energy_inertia, log
        As `fitted` takes them.
    """
    begun = time.perf_counter()
    found = fitted(name, task, energy_inertia, log)
    seconds = time.perf_counter() - begun
    if found.estimate is None:
        return found, 0.0
    if seconds < _LONG_FIT:
        begun = time.perf_counter()
        found = fitted(name, task, energy_inertia, log)
        seconds = time.perf_counter() - begun
    return found, seconds / len(log)


def _judged(
    log: AxisLog, task: EstimationTask, name: str, found: Fitted, seconds: float
) -> ComparedEstimator:
    """Return an estimate with how well it explains the log."""
    from stickslip.estimation import replay, unexplained_effort

    estimate = found.estimate
    if estimate is None:
        return ComparedEstimator(name=name, why_not=found.why_not)
    inertia = task.inertia if found.assumed_inertia is None else found.assumed_inertia
    left = resimulation = None
    try:
        if not task.flexible:
            left = unexplained_effort(log, estimate, inertia=inertia)
        resimulation = replay(
            log,
            estimate,
            inertia=inertia,
            load_inertia=task.load_inertia,
            stiffness=task.stiffness,
        )
    except StickslipError:
        # Too short for the filters, or a motion that cannot be simulated
        pass
    return ComparedEstimator(
        name=name,
        estimate=estimate,
        seconds_per_sample=seconds,
        unexplained_effort=left,
        resimulation=resimulation,
        assumed_inertia=found.assumed_inertia,
    )
