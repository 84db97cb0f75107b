"""Point-to-point moves as the reference of a loop."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.compiled import compiled
from stickslip.control.checks import check_fields
from stickslip.records import InputError, finite, non_negative, positive, quantity_field

COLUMNS = 4  # of a move in the table: when it begins, how long it takes, from where, how far


@compiled(inline=True)
def reference_at(
    s: Float[np.ndarray, " s"], first: int, moves: int, t: float
) -> tuple[float, float, float]:
    """Return position, velocity and acceleration at time t of minimum-jerk moves.

    With q = (t - t0) / D held to 0 ... 1, of a move of length d that takes D from t0 on:
    r = r0 + d (10 q^3 - 15 q^4 + 6 q^5), the quintic that is at rest with no acceleration at both
    ends. The moves lie in ``s`` from ``first`` on, `COLUMNS` values each.
    """
    below, above = 0, moves  # the move sought is the last that has begun
    while above - below > 1:
        middle = (below + above) // 2
        if s[first + COLUMNS * middle] <= t:
            below = middle
        else:
            above = middle
    k = first + COLUMNS * below
    D, r0, d = s[k + 1], s[k + 2], s[k + 3]
    q = (t - s[k]) / D
    if q <= 0.0:
        return r0, 0.0, 0.0
    if q >= 1.0:
        return r0 + d, 0.0, 0.0
    p = 1.0 - q
    r = r0 + d * (q * q * q * (10.0 + q * (6.0 * q - 15.0)))
    return r, 30.0 * d * (q * p) * (q * p) / D, 60.0 * d * q * p * (p - q) / (D * D)


@compiled()
def _references(
    table: Float[np.ndarray, " s"], moves: int, times: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "3 n"]:
    """Return `reference_at` for many times."""
    out = np.empty((3, times.size))
    for k in range(times.size):
        out[0, k], out[1, k], out[2, k] = reference_at(table, 0, moves, times[k])
    return out


@dataclass(frozen=True, kw_only=True)
class Move:
    """One move to a place, and the rest after it.

    Attributes
    ----------
    target
        Where it ends [m or rad].
    duration
        How long it takes [s].
    dwell
        How long the reference rests there before the next move [s].

    Raises
    ------
    InputError
        If a value is not finite, the duration not positive or the dwell negative.
    """

    target: float = quantity_field("position")
    duration: float = quantity_field("time")
    dwell: float = quantity_field("time", default=0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "target", finite("target", self.target, "m or rad"))
        check_fields(self, positive, {"duration": "s"})
        check_fields(self, non_negative, {"dwell": "s"})


class Reference(NamedTuple):
    """Requested motion of an axis over time.

    Attributes
    ----------
    position, velocity, acceleration
        [m or rad, m/s or rad/s, m/s^2 or rad/s^2].
    """

    position: Float[np.ndarray, " n"]
    velocity: Float[np.ndarray, " n"]
    acceleration: Float[np.ndarray, " n"]


@dataclass(frozen=True, kw_only=True)
class PointToPoint:
    """Moves from place to place, each of least jerk, from time 0 on.

    A move of length d in the time D is the fifth-order polynomial that is at rest, without
    acceleration, at both ends; its largest velocity is 15/8 d/D, half way, and its largest
    acceleration 10/sqrt(3) d/D^2. After the last move the reference stays at its target.

    Attributes
    ----------
    moves
        In their order, one at least.
    start
        Where the first move begins [m or rad].

    Raises
    ------
    InputError
        If there is no move or the start is not finite.

    Examples
    --------
    >>> there_and_back = PointToPoint(
    ...     moves=(Move(target=1.0, duration=2.0, dwell=1.0), Move(target=0.0, duration=4.0)))
    >>> there_and_back.at([1.0, 2.5, 5.0]).position.tolist()
    [0.5, 1.0, 0.5]
    >>> there_and_back.duration
    7.0
    """

    moves: Sequence[Move]
    start: float = quantity_field("position", default=0.0)
    table: Float[np.ndarray, " s"] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        moves = tuple(self.moves)
        if not moves:
            raise InputError("no_move")
        start = finite("start", self.start, "m or rad")
        object.__setattr__(self, "moves", moves)
        object.__setattr__(self, "start", start)
        table = np.empty((len(moves), COLUMNS))
        begin, place = 0.0, self.start
        for row, move in zip(table, moves, strict=True):
            row[:] = begin, move.duration, place, move.target - place
            begin, place = begin + move.duration + move.dwell, move.target
        flat = table.ravel()
        flat.flags.writeable = False
        object.__setattr__(self, "table", flat)

    @property
    def duration(self) -> float:
        """From the begin of the first move to the end of the last dwell [s]."""
        return sum(move.duration + move.dwell for move in self.moves)

    def at(self, times: ArrayLike) -> Reference:
        """Return the reference at times from the begin of the first move [s], shape (n,)."""
        t = np.atleast_1d(np.asarray(times, dtype=np.float64))
        r, v, a = _references(self.table, len(self.moves), t)
        return Reference(position=r, velocity=v, acceleration=a)
