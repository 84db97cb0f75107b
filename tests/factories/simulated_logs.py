"""Logs of simulated axes, their samples, and forces that are not logged."""

from dataclasses import replace

import numpy as np
import scipy.signal
from jaxtyping import Float

from stickslip.plants import Plant
from stickslip.records import AxisLog
from stickslip.simulation import Sensors, SimulatedMotion, simulate

Sample = tuple[float, float, float, float, float]


def measured(motion: SimulatedMotion, sensors: Sensors, seed: int = 0) -> AxisLog:
    return sensors.measure(motion, np.random.default_rng(seed))


def disturbed(
    plant: Plant,
    effort: Float[np.ndarray, " n"],
    force: Float[np.ndarray, " n"],
    sensors: Sensors,
    generator: np.random.Generator,
    *,
    sampling_time: float,
    state: tuple[float, ...] | None = None,
) -> AxisLog:
    """Return the log of an axis under an effort and a force that is not logged."""
    motion = simulate(plant, effort + force, sampling_time=sampling_time, initial_state=state)
    return replace(sensors.measure(motion, generator), effort=np.append(effort, effort[-1]))


def autoregression(
    generator: np.random.Generator, samples: int, correlation: float
) -> Float[np.ndarray, " samples"]:
    """Return a first-order autoregression that begins at zero, of unit variance later on."""
    white = generator.normal(size=samples) * np.sqrt(1.0 - correlation**2)
    return scipy.signal.lfilter([1.0], [1.0, -correlation], white)


def table_of(log: AxisLog) -> Float[np.ndarray, "n 5"]:
    """Return effort, position, velocity, load position and load velocity, 0 if not measured."""
    columns = (
        log.effort,
        log.measured_position,
        log.measured_velocity,
        log.measured_load_position,
        log.measured_load_velocity,
    )
    return np.column_stack([np.zeros(len(log)) if each is None else each for each in columns])


def samples_of(log: AxisLog) -> list[Sample]:
    """Return the rows of `table_of` as the online estimators take them."""
    return [(u, x, v, x2, v2) for u, x, v, x2, v2 in table_of(log).tolist()]


def logged_early(log: AxisLog, delay: float) -> AxisLog:
    """Return a log whose effort acts by a delay [samples] later than it is logged."""
    k = np.arange(len(log))
    return replace(log, effort=np.interp(k + delay, k, log.effort))
