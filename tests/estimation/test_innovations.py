"""The whitened balance: differential equations, the exact simulator, dense least squares."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from stickslip.estimation.energy.known_inertia.free_friction import HeldAxis, SensorData
from stickslip.estimation.energy.levels import AxisModel
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.simulation import simulate

INTEGRATED = 1e-8  # relative: an integrator asked for 1e-12 a step, on states of mixed size
EXACT = 1e-10  # relative: rounding over a hundred samples of two exact ways
DENSE = 1e-7  # relative: least squares by a dense covariance, conditioned to 1e8

LOAD = {"load_inertia": 0.7, "stiffness": 300.0}
RIGID: dict[str, Any] = {"load_inertia": None, "stiffness": None}


@given(inertia=st.floats(1e-3, 1e3), sampling_time=st.floats(1e-5, 1.0))
def test_a_rigid_axis_in_closed_form(inertia: float, sampling_time: float) -> None:
    m, T = inertia, sampling_time
    axis = HeldAxis.of(AxisModel(inertia=m), T)
    np.testing.assert_allclose(axis.transition, [[1.0, T], [0.0, 1.0]], rtol=EXACT)
    np.testing.assert_allclose(axis.held, [0.5 * T**2 / m, T / m], rtol=EXACT)
    # A slope about the middle of the sample leaves the velocity, and moves the position back
    np.testing.assert_allclose(axis.ramped[0], -(T**3) / (12.0 * m), rtol=EXACT)
    assert abs(axis.ramped[1]) < EXACT * T**2 / m


@pytest.mark.parametrize("load", [RIGID, LOAD])
@pytest.mark.parametrize("sampling_time", [1e-3, 0.02, 0.2])
@pytest.mark.parametrize(("held", "slope"), [(1.0, 0.0), (0.0, 50.0), (-3.0, 20.0)])
def test_the_axis_solves_its_differential_equation(
    load: dict[str, Any], sampling_time: float, held: float, slope: float
) -> None:
    m, T = 2.0, sampling_time
    axis = HeldAxis.of(AxisModel(inertia=m, **load), T)
    first = np.array([0.3, -0.2, 0.1, 0.4])[: axis.held.size]

    def rates(t: float, z: np.ndarray) -> list[float]:
        force = held + slope * (t - 0.5 * T)
        if z.size == 2:
            return [z[1], force / m]
        spring = load["stiffness"] * (z[0] - z[2])
        return [z[1], (force - spring) / m, z[3], spring / load["load_inertia"]]

    solved = solve_ivp(rates, (0.0, T), first, method="DOP853", rtol=1e-12, atol=1e-14)
    found = axis.transition @ first + axis.held * held + axis.ramped * slope
    np.testing.assert_allclose(found, solved.y[:, -1], rtol=INTEGRATED, atol=1e-10)


@pytest.mark.parametrize("flexible", [False, True])
def test_the_axis_moves_as_the_simulator_without_friction(flexible: bool) -> None:
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
    arm = FlexibleArm(mass_1=2.0, mass_2=0.7, stiffness=300.0, friction=law)
    plant = arm if flexible else SingleMass(mass=2.0, friction=law)
    effort = np.random.default_rng(0).normal(size=100)
    motion = simulate(plant, effort, sampling_time=0.01)
    axis = HeldAxis.of(AxisModel(inertia=2.0, **(LOAD if flexible else RIGID)), 0.01)
    truth = [motion.position, motion.velocity]
    if motion.load_position is not None and motion.load_velocity is not None:
        truth += [motion.load_position, motion.load_velocity]
    z = np.zeros(axis.held.size)
    for k, u in enumerate(effort):
        z = axis.transition @ z + axis.held * u
        np.testing.assert_allclose(z, [row[k + 1] for row in truth], rtol=EXACT, atol=EXACT)


@pytest.mark.parametrize("load", [RIGID, LOAD])
def test_a_white_force_is_as_rough_within_a_sample_as_over_samples(load: dict[str, Any]) -> None:
    """Mean and slope of white noise make the covariance that Van Loan's integral gives."""
    T, m = 0.002, 2.0
    axis = HeldAxis.of(AxisModel(inertia=m, **load), T)
    s = axis.held.size
    rate = np.zeros((s, s))
    rate[0, 1] = 1.0
    if s == 4:
        k, m2 = load["stiffness"], load["load_inertia"]
        rate[1, 0], rate[1, 2], rate[2, 3] = -k / m, k / m, 1.0
        rate[3, 0], rate[3, 2] = k / m2, -k / m2
    push = np.zeros(s)
    push[1] = 1.0 / m
    block = np.block([[-rate, np.outer(push, push)], [np.zeros((s, s)), rate.T]])
    over = scipy.linalg.expm(block * T)
    expected = T * over[s:, s:].T @ over[:s, s:]  # the mean over a sample has unit variance
    found = np.outer(axis.held, axis.held) + 12.0 / T**2 * np.outer(axis.ramped, axis.ramped)
    # A rigid mass sees no more of the force than these two; a spring turns by (omega T)^2 = 2e-3,
    # and what gets through to the load within a sample is too little to matter
    tolerance = EXACT if s == 2 else 2e-3
    np.testing.assert_allclose(found[:2, :2], expected[:2, :2], rtol=tolerance)


CHANNELS = {
    "position": (RIGID, [(0, 1e-6)]),
    "position and velocity": (RIGID, [(0, 1e-6), (1, 1e-3)]),
    "both masses": (LOAD, [(0, 1e-6), (1, 1e-3), (2, 4e-6), (3, 2e-3)]),
    "positions of both": (LOAD, [(0, 1e-6), (2, 4e-6)]),
    "no velocity of the load": (LOAD, [(0, 1e-6), (1, 1e-3), (2, 4e-6)]),
}
"""Measured states and their variances."""


@dataclass(frozen=True, kw_only=True)
class Problem:
    """Random forces on an axis, and sensors whose first values say where it begins."""

    axis: HeldAxis
    channels: np.ndarray
    first: np.ndarray
    effort: np.ndarray
    friction: np.ndarray
    slope: np.ndarray
    disturbance: np.ndarray
    measured: np.ndarray

    T = 0.02
    PARAMETERS = np.array([1.3, -0.7, 0.4])

    @classmethod
    def of(
        cls, load: dict[str, Any], channels: list[tuple[int, float]], size: float, *, noisy: bool
    ) -> "Problem":
        n, generator = 30, np.random.default_rng(3)
        axis = HeldAxis.of(AxisModel(inertia=2.0, **load), cls.T)
        states = axis.held.size
        friction = generator.normal(size=(n, 3))
        slope = 20.0 * generator.normal(size=(n, 3))
        effort = generator.normal(size=n)
        disturbance = size * generator.uniform(0.5, 2.0, size=n)
        places = [place for place, _ in channels]
        z = np.where(np.isin(np.arange(states), places), 0.1, 0.0)
        rows = []
        for k in range(n):
            rows.append(z[places])
            force = effort[k] - friction[k] @ cls.PARAMETERS
            z = axis.transition @ z + axis.held * force - axis.ramped * (slope[k] @ cls.PARAMETERS)
        measured = np.array(rows)
        if noisy:
            measured += np.sqrt([v for _, v in channels]) * generator.normal(size=measured.shape)
        first = np.full(states, 0.05)
        first[places] = [variance for _, variance in channels]
        return cls(
            axis=axis,
            channels=np.array(channels, dtype=float),
            first=first,
            effort=effort,
            friction=friction,
            slope=slope,
            disturbance=disturbance,
            measured=measured,
        )

    def whitened(self) -> tuple[np.ndarray, float]:
        sensors = SensorData(measured=self.measured, channels=self.channels, first=self.first)
        return self.axis.whiten(sensors, self.effort, self.friction, self.slope, self.disturbance)

    def dense(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return what is left of the measurements, regressors, and the covariance of the former."""
        A, B, C = self.axis.transition, self.axis.held, self.axis.ramped
        n, states = self.effort.size, B.size
        places = self.channels[:, 0].astype(int)
        known = np.zeros(states)
        known[places] = self.measured[0]
        responses = np.zeros((states, 3))
        # Each shock to the state, and what of it is left in each later state
        left: list[np.ndarray] = [np.diag(np.sqrt(self.first))]
        targets, regressors, shocks = [], [], []
        for k in range(n - 1):
            known = A @ known + B * self.effort[k]
            responses = A @ responses - np.outer(B, self.friction[k]) - np.outer(C, self.slope[k])
            root = np.sqrt(self.disturbance[k])
            left = [A @ shock for shock in left]
            left.append(root * np.column_stack([B, np.sqrt(12.0) / self.T * C]))
            targets.append(self.measured[k + 1] - known[places])
            regressors.append(responses[places])
            row = np.zeros((places.size, states + 2 * (n - 1)))
            row[:, : states + 2 * (k + 1)] = np.hstack(left)[places]
            shocks.append(row)
        spread = np.vstack(shocks)
        noise = np.tile(self.channels[:, 1], n - 1)
        return (
            np.concatenate(targets),
            np.vstack(regressors),
            spread @ spread.T + np.diag(noise),
        )


@pytest.mark.parametrize("sensors", CHANNELS)
@pytest.mark.parametrize("disturbance", [1e-8, 1e-2, 10.0])
def test_least_squares_of_the_rows_is_generalised_least_squares(
    sensors: str, disturbance: float
) -> None:
    problem = Problem.of(*CHANNELS[sensors], disturbance, noisy=True)
    rows, logs = problem.whitened()
    target, regressors, covariance = problem.dense()
    weighted = np.linalg.solve(covariance, np.column_stack([target, regressors]))
    information = regressors.T @ weighted[:, 1:]
    values = np.linalg.solve(information, regressors.T @ weighted[:, 0])
    found, residual, *_ = np.linalg.lstsq(rows[:, 1:], rows[:, 0], rcond=None)
    np.testing.assert_allclose(found, values, rtol=DENSE)
    np.testing.assert_allclose(rows[:, 1:].T @ rows[:, 1:], information, rtol=DENSE)
    left = target - regressors @ values
    assert float(residual[0]) == pytest.approx(left @ np.linalg.solve(covariance, left), rel=DENSE)
    assert logs == pytest.approx(np.linalg.slogdet(covariance)[1], rel=DENSE)


@pytest.mark.parametrize("sensors", CHANNELS)
def test_without_noise_the_rows_give_the_parameters(sensors: str) -> None:
    """Whatever noise is given: of states that are not measured it must be known at 0."""
    problem = Problem.of(*CHANNELS[sensors], 1e-4, noisy=False)
    rows, _ = problem.whitened()
    np.testing.assert_allclose(
        rows[:, 1:] @ problem.PARAMETERS, rows[:, 0], atol=EXACT * np.max(np.abs(rows))
    )


@pytest.mark.parametrize("sensors", CHANNELS)
def test_the_rows_of_noise_are_white(sensors: str) -> None:
    """The map from measurements to rows takes their dense covariance to the identity."""
    problem = Problem.of(*CHANNELS[sensors], 1e-2, noisy=True)
    _, _, covariance = problem.dense()
    size = covariance.shape[0]
    still = Problem(**{**vars(problem), "effort": np.zeros(30)})
    channels = problem.channels.shape[0]
    mapped = np.empty((size, size))
    for k in range(size):
        one = np.zeros((30, channels))
        one[1 + k // channels, k % channels] = 1.0
        rows, _ = Problem(**{**vars(still), "measured": one}).whitened()
        mapped[:, k] = rows[:, 0]
    np.testing.assert_allclose(mapped @ covariance @ mapped.T, np.eye(size), atol=DENSE)
