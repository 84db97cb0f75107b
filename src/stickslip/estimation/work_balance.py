"""The balance of work along motions that carry no noise, for an axis whose masses are known.

The report multiplies the balance of forces by the measured velocity and sums: noise of the velocity
then meets noise of the forces, and what their product leaves has to be compensated. The balance of
work holds along any other velocity as well (virtual work). Along those that the Kalman filter of
the known masses and spring picks, the sensors' noise enters once only and cancels best: no product
of noises, no variance that would have to be known, and feedback of the noise into the effort does
no harm, as the effort is known. The measured motion decides only where friction acts which way.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.optimize import minimize_scalar

from stickslip.estimation.energy_levels import AxisModel, load_position
from stickslip.estimation.free_arm import ArmMotion, ArmSensors, arm_motions
from stickslip.estimation.free_friction import FreeMotion, free_motion, roaming
from stickslip.estimation.innovations import HeldAxis, whiten
from stickslip.estimation.kinematics import REST_SPEED, LowPass
from stickslip.estimation.observation import MotionNoise, motion_noise
from stickslip.estimation.regression import Regression, summarise_motion
from stickslip.estimation.unseen_load import (
    LEAST_NOISE,
    ROUNDING,
    arms_of,
    lengths_of_runs,
    load_seen,
    said_of_load,
)
from stickslip.records import AxisLog

__all__ = ["reconstructed", "work_regression"]

CERTAIN = 5.0
"""Standard deviations of the smoothed velocity beyond which its sign is certain."""

_AROUND = 6  # samples around a count of the encoder that show its noise
_DISTURBANCE = (-14.0, 2.0)  # decades of a disturbing force's variance over that of friction
_GRID = 9
_RINGING = 3  # samples
_DECADE_TOLERANCE = 0.2


class SensorNoise(NamedTuple):
    """Standard deviations of the noise on a mass' position and velocity [SI]."""

    position: float
    velocity: float


@dataclass(frozen=True, kw_only=True)
class _Stretch:
    """One stretch without gaps, ready for the filter.

    Attributes
    ----------
    part
        Of the log, n samples.
    measured, channels, first
        As `whiten` takes them.
    friction, slope
        Regressors of the friction force and their slopes over each sample, shape (n, p).
    unknown
        Whether the direction of friction is uncertain in each sample, as 0 or 1, shape (n,).
    """

    part: AxisLog
    measured: Float[np.ndarray, "n m"]
    channels: Float[np.ndarray, "m 2"]
    first: Float[np.ndarray, " s"]
    friction: Float[np.ndarray, "n p"]
    slope: Float[np.ndarray, "n p"]
    unknown: Float[np.ndarray, " n"]


def work_regression(
    parts: Sequence[AxisLog],
    model: AxisModel,
    low_pass: LowPass,
    *,
    samples: int,
    notes: tuple[str, ...],
) -> Regression:
    """Return the whitened rows of the balance; their least squares is the estimate.

    Friction enters where the direction of the smoothed motion is certain; elsewhere, at reversals
    and rests, it is any force of the size that friction has. How much of a disturbing force there
    is besides is found by maximum likelihood. A load whose position is not measured is one more
    thing that the filter finds, from where it pulls the driven mass; where it began is not assumed.

    Parameters
    ----------
    parts
        Stretches of a log without gaps.
    model
        What is known of the axis; the inertia must be.
    low_pass
        By which the noise of the sensors is told from motion.
    samples
        Of the whole log.
    notes
        What was done to the log before.
    """
    T = parts[0].sampling_time
    inertia = 0.0 if model.inertia is None else model.inertia
    axis = HeldAxis.of(
        inertia=inertia,
        load_inertia=model.load_inertia,
        stiffness=model.stiffness,
        sampling_time=T,
    )
    noise = _sensor_noise(parts, model, low_pass)
    arms = arms_of(parts, model, noise)
    motions = _arm_motions(arms, model, T) if arms else _motions(parts, model, inertia, noise)
    size = _size(parts, motions)
    # What friction can stop within a sample may turn within it, whatever the noise
    slowest = size * T / inertia
    stretches = [
        _stretch(part, model, motion, shown, slowest)
        for part, motion, shown in zip(
            parts, motions, _shown(parts, model, noise, arms), strict=True
        )
    ]
    # While the axis crosses the speeds at which its direction is uncertain, friction is one force
    spread = float(np.median(np.concatenate([motion.velocity_spread for motion in motions])))
    crossing = max(CERTAIN * spread * inertia / (size * T), 1.0)
    if arms:
        # A load that is not measured is told from its spring's force. A mass that sticks must not
        # tell that there is none: the friction that holds it is as large, and one over the rest
        doubts = [np.maximum(crossing, lengths_of_runs(s.unknown)) * s.unknown for s in stretches]
    else:
        doubts = [crossing * s.unknown for s in stretches]

    def rows(decades: float, *, effort: bool = False) -> tuple[Float[np.ndarray, "r c"], float]:
        # What the effort alone would do comes last, as one more force, if asked for
        made = [
            whiten(
                axis.transition,
                axis.held,
                axis.ramped,
                s.part.effort,
                s.measured,
                s.channels,
                np.column_stack([s.friction, s.part.effort]) if effort else s.friction,
                np.pad(s.slope, ((0, 0), (0, 1))) if effort else s.slope,
                size**2 * (doubt + 10.0**decades),
                s.first,
                T,
            )
            for s, doubt in zip(stretches, doubts, strict=True)
        ]
        return np.concatenate([white for white, _ in made]), sum(logs for _, logs in made)

    def cost(decades: float) -> float:
        white, logs = rows(decades)
        # With the measurements last, the last of R is the norm of what least squares leaves of them
        left = np.asarray(np.linalg.qr(np.roll(white, -1, axis=1), mode="r"))
        return float(left[-1, -1] ** 2) + logs

    likeliest = _least(cost)
    white, _ = rows(likeliest, effort=True)
    names = model.terms.names
    friction = white[:, [1 + k for k, name in enumerate(names) if name.startswith("coulomb")]]
    scale = float(np.sqrt(np.mean(np.sum(friction**2, axis=1))))
    white /= scale if scale > 0 else 1.0  # a row is then a force, on a typical scale
    return Regression(
        kind=parts[0].kind,
        names=names,
        time=np.concatenate([np.repeat(s.part.time[1:], s.channels.shape[0]) for s in stretches]),
        target=white[:, 0],
        regressors=white[:, 1:-1],
        effect=float(np.linalg.norm(white[:, -1])),
        regressor_noise=np.zeros(len(names)),
        quantity="effort",
        motion=summarise_motion(
            [part.measured_position for part in parts],
            [motion.velocity for motion in motions],
            T,
            (noise[0].position, spread),
        ),
        samples=samples,
        notes=(
            f"a disturbing force, white from sample to sample, is taken to have "
            f"{size * 10.0 ** (0.5 * likeliest):.2g} {parts[0].unit('effort')} rms "
            "(maximum likelihood)",
            *said_of_load(parts[0], motions),
            *notes,
        ),
    )


def _least(cost: Callable[[float], float]) -> float:
    """Return the decades at which a cost is least: on a grid, then between its points."""
    low, high = _DISTURBANCE
    grid = np.linspace(low, high, _GRID)
    best = float(grid[int(np.argmin([cost(float(decades)) for decades in grid]))])
    step = float(grid[1] - grid[0])
    found = minimize_scalar(
        cost,
        bounds=(max(best - step, low), min(best + step, high)),
        method="bounded",
        options={"xatol": _DECADE_TOLERANCE},
    )
    return float(found.x)


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
    """Return positions and velocities of all stretches, without what tells nothing of their noise.

    While an encoder does not count it shows no noise, but that is not to say that it has none.
    """
    positions: list[Float[np.ndarray, " _"]] = []
    velocities: list[Float[np.ndarray, " _"]] = []
    end = 0.0
    for x, v in measured:
        counts = np.diff(x, prepend=x[0]) != 0.0
        told = np.convolve(counts, np.ones(2 * _AROUND + 1), mode="same") > 0.0
        if np.any(told):
            positions.append(x[told] - x[told][0] + end)
            end = float(positions[-1][-1])
            if v is not None:
                velocities.append(v[told])
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
    if model.stiffness is None:
        return part.effort
    spring = model.stiffness * (part.measured_position - load_position(part))
    return part.effort - np.append(0.5 * (spring[1:] + spring[:-1]), spring[-1])


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
        By which the noise of the sensors is told from motion.
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
) -> _Stretch:
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
    last = ((0, 1), (0, 0))  # the last effort is held over no sample of the log
    return _Stretch(
        part=part,
        measured=measured,
        channels=channels,
        first=first,
        friction=np.pad(held * certain[:, None], last),
        slope=np.pad(rise * certain[:, None], last),
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
