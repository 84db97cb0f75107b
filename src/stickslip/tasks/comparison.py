"""Comparison of estimators: on one log, or over many runs of a simulated scenario."""

import os
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float
from numba.core import event

from stickslip import __version__
from stickslip.estimation.base import EstimationTask
from stickslip.estimation.registry import ESTIMATORS, entry_of
from stickslip.logs import AxisSchema, LogSchema
from stickslip.plants import FlexibleArm, Plant
from stickslip.records import (
    AxisKind,
    AxisLog,
    ComparedEstimator,
    EstimatorComparison,
    EstimatorScore,
    EstimatorStudy,
    FrictionEstimate,
    InputError,
    ParameterScore,
    StickslipError,
    mass_name,
)
from stickslip.scenario import Axis, Read, StudyFile, check_runs, read_study
from stickslip.simulation import simulate
from stickslip.tasks.parallel import in_parallel
from stickslip.tasks.reading import log_at

_LONG_FIT = 0.5  # s, beside which the time to load compiled code is small


@dataclass(frozen=True, kw_only=True)
class _Fitted:
    """An estimate, or the reason why there is none."""

    estimate: FrictionEstimate | None = None
    why_not: str = ""
    assumed_inertia: float | None = None  # given to the estimator though not known [kg or kg m^2]


@dataclass(frozen=True, kw_only=True)
class _Run:
    """Fits of one run by estimator, and its Cramer-Rao bound by parameter [SI], if there is one."""

    found: Mapping[str, _Fitted]
    bound: Mapping[str, float]


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
    """Identify the friction of an axis from one log with every estimator.

    For an estimator that does not apply, the result has the reason. An estimator that does not
    estimate the mass or inertia gets that of the energy estimator if none is given.

    Parameters
    ----------
    log
        A log, or the path of one.
    schema, axis
        How to read it, if it is a path (see `stickslip.logs.read_log`).
    columns
        Definitions of single columns, which take precedence over the schema.
    task
        Known parameters of the axis, and the terms to estimate; None for an unknown rigid axis.
    only
        Names of the estimators to compare; empty for all.
    progress
        Called before each estimator with the number done and the number of all.

    Returns
    -------
    The estimates, with the time and the residuals of each.

    Raises
    ------
    InputError
        If the log cannot be read, or the known parameters are not valid.

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
    names = _chosen_names(only, task, log.kind)
    energy = _fitted("energy", task, None, log)
    inertia = _inertia_of(energy.estimate)
    compared: list[ComparedEstimator] = []
    for done, name in enumerate(names):
        if progress is not None:
            progress(done, len(names))
        found, seconds = _timed(name, task, inertia, log)
        compared.append(_judged(log, task, name, found, seconds))
    return EstimatorComparison(log=log, compared=tuple(compared), stickslip_version=__version__)


def _chosen_names(only: tuple[str, ...], task: EstimationTask, kind: AxisKind) -> tuple[str, ...]:
    """Return the names of the estimators to compare, in the order of the registry.

    A task that is not valid, an unknown name, and a setting that no compared estimator uses are
    errors.
    """
    task.check(kind)
    for name in only:
        entry_of(name)
    names = tuple(name for name in ESTIMATORS if not only or name in only)
    if task.largest_delay and "maximum-likelihood" not in names:
        raise InputError("delay_not_compared", samples=task.largest_delay)
    return names


def _fitted(name: str, task: EstimationTask, energy_inertia: float | None, log: AxisLog) -> _Fitted:
    """Return the estimate of a log, or why the estimator does not apply to it.

    Settings that the estimator does not have are not used. ``energy_inertia`` is the mass or
    inertia of the energy estimator [kg or kg m^2], for estimators that need one.
    """
    entry = entry_of(name)
    try:
        estimate = entry.make(entry.usable(task), log.kind, energy_inertia).fit(log)
    except StickslipError as error:
        return _Fitted(why_not=error.what)
    assumes = entry.needs_inertia and task.inertia is None
    return _Fitted(estimate=estimate, assumed_inertia=energy_inertia if assumes else None)


def _inertia_of(estimate: FrictionEstimate | None) -> float | None:
    """Return the positive mass or inertia of an estimate [kg or kg m^2]; None if it has none."""
    for name in ("mass", "inertia"):
        parameter = None if estimate is None else estimate.parameters.get(name)
        if parameter is not None and parameter.value is not None and parameter.value > 0:
            return parameter.value
    return None


def _timed(
    name: str, task: EstimationTask, energy_inertia: float | None, log: AxisLog
) -> tuple[_Fitted, float]:
    """Return the fit of a log, and its time over the number of samples [s].

    If the first fit is short, or compiles kernels, the time is that of a second one: the first also
    loads compiled code.
    """

    def timed() -> tuple[_Fitted, float]:
        begun = time.perf_counter()
        return _fitted(name, task, energy_inertia, log), time.perf_counter() - begun

    with event.install_recorder("numba:compile") as compilations:
        found, seconds = timed()
    if found.estimate is None:
        return found, 0.0
    if seconds < _LONG_FIT or compilations.buffer:
        found, seconds = timed()
    return found, seconds / len(log)


def _judged(
    log: AxisLog, task: EstimationTask, name: str, found: _Fitted, seconds: float
) -> ComparedEstimator:
    """Return an estimate with its residuals on the log."""
    from stickslip.estimation import replay, unexplained_effort
    from stickslip.estimation.selection.judgement.plausibility import unexplained
    from stickslip.estimation.selection.judgement.status import judged

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
    if left is not None and estimate.status.trusted:
        estimate = judged(estimate, unexplained(log, left))
    return ComparedEstimator(
        name=name,
        estimate=estimate,
        seconds_per_sample=seconds,
        unexplained_effort=left,
        resimulation=resimulation,
        assumed_inertia=found.assumed_inertia,
    )


def compare_scenario(
    scenario: StudyFile | Path | str,
    *,
    runs: int | None = None,
    task: EstimationTask | None = None,
    only: tuple[str, ...] = (),
    progress: Callable[[int, int], None] | None = None,
) -> EstimatorStudy:
    """Identify a simulated axis many times with every estimator, and compare with the truth.

    Parameters
    ----------
    scenario
        The TOML file (see the guide on comparing estimators), or what `read_study` read from it.
    runs
        Number of runs; None for that of the scenario.
    task
        Known parameters of the axis, and the terms to estimate; None for none. Load and spring of a
        flexible arm are known.
    only
        Names of the estimators to compare; empty for all.
    progress
        Called after each run with the number done and the number of all.

    Returns
    -------
    Bias, root mean square error, that over the Cramer-Rao bound, and coverage of the intervals, for
    every estimator and parameter.

    Raises
    ------
    InputError
        If the scenario or the known parameters are not valid.
    """
    read = scenario if isinstance(scenario, Read) else read_study(scenario)
    study, known = read.scenario, task or EstimationTask()
    count = study.runs if runs is None else runs
    check_runs(count)
    plant = study.axis.build()
    if isinstance(plant, FlexibleArm):
        known = replace(known, load_inertia=plant.mass_2, stiffness=plant.stiffness)
    names = _chosen_names(only, known, plant.kind)
    generators = np.random.default_rng(study.sensors.seed).spawn(count)
    first = measured_log(read, generators[0])
    inertia = _inertia_of(_fitted("energy", known, None, first).estimate)
    opening = {name: _timed(name, known, inertia, first) for name in names}
    bound, notes = _bound(read, plant, known, first)
    done = 1

    def advance() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, count)

    def run(k: int) -> _Run:
        log = measured_log(read, generators[k])
        energy = _fitted("energy", known, None, log)
        inertia = _inertia_of(energy.estimate)
        found = {
            name: energy if name == "energy" else _fitted(name, known, inertia, log)
            for name in names
        }
        own = _bound(read, plant, known, log)[0] if study.input.random_phases else bound
        return _Run(found=found, bound=own)

    runs_done = [
        _Run(found={name: one for name, (one, _) in opening.items()}, bound=bound),
        *in_parallel(
            [lambda k=k: run(k) for k in range(1, count)],
            workers=os.cpu_count() or 1,
            advance=advance,
        ),
    ]
    truth = _truth(study.axis, known)
    return EstimatorStudy(
        name=read.name,
        kind=plant.kind,
        runs=count,
        samples=len(first),
        scenario=study.tables(),
        truth=truth,
        bound={name: _rms(np.array([run.bound[name] for run in runs_done])) for name in bound},
        scores=tuple(
            _score(name, runs_done, opening[name][1], truth, delay=study.input.effort_delay)
            for name in names
        ),
        notes=notes,
        file=read.path.name,
        sha256=read.sha256,
        stickslip_version=__version__,
    )


def measured_log(read: StudyFile, generator: np.random.Generator) -> AxisLog:
    """Return the log of one run, which starts at a random position within an encoder step."""
    study = read.scenario
    plant, sensors = study.axis.build(), study.sensors.build()
    effort, step = study.input.build(read.path.parent, generator)
    acting = study.input.acting(effort) + disturbance(
        effort.size,
        study.input.disturbance,
        study.input.disturbance_correlation,
        generator,
    )
    start = float(generator.uniform(0.0, sensors.encoder_step)) if sensors.encoder_step else 0.0
    state = (start, 0.0) * (2 if study.axis.flexible else 1)
    motion = simulate(plant, acting, sampling_time=step, initial_state=state)
    log = sensors.measure(motion, generator, name=read.name)
    commanded = log.effort.copy()
    commanded[: effort.size], commanded[effort.size :] = effort, effort[-1]
    return replace(log, effort=commanded)


def disturbance(
    samples: int, deviation: float, correlation: float, generator: np.random.Generator
) -> Float[np.ndarray, " n"]:
    """Return a first-order autoregression of a standard deviation [N or N m]."""
    from scipy.signal import lfilter

    white = generator.standard_normal(samples)
    white[1:] *= np.sqrt(1.0 - correlation**2)
    return deviation * np.asarray(lfilter([1.0], [1.0, -correlation], white))


def _truth(axis: Axis, task: EstimationTask) -> dict[str, float]:
    """Return the truth by parameter [SI]; of both directions together, their mean."""
    truth = axis.truth()
    if axis.kind == "rotary":
        truth = {"inertia": truth.pop("mass")} | truth
    if task.per_direction:  # the friction of each direction contains the offset
        for name in ("coulomb_friction", "static_friction"):
            truth[f"{name}_positive"] += truth["offset"]
            truth[f"{name}_negative"] -= truth["offset"]
    elif task.has_offset:  # the offset contains half the difference of the directions
        apart = truth["coulomb_friction_positive"] - truth["coulomb_friction_negative"]
        truth["offset"] += 0.5 * apart
    return truth


def _bound(
    read: StudyFile,
    plant: Plant,
    task: EstimationTask,
    log: AxisLog,
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the Cramer-Rao bound by parameter [SI], and notes on it."""
    from stickslip.estimation import EnergyEstimator, cramer_rao_bound

    terms = EnergyEstimator(
        inertia=None, per_direction=task.per_direction, offset=task.offset
    ).terms
    body = mass_name(plant.kind)
    sought = (*(() if task.inertia is not None else (body,)), *terms.names)
    axis = read.scenario.axis
    if axis.law != "coulomb":
        return {}, (
            f"the axis is simulated with {axis.title}, and estimators are scored by its friction "
            "in steady motion: one that knows Coulomb and viscous friction only takes the rest for "
            "these",
            "no Cramér-Rao bound: it is for Coulomb and viscous friction",
        )
    if read.scenario.input.disturbance:
        return {}, (
            "no Cramér-Rao bound: it is for a known effort, and a force disturbs the axis here",
        )
    try:
        bound = cramer_rao_bound(
            plant,
            read.scenario.input.acting(log.effort[:-1]),
            sampling_time=log.sampling_time,
            sensors=read.scenario.sensors.build(),
            sought=sought,
        )
    except InputError as error:
        return {}, (f"no Cramér-Rao bound: {error.what}",)
    return bound.std, (
        "the Cramér-Rao bound is for unbiased estimators that seek the same parameters: "
        "others are not compared with it",
    )


def _score(
    name: str,
    runs: Sequence[_Run],
    seconds: float,
    truth: dict[str, float],
    *,
    delay: int,
) -> EstimatorScore:
    """Return the errors of an estimator over all runs; ``seconds`` is its time a sample."""
    found = [run.found[name] for run in runs]
    estimates = [each.estimate for each in found if each.estimate is not None]
    if not estimates:
        return EstimatorScore(name=name, why_not=found[0].why_not)
    looked_for = [each.diagnostics.effort_delay for each in estimates]
    delays = [each for each in looked_for if each is not None]
    assumes = any(each.assumed_inertia is not None for each in found)
    sought = {key for each in estimates for key, p in each.parameters.items() if p.identified}
    bound = set(runs[0].bound)
    bounded = sought | ({"mass", "inertia"} & bound if assumes else set()) == bound
    scores: dict[str, ParameterScore] = {}
    for key in estimates[0].parameters:
        if key not in truth:
            continue
        held = [each.parameters[key] for each in estimates]
        values = np.array([p.value for p in held if p.value is not None])
        if not values.size:
            continue
        error = values - truth[key]
        least = [
            run.bound.get(key, 0.0)
            for run in runs
            if (one := run.found[name].estimate) is not None
            and one.parameters[key].value is not None
        ]
        ends = [p.ci95 for p in held if p.ci95 is not None]
        inside = [low <= truth[key] <= high for low, high in ends]
        comparable = bounded and all(0.0 < each < np.inf for each in least)
        scores[key] = ParameterScore(
            name=key,
            truth=truth[key],
            bias=float(np.mean(error)),
            rmse=_rms(error),
            runs=int(values.size),
            bound_ratio=_rms(error / np.array(least)) if comparable else None,
            coverage=float(np.mean(inside)) if inside else None,
        )
    return EstimatorScore(
        name=name,
        trusted=sum(each.status.trusted for each in estimates) / len(found),
        seconds_per_sample=seconds,
        assumes_inertia=assumes,
        delay_found=sum(each == delay for each in delays) / len(found) if delays else None,
        scores=scores,
    )


def _rms(values: Float[np.ndarray, " n"]) -> float:
    return float(np.sqrt(np.mean(values**2)))
