"""The part of an effort that answers to the noise of the encoder."""

import numpy as np
from jaxtyping import Float
from scipy.signal import savgol_filter

__all__ = ["feedback_effort"]

_ORDER = 3  # of the differences: references and smooth efforts leave nothing in them
_LAGS = 12  # samples; a derivative filtered at a fifth of the sampling rate has decayed to 1e-6
_WINDOW = 21  # samples of the smoothed position, whose deviations are the encoder's noise
_SIGNIFICANCE = 0.02  # share of the rough effort that must be explained


def feedback_effort(
    effort: Float[np.ndarray, " n"], position: Float[np.ndarray, " n"]
) -> Float[np.ndarray, " n"]:
    """Return the part of an effort that answers to the noise of the encoder [N or N m].

    j(k) = sum_i h_i n(k-i), with n the deviation of the position from a smooth one and h from least
    squares of the third differences of the effort on those of n. A controller differentiates the
    noise of the encoder; this part of the effort is rough, known, and acts on the axis. What it
    leaves of the effort is smooth, but for noise. Zero if it explains nothing.

    Parameters
    ----------
    effort
        As logged, without gaps [N or N m].
    position
        As measured [m or rad].
    """
    none = np.zeros_like(effort)
    if effort.size < 10 * (_LAGS + _ORDER):
        return none
    noise = position - np.asarray(savgol_filter(position, _WINDOW, 2))
    target = np.diff(effort, _ORDER)[_LAGS - 1 :]
    change = np.diff(noise, _ORDER)
    columns = [change[_LAGS - 1 - lag : change.size - lag] for lag in range(_LAGS)]
    regressors = np.column_stack(columns)
    scale = float(np.sqrt(np.mean(change**2)))
    if scale == 0.0:
        return none
    values, *_ = np.linalg.lstsq(regressors / scale, target, rcond=1e-10)
    left = target - (regressors / scale) @ values
    if np.sum(left**2) > (1.0 - _SIGNIFICANCE) * np.sum(target**2):
        return none
    padded = np.concatenate((np.zeros(_LAGS - 1), noise))
    return np.convolve(padded, values / scale, mode="valid")
