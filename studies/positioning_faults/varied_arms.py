"""Judge `tracked` on arms of all sizes: ``python -m studies.positioning_faults.varied_arms``.

Each arm has a size, a sampling time, a task and at most one fault of its own. Prints one table,
with a row for each value of what was drawn from a few.
"""

import argparse
from dataclasses import replace
from functools import partial
from math import pi

import numpy as np
from rich.console import Console

from studies.positioning_faults.cases import Case, Channels, Noise, damped
from studies.positioning_faults.run import Axis, axis_table, shortest, symmetric
from studies.positioning_faults.varied import MOVES, PERIODS, Drawn, study

_SWINGS = 8.0  # half swings that a move may take at least
_UNSURE = 0.05  # of the friction, where it is known
_FAULTS = ("none", "delay", "damping", "friction of mass 2", "noise", "encoder", "gain", "unseen")


def varied_arm(seed: int, *, known: bool) -> Drawn:
    """Draw an arm with a mass 1 of 1e-3 to 1 kg m^2, or of 1 to 100 kg, and its two moves.

    Mass 2 is 0.16 to 6.3 times mass 1, and swings by 0.01 to 0.12 rad in a sample while mass 1
    rests. The effort limit moves a rigid arm without friction in 0.6 to 10 half swings; it is 2.5
    to 32 times Coulomb friction. Static friction is 1 to 1.3 times that, the tolerance 5e-5 to
    3e-3 of a move. Friction is ``known`` within 5 %, or nothing is known of it.
    """
    g = np.random.default_rng(seed)
    rotary = bool(g.uniform() < 0.5)
    T = float(g.choice(PERIODS))
    m1 = float(10.0 ** (g.uniform(-3.0, 0.0) if rotary else g.uniform(0.0, 2.0)))
    m2 = m1 * float(10.0 ** g.uniform(-0.8, 0.8))
    w = float(g.uniform(0.01, 0.12)) / T
    ratio = float(10.0 ** g.uniform(np.log10(2.5), 1.5))
    way = float(10.0 ** (g.uniform(-1.0, 0.5) if rotary else g.uniform(-2.0, 0.0)))
    time = float(10.0 ** g.uniform(-0.2, 1.0)) * pi / w
    limit = 4.0 * way * (m1 + m2) / time**2
    F = limit / ratio
    c = float(F * 10.0 ** g.uniform(-2.0, 0.0) * time / way)
    static = float(g.uniform(1.0, 1.3))
    tolerance = float(way * 10.0 ** g.uniform(-4.3, -2.5))
    ways = g.choice([-1.0, 1.0], 2) * g.uniform(0.6, 1.4, 2) * way
    wrong = 1.0 + g.uniform(-_UNSURE, _UNSURE, 2)
    guess = {
        "coulomb_friction": float(wrong[0] * F),
        "viscous_friction": float(wrong[1] * c),
        "friction_uncertainty": _UNSURE,
    }
    fault = str(g.choice(_FAULTS))
    plant = symmetric(
        m1, (F, c, static), stribeck_velocity=1e-2 * way * w / pi, load=(m2, m2 * w**2)
    )
    axis = Axis(
        plant=plant,
        tables={
            "axis": axis_table(plant),
            "controller": {"method": "tracked", "effort_limit": limit},
            "guess": guess if known else {},
        },
        targets=tuple(np.cumsum(ways).tolist()),
        tolerance=tolerance,
        duration=T,
        sampling_time=T,
        noise=0.0,
        encoder_step=0.0,
        seed=int(g.integers(2**62)),
    )
    times = shortest(axis)
    return Drawn(
        axis=replace(axis, duration=max(MOVES * max(times), _SWINGS * pi / w)),
        case=_case(fault, g, w, tolerance),
        what={
            "size": "rotary" if rotary else "linear",
            "sampling time": f"{1e3 * T:g} ms",
            "limit over friction": _between(ratio, (5.0, 12.0)),
            "mass 2 over mass 1": _between(m2 / m1, (0.5, 2.0)),
            "half swings of a move": _between(time * w / pi, (1.5, 4.0)),
            "fault": fault,
        },
        shortest=times,
    )


def _between(value: float, bounds: tuple[float, float]) -> str:
    """Return which of three ranges a value is in."""
    low, high = bounds
    if value < low:
        return f"less than {low:g}"
    return f"more than {high:g}" if value > high else f"{low:g} to {high:g}"


def _case(fault: str, g: np.random.Generator, w: float, tolerance: float) -> Case:
    """Return the case of a fault."""
    share = float(g.uniform())
    if fault == "delay":
        return Case(name=fault, plant=lambda p, T: p._replace(actuation_delay=2.0 * share * T))
    if fault == "damping":
        return Case(name=fault, plant=damped)
    if fault == "friction of mass 2":
        other = 0.02 + 0.06 * share
        return Case(name=fault, plant=lambda p, _: p._replace(load_friction=other))
    if fault == "noise":
        noise = Noise(position=0.1 * tolerance, velocity=0.3 * tolerance * w)
        return Case(name=fault, channels=Channels(noise=lambda _: noise))
    if fault == "encoder":
        step = 0.2 * tolerance
        return Case(name=fault, channels=Channels(noise=lambda T: Noise.of_encoder(step, T)))
    gain = 0.97 + 0.06 * share if fault == "gain" else 1.0
    return Case(name=fault, channels=Channels(gain=gain, missing_load=fault == "unseen"))


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(prog="python -m studies.positioning_faults.varied_arms")
    parser.add_argument("--arms", type=int, default=400)
    parser.add_argument("--first-seed", type=int, default=0)
    parser.add_argument("--unknown", action="store_true", help="friction is not known")
    given = parser.parse_args()
    seeds = range(given.first_seed, given.first_seed + given.arms)
    draw = partial(varied_arm, known=not given.unknown)
    Console().print(study(draw, seeds), markup=False, soft_wrap=True)


if __name__ == "__main__":
    main()
