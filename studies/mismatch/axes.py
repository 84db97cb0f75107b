"""Random axes with their motion and their controller.

An axis is drawn in ratios (friction to drive limit, offset to friction, and so on), so that one
drive serves a stage of 100 kg as well as a servo of 1e-4 kg m^2. `physical` turns the ratios into
a `Plant`, `motion_of` into references.
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float

from studies.mismatch.plant import Controller, Plant

CYCLE = 1e-3
"""Nominal period of the controller [s]."""

SETTLING = 0.1
"""Time after a move during which the integral action remains on [s]."""

Kind = Literal["linear", "rotary"]


@dataclass(frozen=True, kw_only=True)
class Stroke:
    """One move at constant speed between two ramps."""

    start: float  #: Time at which it starts [s].
    duration: float  #: From start to end, ramps included [s].
    ramp: float  #: Duration of each ramp; the speed follows a raised cosine [s].
    velocity: float  #: Signed speed between the ramps [m/s or rad/s].

    @property
    def distance(self) -> float:
        """Signed distance [m or rad]."""
        return self.velocity * (self.duration - self.ramp)


@dataclass(frozen=True, kw_only=True)
class Setup:
    """An axis, its motion and its controller before a simulation; ratios unless a unit is given."""

    kind: Kind  #: ``"linear"`` or ``"rotary"``.
    seed: int  #: Number of the recording; alternatives of a case alternate with it.
    mass: float  #: All moving mass [kg or kg m^2].
    top_speed: float  #: Highest speed [m/s or rad/s].
    speeds: tuple[float, ...]  #: Speeds of the moves over the top speed.
    #: ``"profile"``: moves forth and back; ``"sine"``; ``"steps"`` of the reference;
    #: ``"one_direction"``: moves in the positive direction only.
    pattern: Literal["profile", "sine", "steps", "one_direction"] = "profile"
    duration: float  #: Length of the log [s].
    #: Duration of a move and of each of its ramps [s].
    move_time: float
    ramp_time: float
    rests: tuple[float, ...]  #: Rests after the moves [s].
    sine_frequency: float = 0.5  #: Of the pattern ``"sine"`` [Hz].
    start: float = 0.0  #: First position over the travel.
    use: float  #: Largest effort that the motion needs over the drive's limit.
    coulomb: float  #: Coulomb friction over the limit, mean of both directions.
    #: Viscous friction of each kind at top speed over Coulomb friction.
    viscous: float
    quadratic: float = 0.0
    two_thirds: float = 0.0
    offset: float  #: Constant effort over Coulomb friction.
    #: Half of the difference of the directions over their mean.
    coulomb_skew: float = 0.0
    viscous_skew: float = 0.0
    #: Static over Coulomb friction: always, and in addition after a long rest.
    static: float = 1.0
    dwell: float = 1.0
    stribeck: float = 0.05  #: Stribeck velocity over the top speed.
    dwell_time: float = 0.3  #: Rest after which half of the growth is reached [s].
    presliding: float = 0.0  #: Presliding deflection [m or rad]; 0 for none.
    presliding_damping: float = 0.3  #: Damping ratio on the bristles.
    #: Change from the first to the last sample over the mean.
    friction_drift: float = 0.0
    gain_drift: float = 0.0
    spring: float = 0.0  #: Spring force over the travel, over Coulomb friction.
    gravity: float = 0.0  #: Largest torque of a swinging load over Coulomb friction.
    gravity_angle: float = 0.0  #: Angle at which that load has its largest torque [rad].
    #: Amplitude over Coulomb friction; periods in the travel; phase [rad].
    ripple: float = 0.0
    ripple_waves: float = 10.0
    ripple_phase: float = 0.0
    actuation_delay: float = 0.0  #: Time after which an effort acts [s].
    logging_delay: float = 0.0  #: Time after which an effort is logged [s].
    load_share: float = 0.0  #: Part of the mass that is the second body; 0 for a rigid axis.
    #: Frequency at which the two bodies oscillate against each other [Hz].
    resonance: float = 100.0
    resonance_damping: float = 0.05  #: Damping ratio of that oscillation.
    backlash: float = 0.0  #: Play between the bodies over the travel.
    load_friction: float = 0.0  #: Part of the friction that acts on the second body.
    encoder_step: float  #: Resolution [m or rad].
    bandwidth: float  #: Natural frequency of the position loop [Hz].
    #: Over the exact value.
    acceleration_feedforward: float
    velocity_feedforward: float
    white_disturbance: float = 0.0  #: Standard deviation of a white disturbance over the limit.
    #: Standard deviation of an AR(1) disturbance over Coulomb friction, and its coefficient per
    #: cycle.
    correlated_disturbance: float = 0.0
    correlation: float = 0.0
    jitter: float = 0.0  #: Standard deviation of the controller's period over the nominal one.
    noise: float  #: Standard deviation of the logged effort's noise over the limit.
    #: Mass given to ``identify`` over the true one; None gives none.
    known_mass: float | None = None

    @property
    def travel(self) -> float:
        """Distance of a move at top speed [m or rad]."""
        return self.top_speed * (self.move_time - self.ramp_time)

    @property
    def second_alternative(self) -> bool:
        """Whether this recording takes the second of two alternatives of its case."""
        return (self.seed // 2) % 2 == 1


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def draw_setup(rng: np.random.Generator, kind: Kind, seed: int) -> Setup:
    """Draw an axis with Coulomb and viscous friction and an offset.

    Its log has effort noise and an encoder, and no other imperfection.
    """
    linear = kind == "linear"
    move_time, ramp_time = rng.uniform(0.85, 1.0), rng.uniform(0.15, 0.3)
    travel = _log_uniform(rng, 0.1, 0.35) if linear else _log_uniform(rng, 3.0, 50.0)
    feedforward = rng.random() < 0.7
    rests = rng.uniform(0.15, 0.45, size=16)
    return Setup(
        kind=kind,
        seed=seed,
        mass=_log_uniform(rng, 1.0, 100.0) if linear else _log_uniform(rng, 1e-4, 0.1),
        top_speed=travel / (move_time - ramp_time),
        speeds=tuple(
            float(s)
            for s in rng.permutation(
                [rng.uniform(0.12, 0.2), rng.uniform(0.3, 0.4), rng.uniform(0.55, 0.7), 1.0]
            )
        ),
        duration=float(0.2 + 8 * move_time + np.sum(rests[:8])),
        move_time=move_time,
        ramp_time=ramp_time,
        rests=tuple(rests.tolist()),
        start=rng.uniform(-0.7, 0.3),
        use=rng.uniform(0.55, 0.75),
        coulomb=_log_uniform(rng, 0.02, 0.2),
        viscous=rng.uniform(0.2, 1.0),
        offset=rng.uniform(0.0, 0.2) * rng.choice([-1.0, 1.0]),
        encoder_step=(
            _log_uniform(rng, 0.1e-6, 1e-6)
            if linear
            else 2 * np.pi / 2.0 ** rng.choice([18, 20, 22])
        ),
        bandwidth=rng.uniform(8.0, 16.0),
        acceleration_feedforward=rng.uniform(0.8, 1.05) if feedforward else 0.0,
        velocity_feedforward=rng.uniform(0.5, 1.1) if feedforward else 0.0,
        noise=rng.uniform(0.003, 0.01),
    )


def _limit(setup: Setup) -> float:
    """Return the drive's limit [N or N m], of which the motion needs the share ``use``."""
    peak = setup.mass * 0.5 * np.pi * setup.top_speed / setup.ramp_time
    other = 1.0 + setup.viscous + setup.quadratic + setup.two_thirds + abs(setup.offset)
    other += abs(setup.coulomb_skew) + setup.spring + setup.gravity + setup.ripple
    # Under a heavy load the limit is at least 1.2 of all other forces, so that the axis can move.
    return float(max(peak / max(setup.use - setup.coulomb * other, 0.1 * setup.use), 0.0))


def physical(setup: Setup) -> Plant:
    """Return the plant of a setup."""
    limit = _limit(setup)
    coulomb = setup.coulomb * limit
    viscous = setup.viscous * coulomb / setup.top_speed
    load = setup.load_share * setup.mass
    motor = setup.mass - load
    stiffness = damping = 0.0
    if load > 0.0:
        frequency = 2 * np.pi * setup.resonance
        reduced = motor * load / setup.mass
        stiffness = reduced * frequency**2
        damping = 2 * setup.resonance_damping * reduced * frequency
    return Plant(
        mass=motor,
        coulomb_positive=coulomb * (1 + setup.coulomb_skew),
        coulomb_negative=coulomb * (1 - setup.coulomb_skew),
        viscous_positive=viscous * (1 + setup.viscous_skew),
        viscous_negative=viscous * (1 - setup.viscous_skew),
        quadratic=setup.quadratic * coulomb / setup.top_speed**2,
        two_thirds=setup.two_thirds * coulomb / setup.top_speed ** (2 / 3),
        static_ratio=setup.static,
        stribeck_velocity=setup.stribeck * setup.top_speed,
        dwell_ratio=setup.dwell,
        dwell_time=setup.dwell_time,
        presliding=setup.presliding,
        presliding_damping=setup.presliding_damping,
        friction_drift=setup.friction_drift,
        offset=setup.offset * coulomb,
        spring=setup.spring * coulomb / setup.travel,
        gravity_sine=setup.gravity * coulomb * np.sin(setup.gravity_angle),
        gravity_cosine=setup.gravity * coulomb * np.cos(setup.gravity_angle),
        ripple=setup.ripple * coulomb,
        ripple_period=setup.travel / setup.ripple_waves,
        ripple_phase=setup.ripple_phase,
        gain_drift=setup.gain_drift,
        actuation_delay=setup.actuation_delay,
        limit=limit,
        load_mass=load,
        coupling_stiffness=stiffness,
        coupling_damping=damping,
        backlash=setup.backlash * setup.travel,
        load_friction=setup.load_friction,
        encoder_step=setup.encoder_step,
    )


def controller_of(setup: Setup) -> Controller:
    """Return a PID controller by pole placement: m s^2 + k_d s + k_p with damping ratio 0.8."""
    frequency = 2 * np.pi * setup.bandwidth
    return Controller(
        proportional=setup.mass * frequency**2,
        integral=setup.mass * frequency**3 / 6.0,
        derivative=1.6 * setup.mass * frequency,
        derivative_cutoff=200.0,
    )


def true_values(setup: Setup) -> dict[str, float]:
    """Return the true parameters by the names that estimates use [SI].

    Coulomb and static friction of a direction contain the offset, as an effort in one direction
    contains both. The plain names are those of the symmetric law nearest to both directions. For a
    drift they are the values at mid-time. The offset is the effort at position zero. Terms that the
    axis does not have are zero. Static friction and its velocity are those of a fixed Stribeck
    effect: if the breakaway friction depends on the dwell time, they have no single value.
    """
    plant = physical(setup)
    coulomb = 0.5 * (plant.coulomb_positive + plant.coulomb_negative)
    viscous = 0.5 * (plant.viscous_positive + plant.viscous_negative)
    truth = {
        "mass" if setup.kind == "linear" else "inertia": setup.mass,
        "viscous_friction": viscous,
        "viscous_friction_positive": plant.viscous_positive,
        "viscous_friction_negative": plant.viscous_negative,
        "coulomb_friction": coulomb,
        "coulomb_friction_positive": plant.coulomb_positive + plant.offset,
        "coulomb_friction_negative": plant.coulomb_negative - plant.offset,
        "offset": plant.offset + 0.5 * (plant.coulomb_positive - plant.coulomb_negative),
        "viscous_asymmetry": 0.5 * (plant.viscous_positive - plant.viscous_negative),
        "quadratic_friction": plant.quadratic,
        "two_thirds_friction": plant.two_thirds,
        "spring_stiffness": plant.spring,
        "gravity_sine": plant.gravity_sine,
        "gravity_cosine": plant.gravity_cosine,
        "friction_drift": plant.friction_drift / setup.duration,
        "viscous_drift": 0.0,
        "gain_drift": plant.gain_drift / setup.duration,
        "offset_drift": 0.0,
    }
    if setup.ripple != 0.0:
        truth["ripple_period"] = plant.ripple_period
    if setup.static > 1.0:
        truth |= {
            "static_friction": setup.static * coulomb,
            "static_friction_positive": setup.static * plant.coulomb_positive + plant.offset,
            "static_friction_negative": setup.static * plant.coulomb_negative - plant.offset,
            "stribeck_velocity": plant.stribeck_velocity,
        }
    return {name: float(value) for name, value in truth.items()}


def scales(setup: Setup) -> dict[str, float]:
    """Return the scale of the error of each parameter [SI].

    It is the true value, and for an offset the true Coulomb friction. For a term that the axis does
    not have it is the value that gives Coulomb friction at top speed, over the travel or over the
    log; for both components of a gravity load it is the amplitude.
    """
    plant = physical(setup)
    truth = true_values(setup)
    coulomb, viscous = truth["coulomb_friction"], setup.coulomb * plant.limit / setup.top_speed
    gravity = float(np.hypot(plant.gravity_sine, plant.gravity_cosine)) or coulomb
    absent = {
        "viscous_friction": viscous,
        "viscous_friction_positive": viscous,
        "viscous_friction_negative": viscous,
        "viscous_asymmetry": viscous,
        "quadratic_friction": viscous / setup.top_speed,
        "two_thirds_friction": coulomb / setup.top_speed ** (2 / 3),
        "spring_stiffness": coulomb / setup.travel,
        "friction_drift": 1.0 / setup.duration,
        "viscous_drift": viscous / setup.duration,
        "gain_drift": 1.0 / setup.duration,
        "offset_drift": coulomb / setup.duration,
    }
    sizes = {name: abs(value) or absent.get(name, 0.0) for name, value in truth.items()}
    return sizes | {
        "offset": coulomb,
        "gravity_sine": gravity,
        "gravity_cosine": gravity,
        "viscous_asymmetry": truth["viscous_friction"] or viscous,
    }


def friction_curve(setup: Setup, velocity: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return the true effort at constant velocity, offset included, without position loads [N].

    A drift is taken at mid-time; no velocity [m/s or rad/s] may be zero.
    """
    plant = physical(setup)
    speed, positive = np.abs(velocity), velocity > 0
    coulomb = np.where(positive, plant.coulomb_positive, plant.coulomb_negative)
    viscous = np.where(positive, plant.viscous_positive, plant.viscous_negative)
    stribeck = (plant.static_ratio - 1) * np.exp(-((speed / plant.stribeck_velocity) ** 2))
    size = coulomb * (1 + stribeck) + viscous * speed
    size += plant.quadratic * speed**2 + plant.two_thirds * speed ** (2 / 3)
    return np.where(positive, size, -size) + plant.offset


@dataclass(frozen=True, kw_only=True)
class Motion:
    """References at the instants of the controller, shape (n,) each."""

    #: References [m, m/s, m/s^2 or rad, rad/s, rad/s^2].
    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]
    moving: Bool[np.ndarray, " n"]  #: Whether the integral action is on.


def moves(setup: Setup) -> list[Stroke]:
    """Return the moves of the patterns ``"profile"`` and ``"one_direction"``."""
    strokes: list[Stroke] = []
    time = 0.2 if setup.duration > 3.0 else 0.05
    k = 0
    directions = (1.0, -1.0) if setup.pattern == "profile" else (1.0,)
    while True:
        for direction in directions:
            if time + setup.move_time > setup.duration:
                return strokes
            if setup.duration > 3.0:
                speed = setup.speeds[(k // len(directions)) % len(setup.speeds)]
            else:  # too short for all speeds in both directions
                speed = setup.speeds[k % len(setup.speeds)]
            strokes.append(
                Stroke(
                    start=time,
                    duration=setup.move_time,
                    ramp=setup.ramp_time,
                    velocity=direction * speed * setup.top_speed,
                )
            )
            time += setup.move_time + setup.rests[k % len(setup.rests)]
            k += 1


def motion_of(setup: Setup, time: Float[np.ndarray, " n"]) -> Motion:
    """Return the references of a setup at the given instants [s]."""
    if setup.pattern == "sine":
        return _sine(setup, time)
    if setup.pattern == "steps":
        return _steps(setup, time)
    position = np.full(time.shape, setup.start * setup.travel)
    velocity, acceleration = np.zeros_like(time), np.zeros_like(time)
    moving = np.zeros(time.shape, dtype=bool)
    for stroke in moves(setup):
        s, v, a = _stroke_at(stroke, time - stroke.start)
        position += s
        velocity += v
        acceleration += a
        moving |= (time >= stroke.start) & (time < stroke.start + stroke.duration + SETTLING)
    return Motion(position=position, velocity=velocity, acceleration=acceleration, moving=moving)


def _stroke_at(
    stroke: Stroke, time: Float[np.ndarray, " n"]
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return distance, velocity and acceleration of one move at times after its start."""
    r, v = stroke.ramp, stroke.velocity
    up = np.clip(time, 0.0, r)
    down = np.clip(time - (stroke.duration - r), 0.0, r)
    level = np.clip(time - r, 0.0, stroke.duration - 2 * r)
    rise = 0.5 * v * (up - r / np.pi * np.sin(np.pi * up / r))
    fall = v * down - 0.5 * v * (down - r / np.pi * np.sin(np.pi * down / r))
    velocity = 0.5 * v * (np.cos(np.pi * down / r) - np.cos(np.pi * up / r))
    acceleration = 0.5 * v * np.pi / r * (np.sin(np.pi * up / r) - np.sin(np.pi * down / r))
    return rise + v * level + fall, velocity, acceleration


def _sine(setup: Setup, time: Float[np.ndarray, " n"]) -> Motion:
    """Return v(t) = v_top sin(2 pi f t)."""
    w = 2 * np.pi * setup.sine_frequency
    v = setup.top_speed
    return Motion(
        position=setup.start * setup.travel + v / w * (1 - np.cos(w * time)),
        velocity=v * np.sin(w * time),
        acceleration=v * w * np.cos(w * time),
        moving=np.ones(time.shape, dtype=bool),
    )


def _steps(setup: Setup, time: Float[np.ndarray, " n"]) -> Motion:
    """Return steps of the reference forth and back, as large as the drive allows without limit."""
    largest = 0.75 * _limit(setup) / controller_of(setup).proportional
    position = np.full(time.shape, setup.start * setup.travel)
    moving = np.zeros(time.shape, dtype=bool)
    start, k = 0.2, 0
    while start + 0.5 < setup.duration:
        size = largest * (0.6 + 0.4 * setup.speeds[(k // 2) % len(setup.speeds)])
        position[time >= start] += size if k % 2 == 0 else -size
        moving |= (time >= start) & (time < start + 0.5)
        start += 0.6 + setup.rests[k % len(setup.rests)]
        k += 1
    none = np.zeros_like(time)
    return Motion(position=position, velocity=none, acceleration=none.copy(), moving=moving)


def with_speed(setup: Setup, low: float, high: float, rng: np.random.Generator) -> Setup:
    """Return the setup with another top speed, drawn between the bounds [m/s or rad/s]."""
    return replace(setup, top_speed=_log_uniform(rng, low, high))
