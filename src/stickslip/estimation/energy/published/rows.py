"""What the report's estimator takes from a log: samples, weighted rows, and the share of noise."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.levels import load_position
from stickslip.estimation.energy.published import recursion as at
from stickslip.estimation.energy.published.recursion import report_energy_rows
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.online.recursion import FIRST_SPREAD, FORGETTING, PARAMETERS, VALUES
from stickslip.estimation.signals.kinematics import LowPass, central_difference
from stickslip.records import AxisLog, InputError

__all__ = [
    "WORTH_TELLING",
    "check_fits",
    "known_biases",
    "noise_shares",
    "refused",
    "samples_of",
    "weighted_rows",
    "without_error_terms",
]

WORTH_TELLING = 0.001
"""Share of noise in a regressor from which on it is told, and an estimate is not trusted."""

_SAME_SAMPLING_TIME = 0.01  # relative
_SAMPLE = ("effort", "position", "velocity", "load position", "load velocity")


def samples_of(part: AxisLog, low_pass: LowPass, *, load: bool) -> Float[np.ndarray, "n 5"]:
    """Return effort, position, velocity, load position and load velocity, one row a sample.

    Parameters
    ----------
    part
        Without gaps.
    low_pass
        For velocities that were not measured.
    load
        Whether the axis is a flexible arm; if not, its load is zero.

    Raises
    ------
    InputError
        If the position of the load is needed and not there.
    """
    T = part.sampling_time

    def velocity(
        measured: Float[np.ndarray, " n"] | None, position: Float[np.ndarray, " n"]
    ) -> Float[np.ndarray, " n"]:
        if measured is not None:
            return measured
        return central_difference(low_pass.apply(position, T), T)

    x = part.measured_position
    x2 = v2 = np.zeros(len(part))
    if load:
        x2 = load_position(part)
        v2 = velocity(part.measured_load_velocity, x2)
    return np.column_stack([part.effort, x, velocity(part.measured_velocity, x), x2, v2])


def check_fits(log: AxisLog, sampling_time: float) -> None:
    """Refuse a log that does not fit a state.

    Parameters
    ----------
    log
        What is to be run.
    sampling_time
        That the state was made for [s].

    Raises
    ------
    InputError
        If it has a gap, or another sampling time.
    """
    if log.segment_starts.size > 1:
        k = int(log.segment_starts[1])
        raise InputError(
            f"the log has a gap of {log.time[k] - log.time[k - 1]:.6g} s before sample {k}",
            where=log.name,
            remedy="run its segments one by one and resume before each, or use fit",
        )
    own = log.sampling_time
    if abs(own - sampling_time) > _SAME_SAMPLING_TIME * sampling_time:
        raise InputError(
            f"the log has a sampling time of {own:.6g} s, the state was made for "
            f"{sampling_time:.6g} s",
            where=log.name,
            remedy=f"make the state with init(sampling_time={own:.6g})",
        )


def refused(state: Float[np.ndarray, " s"], sample: Any) -> InputError:
    """Return why a state did not take a sample.

    Parameters
    ----------
    state
        Whose noise may be needed and not known.
    sample
        What should be five finite numbers.
    """
    if state[at.NOISE] < 0.0:
        return InputError(
            "the noise of the sensors is needed and not known",
            remedy="give position_noise and velocity_noise, or run a log first",
        )
    try:
        pairs = [(name, float(value)) for name, value in zip(_SAMPLE, sample, strict=True)]
    except (TypeError, ValueError):
        return InputError(
            f"the sample is {sample!r}, it must be five numbers",
            remedy=f"give {', '.join(_SAMPLE)} in SI units, 0 for the load of a rigid axis",
        )
    name, value = next((pair for pair in pairs if not np.isfinite(pair[1])), pairs[0])
    return InputError(
        f"the {name} of the sample is {value}, it must be finite",
        remedy="leave the sample out and resume, as after a gap, or give the last good value",
    )


def weighted_rows(
    state: Float[np.ndarray, " s"], samples: Sequence[Float[np.ndarray, "_ 5"]]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m p"]]:
    """Return targets and rows whose least-squares solution is what the recursion ends at.

    Row k of n weighs lambda^((n - k) / 2), and P(0) and the first guesses enter as one more row a
    parameter, the first ones, of weight lambda^(n / 2).

    Parameters
    ----------
    state
        Before the first sample.
    samples
        Of each stretch without gaps; each begins with energies of zero.
    """
    made = [report_energy_rows(state.copy(), part) for part in samples]
    target = np.concatenate([part[0] for part in made])
    columns = np.concatenate([part[1] for part in made])
    n, p = target.size, int(state[PARAMETERS])
    root = np.sqrt(state[FORGETTING])
    weight = root ** np.arange(n - 1, -1, -1)
    prior = root**n / np.sqrt(state[FIRST_SPREAD : FIRST_SPREAD + p])
    return (
        np.concatenate([prior * state[VALUES : VALUES + p], weight * target]),
        np.concatenate([np.diag(prior), weight[:, None] * columns]),
    )


def without_error_terms(
    target: Float[np.ndarray, " m"], columns: Float[np.ndarray, "m 4"]
) -> tuple[Float[np.ndarray, " m"], Float[np.ndarray, "m 2"], tuple[float, float]]:
    """Return the rows with B and S projected out, and the values of B and S (Eq. 6.2).

    Least squares on what is left gives the same friction as on all four columns.

    Parameters
    ----------
    target, columns
        From `weighted_rows` [SI].
    """
    level_bias, slope = least_squares(columns, target)[2:].tolist()
    basis, _ = np.linalg.qr(columns[:, 2:])
    friction = columns[:, :2]
    return (
        target - basis @ (basis.T @ target),
        friction - basis @ (basis.T @ friction),
        (level_bias, slope),
    )


def noise_shares(
    state: Float[np.ndarray, " s"],
    samples: Sequence[Float[np.ndarray, "_ 5"]],
    velocity_noise: float,
) -> tuple[float, float]:
    """Return which part of the sums of abs(v) and of v^2 is noise, in expectation [-].

    Parameters
    ----------
    state
        Before the first sample.
    samples
        Of each stretch without gaps.
    velocity_noise
        Standard deviation [m/s or rad/s].
    """

    def sums(compensation: float) -> Float[np.ndarray, " 2"]:
        s = state.copy()
        s[at.SETTLED_SUMS], s[at.COMPENSATION] = 0.0, compensation
        s[at.NOISE] = velocity_noise
        ends = [report_energy_rows(s.copy(), part)[1][-1, :2] for part in samples]
        return np.sum(ends, axis=0)

    noisy, clean = sums(0.0), sums(2.0)
    shares = np.divide(noisy - clean, noisy, out=np.zeros(2), where=noisy > 0)
    return float(shares[0]), float(shares[1])


def known_biases(
    velocity_noise: float,
    shares: tuple[float, float],
    *,
    assumed: bool,
    printed: bool,
    compensated: bool,
) -> tuple[str, ...]:
    """Return what is known of the biases of rows, one sentence each.

    Parameters
    ----------
    velocity_noise
        Standard deviation [m/s or rad/s].
    shares
        Of noise in the two regressors, as `noise_shares` gives them.
    assumed
        Whether that noise was given; otherwise it is estimated.
    printed, compensated
        Whether the sums are the printed ones, and whether noise is compensated.
    """
    first = (
        "sums by backward Euler as printed: biased when the effort is held over each sample"
        if printed
        else "sums that are exact while the effort is held over each sample"
    )
    if shares[0] < WORTH_TELLING:
        return (first,)
    size = (
        f"velocity noise ({'assumed' if assumed else 'estimated from the log'}) of "
        f"{velocity_noise:.3g} in SI makes about {100 * shares[0]:.2g} % of the sum of absolute "
        f"velocities and {100 * shares[1]:.2g} % of the sum of squares"
    )
    if not compensated:
        return first, f"{size}; nothing is compensated, and no interval allows for that bias"
    return first, (
        f"{size}; its expectation is compensated, which is biased itself, and the regressors "
        "stay noisy: no interval allows for either"
    )
