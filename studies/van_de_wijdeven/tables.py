"""The tables that each part prints on a terminal."""

import math

from rich import box
from rich.table import Table

from studies.van_de_wijdeven.records import (
    ConjunctionReproduction,
    EnergyReproduction,
    PulseReproduction,
    Spread,
    VariantScore,
)


def _table(title: str, words: tuple[str, ...], numbers: tuple[str, ...]) -> Table:
    """Return an empty table with columns of words, then of numbers."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, pad_edge=False)
    for head in words:
        table.add_column(head)
    for head in numbers:
        table.add_column(head, justify="right")
    return table


def five_runs(reproduction: EnergyReproduction) -> Table:
    """Return the estimates and ITSE after five runs."""
    table = _table(
        "After five consecutive runs",
        ("loop", "case"),
        ("Coulomb [N]", "viscous [N s/m]", "ITSE of run 1", "of run 5"),
    )
    for each in reproduction.five_runs:
        table.add_row(
            each.loop,
            each.case,
            *(f"{values[-1]:.4f}" for values in each.values.values()),
            f"{each.itse[0]:.3g}",
            f"{each.itse[-1]:.3g}",
        )
    return table


def variants(reproduction: EnergyReproduction) -> Table:
    """Return bias and root mean square error of every variant of the estimator."""
    loops = list(dict.fromkeys(each.loop for each in reproduction.variants))
    table = _table(
        "Bias (root mean square error) in % of the truth, "
        f"{reproduction.options['runs']} runs at the surrogate's noise, true σ where one is needed",
        ("variant",),
        tuple(f"{loop}\n{head}" for loop in loops for head in ("Coulomb", "viscous")),
    )
    scores: dict[tuple[str, str], VariantScore] = {}
    for each in reproduction.variants:
        if each.noise == 1.0 and each.assumed in {None, 1.0}:
            # A variant that needs no σ is shown as it is without one, which comes first.
            scores.setdefault((each.variant, each.loop), each)
    for variant in dict.fromkeys(name for name, _ in scores):
        cells = [
            f"{100 * scores[variant, loop].bias[name]:+.2f} "
            f"({100 * scores[variant, loop].rmse[name]:.2f})"
            for loop in loops
            for name in scores[variant, loop].bias
        ]
        table.add_row(variant, *cells)
    return table


def printed_numbers(reproduction: PulseReproduction) -> Table:
    """Return the source's numbers beside ours."""
    table = _table("The source's numbers", ("place", "quantity"), ("printed", "ours", "unit"))
    for each in reproduction.printed_numbers:
        unit = "" if each.unit == "1" else each.unit
        table.add_row(each.place, each.quantity, each.printed, f"{each.value:.4g}", unit)
    return table


def carried_runs(reproduction: PulseReproduction) -> Table:
    """Return how the first and the last run of each case ended."""
    table = _table(
        "Consecutive runs: pulses and error [µm] of the first and of the last, and how many ended "
        "at rest on target",
        ("controller", "reading", "t_p,max [s]"),
        ("pulses", "error", "pulses", "error", "on target"),
    )
    for each in reproduction.carried_runs:
        table.add_row(
            each.controller,
            each.reading,
            "–" if each.longest_pulse is None else f"{each.longest_pulse:g}",
            *(
                cell
                for run in (0, -1)
                for cell in (f"{each.pulses[run]}", f"{1e6 * each.final_error[run]:.1f}")
            ),
            f"{int(each.reached.sum())} of {each.reached.size}",
        )
    return table


def controller_scores(reproduction: PulseReproduction) -> Table:
    """Return how the controllers do on random axes."""
    scores = reproduction.controller_scores
    table = _table(
        f"Controllers on {scores[0].axes} random axes",
        ("controller",),
        ("on target", "hunting", "median error", "worst", "median time", "pulses"),
    )
    for each in scores:
        table.add_row(
            each.controller + (f" ({each.axes} axes)" if each.axes != scores[0].axes else ""),
            f"{100 * each.within_tolerance:.1f} %",
            f"{100 * each.hunting:.1f} %",
            f"{1e6 * each.median_error:.1f} µm",
            f"{1e6 * each.worst_error:.1f} µm",
            _number(each.median_time, " s"),
            _number(each.median_pulses, ""),
        )
    return table


def _number(value: float | None, unit: str) -> str:
    return "–" if value is None or math.isnan(value) else f"{value:.3g}{unit}"


def reference_series(reproduction: ConjunctionReproduction) -> Table:
    """Return the shortest series beside what is known of them."""
    table = _table(
        "Shortest series from rest to rest",
        (),
        ("pulses", "width [s]", "known [s]", "planned [s]", "left [m]"),
    )
    for each in reproduction.reference_series:
        table.add_row(
            f"{each.pulses}",
            f"{each.pulse_width:g}",
            f"{each.expected_duration:.2f}",
            f"{each.duration:.2f}",
            f"{each.residual:.0e}",
        )
    return table


def friction_errors(reproduction: ConjunctionReproduction) -> Table:
    """Return what a Coulomb friction that is not as guessed leaves."""
    table = _table(
        "Left if Coulomb friction is not as guessed, in % of the move (of another series of the "
        "same duration)",
        (),
        ("friction", "mass 1", "swing of mass 2"),
    )
    for each in reproduction.friction_errors:
        table.add_row(
            f"{100 * each.friction_error:+g} %",
            f"{100 * each.error:+.2f} ({100 * each.expected_error:+.2f})",
            f"{100 * each.swing:.2f} ({100 * each.expected_swing:.2f})",
        )
    return table


def landing_scores(reproduction: ConjunctionReproduction) -> Table:
    """Return how the controllers do on random arms."""
    scores = reproduction.landing_scores
    table = _table(
        f"Controllers on {scores[0].arms} random arms, {scores[0].moves} moves; medians, over the "
        "move and the shortest time. Landed: both masses stay within a bound that the page gives; "
        "it is wider with noise",
        ("sensors and knowledge", "controller"),
        ("landed", "mass 1 off", "swing", "time", "series"),
    )
    for each in scores:
        table.add_row(
            each.case,
            each.controller,
            f"{100 * each.landed:.0f} %",
            _median(each.error_1),
            _median(each.swing),
            _median(each.time_ratio),
            _median(each.series),
        )
    return table


def _median(of: Spread | None) -> str:
    return "–" if of is None else f"{of.median:.2g}"
