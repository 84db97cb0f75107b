"""Verdicts on part B follow the evidence: other runs give other verdicts."""

from dataclasses import replace

import pytest

from studies.van_de_wijdeven.judging import judged
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
from studies.van_de_wijdeven.part_b.claims import PART_B_CLAIMS, part_b_claims
from studies.van_de_wijdeven.part_b.evidence import Evidence
from studies.van_de_wijdeven.part_b.runs import series_of
from studies.van_de_wijdeven.records import Claim

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def claims(evidence: Evidence) -> dict[str, Claim]:
    return {claim.name: claim for claim in part_b_claims(evidence)}


def test_every_claim_has_what_it_needs(claims: dict[str, Claim]) -> None:
    assert len(claims) == len(PART_B_CLAIMS) > 50
    for claim in claims.values():
        assert claim.cases
        assert claim.why.endswith(".")
        assert claim.statement.endswith(".")


def test_claims_are_in_the_order_of_the_source() -> None:
    places = [row.place for row in PART_B_CLAIMS]
    assert places[0] == "Abstract; 3.2"
    assert places.index("2.1") < places.index("3.1") < places.index("3.2, Eq. 14")
    assert places[-1] == "4, Fig. 9"
    figures = [each for each in places if each.startswith("4, Fig. ")]
    assert figures == sorted(figures)


ROWS = {row.name: row for row in PART_B_CLAIMS}


def claim(name: str, evidence: Evidence) -> Claim:
    return judged(ROWS[name], evidence)


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
    ("name", "change", "agrees"),
    [
        ("limit cycle", {"pwc_free": BOUND}, False),
        ("full effort", {"pwc_free": BOUND}, False),
        ("two samples in run 10", {"pwc_free": FREE}, False),
        ("closer estimate with the bound", {"pwc_bound": (PWC, APPLIED, UNBOUNDED)}, False),
        ("largest final error of PWC", {}, False),
        ("longer with the bound", {"papwc_bound": FREE}, False),
        ("input with the bound unchanged", {"papwc_bound": FREE}, False),
        ("significant reduction", {"papwc_free": (PWC, APPLIED, UNBOUNDED)}, False),
        (
            "pulses die out",
            {"papwc_free": BOUND},
            True,
        ),
        ("error around zero", {"papwc_free": BOUND}, True),
        ("one large pulse", {"papwc_free": BOUND}, False),
    ],
)
def test_other_runs_give_other_verdicts(
    name: str,
    change: dict[str, tuple[str, str, float | None]],
    agrees: bool,
    evidence: Evidence,
) -> None:
    assert claim(name, exchanged(evidence, **change)).agrees is agrees


def test_readings_that_hit_with_one_pulse_are_reported(evidence: Evidence) -> None:
    anew = {**evidence.series, FREE: evidence.anew[FREE]}
    other = replace(evidence, series=anew)
    found = claim("never zero after one pulse", other).verdicts
    assert found == {SMALL: False, LARGE: True}
    close = claim("one pulse very close", other).verdicts
    assert close == {SMALL: True, LARGE: True}


def test_without_viscous_friction_small_and_large_pulses_are_alike(evidence: Evidence) -> None:
    other = replace(evidence, law=replace(evidence.law, viscous_friction=0.0))
    assert claim("small displacements", other).agrees
    assert not claim("large displacements", other).agrees
    assert not claim("range of the gain of one pulse", other).agrees
    assert not claim("gain of a long pulse for a short one", other).agrees
    assert not claim("range depends on the parameters", other).agrees


def test_with_much_viscous_friction_no_approximation_is_reasonable(evidence: Evidence) -> None:
    other = replace(evidence, law=replace(evidence.law, viscous_friction=7000.0))
    assert not claim("small displacements", other).agrees


def test_the_settled_regressor_keeps_the_gain_positive(evidence: Evidence) -> None:
    settled = {reading: evidence.series[PAPWC, reading, UNBOUNDED] for reading in (SMALL, LARGE)}
    assert claim("printed regressor", replace(evidence, printed=settled)).agrees


def test_adaptation_is_not_needed_where_all_guesses_are_good(evidence: Evidence) -> None:
    right = evidence.unlearned[1.0]
    other = replace(evidence, unlearned=dict.fromkeys(evidence.unlearned, right))
    assert not claim("adaptation is needed", other).agrees
    wrong = evidence.unlearned[0.8]
    other = replace(evidence, unlearned=dict.fromkeys(evidence.unlearned, wrong))
    assert not claim("known friction", other).agrees


def test_another_recursion_is_not_taken_for_least_squares(evidence: Evidence) -> None:
    forgetful = series_of(replace(papwc(longest_width=BOUNDED), forgetting=0.9), runs=1)
    series = {**evidence.series, (PAPWC, SMALL, BOUNDED): forgetful}
    assert not claim("no inversion", replace(evidence, series=series)).agrees
