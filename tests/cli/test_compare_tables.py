"""Tables of estimators side by side: nothing of them is cut, however narrow the terminal is."""

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from stage_log import csv_text, table
from terminals import printed_on

from stickslip import EstimationTask
from stickslip.presentation.terminal import print_comparison
from stickslip.records import (
    ComparedEstimator,
    EstimatorComparison,
    EstimatorStudy,
    FrictionEstimate,
    ModelSelection,
    Status,
    TermScore,
)
from stickslip.tasks import compare_log, compare_scenario

SCENARIO = """
runs = 2
[axis]
kind = "rotary"
inertia = 1.5
coulomb_friction = 2.0
viscous_friction = 3.0
[input]
amplitudes = [4.0, 3.0]
frequencies = [0.5, 1.3]
duration = 2.0
sampling_time = 0.004
[sensors]
position_noise = 1e-6
velocity_noise = 1e-5
"""
SEVERAL = ("energy", "stribeck-energy", "yazdizadeh-khorasani")
NARROW = 72  # characters; below those of an ordinary terminal


Compare = Callable[..., EstimatorComparison]


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> Compare:
    """Return a function that compares estimators on one log, each choice of them once."""
    path = tmp_path_factory.mktemp("tables") / "stage.csv"
    path.write_text(csv_text(table()))
    return functools.cache(lambda *only: compare_log(path, only=only))


def energy_of(compared: Compare) -> tuple[EstimatorComparison, ComparedEstimator, FrictionEstimate]:
    """Return the comparison of the energy estimator alone, and what it compares."""
    found = compared("energy")
    (energy,) = found.compared
    assert energy.estimate is not None
    return found, energy, energy.estimate


def with_mass(
    estimate: FrictionEstimate, value: float, ci95: tuple[float, float], **changes: Any
) -> FrictionEstimate:
    """Return an estimate with another mass."""
    mass = replace(estimate.parameters["mass"], value=value, ci95=ci95)
    return replace(estimate, parameters={**estimate.parameters, "mass": mass}, **changes)


def printed(found: EstimatorComparison | EstimatorStudy, width: int) -> list[str]:
    return printed_on(width, print_comparison, found).splitlines()


def text_of(found: EstimatorComparison) -> str:
    return " ".join(" ".join(printed(found, 120)).split())


@pytest.mark.parametrize("width", [NARROW, 120])
def test_tables_of_a_log_are_as_many_as_it_takes(width: int, compared: Compare) -> None:
    found = compared(*SEVERAL)
    lines = printed(found, width)
    assert max(len(line) for line in lines) <= width
    assert "…" not in "".join(lines)
    for each in found.applied:
        rows = [line for line in lines if line.startswith(f" {each.name} ")]
        assert len(rows) == sum("estimator" in line.split() for line in lines[3:])
        status = each.estimate.status.value.replace("_", " ")
        assert rows[0].removeprefix(f" {each.name} ").lstrip().startswith(status)
        # All its values are printed, in any number of tables
        values = sum(row.count(" ± ") for row in rows)
        assert values == sum(value.std is not None for value in each.estimate.parameters.values())


def test_an_estimate_that_is_not_to_be_trusted_has_a_reason(compared: Compare) -> None:
    text = text_of(compared(*SEVERAL))
    reason = "stribeck-energy: Static friction, Stribeck velocity: no step"
    assert f"- {reason}" in text.split("Not to be trusted:")[1]
    trusted = compared("energy")
    assert not any("Not to be trusted" in line for line in printed(trusted, 120))


def test_a_method_without_intervals_is_not_ok(compared: Compare) -> None:
    observers = ("gradient", "liao-chien")
    found = compared("energy", *observers)
    document = found.to_dict()
    for each in document["estimators"]:
        without = all(p["ci95"] is None for p in each["estimate"]["parameters"].values())
        assert (
            (each["estimate"]["status"] == "no_interval") == without == (each["name"] in observers)
        )
    text = text_of(found)
    assert "liao-chien, gradient: The method gives no confidence intervals" in text


def test_contradictory_results_are_named_with_their_intervals(compared: Compare) -> None:
    found = compared("energy", "idim-ls")
    assert found.contradictions == ()
    assert not any("Contradictory" in line for line in printed(found, 120))
    energy, other = found.compared
    assert other.estimate is not None
    mass = energy.estimate.parameters["mass"]
    value = mass.value + 20.0 * mass.std
    shifted = (value - 2.0 * mass.std, value + 2.0 * mass.std)
    estimate = with_mass(energy.estimate, value, shifted)
    contradicting = replace(found, compared=(energy, replace(other, estimate=estimate)))
    (one,) = contradicting.contradictions
    assert one.parameter == "mass"
    assert dict(one.intervals) == {"energy": mass.ci95, "idim-ls": shifted}
    assert contradicting.to_dict()["contradictions"] == [one.to_dict()]
    text = text_of(contradicting)
    assert "Contradictory results: at least one method is wrong. - Mass [kg]: energy" in text
    doubted = replace(estimate, status=Status.POOR_FIT)
    doubtful = replace(found, compared=(energy, replace(other, estimate=doubted)))
    assert doubtful.contradictions == ()


@pytest.mark.parametrize(("gap", "contradicts"), [(-1e-9, False), (0.0, False), (1e-9, True)])
def test_intervals_that_touch_do_not_contradict(
    gap: float, contradicts: bool, compared: Compare
) -> None:
    found, energy, estimate = energy_of(compared)
    ci95 = estimate.parameters["mass"].ci95
    low = ci95[1] + gap
    moved = with_mass(estimate, low + 1.0, (low, low + 2.0))
    pair = (energy, replace(energy, name="other", estimate=moved))
    assert bool(replace(found, compared=pair).contradictions) == contradicts


@pytest.mark.parametrize(
    ("places", "alone"),
    [
        ((0.0, 0.0, 3.0), "c"),
        ((0.0, 3.0, 0.0), "b"),
        ((0.0, 3.0), ""),
        ((0.0, 3.0, 6.0), ""),
        ((0.0, 1.5, 3.0), ""),  # the middle one overlaps both
        ((0.0, 0.0, 3.0, 3.0), ""),
        ((0.0, 0.5, 1.0, 4.0), "d"),
        ((0.0, 3.0, 3.5, 1.5), ""),  # the last one overlaps all
    ],
)
def test_the_method_that_stands_alone_is_named(
    places: tuple[float, ...], alone: str, compared: Compare
) -> None:
    """Intervals of half-width 1 around the places; they are estimators a, b, c and d."""
    found, energy, estimate = energy_of(compared)
    four = tuple(
        replace(energy, name=name, estimate=with_mass(estimate, place, (place - 1.0, place + 1.0)))
        for name, place in zip("abcd", places, strict=False)
    )
    contradicting = replace(found, compared=four)
    (one,) = contradicting.contradictions
    assert one.alone == alone
    assert contradicting.alone == ({alone} if alone else frozenset())
    assert one.to_dict()["alone"] == (alone or None)
    text = text_of(contradicting)
    assert (f"{alone} stands alone, the others agree" in text) == bool(alone)
    assert ("ok, alone" in text) == bool(alone)


@pytest.mark.parametrize("selected", [True, False])
def test_a_method_with_more_terms_is_not_doubted_for_standing_alone(
    selected: bool, compared: Compare
) -> None:
    found, energy, plain = energy_of(compared)
    spring = TermScore(
        term="spring", text="", selected=selected, p_value=0.0, gain=1.0, gain_std=0.1, share=0.1
    )
    selection = ModelSelection(summary="", scores=(spring,))
    estimate = with_mass(plain, 90.0, (89.0, 91.0), selection=selection)
    others = tuple(replace(energy, name=name) for name in ("first", "second"))
    pair = (replace(energy, name="auto", estimate=estimate), *others)
    found = replace(found, compared=pair)
    text = text_of(found)
    assert "auto stands alone, the others agree" in text
    assert ("and may lack its terms (spring)" in text) == selected
    assert ("ok, alone" in text) != selected


def test_tables_of_a_scenario_fit_and_mark_what_takes_an_inertia(tmp_path: Path) -> None:
    scenario = tmp_path / "quiet.toml"
    scenario.write_text(SCENARIO)
    found = compare_scenario(scenario, only=("energy", "ekf"))
    lines = printed(found, NARROW + 6)
    assert "…" not in "".join(lines)
    assert any(line.startswith(" ekf * ") for line in lines)
    assert "  * with the inertia that the energy estimator returned in each run" in lines
    task = EstimationTask(inertia=1.5)
    known = compare_scenario(scenario, task=task, only=("energy", "ekf"))
    assert not any("*" in line for line in printed(known, NARROW + 6))
