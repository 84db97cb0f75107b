import numpy as np
import pytest
from law_plants import LAWS, plant_of
from refusals import refuses

from stickslip.friction import CoulombViscousFriction
from stickslip.plants import FlexibleArm, SingleMass
from stickslip.records import EventBudgetError
from stickslip.simulation import PlantStepper, simulate, simulate_batch

FREE = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
STICKY = CoulombViscousFriction.symmetric(
    coulomb_friction=0.1, viscous_friction=0.0, static_friction=0.2
)
MASS = SingleMass(mass=1.0, friction=STICKY)
ARM = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=STICKY)


def test_a_double_crossing_inside_one_sample_is_found():
    """The first mass turns round twice between two instants at which it moves forward."""
    arm = FlexibleArm(mass_1=0.05, mass_2=10.0, stiffness=2.0, friction=FREE)
    motion = simulate(arm, [0.0], sampling_time=0.95, initial_state=(0.0, 0.2, 0.0, 0.08))
    assert motion.velocity[0] > 0
    assert motion.velocity[-1] > 0
    assert motion.event_mode.tolist() == [-1, 1]
    # around the centre of mass the first mass swings as v1 = V + (v1(0) - V) cos(omega t)
    omega = np.sqrt(2.0 / 0.05 + 2.0 / 10.0)
    mean = (0.05 * 0.2 + 10.0 * 0.08) / 10.05
    first = np.arccos(-mean / (0.2 - mean)) / omega
    np.testing.assert_allclose(motion.event_time, [first, 2 * np.pi / omega - first], rtol=1e-12)


def test_coming_to_rest_and_breaking_away_inside_one_sample():
    arm = FlexibleArm(mass_1=0.1, mass_2=5.0, stiffness=1.0, friction=STICKY)
    coarse = simulate(arm, np.zeros(3), sampling_time=5.0, initial_state=(0.0, 0.0, 0.0, 1.0))
    fine = simulate(arm, np.zeros(3000), sampling_time=0.005, initial_state=(0.0, 0.0, 0.0, 1.0))
    np.testing.assert_allclose(coarse.event_time, fine.event_time, rtol=1e-12)
    np.testing.assert_array_equal(coarse.event_mode, fine.event_mode)
    assert np.sum(coarse.event_time < 5.0) >= 3


def test_a_velocity_that_just_touches_zero_is_flagged():
    """Whether the mass then sticks or goes on is not determined in doubles."""
    arm = FlexibleArm(mass_1=1.0, mass_2=100.0, stiffness=1.0, friction=STICKY)

    def run(v1):
        return simulate(arm, [0.0], sampling_time=6.0, initial_state=(-0.1, v1, 0.0, 0.1))

    low, high = 0.1, 0.3  # slips on, and sticks on the way
    assert run(low).event_count == 0
    assert run(high).event_count > 0
    while high - low > 1e-15:
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        low, high = (low, middle) if run(middle).event_count else (middle, high)
    for offset in (0.0, 1e-13, -1e-13):
        assert run(low + offset).any_grazing
    for offset in (1e-3, -1e-3):
        assert not run(low + offset).any_grazing


def test_a_load_swing_that_just_reaches_the_static_friction_is_flagged():
    close = simulate(ARM, [0.0, 0.0], sampling_time=4.0, initial_state=(0.0, 0.0, 0.0, 0.2))
    clear = simulate(ARM, [0.0, 0.0], sampling_time=4.0, initial_state=(0.0, 0.0, 0.0, 0.19))
    assert close.any_grazing
    assert not clear.any_grazing
    assert clear.event_count == 0


def test_too_many_events_in_a_sample_are_an_error_that_says_so():
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1e4, friction=FREE)
    state = (0.0, 1.0, 0.0, -1.0)
    with refuses("event_budget", EventBudgetError, where="", event_budget=50, time=0.0):
        simulate(arm, [0.0], sampling_time=10.0, initial_state=state, event_budget=50)
    with refuses("event_budget", EventBudgetError, where="trajectory 0"):
        simulate_batch(arm, [[0.0]], sampling_time=10.0, initial_states=[state], event_budget=50)
    assert simulate(arm, [0.0], sampling_time=10.0, initial_state=state).event_count > 400


def test_more_events_than_samples_are_all_kept():
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=100.0, friction=FREE)
    motion = simulate(arm, [0.0] * 5, sampling_time=10.0, initial_state=(0.0, 1.0, 0.0, -1.0))
    assert motion.event_count > 2 * 5 + 64
    assert np.all(np.diff(motion.event_time) > 0)


def test_what_is_simulated_cannot_be_altered():
    motion = simulate(MASS, [1.0, 0.0], sampling_time=0.1)
    with pytest.raises(ValueError, match="read-only"):
        motion.position[0] = 1.0


def test_an_effort_of_no_samples_is_the_initial_state():
    motion = simulate(MASS, [], sampling_time=0.1, initial_state=(0.5, 0.1))
    assert motion.position.tolist() == [0.5]
    assert motion.stuck.tolist() == [False]


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ({"commanded_effort": [0.0, np.nan]}, "samples_not_finite"),
        ({"sampling_time": 0.0}, "not_positive"),
        ({"sampling_time": np.inf}, "not_finite"),
        ({"initial_state": (0.0,)}, "wrong_length"),
        ({"initial_state": (0.0, np.nan, 0.0, 0.0)}, "not_finite"),
        ({"event_budget": 0}, "not_whole"),
    ],
)
def test_refuses_bad_input(options, code):
    with refuses(code):
        simulate(ARM, **{"commanded_effort": [0.0], "sampling_time": 0.1} | options)


@pytest.mark.parametrize("plant", [MASS, ARM], ids=["mass", "arm"])
def test_a_motion_that_overflows_is_an_error(plant):
    efforts = [[0.0] * 3, [1e308] * 3]
    with refuses("motion_overflows", where="sample 1"):
        simulate(plant, efforts[1], sampling_time=100.0)
    with refuses("motion_overflows", where="trajectory 1"):
        simulate_batch(plant, efforts, sampling_time=100.0)


@pytest.mark.parametrize("plant", [MASS, ARM], ids=["mass", "arm"])
def test_every_way_to_simulate_checks_the_event_budget(plant):
    with refuses("not_whole", value=-5, least=1):
        simulate(plant, [0.0], sampling_time=0.1, event_budget=-5)
    with refuses("not_whole", value=-5, least=1):
        simulate_batch(plant, [[0.0]], sampling_time=0.1, event_budget=-5)
    with refuses("not_whole", value=-5, least=1):
        PlantStepper(plant, sampling_time=0.1, event_budget=-5)


def stiff(damping):
    law = CoulombViscousFriction.symmetric(coulomb_friction=0.1, viscous_friction=damping)
    return FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)


def test_an_arm_far_too_stiff_for_its_sampling_time_is_an_error():
    """Its samples would take as many polynomials as they hold time constants."""
    for make in (simulate, simulate_batch):
        with refuses("arm_too_stiff", sampling_time=1.0, limit=10000.0):
            make(stiff(1e5), [1.0], sampling_time=1.0)
    with refuses("arm_too_stiff"):
        simulate(stiff(1e300), [1.0], sampling_time=1e10)


def test_a_stiff_arm_moves_as_in_short_samples():
    arm, effort = stiff(9e3), np.array([1.0, -1.0, 0.5])
    coarse = simulate(arm, effort, sampling_time=1.0)
    fine = simulate(arm, np.repeat(effort, 1000), sampling_time=1e-3)
    np.testing.assert_allclose(coarse.event_time, fine.event_time, rtol=1e-12)
    np.testing.assert_allclose(coarse.position, fine.position[::1000], rtol=1e-10)
    np.testing.assert_allclose(coarse.load_velocity, fine.load_velocity[::1000], rtol=1e-10)


@pytest.mark.parametrize("flexible", [False, True])
@pytest.mark.parametrize("law", [STICKY, LAWS["Stribeck"], LAWS["LuGre"]])
@pytest.mark.parametrize("velocity", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("effort", [np.nan, np.inf, -np.inf, 1e308])
def test_a_step_under_an_effort_that_is_not_finite_ends_in_nan(law, flexible, velocity, effort):
    stepper = PlantStepper(plant_of(law, arm=flexible), sampling_time=100.0)
    state = stepper.init((0.0, velocity, 0.0, 0.0)[: 4 if flexible else 2])
    for _ in range(2):
        state, _ = stepper.step(state, effort)
    assert np.isnan(state[-1])
    state, output = stepper.step(state, 0.0)  # nothing mends it
    assert np.isnan(state[-1])
    assert law is not STICKY or np.isnan(output).all()


STATIC, OFFSET = 1.5, 0.25  # exact in binary


def _axis(static: float) -> SingleMass:
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=1.0, static_friction=static, viscous_friction=0.0, offset=OFFSET
    )
    return SingleMass(mass=1.0, friction=law)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("beyond", "moves"), [(0.0, False), (np.spacing(2.0), True)])
def test_an_effort_equal_to_static_friction_does_not_move_the_mass(direction, beyond, moves):
    effort = OFFSET + direction * (STATIC + beyond)
    motion = simulate(_axis(STATIC), [effort] * 3, sampling_time=1.0, initial_state=(0.0, 0.0))
    assert bool(np.any(motion.position != 0.0)) == moves
    assert np.all(direction * motion.position >= 0.0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(("beyond", "moves"), [(0.0, False), (np.spacing(2.0), True)])
def test_a_mass_that_stops_against_an_effort_equal_to_static_friction_rests(
    direction, beyond, moves
):
    effort = OFFSET + direction * (STATIC + beyond)
    start = (0.0, -0.5 * direction)  # it stops after 0.2 of a sample
    motion = simulate(_axis(STATIC), [effort] * 3, sampling_time=1.0, initial_state=start)
    assert bool(motion.velocity[1] != 0.0) == moves
    assert np.all(direction * motion.velocity[1:] >= 0.0)


@pytest.mark.parametrize("direction", [1.0, -1.0])
@pytest.mark.parametrize(
    ("excess", "flagged"),
    [(-1.1e-10, False), (-0.9e-10, True), (0.9e-10, True), (1.1e-10, False)],
)
def test_a_stop_at_the_end_of_a_sample_is_flagged(direction, excess, flagged):
    """v(t) = v_0 - t: the mass stops at t = v_0, and 1e-10 of a sample is too close to call."""
    start = (0.0, direction * (1.0 + excess))
    run = {"sampling_time": 1.0, "initial_state": start}
    assert simulate(_axis(STATIC), [OFFSET] * 2, **run).any_grazing == flagged
    # Without static friction above Coulomb friction, rest and motion have the same outcome
    assert not simulate(_axis(1.0), [OFFSET] * 2, **run).any_grazing
