"""Make theory/landing.md, landings on random arms: ``python -m studies.documentation.landing``.

Two hundred arms, each moved by every controller in every case, take 20 minutes on one processor.
``--arms N`` takes another number of them, ``--workers N`` of processes.
"""

import argparse
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from os import cpu_count

import numpy as np
from rich.progress import track

from studies.documentation.style import DOCS
from studies.markdown import table
from studies.van_de_wijdeven.conjunction.cases import BOUND, CASES
from studies.van_de_wijdeven.conjunction.contenders import HOW_COMPARED, LANDINGS
from studies.van_de_wijdeven.conjunction.random_arms import random_arms
from studies.van_de_wijdeven.conjunction.study import arm_outcomes, scores_of
from studies.van_de_wijdeven.records import LandingScore, Spread

ARMS, SEED = 200, 1


def _spread(of: Spread | None, factor: float = 1.0, digits: int = 2) -> str:
    if of is None:
        return "–"
    return " / ".join(
        f"{factor * value:.{digits}g}" for value in (of.median, of.upper_95, of.worst)
    )


def _landings(scores: tuple[LandingScore, ...]) -> str:
    """Return the table of the controllers that land by series of pulses, in every case."""
    rows = [
        [
            each.case,
            each.controller,
            f"{100 * each.landed:.1f}",
            "–" if each.landed_in_four is None else f"{100 * each.landed_in_four:.1f}",
            _spread(each.error_1),
            _spread(each.error_2),
            _spread(each.series),
            _spread(each.time_ratio),
            "–" if each.misjudged is None else f"{100 * each.misjudged:.1f}",
            f"{each.farthest:.2g}",
            f"{each.peak_effort:.3f}",
        ]
        for each in scores
        if each.controller in LANDINGS
    ]
    return table(
        [
            "case",
            "controller",
            "landed [%]",
            "in four series [%]",
            "mass 1 off",
            "mass 2 off",
            "series a move",
            "time / shortest",
            "misjudged [%]",
            "farthest beside the way",
            "peak effort / limit",
        ],
        rows,
    )


def _comparison(scores: tuple[LandingScore, ...]) -> str:
    """Return the table of all controllers in the cases that the rivals were tried in."""
    tried = {each.case for each in scores if each.controller not in LANDINGS}
    rows = [
        [
            each.case,
            each.controller,
            f"{100 * each.landed:.1f}",
            _spread(each.error_1),
            _spread(each.swing),
            _spread(each.time_ratio),
        ]
        for case in dict.fromkeys(each.case for each in scores)
        if case in tried
        for each in scores
        if each.case == case
    ]
    return table(
        ["case", "controller", "landed [%]", "mass 1 off", "swing left", "time / shortest"], rows
    )


def page(scores: tuple[LandingScore, ...], arms: int) -> str:
    """Return the page."""
    return "\n".join(
        (
            "% Made by python -m studies.documentation.landing\n",
            "# Landings on random arms\n",
            f"{arms} arms with two masses around 1 kg, a spring around 1 N/m, Coulomb friction "
            "around 0.1 N and viscous friction around 0.1 N s/m, each within a factor 3, and "
            "static friction of 1 to 1.3 times the Coulomb friction. The effort is limited to "
            "1 N. Each arm makes two moves of 0.7 to 1.3 m, one after the other, either way. Of "
            "half of the arms nothing is guessed of friction at first, of the others values wrong "
            "by up to 50 %.\n",
            f"An arm has landed if, after both of its moves, both masses stay within {BOUND:g} of "
            "the move of their target (with noise: within three standard deviations of a measured "
            "position), mass 2 swinging or not. Numbers are over the length of the move, or over "
            "the shortest time in which the planner takes the arm there when all of it is known: "
            "the median, what 95 % do not exceed, and the worst.\n",
            "## Landings by series of pulses\n",
            "Method `landing` is the conjunction of van de Wijdeven (2002): feedback and notch "
            "bring the arm near its target, and series of pulses from rest to rest land it. Method "
            "`tracked`, the default of `position`, begins with a series, and feedback on both "
            "masses tracks it.\n",
            _landings(scores),
            "Where masses and spring are wrong, each by that much up or down, the controllers are "
            "given how uncertain they are, and learn them from the motion along each series.\n",
            "## Beside others\n",
            f"{HOW_COMPARED}\n",
            _comparison(scores),
            f"The seed is {SEED} (`python -m studies.documentation.landing`).\n",
        )
    )


def main() -> None:
    """Make the page."""
    given = argparse.ArgumentParser(description=__doc__)
    given.add_argument("--arms", type=int, default=ARMS)
    given.add_argument("--workers", type=int, default=cpu_count())
    options = given.parse_args()
    drawn = random_arms(np.random.default_rng(SEED), options.arms)
    with ProcessPoolExecutor(options.workers) as pool:
        work = pool.map(partial(arm_outcomes, cases=CASES), drawn)
        found = list(track(work, description="arms", total=options.arms))
    text = page(scores_of(found, CASES), options.arms)
    (DOCS / "theory" / "landing.md").write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
