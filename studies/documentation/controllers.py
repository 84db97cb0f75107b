"""Make the tables of part B: ``python -m studies.documentation.controllers``.

Every controller on 2000 random axes, which takes a minute or two; figures of the source with it.
"""

from collections.abc import Sequence
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
from rich.progress import Progress

from studies.documentation.style import DOCS, FIGURES, no_arguments, style
from studies.markdown import table
from studies.van_de_wijdeven import reproduce_part_b
from studies.van_de_wijdeven.part_b.contenders import HOW_TUNED, SUCCESSOR
from studies.van_de_wijdeven.records import ControllerScore, PulseReproduction, ResolutionScore

AXES = 2000
SHOWN = ("3", "4", "6")


def comparison(scores: Sequence[ControllerScore]) -> str:
    """Return the table of all controllers."""
    rows = [
        [
            each.controller,
            f"{each.axes}",
            f"{100 * each.within_tolerance:.2f}",
            f"{100 * each.hunting:.2f}",
            f"{1e6 * each.median_error:.1f}",
            f"{1e6 * each.error_95:.1f}",
            f"{1e6 * each.worst_error:.0f}",
            "–" if each.median_time is None else f"{each.median_time:.2f}",
            "–" if each.median_pulses is None else f"{each.median_pulses:g}",
            f"{each.peak_effort:.2f}",
        ]
        for each in scores
    ]
    return table(
        [
            "controller",
            "axes",
            "on target [%]",
            "hunting [%]",
            "median error [µm]",
            "95 % [µm]",
            "worst [µm]",
            "median time [s]",
            "median pulses",
            "peak effort / limit",
        ],
        rows,
    )


def nearness(scores: Sequence[ResolutionScore]) -> str:
    """Return the table of how near pulses come."""
    rows = [
        [
            f"{1e9 * each.encoder_step:g}",
            f"{each.static_ratio:g}",
            f"{100 * each.friction_change:g}",
            f"{1e3 * each.sampling_time:g}",
            f"{1e9 * each.smallest_step:,.0f}",
            f"{1e9 * each.median_error:,.3g}",
            f"{1e9 * each.error_95:,.3g}",
            f"{100 * each.within_a_step:.0f}",
            f"{each.median_pulses:g}",
        ]
        for each in scores
    ]
    return table(
        [
            "encoder step [nm]",
            "$f_s/f_c$",
            "friction changes by [%]",
            "T [ms]",
            "smallest single step [nm]",
            "median error [nm]",
            "95 % [nm]",
            "within a step [%]",
            "median pulses",
        ],
        rows,
    )


def page(made: PulseReproduction) -> str:
    """Return the page of tables."""
    best = next(each for each in made.controller_scores if each.controller == SUCCESSOR)
    return "\n".join(
        (
            "% Made by python -m studies.documentation.controllers\n",
            "# Controllers on random axes\n",
            f"{AXES} axes around that of the source's Table 1: mass, Coulomb and viscous friction "
            "each within a factor 2, static friction 1.05 to 1.5 times the Coulomb friction, each "
            "direction up to 20 % off the mean of both, an offset of up to 0.2 times the Coulomb "
            "friction. The effort is limited to 3 times the Coulomb friction, the sampling time is "
            "10 ms, the encoder has a step of 1 µm and 1 µm of noise, and there is no velocity "
            "sensor. The guesses of the mass are within 5 %, those of friction within 50 %. They "
            "start 0.5 to 20 mm off the target and shall rest within 20 µm of it.\n",
            f"{HOW_TUNED} [How the PID controllers were tuned](pid-tuning.md).\n",
            comparison(made.controller_scores),
            f"Of {best.axes} axes the exact pulses miss "
            f"{round(best.axes * (1.0 - best.within_tolerance))}; the seed is "
            f"{made.options['seed']} (`python -m studies.documentation.controllers`; `python "
            f"-m studies.van_de_wijdeven part-b --axes {AXES}` gives the same). A PID with dither "
            "never rests: its effort goes on shaking the axis, which is what keeps it near the "
            "target.\n",
            "With delays, lag, resonance, presliding, loads, pushes and other faults, `precise` "
            "is compared with a servo with feedforward of friction, at effort limits of up to 30 "
            "times friction: [controllers of a rigid axis under faults]"
            "(../evidence/positioning-rivals.md).\n",
            "## How near\n",
            "The mass of Table 1 asked for the step of its encoder. Friction that changes does so "
            "for every pulse, each direction by itself, by a relative standard deviation.\n",
            nearness(made.resolution_scores),
            "## Figures of the source\n",
            "The error under PWC (Figure 3) and under PAPWC (Figure 4), and the pulses of PAPWC "
            "(Figure 6), as `python -m studies.van_de_wijdeven part-b` draws them with all "
            "others.\n",
            *(f"![Figure {number}](../figures/part-b-figure-{number}.png)\n" for number in SHOWN),
        )
    )


def main() -> None:
    """Make everything."""
    style()
    plt.close("all")
    with TemporaryDirectory() as folder, Progress() as progress:
        task = progress.add_task("part B", total=None)
        made = reproduce_part_b(
            folder,
            axes=AXES,
            progress=lambda done, every: progress.update(task, completed=done, total=every),
        ).reproduction
        for number in SHOWN:
            copyfile(Path(folder) / f"figure-{number}.png", FIGURES / f"part-b-figure-{number}.png")
    if not isinstance(made, PulseReproduction):
        raise TypeError("this is not part B")
    (DOCS / "theory" / "controllers.md").write_text(page(made), encoding="utf-8")


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
