"""Online energy balance with an unknown inertia: kernels that take one sample at a time.

- A sample passes `stickslip.estimation.online.faults.admission` first. The balance is an integral:
  after a gap, a step of the position or an unknown force its level is not known, and begins again.
- A row whose innovation is more than `_GATE` times its usual variance is explained by an unknown
  force: the level begins again there, and nothing is learned from it.
- Without a given force noise, the variance of the random walk follows the correlation of
  neighbouring innovations, which is zero in an optimal filter (R. K. Mehra 1970, "On the
  identification of variances and adaptive Kalman filtering", IEEE Trans. Automatic Control 15).
- The information is kept by batches (`stickslip.estimation.online.intervals.batches`), and with
  each of them the last valid state (`stickslip.estimation.online.faults.guard`).
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.balance import squared_velocity, turning_way
from stickslip.estimation.energy.unknown_inertia.online.layout import (
    ACCEPTED,
    ADAPTED,
    AVERAGED,
    BATCHES,
    CHAIN,
    CONSTANT,
    CONSTANT_SPREAD,
    CONTRASTS,
    DIFFERENCES,
    EARLIER,
    EXTREME,
    FILTER,
    FORCE_EVENTS,
    FORCE_VARIANCE,
    GATE_SCALE,
    GUARD,
    HYSTERESIS,
    IN_BLOCK,
    INFORMATION,
    KINETIC_SQUARES,
    KNOWN,
    LAST,
    LAST_ERROR,
    LEVEL_VARIANCE,
    MARK,
    MEAN,
    NOISE_SQUARES,
    POLE,
    POSITION_NOISE,
    PRODUCTS,
    ROUGHNESS,
    ROW_VARIANCE,
    ROWS,
    SETTLE,
    SINCE,
    SQUARE_BIAS,
    SQUARES,
    SUMS,
    TRACKED,
    UNKNOWN,
    VELOCITY_NOISE,
    WAY,
    WAY_SQUARE,
    WORK,
    admission,
)
from stickslip.estimation.online.faults.admission import (
    admit,
    learn_inertia,
)
from stickslip.estimation.online.faults.guard import keep_state, restore_state
from stickslip.estimation.online.intervals.batches import close_batch, count_sample
from stickslip.estimation.online.intervals.contrasts import add_row, classify
from stickslip.estimation.online.recursion import (
    COUNT,
    DERIVED,
    FORGETTING,
    LOAD_INERTIA,
    MOST_PARAMETERS,
    OFFSET,
    PARAMETERS,
    PER_DIRECTION,
    ROW,
    SAMPLING_TIME,
    SPREAD,
    STIFFNESS,
    STRIBECK,
    VALUES,
    stribeck_left,
    update,
)

__all__ = ["energy_run", "energy_step"]

_SETTLING = 16.0  # samples before the noise is known well enough to detect motion
_NOISE_MEMORY = 256.0  # samples that the running noise estimate looks back
_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise
_GATE = 64.0  # squared innovation over its usual variance beyond which there was an unknown force
_GATE_MEMORY = 1.0 / 256.0  # weight of a row in the running mean that scales the gate
_ADAPTATION = 64.0  # rows from one adaptation of the force variance to the next
_FIRST_RATIO = 1e-2
"""Variance of the walk in a typical row over that of a level, at the start. Small, as differences
of levels with a noisy velocity hide the inertia, and the innovations then look like a walk."""
_LARGEST_RATIO = 1e3  # the same at most: beyond it the rows are differences of levels
_LEAST_RATIO = 1e-6  # the same at least: the constant then holds for 1000 rows
_ADAPTATION_GAIN = 4.0  # change of the logarithm for a correlation of 1, at first
_LEAST_GAIN = 0.2  # the same after many adaptations
_LARGEST_NOISE = 6e-3
"""Share of the sensors' noise in the squared kinetic energy of the rows, beyond which the rows span
longer ways: such a share of noise lowers an estimated inertia by as much."""
_SMOOTHER = 0.3  # change of the ratio then
_WAITING = 4.0  # blocks of rows before the first one: innovations of a first guess are all alike
_PLAUSIBLE = 5.0
"""Friction over the largest effort beyond which an estimate is not plausible."""


@compiled(inline=True)
def _low_pass(s: Float[np.ndarray, " s"], place: int, value: float) -> float:
    """Return a value through two equal first-order stages at the given place of the state."""
    pole = s[POLE]
    s[place] = pole * s[place] + (1.0 - pole) * value
    s[place + 1] = pole * s[place + 1] + (1.0 - pole) * s[place]
    return s[place + 1]


@compiled(inline=True)
def _track_noise(s: Float[np.ndarray, " s"], which: int, value: float) -> float:
    """Return the running standard deviation of the noise on a signal, from third differences."""
    place = DIFFERENCES + 3 * which
    first = value - s[place]
    second = first - s[place + 1]
    third = second - s[place + 2]
    s[place], s[place + 1], s[place + 2] = value, first, second
    tracked = TRACKED + 2 * which
    s[tracked] += 1.0
    if s[tracked] > 3.0:
        s[tracked + 1] += 1.0
        weight = max(1.0 / s[tracked + 1], 1.0 / _NOISE_MEMORY)
        s[ROUGHNESS + which] += weight * (third * third - s[ROUGHNESS + which])
    return np.sqrt(s[ROUGHNESS + which] / _THIRD_DIFFERENCE)


@compiled(inline=True)
def _begin_level(s: Float[np.ndarray, " s"]) -> None:
    """Begin the balance again: its level is not known after an unknown force."""
    s[CHAIN], s[WAY], s[ACCEPTED] = 0.0, 0.0, 0.0
    s[SINCE], s[AVERAGED] = 0.0, 0.0
    s[WORK], s[LAST_ERROR] = 0.0, 0.0
    for j in range(MOST_PARAMETERS):
        s[SUMS + j] = 0.0


@compiled(inline=True)
def _begin_motion(s: Float[np.ndarray, " s"]) -> None:
    """Begin motion and balance again, after a gap; what was learned stays."""
    _begin_level(s)
    s[KNOWN], s[UNKNOWN] = 0.0, 0.0
    s[TRACKED], s[TRACKED + 2] = 0.0, 0.0


@compiled(inline=True)
def _adapt(s: Float[np.ndarray, " s"], error: float) -> None:
    """Take a normalised innovation; let the ratio of walk and level follow their correlation.

    With the variance R of a level, Q of the walk per squared way, and w^2 the mean squared way of a
    row, log(Q w^2 / R) += gain c with c = sum nu_k nu_k-1 / sum nu_k^2: neighbouring innovations
    agree where the walk is larger than Q, and have opposite signs where it is smaller. R + Q w^2
    stays the same, so that rows before and after weigh alike.
    """
    s[ROWS] += 1.0
    weight = max(1.0 / s[ROWS], _GATE_MEMORY)
    s[GATE_SCALE] += weight * (error * error - s[GATE_SCALE])
    if s[ADAPTED] == 0.0:
        return
    s[PRODUCTS] += error * s[LAST_ERROR]
    s[SQUARES] += error * error
    s[WAY_SQUARE] += (s[SINCE] * s[SINCE] - s[WAY_SQUARE]) / s[ROWS]
    s[LAST_ERROR] = error
    s[IN_BLOCK] += 1.0
    if s[IN_BLOCK] < _ADAPTATION:
        return
    gain = max(_ADAPTATION_GAIN / np.sqrt(s[ADAPTED]), _LEAST_GAIN)
    if s[ADAPTED] <= _WAITING:
        gain = 0.0
    change = np.exp(gain * s[PRODUCTS] / s[SQUARES]) if s[SQUARES] > 0.0 else 1.0
    if s[NOISE_SQUARES] > _LARGEST_NOISE * s[KINETIC_SQUARES]:
        change = _SMOOTHER
    s[NOISE_SQUARES], s[KINETIC_SQUARES] = 0.0, 0.0
    ratio = s[FORCE_VARIANCE] / s[LEVEL_VARIANCE] * s[WAY_SQUARE]
    if s[ADAPTED] == 1.0:
        ratio = _FIRST_RATIO
    ratio = min(max(change * ratio, _LEAST_RATIO), _LARGEST_RATIO)
    total = s[ROW_VARIANCE]
    s[LEVEL_VARIANCE] = total / (1.0 + ratio)
    s[FORCE_VARIANCE] = total * ratio / (1.0 + ratio) / s[WAY_SQUARE]
    s[ADAPTED] += 1.0
    s[IN_BLOCK], s[PRODUCTS], s[SQUARES] = 0.0, 0.0, 0.0


@compiled(inline=True)
def _normalised(s: Float[np.ndarray, " s"], p: int, y: float) -> float:
    """Return the innovation e = y - W' theta of the row over its deviation, sqrt(1 + W' P W)."""
    e, g = y, 0.0
    for i in range(p):
        e -= s[ROW + i] * s[VALUES + i]
        for j in range(p):
            g += s[ROW + i] * s[SPREAD + i * p + j] * s[ROW + j]
    return e / np.sqrt(1.0 + max(g, 0.0))


@compiled(inline=True)
def _regress(
    s: Float[np.ndarray, " s"], level: float, way: float, least: float, v: float, sv: float
) -> None:
    """Take the levels as they stand into the estimate, unless the axis rests.

    A row is accepted only when the axis has got further than the noise since the last one: at rest
    nothing is learned, and nothing forgotten. It holds the means over the samples since then, so
    that none is lost. The constant in the level is followed by the Kalman filter of a random walk
    whose steps are a disturbing force times the way. ``v`` is the velocity, and ``sv`` its noise.
    """
    p = int(s[PARAMETERS])
    forgetting = s[FORGETTING]
    groups = classify(s, CONTRASTS, v)
    s[SINCE] += way  # with its sign, so that noise does not add up
    s[AVERAGED] += 1.0
    share = 1.0 / s[AVERAGED]
    s[MEAN] += share * (level - s[MEAN])
    for j in range(p):
        s[MEAN + 1 + j] += share * (s[SUMS + j] - s[MEAN + 1 + j])
    if s[ACCEPTED] > 0.0 and abs(s[EXTREME] - s[MARK]) <= least:
        return
    s[MARK] = s[EXTREME]
    begins = s[ACCEPTED] == 0.0
    if not begins:
        step = s[FORCE_VARIANCE] * s[SINCE] * s[SINCE]
        if s[ADAPTED] == 1.0:
            step = _FIRST_RATIO * s[LEVEL_VARIANCE]
        spread = s[CONSTANT_SPREAD] / forgetting + step
        variance = spread + s[LEVEL_VARIANCE]
        K = spread / variance
        scale = 1.0 / np.sqrt(variance)
        y = (s[MEAN] - s[CONSTANT]) * scale
        for j in range(p):
            s[ROW + j] = (s[MEAN + 1 + j] - s[CONSTANT + 1 + j]) * scale
        s[KINETIC_SQUARES] += (s[MEAN + 1] - s[CONSTANT + 1]) ** 2
        s[NOISE_SQUARES] += v * v * sv * sv / s[AVERAGED]
        error = _normalised(s, p, y)
        limit = _GATE * s[GATE_SCALE]
        begins = s[ROWS] >= _ADAPTATION and error * error > limit
        if begins:
            s[FORCE_EVENTS] += 1.0
            s[GATE_SCALE] += _GATE_MEMORY * (limit - s[GATE_SCALE])
            s[LAST_ERROR] = 0.0
        else:
            s[CONSTANT] += K * (s[MEAN] - s[CONSTANT])
            for j in range(p):
                s[CONSTANT + 1 + j] += K * (s[MEAN + 1 + j] - s[CONSTANT + 1 + j])
            s[CONSTANT_SPREAD] = K * s[LEVEL_VARIANCE]
            update(s, y, forgetting, False)
            add_row(s, INFORMATION, CONTRASTS, MOST_PARAMETERS, groups, y)
            _adapt(s, error)
            if count_sample(s, BATCHES):
                _close_batch(s)
    if begins:
        for j in range(p + 1):
            s[CONSTANT + j] = s[MEAN + j]
        s[CONSTANT_SPREAD] = s[LEVEL_VARIANCE]
    s[SINCE] = 0.0
    s[AVERAGED] = 0.0
    s[ACCEPTED] += 1.0


@compiled(inline=True)
def _is_plausible(s: Float[np.ndarray, " s"], p: int) -> bool:
    """Return whether Coulomb friction and offset are within `_PLAUSIBLE` times the efforts."""
    largest = admission(s).largest_effort
    for i in range(3 if s[PER_DIRECTION] > 0.0 else 2, p):
        variance = max(s[SPREAD + i * p + i], 0.0) * s[GATE_SCALE]
        if not abs(s[VALUES + i]) <= _PLAUSIBLE * (largest + np.sqrt(variance)):
            return False
    return True


@compiled(inline=True)
def _close_batch(s: Float[np.ndarray, " s"]) -> None:
    """Keep the information and the state, or return to the last valid one.

    The sums are taken from the constants on, so that they stay small however long the axis runs.
    """
    p = int(s[PARAMETERS])
    s[WORK] -= s[CONSTANT]
    s[CONSTANT] = 0.0
    for j in range(1, p):  # not the kinetic energy, which is no sum
        s[SUMS + j] -= s[CONSTANT + 1 + j]
        s[CONSTANT + 1 + j] = 0.0
    if not _is_plausible(s, p) or not keep_state(s, GUARD, GUARD):
        _reset(s)
        return
    at = INFORMATION + MOST_PARAMETERS
    J = s[at:GUARD].reshape(MOST_PARAMETERS, MOST_PARAMETERS)
    close_batch(s, BATCHES, MOST_PARAMETERS, J, s[INFORMATION:at])
    learn_inertia(admission(s), s[VALUES], s[SPREAD] * s[GATE_SCALE])


@compiled(inline=True)
def _reset(s: Float[np.ndarray, " s"]) -> None:
    """Return to the last valid estimates; the motion begins again."""
    restore_state(s, GUARD, GUARD)
    _begin_motion(s)


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
            sv = _track_noise(s, 1, v)
    estimated = s[POSITION_NOISE] < 0.0 or (not derived and s[VELOCITY_NOISE] < 0.0)
    s[CHAIN] += 1.0
    if s[CHAIN] <= s[SETTLE] or (estimated and s[COUNT] < _SETTLING):
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
        if derived:
            sv = np.sqrt(s[SQUARE_BIAS]) * sw
        _regress(s, s[WORK] - _stored(s, z, x2, v2), way, least, v, sv)
    s[LAST], s[LAST + 1], s[LAST + 2] = u, z, v


@compiled(inline=True)
def _advance(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample into the state, in place."""
    ready, u, unknown, x, v, x2, v2, stepped = admit(admission(s), u, x, v, x2, v2)
    if not ready:
        return
    derived = s[DERIVED] > 0.0
    if derived:
        v, v2 = 0.0, 0.0
    if s[STIFFNESS] == 0.0:
        x2, v2 = 0.0, 0.0
    missing = np.isnan(x + v + x2 + v2)
    if stepped or missing:
        _begin_motion(s)
    if missing:
        return
    if s[UNKNOWN] > 0.0:
        _begin_level(s)
    s[UNKNOWN] = 1.0 if unknown else 0.0
    T = s[SAMPLING_TIME]
    # Of the raw position: what a filter leaves of its noise looks like motion
    sw = s[POSITION_NOISE]
    if sw < 0.0:
        sw = _track_noise(s, 0, x)
    if derived:
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
    total = s[WORK] + s[CONSTANT_SPREAD]
    for i in range(int(s[PARAMETERS])):
        total += s[VALUES + i]
    if not np.isfinite(total):
        _reset(s)


@compiled(brief=True)
def energy_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all that is measured was finite."""
    whole = np.isfinite(u + x)
    if s[DERIVED] == 0.0:
        whole = whole and np.isfinite(v)
    if s[STIFFNESS] > 0.0:
        whole = whole and np.isfinite(x2)
        if s[DERIVED] == 0.0:
            whole = whole and np.isfinite(v2)
    _advance(s, u, x, v, x2, v2)
    return whole


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
