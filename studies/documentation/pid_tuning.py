"""Tune the PID controllers of part B: ``python -m studies.documentation.pid_tuning``.

It takes some minutes and writes what it finds, the best first, to ``theory/pid-tuning.md``; the
best of each is in `studies.van_de_wijdeven.part_b.contenders`.
"""

from dataclasses import replace
from math import inf
from os import cpu_count

import numpy as np
from rich import print as say

from studies.documentation.style import DOCS, no_arguments
from studies.markdown import table
from studies.van_de_wijdeven.part_b.contenders import HOW_TUNED, PID_TUNINGS
from studies.van_de_wijdeven.part_b.pid_tuning import FASTEST, LEAST_MARGIN, PIDTuning, tune
from studies.van_de_wijdeven.part_b.random_axes import random_axes
from studies.van_de_wijdeven.records import ControllerScore

SEED, AXES = 99, 200
SHOWN = 4
EDGE = "PID with dither, tuned to the edge"
# What is searched besides bandwidth, phase margin and place of the integral
FREE = {
    "PID": (),
    "PID with dead band": ("dead_band",),
    "PID with dither": ("dead_band", "dither", "dither_frequency"),
    EDGE: ("dead_band", "dither", "dither_frequency"),
    "reset PID, Coulomb": ("dead_band",),
    "reset PID, Stribeck": ("dead_band",),
}
HEAD = (
    "bandwidth [Hz]",
    "phase margin [°]",
    "crossover over integral [-]",
    "dead band [tolerance]",
    "dither [static friction]",
    "dither [Hz]",
    "within [%]",
    "hunting [%]",
    "median time [s]",
)
PAGE = DOCS / "theory" / "pid-tuning.md"


def row(tuning: PIDTuning, score: ControllerScore) -> list[str]:
    """Return a row of the table."""
    dithered = tuning.dither > 0.0
    return [
        f"{tuning.bandwidth:g}",
        f"{tuning.phase_margin:g}",
        f"{tuning.integral_ratio:g}",
        f"{tuning.dead_band:g}",
        f"{tuning.dither:g}" if dithered else "none",
        f"{tuning.dither_frequency:g}" if dithered else "none",
        f"{100.0 * score.within_tolerance:.1f}",
        f"{100.0 * score.hunting:.1f}",
        "never" if score.median_time is None else f"{score.median_time:.2f}",
    ]


def main() -> None:
    """Tune every variant and write the page."""
    axes = random_axes(np.random.default_rng(SEED), AXES)
    parts = [
        "% Made by python -m studies.documentation.pid_tuning\n\n# How the PID controllers "
        f"are tuned\n\n{HOW_TUNED} The axes: seed {SEED}, {AXES} of them. The integral stands "
        "still within the dead band; the dither is a square wave; amplitudes are over the guessed "
        "static friction. The best few of each variant:\n"
    ]
    for name, free in FREE.items():
        # The search of what is free begins in the middle, not at what it has found before
        start = replace(PID_TUNINGS[name], bandwidth=4.0, dither_frequency=50.0)
        start = replace(start, dead_band=0.75 if free else 0.0)
        start = replace(start, dither=0.6 if "dither" in free else 0.0)
        limits = (inf, 0.0) if name == EDGE else (FASTEST, LEAST_MARGIN)
        found = tune(
            start,
            axes,
            free=free,
            fastest=limits[0],
            least_margin=limits[1],
            workers=cpu_count() or 1,
        )
        chosen = "as used" if found[0][0] == PID_TUNINGS[name] else "NOT as used"
        say(f"{name}: {found[0][0]}, {chosen}")
        rows = [row(*each) for each in found[:SHOWN]]
        parts.append(f"## {name}\n\n{len(found)} tried.\n\n{table(HEAD, rows)}")
    PAGE.write_text("\n".join(parts), encoding="utf-8")


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
