"""The estimate of an arm after a series that was simulated exactly."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from refusals import refuses
from scipy.stats import chi2

from stickslip.control.landing.arm_belief import LEARNED, ArmBelief, FlightLog, check_learned
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm
from stickslip.records import LearnedPulses
from stickslip.simulation import simulate

T = 0.02
SAMPLES = 180
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.3, stiffness=0.9, friction=LAW)
TRUTH = np.array([1.0, 1.3, 0.9, 0.15, 0.1])
UNCERTAINTY = 0.02
POSITION_NOISE, VELOCITY_NOISE = 1e-4, 1e-3
# A fit of numbers with 1e-8 of the way as their error, through half a dozen digits of conditioning
EXACT = 1e-7
CHANGED = 1e-6  # as exact, with a first estimate that holds against it
TRIALS = 40
SURELY = 1e-5  # of one run in 100 000 a statistic of as many trials is beyond its bound


def effort() -> np.ndarray:
    """Return a series that moves mass 1 on all the time, forward."""
    k = np.arange(SAMPLES)
    return 0.45 + 0.2 * np.sin(0.11 * k) + 0.1 * np.sin(0.31 * k)


def flown(
    start: tuple[float, float, float, float] = (0.2, 0.0, 0.23, -0.02),
    *,
    force: np.ndarray | None = None,
    generator: np.random.Generator | None = None,
    way: float = 1.0,
    arm: FlexibleArm = ARM,
    expected: np.ndarray | None = None,
) -> FlightLog:
    """Return the log of a series on the true arm; the swing at its begin is the true one."""
    force = effort() if force is None else force
    begin = tuple(way * each for each in start)
    motion = simulate(arm, way * force, sampling_time=T, initial_state=begin)
    assert motion.load_position is not None
    assert motion.load_velocity is not None
    seen = np.column_stack(
        (motion.position, motion.velocity, motion.load_position, motion.load_velocity)
    )
    if generator is not None:
        noise = (POSITION_NOISE, VELOCITY_NOISE, POSITION_NOISE, VELOCITY_NOISE)
        seen = seen + generator.normal(size=seen.shape) * noise
    noisy = generator is not None
    return FlightLog(
        start=begin,  # type: ignore[arg-type]
        effort=way * force,
        expected_velocity=motion.velocity if expected is None else expected,
        seen=seen,
        sampling_time=T,
        position_noise=POSITION_NOISE * noisy,
        velocity_noise=VELOCITY_NOISE * noisy,
    )


def belief(generator: np.random.Generator | None = None, **settings: Any) -> ArmBelief:
    """Return a first estimate, drawn from its own covariance or off in every value."""
    spread = np.array([1.0, 1.0, 1.0, 6.0, 6.0]) * UNCERTAINTY
    off = np.array([1.0, -1.0, 1.0, 2.0, -3.0]) * UNCERTAINTY
    if generator is not None:
        off = spread * generator.normal(size=5)
    m1, m2, ks, fc, c = (TRUTH * np.exp(off)).tolist()
    usual: dict[str, Any] = {
        "uncertainty": UNCERTAINTY,
        "coulomb_friction": fc,
        "viscous_friction": c,
        "covariance": np.zeros((2, 2)),
    }
    return ArmBelief.first(replace(ARM, mass_1=m1, mass_2=m2, stiffness=ks), **(usual | settings))


def found(after: ArmBelief) -> np.ndarray:
    return np.array([after.values[name] for name in LEARNED])


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_an_exact_series_determines_all_five(way: float) -> None:
    after = belief().after(flown(way=way))
    np.testing.assert_allclose(found(after), TRUTH, rtol=EXACT)
    assert np.sqrt(np.diag(after.covariance)).max() < 1e-3 * UNCERTAINTY
    assert after.deviations["mass"] == pytest.approx(np.sqrt(after.covariance[0, 0]), rel=EXACT)


def test_a_swing_that_was_fitted_with_wrong_masses_is_corrected_too() -> None:
    exact = flown()
    x1, v1, x2, v2 = exact.start
    fitted = replace(exact, start=(x1, v1, x2 + 2e-4, v2 - 2e-4))
    np.testing.assert_allclose(found(belief().after(fitted)), TRUTH, rtol=EXACT)


@pytest.mark.slow
def test_with_noise_the_errors_agree_with_the_covariance() -> None:
    """The sum of squares over the stated covariance is chi-squared distributed."""
    generator = np.random.default_rng(11)
    total, shrunk = 0.0, []
    for _ in range(TRIALS):
        after = belief(generator).after(flown(generator=generator))
        off = np.log(found(after) / TRUTH)
        total += float(off @ np.linalg.solve(after.covariance, off))
        shrunk.append(np.sqrt(np.diag(after.covariance)))
    low, high = (float(chi2.ppf(part, 5 * TRIALS)) for part in (SURELY / 2.0, 1.0 - SURELY / 2.0))
    assert low < total < high
    assert np.all(np.mean(shrunk, axis=0)[:3] < 0.5 * UNCERTAINTY)


def test_a_series_too_short_changes_nothing() -> None:
    before = belief()
    assert before.after(flown(force=effort()[:7])) is before
    held = replace(flown(force=np.full(60, 0.1), start=(0.0, 0.0, 0.0, 0.0)))
    assert held.slipping() == 0
    assert before.after(held) is before


def test_a_mass_that_sticks_on_the_way_is_learned_from_until_then() -> None:
    force = effort()
    force[100:] = 0.0  # mass 1 stops before the end, and what it does then is no free motion
    flight = flown(force=force, start=(0.0, 0.0, 0.0, 0.0))
    assert 100 <= flight.slipping() < SAMPLES
    after = belief().after(flight)
    np.testing.assert_allclose(found(after), TRUTH, rtol=EXACT)


def test_nothing_is_learned_from_a_mass_that_breaks_away_late() -> None:
    sticky = replace(ARM, friction=replace(LAW, static_friction_positive=0.5))
    expected = simulate(ARM, effort(), sampling_time=T).velocity
    start = (0.0, 0.0, 0.0, 0.0)
    late = flown(arm=sticky, start=start, expected=expected)
    assert late.late
    before = belief()
    assert before.after(late) is before
    assert not flown(start=start, expected=expected).late
    noisy = flown(start=start, expected=expected, generator=np.random.default_rng(2))
    assert not noisy.late


def test_nothing_is_learned_from_an_arm_that_was_pushed() -> None:
    flight = flown()
    pushed = flight.seen.copy()
    pushed[90:, 0] += 0.3 * T * np.arange(pushed.shape[0] - 90)
    pushed[90:, 1] += 0.3
    before = belief()
    assert before.after(replace(flight, seen=pushed)) is before


def test_friction_that_has_changed_is_found_by_the_next_series() -> None:
    once = belief().after(flown())
    changed = CoulombViscousFriction.symmetric(coulomb_friction=0.18, viscous_friction=0.07)
    after = once.later().after(flown(arm=replace(ARM, friction=changed)))
    wanted = np.array([*TRUTH[:3], 0.18, 0.07])
    np.testing.assert_allclose(found(after), wanted, rtol=CHANGED)


def test_an_estimate_without_uncertainty_can_still_be_corrected() -> None:
    sure = ArmBelief(arm=ARM, covariance=np.zeros((5, 5)))
    for _ in range(3):
        sure = sure.after(flown())
        assert np.linalg.eigvalsh(sure.covariance)[0] > 0.0


def test_an_unknown_friction_has_a_large_deviation() -> None:
    first = belief(covariance=np.full((2, 2), np.inf))
    assert np.sqrt(np.diag(first.covariance))[3:].min() > 0.9
    np.testing.assert_allclose(np.sqrt(np.diag(first.covariance))[:3], UNCERTAINTY)


def learned(**changes: Any) -> LearnedPulses:
    values = {**dict(zip(LEARNED, TRUTH.tolist(), strict=True)), "static_friction": 0.2}
    usual: dict[str, Any] = {
        "method": "landing",
        "kind": "linear",
        "values": values,
        "covariance": 1e-8 * np.eye(5),
    }
    return LearnedPulses(**(usual | changes))


def test_values_of_an_earlier_run_are_resumed() -> None:
    again = ArmBelief.resumed(belief().arm, learned())
    np.testing.assert_allclose(found(again), TRUTH, rtol=1e-12)
    assert again.arm.friction.static_friction_positive == 0.2
    spread = np.sqrt(np.diag(again.covariance))
    np.testing.assert_allclose(spread[:3], 1e-4)
    np.testing.assert_allclose(spread[3:], 0.05, rtol=1e-3)  # friction may have changed


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"method": "exact"}, "learned_otherwise"),
        ({"kind": "rotary"}, "learned_otherwise"),
        ({"values": {"coulomb_friction": 0.1}}, "learned_lacks"),
        ({"values": dict.fromkeys(LEARNED, 0.0)}, "not_positive"),
        ({"covariance": np.eye(2)}, "covariance_shape"),
        ({"covariance": -np.eye(5)}, "covariance_not_definite"),
    ],
)
def test_what_is_none_of_an_arm_is_refused(changes: dict[str, Any], code: str) -> None:
    with refuses(code):
        check_learned(learned(**changes), "linear")
