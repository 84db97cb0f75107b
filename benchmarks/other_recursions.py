"""Recursive least squares as one would have it without this package.

All take rows, targets and a forgetting factor, begin with estimates of zero and P(0) =
`INITIAL_VARIANCE` I, and return the estimates after the last row.
"""

import warnings
from typing import Any, cast

import numpy as np
from jaxtyping import Float

INITIAL_VARIANCE = 1e3

Values = Float[np.ndarray, " p"]
Rows = Float[np.ndarray, "n p"]
Targets = Float[np.ndarray, " n"]


def by_numpy(rows: Rows, targets: Targets, forgetting_factor: float = 1.0) -> Values:
    """Write Eqs. 4.6-4.10 down in NumPy, as in any textbook."""
    values = np.zeros(rows.shape[1])
    spread = INITIAL_VARIANCE * np.eye(rows.shape[1])
    for row, target in zip(rows, targets.tolist(), strict=True):
        gain = spread @ row
        gain = gain / (forgetting_factor + row @ gain)
        values = values + gain * (target - row @ values)
        spread = (spread - np.outer(gain, row @ spread)) / forgetting_factor
    return values


def by_padasip(rows: Rows, targets: Targets, forgetting_factor: float = 1.0) -> Values:
    """Adapt padasip's FilterRLS."""
    with warnings.catch_warnings():  # about its docstrings, where they are compiled first
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", SyntaxWarning)
        from padasip.filters import FilterRLS
    adapted: Any = FilterRLS(
        n=rows.shape[1], mu=forgetting_factor, eps=1.0 / INITIAL_VARIANCE, w="zeros"
    )
    adapt = adapted.adapt
    for row, target in zip(rows, targets.tolist(), strict=True):
        adapt(target, row)
    return np.asarray(adapted.w)


def by_filterpy(rows: Rows, targets: Targets, forgetting_factor: float = 1.0) -> Values:
    """Update filterpy's KalmanFilter, whose state is the parameters and does not change.

    Its fading memory is exponential forgetting.
    """
    from filterpy import kalman

    filtered: Any = cast("Any", kalman).KalmanFilter(dim_x=rows.shape[1], dim_z=1)
    filtered.P *= INITIAL_VARIANCE
    filtered.Q[:] = 0.0
    filtered.alpha = forgetting_factor**-0.5
    predict, update = filtered.predict, filtered.update
    for row, target in zip(rows, targets.tolist(), strict=True):
        if forgetting_factor < 1.0:
            predict()
        update(target, H=row[None, :])
    return np.asarray(filtered.x)[:, 0]


def by_statsmodels(rows: Rows, targets: Targets) -> Values:
    """Run the compiled filter of statsmodels' RecursiveLS over the whole log."""
    from statsmodels.regression import recursive_ls

    p = rows.shape[1]
    model: Any = cast("Any", recursive_ls).RecursiveLS(targets, rows)
    model.ssm.initialize_known(np.zeros(p), INITIAL_VARIANCE * np.eye(p))
    return np.asarray(model.ssm.filter().filtered_state)[:, -1]
