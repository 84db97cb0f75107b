"""A controller of a scenario on the plant in fine steps, with faults, and the judgement of it."""

from dataclasses import dataclass, replace
from itertools import pairwise
from math import hypot, isfinite, nan, sqrt
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np

from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseSeriesPlanner
from stickslip.plants import FlexibleArm
from stickslip.records import PositioningOutcome, SensorSample
from stickslip.scenario import (
    ARM_CONTROLLERS,
    AXES,
    AXIS_CONTROLLERS,
    GuessTable,
    Scenario,
    SensorsTable,
    TaskTable,
    table_from,
)
from studies.mismatch.plant import FINE_STEP, HeldPlant, Plant
from studies.positioning_faults.cases import Case, Channels

_PLANNED, _ANGLE = 0.02, 0.06  # samples of the plans of the shortest times: time [s], swing [rad]
PUSHED = 0.05  # duration of a push [s]
_FACTOR = 3.0  # of the parameters of an arm around their means
_STOPPED = -1e9  # effort of a controller that raised an error


@dataclass(frozen=True, kw_only=True)
class Axis:
    """A plant, its task, and what the controller assumes about it.

    ``tables`` are the values of ``[axis]``, ``[controller]`` and ``[guess]``. ``velocity`` is
    whether velocities are measured, ``differentiated`` whether they are differences of positions.
    """

    plant: Plant
    tables: dict[str, dict[str, Any]]
    targets: tuple[float, ...]
    tolerance: float
    duration: float
    sampling_time: float
    noise: float
    encoder_step: float
    seed: int
    velocity_noise: float = 0.0
    velocity: bool = True
    differentiated: bool = False

    @property
    def flexible(self) -> bool:
        """Whether it is an arm."""
        return self.plant.load_mass > 0.0

    def scenario(self) -> Scenario:
        """Return the scenario."""
        controllers = ARM_CONTROLLERS if self.flexible else AXIS_CONTROLLERS
        return Scenario(
            axis=table_from(AXES, self.tables["axis"], name="axis", kind="linear"),
            task=TaskTable(
                targets=self.targets,
                tolerance=self.tolerance,
                duration=self.duration,
                sampling_time=self.sampling_time,
            ),
            sensors=SensorsTable(
                position_noise=self.noise,
                encoder_step=self.encoder_step,
                velocity="measured" if self.velocity else "none",
                velocity_noise=self.velocity_noise,
            ),
            controller=table_from(
                controllers, self.tables["controller"], name="controller", kind="linear"
            ),
            guess=GuessTable(**self.tables["guess"]),
        )


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """The outcome of the moves of one axis; lengths over that of the move."""

    #: Distance from the target at the end of each move, of an arm that of the mass farther away,
    #: its swing included.
    errors: tuple[float, ...]
    #: Time until the error stays within the tolerance, of each move [s]; NaN if it does not.
    settling: tuple[float, ...]
    #: Settling time over the shortest of an arm without faults, by its planner; NaN likewise, and
    #: for a single mass.
    over_shortest: tuple[float, ...]
    left: bool  #: Whether the driven mass has left the travel that the guard allows.
    farthest: float  #: Largest distance of the driven mass beyond the path at any time.
    false: int  #: Moves whose outcome was ``reached`` outside twice the tolerance.
    peak: float  #: Largest magnitude of the effort over its limit; infinite if one was not finite.
    raised: str  #: Error that ended the run, or empty.
    worst_step: float  #: Longest time of a step [s].
    why: tuple[str, ...]  #: Reasons of the controller, of each move.


def symmetric(
    mass: float,
    friction: tuple[float, float, float],
    *,
    stribeck_velocity: float,
    load: tuple[float, float] = (0.0, 0.0),
) -> Plant:
    """Return a plant with the same friction in both directions.

    ``friction`` is its Coulomb friction, its viscous friction, and the ratio of static to Coulomb
    friction; ``load`` the mass 2 of an arm and the stiffness of its spring.
    """
    coulomb, viscous, static_ratio = friction
    return Plant(
        mass=mass,
        coulomb_positive=coulomb,
        coulomb_negative=coulomb,
        viscous_positive=viscous,
        viscous_negative=viscous,
        static_ratio=static_ratio,
        stribeck_velocity=stribeck_velocity,
        load_mass=load[0],
        coupling_stiffness=load[1],
    )


def axis_table(plant: Plant) -> dict[str, Any]:
    """Return the table ``[axis]`` of a symmetric plant."""
    arm = {"load_mass": plant.load_mass, "stiffness": plant.coupling_stiffness}
    return {
        "mass": plant.mass,
        **(arm if plant.load_mass > 0.0 else {}),
        "coulomb_friction": plant.coulomb_positive,
        "viscous_friction": plant.viscous_positive,
        "static_friction": plant.static_ratio * plant.coulomb_positive,
    }


def axes(count: int, seed: int, *, method: str, sampling_time: float, ratio: float) -> list[Axis]:
    """Draw axes around that of van de Wijdeven (2002), part B, Table 1.

    ``ratio`` is the effort limit over Coulomb friction [-].
    """
    generator = np.random.default_rng(seed)
    drawn: list[Axis] = []
    for _ in range(count):
        m, f, c = np.array([150.0, 100.0, 700.0]) * 2.0 ** generator.uniform(-1.0, 1.0, 3)
        friction = f, c, float(generator.uniform(1.05, 1.3))
        plant = symmetric(m, friction, stribeck_velocity=1e-3)
        wrong = 1.0 + generator.uniform(-0.3, 0.3, 2)
        body = 1.0 + float(generator.uniform(-0.05, 0.05))
        target = float(generator.choice([-1.0, 1.0]) * generator.uniform(2e-3, 2e-2))
        drawn.append(
            Axis(
                plant=plant,
                tables={
                    "axis": axis_table(plant),
                    "controller": {"method": method, "effort_limit": ratio * f},
                    "guess": {
                        "mass": body * m,
                        "coulomb_friction": wrong[0] * f,
                        "viscous_friction": wrong[1] * c,
                    },
                },
                targets=(target,),
                tolerance=20e-6,
                duration=3.0,
                sampling_time=sampling_time,
                noise=1e-6,
                encoder_step=1e-6,
                seed=int(generator.integers(2**63)),
                velocity=method == "landing",
            )
        )
    return drawn


def arms(
    count: int,
    seed: int,
    *,
    known: bool,
    method: str = "tracked",
    duration: float = 100.0,
    sampling_time: float = 0.02,
) -> list[Axis]:
    """Draw arms around that of van de Wijdeven (2002), part A; two moves each of a duration [s].

    ``known`` is whether friction is known within 5 %; otherwise nothing is known of it.
    """
    generator = np.random.default_rng(seed)
    drawn: list[Axis] = []
    for _ in range(count):
        draw = _FACTOR ** generator.uniform(-1.0, 1.0, 5)
        m1, m2, ks, f, c = (np.array([1.0, 1.0, 1.0, 0.1, 0.1]) * draw).tolist()
        friction = f, c, float(generator.uniform(1.0, 1.3))
        plant = symmetric(m1, friction, stribeck_velocity=1e-3, load=(m2, ks))
        wrong = 1.0 + generator.uniform(-0.05, 0.05, 2)
        ways = generator.choice([-1.0, 1.0], 2) * generator.uniform(0.7, 1.3, 2)
        guess = {
            "coulomb_friction": float(wrong[0] * f),
            "viscous_friction": float(wrong[1] * c),
            "friction_uncertainty": 0.05,
        }
        drawn.append(
            Axis(
                plant=plant,
                tables={
                    "axis": axis_table(plant),
                    "controller": {"method": method, "effort_limit": 1.0},
                    "guess": guess if known else {},
                },
                targets=tuple(np.cumsum(ways).tolist()),
                tolerance=5e-5,
                duration=duration,
                sampling_time=sampling_time,
                noise=0.0,
                encoder_step=0.0,
                seed=int(generator.integers(2**63)),
            )
        )
    return drawn


def shortest(axis: Axis) -> tuple[float, ...]:
    """Return the shortest time of each move of an arm, with the mechanics known [s]."""
    plant = axis.plant
    law = CoulombViscousFriction.symmetric(
        coulomb_friction=plant.coulomb_positive,
        viscous_friction=plant.viscous_positive,
        static_friction=plant.static_ratio * plant.coulomb_positive,
    )
    planner = PulseSeriesPlanner(
        arm=FlexibleArm(
            mass_1=plant.mass,
            mass_2=plant.load_mass,
            stiffness=plant.coupling_stiffness,
            friction=law,
        ),
        sampling_time=min(_PLANNED, _ANGLE * sqrt(plant.load_mass / plant.coupling_stiffness)),
        effort_limit=float(axis.tables["controller"]["effort_limit"]),
    )
    ends = (0.0, *axis.targets)
    ways = (end - start for start, end in pairwise(ends))
    return tuple(planner.plan((0.0, 0.0, 0.0, 0.0), way).duration for way in ways)


def move_axis(axis: Axis, case: Case) -> Outcome:
    """Run the moves of an axis with the faults of a case."""
    channels, T = case.channels, axis.sampling_time
    if channels.noise is not None:
        noise = channels.noise(T)
        axis = replace(
            axis,
            noise=noise.position,
            velocity_noise=noise.velocity,
            encoder_step=noise.step,
            differentiated=noise.differentiated,
        )
    axis = replace(axis, velocity=axis.velocity and channels.velocity)
    generator = np.random.default_rng(axis.seed)
    built: Any = axis.scenario().build(Path())
    controller = getattr(built, "guarded", built.controller)
    limit = float(axis.tables["controller"]["effort_limit"])
    plant = HeldPlant(case.plant(axis.plant, T), start=0.0, steps=round(T / FINE_STEP))
    getattr(controller, "warm_up", lambda: None)()
    state, raised, effort = controller.init(), "", 0.0
    ends = np.array([0.0, *axis.targets])
    lengths = np.abs(np.diff(ends))
    low, high = float(ends.min()), float(ends.max())
    limits = getattr(controller, "limits", None)
    allowed = (-np.inf, np.inf) if limits is None else limits.travel
    per_move = round(axis.duration / T)
    seen: list[SensorSample] = []
    errors: list[float] = []
    settling: list[float] = []
    why: list[str] = []
    farthest, false, peak, worst, last, left = 0.0, 0, 0.0, 0.0, ends[0], False
    frequency = np.sqrt(axis.plant.coupling_stiffness / max(axis.plant.load_mass, 1e-300))
    for move, target in enumerate(axis.targets):
        if move > 0 and not raised:
            state = controller.retargeted(state, target)
        outside = 0
        for k in range(move * per_move, (move + 1) * per_move):
            if case.retargeted is not None and not raised and k == round(case.retargeted / T):
                target *= 0.5  # noqa: PLW2901 - to that end the move goes on
                state = controller.retargeted(state, target)
            x, v, x2, v2 = plant.motion
            seen.append(_measured(axis, case, k, (x, v, x2, v2), generator, seen))
            sample = seen[max(k - channels.delay, 0)]._replace(time=k * T)
            if not raised:
                begun = perf_counter()
                try:
                    state, effort = controller.step(state, sample)
                except Exception as error:  # noqa: BLE001 - any error is a result here
                    raised, effort = f"{type(error).__name__}: {error}", _STOPPED
                worst = max(worst, perf_counter() - begun)
            if raised or not isfinite(effort):
                peak = peak if raised else np.inf
                effort = 0.0
            peak = max(peak, abs(effort) / limit)
            plant.advance(_sent(channels, effort, limit, generator), _push(axis, case, k, limit))
            farthest = max(farthest, (x - high) / lengths[move], (low - x) / lengths[move])
            left = left or not allowed[0] <= x <= allowed[1]
            off = abs(x - target)
            if axis.flexible:
                off = max(off, hypot(x2 - x, v2 / frequency))
            outside = k if off > axis.tolerance else outside
            last = off
        errors.append(last / lengths[move])
        stays = last <= axis.tolerance
        settling.append((outside + 1 - move * per_move) * T if stays else nan)
        outcome = controller.outcome(state)
        false += outcome is PositioningOutcome.REACHED and last > 2.0 * axis.tolerance
        why.append(controller.why(state) or "")
    least = shortest(axis) if axis.flexible else (nan,) * len(settling)
    return Outcome(
        errors=tuple(errors),
        settling=tuple(settling),
        over_shortest=tuple(t / each for t, each in zip(settling, least, strict=True)),
        left=left,
        farthest=farthest,
        false=false,
        peak=peak,
        raised=raised,
        worst_step=worst,
        why=tuple(why),
    )


def _measured(
    axis: Axis,
    case: Case,
    k: int,
    motion: tuple[float, float, float, float],
    generator: np.random.Generator,
    seen: list[SensorSample],
) -> SensorSample:
    """Return what the sensors show."""
    channels, time = case.channels, k * axis.sampling_time
    noise = generator.normal(size=2) * axis.noise
    lost, glitch = generator.uniform(size=2)
    x, v, x2, v2 = motion
    if time >= channels.frozen_from and seen:
        return seen[-1]._replace(time=time)
    if lost < channels.lost:
        return SensorSample(time, nan, nan, nan, nan)
    position = x + noise[0]
    if glitch < channels.glitches:
        position += abs(axis.targets[0])
    load = x2 + noise[1]
    if axis.encoder_step > 0.0:
        position = axis.encoder_step * round(position / axis.encoder_step)
        load = axis.encoder_step * round(load / axis.encoder_step)
    if not axis.velocity:
        v, v2 = nan, nan
    elif axis.differentiated:
        v, v2 = _differences(position, load, axis, seen)
    elif axis.velocity_noise > 0.0:
        v, v2 = np.array((v, v2)) + axis.velocity_noise * generator.normal(size=2)
    if not axis.flexible or channels.missing_load:
        return SensorSample(time, position, v, nan, nan)
    return SensorSample(time, position, v, load, v2)


def _differences(
    position: float, load: float, axis: Axis, seen: list[SensorSample]
) -> tuple[float, float]:
    """Return the velocities of both masses by their last two positions."""
    if not seen:
        return 0.0, 0.0
    T, last = axis.sampling_time, seen[-1]
    return (position - last.measured_position) / T, (load - last.measured_load_position) / T


def _sent(channels: Channels, effort: float, limit: float, generator: np.random.Generator) -> float:
    """Return the effort that acts."""
    gain = channels.gain * (1.0 + channels.effort_noise * float(generator.normal()))
    if channels.effort_step > 0.0:
        effort = channels.effort_step * limit * round(effort / (channels.effort_step * limit))
    largest = channels.clip * limit
    return gain * min(max(effort, -largest), largest)


def _push(axis: Axis, case: Case, k: int, limit: float) -> float:
    time = k * axis.sampling_time
    return case.channels.push * limit if 0.0 <= time - 0.5 * axis.duration < PUSHED else 0.0
