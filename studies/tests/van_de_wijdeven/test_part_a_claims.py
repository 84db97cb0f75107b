"""Verdicts on the source's claims follow from the numbers, one way and the other."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from stickslip.tasks import surrogate
from studies.van_de_wijdeven.judging import judged
from studies.van_de_wijdeven.part_a.cases import PRINTED_COMPENSATED
from studies.van_de_wijdeven.part_a.effects import NoiseEffects
from studies.van_de_wijdeven.part_a.evidence import Evidence, Rest, Sampling
from studies.van_de_wijdeven.part_a.expectations import AbsoluteValue
from studies.van_de_wijdeven.part_a.loop_claims import LOOP_CLAIMS
from studies.van_de_wijdeven.part_a.monte_carlo import Study
from studies.van_de_wijdeven.part_a.noise_claims import NOISE_CLAIMS, deviation
from studies.van_de_wijdeven.part_a.runs import LOOPS, Loop
from studies.van_de_wijdeven.part_a.sequences import Sequences
from studies.van_de_wijdeven.part_a.simulation_claims import SIMULATION_CLAIMS
from studies.van_de_wijdeven.records import Claim, VariantScore

TRUTH = np.array(list(surrogate.TRUTH.values()))
RUNS = 12
SIGMA = surrogate.VELOCITY_NOISE
SAMPLES = 6001

Change = Callable[[Evidence], Evidence]


def scattered(mean: float, std: float) -> list[float]:
    """Return numbers of exactly this mean and standard deviation."""
    shape = np.linspace(-1.0, 1.0, RUNS)
    return (mean + std * shape / np.std(shape, ddof=1)).tolist()


def effects(**means: float) -> tuple[NoiseEffects, ...]:
    """Return effects of noise just as chapter 5 expects them, but for the means given."""
    expected = {
        "input_energy": 0.0,
        "held_input_energy": 0.0,
        "kinetic_energy": SIGMA**2,
        "potential_energy": surrogate.POSITION_NOISE**2,
        "potential_square": surrogate.POSITION_NOISE**2,
        "coulomb_regressor": 1.6,
        "viscous_regressor": SIGMA**2 * surrogate.SAMPLING_TIME * SAMPLES,
        "speed_at_rest": 0.8 * SIGMA,
        "speed_in_motion": 0.0,
    }
    columns = {name: scattered(mean, 0.05 * SIGMA**2) for name, mean in (expected | means).items()}
    return tuple(
        NoiseEffects(**{name: values[k] for name, values in columns.items()}) for k in range(RUNS)
    )


def sequences(
    error: float = 0.0,
    *,
    level: float = 0.0,
    rise: float = 0.0,
    itse: float = 1.0,
    early: float = 0.0,
    drift: float = 0.0,
) -> Sequences:
    """Return sequences whose estimates miss the truth by this much of it, every time."""
    values = np.broadcast_to(TRUTH * (1.0 + error), (RUNS, 5, 2)).copy()
    values[:, 0] += drift * TRUTH
    flat = np.ones((RUNS, 5))
    return Sequences(
        early=np.broadcast_to(TRUTH * (1.0 + early), (RUNS, 2)).copy(),
        halfway=np.broadcast_to(TRUTH * (1.0 + error), (RUNS, 2)).copy(),
        values=values,
        level=level * flat,
        rise=rise * flat,
        itse=itse * flat,
    )


def score(assumed: float, *, bias: float, rmse: float) -> VariantScore:
    return VariantScore(
        loop="feedforward",
        variant=PRINTED_COMPENSATED,
        noise=1.0,
        assumed=assumed,
        runs=RUNS,
        failed=0,
        bias=dict.fromkeys(surrogate.TRUTH, bias),
        rmse=dict.fromkeys(surrogate.TRUTH, rmse),
        coverage=None,
    )


def world() -> Evidence:
    """Return evidence with which every claim of the source agrees."""
    made: dict[tuple[Loop, str], Sequences] = {}
    for loop, size in zip(LOOPS, (1.0, 0.5), strict=True):
        made |= {
            (loop, "clean"): sequences(0.01 * size, level=0.001, rise=0.001, drift=0.001),
            (loop, "noisy"): sequences(0.4 * size, level=0.05, rise=0.1, itse=100.0, drift=0.2),
            (loop, "full"): sequences(0.03 * size, level=0.01, rise=0.02, itse=10.0),
            (loop, "wrong"): sequences(0.3 * size, level=0.04, rise=0.08, itse=50.0),
            (loop, "terms"): sequences(0.02 * size, level=0.001, rise=0.001, itse=5.0, early=0.1),
            (loop, "wrong-terms"): sequences(0.025 * size, level=0.002, rise=0.002, itse=5.5),
        }
    return Evidence(
        absolute_value=AbsoluteValue(
            density_distance=0.8,
            mean_deviation=1.0,
            sixth_order_error=0.005,
            double_mean_error=0.01,
            fourth_order_error=0.005,
            added_at_rest=0.8,
            removed_at_rest=0.8,
            added_in_motion=0.02,
            removed_in_motion=0.02,
        ),
        rest=Rest(time=25.0, swing=0.1),
        interaction=np.array([[0.2, -0.6], [-0.3, 0.5]]),
        sampling=Sampling(
            printed=np.array([0.01, -0.02]),
            finer=np.array([0.001, -0.002]),
            exact=np.array([1e-6, 1e-6]),
        ),
        sequences=made,
        study=Study(
            scores=(
                score(0.5, bias=0.3, rmse=0.3),
                score(1.0, bias=0.03, rmse=0.04),
            ),
            effects={loop: effects() for loop in LOOPS},
        ),
    )


def claims(evidence: Evidence) -> list[Claim]:
    return [judged(row, evidence) for row in (*NOISE_CLAIMS, *SIMULATION_CLAIMS, *LOOP_CLAIMS)]


def sensors(loop: Loop, **means: float) -> Change:
    def change(e: Evidence) -> Evidence:
        changed = {**e.study.effects, loop: effects(**means)}
        return replace(e, study=replace(e.study, effects=changed))

    return change


def expectation(**values: float) -> Change:
    return lambda e: replace(e, absolute_value=replace(e.absolute_value, **values))


def case(loop: Loop, key: str, made: Sequences) -> Change:
    return lambda e: replace(e, sequences={**e.sequences, (loop, key): made})


def scored(*scores: VariantScore) -> Change:
    return lambda e: replace(e, study=replace(e.study, scores=scores))


# What is changed, and the names of the claims that then differ; the bracket of Eq. 5.26 is judged
# by the sign it has in print, so it differs in a world as chapter 5 derives it.
ALWAYS = {"sign of the bracket"}
WORLDS: dict[str, tuple[Change, set[str]]] = {
    "the source's own": (lambda e: e, set()),
    "correlated input": (sensors("feedback", input_energy=-0.4), {"input energy, feedback"}),
    "biased open loop": (sensors("feedforward", input_energy=0.1), {"input energy, feedforward"}),
    "kinetic energy twice": (
        sensors("feedforward", kinetic_energy=2 * SIGMA**2),
        {"kinetic energy"},
    ),
    "no potential bias": (sensors("feedforward", potential_energy=0.01), {"potential energy"}),
    "potential bias hidden": (sensors("feedforward", potential_square=0.01), {"potential energy"}),
    "viscous bias half": (
        sensors("feedforward", viscous_regressor=0.5 * SIGMA**2 * 60.0),
        {"viscous regressor"},
    ),
    "noise in motion too": (sensors("feedforward", speed_in_motion=0.01), {"slow motion"}),
    "neglected term large": (sensors("feedforward", coulomb_regressor=0.5), {"neglected term"}),
    "another density": (expectation(density_distance=5.0), {"density"}),
    "another mean": (expectation(mean_deviation=9.0), {"expected absolute value"}),
    "poor sixth order": (expectation(sixth_order_error=0.1), {"polynomial of order six"}),
    "poor fourth order": (expectation(fourth_order_error=0.1), {"polynomial of order four"}),
    "too little at rest": (expectation(removed_at_rest=0.6), {"double expectation"}),
    "too much in motion": (expectation(removed_in_motion=0.2), {"double expectation"}),
    "early rest": (lambda e: replace(e, rest=Rest(time=20.0, swing=0.1)), {"first mass rests"}),
    "no swing": (lambda e: replace(e, rest=Rest(time=25.0, swing=0.0)), {"second mass swings"}),
    "exact without noise": (
        case("feedforward", "clean", sequences(1e-5, level=0.001, rise=0.001, drift=0.001)),
        {"bias without noise", "feedback without noise"},
    ),
    "error not from sampling": (
        lambda e: replace(e, sampling=replace(e.sampling, finer=np.array([0.009, -0.018]))),
        {"bias by sampling"},
    ),
    "drift without noise": (
        case("feedforward", "clean", sequences(0.01, level=0.001, rise=0.001, drift=0.1)),
        {"end time matters"},
    ),
    "compensation off": (
        scored(score(0.5, bias=0.3, rmse=0.3), score(1.0, bias=-0.07, rmse=0.08)),
        {"true standard deviations"},
    ),
    "sigma without effect": (
        scored(score(0.5, bias=0.03, rmse=0.04), score(1.0, bias=0.03, rmse=0.04)),
        {"wrong standard deviations"},
    ),
    "slow convergence": (
        case("feedforward", "terms", sequences(0.02, itse=5.0, early=0.5)),
        {"rapid convergence"},
    ),
    "sensitive and inaccurate": (
        case("feedback", "wrong-terms", sequences(0.12, level=0.002, rise=0.002, itse=5.5)),
        {"insensitive, feedback", "accurate, feedback", "feedback with noise"},
    ),
    "less sensitive, and still sensitive": (
        lambda e: replace(
            e,
            sequences={
                **e.sequences,
                ("feedback", "wrong"): sequences(3.0, itse=50.0),
                ("feedback", "wrong-terms"): sequences(0.08, itse=5.5),
            },
        ),
        {"insensitive, feedback", "accurate, feedback", "feedback with noise"},
    ),
    "flat prediction error": (
        case("feedforward", "noisy", sequences(0.4, level=0.05, rise=0.0, itse=100.0, drift=0.2)),
        {"bias and slope, feedforward"},
    ),
    "flat prediction error in the feedback": (
        case("feedback", "noisy", sequences(0.2, level=0.05, rise=0.0, itse=100.0)),
        {"bias and slope, feedback"},
    ),
    "terms apart from friction": (
        lambda e: replace(e, interaction=np.array([[0.2, -0.6], [0.05, -0.05]])),
        {"interaction"},
    ),
    "line left": (
        case("feedforward", "terms", sequences(0.02, level=0.05, itse=5.0, early=0.1)),
        {"line compensated, feedforward"},
    ),
    "unstable error": (
        case("feedback", "wrong-terms", sequences(0.0125, level=0.002, itse=20.0)),
        {"stable error, feedback"},
    ),
    "better without terms": (
        case("feedforward", "wrong", sequences(0.02, level=0.04, rise=0.08, itse=50.0)),
        {"most stable, feedforward", "insensitive, feedforward", "feedback with noise"},
    ),
}


@pytest.mark.parametrize("name", WORLDS)
def test_verdicts_follow_the_numbers(name: str) -> None:
    change, differing = WORLDS[name]
    found = {claim.name for claim in claims(change(world())) if not claim.agrees}
    assert found == differing | ALWAYS


def test_every_claim_has_finite_quantities_with_limits() -> None:
    for claim in claims(world()):
        assert any(measure.decides for measure in claim.measures)
        assert all(np.isfinite(measure.value) for measure in claim.measures)


def test_chance_does_not_refuse_an_expectation() -> None:
    generator = np.random.default_rng(11)
    refused = 0
    for _ in range(400):
        drawn = tuple(
            replace(each, input_energy=float(generator.normal(0.0, 0.02))) for each in effects()
        )
        refused += deviation(drawn, lambda each: each.input_energy, 0.0) > 1.0
    # One in a thousand is expected; seven or more of 400 would come once in ten million times.
    assert refused < 7


def test_the_best_estimate_of_a_line_excludes_chance() -> None:
    chance = 0.01
    lines = {
        mean: replace(
            sequences(itse=5.0),
            level=np.tile(scattered(mean, chance * np.sqrt(RUNS)), (5, 1)).T,
        ).line(-1)
        for mean in (0.0, 5.0 * chance)
    }
    assert lines[0.0].size == 0.0
    assert lines[5.0 * chance].size == pytest.approx(chance * np.sqrt(24.0))
