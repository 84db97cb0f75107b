"""Stretches of a log that are simulated each from a first state of its own."""

from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from stickslip.estimation.likelihood.axis_parameters import AxisParameters
from stickslip.estimation.likelihood.noise_model import run_means, run_starts
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.observation import motion_noise, observe
from stickslip.records import AxisLog
from stickslip.simulation import SimulatedMotion, simulate, simulate_sensitivity

__all__ = ["CHANNELS", "Channel", "Window", "windows_of"]

CHANNELS = ("position", "velocity", "load_position", "load_velocity")


@dataclass(frozen=True, kw_only=True)
class Channel:
    """What one sensor shows of a window.

    Attributes
    ----------
    name
        One of `CHANNELS`.
    readings
        [unit of the channel], shape (n,).
    """

    name: str
    readings: Float[np.ndarray, " n"]

    @cached_property
    def starts(self) -> Int[np.ndarray, " runs"]:
        """Where each run of equal readings begins."""
        return run_starts(self.readings)

    def errors(self, simulated: Float[np.ndarray, " n"]) -> Float[np.ndarray, " runs"]:
        """Return reading less simulated value, the mean of each run of equal readings."""
        return run_means(self.readings - simulated, self.starts)


@dataclass(frozen=True, kw_only=True)
class Window:
    """One stretch of a log and where its motion begins.

    Attributes
    ----------
    sampling_time
        [s].
    time
        Of the samples [s], shape (n,).
    effort
        Held over each sample but the last [N or N m], shape (n-1,).
    channels
        What the sensors show.
    state
        First guess of the first state: position and velocity of each mass [SI].
    """

    sampling_time: float
    time: Float[np.ndarray, " n"]
    effort: Float[np.ndarray, " n-1"]
    channels: tuple[Channel, ...]
    state: tuple[float, ...]

    def errors(
        self,
        parameters: AxisParameters,
        values: Float[np.ndarray, " p"],
        state: Float[np.ndarray, " s"],
    ) -> list[Float[np.ndarray, " _"]]:
        """Return the errors of each channel for values of the parameters and a first state [SI]."""
        motion = self.simulated(parameters, values, state)
        return [channel.errors(getattr(motion, channel.name)) for channel in self.channels]

    def simulated(
        self,
        parameters: AxisParameters,
        values: Float[np.ndarray, " p"],
        state: Float[np.ndarray, " s"],
    ) -> SimulatedMotion:
        """Return the motion for values of the parameters and a first state [SI]."""
        return simulate(
            parameters.plant(values),
            self.effort,
            sampling_time=self.sampling_time,
            initial_state=tuple(state.tolist()),
        )

    def linearised(
        self,
        parameters: AxisParameters,
        values: Float[np.ndarray, " p"],
        state: Float[np.ndarray, " s"],
    ) -> tuple[list[Float[np.ndarray, " _"]], list[Float[np.ndarray, "_ _"]]]:
        """Return the errors of each channel, and how its simulated values change.

        The columns are the parameters sought, then the first state. That of the velocity of a mass
        that rests at first is zero.
        """
        found = simulate_sensitivity(
            parameters.plant(values),
            self.effort,
            sampling_time=self.sampling_time,
            initial_state=tuple(state.tolist()),
        )
        own = len(found.names) - len(self.state)
        chain = parameters.chain(found.names[:own])
        to_sought = np.zeros((len(found.names), chain.shape[1] + len(self.state)))
        to_sought[:own, : chain.shape[1]] = chain
        to_sought[own:, chain.shape[1] :] = np.eye(len(self.state))
        errors, changes = [], []
        for channel in self.channels:
            errors.append(channel.errors(getattr(found.motion, channel.name)))
            change = getattr(found, channel.name) @ to_sought
            changes.append(run_means(change, channel.starts))
        return errors, changes

    def row_times(self) -> list[Float[np.ndarray, " _"]]:
        """Return the time [s] in the middle of what each row of each channel stands for."""
        return [run_means(self.time, channel.starts) for channel in self.channels]


def windows_of(
    log: AxisLog, low_pass: LowPass, *, delay: int, skipped: int, pieces: int, flexible: bool
) -> list[Window]:
    """Return the stretches of a log without gaps, each cut into pieces of equal length.

    Parameters
    ----------
    log
        Uniformly sampled but for gaps.
    low_pass
        What smooths for the first guesses of the states.
    delay
        Samples that the effort comes late.
    skipped
        Samples left out at the beginning of each stretch, at least as many.
    pieces
        In each stretch.
    flexible
        Whether the plant has a second mass.
    """
    windows: list[Window] = []
    for part in log.segments():
        if len(part) < skipped + 2:
            continue
        states = _states(part, low_pass, log.sampling_time, flexible=flexible)
        measured = {name: getattr(part, "measured_" + name) for name in CHANNELS}
        seen = [name for name in CHANNELS[: 4 if flexible else 2] if measured[name] is not None]
        bounds = np.linspace(skipped, len(part) - 1, pieces + 1).astype(int).tolist()
        for start, stop in pairwise(bounds):
            if stop - start < 2:
                continue
            windows.append(
                Window(
                    sampling_time=log.sampling_time,
                    time=part.time[start : stop + 1],
                    effort=part.effort[start - delay : stop - delay],
                    channels=tuple(
                        Channel(name=name, readings=measured[name][start : stop + 1])
                        for name in seen
                    ),
                    state=tuple(states[start].tolist()),
                )
            )
    return windows


def _states(
    part: AxisLog, low_pass: LowPass, sampling_time: float, *, flexible: bool
) -> Float[np.ndarray, "n s"]:
    """Return smoothed positions and velocities at every sample."""
    columns = list(_smoothed(part, low_pass, sampling_time))
    if flexible and part.measured_load_position is None:
        columns *= 2
    elif flexible:
        load = replace(
            part,
            measured_position=part.measured_load_position,
            measured_velocity=part.measured_load_velocity,
        )
        columns += _smoothed(load, low_pass, sampling_time)
    return np.column_stack(columns)


def _smoothed(
    part: AxisLog, low_pass: LowPass, sampling_time: float
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, " n"]]:
    """Return position and velocity without most of their noise; the velocity is 0 at rest."""
    noise = motion_noise(part.measured_position, part.measured_velocity, low_pass, sampling_time)
    motion = observe(part, low_pass, noise, sampling_time)
    return motion.position, np.where(motion.resting, 0.0, motion.smooth_velocity)
