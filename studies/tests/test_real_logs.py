"""The study of two public logs: laws held against a log, and two joints with coupled friction."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from axis_logs import axis_log

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, simulate
from studies.real_logs.laws import DIRECTIONS, PUBLISHED, AxisLaw
from studies.real_logs.motion import acting_effort, smooth_motion
from studies.real_logs.wrist import CoupledFit, fit_coupled_joints

pytestmark = pytest.mark.slow

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

WRIST = {
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
        logs.append(axis_log(at, torque, motor + noise, name=name, kind="rotary"))
    return logs[0], logs[1]


def wave(t: np.ndarray, parts: tuple[tuple[float, float, float], ...]) -> np.ndarray:
    """Return a sum of sines and its first two derivatives."""
    return np.array(
        [sum(a * w**k * np.sin(w * t + p + k * np.pi / 2) for a, w, p in parts) for k in range(3)]
    )


def test_a_made_up_wrist_is_recovered() -> None:
    fit = fit_coupled_joints(*wrist())
    for name, value in TRUTH.items():
        assert fit.values[name] == pytest.approx(value, rel=EXACT, abs=EXACT * 0.1), name


def test_logs_of_other_instants_are_an_error() -> None:
    first, second = wrist()
    for other in (second.part(0, 10_000), replace(second, time=second.time + 1e-4)):
        with pytest.raises(ValueError, match="same instants"):
            fit_coupled_joints(first, other)


def test_a_joint_that_only_follows_is_not_determined() -> None:
    first, _ = wrist()
    together = replace(first, name="second", measured_position=2.0 * first.measured_position)
    with pytest.raises(ValueError, match="does not determine"):
        fit_coupled_joints(first, together)


@pytest.fixture(scope="module")
def tx40(benchmark_data: Callable[[str], Path]) -> CoupledFit:
    folder = benchmark_data("staubli_tx40")
    logs = []
    for joint, ratio in RATIOS.items():
        current, position = (
            np.loadtxt(folder / f"{name}_data.csv", delimiter=",", skiprows=1, usecols=joint - 1)
            for name in ("curr", "pos_read")
        )
        logs.append(
            axis_log(
                np.arange(current.size) * 2e-4,
                current * ratio,
                position / ratio,
                name=f"motor {joint}",
                kind="rotary",
            )
        )
    return fit_coupled_joints(*logs)


@pytest.mark.parametrize("name", WRIST)
def test_published_coupling_of_the_tx40(tx40: CoupledFit, name: str) -> None:
    low, high = tx40.ci95[name]
    assert low <= WRIST[name] <= high


def test_the_coupling_of_the_tx40_is_well_known(tx40: CoupledFit) -> None:
    assert tx40.values["viscous_friction_2"] == pytest.approx(0.616, rel=0.05)
    assert tx40.values["coulomb_friction_2"] == pytest.approx(1.95, rel=0.05)
    assert tx40.ci95["viscous_friction_2"][0] > 0
    assert tx40.ci95["coulomb_friction_2"][0] > 0


# ---- Laws held against a log

LAW = {
    "coulomb_friction_positive": 12.0, "coulomb_friction_negative": 10.0,
    "viscous_friction_positive": 60.0, "viscous_friction_negative": 80.0,
}  # fmt: skip
MASS = 40.0
HELD = 0.03  # residual of the filters at reversals, where friction jumps


def simulated(effort: np.ndarray) -> AxisLog:
    """Return a log without noise of an axis with the law above."""
    static = {name.replace("coulomb", "static"): LAW[name] for name in LAW if "coulomb" in name}
    plant = SingleMass(mass=MASS, friction=CoulombViscousFriction(**LAW, **static))
    motion = simulate(plant, effort, sampling_time=T)
    log = Sensors(velocity="none").measure(motion, np.random.default_rng(1))
    return log.part(0, effort.size)  # no effort is held over the last sample


def drive() -> np.ndarray:
    t = np.arange(8000) * T
    return 40.0 * np.sin(2.0 * t) + 15.0 * np.sin(7.0 * t)


@pytest.mark.parametrize("each_move", [True, False])
def test_the_right_law_explains_effort_and_motion(each_move: bool) -> None:
    log, law = simulated(drive()), AxisLaw(mass=MASS, values=LAW)
    assert law.residual(log) < HELD
    away = law.free_run(log, each_move=each_move) - log.measured_position
    wrong = AxisLaw(mass=MASS, values=LAW | {"coulomb_friction_positive": 15.0})
    farther = wrong.free_run(log, each_move=each_move) - log.measured_position
    assert np.std(away) < 0.05 * np.std(farther)
    assert wrong.residual(log) > 2.0 * law.residual(log)


def test_a_ripple_and_the_friction_of_low_speeds_are_simulated() -> None:
    further = {"ripple_sine": 1.5, "ripple_cosine": -0.5,
               "low_speed_friction": -4.0, "low_speed_velocity": 0.05}  # fmt: skip
    law = AxisLaw(mass=MASS, values=LAW | further, period=0.03)
    effort, steps = drive(), 100  # of one sample, in plain Euler
    x = v = 0.0
    positions = np.empty(effort.size)
    for k, u in enumerate(effort):
        positions[k] = x
        for _ in range(steps):
            wave = 2.0 * np.pi * x / 0.03
            force = u - 1.5 * np.sin(wave) + 0.5 * np.cos(wave)
            side = "positive" if (v or force) > 0 else "negative"
            coulomb = LAW[f"coulomb_friction_{side}"] - 4.0 * np.exp(-((v / 0.05) ** 2))
            if v == 0.0 and abs(force) <= coulomb:
                continue
            sign = 1.0 if side == "positive" else -1.0
            after = v + T / steps / MASS * (
                force - sign * coulomb - LAW[f"viscous_friction_{side}"] * v
            )
            v = after if v == 0.0 or after * v > 0.0 else 0.0
            x += T / steps * v
    log = axis_log(np.arange(effort.size) * T, effort, positions)
    away = law.free_run(log, each_move=True) - positions
    plainly = AxisLaw(mass=MASS, values=LAW).free_run(log, each_move=True) - positions
    assert np.std(away) < 0.02 * np.std(plainly)
    assert law.residual(log) < HELD
    assert law.without_ripple().residual(log) > 1.5 * law.residual(log)


def test_a_delay_of_whole_samples_is_a_shift_of_the_held_effort() -> None:
    log = simulated(drive())
    np.testing.assert_allclose(acting_effort(log, 3.0)[3:], log.effort[:-3], atol=1e-12)
    late = replace(log, effort=np.append(log.effort[20:], log.effort[-20:]))  # logged too early
    right, law = AxisLaw(mass=MASS, values=LAW, delay=20 * T), AxisLaw(mass=MASS, values=LAW)
    assert right.residual(late) < 1.5 * law.residual(log)
    assert law.residual(late) > 2.0 * law.residual(log)


def test_moves_are_the_stretches_in_one_direction() -> None:
    t = np.arange(8000) * T
    log = replace(simulated(drive()), measured_position=0.1 * np.sin(np.pi * t))
    moves = smooth_motion(log).moves()
    ends = [0.001 * stop for _, stop in moves]
    np.testing.assert_allclose(ends, [0.5, 1.5, 2.5, 3.5, 4.5, 5.5, 6.5, 7.5, 8.0], atol=0.01)


@pytest.mark.parametrize(
    ("law", "name", "percent"),
    [
        (PUBLISHED, "DATA_EMPS", 4.0834),
        (PUBLISHED, "DATA_EMPS_PULSES", 5.9824),
        (DIRECTIONS, "DATA_EMPS", 3.1117),
    ],
)
def test_published_residuals_of_emps(
    benchmark_data: Callable[[str], Path], law: AxisLaw, name: str, percent: float
) -> None:
    data = scipy.io.loadmat(benchmark_data(f"emps/{name}.mat"), squeeze_me=True)
    log = axis_log(data["t"], data["vir"] * float(data["gtau"]), data["qm"], name=name)
    assert round(100 * law.residual(log, later=0.0), 4) == percent
