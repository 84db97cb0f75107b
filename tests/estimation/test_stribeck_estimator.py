"""Static friction and Stribeck velocity from simulated logs."""

import functools
import itertools

import numpy as np
import pytest
from benchmark_logs import emps
from numpy.random import default_rng
from refusals import refuses

from stickslip.estimation import (
    EnergyEstimator,
    IdimLeastSquares,
    RecursiveLeastSquares,
    StribeckEstimator,
)
from stickslip.estimation.examine import examine
from stickslip.friction import (
    CoulombViscousFriction,
    FrictionLaw,
    FrictionTerms,
    LuGreFriction,
    StribeckEffect,
    StribeckFriction,
)
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, FrictionEstimate, Status
from stickslip.simulation import Sensors, simulate

T = 1e-3
TRUTH = {
    "mass": 1.0,
    "viscous_friction": 2.0,
    "coulomb_friction": 1.0,
    "static_friction": 1.6,
    "offset": 0.1,
    "stribeck_velocity": 0.05,
}
EFFECT = StribeckEffect(velocity=0.05)
NOISY = Sensors(position_noise=2e-5, velocity_noise=2e-3)
ENCODER = Sensors(position_noise=1e-6, encoder_step=1e-6, velocity="none")
WITHOUT_NOISE = 1e-3  # relative: what sums over samples leave in the passage of 0.05 m/s
IN_NOISE = 0.03
WIDE = 4.0  # standard deviations: the seeds are fixed, and this is not met by 1 in 10 000


def law_of(shape: str = "gaussian") -> StribeckFriction:
    values = {name: value for name, value in TRUTH.items() if name != "mass"}
    return StribeckFriction.symmetric(**values, shape=shape)


@functools.cache
def log_of(law: FrictionLaw, sensors: Sensors, seconds: float = 8.0) -> AxisLog:
    time = np.arange(round(seconds / T)) * T
    effort = 2.2 * np.sin(np.pi * time) + 1.2 * np.sin(3.4 * np.pi * time + 1.0)
    motion = simulate(SingleMass(mass=1.0, friction=law), effort, sampling_time=T)
    return sensors.measure(motion, generator=default_rng(1))


def assert_found(estimate: FrictionEstimate, tolerance: float) -> None:
    assert estimate.status is Status.OK
    for name, parameter in estimate.parameters.items():
        truth = TRUTH[name]
        assert parameter.value == pytest.approx(truth, rel=tolerance, abs=0.1 * tolerance), name
        assert abs(parameter.value - truth) <= WIDE * parameter.std


def reasons_of(estimate: FrictionEstimate) -> dict[str, str]:
    return {each.parameter: each.reason for each in estimate.diagnostics.verdicts}


METHODS = {"known inertia": EnergyEstimator(inertia=1.0), "inertia sought": EnergyEstimator()}


@pytest.mark.parametrize("method", METHODS)
def test_known_stribeck_velocity(method):
    known = {"inertia": METHODS[method].inertia, "stribeck": EFFECT}
    assert_found(EnergyEstimator(**known).fit(log_of(law_of(), Sensors())), WITHOUT_NOISE)
    assert_found(EnergyEstimator(**known).fit(log_of(law_of(), NOISY)), IN_NOISE)


@pytest.mark.parametrize("estimator", [EnergyEstimator, IdimLeastSquares])
def test_a_fit_with_several_effects_is_refused(estimator):
    effects = (EFFECT, StribeckEffect(velocity=0.1))
    with refuses("several_stribeck_effects", method=estimator.name):
        estimator(stribeck=effects).fit(log_of(law_of(), Sensors()))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("method", "sensors", "tolerance"),
    [
        *itertools.product(METHODS, (NOISY, ENCODER), (IN_NOISE,)),
        ("inertia sought", Sensors(), WITHOUT_NOISE),
    ],
)
def test_stribeck_velocity_sought(method, sensors, tolerance):
    estimate = StribeckEstimator(method=METHODS[method]).fit(log_of(law_of(), sensors))
    assert_found(estimate, tolerance)
    assert "stribeck_velocity" in estimate.parameters
    assert estimate.estimator == "stribeck-energy"


@pytest.mark.slow
def test_exponential_shape_and_a_given_range():
    law = law_of("exponential")
    estimator = StribeckEstimator(
        method=METHODS["inertia sought"], shape="exponential", velocities=(0.01, 0.2)
    )
    assert_found(estimator.fit(log_of(law, Sensors())), IN_NOISE)


@pytest.mark.slow
def test_each_direction_has_frictions_of_its_own():
    estimator = StribeckEstimator(method=EnergyEstimator(inertia=1.0, per_direction=True))
    estimate = estimator.fit(log_of(law_of(), NOISY))
    assert estimate.status is Status.OK
    # The offset is the same as unlike frictions
    for side, more in (("positive", 0.1), ("negative", -0.1)):
        for name in ("coulomb_friction", "static_friction"):
            found = estimate.value(f"{name}_{side}")
            assert found == pytest.approx(TRUTH[name] + more, rel=IN_NOISE)


def test_inverse_dynamics_find_it_too():
    estimate = StribeckEstimator(method=IdimLeastSquares()).fit(log_of(law_of(), ENCODER))
    assert estimate.estimator == "stribeck-idim-ls"
    assert estimate.value("static_friction") == pytest.approx(1.6, rel=0.03)
    assert estimate.value("stribeck_velocity") == pytest.approx(0.05, rel=0.06)


@pytest.mark.slow
@pytest.mark.parametrize("method", [EnergyEstimator(inertia=1.0), IdimLeastSquares()])
def test_without_a_step_none_is_found(method):
    law = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=2.0)
    estimate = StribeckEstimator(method=method).fit(log_of(law, NOISY))
    plain = method.fit(log_of(law, NOISY))
    assert estimate.status is Status.NOT_IDENTIFIABLE
    for name in ("static_friction", "stribeck_velocity"):
        assert not estimate.parameters[name].identified
        assert "no step from static" in reasons_of(estimate)[name]
    assert estimate.value("coulomb_friction") == plain.value("coulomb_friction")
    assert reasons_of(estimate)["coulomb_friction"] == "the motion determines it"
    assert any("leave --stribeck out" in note for note in estimate.diagnostics.notes)


@pytest.mark.slow
def test_emps_shows_no_static_friction_but_one_that_rises(benchmark_data):
    estimator = StribeckEstimator(method=EnergyEstimator(per_direction=True))
    estimate = estimator.fit(emps(benchmark_data))
    assert not estimate.parameters["stribeck_velocity"].identified
    assert reasons_of(estimate)["stribeck_velocity"].startswith("friction rises by")


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(("sensors", "tolerance"), [(Sensors(), 2e-3), (NOISY, 0.05)])
def test_on_line(method, sensors, tolerance):
    estimator = EnergyEstimator(inertia=METHODS[method].inertia, stribeck=EFFECT)
    log = log_of(law_of(), sensors)
    state, history = estimator.run(estimator.init(sampling_time=T), log)
    names = estimator.parameter_names("linear")
    assert names[-2:] == ("static_friction", "offset")
    truth = [TRUTH[name] for name in names]
    np.testing.assert_allclose(history[-1], truth, rtol=tolerance, atol=0.1 * tolerance)
    assert np.all(np.diag(estimator.covariance(state)) > 0)
    assert state[estimator.values_at].tolist() == [
        history[-1][names.index("coulomb_friction")],
        history[-1][names.index("viscous_friction")],
    ]


def test_recursive_least_squares_find_the_stribeck_velocity_from_a_guess():
    # The law linearised in all its parameters: the last column belongs to (f_s - f_c) (v_s - guess)
    law, guess = law_of(), StribeckEffect(velocity=0.045)
    terms = FrictionTerms.asked(per_direction=False, offset=True, stribeck=guess)
    velocity = default_rng(2).normal(0.0, 0.1, 2000)
    rows = terms.force_columns(velocity, np.sign(velocity))
    rows = np.column_stack([rows, np.sign(velocity) * guess.slope(velocity)])
    rls = RecursiveLeastSquares()
    state = rls.init(initial_values=[0.0] * 5, initial_variance=1e8)
    _, history = rls.run(state, rows, law.friction(velocity) + law.offset)
    _, coulomb, static, _, change = history[-1]
    found = guess.velocity + change / (static - coulomb)
    assert found == pytest.approx(0.05, rel=0.01)  # of a guess 10 % off: the square is left


@pytest.mark.slow
def test_bristles_show_the_friction_of_sliding():
    bristles = LuGreFriction(sliding=law_of(), bristle_stiffness=1e5, bristle_damping=300.0)
    estimate = StribeckEstimator(method=METHODS["inertia sought"]).fit(log_of(bristles, NOISY))
    for name, parameter in estimate.parameters.items():
        assert parameter.value == pytest.approx(TRUTH[name], rel=0.05), name


@pytest.mark.slow
def test_the_rows_hold_the_stribeck_velocity_itself():
    log = log_of(law_of(), NOISY)
    estimator = StribeckEstimator(method=EnergyEstimator(inertia=1.0, per_direction=True))
    rows, estimate = estimator.regression(log), estimator.fit(log)
    values = {name: p.value for name, p in estimate.parameters.items() if p.value is not None}
    assert set(rows.names) == set(values)
    assert values["stribeck_velocity"] == pytest.approx(0.05, rel=IN_NOISE)
    left = rows.relative_residual(values)
    assert left == pytest.approx(estimate.diagnostics.relative_residual, rel=1e-9)
    # No other velocity leaves less
    assert all(
        rows.relative_residual(values | {"stribeck_velocity": other}) > left
        for other in (0.045, 0.055)
    )


@pytest.mark.slow
@pytest.mark.parametrize("method", [EnergyEstimator(inertia=1.0), IdimLeastSquares()])
@pytest.mark.parametrize("there", [True, False])
def test_a_report_of_what_was_sought_draws_what_there_is(method, there):
    plain = CoulombViscousFriction.symmetric(coulomb_friction=1.0, viscous_friction=2.0)
    law = law_of() if there else plain
    log = log_of(law, NOISY)
    found = examine(log, StribeckEstimator(method=method))
    estimate = found.estimate
    assert estimate.parameters["stribeck_velocity"].identified is there
    assert found.curve is not None
    assert found.evolution is not None
    assert ("stribeck_velocity" in found.evolution.values) is there
    assert found.residuals is not None
    assert found.resimulation is not None
    grid = found.curve.fitted_velocity
    seen = np.isfinite(grid) & (np.abs(grid) > 0.02)  # where motion sets in noise has its way
    truth = law.friction(grid[seen]) + law.offset
    assert np.max(np.abs(found.curve.fitted_friction[seen] - truth)) < IN_NOISE


def test_a_report_draws_the_stribeck_curve():
    log = log_of(law_of(), Sensors())
    found = examine(log, EnergyEstimator(inertia=1.0, stribeck=EFFECT))
    assert found.curve is not None
    at = int(
        np.nanargmin(np.where(found.curve.fitted_velocity > 0, found.curve.fitted_velocity, 9))
    )
    assert found.curve.fitted_friction[at] == pytest.approx(1.7, rel=0.01)  # with the offset
    assert found.resimulation is not None


@pytest.mark.parametrize("inertia", [None, 1.0])
@pytest.mark.parametrize("several", [False, True])
def test_no_room_on_line(inertia, several):
    stribeck = (EFFECT, StribeckEffect(velocity=0.1)) if several else EFFECT
    estimator = EnergyEstimator(inertia=inertia, per_direction=not several, stribeck=stribeck)
    with refuses("stribeck_effects_on_line"):
        estimator.init(sampling_time=T)
