"""Part B's own sections on its page: its numbers, its runs, and controllers on random axes."""

import html
import math
from collections.abc import Sequence

import numpy as np

from stickslip.presentation.drawing import symbol
from stickslip.presentation.page import Section
from stickslip.presentation.words import prefixed
from stickslip.records import QUANTITIES, in_words, unit_text
from studies.van_de_wijdeven.page.dense import prose, row, section, table, typeset, wide
from studies.van_de_wijdeven.records import (
    CarriedRuns,
    ControllerScore,
    PrintedNumber,
    PulseReproduction,
    ResolutionScore,
)

_SYMBOLS = {"pulse_effort": "f_p"}  # of values of Table 1 that are no quantities of an axis
_ESTIMATES = {"pulse_gain": "b̂", "coulomb_friction": "f̂_c"}
_TABLE = "table_1"  # the group of values that the source prints as its Table 1


def pulse_sections(reproduction: PulseReproduction) -> tuple[Section, ...]:
    """Return what stands on the page of part B between claims and figures."""
    return (
        section(
            "numbers",
            "Numbers",
            _table_1(reproduction) + _printed_numbers(reproduction.printed_numbers),
        ),
        section("runs", "Ten runs", _carried_runs(reproduction.carried_runs)),
        section(
            "controllers",
            "Controllers compared",
            _controller_scores(reproduction.controller_scores, reproduction.how_compared),
        ),
        section("resolution", "How near", _resolution_scores(reproduction.resolution_scores)),
    )


def _table_1(reproduction: PulseReproduction) -> str:
    rows = "".join(
        f'<tr><th scope="row">{_term(name)}</th>'
        f'<td class="number">{_values(value)} {html.escape(unit_text(unit))}</td></tr>\n'
        for name, (value, unit) in reproduction.values[_TABLE].items()
    )
    return f'<h3>Table 1</h3>\n<table class="options"><tbody>{rows}</tbody></table>\n'


def _values(value: float | tuple[float, ...]) -> str:
    return ", ".join(f"{each:g}" for each in (value if isinstance(value, tuple) else (value,)))


def _term(name: str) -> str:
    words = in_words(name).replace("_", " ")
    words = words[0].upper() + words[1:]
    if name in QUANTITIES:
        return f"{words} {symbol(name)}"
    return f"{words} {prose(_SYMBOLS[name])}" if name in _SYMBOLS else words


def _printed_numbers(numbers: Sequence[PrintedNumber]) -> str:
    heads = (
        "place",
        "quantity",
        "printed",
        "ours",
        "unit",
        "printed − ours",
        "same digits",
        "from",
    )
    body = "".join(
        f'<tr><th scope="row">{prose(each.place)}</th><td>{prose(each.quantity)}</td>'
        f'<td class="number">{each.printed}</td><td class="number">{each.value:.4g}</td>'
        f"<td>{'' if each.unit == '1' else html.escape(unit_text(each.unit))}</td>"
        f'<td class="number">{_signed_percent(each.difference)}</td>'
        f"<td>{_mark(yes=each.same_digits)}</td><td>{prose(each.how)}</td></tr>\n"
        for each in numbers
    )
    return (
        "<h3>Every number of the text</h3>\n<p>“Same digits” says whether ours, rounded to the "
        "digits that the source prints, is the source's.</p>\n"
        + table(heads, body, words=("quantity", "unit", "same digits", "from"))
    )


def _carried_runs(every: Sequence[CarriedRuns]) -> str:
    runs = every[0].final_error.size
    parts = [
        f"<p>{runs} runs from the same start, each beginning with the estimates and the covariance "
        "that the run before ended with. Errors are the largest of the run's last half second; "
        "“back” are pulses that pushed back after an overshoot; “at rest on target” counts the "
        "runs that ended so.</p>\n"
    ]
    for controller in dict.fromkeys(each.controller for each in every):
        there = [each for each in every if each.controller == controller]
        parts.append(f"<h3>{html.escape(controller)}</h3>\n{_runs_table(there, (0, runs - 1))}")
    return "".join(parts)


def _runs_table(every: Sequence[CarriedRuns], shown: tuple[int, ...]) -> str:
    names = list(every[0].estimates)
    columns = ("pulses (back)", "error [µm]", "time [s]", *(_estimate_head(n) for n in names))
    top = "".join(
        f'<th scope="colgroup" colspan="{len(columns)}">run {run + 1}</th>' for run in shown
    )
    heads = "".join(f'<th scope="col">{column}</th>' for column in columns) * len(shown)
    body = "".join(
        row(
            f"{each.reading}, {_bound(each.longest_pulse)}",
            [
                *(cell for run in shown for cell in _run_cells(each, run, names)),
                f"{int(np.sum(each.reached))} of {each.reached.size}",
            ],
        )
        for each in every
    )
    return wide(
        f'<thead><tr><td></td>{top}<td></td></tr><tr><th scope="col">case</th>{heads}'
        f'<th scope="col">at rest on target</th></tr></thead>\n<tbody>\n{body}</tbody>'
    )


def _run_cells(each: CarriedRuns, run: int, names: Sequence[str]) -> list[str]:
    return [
        f"{each.pulses[run]} ({each.reversed_pulses[run]})",
        _micrometres(float(each.final_error[run])),
        _number(float(each.time[run]), "{:.2f}"),
        *(_number(float(each.estimates[name][run]), "{:.4g}") for name in names),
    ]


def _estimate_head(name: str) -> str:
    unit = html.escape(unit_text(QUANTITIES[name].unit("linear")))
    return f"{prose(_ESTIMATES[name])} [{unit}]"


def _bound(longest_pulse: float | None) -> str:
    return "any width" if longest_pulse is None else f"widths up to {longest_pulse:g} s"


def _controller_scores(scores: Sequence[ControllerScore], how_compared: str) -> str:
    heads = (
        "controller",
        "on target [%]",
        "hunting [%]",
        "median error [µm]",
        "95 % below [µm]",
        "worst [µm]",
        "median time [s]",
        "median pulses",
        "peak effort / limit",
    )
    body = "".join(
        row(
            each.controller + (f" ({each.axes} axes)" if each.axes != scores[0].axes else ""),
            [
                f"{100 * each.within_tolerance:.2f}",
                f"{100 * each.hunting:.2f}",
                _micrometres(each.median_error),
                _micrometres(each.error_95),
                _micrometres(each.worst_error),
                _number(each.median_time, "{:.2f}"),
                _number(each.median_pulses, "{:.3g}"),
                f"{each.peak_effort:.3g}",
            ],
        )
        for each in scores
    )
    return (
        f"<p>Each controller on the same {scores[0].axes} random axes, with the same wrong first "
        "guesses. On target: within the tolerance all the time while watched at the end. Hunting: "
        "moved to and fro then. Times and pulses are those until the target was reached for good, "
        "of the axes on which it was.</p>\n"
        + table(heads, body)
        + f"<p>{prose(how_compared)}</p>\n"
    )


def _resolution_scores(scores: Sequence[ResolutionScore]) -> str:
    heads = (
        "encoder step",
        "f_s/f_c",
        "friction changes by",
        "T",
        "Eq. 24",
        "median error",
        "95 % below",
        "within a step [%]",
        "median pulses",
    )
    body = "".join(
        row(
            prefixed(each.encoder_step, "m"),
            [
                f"{each.static_ratio:g}",
                "–" if each.friction_change == 0.0 else f"{100 * each.friction_change:g} %",
                prefixed(each.sampling_time, "s"),
                *(
                    prefixed(length, "m")
                    for length in (each.smallest_step, each.median_error, each.error_95)
                ),
                f"{100 * each.within_a_step:.0f}",
                f"{each.median_pulses:g}",
            ],
        )
        for each in scores
    )
    return (
        "<p>Below Eq. 24, by alternating pulses: one goes beyond the target, and the next back by "
        "a displacement that differs from it by what is left. The controller of exact pulses on "
        f"the mass of Table 1, asked for the step of its encoder, from {scores[0].axes} starts of "
        "0.5 to 20 mm in each case. As long as friction repeats itself, the encoder is the limit; "
        "where it changes from pulse to pulse, about that change times a few steps of Eq. 24, "
        "which shrink with the square of the sampling time T.</p>\n" + table(heads, body)
    )


def _mark(*, yes: bool) -> str:
    return '<span class="mark-yes">✓</span>' if yes else '<span class="mark-no">✗</span>'


def _micrometres(error: float) -> str:
    """Return a length in micrometres with three digits, and no exponent."""
    value = 1e6 * error
    text = f"{value:,.0f}" if abs(value) >= 1000 else f"{value:.3g}"
    return typeset(text.replace(",", "\u202f"))


def _signed_percent(share: float) -> str:
    return typeset(f"{100 * share:+.1f} %")


def _number(value: float | None, form: str) -> str:
    return "–" if value is None or math.isnan(value) else typeset(form.format(value))
