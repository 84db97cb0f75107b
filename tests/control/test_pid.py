"""PID control: the linear loop against SciPy, limits, dither and resets."""

from dataclasses import replace
from math import inf, nan, pi, radians

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from refusals import refuses
from scipy import signal

from stickslip import CoulombViscousFriction, SensorSample, SingleMass
from stickslip.control import Dither, PIDController, ResetIntegral
from stickslip.simulation import ClosedLoopRun, simulate_closed_loop

ROUNDING = 1e-8
"""Relative, of SciPy's filters as ratios of polynomials, which have poles near 1. Found: 2e-9."""

T, MASS = 0.01, 150.0
SHAPED = PIDController.for_mass(
    sampling_time=T, target=0.01, mass=MASS, bandwidth=4.0, effort_limit=1e6
)
NOTHING = nan, nan, nan


def plain(**changes: object) -> PIDController:
    """A controller without derivative, of round numbers."""
    made = PIDController(
        sampling_time=T,
        target=0.0,
        position_gain=100.0,
        integral_gain=10.0,
        velocity_gain=0.0,
        effort_limit=1e6,
    )
    return replace(made, **changes)


def efforts(controller: PIDController, positions: list[float]) -> list[float]:
    """Return the efforts that a controller answers to measured positions."""
    state = controller.init()
    answered: list[float] = []
    for k, x in enumerate(positions):
        state, u = controller.step(state, SensorSample(k * T, x, *NOTHING))
        answered.append(u)
    return answered


def transfer(controller: PIDController) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return K_p + K_i/s + K_d s/(1 + tau s), sampled by SciPy's Tustin."""
    K_p, K_i, K_d = controller.position_gain, controller.integral_gain, controller.velocity_gain
    tau = controller.filter_time
    over = [K_p * tau + K_d, K_p + K_i * tau, K_i]
    return signal.bilinear(over, [tau, 1.0, 0.0], fs=1.0 / T)


@pytest.mark.parametrize(
    ("bandwidth", "margin", "ratio"),
    [(1.0, 60.0, 20.0), (4.0, 45.0, 10.0), (8.0, 30.0, 3.0), (16.0, 20.0, 10.0)],
)
def test_the_sampled_loop_has_the_crossover_and_the_margin_asked_for(
    bandwidth: float, margin: float, ratio: float
) -> None:
    controller = PIDController.for_mass(
        sampling_time=T, target=0.0, mass=MASS, bandwidth=bandwidth, effort_limit=1.0,
        phase_margin=radians(margin), integral_ratio=ratio,
    )  # fmt: skip
    plant = signal.cont2discrete(([1.0 / MASS], [1.0, 0.0, 0.0]), T, method="zoh")
    W = 2.0 * pi * bandwidth * T  # rad a sample
    _, of_plant = signal.freqz(plant[0].ravel(), plant[1], worN=[W])
    _, of_controller = signal.freqz(*transfer(controller), worN=[W])
    loop = complex(of_plant[0] * of_controller[0])
    assert abs(loop) == pytest.approx(1.0, rel=ROUNDING)
    assert np.degrees(np.angle(-loop)) == pytest.approx(margin, rel=ROUNDING)


def test_the_linear_loop_moves_as_scipy_computes_it() -> None:
    free = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
    run = simulate_closed_loop(
        SingleMass(mass=MASS, friction=free), SHAPED, sampling_time=T, samples=300
    )
    c = SHAPED
    over, a, _ = signal.cont2discrete(([1.0 / MASS], [1.0, 0.0, 0.0]), T, method="zoh")
    b = over.ravel()
    b_i, a_i = signal.bilinear([c.position_gain, c.integral_gain], [1.0, 0.0], fs=1.0 / T)
    b_d, a_d = signal.bilinear([c.velocity_gain, 0.0], [c.filter_time, 1.0], fs=1.0 / T)
    # PI acts on the error and D on the position alone; the integral begins with the first sample,
    # where SciPy's has already taken half a trapezoid of it: a constant effort less
    closed = np.convolve(a, np.convolve(a_i, a_d)) + np.convolve(
        b, np.convolve(b_i, a_d) + np.convolve(b_d, a_i)
    )
    target = np.full(301, c.target)
    half = 0.5 * c.integral_gain * T * target
    expected = signal.lfilter(np.convolve(b, np.convolve(b_i, a_d)), closed, target)
    expected -= signal.lfilter(np.convolve(b, np.convolve(a_i, a_d)), closed, half)
    assert np.abs(run.motion.position - expected).max() < ROUNDING * c.target


def test_integral_and_derivative_are_tustin_of_what_is_measured() -> None:
    positions = [0.0, 0.001, 0.003, 0.002, -0.001]
    controller = plain(velocity_gain=7.0, filter_time=0.02)
    v = signal.lfilter(*signal.bilinear([1.0, 0.0], [0.02, 1.0], fs=1.0 / T), positions)
    x = np.array(positions)
    integral = np.concatenate(([0.0], np.cumsum(-0.5 * (x[1:] + x[:-1]) * T)))
    expected = -100.0 * x + 10.0 * integral - 7.0 * v
    assert efforts(controller, positions) == pytest.approx(expected, rel=1e-12)


def test_a_measured_velocity_is_taken_as_it_is() -> None:
    controller = plain(velocity_gain=7.0, velocity="measured", integral_gain=0.0)
    _, u = controller.step(controller.init(), SensorSample(0.0, 0.02, 0.5, nan, nan))
    assert u == pytest.approx(-100.0 * 0.02 - 7.0 * 0.5, rel=1e-15)


def test_the_integral_waits_while_the_limit_holds_the_effort() -> None:
    controller = plain(effort_limit=50.0)
    answered = efforts(controller, [-1.0] * 1000 + [0.1])
    assert answered[:1000] == [50.0] * 1000
    # Nothing was wound up; half of the last trapezoid is still of the error before
    assert answered[-1] == pytest.approx(-10.0 + 10.0 * 0.5 * T * (1.0 - 0.1), rel=1e-12)


def test_the_integral_stands_still_in_the_dead_band() -> None:
    controller = plain(dead_band=0.01)
    assert efforts(controller, [0.009] * 50) == pytest.approx([-0.9] * 50, rel=1e-15)
    assert efforts(controller, [0.011] * 3)[-1] < -1.1


@given(
    positions=st.lists(st.floats(-10.0, 10.0), min_size=1, max_size=50),
    limit=st.floats(0.1, 1e4),
)
@settings(max_examples=60, deadline=None)
def test_neither_effort_nor_integral_leaves_the_limit(positions: list[float], limit: float) -> None:
    controller = plain(effort_limit=limit, position_gain=1.0)
    state = controller.init()
    most = 0.0
    for k, x in enumerate(positions):
        state, u = controller.step(state, SensorSample(k * T, x, *NOTHING))
        assert abs(u) <= limit
        most = max(most, abs(x))
        # It grows to where u meets the limit at the error of that sample
        assert abs(controller.integral_action(state)) <= limit + most


@pytest.mark.parametrize("frequency", [6.25, 12.5, 25.0])
def test_a_sine_has_one_line_and_a_square_wave_the_odd_ones(frequency: float) -> None:
    n = 160
    line = round(frequency * n * T)
    for shape in ("sine", "square"):
        dither = Dither(amplitude=30.0, frequency=frequency, shape=shape)  # type: ignore[arg-type]
        u = efforts(plain(dither=dither), [0.0] * n)
        spectrum = np.abs(np.fft.rfft(u)) / n
        lines = np.flatnonzero(spectrum > 1e-9)
        assert set(lines) == ({line} if shape == "sine" else set(range(line, n // 2 + 1, 2 * line)))
        if shape == "sine":
            assert spectrum[line] == pytest.approx(15.0, rel=1e-9)
        else:
            assert np.abs(u) == pytest.approx(30.0, rel=1e-15)


def test_the_fastest_dither_alternates() -> None:
    for shape in ("sine", "square"):
        dither = Dither(amplitude=30.0, frequency=50.0, shape=shape)  # type: ignore[arg-type]
        u = efforts(plain(dither=dither), [0.0] * 100)
        assert u == pytest.approx([30.0, -30.0] * 50, rel=1e-9)


def resetting(law: str, **changes: object) -> PIDController:
    rule = ResetIntegral(law=law, rest_speed=1e-3, rest_samples=1)  # type: ignore[arg-type]
    return plain(reset=replace(rule, **changes), velocity="measured", integral_gain=1000.0)


def fed(
    controller: PIDController, samples: list[tuple[float, float]]
) -> tuple[list[float], list[float]]:
    """Return efforts and integral actions after samples of position and velocity."""
    state = controller.init()
    answered, integrals = [], []
    for k, (x, v) in enumerate(samples):
        state, u = controller.step(state, SensorSample(k * T, x, v, nan, nan))
        answered.append(u)
        integrals.append(controller.integral_action(state))
    return answered, integrals


APPROACH = [(-0.05, 0.1)] * 20


def test_a_stop_beyond_the_target_turns_the_force_around() -> None:
    for factor in (1.0, 0.5):
        beyond = [*APPROACH, (0.01, 0.1), (0.011, 0.0)]
        without, _ = fed(plain(velocity="measured", integral_gain=1000.0), beyond)
        u, _ = fed(resetting("coulomb", factor=factor), beyond)
        assert u[:-1] == without[:-1]  # not while it moves
        assert without[-1] > 0.0  # away from the target
        assert u[-1] == pytest.approx(-factor * without[-1], rel=1e-12)


def test_a_stop_before_the_target_or_in_the_dead_band_resets_nothing() -> None:
    short = [*APPROACH, (-0.01, 0.0), (-0.01, 0.0)]
    free = plain(velocity="measured", integral_gain=1000.0)
    assert fed(resetting("coulomb"), short) == fed(free, short)
    near = [*APPROACH, (0.01, 0.0)]
    banded = replace(resetting("coulomb"), dead_band=0.02)
    assert fed(banded, near) == fed(replace(free, dead_band=0.02), near)


def test_a_crossing_turns_the_force_around_and_the_stop_after_it_empties_the_integral() -> None:
    passing = [*APPROACH, (0.01, 0.1), (0.012, 0.05), (0.013, 0.0)]
    without, _ = fed(plain(velocity="measured", integral_gain=1000.0), passing)
    u, integral = fed(resetting("stribeck"), passing)
    crossed = len(APPROACH)
    assert u[:crossed] == without[:crossed]
    assert u[crossed] == pytest.approx(-without[crossed], rel=1e-12)
    assert integral[-1] == 0.0
    assert u[-1] == pytest.approx(-100.0 * 0.013, rel=1e-12)


def test_a_rest_that_follows_no_crossing_does_not_empty_the_integral() -> None:
    resting = [(-0.05, 0.0)] * 10
    free = plain(velocity="measured", integral_gain=1000.0)
    assert fed(resetting("stribeck"), resting) == fed(free, resting)


def test_noise_about_the_target_at_rest_is_no_crossing() -> None:
    about = [(-1e-6, 0.0), (1e-6, 0.0), (-1e-6, 0.0), (1e-6, 0.0)]
    free = plain(velocity="measured", integral_gain=1000.0)
    assert fed(resetting("stribeck"), about) == fed(free, about)


# What the literature says of the two laws, on an axis that is sampled finely and without noise

FINE = 1e-3


def on_axis(static: float, law: str | None) -> ClosedLoopRun[NDArray[np.float64]]:
    friction = CoulombViscousFriction.symmetric(
        coulomb_friction=100.0, viscous_friction=0.0, static_friction=static
    )
    rule = None
    if law is not None:
        rule = ResetIntegral(law=law, rest_speed=1e-6, rest_samples=1)  # type: ignore[arg-type]
    controller = PIDController.for_mass(
        sampling_time=FINE, target=0.01, mass=MASS, bandwidth=4.0, effort_limit=300.0,
        integral_ratio=3.0,
    )  # fmt: skip
    return simulate_closed_loop(
        SingleMass(mass=MASS, friction=friction),
        replace(controller, velocity="measured", reset=rule),
        sampling_time=FINE,
        samples=60_000,
    )


def settling(run: ClosedLoopRun[NDArray[np.float64]], tolerance: float = 2e-5) -> float:
    outside = np.flatnonzero(np.abs(0.01 - run.motion.position) > tolerance)
    return float(outside[-1] + 1) * FINE if outside.size else 0.0


def test_with_coulomb_friction_alone_resets_spare_a_rest() -> None:
    assert settling(on_axis(100.0, "coulomb")) < 0.8 * settling(on_axis(100.0, None)) < 5.0


def test_with_static_friction_the_law_for_it_ends_the_hunting_and_the_other_speeds_it_up() -> None:
    def breakaways(run: ClosedLoopRun[NDArray[np.float64]]) -> int:
        late = run.motion.event_time > 30.0
        return int((run.motion.event_mode[late] != 0).sum())

    plain_run, coulomb, stribeck = (on_axis(130.0, law) for law in (None, "coulomb", "stribeck"))
    assert settling(plain_run) > 59.0
    assert settling(coulomb) > 59.0
    assert breakaways(coulomb) > 2 * breakaways(plain_run) > 0
    assert settling(stribeck) < 5.0


def test_a_step_leaves_the_state_it_was_given() -> None:
    state = SHAPED.init()
    before = state.copy()
    after, _ = SHAPED.step(state, SensorSample(0.0, 0.001, *NOTHING))
    assert np.array_equal(state, before)
    assert not np.array_equal(after, before)


def test_a_sample_that_is_not_finite_changes_nothing() -> None:
    for controller, sample in (
        (SHAPED, SensorSample(0.0, nan, *NOTHING)),
        (SHAPED, SensorSample(0.0, inf, *NOTHING)),
        (replace(SHAPED, velocity="measured"), SensorSample(0.0, 0.0, *NOTHING)),
    ):
        state, effort = controller.step(controller.init(), sample)
        assert np.isnan(effort)
        assert np.array_equal(state, controller.init())


def test_a_new_target_keeps_the_integral() -> None:
    controller = plain()
    state = controller.init()
    for k in range(10):
        state, _ = controller.step(state, SensorSample(k * T, -0.1, *NOTHING))
    integral = controller.integral_action(state)
    assert integral > 0.0
    moved = controller.retargeted(state, -0.1)
    assert controller.integral_action(moved) == integral
    _, u = controller.step(moved, SensorSample(0.1, -0.1, *NOTHING))
    assert u == pytest.approx(integral, rel=1e-12)
    with refuses("not_finite", name="target"):
        controller.retargeted(state, nan)


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"position_gain": 0.0}, "not_positive"),
        ({"integral_gain": -1.0}, "negative"),
        ({"velocity_gain": nan}, "not_finite"),
        ({"target": inf}, "not_finite"),
        ({"effort_limit": 0.0}, "not_positive"),
        ({"dead_band": -1e-6}, "negative"),
        ({"filter_time": -1.0}, "negative"),
        ({"velocity_gain": 7.0}, "derivative_without_filter"),
        (
            {"dither": Dither(amplitude=1.0, frequency=51.0, shape="sine")},
            "frequency_above_nyquist",
        ),
    ],
)
def test_settings_out_of_range_are_refused(changes: dict[str, object], code: str) -> None:
    with refuses(code, of=changes):
        plain(**changes)


@pytest.mark.parametrize(("bandwidth", "margin"), [(16.0, 60.0), (50.0, 10.0), (60.0, 10.0)])
def test_a_loop_that_cannot_be_shaped_is_refused(bandwidth: float, margin: float) -> None:
    with refuses("bandwidth_too_high", sampling_time=0.01):
        PIDController.for_mass(
            sampling_time=T, target=0.0, mass=MASS, bandwidth=bandwidth, effort_limit=1.0,
            phase_margin=radians(margin),
        )  # fmt: skip


@pytest.mark.usefixtures("without_shape_checks")
def test_words_and_parts_that_are_none_of_the_known_are_refused() -> None:
    with refuses("not_a_choice", name="velocity", value="guessed"):
        plain(velocity="guessed")
    with refuses("wrong_type", name="reset", found="Dither"):
        plain(reset=Dither(amplitude=1.0, frequency=1.0, shape="sine"))


def test_parts_out_of_range_are_refused() -> None:
    with refuses("not_positive", name="amplitude", value=0.0):
        Dither(amplitude=0.0, frequency=1.0, shape="sine")
    with refuses("not_positive", name="frequency", value=-1.0):
        Dither(amplitude=1.0, frequency=-1.0, shape="sine")
    with refuses("not_a_choice", name="shape", value="saw"):
        Dither(amplitude=1.0, frequency=1.0, shape="saw")  # type: ignore[arg-type]
    rule = ResetIntegral(law="coulomb", rest_speed=1e-3, rest_samples=1)
    for changes, code in (
        ({"law": "lugre"}, "not_a_choice"),
        ({"rest_speed": 0.0}, "not_positive"),
        ({"rest_samples": 0}, "not_whole"),
        ({"factor": 1.5}, "out_of_range"),
    ):
        with refuses(code, of=changes):
            replace(rule, **changes)


@pytest.mark.parametrize("state", [np.zeros(3), np.zeros(SHAPED.init().size)])
def test_a_vector_that_is_no_state_is_refused(state):
    with pytest.raises(ValueError, match="not a state of a PIDController"):
        SHAPED.step(state, SensorSample(0.0, 0.0, *NOTHING))
