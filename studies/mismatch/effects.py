"""Deviations from an ideal axis or an ideal log, one effect each; effects combine.

An effect changes the setup before the simulation, distorts the recorded columns after it, or does
both.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.signal import lfilter

from studies.mismatch.axes import CYCLE, Setup, with_speed
from studies.mismatch.plant import Run

Rng = np.random.Generator


@dataclass(frozen=True, kw_only=True)
class Columns:
    """The columns of a log while it is recorded, shape (n,) each, and the run behind them."""

    time: Float[np.ndarray, " n"]  #: Time stamps [s].
    effort: Float[np.ndarray, " n"]  #: Logged effort [N or N m].
    position: Float[np.ndarray, " n"]  #: Measured position [m or rad].
    velocity: Float[np.ndarray, " n"] | None = None  #: Measured velocity [m/s or rad/s], or None.
    run: Run  #: True signals at all instants.
    limit: float  #: Of the drive [N or N m].

    def rows(self, kept: Any) -> "Columns":
        """Return the rows with these indices."""
        velocity = None if self.velocity is None else self.velocity[kept]
        return replace(
            self,
            time=self.time[kept],
            effort=self.effort[kept],
            position=self.position[kept],
            velocity=velocity,
        )


Change = Callable[[Setup, Rng], Setup]
Distortion = Callable[[Columns, Setup, Rng], Columns]


@dataclass(frozen=True, kw_only=True)
class Effect:
    """One deviation from the ideal."""

    change: Change | None = None  #: Changes the setup, or None.
    distort: Distortion | None = None  #: Distorts the columns, or None.


def _setting(**values: Any) -> Effect:
    """Return an effect that sets fields of the setup, in their order.

    A callable draws its value.
    """

    def change(setup: Setup, rng: Rng) -> Setup:
        drawn = {name: each(rng) if callable(each) else each for name, each in values.items()}
        return replace(setup, **drawn)

    return Effect(change=change)


def _uniform(low: float, high: float) -> Callable[[Rng], float]:
    return lambda rng: rng.uniform(low, high)


def _uniform_either_sign(low: float, high: float) -> Callable[[Rng], float]:
    return lambda rng: rng.uniform(low, high) * _sign(rng)


def _log_uniform(low: float, high: float) -> Callable[[Rng], float]:
    return lambda rng: float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _noise(factor: float) -> Effect:
    return Effect(change=lambda setup, _rng: replace(setup, noise=factor * setup.noise))


def _sign(rng: Rng) -> float:
    return float(rng.choice([-1.0, 1.0]))


# Friction and loads.


def _presliding(setup: Setup, rng: Rng) -> Setup:
    # 2 to 50 µm on a stage of 0.3 m; the same part of the travel on a servo.
    size = float(np.exp(rng.uniform(np.log(2e-6), np.log(50e-6))))
    scale = 1.0 if setup.kind == "linear" else setup.travel / 0.3
    return replace(setup, presliding=size * scale, presliding_damping=rng.uniform(0.1, 0.7))


def _pendulum(setup: Setup, rng: Rng) -> Setup:
    setup = with_speed(setup, 2.0, 8.0, rng)
    angle = rng.uniform(0.0, 2 * np.pi)
    return replace(setup, gravity=rng.uniform(0.1, 1.0), gravity_angle=angle)


def _resonance(setup: Setup, rng: Rng) -> Setup:
    resonance = rng.uniform(20.0, 60.0)
    share = rng.uniform(0.2, 0.5)
    return replace(
        setup,
        load_share=share,
        resonance=resonance,
        resonance_damping=rng.uniform(0.02, 0.08),
        bandwidth=min(setup.bandwidth, resonance * np.sqrt(1 - share) / 4.0),
    )


# Motion.


def _short(duration: float) -> Effect:
    def change(setup: Setup, rng: Rng) -> Setup:
        time = 0.4 * duration if duration < 1.5 else 0.2 * duration
        return replace(
            setup,
            duration=duration,
            move_time=time,
            ramp_time=time * rng.uniform(0.2, 0.3),
            rests=tuple((rng.uniform(0.03, 0.05, size=16) * duration).tolist()),
            speeds=(1.0, rng.uniform(0.4, 0.6)) if duration < 1.5 else (1.0, 1.0, 0.4, 0.4),
        )

    return Effect(change=change)


# The drive and its log.


def _delay(samples: float) -> Effect:
    """Return a delay of the actuation or of the logging, in turn."""

    def change(setup: Setup, _rng: Rng) -> Setup:
        setup = replace(setup, bandwidth=min(setup.bandwidth, 12.0))
        if setup.second_alternative:
            return replace(setup, logging_delay=samples * CYCLE)
        return replace(setup, actuation_delay=samples * CYCLE)

    return Effect(change=change, distort=_with_logging_delay)


def _with_logging_delay(columns: Columns, setup: Setup, _rng: Rng) -> Columns:
    samples = setup.logging_delay / CYCLE
    whole, part = int(samples), samples - int(samples)
    delayed = np.concatenate((np.full(whole + 1, columns.effort[0]), columns.effort))
    n = columns.effort.size
    return replace(columns, effort=(1 - part) * delayed[1 : n + 1] + part * delayed[:n])


def _log_command(columns: Columns, _setup: Setup, _rng: Rng) -> Columns:
    return replace(columns, effort=columns.effort - columns.run.effort + columns.run.command)


def _clipped(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    bound = rng.uniform(0.6, 0.9) * np.max(np.abs(columns.run.effort))
    return replace(columns, effort=np.clip(columns.effort, -bound, bound))


def _clipped_in_noise(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    """Clip the effort, and then add 3 to 100 % of the usual noise."""
    effort = _clipped(replace(columns, effort=columns.run.effort), setup, rng).effort
    noise = 10.0 ** rng.uniform(-1.5, 0.0) * setup.noise * columns.limit
    return replace(columns, effort=effort + noise * rng.standard_normal(effort.size))


def _spikes(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    hit = rng.random(columns.effort.size) < 0.002
    size = rng.uniform(1.0, 5.0, hit.size) * rng.choice([-1.0, 1.0], hit.size) * columns.limit
    return replace(columns, effort=columns.effort + hit * size)


def _quantized(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    step = 2 * columns.limit / 2.0 ** rng.choice([8, 9, 10])
    return replace(columns, effort=step * np.round(columns.effort / step))


def _coarse(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    step = 2.4 * float(np.max(np.abs(columns.effort))) / 2.0 ** rng.choice([3, 4, 5])
    return replace(columns, effort=step * np.round(columns.effort / step))


def _gain_step(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    """Change the gain from the logged effort to the axis at a random instant.

    The factor is 1.06 to 1.25, or its inverse.
    """
    gain = rng.uniform(1.06, 1.25) ** _sign(rng)
    later = columns.time > rng.uniform(0.3, 0.7) * setup.duration
    return replace(columns, effort=np.where(later, columns.effort / gain, columns.effort))


def _gain_loss(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    """Log the current of a motor whose torque constant falls by 5 to 25 % at the largest one."""
    loss, size = rng.uniform(0.05, 0.25), float(np.max(np.abs(columns.effort)))
    largest = size / (1.0 - loss)
    share = np.abs(columns.effort) / largest
    current = (1.0 - np.sqrt(1.0 - 4.0 * loss * share)) / (2.0 * loss)
    return replace(columns, effort=np.sign(columns.effort) * current * largest)


def _decimated(rate: float) -> Effect:
    every = round(1.0 / (rate * CYCLE))
    return Effect(distort=lambda columns, _setup, _rng: columns.rows(slice(None, None, every)))


def _units(columns: Columns, setup: Setup, _rng: Rng) -> Columns:
    factor = 1e3 if setup.kind == "linear" else 180 / np.pi
    return replace(columns, position=factor * columns.position)


def _glitches(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    n = columns.position.size
    where = rng.choice(np.arange(10, n - 10), size=rng.integers(1, 6), replace=False)
    position = columns.position.copy()
    jump = rng.uniform(0.05, 2.0, where.size) * rng.choice([-1.0, 1.0], where.size)
    position[where] += jump * setup.travel
    return replace(columns, position=position)


def _wrapped(columns: Columns, _setup: Setup, _rng: Rng) -> Columns:
    return replace(columns, position=np.mod(columns.position, 2 * np.pi))


# Time stamps.


def _nominal_stamps(columns: Columns, _setup: Setup, _rng: Rng) -> Columns:
    return replace(columns, time=CYCLE * np.arange(columns.time.size))


def _noisy_stamps(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    period = float(np.median(np.diff(columns.time)))
    error = np.clip(0.1 * rng.standard_normal(columns.time.size), -0.4, 0.4)
    return replace(columns, time=columns.time + period * error)


def _grouped_stamps(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    """Stamp groups of records when the last of each has been taken, 50 µs apart."""
    record, size = np.arange(columns.time.size), int(rng.integers(3, 13))
    taken = np.minimum(record // size * size + size - 1, record[-1])
    return replace(columns, time=columns.time[taken] + 5e-5 * (record % size))


def _lost(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    n = columns.time.size
    kept = np.ones(n, dtype=bool)
    for start in np.flatnonzero(rng.random(n) < 0.005):
        kept[start : start + rng.integers(1, 4)] = False
    for start in rng.integers(0, n, size=2):  # two longer gaps
        kept[start : start + rng.integers(20, 80)] = False
    return columns.rows(kept)


def _lost_uncounted(columns: Columns, _setup: Setup, rng: Rng) -> Columns:
    n = columns.time.size
    kept = rng.random(n) >= np.exp(rng.uniform(np.log(1e-3), np.log(0.03)))
    left = columns.rows(kept)
    return replace(left, time=columns.time[: left.time.size])


# Measured velocity.


def _noisy_velocity(columns: Columns, setup: Setup, rng: Rng) -> Float[np.ndarray, " n"]:
    noise = 1e-3 * setup.top_speed * rng.standard_normal(columns.time.size)
    return columns.run.velocity + noise


def _velocity(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    return replace(columns, velocity=_noisy_velocity(columns, setup, rng))


def _delayed_velocity(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    velocity = _noisy_velocity(columns, setup, rng)
    delay = int(rng.integers(2, 11))
    return replace(columns, velocity=np.concatenate((np.zeros(delay), velocity[:-delay])))


def _filtered_velocity(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    velocity = _noisy_velocity(columns, setup, rng)
    pole = np.exp(-2 * np.pi * rng.uniform(15.0, 60.0) * CYCLE)
    return replace(columns, velocity=lfilter([1 - pole], [1, -pole], velocity))


def _differentiated_velocity(columns: Columns, _setup: Setup, _rng: Rng) -> Columns:
    difference = np.diff(columns.position, prepend=columns.position[0])
    return replace(columns, velocity=difference / CYCLE)


def _scaled_velocity(columns: Columns, setup: Setup, rng: Rng) -> Columns:
    return replace(columns, velocity=1.03 * _noisy_velocity(columns, setup, rng))


_JITTER = _setting(jitter=_uniform(0.02, 0.1))

EFFECTS: dict[str, Effect] = {
    "no_noise": _setting(noise=0.0),
    "noise_half": _noise(0.5),
    "noise_double": _noise(2.0),
    "noise_fourfold": _noise(4.0),
    "little_noise": _noise(0.3),
    "stribeck": _setting(static=1.5, stribeck=_log_uniform(0.02, 0.1)),
    "presliding": Effect(change=_presliding),
    "asymmetry": _setting(
        coulomb_skew=_uniform_either_sign(0.02, 0.1), viscous_skew=_uniform_either_sign(0.0, 0.1)
    ),
    "spring": _setting(spring=_uniform(0.1, 1.0)),
    "pendulum": Effect(change=_pendulum),
    "friction_drift": _setting(friction_drift=-0.2 / 0.9),
    "gain_drift": _setting(gain_drift=-0.1 / 0.95),
    "dwell": _setting(
        dwell=_uniform(1.2, 1.6), dwell_time=_uniform(0.05, 0.3), stribeck=_log_uniform(0.01, 0.04)
    ),
    "quadratic": _setting(quadratic=_uniform(0.3, 1.0)),
    "two_thirds": Effect(
        change=lambda setup, _rng: replace(setup, two_thirds=setup.viscous, viscous=0.0)
    ),
    "ripple": _setting(
        ripple=_uniform(0.05, 0.3),
        ripple_waves=_uniform(4.0, 15.0),
        ripple_phase=_uniform(0.0, 2 * np.pi),
    ),
    "constant_load": _setting(offset=_uniform_either_sign(0.5, 2.0)),
    "resonance": Effect(change=_resonance),
    "backlash": _setting(
        load_share=_uniform(0.3, 0.5),
        resonance=_uniform(100.0, 200.0),
        resonance_damping=_uniform(0.1, 0.3),
        backlash=_uniform(2e-4, 2e-3),
        load_friction=_uniform(0.3, 0.6),
    ),
    "correlated_098": _setting(correlation=0.98, correlated_disturbance=_uniform(0.03, 0.1)),
    "correlated_0998": _setting(correlation=0.998, correlated_disturbance=_uniform(0.03, 0.1)),
    "white_force": _setting(white_disturbance=_uniform(0.003, 0.01)),
    "short_1s": _short(1.0),
    "short_2s": _short(2.0),
    "single_speed": _setting(speeds=(1.0,)),
    "sine": _setting(pattern="sine", sine_frequency=_uniform(0.3, 1.0)),
    "steps": _setting(pattern="steps", bandwidth=_uniform(2.0, 3.0)),
    "one_direction": _setting(pattern="one_direction"),
    "delay_0_5": _delay(0.5),
    "delay_1": _delay(1.0),
    "delay_2": _delay(2.0),
    "delay_5": _delay(5.0),
    # A soft loop, so that the command exceeds the limit by some times and not by tens of times.
    "saturated": replace(
        _setting(use=_uniform(1.1, 1.4), bandwidth=_uniform(3.0, 5.0)), distort=_log_command
    ),
    "clipped": Effect(distort=_clipped),
    "clipped_in_noise": Effect(distort=_clipped_in_noise),
    "spikes": Effect(distort=_spikes),
    "quantized": Effect(distort=_quantized),
    "coarse": Effect(distort=_coarse),
    "gain_step": Effect(distort=_gain_step),
    "gain_loss": Effect(distort=_gain_loss),
    "rate_250": _decimated(250.0),
    "rate_100": _decimated(100.0),
    "rate_50": _decimated(50.0),
    "rate_20": _decimated(20.0),
    "units": Effect(distort=_units),
    "glitches": Effect(distort=_glitches),
    "wrapped": Effect(distort=_wrapped),
    "jitter": _JITTER,
    "nominal_stamps": replace(_JITTER, distort=_nominal_stamps),
    "noisy_stamps": Effect(distort=_noisy_stamps),
    "grouped_stamps": Effect(distort=_grouped_stamps),
    "lost_samples": Effect(distort=_lost),
    "lost_uncounted": Effect(distort=_lost_uncounted),
    "velocity": Effect(distort=_velocity),
    "velocity_delayed": Effect(distort=_delayed_velocity),
    "velocity_filtered": Effect(distort=_filtered_velocity),
    "velocity_differentiated": Effect(distort=_differentiated_velocity),
    "velocity_scaled": Effect(distort=_scaled_velocity),
    "mass_known": _setting(known_mass=1.0),
    "mass_wrong": _setting(known_mass=lambda rng: 1.0 + 0.1 * _sign(rng)),
}
"""Every effect by name."""
