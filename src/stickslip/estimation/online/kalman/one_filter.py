"""One extended Kalman filter of the motion and its friction: a sample, and its force noise.

The states are z = (x, v, c, f_c, o): position, velocity, viscous friction, Coulomb friction and
offset. Between samples x and v move exactly, as in `predicted`; friction stays.

- An innovation beyond `GATE` is explained by an unknown force in that sample: Q grows until it is
  not. The motion follows the measurement, friction does not.
- Without a given force noise, Q follows the innovations.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.unknown_force import (
    ADAPTATION,
    GATE,
    GATE_MEMORY,
    OVERCONFIDENT,
    adaptation_exponent,
)
from stickslip.estimation.online.intervals.batches import scale_information
from stickslip.estimation.online.kalman.motion import predicted
from stickslip.estimation.online.kalman.state import FRICTION, STATES
from stickslip.numerics.kalman import measure

_SURE = 3.0  # standard deviations of the velocity from 0, from which on the axis moves for sure
_LARGEST_ADAPTATION = 4.0  # factor of an adaptation
_LEAST_FORCE = 1e-3  # of the largest effort: least standard deviation of the adapted force


@compiled(inline=True)
def _predict(s: Any, f: Any, careful: bool, u: float) -> bool:
    """Predict: z by the axis' own motion, P by F P F' + Q; return whether by the exact one."""
    T, m = s.period, s.mass
    P = f.P
    F = np.zeros((2, STATES))
    x, v, q = f.z[0], f.z[1], s.force_variance if careful else 0.0
    rested = v == 0.0
    slow = max(s.rest_speed, _SURE * np.sqrt(P[1, 1]))
    unclear = s.rest_speed > 0.0 and abs(v) < slow
    if unclear and not careful:
        # Friction stops the spread of the velocity within m P_vv / (2 f_c), and to linearise that
        # is sound if a position sensor would hardly see it
        unclear = m * P[1, 1] > 2.0 * max(f.z[3], 0.0) * np.sqrt(s.position_variance)
    if s.held_unknown:
        unclear = True
        q = max(s.rest_variance, s.admission.largest_effort**2)
    if unclear:
        q = max(q, s.rest_variance)
        F[0, 0], F[0, 1], F[1, 1] = 1.0, T, 1.0
        x += v * T
    else:
        x, v = predicted(m, f.z, u, T, F)
    f.z[0], f.z[1] = x, v
    moved = np.zeros((2, STATES))
    for i in range(2):
        for j in range(STATES):
            for k in range(STATES):
                moved[i, j] += F[i, k] * P[k, j]
    for i in range(2):
        for j in range(2, STATES):
            P[i, j] = moved[i, j]
            P[j, i] = moved[i, j]
    for i in range(2):
        for j in range(2):
            total = 0.0
            for k in range(STATES):
                total += moved[i, k] * F[j, k]
            P[i, j] = total
    # r by F r, and the lack of speed at a breakaway
    lack_x, lack_v = 0.0, -np.sign(v) if rested and not careful else 0.0
    for k in range(STATES):
        lack_x += F[0, k] * f.response[k]
        lack_v += F[1, k] * f.response[k]
    f.response[0], f.response[1] = lack_x, lack_v
    # A force of variance q held over the sample
    q /= m * m
    P[0, 0] += 0.25 * q * T**4
    P[0, 1] += 0.5 * q * T**3
    P[1, 0] += 0.5 * q * T**3
    P[1, 1] += q * T * T
    for i in range(FRICTION):
        P[2 + i, 2 + i] += f.walk[i]
    return not unclear


@compiled(inline=True)
def _correct(s: Any, f: Any, k: int, measured: float, variance: float) -> tuple[float, float]:
    """Correct by a measurement of state k: z <- z + K e, P <- P - K S K' with K = P_k / S.

    Returns e^2 / S and log S of the innovation e; zeros for one without information.
    """
    if np.isnan(measured):
        return 0.0, 0.0
    P = f.P
    S = P[k, k] + variance
    if not (S > 0.0 and np.isfinite(S)):
        return 0.0, 0.0
    e = measured - f.z[k]
    lack = f.response[k]
    s.lack += lack * e / S
    s.lack_variance += lack * lack / S
    gain = np.empty(STATES)
    measure(k, variance, P, gain, STATES)
    for i in range(STATES):
        f.z[i] += gain[i] * e
        f.response[i] -= gain[i] * lack
    return e * e / S, np.log(S)


@compiled(inline=True)
def _squared_innovation(f: Any, k: int, measured: float, variance: float) -> float:
    """Return e^2 / S of a measurement of state k; 0 where it holds no information or is missing."""
    S = f.P[k, k] + variance
    if np.isnan(measured) or not (S > 0.0 and np.isfinite(S)):
        return 0.0
    return (measured - f.z[k]) ** 2 / S


@compiled(inline=True)
def _add_force(s: Any, f: Any, q: float) -> None:
    """Add to P what an unknown force does in a sample, white in it, with a mean of variance q.

    P + q T^2 / m^2 [T^2 / 3, T / 2; T / 2, 1]. Its instant is unknown: of a held force the position
    would show the velocity for certain, and a wrong velocity would change its sign in every sample.
    """
    P = f.P
    b0, b1 = 0.5 * s.period**2 / s.mass, s.period / s.mass
    P[0, 0] += q * b0 * b0 * 4.0 / 3.0
    P[0, 1] += q * b0 * b1
    P[1, 0] += q * b0 * b1
    P[1, 1] += q * b1 * b1


@compiled(inline=True)
def take(s: Any, f: Any, careful: bool, u: float, x: float, v: float) -> tuple[bool, float, float]:
    """Take a sample after the effort u into a filter.

    Returns whether the exact motion led to it, e' S^-1 e, and how unlikely it was [nat].
    """
    exactly = _predict(s, f, careful, u)
    square_x = _squared_innovation(f, 0, x, s.position_variance)
    square_v = _squared_innovation(f, 1, v, s.velocity_variance)
    limit = GATE * max(1.0, s.gate_scale)
    if max(square_x, square_v) > limit:
        T, m = s.period, s.mass
        q = 0.0
        if square_x > limit:
            q = ((x - f.z[0]) * 2.0 * m / (T * T)) ** 2
        if square_v > limit:
            q = max(q, ((v - f.z[1]) * m / T) ** 2)
        _add_force(s, f, q)
        if careful:
            s.force_events += 1
    elif exactly and careful:
        s.largest_speed = max(s.largest_speed, abs(f.z[1]))
    bounded = min(square_x, limit) + min(square_v, limit)
    if exactly and careful:
        seen = (0.0 if np.isnan(x) else 1.0) + (0.0 if np.isnan(v) else 1.0)
        if np.isinf(s.velocity_variance):
            seen = 0.0 if np.isnan(x) else 1.0
        if seen > 0.0:
            s.gate_scale += GATE_MEMORY * (bounded / seen - s.gate_scale)
            s.mismatch += bounded
            s.mismatched += seen
    square_x, log_x = _correct(s, f, 0, x, s.position_variance)
    square_v, log_v = _correct(s, f, 1, v, s.velocity_variance)
    return exactly, bounded, 0.5 * (square_x + square_v + log_x + log_v)


@compiled(inline=True)
def _scale_friction(f: Any, factor: float) -> None:
    """Multiply the covariance of friction by a factor, and keep its correlations."""
    P = f.P
    root = np.sqrt(factor)
    for i in range(STATES):
        for j in range(STATES):
            P[i, j] *= (root if i > 1 else 1.0) * (root if j > 1 else 1.0)


@compiled(inline=True)
def adapt(s: Any) -> None:
    """Let the force variance follow the innovations, as in `unknown_force`.

    If the innovations are larger than expected, the information so far was counted too high by
    their mean square, and is reduced.
    """
    if s.adapted == 0 or s.mismatched < ADAPTATION:
        return
    mean = s.mismatch / s.mismatched
    s.mismatch, s.mismatched = 0.0, 0
    gamma = adaptation_exponent(mean, s.adapted)
    s.adapted += 1
    factor = min(max(mean, 1.0 / _LARGEST_ADAPTATION), _LARGEST_ADAPTATION) ** gamma
    most = s.admission.largest_effort**2
    least = most * _LEAST_FORCE * _LEAST_FORCE
    s.force_variance = min(max(factor * s.force_variance, least), max(most, least))
    if mean > OVERCONFIDENT:
        factor = min(mean, _LARGEST_ADAPTATION)
        _scale_friction(s.careful, factor)
        scale_information(s.batches.snapshots, 1.0 / factor)
        scale_information(s.contrasts.groups, 1.0 / factor)
        for i in range(FRICTION):
            s.spell_vector[i] /= factor
            for j in range(FRICTION):
                s.spell_information[i, j] /= factor


@compiled(inline=True)
def information(s: Any, f: Any, J: Float[np.ndarray, "3 3"], eta: Float[np.ndarray, " 3"]) -> bool:
    """Write P^-1 of friction to J, zeros for what is not estimated, and J theta to eta."""
    P = f.P
    a, b, c = P[2, 2], P[2, 3], P[3, 3]
    J[:] = 0.0
    if s.parameters < FRICTION:
        det = a * c - b * b
        J[0, 0], J[0, 1], J[1, 0], J[1, 1] = c / det, -b / det, -b / det, a / det
    else:
        d, e, g = P[2, 4], P[3, 4], P[4, 4]
        det = a * (c * g - e * e) - b * (b * g - d * e) + d * (b * e - c * d)
        J[0, 0] = (c * g - e * e) / det
        J[1, 1] = (a * g - d * d) / det
        J[2, 2] = (a * c - b * b) / det
        J[0, 1] = J[1, 0] = (d * e - b * g) / det
        J[0, 2] = J[2, 0] = (b * e - c * d) / det
        J[1, 2] = J[2, 1] = (b * d - a * e) / det
    for i in range(FRICTION):
        eta[i] = 0.0
        for j in range(FRICTION):
            eta[i] += J[i, j] * f.z[2 + j]
    return det > 0.0 and a > 0.0


@compiled(inline=True)
def is_valid(f: Any) -> bool:
    """Return whether a filter's states are finite and its variances finite and not negative."""
    total = 0.0
    valid = True
    for i in range(STATES):
        variance = f.P[i, i]
        total += f.z[i] + variance
        valid = valid and variance >= 0.0
    return valid and np.isfinite(total)


@compiled(inline=True)
def unknown_motion(s: Any, f: Any, speed: float) -> None:
    """Set what is known of position and velocity by one sample, in a P that is 0 there.

    Without a velocity sensor the velocity is 0, up to the speed and the noise of a sample.
    """
    f.P[0, 0] = s.position_variance
    f.P[1, 1] = s.velocity_variance
    if not np.isfinite(s.velocity_variance):
        f.P[1, 1] = 2.0 * s.position_variance / s.period**2 + speed * speed
