"""Rows of several logs, each over windows of its own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from jaxtyping import Float, Int

from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.estimation.weak_form.rows import WindowRows
from stickslip.estimation.weak_form.shape import Column

__all__ = ["JointMotions", "StackedRows"]


class JointMotions(SlipMotions):
    """The motion of several logs, the time of each counted from the middle of that log."""

    @property
    def reference_time(self) -> float:
        """Middle of every log [s], at which drifting parameters have the values given."""
        return 0.0


@dataclass(frozen=True, kw_only=True)
class StackedRows(WindowRows):
    """Rows of several logs, whose sampling times and windows may differ.

    Attributes
    ----------
    parts
        Rows of each log.
    """

    parts: tuple[WindowRows, ...]

    @classmethod
    def of(cls, parts: Sequence[WindowRows]) -> "StackedRows":
        """Return the rows of all logs, one log after another."""
        moves = np.cumsum([0, *(part.moves for part in parts)])
        return cls(
            motions=tuple(motion for part in parts for motion in part.motions),
            weight=max((part.weight for part in parts), key=lambda weight: weight.duration),
            delay=0.0,  # each log has its own
            middles=tuple(middles for part in parts for middles in part.middles),
            move=np.concatenate([part.move + k for part, k in zip(parts, moves, strict=False)]),
            parts=tuple(parts),
        )

    @cached_property
    def log(self) -> Int[np.ndarray, " n"]:
        """Number of the log that each row is from [-]."""
        return np.repeat(np.arange(len(self.parts)), [part.size for part in self.parts])

    @cached_property
    def indicators(self) -> Float[np.ndarray, "n k"]:
        """Whether each row is from each log, 1 or 0 [-]."""
        return (self.log[:, None] == np.arange(len(self.parts))).astype(float)

    def moved(self, samples: int) -> "StackedRows":
        """Return rows of the same windows a sample later (1) or earlier (-1)."""
        return StackedRows.of([part.moved(samples) for part in self.parts])

    def widened(self, factor: float) -> "StackedRows":
        """Return rows of windows that are wider by a factor [-]."""
        return StackedRows.of([part.widened(factor) for part in self.parts])

    def _filtered(
        self, column: Column, taps_of: Callable[[WindowRows], Float[np.ndarray, " k"]]
    ) -> Float[np.ndarray, " n"]:
        return np.concatenate([part._filtered(column, taps_of) for part in self.parts])
