"""The conjunction from one call: its files, its claims, its reference points."""

import json
from dataclasses import replace

import numpy as np
import pytest
from reproductions import check_files, check_numbers, landing_score

from studies.van_de_wijdeven import Reproduced, reproduce_conjunction
from studies.van_de_wijdeven.conjunction import study
from studies.van_de_wijdeven.records import ConjunctionReproduction

pytestmark = pytest.mark.slow

FIGURES = [f"C.{k}" for k in range(1, 6)]
SAME = 1e-9  # m; what the exact simulation leaves of a move of 1 m
SHARE = 0.02  # of what is known with two digits
BOUND = 1e-5


def scores(arms: int, seed: int, *, cases: object, workers: int, advance: object) -> object:
    """Stand for the study, which has tests of its own."""
    assert callable(advance)
    for _ in range(arms):
        advance()
    scored = landing_score(f"landing, {seed}", "no noise", lands=True)
    return (replace(scored, arms=arms, moves=2 * arms),)


@pytest.fixture(scope="module")
def calls() -> list[tuple[int, int]]:
    return []


@pytest.fixture(scope="module")
def reproduced(
    tmp_path_factory: pytest.TempPathFactory, calls: list[tuple[int, int]]
) -> Reproduced:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study, "landing_scores", scores)
        return reproduce_conjunction(
            tmp_path_factory.mktemp("conjunction") / "new",
            arms=1,
            seed=2,
            progress=lambda done, every: calls.append((done, every)),
        )


@pytest.fixture(scope="module")
def record(reproduced: Reproduced) -> ConjunctionReproduction:
    assert isinstance(reproduced.reproduction, ConjunctionReproduction)
    return reproduced.reproduction


def test_every_file_is_there_and_nothing_else(reproduced: Reproduced) -> None:
    check_files(reproduced, FIGURES)


def test_progress_is_told_to_its_end(reproduced: Reproduced, calls: list[tuple[int, int]]) -> None:
    assert reproduced.page.exists()
    every = calls[0][1]
    assert calls == [(done, every) for done in range(1, every + 1)]


def test_the_numbers_are_those_of_the_record(
    reproduced: Reproduced, record: ConjunctionReproduction
) -> None:
    check_numbers(reproduced, FIGURES, {"arms": 1, "seed": 2})
    found = json.loads(reproduced.numbers.read_text())
    assert found["part"] == "conjunction"
    for written, kept in zip(found["claims"], record.claims, strict=True):
        assert [m["value"] for m in written["measures"]] == [m.value for m in kept.measures]
    for written, series in zip(found["successive_series"], record.successive_series, strict=True):
        assert written["error"] == series.error.tolist()
    assert found["landing_scores"][0]["error_1"]["upper_95"] == 4e-7


def test_the_page_shows_all_of_it(reproduced: Reproduced) -> None:
    page = reproduced.page.read_text()
    for words in (
        "van de Wijdeven (2002), concluding remarks",
        "92 pulses of 0.05 s",
        "Successive series",
        "−5 %, learns",
        "landing, 2",
        'id="figure-C.5"',
    ):
        assert words in page, words


def test_the_reference_points_are_reached(record: ConjunctionReproduction) -> None:
    durations = {(each.pulses, each.pulse_width): each.duration for each in record.reference_series}
    assert durations == pytest.approx(
        {(92, 0.05): 4.6, (10, 0.5): 5.0, (6, 1.0): 6.0, (4, 1.5): 6.0}
    )
    for each in record.reference_series:
        assert each.residual < SAME
        assert each.peak_effort <= 1.0


def test_less_friction_than_guessed_leaves_what_is_known(record: ConjunctionReproduction) -> None:
    for each in record.friction_errors:
        if each.friction_error < 0:
            assert each.error == pytest.approx(each.expected_error, rel=SHARE)
            assert each.swing == pytest.approx(each.expected_swing, rel=SHARE)
        else:
            assert each.error < 0
            assert abs(each.error) < 0.005 * abs(each.friction_error) / 0.01


def test_series_learn_and_three_are_enough(record: ConjunctionReproduction) -> None:
    assert len(record.successive_series) == 8
    for each in record.successive_series:
        left = np.maximum(np.abs(each.error), each.swing)
        if each.learning:
            assert left.size == 3
            assert left[-1] < 1e-6
        elif each.friction_error > 0:
            assert left[-1] > 1e-3


def test_every_remark_agrees(record: ConjunctionReproduction) -> None:
    assert len(record.claims) == 9
    for claim in record.claims:
        assert claim.agrees, claim.name
    together, alone = {claim.name: claim for claim in record.claims}["synergy"].measures
    assert together.value <= BOUND < alone.value
