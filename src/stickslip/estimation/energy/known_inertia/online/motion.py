"""The motion on line with friction as a free force: kernels of the first of two filters.

It assumes no friction law. The innovations of the next `LAG` samples improve its velocity, so that
the direction of friction is decided from many samples, and not from the one that an estimate is
made of.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.known_inertia.online.layout import (
    CERTAINTIES,
    CHAIN,
    CHANNELS,
    DEPTH,
    DIFFERENCES,
    DISAGREEMENT,
    FORCES,
    FREE,
    FRICTION,
    GAINS,
    GUESS,
    GUESSED,
    INERTIA,
    LAG,
    NET,
    NOISE,
    RING,
    ROUGHNESS,
    SEEN,
    SETTLED,
    SPREAD_OF_VELOCITY,
    SQUARES,
    TALLIED,
    TAPS,
    TURNS,
    WIDTH,
)
from stickslip.estimation.online.recursion import COUNT, LOAD_INERTIA, SAMPLING_TIME, STIFFNESS
from stickslip.numerics.kalman import measure

__all__ = ["compare", "innovate", "predict", "refresh", "smoothed_velocity", "tally"]

_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise
_ROUNDING = 1e-14  # of the mean square: noise that a signal without any is taken to have
_LEAST_VARIANCE = 1e-300  # of a signal that is zero throughout
_ITERATIONS = 500  # of the filter's covariance until it is steady
_CONVERGED = 1e-6  # relative
_DEAD = 0.03  # of a velocity's variance: the rest that later innovations do not reduce
_FASTER = 20  # times that the walk is made faster, fourfold each
_LEAST_SHARE = 1e-3  # of the mean square of the net force that friction is taken to have


@compiled(inline=True)
def tally(s: Float[np.ndarray, " s"], value: float, channel: int) -> None:
    """Add a measurement to what is known of its sensor's noise, by third differences.

    While an encoder does not count, its noise is not visible.
    """
    at = DIFFERENCES + 3 * channel
    first = value - s[at]
    second = first - s[at + 1]
    third = second - s[at + 2]
    s[at], s[at + 1], s[at + 2] = value, first, second
    s[SQUARES + channel] += value * value
    if s[CHAIN + channel] >= 3.0 and third != 0.0:
        s[ROUGHNESS + channel] += third * third
        s[TALLIED + channel] += 1.0
    s[CHAIN + channel] += 1.0


@compiled(inline=True)
def compare(s: Float[np.ndarray, " s"], before: int, at: int) -> None:
    """Add up how positions and velocities of neighbouring samples disagree, for each mass.

    Under a held force dx / T is the mean of the velocities but for T / 12 times the change of the
    acceleration, most of which the spring makes. The difference d of both bounds the noise of
    each: var(d - d_-) = 6 sigma_x^2 / T^2 + sigma_v^2 / 2 and
    var(d + d_-) = 2 sigma_x^2 / T^2 + 3/2 sigma_v^2.
    """
    T = s[SAMPLING_TIME]
    stretching = s[at + 1] - s[at + 3] - s[before + 1] + s[before + 3]
    for mass in range(2):
        x, place = 1 + 2 * mass, DISAGREEMENT + 4 * mass
        chain = min(s[CHAIN + 2 * mass], s[CHAIN + 2 * mass + 1])
        if s[SEEN + 2 * mass + 1] == 0.0 or chain < 2.0:
            continue
        bent = T / 12.0 * s[STIFFNESS] * stretching
        bent /= s[INERTIA] if mass == 0 else -s[LOAD_INERTIA]
        mean = 0.5 * (s[at + x + 1] + s[before + x + 1]) + bent
        d = (s[at + x] - s[before + x]) / T - mean
        counting = s[at + x] != s[before + x] or s[at + x + 1] != s[before + x + 1]
        if chain >= 3.0 and counting:
            s[place + 1] += (d - s[place]) ** 2
            s[place + 2] += (d + s[place]) ** 2
            s[place + 3] += 1.0
        s[place] = d


@compiled(inline=True)
def _take_noise(s: Float[np.ndarray, " s"]) -> None:
    """Take the noise of the sensors as known by now: never more than signals disagree by."""
    n, T = s[COUNT], s[SAMPLING_TIME]
    for c in range(CHANNELS):
        seen = s[ROUGHNESS + c] / _THIRD_DIFFERENCE + s[GUESSED + c] * s[GUESS + c]
        variance = seen / max(s[TALLIED + c] + s[GUESSED + c], 1.0)
        mass = c // 2
        place = DISAGREEMENT + 4 * mass
        if s[SEEN + 2 * mass + 1] > 0.0 and s[place + 3] > 0.0:
            most = s[place + 1] * T * T / 6.0 if c % 2 == 0 else s[place + 2] / 1.5
            variance = min(variance, most / s[place + 3])
        floor = _ROUNDING * s[SQUARES + c] / n
        s[NOISE + c] = max(variance, floor, _LEAST_VARIANCE)


@compiled(inline=True)
def _steady(
    s: Float[np.ndarray, " s"], rate: float, net: float, P: Float[np.ndarray, "3 3"]
) -> tuple[float, float]:
    """Iterate the first filter's covariance until it is steady; lay its gains in the state.

    P becomes the covariance of the prediction. Returns the variances of the two innovations.
    """
    T, m = s[SAMPLING_TIME], s[INERTIA]
    a, b = 0.5 * T * T / m, T / m
    Q = np.empty((3, 3))
    Q[0, 0], Q[0, 1], Q[0, 2] = T**5 / (20 * m * m), T**4 / (8 * m * m), -(T**3) / (6 * m)
    Q[1, 1], Q[1, 2], Q[2, 2] = T**3 / (3 * m * m), -(T**2) / (2 * m), T
    Q[1, 0], Q[2, 0], Q[2, 1] = Q[0, 1], Q[0, 2], Q[1, 2]
    for i in range(3):
        for j in range(3):
            P[i, j] = 0.0
    P[0, 0], P[1, 1], P[2, 2] = s[NOISE], s[NOISE + 1], net
    M, S = np.empty((3, 3)), np.ones(2)
    for _ in range(_ITERATIONS):
        before = P[1, 1]
        for i in range(3):
            for j in range(3):
                M[i, j] = P[i, j]
        for i in range(2):
            gain = s[GAINS + 3 * i : GAINS + 3 * i + 3]
            gain[:] = 0.0
            if s[SEEN + i] > 0.0:
                S[i] = measure(i, s[NOISE + i], M, gain, 3)
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
        if abs(P[1, 1] - before) <= _CONVERGED * before:
            break
    return S[0], S[1]


@compiled(inline=True)
def _lay_taps(
    s: Float[np.ndarray, " s"], P: Float[np.ndarray, "3 3"], S0: float, S1: float
) -> bool:
    """Lay out the gain of each innovation on the velocity so many samples earlier.

    The row of P that belongs to the velocity goes through the filter from sample to sample
    (fixed-lag smoothing). Returns whether it has died away within `LAG` samples.
    """
    T, m = s[SAMPLING_TIME], s[INERTIA]
    a, b = 0.5 * T * T / m, T / m
    r0, r1, r2 = P[1, 0], P[1, 1], P[1, 2]
    variance = P[1, 1]
    s[SETTLED] = 0.0
    for j in range(DEPTH):
        if abs(r1) > _DEAD * P[1, 1]:
            s[SETTLED] = j + 1.0
        c0 = r0 / S0 if s[SEEN] > 0.0 else 0.0
        e = r0
        r0, r1, r2 = r0 - s[GAINS] * e, r1 - s[GAINS + 1] * e, r2 - s[GAINS + 2] * e
        c1 = r1 / S1 if s[SEEN + 1] > 0.0 else 0.0
        e = r1
        r0, r1, r2 = r0 - s[GAINS + 3] * e, r1 - s[GAINS + 4] * e, r2 - s[GAINS + 5] * e
        s[TAPS + 2 * j], s[TAPS + 2 * j + 1] = c0, c1
        variance -= c0 * c0 * S0 + c1 * c1 * S1
        r0, r1 = r0 + T * r1 - a * r2, r1 - b * r2
    s[SPREAD_OF_VELOCITY] = np.sqrt(max(variance, 0.0))
    return s[SETTLED] <= LAG


@compiled()
def refresh(s: Float[np.ndarray, " s"]) -> None:
    """Take noise and friction as known by now, and make the first filter steady for them.

    Friction turns from one side to the other at every reversal, and is a random walk here. The walk
    is made as fast as it must be for `LAG` samples to be enough.
    """
    n = s[TALLIED]
    _take_noise(s)
    net = s[NET]
    s[FRICTION] = net
    if s[CERTAINTIES] > 0.0:
        s[FRICTION] = max(s[FORCES] / s[CERTAINTIES], _LEAST_SHARE * net)
    rate = 4.0 * s[FRICTION] * (s[TURNS] + 1.0) / (n * s[SAMPLING_TIME])
    P = np.empty((3, 3))
    for _ in range(_FASTER):
        S0, S1 = _steady(s, rate, net, P)
        if _lay_taps(s, P, S0, S1):
            break
        rate *= 4.0


@compiled(inline=True)
def innovate(s: Float[np.ndarray, " s"], at: int) -> None:
    """Update the first filter with the sample at a place of the ring, and note what was new."""
    z0, z1, z2 = s[FREE], s[FREE + 1], s[FREE + 2]
    missing = int(s[at + 8])
    e0 = s[at + 1] - z0 if missing & 1 == 0 else 0.0
    s[at + 5] = z1
    z0 += s[GAINS] * e0
    z1 += s[GAINS + 1] * e0
    z2 += s[GAINS + 2] * e0
    e1 = s[at + 2] - z1 if s[SEEN + 1] > 0.0 and missing & 2 == 0 else 0.0
    z0 += s[GAINS + 3] * e1
    z1 += s[GAINS + 4] * e1
    z2 += s[GAINS + 5] * e1
    s[at + 6], s[at + 7] = e0, e1
    s[FREE], s[FREE + 1], s[FREE + 2] = z0, z1, z2


@compiled(inline=True)
def predict(s: Float[np.ndarray, " s"], at: int, to: int) -> None:
    """Let the first filter go on from one sample of the ring to the next."""
    T, m = s[SAMPLING_TIME], s[INERTIA]
    spring = 0.5 * s[STIFFNESS] * (s[at + 1] - s[at + 3] + s[to + 1] - s[to + 3])
    w = (s[at] - spring - s[FREE + 2]) / m
    s[FREE] += T * s[FREE + 1] + 0.5 * T * T * w
    s[FREE + 1] += T * w


@compiled(inline=True)
def _correction(s: Float[np.ndarray, " s"], tap: int, begin: int, end: int) -> float:
    """Return the correction by the innovations at these places of the ring, with their taps.

    Four sums are independent, so that no addition waits for the one before.
    """
    even0, even1, odd0, odd1 = 0.0, 0.0, 0.0, 0.0
    for j in range(begin, end - 1, 2):
        at = RING + WIDTH * j
        even0 += s[tap] * s[at + 6]
        even1 += s[tap + 1] * s[at + 7]
        odd0 += s[tap + 2] * s[at + WIDTH + 6]
        odd1 += s[tap + 3] * s[at + WIDTH + 7]
        tap += 4
    if (end - begin) % 2 == 1:
        at = RING + WIDTH * (end - 1)
        even0 += s[tap] * s[at + 6]
        even1 += s[tap + 1] * s[at + 7]
    return (even0 + odd0) + (even1 + odd1)


@compiled(inline=True)
def smoothed_velocity(s: Float[np.ndarray, " s"], first: int) -> float:
    """Return the velocity of the oldest sample in the ring, by all innovations since."""
    later = _correction(s, TAPS, first, DEPTH)
    later += _correction(s, TAPS + 2 * (DEPTH - first), 0, first)
    return s[RING + WIDTH * first + 5] + later
