"""Part B's own sections: its numbers, its runs, and controllers on random axes."""

import math
from collections.abc import Sequence

import numpy as np

from stickslip.presentation.drawing import symbol
from stickslip.presentation.page import Block, Section, Text
from stickslip.presentation.table import Cell, Column, Table
from stickslip.presentation.words import prefixed
from stickslip.records import QUANTITIES, in_words, unit_of, unit_text
from studies.van_de_wijdeven.records import (
    CarriedRuns,
    ControllerScore,
    PrintedNumber,
    PulseReproduction,
    ResolutionScore,
)

_SYMBOLS = {"pulse_effort": "<i>f</i><sub>p</sub>"}  # of values that are no quantity of an axis
_ESTIMATES = {"pulse_gain": "b̂", "coulomb_friction": "f̂_c"}
_TABLE = "table_1"  # the group of values that the source prints as its Table 1


def pulse_sections(reproduction: PulseReproduction) -> tuple[Section, ...]:
    """Return the sections of part B between claims and figures."""
    return (
        Section(
            "numbers",
            "Numbers",
            [_table_1(reproduction), _printed_numbers(reproduction.printed_numbers)],
        ),
        Section("runs", "Ten runs", _carried_runs(reproduction.carried_runs)),
        Section(
            "controllers",
            "Controllers compared",
            [_controller_scores(reproduction.controller_scores), Text(reproduction.how_compared)],
        ),
        Section("resolution", "How near", [_resolution_scores(reproduction.resolution_scores)]),
    )


def _table_1(reproduction: PulseReproduction) -> Table:
    return Table(
        title="Table 1",
        style="options",
        columns=[Column("quantity", "left"), Column("value")],
        rows=[
            (_term(name), f"{_values(value)} {unit_text(unit)}")
            for name, (value, unit) in reproduction.values[_TABLE].items()
        ],
    )


def _values(value: float | tuple[float, ...]) -> str:
    return ", ".join(f"{each:g}" for each in (value if isinstance(value, tuple) else (value,)))


def _term(name: str) -> Cell:
    words = in_words(name).replace("_", " ")
    letter = symbol(name) if name in QUANTITIES else _SYMBOLS.get(name, "")
    return Cell(words[0].upper() + words[1:], symbol=letter)


def _printed_numbers(numbers: Sequence[PrintedNumber]) -> Table:
    return Table(
        title="Every number of the text",
        style="parameters",
        caption="“Same digits” says whether ours, rounded to the digits that the source prints, is "
        "the source's.",
        columns=[
            Column("place", "left"),
            Column("quantity", "left"),
            Column("printed"),
            Column("ours"),
            Column("unit", "left"),
            Column("printed − ours [%]", only="page"),
            Column("same digits", "left"),
            Column("from", "left", only="page"),
        ],
        rows=[
            (
                each.place,
                each.quantity,
                each.printed,
                f"{each.value:.4g}",
                "" if each.unit == "1" else unit_text(each.unit),
                f"{100 * each.difference:+.1f}",
                Cell("yes", "good") if each.same_digits else Cell("no", "bad"),
                each.how,
            )
            for each in numbers
        ],
    )


def _carried_runs(every: Sequence[CarriedRuns]) -> list[Block]:
    controllers = dict.fromkeys(each.controller for each in every)
    return [
        Text(
            f"{every[0].final_error.size} runs from the same start, each beginning with the "
            "estimates and the covariance that the run before ended with. Errors are the largest "
            "of the run's last half second; “back” are pulses that pushed back after an overshoot; "
            "“at rest on target” counts the runs that ended so."
        ),
        *(_first_and_last([each for each in every if each.controller == c]) for c in controllers),
    ]


def _first_and_last(every: Sequence[CarriedRuns]) -> Table:
    names = list(every[0].estimates)
    runs = (0, every[0].final_error.size - 1)
    heads = ("pulses (back)", "error [µm]", "time [s]", *map(_estimate_head, names))
    return Table(
        title=every[0].controller,
        columns=[
            Column("case", "left"),
            *(
                Column(f"run {run + 1}: {head}", only="" if head in heads[:2] else "page")
                for run in runs
                for head in heads
            ),
            Column("at rest on target"),
        ],
        rows=[
            (
                f"{each.reading}, {_bound(each.longest_pulse)}",
                *(cell for run in runs for cell in _run_cells(each, run)),
                f"{int(np.sum(each.reached))} of {each.reached.size}",
            )
            for each in every
        ],
    )


def _run_cells(each: CarriedRuns, run: int) -> list[str]:
    return [
        f"{each.pulses[run]} ({each.reversed_pulses[run]})",
        _micrometres(float(each.final_error[run])),
        _number(float(each.time[run]), "{:.2f}"),
        *(_number(float(values[run]), "{:.4g}") for values in each.estimates.values()),
    ]


def _estimate_head(name: str) -> str:
    return f"{_ESTIMATES[name]} [{unit_text(unit_of(name, 'linear'))}]"


def _bound(longest_pulse: float | None) -> str:
    return "any width" if longest_pulse is None else f"widths up to {longest_pulse:g} s"


def _controller_scores(scores: Sequence[ControllerScore]) -> Table:
    axes = scores[0].axes
    return Table(
        title=f"Controllers on {axes} random axes",
        caption="Each controller on the same axes, with the same wrong first guesses. On target: "
        "within the tolerance all the time while watched at the end. Hunting: moved to and fro "
        "then. Times and pulses are those until the target was reached for good, of the axes on "
        "which it was.",
        columns=[
            Column("controller", "left"),
            Column("on target [%]"),
            Column("hunting [%]"),
            Column("median error [µm]"),
            Column("95 % below [µm]", only="page"),
            Column("worst [µm]"),
            Column("median time [s]"),
            Column("median pulses"),
            Column("peak effort / limit", only="page"),
        ],
        rows=[
            (
                each.controller + (f" ({each.axes} axes)" if each.axes != axes else ""),
                f"{100 * each.within_tolerance:.2f}",
                f"{100 * each.hunting:.2f}",
                _micrometres(each.median_error),
                _micrometres(each.error_95),
                _micrometres(each.worst_error),
                _number(each.median_time, "{:.2f}"),
                _number(each.median_pulses, "{:.3g}"),
                f"{each.peak_effort:.3g}",
            )
            for each in scores
        ],
    )


def _resolution_scores(scores: Sequence[ResolutionScore]) -> Table:
    return Table(
        title="Steps of the encoder",
        caption="Below Eq. 24, by alternating pulses: one goes beyond the target, and the next "
        "back by a displacement that differs from it by what is left. The controller of exact "
        "pulses on the mass of Table 1, asked for the step of its encoder, from "
        f"{scores[0].axes} starts of 0.5 to 20 mm in each case. As long as friction repeats "
        "itself, the encoder is the limit; where it changes from pulse to pulse, about that change "
        "times a few steps of Eq. 24, which shrink with the square of the sampling time T.",
        columns=[
            Column("encoder step", "left"),
            Column("f_s/f_c"),
            Column("friction changes by"),
            Column("T"),
            Column("Eq. 24", only="page"),
            Column("median error"),
            Column("95 % below"),
            Column("within a step [%]"),
            Column("median pulses"),
        ],
        rows=[
            (
                prefixed(each.encoder_step, "m"),
                f"{each.static_ratio:g}",
                "–" if each.friction_change == 0.0 else f"{100 * each.friction_change:g} %",
                prefixed(each.sampling_time, "s"),
                prefixed(each.smallest_step, "m"),
                prefixed(each.median_error, "m"),
                prefixed(each.error_95, "m"),
                f"{100 * each.within_a_step:.0f}",
                f"{each.median_pulses:g}",
            )
            for each in scores
        ],
    )


def _micrometres(error: float) -> str:
    """Return a length in micrometres with three digits, and no exponent."""
    value = 1e6 * error
    return f"{value:,.0f}".replace(",", "\u202f") if abs(value) >= 1000 else f"{value:.3g}"


def _number(value: float | None, form: str) -> str:
    return "–" if value is None or math.isnan(value) else form.format(value)
