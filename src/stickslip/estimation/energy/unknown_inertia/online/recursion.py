"""Online energy balance with an unknown inertia: kernels that take one sample at a time.

- A sample passes `stickslip.estimation.online.faults.admission` first. The balance is an integral:
  after a gap, a step of the position or an unknown force its level is not known, and begins again.
- A row whose innovation is more than `GATE` times its usual variance is explained by an unknown
  force: the level begins again there, and nothing is learned from it.
- Without a given force noise, the variance of the random walk follows the correlation of
  neighbouring innovations, which is zero in an optimal filter (R. K. Mehra 1970, "On the
  identification of variances and adaptive Kalman filtering", IEEE Trans. Automatic Control 15).
- The information is kept by batches (`stickslip.estimation.online.intervals.batches`), and with
  each of them the last valid state (`stickslip.estimation.online.faults.guard`).
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.balance import squared_velocity, turning_distance
from stickslip.estimation.energy.unknown_inertia.online.state import fields
from stickslip.estimation.online.faults.admission import admit, learn_inertia
from stickslip.estimation.online.faults.guard import keep_state, restore_state
from stickslip.estimation.online.faults.unknown_force import (
    ADAPTATION,
    GATE,
    GATE_MEMORY,
    PLAUSIBLE,
)
from stickslip.estimation.online.intervals.batches import close_batch, count_sample
from stickslip.estimation.online.intervals.contrasts import add_row, classify
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import stribeck_left, update
from stickslip.estimation.signals.observation import HYSTERESIS

_SETTLING = 16.0  # samples before the noise is known well enough to detect motion
_NOISE_MEMORY = 256.0  # samples that the running noise estimate looks back
_THIRD_DIFFERENCE = 20.0  # variance of the third difference of unit white noise
_FIRST_RATIO = 1e-2
"""Variance of the walk in a typical row over that of a level, at the start. Small, as differences
of levels with a noisy velocity hide the inertia, and the innovations then look like a walk."""
_LARGEST_RATIO = 1e3  # the same at most: beyond it the rows are differences of levels
_LEAST_RATIO = 1e-6  # the same at least: the constant then holds for 1000 rows
_ADAPTATION_GAIN = 4.0  # change of the logarithm for a correlation of 1, at first
_LEAST_GAIN = 0.2  # the same after many adaptations
_LARGEST_NOISE = 6e-3
"""Share of the sensors' noise in the squared kinetic energy of the rows, beyond which the rows span
longer distances: such a share of noise lowers an estimated inertia by as much."""
_SMOOTHER = 0.3  # change of the ratio then
_WAITING = 4.0  # blocks of rows before the first one: innovations of a first guess are all alike


@compiled(inline=True)
def _low_pass(pole: float, stages: Any, value: float) -> float:
    """Return a value through two equal first-order stages."""
    stages[0] = pole * stages[0] + (1.0 - pole) * value
    stages[1] = pole * stages[1] + (1.0 - pole) * stages[0]
    return stages[1]


@compiled(inline=True)
def _track_noise(tracked: Any, value: float) -> float:
    """Return the running standard deviation of the noise on a signal, from third differences."""
    last = tracked.differences
    first = value - last[0]
    second = first - last[1]
    third = second - last[2]
    last[0], last[1], last[2] = value, first, second
    tracked.samples += 1.0
    if tracked.samples > 3.0:
        tracked.differences_seen += 1.0
        weight = max(1.0 / tracked.differences_seen, 1.0 / _NOISE_MEMORY)
        tracked.roughness += weight * (third * third - tracked.roughness)
    return np.sqrt(tracked.roughness / _THIRD_DIFFERENCE)


@compiled(inline=True)
def _begin_level(own: Any) -> None:
    """Begin the balance again: its level is not known after an unknown force."""
    own.chain, own.heading, own.accepted = 0.0, 0.0, 0.0
    own.travel, own.averaged = 0.0, 0.0
    own.work, own.last_error = 0.0, 0.0
    own.sums[:] = 0.0


@compiled(inline=True)
def _begin_motion(own: Any) -> None:
    """Begin motion and balance again, after a gap; what was learned stays."""
    _begin_level(own)
    own.filtered_samples, own.unknown = 0.0, 0.0
    own.tracked[0].samples = own.tracked[1].samples = 0.0


@compiled(inline=True)
def _adapt(own: Any, error: float) -> None:
    """Take a normalised innovation; let the ratio of walk and level follow their correlation.

    With the variance R of a level, Q of the walk per squared travel, and w^2 the mean squared
    travel of a row, log(Q w^2 / R) += gain c with c = sum nu_k nu_k-1 / sum nu_k^2: neighbouring
    innovations agree where the walk is larger than Q, and have opposite signs where it is smaller.
    R + Q w^2 stays the same, so that rows before and after weigh alike.
    """
    own.rows += 1.0
    weight = max(1.0 / own.rows, GATE_MEMORY)
    own.gate_scale += weight * (error * error - own.gate_scale)
    if own.adaptations == 0.0:
        return
    own.products += error * own.last_error
    own.squares += error * error
    own.travel_square += (own.travel * own.travel - own.travel_square) / own.rows
    own.last_error = error
    own.block_rows += 1.0
    if own.block_rows < ADAPTATION:
        return
    gain = max(_ADAPTATION_GAIN / np.sqrt(own.adaptations), _LEAST_GAIN)
    if own.adaptations <= _WAITING:
        gain = 0.0
    change = np.exp(gain * own.products / own.squares) if own.squares > 0.0 else 1.0
    if own.noise_squares > _LARGEST_NOISE * own.kinetic_squares:
        change = _SMOOTHER
    own.noise_squares, own.kinetic_squares = 0.0, 0.0
    ratio = own.force_variance / own.level_variance * own.travel_square
    if own.adaptations == 1.0:
        ratio = _FIRST_RATIO
    ratio = min(max(change * ratio, _LEAST_RATIO), _LARGEST_RATIO)
    total = own.row_variance
    own.level_variance = total / (1.0 + ratio)
    own.force_variance = total * ratio / (1.0 + ratio) / own.travel_square
    own.adaptations += 1.0
    own.block_rows, own.products, own.squares = 0.0, 0.0, 0.0


@compiled(inline=True)
def _normalised(own: Any, p: int, y: float) -> float:
    """Return the innovation e = y - W' theta of the row over its deviation, sqrt(1 + W' P W)."""
    e, g = y, 0.0
    for i in range(p):
        e -= own.recursion.row[i] * own.recursion.values[i]
        for j in range(p):
            g += own.recursion.row[i] * own.recursion.spread[i, j] * own.recursion.row[j]
    return e / np.sqrt(1.0 + max(g, 0.0))


@compiled(inline=True)
def _regress(s: State, level: float, travel: float, least: float, v: float, sv: float) -> None:
    """Take the levels as they stand into the estimate, unless the axis rests.

    A row is accepted only when the axis has got further than the noise since the last one: at rest
    nothing is learned, and nothing forgotten. It holds the means over the samples since then, so
    that none is lost. The constant in the level is followed by the Kalman filter of a random walk
    whose steps are a disturbing force times the travel. ``v`` is the velocity, and ``sv`` its
    noise.
    """
    own = fields(s)
    means, constants = own.means, own.constants
    p = own.recursion.parameters
    forgetting = own.recursion.forgetting
    groups = classify(own.contrasts, v)
    own.travel += travel  # with its sign, so that noise does not add up
    own.averaged += 1.0
    share = 1.0 / own.averaged
    means[0] += share * (level - means[0])
    for j in range(p):
        means[1 + j] += share * (own.sums[j] - means[1 + j])
    if own.accepted > 0.0 and abs(own.extreme - own.mark) <= least:
        return
    own.mark = own.extreme
    begins = own.accepted == 0.0
    if not begins:
        step = own.force_variance * own.travel * own.travel
        if own.adaptations == 1.0:
            step = _FIRST_RATIO * own.level_variance
        spread = own.constant_spread / forgetting + step
        variance = spread + own.level_variance
        K = spread / variance
        scale = 1.0 / np.sqrt(variance)
        y = (means[0] - constants[0]) * scale
        for j in range(p):
            own.recursion.row[j] = (means[1 + j] - constants[1 + j]) * scale
        own.kinetic_squares += (means[1] - constants[1]) ** 2
        own.noise_squares += v * v * sv * sv / own.averaged
        error = _normalised(own, p, y)
        limit = GATE * own.gate_scale
        begins = own.rows >= ADAPTATION and error * error > limit
        if begins:
            own.force_events += 1.0
            own.gate_scale += GATE_MEMORY * (limit - own.gate_scale)
            own.last_error = 0.0
        else:
            for j in range(p + 1):
                constants[j] += K * (means[j] - constants[j])
            own.constant_spread = K * own.level_variance
            update(own.recursion, y, forgetting, False)
            add_row(own, groups, y)
            _adapt(own, error)
            if count_sample(own.batches):
                _close_batch(s)
    if begins:
        for j in range(p + 1):
            constants[j] = means[j]
        own.constant_spread = own.level_variance
    own.travel = 0.0
    own.averaged = 0.0
    own.accepted += 1.0


@compiled(inline=True)
def _is_plausible(own: Any, p: int) -> bool:
    """Return whether Coulomb friction and offset are within `PLAUSIBLE` times the efforts."""
    largest = own.admission.largest_effort
    for i in range(3 if own.recursion.per_direction > 0 else 2, p):
        variance = max(own.recursion.spread[i, i], 0.0) * own.gate_scale
        if not abs(own.recursion.values[i]) <= PLAUSIBLE * (largest + np.sqrt(variance)):
            return False
    return True


@compiled(inline=True)
def _close_batch(s: State) -> None:
    """Keep the information and the state, or return to the last valid one.

    The sums are taken from the constants on, so that they stay small however long the axis runs.
    """
    own = fields(s)
    p = own.recursion.parameters
    own.work -= own.constants[0]
    own.constants[0] = 0.0
    for j in range(1, p):  # not the kinetic energy, which is no sum
        own.sums[j] -= own.constants[1 + j]
        own.constants[1 + j] = 0.0
    if not _is_plausible(own, p) or not keep_state(s, own.guard):
        _reset(s)
        return
    close_batch(own.batches, own.information, own.eta)
    mass, variance = own.recursion.values[0], own.recursion.spread[0, 0] * own.gate_scale
    learn_inertia(own.admission, mass, variance)


@compiled(inline=True)
def _reset(s: State) -> None:
    """Return to the last valid estimates; the motion begins again."""
    own = fields(s)
    restore_state(s, own.guard)
    _begin_motion(own)


@compiled(inline=True)
def _mean_left(own: Any, v0: float, v: float) -> float:
    """Return the mean share of the Stribeck effect over the travel of a sample (Simpson's rule)."""
    if own.recursion.stribeck_velocity == 0.0:
        return 0.0
    middle = 0.5 * (v0 + v)
    travel = abs(v0) + 4.0 * abs(middle) + abs(v)
    share = abs(v0) * stribeck_left(own.recursion, v0) + abs(v) * stribeck_left(own.recursion, v)
    share += 4.0 * abs(middle) * stribeck_left(own.recursion, middle)
    return share / travel if travel > 0.0 else 1.0


@compiled(inline=True)
def _add_friction(
    own: Any, squared: float, travel: float, displacement: float, left: float
) -> None:
    """Add one sample's share to the friction regressors (Eq. 4.3).

    ``squared`` is the integral of the squared velocity, ``left`` the mean share of the Stribeck
    effect over the travel.
    """
    sums = own.sums  # behind the kinetic energy of a unit inertia
    if own.recursion.per_direction > 0:
        side = 0 if own.heading > 0.0 else 1
        sums[1 + side] += squared
        sums[3 + side] += travel
        return
    sums[1] += squared
    sums[2] += travel * (1.0 - left)
    k = 3
    if own.recursion.stribeck_velocity > 0.0:
        sums[k] += travel * left
        k += 1
    if own.recursion.has_offset > 0:
        sums[k] += displacement


@compiled(inline=True)
def _held_step(s: State, u: float, x: float, v: float, x2: float, v2: float, sw: float) -> None:
    """Take one sample, its position known to sw, by the form that is exact under a held effort."""
    own = fields(s)
    T = own.recursion.sampling_time
    derived = own.recursion.differentiates > 0
    sv = 0.0
    if not derived:
        sv = own.velocity_noise
        if sv < 0.0:
            sv = _track_noise(own.tracked[1], v)
    estimated = own.position_noise < 0.0 or (not derived and own.velocity_noise < 0.0)
    own.chain += 1.0
    if own.chain <= own.settle or (estimated and own.recursion.samples < _SETTLING):
        own.extreme = x
        own.mark = x
        z = x
    else:
        u0, z0, v0 = own.last_effort, own.last_position, own.last_velocity
        # Fuse: the position goes on by the velocities, corrected by a steady Kalman gain
        gain = 1.0
        if sw > 0.0 and not derived:
            q = (T * sv / sw) * (T * sv / sw)
            predicted = 0.5 * (q + np.sqrt(q * q + 4.0 * q))
            gain = predicted / (predicted + 1.0)
        carried = z0 + 0.5 * T * (v0 + v)
        z = carried + gain * (x - carried)
        least = HYSTERESIS * sw * np.sqrt(gain)
        dz = z - z0
        travel = own.heading * dz
        # The sign of a velocity means something only beyond its own noise and that of the position
        noisy = max(least, HYSTERESIS * T * sv) > 0.5 * T * (abs(v0) + abs(v))
        if own.heading == 0.0:
            if abs(z - own.extreme) > least:
                own.heading = 1.0 if z > own.extreme else -1.0
                travel = abs(z - own.extreme)
                own.extreme = z
        elif own.heading * (z - own.extreme) >= 0.0:
            own.extreme = z
        elif own.heading * (own.extreme - z) > least:
            # Reversed at the furthest point: what was counted back since then was travel forward
            travel += 2.0 * abs(own.extreme - z)
            own.heading = -own.heading
            own.extreme = z
        if not noisy and v0 * v < 0.0:
            travel = turning_distance(v0, v, dz, T)
            own.heading = 1.0 if v > 0.0 else -1.0
            own.extreme = z
        bias = own.square_bias * sw * sw if derived else 2.0 / 3.0 * sv * sv
        squared = squared_velocity(v0, v, v - v0, T) - T * bias
        own.work += u0 * dz
        _add_friction(own, squared, travel, dz, _mean_left(own, v0, v))
        own.sums[0] = 0.5 * v * v
        if derived:
            sv = np.sqrt(own.square_bias) * sw
        # Energy of the load and of the spring (Eqs. 3.7, 3.8 with its squares)
        kinetic = 0.5 * own.recursion.load_inertia * v2 * v2
        stored = kinetic + 0.5 * own.recursion.stiffness * (z - x2) * (z - x2)
        _regress(s, own.work - stored, travel, least, v, sv)
    own.last_effort, own.last_position, own.last_velocity = u, z, v


@compiled(inline=True)
def _advance(s: State, u: float, x: float, v: float, x2: float, v2: float) -> None:
    """Take one sample into the state, in place."""
    own = fields(s)
    ready, u, unknown, x, v, x2, v2, stepped = admit(own.admission, u, x, v, x2, v2)
    if not ready:
        return
    derived = own.recursion.differentiates > 0
    if derived:
        v, v2 = 0.0, 0.0
    if own.recursion.stiffness == 0.0:
        x2, v2 = 0.0, 0.0
    missing = np.isnan(x + v + x2 + v2)
    if stepped or missing:
        _begin_motion(own)
    if missing:
        return
    if own.unknown > 0.0:
        _begin_level(own)
    own.unknown = 1.0 if unknown else 0.0
    # Of the raw position: what a filter leaves of its noise looks like motion
    sw = own.position_noise
    if sw < 0.0:
        sw = _track_noise(own.tracked[0], x)
    if derived:
        # Effort and positions through the same causal filter, delayed by a sample, so that the
        # velocity is a central difference
        T, pole, stages = own.recursion.sampling_time, own.pole, own.stages
        last, earlier = own.filtered, own.earlier
        if own.filtered_samples == 0.0:
            stages[0, 0] = stages[0, 1] = u
            stages[1, 0] = stages[1, 1] = x
            stages[2, 0] = stages[2, 1] = x2
        uf = _low_pass(pole, stages[0], u)
        xf = _low_pass(pole, stages[1], x)
        x2f = _low_pass(pole, stages[2], x2)
        u, x, x2 = last.effort, last.position, last.load_position
        v = 0.5 * (xf - earlier.position) / T
        v2 = 0.5 * (x2f - earlier.load_position) / T
        earlier.effort, earlier.position, earlier.load_position = u, x, x2
        last.effort, last.position, last.load_position = uf, xf, x2f
        if own.filtered_samples < 2.0:
            own.filtered_samples += 1.0
            return
    _held_step(s, u, x, v, x2, v2, sw)
    own.recursion.samples += 1
    total = own.work + own.constant_spread
    for i in range(own.recursion.parameters):
        total += own.recursion.values[i]
    if not np.isfinite(total):
        _reset(s)


@compiled(brief=True)
def energy_step(s: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into the state, in place; return whether all that is measured was finite."""
    own = fields(s)
    whole = np.isfinite(u + x)
    if own.recursion.differentiates == 0:
        whole = whole and np.isfinite(v)
    if own.recursion.stiffness > 0.0:
        whole = whole and np.isfinite(x2)
        if own.recursion.differentiates == 0:
            whole = whole and np.isfinite(v2)
    _advance(s, u, x, v, x2, v2)
    return whole


@compiled()
def energy_run(
    state: State, samples: Float[np.ndarray, "n 5"]
) -> tuple[State, Float[np.ndarray, "n p"]]:
    """Return the state after many samples, and the estimates after each."""
    s = state.copy()
    own = fields(s)
    n, p = samples.shape[0], own.recursion.parameters
    history = np.empty((n, p))
    for k in range(n):
        _advance(s, samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4])
        for j in range(p):
            history[k, j] = own.recursion.values[j]
    return s, history
