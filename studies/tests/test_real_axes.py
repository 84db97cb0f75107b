"""Public logs of real axes: what `identify` returns for them without options."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from itertools import combinations
from math import hypot
from pathlib import Path

import numpy as np
import pytest

from stickslip import identify
from stickslip.estimation import predict_effort
from stickslip.records import FrictionEstimate
from studies.real_axes.logs import RealLog, load_logs
from studies.real_axes.reference import relative_error
from studies.real_axes.study import NO_WORSE, Judgement, judge, split_index

pytestmark = pytest.mark.slow

Find = Callable[[str], Path]

WIDEST = 3.0
"""Largest over smallest interval of repeats; 0.1 had a factor of 120 on the same four logs."""


@pytest.fixture(scope="module")
def logs(benchmark_data: Find) -> dict[str, RealLog]:
    folders = {benchmark_data(name).parent for name in ("emps", "staubli_tx40", "real_axes")}
    if len(folders) > 1:
        pytest.skip("the public logs are in several folders")
    return {log.name: log for log in load_logs(folders.pop())}


@pytest.fixture(scope="module")
def judged(logs: dict[str, RealLog]) -> Callable[[str], Judgement]:
    @cache
    def of(name: str) -> Judgement:
        return judge(logs[name], lambda _: None)

    return of


@pytest.fixture(scope="module")
def estimate(logs: dict[str, RealLog]) -> Callable[[str], FrictionEstimate]:
    @cache
    def of(name: str) -> FrictionEstimate:
        return identify(logs[name].log).estimate

    return of


@pytest.mark.parametrize("name", ["DATA_EMPS", "tx40_joint_4", "ur10e_joint_6"])
def test_a_result_that_is_ok_is_right(judged: Callable[[str], Judgement], name: str) -> None:
    found = judged(name)
    assert found.whole.status == "ok"
    assert {"coulomb_friction", "viscous_friction"} <= found.inside.keys()
    assert found.faults == ()


def test_gravity_of_a_wrist_is_found(judged: Callable[[str], Judgement]) -> None:
    found = judged("ur10e_joint_4")
    assert found.whole.selected[0] == "gravity"
    assert found.usable_halves
    assert all(each.agree for each in (*found.halves.values(), *found.inside.values()))
    assert not found.prediction_ratio > NO_WORSE  # NaN where a half does not identify everything


@pytest.mark.parametrize("name", ["DATA_EMPS", "DATA_EMPS_PULSES"])
def test_the_ripple_of_a_ball_screw_is_found(
    estimate: Callable[[str], FrictionEstimate], name: str
) -> None:
    found = estimate(name)
    assert {"direction", "ripple", "low speed", "delay"} <= set(found.selection.selected)
    assert found.value("ripple_period") == pytest.approx(2.5e-3, rel=2e-3)
    assert found.diagnostics.relative_residual < 0.018


def test_the_effort_of_another_recording_is_predicted(
    logs: dict[str, RealLog], estimate: Callable[[str], FrictionEstimate]
) -> None:
    """The published law per direction leaves 3.8 % of it (docs/evidence/real-logs.md)."""
    real = logs["DATA_EMPS_PULSES"]
    effort = predict_effort(estimate("DATA_EMPS"), real.log, window=0.0)
    known = np.isfinite(effort)
    target = real.filtered()
    predicted = replace(target, effort=np.where(known, effort, real.log.effort)).rows().effort
    rows = target.rows()
    moving = rows.moving & (np.interp(rows.time, real.log.time, known.astype(float)) == 1.0)
    assert np.sum(moving) > 0.9 * np.sum(rows.moving)
    assert relative_error(replace(rows, moving=moving), predicted) < 0.03


def test_the_effort_of_an_uneven_log_is_a_mean(
    logs: dict[str, RealLog], estimate: Callable[[str], FrictionEstimate]
) -> None:
    name = "moteus_ri50_14-29"
    whole = estimate(name).selection
    assert whole.effort_kind == "mean"
    assert abs(whole.effort_delay) < 1e-3
    log = logs[name].log
    split = split_index(log)
    for part in (log.part(0, split), log.part(split, len(log))):
        found = identify(part).estimate
        assert found.selection.effort_kind == "mean"
        assert 0.46e-3 < found.value("inertia") < 0.51e-3


def test_repeats_agree_with_equal_intervals(estimate: Callable[[str], FrictionEstimate]) -> None:
    found = [estimate(f"lorenz_S3_{k}").parameters["coulomb_friction"] for k in range(1, 5)]
    values = [p.value for p in found if p.value is not None]
    halves = [(p.ci95[1] - p.ci95[0]) / 2 for p in found if p.ci95 is not None]
    assert len(values) == len(halves) == 4
    assert max(halves) < WIDEST * min(halves)
    for (a, ha), (b, hb) in combinations(zip(values, halves, strict=True), 2):
        assert abs(a - b) < hypot(ha, hb)
    for value, half in zip(values, halves, strict=True):
        assert abs(value - 0.0151) < half + 0.0004


def test_stick_slip_is_not_trusted(estimate: Callable[[str], FrictionEstimate]) -> None:
    assert not estimate("openarm_joint_3").status.trusted
