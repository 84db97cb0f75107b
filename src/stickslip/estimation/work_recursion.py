"""The balance of work on line: kernels that take one sample at a time.

The same two filters as offline, one after the other. The first knows nothing of any friction law;
what it says of a velocity is improved by the innovations of the next `LAG` samples, so that the
direction of friction is decided from many samples, and not from the one that the estimate is made
of. The second whitens the balance, `LAG` samples late, and its rows go into the recursion.

The state is that of `stickslip.estimation.recursion`, with room for four parameters, and behind it
what the filters need. What lies where is given by the constants below.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.recursion import (
    COUNT,
    FORGETTING,
    LOAD_INERTIA,
    PARAMETERS,
    PER_DIRECTION,
    ROW,
    SAMPLING_TIME,
    STIFFNESS,
    VALUES,
    update,
)

__all__ = [
    "AXIS",
    "DISTURBANCE",
    "GUESS",
    "GUESSED",
    "INERTIA",
    "LAG",
    "REFRESH",
    "RESIDUALS",
    "ROWS",
    "SEEN",
    "STATE_SIZE",
    "work_run",
    "work_step",
]

LAG = 64
"""Samples by which the estimate is late: what a velocity gains from later ones is seen by then."""

CERTAIN = 5.0
"""Standard deviations of the smoothed velocity beyond which its sign is certain."""

_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise
_ROUNDING = 1e-14  # of the mean square: noise that a signal without any is taken to have
_LEAST_VARIANCE = 1e-300  # of a signal that is zero throughout
_ITERATIONS = 500  # of the filter's covariance until it is steady
_STEADY = 1e-6  # relative
_DEPTH = LAG + 1  # samples remembered
_CHANNELS = 4  # position and velocity of the driven mass, then of the load

(
    INERTIA,
    DISTURBANCE,  # standard deviation of a disturbing force
    REFRESH,  # number of samples at which the noise is next taken anew
    EARLIER_VELOCITY,  # of the sample before the one that is being whitened
    TURNS,  # reversals so far
    HEADING,  # direction of the last certain motion
    FORCES,  # sum of squared friction, as the first filter sees it
    FORCE_SPREAD,  # its variance there
    NET,  # sum of squared effort less spring force
    FRICTION,  # mean square of the friction
    SPREAD_OF_VELOCITY,  # standard deviation of the smoothed velocity
    RESIDUALS,  # sum of squared prediction errors over their variances
    ROWS,  # number of them
    KEPT_EFFORT,  # of the sample that has just left the ring
    KEPT_STRETCH,  # and of its spring
    SEEN,  # which channels are measured
) = range(VALUES + 4, VALUES + 4 + 16)
NOISE = SEEN + _CHANNELS  # variances
GUESS = NOISE + _CHANNELS  # guessed variances
GUESSED = GUESS + _CHANNELS  # samples that the guess counts for
ROUGHNESS = GUESSED + _CHANNELS  # sums of squared third differences
SQUARES = ROUGHNESS + _CHANNELS  # sums of squares
DIFFERENCES = SQUARES + _CHANNELS  # last value, first and second difference
DISAGREEMENT = DIFFERENCES + 3 * _CHANNELS  # of each mass, see `_compare`
FREE = DISAGREEMENT + 3 * 2  # position, velocity and friction predicted
GAINS = FREE + 3  # of the first filter: position, then velocity
TAPS = GAINS + 6  # of the innovations of position and velocity
AXIS = TAPS + 2 * _DEPTH  # transition (4 x 4), held and ramped response
COVARIANCE = AXIS + 24  # of the second filter
RESPONSES = COVARIANCE + 16  # its states, for the measurements and each regressor
RING = RESPONSES + 4 * 5
_WIDTH = 8  # effort, four channels, predicted velocity, two innovations
STATE_SIZE = RING + _WIDTH * _DEPTH


@compiled(inline=True)
def _tally(s: Float[np.ndarray, " s"], value: float, channel: int) -> None:
    """Add a measurement to what is known of its sensor's noise, by third differences."""
    at = DIFFERENCES + 3 * channel
    first = value - s[at]
    second = first - s[at + 1]
    third = second - s[at + 2]
    s[at], s[at + 1], s[at + 2] = value, first, second
    s[SQUARES + channel] += value * value
    if s[COUNT] >= 3.0:
        s[ROUGHNESS + channel] += third * third


@compiled(inline=True)
def _compare(s: Float[np.ndarray, " s"], before: int, at: int) -> None:
    """Add up how positions and velocities of neighbouring samples disagree, for each mass.

    Under a held force dx / T is the mean of the velocities but for T / 12 times the change of the
    acceleration, most of which the spring makes. The difference d of both bounds the noise of
    each: var(d - d_-) = 6 sigma_x^2 / T^2 + sigma_v^2 / 2 and
    var(d + d_-) = 2 sigma_x^2 / T^2 + 3/2 sigma_v^2.
    """
    T = s[SAMPLING_TIME]
    stretching = s[at + 1] - s[at + 3] - s[before + 1] + s[before + 3]
    for mass in range(2):
        x, place = 1 + 2 * mass, DISAGREEMENT + 3 * mass
        if s[SEEN + 2 * mass + 1] == 0.0:
            continue
        bent = T / 12.0 * s[STIFFNESS] * stretching
        bent /= s[INERTIA] if mass == 0 else -s[LOAD_INERTIA]
        mean = 0.5 * (s[at + x + 1] + s[before + x + 1]) + bent
        d = (s[at + x] - s[before + x]) / T - mean
        if s[COUNT] >= 2.0:
            s[place + 1] += (d - s[place]) ** 2
            s[place + 2] += (d + s[place]) ** 2
        s[place] = d


@compiled()
def _refresh(s: Float[np.ndarray, " s"]) -> None:
    """Take noise and friction as known by now, and make the first filter steady for them."""
    n, T, m = s[COUNT], s[SAMPLING_TIME], s[INERTIA]
    for c in range(_CHANNELS):
        seen = s[ROUGHNESS + c] / _THIRD_DIFFERENCE + s[GUESSED + c] * s[GUESS + c]
        floor = _ROUNDING * s[SQUARES + c] / n
        least = seen / (n - 3.0 + s[GUESSED + c])
        place = DISAGREEMENT + 3 * (c // 2)
        if s[SEEN + c] > 0.0 and s[SEEN + 1 + 2 * (c // 2)] > 0.0:
            most = s[place + 2] / 1.5 if c % 2 == 1 else s[place + 1] * T * T / 6.0
            least = min(least, most / (n - 2.0))
        s[NOISE + c] = max(least, floor, _LEAST_VARIANCE)
    net = s[NET] / n
    seen = s[FORCES] / n - s[FORCE_SPREAD]
    s[FRICTION] = net if s[FORCES] == 0.0 else max(min(seen, net), 1e-3 * net)
    # Friction turns from one side to the other at every reversal, and is a random walk here
    rate = 4.0 * s[FRICTION] * (s[TURNS] + 1.0) / (n * T)
    a, b = 0.5 * T * T / m, T / m
    Q = np.empty((3, 3))
    Q[0, 0], Q[0, 1], Q[0, 2] = T**5 / (20 * m * m), T**4 / (8 * m * m), -(T**3) / (6 * m)
    Q[1, 1], Q[1, 2], Q[2, 2] = T**3 / (3 * m * m), -(T**2) / (2 * m), T
    Q[1, 0], Q[2, 0], Q[2, 1] = Q[0, 1], Q[0, 2], Q[1, 2]
    P, M = np.zeros((3, 3)), np.zeros((3, 3))
    P[0, 0], P[1, 1], P[2, 2] = s[NOISE], s[NOISE + 1], net
    K = np.zeros((2, 3))
    S = np.ones(2)
    for _ in range(_ITERATIONS):
        before = P[1, 1]
        for i in range(3):
            for j in range(3):
                M[i, j] = P[i, j]
        for i in range(2):
            for j in range(3):
                K[i, j] = 0.0
            S[i] = 1.0
            if s[SEEN + i] > 0.0:
                S[i] = M[i, i] + s[NOISE + i]
                for j in range(3):
                    K[i, j] = M[j, i] / S[i]
                for j in range(3):
                    for h in range(3):
                        M[j, h] -= K[i, j] * K[i, h] * S[i]
        s[FORCE_SPREAD] = M[2, 2]
        for j in range(3):
            M[0, j] += T * M[1, j] - a * M[2, j]
            M[1, j] -= b * M[2, j]
        for i in range(3):
            P[i, 0] = M[i, 0] + T * M[i, 1] - a * M[i, 2] + rate * Q[i, 0]
            P[i, 1] = M[i, 1] - b * M[i, 2] + rate * Q[i, 1]
            P[i, 2] = M[i, 2] + rate * Q[i, 2]
        for i in range(3):
            for j in range(i):
                P[i, j] = 0.5 * (P[i, j] + P[j, i])
                P[j, i] = P[i, j]
        if abs(P[1, 1] - before) <= _STEADY * before:
            break
    for i in range(2):
        for j in range(3):
            s[GAINS + 3 * i + j] = K[i, j]
    # What the innovation of j samples later tells of a velocity: its row of P through the filter
    r0, r1, r2 = P[1, 0], P[1, 1], P[1, 2]
    spread = P[1, 1]
    for j in range(_DEPTH):
        c0 = r0 / S[0] if s[SEEN] > 0.0 else 0.0
        e = r0
        r0, r1, r2 = r0 - K[0, 0] * e, r1 - K[0, 1] * e, r2 - K[0, 2] * e
        c1 = r1 / S[1] if s[SEEN + 1] > 0.0 else 0.0
        e = r1
        r0, r1, r2 = r0 - K[1, 0] * e, r1 - K[1, 1] * e, r2 - K[1, 2] * e
        s[TAPS + 2 * j], s[TAPS + 2 * j + 1] = c0, c1
        spread -= c0 * c0 * S[0] + c1 * c1 * S[1]
        r0, r1 = r0 + T * r1 - a * r2, r1 - b * r2
    s[SPREAD_OF_VELOCITY] = np.sqrt(max(spread, 0.0))


@compiled(inline=True)
def _innovate(s: Float[np.ndarray, " s"], at: int) -> None:
    """Update the first filter with the sample at a place of the ring, and note what was new."""
    z0, z1, z2 = s[FREE], s[FREE + 1], s[FREE + 2]
    e0 = s[at + 1] - z0
    s[at + 5] = z1
    z0 += s[GAINS] * e0
    z1 += s[GAINS + 1] * e0
    z2 += s[GAINS + 2] * e0
    e1 = s[at + 2] - z1 if s[SEEN + 1] > 0.0 else 0.0
    z0 += s[GAINS + 3] * e1
    z1 += s[GAINS + 4] * e1
    z2 += s[GAINS + 5] * e1
    s[at + 6], s[at + 7] = e0, e1
    s[FREE], s[FREE + 1], s[FREE + 2] = z0, z1, z2
    s[FORCES] += z2 * z2


@compiled(inline=True)
def _predict(s: Float[np.ndarray, " s"], at: int, to: int) -> None:
    """Let the first filter go on from one sample of the ring to the next."""
    T, m = s[SAMPLING_TIME], s[INERTIA]
    spring = 0.5 * s[STIFFNESS] * (s[at + 1] - s[at + 3] + s[to + 1] - s[to + 3])
    w = (s[at] - spring - s[FREE + 2]) / m
    s[FREE] += T * s[FREE + 1] + 0.5 * T * T * w
    s[FREE + 1] += T * w


@compiled(inline=True)
def _smoothed_velocity(s: Float[np.ndarray, " s"], first: int) -> float:
    """Return the velocity of the oldest sample in the ring, by all innovations since."""
    total, other = s[RING + _WIDTH * first + 5], 0.0
    tap = TAPS
    for j in range(first, _DEPTH):
        at = RING + _WIDTH * j
        total += s[tap] * s[at + 6]
        other += s[tap + 1] * s[at + 7]
        tap += 2
    for j in range(first):
        at = RING + _WIDTH * j
        total += s[tap] * s[at + 6]
        other += s[tap + 1] * s[at + 7]
        tap += 2
    return total + other


@compiled(inline=True)
def _friction_columns(
    s: Float[np.ndarray, " s"], mean: float, slope: float, direction: float
) -> tuple[float, float, float, float, float, float]:
    """Return the regressors of the friction force, and the slopes of the viscous ones (Eq. 2.1)."""
    if s[PER_DIRECTION] > 0.0:
        if direction > 0.0:
            return mean, 0.0, 1.0, 0.0, slope, 0.0
        if direction < 0.0:
            return 0.0, mean, 0.0, -1.0, 0.0, slope
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if direction == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    return mean, direction, 1.0, 0.0, slope, 0.0


@compiled(inline=True)
def _propagate(s: Float[np.ndarray, " s"], u: float, unknown: float) -> None:
    """Let the second filter go on over a sample (its covariance; states follow apart)."""
    T = s[SAMPLING_TIME]
    M = np.empty(16)
    for i in range(4):
        for j in range(4):
            total = 0.0
            for h in range(4):
                total += s[AXIS + 4 * i + h] * s[COVARIANCE + 4 * h + j]
            M[4 * i + j] = total
    rough = 12.0 / (T * T)
    for i in range(4):
        for j in range(i, 4):
            total = unknown * (
                s[AXIS + 16 + i] * s[AXIS + 16 + j] + rough * s[AXIS + 20 + i] * s[AXIS + 20 + j]
            )
            for h in range(4):
                total += M[4 * i + h] * s[AXIS + 4 * j + h]
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
    for c in range(_CHANNELS):
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
def _balance(s: Float[np.ndarray, " s"], first: int, velocity: float) -> None:
    """Take the sample that ends at the oldest one in the ring into the estimate.

    What lies before the oldest one is not in the ring any more: its effort, the stretch of the
    spring and its smoothed velocity were kept.
    """
    T, m = s[SAMPLING_TIME], s[INERTIA]
    at = RING + _WIDTH * first
    u0, d0, v0 = s[KEPT_EFFORT], s[KEPT_STRETCH], s[EARLIER_VELOCITY]
    spread = CERTAIN * s[SPREAD_OF_VELOCITY]
    direction = 0.0
    if v0 * velocity > 0.0 and min(abs(v0), abs(velocity)) > spread:
        direction = 1.0 if velocity > 0.0 else -1.0
        if direction * s[HEADING] < 0.0:
            s[TURNS] += 1.0
        s[HEADING] = direction
    # Mean velocity of a cubic motion: the known forces say how the acceleration changes
    d = s[at + 1] - s[at + 3]
    c = min(max(s[VALUES], 0.0), 0.5 * m / T)
    change = -(s[STIFFNESS] * (d - d0) + c * (velocity - v0)) / m
    mean = 0.5 * (v0 + velocity) - T * change / 12.0
    columns = _friction_columns(s, mean, (velocity - v0) / T, direction)
    unknown = s[DISTURBANCE] * s[DISTURBANCE]
    if direction == 0.0:
        crossing = spread * m / (np.sqrt(s[FRICTION]) * T)
        unknown += s[FRICTION] * max(crossing, 1.0)
    _propagate(s, u0, unknown)
    per_direction = s[PER_DIRECTION] > 0.0
    for j in range(int(s[PARAMETERS])):
        z = RESPONSES + 4 * (j + 1)
        slope = 0.0
        if j == 0:
            slope = columns[4]
        elif j == 1 and per_direction:
            slope = columns[5]
        for i in range(4):
            s[z + i] -= s[AXIS + 16 + i] * columns[j] + s[AXIS + 20 + i] * slope
    _regress(s, at, direction != 0.0)


@compiled(inline=True)
def _begin(s: Float[np.ndarray, " s"], velocity: float) -> None:
    """Begin the second filter with the oldest sample, which is the first."""
    T = s[SAMPLING_TIME]
    last = RING + _WIDTH * LAG
    for c in range(_CHANNELS):
        s[RESPONSES + c] = s[RING + 1 + c]
        s[COVARIANCE + 5 * c] = s[NOISE + c]
        if s[SEEN + c] == 0.0 and (c == 1 or (c == 3 and s[SEEN + 2] > 0.0)):
            s[RESPONSES + c] = 0.0
            over = (s[last + c] - s[RING + c]) / (LAG * T)
            s[COVARIANCE + 5 * c] = (
                over * over + velocity * velocity + (CERTAIN * s[SPREAD_OF_VELOCITY]) ** 2
            )


@compiled(inline=True)
def _advance(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample into the state, in place."""
    n = int(s[COUNT])
    slot = n % _DEPTH
    at = RING + _WIDTH * slot
    s[at], s[at + 1], s[at + 2], s[at + 3], s[at + 4] = u, x, v, x2, v2
    for c in range(_CHANNELS):
        if s[SEEN + c] > 0.0:
            _tally(s, s[at + 1 + c], c)
    if n > 0:
        _compare(s, RING + _WIDTH * ((n - 1) % _DEPTH), at)
    net = u - s[STIFFNESS] * (x - x2)
    s[NET] += net * net
    s[COUNT] += 1.0
    if n < LAG:
        return
    if n == LAG:
        _refresh(s)
        s[REFRESH] = 2.0 * LAG
        s[FREE] = s[RING + 1]
        s[FREE + 1] = s[RING + 2]
        _innovate(s, RING)
        for k in range(LAG):
            _predict(s, RING + _WIDTH * k, RING + _WIDTH * (k + 1))
            _innovate(s, RING + _WIDTH * (k + 1))
    else:
        _predict(s, RING + _WIDTH * ((n - 1) % _DEPTH), at)
        _innovate(s, at)
    first = (n + 1) % _DEPTH
    velocity = _smoothed_velocity(s, first)
    if n == LAG:
        _begin(s, velocity)
    else:
        _balance(s, first, velocity)
    oldest = RING + _WIDTH * first
    s[KEPT_EFFORT] = s[oldest]
    s[KEPT_STRETCH] = s[oldest + 1] - s[oldest + 3]
    s[EARLIER_VELOCITY] = velocity
    if s[COUNT] >= s[REFRESH]:
        _refresh(s)
        s[REFRESH] *= 2.0


@compiled()
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
