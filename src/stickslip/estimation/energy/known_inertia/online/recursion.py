"""Second of the two online filters: the balance of work, one sample at a time.

The same two filters as offline, one after the other:
`stickslip.estimation.energy.known_inertia.online.motion` gives the direction of friction, and the
filter here whitens the balance, with a delay of `LAG` samples. Its rows go into the recursion.

The prediction and the update of its covariance are those of `stickslip.numerics.kalman`, written
out for four states. With the functions from there the estimates are identical, but a sample takes
40 % longer (15 % with the update alone): the state is one array, and no intermediate result stays
in a register.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.energy.known_inertia.online.motion import (
    compare,
    count_noise,
    estimate_noise,
    innovate,
    predict,
    refresh,
    smoothed_velocity,
)
from stickslip.estimation.energy.known_inertia.online.state import (
    CHANNELS,
    DEPTH,
    LAG,
    MOST,
    fields,
)
from stickslip.estimation.energy.known_inertia.stretches import CERTAIN
from stickslip.estimation.online.faults.admission import admit
from stickslip.estimation.online.faults.guard import keep_state, restore_state
from stickslip.estimation.online.faults.unknown_force import (
    ADAPTATION,
    GATE,
    GATE_MEMORY,
    OVERCONFIDENT,
    PLAUSIBLE,
    adaptation_exponent,
)
from stickslip.estimation.online.intervals.batches import (
    close_batch,
    count_sample,
    scale_information,
)
from stickslip.estimation.online.intervals.contrasts import add_row, classify
from stickslip.estimation.online.method import State
from stickslip.estimation.online.recursion import stribeck_left, update

_LARGER = 100.0  # how many times what the samples show the variance of a load's first stretch is

_LARGEST_ADAPTATION = 16.0  # factor of an adaptation

_TRUST = 7e-4  # of friction's root mean square: no model is trusted beyond that

_Columns = tuple[float, float, float, float, float, float, float, float]


@compiled(inline=True)
def _friction_columns(own: Any, mean: float, change: float, direction: float) -> _Columns:
    """Return the regressors of the friction force, and their slopes (Eq. 2.1; Stribeck effect).

    ``change`` is that of the velocity over the sample, ``mean`` its mean.
    """
    T = own.recursion.sampling_time
    slope = change / T
    if own.recursion.per_direction > 0:
        if direction > 0.0:
            return mean, 0.0, 1.0, 0.0, slope, 0.0, 0.0, 0.0
        if direction < 0.0:
            return 0.0, mean, 0.0, -1.0, 0.0, slope, 0.0, 0.0
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if direction == 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    if own.recursion.stribeck_velocity > 0.0:
        left = stribeck_left(own.recursion, mean)
        start = stribeck_left(own.recursion, mean - 0.5 * change)
        end = stribeck_left(own.recursion, mean + 0.5 * change)
        fall = direction * (end - start) / T
        return mean, direction * (1.0 - left), direction * left, 1.0, slope, -fall, fall, 0.0
    return mean, direction, 1.0, 0.0, slope, 0.0, 0.0, 0.0


@compiled(inline=True)
def _carried(own: Any, i: int) -> tuple[float, float, float, float]:
    """Return row i of the transition times the covariance."""
    A, P = own.transition[i], own.covariance
    return (
        A[0] * P[0, 0] + A[1] * P[1, 0] + A[2] * P[2, 0] + A[3] * P[3, 0],
        A[0] * P[0, 1] + A[1] * P[1, 1] + A[2] * P[2, 1] + A[3] * P[3, 1],
        A[0] * P[0, 2] + A[1] * P[1, 2] + A[2] * P[2, 2] + A[3] * P[3, 2],
        A[0] * P[0, 3] + A[1] * P[1, 3] + A[2] * P[2, 3] + A[3] * P[3, 3],
    )


@compiled(inline=True)
def _propagate(own: Any, u: float, unknown: float) -> None:
    """Advance the second filter over a sample, with the variance of an unknown force."""
    T, A, P = own.recursion.sampling_time, own.transition, own.covariance
    M = (_carried(own, 0), _carried(own, 1), _carried(own, 2), _carried(own, 3))
    rough = 12.0 / (T * T)
    for i in range(4):
        for j in range(i, 4):
            total = unknown * (own.held[i] * own.held[j] + rough * own.ramped[i] * own.ramped[j])
            for h in range(4):
                total += M[i][h] * A[j, h]
            P[i, j] = total
            P[j, i] = total
    for j in range(own.recursion.parameters + 1):
        z = own.responses[j]
        z0, z1, z2, z3 = z[0], z[1], z[2], z[3]
        for i in range(4):
            z[i] = A[i, 0] * z0 + A[i, 1] * z1 + A[i, 2] * z2 + A[i, 3] * z3
    for i in range(4):
        own.responses[0, i] += own.held[i] * u


@compiled(inline=True)
def _allow_unknown_force(own: Any, sample: Any) -> None:
    """Let an unknown force explain an innovation of the driven mass that nothing else explains.

    With the friction estimated so far the innovation is e = z - z_0 - sum_j theta_j z_j, with the
    variance S + row P row'. Beyond the gate P of the second filter grows by that of a white force
    whose mean has the variance q = (e / B)^2: its states follow the measurement, and the row gets
    next to no weight.
    """
    p = own.recursion.parameters
    rough = 12.0 / own.recursion.sampling_time**2
    limit = GATE * max(1.0, own.gate_scale)
    for c in range(2):
        if own.is_measured[c] == 0 or (sample.missing >> c) & 1 == 1:
            continue
        variance = own.covariance[c, c] + own.noise[c]
        e = sample.measured[c] - own.responses[0, c]
        for j in range(p):
            e -= own.responses[j + 1, c] * own.recursion.values[j]
        if e * e <= limit * variance:
            continue
        for i in range(p):
            for j in range(p):
                row = own.responses[i + 1, c] * own.responses[j + 1, c]
                variance += row * own.recursion.spread[i, j]
        if own.rows == 0.0 or e * e <= limit * variance:
            continue
        q = (e / own.held[c]) ** 2
        for i in range(4):
            for j in range(4):
                force = own.held[i] * own.held[j] + rough * own.ramped[i] * own.ramped[j]
                own.covariance[i, j] += q * force
        own.force_events += 1.0
        own.gate_scale += GATE_MEMORY * (limit - own.gate_scale)
        own.mismatch += limit
        own.mismatch_rows += 1.0


@compiled(inline=True)
def _regress(own: Any, sample: Any, certain: bool, groups: int) -> None:
    """Update the second filter with a sample of the ring; its rows are regressed.

    Where the direction of friction is not certain, nothing is forgotten for it.
    """
    P = own.covariance
    p = own.recursion.parameters
    forgetting = own.recursion.forgetting if certain else 1.0
    if certain:
        _allow_unknown_force(own, sample)
    for c in range(CHANNELS):
        if own.is_measured[c] == 0 or (sample.missing >> c) & 1 == 1:
            continue
        S = P[c, c] + own.noise[c]
        scale = 1.0 / np.sqrt(S)
        K = (P[0, c] / S, P[1, c] / S, P[2, c] / S, P[3, c] / S)
        y = 0.0
        for j in range(p + 1):
            z = own.responses[j]
            e = sample.measured[c] - z[c] if j == 0 else -z[c]
            if j == 0:
                y = e * scale
            else:
                own.recursion.row[j - 1] = -e * scale
            z[0] += K[0] * e
            z[1] += K[1] * e
            z[2] += K[2] * e
            z[3] += K[3] * e
        for i in range(4):
            for j in range(i, 4):
                value = P[i, j] - K[i] * K[j] * S
                P[i, j] = value
                P[j, i] = value
        error = update(own.recursion, y, forgetting, False)
        add_row(own, groups, y)
        if certain:
            own.residual_squares += error
            own.rows += 1.0
            own.gate_scale += GATE_MEMORY * (error - own.gate_scale)
            own.mismatch += error
            own.mismatch_rows += 1.0


@compiled(inline=True)
def _adapt(own: Any) -> None:
    """Let the disturbance force follow the innovations, as in `unknown_force`.

    If the innovations are larger than expected, the information so far was counted too high by
    their mean square, and is reduced.
    """
    if own.adaptations == 0.0 or own.mismatch_rows < ADAPTATION:
        return
    mean = own.mismatch / own.mismatch_rows
    own.mismatch, own.mismatch_rows = 0.0, 0.0
    gamma = adaptation_exponent(mean, own.adaptations)
    own.adaptations += 1.0
    factor = min(max(mean, 1.0 / _LARGEST_ADAPTATION), _LARGEST_ADAPTATION) ** (0.5 * gamma)
    least = _TRUST * np.sqrt(own.friction_square)
    own.disturbance = max(factor * own.disturbance, least)
    if own.disturbance > np.sqrt(own.friction_square):
        # Not even a force as large as friction explains the innovations: the sensors' noise is not
        # as modelled (a velocity differentiated from the same encoder), and no force is sought
        own.disturbance, own.adaptations = least, 0.0
    if mean > OVERCONFIDENT:
        p = own.recursion.parameters
        factor = min(mean, _LARGEST_ADAPTATION)
        for i in range(p):  # a given prior holds
            if own.recursion.has_relative_prior == 0:
                factor = min(factor, own.recursion.first_spread[i] / own.recursion.spread[i, i])
        factor = max(factor, 1.0)
        for i in range(MOST):
            own.eta[i] /= factor
            for j in range(MOST):
                own.recursion.spread[i, j] *= factor
                own.information[i, j] /= factor
        own.residual_squares, own.rows = 1.0, 1.0
        scale_information(own.batches.snapshots, 1.0 / factor)
        scale_information(own.contrasts.groups, 1.0 / factor)


@compiled(inline=True)
def _close_batch(s: State, columns: _Columns) -> None:
    """Keep the information so far, and the state as valid if its friction is plausible."""
    own = fields(s)
    p = own.recursion.parameters
    friction, variance = 0.0, 0.0
    for i in range(p):
        friction += columns[i] * own.recursion.values[i]
        for j in range(p):
            variance += columns[i] * columns[j] * own.recursion.spread[i, j]
    most = own.admission.largest_effort + np.sqrt(max(variance, 0.0))
    if abs(friction) > PLAUSIBLE * most or not keep_state(s, own.guard):
        _reset(s)
        return
    close_batch(own.batches, own.information, own.eta)


@compiled(inline=True)
def _reset(s: State) -> None:
    """Return to the last valid estimates; the motion begins again."""
    own = fields(s)
    restore_state(s, own.guard)
    own.gate_scale, own.mismatch, own.mismatch_rows = 1.0, 0.0, 0.0
    own.residual_squares, own.rows = 1.0, 1.0
    _restart(own)


@compiled(inline=True)
def _restart(own: Any) -> None:
    """Begin the motion again; friction and noise are known as before."""
    own.recursion.samples, own.refresh, own.uncertain_run = 0.0, 0.0, 0.0
    for c in range(CHANNELS):
        own.chain[c], own.squares[c] = 0.0, 0.0


@compiled(inline=True)
def _load_hidden(own: Any) -> bool:
    """Return whether there is a load that is not measured."""
    return own.recursion.stiffness > 0.0 and own.is_measured[2] == 0


@compiled(inline=True)
def _balance(s: State, sample: Any, velocity: float) -> None:
    """Take the sample that ends at the oldest one in the ring into the estimate.

    What lies before the oldest one is not in the ring any more: its effort, the stretch of the
    spring and its smoothed velocity were kept.
    """
    own = fields(s)
    T, m = own.recursion.sampling_time, own.inertia
    u0, d0, v0 = own.kept_effort, own.kept_stretch, own.earlier_velocity
    d = sample.measured[0] - sample.measured[2]
    spread = CERTAIN * own.velocity_spread
    direction = 0.0
    settled = own.recursion.samples > own.began + own.settled
    if settled and v0 * velocity > 0.0 and min(abs(v0), abs(velocity)) > spread:
        direction = 1.0 if velocity > 0.0 else -1.0
        if direction * own.heading < 0.0:
            own.turns += 1.0
        own.heading = direction
        friction = u0 - 0.5 * own.recursion.stiffness * (d0 + d) - m * (velocity - v0) / T
        own.friction_squares += friction * friction
        own.certain_samples += 1.0
    # Mean velocity of a cubic motion: the change of the acceleration follows from the known forces
    c = min(max(own.recursion.values[0], 0.0), 0.5 * m / T)
    change = -(own.recursion.stiffness * (d - d0) + c * (velocity - v0)) / m
    mean = 0.5 * (v0 + velocity) - T * change / 12.0
    columns = _friction_columns(own, mean, velocity - v0, direction)
    unknown = max(own.disturbance * own.disturbance, _TRUST * _TRUST * own.friction_square)
    if direction == 0.0:
        crossing = spread * m / (np.sqrt(own.friction_square) * T)
        own.uncertain_run += 1.0
        if _load_hidden(own):
            # The force that holds a sticking mass equals that of the spring, in successive samples
            crossing = max(crossing, own.uncertain_run)
        unknown += own.friction_square * max(crossing, 1.0)
    else:
        own.uncertain_run = 0.0
    unknown += own.kept_unknown
    _propagate(own, u0, unknown)
    for j in range(own.recursion.parameters):
        for i in range(4):
            own.responses[j + 1, i] -= own.held[i] * columns[j] + own.ramped[i] * columns[4 + j]
    certain = direction != 0.0 and own.kept_unknown == 0.0
    groups = classify(own.contrasts, velocity)
    _regress(own, sample, certain, groups)
    if certain:
        _adapt(own)
        if count_sample(own.batches):
            _close_batch(s, columns)


@compiled(inline=True)
def _begin(own: Any, oldest: Any, newest: Any, velocity: float) -> None:
    """Begin the second filter with the oldest sample in the ring.

    The variances of the position and velocity of an unmeasured load are wide.
    """
    P, z = own.covariance, own.responses[0]
    T = own.recursion.sampling_time
    own.responses[:] = 0.0
    P[:] = 0.0
    for c in range(CHANNELS):
        z[c] = oldest.measured[c]
        P[c, c] = own.noise[c] if own.is_measured[c] > 0 else 0.0
        if own.is_measured[c] == 0 and (c == 1 or (c == 3 and own.is_measured[2] > 0)):
            z[c] = 0.0
            over = (newest.measured[c - 1] - oldest.measured[c - 1]) / (LAG * T)
            P[c, c] = over * over + velocity * velocity + (CERTAIN * own.velocity_spread) ** 2
    if _load_hidden(own):
        travel = newest.measured[0] - oldest.measured[0]
        square = own.net_square + own.free[2] * own.free[2]
        stretch = square / own.recursion.stiffness**2 + travel * travel
        z[3] = 0.0
        P[2, 2] = _LARGER * stretch
        swing = own.recursion.stiffness / own.recursion.load_inertia * stretch
        P[3, 3] = _LARGER * (swing + (travel / (LAG * T)) ** 2)


@compiled(inline=True)
def _can_begin(own: Any, position: float) -> bool:
    """Return whether a force has acted, every sensor has shown its noise, and the axis has moved.

    At rest noise would pass for motion under no force, which shows that there is no friction.
    """
    known = own.net_square > 0.0
    for c in range(CHANNELS):
        known = known and (own.is_measured[c] == 0 or own.noisy_samples[c] > 0.0)
    if not known or own.certain_samples > 0.0:
        return known
    estimate_noise(own)
    return (position - own.origin) ** 2 > 2.0 * CERTAIN**2 * own.noise[0]


@compiled(inline=True)
def _fill(own: Any, before: Any, now: Any) -> int:
    """Fill missing values of a sample by constant velocity; return which ones were missing."""
    T = own.recursion.sampling_time
    z, z0 = now.measured, before.measured
    missing = 0
    for mass in range(2):
        x, v = 2 * mass, 2 * mass + 1
        if own.is_measured[v] == 0:
            z[v] = 0.0
        elif np.isnan(z[v]):
            missing += 1 << v
            z[v] = z0[v]
        if own.is_measured[x] == 0:
            z[x] = z[0]
        elif np.isnan(z[x]):
            missing += 1 << x
            if own.is_measured[v] > 0:
                z[x] = z0[x] + 0.5 * T * (z0[v] + z[v])
            elif mass == 0 and own.refresh > 0.0:
                z[x] = z0[x] + T * own.free[1]
            else:
                z[x] = z0[x]
    return missing


@compiled(inline=True)
def _advance(s: State, u: float, x: float, v: float, x2: float, v2: float) -> None:
    """Take one sample into the state, in place."""
    own = fields(s)
    ready, u, unknown, x, v, x2, v2, stepped = admit(own.admission, u, x, v, x2, v2)
    if not ready:
        return
    if stepped:
        _restart(own)
    n = own.recursion.samples
    now, before = own.ring[n % DEPTH], own.ring[(n + DEPTH - 1) % DEPTH]
    z = now.measured
    now.effort = u
    z[0], z[1], z[2], z[3] = x, v, x2, v2
    if n == 0:
        own.origin = x
    missing = _fill(own, before, now)
    if missing > 0 and own.refresh == 0.0:
        _restart(own)  # the filters begin with complete samples
        return
    if _load_hidden(own):
        z[2], z[3] = z[0], z[1]  # the first filter has the spring's force in the free one
    now.missing = missing
    now.unknown = own.admission.largest_effort**2 if unknown else 0.0
    for c in range(CHANNELS):
        if (missing >> c) & 1 == 1:
            own.chain[c] = 0.0
        elif own.is_measured[c] > 0:
            count_noise(own, z[c], c)
    net = u - own.recursion.stiffness * (z[0] - z[2])
    own.net_square = max(own.net_square, net * net)
    if n > 0:
        compare(own, before, now)
    own.recursion.samples += 1
    begins = own.refresh == 0.0
    if n < LAG or (begins and not _can_begin(own, z[0])):
        return
    first = (n + 1) % DEPTH
    oldest = own.ring[first]
    if begins:
        refresh(s)
        if own.adaptations == 1.0:
            own.disturbance = _TRUST * np.sqrt(own.friction_square)
        own.refresh = 2.0 * own.noisy_samples[0]
        own.began = own.recursion.samples
        own.free[0], own.free[1] = oldest.measured[0], oldest.measured[1]
        innovate(own, oldest)
        for k in range(LAG):
            later = own.ring[(first + k + 1) % DEPTH]
            predict(own, own.ring[(first + k) % DEPTH], later)
            innovate(own, later)
    else:
        predict(own, before, now)
        innovate(own, now)
    velocity = smoothed_velocity(own, first)
    if begins:
        _begin(own, oldest, now, velocity)
    else:
        _balance(s, oldest, velocity)
    own.kept_effort = oldest.effort
    own.kept_stretch = oldest.measured[0] - oldest.measured[2]
    own.kept_unknown = oldest.unknown
    own.earlier_velocity = velocity
    if own.refresh > 0.0 and own.noisy_samples[0] >= own.refresh:
        refresh(s)
        own.refresh *= 2.0
    if not _is_valid(own):
        _reset(s)


@compiled(inline=True)
def _is_valid(own: Any) -> bool:
    """Return whether the estimates and the states of both filters are finite."""
    total = own.free[0] + own.free[1] + own.free[2]
    for i in range(4):
        total += own.responses[0, i] + own.covariance[i, i]
    for i in range(own.recursion.parameters):
        total += own.recursion.values[i]
    return np.isfinite(total)


@compiled(brief=True)
def work_step(s: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite.

    Of a sample that is not only the rest is used.
    """
    _advance(s, u, x, v, x2, v2)
    return np.isfinite(u + x + v + x2 + v2)


@compiled()
def work_run(
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
