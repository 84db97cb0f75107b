"""The balance of work on line: kernels that take one sample at a time.

The same two filters as offline, one after the other:
`stickslip.estimation.energy.known_inertia.online.motion` gives the direction of friction, and the
filter here whitens the balance, `LAG` samples late. Its rows go into the recursion.

The prediction and the update of its covariance are those of `stickslip.numerics.kalman`, written
out for four states. With the functions from there the estimates are identical, but a sample takes
40 % longer (15 % with the update alone): the state is one array, and no intermediate result stays
in a register.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.known_inertia.online.layout import (
    ADAPTED,
    AXIS,
    BATCHES,
    BEGAN,
    CERTAINTIES,
    CHAIN,
    CHANNELS,
    CONTRASTS,
    COVARIANCE,
    DEPTH,
    DISTURBANCE,
    EARLIER_VELOCITY,
    FORCE_EVENTS,
    FORCES,
    FREE,
    FRICTION,
    GATE_SCALE,
    GUARD,
    HEADING,
    INERTIA,
    INFORMATION,
    KEPT_EFFORT,
    KEPT_STRETCH,
    KEPT_UNKNOWN,
    LAG,
    MISMATCH,
    MISMATCHED,
    MOST,
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
    SQUARES,
    TALLIED,
    TURNS,
    UNCERTAIN,
    WIDTH,
    admission,
)
from stickslip.estimation.energy.known_inertia.online.motion import (
    compare,
    innovate,
    predict,
    refresh,
    smoothed_velocity,
    tally,
)
from stickslip.estimation.online.faults.admission import admit
from stickslip.estimation.online.faults.guard import keep_state, restore_state
from stickslip.estimation.online.intervals.batches import close_batch, count_sample, scale_batches
from stickslip.estimation.online.intervals.contrasts import add_row, classify, scale_contrasts
from stickslip.estimation.online.recursion import (
    COUNT,
    FIRST_SPREAD,
    FORGETTING,
    LOAD_INERTIA,
    PARAMETERS,
    PER_DIRECTION,
    RELATIVE_PRIOR,
    ROW,
    SAMPLING_TIME,
    SPREAD,
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

_GATE = 64.0  # squared innovation over its variance beyond which there was an unknown force
_GATE_MEMORY = 1.0 / 256.0  # weight of a row in the running mean that scales the gate
_ADAPTATION = 64.0  # rows from one adaptation of the disturbance force to the next
_LEAST_ADAPTATION = 0.05  # exponent of an adaptation after many of them
_LARGEST_ADAPTATION = 16.0  # factor of an adaptation
_OVERCONFIDENT = 2.0
"""Mismatch beyond which what was learned so far is trusted less, and q follows at once: 1 in 10^5
adaptations exceeds it by chance."""
_PLAUSIBLE = 5.0
"""Friction over the largest effort beyond which an estimate is not plausible."""

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
def _allow_unknown_force(s: Float[np.ndarray, " s"], at: int, missing: int) -> None:
    """Let an unknown force explain an innovation of the driven mass that nothing else explains.

    With the friction estimated so far the innovation is e = z - z_0 - sum_j theta_j z_j, with the
    variance S + row P row'. Beyond the gate P of the second filter grows by q B B' with
    q = (e / B)^2: its states follow the measurement, and the row gets next to no weight.
    """
    p = int(s[PARAMETERS])
    limit = _GATE * max(1.0, s[GATE_SCALE])
    for c in range(2):
        if s[SEEN + c] == 0.0 or (missing >> c) & 1 == 1:
            continue
        variance = s[COVARIANCE + 5 * c] + s[NOISE + c]
        e = s[at + 1 + c] - s[RESPONSES + c]
        for j in range(p):
            e -= s[RESPONSES + 4 * (j + 1) + c] * s[VALUES + j]
        if e * e <= limit * variance:
            continue
        for i in range(p):
            for j in range(p):
                row = s[RESPONSES + 4 * (i + 1) + c] * s[RESPONSES + 4 * (j + 1) + c]
                variance += row * s[SPREAD + i * p + j]
        if s[ROWS] == 0.0 or e * e <= limit * variance:
            continue
        q = (e / s[AXIS + 16 + c]) ** 2
        for i in range(4):
            for j in range(4):
                s[COVARIANCE + 4 * i + j] += q * s[AXIS + 16 + i] * s[AXIS + 16 + j]
        s[FORCE_EVENTS] += 1.0
        s[GATE_SCALE] += _GATE_MEMORY * (limit - s[GATE_SCALE])
        s[MISMATCH] += limit
        s[MISMATCHED] += 1.0


@compiled(inline=True)
def _regress(s: Float[np.ndarray, " s"], at: int, certain: bool, groups: int) -> None:
    """Update the second filter with the sample at a place of the ring; its rows are regressed.

    Where the direction of friction is not certain, nothing is forgotten for it.
    """
    p = int(s[PARAMETERS])
    forgetting = s[FORGETTING] if certain else 1.0
    missing = int(s[at + 8])
    if certain:
        _allow_unknown_force(s, at, missing)
    for c in range(CHANNELS):
        if s[SEEN + c] == 0.0 or (missing >> c) & 1 == 1:
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
        add_row(s, INFORMATION, CONTRASTS, MOST, groups, y)
        if certain:
            s[RESIDUALS] += error
            s[ROWS] += 1.0
            s[GATE_SCALE] += _GATE_MEMORY * (error - s[GATE_SCALE])
            s[MISMATCH] += error
            s[MISMATCHED] += 1.0


@compiled(inline=True)
def _adapt(s: Float[np.ndarray, " s"]) -> None:
    """Let the disturbance force follow the innovations: q+ = q (mean e' S^-1 e / size)^gamma.

    The exponent falls from 1 to `_LEAST_ADAPTATION`. If the innovations are larger than expected,
    the information so far was counted too high by their mean square, and is reduced.
    """
    if s[ADAPTED] == 0.0 or s[MISMATCHED] < _ADAPTATION:
        return
    mean = s[MISMATCH] / s[MISMATCHED]
    s[MISMATCH], s[MISMATCHED] = 0.0, 0.0
    gamma = max(_LEAST_ADAPTATION, 1.0 / np.sqrt(s[ADAPTED]))
    if mean > _OVERCONFIDENT:
        gamma = 1.0
    s[ADAPTED] += 1.0
    factor = min(max(mean, 1.0 / _LARGEST_ADAPTATION), _LARGEST_ADAPTATION) ** (0.5 * gamma)
    least = _TRUST * np.sqrt(s[FRICTION])
    s[DISTURBANCE] = max(factor * s[DISTURBANCE], least)
    if s[DISTURBANCE] > np.sqrt(s[FRICTION]):
        # Not even a force as large as friction explains the innovations: the sensors' noise is not
        # as modelled (a velocity differentiated from the same encoder), and no force is sought
        s[DISTURBANCE], s[ADAPTED] = least, 0.0
    if mean > _OVERCONFIDENT:
        p = int(s[PARAMETERS])
        factor = min(mean, _LARGEST_ADAPTATION)
        for i in range(p):  # a given prior holds
            if s[RELATIVE_PRIOR] == 0.0:
                factor = min(factor, s[FIRST_SPREAD + i] / s[SPREAD + i * p + i])
        factor = max(factor, 1.0)
        for i in range(p * p):
            s[SPREAD + i] *= factor
        for i in range(MOST + MOST * MOST):
            s[INFORMATION + i] /= factor
        s[RESIDUALS], s[ROWS] = 1.0, 1.0
        scale_batches(s, BATCHES, MOST, 1.0 / factor)
        scale_contrasts(s, CONTRASTS, MOST, 1.0 / factor)


@compiled(inline=True)
def _close_batch(
    s: Float[np.ndarray, " s"],
    columns: tuple[float, float, float, float, float, float, float, float],
) -> None:
    """Keep the information so far, and the state as valid if its friction is plausible."""
    p = int(s[PARAMETERS])
    friction, variance = 0.0, 0.0
    for i in range(p):
        friction += columns[i] * s[VALUES + i]
        for j in range(p):
            variance += columns[i] * columns[j] * s[SPREAD + i * p + j]
    most = admission(s).largest_effort + np.sqrt(max(variance, 0.0))
    if abs(friction) > _PLAUSIBLE * most or not keep_state(s, GUARD, GUARD):
        _reset(s)
        return
    J = s[INFORMATION + MOST : GUARD].reshape(MOST, MOST)
    close_batch(s, BATCHES, MOST, J, s[INFORMATION : INFORMATION + MOST])


@compiled(inline=True)
def _reset(s: Float[np.ndarray, " s"]) -> None:
    """Return to the last valid estimates; the motion begins again."""
    restore_state(s, GUARD, GUARD)
    s[GATE_SCALE], s[MISMATCH], s[MISMATCHED] = 1.0, 0.0, 0.0
    s[RESIDUALS], s[ROWS] = 1.0, 1.0
    _restart(s)


@compiled(inline=True)
def _restart(s: Float[np.ndarray, " s"]) -> None:
    """Begin the motion again; friction and noise are known as before."""
    s[COUNT], s[REFRESH], s[UNCERTAIN] = 0.0, 0.0, 0.0
    for c in range(CHANNELS):
        s[CHAIN + c], s[SQUARES + c] = 0.0, 0.0


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
    # Mean velocity of a cubic motion: the change of the acceleration follows from the known forces
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
    unknown += s[KEPT_UNKNOWN]
    _propagate(s, u0, unknown)
    for j in range(int(s[PARAMETERS])):
        z = RESPONSES + 4 * (j + 1)
        for i in range(4):
            s[z + i] -= s[AXIS + 16 + i] * columns[j] + s[AXIS + 20 + i] * columns[4 + j]
    certain = direction != 0.0 and s[KEPT_UNKNOWN] == 0.0
    groups = classify(s, CONTRASTS, velocity)
    _regress(s, at, certain, groups)
    if certain:
        _adapt(s)
        if count_sample(s, BATCHES):
            _close_batch(s, columns)


@compiled(inline=True)
def _begin(s: Float[np.ndarray, " s"], oldest: int, last: int, velocity: float) -> None:
    """Begin the second filter with the oldest sample in the ring.

    A load that is not measured begins anywhere, as fast as it likes.
    """
    T = s[SAMPLING_TIME]
    for i in range(4 * (MOST + 1)):
        s[RESPONSES + i] = 0.0
    for i in range(16):
        s[COVARIANCE + i] = 0.0
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
def _noise_known(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether a force has acted and every sensor has shown its noise."""
    known = s[NET] > 0.0
    for c in range(CHANNELS):
        known = known and (s[SEEN + c] == 0.0 or s[TALLIED + c] > 0.0)
    return known


@compiled(inline=True)
def _fill(s: Float[np.ndarray, " s"], before: int, at: int) -> int:
    """Fill missing values of a sample by constant velocity; return which ones were missing."""
    T = s[SAMPLING_TIME]
    missing = 0
    for mass in range(2):
        x, v = 1 + 2 * mass, 2 + 2 * mass
        if s[SEEN + v - 1] == 0.0:
            s[at + v] = 0.0
        elif np.isnan(s[at + v]):
            missing += 1 << (v - 1)
            s[at + v] = s[before + v]
        if s[SEEN + x - 1] == 0.0:
            s[at + x] = s[at + 1]
        elif np.isnan(s[at + x]):
            missing += 1 << (x - 1)
            if s[SEEN + v - 1] > 0.0:
                s[at + x] = s[before + x] + 0.5 * T * (s[before + v] + s[at + v])
            elif mass == 0 and s[REFRESH] > 0.0:
                s[at + x] = s[before + x] + T * s[FREE + 1]
            else:
                s[at + x] = s[before + x]
    return missing


@compiled(inline=True)
def _advance(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> None:
    """Take one sample into the state, in place."""
    ready, u, unknown, x, v, x2, v2, stepped = admit(admission(s), u, x, v, x2, v2)
    if not ready:
        return
    if stepped:
        _restart(s)
    n = int(s[COUNT])
    slot = n % DEPTH
    at = RING + WIDTH * slot
    before = RING + WIDTH * ((n + DEPTH - 1) % DEPTH)
    s[at], s[at + 1], s[at + 2], s[at + 3], s[at + 4] = u, x, v, x2, v2
    missing = _fill(s, before, at)
    if missing > 0 and s[REFRESH] == 0.0:
        _restart(s)  # the filters begin with complete samples
        return
    if _load_unseen(s):
        s[at + 3], s[at + 4] = s[at + 1], s[at + 2]
        # The first filter has the spring's force in the free one
    s[at + 8] = missing
    s[at + 9] = admission(s).largest_effort ** 2 if unknown else 0.0
    for c in range(CHANNELS):
        if (missing >> c) & 1 == 1:
            s[CHAIN + c] = 0.0
        elif s[SEEN + c] > 0.0:
            tally(s, s[at + 1 + c], c)
    net = u - s[STIFFNESS] * (s[at + 1] - s[at + 3])
    s[NET] = max(s[NET], net * net)
    if n > 0:
        compare(s, before, at)
    s[COUNT] += 1.0
    begins = s[REFRESH] == 0.0
    if n < LAG or (begins and not _noise_known(s)):
        return
    first = (n + 1) % DEPTH
    oldest = RING + WIDTH * first
    if begins:
        refresh(s)
        if s[ADAPTED] == 1.0:
            s[DISTURBANCE] = _TRUST * np.sqrt(s[FRICTION])
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
        predict(s, before, at)
        innovate(s, at)
    velocity = smoothed_velocity(s, first)
    if begins:
        _begin(s, oldest, at, velocity)
    else:
        _balance(s, first, velocity)
    s[KEPT_EFFORT] = s[oldest]
    s[KEPT_STRETCH] = s[oldest + 1] - s[oldest + 3]
    s[KEPT_UNKNOWN] = s[oldest + 9]
    s[EARLIER_VELOCITY] = velocity
    if s[REFRESH] > 0.0 and s[TALLIED] >= s[REFRESH]:
        refresh(s)
        s[REFRESH] *= 2.0
    if not _is_valid(s):
        _reset(s)


@compiled(inline=True)
def _is_valid(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether the estimates and the states of both filters are finite."""
    total = s[FREE] + s[FREE + 1] + s[FREE + 2]
    for i in range(4):
        total += s[RESPONSES + i] + s[COVARIANCE + 5 * i]
    for i in range(int(s[PARAMETERS])):
        total += s[VALUES + i]
    return np.isfinite(total)


@compiled(brief=True)
def work_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite.

    Of a sample that is not only the rest is used.
    """
    _advance(s, u, x, v, x2, v2)
    return np.isfinite(u + x + v + x2 + v2)


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
