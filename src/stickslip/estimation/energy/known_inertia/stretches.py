"""A log prepared for the balance of work: noise, smoothed motion, and the direction of friction."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.energy.known_inertia.free_friction import (
    DrivenMotion,
    FreeAxis,
    FreeMotion,
    SensorData,
    sensor_data,
)
from stickslip.estimation.energy.levels import AxisModel, load_position
from stickslip.estimation.signals.kinematics import REST_SPEED, LowPass, noise_level
from stickslip.estimation.signals.observation import motion_noise
from stickslip.records import AxisLog

CERTAIN = 5.0
"""Standard deviations of the smoothed velocity beyond which its sign is certain."""

_DOUBT = 10.0
"""Variance of a friction of unknown direction over the mean square of friction: it acts one way
before a turn and the other after, and its likely size must not draw the estimate."""
_AROUND = 6  # samples around a count of the encoder that show its noise
_RINGING = 3  # samples for which the smoothed velocity rings around a jump of friction
_ROUNDING = 1e-7  # of the largest value: noise that a log without any is taken to have
_LEAST_NOISE = 1e-150  # of a signal that is zero throughout
_FREE = 1e4  # times faster than elsewhere, where friction may be anything
_WITHIN_95 = 1.96  # standard deviations


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """One stretch of n samples without gaps, ready for the filter."""

    part: AxisLog
    sensors: SensorData
    motion: FreeMotion  # of the driven mass, smoothed
    friction: Float[np.ndarray, "n p"]  # regressors of the friction force
    slope: Float[np.ndarray, "n p"]  # their slopes over each sample
    push: Float[np.ndarray, " n"]
    """Mean over each sample of all other force on the driven mass, where the direction of friction
    is certain, and 0 elsewhere [N or N m]."""
    push_slope: Float[np.ndarray, " n"]  # its slope [N/s or N m/s]
    doubt: Float[np.ndarray, " n"]
    """Variance of the unknown friction over the mean square of friction, where its direction is
    uncertain; 0 elsewhere [-]."""


@dataclass(frozen=True, kw_only=True)
class PreparedStretches:
    """All that the balance of work needs of a log, with the masses as given."""

    stretches: tuple[Stretch, ...]
    size: float  # root mean square of the friction [N or N m]
    position_noise: float  # of the driven mass [m or rad]
    spread: float  # standard deviation of the smoothed velocity in the median [m/s or rad/s]


def prepared(parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass) -> PreparedStretches:
    """Return stretches of a log without gaps ready for the balance of work, of a known inertia.

    The low-pass separates the noise of the sensors from motion.
    """
    T, m = parts[0].sampling_time, model.driven
    noise = _sensor_noise(parts, model, low_pass)
    hidden = model.load_inertia is not None and not _load_seen(parts, model)
    measured = _driven_motions(parts, model, noise[0], hidden=hidden)
    motions = _smoothed(measured, model, T, hidden=hidden)
    sensors = measured if hidden else [_all_sensors(part, model, noise) for part in parts]
    size = _friction_size(parts, motions)
    # While the axis crosses the speeds at which its direction is uncertain, friction is one force
    spread = float(np.median(np.concatenate([motion.velocity_spread for motion in motions])))
    crossing = max(CERTAIN * spread * m / (size * T), 1.0)
    return PreparedStretches(
        stretches=tuple(
            # What friction can stop within a sample may turn within it, whatever the noise
            _stretch(part, model, motion, shown, slowest=size * T / m, crossing=crossing)
            for part, motion, shown in zip(parts, motions, sensors, strict=True)
        ),
        size=size,
        position_noise=noise[0][0],
        spread=spread,
    )


def _load_seen(parts: Sequence[AxisLog], model: AxisModel) -> bool:
    """Return whether there is a load and its position is measured."""
    return model.load_inertia is not None and parts[0].measured_load_position is not None


def _sensor_noise(
    parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass
) -> list[tuple[float, float]]:
    """Return noise of position and velocity of the driven mass and, if it is seen, of the load."""
    masses = [_where_counting([(part.measured_position, part.measured_velocity) for part in parts])]
    if _load_seen(parts, model):
        load = [(load_position(part), part.measured_load_velocity) for part in parts]
        masses.append(_where_counting(load))
    noises: list[tuple[float, float]] = []
    for x, v in masses:
        noise = motion_noise(x, v, low_pass, parts[0].sampling_time)
        fastest = 0.0 if v is None else float(np.max(np.abs(v)))
        position = max(noise.position, _ROUNDING * float(np.ptp(x)), _LEAST_NOISE)
        noises.append((position, max(noise.velocity, _ROUNDING * fastest, _LEAST_NOISE)))
    return noises


def _where_counting(
    measured: Sequence[tuple[Float[np.ndarray, " _"], Float[np.ndarray, " _"] | None]],
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"] | None]:
    """Return positions and velocities of all stretches, where their noise is visible.

    While an encoder does not count, its noise is not visible.
    """
    positions: list[Float[np.ndarray, " _"]] = []
    velocities: list[Float[np.ndarray, " _"]] = []
    end = 0.0
    for x, v in measured:
        counts = np.diff(x, prepend=x[0]) != 0.0
        counting = np.convolve(counts, np.ones(2 * _AROUND + 1), mode="same") > 0.0
        if np.any(counting):
            positions.append(x[counting] - x[counting][0] + end)
            end = float(positions[-1][-1])
            if v is not None:
                velocities.append(v[counting])
    if not positions:
        return measured[0]
    return np.concatenate(positions), np.concatenate(velocities) if velocities else None


def _force_but_friction(part: AxisLog, model: AxisModel) -> Float[np.ndarray, " n"]:
    """Return effort less the mean spring force over each sample [N or N m]."""
    spring = _spring_force(part, model)
    return part.effort - np.append(0.5 * (spring[1:] + spring[:-1]), spring[-1])


def _spring_force(part: AxisLog, model: AxisModel) -> Float[np.ndarray, " n"]:
    """Return the force with which the spring holds back the driven mass [N or N m].

    It is 0 for a rigid axis, and where the position of the load is not measured.
    """
    if model.stiffness is None or part.measured_load_position is None:
        return np.zeros(len(part))
    return model.stiffness * (part.measured_position - load_position(part))


def _driven_motions(
    parts: Sequence[AxisLog], model: AxisModel, noise: tuple[float, float], *, hidden: bool
) -> list[DrivenMotion]:
    """Return the measurements from which the motion of the driven mass is smoothed.

    Noise of a velocity of a hidden load is its variation from sample to sample.
    """
    if not hidden:
        return [
            DrivenMotion.of(
                part.measured_position,
                part.measured_velocity,
                _force_but_friction(part, model),
                model.driven,
                parts[0].sampling_time,
                noise,
            )
            for part in parts
        ]
    velocities = [part.measured_load_velocity for part in parts]
    seen = [v for v in velocities if v is not None]
    velocity = np.concatenate(seen) if seen else np.zeros(1)
    load_noise = max(
        noise_level(velocity) if seen else 0.0,
        _ROUNDING * float(np.max(np.abs(velocity))),
        _LEAST_NOISE,
    )
    return [DrivenMotion.of_arm(part, model, noise, load_noise) for part in parts]


def _smoothed(
    measured: Sequence[DrivenMotion], model: AxisModel, sampling_time: float, *, hidden: bool
) -> list[FreeMotion]:
    """Smooth the motion of every stretch, with one rate of friction for all.

    A hidden load is smoothed with the driven mass. A mass that sticks is held by whatever force the
    spring has, which no walk is likely to follow: where the first pass leaves the direction of
    friction uncertain, a second one lets friction be anything, so that the load is estimated from
    the rest alone.
    """
    model = model if hidden else replace(model, load_inertia=None, stiffness=None)
    axis = FreeAxis.of(model, sampling_time)
    rate = axis.likeliest_rate(measured)
    motions: list[FreeMotion] = []
    for one in measured:
        motion = axis.motion(one, rate)
        if hidden:
            free = (~_direction_certain(motion, 0.0)).astype(np.float64)
            motion = replace(motion, load=axis.motion(one, rate, 1.0 + _FREE * free).load)
        motions.append(motion)
    return motions


def reconstructed(parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass) -> list[AxisLog]:
    """Return stretches with the motion of a load that was not measured, by the smoother.

    Stretches of a rigid axis, of an arm whose load is measured and of one whose inertia is sought
    are returned as they are.
    """
    if model.inertia is None or model.load_inertia is None or _load_seen(parts, model):
        return list(parts)
    noise = _sensor_noise(parts, model, low_pass)
    arms = _driven_motions(parts, model, noise[0], hidden=True)
    motions = _smoothed(arms, model, parts[0].sampling_time, hidden=True)
    return [
        replace(part, measured_load_position=load.position, measured_load_velocity=load.velocity)
        for part, motion in zip(parts, motions, strict=True)
        if (load := motion.load) is not None
    ]


def load_reconstruction_note(part: AxisLog, motions: Sequence[FreeMotion]) -> tuple[str, ...]:
    """Return what a user should know of a load that was reconstructed, if it was."""
    loads = [motion.load for motion in motions if motion.load is not None]
    if not loads:
        return ()
    half = _WITHIN_95 * float(np.median(np.concatenate([load.spread for load in loads])))
    unit = part.unit("position")
    note = (
        "the position of the load is not measured: it is reconstructed from the motion of the "
        f"driven mass, to +-{half:.2g} {unit} (95 %) if both masses and the stiffness are right"
    )
    movement = float(np.sqrt(np.mean([np.var(load.position) for load in loads])))
    if half < movement:
        return (note,)
    return (
        f"{note}; that is no better than not knowing it, as it moves by {movement:.2g} {unit} "
        "rms: friction is found without it, where an interval is given, but energies and the "
        "simulated motion are not to be relied on; measure the load's position, or record a longer "
        "motion that shakes the load",
    )


def _all_sensors(
    part: AxisLog, model: AxisModel, noise: Sequence[tuple[float, float]]
) -> SensorData:
    """Return the measurements where the position of every mass is measured."""
    masses = [(part.measured_position, part.measured_velocity)]
    if model.load_inertia is not None:
        masses.append((load_position(part), part.measured_load_velocity))
    return sensor_data(masses, noise, part.sampling_time)


def _stretch(
    part: AxisLog,
    model: AxisModel,
    motion: FreeMotion,
    sensors: SensorData,
    *,
    slowest: float,
    crossing: float,
) -> Stretch:
    """Return the friction regressors of a stretch, and its measurements.

    No direction is certain below the speed ``slowest`` near a turn; ``crossing`` is the number of
    samples in which the axis crosses the uncertain speeds.
    """
    T, velocity = part.sampling_time, motion.velocity
    clear = _direction_certain(motion, slowest)
    certain = clear[1:] & clear[:-1] & (velocity[1:] * velocity[:-1] > 0)
    mean, slope = np.diff(motion.position) / T, np.diff(velocity) / T
    direction = np.sign(velocity[1:])
    held = model.terms.force_columns(mean, direction)
    half = 0.5 * T * slope
    rise = model.terms.force_columns(mean + half, direction)
    rise = (rise - model.terms.force_columns(mean - half, direction)) / T
    push = _force_but_friction(part, model)
    push_slope = -np.diff(_spring_force(part, model)) / T
    last = ((0, 1), (0, 0))  # the last effort is held over no sample of the log
    unknown = np.append(~certain, True).astype(np.float64)
    if motion.load is None:
        doubt = _DOUBT * crossing * unknown
    else:
        # A load that is not measured is reconstructed from the spring force. A mass that sticks
        # must not imply a zero spring force: the friction that holds it is as large, and one force
        # over the rest
        doubt = np.maximum(crossing, _lengths_of_runs(unknown)) * unknown
    return Stretch(
        part=part,
        sensors=sensors,
        motion=motion,
        friction=np.pad(held * certain[:, None], last),
        slope=np.pad(rise * certain[:, None], last),
        push=np.append(push[:-1] * certain, 0.0),
        push_slope=np.append(push_slope * certain, 0.0),
        doubt=doubt,
    )


def _direction_certain(motion: FreeMotion, slowest: float) -> Bool[np.ndarray, " n"]:
    """Return where the direction of friction is certain.

    Near a turn or a rest, no direction is certain below the slowest speed; elsewhere, below that
    and the speed of a rest.
    """
    velocity = motion.velocity
    clear = np.abs(velocity) > CERTAIN * motion.velocity_spread
    # Where friction jumps within a sample, the smoothed velocity rings for a few of them
    turning = np.convolve(~clear, np.ones(2 * _RINGING + 1), mode="same") > 0
    clear &= ~(turning & (np.abs(velocity) < slowest))
    # And a real axis gives way before it slips
    least = REST_SPEED * float(np.max(np.abs(velocity)))
    clear &= np.abs(velocity) >= min(slowest, least)
    return clear


def _lengths_of_runs(marks: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
    """Return, for each sample, how many in a row are like it."""
    turns = np.flatnonzero(np.diff(marks)) + 1
    runs = np.diff(np.concatenate([[0], turns, [marks.size]]))
    return np.repeat(runs, runs).astype(np.float64)


def _friction_size(parts: Sequence[AxisLog], motions: Sequence[FreeMotion]) -> float:
    """Return the root mean square of the friction [N or N m], above what rounding leaves."""
    friction = np.concatenate([motion.friction for motion in motions])
    effort = np.concatenate([part.effort for part in parts])
    return float(np.sqrt(np.mean(friction**2) + _ROUNDING**2 * np.mean(effort**2)))
