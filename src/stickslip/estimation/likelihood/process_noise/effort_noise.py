"""White noise of a logged effort that does not act on the axis, from its highest frequencies."""

from math import comb

import numpy as np
from jaxtyping import Float

__all__ = ["effort_noise"]

_ORDER = 3  # of the differences: a smooth effort leaves nothing of its own in them
_LAGS = 6  # samples of the position that a controller answers to
_TRIMMED = 0.02  # share of the largest differences: jumps of the effort
_TRIMMED_VARIANCE = 0.8735  # of a unit normal distribution without its outer 2 %


def effort_noise(effort: Float[np.ndarray, " n"], position: Float[np.ndarray, " n"]) -> float:
    """Return the standard deviation of the white noise of a logged effort [N or N m].

    Third differences of the effort, less what third differences of the last positions explain of
    them: a controller answers to the noise of the encoder, and this part of the effort does act.
    The largest 2 % of what is left are jumps of the effort and are left out.

    Parameters
    ----------
    effort
        As logged, without gaps [N or N m].
    position
        As measured [m or rad].
    """
    if effort.size < 10 * (_LAGS + _ORDER):
        return 0.0
    change = np.diff(effort, _ORDER)
    moved = np.diff(position, _ORDER)
    columns = [moved[_LAGS - 1 - lag : moved.size - lag] for lag in range(_LAGS)]
    regressors = np.column_stack(columns)
    target = change[_LAGS - 1 :]
    norms = np.linalg.norm(regressors, axis=0)
    norms[norms == 0] = 1.0
    values, *_ = np.linalg.lstsq(regressors / norms, target, rcond=None)
    left = np.sort(np.abs(target - (regressors / norms) @ values))
    kept = left[: left.size - int(_TRIMMED * left.size)]
    variance = float(np.mean(kept**2)) / (_TRIMMED_VARIANCE * comb(2 * _ORDER, _ORDER))
    return float(np.sqrt(variance))
