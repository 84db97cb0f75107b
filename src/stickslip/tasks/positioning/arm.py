"""What a run on a flexible arm has beyond that of a rigid axis: both masses, and the series."""

from math import sqrt
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import LandingState
from stickslip.records import ArmRun, ArmSeries
from stickslip.scenario import Scenario
from stickslip.simulation import ClosedLoopRun

__all__ = ["arm_of", "swings"]


def arm_of(run: ClosedLoopRun[Any], goals: Float[np.ndarray, " n"], scenario: Scenario) -> ArmRun:
    """Return both masses and the series of a run."""
    motion = run.motion
    return ArmRun(
        target=goals,
        position=motion.position,
        load_position=_load(motion.load_position),
        measured_position=run.log.measured_position,
        measured_load_position=_load(run.log.measured_load_position),
        resting=motion.stuck,
        series=_series(run, scenario),
    )


def swings(run: ClosedLoopRun[Any], scenario: Scenario) -> Float[np.ndarray, " n"]:
    """Return the amplitude of mass 2 from each sample on if mass 1 rested there [m or rad]."""
    motion, axis = run.motion, scenario.axis
    frequency = sqrt((axis.stiffness or 0.0) / (axis.load or 1.0))
    apart = _load(motion.load_position) - motion.position
    return np.hypot(apart, (_load(motion.load_velocity) - motion.velocity) / frequency)


def _load(values: Float[np.ndarray, " n"] | None) -> Float[np.ndarray, " n"]:
    """Return a channel of the second mass, which every arm of a scenario has."""
    return np.empty(0) if values is None else values


def _series(run: ClosedLoopRun[Any], scenario: Scenario) -> tuple[ArmSeries, ...]:
    """Return the series of a run, with where they truly left the arm."""
    swing, state = swings(run, scenario), run.controller_state
    flights = state.flights if isinstance(state, LandingState) else ()
    T, motion = scenario.task.sampling_time, run.motion
    last = motion.time.size - 1
    series: list[ArmSeries] = []
    for k, flight in enumerate(flights):
        start = round(flight.start / T)
        # The rest after it lasts until the next series or the next move begins
        move = start // scenario.task.samples + 1
        until = min(move * scenario.task.samples, last)
        if k + 1 < len(flights):
            until = min(until, round(flights[k + 1].start / T))
        rests = until >= start + flight.planned.effort.size and bool(motion.stuck[until])
        series.append(
            ArmSeries(
                move=move,
                start_time=flight.start,
                sampling_time=T,
                pulses=flight.planned.amplitudes.size,
                target=flight.planned.target,
                coulomb_friction=flight.coulomb_friction,
                viscous_friction=flight.viscous_friction,
                effort=flight.planned.effort,
                position=flight.planned.position,
                load_position=flight.planned.load_position,
                start_swing=float(swing[start]),
                final_position=float(motion.position[until]) if rests else None,
                final_swing=float(swing[until]) if rests else None,
            )
        )
    return tuple(series)
