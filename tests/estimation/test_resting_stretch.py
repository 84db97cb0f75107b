"""Logs with gaps whose longest stretch without a gap is one at rest."""

import numpy as np
import pytest
from axis_logs import axis_log

from stickslip.estimation import (
    EnergyEstimator,
    ExtendedKalmanFilter,
    FriedlandParkObserver,
    GradientEstimator,
    IdimInstrumentalVariables,
    IdimLeastSquares,
    LeastSquaresObserver,
    LiaoChienObserver,
    MaximumLikelihoodEstimator,
    PublishedEnergyEstimator,
    StribeckEstimator,
    YazdizadehKhorasaniObserver,
    examine,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, InputError
from stickslip.simulation import Sensors, simulate

MASS, COULOMB, VISCOUS = 1.5, 2.0, 3.0
AXIS = SingleMass(
    mass=MASS,
    friction=CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS),
)
T = 0.005
GAP = 1.0  # s

CLOSE = 0.05
"""Relative error of Coulomb friction; the logs hold no noise but that of an encoder."""

SENSORS = {
    "encoder": Sensors(encoder_step=1e-4, velocity="none"),
    "encoder and velocity": Sensors(encoder_step=1e-4),
    "noisy velocity": Sensors(velocity_noise=1e-3),
    "noisy position": Sensors(position_noise=1e-5, velocity="none"),
}
ESTIMATORS = {
    "energy": EnergyEstimator(),
    "energy, mass known": EnergyEstimator(inertia=MASS),
    "stribeck": StribeckEstimator(method=EnergyEstimator()),
    "maximum likelihood": MaximumLikelihoodEstimator(),
    "idim-ls": IdimLeastSquares(),
    "idim-iv": IdimInstrumentalVariables(),
    "ekf": ExtendedKalmanFilter(inertia=MASS),
    "rls": LeastSquaresObserver(inertia=MASS),
    "published": PublishedEnergyEstimator(inertia=MASS, sums="settled"),
    "gradient": GradientEstimator(inertia=MASS),
    "friedland-park": FriedlandParkObserver(inertia=MASS, viscous=True),
    "yazdizadeh-khorasani": YazdizadehKhorasaniObserver(inertia=MASS, viscous=True),
    "liao-chien": LiaoChienObserver(inertia=MASS, viscous=True),
}
UNSETTLED = ("gradient", "friedland-park", "yazdizadeh-khorasani", "liao-chien")
"""Observers that have not settled at the end of so short a log."""


def gapped_log(sensors: Sensors, *, moving: int, resting: int) -> AxisLog:
    """Return a move, a gap, a rest, a gap, and another move."""
    generator = np.random.default_rng(1)
    time = np.arange(moving) * T
    effort = 9.0 * np.sin(3.0 * time) + 2.0 * np.sin(11.0 * time)
    position, start = 0.0, 0.0
    parts: list[AxisLog] = []
    begins: list[float] = []
    for part in (effort, np.zeros(resting), effort):
        motion = simulate(AXIS, part, sampling_time=T, initial_state=(position, 0.0))
        parts.append(sensors.measure(motion, generator))
        begins.append(start)
        position = float(motion.position[-1])
        start += float(parts[-1].time[-1]) + GAP
    velocities = [part.measured_velocity for part in parts if part.measured_velocity is not None]
    return axis_log(
        np.concatenate([part.time + at for part, at in zip(parts, begins, strict=True)]),
        np.concatenate([part.effort for part in parts]),
        np.concatenate([part.measured_position for part in parts]),
        np.concatenate(velocities) if velocities else None,
    )


@pytest.mark.parametrize("sensors", list(SENSORS))
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow)
        if name in {"stribeck", "maximum likelihood"}
        else name
        for name in ESTIMATORS
    ],
)
def test_moves_beside_a_longer_rest_are_used(name: str, sensors: str) -> None:
    log = gapped_log(SENSORS[sensors], moving=700, resting=1400)
    estimate = ESTIMATORS[name].fit(log)
    if name not in UNSETTLED:
        assert estimate.value("coulomb_friction") == pytest.approx(COULOMB, rel=CLOSE)


@pytest.mark.parametrize("sensors", list(SENSORS))
@pytest.mark.parametrize(
    "name",
    [
        "energy",
        pytest.param("stribeck", marks=pytest.mark.slow),
        "idim-ls",
        pytest.param("maximum likelihood", marks=pytest.mark.slow),
    ],
)
def test_a_log_whose_moves_are_too_short_is_refused_or_fitted(name: str, sensors: str) -> None:
    log = gapped_log(SENSORS[sensors], moving=100, resting=1400)
    code, found = "", None
    try:
        found = examine(log, ESTIMATORS[name]).estimate  # pyright: ignore[reportArgumentType]
    except InputError as error:
        code = error.code
    if found is None or not found.status.trusted:
        assert code in {"", "no_motion_in_stretches", "no_effort_in_stretches"}
    else:
        assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=CLOSE)
