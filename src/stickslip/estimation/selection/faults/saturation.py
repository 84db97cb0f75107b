"""A drive that saturates below the largest logged effort."""

from dataclasses import dataclass

import numpy as np

from stickslip.estimation.selection.model import Model
from stickslip.estimation.selection.terms import effort_excess
from stickslip.estimation.weak_form.motion import SlipMotions
from stickslip.records import AxisLog, share_text


@dataclass(frozen=True, kw_only=True)
class SaturationTuning:
    """Tuning of the test for saturation."""

    highest_followed: float = 0.98  #: Effort over the limit [-], below which the drive follows.
    fewest_followed: float = 0.4
    """Share of the windows below the limit [-]: a limit that is reached in most of them is
    friction."""
    smallest_excess: float = 0.02
    """Excess of the logged effort, relative to the limit [-], below which a window does not count:
    its effect is within the noise."""
    largest_error: float = 0.25
    """Squared error with the limit over that without it, beyond the limit [-]."""


def without_saturation(
    motions: SlipMotions, limit: float, log: AxisLog, tuning: SaturationTuning
) -> tuple[SlipMotions, str]:
    """Return the motions without the samples whose effort did not reach the axis, and a note."""
    followed, share = motions.without(lambda m: np.abs(m.effort) > tuning.highest_followed * limit)
    return followed, (
        f"logged effort beyond {limit:.3g} {log.unit('effort')} does not reach the axis, so the "
        f"drive saturates; {share_text(share)} of samples excluded"
    )


def saturates(model: Model, motions: SlipMotions, limit: float, tuning: SaturationTuning) -> bool:
    """Return whether the effort that moves the axis stays at a limit where the logged one does not.

    The model is that of the samples within the limit, and is fitted to the windows in which the
    effort is within it. The excess of an effort over a limit explains part of any effort, so that
    its coefficient alone is no proof. ``limit`` is that of the drive [N or N m].
    """
    every = model.over(motions)
    if model.rows.size < tuning.fewest_followed * every.rows.size:
        return False
    logged = every.target()
    excess = every.rows.mean(effort_excess(limit))
    beyond = np.abs(excess) > tuning.smallest_excess * limit
    needed = (every.columns() @ model.solution)[beyond]
    followed = float(np.sum((needed - logged[beyond]) ** 2))
    limited = float(np.sum((needed - logged[beyond] + excess[beyond]) ** 2))
    return bool(np.any(beyond)) and limited < tuning.largest_error * followed
