"""Friction laws chosen by moves that they were not fitted to: made-up axes, and the EMPS."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.io
from scipy.integrate import solve_ivp

from stickslip.estimation import (
    FittedLaw,
    FrictionForm,
    IdimLeastSquares,
    LawCandidate,
    LawSelection,
    RowSettings,
    find_moves,
    force_ripple,
    law_candidates,
    select_friction_law,
)
from stickslip.friction import CoulombViscousFriction, StribeckEffect
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, InputError
from stickslip.simulation import simulate

T = 1e-3
MASS = 20.0
PERIOD = 0.004
NOISE = 1e-7  # of the position [m]

HELD = 1e-6
"""What of the law the simulator does not know is held over each sample: the position of a run of
a few centimetres is right to this [m], the count of a good encoder."""

PLAIN = FrictionForm(offset=True)
PLAIN_VALUES = {"viscous_friction": 60.0, "coulomb_friction": 12.0, "offset": 1.5}
RICH = FrictionForm(
    viscous_per_direction=True,
    offset=True,
    stribeck=StribeckEffect(velocity=0.02, shape="exponential"),
    stiffness=True,
    period=PERIOD,
    harmonics=2,
)
RICH_VALUES = {
    "viscous_friction_positive": 40.0,
    "viscous_friction_negative": 70.0,
    "coulomb_friction": 14.0,
    "static_friction": 9.0,
    "offset": 0.5,
    "stiffness": 6.0,
    "ripple_cosine_1": 1.0,
    "ripple_sine_1": -0.5,
    "ripple_cosine_2": 0.2,
    "ripple_sine_2": 0.3,
}
MOVES = ((0.05, 0.8), (0.12, 0.9), (0.02, 0.5), (-0.09, 1.0), (-0.04, 0.3), (-0.06, 1.2))
"""Ways [m] and durations [s]; they come back to where they began."""


def moved(law: FittedLaw, repetitions: int = 2, noise: float = NOISE) -> AxisLog:
    """Return the log of an axis with this law that goes smooth ways, by its inverse dynamics."""
    position, velocity, acceleration, start = [], [], [], 0.0
    for way, duration in MOVES * repetitions:
        s = (np.arange(round(duration / T)) + 0.5) * T / duration  # in the middle of each sample
        position.append(start + way * (10 * s**3 - 15 * s**4 + 6 * s**5))
        velocity.append(way * (30 * s**2 - 60 * s**3 + 30 * s**4) / duration)
        acceleration.append(way * (60 * s - 180 * s**2 + 120 * s**3) / duration**2)
        start += way
    x, v, a = (np.concatenate(each) for each in (position, velocity, acceleration))
    at_start = np.concatenate([[0.0], x[:-1] + 0.5 * T * v[:-1] + 0.125 * T**2 * a[:-1]])
    generator = np.random.default_rng(3)
    return AxisLog(
        name="made up",
        kind="linear",
        time=np.arange(x.size) * T,
        effort=law.inertia * a + law.friction(x, v),
        measured_position=at_start + noise * generator.standard_normal(x.size),
    )


def law(form: FrictionForm, values: dict[str, float]) -> FittedLaw:
    return FittedLaw(form=form, inertia=MASS, values=values)


def test_a_form_is_the_sum_of_its_terms() -> None:
    x, v = np.array([0.01, 0.02, -0.3]), np.array([0.03, -0.05, 0.0])
    left = np.exp(-np.abs(v) / 0.02)
    angle = 2 * np.pi * x / PERIOD
    expected = (
        np.where(v > 0, 40.0, 70.0) * v
        + np.sign(v) * (14.0 * (1 - left) + 9.0 * left)
        + 0.5
        + 6.0 * x
        + np.cos(angle)
        - 0.5 * np.sin(angle)
        + 0.2 * np.cos(2 * angle)
        + 0.3 * np.sin(2 * angle)
    )
    np.testing.assert_allclose(RICH.friction(RICH_VALUES, x, v), expected, rtol=1e-12)
    assert len(RICH.names) == RICH.size - 2 == RICH.columns(x, v).shape[1]
    power = FrictionForm(exponent=2 / 3)
    values = {"viscous_friction": 2.0, "coulomb_friction": 1.0}
    np.testing.assert_allclose(power.friction(values, [0.0], [-0.008]), [-1.0 - 2.0 * 0.04])


@pytest.mark.parametrize("form", [RICH, replace(RICH, stribeck=None, exponent=2 / 3)])
def test_a_free_run_is_the_solution_of_the_equation_of_motion(form: FrictionForm) -> None:
    axis = law(form, RICH_VALUES)
    time = np.arange(1500) * T
    effort = 30.0 + 10.0 * np.sin(5.0 * time)  # always ahead, beyond friction
    log = AxisLog(name="pushed", kind="linear", time=time, effort=effort,
                  measured_position=0.05 * time + 0.02 * time**2)  # fmt: skip
    start = RowSettings().motion(log)

    def friction(x: float, v: float) -> float:
        angle = 2 * math.pi * x / PERIOD
        if form.stribeck is None:
            moving = 14.0 + 40.0 * v ** (2 / 3)
        else:
            moving = 14.0 - 5.0 * math.exp(-v / 0.02) + 40.0 * v
        ripple = math.cos(angle) - 0.5 * math.sin(angle)
        return (
            moving + 0.5 + 6.0 * x + ripple + 0.2 * math.cos(2 * angle) + 0.3 * math.sin(2 * angle)
        )

    state = [float(start.position[0]), float(start.velocity[0])]
    reference = [state[0]]
    for force in effort[:300].tolist():
        solved = solve_ivp(
            lambda _, y, force=force: [y[1], (force - friction(y[0], y[1])) / MASS],
            (0.0, T), state, rtol=1e-9, atol=1e-12,
        )  # fmt: skip
        state = solved.y[:, -1].tolist()
        reference.append(state[0])
    error = axis.free_run(log)[:301] - reference
    assert np.abs(error).max() < HELD


def test_a_free_run_of_coulomb_and_viscous_friction_is_exact() -> None:
    axis = law(PLAIN, PLAIN_VALUES)
    log = moved(axis)
    friction = CoulombViscousFriction.symmetric(
        coulomb_friction=12.0, viscous_friction=60.0, offset=1.5
    )
    start = RowSettings().motion(log)
    motion = simulate(
        SingleMass(mass=MASS, friction=friction),
        log.effort,
        sampling_time=log.sampling_time,
        initial_state=(float(start.position[0]), float(start.velocity[0])),
    )
    np.testing.assert_array_equal(axis.free_run(log), motion.position[:-1])


def test_restarts_take_up_the_measured_motion() -> None:
    axis = law(PLAIN, PLAIN_VALUES)
    log = moved(axis)
    wrong = law(PLAIN, {**PLAIN_VALUES, "coulomb_friction": 13.0})
    starts = [start for start, _ in find_moves(log)]
    whole, restarted = (
        np.abs(wrong.free_run(log, each) - log.measured_position).max() for each in ((), starts)
    )
    assert restarted < whole
    smooth = RowSettings().motion(log)
    np.testing.assert_array_equal(wrong.free_run(log, starts)[starts], smooth.position[starts])


@pytest.mark.parametrize(
    ("form", "name"),
    [
        (PLAIN, "Coulomb, viscous, offset"),
        (FrictionForm(viscous_per_direction=True), "viscous per direction"),
        (
            FrictionForm(viscous_per_direction=True, exponent=2 / 3),
            "viscous per direction, 2/3 power",
        ),
        (
            FrictionForm(viscous_per_direction=True, stribeck=RICH.stribeck),
            "viscous per direction, Stribeck",
        ),
        (
            FrictionForm(viscous_per_direction=True, stribeck=RICH.stribeck, period=PERIOD),
            "Stribeck, ripple",
        ),
    ],
)
def test_the_law_that_made_the_log_is_chosen(form: FrictionForm, name: str) -> None:
    values = {**PLAIN_VALUES, **RICH_VALUES}
    selection = select_friction_law(moved(law(form, values), noise=2e-7))
    assert selection.chosen.name == name
    low, high = selection.fit.ci95["mass"]
    assert selection.fit.values["mass"] == pytest.approx(MASS, rel=0.01)
    assert low < high


def test_the_period_of_a_ripple_is_found() -> None:
    log = moved(law(RICH, RICH_VALUES))
    assert force_ripple(log).period == pytest.approx(PERIOD, rel=2e-3)


@pytest.mark.parametrize("repetitions", [1, 3])
def test_repetitions_of_a_move_are_left_out_together(repetitions: int) -> None:
    log = moved(law(PLAIN, PLAIN_VALUES), repetitions)
    assert len(find_moves(log)) == repetitions * len(MOVES)
    candidates = [LawCandidate(name="plain", forms=(PLAIN,))]
    (score,) = select_friction_law(log, candidates).scores
    assert score.fold_errors.size == len(MOVES)
    assert score.within
    assert score.excess == 0.0


def test_without_its_ripple_a_law_is_otherwise_the_same() -> None:
    axis = law(RICH, RICH_VALUES).without_ripple()
    assert axis.form.period is None
    assert axis.inertia == MASS
    x = np.linspace(0.0, PERIOD, 40, endpoint=False)
    with_it = law(RICH, RICH_VALUES).friction(x, np.full(40, 0.1))
    assert axis.friction([0.0], [0.1])[0] + 6.0 * x.mean() == pytest.approx(with_it.mean())


def test_a_law_from_an_estimate() -> None:
    log = moved(law(PLAIN, PLAIN_VALUES))
    for per_direction in (False, True):
        axis = FittedLaw.of(IdimLeastSquares(per_direction=per_direction).fit(log))
        at = np.array([-0.1, 0.1])
        np.testing.assert_allclose(
            axis.friction([0.0, 0.0], at), 60 * at + [-10.5, 13.5], rtol=0.02
        )
    known = IdimLeastSquares(inertia=MASS).fit(log)
    assert FittedLaw.of(known, inertia=MASS).inertia == MASS
    with pytest.raises(InputError, match="holds no inertia"):
        FittedLaw.of(known)
    one_way = log.part(*find_moves(log)[1])
    with pytest.raises(InputError, match="holds no value for 'coulomb_friction'"):
        FittedLaw.of(IdimLeastSquares().fit(one_way))


def test_what_cannot_be_judged_is_refused() -> None:
    log = moved(law(PLAIN, PLAIN_VALUES), 1)
    with pytest.raises(InputError, match="kinds of moves"):
        select_friction_law(log.part(0, 1500))
    with pytest.raises(InputError, match="no law to choose"):
        select_friction_law(log, [])
    with pytest.raises(InputError, match="has no form"):
        LawCandidate(name="none", forms=())
    with pytest.raises(InputError, match="both asked for"):
        FrictionForm(coulomb_per_direction=True, offset=True)
    with pytest.raises(InputError, match="viscous_friction is None"):
        FittedLaw(form=PLAIN, inertia=1.0, values={})
    with pytest.raises(InputError, match="harmonics is 0"):
        FrictionForm(harmonics=0)
    with pytest.raises(InputError, match="decimation is 0"):
        RowSettings(decimation=0)
    gap = np.concatenate([log.time[:2000], log.time[2000:] + 1.0])
    with pytest.raises(InputError, match="1 gaps"):
        find_moves(replace(log, time=gap))
    one_way = [LawCandidate(name="flat", forms=(replace(PLAIN, exponent=1e-9),))]
    with pytest.raises(InputError, match="does not determine"):
        select_friction_law(log, one_way)


# ---- The Electro-Mechanical Positioning System (Janot, Gautier and Brunot 2019)

PUBLISHED = FittedLaw(
    form=PLAIN,
    inertia=95.1089,
    values={"viscous_friction": 203.5034, "coulomb_friction": 20.3935, "offset": -3.1648},
)
PUBLISHED_DIRECTIONS = FittedLaw(
    form=FrictionForm(coulomb_per_direction=True, viscous_per_direction=True),
    inertia=95.1540,
    values={
        "viscous_friction_positive": 166.7061,
        "viscous_friction_negative": 240.4236,
        "coulomb_friction_positive": 20.1440,
        "coulomb_friction_negative": 20.6277,
    },
)
AS_PUBLISHED = RowSettings(held=False)
SCREW = 2.5e-3  # the period that the spectrum of each kind of move shows [m]


@pytest.fixture(scope="module")
def emps(benchmark_data: Callable[[str], Path]) -> tuple[AxisLog, AxisLog]:
    """Return the log that laws are fitted to, and the one with force pulses."""
    logs = []
    for name in ("DATA_EMPS", "DATA_EMPS_PULSES"):
        data = scipy.io.loadmat(benchmark_data(f"emps/{name}.mat"), squeeze_me=True)
        logs.append(
            AxisLog(
                name=name,
                kind="linear",
                time=data["t"],
                effort=data["vir"] * float(data["gtau"]),
                measured_position=data["qm"],
            )
        )
    return logs[0], logs[1]


@pytest.fixture(scope="module")
def selection(emps: tuple[AxisLog, AxisLog]) -> LawSelection:
    return select_friction_law(emps[0])


def free_error(axis: FittedLaw, log: AxisLog, starts: list[int]) -> float:
    """Return the root mean square of the simulated less the measured position [m]."""
    return math.sqrt(np.mean((axis.free_run(log, starts) - log.measured_position) ** 2))


def test_published_residuals_come_out_to_their_digits(emps: tuple[AxisLog, AxisLog]) -> None:
    residuals = [PUBLISHED.effort_residual(log, AS_PUBLISHED) for log in emps]
    assert [round(100 * each, 4) for each in residuals] == [4.0834, 5.9824]
    directions = PUBLISHED_DIRECTIONS.effort_residual(emps[0], AS_PUBLISHED)
    assert round(100 * directions, 4) == 3.1117


def test_what_cross_validation_says_of_emps(selection: LawSelection) -> None:
    errors = {score.candidate.name: score for score in selection.scores}
    assert selection.chosen.name == "Stribeck, ripple"
    # The evidence for each of its parts: the same law without it is outside one standard error
    for name in (
        "viscous per direction, Stribeck",
        "viscous per direction, ripple",
        "symmetric, Stribeck",
        "symmetric, ripple",
    ):
        assert not errors[name].within
    fit = selection.fit
    assert fit.ci95["static_friction"][1] < fit.ci95["coulomb_friction"][0]
    assert fit.ci95["viscous_friction_positive"][1] < fit.ci95["viscous_friction_negative"][0]
    assert selection.law.form.period == pytest.approx(SCREW, rel=2e-3)


def test_the_chosen_law_explains_both_logs_better(
    emps: tuple[AxisLog, AxisLog], selection: LawSelection
) -> None:
    own, other = emps
    transferred = selection.law.without_ripple()
    for rival in (PUBLISHED, PUBLISHED_DIRECTIONS):
        assert selection.law.effort_residual(own) < rival.effort_residual(own)
        assert transferred.effort_residual(other) < rival.effort_residual(other)
    # Half a sample of the effort is most of what the published rows leave over
    found = transferred.effort_residual(other, AS_PUBLISHED)
    assert found < PUBLISHED.effort_residual(other, AS_PUBLISHED)


def test_the_ripple_has_another_phase_in_the_other_log(
    emps: tuple[AxisLog, AxisLog], selection: LawSelection
) -> None:
    own, other = emps
    assert force_ripple(other).period == pytest.approx(SCREW, rel=2e-3)
    bare = selection.law.without_ripple()
    assert selection.law.effort_residual(own) < bare.effort_residual(own)
    assert selection.law.effort_residual(other) > bare.effort_residual(other)


def test_the_chosen_law_runs_free_better(
    emps: tuple[AxisLog, AxisLog], selection: LawSelection
) -> None:
    own = emps[0]
    starts = [start for start, _ in find_moves(own)]
    for each in (starts, []):
        found = free_error(selection.law, own, each)
        for rival in (PUBLISHED, PUBLISHED_DIRECTIONS):
            assert found < free_error(rival, own, each)


def test_every_candidate_of_a_log_is_another_law(emps: tuple[AxisLog, AxisLog]) -> None:
    candidates = law_candidates(emps[0])
    assert len({each.forms for each in candidates}) == len({each.name for each in candidates})
