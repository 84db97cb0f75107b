"""Search of the delay of the effort."""

from dataclasses import replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.selection.model import LARGEST_STEP, Model, testable
from stickslip.estimation.selection.search.tuning import SearchTuning

_SLOWEST = 0.98
"""Ratio of one Gauss-Newton step to the one before up to which the steps are extrapolated [-]:
above it the extrapolation is longer than 49 steps, and uncertain."""

_FARTHEST = 5.0
"""Longest extrapolation over the largest step [-]: 15 samples, over which the effort may turn."""


def scanned_delay(plain: Model, found: Model, tuning: SearchTuning) -> float:
    """Return the delay at which the plain model explains much more than the one found [samples].

    0 if there is none. Over many samples the effort is not linear in the delay: the Gauss-Newton
    steps then converge to another delay, or do not converge.
    """
    left = _left(found if found.settled else plain)
    if left < tuning.unexplained**2:
        return 0.0
    steps = round(tuning.largest_delay / tuning.scanned_step)
    step = tuning.scanned_step / plain.rows.weight.sampling_time
    delays = [step * k for k in range(-steps, steps + 1) if k]
    trials = [(_left(plain.shifted(delay)), delay) for delay in delays]
    least, delay = min(trials)
    return delay if least < tuning.delay_gain * left else 0.0


def _left(model: Model) -> float:
    """Return the unexplained share of the squared effort [-]; 1 if the model is not testable."""
    return model.residual_share() ** 2 if testable(model) else 1.0


def settled(model: Model, tuning: SearchTuning) -> Model:
    """Return the model at the delay that fits best (Gauss-Newton).

    Noise of the effort shortens all steps by the same factor. Two of them therefore give the delay
    that they converge to (Aitken's extrapolation).
    """
    before: Float[np.ndarray, " k"] | None = None
    for _ in range(tuning.delay_steps):
        start = model.delays
        model, step = model.stepped(tuning.largest_delay)
        if step < tuning.settled_delay:
            return replace(model, settled=True)
        change = model.delays - start
        if before is None:
            before = change
            continue
        ratio = np.divide(change, before, out=np.zeros(change.size), where=before != 0.0)
        slow = (ratio > 0.0) & (ratio < _SLOWEST) & (np.abs(before) < LARGEST_STEP)
        ahead = np.where(slow, change * ratio / (1.0 - np.where(slow, ratio, 0.0)), 0.0)
        ahead = np.clip(ahead, -_FARTHEST * LARGEST_STEP, _FARTHEST * LARGEST_STEP)
        model, before = model.with_delays(model.delays + ahead), None
    return replace(model, settled=False)
