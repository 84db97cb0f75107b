"""Joint fit of several logs on motions in closed form, and its test of consistency."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from axis_logs import axis_log
from estimates import std_of
from jaxtyping import Float
from refusals import refuses
from scipy.stats import f as f_distribution
from two_sines import Motion

from stickslip import identify, write_csv
from stickslip.estimation import JointEstimator, SelectedModelEstimator, predict_effort
from stickslip.estimation.fit.intervals import robust_uncertainty
from stickslip.estimation.joint.consistency import ConsistencyTuning, compared
from stickslip.estimation.joint.summary import difference_text
from stickslip.estimation.selection.model_rows import ModelRows
from stickslip.estimation.selection.significance import Basis, significance
from stickslip.records import AxisLog, FrictionEstimate, LogDeviation, Status

TRUTH = {"mass": 3.0, "viscous_friction": 4.0, "coulomb_friction": 1.5}

DEVIATIONS = 4.0
"""Standard deviations within which a value must lie: one in some thousand values of a t
distribution with 12 degrees of freedom does not."""

SAME = 1e-9
"""Relative; what sums of some hundred terms leave of double precision."""


def log_of(
    name: str,
    *,
    offset: float = 0.2,
    delay: float = 0.0,
    noise: float = 0.02,
    step: float = 1e-3,
    duration: float = 10.0,
    more_coulomb: float = 0.0,
    stiffness: float = 0.0,
    drift: float = 0.0,
    seed: int = 1,
) -> AxisLog:
    """Return a log of two sines; each seed has phases, and thus moves, of its own."""
    rng = np.random.default_rng([seed, 314])
    first, second = rng.uniform(0.0, 2.0 * np.pi, 2).tolist()
    shown = Motion(time=np.arange(0.0, duration, step), phases=(first, second))
    # The effort of a sample is held until the next
    acts = replace(shown, time=shown.time + 0.5 * step + delay)
    effort = acts.effort(coulomb=1.5 * (1.0 + more_coulomb), offset=offset)
    effort += stiffness * acts.position + drift * (acts.time - 0.5 * duration)
    effort += noise * rng.standard_normal(effort.size)
    return axis_log(shown.time, effort, shown.position, name=name)


@pytest.fixture(scope="module")
def trio() -> list[AxisLog]:
    return [
        log_of("morning", offset=0.2, delay=2e-3, noise=0.01, seed=1),
        log_of("noon", offset=-0.1, delay=-1e-3, noise=0.02, step=2e-3, seed=2),
        log_of("evening", offset=0.5, delay=4e-3, noise=0.04, seed=3),
    ]


@pytest.fixture(scope="module")
def fitted(trio: list[AxisLog]) -> FrictionEstimate:
    return JointEstimator().fit(trio)


def near(estimate: FrictionEstimate, name: str, value: float) -> bool:
    return abs(estimate.value(name) - value) < DEVIATIONS * std_of(estimate, name)


def test_common_parameters_and_those_of_each_log_are_found(fitted: FrictionEstimate) -> None:
    assert fitted.status is Status.OK
    truth = TRUTH | {
        "offset[morning]": 0.2,
        "offset[noon]": -0.1,
        "offset[evening]": 0.5,
        "effort_delay[morning]": 2e-3,
        "effort_delay[noon]": 0.0,  # of the value at its time stamp, half a sample of 2 ms before
        "effort_delay[evening]": 4e-3,
    }
    assert set(fitted.parameters) == set(truth)
    for name, value in truth.items():
        assert near(fitted, name, value), name
    assert fitted.joint is not None
    assert [each.effort_kind for each in fitted.joint.logs] == ["held", "sampled", "held"]
    assert fitted.parameters["offset[noon]"].unit == "N"
    assert fitted.covariance.shape == (len(truth), len(truth))


def test_residual_levels_are_those_of_the_noise(fitted: FrictionEstimate) -> None:
    assert fitted.joint is not None
    levels = np.array([log.residual for log in fitted.joint.logs])
    # A window of fixed duration averages over half as many samples of the second log
    expected = np.array([0.01, 0.02 * np.sqrt(2.0), 0.04])
    assert levels / levels[0] == pytest.approx(expected / expected[0], rel=0.2)
    assert fitted.joint.consistent
    assert [log.name for log in fitted.joint.logs] == ["morning", "noon", "evening"]


def test_a_noisy_log_does_not_spoil_a_good_one() -> None:
    good = log_of("good", noise=0.02, seed=1)
    noisy = log_of("noisy", noise=1.0, seed=2)
    alone = SelectedModelEstimator(select=False).fit(good)
    joint = JointEstimator(single=SelectedModelEstimator(select=False)).fit([good, noisy])
    for name in TRUTH:
        # An unweighted fit has more than ten times as much
        assert std_of(joint, name) < 1.3 * std_of(alone, name), name


@pytest.mark.slow
def test_intervals_shrink_with_the_number_of_logs() -> None:
    single = SelectedModelEstimator(select=False)
    logs = [log_of(f"log {k}", noise=0.2, seed=k) for k in range(9)]
    joint = JointEstimator(single=single).fit(logs)
    alone = [single.fit(log) for log in logs]
    for name in TRUTH:
        stds = np.array([std_of(estimate, name) for estimate in alone])
        # One over the square root of nine; each standard deviation is known to 20 %
        assert std_of(joint, name) == pytest.approx(1.0 / np.sqrt(np.sum(stds**-2.0)), rel=0.5)


@pytest.mark.slow
def test_a_log_that_differs_is_named_with_parameter_and_size() -> None:
    logs = [
        log_of("morning", offset=0.2, seed=1),
        log_of("noon", offset=0.3, seed=2, more_coulomb=0.1),
        log_of("evening", offset=0.1, seed=3),
    ]
    found = JointEstimator().fit(logs)
    assert found.status is Status.MODEL_MISMATCH
    assert found.joint is not None
    assert not found.joint.consistent
    assert found.joint.p_value is not None
    assert found.joint.p_value < found.joint.error_rate
    first = found.joint.deviations[0]
    assert (first.log, first.parameter) == ("noon", "coulomb_friction")
    assert first.relative == pytest.approx(0.1, abs=0.02)
    note = found.diagnostics.notes[0]
    assert "noon shows" in note
    assert "more Coulomb friction than the others" in note
    # The value is that of the other logs, and the interval allows for the one that differs
    parameter = found.parameters["coulomb_friction"]
    assert parameter.value == pytest.approx(1.5, rel=0.02)
    assert parameter.ci95 is not None
    assert parameter.ci95[0] < 1.5 < 1.65 < parameter.ci95[1]


def test_of_two_logs_the_second_is_compared_with_the_first() -> None:
    logs = [log_of("before", seed=1), log_of("after", seed=2, more_coulomb=-0.1)]
    found = JointEstimator().fit(logs)
    assert found.joint is not None
    first = found.joint.deviations[0]
    assert (first.log, first.parameter) == ("after", "coulomb_friction")
    assert first.relative == pytest.approx(-0.1, abs=0.02)
    assert "less Coulomb friction than before" in found.diagnostics.notes[0]


@pytest.mark.slow
@pytest.mark.parametrize(("factor", "logs"), [(1e-3, 2), (0.1, 2), (1.0 / 0.454, 3), (1e3, 3)])
def test_a_log_in_another_unit_of_effort_differs_by_that_factor(factor: float, logs: int) -> None:
    every = [log_of(name, seed=k) for k, name in enumerate(("one", "two", "three")[:logs], 1)]
    every[-1] = replace(every[-1], effort=factor * every[-1].effort)
    found = JointEstimator().fit(every)
    assert found.status is Status.MODEL_MISMATCH
    assert found.joint is not None
    assert not found.joint.consistent
    own = {each.parameter: each for each in found.joint.deviations if each.log == every[-1].name}
    if logs == 2:
        assert set(own) == set(TRUTH)
    for each in own.values():
        assert each.relative == pytest.approx(factor - 1.0, rel=0.05)
        assert each.material


def rows_of_trapezoids(values: Float[np.ndarray, "logs 3"], seed: int) -> ModelRows:
    """Return rows of moves with trapezoidal velocity, weighted by the residual of their log.

    The noise of a log follows its mass, the first of its values.
    """
    rng = np.random.default_rng([seed, 159])
    phase = (np.arange(60) + 0.5) / 60
    speed = np.clip(5.0 * np.minimum(phase, 1.0 - phase), 0.0, 1.0)
    ramp = 5.0 * ((phase < 0.2).astype(float) - (phase > 0.8))
    logs: list[Float[np.ndarray, "n 3"]] = []
    for _ in values:
        sizes = np.repeat(rng.uniform(0.2, 1.0, 4) * [1.0, -1.0, 1.0, -1.0], phase.size)
        velocity = sizes * np.tile(speed, 4)
        logs.append(np.column_stack([sizes * np.tile(ramp, 4), velocity, np.sign(velocity)]))
    log = np.repeat(np.arange(len(logs)), [each.shape[0] for each in logs])
    offsets = (log[:, None] == np.arange(len(logs))).astype(float)
    columns = np.column_stack([np.vstack(logs), offsets])
    target = np.concatenate([each @ own for each, own in zip(logs, values, strict=True)])
    level = 0.01 * values[:, 0]
    target += level[log] * rng.standard_normal(target.size)
    for _ in range(2):
        weight = 1.0 / level[log]
        fit = np.linalg.lstsq(columns * weight[:, None], target * weight)[0]
        level = np.sqrt(np.bincount(log, (target - columns @ fit) ** 2) / np.bincount(log))
    weight = 1.0 / level[log]
    names = (*TRUTH, *(f"offset[{k}]" for k in range(len(logs))))
    rows, target = columns * weight[:, None], target * weight
    return ModelRows(names=names, columns=rows, target=target, log=log)


@pytest.mark.parametrize("seed", [1, 2, 3])
@pytest.mark.parametrize("differences", [(-0.2, -0.47, 0.91), (0.2, -0.3, 0.2), (9.0, 9.0, 9.0)])
def test_a_log_of_another_axis_differs_in_all_parameters(
    differences: tuple[float, float, float], seed: int
) -> None:
    own = np.array(list(TRUTH.values()))
    rows = rows_of_trapezoids(np.array([own, own, own * (1.0 + np.array(differences))]), seed)
    found = compared(rows, ("0", "1", "2"), tuple(TRUTH), ConsistencyTuning())
    assert {(each.log, each.parameter) for each in found.deviations} == {("2", n) for n in TRUTH}
    relative = {each.parameter: each.relative for each in found.deviations}
    assert relative == pytest.approx(dict(zip(TRUTH, differences, strict=True)), abs=0.02)


@pytest.mark.parametrize("factor", [1e-5, 1e-3, 1e3, 1e5])
def test_differences_of_two_logs_are_found_whatever_their_weights(factor: float) -> None:
    own = np.array(list(TRUTH.values()))
    rows = rows_of_trapezoids(np.array([own, factor * own]), 1)
    found = compared(rows, ("0", "1"), tuple(TRUTH), ConsistencyTuning())
    assert {each.parameter for each in found.deviations} == set(TRUTH)
    for each in found.deviations:
        assert each.relative == pytest.approx(factor - 1.0, rel=0.05)


@pytest.mark.parametrize("mass", [None, 3.0])
def test_a_log_with_reversed_effort_is_named(mass: float | None) -> None:
    turned = log_of("evening", seed=3)
    logs = [
        log_of("morning", seed=1),
        log_of("noon", seed=2),
        replace(turned, effort=-turned.effort),
    ]
    single = SelectedModelEstimator(inertia=mass, select=False)
    found = JointEstimator(single=single).fit(logs)
    assert found.status is Status.MODEL_MISMATCH
    named = [note for note in found.diagnostics.notes if "is reversed" in note]
    assert len(named) == 1
    assert named[0].startswith("evening: ")


@pytest.mark.parametrize(
    ("relative", "words"),
    [
        (-0.1, "noon shows 10 % less Coulomb friction than the others"),
        (2.4, "noon shows 240 % more Coulomb friction than the others"),
        (-1.2, "noon shows a Coulomb friction of -0.3 N, the others 1.5 N"),
    ],
)
def test_a_difference_is_a_plain_sentence(relative: float, words: str) -> None:
    deviation = LogDeviation(
        log="noon",
        parameter="coulomb_friction",
        difference=1.5 * relative,
        std=0.01,
        relative=relative,
        p_value=1e-6,
        material=True,
    )
    sentence = difference_text(deviation, ["morning", "noon", "evening"], "N")
    assert sentence.startswith(f"{words} (p = 1e-06)")


def test_a_difference_that_does_not_matter_widens_the_interval_only() -> None:
    logs = [log_of("a", noise=0.002, seed=1), log_of("b", noise=0.002, seed=2, more_coulomb=0.01)]
    found = JointEstimator().fit(logs)
    assert found.status is Status.OK
    assert found.joint is not None
    assert found.joint.consistent
    assert found.joint.deviations
    assert any("the intervals allow for it" in note for note in found.diagnostics.notes)
    interval = found.parameters["coulomb_friction"].ci95
    assert interval is not None
    assert interval[0] < 1.5 < 1.515 < interval[1]


@pytest.mark.slow
def test_a_spring_is_common_and_a_drift_is_that_of_a_log() -> None:
    logs = [
        log_of("still", offset=0.2, stiffness=20.0, seed=1),
        log_of("drifting", offset=0.3, stiffness=20.0, drift=0.05, seed=2),
    ]
    found = JointEstimator().fit(logs)
    assert found.selection is not None
    assert set(found.selection.selected) == {"spring", "offset drift"}
    for name, value in {
        **TRUTH,
        "spring_stiffness": 20.0,
        "offset_drift[still]": 0.0,
        "offset_drift[drifting]": 0.05,
    }.items():
        assert near(found, name, value), name


def test_a_change_of_the_gain_within_a_log_is_named_with_its_instant() -> None:
    logs = [log_of("morning", seed=1), log_of("noon", seed=2), log_of("evening", seed=3)]
    late = logs[1].time >= 6.0
    logs[1] = replace(logs[1], effort=np.where(late, 1.2, 1.0) * logs[1].effort)
    found = JointEstimator().fit(logs)
    assert found.status is Status.MODEL_MISMATCH
    note = next(note for note in found.diagnostics.notes if note.startswith("noon: from about"))
    instant = float(note.split("from about ")[1].split(" s")[0])
    assert instant == pytest.approx(6.0, abs=0.5)  # instants 0.5 s apart are tried
    assert "takes 1.2 times the logged effort" in note


def test_a_wrong_delay_is_named_beside_that_of_its_log() -> None:
    logs = [log_of("morning", seed=1), log_of("noon", delay=2e-3, seed=2)]
    found = JointEstimator(delays={"noon": 8e-3}).fit(logs)
    assert found.status is Status.MODEL_MISMATCH
    note = found.diagnostics.notes[0]
    assert note.startswith("noon: the given effort delay of 8 ms disagrees with the log")
    shown = float(note.split("shows about ")[1].split(" ms")[0])
    assert shown == pytest.approx(2.0, abs=0.3)


def test_terms_that_are_not_selected_are_named() -> None:
    logs = [log_of("morning", seed=1, stiffness=3.0), log_of("noon", seed=2, stiffness=3.0)]
    found = JointEstimator(single=SelectedModelEstimator(select=False)).fit(logs)
    assert found.status is Status.MODEL_MISMATCH
    assert "the model lacks some (a spring acts on the axis)" in found.diagnostics.notes[0]


def test_friction_per_direction_contains_the_offset_of_the_first_log() -> None:
    logs = [log_of("a", offset=0.2, seed=1), log_of("b", offset=0.5, seed=2)]
    single = SelectedModelEstimator(include=("direction",), select=False)
    found = JointEstimator(single=single).fit(logs)
    assert near(found, "coulomb_friction_positive", 1.7)
    assert near(found, "coulomb_friction_negative", 1.3)
    assert near(found, "offset[b]", 0.3)
    assert "offset[a]" not in found.parameters


@pytest.mark.slow
def test_a_known_delay_is_taken_and_the_others_are_estimated(trio: list[AxisLog]) -> None:
    found = JointEstimator(delays={"morning": 2e-3}).fit(trio)
    assert "effort_delay[morning]" not in found.parameters
    assert near(found, "effort_delay[evening]", 4e-3)
    assert near(found, "mass", 3.0)


def test_the_estimate_of_one_log_has_the_usual_names(
    trio: list[AxisLog], fitted: FrictionEstimate
) -> None:
    for log in trio:
        own = fitted.of_log(log.name)
        assert set(own.parameters) == {*TRUTH, "offset", "effort_delay"}
        assert own.value("offset") == fitted.value(f"offset[{log.name}]")
        std = std_of(own, "effort_delay")
        assert std == pytest.approx(float(np.sqrt(own.covariance[-1, -1])), rel=SAME)
        error = predict_effort(own, log) - log.effort
        noise = {"morning": 0.01, "noon": 0.02, "evening": 0.04}[log.name]
        # The noise of the log, and less than a tenth of it of the model
        assert np.sqrt(np.nanmean(error**2)) == pytest.approx(noise, rel=0.1)
    with refuses("prediction_of_joint_fit"):
        predict_effort(fitted, trio[0])
    with refuses("unknown_log", logs=["morning", "noon", "evening"]):
        fitted.of_log("night")


def test_logs_have_cosines_of_their_own() -> None:
    """Where no column is shared, each log has the covariance of a fit of its own."""
    rng = np.random.default_rng(1)
    sizes = (300, 500)
    blocks = [rng.standard_normal((n, 2)) for n in sizes]
    columns = np.zeros((sum(sizes), 4))
    columns[:300, :2], columns[300:, 2:] = blocks
    target = rng.standard_normal(sum(sizes))
    log = np.repeat([0, 1], sizes)

    def covariance(x: Float[np.ndarray, "n p"], y: Float[np.ndarray, " n"], own: Any = None) -> Any:
        left, singular, right = np.linalg.svd(x, full_matrices=False)
        to_values = right.T / singular
        residual = y - left @ (left.T @ y)
        return robust_uncertainty(left, to_values, residual, log=own)

    joint = covariance(columns, target, log)
    for k, x in enumerate(blocks):
        alone = covariance(x, target[log == k])
        own = slice(2 * k, 2 * k + 2)
        # Each loses degrees of freedom to its own two columns, or to all four
        factor = (800 / 796) / (sizes[k] / (sizes[k] - 2))
        assert joint.covariance[own, own] == pytest.approx(alone.covariance * factor, rel=SAME)
        assert joint.degrees_of_freedom[own] == pytest.approx(alone.degrees_of_freedom, rel=SAME)


def test_intervals_of_several_logs_hold_under_correlated_residuals() -> None:
    """Three blocks of an AR(1) process around a common mean: 95 % intervals hold in 95 %."""
    rng = np.random.default_rng(2)
    runs, sizes = 400, (200, 300, 400)
    log = np.repeat([0, 1, 2], sizes)
    n = log.size
    left = np.full((n, 1), n**-0.5)
    inside = 0
    for _ in range(runs):
        noise = []
        for size in sizes:
            white = rng.standard_normal(size + 50)
            values = np.zeros(size + 50)
            for k in range(1, size + 50):
                values[k] = 0.7 * values[k - 1] + white[k]
            noise.append(values[50:])
        target = np.concatenate(noise)
        mean = float(np.mean(target))
        found = robust_uncertainty(left, np.array([[n**-0.5]]), target - mean, log=log)
        quantile = f_distribution.ppf(0.95, 1, found.degrees_of_freedom[0])
        inside += mean**2 < quantile * found.covariance[0, 0]
    # Three standard deviations of a binomial rate, and one per cent of a finite sample
    assert abs(inside / runs - 0.95) < 3.0 * np.sqrt(0.95 * 0.05 / runs) + 0.01


def test_columns_of_single_logs_are_tested_one_by_one() -> None:
    rng = np.random.default_rng(3)
    log = np.repeat([0, 1, 2], 200)
    columns = np.ones((600, 1))
    further = rng.standard_normal((600, 1)) * (log[:, None] == np.arange(3))
    basis = Basis.of(columns, rng.standard_normal(600) + 0.4 * further[:, 1], log)
    parts = [basis.partial(further[:, [k]]) for k in range(3)]
    whole = basis.partial(further)
    assert whole is not None
    each = [significance(basis, part) for part in parts if part is not None]
    assert len(each) == 3
    assert significance(basis, whole, further) == pytest.approx(3.0 * min(each))
    assert each[1] < 1e-3


# Refusals


def resting_pair() -> list[AxisLog]:
    """Return a log and one in which the position is noise."""
    resting = log_of("second", seed=2)
    noise = 1e-6 * np.random.default_rng(0).standard_normal(len(resting))
    return [log_of("first"), replace(resting, measured_position=noise)]


def pair(**changes: Any) -> list[AxisLog]:
    return [log_of("first", seed=1), replace(log_of("second", seed=2), **changes)]


@pytest.mark.parametrize(
    ("logs", "code", "where"),
    [
        (lambda: pair(kind="rotary"), "logs_of_two_kinds", "second"),
        (lambda: pair(name="first"), "logs_of_one_name", "first"),
        (
            lambda: [log_of("first"), replace(log_of("first"), name="copy")],
            "log_given_twice",
            "copy",
        ),
        (lambda: pair(measured_load_position=np.zeros(10000)), "joint_log_of_arm", "second"),
        (list, "no_log", ""),
        (lambda: pair(effort=np.zeros(10000)), "no_effort", "second"),
        (lambda: [log_of("first"), "missing.csv"], "no_such_file", "missing.csv"),
        (resting_pair, "joint_log_without_slip", "second"),
    ],
)
def test_what_cannot_be_fitted_jointly_is_refused_by_name(
    logs: Callable[[], list[Any]], code: str, where: str
) -> None:
    with refuses(code, where=where):
        identify(logs())


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"estimator": "energy"}, "estimator_of_one_log"),
        ({"estimator": SelectedModelEstimator(), "inertia": 3.0}, "setting_beside_estimator"),
        ({"load_inertia": 1.0, "stiffness": 9.0}, "joint_fit_of_arm"),
        ({"effort_delay": {"third": 0.001}}, "delay_of_unknown_log"),
        ({"effort_delay": {"first": 7.0}}, "effort_delay_too_long"),
    ],
)
def test_options_that_several_logs_do_not_have_are_refused(
    options: dict[str, Any], code: str
) -> None:
    with refuses(code):
        identify(pair(), **options)


def test_delays_by_name_need_several_logs() -> None:
    with refuses("delays_of_one_log"):
        identify(log_of("first"), effort_delay={"first": 0.001})


def test_a_list_of_one_log_is_that_log() -> None:
    log = log_of("only")
    assert identify([log]).estimate.to_dict() == identify(log).estimate.to_dict()


def test_files_of_one_name_are_named_by_their_folders(tmp_path: Path) -> None:
    paths = []
    for k, folder in enumerate(("monday", "tuesday")):
        path = tmp_path / folder / "stage.csv"
        path.parent.mkdir()
        write_csv(log_of("stage", duration=5.0, seed=k), path)
        paths.append(path)
    found = identify(paths)
    assert [log.name for log in found.logs] == ["monday/stage", "tuesday/stage"]
    assert "offset[tuesday/stage]" in found.estimate.parameters
    assert found.estimate.provenance.files == ("stage.csv", "stage.csv")
    with refuses("log_given_twice"):
        identify([paths[0], paths[0]])
