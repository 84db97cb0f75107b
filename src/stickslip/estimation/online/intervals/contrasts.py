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

All memory is a part of the estimator's state, which begins at an offset ``at``: the smoothed
velocity and acceleration, their largest sizes, and for either group eta and the upper triangle of J
row by row.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.intervals.batches import LEAST_WIDTH, intervals_of
from stickslip.estimation.online.recursion import PARAMETERS, ROW, VALUES

EVERYWHERE, SLOW, ACCELERATED = 0, 1, 2
"""Groups of a sample; one that is slow and accelerated has the sum of both."""

_GROUPS = 2
_SLOW_SHARE = 0.25
"""Speed below which a sample is slow, over the largest so far: a Stribeck velocity is some 1 % to
10 % of it."""
_RAMP_SHARE = 0.1  # acceleration from which a sample is accelerated, over the largest so far
_SMOOTHING = 0.1  # weight of a sample in the smoothed velocity, whose change is the acceleration
_FADING = 1.0 / 65536.0  # relative decay of the largest speed and acceleration in a sample
_SINGULAR = 1e-9  # least eigenvalue of information with a unit diagonal

_VELOCITY, _STARTED, _TOP_SPEED, _TOP_CHANGE, _RECORDS = range(5)


def contrast_size(p: int) -> int:
    """Return the room that the groups of p parameters take in a state."""
    return _RECORDS + _GROUPS * (p + p * (p + 1) // 2)


@compiled(inline=True)
def classify(s: Float[np.ndarray, " s"], at: int, velocity: float) -> int:
    """Return the groups of a sample in motion."""
    if s[at + _STARTED] == 0.0:
        s[at + _STARTED] = 1.0
        s[at + _VELOCITY] = velocity
    change = _SMOOTHING * (velocity - s[at + _VELOCITY])
    s[at + _VELOCITY] += change
    keep = 1.0 - _FADING
    s[at + _TOP_SPEED] = max(keep * s[at + _TOP_SPEED], abs(s[at + _VELOCITY]))
    s[at + _TOP_CHANGE] = max(keep * s[at + _TOP_CHANGE], abs(change))
    groups = EVERYWHERE
    if abs(velocity) < _SLOW_SHARE * s[at + _TOP_SPEED]:
        groups += SLOW
    if abs(change) > _RAMP_SHARE * s[at + _TOP_CHANGE]:
        groups += ACCELERATED
    return groups


@compiled(inline=True)
def add_information(
    s: Float[np.ndarray, " s"],
    at: int,
    p: int,
    groups: int,
    information: Float[np.ndarray, "p p"],
    vector: Float[np.ndarray, " p"],
) -> None:
    """Add J and eta of a sample to its groups."""
    size = p + p * (p + 1) // 2
    for k in range(_GROUPS):
        if (groups >> k) & 1 == 0:
            continue
        place = at + _RECORDS + k * size
        for i in range(p):
            s[place + i] += vector[i]
        place += p
        for i in range(p):
            for j in range(i, p):
                s[place] += information[i, j]
                place += 1


@compiled(inline=True)
def add_row(
    s: Float[np.ndarray, " s"], information: int, at: int, most: int, groups: int, y: float
) -> None:
    """Add the row in a state and its target to eta and J, and to the groups of its sample.

    ``information`` is the place of eta, and of J behind it, whole; ``most`` is the number of
    parameters that there is room for.
    """
    p = int(s[PARAMETERS])
    for i in range(p):
        s[information + i] += s[ROW + i] * y
        for j in range(p):
            s[information + most + i * most + j] += s[ROW + i] * s[ROW + j]
    size = most + most * (most + 1) // 2
    for k in range(_GROUPS):
        if (groups >> k) & 1 == 0:
            continue
        place = at + _RECORDS + k * size
        for i in range(p):
            s[place + i] += s[ROW + i] * y
        place += most
        for i in range(p):
            for j in range(i, p):
                s[place + j - i] += s[ROW + i] * s[ROW + j]
            place += most - i


@compiled(inline=True)
def scale_contrasts(s: Float[np.ndarray, " s"], at: int, p: int, factor: float) -> None:
    """Multiply all information by a factor, after a change of the estimated noise."""
    for i in range(_GROUPS * (p + p * (p + 1) // 2)):
        s[at + _RECORDS + i] *= factor


def widened(
    state: Float[np.ndarray, " s"],
    at: int,
    intervals: Float[np.ndarray, "p 2"],
    information: Float[np.ndarray, "q q"],
) -> Float[np.ndarray, "p 2"]:
    """Return 95 % intervals [SI], widened by the difference between the groups.

    ``information`` is J of all parameters that the groups are for, zero for those not estimated.
    """
    p, q = intervals.shape[0], information.shape[0]
    if not np.all(np.isfinite(intervals)):
        return intervals
    values, half = np.mean(intervals, axis=1), 0.5 * np.diff(intervals, axis=1)[:, 0]
    size = q + q * (q + 1) // 2
    J = information[:p, :p]
    scale = 1.0 / np.sqrt(np.diag(J))
    upper = np.triu_indices(q)
    total = np.zeros(p)
    for k in range(_GROUPS):
        record = state[at + _RECORDS + k * size : at + _RECORDS + (k + 1) * size]
        own = np.zeros((q, q))
        own[upper] = record[q:]
        own = own + np.triu(own, 1).T
        rest = (J - own[:p, :p]) * np.outer(scale, scale)
        if np.min(np.linalg.eigvalsh(rest)) <= _SINGULAR:
            continue
        vector = (J @ values - record[:p]) * scale
        difference = np.linalg.solve(rest, vector) * scale - values
        total += np.abs(difference)
    half = np.maximum(half, LEAST_WIDTH * total)
    return np.column_stack([values - half, values + half])


def intervals_in(
    state: Float[np.ndarray, " s"], *, information: int, batches: int, contrasts: int, most: int
) -> Float[np.ndarray, "p 2"]:
    """Return 95 % intervals from the state of a recursion that calls `add_row` [SI].

    The other arguments are where eta and J, the batches and the groups begin, and the number of
    parameters that there is room for.
    """
    start = information + most
    J = state[start : start + most**2].reshape(most, most)
    values = state[VALUES : VALUES + int(state[PARAMETERS])]
    return widened(state, contrasts, intervals_of(state, batches, values, J), J)
