"""Part A of the source from one call: its files, known values, and what its results depend on."""

import json
import tracemalloc
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from refusals import refuses
from reproductions import check_files, check_numbers

from stickslip.records import AxisLog
from stickslip.simulation import simulate_closed_loop
from stickslip.tasks import surrogate
from studies.van_de_wijdeven import Reproduced, reproduce_part_a
from studies.van_de_wijdeven.part_a.cases import CASES, published_estimator
from studies.van_de_wijdeven.part_a.effects import noise_effects
from studies.van_de_wijdeven.part_a.evidence import rest_of_the_arm, sampling_errors
from studies.van_de_wijdeven.part_a.expectations import absolute_value, expectation_figures
from studies.van_de_wijdeven.part_a.loops import feedback_controller
from studies.van_de_wijdeven.part_a.monte_carlo import monte_carlo
from studies.van_de_wijdeven.part_a.runs import LOOPS, five_runs, itse, one_run
from studies.van_de_wijdeven.part_a.sequences import digest, sequence_seeds, sequences_of

pytestmark = pytest.mark.slow

FIGURES = [f"5.{k}" for k in (1, 2, 3)] + [f"6.{k}" for k in range(1, 11)]
FEWEST = 5
ROUNDING = 1e-7  # of recursive against batch least squares, whose first P is 1e3 of rows to 1e4
REST_TIME, SWING = 20.2, 0.116  # s and m, of the surrogate values, known to these digits
P0 = 1e3


@pytest.fixture(scope="module")
def reproduced(tmp_path_factory: pytest.TempPathFactory) -> Reproduced:
    return reproduce_part_a(tmp_path_factory.mktemp("part-a") / "new", runs=FEWEST, seed=3)


def levels(log: AxisLog) -> tuple[np.ndarray, np.ndarray]:
    """Return y and W as printed (Eqs. 4.3, 4.4), in plain numpy."""
    assert log.measured_velocity is not None
    assert log.measured_load_velocity is not None
    T, v, v2 = log.sampling_time, log.measured_velocity, log.measured_load_velocity
    stretch = log.measured_position - log.measured_load_position
    y = np.cumsum(T * log.effort * v) - 0.5 * (v**2 + v2**2 + stretch**2)
    return y, np.column_stack([np.cumsum(T * np.abs(v)), np.cumsum(T * v**2)])


def batch(logs: list[AxisLog]) -> np.ndarray:
    """Return the least-squares solution over the rows of all logs, with P(0) as a prior."""
    made = [levels(log) for log in logs]
    y = np.concatenate([each for each, _ in made])
    W = np.concatenate([each for _, each in made])
    return np.linalg.solve(W.T @ W + np.eye(2) / P0, W.T @ y)


def test_every_file_is_there_and_nothing_else(reproduced: Reproduced) -> None:
    check_files(reproduced, FIGURES)


def test_the_numbers_are_those_of_the_record(reproduced: Reproduced) -> None:
    found, record = json.loads(reproduced.numbers.read_text()), reproduced.reproduction
    check_numbers(reproduced, FIGURES, {"runs": FEWEST, "seed": 3})
    assert {"claims.measures", "variants.assumed", "variants.noise"} <= set(found["legend"])
    for written, kept in zip(found["five_runs"], record.five_runs, strict=True):
        assert written["itse"] == kept.itse.tolist()
    for written, kept in zip(found["variants"], record.variants, strict=True):
        assert written["bias"] == dict(kept.bias)
    setting = found["setting"]
    assert setting["words"] == record.setting
    assert setting["truth"]["coulomb_friction"] == {
        "value": surrogate.COULOMB_FRICTION,
        "unit": "N",
    }
    for group in setting.values():
        if group is not setting["words"]:
            for each in group.values():
                assert set(each) == {"value", "unit"}


def test_no_peak_without_noise_is_cut_off(reproduced: Reproduced) -> None:
    figures = {each.number: each for each in reproduced.reproduction.figures}
    for number in ("6.3", "6.8"):
        for panel in figures[number].panels[::2]:
            assert panel.curves[0].label == "without noise"
            assert np.max(np.abs(panel.curves[0].y)) < panel.y_range[1]


def test_a_larger_error_despite_compensation_is_noted(reproduced: Reproduced) -> None:
    captions = {each.number: each.caption for each in reproduced.reproduction.figures}
    words = "larger than without compensation (Figure 6.8)"
    assert [number for number, caption in captions.items() if words in caption] == ["6.9"]


def test_the_panels_are_the_reports(reproduced: Reproduced) -> None:
    figures = {each.number: each for each in reproduced.reproduction.figures}
    for number in ("6.1", "6.2", "6.6", "6.7"):
        assert [len(panel.curves) for panel in figures[number].panels] == [3, 3, 3]
        for panel in figures[number].panels:
            assert panel.curves[-1].label == "truth"
            assert panel.curves[0].x[-1] == pytest.approx(5 * surrogate.DURATION)
    for number in ("6.3", "6.4", "6.5", "6.8", "6.9", "6.10"):
        assert (figures[number].columns, len(figures[number].panels)) == (2, 10)
    for figure in figures.values():
        for panel in figure.panels:
            assert panel.x_label.endswith(("[s]", "in σ", "true)"))
            assert "[" in panel.y_label or "σ" in panel.y_label


def test_the_first_run_without_noise_has_an_itse_of_one(reproduced: Reproduced) -> None:
    clean = [each for each in reproduced.reproduction.five_runs if each.case == "without noise"]
    assert [each.loop for each in clean] == list(LOOPS)
    assert [each.itse[0] for each in clean] == [1.0, 1.0]


def test_the_printed_estimates_are_those_of_batch_least_squares(reproduced: Reproduced) -> None:
    estimator = published_estimator()
    state = estimator.init(sampling_time=surrogate.SAMPLING_TIME)
    log = one_run("feedforward", 0.0, np.random.default_rng(0), estimator, state).log
    row = reproduced.reproduction.five_runs[0]
    found = [row.values[name][0] for name in surrogate.TRUTH]
    np.testing.assert_allclose(found, batch([log]), rtol=ROUNDING)


def test_five_runs_carry_over_what_was_learned() -> None:
    noisy = next(case for case in CASES if case.key == "noisy")
    seeds = sequence_seeds(1, 0)
    trace = five_runs("feedforward", noisy, seeds)
    state = noisy.estimator.init(sampling_time=surrogate.SAMPLING_TIME)
    logs = [
        one_run("feedforward", 1.0, np.random.default_rng(seed), noisy.estimator, state).log
        for seed in seeds
    ]
    for k in range(len(seeds)):
        np.testing.assert_allclose(trace.values[k, -1], batch(logs[: k + 1]), rtol=ROUNDING)


def test_the_loop_compensates_what_the_log_repeats() -> None:
    estimator = published_estimator(compensation="printed", error_terms=True)
    state = estimator.init(sampling_time=surrogate.SAMPLING_TIME)
    controller = feedback_controller(estimator, state)
    samples = 3000
    run = simulate_closed_loop(
        surrogate.surrogate_arm(),
        controller,
        sampling_time=surrogate.SAMPLING_TIME,
        samples=samples,
        sensors=surrogate.surrogate_sensors(),
        generator=np.random.default_rng(2),
    )
    inside = controller.estimator_state(run.controller_state)
    repeated, _ = estimator.run(state, run.log.part(0, samples))
    np.testing.assert_array_equal(inside, repeated)
    assert controller.refused_samples(run.controller_state) == 0


def test_the_arm_moves_as_its_values_make_it() -> None:
    rest = rest_of_the_arm()
    assert rest.time == pytest.approx(REST_TIME, abs=0.05)
    assert rest.swing == pytest.approx(SWING, abs=0.0005)
    # The spring cannot free the first mass, so the second goes on for ever.
    assert surrogate.STIFFNESS * rest.swing < surrogate.COULOMB_FRICTION


def test_the_printed_sums_err_by_the_first_order_and_the_exact_ones_hardly() -> None:
    found = sampling_errors()
    np.testing.assert_allclose(found.printed / found.finer, 10.0, rtol=0.1)
    assert np.max(np.abs(found.exact)) < 1e-5  # the order of T^3 at T = 0.01 s
    assert np.min(np.abs(found.printed)) > 0.01


def test_itse_of_known_errors() -> None:
    time = np.linspace(0.0, 2.0, 2001)
    found = itse(time, np.array([np.ones(2001), time]))
    # Integrals of t and t^3 from 0 to 2; the second within the trapezoidal rule's error.
    np.testing.assert_allclose(found, [2.0, 4.0], rtol=1e-6)


def test_without_noise_there_are_no_effects_of_noise() -> None:
    estimator = published_estimator()
    state = estimator.init(sampling_time=surrogate.SAMPLING_TIME)
    run = one_run("feedback", 0.0, np.random.default_rng(0), estimator, state)
    effects = noise_effects(run)
    assert effects.held_input_energy == 0.0
    assert effects.input_energy == effects.kinetic_energy == effects.potential_energy == 0.0
    assert effects.coulomb_regressor == effects.viscous_regressor == 0.0


def test_the_feedback_correlates_its_input_with_noise_as_its_gains_say() -> None:
    estimator = published_estimator(compensation="printed", error_terms=True)
    T = surrogate.SAMPLING_TIME
    state = estimator.init(sampling_time=T)
    controller = feedback_controller(estimator, state)
    straight = controller.notch.coefficients(T).b0
    samples = round(surrogate.DURATION / T)
    found = np.array(
        [
            (each.input_energy, each.held_input_energy)
            for k in range(20)
            for each in [
                noise_effects(one_run("feedback", 1.0, np.random.default_rng(k), estimator, state))
            ]
        ]
    )
    expected = (
        -straight * controller.pd.velocity_gain * surrogate.VELOCITY_NOISE**2 * T * samples,
        straight * controller.pd.position_gain * surrogate.POSITION_NOISE**2 * samples,
    )
    chance = np.std(found, axis=0, ddof=1) / np.sqrt(len(found))
    assert np.all(np.abs(np.mean(found, axis=0) - expected) < 4.0 * chance)
    assert np.all(np.abs(expected) > 10.0 * chance)


def test_the_expectations_are_those_of_a_folded_normal() -> None:
    found = absolute_value(np.random.default_rng(5))
    assert found.added_at_rest == pytest.approx(np.sqrt(2.0 / np.pi))
    assert found.mean_deviation < 5.0  # standard errors, of five means
    assert found.density_distance < 1.5  # of a 95 % limit, both means
    densities = expectation_figures()[0]
    for panel in densities.panels:
        for curve in panel.curves:
            # A jump at zero is off by half a step of 1/60 times a height of at most 0.8.
            assert np.trapezoid(curve.y, curve.x) == pytest.approx(1.0, abs=0.01)


def test_a_study_depends_on_its_seed_and_not_on_its_workers() -> None:
    def study(seed: int, workers: int) -> list[dict[str, float]]:
        found = monte_carlo(2, seed, workers=workers, advance=lambda: None)
        return [dict(each.rmse) for each in found.scores]

    alone = study(1, 1)
    assert study(1, 3) == alone
    assert study(2, 1) != alone


def test_scores_are_consistent(reproduced: Reproduced) -> None:
    for score in reproduced.reproduction.variants:
        assert score.runs == FEWEST
        for name in surrogate.TRUTH:
            assert abs(score.bias[name]) <= score.rmse[name] * (1 + 1e-12)
            if score.coverage is not None:
                assert 0.0 <= score.coverage[name] <= 1.0


def test_all_runs_have_noise_of_their_own() -> None:
    states = [
        tuple(seed.generate_state(4).tolist())
        for sequence in range(3)
        for seed in sequence_seeds(1, sequence)
    ]
    assert len(set(states)) == len(states)


def test_digests_of_sequences_join() -> None:
    case = CASES[0]
    made = [
        digest({("feedforward", case.key): five_runs("feedforward", case, sequence_seeds(1, k))})
        for k in range(2)
    ]
    both = sequences_of(made)["feedforward", case.key]
    assert both.values.shape == (2, 5, 2)
    # Without noise sequences are alike, so the mean line is that of either, and chance is none.
    found = both.line(0)
    assert found.chance == 0.0
    assert found.size == found.measured > 0.0
    time = np.linspace(0.0, surrogate.DURATION, 6001)
    trace = five_runs("feedforward", case, sequence_seeds(1, 0))
    line = np.polynomial.Polynomial.fit(time, trace.error[0], 1)(time)
    assert found.size == pytest.approx(np.sqrt(np.mean(line**2)), rel=1e-3)  # a sum for an integral


def test_what_is_kept_of_many_runs_holds_no_samples() -> None:
    case = CASES[0]
    trace = five_runs("feedforward", case, sequence_seeds(1, 0))
    kept = digest({("feedforward", case.key): trace})["feedforward", case.key]
    for field in fields(kept):
        assert not np.shares_memory(trace.values, getattr(kept, field.name)), field.name

    monte_carlo(1, 1, workers=1, advance=lambda: None)  # compiles, and fills what is kept
    tracemalloc.start()
    monte_carlo(2, 1, workers=1, advance=lambda: None)
    _, largest = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # One run at work takes 14 MB, the estimates after every sample of two would be 34 MB more.
    assert largest < 3e7


def test_a_place_that_cannot_be_written_is_found_beforehand(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    with refuses("output_needs_folder"):
        reproduce_part_a(tmp_path / "file")
    with refuses("missing", name="out"):
        reproduce_part_a("")
    (tmp_path / "out" / "part-a.html").mkdir(parents=True)
    with refuses("output_is_folder"):
        reproduce_part_a(tmp_path / "out")
    assert (tmp_path / "file").read_text() == "kept"
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["part-a.html"]


def test_an_interruption_leaves_nothing(tmp_path: Path) -> None:
    def interrupt(_done: int, _every: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        reproduce_part_a(tmp_path / "a" / "b", runs=FEWEST, progress=interrupt)
    assert list(tmp_path.iterdir()) == []


def test_a_failure_in_drawing_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, reproduced: Reproduced
) -> None:
    def fail(_: object) -> bytes:
        raise MemoryError

    monkeypatch.setattr("studies.van_de_wijdeven.writing.picture", fail)
    monkeypatch.setattr(
        "studies.van_de_wijdeven.part_a.computation._computed", lambda *_: reproduced.reproduction
    )
    with pytest.raises(MemoryError):
        reproduce_part_a(tmp_path / "out")
    assert list(tmp_path.iterdir()) == []
