"""``[task]`` and ``[sensors]``: the targets of the axis, and the measurements of the controller."""

import math
from itertools import pairwise
from typing import Any, Literal

from pydantic import model_validator

from stickslip.records import InputError, finite, non_negative, positive, unit_of, whole
from stickslip.scenario.table import Table, key, kind_in, required
from stickslip.simulation import Sensors

_MOST_SAMPLES = 2_000_000
"""Samples of a scenario over all moves and runs: minutes of computing, a gigabyte of results."""

_LEAST_SAMPLES = 10  # samples of a move: fewer have no room for a pulse and the rest after it


class TaskTable(Table):
    """Targets, tolerance, and number of runs."""

    start: float = key("where the axis rests at first", "position", default=0.0)
    target: float | None = key("where it is to go", "position", says="or `targets`")
    targets: tuple[float, ...] | None = key("several targets, one after the other", "position")
    tolerance: float = required("largest error that counts as reached", "position", positive)
    duration: float = required("time for each move", "time", positive)
    sampling_time: float = required(
        "of the controller; pulses last whole samples", "sampling_time", positive
    )
    runs: int = key(
        "repetitions of the task from its start, each with what was learned before", default=1
    )

    @model_validator(mode="after")
    def _check_task(self, info: Any) -> "TaskTable":
        if (self.target is None) == (self.targets is None):
            raise InputError("no_target" if self.target is None else "two_targets")
        if self.targets == ():
            raise InputError("targets_empty")
        unit = unit_of("position", kind_in(info))
        finite("start", self.start, unit)
        for each in self.all_targets:
            finite("target", each, unit)
        # Counted as the run counts them, as 0.7 s is no less than ten samples of 0.07 s
        if self.duration / self.sampling_time < _LEAST_SAMPLES - 0.5:
            raise InputError(
                "duration_too_short",
                name="duration",
                value=self.duration,
                least=_LEAST_SAMPLES,
                sampling_time=self.sampling_time,
            )
        whole("runs", self.runs, least=1)
        every = self.runs * len(self.all_targets) * (self.duration / self.sampling_time)
        if not every <= _MOST_SAMPLES:
            raise InputError("task_too_long", samples=every, most=_MOST_SAMPLES)
        return self

    @property
    def all_targets(self) -> tuple[float, ...]:
        """The targets in their order [m or rad]."""
        if self.targets is not None:
            return self.targets
        return () if self.target is None else (self.target,)

    @property
    def places(self) -> tuple[float, ...]:
        """The start, then the targets [m or rad]."""
        return (self.start, *self.all_targets)

    @property
    def longest_move(self) -> float:
        """Length of the longest move [m or rad]."""
        return max(abs(end - start) for start, end in pairwise(self.places))

    @property
    def samples(self) -> int:
        """Samples of each move."""
        return round(self.duration / self.sampling_time)


class SensorsTable(Table):
    """Sensors, ideal by default."""

    position_noise: float = key(
        "standard deviation of a position, before it is rounded",
        "position",
        non_negative,
        default=0.0,
    )
    encoder_step: float = key(
        "step of the position encoder; 0 for none", "position", non_negative, default=0.0
    )
    velocity: Literal["measured", "none"] = key(
        "whether the velocity is measured", default="measured"
    )
    velocity_noise: float = key(
        "standard deviation of a velocity", "velocity", non_negative, default=0.0
    )
    seed: int = key("of all that is random", default=1)

    @model_validator(mode="after")
    def _check_sensors(self) -> "SensorsTable":
        whole("seed", self.seed)
        self.build()
        return self

    def build(self) -> Sensors:
        """Return the simulated sensors."""
        return Sensors(
            position_noise=self.position_noise,
            encoder_step=self.encoder_step,
            velocity=self.velocity,
            velocity_noise=self.velocity_noise,
        )

    @property
    def noisy(self) -> bool:
        """Whether anything is random."""
        return self.position_noise > 0 or self.velocity_noise > 0

    @property
    def position_deviation(self) -> float:
        """Standard deviation of a sampled position, its rounding included [m or rad]."""
        return math.sqrt(self.position_noise**2 + self.encoder_step**2 / 12.0)
