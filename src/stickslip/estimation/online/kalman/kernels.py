"""Kernels of an extended Kalman filter whose states are the motion and its friction.

The states of a filter are z = (x, v, c, f_c, o): position, velocity, viscous friction, Coulomb
friction and offset. Between samples x and v move exactly, as in `predicted`; friction stays.

At rest, friction is whatever the effort asks for, up to a limit: a sample shows that the limit is
not reached, which is an inequality, and no Gaussian can hold it. A filter that takes it for an
equation learns that the limit is the effort of the moment, is soon sure of it, and diverges. So
there are two filters side by side:

- The *careful* one carries the motion through what may be a rest under an unknown force, and learns
  nothing of friction there. It needs no good first guess, but forgets the motion at every stop.
- The *sharp* one takes stops, reversals, rests and breakaways as exactly as all other motion. That
  is sound once friction is known so well that the sample of each event follows from it; it begins
  then, with the first of the samples that were kept until then.

The sharp one takes static friction for Coulomb friction. It is left for good

- if the axis is slower after a breakaway than predicted (a score test for another speed there),
- if the careful one predicts the motion better (the likelihood ratio, in slip only),
- if their Coulomb frictions differ (J. A. Hausman 1978, "Specification tests in econometrics": the
  careful estimate stays right if static friction is larger), or
- if the axis rests under an effort that is certain to be above its Coulomb friction. Nothing is
  learned from such a sample.

Against faults of the log and of the model:

- A sample passes `stickslip.estimation.online.faults.admission` first; a missing value is not used.
- An innovation larger than `_GATE` standard deviations is explained by an unknown force in that
  sample: Q grows until it is not. The motion follows the measurement, friction does not.
- Without a given force noise, Q follows the innovations (bounded covariance matching).
- The state of the last complete batch that was finite and plausible is kept. One that is not is
  replaced by it.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import (
    ADMISSION_DTYPE,
    admit,
    restart_admission,
)
from stickslip.estimation.online.intervals.batches import (
    batches_dtype,
    clear_batches,
    close_batch,
    count_sample,
    scale_information,
)
from stickslip.estimation.online.intervals.contrasts import (
    EVERYWHERE,
    add_information,
    classify,
    contrasts_dtype,
)
from stickslip.estimation.online.kalman.motion import predicted
from stickslip.numerics.kalman import measure
from stickslip.numerics.named_fields import fields_at, place_of, places

STATES = 5
FRICTION = 3  # of these: c, f_c, o
LEARNING, REPLAYING, TRUSTED, LEFT = 0, 1, 2, 3  # stages of the sharp filter

_FILTER = np.dtype(
    [
        ("z", "f8", (STATES,)),
        ("P", "f8", (STATES, STATES)),
        ("walk", "f8", (FRICTION,)),  # variances that friction gains in a sample
        # r: error of z if every breakaway gave a speed of one less than predicted
        ("response", "f8", (STATES,)),
    ]
)
STATE = np.dtype(
    [
        ("period", "f8"),  # sampling time
        ("values", "f8", (FRICTION,)),  # c, f_c, o of the filter in use
        # Settings
        ("mass", "f8"),
        ("position_variance", "f8"),
        ("velocity_variance", "f8"),  # infinite where no velocity is measured
        ("rest_speed", "f8"),  # below it the axis may be at rest; 0: samples are taken as they are
        ("rest_variance", "f8"),  # of the unknown force there
        ("parameters", "i8"),  # of c, f_c and o, those that are estimated
        ("drift", "f8", (FRICTION,)),  # variances by which c, f_c and o wander in a sample
        # What changes
        ("force_variance", "f8"),  # of a disturbing force, white from sample to sample
        ("known", "i8"),  # whether there was a sample before
        ("held_effort", "f8"),
        ("held_unknown", "i8"),  # whether the force in the current interval is unknown
        ("innovation", "f8"),  # e' S^-1 e of the last sample
        ("stage", "i8"),  # of the sharp filter
        ("change", "f8"),  # mean squared change of the effort from sample to sample
        ("samples", "i8"),  # that it is the mean of
        ("behind", "f8"),  # log likelihood of the careful filter over that of the sharp one [nat]
        ("lack", "f8"),  # score of a lack of speed after breakaways: sum of r e / S
        ("lack_variance", "f8"),  # of that score: sum of r^2 / S
        ("stored", "i8"),  # samples that are kept
        ("replayed", "i8"),  # how many of them the sharp filter has taken
        ("gate_scale", "f8"),  # running mean of squared innovations over their variances
        ("adapted", "i8"),  # adaptations of the force variance, from 1 on; 0 if it is given
        ("mismatch", "f8"),  # sum of squared innovations over their variances since the last one
        ("mismatched", "i8"),  # number of measurements in it
        ("force_events", "i8"),  # samples whose innovation only an unknown force explains
        ("resets", "i8"),  # times that a state was replaced by the last valid one
        ("largest_speed", "f8"),
        ("anchor", "f8"),  # position at which the axis seems to rest
        ("due_speed", "f8"),  # velocity and travel due since, under the effort above friction
        ("due_travel", "f8"),
        ("careful", _FILTER),
        ("sharp", _FILTER),
        ("good", "f8", (FRICTION,)),  # friction and its covariance at the last valid batch
        ("good_covariance", "f8", (FRICTION, FRICTION)),
        ("admission", ADMISSION_DTYPE),
        ("batches", batches_dtype(FRICTION)),  # of the careful filter
        ("sharp_batches", batches_dtype(FRICTION)),
        ("contrasts", contrasts_dtype(FRICTION)),  # of the careful filter
        ("spell", "i8"),  # groups of the current samples
        ("spell_vector", "f8", (FRICTION,)),  # eta and J of the careful filter when these began
        ("spell_information", "f8", (FRICTION, FRICTION)),
    ]
)
fields = fields_at(STATE)
State = Float[np.ndarray, " s"]

VALUES = place_of(STATE, "values")
"""Place of the first estimate in a state."""
MEMORY = places(STATE)
"""Place from which on u, x and v of the first samples follow, to the end of the state."""

RESOLUTION = 1e-15
"""Variance that a parameter gains in a sample, over that which the filter began with: without it,
P loses its positive eigenvalues to rounding where the sensors are good."""
_SURE = 3.0  # standard deviations of the velocity from 0, from which on the axis moves for sure
_LOOSER = 10.0
"""The sharp filter begins with this many times the careful one's covariance of friction, as what
that learned is from the same samples: counted twice, it weighs a tenth at most."""
_HIDDEN = 0.01  # of a sensor's variance, that one sample does not show
_PACE = 4  # kept samples that the sharp filter takes in one
_LACKING = 4.0  # standard deviations of the score
_WORSE = 15.0
"""How far the sharp filter may fall behind [nat]; in 19 of 20 logs it stays within 7 if right."""
_GATE = 64.0  # squared innovation over its variance beyond which there was an unknown force
_GATE_MEMORY = 1.0 / 256.0  # weight of a sample in the running mean that scales the gate
_DIFFERENT = 4.0  # standard deviations between the Coulomb frictions of the two filters
_CERTAIN = 3.0  # standard deviations by which an effort must exceed Coulomb friction
_RESTING = 4.0  # standard deviations of the position within which an axis may be at rest
_DUE = 40.0
"""Standard deviations of the position that a resting axis should have moved by, until it is certain
that static friction holds it; so many that a slow reversal is no rest."""
_ADAPTATION = 64.0  # measurements from one adaptation of the force variance to the next
_LEAST_ADAPTATION = 0.05  # exponent of an adaptation after many of them
_LARGEST_ADAPTATION = 4.0  # factor of an adaptation
_LEAST_FORCE = 1e-3  # of the largest effort: least standard deviation of the adapted force
_OVERCONFIDENT = 2.0
"""Mismatch beyond which what was learned so far is trusted less, and q follows at once: 1 in 10^5
adaptations exceeds it by chance. At 1.5 of 32 measurements 1 in 30 does, and the information of a
log is lost several times over."""
_PLAUSIBLE = 5.0
"""Friction over the largest effort beyond which an estimate is not plausible."""


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
        x, v = predicted(m, x, v, f.z[2], f.z[3], f.z[4], u, T, F)
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
    """Add to P what an unknown force of variance q does in a sample: P + q B B' / m^2."""
    P = f.P
    b0, b1 = 0.5 * s.period**2 / s.mass, s.period / s.mass
    P[0, 0] += q * b0 * b0
    P[0, 1] += q * b0 * b1
    P[1, 0] += q * b0 * b1
    P[1, 1] += q * b1 * b1


@compiled(inline=True)
def _take(s: Any, f: Any, careful: bool, u: float, x: float, v: float) -> tuple[bool, float, float]:
    """Take a sample after the effort u into a filter.

    Returns whether the exact motion led to it, e' S^-1 e, and how unlikely it was [nat].
    """
    exactly = _predict(s, f, careful, u)
    square_x = _squared_innovation(f, 0, x, s.position_variance)
    square_v = _squared_innovation(f, 1, v, s.velocity_variance)
    limit = _GATE * max(1.0, s.gate_scale)
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
            s.gate_scale += _GATE_MEMORY * (bounded / seen - s.gate_scale)
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
def _adapt(s: Any) -> None:
    """Let the force variance follow the innovations: q+ = q (mean e' S^-1 e / size)^gamma.

    The exponent falls from 1 to `_LEAST_ADAPTATION`. If the innovations are larger than expected,
    the information so far was counted too high by their mean square, and is reduced.
    """
    if s.adapted == 0 or s.mismatched < _ADAPTATION:
        return
    mean = s.mismatch / s.mismatched
    s.mismatch, s.mismatched = 0.0, 0
    gamma = max(_LEAST_ADAPTATION, 1.0 / np.sqrt(s.adapted))
    if mean > _OVERCONFIDENT:
        gamma = 1.0
    s.adapted += 1
    factor = min(max(mean, 1.0 / _LARGEST_ADAPTATION), _LARGEST_ADAPTATION) ** gamma
    most = s.admission.largest_effort**2
    least = most * _LEAST_FORCE * _LEAST_FORCE
    s.force_variance = min(max(factor * s.force_variance, least), max(most, least))
    if mean > _OVERCONFIDENT:
        factor = min(mean, _LARGEST_ADAPTATION)
        _scale_friction(s.careful, factor)
        scale_information(s.batches.snapshots, 1.0 / factor)
        scale_information(s.contrasts.groups, 1.0 / factor)
        for i in range(FRICTION):
            s.spell_vector[i] /= factor
            for j in range(FRICTION):
                s.spell_information[i, j] /= factor


@compiled(inline=True)
def _information(s: Any, f: Any, J: Float[np.ndarray, "3 3"], eta: Float[np.ndarray, " 3"]) -> bool:
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
def _keep_batch(s: Any, f: Any, batches: Any) -> None:
    """Keep the information of a filter at the end of a batch."""
    J, eta = np.empty((FRICTION, FRICTION)), np.empty(FRICTION)
    if _information(s, f, J, eta):
        close_batch(batches, J, eta)


@compiled(inline=True)
def _contrast(s: Any) -> None:
    """Add what the careful filter learned to the groups of its samples, when these change."""
    groups = classify(s.contrasts, s.careful.z[1])
    if groups == s.spell:
        return
    J, eta = np.empty((FRICTION, FRICTION)), np.empty(FRICTION)
    if not _information(s, s.careful, J, eta):
        return
    for i in range(FRICTION):
        before = s.spell_vector[i]
        s.spell_vector[i] = eta[i]
        eta[i] -= before
        for j in range(FRICTION):
            before = s.spell_information[i, j]
            s.spell_information[i, j] = J[i, j]
            J[i, j] -= before
    add_information(s.contrasts, s.spell, J, eta)
    s.spell = groups


@compiled(inline=True)
def _is_plausible(s: Any) -> bool:
    """Return whether friction is within `_PLAUSIBLE` times the largest effort."""
    P = s.careful.P
    most = _PLAUSIBLE * s.admission.largest_effort
    viscous = abs(s.careful.z[2]) - _PLAUSIBLE * np.sqrt(max(P[2, 2], 0.0))
    coulomb = abs(s.careful.z[3]) - _PLAUSIBLE * np.sqrt(max(P[3, 3], 0.0))
    offset = abs(s.careful.z[4]) - _PLAUSIBLE * np.sqrt(max(P[4, 4], 0.0))
    return viscous * s.largest_speed <= most and coulomb <= most and offset <= most


@compiled(inline=True)
def _is_valid(f: Any) -> bool:
    """Return whether a filter's states are finite and its variances finite and not negative."""
    total = 0.0
    valid = True
    for i in range(STATES):
        variance = f.P[i, i]
        total += f.z[i] + variance
        valid = valid and variance >= 0.0
    return valid and np.isfinite(total)


@compiled(inline=True)
def _keep_good(s: Any) -> None:
    """Keep friction and its covariance as the last valid ones."""
    s.good[:] = s.careful.z[2:]
    s.good_covariance[:] = s.careful.P[2:, 2:]


@compiled(inline=True)
def _reset(s: Any) -> None:
    """Return to the friction of the last valid state; the motion begins again."""
    s.resets += 1
    for f in (s.careful, s.sharp):
        f.z[:] = 0.0
        f.response[:] = 0.0
    s.careful.z[2:] = s.good
    s.careful.P[2:, 2:] = s.good_covariance
    s.stage = LEFT
    s.gate_scale, s.mismatch, s.mismatched = 1.0, 0.0, 0
    s.spell = EVERYWHERE
    _forget_motion(s)


@compiled(inline=True)
def _knows_the_events(s: Any) -> bool:
    """Return whether stops and breakaways can be linearised about the friction as known.

    The sample of a breakaway is certain when the error of f_c +- o is smaller than the change of
    the effort in one sample. Its effect on the velocity and position of a single sample must also
    be small beside the sensors' noise: otherwise one measurement after a breakaway may reverse the
    predicted motion.
    """
    P = s.careful.P
    spread = _LOOSER * (P[3, 3] + P[4, 4] + 2.0 * abs(P[3, 4]))
    speed = spread * (s.period / s.mass) ** 2
    travel = 0.25 * speed * s.period**2
    hidden = speed < _HIDDEN * s.velocity_variance and travel < _HIDDEN * s.position_variance
    return spread < s.change and hidden and s.careful.z[3] > 0.0


@compiled(inline=True)
def _sharpen(vector: State, s: Any) -> None:
    """Begin the sharp filter, with the first sample that is kept or else with this one."""
    f = s.sharp
    f.z[:] = s.careful.z
    f.P[:] = s.careful.P
    s.behind = 0.0
    s.stage = TRUSTED
    clear_batches(s.sharp_batches)
    # It catches up with the samples that come in while there is room for these
    if 0 < s.stored * _PACE <= (_PACE - 1) * ((vector.size - MEMORY) // 3):
        s.stage = REPLAYING
        s.replayed = 1
        f.z[0], f.z[1] = vector[MEMORY + 1], vector[MEMORY + 2]
        for i in range(STATES):
            for j in range(STATES):
                f.P[i, j] = _LOOSER * f.P[i, j] if i > 1 and j > 1 else 0.0
        _unknown_motion(s, f, 0.0)
    for i in range(FRICTION):
        f.walk[i] = s.drift[i] + RESOLUTION * f.P[2 + i, 2 + i]


@compiled(inline=True)
def _unknown_motion(s: Any, f: Any, speed: float) -> None:
    """Set what is known of position and velocity by one sample, in a P that is 0 there.

    Without a velocity sensor the velocity is 0, up to the speed and the noise of a sample.
    """
    f.P[0, 0] = s.position_variance
    f.P[1, 1] = s.velocity_variance
    if not np.isfinite(s.velocity_variance):
        f.P[1, 1] = 2.0 * s.position_variance / s.period**2 + speed * speed


@compiled()
def forget_motion(vector: State) -> None:
    """Begin another stretch of samples, in place: friction as known, the motion anew."""
    s = fields(vector)
    restart_admission(s.admission)
    _forget_motion(s)


@compiled(inline=True)
def _forget_motion(s: Any) -> None:
    """Begin the motion anew, which may be as fast as the fastest so far."""
    s.known = s.held_unknown = s.stored = 0
    if s.stage == REPLAYING:
        s.stage = TRUSTED
    for f in (s.careful, s.sharp):
        f.response[:2] = 0.0
        f.P[:2] = 0.0
        f.P[:, :2] = 0.0
        _unknown_motion(s, f, s.largest_speed)


@compiled(inline=True)
def _follow(
    vector: State, s: Any, held: float, x: float, v: float, exactly: bool, unlikely: float
) -> None:
    """Let the sharp filter do what its stage asks for, after the careful one took the sample."""
    if s.stage == LEARNING:
        if _knows_the_events(s):
            _sharpen(vector, s)
    elif s.stage == REPLAYING:
        for _ in range(_PACE):
            if s.replayed < s.stored:
                k = MEMORY + 3 * int(s.replayed)
                _take(s, s.sharp, False, vector[k - 3], vector[k + 1], vector[k + 2])
                s.replayed += 1
        if s.replayed == s.stored:
            s.stage = TRUSTED
    elif s.stage == TRUSTED:
        exactly_too, squares, unlikely_too = _take(s, s.sharp, False, held, x, v)
        s.innovation = squares
        # The careful filter does not model rests: a better prediction of them is no evidence
        if exactly and exactly_too:
            s.behind = max(0.0, s.behind + unlikely_too - unlikely)
        apart = abs(s.sharp.z[3] - s.careful.z[3])
        if (
            s.behind > _WORSE
            or abs(s.lack) > _LACKING * np.sqrt(s.lack_variance)
            or apart > _DIFFERENT * np.sqrt(s.careful.P[3, 3])
            or _sticks(s, held, x)
            or not _is_valid(s.sharp)
        ):
            s.stage = LEFT


@compiled(inline=True)
def _sticks(s: Any, held: float, x: float) -> bool:
    """Return whether the axis rests although the effort is above Coulomb friction for certain.

    The net force |u - o| - f_c - 3 sigma would have moved it by `_DUE` standard deviations of the
    position.
    """
    deviation = np.sqrt(s.position_variance)
    if np.isnan(x) or s.held_unknown:
        return False
    P = s.sharp.P
    spread = P[3, 3] + P[4, 4] + 2.0 * abs(P[3, 4])
    net = abs(held - s.sharp.z[4]) - s.sharp.z[3] - _CERTAIN * np.sqrt(spread)
    if net <= 0.0 or abs(x - s.anchor) > _RESTING * deviation:
        s.anchor, s.due_speed, s.due_travel = x, 0.0, 0.0
        return False
    s.due_speed += net / s.mass * s.period
    s.due_travel += s.due_speed * s.period
    return s.due_travel > _DUE * deviation


@compiled(brief=True)
def ekf_step(vector: State, u: float, x: float, v: float, x2: float, v2: float) -> bool:
    """Take one sample into the state, in place; return whether it was complete.

    Of a sample that is not (NaN, or impossible) only the rest is used. The load is not read.
    """
    s = fields(vector)
    measured = np.isfinite(s.velocity_variance)
    whole = np.isfinite(u) and np.isfinite(x) and (np.isfinite(v) or not measured)
    ready, u, unknown, x, v, _, _, stepped = admit(s.admission, u, x, v, x2, v2)
    if not ready:
        return whole
    if stepped:
        _forget_motion(s)
    if s.known == 0 and (np.isnan(x) or (measured and np.isnan(v))):
        return whole
    k = MEMORY + 3 * int(s.stored)
    if s.stage <= REPLAYING and k + 3 <= vector.size and not (unknown or np.isnan(x) or stepped):
        vector[k], vector[k + 1], vector[k + 2] = u, x, v
        s.stored += 1
    elif s.stage == LEARNING and (unknown or np.isnan(x)):
        s.stored = 0  # the kept samples must follow each other
    exactly = False
    if s.known:
        held = s.held_effort
        if not unknown:
            s.samples += 1
            s.change += ((u - held) ** 2 - s.change) / s.samples
        exactly, s.innovation, unlikely = _take(s, s.careful, True, held, x, v)
        _follow(vector, s, held, x, v, exactly, unlikely)
        if not _is_valid(s.careful):
            _reset(s)
            exactly = False
    else:
        for f in (s.careful, s.sharp):
            f.z[0], f.z[1] = x, v if measured else 0.0
        s.known = 1
    if exactly:
        _contrast(s)
        _adapt(s)
        if count_sample(s.batches):
            if _is_plausible(s):
                _keep_good(s)
                _keep_batch(s, s.careful, s.batches)
            else:
                _reset(s)
        if s.stage == TRUSTED and count_sample(s.sharp_batches):
            _keep_batch(s, s.sharp, s.sharp_batches)
    s.values[:] = (s.sharp if s.stage == TRUSTED else s.careful).z[2:]
    s.held_effort, s.held_unknown = u, unknown
    return whole


@compiled()
def ekf_run(
    vector: State, samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Take many samples, in place; return c, f_c and o after each, and the innovations."""
    n = samples.shape[0]
    s = fields(vector)
    history, innovations = np.empty((n, FRICTION)), np.empty(n)
    for k in range(n):
        u, x, v, x2, v2 = samples[k]
        ekf_step(vector, u, x, v, x2, v2)
        history[k] = s.values
        innovations[k] = s.innovation
    return history, innovations
