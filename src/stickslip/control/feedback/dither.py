"""Dither: a fast oscillation of the effort that shakes a sticking mass."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from stickslip.compiled import compiled
from stickslip.records import InputError, positive, quantity_field

__all__ = ["Dither", "dither_effort"]


@compiled(inline=True)
def dither_effort(A: float, cycles: float, square: bool) -> float:
    """Return the effort of a dither after so many cycles: A sign(sin) or A sin of 2 pi cycles."""
    phase = cycles - np.floor(cycles)
    if square:
        return A if phase < 0.5 else -A
    return A * np.sin(2.0 * np.pi * phase)


@dataclass(frozen=True, kw_only=True)
class Dither:
    """An oscillation added to the effort, whatever the error.

    Its value at sample k is that of the wave in the middle of the sample, ``(k + 1/2) T``: the
    fastest one possible, half the sampling rate, then alternates between ``+-amplitude``.

    Attributes
    ----------
    amplitude
        Peak of the oscillation [N or N m].
    frequency
        [Hz]; at most half the sampling rate of the controller it is used in.
    shape
        ``"square"`` or ``"sine"``.

    Raises
    ------
    InputError
        If a value is out of its range.

    Examples
    --------
    >>> Dither(amplitude=50.0, frequency=25.0, shape="square").frequency
    25.0
    """

    amplitude: float = quantity_field("effort")
    frequency: float
    shape: Literal["square", "sine"]

    def __post_init__(self) -> None:
        object.__setattr__(self, "amplitude", positive("amplitude", self.amplitude, "N or N m"))
        object.__setattr__(self, "frequency", positive("frequency", self.frequency, "Hz"))
        if self.shape not in ("square", "sine"):
            raise InputError(f"shape is {self.shape!r}", remedy="give 'square' or 'sine'")
