"""Information of slow motion and of acceleration apart, for a model that does not hold everywhere.

Static friction, a Stribeck effect and presliding act at low speed; a delay of the effort and a
wrong inertia act where the axis accelerates. None of them is in the model, and batches of time
(`stickslip.estimation.online.intervals.batches`) all have the same error. The information of the
slow samples and of the accelerated ones is therefore gathered apart, J_k and eta_k. Without a
group the estimates are

    theta_(k) = (J - J_k)^-1 (eta - eta_k),    d_k = theta_(k) - theta.

If the model holds, d_k is small beside the interval (J. A. Hausman 1978, "Specification tests in
econometrics", Econometrica 46). If it does not, d_k is about the error that the group makes. A half
width is therefore at least 1.5 sum_k |d_k|. There is no test of d_k first: an error of the model
inflates the standard error of d_k too.

The groups are a field of the estimator's state.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.intervals.batches import LEAST_WIDTH, intervals_of, symmetric

EVERYWHERE, SLOW, ACCELERATED = 0, 1, 2
"""Groups of a sample; one that is slow and accelerated has the sum of both."""

_GROUPS = 2  # slow and accelerated samples
_SLOW_SHARE = 0.25
"""Speed below which a sample is slow, over the largest so far: a Stribeck velocity is some 1 % to
10 % of it."""
_RAMP_SHARE = 0.1  # acceleration from which a sample is accelerated, over the largest so far
_SMOOTHING = 0.1  # weight of a sample in the smoothed velocity, whose change is the acceleration
_FADING = 1.0 / 65536.0  # relative decay of the largest speed and acceleration in a sample
_SINGULAR = 1e-9  # least eigenvalue of information with a unit diagonal


def contrasts_dtype(p: int) -> np.dtype[Any]:
    """Return the fields of the groups of p parameters."""
    group = np.dtype([("eta", "f8", (p,)), ("information", "f8", (p, p))])
    return np.dtype(
        [
            ("velocity", "f8"),  # smoothed
            ("started", "i8"),  # 1 after the first sample
            ("top_speed", "f8"),  # largest smoothed speed, decaying
            ("top_change", "f8"),  # largest change of it in a sample, decaying
            ("groups", group, (_GROUPS,)),  # of J, the upper triangle
        ]
    )


@compiled(inline=True)
def classify(contrasts: Any, velocity: float) -> int:
    """Return the groups of a sample in motion."""
    if contrasts.started == 0:
        contrasts.started = 1
        contrasts.velocity = velocity
    change = _SMOOTHING * (velocity - contrasts.velocity)
    contrasts.velocity += change
    keep = 1.0 - _FADING
    contrasts.top_speed = max(keep * contrasts.top_speed, abs(contrasts.velocity))
    contrasts.top_change = max(keep * contrasts.top_change, abs(change))
    groups = EVERYWHERE
    if abs(velocity) < _SLOW_SHARE * contrasts.top_speed:
        groups += SLOW
    if abs(change) > _RAMP_SHARE * contrasts.top_change:
        groups += ACCELERATED
    return groups


@compiled(inline=True)
def add_information(
    contrasts: Any,
    groups: int,
    information: Float[np.ndarray, "p p"],
    vector: Float[np.ndarray, " p"],
) -> None:
    """Add J and eta of a sample to its groups."""
    for k in range(_GROUPS):
        if (groups >> k) & 1 == 0:
            continue
        group = contrasts.groups[k]
        for i in range(vector.size):
            group.eta[i] += vector[i]
            for j in range(i, vector.size):
                group.information[i, j] += information[i, j]


@compiled(inline=True)
def add_row(own: Any, groups: int, y: float) -> None:
    """Add the row in a state and its target to eta and J, and to the groups of its sample.

    ``own`` are the fields of a state with ``recursion``, ``eta``, ``information``, ``contrasts``.
    """
    p, row = own.recursion.parameters, own.recursion.row
    for i in range(p):
        own.eta[i] += row[i] * y
        for j in range(p):
            own.information[i, j] += row[i] * row[j]
    for k in range(_GROUPS):
        if (groups >> k) & 1 == 0:
            continue
        group = own.contrasts.groups[k]
        for i in range(p):
            group.eta[i] += row[i] * y
            for j in range(i, p):
                group.information[i, j] += row[i] * row[j]


def widened(
    contrasts: Any, intervals: Float[np.ndarray, "p 2"], information: Float[np.ndarray, "q q"]
) -> Float[np.ndarray, "p 2"]:
    """Return 95 % intervals [SI], widened by the difference between the groups.

    ``information`` is J of all parameters that the groups are for, zero for those not estimated.
    """
    p = intervals.shape[0]
    if not np.all(np.isfinite(intervals)):
        return intervals
    values, half = np.mean(intervals, axis=1), 0.5 * np.diff(intervals, axis=1)[:, 0]
    J = information[:p, :p]
    scale = 1.0 / np.sqrt(np.diag(J))
    total = np.zeros(p)
    for group in contrasts.groups:
        own = symmetric(group["information"][:p, :p])
        rest = (J - own) * np.outer(scale, scale)
        if np.min(np.linalg.eigvalsh(rest)) <= _SINGULAR:
            continue
        vector = (J @ values - group["eta"][:p]) * scale
        difference = np.linalg.solve(rest, vector) * scale - values
        total += np.abs(difference)
    half = np.maximum(half, LEAST_WIDTH * total)
    return np.column_stack([values - half, values + half])


def intervals_in(own: Any) -> Float[np.ndarray, "p 2"]:
    """Return 95 % intervals from the fields of a state that `add_row` writes to [SI]."""
    values = own.recursion.values[: own.recursion.parameters]
    intervals = intervals_of(own.batches, values, own.information)
    return widened(own.contrasts, intervals, own.information)
