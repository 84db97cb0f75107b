"""Vary the tuning of landings: ``python -m studies.positioning_faults.landing_tuning``.

Each constant is halved and doubled, all others as they are. Prints a table of each method.
Constants named as arguments replace the default ones.
"""

import argparse
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import fields
from os import cpu_count
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from stickslip.control.landing.tuning import APPROACH, LANDING, LEARNING, TRACKING
from studies.markdown import table
from studies.positioning_faults.cases import ARM_CASES, AXIS_CASES, Case
from studies.positioning_faults.run import Axis, Outcome, arms, axes, move_axis

RECORDS: dict[str, Any] = {
    "approach": APPROACH,
    "landing": LANDING,
    "learning": LEARNING,
    "tracking": TRACKING,
}
CONSTANTS = {
    "tracked": (
        "landing.moving_deviations",
        "landing.beyond",
        "learning.significance",
        "tracking.assumed_delay",
        "tracking.delay_pole",
        "tracking.integral_pole",
        "tracking.plan_share",
        "tracking.correction_share",
        "tracking.guessed_friction",
        "tracking.nearby_error",
        "tracking.correcting_travel",
        "tracking.correcting_speed",
    ),
    "landing": ("approach.left_travel", "landing.rest_swing", "learning.friction_ratio"),
    "mass": ("approach.mass_pole", "approach.friction_uncertainty"),
}
ARM_FAULTS = (
    "delay of 1 sample",
    "damping of 2 %",
    "effort limit of 70 %",
    "all mild faults",
    "noise of 1e-5 m and 1e-4 m/s",
    "masses and spring wrong by 10 %",
)
AXIS_FAULTS = ("no fault", "delay of 2 samples", "Stribeck effect of 50 %", "all mild faults")
FACTORS = (0.5, 2.0)
_SEED, _DURATION = 7, 40.0

Runs = list[tuple[Axis, Case]]
Variant = tuple[str, float]


def runs(method: str, count: int) -> Runs:
    """Draw axes for a method, ``count`` for each case; friction is known for half of the arms."""
    names = AXIS_FAULTS if method == "mass" else ARM_FAULTS
    cases = {case.name: case for case in (*ARM_CASES, *AXIS_CASES) if case.name in names}
    chosen = [cases[name] for name in names for _ in range(count)]
    if method == "mass":
        drawn = axes(len(chosen), _SEED, method="landing", sampling_time=0.01, ratio=3.0)
        return list(zip(drawn, chosen, strict=True))
    known, unknown = (
        arms(len(chosen), _SEED, known=each, method=method, duration=_DURATION)
        for each in (True, False)
    )
    drawn = [(known, unknown)[k % 2][k] for k in range(len(chosen))]
    return list(zip(drawn, chosen, strict=True))


def varied_value(value: Any, factor: float) -> Any:
    """Return a constant times a factor; 0.99 for twice a share above one half."""
    if isinstance(value, tuple):
        return tuple(varied_value(each, factor) for each in value)
    if isinstance(value, int):
        return max(1, round(factor * value))
    return 0.99 if factor > 1.0 and 0.5 < value < 1.0 else factor * value


@contextmanager
def changed(constant: str, factor: float) -> Iterator[None]:
    """Multiply a constant by a factor within a ``with`` block, in this process.

    Every module of the controllers holds the one record, which is frozen against any other change.
    """
    record, name = _place(constant)
    value = getattr(record, name)
    object.__setattr__(record, name, varied_value(value, factor))
    try:
        yield
    finally:
        object.__setattr__(record, name, value)


def outcomes(method: str, count: int, variant: Variant) -> list[Outcome]:
    """Return the outcomes of all runs with one constant changed."""
    with changed(*variant):
        return [move_axis(axis, case) for axis, case in runs(method, count)]


def cell(found: Sequence[Outcome], plain: Sequence[Outcome]) -> str:
    """Return how many landed, and the mean of their settling times relative to the plain ones."""
    times = np.array([each.settling for each in found])
    ratios = times / np.array([each.settling for each in plain])
    landed = np.sum(~np.isnan(times).any(axis=1))
    false = sum(each.false for each in found)
    text = f"{landed}, {np.nanmean(ratios):.2f}" if landed else f"{landed}"
    return f"{text} ({false} wrong)" if false else text


def study(method: str, constants: Sequence[str], count: int, workers: int) -> str:
    """Return the table of a method."""
    variants = [(constants[0], 1.0)]
    variants += [(constant, factor) for constant in constants for factor in FACTORS]
    progress, rows = Console(stderr=True), list[list[str]]()
    with ProcessPoolExecutor(workers) as pool:
        found = pool.map(outcomes, [method] * len(variants), [count] * len(variants), variants)
        plain = next(found)
        pairs = zip(constants, found, found, strict=True)
        for constant, *pair in track(pairs, total=len(constants), console=progress, transient=True):
            cells = [cell(each, plain) for each in pair]
            rows.append([constant, str(getattr(*_place(constant))), *cells])
            progress.print(" | ".join(rows[-1]), markup=False, soft_wrap=True)
    title = f"of {len(plain)} axes, {cell(plain, plain).split(', ', maxsplit=1)[0]} landed"
    return table([f"constant ({method}; {title})", "value", "half", "twice"], rows)


def _place(constant: str) -> tuple[Any, str]:
    """Return record and field of a constant."""
    record, name = constant.split(".")
    return RECORDS[record], name


def main() -> None:
    """Run the study."""
    every = [f"{name}.{each.name}" for name, of in RECORDS.items() for each in fields(of)]
    parser = argparse.ArgumentParser(prog="python -m studies.positioning_faults.landing_tuning")
    parser.add_argument("constants", nargs="*", choices=[[], *every], metavar="record.constant")
    parser.add_argument("--method", choices=list(CONSTANTS), help="all by default")
    parser.add_argument("--axes", type=int, default=2, help="of each case")
    parser.add_argument("--workers", type=int, default=cpu_count() or 1)
    given = parser.parse_args()
    for method in [given.method] if given.method else CONSTANTS:
        constants = given.constants or CONSTANTS[method]
        text = study(method, constants, given.axes, given.workers)
        Console().print(f"{text}\n", markup=False, soft_wrap=True)


if __name__ == "__main__":
    main()
