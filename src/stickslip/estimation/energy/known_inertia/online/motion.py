"""First of the two online filters: the motion with friction as a free force.

It assumes no friction law. The innovations of the next `LAG` samples improve its velocity, so that
the direction of friction is decided from many samples, and not from the one that an estimate is
made of.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.known_inertia.online.state import CHANNELS, DEPTH, LAG, fields
from stickslip.estimation.online.method import State
from stickslip.numerics.kalman import measure

_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise
_ROUNDING = 1e-14  # of the mean square: noise that a signal without any is taken to have
_LEAST_VARIANCE = 1e-300  # of a signal that is zero throughout
_ITERATIONS = 500  # of the filter's covariance until it is steady
_CONVERGED = 1e-6  # relative
_DEAD = 0.03  # of a velocity's variance: the rest that later innovations do not reduce
_FASTER = 20  # times that the walk is made faster, fourfold each
_LEAST_SHARE = 1e-3  # of the mean square of the net force that friction is taken to have


@compiled(inline=True)
def count_noise(own: Any, value: float, c: int) -> None:
    """Add a measurement of a channel to the sums of its noise, by third differences.

    While an encoder does not count, its noise is not visible.
    """
    last = own.differences[c]
    first = value - last[0]
    second = first - last[1]
    third = second - last[2]
    last[0], last[1], last[2] = value, first, second
    own.squares[c] += value * value
    if own.chain[c] >= 3.0 and third != 0.0:
        own.roughness[c] += third * third
        own.noisy_samples[c] += 1.0
    own.chain[c] += 1.0


@compiled(inline=True)
def compare(own: Any, before: Any, now: Any) -> None:
    """Add up how positions and velocities of neighbouring samples disagree, for each mass.

    Under a held force dx / T is the mean of the velocities but for T / 12 times the change of the
    acceleration, most of which the spring makes. The difference d of both bounds the noise of
    each: var(d - d_-) = 6 sigma_x^2 / T^2 + sigma_v^2 / 2 and
    var(d + d_-) = 2 sigma_x^2 / T^2 + 3/2 sigma_v^2.
    """
    T = own.recursion.sampling_time
    z, z0 = now.measured, before.measured
    stretching = z[0] - z[2] - z0[0] + z0[2]
    for mass in range(2):
        x, v = 2 * mass, 2 * mass + 1
        chain = min(own.chain[x], own.chain[v])
        if own.is_measured[v] == 0 or chain < 2.0:
            continue
        bent = T / 12.0 * own.recursion.stiffness * stretching
        bent /= own.inertia if mass == 0 else -own.recursion.load_inertia
        mean = 0.5 * (z[v] + z0[v]) + bent
        d = (z[x] - z0[x]) / T - mean
        sums = own.disagreement[mass]
        if chain >= 3.0 and (z[x] != z0[x] or z[v] != z0[v]):
            sums.difference_squares += (d - sums.last) ** 2
            sums.sum_squares += (d + sums.last) ** 2
            sums.samples += 1.0
        sums.last = d


@compiled(inline=True)
def estimate_noise(own: Any) -> None:
    """Estimate the noise of the sensors so far, bounded by the disagreement of the signals."""
    n, T = own.recursion.samples, own.recursion.sampling_time
    for c in range(CHANNELS):
        seen = own.roughness[c] / _THIRD_DIFFERENCE + own.guess_samples[c] * own.guess[c]
        variance = seen / max(own.noisy_samples[c] + own.guess_samples[c], 1.0)
        mass = c // 2
        sums = own.disagreement[mass]
        if own.is_measured[2 * mass + 1] > 0 and sums.samples > 0.0:
            most = sums.difference_squares * T * T / 6.0 if c % 2 == 0 else sums.sum_squares / 1.5
            variance = min(variance, most / sums.samples)
        own.noise[c] = max(variance, _ROUNDING * own.squares[c] / n, _LEAST_VARIANCE)


@compiled(inline=True)
def _steady(own: Any, rate: float, net: float, P: Float[np.ndarray, "3 3"]) -> tuple[float, float]:
    """Iterate the first filter's covariance until it is steady; write its gains to the state.

    P becomes the covariance of the prediction. Returns the variances of the two innovations.
    """
    T, m = own.recursion.sampling_time, own.inertia
    a, b = 0.5 * T * T / m, T / m
    Q = np.empty((3, 3))
    Q[0, 0], Q[0, 1], Q[0, 2] = T**5 / (20 * m * m), T**4 / (8 * m * m), -(T**3) / (6 * m)
    Q[1, 1], Q[1, 2], Q[2, 2] = T**3 / (3 * m * m), -(T**2) / (2 * m), T
    Q[1, 0], Q[2, 0], Q[2, 1] = Q[0, 1], Q[0, 2], Q[1, 2]
    for i in range(3):
        for j in range(3):
            P[i, j] = 0.0
    P[0, 0], P[1, 1], P[2, 2] = own.noise[0], own.noise[1], net
    M, S = np.empty((3, 3)), np.ones(2)
    for _ in range(_ITERATIONS):
        before = P[1, 1]
        for i in range(3):
            for j in range(3):
                M[i, j] = P[i, j]
        for i in range(2):
            gain = own.gains[i]
            gain[:] = 0.0
            if own.is_measured[i] > 0:
                S[i] = measure(i, own.noise[i], M, gain, 3)
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
def _write_taps(own: Any, P: Float[np.ndarray, "3 3"], S0: float, S1: float) -> bool:
    """Write the gain of each innovation on the velocity so many samples earlier.

    The row of P that belongs to the velocity goes through the filter from sample to sample
    (fixed-lag smoothing). Returns whether it has died away within `LAG` samples.
    """
    T, m = own.recursion.sampling_time, own.inertia
    a, b = 0.5 * T * T / m, T / m
    r0, r1, r2 = P[1, 0], P[1, 1], P[1, 2]
    variance = P[1, 1]
    own.settled = 0.0
    of_x, of_v = own.gains[0], own.gains[1]
    for j in range(DEPTH):
        if abs(r1) > _DEAD * P[1, 1]:
            own.settled = j + 1.0
        c0 = r0 / S0 if own.is_measured[0] > 0 else 0.0
        e = r0
        r0, r1, r2 = r0 - of_x[0] * e, r1 - of_x[1] * e, r2 - of_x[2] * e
        c1 = r1 / S1 if own.is_measured[1] > 0 else 0.0
        e = r1
        r0, r1, r2 = r0 - of_v[0] * e, r1 - of_v[1] * e, r2 - of_v[2] * e
        own.taps[j, 0], own.taps[j, 1] = c0, c1
        variance -= c0 * c0 * S0 + c1 * c1 * S1
        r0, r1 = r0 + T * r1 - a * r2, r1 - b * r2
    own.velocity_spread = np.sqrt(max(variance, 0.0))
    return own.settled <= LAG


@compiled()
def refresh(s: State) -> None:
    """Estimate noise and friction so far, and make the first filter steady for them.

    Friction turns from one side to the other at every reversal, and is a random walk here. The walk
    is made as fast as it must be for `LAG` samples to be enough.
    """
    own = fields(s)
    estimate_noise(own)
    net = own.net_square
    own.friction_square = net
    if own.certain_samples > 0.0:
        own.friction_square = max(own.friction_squares / own.certain_samples, _LEAST_SHARE * net)
    duration = own.noisy_samples[0] * own.recursion.sampling_time
    rate = 4.0 * own.friction_square * (own.turns + 1.0) / duration
    P = np.empty((3, 3))
    for _ in range(_FASTER):
        S0, S1 = _steady(own, rate, net, P)
        if _write_taps(own, P, S0, S1):
            break
        rate *= 4.0


@compiled(inline=True)
def innovate(own: Any, sample: Any) -> None:
    """Update the first filter with a sample of the ring, and note prediction and innovations."""
    z0, z1, z2 = own.free[0], own.free[1], own.free[2]
    of_x, of_v = own.gains[0], own.gains[1]
    missing = sample.missing
    e0 = sample.measured[0] - z0 if missing & 1 == 0 else 0.0
    sample.predicted_velocity = z1
    z0 += of_x[0] * e0
    z1 += of_x[1] * e0
    z2 += of_x[2] * e0
    e1 = sample.measured[1] - z1 if own.is_measured[1] > 0 and missing & 2 == 0 else 0.0
    z0 += of_v[0] * e1
    z1 += of_v[1] * e1
    z2 += of_v[2] * e1
    sample.innovation[0], sample.innovation[1] = e0, e1
    own.free[0], own.free[1], own.free[2] = z0, z1, z2


@compiled(inline=True)
def predict(own: Any, now: Any, later: Any) -> None:
    """Advance the first filter from one sample of the ring to the next."""
    T, m = own.recursion.sampling_time, own.inertia
    z, z1 = now.measured, later.measured
    spring = 0.5 * own.recursion.stiffness * (z[0] - z[2] + z1[0] - z1[2])
    w = (now.effort - spring - own.free[2]) / m
    own.free[0] += T * own.free[1] + 0.5 * T * T * w
    own.free[1] += T * w


@compiled(inline=True)
def _correction(own: Any, tap: int, begin: int, end: int) -> float:
    """Return the correction by the innovations at these places of the ring, with their taps.

    Four sums are independent, so that no addition waits for the one before.
    """
    even0, even1, odd0, odd1 = 0.0, 0.0, 0.0, 0.0
    for j in range(begin, end - 1, 2):
        even, odd = own.ring[j].innovation, own.ring[j + 1].innovation
        k = tap + j - begin
        even0 += own.taps[k, 0] * even[0]
        even1 += own.taps[k, 1] * even[1]
        odd0 += own.taps[k + 1, 0] * odd[0]
        odd1 += own.taps[k + 1, 1] * odd[1]
    if (end - begin) % 2 == 1:
        even = own.ring[end - 1].innovation
        k = tap + end - 1 - begin
        even0 += own.taps[k, 0] * even[0]
        even1 += own.taps[k, 1] * even[1]
    return (even0 + odd0) + (even1 + odd1)


@compiled(inline=True)
def smoothed_velocity(own: Any, first: int) -> float:
    """Return the velocity of the oldest sample in the ring, by all innovations since."""
    later = _correction(own, 0, first, DEPTH)
    later += _correction(own, DEPTH - first, 0, first)
    return own.ring[first].predicted_velocity + later
