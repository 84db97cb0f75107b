"""Columns of the force balance, and its rows over windows.

A column is a function of the motion, one for each coefficient.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from jaxtyping import Bool, Float, Int

from stickslip.estimation.weak_form.motion import SlipMotion
from stickslip.estimation.weak_form.windows import Weight, convolved, whole_windows

Column = Callable[[SlipMotion], Float[np.ndarray, " n"]]
"""A part of the effort per unit of its coefficient, sample by sample."""

ANY = (-np.inf, np.inf)  #: Bounds of a coefficient of either sign.

ROWS_PER_WINDOW = 6
"""Rows in the width of a window [-]: the weight attenuates all frequencies that they alias."""

FEWEST_FOLDS = 4
"""Fewest groups of rows that are left out in turn [-], for a standard error of the prediction."""


@dataclass(frozen=True, kw_only=True)
class Shape:
    """One member of a family of terms: names and columns of its parameters."""

    names: tuple[str, ...]
    columns: tuple[Column, ...]
    value: float = 0.0  # of the shape, such as a Stribeck velocity [SI]; 0 if there is one only
    bounds: tuple[float, float] = ANY  #: Bounds of the coefficients [SI].
    slope: tuple[str, Callable[[Float[np.ndarray, " p"]], Column]] | None = None
    """Name of ``value`` as a parameter, and the derivative of the effort with respect to it as a
    function of the coefficients; None if it is not a parameter."""
    of_effort: bool = False
    """Whether the columns are functions of the effort: they are held and delayed like it."""

    def allows(self, values: Float[np.ndarray, " p"]) -> bool:
        """Return whether the coefficients [SI] are within the bounds."""
        return bool(np.all((values > self.bounds[0]) & (values < self.bounds[1])))


@dataclass(frozen=True, kw_only=True)
class WindowRows:
    """Windows over the stretches of a motion, each a row of the force balance."""

    motions: tuple[SlipMotion, ...]
    weight: Weight
    delay: float  # time by which the effort acts later than it is logged [samples]
    middles: tuple[Int[np.ndarray, " _"], ...]  # middle sample of each window, of each stretch
    move: Int[np.ndarray, " n"]  # number of the move that each row belongs to
    _means: dict[int, tuple[Shape, Float[np.ndarray, "n p"]]] = field(
        default_factory=dict, repr=False, compare=False
    )
    _moved: dict[int, "WindowRows"] = field(default_factory=dict, repr=False, compare=False)

    @property
    def size(self) -> int:
        """Number of rows."""
        return self.move.size

    @property
    def moves(self) -> int:
        """Number of moves."""
        return int(self.move[-1]) + 1 if self.size else 0

    @cached_property
    def folds(self) -> Int[np.ndarray, " n"]:
        """Number of the group of rows that is left out of a fit together [-].

        A group is a move. With fewer than `FEWEST_FOLDS` moves, each is divided into equal parts.
        Windows at the ends of neighbouring parts overlap.
        """
        if not 0 < self.moves < FEWEST_FOLDS:
            return self.move
        parts = -(-FEWEST_FOLDS // self.moves)
        numbers: list[Int[np.ndarray, " _"]] = []
        count = 0
        for move in range(self.moves):
            rows = int(np.sum(self.move == move))
            own = min(parts, rows)
            numbers.append(count + np.arange(rows) * own // rows)
            count += own
        return np.concatenate(numbers)

    @cached_property
    def log(self) -> Int[np.ndarray, " n"]:
        """Number of the log that each row is from [-]."""
        return np.zeros(self.size, dtype=np.int64)

    @cached_property
    def time(self) -> Float[np.ndarray, " n"]:
        """Middle of each window [s]."""
        return self._at_middles(lambda m: m.time)

    @cached_property
    def position(self) -> Float[np.ndarray, " n"]:
        """Position in the middle of each window [m or rad]."""
        return self._at_middles(lambda m: m.position)

    @cached_property
    def direction(self) -> Float[np.ndarray, " n"]:
        """Direction of travel in each window, 1 or -1 [-]."""
        return self._at_middles(lambda m: m.direction.astype(float))

    @cached_property
    def acceleration(self) -> Float[np.ndarray, " n"]:
        """Mean acceleration [m/s^2 or rad/s^2]."""
        return self._filtered(_from_start, lambda own: own.weight.second())

    @cached_property
    def snap(self) -> Float[np.ndarray, " n"]:
        """Mean fourth derivative of the position [m/s^4 or rad/s^4]."""
        return self._filtered(_from_start, lambda own: own.weight.fourth())

    @cached_property
    def velocity(self) -> Float[np.ndarray, " n"]:
        """Mean velocity [m/s or rad/s]."""
        return self._filtered(_from_start, lambda own: own.weight.first())

    @cached_property
    def effort(self) -> Float[np.ndarray, " n"]:
        """Mean of the effort that acts [N or N m]."""
        return self._filtered(lambda m: m.effort, lambda own: own.weight.effort(own.delay))

    @cached_property
    def model_effort(self) -> Float[np.ndarray, " n"]:
        """Mean of the effort that a model of the machine states [N or N m]."""
        if not any(np.any(motion.model_effort) for motion in self.motions):
            return np.zeros(self.size)
        return self.mean(model_effort)

    @property
    def own_effort(self) -> Float[np.ndarray, " n"]:
        """Mean of the effort that acts beyond that of a model [N or N m]."""
        return self.effort - self.model_effort

    def mean(self, column: Column) -> Float[np.ndarray, " n"]:
        """Return the weighted mean of a function of the motion."""
        return self._filtered(column, lambda own: own.weight.mean())

    def means(self, shape: Shape) -> Float[np.ndarray, "n p"]:
        """Return the weighted means of the columns of a shape; cached unless of the effort."""
        if shape.of_effort:  # they depend on the delay of these rows
            held = [
                self._filtered(column, lambda own: own.weight.effort(own.delay))
                for column in shape.columns
            ]
            return np.column_stack(held)
        known = self._means.get(id(shape))
        if known is None:
            known = (shape, np.column_stack([self.mean(column) for column in shape.columns]))
            self._means[id(shape)] = known
        return known[1]

    def moved(self, samples: int) -> "WindowRows":
        """Return rows of the same windows a sample later (1) or earlier (-1), computed once.

        The windows leave room for one sample and no more.
        """
        known = self._moved.get(samples)
        if known is None:
            middles = tuple(middle + samples for middle in self.middles)
            known = replace(self, middles=middles, _means={}, _moved={})
            self._moved[samples] = known
        return known if known.delay == self.delay else replace(known, delay=self.delay)

    def widened(self, factor: float) -> "WindowRows":
        """Return rows of windows that are wider by a factor [-]."""
        wider = replace(self.weight, half_width=round(factor * self.weight.half_width))
        return window_rows(self.motions, wider, self.delay)

    def _filtered(
        self, column: Column, taps_of: Callable[["WindowRows"], Float[np.ndarray, " k"]]
    ) -> Float[np.ndarray, " n"]:
        """Return a column convolved with taps; rows of several logs have taps for each log."""
        taps = taps_of(self)
        return self._at_middles(lambda motion: convolved(column(motion), taps))

    def _at_middles(self, column: Column) -> Float[np.ndarray, " n"]:
        """Return a column in the middle of each window."""
        parts = [column(m)[at] for m, at in zip(self.motions, self.middles, strict=True)]
        return np.concatenate(parts)


def model_effort(motion: SlipMotion) -> Float[np.ndarray, " n"]:
    """Return the effort that a model of the machine states [N or N m]."""
    return motion.model_effort


def _from_start(motion: SlipMotion) -> Float[np.ndarray, " n"]:
    return motion.position - motion.position[0]


def window_rows(motions: Sequence[SlipMotion], weight: Weight, delay: float = 0.0) -> WindowRows:
    """Return windows over the moves of stretches without gaps, of which there is at least one.

    Each window holds usable samples of one direction only. ``delay`` is the time by which the
    effort acts later than it is logged [samples].
    """
    stride = max(2 * weight.half_width // ROWS_PER_WINDOW, 1)
    every: list[Int[np.ndarray, " _"]] = []
    numbers: list[Int[np.ndarray, " _"]] = []
    moves = 0
    for motion in motions:
        whole = whole_windows(motion.direction, motion.usable, weight.half_width + 1, weight.reach)
        middles = _strided(whole, stride)
        changes = np.concatenate(([0], np.cumsum(np.diff(motion.direction) != 0)))
        number = np.unique(changes[middles], return_inverse=True)[1].astype(np.int64)
        every.append(middles)
        numbers.append(number + moves)
        moves += int(number[-1]) + 1 if number.size else 0
    return WindowRows(
        motions=tuple(motions),
        weight=weight,
        delay=delay,
        middles=tuple(every),
        move=np.concatenate(numbers),
    )


def _strided(marks: Bool[np.ndarray, " n"], stride: int) -> Int[np.ndarray, " m"]:
    """Return the marked indices that are a stride apart, counted from the start of each run."""
    index = np.flatnonzero(marks)
    if index.size == 0:
        return index
    begins = np.concatenate(([True], np.diff(index) > 1))
    place = np.arange(index.size)
    since = place - np.maximum.accumulate(np.where(begins, place, 0))
    return index[since % stride == 0]
