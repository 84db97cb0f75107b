import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pulse_runs import run_pulses
from refusals import refuses

from stickslip.control import PulseWidthController, RestDetection
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.records import PositioningOutcome

T = 0.01
IDEAL = RestDetection(samples=1, spread=0.0, speed=0.0)
PUBLISHED = PulseWidthController.from_friction(  # its mass known, its friction guessed at 0.8 f_c
    mass=150.0,
    coulomb_friction=80.0,
    pulse_effort=300.0,
    sampling_time=T,
    target=0.01,
    tolerance=2e-5,
    rest=IDEAL,
)
TRUE_GAIN = 2.0  # b of Table 1 [m/s^2]
LAST_DIGIT = 5e-7  # of van de Wijdeven's cycles as they are known, in micrometres [m]
ROUNDING = 1e-10  # relative; some hundred updates


def cycle(run):
    """Return the two errors between which a run goes to and fro at its end."""
    errors = [pulse.error for pulse in run.pulses[-4:]]
    assert errors[0] == pytest.approx(errors[2], rel=1e-6)
    assert errors[1] == pytest.approx(errors[3], rel=1e-6)
    return max(errors), min(errors)


def regressors(run, controller):
    """Return u_p of each pulse, from its error and the estimate before it (Eqs. 7 and 10)."""
    b = run.estimates["pulse_gain"][: len(run.pulses)]
    error = np.array([pulse.error for pulse in run.pulses])
    width = np.minimum(
        np.sqrt(controller.gain * np.abs(error) / b), controller.longest_width or np.inf
    )
    if controller.regressor == "applied":
        width = T * np.ceil(width / T - 1e-9)
    return np.sign(error) * width**2


def test_the_first_guess_is_that_of_the_source():
    assert PUBLISHED.first_gain == pytest.approx(1.375 * TRUE_GAIN, rel=1e-12)


def test_it_cycles_for_ever_at_one_sample_and_after_ten_runs_at_two(consecutive_runs):
    runs = consecutive_runs(PUBLISHED, 10)
    first, tenth = runs[0], runs[-1]
    assert cycle(first) == pytest.approx((0.114e-3, -0.072e-3), abs=LAST_DIGIT)
    assert cycle(tenth) == pytest.approx((0.275e-3, -0.419e-3), abs=LAST_DIGIT)
    for run, samples in ((first, 1), (tenth, 2)):
        assert run.outcome is PositioningOutcome.MOVING
        assert [pulse.duration for pulse in run.pulses[-4:]] == pytest.approx([samples * T] * 4)
        assert [pulse.levels[0][0] for pulse in run.pulses[-2:]] in ([300, -300], [-300, 300])


def test_with_bounded_widths_it_cycles_as_well_and_its_estimate_is_nearer(consecutive_runs):
    bounded = consecutive_runs(replace(PUBLISHED, longest_width=0.03), 10)[-1]
    unbounded = consecutive_runs(PUBLISHED, 10)[-1]
    assert max(pulse.duration for pulse in bounded.pulses) <= 0.03 + 1e-12
    upper, lower = cycle(bounded)
    assert lower < -PUBLISHED.tolerance < PUBLISHED.tolerance < upper
    b_bounded, b_unbounded = (run.estimates["pulse_gain"][-1] for run in (bounded, unbounded))
    assert abs(b_bounded - TRUE_GAIN) < abs(b_unbounded - TRUE_GAIN)


@pytest.mark.parametrize("regressor", ["nominal", "applied"])
@pytest.mark.parametrize(("forgetting", "weight"), [(1.0, 1.0), (0.9, 1.0), (1.0, 0.5), (0.8, 1.7)])
def test_the_recursion_is_weighted_least_squares(consecutive_runs, regressor, forgetting, weight):
    """In closed form: b minimises the weighted squares with F^-1(0) (b - b(0))^2 before them.

    With lambda_2 the recursion of Eqs. 12 and 13 multiplies the update by F alone, so that only
    for lambda_2 = 1 is it least squares; elsewhere it is compared with Eqs. 11-13 written out.
    """
    controller = replace(
        PUBLISHED, regressor=regressor, forgetting=forgetting, new_data_weight=weight
    )
    (run,) = consecutive_runs(controller, 1)
    u = regressors(run, controller)
    d = np.array([pulse.achieved_displacement for pulse in run.pulses])
    found = run.estimates["pulse_gain"]
    if weight == 1.0:
        for n in (1, 5, len(u)):
            fade = forgetting ** np.arange(n - 1, -1, -1)
            prior = forgetting**n / controller.initial_covariance
            b = (prior * controller.first_gain + np.sum(fade * u[:n] * d[:n])) / (
                prior + np.sum(fade * u[:n] ** 2)
            )
            assert found[n] == pytest.approx(b, rel=ROUNDING)
    else:
        b, inverse = controller.first_gain, 1.0 / controller.initial_covariance
        for k in range(len(u)):
            inverse = forgetting * inverse + weight * u[k] ** 2
            b += u[k] * (d[k] - b * u[k]) / inverse
            assert found[k + 1] == pytest.approx(b, rel=ROUNDING)


def test_runs_that_keep_the_covariance_learn_as_one(consecutive_runs):
    runs = consecutive_runs(PUBLISHED, 3)
    u = np.concatenate([regressors(run, PUBLISHED) for run in runs])
    d = np.concatenate([[p.achieved_displacement for p in run.pulses] for run in runs])
    prior = 1.0 / PUBLISHED.initial_covariance
    b = (prior * PUBLISHED.first_gain + np.sum(u * d)) / (prior + np.sum(u * u))
    assert runs[-1].estimates["pulse_gain"][-1] == pytest.approx(b, rel=ROUNDING)
    anew = consecutive_runs(PUBLISHED, 3, keep_covariance=False)
    assert anew[-1].estimates["pulse_gain"][-1] != pytest.approx(b, rel=1e-3)


@settings(max_examples=60)
@given(
    error=st.floats(-0.02, 0.02),
    mass=st.floats(75.0, 300.0),
    coulomb=st.floats(50.0, 200.0),
    excess=st.floats(1.0, 1.5),
    guess=st.floats(0.5, 1.4),
    gain=st.floats(0.2, 1.9),
    longest=st.one_of(st.none(), st.floats(0.01, 0.1)),
)
def test_on_any_axis_it_keeps_its_limits(error, mass, coulomb, excess, guess, gain, longest):
    plant = SingleMass(
        mass=mass,
        friction=CoulombViscousFriction.symmetric(
            coulomb_friction=coulomb, static_friction=excess * coulomb, viscous_friction=700.0
        ),
    )
    effort = 3.0 * coulomb
    controller = replace(
        PulseWidthController.from_friction(
            mass=mass,
            coulomb_friction=guess * coulomb,
            pulse_effort=effort,
            sampling_time=T,
            target=error,
            tolerance=2e-5,
            rest=IDEAL,
        ),
        gain=gain,
        longest_width=longest,
    )
    run = run_pulses(plant, controller, sampling_time=T, duration=1.0)
    applied = run.run.log.effort[:-1]
    assert set(np.abs(applied).tolist()) <= {0.0, effort}
    for pulse in run.pulses:
        assert abs(pulse.error) > controller.tolerance
        assert pulse.levels[0][0] * pulse.error > 0.0
        assert longest is None or pulse.duration <= longest + 1e-12
        assert pulse.duration == pytest.approx(T * round(pulse.duration / T), rel=1e-12)
    # It fires only while the axis is at rest
    starts = [round(pulse.time / T) for pulse in run.pulses]
    assert not np.any(run.run.motion.velocity[starts])
    assert (run.estimates["pulse_gain"] > 0.0).all()


def test_what_was_learned_is_resumed(consecutive_runs):
    (run,) = consecutive_runs(PUBLISHED, 1)
    learned = PUBLISHED.learned(run.run.controller_state)
    resumed = PUBLISHED.resumed(learned)
    assert resumed.first_gain == run.estimates["pulse_gain"][-1]
    assert resumed.initial_covariance < PUBLISHED.initial_covariance
    assert PUBLISHED.resumed(learned, keep_covariance=False) == replace(
        PUBLISHED, first_gain=resumed.first_gain
    )


def test_what_cannot_be_resumed_is_refused():
    learned = PUBLISHED.learned(PUBLISHED.init())
    with refuses("learned_otherwise", own=300.0, needed=200.0):
        replace(PUBLISHED, pulse_effort=200.0).resumed(learned)
    with refuses("learned_lacks"):
        PUBLISHED.resumed(replace(learned, values={"effort": 300.0}))
    with refuses("not_positive", value=-1.0):
        PUBLISHED.resumed(replace(learned, values={"effort": 300.0, "pulse_gain": -1.0}))


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"pulse_effort": 0.0}, "not_positive"),
        ({"first_gain": -1.0}, "not_positive"),
        ({"gain": 0.0}, "not_in_interval"),
        ({"gain": 2.0}, "not_in_interval"),
        ({"gain": math.nan}, "not_in_interval"),
        ({"forgetting": 1.01}, "not_in_interval"),
        ({"forgetting": 0.0}, "not_in_interval"),
        ({"new_data_weight": 2.0}, "not_in_interval"),
        ({"longest_width": 0.009}, "pulse_below_sample"),
        ({"longest_width": math.inf}, "not_finite"),
        ({"initial_covariance": 0.0}, "not_positive"),
        ({"regressor": "best"}, "not_a_choice"),
        ({"max_idle_pulses": 0}, "not_whole"),
    ],
)
def test_impossible_settings_are_refused(wrong, code, without_shape_checks):
    with refuses(code, of=wrong):
        replace(PUBLISHED, **wrong)


@pytest.mark.parametrize(
    ("wrong", "code"),
    [
        ({"mass": 0.0}, "not_positive"),
        ({"coulomb_friction": -1.0}, "not_positive"),
        ({"coulomb_friction": 300.0}, "effort_below_breakaway"),
    ],
)
def test_pulses_that_cannot_overcome_the_friction_are_refused(wrong, code):
    values = {
        "mass": 150.0,
        "coulomb_friction": 80.0,
        "pulse_effort": 300.0,
        "sampling_time": T,
        "target": 0.01,
        "tolerance": 2e-5,
        "rest": IDEAL,
        **wrong,
    }
    with refuses(code, of=(*wrong, "pulse_effort")):
        PulseWidthController.from_friction(**values)
