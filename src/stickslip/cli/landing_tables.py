"""What the conjunction gives, as tables on a terminal."""

from typing import TYPE_CHECKING

from stickslip.cli.pulse_tables import table_of

if TYPE_CHECKING:
    from rich.table import Table

    from stickslip.records import ConjunctionReproduction, Spread

__all__ = ["friction_errors", "landing_scores", "reference_series"]


def reference_series(reproduction: "ConjunctionReproduction") -> "Table":
    """Return the shortest series beside what is known of them."""
    table = table_of(
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


def friction_errors(reproduction: "ConjunctionReproduction") -> "Table":
    """Return what a Coulomb friction that is not as believed leaves."""
    table = table_of(
        "Left if Coulomb friction is not as believed, in % of the move (of another series of the "
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


def landing_scores(reproduction: "ConjunctionReproduction") -> "Table":
    """Return how the controllers do on random arms."""
    scores = reproduction.landing_scores
    table = table_of(
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


def _median(of: "Spread | None") -> str:
    return "–" if of is None else f"{of.median:.2g}"
