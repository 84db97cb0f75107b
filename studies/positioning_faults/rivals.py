"""Compare controllers of a rigid axis: ``python -m studies.positioning_faults.rivals``.

Prints one table for each sampling time and ratio of effort limit to friction, or one of all of them
without faults.
"""

import argparse
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from itertools import chain, product
from math import isfinite
from pathlib import Path

import numpy as np
from jaxtyping import Float
from rich.progress import track
from scipy.integrate import quad

from studies.markdown import table
from studies.mismatch.plant import FINE_STEP, HeldPlant
from studies.positioning_faults.cases import AXIS_CASES, Case
from studies.positioning_faults.run import PUSHED, Axis, Outcome, axes, move_axis

_METHODS = ("precise", "exact", "profile")
_UNKNOWN = "precise, no guess"
_SEED = 1
_LOGGED = 0.01  # standard deviation of mass and friction from a log, over the values


def shortest_time(axis: Axis) -> float:
    """Return the time of full acceleration and full braking to the target, without faults [s]."""
    plant, limit = axis.plant, float(axis.tables["controller"]["effort_limit"])
    m, F, c = plant.mass, plant.coulomb_positive, plant.viscous_positive

    def parts(v: float) -> tuple[float, float]:
        """Return time and way up to a speed and down from it."""
        time = way = 0.0
        for sign in (1.0, -1.0):
            time += quad(lambda w, s=sign: m / (limit - s * (F + c * w)), 0.0, v)[0]
            way += quad(lambda w, s=sign: m * w / (limit - s * (F + c * w)), 0.0, v)[0]
        return time, way

    low, high = 0.0, 0.9999 * (limit - F) / c
    for _ in range(50):
        v = 0.5 * (low + high)
        low, high = (v, high) if parts(v)[1] < abs(axis.targets[0]) else (low, v)
    return parts(low)[0]


def _unsafe(outcomes: Sequence[Outcome]) -> bool:
    """Return whether a controller raised an error, or sent an effort above its limit."""
    return any(o.raised or not o.peak <= 1.0 + 1e-9 for o in outcomes)


def _quantiles(
    outcomes: Sequence[Outcome], shortest: Float[np.ndarray, " axes"]
) -> tuple[float, float]:
    """Return the median and the 90 % quantile of the settling times, over the shortest.

    The time of an axis that does not settle is infinite.
    """
    times = np.nan_to_num([o.settling[0] for o in outcomes], nan=np.inf) / shortest
    median, most = np.quantile(times, [0.5, 0.9], method="higher")
    return float(median), float(most)


def _settled(outcomes: Sequence[Outcome], shortest: Float[np.ndarray, " axes"]) -> str:
    """Return how many end within the tolerance, the median and the 90 % time, wrong outcomes."""
    if _unsafe(outcomes):
        return "error"
    wrong = sum(o.false for o in outcomes)
    errors = f", {wrong} wrong" if wrong else ""
    inside = sum(isfinite(o.settling[0]) for o in outcomes)
    shown = [f"{x:.1f}" if isfinite(x) else "–" for x in _quantiles(outcomes, shortest)]
    return f"{inside}: {shown[0]} ({shown[1]}){errors}"


def _stopped(outcomes: Sequence[Outcome]) -> str:
    """Return how many stop, the most frequent reason, and how many leave their travel."""
    if _unsafe(outcomes):
        return "error"
    reasons = Counter(
        reason.split(": ")[0] for o in outcomes for reason in o.why if reason
    ).most_common(1)
    left = sum(o.left for o in outcomes)
    ends = f", {left} leave their travel" if left else ""
    return f"{reasons[0][1]}: {reasons[0][0]}{ends}" if reasons else f"no reason{ends}"


def _unheld(axis: Axis, case: Case) -> bool:
    """Return whether the push takes the axis out of its travel whatever acts against it.

    The whole limit does from the first sample on in which the axis has moved.
    """
    T, limit = axis.sampling_time, float(axis.tables["controller"]["effort_limit"])
    plant = HeldPlant(axis.plant, start=axis.targets[0], steps=round(T / FINE_STEP))
    low, _ = axis.scenario().build(Path()).guarded.limits.travel
    lowest, k = axis.targets[0], 0
    while k == 0 or plant.motion[1] < 0.0:
        push = case.channels.push * limit if k * T < PUSHED else 0.0
        plant.advance(limit if k else 0.0, push)
        lowest, k = min(lowest, plant.motion[0]), k + 1
    return lowest < low


def _unguessed(axis: Axis) -> Axis:
    """Return the axis without a guess of friction."""
    guess = {"mass": axis.tables["guess"]["mass"]}
    return replace(axis, tables={**axis.tables, "guess": guess})


def _known(axis: Axis, generator: np.random.Generator) -> Axis:
    """Return the axis with mass and friction known within 1 %, as from a log."""
    mass, coulomb, viscous = (
        value * generator.normal(1.0, _LOGGED)
        for value in (axis.plant.mass, axis.plant.coulomb_positive, axis.plant.viscous_positive)
    )
    guess = {
        "mass": mass,
        "coulomb_friction": coulomb,
        "viscous_friction": viscous,
        "mass_uncertainty": _LOGGED,
        "friction_uncertainty": _LOGGED,
        "asymmetry": _LOGGED,
    }
    return replace(axis, tables={**axis.tables, "guess": {**axis.tables["guess"], **guess}})


def _without_friction(axis: Axis, _: np.random.Generator) -> Axis:
    """Return the axis without a guess of friction, and with its delay of 0 given."""
    tables = _unguessed(axis).tables
    return replace(axis, tables={**tables, "controller": {**tables["controller"], "delay": 0.0}})


_PRIOR = {"known within 1 %, delay not given": _known, "unknown, delay given": _without_friction}


def faultless(
    count: int, sampling_times: Sequence[float], ratios: Sequence[float], seed: int = _SEED
) -> str:
    """Return the table of settling times without faults, with friction known and unknown."""
    rows = []
    for sampling_time, (friction, prepared) in product(sampling_times, _PRIOR.items()):
        for ratio in track(ratios, transient=True):
            generator = np.random.default_rng([seed, 1])
            drawn = axes(count, seed, method="precise", sampling_time=sampling_time, ratio=ratio)
            shortest = np.array([shortest_time(axis) for axis in drawn])
            moved = [move_axis(prepared(axis, generator), AXIS_CASES[0]) for axis in drawn]
            if _unsafe(moved) or any(o.false for o in moved):
                raise RuntimeError(
                    f"a move at {sampling_time:g} s and {ratio:g} is wrong: {friction}"
                )
            median, most = _quantiles(moved, shortest)
            whole = np.ceil(shortest / sampling_time) * sampling_time / shortest
            rows.append(
                [
                    friction,
                    f"{1e3 * sampling_time:g} ms",
                    f"{ratio:g}",
                    f"{np.median(shortest / sampling_time):.1f}",
                    f"{np.median(whole):.2f}",
                    f"{median:.2f}",
                    f"{most:.2f}",
                ]
            )
    names = ["friction", "sampling time", "limit over friction", "shortest time [samples]"]
    return table([*names, "in whole samples, over the shortest", "median", "90 %"], rows)


def study(
    count: int, sampling_time: float, ratio: float, cases: Sequence[Case], seed: int = _SEED
) -> str:
    """Return the table of cases at a sampling time and a ratio of effort limit to friction."""
    by_method = {
        method: axes(count, seed, method=method, sampling_time=sampling_time, ratio=ratio)
        for method in _METHODS
    }
    shortest = np.array([shortest_time(axis) for axis in by_method["precise"]])
    by_method[_UNKNOWN] = [_unguessed(axis) for axis in by_method["precise"]]
    moved = {  # the outcomes of each column
        case.name: [[move_axis(axis, case) for axis in drawn] for drawn in by_method.values()]
        for case in track(cases, transient=True)
    }
    mild = [case for case in cases if case.mild]
    rows = [[case.name, *(_settled(o, shortest) for o in moved[case.name])] for case in mild]
    if len(mild) > 1:
        times = np.tile(shortest, len(mild))
        columns = zip(*(moved[case.name] for case in mild), strict=True)
        rows.append(["all cases above", *(_settled([*chain(*c)], times) for c in columns)])
    stopped = [
        [case.name, *(_stopped(o) for o in moved[case.name])] for case in cases if not case.mild
    ]
    names = list(by_method)
    title = f"## T = {1e3 * sampling_time:g} ms, effort limit {ratio:g} times friction\n\n"
    note = (
        f"{count} axes; the median of the shortest times is {1e3 * np.median(shortest):.0f} ms.\n\n"
    )
    ends = "\n\nAxes that stop, and the most frequent reason:\n\n"
    for case in cases:
        if case.channels.push:
            unheld = sum(_unheld(axis, case) for axis in by_method["precise"])
            ends = f"\n\n{unheld} pushes leave the travel against the whole limit as well.{ends}"
    return title + note + table(["case", *names], rows) + ends + table(["case", *names], stopped)


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m studies.positioning_faults.rivals")
    parser.add_argument("--axes", type=int, default=60)
    parser.add_argument("--sampling-times", type=float, nargs="*", default=[0.01, 0.001])
    parser.add_argument("--ratios", type=float, nargs="*", default=[3.0, 10.0, 30.0])
    parser.add_argument(
        "--faultless", action="store_true", help="print the times without faults alone"
    )
    parser.add_argument("--cases", nargs="*", default=[], help="parts of their names; all if none")
    parser.add_argument("--seed", type=int, default=_SEED, help="random seed of the axes")
    given = parser.parse_args()
    if given.faultless:
        text = faultless(given.axes, given.sampling_times, given.ratios, given.seed)
        print(text)  # noqa: T201
        return
    cases = [
        case for case in AXIS_CASES if not given.cases or any(n in case.name for n in given.cases)
    ]
    for sampling_time in given.sampling_times:
        for ratio in given.ratios:
            text = study(given.axes, sampling_time, ratio, cases, given.seed)
            print(text, flush=True)  # noqa: T201 - takes long


if __name__ == "__main__":
    main()
