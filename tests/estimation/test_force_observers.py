"""Observers of the friction force: their own equations, Lyapunov functions, biases and limits."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from estimates import assert_covers
from refusals import refuses
from scipy import integrate
from simulated_logs import logged_early, measured, samples_of, table_of
from slow_cases import quick_where

from stickslip.control import (
    PD,
    FeedbackController,
    FrictionCompensation,
    Move,
    OnlineFriction,
    PointToPoint,
)
from stickslip.estimation import (
    FriedlandParkObserver,
    GradientEstimator,
    LeastSquaresObserver,
    LiaoChienObserver,
    PublishedEnergyEstimator,
    YazdizadehKhorasaniObserver,
)
from stickslip.estimation.online.observers.adaptive_observers import AdaptiveObserver
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import AxisLog, Status
from stickslip.simulation import Sensors, SimulatedMotion, simulate, simulate_closed_loop

T = 0.001
MASS = 1.3
COULOMB, VISCOUS = 0.8, 0.6
OBSERVERS = (
    FriedlandParkObserver,
    YazdizadehKhorasaniObserver,
    LiaoChienObserver,
    GradientEstimator,
)
EXACT = 1e-9  # relative: rounding in 10 000 steps
HELD = 2e-3  # relative: the differential equation and its steps of 1 ms differ by terms of T
MEAN_SPEED = 1e-7  # (c T / m)^2 / 12, by which the mean of two velocities is not that of a sample
DELAY_LEFT = 0.1  # error with a removed delay over that with the same delay not removed


def law(viscous: float) -> CoulombViscousFriction:
    return CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=viscous)


def motion(
    effort: Callable[[np.ndarray], np.ndarray], viscous: float, duration: float = 10.0
) -> SimulatedMotion:
    time = np.arange(0.0, duration, T)
    plant = SingleMass(mass=MASS, friction=law(viscous))
    return simulate(plant, effort(time), sampling_time=T)


def swings(time: np.ndarray) -> np.ndarray:
    return 3.0 * np.sin(2.0 * time) + 2.0 * np.sin(5.1 * time)


def onward(time: np.ndarray) -> np.ndarray:
    return 3.0 + 1.0 * np.sin(2.0 * time)


@pytest.fixture(scope="module")
def coulomb_log() -> AxisLog:
    return Sensors().measure(motion(swings, 0.0))


@pytest.fixture(scope="module")
def viscous_log() -> AxisLog:
    return Sensors().measure(motion(swings, VISCOUS, 40.0))


def ends(observer: AdaptiveObserver | LeastSquaresObserver, log: AxisLog) -> np.ndarray:
    _, history = observer.run(observer.init(sampling_time=log.sampling_time), log)
    return history


def test_the_error_decays_as_published(coulomb_log: AxisLog) -> None:
    v = table_of(coulomb_log)[:, 2]
    a, b = np.abs(v[:-1]), np.abs(v[1:])
    moving = v[:-1] * v[1:] > 0
    rate, speed = 2.0, 0.4

    def parks(exponent: float) -> FriedlandParkObserver:
        return FriedlandParkObserver(inertia=MASS, rate=rate, speed=speed, exponent=exponent)

    lyapunov = YazdizadehKhorasaniObserver(inertia=MASS, rate=rate, speed=speed)
    slopes: list[tuple[AdaptiveObserver, Callable[[np.ndarray], np.ndarray]]] = [
        (parks(1.0), np.ones_like),
        (parks(1.7), lambda w: 1.7 * (w / speed) ** 0.7),
        (parks(2.0), lambda w: 2.0 * w / speed),
        (lyapunov, lambda w: 1.0 / (1.0 + w / speed)),
    ]
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for observer, slope in slopes:
        error = COULOMB - ends(observer, coulomb_log)[1:, 0]
        along = [slope(0.5 * (a + b) + 0.5 * (b - a) * node) for node in nodes]
        mean = 0.5 * sum(w * part for w, part in zip(weights, along, strict=True))
        exponent = np.cumsum(np.where(moving, rate * T * mean, 0.0))
        np.testing.assert_allclose(error, COULOMB * np.exp(-exponent), rtol=1e-6, atol=EXACT)


@pytest.mark.parametrize("viscous", [0.0, VISCOUS])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_friedland_and_parks_own_equation(viscous: float, exponent: float) -> None:
    """a^ = z - g(|v|), z' = g'(|v|) (w - a^ sign v) sign v, integrated beside the motion."""
    rate, speed = 2.0, 1.0
    log = Sensors().measure(motion(onward, viscous, 5.0))

    def slope(v: float) -> float:
        return rate * exponent * (v / speed) ** (exponent - 1.0)

    def derivative(t: float, y: np.ndarray) -> list[float]:
        v, z = y
        a = z - rate * speed * (v / speed) ** exponent
        force = float(onward(np.array(t)))
        w = force / MASS
        return [w - (COULOMB + viscous * v) / MASS, slope(v) * (w - a)]

    solved = integrate.solve_ivp(derivative, (0.0, 5.0), [1e-9, 0.0], rtol=1e-9, max_step=0.01)
    v, z = solved.y[:, -1]
    expected = MASS * (z - rate * speed * (v / speed) ** exponent)
    observer = FriedlandParkObserver(inertia=MASS, rate=rate, speed=speed, exponent=exponent)
    assert ends(observer, log)[-1, 0] == pytest.approx(expected, rel=HELD)


@pytest.mark.parametrize("observer", OBSERVERS)
def test_coulomb_friction_alone_is_found(
    observer: type[AdaptiveObserver], coulomb_log: AxisLog
) -> None:
    found = observer(inertia=MASS, viscous=False, rate=5.0).fit(coulomb_log)
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e-6)
    assert found.status is Status.NO_INTERVAL
    assert found.parameters["coulomb_friction"].std is None


@pytest.mark.parametrize("observer", OBSERVERS)
def test_with_viscous_friction_they_follow_the_force_at_the_speed_of_the_moment(
    observer: type[AdaptiveObserver],
) -> None:
    log = Sensors().measure(motion(lambda time: np.full(time.shape, 2.0), VISCOUS, 20.0))
    found = observer(inertia=MASS, viscous=False, rate=5.0).fit(log)
    final_speed = (2.0 - COULOMB) / VISCOUS
    assert found.value("coulomb_friction") == pytest.approx(
        COULOMB + VISCOUS * final_speed, rel=1e-3
    )


@pytest.mark.parametrize("observer", OBSERVERS)
def test_both_kinds_of_friction_are_found_where_the_speed_varies(
    observer: type[AdaptiveObserver], viscous_log: AxisLog
) -> None:
    found = observer(inertia=MASS, viscous=True).fit(viscous_log)
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e-3)
    assert found.value("viscous_friction") == pytest.approx(VISCOUS, rel=1e-3)


@pytest.mark.parametrize("observer", OBSERVERS)
def test_a_rate_beyond_the_motion_makes_them_slower(
    observer: type[AdaptiveObserver], viscous_log: AxisLog
) -> None:
    errors = [
        abs(observer(inertia=MASS, viscous=True, rate=rate).fit(viscous_log).value(name) - true)
        for rate in (3.0, 60.0)
        for name, true in (("viscous_friction", VISCOUS),)
    ]
    assert errors[1] > 10.0 * errors[0]


@pytest.mark.parametrize("observer", OBSERVERS)
def test_at_one_speed_only_their_sum_is_found(observer: type[AdaptiveObserver]) -> None:
    log = Sensors().measure(motion(lambda time: np.full(time.shape, 2.0), VISCOUS, 40.0))
    steady = log.part(30_000, len(log))
    found = observer(inertia=MASS, viscous=True, speed=2.0, rate=5.0)
    values = ends(found, steady)[-1]
    speed = (2.0 - COULOMB) / VISCOUS
    assert values[1] + values[0] * speed == pytest.approx(2.0, rel=1e-3)
    assert abs(values[1] - COULOMB) > 0.05
    fitted = found.fit(steady)
    assert fitted.status is Status.NOT_IDENTIFIABLE
    assert not fitted.parameters["viscous_friction"].identified


@pytest.mark.parametrize("observer", OBSERVERS[:2] + OBSERVERS[3:])
@pytest.mark.parametrize("viscous", [False, True])
def test_the_lyapunov_function_of_the_parameters_never_grows(
    observer: type[AdaptiveObserver], viscous: bool, coulomb_log: AxisLog
) -> None:
    rate, speed = 8.0, 0.5
    one = observer(
        inertia=MASS,
        viscous=viscous,
        rate=rate,
        speed=speed,
        initial_values={"coulomb_friction": 2.0, "viscous_friction": 1.5 if viscous else 0.0},
    )
    history = ends(one, coulomb_log)
    error = (history[:, 1:] if viscous else history) - COULOMB
    lyapunov = np.sum(error**2, axis=1)
    if viscous:
        lyapunov += (history[:, 0] * speed) ** 2
    assert np.all(np.diff(lyapunov) <= EXACT)
    assert lyapunov[-1] < 0.5 * lyapunov[0]


@pytest.mark.parametrize("seed", quick_where(lambda seed: seed == 0, range(3)))
def test_liao_and_chiens_function_decays_exponentially(seed: int) -> None:
    rng = np.random.default_rng(seed)
    parts = rng.uniform(-4.0, 4.0, 20)
    effort = np.repeat(parts, 500)
    plant = SingleMass(mass=MASS, friction=law(0.0))
    log = Sensors().measure(simulate(plant, effort, sampling_time=T))
    observer = LiaoChienObserver(inertia=MASS, rate=3.0, speed=1.0, bandwidth=6.0)
    state = observer.init(sampling_time=T)
    v = table_of(log)[:, 2]
    lyapunov: list[float] = []
    moving = 0.0
    bounds: list[float] = []
    for k, sample in enumerate(samples_of(log)):
        state, values = observer.step(state, sample)
        error = observer.tracking_error(state)
        quadratic = error @ observer.lyapunov @ error + (COULOMB - values[0]) ** 2 / 3.0
        lyapunov.append(float(quadratic))
        moving += T if k and v[k - 1] * v[k] > 0 else 0.0
        bounds.append(lyapunov[0] * np.exp(-observer.decay * moving))
    assert np.all(np.diff(lyapunov) <= EXACT)
    # The midpoint rule decays by (1 - z/2)/(1 + z/2) instead of exp(-z), z = decay T
    assert np.all(np.array(lyapunov) <= np.array(bounds) * (1.0 + 1e-3) + EXACT)


def test_p_solves_the_lyapunov_equation() -> None:
    observer = LiaoChienObserver(inertia=MASS, bandwidth=7.0)
    A = np.array([[0.0, 1.0], [-49.0, -14.0]])
    Q = (MASS * 7.0) ** 2 * np.diag([49.0, 1.0])
    P = observer.lyapunov
    np.testing.assert_allclose(A.T @ P + P @ A, -Q, atol=1e-9)
    smallest = np.min(np.linalg.eigvals(np.linalg.solve(P, Q)).real)
    assert observer.decay == pytest.approx(min(smallest, 2.0 * observer.rate))


@pytest.mark.parametrize("forgetting_factor", [1.0, 0.98])
@pytest.mark.parametrize("inertia", [MASS, None])
def test_recursion_ends_at_weighted_least_squares(
    forgetting_factor: float, inertia: float | None, viscous_log: AxisLog
) -> None:
    observer = LeastSquaresObserver(
        inertia=inertia, offset=True, forgetting_factor=forgetting_factor, dead_band=0.0
    )
    found = observer.fit(viscous_log)
    fitted = [found.value(name) for name in observer.parameter_names("linear")]
    np.testing.assert_allclose(ends(observer, viscous_log)[-1], fitted, rtol=1e-5, atol=1e-5)
    assert found.value("viscous_friction") == pytest.approx(VISCOUS, rel=1e3 * MEAN_SPEED)
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e3 * MEAN_SPEED)


def test_least_squares_cover_the_truth_under_velocity_noise() -> None:
    moved = motion(swings, VISCOUS)
    sensors = Sensors(velocity_noise=1e-3, position_noise=1e-5)
    observer = LeastSquaresObserver(inertia=MASS)
    fits = (observer.fit(measured(moved, sensors, seed)) for seed in range(60))
    assert_covers(fits, {"viscous_friction": VISCOUS, "coulomb_friction": COULOMB})


@pytest.mark.parametrize("observer", OBSERVERS[:3])
def test_rests_with_noise_need_a_dead_band(
    observer: type[AdaptiveObserver],
) -> None:
    """An axis at rest seems to creep either way, whatever pushes it.

    The gradient estimator's filter averages the directions, and learns nothing instead.
    """

    def pushed(time: np.ndarray) -> np.ndarray:
        return np.where(time < 0.5, 2.0, 0.5 * COULOMB)

    moved = motion(pushed, 0.0, 10.0)
    log = measured(moved, Sensors(velocity_noise=1e-3))
    careless = observer(inertia=MASS, viscous=False, speed=1.0, dead_band=0.0)
    careful = observer(inertia=MASS, viscous=False, speed=1.0)
    assert careless.fit(log).value("coulomb_friction") < 0.1 * COULOMB
    assert careful.fit(log).value("coulomb_friction") == pytest.approx(COULOMB, rel=0.02)


def test_an_inertia_biased_by_noise_is_not_identified() -> None:
    log = measured(motion(swings, VISCOUS), Sensors(velocity_noise=2e-2))
    found = LeastSquaresObserver().fit(log)
    assert not found.status.trusted
    assert not found.parameters["mass"].identified


@pytest.mark.parametrize(
    "observer",
    [
        FriedlandParkObserver(inertia=1.0, stiffness=4.0, viscous=True),
        LeastSquaresObserver(inertia=1.0, stiffness=4.0),
    ],
)
def test_the_spring_of_an_arm_is_taken_out(
    observer: AdaptiveObserver | LeastSquaresObserver,
) -> None:
    arm = FlexibleArm(mass_1=1.0, mass_2=0.5, stiffness=4.0, friction=law(VISCOUS))
    effort = swings(np.arange(0.0, 30.0, T))
    found = observer.fit(Sensors().measure(simulate(arm, effort, sampling_time=T)))
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e-3)
    assert found.value("viscous_friction") == pytest.approx(VISCOUS, rel=1e-3)


@pytest.mark.parametrize("observer", OBSERVERS)
def test_positions_alone_will_do(observer: type[AdaptiveObserver], viscous_log: AxisLog) -> None:
    blind = axis_log(viscous_log.time, viscous_log.effort, viscous_log.measured_position)
    found = observer(inertia=MASS, viscous=True).fit(blind)
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=3e-3)
    assert found.value("viscous_friction") == pytest.approx(VISCOUS, rel=3e-3)


@pytest.mark.parametrize("observer", [*OBSERVERS, LeastSquaresObserver])
def test_they_run_along_in_a_controller(
    observer: type[AdaptiveObserver] | type[LeastSquaresObserver],
) -> None:
    one = (
        LeastSquaresObserver(inertia=MASS)
        if observer is LeastSquaresObserver
        else observer(inertia=MASS, speed=0.5)  # type: ignore[call-arg]
    )
    online = OnlineFriction.of(one, sampling_time=T, needs_load=False)
    state = online.first_state.copy()
    assert online.kernel(state, 1.0, 0.0, 0.1, 0.0, 0.0)
    assert not online.kernel(state, 1.0, 0.0, float("nan"), 0.0, 0.0)
    coulomb, viscous = online.places
    assert (state[coulomb], state[viscous]) == (0.0, 0.0)


def test_a_known_parameter_is_not_estimated(viscous_log: AxisLog) -> None:
    observer = FriedlandParkObserver(
        inertia=MASS, rate=5.0, initial_values={"viscous_friction": VISCOUS}
    )
    found = observer.fit(viscous_log)
    assert list(found.parameters) == ["coulomb_friction"]
    assert found.value("coulomb_friction") == pytest.approx(COULOMB, rel=1e-6)


def test_estimates_that_still_change_at_the_end_have_a_note(viscous_log: AxisLog) -> None:
    found = FriedlandParkObserver(inertia=MASS).fit(viscous_log)
    assert any("moved by" in note for note in found.diagnostics.notes)


def test_a_first_state_needs_a_typical_speed() -> None:
    with refuses("no_typical_speed"):
        FriedlandParkObserver(inertia=1.0).init(sampling_time=T)


def test_a_missing_value_gives_no_row_and_is_counted() -> None:
    """The rows before it and after it are those of a log that has a gap there."""
    observer = FriedlandParkObserver(inertia=1.0, speed=1.0)
    state = observer.init(sampling_time=T)
    moving = (3.0, 0.0, 0.1, 0.0, 0.0)
    state, _ = observer.step(state, moving)
    state, before = observer.step(state, moving)
    state, missing = observer.step(state, (3.0, 0.0, float("nan"), 0.0, 0.0))
    state, next_one = observer.step(state, moving)
    assert before.tolist() == missing.tolist() == next_one.tolist() != [0.0]
    state, after = observer.step(state, moving)
    assert after[0] > before[0]
    assert observer.health(state).missing_samples == 1
    assert observer.health(state).force_noise is None


@pytest.mark.parametrize("delay", [3.0, -1.5])
@pytest.mark.parametrize(
    "observer",
    [
        GradientEstimator(inertia=MASS),
        LeastSquaresObserver(inertia=MASS),
        PublishedEnergyEstimator(inertia=MASS, sums="settled"),
    ],
    ids=lambda observer: observer.name,
)
def test_the_rows_of_a_log_are_free_of_a_known_delay(
    observer: GradientEstimator | LeastSquaresObserver | PublishedEnergyEstimator,
    delay: float,
    viscous_log: AxisLog,
) -> None:
    early = logged_early(viscous_log, delay)

    def friction(log: AxisLog, effort_delay: float) -> np.ndarray:
        rows = replace(observer, effort_delay=effort_delay).regression(log)
        return np.linalg.lstsq(rows.regressors, rows.target)[0]

    right = friction(early, delay) - friction(viscous_log, 0.0)
    wrong = friction(early, 0.0) - friction(viscous_log, 0.0)
    assert np.max(np.abs(right)) < DELAY_LEFT * np.max(np.abs(wrong))


@pytest.mark.slow
def test_liao_and_chiens_observer_compensates_in_the_loop() -> None:
    plant = SingleMass(mass=MASS, friction=law(0.0))
    learning = OnlineFriction.of(
        LiaoChienObserver(inertia=MASS, rate=4.0, speed=1.0), sampling_time=T, needs_load=False
    )
    moves = (Move(target=1.0, duration=2.0), Move(target=0.0, duration=2.0)) * 2
    errors: list[float] = []
    for compensation in (None, FrictionCompensation(friction=learning)):
        controller = FeedbackController(
            sampling_time=T,
            pd=PD(position_gain=20.0, velocity_gain=10.0),
            compensation=compensation,
            inertia=MASS,
            effort_limit=20.0,
            reference=PointToPoint(moves=moves),
        )
        run = simulate_closed_loop(
            plant, controller, sampling_time=T, samples=8000, sensors=Sensors()
        )
        wanted = controller.reference.at(run.motion.time).position
        errors.append(float(np.max(np.abs(run.motion.position - wanted)[4000:])))
    assert errors[1] < 0.1 * errors[0]


def test_an_axis_that_only_moves_in_its_noise_identifies_nothing() -> None:
    time = np.arange(0.0, 2.0, T)
    rng = np.random.default_rng(0)
    log = axis_log(
        time,
        0.5 * np.sin(time),
        1e-6 * rng.normal(size=time.size),
        1e-3 * rng.normal(size=time.size),
    )
    for observer in (FriedlandParkObserver(inertia=MASS), LeastSquaresObserver(inertia=MASS)):
        found = observer.fit(log)
        assert found.status is Status.INSUFFICIENT_EXCITATION
        assert not found.parameters["coulomb_friction"].identified
