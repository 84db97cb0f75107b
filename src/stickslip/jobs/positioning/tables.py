"""Tables of a scenario: the task, the sensors, and what the controller believes."""

import math
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal

from stickslip.records import (
    AxisKind,
    InputError,
    non_negative,
    positive,
    quantity_field,
    unit_of,
)
from stickslip.simulation import Sensors

__all__ = ["DIRECTIONAL", "BodyTable", "GuessTable", "SensorsTable", "TaskTable"]

DIRECTIONAL = ("coulomb_friction", "viscous_friction", "static_friction")
"""What can be given for both directions at once, or for each apart."""

_MOST_SAMPLES = 2_000_000
"""Samples of a scenario over all moves and runs: minutes of computing, a gigabyte of results."""

_LEAST_SAMPLES = 10
"""Samples of a move: fewer have no room for a pulse and the rest after it."""

_STRICT: Any = {"extra": "forbid"}


@dataclass(frozen=True, kw_only=True)
class BodyTable:
    """Masses, spring and friction, all optional; each friction for both directions or for each."""

    mass: float | None = quantity_field("mass", default=None)
    inertia: float | None = quantity_field("inertia", default=None)
    load_mass: float | None = quantity_field("mass", default=None)
    load_inertia: float | None = quantity_field("inertia", default=None)
    stiffness: float | None = quantity_field("stiffness", default=None)
    coulomb_friction: float | None = quantity_field("coulomb_friction", default=None)
    coulomb_friction_positive: float | None = quantity_field("coulomb_friction", default=None)
    coulomb_friction_negative: float | None = quantity_field("coulomb_friction", default=None)
    viscous_friction: float | None = quantity_field("viscous_friction", default=None)
    viscous_friction_positive: float | None = quantity_field("viscous_friction", default=None)
    viscous_friction_negative: float | None = quantity_field("viscous_friction", default=None)
    static_friction: float | None = quantity_field("static_friction", default=None)
    static_friction_positive: float | None = quantity_field("static_friction", default=None)
    static_friction_negative: float | None = quantity_field("static_friction", default=None)
    offset: float | None = quantity_field("offset", default=None)

    __pydantic_config__: ClassVar[Any] = _STRICT

    def __post_init__(self) -> None:
        for name in DIRECTIONAL:
            sides = [getattr(self, f"{name}_{side}") for side in ("positive", "negative")]
            both = getattr(self, name)
            if both is not None and sides != [None, None]:
                raise InputError(
                    f"{name} is given for both directions and for one of them apart",
                    remedy=f"keep {name}, or {name}_positive and {name}_negative",
                )
            if both is None and sides.count(None) == 1:
                given = "positive" if sides[1] is None else "negative"
                missing = "negative" if sides[1] is None else "positive"
                raise InputError(
                    f"{name}_{given} is given without {name}_{missing}",
                    remedy=f"give both, or {name} if it is the same in both directions",
                )

    def sides(self, name: str) -> tuple[float, float] | None:
        """Return what a friction is in the positive and in the negative direction."""
        both = getattr(self, name)
        if both is not None:
            return both, both
        forward = getattr(self, f"{name}_positive")
        return None if forward is None else (forward, getattr(self, f"{name}_negative"))

    def body(self, kind: AxisKind) -> float | None:
        """Return the mass or inertia; refuse the one that such an axis has not.

        Raises
        ------
        InputError
            If a linear axis has an inertia or a rotary one a mass.
        """
        return self._either(kind, "")

    def load(self, kind: AxisKind) -> float | None:
        """Return the mass or inertia of the load of a flexible arm, as `body`.

        Raises
        ------
        InputError
            As `body`.
        """
        return self._either(kind, "load_")

    def _either(self, kind: AxisKind, of: str) -> float | None:
        name, other = ("mass", "inertia") if kind == "linear" else ("inertia", "mass")
        if getattr(self, of + other) is not None:
            raise InputError(
                f"{of}{other} is given for a {kind} axis",
                remedy=f"give its {of}{name} [{unit_of(name, kind)}]",
            )
        return getattr(self, of + name)


@dataclass(frozen=True, kw_only=True)
class TaskTable:
    """``[task]``: where the axis is to go, how exactly, and how often it tries.

    Attributes
    ----------
    start
        Where the axis rests at first [m or rad].
    target, targets
        Where it is to go [m or rad]; several are gone to one after the other.
    tolerance
        Largest error that counts as reached [m or rad].
    duration
        Time for each move [s].
    sampling_time
        Of the controller [s].
    runs
        How often the task is repeated from its start, with what was learnt carried on.

    Raises
    ------
    InputError
        If a value is out of its range, or the target is missing or given twice.
    """

    start: float = quantity_field("position", default=0.0)
    target: float | None = quantity_field("position", default=None)
    targets: tuple[float, ...] | None = quantity_field("position", default=None)
    tolerance: float = quantity_field("position")
    duration: float = quantity_field("time")
    sampling_time: float = quantity_field("sampling_time")
    runs: int = 1

    __pydantic_config__: ClassVar[Any] = _STRICT

    def __post_init__(self) -> None:
        if (self.target is None) == (self.targets is None):
            raise InputError(
                "neither target nor targets is given"
                if self.target is None
                else "target and targets are both given",
                remedy="give target = 0.01, or targets = [0.01, 0.02] for moves one after another",
            )
        if self.targets == ():
            raise InputError("targets is empty", remedy="name one position or more")
        for name, value in (("start", self.start), *(("target", each) for each in self.goals)):
            if not math.isfinite(value):
                raise InputError(
                    f"{name} is {value:g} m or rad, it must be finite", remedy="give a position"
                )
        positive("tolerance", self.tolerance, "m or rad")
        positive("sampling_time", self.sampling_time, "s")
        positive("duration", self.duration, "s")
        # Counted as the run counts them, as 0.7 s is no less than ten samples of 0.07 s
        if self.duration / self.sampling_time < _LEAST_SAMPLES - 0.5:
            raise InputError(
                f"duration is {self.duration:g} s, shorter than {_LEAST_SAMPLES} samples of "
                f"{self.sampling_time:g} s, in which no pulse ends",
                remedy="give each move more time",
            )
        if self.runs < 1:
            raise InputError(f"runs is {self.runs}, it must be at least 1", remedy="run it once")
        every = self.runs * len(self.goals) * (self.duration / self.sampling_time)
        if not every <= _MOST_SAMPLES:
            raise InputError(
                f"the task takes {every:.3g} samples over all moves and runs, it may take "
                f"{_MOST_SAMPLES:g}",
                remedy="shorten the duration, or lengthen the sampling time",
            )

    @property
    def goals(self) -> tuple[float, ...]:
        """The targets in their order [m or rad]."""
        if self.targets is not None:
            return self.targets
        return () if self.target is None else (self.target,)

    @property
    def samples(self) -> int:
        """Samples of each move."""
        return round(self.duration / self.sampling_time)


@dataclass(frozen=True, kw_only=True)
class SensorsTable:
    """``[sensors]``: what the controller gets to see; ideal sensors unless told.

    Attributes
    ----------
    position_noise
        Standard deviation of the noise on each position [m or rad].
    encoder_step
        Of the position encoder [m or rad]; 0 for none.
    velocity
        ``"measured"`` or ``"none"``.
    velocity_noise
        Standard deviation of the noise on each velocity [m/s or rad/s].
    seed
        Of the noise.

    Raises
    ------
    InputError
        If a value is out of its range, or the noise is that of a sensor that is not there.
    """

    position_noise: float = quantity_field("position", default=0.0)
    encoder_step: float = quantity_field("position", default=0.0)
    velocity: Literal["measured", "none"] = "measured"
    velocity_noise: float = quantity_field("velocity", default=0.0)
    seed: int = 1

    __pydantic_config__: ClassVar[Any] = _STRICT

    def __post_init__(self) -> None:
        if self.seed < 0:
            raise InputError(
                f"seed is {self.seed}, it must not be negative", remedy="give 0 or more"
            )
        self.sensors()

    def sensors(self) -> Sensors:
        """Return the sensors as they are simulated."""
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


@dataclass(frozen=True, kw_only=True)
class GuessTable(BodyTable):
    """``[guess]``: what the controller believes at first.

    Attributes
    ----------
    mass_uncertainty, friction_uncertainty, asymmetry
        How sure it is: standard deviations of mass, of friction, and of what sets the directions
        apart, over the value given [-].
    arm_uncertainty
        How sure it is of masses and spring of a flexible arm: their standard deviation, over the
        values given [-]; above 0 they are learned.
    estimate
        File written by ``stickslip identify --json``; what stands beside it comes before it.
    learnt
        File written by an earlier ``stickslip position --learnt``.

    Raises
    ------
    InputError
        If a quantity is given twice or negative.
    """

    mass_uncertainty: float | None = None
    friction_uncertainty: float | None = None
    asymmetry: float | None = None
    arm_uncertainty: float | None = None
    estimate: str | None = None
    learnt: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("estimate", "learnt"):
            if getattr(self, name) == "":
                raise InputError(
                    f"{name} is empty, it must name a file", remedy="name the file, or leave it out"
                )
        for each in fields(self):
            value = getattr(self, each.name)
            if isinstance(value, float) and each.name != "offset":
                quantity = each.metadata.get("quantity")
                units = (
                    "(no unit)" if quantity is None else f"{quantity.linear} or {quantity.rotary}"
                )
                non_negative(each.name, value, units)
