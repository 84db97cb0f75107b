"""Kernels that take one sample at a time: the energy balance and recursive least squares.

All that a step remembers is one vector of fixed size, so that the same step runs from Python, in a
compiled loop and on a drive. What lies where in the vector is given by the constants below.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy_balance import report_step, squared_velocity, turning_way

__all__ = [
    "COUNT",
    "DERIVED",
    "FIRST_SPREAD",
    "FORCE_VARIANCE",
    "FORGETTING",
    "HYSTERESIS",
    "INERTIA",
    "INERTIA_KNOWN",
    "LEVEL_VARIANCE",
    "LOAD_INERTIA",
    "MOST_PARAMETERS",
    "OFFSET",
    "PARAMETERS",
    "PER_DIRECTION",
    "POLE",
    "POSITION_NOISE",
    "PRINTED",
    "RELATIVE_PRIOR",
    "SAMPLING_TIME",
    "SPREAD",
    "SQUARE_BIAS",
    "STIFFNESS",
    "VALUES",
    "VELOCITY_NOISE",
    "covariance_in",
    "energy_run",
    "energy_step",
    "rls_run",
    "rls_step",
]

MOST_PARAMETERS = 5

# Settings
(
    SAMPLING_TIME,
    FORGETTING,
    PARAMETERS,
    INERTIA,
    INERTIA_KNOWN,
    LOAD_INERTIA,
    STIFFNESS,
    PER_DIRECTION,
    OFFSET,
    PRINTED,  # the report's sums and updates, as printed
    DERIVED,  # velocities are not measured but differentiated
    POLE,  # of the causal low-pass used then
    POSITION_NOISE,  # standard deviations; negative: estimated on the way
    VELOCITY_NOISE,
    LEVEL_VARIANCE,
    FORCE_VARIANCE,
    HYSTERESIS,  # in standard deviations of the fused position
    SQUARE_BIAS,  # of a differentiated velocity's square, over the variance of the position [1/s^2]
    RELATIVE_PRIOR,  # P(0) follows the largest regressors so far
) = range(19)
# What changes
(
    COUNT,
    _WORK,
    _WAY,  # direction of travel
    _EXTREME,  # furthest point in that direction
    _MARK,  # that point at the last accepted row
    _SINCE,  # way since then
    _ACCEPTED,
    _CONSTANT_SPREAD,  # variance of the level's constant
    _KNOWN,  # samples in the differentiating filter, up to 2
    _ROUGHNESS,  # running means of squared third differences of position and velocity
) = range(19, 29)
_LAST = _ROUGHNESS + 2  # effort, fused position, velocity
_FILTER = _LAST + 3  # two stages each for effort, position, load position
_EARLIER = _FILTER + 6  # filtered effort, position, load position, one and two samples ago
_DIFFERENCES = _EARLIER + 6  # last value, first and second difference of position, of velocity
_SUMS = _DIFFERENCES + 6  # regressors
_CONSTANT = _SUMS + MOST_PARAMETERS  # level of the balance, then of each regressor
_MEAN = _CONSTANT + MOST_PARAMETERS + 1  # means of the same since the last accepted row
_AVERAGED = _MEAN + MOST_PARAMETERS + 1  # samples in them
FIRST_SPREAD = _AVERAGED + 1  # diagonal of P(0)
SPREAD = FIRST_SPREAD + MOST_PARAMETERS  # P, row by row
_ROW = SPREAD + MOST_PARAMETERS**2  # regressor of the row being taken
_GAIN = _ROW + MOST_PARAMETERS
_TYPICAL = _GAIN + MOST_PARAMETERS  # running mean squares of the regressors that count
_COUNTED = _TYPICAL + MOST_PARAMETERS  # rows that counted
VALUES = _COUNTED + 1  # estimates: the rest of the vector

_SETTLING = 16.0  # samples before the noise is known well enough to tell motion from it
_NOISE_MEMORY = 256.0  # samples that the running noise estimate looks back
_PRIOR = 1e-10  # information of a relative prior, over that of the largest row so far
_SMALL_ROW = 1e-3  # squared size of a row that tells nothing new, over that of a typical one
_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise


@compiled(inline=True)
def _counts(s: Float[np.ndarray, " s"], p: int, forgetting: float) -> bool:
    """Return whether the row is not far smaller than a typical one, and let it count as typical."""
    size = 0.0
    for i in range(p):
        if s[_TYPICAL + i] > 0.0:
            size = max(size, s[_ROW + i] * s[_ROW + i] / s[_TYPICAL + i])
    if s[_COUNTED] > 0.0 and size < _SMALL_ROW:
        return False
    s[_COUNTED] += 1.0
    weight = max(1.0 / s[_COUNTED], 1.0 - forgetting)
    for i in range(p):
        s[_TYPICAL + i] += weight * (s[_ROW + i] * s[_ROW + i] - s[_TYPICAL + i])
    return True


@compiled(inline=True)
def _widen_prior(s: Float[np.ndarray, " s"], p: int) -> None:
    """Let P(0) be that of a small fraction of the largest row so far, whatever its units.

    A regressor counts from its first value other than zero; as it grows, so does the information
    that P begins with, which leaves the estimates as they are.
    """
    for k in range(p):
        size = _PRIOR * s[_ROW + k] * s[_ROW + k]
        first = s[FIRST_SPREAD + k]
        if first == 0.0 and size > 0.0:
            s[FIRST_SPREAD + k] = 1.0 / size
            s[SPREAD + k * p + k] = 1.0 / size
        elif size * first > 2.0:
            s[FIRST_SPREAD + k] = 1.0 / size
            added = size - 1.0 / first
            for i in range(p):
                s[_GAIN + i] = s[SPREAD + i * p + k]
            drop = added / (1.0 + added * s[_GAIN + k])
            for i in range(p):
                for j in range(p):
                    s[SPREAD + i * p + j] -= drop * s[_GAIN + i] * s[_GAIN + j]


@compiled(inline=True)
def _update(s: Float[np.ndarray, " s"], y: float, forgetting: float, printed: bool) -> None:
    """Take the row W at its place and its target y into the estimates (Eqs. 4.6-4.10, K before P).

    Printed: everything is forgotten exponentially. Otherwise restricted forgetting (Kulhavy 1987):
    the information P^-1 grows by eps W W' with eps = lambda - (1 - lambda) / g and g = W' P W, so
    that only what the row tells about is forgotten. A row far smaller than those before it (a rest,
    with its noise) tells nothing new, and nothing is forgotten for it: eps >= 0 there. Either way
    nothing is forgotten in a step that would leave the estimates less certain than they were at the
    start, on average over the parameters: P stays bounded whatever the rows are. Without forgetting
    both are ordinary recursive least squares.
    """
    p = int(s[PARAMETERS])
    if s[RELATIVE_PRIOR] > 0.0:
        _widen_prior(s, p)
    g = 0.0
    e = y
    for i in range(p):
        total = 0.0
        for j in range(p):
            total += s[SPREAD + i * p + j] * s[_ROW + j]
        s[_GAIN + i] = total
        g += total * s[_ROW + i]
        e -= s[_ROW + i] * s[VALUES + i]
    if not (g > 0.0 and np.isfinite(g)):
        return
    weight, grown = 1.0, 1.0
    if printed:
        weight, grown = forgetting, 1.0 / forgetting
        drop = grown / (forgetting + g)
    else:
        eps = forgetting - (1.0 - forgetting) / g
        if forgetting < 1.0 and not _counts(s, p, forgetting) and eps < 0.0:
            eps = 0.0
        drop = eps / (1.0 + eps * g)
    if forgetting < 1.0 and (printed or drop < 0.0):
        spread, square = 0.0, 0.0
        started = 0
        for i in range(p):
            if s[FIRST_SPREAD + i] > 0.0:
                started += 1
                spread += s[SPREAD + i * p + i] / s[FIRST_SPREAD + i]
                square += s[_GAIN + i] * s[_GAIN + i] / s[FIRST_SPREAD + i]
        if grown * spread - drop * square > started:
            weight, grown, drop = 1.0, 1.0, 1.0 / (1.0 + g)
    step = e / (weight + g)
    for i in range(p):
        s[VALUES + i] += s[_GAIN + i] * step
        for j in range(i, p):
            value = grown * s[SPREAD + i * p + j] - drop * s[_GAIN + i] * s[_GAIN + j]
            s[SPREAD + i * p + j] = value
            s[SPREAD + j * p + i] = value


@compiled()
def rls_step(
    s: Float[np.ndarray, " s"], row: Float[np.ndarray, " p"], y: float, printed: bool
) -> bool:
    """Take one row into the state, in place, if all of it is finite; return whether it is."""
    finite = np.isfinite(y)
    for i in range(row.size):
        finite = finite and np.isfinite(row[i])
    if finite:
        for i in range(row.size):
            s[_ROW + i] = row[i]
        _update(s, y, s[FORGETTING], printed)
    return finite


@compiled()
def rls_run(
    s: Float[np.ndarray, " s"],
    rows: Float[np.ndarray, "n p"],
    targets: Float[np.ndarray, " n"],
    printed: bool,
) -> Float[np.ndarray, "n p"]:
    """Take many rows, in place, and return the estimates after each."""
    n, p = rows.shape
    history = np.empty((n, p))
    for k in range(n):
        for i in range(p):
            s[_ROW + i] = rows[k, i]
        _update(s, targets[k], s[FORGETTING], printed)
        for i in range(p):
            history[k, i] = s[VALUES + i]
    return history


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
    place = _DIFFERENCES + 3 * which
    first = value - s[place]
    second = first - s[place + 1]
    third = second - s[place + 2]
    s[place], s[place + 1], s[place + 2] = value, first, second
    if count < 3.0:
        return 0.0
    weight = max(1.0 / (count - 2.0), 1.0 / _NOISE_MEMORY)
    s[_ROUGHNESS + which] += weight * (third * third - s[_ROUGHNESS + which])
    return np.sqrt(s[_ROUGHNESS + which] / _THIRD_DIFFERENCE)


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
    s[_SINCE] += way  # with its sign, so that noise does not add up
    s[_AVERAGED] += 1.0
    share = 1.0 / s[_AVERAGED]
    s[_MEAN] += share * (level - s[_MEAN])
    for j in range(p):
        s[_MEAN + 1 + j] += share * (s[_SUMS + j] - s[_MEAN + 1 + j])
    if s[_ACCEPTED] > 0.0 and abs(s[_EXTREME] - s[_MARK]) <= least:
        return
    s[_MARK] = s[_EXTREME]
    if s[_ACCEPTED] == 0.0:
        for j in range(p + 1):
            s[_CONSTANT + j] = s[_MEAN + j]
        s[_CONSTANT_SPREAD] = s[LEVEL_VARIANCE]
    else:
        step = s[FORCE_VARIANCE] * s[_SINCE] * s[_SINCE]
        spread = s[_CONSTANT_SPREAD] / forgetting + step
        variance = spread + s[LEVEL_VARIANCE]
        K = spread / variance
        scale = 1.0 / np.sqrt(variance)
        y = (s[_MEAN] - s[_CONSTANT]) * scale
        s[_CONSTANT] += K * (s[_MEAN] - s[_CONSTANT])
        for j in range(p):
            e = s[_MEAN + 1 + j] - s[_CONSTANT + 1 + j]
            s[_ROW + j] = e * scale
            s[_CONSTANT + 1 + j] += K * e
        s[_CONSTANT_SPREAD] = K * s[LEVEL_VARIANCE]
        _update(s, y, forgetting, False)
    s[_SINCE] = 0.0
    s[_AVERAGED] = 0.0
    s[_ACCEPTED] += 1.0


@compiled(inline=True)
def _add(
    s: Float[np.ndarray, " s"], squared: float, way: float, displacement: float, forward: bool
) -> None:
    """Add one sample's share to the friction regressors (Eq. 4.3)."""
    k = _SUMS + (0 if s[INERTIA_KNOWN] > 0.0 else 1)
    if s[PER_DIRECTION] > 0.0:
        side = 0 if forward else 1
        s[k + side] += squared
        s[k + 2 + side] += way
    else:
        s[k] += squared
        s[k + 1] += way
        if s[OFFSET] > 0.0:
            s[k + 2] += displacement


@compiled(inline=True)
def _stored(s: Float[np.ndarray, " s"], x: float, v: float, x2: float, v2: float) -> float:
    """Return the known kinetic and potential energy (Eqs. 3.7, 3.8 with its squares)."""
    stored = 0.5 * s[LOAD_INERTIA] * v2 * v2 + 0.5 * s[STIFFNESS] * (x - x2) * (x - x2)
    if s[INERTIA_KNOWN] > 0.0:
        stored += 0.5 * s[INERTIA] * v * v
    return stored


@compiled(inline=True)
def _printed_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample by the printed equations (3.6-4.10)."""
    T = s[SAMPLING_TIME]
    work, way, squared = report_step(u, v, T)
    s[_WORK] += work
    _add(s, squared, way, T * v, v > 0.0)
    if s[INERTIA_KNOWN] == 0.0:
        s[_SUMS] = 0.5 * v * v
    for j in range(int(s[PARAMETERS])):
        s[_ROW + j] = s[_SUMS + j]
    _update(s, s[_WORK] - _stored(s, x, v, x2, v2), s[FORGETTING], True)


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
        s[_EXTREME] = x
        s[_MARK] = x
        z = x
    else:
        u0, z0, v0 = s[_LAST], s[_LAST + 1], s[_LAST + 2]
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
        way = s[_WAY] * dz
        noisy = least > 0.5 * T * (abs(v0) + abs(v))
        if s[_WAY] == 0.0:
            if abs(z - s[_EXTREME]) > least:
                s[_WAY] = 1.0 if z > s[_EXTREME] else -1.0
                way = abs(z - s[_EXTREME])
                s[_EXTREME] = z
        elif s[_WAY] * (z - s[_EXTREME]) >= 0.0:
            s[_EXTREME] = z
        elif s[_WAY] * (s[_EXTREME] - z) > least:
            # Reversed at the furthest point: what was counted back since then was way forward
            back = abs(s[_EXTREME] - z)
            way += 2.0 * back
            s[_WAY] = -s[_WAY]
            s[_EXTREME] = z
        if not noisy and v0 * v < 0.0:
            way = turning_way(v0, v, dz, T)
            s[_WAY] = 1.0 if v > 0.0 else -1.0
            s[_EXTREME] = z
        bias = s[SQUARE_BIAS] * sw * sw if derived else 2.0 / 3.0 * sv * sv
        squared = squared_velocity(v0, v, v - v0, T) - T * bias
        s[_WORK] += u0 * dz
        _add(s, squared, way, dz, s[_WAY] > 0.0)
        if s[INERTIA_KNOWN] == 0.0:
            s[_SUMS] = 0.5 * v * v
        _regress(s, s[_WORK] - _stored(s, z, v, x2, v2), way, least)
    s[_LAST], s[_LAST + 1], s[_LAST + 2] = u, z, v


@compiled(inline=True)
def _advance(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample into the state, in place."""
    T = s[SAMPLING_TIME]
    # Of the raw position: what a filter leaves of its noise is too smooth to be told from motion
    sw = s[POSITION_NOISE]
    if sw < 0.0 and s[PRINTED] == 0.0:
        sw = _track_noise(s, 0, x, s[COUNT] + s[_KNOWN])
    if s[DERIVED] > 0.0:
        # Effort and positions through the same causal filter, one sample late so that the velocity
        # is a central difference
        if s[_KNOWN] == 0.0:
            for place, value in ((0, u), (2, x), (4, x2)):
                s[_FILTER + place] = value
                s[_FILTER + place + 1] = value
        uf = _low_pass(s, _FILTER, u)
        xf = _low_pass(s, _FILTER + 2, x)
        x2f = _low_pass(s, _FILTER + 4, x2)
        known = s[_KNOWN]
        u, x, x2 = s[_EARLIER], s[_EARLIER + 1], s[_EARLIER + 2]
        v, v2 = 0.5 * (xf - s[_EARLIER + 4]) / T, 0.5 * (x2f - s[_EARLIER + 5]) / T
        for place in range(3):
            s[_EARLIER + 3 + place] = s[_EARLIER + place]
        s[_EARLIER], s[_EARLIER + 1], s[_EARLIER + 2] = uf, xf, x2f
        if known < 2.0:
            s[_KNOWN] += 1.0
            return
    if s[PRINTED] > 0.0:
        _printed_step(s, u, x, v, x2, v2)
    else:
        _held_step(s, u, x, v, x2, v2, sw)
    s[COUNT] += 1.0


@compiled()
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


def covariance_in(state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
    """Return P from a state; infinite for a parameter that no row has told about yet."""
    p = int(state[PARAMETERS])
    spread = state[SPREAD : SPREAD + p * p].reshape(p, p).copy()
    unknown = np.flatnonzero(state[FIRST_SPREAD : FIRST_SPREAD + p] == 0.0)
    spread[unknown, unknown] = np.inf
    return spread
