"""How a controller lands flexible arms: what a table of a comparison holds."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stickslip.records.record import Record


@dataclass(frozen=True, kw_only=True)
class Spread(Record):
    """How something is spread over many cases."""

    #: The median, what 95 % do not exceed, and the largest [as of what is spread].
    median: float
    upper_95: float
    worst: float

    @classmethod
    def of(cls, values: Sequence[float]) -> "Spread":
        """Return the spread of at least one value."""
        median, upper = np.quantile(values, (0.5, 0.95))
        return cls(median=float(median), upper_95=float(upper), worst=float(max(values)))


@dataclass(frozen=True, kw_only=True)
class LandingScore(Record):
    """How one controller lands many random arms, from rest to rest and target to target."""

    controller: str  #: Which one.
    case: str  #: The conditions: sensors, and how well masses and spring are known.
    #: How many arms it was tried on, and how many moves these made in all.
    arms: int
    moves: int
    #: Share of the arms on which, after every move, both masses stayed within the bound of the
    #: target as long as they were watched [1].
    landed: float
    #: Share of the arms on which they did so after at most four series a move [1]; None for a
    #: controller without series.
    landed_in_four: float | None
    #: The farthest that mass 1 and mass 2 were from the target while watched, over the move [1].
    error_1: Spread
    error_2: Spread
    swing: Spread  #: Amplitude of mass 2 about mass 1 that was left, over the move [1].
    #: Time to land over the shortest in which the arm can, if everything about it is known [1], of
    #: the moves that landed; None if none did.
    time_ratio: Spread | None
    series: Spread | None  #: Fired in a move [1]; None for a controller without series.
    #: Share of the moves that ended outside the bound though the controller took them for landed
    #: [1]; None if it reports nothing.
    misjudged: float | None
    #: The farthest that either mass ever was beside the way between start and target, over the move
    #: [1].
    farthest: float
    peak_effort: float  #: Largest effort over the limit [1].
