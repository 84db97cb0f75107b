"""One controller on random axes: where they end, how soon, and whether they hunt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.control import PulseController
from stickslip.simulation import Controller, Sensors, SimulatedMotion, simulate_closed_loop
from stickslip.tasks.positioning.judging import hunts
from studies.van_de_wijdeven.part_b.random_axes import ENCODER_STEP, POSITION_NOISE, RandomAxis
from studies.van_de_wijdeven.part_b.setting import SAMPLING_TIME, TOLERANCE
from studies.van_de_wijdeven.records import ControllerScore

ARRIVAL = 40.0
"""Time to arrive [s]: ten times what most controllers need."""
WATCH = 20.0
"""Time thereafter in which the axis is watched [s]."""

Make = Callable[[RandomAxis], Controller[Float[np.ndarray, " s"]]]
"""From what is guessed of an axis (not from its truth) to a controller for it."""


@dataclass(frozen=True, kw_only=True)
class AxisOutcome:
    """How one controller did on one axis."""

    final_error: float  #: Of the true position at the end, absolute [m].
    #: Whether the error was within the tolerance all the time while watched.
    within_tolerance: bool
    #: Whether, while watched, the axis turned round twice, moving by more than the tolerance.
    hunting: bool
    #: From which on the error stayed within the tolerance [s]; None if at the end it was not.
    time: float | None
    #: Begun until then; None for a controller without pulses, or if the time is None.
    pulses: int | None
    peak_effort: float  #: Over the limit [1].


def outcome_on(axis: RandomAxis, make: Make, *, watch: float = WATCH) -> AxisOutcome:
    """Run the controller that is made for an axis on it, and judge the true motion.

    The axis is watched for a while after the time to arrive [s].
    """
    controller = make(axis)
    run = simulate_closed_loop(
        axis.plant,
        controller,
        sampling_time=SAMPLING_TIME,
        samples=round((ARRIVAL + watch) / SAMPLING_TIME),
        sensors=Sensors(position_noise=POSITION_NOISE, encoder_step=ENCODER_STEP, velocity="none"),
        generator=np.random.default_rng(axis.seed),
    )
    return _judged(axis, run.motion, gives_pulses=isinstance(controller, PulseController))


def _judged(axis: RandomAxis, motion: SimulatedMotion, *, gives_pulses: bool) -> AxisOutcome:
    error = np.abs(axis.start_error - motion.position)
    effort = motion.commanded_effort
    outside = np.flatnonzero(error > TOLERANCE)
    arrived = int(outside[-1]) + 1 if outside.size else 0  # sample
    reached = arrived < error.size
    watched = round(ARRIVAL / SAMPLING_TIME)
    begins = (effort[1:] != 0.0) & (effort[:-1] == 0.0)  # rest is waited for before each pulse
    return AxisOutcome(
        final_error=float(error[-1]),
        within_tolerance=arrived <= watched,
        hunting=hunts(motion.position[watched:], TOLERANCE),
        time=arrived * SAMPLING_TIME if reached else None,
        pulses=int(begins[:arrived].sum()) if gives_pulses and reached else None,
        peak_effort=float(np.abs(effort).max() / axis.effort_limit),
    )


def score(name: str, outcomes: Sequence[AxisOutcome]) -> ControllerScore:
    """Return what one controller's outcomes on all axes come to."""
    errors = np.array([each.final_error for each in outcomes])
    settled = [each for each in outcomes if each.within_tolerance]
    times = [each.time for each in settled if each.time is not None]
    pulses = [each.pulses for each in settled if each.pulses is not None]
    return ControllerScore(
        controller=name,
        axes=len(outcomes),
        within_tolerance=len(settled) / len(outcomes),
        hunting=sum(each.hunting for each in outcomes) / len(outcomes),
        median_error=float(np.median(errors)),
        error_95=float(np.quantile(errors, 0.95)),
        worst_error=float(errors.max()),
        median_time=float(np.median(times)) if times else None,
        median_pulses=float(np.median(pulses)) if pulses else None,
        peak_effort=max(each.peak_effort for each in outcomes),
    )
