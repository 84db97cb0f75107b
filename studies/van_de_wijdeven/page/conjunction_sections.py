"""The conjunction's own sections on its page: series of pulses, and controllers on random arms."""

from collections.abc import Sequence

from stickslip.presentation.page import Section
from stickslip.presentation.words import prefixed
from studies.van_de_wijdeven.page.dense import prose, row, section, table, typeset
from studies.van_de_wijdeven.records import (
    ConjunctionReproduction,
    FrictionErrorEffect,
    LandingScore,
    ReferenceSeries,
    Spread,
    SuccessiveSeries,
)


def conjunction_sections(reproduction: ConjunctionReproduction) -> tuple[Section, ...]:
    """Return what stands on the page of the conjunction between claims and figures."""
    return (
        section(
            "series",
            "Series of pulses",
            _reference_series(reproduction.reference_series)
            + _friction_errors(reproduction.friction_errors)
            + _successive_series(reproduction.successive_series),
        ),
        section(
            "controllers",
            "Controllers compared",
            _landing_scores(reproduction.landing_scores, reproduction.how_compared),
        ),
    )


def _reference_series(every: Sequence[ReferenceSeries]) -> str:
    rows = "".join(
        row(
            f"{each.pulses} pulses of {each.pulse_width:g} s",
            [
                f"{each.expected_duration:.2f}",
                f"{each.duration:.2f}",
                f"{each.impulse:.3f}",
                f"{each.peak_effort:.3f}",
                typeset(f"{each.residual:.0e}"),
            ],
        )
        for each in every
    )
    return (
        "<h3>Shortest durations</h3>\n<p>From rest to rest over 1 m. What is left is of the exact "
        "simulation of the arm as it is guessed.</p>\n"
        + table(
            (
                "series",
                "known [s]",
                "planned [s]",
                "impulse [N s]",
                "largest effort [N]",
                "left [m]",
            ),
            rows,
        )
    )


def _friction_errors(every: Sequence[FrictionErrorEffect]) -> str:
    rows = "".join(
        row(
            typeset(f"{100 * each.friction_error:+g} %"),
            [
                _signed(each.expected_error),
                _signed(each.error),
                _signed(each.expected_swing),
                _signed(each.swing),
            ],
        )
        for each in every
    )
    return (
        "<h3>Coulomb friction that is not as guessed</h3>\n<p>True over guessed friction, and "
        "what the series at full rate leaves, in % of the move, beside what is known of another "
        "series of the same duration. Where there is less friction than guessed both must be the "
        "same; where there is more, mass 1 sticks on the way where the series lets it creep, "
        "which series of one duration do differently.</p>\n"
        + table(
            ("friction", "mass 1, other", "mass 1, ours", "swing, other", "swing, ours"),
            rows,
        )
    )


def _signed(share: float) -> str:
    return typeset(f"{100 * share:+.3g}")


def _successive_series(every: Sequence[SuccessiveSeries]) -> str:
    count = max(each.error.size for each in every)
    rows = "".join(
        row(
            typeset(f"{100 * each.friction_error:+g} %, {'learns' if each.learning else 'stays'}"),
            [
                prefixed(max(abs(float(error)), float(swing)), "m")
                for error, swing in zip(each.error, each.swing, strict=True)
            ]
            + ["–"] * (count - each.error.size),
        )
        for each in every
    )
    return (
        "<h3>Successive series</h3>\n<p>What is left of 1 m, the larger of mass 1's error and "
        "mass 2's swing, by the error of the first guess and whether it learns.</p>\n"
        + table(("guess", *(f"after series {k + 1}" for k in range(count))), rows)
    )


def _landing_scores(scores: Sequence[LandingScore], how_compared: str) -> str:
    parts = [
        f"<p>Each controller on the same {scores[0].arms} random arms, in {scores[0].moves} moves; "
        "medians, with what 95 % do not exceed in brackets. Errors and swings are over the move, "
        "times over the shortest possible.</p>\n"
    ]
    heads = (
        "controller",
        "landed [%]",
        "mass 1 off",
        "mass 2 off",
        "swing",
        "time",
        "series",
        "peak effort / limit",
    )
    for case in dict.fromkeys(each.case for each in scores):
        rows = "".join(
            row(
                each.controller,
                [
                    f"{100 * each.landed:.0f}",
                    *(_spread(of) for of in (each.error_1, each.error_2, each.swing)),
                    _spread(each.time_ratio),
                    _spread(each.series),
                    f"{each.peak_effort:.3g}",
                ],
            )
            for each in scores
            if each.case == case
        )
        parts.append(f"<h3>{prose(case[0].upper() + case[1:])}</h3>\n{table(heads, rows)}")
    return "".join(parts) + f"<p>{prose(how_compared)}</p>\n"


def _spread(of: Spread | None) -> str:
    if of is None:
        return "–"
    return typeset(f"{of.median:.2g} ({of.upper_95:.2g})")
