from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from laws import uneven
from refusals import refuses

from stickslip.compiled import compiled
from stickslip.control import (
    PD,
    FeedbackController,
    FrictionCompensation,
    Move,
    Notch,
    OnlineFriction,
    PointToPoint,
)
from stickslip.estimation import EnergyEstimator, PublishedEnergyEstimator
from stickslip.estimation.energy.known_inertia.online.recursion import work_run, work_step
from stickslip.friction import CoulombViscousFriction
from stickslip.records import SensorSample
from stickslip.simulation import Sensors, simulate_closed_loop

LAW = uneven(coulomb=(0.2, 0.3), static=(0.4, 0.5), viscous=(0.6, 0.7), offset=0.05)
THERE = PointToPoint(
    moves=(Move(target=2.0, duration=2.0, dwell=1.0), Move(target=0.0, duration=1.0))
)
NOTCH = Notch(angular_frequency=20.0, depth=0.2, damping=0.5)
NOISY = Sensors(position_noise=0.005, velocity_noise=0.05)
LIMIT = 3.0
VALUE = st.floats(-1e3, 1e3)
SAMPLES = st.builds(SensorSample, st.floats(-1.0, 6.0), VALUE, VALUE, VALUE, VALUE)


@compiled()
def counting(s, u, x, v, x2, v2):
    """An estimator that shows what it was given: its estimates are s[0] and s[1]."""
    if not np.isfinite(x2):
        return False
    s[0] += 1.0
    s[1] = u
    s[2] = x + 10.0 * v + 100.0 * x2 + 1000.0 * v2
    return True


def friction_at(velocity):
    return LAW.friction(np.array([velocity]))[0]


def counter(first=(0.0, 0.0, 0.0), *, kernel=counting, needs_load=True):
    return OnlineFriction(
        kernel=kernel,
        first_state=np.array(first),
        sampling_time=0.01,
        values_at=slice(0, 2),
        needs_load=needs_load,
    )


def made(friction=LAW, **settings):
    compensation = None if friction is None else FrictionCompensation(friction=friction)
    return FeedbackController(
        **{
            "sampling_time": 0.01,
            "pd": PD(position_gain=5.0, velocity_gain=2.0),
            "reference": THERE,
            "notch": NOTCH,
            "compensation": compensation,
            "inertia": 1.5,
            "effort_limit": LIMIT,
            **settings,
        }
    )


def run_of(arm, controller, *, seed=1, samples=2500, sensors=NOISY):
    return simulate_closed_loop(
        arm,
        controller,
        sampling_time=0.01,
        samples=samples,
        sensors=sensors,
        generator=np.random.default_rng(seed),
    )


class Interpreted:
    """The same controller, its step called from Python."""

    def __init__(self, controller, step):
        self.init = controller.init
        self._step = step

    def step(self, state, sample):
        return self._step(state, sample)


@pytest.mark.parametrize("running", [False, True], ids=["known friction", "running estimate"])
def test_compiled_and_interpreted_loops_agree_to_the_bit(arm, controller, online, running):
    if running:
        friction = FrictionCompensation(friction=online)
        controller = replace(controller, compensation=friction)
        plain = replace(online, kernel=work_step.py_func)
        by_hand = replace(controller, compensation=FrictionCompensation(friction=plain)).step
        assert not hasattr(by_hand, "py_func")  # an estimator in Python makes a step in Python
    else:
        by_hand = controller.step.py_func
    whole = run_of(arm, controller)
    assert whole.log.effort.any()
    for step in (controller.step, by_hand):
        single = run_of(arm, Interpreted(controller, step))
        np.testing.assert_array_equal(whole.log.effort, single.log.effort)
        np.testing.assert_array_equal(whole.motion.position, single.motion.position)
        np.testing.assert_array_equal(whole.controller_state, single.controller_state)


def test_each_effort_is_the_documented_sum():
    controller = made()
    filtered = NOTCH.coefficients(0.01)
    rng = np.random.default_rng(3)
    state, z1, z2 = controller.init(), 0.0, 0.0
    for k in range(400):
        t = 0.01 * k
        (r,), (r_dot,), (r_ddot,) = THERE.at([t])
        x, v = r + 0.05 * rng.normal(), r_dot + 0.1 * rng.normal()
        state, u = controller.step(state, SensorSample(t, x, v, np.nan, np.nan))
        e = 5.0 * (r - x) + 2.0 * (r_dot - v)
        y = filtered.b0 * e + z1
        z1 = filtered.b1 * e - filtered.a1 * y + z2
        z2 = filtered.b2 * e - filtered.a2 * y
        whole = y + 1.5 * r_ddot + friction_at(r_dot) + LAW.offset
        assert u == pytest.approx(np.clip(whole, -LIMIT, LIMIT), abs=1e-12)


@given(sample=SAMPLES, earlier=SAMPLES, limit=st.floats(1e-3, 1e3))
def test_a_step_is_pure_and_its_effort_within_the_limit(sample, earlier, limit):
    controller = made(counter(), effort_limit=limit)
    state, _ = controller.step(controller.init(), earlier)
    before = state.copy()
    first, u = controller.step(state, sample)
    second, again = controller.step(state, sample)
    np.testing.assert_array_equal(state, before)
    np.testing.assert_array_equal(first, second)
    assert u == again
    assert abs(u) <= limit


@given(sample=SAMPLES, earlier=SAMPLES, measured=st.booleans(), band=st.floats(0.0, 2.0))
def test_the_mirrored_axis_gets_the_mirrored_effort(sample, earlier, measured, band):
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.2, viscous_friction=0.3)
    friction = FrictionCompensation(
        friction=law, velocity="measured" if measured else "reference", dead_band=band
    )
    mirror = PointToPoint(moves=[replace(move, target=-move.target) for move in THERE.moves])
    efforts = []
    for profile, way in ((THERE, 1.0), (mirror, -1.0)):
        controller = made(compensation=friction, reference=profile, effort_limit=None)
        state = controller.init()
        for seen in (earlier, sample):
            turned = SensorSample(seen.time, *(way * value for value in seen[1:]))
            state, u = controller.step(state, turned)
        efforts.append(u)
    assert efforts[0] == -efforts[1]


def test_the_measured_velocity_is_compensated_for_if_asked():
    friction = FrictionCompensation(friction=LAW, velocity="measured", dead_band=0.1)
    controller = made(compensation=friction, notch=None, inertia=0.0, effort_limit=None)
    state = controller.init()
    for v, expected in ((0.2, friction_at(0.2)), (-0.2, friction_at(-0.2)), (0.1, 0.0)):
        _, u = controller.step(state, SensorSample(0.0, 0.0, v, np.nan, np.nan))
        assert u == pytest.approx(-2.0 * v + expected + LAW.offset, abs=1e-15)


def test_at_rest_the_reference_compensates_only_the_offset():
    _, u = made().step(made().init(), SensorSample(2.5, 2.0, 0.0, np.nan, np.nan))
    assert u == LAW.offset


@pytest.mark.parametrize("channel", ["measured_position", "measured_velocity", "time"])
def test_a_sample_that_is_not_finite_is_not_taken(channel):
    controller = made(counter())
    good = SensorSample(0.5, 0.1, 0.2, 0.3, 0.4)
    state, _ = controller.step(controller.init(), good)
    after, u = controller.step(state, good._replace(**{channel: np.nan}))
    assert np.isnan(u)
    np.testing.assert_array_equal(after, state)


def test_the_estimate_before_a_sample_is_compensated_and_the_sample_then_learned():
    controller = made(counter((0.5, 0.0, 0.0)), effort_limit=None, notch=None, inertia=0.0)
    sample = SensorSample(1.0, 1.0, 15 / 8, 0.3, 0.4)  # half way, on the reference: PD gives 0
    state = controller.init()
    coulomb, viscous = 0.5, 0.0
    for _ in range(4):
        state, u = controller.step(state, sample)
        assert u == pytest.approx(coulomb + viscous * 15 / 8, rel=1e-14)
        coulomb, viscous = coulomb + 1.0, u
        learned = controller.estimator_state(state)
        assert learned[:2].tolist() == [coulomb, viscous]
        assert learned[2] == 1.0 + 10.0 * 15 / 8 + 30.0 + 400.0


def test_negative_estimates_compensate_nothing():
    sample = SensorSample(1.0, 0.9, 1.0, 0.3, 0.4)
    nothing = made(None)
    expected = nothing.step(nothing.init(), sample)[1]
    below = made(counter((-2.0, -1.0, 0.0)))
    assert below.step(below.init(), sample)[1] == expected
    assert below.step(below.init(), sample._replace(time=1.5))[1] != expected


def test_without_a_load_sensor_an_estimator_gets_0_or_nothing():
    sample = SensorSample(1.0, 0.5, 0.25, np.nan, np.nan)
    rigid, arm = made(counter(needs_load=False)), made(counter(needs_load=True))
    state, _ = rigid.step(rigid.init(), sample)
    assert rigid.estimator_state(state)[2] == 3.0
    assert rigid.refused_samples(state) == 0
    state, u = arm.step(arm.init(), sample)
    assert np.isfinite(u)
    assert arm.estimator_state(state).tolist() == [0.0, 0.0, 0.0]
    assert arm.refused_samples(state) == 1


def test_the_estimator_sees_what_the_log_holds(arm, controller, online):
    running = replace(controller, compensation=FrictionCompensation(friction=online))
    run = run_of(arm, running)
    log = run.log
    seen = np.column_stack(
        [
            log.effort,
            log.measured_position,
            log.measured_velocity,
            log.measured_load_position,
            log.measured_load_velocity,
        ]
    )[:-1]
    expected, history = work_run(online.first_state, seen)
    learned = running.estimator_state(run.controller_state)
    np.testing.assert_array_equal(learned, expected)
    assert running.refused_samples(run.controller_state) == 0
    assert learned[list(online.places)].tolist() == history[-1, ::-1].tolist()


def test_the_estimate_is_carried_to_the_next_run(arm, controller, online):
    running = replace(controller, compensation=FrictionCompensation(friction=online))
    first = run_of(arm, running, samples=500)
    learned = running.estimator_state(first.controller_state)
    again = running.resumed(learned)
    np.testing.assert_array_equal(again.estimator_state(again.init()), learned)
    assert again.step is running.step  # nothing is compiled anew
    np.testing.assert_array_equal(running.estimator_state(running.init()), online.first_state)


@pytest.mark.parametrize(
    "estimator",
    [
        EnergyEstimator(inertia=1.0, offset=False),
        EnergyEstimator(offset=False),
        PublishedEnergyEstimator(inertia=1.0),
    ],
    ids=["inertia known", "inertia sought", "report"],
)
def test_an_estimator_runs_along_from_its_own_first_state(estimator):
    online = OnlineFriction.of(estimator, sampling_time=0.01, needs_load=False)
    first = estimator.init(sampling_time=0.01)
    np.testing.assert_array_equal(online.first_state, first)
    assert online.sampling_time == 0.01
    assert list(online.places) == np.arange(first.size)[estimator.values_at].tolist()
    assert online.kernel is estimator.kernel


def test_a_loop_that_the_controller_was_not_made_for_is_refused(arm, controller):
    with refuses("other_sampling_time", own=0.01, sampling_time=0.005):
        simulate_closed_loop(arm, controller, sampling_time=0.005, samples=10)


@pytest.mark.parametrize(
    ("make", "code"),
    [
        (lambda: made(sampling_time=0.0), "not_positive"),
        (lambda: made(inertia=-1.0), "negative"),
        (lambda: made(effort_limit=0.0), "not_positive"),
        (lambda: made(sampling_time=0.2), "frequency_above_nyquist"),
        (lambda: made().estimator_state(made().init()), "no_estimator"),
        (lambda: made().refused_samples(made().init()), "no_estimator"),
        (lambda: made(None).resumed(np.zeros(3)), "no_estimator"),
        (
            lambda: made(counter()).resumed(np.zeros(4)),
            "state_of_other_estimator",
        ),
        (
            lambda: made(counter(), sampling_time=0.005),
            "other_sampling_time",
        ),
        (
            lambda: made(reference=lambda t: t),
            "wrong_type",
        ),
        (lambda: made(reference=None), "wrong_type"),
        (lambda: made(pd=(5.0, 2.0)), "wrong_type"),
        (lambda: made(notch=20.0), "wrong_type"),
        (
            lambda: made(compensation=LAW),
            "wrong_type",
        ),
    ],
)
@pytest.mark.usefixtures("without_shape_checks")
def test_refuses_what_cannot_be_used(make, code):
    with refuses(code):
        make()


@pytest.mark.parametrize("change", [slice(3), slice(None, -1)])
def test_a_vector_that_is_no_state_is_refused(controller, change):
    with pytest.raises(ValueError, match="not a state of a FeedbackController"):
        controller.step(controller.init()[change], SensorSample(0.0, 0.0, 0.0, 0.0, 0.0))
