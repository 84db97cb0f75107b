"""Part A's own sections on its page: estimates after five runs, and all variants."""

import html
import math
from collections.abc import Mapping, Sequence

from stickslip.presentation.drawing import symbol
from stickslip.presentation.page import Section
from stickslip.records import parameter_label, unit_of, unit_text
from studies.van_de_wijdeven.page.dense import row, section, typeset, wide
from studies.van_de_wijdeven.records import EnergyReproduction, FiveRuns, VariantScore


def energy_sections(reproduction: EnergyReproduction) -> tuple[Section, ...]:
    """Return what stands on the page of part A between claims and figures."""
    return (
        section("estimates", "Estimates and ITSE", _estimates(reproduction.five_runs)),
        section("variants", "All variants", _variants(reproduction.variants)),
    )


def _estimates(every: Sequence[FiveRuns]) -> str:
    parts = [
        "<p>What the estimators had learned after each of five consecutive runs: the runs of "
        "Figures 6.1 to 6.10.</p>\n"
    ]
    loops = list(dict.fromkeys(each.loop for each in every))
    for loop in loops:
        there = [each for each in every if each.loop == loop]
        names = list(there[0].values)
        parts.append(
            f"<h3>{loop.capitalize()}</h3>\n"
            + _table_of_runs(
                [f"{_quantity(name)} after run" for name in names],
                there[0].itse.size,
                {
                    each.case: [
                        _fixed(value) for name in names for value in each.values[name].tolist()
                    ]
                    for each in there
                },
            )
        )
    errors: dict[str, list[str]] = {}
    for each in every:
        errors.setdefault(each.case, []).extend(map(_short, each.itse.tolist()))
    parts.append(
        "<h3>Prediction error</h3>\n<p>Its integral of time-multiplied squared error (Eq. 6.3), "
        "over that of the first run without noise in the same loop. It measures what the "
        "regression leaves, not how true the estimates are: compensating the noise can make it "
        "larger.</p>\n"
        + _table_of_runs(
            [f"{loop.capitalize()}, run" for loop in loops], every[0].itse.size, errors
        )
    )
    return "".join(parts)


def _table_of_runs(groups: Sequence[str], runs: int, rows: Mapping[str, Sequence[str]]) -> str:
    """Return a table with a group of columns, one a run, under each head."""
    top = "".join(f'<th scope="colgroup" colspan="{runs}">{group}</th>' for group in groups)
    numbers = "".join(f'<th scope="col">{run}</th>' for run in range(1, runs + 1)) * len(groups)
    body = "".join(row(name, cells) for name, cells in rows.items())
    return wide(
        f"<thead><tr><td></td>{top}</tr><tr><td></td>{numbers}</tr></thead>\n"
        f"<tbody>\n{body}</tbody>"
    )


def _variants(scores: Sequence[VariantScore]) -> str:
    parts = [
        f"<p>Every variant over {scores[0].runs} runs for each loop and each noise, each run from "
        "first guesses of zero: mean error, and in brackets root mean square error, in % of the "
        "truth. Noise is over that of the surrogate values; σ assumed is over the true one. In the "
        "feedback all variants see the same logs, made while the controller compensates with the "
        "source's own best form (printed sums, true σ, B and S).</p>\n"
        "<p>Printed sums are backward Euler (Eqs. 3.6, 4.3, 4.4); exact sums are exact while the "
        "input is held over each sample. Printed compensation takes the polynomials of orders six "
        "and four (Eqs. 5.21 to 5.24), settled compensation the double expectation itself. B and S "
        "multiply 1 and what is compensated (Eq. 6.2), so there is no variant of them without a "
        "compensation. The noise-robust estimator needs neither: it follows the motion with the "
        "known masses and spring, and learns the noise from the log; on line it is also given a "
        "first guess of σ, right and wrong.</p>\n"
    ]
    for loop in dict.fromkeys(each.loop for each in scores):
        there = [each for each in scores if each.loop == loop]
        parts.append(f"<h3>{loop.capitalize()}</h3>\n{_variant_table(there)}")
        parts += [
            f"<p>{html.escape(each.variant)}, noise × {each.noise:g}: nothing was identified in "
            f"{each.failed} of {each.runs} runs, which count in nothing else.</p>\n"
            for each in there
            if each.failed
        ]
    sure = [each for each in scores if each.coverage is not None]
    if sure:
        parts.append(
            "<h3>Intervals</h3>\n<p>Share of the runs in which the 95 % interval holds the truth; "
            f"a single run is {100 / sure[0].runs:.2g} %. The source's recursion gives no "
            "interval.</p>\n" + _coverage_table(sure)
        )
    return "".join(parts)


def _variant_table(scores: Sequence[VariantScore]) -> str:
    names = list(scores[0].bias)
    noises = list(dict.fromkeys(each.noise for each in scores))
    found = {(each.variant, each.assumed, each.noise): each for each in scores}
    top = "".join(
        f'<th scope="colgroup" colspan="{len(names)}">noise × {noise:g}</th>' for noise in noises
    )
    second = "".join(f'<th scope="col">{symbol(name)} [%]</th>' for name in names) * len(noises)
    rows: list[str] = []
    for variant, assumed in dict.fromkeys((each.variant, each.assumed) for each in scores):
        cells = ["–" if assumed is None else f"× {assumed:g}"]
        for noise in noises:
            score = found[variant, assumed, noise]
            cells += [_error(score.bias[name], score.rmse[name]) for name in names]
        rows.append(row(variant, cells))
    return wide(
        f"<thead><tr><td></td><td></td>{top}</tr>"
        f'<tr><th scope="col">variant</th><th scope="col">σ assumed</th>{second}</tr></thead>\n'
        f"<tbody>\n{''.join(rows)}</tbody>"
    )


def _coverage_table(scores: Sequence[VariantScore]) -> str:
    names = list(scores[0].bias)
    heads = "".join(
        f'<th scope="col">{name}</th>'
        for name in (
            "variant",
            "loop",
            "noise",
            "σ assumed",
            *(f"{symbol(n)} [%]" for n in names),
        )
    )
    body = "".join(
        row(
            each.variant,
            [
                each.loop,
                f"× {each.noise:g}",
                "–" if each.assumed is None else f"× {each.assumed:g}",
                *(
                    "–" if each.coverage is None else f"{100 * each.coverage[name]:.1f}"
                    for name in names
                ),
            ],
        )
        for each in scores
    )
    return wide(f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}</tbody>")


def _quantity(name: str) -> str:
    return f"{parameter_label(name)} {symbol(name)} [{unit_text(unit_of(name, 'linear'))}]"


def _fixed(value: float) -> str:
    return typeset(f"{value:.4f}")


def _short(value: float) -> str:
    """Return a positive number with three digits, and without an exponent where it is large."""
    return f"{value:.3g}" if value < 1000 else f"{value:,.0f}".replace(",", "\u202f")


def _error(bias: float, rmse: float) -> str:
    if not (math.isfinite(bias) and math.isfinite(rmse)):
        return "–"
    decimals = 2 if 100 * rmse < 100 else 0
    return typeset(f"{100 * bias:+.{decimals}f} ({100 * rmse:.{decimals}f})")
