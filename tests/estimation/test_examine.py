"""Data of a report, against the truth of a simulated axis."""

from dataclasses import replace

import numpy as np
import pytest

from stickslip.estimation import (
    EnergyEstimator,
    Estimator,
    IdimLeastSquares,
    MaximumLikelihoodEstimator,
    PublishedEnergyEstimator,
    SelectedModelEstimator,
    examine,
)
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import Identification
from stickslip.simulation import Sensors, simulate

LAW = CoulombViscousFriction.symmetric(coulomb_friction=2.0, viscous_friction=5.0, offset=0.5)
SHARE = 0.15  # relative: rests are left out, and the fit takes a part of any signal
TRUTH = {"mass": 3.0, "viscous_friction": 5.0, "coulomb_friction": 2.0, "offset": 0.5}


@pytest.fixture(scope="module", params=["energy", "idim-ls"])
def stage(request: pytest.FixtureRequest) -> Identification:
    time = np.arange(10_000) * 0.001
    effort = 30 * np.sin(2 * time) + 15 * np.sin(5 * time)
    motion = simulate(SingleMass(mass=3.0, friction=LAW), effort, sampling_time=0.001)
    sensors = Sensors(position_noise=1e-6, velocity="none")
    log = sensors.measure(motion, np.random.default_rng(1))
    estimator = EnergyEstimator() if request.param == "energy" else IdimLeastSquares()
    return examine(log, estimator, truth=TRUTH)


def test_the_truth_is_passed_on(stage: Identification) -> None:
    assert stage.truth == TRUTH
    for name, value in TRUTH.items():
        # IDIM takes the effort of a sample for that at its beginning, half a sample early
        tolerance = 0.005 if stage.estimate.estimator == "energy" else 0.03
        assert stage.estimate.value(name) == pytest.approx(value, rel=tolerance)


def test_the_curve_goes_through_its_cloud(stage: Identification) -> None:
    curve = stage.curve
    assert curve is not None
    assert 100 < curve.velocity.size <= 4000
    moving = np.abs(curve.velocity) > 0.1
    law = 0.5 + LAW.friction(curve.velocity[moving])
    # The cloud carries the noise of the acceleration; its middle does not
    assert abs(np.median(curve.friction[moving] - law)) < 0.05
    inside = np.isfinite(curve.fitted_velocity)
    assert np.count_nonzero(~inside) == 1
    assert np.all(curve.band_low[inside] < curve.fitted_friction[inside])
    assert np.all(curve.band_high[inside] > curve.fitted_friction[inside])
    order = np.diff(curve.fitted_velocity[inside])
    assert np.all(order >= 0)


@pytest.mark.slow
def test_static_friction_of_a_rigid_axis_is_kept() -> None:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=2.0, viscous_friction=5.0, static_friction=3.0
    )
    effort = 6.0 * np.sin(np.arange(2000) * 0.02)
    motion = simulate(SingleMass(mass=3.0, friction=law), effort, sampling_time=0.005)
    log = Sensors(encoder_step=1e-5, velocity="none").measure(motion)
    estimator = MaximumLikelihoodEstimator(static_friction=True)
    found = examine(log, estimator)
    assert found.estimate.to_dict() == estimator.fit(log).to_dict()
    assert found.estimate.value("static_friction") == pytest.approx(3.0, rel=0.05)
    assert found.resimulation is not None
    assert found.resimulation.fit > 0.99


def test_the_energies_balance(stage: Identification) -> None:
    energy = stage.energy
    assert energy is not None
    stored = energy.kinetic + energy.potential
    np.testing.assert_allclose(energy.input - stored, energy.measured_dissipation, atol=1e-9)
    most = energy.explained_dissipation[-1]
    gap = np.abs(energy.measured_dissipation - energy.explained_dissipation)
    assert np.max(gap) < 0.02 * most


def test_the_evolution_ends_at_the_estimate(stage: Identification) -> None:
    evolution = stage.evolution
    assert evolution is not None
    assert np.all(np.diff(evolution.time) > 0)
    for name, parameter in stage.estimate.parameters.items():
        assert evolution.values[name][-1] == pytest.approx(parameter.value, rel=1e-6)
        assert evolution.stds[name][-1] == pytest.approx(parameter.std, rel=0.01)


def test_the_residuals_start_at_one(stage: Identification) -> None:
    residuals = stage.residuals
    assert residuals is not None
    assert residuals.share < 0.05
    assert residuals.autocorrelation[0] == pytest.approx(1.0)
    assert residuals.lag.size == residuals.autocorrelation.size
    assert residuals.lag[0] == 0.0


@pytest.mark.parametrize(
    "estimator",
    [EnergyEstimator(), IdimLeastSquares(), SelectedModelEstimator(select=False)],
    ids=lambda each: each.name,
)
def test_the_share_is_that_of_an_effort_which_the_axis_does_not_feel(estimator: Estimator) -> None:
    """A logged effort of another frequency, orthogonal to all that moves, is all unexplained."""
    time = np.arange(10_000) * 0.001
    effort = 30 * np.sin(2 * time) + 15 * np.sin(5 * time)
    motion = simulate(SingleMass(mass=3.0, friction=LAW), effort, sampling_time=0.001)
    log = Sensors(position_noise=1e-7, velocity="none").measure(motion, np.random.default_rng(1))
    log = log.part(0, 10_000)
    added = 2.0 * np.sin(13.0 * time)
    residuals = examine(replace(log, effort=log.effort + added), estimator).residuals
    assert residuals is not None
    expected = np.linalg.norm(added) / np.linalg.norm(log.effort + added)
    assert residuals.share == pytest.approx(expected, rel=SHARE)


def test_the_model_moves_as_the_axis_does(stage: Identification) -> None:
    again = stage.resimulation
    assert again is not None
    assert again.fit > 0.99
    assert again.horizon == pytest.approx(0.5)


def test_an_arm_is_examined_too() -> None:
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    time = np.arange(3000) * 0.01
    effort = np.where(time < 5, 1.0, np.where(time < 10, -1.0, 0.0))
    motion = simulate(arm, effort, sampling_time=0.01)
    log = Sensors(position_noise=0.005, velocity_noise=0.05).measure(
        motion, np.random.default_rng(2)
    )
    found = examine(log, EnergyEstimator(inertia=1.0, load_inertia=1.0, stiffness=1.0))
    assert found.energy is not None
    assert found.resimulation is not None
    assert found.curve is not None
    assert np.max(found.energy.potential) > 0.1
    assert found.resimulation.fit > 0.97
    assert found.energy.measured_dissipation[-1] == pytest.approx(
        found.energy.explained_dissipation[-1], rel=0.02
    )


@pytest.mark.parametrize("samples", [2000, 2001, 2002])
def test_rows_of_any_number_are_put_together(samples: int) -> None:
    """Van de Wijdeven's recursion has rows of its first guesses beside those of the samples."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    effort = np.sign(np.sin(0.01 * np.arange(samples)))
    log = Sensors().measure(simulate(arm, effort, sampling_time=0.01))
    estimator = PublishedEnergyEstimator(inertia=1.0, load_inertia=1.0, stiffness=1.0)
    residuals = examine(log, estimator).residuals
    assert residuals is not None
    assert residuals.residual.size == residuals.time.size
    assert np.all(np.diff(residuals.lag) > 0)
