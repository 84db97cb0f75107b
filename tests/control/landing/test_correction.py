"""Corrections of a series on its way, and the estimate of the load, on integrated equations."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from stickslip.control.landing.tracked.correction import (
    NONE,
    CorrectedSeries,
    Goal,
    Tracking,
    _taken,
    before,
)
from stickslip.control.landing.tracked.drive_fit import DriveFit
from stickslip.control.landing.tracked.load_fit import LoadFit
from stickslip.friction import CoulombViscousFriction
from stickslip.numerics.growing import Growing
from stickslip.planning import NO_LOSSES, LoadLosses, PulseSeriesPlanner
from stickslip.plants import FlexibleArm

T = 0.02
LAW = CoulombViscousFriction.symmetric(coulomb_friction=0.15, viscous_friction=0.1)
ARM = FlexibleArm(mass_1=1.2, mass_2=0.8, stiffness=1.5, friction=LAW)
LOSSES = LoadLosses(damping=0.05, coulomb_friction=0.004, viscous_friction=0.01)
DRIVE = DriveFit.first(0.15, 0.1, np.diag([0.01, 0.25]))
LIMIT = 0.95
INTEGRATED = 1e-6  # of the move


def corrected(
    target: float,
    losses: LoadLosses,
    *,
    rests: bool,
    noise: tuple[float, float] = (0.0, 0.0),
    learned: bool = False,
    aim: Goal = NONE,
) -> CorrectedSeries:
    planner = PulseSeriesPlanner(
        arm=ARM,
        sampling_time=T,
        effort_limit=0.85,
        losses=losses,
        excess=0.1,
        impulse_gap=0.3,
        rest_on_the_way=rests,
    )
    series = planner.plan((0.0, 0.0, 0.0, 0.0), target)
    tracking = Tracking(pole=10.0, settling=5, limit=LIMIT, noise=noise, learned=learned, aim=aim)
    return CorrectedSeries.of(series, ARM, losses, DRIVE, tracking)


def moved(
    series: CorrectedSeries, start: int, deviation: tuple[float, float], losses: LoadLosses
) -> tuple[np.ndarray, np.ndarray]:
    """Return the deviation of both masses at the end, and the corrections.

    Mass 1 moves as planned and corrected; mass 2, off by a deviation at first, follows by its own
    equation.
    """
    d, _, viscous = losses
    r = (0.0, 0.0, *deviation)
    goal, accelerations = NONE, []
    for k in range(start, series.moving):
        goal = series.goal(k, r, goal)
        a = series.acceleration(k, r, goal)
        resting = bool(series.rests[k])

        def rates(_: float, y: np.ndarray, a: float = a, resting: bool = resting) -> list[float]:
            x1, v1, x2, v2 = y
            pull = ARM.stiffness * (x1 - x2) + d * (v1 - v2) - viscous * v2
            return [0.0 if resting else v1, 0.0 if resting else a, v2, pull / ARM.mass_2]

        y = np.array([r[0], 0.0 if resting else r[1], r[2], r[3]])
        forced = float(series.forced[k])
        y = solve_ivp(rates, (0.0, T), y, rtol=1e-10, atol=1e-13).y[:, -1]
        y[2] += 0.5 * forced * T**2
        y[3] += forced * T
        r = (float(y[0]), 0.0 if resting else float(y[1]), float(y[2]), float(y[3]))
        accelerations.append(a)
    return np.array(r), np.array(accelerations)


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("rests", [False, True])
@pytest.mark.parametrize("losses", [NO_LOSSES, LOSSES], ids=["no losses", "losses"])
def test_a_small_deviation_is_gone_at_the_end(way: float, rests: bool, losses: LoadLosses) -> None:
    series = corrected(way, losses, rests=rests)
    end, accelerations = moved(series, series.moving // 5, (2e-3, -1e-3), losses)
    np.testing.assert_allclose(end, 0.0, atol=2e-5)
    efforts = series.effort[series.moving // 5 : series.moving] + ARM.mass_1 * accelerations
    assert np.abs(efforts).max() <= max(LIMIT, np.abs(series.effort).max()) + 1e-12


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_series_ends_where_it_is_aimed(way: float) -> None:
    aim = (1e-3, 0.0, -5e-4, 4e-4)  # the last one over the frequency of mass 2
    series = corrected(way, NO_LOSSES, rests=False, aim=aim)
    end, _ = moved(series, 0, (0.0, 0.0), NO_LOSSES)
    w = np.sqrt(ARM.stiffness / ARM.mass_2)
    np.testing.assert_allclose(end, [*aim[:3], w * aim[3]], atol=2e-5)
    # It stays there while the feedback settles
    assert series.after(series.moving - 1, NONE, 0.0) == (1e-3, 0.0, 1e-3, 0.0)


def test_no_correction_without_a_deviation() -> None:
    series = corrected(1.0, NO_LOSSES, rests=True)
    for k in range(series.moving):
        assert series.acceleration(k, NONE, NONE) == 0.0
        assert series.after(k, NONE, 0.0) == NONE


def test_what_is_out_of_reach_is_not_aimed_at() -> None:
    series = corrected(1.0, NO_LOSSES, rests=False)
    stride = max(1, series.moving // 64)
    late = (series.moving - 20) // stride * stride
    assert series.goal(late, (0.0, 0.0, 1e-7, 0.0), NONE) == NONE
    goal = series.goal(late, (0.0, 0.0, 0.1, 0.0), NONE)
    assert np.hypot(goal[2], goal[3]) > 0.05
    assert goal[:2] == (0.0, 0.0)


@pytest.mark.parametrize("rests", [False, True])
def test_a_series_back_is_the_mirror_image_of_one_forth(rests: bool) -> None:
    sticky = LOSSES._replace(coulomb_friction=0.02)
    forth, back = (corrected(target, sticky, rests=rests) for target in (0.4, -0.4))
    looked = [k for k in range(forth.moving) if forth.goal(k, (0.0, 0.0, 0.05, 0.0), NONE) != NONE]
    assert len(looked) > 10
    for k in looked:
        for off in (0.0, 0.01, 0.05):
            goal = np.array(forth.goal(k, (0.0, 0.0, off, 0.0), NONE))
            mirrored = np.array(back.goal(k, (0.0, 0.0, -off, 0.0), NONE))
            assert np.allclose(mirrored, -goal, rtol=0.0, atol=1e-9)


def test_with_noise_less_is_corrected_late_and_mass_1_still_ends_on_its_plan() -> None:
    late, deviation = 0.8, (0.0, 2e-4)
    exact = corrected(1.0, NO_LOSSES, rests=False)
    noisy = corrected(1.0, NO_LOSSES, rests=False, noise=(1e-5, 1e-3))
    k = round(late * exact.moving)
    end, efforts = moved(exact, k, deviation, NO_LOSSES)
    unsure, less = moved(noisy, k, deviation, NO_LOSSES)
    np.testing.assert_allclose(end, 0.0, atol=2e-6)
    np.testing.assert_allclose(unsure[:2], 0.0, atol=2e-6)
    assert np.abs(less).max() < 0.2 * np.abs(efforts).max()
    early, _ = moved(noisy, 0, (0.0, 5e-2), NO_LOSSES)
    assert np.abs(early).max() < 5e-4


def test_a_free_swing_is_followed_through_noise() -> None:
    noise, samples = (2e-3, 1e-2), 20_000
    series = corrected(1.0, NO_LOSSES, rests=False, noise=noise, learned=True)
    quick = corrected(1.0, NO_LOSSES, rests=False)
    w = np.sqrt(ARM.stiffness / ARM.mass_2)
    swing = 0.03 * np.column_stack([np.cos(w * T * np.arange(samples)), np.zeros(samples)])
    swing[:, 1] = -0.03 * w * np.sin(w * T * np.arange(samples))
    seen = swing + np.random.default_rng(4).normal(size=swing.shape) * noise
    errors = {}
    for name, each in (("weighed", series), ("quick", quick)):
        r, off = NONE, []
        for position, velocity in seen:
            r = each.seen(0, r, (position - r[2], velocity - r[3]))
            off.append((r[2], r[3]))
            c, s = np.cos(w * T), np.sin(w * T)
            r = (0.0, 0.0, c * r[2] + s / w * r[3], c * r[3] - s * w * r[2])
        errors[name] = np.array(off[1000:]) - swing[1000:]
    spread = {name: np.sqrt(np.mean((each / (1.0, w)) ** 2)) for name, each in errors.items()}
    assert abs(errors["weighed"].mean(axis=0)).max() < 2e-4
    assert spread["weighed"] < 0.5 * spread["quick"]


@pytest.mark.parametrize("noise", [0.0, 1e-4])
def test_the_load_is_that_of_the_motion(noise: float) -> None:
    d, dry, viscous = LOSSES
    stiffer = 1.01

    def rates(t: float, y: np.ndarray) -> list[float]:
        x1, v1 = 0.5 * np.sin(0.7 * t) + t, 0.35 * np.cos(0.7 * t) + 1.0
        x2, v2 = y
        pull = stiffer * ARM.stiffness * (x1 - x2) + d * (v1 - v2)
        return [v2, (pull - dry * np.sign(v2) - viscous * v2) / ARM.mass_2]

    time = np.arange(600) * T
    path = solve_ivp(rates, (0.0, time[-1]), [0.0, 1.35], t_eval=time, rtol=1e-10, atol=1e-12).y
    x1, v1 = 0.5 * np.sin(0.7 * time) + time, 0.35 * np.cos(0.7 * time) + 1.0
    assert np.all(path[1] > 0.0)
    seen = np.column_stack([x1, v1, *path])
    seen[:, 3] += noise * np.random.default_rng(1).normal(size=time.size)
    fit = LoadFit().after(ARM, seen, coulomb_friction=0.15, sampling_time=T, velocity_noise=noise)
    assert fit.arm is not None
    assert fit.arm.mass_2 == pytest.approx(ARM.mass_2 / stiffer, rel=max(1e-5, 20.0 * noise))
    if noise == 0.0:
        np.testing.assert_allclose(np.array(fit.losses) * stiffer, LOSSES, rtol=1e-3)


def test_no_losses_are_found_where_there_are_none() -> None:
    series = corrected(1.0, NO_LOSSES, rests=False)
    seen = np.column_stack(
        [series.position, series.velocity, series.load_position, series.load_velocity]
    )
    generator = np.random.default_rng(2)
    seen = seen + 1e-4 * generator.normal(size=seen.shape)
    fit = LoadFit().after(ARM, seen, coulomb_friction=0.15, sampling_time=T, velocity_noise=1e-4)
    assert fit.losses == NO_LOSSES


def test_nothing_is_learned_from_too_few_samples() -> None:
    fit = LoadFit()
    seen = np.ones((10, 4))
    assert fit.after(
        ARM, seen, coulomb_friction=0.15, sampling_time=T, velocity_noise=0.0
    ) == replace(fit)


def test_a_growing_sequence_is_a_list_whose_past_stays() -> None:
    grown: Growing[int] = Growing()
    before = grown
    for k in range(1000):
        if k == 300:
            before = grown
        grown = grown.after(k)
    assert list(grown) == list(range(1000))
    assert len(grown) == 1000
    assert list(before) == list(range(300))


def test_the_planned_state_between_samples_is_that_of_the_equations() -> None:
    series = corrected(1.0, NO_LOSSES, rests=False)
    w = np.sqrt(ARM.stiffness / ARM.mass_2)
    for k in (2, 40, 90):
        start = series.at(float(k))

        def rate(_: float, y: np.ndarray, u: float = float(series.effort[k])) -> list[float]:
            spring = ARM.stiffness * (y[0] - y[2])
            return [
                y[1], (u - 0.15 - 0.1 * y[1] - spring) / ARM.mass_1, y[3], spring / ARM.mass_2,
            ]  # fmt: skip

        for share in (0.25, 0.5, 0.8):
            solved = solve_ivp(rate, (0.0, share * T), start, rtol=1e-12, atol=1e-14)
            off = (np.array(series.at(k + share)) - solved.y[:, -1]) / (1.0, w, 1.0, w)
            assert np.abs(off).max() < 1e-6


@pytest.mark.parametrize("delay", [0.3, 0.5, 1.5])
def test_a_past_deviation_of_constant_acceleration_is_exact(delay: float) -> None:
    T, a = 0.01, 3.0
    past = [0.5 * a * T**2, a * T]  # position and velocity a sample after rest
    kept = tuple((n * n * past[0], n * past[1], -n * n * past[0], -n * past[1]) for n in range(4))
    n = 3 - delay
    there = (n * n * past[0], n * past[1], -n * n * past[0], -n * past[1])
    assert before(kept, delay, T) == pytest.approx(there, rel=1e-12)


def test_a_past_deviation_that_was_seen_to_be_another_keeps_its_velocity() -> None:
    kept = ((0.0, 1.0, 0.0, 1.0), (0.0, 1.0, 0.0, 1.0))  # brought back by what was seen
    assert before(kept, 0.5, 0.01) == pytest.approx((0.0, 1.0, 0.0, 1.0), abs=1e-15)


def test_the_filter_of_mass_2_depends_on_no_unit_of_length() -> None:
    gain, by_noise = _taken(25.0, 1e-3, 90.0, 1e-3, (1e-4, 2e-3))
    small, small_noise = _taken(25.0, 1e-3, 90.0, 1e-9, (1e-10, 2e-9))
    np.testing.assert_allclose(small, gain, rtol=1e-9)
    assert small_noise == pytest.approx(1e-6 * by_noise)
