"""Maximum likelihood with process noise: its likelihood, derivatives, bound and recovery."""

from dataclasses import replace

import numpy as np
import pytest
from axis_logs import axis_log
from estimates import std_of
from scipy.linalg import expm
from scipy.stats import multivariate_normal

from stickslip.estimation import (
    NoiseLevels,
    ProcessNoiseLikelihoodEstimator,
    SelectedModelEstimator,
    examine,
    process_noise_bound,
)
from stickslip.estimation.likelihood.axis_parameters import SoughtParameters
from stickslip.estimation.likelihood.process_noise.problem import (
    LogPart,
    Problem,
    SlipSegment,
    Tuning,
    averages_of,
    first_guess,
    parts_of,
    problem_of,
)
from stickslip.estimation.likelihood.process_noise.search import (
    ROUGHNESS,
    Maximum,
    evaluate,
    maximise,
)
from stickslip.estimation.likelihood.process_noise.slip_filter import SlipModel, slip_model
from stickslip.estimation.likelihood.process_noise.uncertainty import (
    compare_with_windows,
    covariance_of,
    shift_by_low_speed,
    whiteness_probability,
)
from stickslip.records import AxisLog, Status

T = 0.01
NAMES = ("mass", "viscous_friction", "coulomb_friction", "offset", "effort_delay")
VALUES = np.array([2.0, 3.0, 1.5, 0.2, 0.004])
LEVELS = np.log([1e-4, 0.04, 30.0, 0.02, 0.09, 0.15, 1e-3])
DENSE_TOLERANCE = 1e-6  # relative; a diffuse start of 1e4 units costs eight digits
DIFFERENCE_TOLERANCE = 2e-5  # relative; central differences of a step of 1e-5


def segment(samples: int, *, seed: int = 1, both: bool = True) -> SlipSegment:
    """Return a record of arbitrary measurements, with a load and a gap before the second half.

    The second half slips the other way, or not surely.
    """
    generator = np.random.default_rng(seed)
    n = samples
    direction = np.ones(n, dtype=np.int64)
    direction[n // 2 - 2 : n // 2 + 1] = 0
    direction[n // 2 + 1 :] = -1 if both else 0
    signals = generator.standard_normal((5, n))
    return SlipSegment(
        time=T * np.arange(n),
        effort=3.0 * signals[0],
        feedback=0.3 * signals[1],
        position=0.05 * np.cumsum(signals[2]),
        velocity=0.2 * signals[3],
        usable=np.ones(n, dtype=bool),
        direction=direction,
        jumps=np.zeros(n, dtype=bool),
        smooth_velocity=signals[3],
        smooth_acceleration=signals[4],
        smooth_effort=signals[0],
        loads=np.zeros((n, 0)),
    )


def problem(*segments: SlipSegment, sought: tuple[str, ...] = NAMES) -> Problem:
    return Problem(
        segments=list(segments),
        sought=SoughtParameters(names=sought, known={}),
        mass_name="mass",
        sampling_time=T,
        averaged=1,
        speed=20.0,
        effort_rate=200.0,
        prior=LEVELS,
        prior_spread=np.ones(LEVELS.size),
    )


def model_of(values: np.ndarray, *, ramped: bool = False) -> SlipModel:
    sought = SoughtParameters(names=NAMES, known={})
    r = float(np.exp(-T / np.exp(LEVELS[5])))
    return slip_model(
        sought, values, mass_name="mass", sampling_time=T, correlation=r, ramped=ramped
    )


def dense_moments(
    part: SlipSegment, values: np.ndarray, load: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return measurements, mean and covariance of the first stretch, slipping forwards.

    From the continuous equations: the states are (x, v, d, u, u') by the matrix exponential of the
    axis with a held force. The load is a coefficient of the column of loads.
    """
    m, c, fc, f0, delay = values
    level = np.exp(LEVELS)
    n = int(np.argmin(part.direction))
    rate = np.array([[0.0, 1.0, 0.0], [0.0, -c / m, 1.0 / m], [0.0, 0.0, 0.0]])
    over = expm(rate * T)
    b = np.append(over[:2, 2], np.zeros(3))
    r = np.exp(-T / level[5])
    A = np.zeros((5, 5))
    A[:2, :2], A[:2, 2], A[:2, 3] = over[:2, :2], b[:2], b[:2]
    A[2, 2], A[3, 3], A[3, 4], A[4, 4] = r, 1.0, T, 1.0
    Q = level[3] * np.outer(b, b)
    Q[2, 2] += level[4] * (1.0 - r * r)
    Q[4, 4] += level[2] * T
    mean, cov = np.zeros(5 * n), np.zeros((5 * n, 5 * n))
    effort = part.effort - part.feedback
    mean[0], mean[3] = part.position[0], effort[0]
    cov[:5, :5] = np.diag([level[0], 20.0**2, level[4], level[1], 200.0**2])
    for k in range(1, n):
        new, last, old = slice(5 * k, 5 * k + 5), slice(5 * k - 5, 5 * k), slice(0, 5 * k)
        known = part.feedback[k - 1] - fc - f0 - load * part.loads[k - 1, 0]
        mean[new] = A @ mean[last] + b * known
        cov[new, old] = A @ cov[last, old]
        cov[old, new] = cov[new, old].T
        cov[new, new] = A @ cov[last, last] @ A.T + Q
    H, y, noise = [], [], []
    for k in range(n):
        rows = ((0, [1.0, 0, 0, 0, 0]), (1, [0, 0, 0, 1.0, delay]), (2, [0, 1.0, 0, 0, 0]))
        for c_, row in rows:
            if k == 0 and c_ < 2:
                continue  # the first position and effort start the stretch
            wide = np.zeros(5 * n)
            wide[5 * k : 5 * k + 5] = row
            H.append(wide)
            y.append((part.position, effort, part.velocity)[c_][k])
            noise.append((level[0], level[1], level[6])[c_])
    H = np.array(H)
    return np.array(y), H @ mean, H @ cov @ H.T + np.diag(noise)


@pytest.mark.parametrize("coefficient", [0.0, 0.7])
def test_likelihood_and_information_are_those_of_the_dense_covariance(coefficient: float) -> None:
    load = np.random.default_rng(7).standard_normal((24, 1))
    part = replace(segment(24, both=False), loads=load)
    y, mean, cov = dense_moments(part, VALUES, coefficient)
    found = evaluate(
        problem(part, sought=(*NAMES, "spring_stiffness")), np.append(VALUES, coefficient), LEVELS
    )
    expected = -2.0 * multivariate_normal(mean, cov, allow_singular=True).logpdf(y)
    expected -= y.size * np.log(2.0 * np.pi)
    assert found.logs + found.gram[0, 0] == pytest.approx(expected, rel=DENSE_TOLERANCE)
    # The linear parameters: Coulomb friction, offset and the load
    units = np.eye(VALUES.size)
    columns = [dense_moments(part, VALUES + units[j], coefficient)[1] - mean for j in (2, 3)]
    columns.append(dense_moments(part, VALUES, coefficient + 1.0)[1] - mean)
    X, at = np.array(columns).T, [3, 4, 6]
    information = X.T @ np.linalg.solve(cov, X)
    np.testing.assert_allclose(found.gram[np.ix_(at, at)], information, rtol=DENSE_TOLERANCE)
    score = X.T @ np.linalg.solve(cov, y - mean)
    np.testing.assert_allclose(found.gram[0, at], score, rtol=1e-4)  # of a diffuse start


def test_covariance_holds_the_shift_by_another_roughness() -> None:
    log, _ = closed_loop(7, effort_noise=0.3, disturbance=0.2)
    whole, maximum = fitted(log)
    assert maximum.converged
    at_maximum = evaluate(whole, maximum.values, maximum.levels)
    plain, _ = covariance_of(whole, at_maximum, 0.0)
    wide, _ = covariance_of(whole, at_maximum, 2.0)
    ends = []
    for h in (-0.01, 0.01):
        levels, values = maximum.levels.copy(), maximum.values
        levels[ROUGHNESS] += h
        for _ in range(8):
            values = values + evaluate(whole, values, levels, changes="none").parameter_step()
        ends.append(values)
    shift = 2.0 * (ends[1] - ends[0]) / 0.02
    gained = np.sqrt(np.diag(wide - plain))
    assert gained[0] == pytest.approx(abs(shift[0]), rel=0.05)  # mass: the largest by far


def test_derivatives_by_noise_levels_are_those_of_differences() -> None:
    whole = problem(segment(60), segment(40, seed=2))
    found = evaluate(whole, VALUES, LEVELS)
    cost = found.restricted()
    gradient = found.likelihood_change() + found.determinant_change()
    assert np.isfinite(cost)
    alone = evaluate(whole, VALUES, LEVELS, changes="innovations")
    np.testing.assert_allclose(alone.likelihood_change(), found.likelihood_change())
    np.testing.assert_allclose(alone.information, found.information)
    for a in range(LEVELS.size):
        h = 1e-5 * np.eye(LEVELS.size)[a]
        up, down = (evaluate(whole, VALUES, LEVELS + sign * h) for sign in (1, -1))
        np.testing.assert_allclose(
            found.gram_change[a],
            (up.gram - down.gram) / 2e-5,
            rtol=DIFFERENCE_TOLERANCE,
            atol=DIFFERENCE_TOLERANCE * np.abs(found.gram_change[a]).max(),
        )
        difference = (up.restricted() - down.restricted()) / 2e-5
        assert gradient[a] == pytest.approx(
            difference, rel=DIFFERENCE_TOLERANCE, abs=1e-9 * abs(cost) / 1e-5
        )


def innovations_at_fixed_gain(
    part: SlipSegment, gains: list[np.ndarray], values: np.ndarray
) -> np.ndarray:
    """Return the innovations of a stretch from its first sample on, with given gains."""
    model = model_of(values)
    H = np.zeros((3, 5))
    H[0, 0], H[1, 3], H[1, 4], H[2, 1] = 1.0, 1.0, model.fraction, 1.0
    y = part.record(0, np.zeros(0)).measured
    z = np.array([y[0, 0], 0.0, 0.0, y[0, 1], 0.0])
    errors = np.zeros((len(gains), 3))
    for k, gain in enumerate(gains):
        for c in range(3):
            if k == 0 and c < 2:
                continue
            errors[k, c] = y[k, c] - H[c] @ z
            z = z + gain[c] * errors[k, c]
        z = model.A[0] @ z + model.G[0, 0] + model.B[0, 0] * part.feedback[k]
    return errors


def test_derivatives_by_parameters_are_those_of_differences_at_fixed_gain() -> None:
    n = 30
    part = replace(segment(n), direction=np.ones(n, dtype=np.int64))
    level, model = np.exp(LEVELS), model_of(VALUES)
    A, b, r = model.A[0], model.B[0, 0], model.A[0, 2, 2]
    Q = level[3] * np.outer(b, b) + np.diag([0, 0, level[4] * (1 - r * r), 0, level[2] * T])
    H = np.zeros((3, 5))
    H[0, 0], H[1, 3], H[1, 4], H[2, 1] = 1.0, 1.0, VALUES[4], 1.0
    P = np.diag([level[0], 20.0**2, level[4], level[1], 200.0**2])
    gains, variances = [], []
    for k in range(n):
        gain, variance = np.zeros((3, 5)), np.ones(3)
        for c, noise in enumerate((level[0], level[1], level[6])):
            if k == 0 and c < 2:
                continue
            variance[c] = H[c] @ P @ H[c] + noise
            gain[c] = P @ H[c] / variance[c]
            P = P - np.outer(gain[c], gain[c]) * variance[c]
        gains.append(gain)
        variances.append(variance)
        P = A @ P @ A.T + Q
    root = np.sqrt(np.array(variances))
    found = evaluate(problem(part), VALUES, LEVELS, with_rows=True).rows[0]
    np.testing.assert_allclose(
        found[:, :, 0], innovations_at_fixed_gain(part, gains, VALUES) / root, atol=1e-6
    )
    for j in range(VALUES.size):
        h = 1e-5 * np.eye(VALUES.size)[j]
        up, down = (innovations_at_fixed_gain(part, gains, VALUES + s * h) for s in (1, -1))
        expected = -(up - down) / 2e-5 / root
        np.testing.assert_allclose(
            found[:, :, 1 + j], expected, atol=DIFFERENCE_TOLERANCE * np.abs(expected).max()
        )


@pytest.mark.parametrize("ramped", [False, True], ids=["held", "ramped"])
def test_model_is_the_exact_discretisation(ramped: bool) -> None:
    m, c = VALUES[:2]
    rate = np.zeros((4, 4))  # x, v, u, u'
    rate[0, 1], rate[1, 1], rate[1, 2] = 1.0, -c / m, 1.0 / m
    rate[2, 3] = float(ramped)
    over = expm(rate * T)
    model = model_of(VALUES, ramped=ramped)
    np.testing.assert_allclose(model.B[0, 0, :2], over[:2, 2], rtol=1e-13)
    over[2, 3] = T
    found = model.A[0][np.ix_((0, 1, 3, 4), (0, 1, 3, 4))]
    np.testing.assert_allclose(found, over, rtol=1e-12, atol=1e-18)
    assert (model.shift, model.fraction) == (0, VALUES[4])
    for j in (0, 1):
        h = 1e-5 * np.eye(VALUES.size)[j]
        up, down = (model_of(VALUES + s * h, ramped=ramped).A for s in (1, -1))
        change = model.A_p[:, j]
        np.testing.assert_allclose(
            change, (up - down) / 2e-5, atol=DIFFERENCE_TOLERANCE * np.abs(change).max()
        )


def fitted(
    log: AxisLog, *, names: tuple[str, ...] = NAMES[:4], averaged: int = 1
) -> tuple[Problem, Maximum]:
    """Return the problem of a log with its maximum, without a selection of terms."""
    whole = problem_of(
        parts_of(log),
        "linear",
        log.sampling_time,
        sought=names,
        known={},
        tuning=Tuning(),
        averaged=averaged,
    )
    assert whole is not None
    return whole, maximise(whole, first_guess(whole, (0,)), Tuning(), most=40)


def closed_loop(
    seed: int,
    *,
    effort_noise: float = 0.0,
    disturbance: float = 0.0,
    mass: float = 2.0,
    spring: float = 0.0,
) -> tuple[AxisLog, AxisLog]:
    """Return a log of a PD loop around an axis that never stops, and the same without noise.

    Steps of a tenth of a sample; the direction changes by a large acceleration.
    """
    generator = np.random.default_rng(seed)
    n, fine, dt = 3000, 10, 1e-3
    t = dt * np.arange(n)
    reference = 0.1 * np.sin(2.0 * np.pi * 0.7 * t) + 0.03 * np.sin(2.0 * np.pi * 1.9 * t)
    x, v, d = float(reference[0]), 0.2, 0.0
    r = np.exp(-dt / 0.05)
    true_x, read, effort = np.empty(n), np.empty(n), np.empty(n)
    step, before = 1e-6, 0.0
    for k in range(n):
        reading = round(x / step) * step
        rate = (reference[k] - reading - before) / dt if k else 0.0
        before = reference[k] - reading
        u = 8000.0 * before + 100.0 * rate
        true_x[k], read[k], effort[k] = x, reading, u
        for _ in range(fine):
            h = dt / fine
            force = u + d - 4.0 * v - 1.0 * np.sign(v) - 0.3 - spring * x
            x, v = x + h * v + 0.5 * h * h * force / mass, v + h * force / mass
        d = r * d + disturbance * np.sqrt(1.0 - r * r) * generator.standard_normal()
    log = axis_log(t, effort + effort_noise * generator.standard_normal(n), read)
    return log, replace(log, effort=effort, measured_position=true_x)


def test_means_are_those_of_samples_and_loads_of_the_step_that_follows() -> None:
    part = LogPart(
        time=np.arange(8.0),
        effort=np.arange(8.0),
        position=np.arange(8.0) ** 2,
        velocity=None,
        usable=np.arange(8) != 4,
        loads=np.arange(8.0)[:, None],
    )
    found = averages_of(part, 3)
    np.testing.assert_array_equal(found.time, [0.0, 3.0])
    np.testing.assert_array_equal(found.effort, [1.0, 4.0])
    np.testing.assert_allclose(found.position, [5.0 / 3.0, 50.0 / 3.0])
    np.testing.assert_array_equal(found.usable, [True, False])
    np.testing.assert_array_equal(found.loads, [[2.5], [4.0]])


TRUTH = {"mass": 2.0, "viscous_friction": 4.0, "coulomb_friction": 1.0, "offset": 0.3}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("noise", "disturbance"), [(0.6, 0.0), (0.02, 0.2)], ids=["log noise", "force"]
)
def test_mass_is_not_attenuated_in_closed_loop(noise: float, disturbance: float) -> None:
    errors = []
    for seed in range(12):
        log, clean = closed_loop(seed, effort_noise=noise, disturbance=disturbance)
        estimate = ProcessNoiseLikelihoodEstimator().fit(log)
        bound = process_noise_bound(
            clean,
            TRUTH,
            NoiseLevels(
                effort=noise,
                correlated_force=disturbance,
                time_constant=0.05,
                position=1e-6 / np.sqrt(12.0),
            ),
        )
        errors.append([(estimate.value(name) - TRUTH[name]) / bound.std[name] for name in TRUTH])
    # Of 12 standard normal numbers: 0.1 % quantiles of their mean and of their rms
    assert np.all(np.abs(np.mean(errors, axis=0)) < 1.2 * 3.3 / np.sqrt(12.0))
    assert np.all(np.sqrt(np.mean(np.square(errors), axis=0)) < 1.2 * np.sqrt(32.9 / 12.0))


def test_delay_of_the_effort_is_estimated_with_its_fraction() -> None:
    log, _ = closed_loop(3, effort_noise=0.05)
    early = np.concatenate((log.effort[3:], np.full(3, log.effort[-1])))
    half = 0.5 * (early + np.concatenate((early[1:], early[-1:])))
    estimate = ProcessNoiseLikelihoodEstimator(largest_delay=6).fit(replace(log, effort=half))
    assert estimate.diagnostics.effort_delay in {3, 4}
    assert any("the effort acts 3." in note for note in estimate.diagnostics.notes)
    assert estimate.value("mass") == pytest.approx(2.0, rel=0.01)


def test_means_of_samples_hold_the_same_parameters_and_no_delay() -> None:
    log, _ = closed_loop(13, effort_noise=0.3)
    whole, maximum = fitted(log, names=NAMES, averaged=4)
    assert whole.sampling_time == pytest.approx(4.0 * log.sampling_time)
    # Moves of a smooth controller between nodes: means of 4 are known to bias by a part of this
    np.testing.assert_allclose(maximum.values[:4], list(TRUTH.values()), rtol=0.05)
    assert maximum.values[0] == pytest.approx(2.0, rel=0.01)
    assert abs(maximum.values[4]) < 0.25 * log.sampling_time  # without their lag it is half of one


@pytest.mark.slow
def test_means_are_used_where_the_model_does_not_hold_for_fast_motion() -> None:
    log, _ = closed_loop(9, effort_noise=0.3)
    ringing = 2e-5 * np.sin(2.0 * np.pi * 90.0 * log.time) * np.sin(2.0 * np.pi * log.time)
    rings = replace(log, measured_position=log.measured_position + ringing)
    windows = SelectedModelEstimator().fit(rings)
    widths = []
    for tolerated, means in ((4.0, False), (0.5, True)):  # the intervals widen by a factor of 2
        tuning = Tuning(tolerated_widening=tolerated)
        found = ProcessNoiseLikelihoodEstimator(tuning=tuning).fit(rings)
        assert any(note.startswith("means of") for note in found.diagnostics.notes) is means
        assert found.status is Status.OK
        for name, true in TRUTH.items():
            ends = found.parameters[name].ci95
            assert ends is not None
            assert ends[0] < true < ends[1], name
            if means:
                assert ends[0] <= windows.value(name) <= ends[1], name
        widths.append(std_of(found, "mass"))
    assert widths[1] < widths[0]


def test_friction_at_low_speed_that_the_model_lacks_widens_the_intervals() -> None:
    log, _ = closed_loop(14, effort_noise=0.1)
    for rise, widened in ((0.0, False), (0.5, True)):
        speed = np.gradient(log.measured_position, log.time)
        scale = Tuning().low_speed_share * np.max(np.abs(speed))
        force = rise * np.sign(speed) * np.exp(-np.abs(speed) / scale)
        whole, maximum = fitted(replace(log, effort=log.effort + force))
        shift = shift_by_low_speed(whole, maximum, Tuning())
        assert (shift is not None) is widened
        if shift is not None:
            error = maximum.values - np.array(list(TRUTH.values()))
            np.testing.assert_allclose(shift[1:3], -error[1:3], rtol=0.5)  # viscous, Coulomb


def test_known_mass_and_friction_per_direction() -> None:
    log, _ = closed_loop(4, effort_noise=0.1)
    estimate = ProcessNoiseLikelihoodEstimator(inertia=2.0, per_direction=True).fit(log)
    assert set(estimate.parameters) == {
        "coulomb_friction_positive",
        "coulomb_friction_negative",
        "viscous_friction_positive",
        "viscous_friction_negative",
    }
    assert estimate.status is Status.OK
    assert estimate.value("coulomb_friction_positive") == pytest.approx(1.3, abs=0.15)
    assert estimate.value("coulomb_friction_negative") == pytest.approx(0.7, abs=0.15)


def test_spring_that_the_selection_finds_is_part_of_the_model() -> None:
    log, _ = closed_loop(9, effort_noise=0.3, spring=40.0)
    estimate = ProcessNoiseLikelihoodEstimator().fit(log)
    assert estimate.status is Status.OK
    for name, true in (TRUTH | {"spring_stiffness": 40.0}).items():
        assert abs(estimate.value(name) - true) < 4.0 * std_of(estimate, name), name
    bare = ProcessNoiseLikelihoodEstimator(select=False).fit(log)
    assert "spring_stiffness" not in bare.parameters


def test_glitches_are_repaired() -> None:
    log, _ = closed_loop(10, effort_noise=0.3)
    clean = ProcessNoiseLikelihoodEstimator().fit(log)
    position = log.measured_position.copy()
    position[1000:1002] += 0.05
    spoiled = ProcessNoiseLikelihoodEstimator().fit(replace(log, measured_position=position))
    for name, found in clean.parameters.items():
        assert found.std is not None
        assert spoiled.value(name) == pytest.approx(clean.value(name), abs=0.5 * found.std)
    assert any("glitches" in note for note in spoiled.diagnostics.notes)


def test_estimates_that_differ_from_those_of_windows_are_named() -> None:
    log, _ = closed_loop(11, effort_noise=0.3)
    own = ProcessNoiseLikelihoodEstimator().fit(log)
    windows = SelectedModelEstimator().fit(log)
    values = {name: own.value(name) for name in own.parameters}
    std = {name: p.std or 0.0 for name, p in own.parameters.items()}
    other = windows.parameters["mass"]
    assert other.std is not None
    spread = float(np.hypot(std["mass"], other.std))
    for deviations, named in ((3.0, False), (4.0, True)):  # 3.66 at 0.1 % over four parameters
        moved = values | {"mass": (other.value or 0.0) + deviations * spread}
        found = compare_with_windows(moved, std, windows, 1e-3)
        assert any(cause.startswith("mass is") for cause in found.causes) is named
        assert found.differences["mass"] == pytest.approx(deviations * spread)


def test_report_shows_residuals_and_resimulation() -> None:
    log, _ = closed_loop(12, effort_noise=0.3)
    shown = examine(log, ProcessNoiseLikelihoodEstimator())
    assert shown.residuals is not None
    assert shown.curve is not None
    assert shown.resimulation is not None
    with_spring, _ = closed_loop(9, effort_noise=0.3, spring=40.0)
    shown = examine(with_spring, ProcessNoiseLikelihoodEstimator())
    assert shown.evolution is not None
    assert shown.curve is None


def test_notes_name_the_noise_levels() -> None:
    log, _ = closed_loop(5, effort_noise=0.5)
    (note,) = [
        note
        for note in ProcessNoiseLikelihoodEstimator().fit(log).diagnostics.notes
        if note.startswith("estimated noise levels")
    ]
    level = float(note.split("effort noise ")[1].split()[0])
    assert level == pytest.approx(0.5, rel=0.1)


def test_too_little_motion_is_a_status() -> None:
    log, _ = closed_loop(6)
    estimate = ProcessNoiseLikelihoodEstimator().fit(log.part(0, 30))
    assert estimate.status is Status.INSUFFICIENT_EXCITATION


def test_whiteness_probability_is_uniform_for_white_noise_and_small_for_red() -> None:
    generator = np.random.default_rng(8)
    p = [whiteness_probability(generator.standard_normal(2000)) for _ in range(200)]
    assert 0.01 < np.mean(np.array(p) < 0.1) < 0.2
    red = np.cumsum(generator.standard_normal(2000)) * 0.05 + generator.standard_normal(2000)
    assert whiteness_probability(red) < Tuning().whiteness_level
