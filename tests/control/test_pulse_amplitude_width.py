import importlib
import math
import warnings
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from laws import uneven
from pulse_runs import run_pulses
from refusals import refuses
from scipy.optimize import minimize

from stickslip.control import PulseAmplitudeWidthController, RestDetection
from stickslip.control.pulses.published import in_range, trimmed_effort
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome
from stickslip.simulation import Sensors

T = 0.01
FULL = 300.0
IDEAL = RestDetection(samples=1, spread=0.0, speed=0.0)
PUBLISHED = PulseAmplitudeWidthController.from_friction(  # mass known, friction guessed at 0.8 f_c
    mass=150.0,
    coulomb_friction=80.0,
    pulse_effort=FULL,
    sampling_time=T,
    target=0.01,
    tolerance=2e-5,
    rest=IDEAL,
)
BOUNDED = replace(PUBLISHED, longest_width=0.03)
TRUE_GAIN = 2.0  # b of Table 1 [m/s^2]
ROUNDING = 1e-12  # relative, of a closed form
CANCELLED = 1e-6  # relative; the reference loses nine digits of P from the first pulse, at 1e5
LEAST_SQUARES = 1e-9  # relative; the condition of the rows is some 1e5


def table(run):
    """Return the regressors that were applied, shape (k, 2), and the displacements, (k,)."""
    effort, width = np.array([pulse.levels[0] for pulse in run.pulses]).T
    d = np.array([pulse.achieved_displacement for pulse in run.pulses])
    return np.column_stack((effort * np.abs(effort), -effort)) * width[:, None] ** 2, d


def gains(run):
    return np.column_stack((run.estimates["gain_1"], run.estimates["gain_2"]))


def test_the_first_guess_is_that_of_the_source():
    estimates = PUBLISHED.estimates(PUBLISHED.init())
    assert estimates["pulse_gain"] == pytest.approx(1.375 * TRUE_GAIN, rel=ROUNDING)
    assert estimates["coulomb_friction"] == pytest.approx(80.0, rel=ROUNDING)


def test_with_bounded_widths_it_arrives_from_one_side(consecutive_runs):
    runs = consecutive_runs(BOUNDED, 10)
    assert [len(runs[0].pulses), len(runs[-1].pulses)] == [10, 8]
    for run in (runs[0], runs[-1]):
        assert (run.run.log.effort >= 0.0).all()
        assert run.outcome is PositioningOutcome.REACHED
        assert abs(0.01 - run.run.motion.position[-1]) <= 2e-5
        assert max(pulse.duration for pulse in run.pulses) == pytest.approx(0.03)
    assert consecutive_runs(BOUNDED, 10, keep_covariance=False)[-1].outcome is (
        PositioningOutcome.REACHED
    )


def test_with_unbounded_widths_it_can_cycle_just_outside_the_tolerance(consecutive_runs):
    runs = consecutive_runs(PUBLISHED, 10)
    assert runs[0].outcome is PositioningOutcome.REACHED
    assert runs[-1].outcome is PositioningOutcome.MOVING
    last = [pulse.error for pulse in runs[-1].pulses[-4:]]
    assert np.abs(last) == pytest.approx(2.4e-5, abs=0.5e-6)
    assert (np.diff(np.sign(last)) != 0.0).all()


@pytest.mark.parametrize("variance", [1e-5, 1e5])
def test_either_reading_of_the_first_covariance_arrives_with_bounded_widths(
    consecutive_runs, variance
):
    for run in consecutive_runs(replace(BOUNDED, initial_covariance=variance), 10):
        assert run.outcome is PositioningOutcome.REACHED
        assert (run.estimates["coulomb_friction"] > 0.0).all()
        assert (run.estimates["coulomb_friction"] < FULL).all()


@given(
    f_p=st.floats(1.0, 1e4),
    share=st.floats(0.01, 0.99),
    samples=st.integers(1, 50),
    part=st.floats(0.0, 1.0, exclude_min=True),
)
def test_the_trimmed_effort_is_the_root_of_equation_15(f_p, share, samples, part):
    f_c, T_x = share * f_p, samples * T
    t_p = (samples - 1 + part) * T if samples > 1 else max(part, 1e-6) * T
    found = trimmed_effort(f_p, f_c, t_p, T_x)
    with mpmath.workdps(50):
        p, c = mpmath.mpf(f_p), mpmath.mpf(f_c)
        wanted = p * (p - c) * (mpmath.mpf(t_p) / mpmath.mpf(T_x)) ** 2
        root = mpmath.findroot(lambda f: f * (f - c) - wanted, p)
    assert found == pytest.approx(float(root), rel=ROUNDING)
    assert f_c <= found <= f_p


@pytest.mark.parametrize("longest", [None, 0.03])
def test_the_trimmed_pulse_is_expected_to_do_what_the_error_asks_for(consecutive_runs, longest):
    controller = replace(PUBLISHED, longest_width=longest, gain=0.9)
    (run,) = consecutive_runs(controller, 1)
    u, _ = table(run)
    predicted = np.sum(u * gains(run)[:-1], axis=1)
    error = np.array([pulse.error for pulse in run.pulses])
    assert predicted == pytest.approx([p.predicted_displacement for p in run.pulses], rel=1e-9)
    limit = run.estimates["pulse_gain"][:-1] * (longest or math.inf) ** 2
    assert predicted == pytest.approx(np.sign(error) * np.minimum(0.9 * abs(error), limit))


@pytest.mark.parametrize("variance", [1e-5, 1e5])
@pytest.mark.parametrize("forgetting", [1.0, 0.9])
def test_the_recursion_is_that_of_an_adaptive_filter(consecutive_runs, variance, forgetting):
    controller = replace(BOUNDED, initial_covariance=variance, forgetting=forgetting)
    (run,) = consecutive_runs(controller, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # its docstrings hold escapes that Python warns of
        filters = importlib.import_module("padasip.filters")
    rls = filters.FilterRLS(
        n=2, mu=forgetting, eps=1.0 / variance, w=[PUBLISHED.first_gain_1, PUBLISHED.first_gain_2]
    )
    found = gains(run)
    for k, (u, d) in enumerate(zip(*table(run), strict=True)):
        rls.adapt(d, u)
        assert found[k + 1] == pytest.approx(rls.w, rel=CANCELLED)
    P = controller.learned(run.run.controller_state).covariance
    assert pytest.approx(rls.R, rel=1e-4, abs=1e-9 * variance) == P


@pytest.mark.parametrize("variance", [1e-5, 1e5])
def test_the_recursion_is_least_squares_around_the_first_guess(consecutive_runs, variance):
    runs = consecutive_runs(replace(BOUNDED, initial_covariance=variance), 3)  # learn as one
    u, d = (np.concatenate(parts) for parts in zip(*map(table, runs), strict=True))
    first = np.array([PUBLISHED.first_gain_1, PUBLISHED.first_gain_2])
    # min ||d - u a||^2 + ||a - a(0)||^2 / P(0)
    prior = math.sqrt(1.0 / variance)
    rows = np.vstack((u, prior * np.eye(2)))
    a = np.linalg.lstsq(rows, np.concatenate((d, prior * first)), rcond=None)[0]
    assert gains(runs[-1])[-1] == pytest.approx(a, rel=LEAST_SQUARES)


def test_from_the_nominal_pulse_only_one_combination_is_learned(consecutive_runs):
    across = np.array([1.0, FULL])  # to every nominal regressor t_p^2 [f_p^2, -f_p]
    changes = {}
    for regressor in ("nominal", "applied"):
        controller = replace(
            PUBLISHED, regressor=regressor, initial_covariance=1e5, friction_margin=None
        )
        (run,) = consecutive_runs(controller, 1)
        P = controller.learned(run.run.controller_state).covariance
        changes[regressor] = np.linalg.norm(P @ across / 1e5 - across) / np.linalg.norm(across)
    assert changes["nominal"] < 1e-9
    assert changes["applied"] > 1e-4


def test_the_printed_sign_drives_the_pulse_gain_negative_at_the_second_pulse(sliding_mass):
    printed = replace(BOUNDED, regressor="printed", initial_covariance=1e5, friction_margin=None)
    run = run_pulses(sliding_mass, printed, sampling_time=T, duration=2.0)
    before, after = run.estimates["pulse_gain"]
    assert after < 0.0 < before
    assert run.outcome is PositioningOutcome.STOPPED  # no width can be planned for the second
    kept = run_pulses(
        sliding_mass, replace(printed, friction_margin=0.01), sampling_time=T, duration=2.0
    )
    assert (kept.estimates["pulse_gain"] > 0.0).all()


COVARIANCES = st.tuples(st.floats(0.1, 10.0), st.floats(-0.99, 0.99), st.floats(0.1, 10.0)).map(
    lambda c: (c[0], c[1] * math.sqrt(c[0] * c[2]), c[2])
)
GAIN = st.floats(-5.0, 5.0)


@settings(max_examples=150)
@given(a=st.tuples(GAIN, GAIN), P=COVARIANCES, low=st.floats(0.1, 1.0), high=st.floats(1.1, 4.0))
def test_the_range_is_kept_by_the_nearest_estimate(a, P, low, high):
    S = np.linalg.cholesky([[P[0], P[1]], [P[1], P[2]]])
    found = in_range(a, tuple(S.ravel().tolist()), low, high)
    G = np.linalg.inv([[P[0], P[1]], [P[1], P[2]]])

    def distance(point):
        away = np.asarray(point) - a
        return away @ G @ away

    # The cone low A_1 <= A_2 <= high A_1 is x [1, low] + y [1, high], x and y not negative
    def of(xy):
        return np.array([xy[0] + xy[1], low * xy[0] + high * xy[1]])

    best = min(
        (
            minimize(lambda xy: distance(of(xy)), start, bounds=[(0.0, None)] * 2, tol=1e-14)
            for start in ([1.0, 0.0], [0.0, 1.0])
        ),
        key=lambda each: each.fun,
    )
    if math.isnan(found[0]):
        assert np.abs(of(best.x)).max() < 1e-4  # nothing but the origin agrees
        return
    assert found[0] > 0.0
    assert low * (1 - ROUNDING) <= found[1] / found[0] <= high * (1 + ROUNDING)
    assert distance(found) <= best.fun + 1e-7 * (1.0 + distance((0.0, 0.0)))


AXES = {
    "error": st.floats(-0.02, 0.02),
    "mass": st.floats(75.0, 300.0),
    "coulomb": st.floats(50.0, 200.0),
    "excess": st.floats(1.0, 1.5),
    "guess": st.floats(0.5, 1.5),
    "variance": st.sampled_from([1e-5, 1e5, 1e12]),
    "longest": st.one_of(st.none(), st.floats(0.01, 0.1)),
    "offset": st.floats(-0.2, 0.2),
}


@settings(max_examples=80)
@given(**AXES)
def test_on_any_axis_it_keeps_its_limits(
    error, mass, coulomb, excess, guess, variance, longest, offset
):
    plant = SingleMass(
        mass=mass,
        friction=uneven(
            coulomb=(coulomb, 1.2 * coulomb),
            static=(excess * coulomb, 1.2 * excess * coulomb),
            viscous=(700.0, 700.0),
            offset=offset * coulomb,
        ),
    )
    effort = 3.0 * coulomb
    controller = replace(
        PulseAmplitudeWidthController.from_friction(
            mass=mass,
            coulomb_friction=guess * coulomb,
            pulse_effort=effort,
            sampling_time=T,
            target=error,
            tolerance=2e-5,
            rest=IDEAL,
        ),
        longest_width=longest,
        initial_covariance=variance,
    )
    run = run_pulses(plant, controller, sampling_time=T, duration=1.0)
    applied = run.run.log.effort[:-1]
    assert np.abs(applied).max(initial=0.0) <= effort
    friction, margin = run.estimates["coulomb_friction"], 0.01 * effort
    assert (friction >= margin * (1 - 1e-9)).all()
    assert (friction <= (effort - margin) * (1 + 1e-9)).all()
    assert (run.estimates["gain_1"] > 0.0).all()
    known = dict(zip(run.estimate_times[1:].tolist(), friction[1:].tolist(), strict=True))
    before = [friction[0], *known.values()]
    for pulse, f_c in zip(run.pulses, before, strict=False):
        level, width = pulse.levels[0]
        assert abs(pulse.error) > controller.tolerance
        assert level * pulse.error > 0.0
        assert f_c * (1 - 1e-9) <= abs(level)
        assert longest is None or width <= longest + 1e-12
    starts = [round(pulse.time / T) for pulse in run.pulses]
    assert not np.any(run.run.motion.velocity[starts])
    # What is learned can always be taken on
    learned = controller.learned(run.run.controller_state)
    assert controller.resumed(learned).first_gain_1 == run.estimates["gain_1"][-1]


def test_a_pulse_below_breakaway_is_repeated_up_to_max_idle_pulses():
    # A static friction that the pulse for 0.1 mm does not overcome
    plant = SingleMass(
        mass=150.0,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=100.0, static_friction=250.0, viscous_friction=700.0
        ),
    )
    controller = replace(PUBLISHED, target=1e-4)
    patient = run_pulses(plant, controller, sampling_time=T, duration=1.0)
    assert patient.outcome is PositioningOutcome.STOPPED
    assert [pulse.moved for pulse in patient.pulses] == [False] * 3
    assert (gains(patient) == gains(patient)[0]).all()
    printed = run_pulses(
        plant, replace(controller, max_idle_pulses=None), sampling_time=T, duration=1.0
    )
    assert printed.outcome is PositioningOutcome.MOVING
    assert len(printed.pulses) == 99  # every sample but that of the pulse still on its way


@pytest.mark.parametrize("seed", range(5))
def test_on_an_encoder_without_a_velocity_it_arrives(sliding_mass, seed):
    step, noise = 1e-6, 1e-6
    rest = RestDetection.for_encoder(resolution=step, noise=noise, samples=20)
    controller = replace(BOUNDED, rest=rest)
    run = run_pulses(
        sliding_mass,
        controller,
        sampling_time=T,
        duration=8.0,
        sensors=Sensors(position_noise=noise, encoder_step=step, velocity="none"),
        generator=np.random.default_rng(seed),
    )
    assert run.outcome is PositioningOutcome.REACHED
    assert run.run.log.measured_velocity is None
    truth = run.run.motion
    # Means of a window at rest are off by less than the least motion
    assert abs(controller.target - truth.position[-1]) <= controller.tolerance + rest.least_motion
    starts = [round(pulse.time / T) for pulse in run.pulses]
    assert not np.any(truth.velocity[starts])
    moved = np.diff([*truth.position[starts], truth.position[-1]])
    achieved = [pulse.achieved_displacement for pulse in run.pulses]
    assert achieved == pytest.approx(moved, abs=rest.least_motion)


def test_a_rotary_axis_is_controlled_alike(sliding_mass, consecutive_runs):
    axis = replace(sliding_mass, kind="rotary")
    (linear,) = consecutive_runs(BOUNDED, 1)
    rotary = run_pulses(axis, replace(BOUNDED, kind="rotary"), sampling_time=T, duration=2.0)
    assert rotary.pulses == linear.pulses


def test_what_cannot_be_resumed_is_refused():
    learned = PUBLISHED.learned(PUBLISHED.init())
    with refuses("learned_lacks", name="gain_2"):
        PUBLISHED.resumed(replace(learned, values={"gain_1": 4e-5}))
    with refuses("first_guess_too_large", value=400.0, effort=300.0):
        PUBLISHED.resumed(replace(learned, values={"gain_1": 1e-5, "gain_2": 4e-3}))


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"pulse_effort": 80.0}, "first_guess_too_large"),
        ({"pulse_effort": 10_000.0}, "first_guess_too_small"),
        ({"first_gain_1": 0.0}, "not_positive"),
        ({"first_gain_2": -1.0}, "not_positive"),
        ({"initial_covariance": -1.0}, "initial_covariance_not_definite"),
        ({"initial_covariance": (1.0, 2.0, 1.0)}, "initial_covariance_not_definite"),
        ({"initial_covariance": math.nan}, "initial_covariance_not_definite"),
        ({"friction_margin": 0.5}, "not_in_interval"),
        ({"friction_margin": 0.4}, "first_guess_too_small"),
        ({"regressor": "best"}, "not_a_choice"),
        ({"kind": "rotary", "pulse_effort": 80.0}, "first_guess_too_large"),
    ],
)
def test_impossible_settings_are_refused(wrong, code, without_shape_checks):
    with refuses(code, of=wrong):
        replace(PUBLISHED, **wrong)
