"""The conjunction's own sections: series of pulses, and controllers on random arms."""

from collections.abc import Sequence

from stickslip.presentation.page import Section, Text
from stickslip.presentation.table import Column, Table
from stickslip.presentation.words import prefixed
from studies.van_de_wijdeven.records import (
    ConjunctionReproduction,
    FrictionErrorEffect,
    LandingScore,
    ReferenceSeries,
    Spread,
    SuccessiveSeries,
)


def conjunction_sections(reproduction: ConjunctionReproduction) -> tuple[Section, ...]:
    """Return the sections of the conjunction between claims and figures."""
    scores = reproduction.landing_scores
    cases = dict.fromkeys(each.case for each in scores)
    return (
        Section(
            "series",
            "Series of pulses",
            [
                _reference_series(reproduction.reference_series),
                _friction_errors(reproduction.friction_errors),
                _successive_series(reproduction.successive_series),
            ],
        ),
        Section(
            "controllers",
            "Controllers compared",
            [
                Text(
                    f"Each controller on the same arms, in {scores[0].moves} moves; medians, with "
                    "what 95 % do not exceed in brackets. Errors and swings are over the move, "
                    "times over the shortest possible."
                ),
                *(_landing_scores([each for each in scores if each.case == c]) for c in cases),
                Text(reproduction.how_compared),
            ],
        ),
    )


def _reference_series(every: Sequence[ReferenceSeries]) -> Table:
    return Table(
        title="Shortest durations",
        caption="From rest to rest over 1 m. What is left is of the exact simulation of the arm as "
        "it is guessed.",
        columns=[
            Column("series", "left"),
            Column("known [s]"),
            Column("planned [s]"),
            Column("impulse [N s]"),
            Column("largest effort [N]"),
            Column("left [m]"),
        ],
        rows=[
            (
                f"{each.pulses} pulses of {each.pulse_width:g} s",
                f"{each.expected_duration:.2f}",
                f"{each.duration:.2f}",
                f"{each.impulse:.3f}",
                f"{each.peak_effort:.3f}",
                f"{each.residual:.0e}",
            )
            for each in every
        ],
    )


def _friction_errors(every: Sequence[FrictionErrorEffect]) -> Table:
    return Table(
        title="Coulomb friction that is not as guessed",
        caption="True over guessed friction, and what the series at full rate leaves, in % of the "
        "move, beside what is known of another series of the same duration. Where there is less "
        "friction than guessed both must be the same; where there is more, mass 1 sticks on the "
        "way where the series lets it creep, which series of one duration do differently.",
        columns=[
            Column("friction"),
            Column("mass 1, other"),
            Column("mass 1, ours"),
            Column("swing, other"),
            Column("swing, ours"),
        ],
        rows=[
            (
                f"{100 * each.friction_error:+g} %",
                f"{100 * each.expected_error:+.3g}",
                f"{100 * each.error:+.3g}",
                f"{100 * each.expected_swing:+.3g}",
                f"{100 * each.swing:+.3g}",
            )
            for each in every
        ],
    )


def _successive_series(every: Sequence[SuccessiveSeries]) -> Table:
    count = max(each.error.size for each in every)
    return Table(
        title="Successive series",
        caption="What is left of 1 m, the larger of mass 1's error and mass 2's swing, by the "
        "error of the first guess and whether it learns.",
        columns=[
            Column("guess", "left"),
            *(Column(f"after series {k + 1}") for k in range(count)),
        ],
        rows=[
            (
                f"{100 * each.friction_error:+g} %, ".replace("-", "−")
                + ("learns" if each.learning else "stays"),
                *(
                    prefixed(max(abs(float(error)), float(swing)), "m")
                    for error, swing in zip(each.error, each.swing, strict=True)
                ),
                *["–"] * (count - each.error.size),
            )
            for each in every
        ],
    )


def _landing_scores(of_case: Sequence[LandingScore]) -> Table:
    case = of_case[0].case
    return Table(
        title=f"{case[0].upper()}{case[1:]}, {of_case[0].arms} random arms",
        columns=[
            Column("controller", "left"),
            Column("landed [%]"),
            Column("mass 1 off"),
            Column("mass 2 off", only="page"),
            Column("swing"),
            Column("time"),
            Column("series"),
            Column("peak effort / limit", only="page"),
        ],
        rows=[
            (
                each.controller,
                f"{100 * each.landed:.0f}",
                _spread(each.error_1),
                _spread(each.error_2),
                _spread(each.swing),
                _spread(each.time_ratio),
                _spread(each.series),
                f"{each.peak_effort:.3g}",
            )
            for each in of_case
        ],
    )


def _spread(of: Spread | None) -> str:
    return "–" if of is None else f"{of.median:.2g} ({of.upper_95:.2g})"
