"""Run controllers with random faults and check that they are safe.

``python -m studies.positioning_faults.safety --runs 100000``

A run is unsafe if ``step`` raises an error, or if the effort is not finite or exceeds the limit.
Faults of the axis and its channels are combined at random; in three quarters of the runs samples
contain invalid values, such as infinity, and times that stand still or run back.
"""

import argparse
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from itertools import islice
from math import inf, isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from stickslip.control import GuardedController
from stickslip.records import InputError, SensorSample
from stickslip.scenario import ARM_CONTROLLERS, AXIS_CONTROLLERS
from studies.mismatch.plant import FINE_STEP, HeldPlant, Plant
from studies.positioning_faults.cases import ARM_CASES, AXIS_CASES
from studies.positioning_faults.run import Axis, arms, axes

_TABLES = {False: AXIS_CONTROLLERS.models, True: ARM_CONTROLLERS.models}
_ARMS = 0.1
"""Share of the runs on arms, whose planning takes most of the time."""

_CONSOLE = Console()
_SAMPLES = 300
_WIDEST = 2.0  # decades of wrong guesses
_ODD: tuple[Any, ...] = (
    nan, inf, -inf, 1e308, -1e30, 0.0, 0, -7, True, np.float32(0.01), np.int64(3),
    np.array(0.02), 5e-324,
)  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Fault:
    """An unsafe run."""

    seed: int
    method: str
    what: str


def unsafe(seed: int) -> Fault | None:
    """Return what was unsafe in the run of a seed, or None."""
    generator = np.random.default_rng(seed)
    flexible = bool(generator.uniform() < _ARMS)
    method = str(generator.choice(sorted(_TABLES[flexible])))
    axis, controller = _begun(generator, method, flexible=flexible)
    limit = float(axis.tables["controller"]["effort_limit"])
    low, high = controller.limits.travel
    step, plant = axis.sampling_time, _faulty(generator, axis)
    held = HeldPlant(plant, start=0.0, steps=round(step / FINE_STEP))
    odd = float(generator.choice([0.0, 0.002, 0.05, 0.5]))
    delay, lost = int(generator.integers(0, 6)), float(generator.choice([0.0, 0.02, 0.3]))
    frozen = generator.uniform(0.0, 2.0) * _SAMPLES
    gain, clip = 10.0 ** generator.uniform(-0.5, 0.5), generator.uniform(0.2, 1.5)
    seen: list[SensorSample] = []
    state = controller.init()
    for k in range(_SAMPLES):
        motion = held.motion
        noisy = [each + axis.noise * generator.normal() for each in motion]
        seen.append(SensorSample(0.0, *(noisy if flexible else (*noisy[:2], nan, nan))))
        sample = seen[int(min(max(k - delay, 0), frozen))]._replace(time=k * step)
        if not axis.velocity:
            sample = sample._replace(measured_velocity=nan)
        if generator.uniform() < lost:
            sample = SensorSample(k * step, nan, nan, nan, nan)
        if generator.uniform() < odd:
            sample = _spoiled(generator, sample)
        try:
            if generator.uniform() < 1.0 / _SAMPLES:
                state = controller.retargeted(state, float(generator.uniform(low, high)))
            state, effort = controller.step(state, sample)
            for shown in (controller.outcome, controller.why, controller.estimates):
                shown(state)
        except Exception as error:  # noqa: BLE001 - any error is a result here
            what = f"sample {k}: {type(error).__name__}: {error}"
            return Fault(seed=seed, method=method, what=what)
        if not isfinite(effort) or abs(effort) > limit:
            return Fault(seed=seed, method=method, what=f"sample {k}: effort of {effort:g}")
        held.advance(min(max(gain * effort, -clip * limit), clip * limit))
    return None


def _begun(
    generator: np.random.Generator, method: str, *, flexible: bool
) -> tuple[Axis, GuardedController]:
    """Return the first drawn axis that is not refused, as for a guess that no pulse moves it."""
    while True:
        axis = _drawn(generator, method, flexible=flexible)
        try:
            return axis, axis.scenario().build(Path()).guarded
        except InputError:
            continue


def _drawn(generator: np.random.Generator, method: str, *, flexible: bool) -> Axis:
    """Return an axis whose controller has first guesses that are wrong by up to two decades."""
    seed = int(generator.integers(2**32))
    if flexible:
        step = float(generator.choice([0.01, 0.02, 0.05]))
        axis = arms(1, seed, known=True, method=method, duration=20.0, sampling_time=step)[0]
    else:
        step, ratio = float(generator.choice([1e-3, 1e-2])), 10.0 ** generator.uniform(0.2, 1.5)
        axis = axes(1, seed, method=method, sampling_time=step, ratio=ratio)[0]
    known = {
        name: value
        for name, value in {**axis.tables["axis"], **axis.tables["guess"]}.items()
        if name in _TABLES[flexible][method].guesses
    }
    spread = generator.choice([0.0, 0.3, _WIDEST])
    guess = {
        name: value if "uncertainty" in name else value * 10.0 ** generator.uniform(-spread, spread)
        for name, value in known.items()
    }
    if "static_friction" in guess and "coulomb_friction" in guess:
        guess["static_friction"] = max(guess["static_friction"], guess["coulomb_friction"])
    settings = {**axis.tables["controller"], **_settings(generator, method, axis)}
    return replace(axis, tables={**axis.tables, "controller": settings, "guess": guess})


def _settings(generator: np.random.Generator, method: str, axis: Axis) -> dict[str, Any]:
    """Return the settings of a method that has no defaults for them, over two decades."""
    mass, limit = axis.plant.mass, float(axis.tables["controller"]["effort_limit"])
    frequency = float(10.0 ** generator.uniform(-0.5, 1.5))  # rad/s, of the closed loop
    if not method.startswith("pid") and method != "pd":
        return {}
    settings: dict[str, Any] = {
        "position_gain": mass * frequency**2,
        "velocity_gain": 1.4 * mass * frequency,
    }
    if method != "pd":
        settings["integral_gain"] = 0.1 * mass * frequency**3
    if method == "pid-dither":
        settings["dither_amplitude"] = float(generator.uniform(0.01, 1.5)) * limit
        settings["dither_frequency"] = float(generator.uniform(0.05, 0.45)) / axis.sampling_time
    if method == "pid-reset":
        settings["reset_law"] = str(generator.choice(["coulomb", "stribeck"]))
        settings["reset_speed"] = 1e-4
    return {**settings, "filter_time": 2.0 * axis.sampling_time}


def _faulty(generator: np.random.Generator, axis: Axis) -> Plant:
    """Return the plant with the faults of up to three cases."""
    cases = ARM_CASES if axis.flexible else AXIS_CASES
    plant = axis.plant
    for k in generator.choice(len(cases), size=int(generator.integers(0, 4)), replace=False):
        plant = cases[int(k)].plant(plant, axis.sampling_time)
    return plant


def _spoiled(generator: np.random.Generator, sample: SensorSample) -> SensorSample:
    """Return a sample in which one to five values are no measurements."""
    values = list(sample)
    for k in generator.choice(5, size=int(generator.integers(1, 6)), replace=False):
        values[int(k)] = _ODD[int(generator.integers(len(_ODD)))]
    return SensorSample(*values)


def _batch(seeds: range) -> list[Fault]:
    return [fault for seed in seeds if (fault := unsafe(seed)) is not None]


def _batches(runs: int, first: int) -> Iterator[range]:
    size = 50
    for start in range(first, first + runs, size):
        yield range(start, min(start + size, first + runs))


def safety(runs: int, first: int = 0, *, workers: int = 1) -> list[Fault]:
    """Return the unsafe runs of the seeds from the first on."""
    every = list(_batches(runs, first))
    faults: list[Fault] = []
    with ProcessPoolExecutor(workers) as pool:
        for found in track(pool.map(_batch, every), total=len(every), console=_CONSOLE):
            faults += found
            for each in islice(found, 3):
                _CONSOLE.print(f"seed {each.seed}, {each.method}: {each.what}", soft_wrap=True)
    return faults


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m studies.positioning_faults.safety")
    parser.add_argument("--runs", type=int, default=100_000)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    faults = safety(given.runs, given.first_seed, workers=given.workers)
    _CONSOLE.print(f"{len(faults)} of {given.runs} runs were unsafe")
    for method, count in Counter(each.method for each in faults).most_common():
        _CONSOLE.print(f"{method}: {count}")


if __name__ == "__main__":
    main()
