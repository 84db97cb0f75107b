"""The balance of work on line: kernels that take one sample at a time.

The same two filters as offline, one after the other:
`stickslip.estimation.energy.known_inertia.motion` says which way friction acts, and the filter here
whitens the balance, `LAG` samples late. Its rows go into the recursion.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.known_inertia.layout import (
    AXIS,
    BEGAN,
    CERTAINTIES,
    CHANNELS,
    COVARIANCE,
    DEPTH,
    DISTURBANCE,
    EARLIER_VELOCITY,
    FORCES,
    FREE,
    FRICTION,
    HEADING,
    INERTIA,
    KEPT_EFFORT,
    KEPT_STRETCH,
    LAG,
    NET,
    NOISE,
    REFRESH,
    RESIDUALS,
    RESPONSES,
    RING,
    ROWS,
    SEEN,
    SETTLED,
    SPREAD_OF_VELOCITY,
    TALLIED,
    TURNS,
    UNCERTAIN,
    WIDTH,
)
from stickslip.estimation.energy.known_inertia.motion import (
    compare,
    innovate,
    predict,
    refresh,
    smoothed_velocity,
    tally,
)
from stickslip.estimation.online.recursion import (
    COUNT,
    FORGETTING,
    LOAD_INERTIA,
    PARAMETERS,
    PER_DIRECTION,
    ROW,
    SAMPLING_TIME,
    STIFFNESS,
    STRIBECK,
    VALUES,
    stribeck_left,
    update,
)

__all__ = ["work_run", "work_step"]

CERTAIN = 5.0
"""Standard deviations of the smoothed velocity beyond which its sign is certain."""

_LARGER = 100.0
"""How many times what the samples show the variance of a load's first stretch is."""

_TRUST = 7e-4
"""Of friction's root mean square: no model is trusted beyond that."""


@compiled(inline=True)
def _friction_columns(
    s: Float[np.ndarray, " s"], mean: float, change: float, direction: float
) -> tuple[float, float, float, float, float, float, float, float]:
    """Return the regressors of the friction force, and their slopes (Eq. 2.1; Stribeck effect).

    ``change`` is that of the velocity over the sample, ``mean`` its mean.
    """
    T = s[SAMPLING_TIME]
    slope = change / T
    if s[PER_DIRECTION] > 0.0:
        if direction > 0.0:
            return mean, 0.0, 1.0, 0.0, slope, 0.0, 0.0, 0.0
        if direction < 0.0:
            return 0.0, mean, 0.0, -1.0, 0.0, slope, 0.0, 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if direction == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if s[STRIBECK] > 0.0:
        left = stribeck_left(s, mean)
        end, start = stribeck_left(s, mean + 0.5 * change), stribeck_left(s, mean - 0.5 * change)
        fall = direction * (end - start) / T
        return mean, direction * (1.0 - left), direction * left, 1.0, slope, -fall, fall, 0.0
    return mean, direction, 1.0, 0.0, slope, 0.0, 0.0, 0.0


@compiled(inline=True)
def _carried(s: Float[np.ndarray, " s"], i: int) -> tuple[float, float, float, float]:
    """Return row i of the transition times the covariance."""
    a = AXIS + 4 * i
    c = COVARIANCE
    return (
        s[a] * s[c] + s[a + 1] * s[c + 4] + s[a + 2] * s[c + 8] + s[a + 3] * s[c + 12],
        s[a] * s[c + 1] + s[a + 1] * s[c + 5] + s[a + 2] * s[c + 9] + s[a + 3] * s[c + 13],
        s[a] * s[c + 2] + s[a + 1] * s[c + 6] + s[a + 2] * s[c + 10] + s[a + 3] * s[c + 14],
        s[a] * s[c + 3] + s[a + 1] * s[c + 7] + s[a + 2] * s[c + 11] + s[a + 3] * s[c + 15],
    )


@compiled(inline=True)
def _propagate(s: Float[np.ndarray, " s"], u: float, unknown: float) -> None:
    """Let the second filter go on over a sample (its covariance; states follow apart)."""
    T = s[SAMPLING_TIME]
    M = (_carried(s, 0), _carried(s, 1), _carried(s, 2), _carried(s, 3))
    rough = 12.0 / (T * T)
    for i in range(4):
        for j in range(i, 4):
            total = unknown * (
                s[AXIS + 16 + i] * s[AXIS + 16 + j] + rough * s[AXIS + 20 + i] * s[AXIS + 20 + j]
            )
            for h in range(4):
                total += M[i][h] * s[AXIS + 4 * j + h]
            s[COVARIANCE + 4 * i + j] = total
            s[COVARIANCE + 4 * j + i] = total
    p = int(s[PARAMETERS])
    for j in range(p + 1):
        at = RESPONSES + 4 * j
        z0, z1, z2, z3 = s[at], s[at + 1], s[at + 2], s[at + 3]
        for i in range(4):
            row = AXIS + 4 * i
            s[at + i] = s[row] * z0 + s[row + 1] * z1 + s[row + 2] * z2 + s[row + 3] * z3
    for i in range(4):
        s[RESPONSES + i] += s[AXIS + 16 + i] * u


@compiled(inline=True)
def _regress(s: Float[np.ndarray, " s"], at: int, certain: bool) -> None:
    """Update the second filter with the sample at a place of the ring; its rows are regressed.

    Where the direction of friction is not certain, nothing is forgotten for it.
    """
    p = int(s[PARAMETERS])
    forgetting = s[FORGETTING] if certain else 1.0
    for c in range(CHANNELS):
        if s[SEEN + c] == 0.0:
            continue
        S = s[COVARIANCE + 5 * c] + s[NOISE + c]
        scale = 1.0 / np.sqrt(S)
        k0 = s[COVARIANCE + c] / S
        k1 = s[COVARIANCE + 4 + c] / S
        k2 = s[COVARIANCE + 8 + c] / S
        k3 = s[COVARIANCE + 12 + c] / S
        y = 0.0
        for j in range(p + 1):
            z = RESPONSES + 4 * j
            e = s[at + 1 + c] - s[z + c] if j == 0 else -s[z + c]
            if j == 0:
                y = e * scale
            else:
                s[ROW + j - 1] = -e * scale
            s[z] += k0 * e
            s[z + 1] += k1 * e
            s[z + 2] += k2 * e
            s[z + 3] += k3 * e
        K = (k0, k1, k2, k3)
        for i in range(4):
            for j in range(i, 4):
                value = s[COVARIANCE + 4 * i + j] - K[i] * K[j] * S
                s[COVARIANCE + 4 * i + j] = value
                s[COVARIANCE + 4 * j + i] = value
        error = update(s, y, forgetting, False)
        if certain:
            s[RESIDUALS] += error
            s[ROWS] += 1.0


@compiled(inline=True)
def _load_unseen(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether there is a load that is not measured."""
    return s[STIFFNESS] > 0.0 and s[SEEN + 2] == 0.0


@compiled(inline=True)
def _balance(s: Float[np.ndarray, " s"], first: int, velocity: float) -> None:
    """Take the sample that ends at the oldest one in the ring into the estimate.

    What lies before the oldest one is not in the ring any more: its effort, the stretch of the
    spring and its smoothed velocity were kept.
    """
    T, m = s[SAMPLING_TIME], s[INERTIA]
    at = RING + WIDTH * first
    u0, d0, v0 = s[KEPT_EFFORT], s[KEPT_STRETCH], s[EARLIER_VELOCITY]
    d = s[at + 1] - s[at + 3]
    spread = CERTAIN * s[SPREAD_OF_VELOCITY]
    direction = 0.0
    settled = s[COUNT] > s[BEGAN] + s[SETTLED]
    if settled and v0 * velocity > 0.0 and min(abs(v0), abs(velocity)) > spread:
        direction = 1.0 if velocity > 0.0 else -1.0
        if direction * s[HEADING] < 0.0:
            s[TURNS] += 1.0
        s[HEADING] = direction
        friction = u0 - 0.5 * s[STIFFNESS] * (d0 + d) - m * (velocity - v0) / T
        s[FORCES] += friction * friction
        s[CERTAINTIES] += 1.0
    # Mean velocity of a cubic motion: the known forces say how the acceleration changes
    c = min(max(s[VALUES], 0.0), 0.5 * m / T)
    change = -(s[STIFFNESS] * (d - d0) + c * (velocity - v0)) / m
    mean = 0.5 * (v0 + velocity) - T * change / 12.0
    columns = _friction_columns(s, mean, velocity - v0, direction)
    unknown = max(s[DISTURBANCE] * s[DISTURBANCE], _TRUST * _TRUST * s[FRICTION])
    if direction == 0.0:
        crossing = spread * m / (np.sqrt(s[FRICTION]) * T)
        s[UNCERTAIN] += 1.0
        if _load_unseen(s):
            # What holds a mass that sticks is as large as the spring's force, one sample as another
            crossing = max(crossing, s[UNCERTAIN])
        unknown += s[FRICTION] * max(crossing, 1.0)
    else:
        s[UNCERTAIN] = 0.0
    _propagate(s, u0, unknown)
    for j in range(int(s[PARAMETERS])):
        z = RESPONSES + 4 * (j + 1)
        for i in range(4):
            s[z + i] -= s[AXIS + 16 + i] * columns[j] + s[AXIS + 20 + i] * columns[4 + j]
    _regress(s, at, direction != 0.0)


@compiled(inline=True)
def _begin(s: Float[np.ndarray, " s"], oldest: int, last: int, velocity: float) -> None:
    """Begin the second filter with the oldest sample in the ring.

    A load that is not measured begins anywhere, as fast as it likes.
    """
    T = s[SAMPLING_TIME]
    for c in range(CHANNELS):
        s[RESPONSES + c] = s[oldest + 1 + c]
        s[COVARIANCE + 5 * c] = s[NOISE + c] if s[SEEN + c] > 0.0 else 0.0
        if s[SEEN + c] == 0.0 and (c == 1 or (c == 3 and s[SEEN + 2] > 0.0)):
            s[RESPONSES + c] = 0.0
            over = (s[last + c] - s[oldest + c]) / (LAG * T)
            s[COVARIANCE + 5 * c] = (
                over * over + velocity * velocity + (CERTAIN * s[SPREAD_OF_VELOCITY]) ** 2
            )
    if _load_unseen(s):
        way = s[last + 1] - s[oldest + 1]
        stretch = (s[NET] + s[FREE + 2] * s[FREE + 2]) / s[STIFFNESS] ** 2 + way * way
        s[RESPONSES + 3] = 0.0
        s[COVARIANCE + 10] = _LARGER * stretch
        swing = s[STIFFNESS] / s[LOAD_INERTIA] * stretch
        s[COVARIANCE + 15] = _LARGER * (swing + (way / (LAG * T)) ** 2)


@compiled(inline=True)
def _told(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether anything has pushed, and every sensor shown something of its noise."""
    told = s[NET] > 0.0
    for c in range(CHANNELS):
        told = told and (s[SEEN + c] == 0.0 or s[TALLIED + c] > 0.0)
    return told


@compiled(inline=True)
def _advance(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample into the state, in place."""
    n = int(s[COUNT])
    slot = n % DEPTH
    at = RING + WIDTH * slot
    if _load_unseen(s):
        x2, v2 = x, v  # the first filter has the spring's force in the free one
    s[at], s[at + 1], s[at + 2], s[at + 3], s[at + 4] = u, x, v, x2, v2
    for c in range(CHANNELS):
        if s[SEEN + c] > 0.0:
            tally(s, s[at + 1 + c], c)
    net = u - s[STIFFNESS] * (x - x2)
    s[NET] = max(s[NET], net * net)
    if n > 0:
        compare(s, RING + WIDTH * ((n - 1) % DEPTH), at)
    s[COUNT] += 1.0
    begins = s[REFRESH] == 0.0
    if n < LAG or (begins and not _told(s)):
        return
    first = (n + 1) % DEPTH
    oldest = RING + WIDTH * first
    if begins:
        refresh(s)
        s[REFRESH] = 2.0 * s[TALLIED]
        s[BEGAN] = s[COUNT]
        s[FREE] = s[oldest + 1]
        s[FREE + 1] = s[oldest + 2]
        innovate(s, oldest)
        for k in range(LAG):
            to = RING + WIDTH * ((first + k + 1) % DEPTH)
            predict(s, RING + WIDTH * ((first + k) % DEPTH), to)
            innovate(s, to)
    else:
        predict(s, RING + WIDTH * ((n - 1) % DEPTH), at)
        innovate(s, at)
    velocity = smoothed_velocity(s, first)
    if begins:
        _begin(s, oldest, at, velocity)
    else:
        _balance(s, first, velocity)
    s[KEPT_EFFORT] = s[oldest]
    s[KEPT_STRETCH] = s[oldest + 1] - s[oldest + 3]
    s[EARLIER_VELOCITY] = velocity
    if s[TALLIED] >= s[REFRESH]:
        refresh(s)
        s[REFRESH] *= 2.0


@compiled(brief=True)
def work_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite.

    One that is not is not taken.
    """
    finite = (
        np.isfinite(u) and np.isfinite(x) and np.isfinite(v) and np.isfinite(x2) and np.isfinite(v2)
    )
    if finite:
        _advance(s, u, x, v, x2, v2)
    return finite


@compiled()
def work_run(
    state: Float[np.ndarray, " s"], samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, " s"], Float[np.ndarray, "n p"]]:
    """Return the state after many samples, and the estimates after each."""
    s = state.copy()
    n, p = samples.shape[0], int(s[PARAMETERS])
    history = np.empty((n, p))
    for k in range(n):
        _advance(s, samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4])
        for j in range(p):
            history[k, j] = s[VALUES + j]
    return s, history
