"""Stretches of a log that are simulated each from its own first state, and their errors.

The errors of a channel are Gaussian with an unknown variance, white or a first-order
autoregression. For given errors the likeliest variance and coefficient are known in closed form or
almost, so that the likelihood is one of the motion alone (concentrated).

A run of equal readings is one reading: an axis that rests on one count of its encoder, or creeps
over it, shows the same rounding error again and again. Errors are therefore averaged over each run,
and the run counts once.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from jaxtyping import Float, Int

from stickslip.estimation.likelihood.axis_parameters import AxisParameters
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.estimation.signals.observation import motion_noise, observe
from stickslip.records import AxisLog
from stickslip.simulation import SimulatedMotion, simulate, simulate_sensitivity

CHANNELS = ("position", "velocity", "load_position", "load_velocity")

_LARGEST_CORRELATION = 0.9999  # at which a search of the coefficient ends [-]
_GOLDEN_STEPS = 40  # of the search of the coefficient: (0.618)^40 = 4e-9
_GOLDEN = 0.6180339887498949  # (sqrt(5) - 1)/2
_FIRST_GRID = 33  # coefficients


@dataclass(frozen=True, kw_only=True)
class ChannelNoise:
    """Noise of one channel."""

    std: float  # standard deviation of what is new in each error [unit of the channel]
    correlation: float  # from one error to the next; 0 for white noise
    rows: int  # readings that count
    cost: float  # negative logarithm of the likelihood, up to a constant


def run_starts(readings: Float[np.ndarray, " n"]) -> Int[np.ndarray, " runs"]:
    """Return where each run of equal readings begins."""
    return np.concatenate(([0], np.flatnonzero(np.diff(readings)) + 1))


def run_means(
    rows: Float[np.ndarray, "n ..."], starts: Int[np.ndarray, " runs"]
) -> Float[np.ndarray, "runs ..."]:
    """Return the mean of the rows of each run."""
    n = rows.shape[0]
    if starts.size == n:
        return rows
    lengths = np.diff(starts, append=n)
    sums = np.add.reduceat(rows, starts, axis=0)
    return sums / lengths.reshape(-1, *(1,) * (rows.ndim - 1))


def whitened(rows: Float[np.ndarray, "n ..."], correlation: float) -> Float[np.ndarray, "n ..."]:
    """Return rows less what those before predict: e_k - rho e_(k-1), and sqrt(1 - rho^2) e_0."""
    if correlation == 0.0:
        return rows
    white = rows.copy()
    white[1:] -= correlation * rows[:-1]
    white[0] *= np.sqrt(1.0 - correlation**2)
    return white


def likeliest_noise(
    errors: Sequence[Float[np.ndarray, " _"]], *, coloured: bool, least: float
) -> ChannelNoise:
    """Return the noise that makes the errors of a channel likeliest, one array a stretch.

    With e white, -log p = N/2 log(SSE/N); of an autoregression in W stretches,
    SSE = sum (1 - rho^2) e_0^2 + sum (e_k - rho e_(k-1))^2 and -W/2 log(1 - rho^2) is added
    (Box and Jenkins, Time Series Analysis, A7.4). Below the ``least`` standard deviation an error
    is rounding.
    """
    rows = sum(e.size for e in errors)
    total = sum(float(e @ e) for e in errors)
    across = sum(float(e[1:] @ e[:-1]) for e in errors)
    inner = sum(float(e[1:-1] @ e[1:-1]) for e in errors)

    def squares(rho: float) -> float:
        # sum over a stretch of (1 - rho^2) e_0^2 + (e_k - rho e_(k-1))^2
        return max(total - 2.0 * rho * across + rho**2 * inner, 0.0) + rows * least**2

    def cost(rho: float) -> float:
        edge = 0.5 * len(errors) * float(np.log1p(-(rho**2)))
        return 0.5 * rows * float(np.log(squares(rho) / rows)) - edge

    rho = 0.0
    if coloured and total > 0.0:
        grid = np.tanh(np.linspace(-4.0, 4.0, _FIRST_GRID)) / np.tanh(4.0) * _LARGEST_CORRELATION
        best = int(np.argmin([cost(float(value)) for value in grid]))
        low, high = float(grid[max(best - 1, 0)]), float(grid[min(best + 1, grid.size - 1)])
        for _ in range(_GOLDEN_STEPS):
            left, right = high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)
            if cost(left) < cost(right):
                high = right
            else:
                low = left
        rho = 0.5 * (low + high)
    std = float(np.sqrt(squares(rho) / rows))
    return ChannelNoise(std=std, correlation=rho, rows=rows, cost=cost(rho))


@dataclass(frozen=True, kw_only=True)
class Channel:
    """Readings of one sensor in a window."""

    name: str  # one of CHANNELS
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
    """One stretch of a log and where its motion begins."""

    sampling_time: float  # [s]
    time: Float[np.ndarray, " n"]  # [s]
    effort: Float[np.ndarray, " n-1"]  # held over each sample but the last [N or N m]
    channels: tuple[Channel, ...]
    state: tuple[float, ...]  # first guess of position and velocity of each mass at first [SI]

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

    def errors(self, motion: SimulatedMotion) -> list[Float[np.ndarray, " _"]]:
        """Return the errors of each channel."""
        return [channel.errors(getattr(motion, channel.name)) for channel in self.channels]

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
        own, states = len(found.names) - len(self.state), len(self.state)
        chain = parameters.chain(found.names[:own])
        to_sought = np.zeros((own + states, chain.shape[1] + states))
        to_sought[:own, : chain.shape[1]] = chain
        to_sought[own:, chain.shape[1] :] = np.eye(states)
        changes = [
            run_means(getattr(found, channel.name) @ to_sought, channel.starts)
            for channel in self.channels
        ]
        return self.errors(found.motion), changes

    def row_times(self) -> list[Float[np.ndarray, " _"]]:
        """Return the time [s] in the middle of what each row of each channel stands for."""
        return [run_means(self.time, channel.starts) for channel in self.channels]


def windows_of(
    log: AxisLog, low_pass: LowPass, pieces: int, *, delay: int, skipped: int, flexible: bool
) -> list[Window]:
    """Return the stretches of a log without gaps, each cut into pieces of equal length.

    The effort acts later by the delay [samples]; at least as many samples are skipped at the
    beginning of each stretch. The low-pass smooths for the first guesses of the states.
    """
    windows: list[Window] = []
    for part in log.segments():
        if len(part) < skipped + 2:
            continue
        states = _states(part, low_pass, log.sampling_time, flexible=flexible)
        measured = {name: getattr(part, f"measured_{name}") for name in CHANNELS}
        present = [name for name in CHANNELS[: 4 if flexible else 2] if measured[name] is not None]
        bounds = np.linspace(skipped, len(part) - 1, pieces + 1).astype(int).tolist()
        for start, stop in pairwise(bounds):
            if stop - start < 2:
                continue
            channels = (Channel(name=n, readings=measured[n][start : stop + 1]) for n in present)
            windows.append(
                Window(
                    sampling_time=log.sampling_time,
                    time=part.time[start : stop + 1],
                    effort=part.effort[start - delay : stop - delay],
                    channels=tuple(channels),
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
