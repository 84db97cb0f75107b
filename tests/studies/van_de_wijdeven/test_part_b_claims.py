"""Verdicts on part B follow the evidence: what the runs show, and what others would show."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from studies.van_de_wijdeven.part_b import (
    error_claims,
    estimate_claims,
    form_claims,
    law_claims,
    pulse_claims,
    width_claims,
)
from studies.van_de_wijdeven.part_b.cases import (
    APPLIED,
    BOUNDED,
    CALCULATED,
    LARGE,
    PAPWC,
    PWC,
    SMALL,
    UNBOUNDED,
    papwc,
)
from studies.van_de_wijdeven.part_b.computation import _place
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.judging import by_reading, lengths
from studies.van_de_wijdeven.part_b.runs import series_of
from studies.van_de_wijdeven.records import Claim

pytestmark = pytest.mark.slow

DIFFER = {
    "For a negative pulse the ±",
    "The regressor of A_1 and A_2",
    "Its f_p and t_p are those before",
    "Â_2/Â_1 is an estimate",
    "It overshoots with the bound too",
    "d_min, 186 µm",
    "That the pulses last two samples",
    "Fluctuations with small velocities",
    "After ten iterations two pulses",
    "In run 10 without a bound, b̂ is larger",
    "Two parameters are estimated",
    "Without carrying P",
}
PARTLY = {
    "The loop is stable": {"b̂ = b"},
    "With a finite t_p,max, overshoot": {f"PAPWC, {SMALL}", f"PAPWC, {LARGE}"},
    "With t_p,max = 0.03 s the estimate b̂": {
        f"PWC, {APPLIED}",
        f"PAPWC, {SMALL}",
        f"PAPWC, {LARGE}",
    },
    "δ can be small": {LARGE},
    "If the error is the same": {f"{SMALL}, P laid anew", f"{LARGE}, P laid anew"},
    "The final error of PAPWC": {
        f"{SMALL}, with the bound",
        f"{LARGE}, no bound",
        f"{LARGE}, with the bound",
    },
    "In run 10 without a bound, one pulse": {LARGE},
    "The pulses of PAPWC die out": {
        f"{SMALL}, with the bound",
        f"{LARGE}, no bound",
        f"{LARGE}, with the bound",
    },
    "With t_p,max, only positive": {SMALL},
    "Without a bound overshoot": {LARGE},
    "That does not influence": {
        f"{SMALL}, with the bound",
        f"{LARGE}, no bound",
        f"{LARGE}, with the bound",
    },
    "PAPWC adapts much faster": {LARGE},
    "b̂ increases when": {SMALL},
}


@pytest.fixture(scope="module")
def claims(evidence: Evidence) -> tuple[Claim, ...]:
    return every_claim(evidence)


def every_claim(evidence: Evidence) -> tuple[Claim, ...]:
    return (
        *law_claims.law_claims(evidence.law),
        *width_claims.width_claims(evidence),
        *form_claims.form_claims(evidence),
        *error_claims.error_claims(evidence),
        *pulse_claims.pulse_claims(evidence),
        *estimate_claims.estimate_claims(evidence),
    )


def begins(claim: Claim, words: str) -> bool:
    return claim.statement.startswith(words)


def test_what_differs_and_what_holds_in_part_is_known(claims: tuple[Claim, ...]) -> None:
    for claim in claims:
        if claim.agrees:
            assert not any(begins(claim, words) for words in (*DIFFER, *PARTLY)), claim.statement
        elif claim.agrees_partly:
            names = {each.name for each in claim.readings if each.agrees}
            assert [names] == [PARTLY[words] for words in PARTLY if begins(claim, words)]
        else:
            assert any(begins(claim, words) for words in DIFFER), claim.statement
    assert len(claims) > 50


def test_every_claim_has_what_it_needs(claims: tuple[Claim, ...]) -> None:
    assert len({claim.statement for claim in claims}) == len(claims)
    for claim in claims:
        assert claim.numbers
        assert claim.why.endswith(".")
        assert claim.statement.endswith(".")
        assert not claim.criterion.endswith(".")
        assert "nan" not in claim.measured
        if claim.readings:
            assert claim.agrees == all(each.agrees for each in claim.readings)


def test_claims_are_put_in_the_order_of_the_report(claims: tuple[Claim, ...]) -> None:
    places = [claim.place for claim in sorted(claims, key=_place)]
    assert places[0] == "Abstract; 3.2"
    assert places.index("2.1") < places.index("3.1") < places.index("3.2, Eq. 14")
    assert places[-1] == "4, Fig. 9"
    figures = [each for each in places if each.startswith("4, Fig. ")]
    assert figures == sorted(figures)


def exchanged(evidence: Evidence, **of: tuple[str, str, float | None]) -> Evidence:
    """Return the evidence with one case's series in the place of another's."""
    taken = {
        "pwc_free": (PWC, CALCULATED, UNBOUNDED),
        "pwc_bound": (PWC, CALCULATED, BOUNDED),
        "pwc_applied_free": (PWC, APPLIED, UNBOUNDED),
        "papwc_free": (PAPWC, SMALL, UNBOUNDED),
        "papwc_bound": (PAPWC, SMALL, BOUNDED),
    }
    series = dict(evidence.series)
    for place, source in of.items():
        series[taken[place]] = evidence.series[source]
    return replace(evidence, series=series)


FREE, BOUND = (PAPWC, SMALL, UNBOUNDED), (PAPWC, SMALL, BOUNDED)


@pytest.mark.parametrize(
    ("judge", "change", "agrees"),
    [
        (width_claims._limit_cycle, {"pwc_free": BOUND}, False),
        (width_claims._full_effort, {"pwc_free": BOUND}, False),
        (width_claims._two_samples, {"pwc_free": FREE}, False),
        (width_claims._closer_estimate, {"pwc_bound": (PWC, APPLIED, UNBOUNDED)}, False),
        (width_claims._maximum_final_error, {}, False),
        (error_claims._takes_longer, {"papwc_bound": FREE}, False),
        (pulse_claims._bounded_unchanged, {"papwc_bound": FREE}, False),
        (error_claims._significant_reduction, {"papwc_free": (PWC, APPLIED, UNBOUNDED)}, False),
        (
            pulse_claims._pulses_die_out,
            {"papwc_free": BOUND},
            True,
        ),
        (error_claims._error_around_zero, {"papwc_free": BOUND}, True),
        (estimate_claims._one_large_pulse, {"papwc_free": BOUND}, False),
    ],
    ids=lambda value: getattr(value, "__name__", None),
)
def test_other_runs_give_other_verdicts(
    judge: Callable[[Evidence], Claim],
    change: dict[str, tuple[str, str, float | None]],
    agrees: bool,
    evidence: Evidence,
) -> None:
    assert judge(exchanged(evidence, **change)).agrees is agrees


def test_what_hits_with_one_pulse_is_told(evidence: Evidence) -> None:
    anew = {**evidence.series, FREE: evidence.anew[FREE]}
    other = replace(evidence, series=anew)
    found = {each.name: each.agrees for each in error_claims._never_zero(other).readings}
    assert found == {SMALL: False, LARGE: True}
    close = {each.name: each.agrees for each in error_claims._one_pulse_very_close(other).readings}
    assert close == {SMALL: True, LARGE: True}


def test_without_viscous_friction_small_and_large_pulses_are_alike(evidence: Evidence) -> None:
    law = replace(evidence.law, viscous_friction=0.0)
    assert law_claims._small_displacements(law).agrees
    assert not law_claims._large_displacements(law).agrees
    assert not law_claims._range_of_gain(law).agrees
    assert not law_claims._longer_width(law).agrees
    assert not law_claims._depends_on_parameters(law).agrees


def test_with_much_viscous_friction_no_approximation_is_reasonable(evidence: Evidence) -> None:
    law = replace(evidence.law, viscous_friction=7000.0)
    assert not law_claims._small_displacements(law).agrees


def test_the_settled_regressor_keeps_the_gain_positive(evidence: Evidence) -> None:
    settled = {reading: evidence.series[PAPWC, reading, UNBOUNDED] for reading in (SMALL, LARGE)}
    assert form_claims._printed_regressor(replace(evidence, printed=settled)).agrees


def test_adaptation_is_not_needed_where_all_guesses_are_good(evidence: Evidence) -> None:
    right = evidence.unlearned[1.0]
    other = replace(evidence, unlearned=dict.fromkeys(evidence.unlearned, right))
    assert not form_claims._adaptation_is_needed(other).agrees
    wrong = evidence.unlearned[0.8]
    other = replace(evidence, unlearned=dict.fromkeys(evidence.unlearned, wrong))
    assert not form_claims._works_with_known_friction(other).agrees


def test_another_recursion_is_not_taken_for_least_squares(evidence: Evidence) -> None:
    forgetful = series_of(replace(papwc(longest_width=BOUNDED), forgetting=0.9), runs=1)
    series = {**evidence.series, (PAPWC, SMALL, BOUNDED): forgetful}
    assert not form_claims._no_inversion(replace(evidence, series=series)).agrees


def test_a_claim_holds_where_all_its_readings_do() -> None:
    def claim(**verdicts: bool) -> Claim:
        return by_reading(
            place="4",
            statement="It does.",
            criterion="it does",
            found={name: (agrees, f"seen {name}") for name, agrees in verdicts.items()},
            why="So.",
            numbers={"count": 3},
        )

    assert claim(a=True, b=True).agrees
    assert claim(a=True, b=False).agrees_partly
    assert not claim(a=False, b=False).agrees_partly
    assert claim(a=True, b=False).measured == "a: seen a; b: seen b"
    assert isinstance(claim(a=True).numbers["count"], float)


def test_lengths_in_words() -> None:
    assert lengths([-4.19e-4, 1e-12]) == "−419 µm, less than 1 nm"
