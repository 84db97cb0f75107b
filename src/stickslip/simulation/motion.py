"""The truth of a simulated run. No estimator or controller can reach it."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int8

from stickslip.records import AxisKind, quantity_field

__all__ = ["SimulatedMotion", "make_arrays_read_only"]


def make_arrays_read_only(record: Any) -> None:
    """Replace the arrays of a new frozen dataclass by read-only views of them.

    The one who made an array can still write it; the record cannot.
    """
    for name in record.__dataclass_fields__:
        value = getattr(record, name)
        if isinstance(value, np.ndarray):
            view = value.view()
            view.flags.writeable = False
            object.__setattr__(record, name, view)


@dataclass(frozen=True, kw_only=True)
class SimulatedMotion:
    """What a simulated plant really did, at every sample and at every event between them.

    ``commanded_effort[k]`` is held from ``time[k]`` to ``time[k+1]``.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``; decides the units.
    sampling_time
        [s].
    commanded_effort
        Shape (n,).
    position, velocity
        Of the (first) mass, shape (n+1,).
    load_position, load_velocity
        Of the second mass of a flexible arm, shape (n+1,), or None.
    event_time
        When the (first) mass came to rest, broke away or reversed [s], shape (e,).
    event_mode
        What it did from then on: -1 and +1 slip in that direction, 0 rest; shape (e,).
    grazing
        Samples, shape (n,), in which the outcome of an event was too close to call: the velocity
        or the force touched its limit to 1e-10 of its scale, with static friction above Coulomb
        friction, where the motion depends on it discontinuously.
    bristle_deflection
        Of a friction law with bristles, shape (n+1,), or None.
    """

    kind: AxisKind
    sampling_time: float = quantity_field("sampling_time")
    commanded_effort: Float[np.ndarray, " n"] = quantity_field("effort")
    position: Float[np.ndarray, " n+1"] = quantity_field("position")
    velocity: Float[np.ndarray, " n+1"] = quantity_field("velocity")
    load_position: Float[np.ndarray, " n+1"] | None = quantity_field("position", default=None)
    load_velocity: Float[np.ndarray, " n+1"] | None = quantity_field("velocity", default=None)
    event_time: Float[np.ndarray, " e"] = quantity_field("time")
    event_mode: Int8[np.ndarray, " e"]
    grazing: Bool[np.ndarray, " n"]
    bristle_deflection: Float[np.ndarray, " n+1"] | None = quantity_field("position", default=None)

    def __post_init__(self) -> None:
        make_arrays_read_only(self)

    @cached_property
    def time(self) -> Float[np.ndarray, " samples"]:
        """Sample instants [s], shape (n+1,)."""
        time = np.arange(self.position.size) * self.sampling_time
        time.flags.writeable = False
        return time

    @cached_property
    def stuck(self) -> Bool[np.ndarray, " samples"]:
        """Whether the (first) mass rests at each sample instant, shape (n+1,).

        What the effort of the sample that begins there will do to it is not considered. On
        bristles nothing rests quite.
        """
        stuck = self.velocity == 0.0
        stuck.flags.writeable = False
        return stuck

    @property
    def event_count(self) -> int:
        """How often the (first) mass came to rest, broke away or reversed."""
        return self.event_time.size

    @property
    def any_grazing(self) -> bool:
        """Whether the outcome of any event was too close to call."""
        return bool(self.grazing.any())
