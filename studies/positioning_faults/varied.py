"""Judge `precise` on rigid axes of all sizes: ``python -m studies.positioning_faults.varied``.

Each axis has a size, a sampling time, sensors, a task, a guess and at most one fault of its own.
Prints one table, with a row for each value of what was drawn from a few.
"""

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from rich.console import Console
from rich.progress import track

from studies.markdown import table
from studies.mismatch.plant import Plant
from studies.positioning_faults.cases import Case, Channels
from studies.positioning_faults.run import Axis, Outcome, axis_table, move_axis, symmetric

_FAULTS = ("none", "delay", "lag", "presliding", "directions", "load", "gain")
_POSITIONS = ("exact", "noise of 1/10", "encoder step of 1/10", "encoder step of 1/2")
_VELOCITIES = ("none", "exact", "noisy", "differentiated")
_GUESSES = ("5 %", "30 %", "mass alone")
PERIODS = (1e-3, 2e-3, 4e-3, 1e-2)
MOVES = 25.0  # shortest times that a move may take
_LEAST_SAMPLES = 300  # likewise


@dataclass(frozen=True, kw_only=True)
class Drawn:
    """An axis, its case, what was drawn for them, and the shortest time of each move [s]."""

    axis: Axis
    case: Case
    what: dict[str, str]
    shortest: tuple[float, ...]


def varied(seed: int) -> Drawn:
    """Draw a servo of 1e-4 to 0.1 kg m^2 or a stage of 1 to 200 kg, and its task.

    Coulomb friction decelerates it by 3 to 300 rad/s^2, or 0.2 to 10 m/s^2. The effort limit is 1.7
    to 32 times that friction, viscous friction 1 to 200 % of it. The first move lasts 10 to 200
    samples at least, the tolerance is 0.05 to 3 % of it.
    """
    g = np.random.default_rng(seed)
    rotary = bool(g.uniform() < 0.5)
    T = float(g.choice(PERIODS))
    m = float(10.0 ** (g.uniform(-4.0, -1.0) if rotary else g.uniform(0.0, 2.3)))
    deceleration = 10.0 ** (g.uniform(0.5, 2.5) if rotary else g.uniform(-0.7, 1.0))
    F, ratio = m * deceleration, float(10.0 ** g.uniform(np.log10(1.7), 1.5))
    up, down = (ratio - 1.0) * deceleration, (ratio + 1.0) * deceleration
    fastest = float(10.0 ** g.uniform(1.0, 2.3)) * T
    way = 0.5 * fastest**2 * up * down / (up + down)
    c = float(F * 10.0 ** g.uniform(-2.0, 0.3) * fastest / way)
    tolerance = float(way * 10.0 ** g.uniform(-3.3, -1.5))
    static, stribeck = g.uniform(1.0, 1.4), 10.0 ** g.uniform(-2.0, -0.5) * way / fastest
    names = (_POSITIONS, _VELOCITIES, _GUESSES, _FAULTS)
    position, velocity, guess, fault = (str(g.choice(each)) for each in names)
    side = g.choice([-1.0, 1.0])
    back = g.choice([-1.0, 1.0]) * g.uniform(0.05, 1.5)
    targets = float(side * way), float(side * way + back * way)
    plant = symmetric(m, (F, c, float(static)), stribeck_velocity=float(stribeck))
    noise, step = {
        "exact": (0.0, 0.0),
        "noise of 1/10": (0.1, 0.0),
        "encoder step of 1/10": (0.02, 0.1),
        "encoder step of 1/2": (0.0, 0.5),
    }[position]
    wrong = 1.0 + (0.05 if guess == "5 %" else 0.3) * g.uniform(-1.0, 1.0, 3)
    body = wrong[0] if guess == "5 %" else 1.0 + 0.3 * (wrong[0] - 1.0)
    friction = {"coulomb_friction": wrong[1] * F, "viscous_friction": wrong[2] * c}
    axis = Axis(
        plant=_faulty(plant, fault, g, T, tolerance),
        tables={
            "axis": axis_table(plant),
            "controller": {"method": "precise", "effort_limit": ratio * F},
            "guess": {"mass": m} if guess == "mass alone" else {"mass": body * m, **friction},
        },
        targets=targets,
        tolerance=tolerance,
        duration=max(MOVES * fastest, _LEAST_SAMPLES * T),
        sampling_time=T,
        noise=noise * tolerance,
        encoder_step=step * tolerance,
        seed=int(g.integers(2**62)),
        velocity=velocity != "none",
        velocity_noise=0.05 * tolerance / T if velocity == "noisy" else 0.0,
        differentiated=velocity == "differentiated",
    )
    gain = float(g.uniform(0.85, 1.15)) if fault == "gain" else 1.0
    ways = np.abs(np.diff([0.0, *targets]))
    return Drawn(
        axis=axis,
        case=Case(name=fault, channels=Channels(gain=gain)),
        what={
            "size": "servo" if rotary else "stage",
            "sampling time": f"{1e3 * T:g} ms",
            "position": position,
            "velocity": velocity,
            "guess": guess,
            "fault": fault,
        },
        shortest=tuple(sqrt(2.0 * d * (up + down) / (up * down)) for d in ways.tolist()),
    )


def _faulty(plant: Plant, fault: str, g: np.random.Generator, T: float, tolerance: float) -> Plant:
    """Return the plant with a fault."""
    if fault == "delay":
        return plant._replace(actuation_delay=float(g.uniform(0.0, 2.5) * T))
    if fault == "lag":
        return plant._replace(actuation_lag=float(g.uniform(0.0, 1.5) * T))
    if fault == "presliding":
        bend = float(g.uniform(0.2, 2.0)) * tolerance
        return plant._replace(presliding=bend, presliding_damping=0.3)
    F = plant.coulomb_positive
    if fault == "directions":
        return plant._replace(coulomb_positive=1.1 * F, coulomb_negative=0.9 * F)
    return plant._replace(offset=float(g.uniform(-0.6, 0.6)) * F) if fault == "load" else plant


def rows(drawn: Sequence[Drawn], outcomes: Sequence[Outcome]) -> Iterator[list[str]]:
    """Return a row of all axes, and one for each value of what was drawn."""
    names = list(drawn[0].what)
    groups = {"all": list(range(len(drawn)))}
    for name in names:
        for value in sorted({each.what[name] for each in drawn}):
            label = f"{name}: {value}"
            groups[label] = [k for k, each in enumerate(drawn) if each.what[name] == value]
    for label, places in groups.items():
        landed = sum(not np.isnan(outcomes[k].settling).any() for k in places)
        times = [
            settled / shortest
            for k in places
            for settled, shortest in zip(outcomes[k].settling, drawn[k].shortest, strict=True)
        ]
        late = np.where(np.isnan(times), np.inf, times)
        median, most = np.quantile(late, [0.5, 0.9], method="higher")
        yield [
            label,
            f"{landed} of {len(places)}",
            f"{median:.2f}",
            f"{most:.2f}",
            str(sum(outcomes[k].false for k in places)),
            str(sum(outcomes[k].left for k in places)),
        ]


def study(draw: Callable[[int], Drawn], seeds: range) -> str:
    """Return the table of the axes drawn with some seeds, and print those of which a move fails."""
    progress = Console(stderr=True)
    drawn: list[Drawn] = []
    outcomes: list[Outcome] = []
    for seed in track(seeds, console=progress, transient=True):
        each = draw(seed)
        drawn.append(each)
        outcomes.append(move_axis(each.axis, each.case))
        if np.isnan(outcomes[-1].settling).any():
            progress.print(f"seed {seed}: {each.what} {outcomes[-1]}", soft_wrap=True)
    titles = (
        "axes",
        "both moves within the tolerance",
        "median over the shortest",
        "90 %",
        "wrong reached",
        "leaves the travel",
    )
    return table(list(titles), list(rows(drawn, outcomes)))


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m studies.positioning_faults.varied")
    parser.add_argument("--axes", type=int, default=1000)
    parser.add_argument("--first-seed", type=int, default=0)
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.axes)
    Console().print(study(varied, seeds), markup=False, soft_wrap=True)


if __name__ == "__main__":
    main()
