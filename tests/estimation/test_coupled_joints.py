"""Two joints with coupled friction: a made-up wrist, and that of the TX40."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from stickslip.estimation import CoupledJoints, LinearFit
from stickslip.records import AxisLog, InputError

T = 1e-3
TRUTH = {
    "inertia_1": 0.04, "inertia_2": 0.02, "inertia_12": 0.005,
    "viscous_friction_1": 1.2, "coulomb_friction_1": 3.0,
    "viscous_friction_2": 0.6, "coulomb_friction_2": 2.0,
    "viscous_friction_12": 0.1, "coulomb_friction_12": 0.3,
    "offset_1": -0.1, "offset_2": 0.15,
}  # fmt: skip

EXACT = 0.01
"""Without noise what is left is what the filters make of the jumps at reversals."""

PUBLISHED = {
    "viscous_friction_1": 1.86 - 0.616,
    "coulomb_friction_1": 3.03,
    "viscous_friction_2": 0.616,
    "coulomb_friction_2": 1.95,
    "viscous_friction_12": 0.65 - 0.616,
    "coulomb_friction_12": 0.282,
    "offset_1": -0.0288 - 0.127,
    "offset_2": 0.127,
}
"""In joint coordinates motor 2 adds its viscous friction to that of both joints, and the torque of
joint 1 is the sum of both motors'."""

RATIOS = {5: 45.0, 6: 32.0}


def wrist() -> tuple[AxisLog, AxisLog]:
    """Return logs of both motors, from the torques of joints that turn at q1 and q2."""
    t = (np.arange(20_000) + 0.5) * T
    _, v1, a1 = wave(t, ((0.8, 2.1, 0.0), (0.3, 5.3, 1.0)))
    _, v2, a2 = wave(t, ((1.1, 1.7, 0.5), (0.2, 6.1, 2.0)))
    p = TRUTH
    s12 = np.sign(v1 + v2)
    # The published form: torques of the joints, friction of motor 2 with the sum of both rates
    motor_2 = p["viscous_friction_2"] * (v1 + v2) + p["coulomb_friction_2"] * s12
    tau_2 = (
        p["inertia_12"] * a1 + p["inertia_2"] * (a1 + a2) + motor_2 + p["offset_2"]
        + p["viscous_friction_12"] * v2 + p["coulomb_friction_12"] * np.sign(v2)
    )  # fmt: skip
    tau_1 = (
        (p["inertia_1"] + p["inertia_12"]) * a1
        + (p["inertia_12"] + p["inertia_2"]) * (a1 + a2)
        + motor_2
        + p["viscous_friction_1"] * v1 + p["coulomb_friction_1"] * np.sign(v1)
        + p["offset_1"] + p["offset_2"]
    )  # fmt: skip
    at, generator = t - 0.5 * T, np.random.default_rng(1)
    logs = []
    for name, motor, torque in (
        ("first", wave(at, ((0.8, 2.1, 0.0), (0.3, 5.3, 1.0)))[0], tau_1 - tau_2),
        ("second", wave(at, ((0.8, 2.1, 0.0), (0.3, 5.3, 1.0)))[0]
         + wave(at, ((1.1, 1.7, 0.5), (0.2, 6.1, 2.0)))[0], tau_2),
    ):  # fmt: skip
        noise = 1e-7 * generator.standard_normal(at.size)
        logs.append(
            AxisLog(
                name=name, kind="rotary", time=at, effort=torque, measured_position=motor + noise
            )
        )
    return logs[0], logs[1]


def wave(t: np.ndarray, parts: tuple[tuple[float, float, float], ...]) -> np.ndarray:
    """Return a sum of sines and its first two derivatives."""
    return np.array(
        [sum(a * w**k * np.sin(w * t + p + k * np.pi / 2) for a, w, p in parts) for k in range(3)]
    )


def test_a_made_up_wrist_is_recovered() -> None:
    fit = CoupledJoints().fit(*wrist())
    for name, value in TRUTH.items():
        assert fit.values[name] == pytest.approx(value, rel=EXACT, abs=EXACT * 0.1), name


def test_joints_of_other_instants_are_refused() -> None:
    first, second = wrist()
    with pytest.raises(InputError, match="other instants"):
        CoupledJoints().fit(first, second.part(0, 10_000))
    with pytest.raises(InputError, match="other instants"):
        CoupledJoints().fit(first, replace(second, time=second.time + 1e-4))


def test_a_joint_that_does_not_move_of_its_own_is_not_told_apart() -> None:
    first, _ = wrist()
    together = replace(first, name="second", measured_position=2.0 * first.measured_position)
    with pytest.raises(InputError, match="does not determine"):
        CoupledJoints().fit(first, together)


@pytest.fixture(scope="module")
def tx40(benchmark_data: Callable[[str], Path]) -> LinearFit:
    folder = benchmark_data("staubli_tx40")
    logs = []
    for joint, ratio in RATIOS.items():
        current, position = (
            np.loadtxt(folder / f"{name}_data.csv", delimiter=",", skiprows=1, usecols=joint - 1)
            for name in ("curr", "pos_read")
        )
        logs.append(
            AxisLog(
                name=f"motor {joint}",
                kind="rotary",
                time=np.arange(current.size) * 2e-4,
                effort=current * ratio,
                measured_position=position / ratio,
            )
        )
    return CoupledJoints().fit(*logs)


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_coupling_of_the_tx40(tx40: LinearFit, name: str) -> None:
    low, high = tx40.ci95[name]
    assert low <= PUBLISHED[name] <= high


def test_the_coupling_of_the_tx40_is_well_known(tx40: LinearFit) -> None:
    assert tx40.values["viscous_friction_2"] == pytest.approx(0.616, rel=0.05)
    assert tx40.values["coulomb_friction_2"] == pytest.approx(1.95, rel=0.05)
    assert tx40.ci95["viscous_friction_2"][0] > 0
    assert tx40.ci95["coulomb_friction_2"][0] > 0
