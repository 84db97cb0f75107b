"""The reference itself: against closed forms, other precision, and its stored output."""

from itertools import pairwise

import pytest
from event_driven import simulate
from exact_plants import FlexibleArm, Friction, SingleMass
from make_reference import compute, plant_of
from mpmath import mp, mpf
from reference_cases import STORED_DIGITS, StoredRun, read

EXACT = mpf(10) ** -60
"""Far below the 30 digits that are stored, far above rounding at the 100 that are carried."""

STORED = mpf(10) ** (2 - STORED_DIGITS)
"""Relative to the largest magnitude: the stored digits, less what small components lose of them."""

PUBLISHED = 0.05
"""The settled equations print rest time and swing with three digits."""


def _same(friction: float, *, static: float | None = None, viscous: float = 0.0) -> Friction:
    static = friction if static is None else static
    return Friction(coulomb=(friction,) * 2, static=(static,) * 2, viscous=(viscous,) * 2)


@pytest.fixture(autouse=True)
def _precision() -> object:
    with mp.workdps(100):
        yield


@pytest.mark.parametrize("samples", [1, 3, 9])
@pytest.mark.parametrize("direction", [1, -1])
def test_pulse_of_a_viscous_mass_moves_it_as_equation_3(samples: int, direction: int) -> None:
    m, fc, c, fp = 150.0, 100.0, 700.0, 300.0
    plant = SingleMass(mass=m, friction=_same(fc, static=130.0, viscous=c))
    run = simulate(plant, [direction * fp] * samples + [0.0] * 40, 0.01, (0.0, 0.0))
    tp = samples * mpf(0.01)
    expected = fp * tp / c - m * fc / mpf(c) ** 2 * mp.log(fp / fc * mp.expm1(c * tp / m) + 1)
    assert run.stuck[-1]
    assert abs(direction * run.states[-1][0] - expected) < EXACT


@pytest.mark.parametrize("samples", [1, 4])
def test_pulse_of_a_dry_mass_moves_it_as_equation_2(samples: int) -> None:
    m, fc, fp = 150.0, 100.0, 300.0
    run = simulate(
        SingleMass(mass=m, friction=_same(fc)), [fp] * samples + [0.0] * 40, 0.01, (0.0, 0.0)
    )
    tp = samples * mpf(0.01)
    assert abs(run.states[-1][0] - fp * (fp - fc) / (2 * m * fc) * tp**2) < EXACT


def test_load_beside_a_stuck_motor_turns_on_a_circle() -> None:
    arm = FlexibleArm(mass_1=1.0, mass_2=0.5, stiffness=2.0, friction=_same(1.0))
    run = simulate(arm, [0.25] * 50, 0.3, (0.5, 0.0, 0.75, 0.125))
    for k, (x1, v1, x2, v2) in enumerate(run.states):
        angle = 2 * k * mpf(0.3)
        assert (x1, v1) == (0.5, 0)
        assert abs(x2 - (0.5 + 0.25 * mp.cos(angle) + 0.0625 * mp.sin(angle))) < EXACT
        assert abs(v2 - (0.125 * mp.cos(angle) - 0.5 * mp.sin(angle))) < EXACT


@pytest.mark.parametrize("viscous", [0.0, 1e-6, 0.3, 7.0])
def test_slipping_arm_follows_the_matrix_exponential(viscous: float) -> None:
    arm = FlexibleArm(mass_1=2.0, mass_2=0.5, stiffness=3.0, friction=_same(0.25, viscous=viscous))
    start = (0.1, 1.0, -0.2, 0.5)
    state = simulate(arm, [1.5], 0.125, start).states[-1]
    k, m1, m2 = 3, 2, mpf(0.5)
    matrix = mp.matrix(
        [
            [0, 1, 0, 0, 0],
            [-k / mpf(m1), -mpf(viscous) / m1, k / mpf(m1), 0, (1.5 - 0.25) / mpf(m1)],
            [0, 0, 0, 1, 0],
            [k / m2, 0, -k / m2, 0, 0],
            [0, 0, 0, 0, 0],
        ]
    )
    expected = mp.expm(matrix * mpf(0.125)) * mp.matrix([*map(mpf, start), 1])
    assert max(abs(a - b) for a, b in zip(state, expected, strict=False)) < EXACT


def test_energy_put_in_is_stored_or_lost_to_friction() -> None:
    """Without viscous friction the loss is Coulomb friction times the path, reversals included."""
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=_same(0.2, static=0.3))
    effort = [1.0, -0.75, 0.5, 0.0, -1.0, 0.25, 0.75, -0.5] * 5
    run = simulate(arm, effort, 1.0, (0.0,) * 4)
    assert run.count("reversal", "stick") > 10
    work = sum(
        u * (after[0] - before[0])
        for u, (before, after) in zip(effort, pairwise(run.states), strict=True)
    )
    turns = [run.states[0][0], *run.places, run.states[-1][0]]
    path = sum(abs(b - a) for a, b in pairwise(turns))
    assert abs(work - mpf(0.2) * path - _energy(run.states[-1])) < EXACT


def _energy(state: tuple[mpf, ...]) -> mpf:
    x1, v1, x2, v2 = state
    return (v1**2 + v2**2 + (x1 - x2) ** 2) / 2


@pytest.mark.parametrize("cut", [2, 7])
def test_finer_sampling_of_the_same_effort_changes_nothing(cut: int) -> None:
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=4.5, friction=_same(0.2, static=0.35))
    effort = [1.0, -0.5, 0.25, 0.0, -1.0, 0.75, 0.0, 0.0, -0.875, 1.0, 0.0, 0.0] * 2
    coarse = simulate(arm, effort, 2.0, (0.0,) * 4)
    fine = simulate(arm, [u for u in effort for _ in range(cut)], mpf(2) / cut, (0.0,) * 4)
    assert coarse.hidden() + coarse.count("stick", "reversal") > 5
    for state, other in zip(coarse.states, fine.states[::cut], strict=True):
        assert max(abs(a - b) for a, b in zip(state, other, strict=True)) < EXACT


def test_surrogate_arm_comes_to_rest_as_published() -> None:
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=_same(0.15, viscous=0.1))
    run = simulate(arm, [1.0] * 50 + [-1.0] * 50 + [0.0] * 500, 0.1, (0.0,) * 4)
    (stop,) = [t for t, (_, kind) in zip(run.times, run.events, strict=True) if kind == "stick"]
    x1, _, x2, v2 = run.states[-1]
    assert float(stop) == pytest.approx(20.2, abs=PUBLISHED)
    assert float(mp.hypot(x1 - x2, v2)) == pytest.approx(0.116, abs=PUBLISHED / 100)


def test_exact_grazing_is_seen_as_a_touch() -> None:
    """v1 = V (1 + cos(omega t)) touches zero; above Coulomb friction it then sticks."""
    for static, touches in ((0.125, 1), (0.25, 1)):
        arm = FlexibleArm(
            mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=_same(0.125, static=static)
        )
        run = simulate(arm, [0.125] * 4, 1.0, (0.0, 2.0, 0.0, 0.0))
        assert run.count("touch") == touches
        assert run.count("breakaway") == 1


_SHORT = [
    run
    for name in ("single_mass", "flexible_arm")
    for run in read(name)
    if len(run.case.effort) <= 100
]


@pytest.mark.parametrize("stored", _SHORT[::4], ids=lambda run: run.case.name)
def test_stored_cases_come_out_again_at_another_precision(stored: StoredRun) -> None:
    fresh = compute(stored.case, digits=80, conditioning=False)
    assert fresh.events == stored.events
    assert fresh.at_rest == stored.at_rest
    sizes = (mpf(stored.largest_position), mpf(stored.largest_velocity))
    for k, state in stored.states.items():
        for i, (old, new) in enumerate(zip(state, fresh.states[k], strict=True)):
            assert abs(mpf(old) - mpf(new)) <= STORED * sizes[i % 2]


def test_stored_cases_cover_what_they_must() -> None:
    arms, masses = read("flexible_arm"), read("single_mass")
    for runs in (arms, masses):
        times = {run.case.sampling_time for run in runs}
        assert (min(times), max(times) >= 2.0) == (0.001, True)
        assert any(run.case.static > run.case.coulomb for run in runs)
        assert any(run.case.viscous == (0.0, 0.0) for run in runs)
        assert any(run.case.offset for run in runs)
        for kind in ("stick", "reversal", "start"):
            assert sum(run.events[kind] for run in runs) > 100
    assert sum(run.events["breakaway"] for run in arms) > 100
    assert sum(run.hidden for run in arms) > 30
    largest = max(run.case.sampling_time * _omega(run) for run in arms)
    assert largest >= 6.0
    assert min(run.case.sampling_time * _omega(run) for run in arms) <= 0.001


def _omega(run: StoredRun) -> float:
    plant = run.case.plant
    return float((plant["stiffness"] * (1 / plant["mass_1"] + 1 / plant["mass_2"])) ** 0.5)


def test_plant_of_a_case_is_the_plant_it_names() -> None:
    (design,) = read("design_case")
    assert isinstance(plant_of(design.case), FlexibleArm)
    assert isinstance(plant_of(read("single_mass")[0].case), SingleMass)
