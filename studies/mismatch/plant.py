"""A motion axis in fine steps of 20 µs, in a sampled PID loop.

The plant shares no code with `stickslip.simulation`. It tests estimators on logs that their own
simulator cannot make.

The first (motor-side) body obeys

    m v' = k_t(t) u(t - t_d) - F_friction - F_load(x) - F_coupling - F_offset - d(t),

and the optional second body m_2 v_2' = F_coupling - F_friction,2. Forces other than friction are
evaluated at the middle of a step, friction by a linearly implicit midpoint rule, so that both are
of second order while the direction of motion does not change. A change of direction is located
inside the step; a body at rest stays at rest until the other forces exceed its static friction.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numba import njit

FINE_STEP = 20e-6
"""Integration step [s]."""

MOTION_SIZE = 9
"""Numbers in the state of the motion: position and velocity of both bodies, deflection of the
bristles, time at rest, excess by it, lagged effort, and the place in the queue of efforts."""

_TINY = 1e-12


class Plant(NamedTuple):
    """Physics of an axis; SI units, of a linear axis (rotary: kg m^2, N m, rad)."""

    mass: float  #: Mass of the first body [kg].
    #: Coulomb friction of each direction [N].
    coulomb_positive: float = 0.0
    coulomb_negative: float = 0.0
    #: Viscous friction of each direction [N s/m].
    viscous_positive: float = 0.0
    viscous_negative: float = 0.0
    quadratic: float = 0.0  #: Coefficient of v |v| [N s^2/m^2].
    two_thirds: float = 0.0  #: Coefficient of |v|^(2/3) sign(v) [N (s/m)^(2/3)].
    static_ratio: float = 1.0  #: Static over Coulomb friction [-]; 1 has no Stribeck effect.
    stribeck_velocity: float = 1.0  #: V_s of the excess (F_s - F_c) exp(-(v/v_s)^2) [m/s].
    #: Largest static over Coulomb friction after a long rest [-]; 1 has no dependence on it.
    dwell_ratio: float = 1.0
    dwell_time: float = 1.0  #: Rest after which half of that excess is reached [s].
    #: Deflection F_c / sigma_0 of the LuGre law [m]; 0 takes the discontinuous law.
    presliding: float = 0.0
    #: Damping ratio of the mass on the bristles [-], sigma_1 = 2 zeta sqrt(sigma_0 m).
    presliding_damping: float = 0.0
    #: Change of all friction from first to last sample, relative to the mean [-].
    friction_drift: float = 0.0
    offset: float = 0.0  #: Constant part of the effort [N].
    spring: float = 0.0  #: Stiffness of a spring with its rest position at 0 [N/m].
    #: Coefficients of sin(x) and cos(x) [N].
    gravity_sine: float = 0.0
    gravity_cosine: float = 0.0
    #: Amplitude [N], period [m] and phase [rad] of a periodic force over position.
    ripple: float = 0.0
    ripple_period: float = 1.0
    ripple_phase: float = 0.0
    #: Change of the torque constant from first to last sample, relative to the mean [-].
    gain_drift: float = 0.0
    actuation_delay: float = 0.0  #: Time after which an effort acts [s]; rounded to fine steps.
    #: Time constant of the drive's first-order lag after that [s]; 0 has none.
    actuation_lag: float = 0.0
    limit: float = np.inf  #: Largest effort of the drive [N].
    load_mass: float = 0.0  #: Mass of the second body [kg]; 0 has one body.
    #: Of the spring between the bodies [N/m, N s/m].
    coupling_stiffness: float = 0.0
    coupling_damping: float = 0.0
    backlash: float = 0.0  #: Play of that spring [m].
    #: Share of the Coulomb and viscous friction that acts on the second body [-].
    load_friction: float = 0.0
    #: Resolution of the encoder, which is on the first body [m]; 0 is exact.
    encoder_step: float = 0.0


class Controller(NamedTuple):
    """A PID position controller with a filtered derivative; all zero is an open loop."""

    #: Gains [N/m, N/(m s), N s/m].
    proportional: float = 0.0
    integral: float = 0.0
    derivative: float = 0.0
    derivative_cutoff: float = 200.0  #: Corner of the low-pass of the measured velocity [Hz].


class Inputs(NamedTuple):
    """Signals that drive the axis, one value for each instant of the controller."""

    #: Motion that the controller follows [m, m/s].
    reference_position: Float[np.ndarray, " n"]
    reference_velocity: Float[np.ndarray, " n"]
    feedforward: Float[np.ndarray, " n"]  #: Added to the effort of the controller [N].
    integrate: Float[np.ndarray, " n"]  #: 1 where its integral action is on, 0 where it is held.
    #: Force against the positive direction [N], held over each sample.
    disturbance: Float[np.ndarray, " n"]
    fine_steps: Int[np.ndarray, " n"]  #: Fine steps to the next instant.


class Run(NamedTuple):
    """Signals at the instants of the controller; shape (n,) each."""

    time: Float[np.ndarray, " n"]  #: Instants [s].
    #: True motion of the first body [m, m/s].
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    #: True motion of the second body [m, m/s]; zero without one.
    load_position: Float[np.ndarray, " n"]
    load_velocity: Float[np.ndarray, " n"]
    reading: Float[np.ndarray, " n"]  #: Position as the encoder reads it [m].
    command: Float[np.ndarray, " n"]  #: Effort that the controller commands [N].
    #: The same within the drive's limit [N]; held until the next instant.
    effort: Float[np.ndarray, " n"]


def run_plant(
    plant: Plant,
    controller: Controller,
    inputs: Inputs,
    *,
    initial_velocity: float = 0.0,
    initial_effort: float = 0.0,
) -> Run:
    """Simulate the axis from its first reference position on, at the instants of the controller.

    The initial velocity [m/s] is that of both bodies, the initial effort [N] that of the integral
    action.
    """
    *signals, fine_steps = inputs
    time = FINE_STEP * np.concatenate(([0.0], np.cumsum(fine_steps[:-1], dtype=float)))
    contiguous = Inputs(
        *(np.ascontiguousarray(each, dtype=float) for each in signals),
        np.ascontiguousarray(fine_steps, dtype=np.int64),
    )
    start = (float(initial_velocity), float(initial_effort))
    return Run(time, *_run(plant, controller, contiguous, start))


class _Friction(NamedTuple):
    """Friction of one body at one instant."""

    coulomb_positive: float
    coulomb_negative: float
    viscous_positive: float
    viscous_negative: float
    quadratic: float
    two_thirds: float
    excess: float  # static over Coulomb friction, less one
    stribeck_velocity: float


@njit(cache=True, error_model="numpy", inline="always")
def _sides(law: _Friction, positive: bool) -> tuple[float, float]:
    """Return Coulomb and viscous friction of a direction."""
    if positive:
        return law.coulomb_positive, law.viscous_positive
    return law.coulomb_negative, law.viscous_negative


@njit(cache=True, error_model="numpy", inline="always")
def _sliding_friction(
    velocity: float, law: _Friction, coulomb: float, viscous: float, excess: float
) -> tuple[float, float]:
    """Return the size of friction at a speed above zero, and its slope over speed.

    F(v) = F_c + F_e exp(-(v/v_s)^2) + c v + c_2 v^2 + c_3 v^(2/3)
    """
    speed = abs(velocity)
    friction = coulomb + viscous * speed
    slope = viscous
    if excess != 0.0:
        fall = excess * np.exp(-((speed / law.stribeck_velocity) ** 2))
        friction += fall
        slope -= 2.0 * speed / law.stribeck_velocity**2 * fall
    if law.quadratic != 0.0:
        friction += law.quadratic * speed * speed
        slope += 2.0 * law.quadratic * speed
    if law.two_thirds != 0.0:
        part = law.two_thirds * (speed + _TINY) ** (2.0 / 3.0)
        friction += part
        slope += 2.0 / 3.0 * part / (speed + _TINY)
    return friction, slope


@njit(cache=True, error_model="numpy", inline="always")
def _dry_step(
    velocity: float, force: float, mass: float, law: _Friction, step: float
) -> tuple[float, float]:
    """Advance one body under discontinuous friction; return its velocity and its displacement.

    v+ = v + h (F - F_f(v)) / (m + h/2 dF_f/dv)
    """
    if velocity == 0.0:
        breakaway = _sides(law, force > 0.0)[0] * (1.0 + law.excess)
        if abs(force) <= breakaway:
            return 0.0, 0.0
        direction = 1.0 if force > 0.0 else -1.0
        new = step * (force - direction * breakaway) / mass
        return new, 0.5 * step * new
    direction = 1.0 if velocity > 0.0 else -1.0
    coulomb, viscous = _sides(law, velocity > 0.0)
    friction, slope = _sliding_friction(velocity, law, coulomb, viscous, coulomb * law.excess)
    new = velocity + step * (force - direction * friction) / (mass + 0.5 * step * slope)
    if new * velocity > 0.0:
        return new, 0.5 * step * (velocity + new)
    # The body stops inside the step and moves on only if the other forces exceed static friction.
    until_rest = step * velocity / (velocity - new)
    displacement = 0.5 * until_rest * velocity
    breakaway = _sides(law, force > 0.0)[0] * (1.0 + law.excess)
    if abs(force) <= breakaway:
        return 0.0, displacement
    direction = 1.0 if force > 0.0 else -1.0
    rest = step - until_rest
    new = rest * (force - direction * breakaway) / mass
    return new, displacement + 0.5 * rest * new


@njit(cache=True, error_model="numpy", inline="always")
def _bristle_step(
    velocity: float,
    deflection: float,
    force: float,
    mass: float,
    law: _Friction,
    bristles: tuple[float, float],
    step: float,
) -> tuple[float, float, float]:
    """Advance one body under LuGre friction; return velocity, displacement and deflection.

    z' = v - sigma_0 |v| z / g(v),  F_f = sigma_0 z + sigma_1 z' + c v + ...; z is advanced by the
    exact solution at constant speed. ``bristles`` are sigma_0 and sigma_1.
    """
    stiffness, damping = bristles
    coulomb, viscous = _sides(law, velocity > 0.0 or (velocity == 0.0 and force > 0.0))
    speed = abs(velocity)
    level = coulomb * (1.0 + law.excess * np.exp(-((speed / law.stribeck_velocity) ** 2)))
    rate = velocity - stiffness * speed * deflection / level
    other, slope = _sliding_friction(velocity, law, 0.0, viscous, 0.0)
    direction = 1.0 if velocity >= 0.0 else -1.0
    friction = stiffness * deflection + damping * rate + direction * other
    relative = 1.0 - stiffness * deflection * direction / level
    slope += damping * relative
    advance = stiffness * rate  # of the bristle force, over half a step
    new = velocity + step * (force - friction - 0.5 * step * advance) / (mass + 0.5 * step * slope)
    mean = 0.5 * (velocity + new)
    if mean != 0.0:
        coulomb, _ = _sides(law, mean > 0.0)
        level = coulomb * (1.0 + law.excess * np.exp(-((mean / law.stribeck_velocity) ** 2)))
        steady = level / stiffness if mean > 0.0 else -level / stiffness
        deflection = steady + (deflection - steady) * np.exp(-stiffness * abs(mean) * step / level)
    return new, step * mean, deflection


@njit(cache=True, error_model="numpy", inline="always")
def _loaded(plant: Plant, position: float, force: float) -> float:
    """Return the force less those of spring, gravity and ripple at a position."""
    if plant.spring != 0.0:
        force -= plant.spring * position
    if plant.gravity_sine != 0.0 or plant.gravity_cosine != 0.0:
        force -= plant.gravity_sine * np.sin(position) + plant.gravity_cosine * np.cos(position)
    if plant.ripple != 0.0:
        force -= plant.ripple * np.sin(
            2.0 * np.pi * position / plant.ripple_period + plant.ripple_phase
        )
    return force


@njit(cache=True, error_model="numpy", inline="always")
def _coupling(plant: Plant, stretch: float, rate: float) -> float:
    """Return the force of the spring between the bodies, which has play."""
    half = 0.5 * plant.backlash
    if abs(stretch) <= half:
        return 0.0
    end = half if stretch > half else -half
    force = plant.coupling_stiffness * (stretch - end)
    force += plant.coupling_damping * rate
    if half > 0.0:  # a tooth does not pull
        force = max(force, 0.0) if stretch > half else min(force, 0.0)
    return force


@njit(cache=True, error_model="numpy", inline="always")
def _friction(plant: Plant, share: float, scale: float, excess: float) -> _Friction:
    """Return the drifted friction on a body: a share of Coulomb and viscous, all other friction."""
    both = share * scale
    return _Friction(
        both * plant.coulomb_positive,
        both * plant.coulomb_negative,
        both * plant.viscous_positive,
        both * plant.viscous_negative,
        scale * plant.quadratic,
        scale * plant.two_thirds,
        excess,
        plant.stribeck_velocity,
    )


@njit(cache=True, error_model="numpy")
def _advance(
    plant: Plant,
    motion: Float[np.ndarray, " m"],
    pending: Float[np.ndarray, " d"],
    effort: float,
    disturbance: float,
    steps: int,
    progress: tuple[int, int],
) -> None:
    """Advance the motion by some fine steps under one effort, in place.

    ``pending`` is the queue of delayed efforts, ``progress`` the fine steps that are done, and of
    all.
    """
    h = FINE_STEP
    delay = pending.size - 1
    x, v, x2, v2, bristle, dwell, dwell_excess, lagged = motion[:8]
    slot = int(motion[8])
    bristles = (0.0, 0.0)
    if plant.presliding > 0.0:
        mean_coulomb = 0.5 * (plant.coulomb_positive + plant.coulomb_negative)
        stiffness = mean_coulomb / plant.presliding
        bristles = (
            stiffness,
            2.0 * plant.presliding_damping * np.sqrt(stiffness * plant.mass),
        )
    done, total_steps = progress
    for _ in range(steps):
        pending[slot] = effort
        slot = slot + 1 if slot < delay else 0
        acting = pending[slot] if delay > 0 else effort
        # The drifts are linear in time and relative to their means.
        elapsed = done / total_steps - 0.5
        done += 1
        if plant.actuation_lag > 0.0:
            lagged += (1.0 - np.exp(-h / plant.actuation_lag)) * (acting - lagged)
            acting = lagged
        acting *= 1.0 + plant.gain_drift * elapsed
        scale = 1.0 + plant.friction_drift * elapsed
        x_mid = x + 0.5 * h * v
        force = _loaded(plant, x_mid, acting - plant.offset - disturbance)
        if plant.load_mass > 0.0:
            coupling = _coupling(plant, x_mid - x2 - 0.5 * h * v2, v - v2)
            force -= coupling
            far = plant.load_friction * scale
            law = _Friction(
                far * plant.coulomb_positive,
                far * plant.coulomb_negative,
                far * plant.viscous_positive,
                far * plant.viscous_negative,
                0.0,
                0.0,
                0.0,
                1.0,
            )
            v2, displacement = _dry_step(v2, coupling, plant.load_mass, law, h)
            x2 += displacement
        if plant.dwell_ratio > 1.0:
            # Contacts grow at rest; the excess is lost once the body has left the Stribeck
            # range.
            if v == 0.0:
                dwell += h
                grown = dwell / (dwell + plant.dwell_time)
                dwell_excess = (plant.dwell_ratio - 1.0) * grown
            else:
                dwell = 0.0
                if abs(v) > 3.0 * plant.stribeck_velocity:
                    dwell_excess = 0.0
        excess = plant.static_ratio - 1.0 + dwell_excess
        if plant.presliding > 0.0:
            law = _friction(plant, 1.0, scale, excess)
            v, displacement, bristle = _bristle_step(
                v, bristle, force, plant.mass, law, bristles, h
            )
        else:
            law = _friction(plant, 1.0 - plant.load_friction, scale, excess)
            v, displacement = _dry_step(v, force, plant.mass, law, h)
        x += displacement
    motion[:8] = x, v, x2, v2, bristle, dwell, dwell_excess, lagged
    motion[8] = slot


@njit(cache=True, error_model="numpy")
def _run(
    plant: Plant, controller: Controller, inputs: Inputs, start: tuple[float, float]
) -> tuple[Float[np.ndarray, " n"], ...]:
    """Simulate; return position, velocity, those of the load, reading, command and effort."""
    reference_position, fine_steps = inputs.reference_position, inputs.fine_steps
    n = reference_position.size
    positions, velocities = np.empty(n), np.empty(n)
    load_positions, load_velocities = np.zeros(n), np.zeros(n)
    readings, commands, efforts = np.empty(n), np.empty(n), np.empty(n)

    h = FINE_STEP
    total_steps = np.sum(fine_steps)
    pending = np.zeros(int(np.rint(plant.actuation_delay / h)) + 1)
    initial_velocity, integral = start

    motion = np.zeros(MOTION_SIZE)
    motion[:4] = reference_position[0], initial_velocity, reference_position[0], initial_velocity
    x_last, v_filtered = reference_position[0], initial_velocity
    if plant.encoder_step > 0.0:
        x_last = np.round(x_last / plant.encoder_step) * plant.encoder_step
    nominal = h * np.median(fine_steps)
    done = 0

    for k in range(n):
        x, v, x2, v2 = motion[0], motion[1], motion[2], motion[3]
        y = x
        if plant.encoder_step > 0.0:
            y = np.round(x / plant.encoder_step) * plant.encoder_step
        elapsed = nominal if k == 0 else h * fine_steps[k - 1]
        smoothing = 1.0 - np.exp(-2.0 * np.pi * controller.derivative_cutoff * elapsed)
        v_filtered += smoothing * ((y - x_last) / elapsed - v_filtered)
        x_last = y
        error = reference_position[k] - y
        command = (
            inputs.feedforward[k]
            + controller.proportional * error
            + controller.derivative * (inputs.reference_velocity[k] - v_filtered)
            + integral
        )
        effort = min(max(command, -plant.limit), plant.limit)
        if effort == command:
            integral += inputs.integrate[k] * controller.integral * error * nominal
        positions[k], velocities[k] = x, v
        load_positions[k], load_velocities[k] = x2, v2
        readings[k], commands[k], efforts[k] = y, command, effort
        progress = (done, total_steps)
        _advance(plant, motion, pending, effort, inputs.disturbance[k], fine_steps[k], progress)
        done += fine_steps[k]
    return positions, velocities, load_positions, load_velocities, readings, commands, efforts


class HeldPlant:
    """The axis in the loop of any controller: efforts are held from sample to sample.

    It starts at rest at ``start`` [m], with so many fine ``steps`` a sample. Drifts, encoder and
    limit of the plant are not used.
    """

    def __init__(self, plant: Plant, *, start: float, steps: int) -> None:
        self._plant, self._steps = plant, steps
        self._motion = np.zeros(MOTION_SIZE)
        self._motion[0] = self._motion[2] = start
        self._pending = np.zeros(int(np.rint(plant.actuation_delay / FINE_STEP)) + 1)

    @property
    def motion(self) -> tuple[float, float, float, float]:
        """Position and velocity of the first, then of the second body [m, m/s]."""
        x, v, x2, v2 = self._motion[:4].tolist()
        return x, v, x2, v2

    def advance(self, effort: float, disturbance: float = 0.0) -> None:
        """Move for one sample under an effort, with a force against the positive direction [N]."""
        _advance(self._plant, self._motion, self._pending, effort, disturbance, self._steps, (0, 1))
