"""Make the tables of part A: ``python -m studies.documentation.variants``, some ten minutes."""

from collections.abc import Sequence
from pathlib import Path
from shutil import copyfile
from tempfile import TemporaryDirectory

import matplotlib.pyplot as plt
import numpy as np
from rich.progress import Progress

from studies.documentation.style import BLUE, DOCS, FIGURES, ORANGE, no_arguments, save, style
from studies.markdown import table
from studies.van_de_wijdeven import reproduce_part_a
from studies.van_de_wijdeven.records import Reproduction, VariantScore

RUNS = 400
SHOWN = ("5.3", "6.1", "6.6")
PARAMETERS = {"coulomb_friction": "$f_c$", "viscous_friction": "$c$"}


def assumed_noise(score: VariantScore) -> str:
    """Return the standard deviations that a variant assumes, over the true ones."""
    return "none" if score.assumed is None else f"× {score.assumed:g}"


def errors(scores: Sequence[VariantScore]) -> str:
    """Return bias and root mean square error of every variant, one row a variant and assumption."""
    noises = sorted({each.noise for each in scores})
    found = {(each.variant, each.assumed, each.noise): each for each in scores}
    rows: list[list[str]] = []
    for variant, assumed in dict.fromkeys((each.variant, each.assumed) for each in scores):
        cells = [
            f"{100 * found[variant, assumed, noise].bias[name]:+.3g} "
            f"({100 * found[variant, assumed, noise].rmse[name]:.3g})"
            for noise in noises
            for name in PARAMETERS
        ]
        rows.append([variant, assumed_noise(found[variant, assumed, noises[0]]), *cells])
    head = [f"{symbol}, noise × {noise:g}" for noise in noises for symbol in PARAMETERS.values()]
    return table(["variant", "assumed σ", *head], rows)


def coverage(scores: Sequence[VariantScore]) -> str:
    """Return the share of runs whose 95 % interval holds the truth."""
    rows = [
        [
            each.variant,
            assumed_noise(each),
            each.loop,
            f"× {each.noise:g}",
            *(f"{100 * each.coverage[name]:.1f}" for name in PARAMETERS),
        ]
        for each in scores
        if each.coverage is not None
    ]
    heads = [f"{symbol} [%]" for symbol in PARAMETERS.values()]
    return table(["variant", "assumed σ", "loop", "noise", *heads], rows)


def tables(made: Reproduction) -> str:
    """Return the page of tables."""
    loops = list(dict.fromkeys(each.loop for each in made.variants))
    parts = [
        "% Made by python -m studies.documentation.variants\n",
        f"# Every variant of the energy-based estimator\n\n{made.setting}\n\n"
        "Mean error, and in brackets the root mean square error, in % of the truth, over "
        f"{made.options['runs']} runs of each loop and noise, seed {made.options['seed']} "
        "(`python -m studies.documentation.variants`; `python -m studies.van_de_wijdeven part-a "
        f"--runs {made.options['runs']}` gives the same). Noise is over that of the surrogate "
        "values, assumed σ over the true one. [What the variants are, and which to "
        "choose](energy.md).\n",
    ]
    for loop in loops:
        scores = [each for each in made.variants if each.loop == loop]
        parts.append(f"## {loop.capitalize()}\n\n{errors(scores)}")
    parts.append(
        "## Intervals\n\nShare of runs whose 95 % interval holds the truth. With "
        f"{made.options['runs']} runs, chance alone moves it by "
        f"{100 * np.sqrt(0.95 * 0.05 / made.options['runs']):.1f} % (one standard deviation). The "
        "source's recursion gives no interval.\n\n" + coverage(made.variants)
    )
    return "\n".join(parts)


def bars(made: Reproduction) -> None:
    """Draw the root mean square error of every variant at the noise of the surrogate values."""
    scores = [each for each in made.variants if each.noise == 1.0 and each.assumed in {None, 1.0}]
    best = {(each.loop, each.variant): each for each in scores if each.assumed == 1.0}
    best |= {(each.loop, each.variant): each for each in scores if each.assumed is None}
    names = list(dict.fromkeys(each.variant for each in made.variants))
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6), sharey=True, layout="constrained")
    place = np.arange(len(names))
    for axis, loop in zip(axes, ("feedforward", "feedback"), strict=True):
        for offset, color, (name, symbol) in zip(
            (-0.2, 0.2), (BLUE, ORANGE), PARAMETERS.items(), strict=True
        ):
            values = [100 * best[loop, variant].rmse[name] for variant in names]
            axis.barh(place + offset, values, height=0.36, color=color, label=symbol)
        axis.set(title=loop, xscale="log", xlabel="root mean square error [% of the truth]")
        axis.grid(visible=False, axis="y")
    axes[0].set_yticks(place, names)
    axes[0].invert_yaxis()
    axes[0].legend(loc="lower right")
    save(figure, "variants.png")


def main() -> None:
    """Make everything."""
    style()
    with TemporaryDirectory() as folder, Progress() as progress:
        task = progress.add_task("part A", total=None)
        made = reproduce_part_a(
            folder,
            runs=RUNS,
            progress=lambda done, every: progress.update(task, completed=done, total=every),
        )
        for number in SHOWN:
            name = f"figure-{number}.png"
            copyfile(Path(folder) / name, FIGURES / name)
    bars(made.reproduction)
    (DOCS / "theory" / "variants.md").write_text(tables(made.reproduction), encoding="utf-8")


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
