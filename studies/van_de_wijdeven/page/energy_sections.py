"""Part A's own sections: estimates after five runs, and all variants."""

import math
from collections.abc import Sequence

from stickslip.presentation.page import Block, Section, Text
from stickslip.presentation.table import Column, Table
from stickslip.records import in_words, unit_of, unit_text
from studies.van_de_wijdeven.records import EnergyReproduction, FiveRuns, VariantScore


def energy_sections(reproduction: EnergyReproduction) -> tuple[Section, ...]:
    """Return the sections of part A between claims and figures."""
    return (
        Section("estimates", "Estimates and ITSE", _estimates(reproduction.five_runs)),
        Section("variants", "All variants", _variants(reproduction.variants)),
    )


def _estimates(every: Sequence[FiveRuns]) -> list[Block]:
    runs = range(1, every[0].itse.size + 1)
    loops = list(dict.fromkeys(each.loop for each in every))
    errors: dict[str, list[str]] = {}
    for each in every:
        errors.setdefault(each.case, []).extend(map(_short, each.itse.tolist()))
    return [
        Text("Estimates after each of five consecutive runs: the runs of Figures 6.1 to 6.10."),
        *(_learned([each for each in every if each.loop == loop]) for loop in loops),
        Table(
            title="Prediction error",
            caption="Its integral of time-multiplied squared error (Eq. 6.3), over that of the "
            "first run without noise in the same loop. It measures what the regression leaves, "
            "not how true the estimates are: compensating the noise can make it larger.",
            columns=[
                Column("case", "left"),
                *(_of_run(f"{loop}, run {run}", run, runs) for loop in loops for run in runs),
            ],
            rows=[(case, *cells) for case, cells in errors.items()],
        ),
    ]


def _of_run(head: str, run: int, runs: range) -> Column:
    """Return a column of a run; a terminal shows those of the first run and the last one."""
    return Column(head, only="" if run in (runs[0], runs[-1]) else "page")


def _learned(of_loop: Sequence[FiveRuns]) -> Table:
    names = list(of_loop[0].values)
    runs = range(1, of_loop[0].itse.size + 1)
    return Table(
        title=f"Estimates, {of_loop[0].loop}",
        columns=[
            Column("case", "left"),
            *(
                _of_run(f"run {run}: {_quantity(name)}", run, runs)
                for name in names
                for run in runs
            ),
        ],
        rows=[
            (each.case, *(f"{value:.4f}" for name in names for value in each.values[name]))
            for each in of_loop
        ],
    )


def _variants(scores: Sequence[VariantScore]) -> list[Block]:
    blocks: list[Block] = [
        Text(
            f"Every variant over {scores[0].runs} runs for each loop and each noise, each run from "
            "first guesses of zero: mean error, and in brackets root mean square error, in % of "
            "the truth. Noise is over that of the surrogate values; σ assumed is over the true "
            "one. In the feedback all variants see the same logs, made while the controller "
            "compensates with the source's own best form (printed sums, true σ, B and S)."
        ),
        Text(
            "Printed sums are backward Euler (Eqs. 3.6, 4.3, 4.4); exact sums are exact while the "
            "input is held over each sample. Printed compensation takes the polynomials of orders "
            "six and four (Eqs. 5.21 to 5.24), settled compensation the double expectation itself. "
            "B and S multiply 1 and what is compensated (Eq. 6.2), so there is no variant of them "
            "without a compensation. The noise-robust estimator needs neither: it follows the "
            "motion with the known masses and spring, and learns the noise from the log; on line "
            "it is also given a first guess of σ, right and wrong."
        ),
    ]
    for loop in dict.fromkeys(each.loop for each in scores):
        there = [each for each in scores if each.loop == loop]
        blocks += [
            _errors(there),
            *(
                Text(
                    f"{each.variant}, noise × {each.noise:g}: nothing was identified in "
                    f"{each.failed} of {each.runs} runs, which count in nothing else."
                )
                for each in there
                if each.failed
            ),
        ]
    sure = [each for each in scores if each.coverage is not None]
    return [*blocks, _coverage(sure)] if sure else blocks


def _errors(of_loop: Sequence[VariantScore]) -> Table:
    names = list(of_loop[0].bias)
    noises = dict.fromkeys(each.noise for each in of_loop)
    found = {(each.variant, each.assumed, each.noise): each for each in of_loop}
    return Table(
        title=f"Mean and root mean square errors, {of_loop[0].loop}",
        columns=[
            Column("variant", "left"),
            Column("σ assumed"),
            *(
                Column(
                    f"noise × {noise:g}: {_label(name)} [%]", only="" if noise == 1.0 else "page"
                )
                for noise in noises
                for name in names
            ),
        ],
        rows=[
            (
                variant,
                _ratio(assumed),
                *(_error(found[variant, assumed, k], name) for k in noises for name in names),
            )
            for variant, assumed in dict.fromkeys((each.variant, each.assumed) for each in of_loop)
        ],
    )


def _coverage(scores: Sequence[VariantScore]) -> Table:
    names = list(scores[0].bias)
    return Table(
        title="Intervals",
        caption="Share of the runs in which the 95 % interval holds the truth; a single run is "
        f"{100 / scores[0].runs:.2g} %. The source's recursion gives no interval.",
        columns=[
            Column("variant", "left"),
            Column("loop", "left"),
            Column("noise"),
            Column("σ assumed"),
            *(Column(f"covered: {_label(name)} [%]") for name in names),
        ],
        rows=[
            (
                each.variant,
                each.loop,
                _ratio(each.noise),
                _ratio(each.assumed),
                *(f"{100 * coverage[name]:.1f}" for name in names),
            )
            for each in scores
            if (coverage := each.coverage) is not None
        ],
    )


def _label(name: str) -> str:
    return in_words(name).removesuffix(" friction")


def _quantity(name: str) -> str:
    return f"{_label(name)} [{unit_text(unit_of(name, 'linear'))}]"


def _ratio(value: float | None) -> str:
    return "–" if value is None else f"× {value:g}"


def _short(value: float) -> str:
    """Return a positive number with three digits, and without an exponent where it is large."""
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}".replace(",", "\u202f")


def _error(score: VariantScore, name: str) -> str:
    bias, rmse = 100 * score.bias[name], 100 * score.rmse[name]
    if not (math.isfinite(bias) and math.isfinite(rmse)):
        return "–"
    decimals = 2 if rmse < 100 else 0
    return f"{bias:+.{decimals}f} ({rmse:.{decimals}f})"
