"""Samples, weighted rows and shares of noise of the published energy estimator."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.levels import load_position
from stickslip.estimation.energy.published import recursion as at
from stickslip.estimation.energy.published.recursion import published_energy_rows
from stickslip.estimation.fit.rows import least_squares
from stickslip.estimation.online.recursion import FIRST_SPREAD, FORGETTING, PARAMETERS, VALUES
from stickslip.estimation.signals.kinematics import LowPass, central_difference
from stickslip.records import AxisLog

__all__ = [
    "NOTEWORTHY_NOISE",
    "filtered_samples",
    "known_biases",
    "noise_shares",
    "weighted_rows",
    "without_error_terms",
]

NOTEWORTHY_NOISE = 0.001
"""Share of noise in a regressor [-] above which a note states it and the status is `biased`."""


def filtered_samples(
    part: AxisLog, low_pass: LowPass, *, load: bool, effort_delay: float = 0.0
) -> Float[np.ndarray, "n 5"]:
    """Return effort, position, velocity, load position and load velocity, one row a sample.

    Parameters
    ----------
    part
        Without gaps.
    low_pass
        For velocities that were not measured.
    load
        Whether the axis is a flexible arm; if not, its load is zero.
    effort_delay
        Samples by which the effort acts after it is logged [-]; it is removed.

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
    k = np.arange(len(part))
    effort = np.interp(k - effort_delay, k, part.effort)
    return np.column_stack([effort, x, velocity(part.measured_velocity, x), x2, v2])


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
    made = [published_energy_rows(state.copy(), part) for part in samples]
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
        ends = [published_energy_rows(s.copy(), part)[1][-1, :2] for part in samples]
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
    if shares[0] < NOTEWORTHY_NOISE:
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
