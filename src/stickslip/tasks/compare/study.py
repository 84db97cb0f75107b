"""Every estimator over many runs of a simulated scenario, whose truth is known."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import Float

from stickslip import __version__
from stickslip.estimation.base import EstimationTask
from stickslip.plants import FlexibleArm, Plant
from stickslip.records import (
    AxisLog,
    EstimatorScore,
    EstimatorStudy,
    InputError,
    ParameterScore,
)
from stickslip.scenario import Axis, Read, StudyFile, check_runs, read_study
from stickslip.simulation import simulate
from stickslip.tasks.compare.candidates import (
    Fitted,
    chosen_names,
    fitted,
    inertia_of,
)
from stickslip.tasks.compare.log import timed
from stickslip.tasks.parallel import in_parallel

__all__ = ["compare_scenario", "disturbance", "measured_log"]


@dataclass(frozen=True, kw_only=True)
class _Run:
    """What came of one run.

    Attributes
    ----------
    found
        By estimator.
    bound
        Cramer-Rao bound by parameter, as a standard deviation [SI]; empty where it does not apply.
    """

    found: Mapping[str, Fitted]
    bound: Mapping[str, float]


def compare_scenario(
    scenario: StudyFile | Path | str,
    *,
    runs: int | None = None,
    task: EstimationTask | None = None,
    only: tuple[str, ...] = (),
    progress: Callable[[int, int], None] | None = None,
) -> EstimatorStudy:
    """Let every estimator identify a simulated axis many times, and compare with the truth.

    Parameters
    ----------
    scenario
        The TOML file (see the guide on comparing estimators), or what `read_study` read from it.
    runs
        How many; None for as many as the scenario says.
    task
        What the estimators know of the axis, and what to estimate; None for nothing known. Load
        and spring of a flexible arm are known.
    only
        Names of the estimators to compare; empty for all.
    progress
        Called after each run with how many are done, of how many.

    Returns
    -------
    Bias, root mean square error, that over the Cramer-Rao bound, and coverage of the intervals, for
    every estimator and parameter.

    Raises
    ------
    InputError
        If the scenario cannot be used, or what is known of the axis cannot be.
    """
    read = scenario if isinstance(scenario, Read) else read_study(scenario)
    asked, known = read.scenario, task or EstimationTask()
    count = asked.runs if runs is None else runs
    check_runs(count)
    plant = asked.axis.build()
    if isinstance(plant, FlexibleArm):
        known = replace(known, load_inertia=plant.mass_2, stiffness=plant.stiffness)
    names = chosen_names(only, known, plant.kind)
    generators = np.random.default_rng(asked.sensors.seed).spawn(count)
    first = measured_log(read, generators[0])
    inertia = inertia_of(fitted("energy", known, None, first).estimate)
    opening = {name: timed(name, known, inertia, first) for name in names}
    bound, notes = _bound(read, plant, known, first)
    done = 1

    def advance() -> None:
        nonlocal done
        done += 1
        if progress is not None:
            progress(done, count)

    def run(k: int) -> _Run:
        log = measured_log(read, generators[k])
        if asked.input.random_phases:
            return _Run(
                found=_fitted_all(names, known, log), bound=_bound(read, plant, known, log)[0]
            )
        return _Run(found=_fitted_all(names, known, log), bound=bound)

    runs_done = [
        _Run(found={name: one for name, (one, _) in opening.items()}, bound=bound),
        *in_parallel(
            [lambda k=k: run(k) for k in range(1, count)],
            workers=os.cpu_count() or 1,
            advance=advance,
        ),
    ]
    truth = _truth(asked.axis, known)
    return EstimatorStudy(
        name=read.name,
        kind=plant.kind,
        runs=count,
        samples=len(first),
        scenario=asked.tables(),
        truth=truth,
        bound={name: _rms(np.array([run.bound[name] for run in runs_done])) for name in bound},
        scores=tuple(
            _score(name, runs_done, opening[name][1], truth, delay=asked.input.effort_delay)
            for name in names
        ),
        notes=notes,
        file=read.path.name,
        sha256=read.sha256,
        stickslip_version=__version__,
    )


def measured_log(read: StudyFile, generator: np.random.Generator) -> AxisLog:
    """Return the log of one run: disturbed, started anywhere within an encoder step, measured.

    Parameters
    ----------
    read
        The scenario.
    generator
        Where all that is random comes from.
    """
    asked = read.scenario
    plant, sensors = asked.axis.build(), asked.sensors.build()
    effort, step = asked.input.build(read.path.parent, generator)
    acting = asked.input.acting(effort) + disturbance(
        effort.size,
        asked.input.disturbance,
        asked.input.disturbance_correlation,
        generator,
    )
    start = float(generator.uniform(0.0, sensors.encoder_step)) if sensors.encoder_step else 0.0
    state = (start, 0.0) * (2 if asked.axis.flexible else 1)
    motion = simulate(plant, acting, sampling_time=step, initial_state=state)
    log = sensors.measure(motion, generator, name=read.name)
    commanded = log.effort.copy()
    commanded[: effort.size], commanded[effort.size :] = effort, effort[-1]
    return replace(log, effort=commanded)


def disturbance(
    samples: int, deviation: float, correlation: float, generator: np.random.Generator
) -> Float[np.ndarray, " n"]:
    """Return a first-order autoregression.

    Parameters
    ----------
    samples
        How many.
    deviation
        Its standard deviation [N or N m].
    correlation
        From sample to sample [-].
    generator
        Where it comes from.
    """
    from scipy.signal import lfilter

    white = generator.standard_normal(samples)
    white[1:] *= np.sqrt(1.0 - correlation**2)
    return deviation * np.asarray(lfilter([1.0], [1.0, -correlation], white))


def _fitted_all(names: tuple[str, ...], task: EstimationTask, log: AxisLog) -> dict[str, Fitted]:
    energy = fitted("energy", task, None, log)
    inertia = inertia_of(energy.estimate)
    return {
        name: energy if name == "energy" else fitted(name, task, inertia, log) for name in names
    }


def _truth(axis: Axis, task: EstimationTask) -> dict[str, float]:
    """Return the truth by the names of parameters; of both directions together, their mean."""
    truth = axis.truth()
    if axis.kind == "rotary":
        truth = {"inertia": truth.pop("mass")} | truth
    if task.per_direction:  # an offset is then part of the friction that each direction has
        for name in ("coulomb_friction", "static_friction"):
            truth[f"{name}_positive"] += truth["offset"]
            truth[f"{name}_negative"] -= truth["offset"]
    elif task.has_offset:  # and what sets the directions apart is part of the offset
        apart = truth["coulomb_friction_positive"] - truth["coulomb_friction_negative"]
        truth["offset"] += 0.5 * apart
    return truth


def _bound(
    read: StudyFile,
    plant: Plant,
    task: EstimationTask,
    log: AxisLog,
) -> tuple[dict[str, float], tuple[str, ...]]:
    """Return the Cramer-Rao bound by parameter, and what there is to say of it."""
    from stickslip.estimation import EnergyEstimator, cramer_rao_bound

    terms = EnergyEstimator(
        inertia=None, per_direction=task.per_direction, offset=task.offset
    ).terms
    body = "mass" if plant.kind == "linear" else "inertia"
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
    """Return how near an estimator comes."""
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
