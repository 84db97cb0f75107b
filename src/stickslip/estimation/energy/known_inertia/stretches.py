"""A log made ready for the balance of work: noise, smoothed motion, and where friction acts how."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from stickslip.estimation.energy.known_inertia.free_motion import FreeMotion, free_motion, roaming
from stickslip.estimation.energy.known_inertia.hidden_load import (
    LEAST_NOISE,
    ROUNDING,
    ArmMotion,
    ArmSensors,
    arm_motions,
    arms_of,
    lengths_of_runs,
    load_seen,
)
from stickslip.estimation.energy.levels import AxisModel, load_position
from stickslip.estimation.signals.kinematics import REST_SPEED, LowPass
from stickslip.estimation.signals.observation import MotionNoise, motion_noise
from stickslip.records import AxisLog

__all__ = ["Prepared", "Stretch", "prepared", "reconstructed"]

CERTAIN = 5.0
"""Standard deviations of the smoothed velocity beyond which its sign is certain."""

_DOUBT = 10.0
"""Variance of a friction of unknown direction over the mean square of friction: it acts one way
before a turn and the other after, and its likely size must not draw the estimate."""
_AROUND = 6  # samples around a count of the encoder that show its noise
_RINGING = 3  # samples


class SensorNoise(NamedTuple):
    """Standard deviations of the noise on a mass' position and velocity [SI]."""

    position: float
    velocity: float


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """One stretch without gaps, ready for the filter.

    Attributes
    ----------
    part
        Of the log, n samples.
    measured, channels, first
        As `whiten` takes them.
    friction, slope
        Regressors of the friction force and their slopes over each sample, shape (n, p).
    push, push_slope
        Mean and slope over each sample of all other force on the driven mass, where the direction
        of friction is certain, and 0 elsewhere, shape (n,) [N or N m and per second].
    unknown
        Whether the direction of friction is uncertain in each sample, as 0 or 1, shape (n,).
    """

    part: AxisLog
    measured: Float[np.ndarray, "n m"]
    channels: Float[np.ndarray, "m 2"]
    first: Float[np.ndarray, " s"]
    friction: Float[np.ndarray, "n p"]
    slope: Float[np.ndarray, "n p"]
    push: Float[np.ndarray, " n"]
    push_slope: Float[np.ndarray, " n"]
    unknown: Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class Prepared:
    """What the balance of work needs of a log, with the masses as given.

    Attributes
    ----------
    stretches
        Of the log, without gaps.
    doubts
        Of each stretch: variance of the unknown friction over the mean square of friction, where
        its direction is uncertain; 0 elsewhere, shape (n,) [-].
    motions
        Of the driven mass, smoothed.
    size
        Root mean square of the friction [N or N m].
    position_noise
        Standard deviation of the noise on the driven mass' position [m or rad].
    spread
        Standard deviation of the smoothed velocity in the median [m/s or rad/s].
    """

    stretches: tuple[Stretch, ...]
    doubts: tuple[Float[np.ndarray, " _"], ...]
    motions: tuple[FreeMotion | ArmMotion, ...]
    size: float
    position_noise: float
    spread: float


def prepared(parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass) -> Prepared:
    """Return a log ready for the balance of work.

    Parameters
    ----------
    parts
        Stretches of a log without gaps.
    model
        What is known of the axis; the inertia must be.
    low_pass
        That separates the noise of the sensors from motion.
    """
    T = parts[0].sampling_time
    inertia = 0.0 if model.inertia is None else model.inertia
    noise = _sensor_noise(parts, model, low_pass)
    arms = arms_of(parts, model, noise)
    motions = _arm_motions(arms, model, T) if arms else _motions(parts, model, inertia, noise)
    size = _size(parts, motions)
    # What friction can stop within a sample may turn within it, whatever the noise
    slowest = size * T / inertia
    stretches = tuple(
        _stretch(part, model, motion, shown, slowest)
        for part, motion, shown in zip(
            parts, motions, _shown(parts, model, noise, arms), strict=True
        )
    )
    # While the axis crosses the speeds at which its direction is uncertain, friction is one force
    spread = float(np.median(np.concatenate([motion.velocity_spread for motion in motions])))
    crossing = max(CERTAIN * spread * inertia / (size * T), 1.0)
    if arms:
        # A load that is not measured is reconstructed from the spring force. A mass that sticks
        # must not imply a zero spring force: the friction that holds it is as large, and one force
        # over the rest
        doubts = [np.maximum(crossing, lengths_of_runs(s.unknown)) * s.unknown for s in stretches]
    else:
        doubts = [_DOUBT * crossing * s.unknown for s in stretches]
    return Prepared(
        stretches=stretches,
        doubts=tuple(doubts),
        motions=tuple(motions),
        size=size,
        position_noise=noise[0].position,
        spread=spread,
    )


def _sensor_noise(
    parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass
) -> tuple[SensorNoise, ...]:
    """Return the noise on the driven mass and, if there is one, on the load."""
    T = parts[0].sampling_time
    masses = [_joined([(part.measured_position, part.measured_velocity) for part in parts])]
    if load_seen(parts, model):
        masses.append(
            _joined([(load_position(part), part.measured_load_velocity) for part in parts])
        )
    return tuple(_floored(motion_noise(x, v, low_pass, T), x, v) for x, v in masses)


def _joined(
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


def _floored(
    noise: MotionNoise, x: Float[np.ndarray, " n"], v: Float[np.ndarray, " n"] | None
) -> SensorNoise:
    fastest = 0.0 if v is None else float(np.max(np.abs(v)))
    return SensorNoise(
        position=max(noise.position, ROUNDING * float(np.ptp(x)), LEAST_NOISE),
        velocity=max(noise.velocity, ROUNDING * fastest, LEAST_NOISE),
    )


def _motions(
    parts: Sequence[AxisLog], model: AxisModel, inertia: float, noise: Sequence[SensorNoise]
) -> list[FreeMotion]:
    """Smooth the motion of every stretch, with one rate at which friction roams for all."""
    T = parts[0].sampling_time
    measured = [
        (part.measured_position, part.measured_velocity, _force_but_friction(part, model))
        for part in parts
    ]
    rate = roaming(measured, inertia, T, noise[0])
    return [free_motion(*of, inertia, T, noise[0], rate) for of in measured]


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


def _arm_motions(
    arms: Sequence[ArmSensors], model: AxisModel, sampling_time: float
) -> list[ArmMotion]:
    return arm_motions(
        arms,
        inertia=model.inertia or 0.0,
        load_inertia=model.load_inertia or 0.0,
        stiffness=model.stiffness or 0.0,
        sampling_time=sampling_time,
        direction=lambda motion: (~_clear(motion, 0.0)).astype(np.float64),
    )


def reconstructed(parts: Sequence[AxisLog], model: AxisModel, low_pass: LowPass) -> list[AxisLog]:
    """Return stretches with the motion of a load that was not measured, found by the smoother.

    Stretches of a rigid axis, of an arm whose load is measured and of one whose inertia is sought
    are returned as they are.

    Parameters
    ----------
    parts
        Stretches of a log without gaps.
    model
        What is known of the axis.
    low_pass
        That separates the noise of the sensors from motion.
    """
    if model.inertia is None or model.load_inertia is None or load_seen(parts, model):
        return list(parts)
    arms = arms_of(parts, model, _sensor_noise(parts, model, low_pass))
    return [
        replace(
            part,
            measured_load_position=motion.load_position,
            measured_load_velocity=motion.load_velocity,
        )
        for part, motion in zip(
            parts, _arm_motions(arms, model, parts[0].sampling_time), strict=True
        )
    ]


Shown = tuple[Float[np.ndarray, "n m"], Float[np.ndarray, "m 2"], Float[np.ndarray, " s"]]
"""What the sensors show, their channels, and the variance of the first state."""


def _shown(
    parts: Sequence[AxisLog],
    model: AxisModel,
    noise: Sequence[SensorNoise],
    arms: Sequence[ArmSensors],
) -> list[Shown]:
    if arms:
        return [(arm.measured, arm.channels, arm.first) for arm in arms]
    return [_shown_by_all(part, model, noise) for part in parts]


def _shown_by_all(part: AxisLog, model: AxisModel, noise: Sequence[SensorNoise]) -> Shown:
    """Return what the sensors show where the position of every mass is measured."""
    masses = [(part.measured_position, part.measured_velocity)]
    if model.load_inertia is not None:
        masses.append((load_position(part), part.measured_load_velocity))
    measured: list[Float[np.ndarray, " n"]] = []
    channels: list[tuple[float, float]] = []
    first: list[float] = []
    for k, ((x, v), of) in enumerate(zip(masses, noise, strict=True)):
        measured.append(x)
        channels.append((2.0 * k, of.position**2))
        if v is not None:
            measured.append(v)
            channels.append((2.0 * k + 1.0, of.velocity**2))
        fastest = float(np.max(np.abs(np.diff(x)))) / part.sampling_time
        first += [of.position**2, fastest**2 if v is None else of.velocity**2]
    return np.column_stack(measured), np.array(channels), np.array(first)


def _stretch(
    part: AxisLog, model: AxisModel, motion: FreeMotion, shown: Shown, slowest: float
) -> Stretch:
    """Return the friction regressors of a stretch, and what its sensors show."""
    T = part.sampling_time
    measured, channels, first = shown
    velocity = motion.velocity
    clear = _clear(motion, slowest)
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
    return Stretch(
        part=part,
        measured=measured,
        channels=channels,
        first=first,
        friction=np.pad(held * certain[:, None], last),
        slope=np.pad(rise * certain[:, None], last),
        push=np.append(push[:-1] * certain, 0.0),
        push_slope=np.append(push_slope * certain, 0.0),
        unknown=np.append(~certain, True).astype(np.float64),
    )


def _clear(motion: FreeMotion, slowest: float) -> Bool[np.ndarray, " n"]:
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


def _size(parts: Sequence[AxisLog], motions: Sequence[FreeMotion]) -> float:
    """Return the root mean square of the friction [N or N m], above what rounding leaves."""
    friction = np.concatenate([motion.friction for motion in motions])
    effort = np.concatenate([part.effort for part in parts])
    return float(np.sqrt(np.mean(friction**2) + ROUNDING**2 * np.mean(effort**2)))
