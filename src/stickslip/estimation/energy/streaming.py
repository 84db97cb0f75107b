"""Kernels that take one sample at a time into the energy balance."""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.balance import squared_velocity, turning_way
from stickslip.estimation.energy.streaming_layout import (
    ACCEPTED,
    AVERAGED,
    CONSTANT,
    CONSTANT_SPREAD,
    DIFFERENCES,
    EARLIER,
    EXTREME,
    FILTER,
    FORCE_VARIANCE,
    HYSTERESIS,
    KNOWN,
    LAST,
    LEVEL_VARIANCE,
    MARK,
    MEAN,
    POLE,
    POSITION_NOISE,
    ROUGHNESS,
    SINCE,
    SQUARE_BIAS,
    SUMS,
    VELOCITY_NOISE,
    WAY,
    WORK,
)
from stickslip.estimation.online.recursion import (
    COUNT,
    DERIVED,
    FORGETTING,
    LOAD_INERTIA,
    OFFSET,
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

__all__ = ["energy_run", "energy_step"]

_SETTLING = 16.0  # samples before the noise is known well enough to tell motion from it
_NOISE_MEMORY = 256.0  # samples that the running noise estimate looks back
_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise


@compiled(inline=True)
def _low_pass(s: Float[np.ndarray, " s"], place: int, value: float) -> float:
    """Return a value through two equal first-order stages at the given place of the state."""
    pole = s[POLE]
    s[place] = pole * s[place] + (1.0 - pole) * value
    s[place + 1] = pole * s[place + 1] + (1.0 - pole) * s[place]
    return s[place + 1]


@compiled(inline=True)
def _track_noise(s: Float[np.ndarray, " s"], which: int, value: float, count: float) -> float:
    """Return the running standard deviation of the noise on a signal, from third differences."""
    place = DIFFERENCES + 3 * which
    first = value - s[place]
    second = first - s[place + 1]
    third = second - s[place + 2]
    s[place], s[place + 1], s[place + 2] = value, first, second
    if count < 3.0:
        return 0.0
    weight = max(1.0 / (count - 2.0), 1.0 / _NOISE_MEMORY)
    s[ROUGHNESS + which] += weight * (third * third - s[ROUGHNESS + which])
    return np.sqrt(s[ROUGHNESS + which] / _THIRD_DIFFERENCE)


@compiled(inline=True)
def _regress(s: Float[np.ndarray, " s"], level: float, way: float, least: float) -> None:
    """Take the levels as they stand into the estimate, unless the axis rests.

    A row is accepted only when the axis has got further than the noise since the last one: at rest
    nothing is learned, and nothing forgotten. It holds the means over the samples since then, so
    that none is lost. The constant in the level is followed by the Kalman filter of a random walk
    whose steps are a disturbing force times the way.
    """
    p = int(s[PARAMETERS])
    forgetting = s[FORGETTING]
    s[SINCE] += way  # with its sign, so that noise does not add up
    s[AVERAGED] += 1.0
    share = 1.0 / s[AVERAGED]
    s[MEAN] += share * (level - s[MEAN])
    for j in range(p):
        s[MEAN + 1 + j] += share * (s[SUMS + j] - s[MEAN + 1 + j])
    if s[ACCEPTED] > 0.0 and abs(s[EXTREME] - s[MARK]) <= least:
        return
    s[MARK] = s[EXTREME]
    if s[ACCEPTED] == 0.0:
        for j in range(p + 1):
            s[CONSTANT + j] = s[MEAN + j]
        s[CONSTANT_SPREAD] = s[LEVEL_VARIANCE]
    else:
        step = s[FORCE_VARIANCE] * s[SINCE] * s[SINCE]
        spread = s[CONSTANT_SPREAD] / forgetting + step
        variance = spread + s[LEVEL_VARIANCE]
        K = spread / variance
        scale = 1.0 / np.sqrt(variance)
        y = (s[MEAN] - s[CONSTANT]) * scale
        s[CONSTANT] += K * (s[MEAN] - s[CONSTANT])
        for j in range(p):
            e = s[MEAN + 1 + j] - s[CONSTANT + 1 + j]
            s[ROW + j] = e * scale
            s[CONSTANT + 1 + j] += K * e
        s[CONSTANT_SPREAD] = K * s[LEVEL_VARIANCE]
        update(s, y, forgetting, False)
    s[SINCE] = 0.0
    s[AVERAGED] = 0.0
    s[ACCEPTED] += 1.0


@compiled(inline=True)
def _mean_left(s: Float[np.ndarray, " s"], v0: float, v: float) -> float:
    """Return the mean share of the Stribeck effect over the way of a sample (Simpson's rule)."""
    if s[STRIBECK] == 0.0:
        return 0.0
    middle = 0.5 * (v0 + v)
    way = abs(v0) + 4.0 * abs(middle) + abs(v)
    share = abs(v0) * stribeck_left(s, v0) + abs(v) * stribeck_left(s, v)
    share += 4.0 * abs(middle) * stribeck_left(s, middle)
    return share / way if way > 0.0 else 1.0


@compiled(inline=True)
def _add(
    s: Float[np.ndarray, " s"],
    squared: float,
    way: float,
    displacement: float,
    forward: bool,
    left: float,
) -> None:
    """Add one sample's share to the friction regressors (Eq. 4.3).

    ``left`` is the mean share of the Stribeck effect over its way.
    """
    k = SUMS + 1  # behind the kinetic energy of a unit inertia
    if s[PER_DIRECTION] > 0.0:
        side = 0 if forward else 1
        s[k + side] += squared
        s[k + 2 + side] += way
    else:
        s[k] += squared
        s[k + 1] += way * (1.0 - left)
        if s[STRIBECK] > 0.0:
            s[k + 2] += way * left
            k += 1
        if s[OFFSET] > 0.0:
            s[k + 2] += displacement


@compiled(inline=True)
def _stored(s: Float[np.ndarray, " s"], x: float, x2: float, v2: float) -> float:
    """Return the energy of the load and of the spring (Eqs. 3.7, 3.8 with its squares)."""
    return 0.5 * s[LOAD_INERTIA] * v2 * v2 + 0.5 * s[STIFFNESS] * (x - x2) * (x - x2)


@compiled(inline=True)
def _held_step(
    s: Float[np.ndarray, " s"],
    u: float,
    x: float,
    v: float,
    x2: float,
    v2: float,
    sw: float,
) -> None:
    """Take one sample, its position known to sw, by the form that is exact under a held effort."""
    T = s[SAMPLING_TIME]
    derived = s[DERIVED] > 0.0
    sv = 0.0
    if not derived:
        sv = s[VELOCITY_NOISE]
        if sv < 0.0:
            sv = _track_noise(s, 1, v, s[COUNT])
    estimated = s[POSITION_NOISE] < 0.0 or (not derived and s[VELOCITY_NOISE] < 0.0)
    if s[COUNT] < (_SETTLING if estimated else 1.0):
        s[EXTREME] = x
        s[MARK] = x
        z = x
    else:
        u0, z0, v0 = s[LAST], s[LAST + 1], s[LAST + 2]
        # Fuse: the position goes on by the velocities, corrected by a steady Kalman gain
        gain = 1.0
        if sw > 0.0 and not derived:
            q = (T * sv / sw) * (T * sv / sw)
            predicted = 0.5 * (q + np.sqrt(q * q + 4.0 * q))
            gain = predicted / (predicted + 1.0)
        carried = z0 + 0.5 * T * (v0 + v)
        z = carried + gain * (x - carried)
        least = s[HYSTERESIS] * sw * np.sqrt(gain)
        dz = z - z0
        way = s[WAY] * dz
        # The sign of a velocity means something only beyond its own noise and that of the position
        noisy = max(least, s[HYSTERESIS] * T * sv) > 0.5 * T * (abs(v0) + abs(v))
        if s[WAY] == 0.0:
            if abs(z - s[EXTREME]) > least:
                s[WAY] = 1.0 if z > s[EXTREME] else -1.0
                way = abs(z - s[EXTREME])
                s[EXTREME] = z
        elif s[WAY] * (z - s[EXTREME]) >= 0.0:
            s[EXTREME] = z
        elif s[WAY] * (s[EXTREME] - z) > least:
            # Reversed at the furthest point: what was counted back since then was way forward
            back = abs(s[EXTREME] - z)
            way += 2.0 * back
            s[WAY] = -s[WAY]
            s[EXTREME] = z
        if not noisy and v0 * v < 0.0:
            way = turning_way(v0, v, dz, T)
            s[WAY] = 1.0 if v > 0.0 else -1.0
            s[EXTREME] = z
        bias = s[SQUARE_BIAS] * sw * sw if derived else 2.0 / 3.0 * sv * sv
        squared = squared_velocity(v0, v, v - v0, T) - T * bias
        s[WORK] += u0 * dz
        _add(s, squared, way, dz, s[WAY] > 0.0, _mean_left(s, v0, v))
        s[SUMS] = 0.5 * v * v
        _regress(s, s[WORK] - _stored(s, z, x2, v2), way, least)
    s[LAST], s[LAST + 1], s[LAST + 2] = u, z, v


@compiled(inline=True)
def _advance(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample into the state, in place."""
    T = s[SAMPLING_TIME]
    # Of the raw position: what a filter leaves of its noise is too smooth to be told from motion
    sw = s[POSITION_NOISE]
    if sw < 0.0:
        sw = _track_noise(s, 0, x, s[COUNT] + s[KNOWN])
    if s[DERIVED] > 0.0:
        # Effort and positions through the same causal filter, one sample late so that the velocity
        # is a central difference
        if s[KNOWN] == 0.0:
            for place, value in ((0, u), (2, x), (4, x2)):
                s[FILTER + place] = value
                s[FILTER + place + 1] = value
        uf = _low_pass(s, FILTER, u)
        xf = _low_pass(s, FILTER + 2, x)
        x2f = _low_pass(s, FILTER + 4, x2)
        known = s[KNOWN]
        u, x, x2 = s[EARLIER], s[EARLIER + 1], s[EARLIER + 2]
        v, v2 = 0.5 * (xf - s[EARLIER + 4]) / T, 0.5 * (x2f - s[EARLIER + 5]) / T
        for place in range(3):
            s[EARLIER + 3 + place] = s[EARLIER + place]
        s[EARLIER], s[EARLIER + 1], s[EARLIER + 2] = uf, xf, x2f
        if known < 2.0:
            s[KNOWN] += 1.0
            return
    _held_step(s, u, x, v, x2, v2, sw)
    s[COUNT] += 1.0


@compiled(brief=True)
def energy_step(
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
def energy_run(
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
