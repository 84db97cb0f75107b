"""The cases of the study and the recording of their logs."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal
from zlib import crc32

import numpy as np
from jaxtyping import Float

from stickslip.records import AxisLog
from studies.mismatch.axes import (
    CYCLE,
    Kind,
    Setup,
    controller_of,
    draw_setup,
    friction_curve,
    motion_of,
    moves,
    physical,
    scales,
    true_values,
)
from studies.mismatch.effects import EFFECTS, Columns
from studies.mismatch.plant import FINE_STEP, Inputs, Plant, Run, run_plant

Group = Literal["ideal", "noise", "in_class", "unmodelled"]


@dataclass(frozen=True, kw_only=True)
class Case:
    """A family of recordings that share their effects."""

    name: str  #: Unique name; part of the seed.
    #: ``"ideal"`` and ``"noise"``: Coulomb and viscous friction and an offset; ``"in_class"``: the
    #: truth lies within the candidate models; ``"unmodelled"``: anything else.
    group: Group
    description: str  #: One line for tables.
    effects: tuple[str, ...] = ()  #: Names of effects, in the order in which they act.
    kinds: tuple[Kind, ...] = ("linear", "rotary")  #: Kinds of axes, in turn over the seeds.


@dataclass(frozen=True, kw_only=True)
class Recorded:
    """A log and the truth behind it."""

    log: AxisLog  #: The log.
    #: True parameters by the names that estimates use [SI] (`axes.true_values`).
    truth: dict[str, float]
    scales: dict[str, float]  #: Scale of the error of each of them [SI] (`axes.scales`).
    #: Time by which the effort acts later than it is logged [samples]; negative for a delay of the
    #: log.
    delay: float
    #: True effort at constant velocity [N or N m] over velocity [m/s or rad/s], with the offset,
    #: without position-dependent loads.
    curve: Callable[[Float[np.ndarray, " n"]], Float[np.ndarray, " n"]]
    settings: dict[str, Any]  #: Keyword arguments for ``identify``.
    speed_range: tuple[float, float]  #: Lowest and highest speed of the moves [m/s or rad/s].
    #: Twenty velocities over the driven ranges of the directions driven, shape (20,) [m/s or
    #: rad/s].
    velocities: Float[np.ndarray, " 20"]
    #: The simulated axis and its true signals.
    setup: Setup
    run: Run


def _case(group: Group, name: str, description: str, *effects: str, **more: Any) -> Case:
    return Case(name=name, group=group, description=description, effects=effects, **more)


_ALL = (
    _case("ideal", "ideal", "exact effort", "no_noise"),
    _case("noise", "noise", "effort noise only"),
    _case("noise", "noise_half", "effort noise x 0.5", "noise_half"),
    _case("noise", "noise_double", "effort noise x 2", "noise_double"),
    _case("noise", "noise_fourfold", "effort noise x 4", "noise_fourfold"),
    _case("noise", "quantized", "effort quantized to 8-10 bit", "little_noise", "quantized"),
    _case("noise", "correlated_098", "AR(1) disturbance force, 0.98", "correlated_098"),
    _case("noise", "correlated_0998", "AR(1) disturbance force, 0.998", "correlated_0998"),
    _case("noise", "white_force", "white disturbance force", "white_force"),
    _case("in_class", "stribeck", "static friction 1.5 x Coulomb", "stribeck"),
    _case("in_class", "presliding", "LuGre presliding of 2-50 µm", "presliding"),
    _case("in_class", "asymmetry", "directions differ by up to 20 %", "asymmetry"),
    _case("in_class", "spring", "spring load, 0.1-1 x Coulomb", "spring"),
    _case("in_class", "pendulum", "pendulum load, 0.1-1 x Coulomb", "pendulum", kinds=("rotary",)),
    _case("in_class", "friction_drift", "friction -20 % during the log", "friction_drift"),
    _case("in_class", "dwell", "breakaway grows with dwell time", "dwell"),
    _case("in_class", "quadratic", "quadratic viscous friction", "quadratic"),
    _case("in_class", "two_thirds", "2/3-power viscous friction", "two_thirds"),
    _case("in_class", "ripple", "periodic force over position", "ripple"),
    _case("in_class", "constant_load", "constant load, 0.5-2 x Coulomb", "constant_load"),
    _case("in_class", "mass_known", "mass given", "mass_known"),
    _case("in_class", "velocity", "velocity measured as well", "velocity"),
    _case("unmodelled", "mass_wrong", "mass given, 10 % wrong", "mass_wrong"),
    _case("unmodelled", "delay_0_5", "effort delay of 0.5 samples", "delay_0_5"),
    _case("unmodelled", "delay_1", "effort delay of 1 sample", "delay_1"),
    _case("unmodelled", "delay_2", "effort delay of 2 samples", "delay_2"),
    _case("unmodelled", "delay_5", "effort delay of 5 samples", "delay_5"),
    _case("unmodelled", "gain_drift", "torque constant -10 % during the log", "gain_drift"),
    _case("unmodelled", "rate_50", "sampled at 50 Hz", "rate_50"),
    _case("unmodelled", "rate_20", "sampled at 20 Hz", "rate_20"),
    _case("unmodelled", "saturated", "command logged, drive saturates", "saturated"),
    _case("unmodelled", "clipped", "logged effort clipped at its range", "clipped"),
    _case(
        "unmodelled",
        "clipped_in_noise",
        "logged effort clipped before its noise",
        "clipped_in_noise",
    ),
    _case("unmodelled", "spikes", "spikes in 0.2 % of the effort", "spikes"),
    _case("unmodelled", "resonance", "drive resonance at 20-60 Hz", "resonance"),
    _case("unmodelled", "backlash", "backlash, friction on both sides", "backlash"),
    _case("unmodelled", "units", "mm read as m, degrees read as rad", "units"),
    _case("unmodelled", "velocity_delayed", "velocity delay of 2-10 ms", "velocity_delayed"),
    _case("unmodelled", "velocity_filtered", "velocity filtered, 15-60 Hz", "velocity_filtered"),
    _case(
        "unmodelled",
        "velocity_differentiated",
        "velocity differentiated from position",
        "velocity_differentiated",
    ),
    _case("unmodelled", "velocity_scaled", "velocity 3 % too large", "velocity_scaled"),
    _case("unmodelled", "jitter", "sampling jitters, stamps are right", "jitter"),
    _case("unmodelled", "nominal_stamps", "sampling jitters, stamps do not", "nominal_stamps"),
    _case("unmodelled", "noisy_stamps", "stamps jitter, sampling does not", "noisy_stamps"),
    _case("unmodelled", "grouped_stamps", "stamps of groups of 3-12 samples", "grouped_stamps"),
    _case(
        "unmodelled", "rate_stamps", "sampled at 100 Hz, stamps jitter", "rate_100", "noisy_stamps"
    ),
    _case("unmodelled", "lost_samples", "1 % of samples lost, two gaps", "lost_samples"),
    _case(
        "unmodelled",
        "lost_uncounted",
        "0.1-3 % of samples lost, time stamps counted",
        "lost_uncounted",
    ),
    _case("unmodelled", "coarse", "effort of 3-5 bit without noise", "no_noise", "coarse"),
    _case("unmodelled", "gain_step", "gain of the drive changes by 6-25 %", "gain_step"),
    _case("unmodelled", "gain_loss", "gain falls by 5-25 % at the largest effort", "gain_loss"),
    _case("unmodelled", "short_1s", "log of 1 s", "short_1s"),
    _case("unmodelled", "short_2s", "log of 2 s", "short_2s"),
    _case("unmodelled", "single_speed", "one speed only", "single_speed"),
    _case("unmodelled", "sine", "sinusoidal motion", "sine"),
    _case("unmodelled", "steps", "steps of the reference", "steps"),
    _case("unmodelled", "one_direction", "one direction only", "one_direction"),
    _case("unmodelled", "glitches", "1-5 encoder glitches", "glitches"),
    _case("unmodelled", "wrapped", "angle modulo 2 pi", "wrapped", kinds=("rotary",)),
    _case("unmodelled", "delay_stribeck", "delay of 2 samples, Stribeck", "delay_2", "stribeck"),
    _case(
        "unmodelled", "delay_noise", "delay of 2 samples, noise x 4", "delay_2", "noise_fourfold"
    ),
    _case(
        "in_class",
        "presliding_asymmetry",
        "presliding, directions differ",
        "presliding",
        "asymmetry",
    ),
    _case("in_class", "presliding_stribeck", "presliding, Stribeck", "presliding", "stribeck"),
    _case("in_class", "spring_drift", "spring load, friction -20 %", "spring", "friction_drift"),
    _case("unmodelled", "glitches_clipped", "glitches, effort clipped", "glitches", "clipped"),
    _case("unmodelled", "resonance_noise", "resonance, noise x 4", "resonance", "noise_fourfold"),
    _case("unmodelled", "spikes_stribeck", "spikes, Stribeck", "spikes", "stribeck"),
    _case(
        "unmodelled",
        "wrapped_pendulum",
        "angle modulo 2 pi, pendulum load",
        "pendulum",
        "wrapped",
        kinds=("rotary",),
    ),
    _case("unmodelled", "rate_stribeck", "sampled at 50 Hz, Stribeck", "stribeck", "rate_50"),
    _case(
        "unmodelled",
        "steps_rate",
        "steps of the reference, sampled at 250 Hz",
        "steps",
        "rate_250",
    ),
    _case(
        "unmodelled",
        "saturated_delay",
        "drive saturates, delay of 1 sample",
        "saturated",
        "delay_1",
    ),
    _case("unmodelled", "resonance_delay", "resonance, delay of 1 sample", "resonance", "delay_1"),
    _case(
        "unmodelled",
        "correlated_delay",
        "AR(1) 0.998, delay of 2 samples",
        "correlated_0998",
        "delay_2",
    ),
)

CASES: Mapping[str, Case] = MappingProxyType({case.name: case for case in _ALL})
"""Every case by name."""


def _generator(*words: str | int) -> np.random.Generator:
    return np.random.default_rng([crc32(w.encode()) if isinstance(w, str) else w for w in words])


def record(case_name: str, seed: int) -> Recorded:
    """Simulate an axis of one of `CASES` and record its log; case and seed determine both."""
    case = CASES[case_name]
    setup = draw_setup(_generator(case.name, seed), case.kinds[seed % len(case.kinds)], seed)
    for name in case.effects:
        if (change := EFFECTS[name].change) is not None:
            setup = change(setup, _generator(case.name, seed, "change", name))
    run, plant = _simulated(setup, _generator(case.name, seed, "disturbance"))
    noise = _generator(case.name, seed, "noise").standard_normal(run.time.size)
    columns = Columns(
        time=run.time,
        effort=run.effort + setup.noise * plant.limit * noise,
        position=run.reading,
        run=run,
        limit=plant.limit,
    )
    for name in case.effects:
        if (distort := EFFECTS[name].distort) is not None:
            columns = distort(columns, setup, _generator(case.name, seed, "distort", name))
    log = AxisLog(
        name=f"{case.name} {seed}",
        kind=setup.kind,
        time=columns.time,
        effort=columns.effort,
        measured_position=columns.position,
        measured_velocity=columns.velocity,
    )
    speeds = _driven(setup, run)
    known = {} if setup.known_mass is None else {"inertia": setup.known_mass * setup.mass}
    return Recorded(
        log=log,
        truth=true_values(setup),
        scales=scales(setup),
        delay=(setup.actuation_delay - setup.logging_delay) / CYCLE,
        curve=lambda velocity: friction_curve(setup, np.asarray(velocity, dtype=float)),
        settings=known,
        speed_range=(min(min(s) for s in speeds if s), max(max(s) for s in speeds if s)),
        velocities=_spread(speeds),
        setup=setup,
        run=run,
    )


def _driven(setup: Setup, run: Run) -> tuple[list[float], list[float]]:
    """Return the speeds of the moves in the positive and in the negative direction."""
    if setup.pattern in ("sine", "steps"):
        forth, back = float(np.max(run.velocity)), float(-np.min(run.velocity))
        return [0.1 * forth, forth], [0.1 * back, back]
    velocities = [stroke.velocity for stroke in moves(setup)]
    return [v for v in velocities if v > 0], [-v for v in velocities if v < 0]


def _spread(speeds: tuple[list[float], list[float]]) -> Float[np.ndarray, " 20"]:
    """Return twenty velocities from the slowest to the fastest move of each direction."""
    driven = [(sign, s) for sign, s in zip((1.0, -1.0), speeds, strict=True) if s]
    count = 20 // len(driven)
    return np.concatenate([sign * np.linspace(min(s), max(s), count) for sign, s in driven])


def _simulated(setup: Setup, rng: np.random.Generator) -> tuple[Run, Plant]:
    """Return the run of a setup, and its plant."""
    plant = physical(setup)
    n = round(setup.duration / CYCLE)
    nominal = round(CYCLE / FINE_STEP)
    fine_steps = np.full(n, nominal)
    if setup.jitter > 0.0:
        spread = np.round(nominal * setup.jitter * rng.standard_normal(n))
        fine_steps = np.clip(nominal + spread, nominal // 3, 2 * nominal).astype(int)
    time = FINE_STEP * np.concatenate(([0.0], np.cumsum(fine_steps[:-1], dtype=float)))
    motion = motion_of(setup, time)
    viscous = 0.5 * (plant.viscous_positive + plant.viscous_negative)
    feedforward = setup.acceleration_feedforward * setup.mass * motion.acceleration
    feedforward += setup.velocity_feedforward * viscous * motion.velocity
    run = run_plant(
        plant,
        controller_of(setup),
        Inputs(
            reference_position=motion.position,
            reference_velocity=motion.velocity,
            feedforward=feedforward,
            integrate=motion.moving.astype(float),
            disturbance=_disturbance(setup, plant, n, rng),
            fine_steps=fine_steps,
        ),
        # A load heavier than friction is held from the start.
        initial_effort=plant.offset if abs(setup.offset) > 0.5 else 0.0,
    )
    return run, plant


def _disturbance(
    setup: Setup, plant: Plant, n: int, rng: np.random.Generator
) -> Float[np.ndarray, " n"]:
    """Return the disturbance force, held over each cycle [N or N m]."""
    white, driven = rng.standard_normal((2, n))
    force = setup.white_disturbance * plant.limit * white
    if setup.correlated_disturbance > 0.0:
        size = setup.correlated_disturbance * setup.coulomb * plant.limit
        state = rng.standard_normal()
        gain = np.sqrt(1.0 - setup.correlation**2)
        correlated = np.empty(n)
        for k in range(n):
            correlated[k] = state
            state = setup.correlation * state + gain * driven[k]
        force = force + size * correlated
    return force
