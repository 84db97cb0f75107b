"""The energy balance as the report prints it (part A Eqs. 3.6-4.10), for a whole log."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy_levels import AxisModel, load_position, summed
from stickslip.estimation.kinematics import LowPass, central_difference
from stickslip.estimation.regression import Regression, summarise_motion
from stickslip.records import AxisLog

__all__ = ["printed_regression", "printed_rows"]


def printed_rows(
    part: AxisLog, model: AxisModel, low_pass: LowPass, sampling_time: float
) -> tuple[Float[np.ndarray, " n"], Float[np.ndarray, "n p"], Float[np.ndarray, " n"]]:
    """Return y(k) (Eq. 4.4), W(k) (Eq. 4.3) and the velocity, by backward-Euler sums.

    Parameters
    ----------
    part
        Without gaps.
    model
        What is known of the axis.
    low_pass
        For velocities that were not measured.
    sampling_time
        [s].

    Raises
    ------
    InputError
        If the model has a load and the log does not hold its position.
    """
    T = sampling_time
    x, v = part.measured_position, part.measured_velocity
    if v is None:
        v = central_difference(low_pass.apply(x, T), T)
    stored = np.zeros(len(part)) if model.inertia is None else 0.5 * model.inertia * v**2
    if model.load_inertia is not None and model.stiffness is not None:
        x2, v2 = load_position(part), part.measured_load_velocity
        if v2 is None:
            v2 = central_difference(low_pass.apply(x2, T), T)
        stored = stored + 0.5 * model.load_inertia * v2**2
        stored = stored + 0.5 * model.stiffness * (x - x2) ** 2
    work = summed((T * part.effort * v)[:, None])[1:, 0]
    friction = model.terms.energy_columns(T * v**2, T * np.abs(v), T * v, np.sign(v))
    columns = summed(friction)[1:]
    if model.inertia is None:
        columns = np.column_stack([0.5 * v**2, columns])
    return work - stored, columns, v


def printed_regression(
    parts: Sequence[AxisLog],
    model: AxisModel,
    names: tuple[str, ...],
    low_pass: LowPass,
    *,
    forgetting_factor: float,
    initial_values: Sequence[float],
    initial_variance: float,
) -> Regression:
    """Return rows whose least-squares solution is what the printed recursion ends at.

    Row k of n weighs lambda^((n - k) / 2), and P(0) and the first guesses enter as one more row a
    parameter, of weight lambda^(n / 2).

    Parameters
    ----------
    parts
        Stretches without gaps; each begins with energies of zero.
    model
        What is known of the axis.
    names
        Of the parameters.
    low_pass
        For velocities that were not measured.
    forgetting_factor
        lambda [-].
    initial_values
        First guesses [SI].
    initial_variance
        Diagonal of P(0) [squared unit of the parameters over J^2].
    """
    T = parts[0].sampling_time
    rows = [printed_rows(part, model, low_pass, T) for part in parts]
    target = np.concatenate([row[0] for row in rows])
    columns = np.concatenate([row[1] for row in rows])
    velocities = [row[2] for row in rows]
    n, p = columns.shape
    weight = forgetting_factor ** (0.5 * np.arange(n - 1, -1, -1))
    prior = forgetting_factor ** (0.5 * n) / np.sqrt(initial_variance)
    time = np.concatenate([part.time for part in parts])
    return Regression(
        kind=parts[0].kind,
        names=names,
        time=np.concatenate([np.full(p, time[0]), time]),
        target=np.concatenate([prior * np.array(initial_values), weight * target]),
        regressors=np.concatenate([prior * np.eye(p), weight[:, None] * columns]),
        regressor_noise=np.zeros(p),
        quantity="energy",
        motion=summarise_motion(
            [part.measured_position for part in parts], velocities, T, (0.0, 0.0)
        ),
        samples=n,
        notes=(
            "sums by backward Euler as printed: biased when the effort is held over each sample, "
            "and by sensor noise",
        ),
    )
