"""The page of estimators side by side: what it holds, and that it needs nothing else."""

import re
from dataclasses import replace

import numpy as np
import pytest
from pages import page_of
from results import study

from stickslip import EstimationTask
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import EstimatorComparison, EstimatorScore
from stickslip.simulation import Sensors, simulate
from stickslip.tasks import compare_log


@pytest.fixture(scope="module")
def comparison() -> EstimatorComparison:
    law = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=3.0)
    time = 0.004 * np.arange(1500)
    effort = 5.0 * np.sin(3.0 * time) + 3.0 * np.sin(7.1 * time)
    motion = simulate(SingleMass(mass=1.5, friction=law), effort, sampling_time=0.004)
    log = Sensors(position_noise=1e-6, velocity="none").measure(
        motion, np.random.default_rng(4), name="a <b> stage"
    )
    only = ("energy", "idim-ls", "gradient", "free-decay")
    return compare_log(log, only=only)


def test_a_page_of_a_log_holds_every_estimator(comparison: EstimatorComparison) -> None:
    text = page_of(comparison).source
    assert "<h1>a &lt;b&gt; stage</h1>" in text
    for name in ("energy", "idim-ls", "gradient"):
        assert f'id="motion-{name}"' in text
    assert "free-decay: " in text
    assert 'id="estimates-coulomb-friction"' in text
    body = text.split("<script")[0]
    assert not re.search(r"\bnan\b", body)
    for column in ("Effort left: ", "Position explained: ", "A sample: "):
        assert column in body
    assert "Given: " not in body


def test_known_values_are_stated(comparison: EstimatorComparison) -> None:
    task = EstimationTask(inertia=1.5)
    found = compare_log(comparison.log, task=task, only=("energy", "gradient"))
    text = page_of(found).source
    assert "Given: mass 1.5 kg." in text


def test_a_page_of_a_scenario_holds_its_scores() -> None:
    text = page_of(study()).source
    for words in (
        "a &lt;b&gt; scenario",
        "Mass: 2 kg; Cramér-Rao bound 0.5 %",
        "95.6%",
        "biased by more than three standard errors",
        "free-decay: no decay",
        "a note",
        "0.5, 1 Hz",
        ">yes</span>",
        "ekf *",
        "* with the mass that the energy estimator returned in each run",
    ):
        assert words in text


def test_what_cannot_be_trusted_is_said_first() -> None:
    scores = (EstimatorScore(name="energy", why_not="nothing moves"),)
    text = page_of(study(scores=scores)).source
    assert "None of the estimates can be trusted" in text


def test_contradictory_results_are_on_the_page(comparison: EstimatorComparison) -> None:
    plain = page_of(comparison).source
    assert ("Contradictory results" in plain) == bool(comparison.contradictions)
    energy = comparison.compared[0]
    mass = energy.estimate.parameters["mass"]
    moved = replace(mass, value=9.0, ci95=(8.9, 9.1))
    estimate = replace(energy.estimate, parameters={**energy.estimate.parameters, "mass": moved})
    other = replace(energy, name="idim-ls", estimate=estimate)
    found = replace(comparison, compared=(energy, other))
    text = page_of(found).source
    assert "Contradictory results: at least one method is wrong." in text
    assert "idim-ls 9.000 ± 0.1" in text
    assert "Some of these contradict each other." in text
