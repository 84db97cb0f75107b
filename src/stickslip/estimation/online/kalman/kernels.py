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

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import (
    ADMISSION_DTYPE,
    ADMISSION_SIZE,
    admit,
    restart_admission,
)
from stickslip.estimation.online.intervals.batches import (
    batch_size,
    clear_batches,
    close_batch,
    count_sample,
    scale_batches,
)
from stickslip.estimation.online.intervals.contrasts import (
    EVERYWHERE,
    add_information,
    classify,
    contrast_size,
    scale_contrasts,
)
from stickslip.estimation.online.kalman.motion import predicted
from stickslip.estimation.online.recursion import SAMPLING_TIME, VALUES
from stickslip.numerics.kalman import measure
from stickslip.numerics.named_fields import fields_at

__all__ = [
    "ADAPTED",
    "ADMISSION",
    "BATCHES",
    "CAREFUL",
    "CONTRASTS",
    "COVARIANCE",
    "DRIFT",
    "FORCE_EVENTS",
    "FORCE_VARIANCE",
    "FRICTION",
    "GATE_SCALE",
    "GOOD",
    "INNOVATION",
    "KNOWN",
    "LEARNING",
    "LEFT",
    "MASS",
    "MEMORY",
    "PARAMETERS",
    "POSITION_VARIANCE",
    "RESETS",
    "RESOLUTION",
    "REST_SPEED",
    "REST_VARIANCE",
    "SHARP",
    "SHARP_BATCHES",
    "STAGE",
    "STATES",
    "TRUSTED",
    "VELOCITY_VARIANCE",
    "WALK",
    "admission",
    "ekf_run",
    "ekf_step",
    "forget_motion",
]

STATES = 5
FRICTION = 3  # of these: c, f_c, o; those of the filter in use stand at VALUES

(
    MASS,
    FORCE_VARIANCE,  # of a disturbing force, white from sample to sample
    POSITION_VARIANCE,
    VELOCITY_VARIANCE,  # infinite where no velocity is measured
    REST_SPEED,  # below which the axis may be at rest; 0 where every sample is taken as it is
    REST_VARIANCE,  # of the unknown force there
    KNOWN,  # whether there was a sample before
    HELD_EFFORT,
    INNOVATION,  # e' S^-1 e of the last sample
    STAGE,  # what the sharp filter does
    CHANGE,  # mean squared change of the effort from sample to sample
    SAMPLES,  # that it is the mean of
    BEHIND,  # how much less likely the sharp filter made the samples than the careful one [nat]
    LACK,  # score of a lack of speed after breakaways: sum of r e / S, r of RESPONSE
    LACK_VARIANCE,  # of that score: sum of r^2 / S
    STORED,  # samples that are kept
    REPLAYED,  # how many of them the sharp filter has taken
    PARAMETERS,  # of c, f_c and o, those that are estimated
    HELD_UNKNOWN,  # whether the force in the current interval is unknown
    GATE_SCALE,  # running mean of squared innovations over their variances
    ADAPTED,  # number of adaptations of the force variance, from 1 on; 0 if it is given
    MISMATCH,  # sum of squared innovations over their variances since the last one
    MISMATCHED,  # number of measurements in it
    FORCE_EVENTS,  # samples whose innovation asked for an unknown force
    RESETS,  # times that a state was replaced by the last valid one
    LARGEST_SPEED,
    ANCHOR,  # position at which the axis seems to rest
    DUE_SPEED,  # velocity and way that it should have gained since, under the effort above friction
    DUE_WAY,
) = range(VALUES + FRICTION, VALUES + FRICTION + 29)
DRIFT = DUE_WAY + 1  # variances by which c, f_c and o wander in a sample
CAREFUL = DRIFT + FRICTION

# Within the part of a filter: its states, then
COVARIANCE = STATES
WALK = COVARIANCE + STATES * STATES  # variances that friction gains in a sample
RESPONSE = (
    WALK + FRICTION
)  # r: error of z if every breakaway gave a speed of one less than predicted
SHARP = CAREFUL + RESPONSE + STATES
GOOD = SHARP + RESPONSE + STATES  # friction and its covariance at the last valid batch
ADMISSION = GOOD + FRICTION + FRICTION * FRICTION
BATCHES = ADMISSION + ADMISSION_SIZE  # of the careful filter
SHARP_BATCHES = BATCHES + batch_size(FRICTION)
CONTRASTS = SHARP_BATCHES + batch_size(FRICTION)  # of the careful filter
SPELL = CONTRASTS + contrast_size(FRICTION)  # groups of the current samples
SPELL_START = SPELL + 1  # eta and J of the careful filter when these began
MEMORY = SPELL_START + FRICTION + FRICTION * FRICTION
# From there on u, x, v of the first samples, to the end of the state

admission = fields_at(ADMISSION_DTYPE, start=ADMISSION)

LEARNING, REPLAYING, TRUSTED, LEFT = 0.0, 1.0, 2.0, 3.0  # stages of the sharp filter

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
def _carry(s: Float[np.ndarray, " s"], at: int, u: float) -> bool:
    """Predict: z by the axis' own motion, P by F P F' + Q; return whether by the exact one."""
    T, m = s[SAMPLING_TIME], s[MASS]
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    F = np.zeros((2, STATES))
    x, v, q = s[at], s[at + 1], s[FORCE_VARIANCE] if at == CAREFUL else 0.0
    rested = v == 0.0
    slow = max(s[REST_SPEED], _SURE * np.sqrt(P[1, 1]))
    unclear = s[REST_SPEED] > 0.0 and abs(v) < slow
    if unclear and at == SHARP:
        # Friction stops the spread of the velocity within m P_vv / (2 f_c), and to linearise that
        # is sound if a position sensor would hardly see it
        unclear = m * P[1, 1] > 2.0 * max(s[at + 3], 0.0) * np.sqrt(s[POSITION_VARIANCE])
    if s[HELD_UNKNOWN] > 0.0:
        unclear = True
        q = max(s[REST_VARIANCE], admission(s).largest_effort ** 2)
    if unclear:
        q = max(q, s[REST_VARIANCE])
        F[0, 0], F[0, 1], F[1, 1] = 1.0, T, 1.0
        x += v * T
    else:
        x, v = predicted(m, x, v, s[at + 2], s[at + 3], s[at + 4], u, T, F)
    s[at], s[at + 1] = x, v
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
    lack_x, lack_v = 0.0, -np.sign(v) if rested and at == SHARP else 0.0
    for k in range(STATES):
        lack_x += F[0, k] * s[at + RESPONSE + k]
        lack_v += F[1, k] * s[at + RESPONSE + k]
    s[at + RESPONSE], s[at + RESPONSE + 1] = lack_x, lack_v
    # A force of variance q held over the sample
    q /= m * m
    P[0, 0] += 0.25 * q * T**4
    P[0, 1] += 0.5 * q * T**3
    P[1, 0] += 0.5 * q * T**3
    P[1, 1] += q * T * T
    for i in range(FRICTION):
        P[2 + i, 2 + i] += s[at + WALK + i]
    return not unclear


@compiled(inline=True)
def _correct(
    s: Float[np.ndarray, " s"], at: int, k: int, measured: float, variance: float
) -> tuple[float, float]:
    """Take a measurement of state k: z <- z + K e, P <- P - K S K' with K = P_k / S.

    Returns e^2 / S and log S of the innovation e; zeros for one without information.
    """
    if np.isnan(measured):
        return 0.0, 0.0
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    S = P[k, k] + variance
    if not (S > 0.0 and np.isfinite(S)):
        return 0.0, 0.0
    e = measured - s[at + k]
    lack = s[at + RESPONSE + k]
    s[LACK] += lack * e / S
    s[LACK_VARIANCE] += lack * lack / S
    gain = np.empty(STATES)
    measure(k, variance, P, gain, STATES)
    for i in range(STATES):
        s[at + i] += gain[i] * e
        s[at + RESPONSE + i] -= gain[i] * lack
    return e * e / S, np.log(S)


@compiled(inline=True)
def _squared_innovation(
    s: Float[np.ndarray, " s"], at: int, k: int, measured: float, variance: float
) -> float:
    """Return e^2 / S of a measurement of state k; 0 where it holds no information or is missing."""
    S = s[at + COVARIANCE + k * (STATES + 1)] + variance
    if np.isnan(measured) or not (S > 0.0 and np.isfinite(S)):
        return 0.0
    return (measured - s[at + k]) ** 2 / S


@compiled(inline=True)
def _add_force(s: Float[np.ndarray, " s"], at: int, q: float) -> None:
    """Add to P what an unknown force of variance q does in a sample: P + q B B' / m^2."""
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    b0, b1 = 0.5 * s[SAMPLING_TIME] ** 2 / s[MASS], s[SAMPLING_TIME] / s[MASS]
    P[0, 0] += q * b0 * b0
    P[0, 1] += q * b0 * b1
    P[1, 0] += q * b0 * b1
    P[1, 1] += q * b1 * b1


@compiled(inline=True)
def _take(
    s: Float[np.ndarray, " s"], at: int, u: float, x: float, v: float
) -> tuple[bool, float, float]:
    """Take a sample after the effort u into the filter at a place.

    Returns whether the exact motion led to it, e' S^-1 e, and how unlikely it was [nat].
    """
    exactly = _carry(s, at, u)
    square_x = _squared_innovation(s, at, 0, x, s[POSITION_VARIANCE])
    square_v = _squared_innovation(s, at, 1, v, s[VELOCITY_VARIANCE])
    limit = _GATE * max(1.0, s[GATE_SCALE])
    if max(square_x, square_v) > limit:
        T, m = s[SAMPLING_TIME], s[MASS]
        q = 0.0
        if square_x > limit:
            q = ((x - s[at]) * 2.0 * m / (T * T)) ** 2
        if square_v > limit:
            q = max(q, ((v - s[at + 1]) * m / T) ** 2)
        _add_force(s, at, q)
        if at == CAREFUL:
            s[FORCE_EVENTS] += 1.0
    elif exactly and at == CAREFUL:
        s[LARGEST_SPEED] = max(s[LARGEST_SPEED], abs(s[CAREFUL + 1]))
    bounded = min(square_x, limit) + min(square_v, limit)
    if exactly and at == CAREFUL:
        seen = (0.0 if np.isnan(x) else 1.0) + (0.0 if np.isnan(v) else 1.0)
        if np.isinf(s[VELOCITY_VARIANCE]):
            seen = 0.0 if np.isnan(x) else 1.0
        if seen > 0.0:
            s[GATE_SCALE] += _GATE_MEMORY * (bounded / seen - s[GATE_SCALE])
            s[MISMATCH] += bounded
            s[MISMATCHED] += seen
    square_x, log_x = _correct(s, at, 0, x, s[POSITION_VARIANCE])
    square_v, log_v = _correct(s, at, 1, v, s[VELOCITY_VARIANCE])
    return exactly, bounded, 0.5 * (square_x + square_v + log_x + log_v)


@compiled(inline=True)
def _scale_friction(s: Float[np.ndarray, " s"], at: int, factor: float) -> None:
    """Multiply the covariance of friction by a factor, and keep its correlations."""
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    root = np.sqrt(factor)
    for i in range(STATES):
        for j in range(STATES):
            P[i, j] *= (root if i > 1 else 1.0) * (root if j > 1 else 1.0)


@compiled(inline=True)
def _adapt(s: Float[np.ndarray, " s"]) -> None:
    """Let the force variance follow the innovations: q+ = q (mean e' S^-1 e / size)^gamma.

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
    factor = min(max(mean, 1.0 / _LARGEST_ADAPTATION), _LARGEST_ADAPTATION) ** gamma
    most = admission(s).largest_effort ** 2
    least = most * _LEAST_FORCE * _LEAST_FORCE
    s[FORCE_VARIANCE] = min(max(factor * s[FORCE_VARIANCE], least), max(most, least))
    if mean > _OVERCONFIDENT:
        factor = min(mean, _LARGEST_ADAPTATION)
        _scale_friction(s, CAREFUL, factor)
        scale_batches(s, BATCHES, FRICTION, 1.0 / factor)
        scale_contrasts(s, CONTRASTS, FRICTION, 1.0 / factor)
        for i in range(FRICTION + FRICTION * FRICTION):
            s[SPELL_START + i] /= factor


@compiled(inline=True)
def _inverse(s: Float[np.ndarray, " s"], at: int, J: Float[np.ndarray, "3 3"]) -> bool:
    """Write the inverse of the covariance of friction to J (zeros for what is not estimated)."""
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    a, b, c = P[2, 2], P[2, 3], P[3, 3]
    for i in range(FRICTION):
        for j in range(FRICTION):
            J[i, j] = 0.0
    if s[PARAMETERS] < FRICTION:
        det = a * c - b * b
        J[0, 0], J[0, 1], J[1, 0], J[1, 1] = c / det, -b / det, -b / det, a / det
        return det > 0.0 and a > 0.0
    d, e, f = P[2, 4], P[3, 4], P[4, 4]
    det = a * (c * f - e * e) - b * (b * f - d * e) + d * (b * e - c * d)
    J[0, 0], J[1, 1], J[2, 2] = (c * f - e * e) / det, (a * f - d * d) / det, (a * c - b * b) / det
    J[0, 1], J[0, 2], J[1, 2] = (d * e - b * f) / det, (b * e - c * d) / det, (b * d - a * e) / det
    J[1, 0], J[2, 0], J[2, 1] = J[0, 1], J[0, 2], J[1, 2]
    return det > 0.0 and a > 0.0


@compiled(inline=True)
def _keep_batch(s: Float[np.ndarray, " s"], at: int, batches: int) -> None:
    """Keep the information of a filter at the end of a batch."""
    J, eta = np.empty((FRICTION, FRICTION)), np.zeros(FRICTION)
    if _inverse(s, at, J):
        for i in range(FRICTION):
            for j in range(FRICTION):
                eta[i] += J[i, j] * s[at + 2 + j]
        close_batch(s, batches, FRICTION, J, eta)


@compiled(inline=True)
def _contrast(s: Float[np.ndarray, " s"]) -> None:
    """Add what the careful filter learned to the groups of its samples, when these change."""
    groups = classify(s, CONTRASTS, s[CAREFUL + 1])
    if groups == int(s[SPELL]):
        return
    J, eta = np.empty((FRICTION, FRICTION)), np.zeros(FRICTION)
    if not _inverse(s, CAREFUL, J):
        return
    start = s[SPELL_START + FRICTION : MEMORY].reshape(FRICTION, FRICTION)
    for i in range(FRICTION):
        for j in range(FRICTION):
            eta[i] += J[i, j] * s[CAREFUL + 2 + j]
    for i in range(FRICTION):
        before = s[SPELL_START + i]
        s[SPELL_START + i] = eta[i]
        eta[i] -= before
        for j in range(FRICTION):
            before = start[i, j]
            start[i, j] = J[i, j]
            J[i, j] -= before
    add_information(s, CONTRASTS, FRICTION, int(s[SPELL]), J, eta)
    s[SPELL] = groups


@compiled(inline=True)
def _is_plausible(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether friction is within `_PLAUSIBLE` times the largest effort."""
    P = s[CAREFUL + COVARIANCE : CAREFUL + WALK].reshape(STATES, STATES)
    most = _PLAUSIBLE * admission(s).largest_effort
    viscous = abs(s[CAREFUL + 2]) - _PLAUSIBLE * np.sqrt(max(P[2, 2], 0.0))
    coulomb = abs(s[CAREFUL + 3]) - _PLAUSIBLE * np.sqrt(max(P[3, 3], 0.0))
    offset = abs(s[CAREFUL + 4]) - _PLAUSIBLE * np.sqrt(max(P[4, 4], 0.0))
    return viscous * s[LARGEST_SPEED] <= most and coulomb <= most and offset <= most


@compiled(inline=True)
def _is_valid(s: Float[np.ndarray, " s"], at: int) -> bool:
    """Return whether a filter's states are finite and its variances finite and not negative."""
    total = 0.0
    valid = True
    for i in range(STATES):
        variance = s[at + COVARIANCE + i * (STATES + 1)]
        total += s[at + i] + variance
        valid = valid and variance >= 0.0
    return valid and np.isfinite(total)


@compiled(inline=True)
def _keep_good(s: Float[np.ndarray, " s"]) -> None:
    """Keep friction and its covariance as the last valid ones."""
    P = s[CAREFUL + COVARIANCE : CAREFUL + WALK].reshape(STATES, STATES)
    for i in range(FRICTION):
        s[GOOD + i] = s[CAREFUL + 2 + i]
        for j in range(FRICTION):
            s[GOOD + FRICTION + i * FRICTION + j] = P[2 + i, 2 + j]


@compiled(inline=True)
def _reset(s: Float[np.ndarray, " s"]) -> None:
    """Return to the friction of the last valid state; the motion begins again."""
    s[RESETS] += 1.0
    P = s[CAREFUL + COVARIANCE : CAREFUL + WALK].reshape(STATES, STATES)
    for i in range(STATES):
        s[CAREFUL + i], s[SHARP + i] = 0.0, 0.0
        s[CAREFUL + RESPONSE + i], s[SHARP + RESPONSE + i] = 0.0, 0.0
    for i in range(FRICTION):
        s[CAREFUL + 2 + i] = s[GOOD + i]
        for j in range(FRICTION):
            P[2 + i, 2 + j] = s[GOOD + FRICTION + i * FRICTION + j]
    s[STAGE] = LEFT
    s[GATE_SCALE], s[MISMATCH], s[MISMATCHED] = 1.0, 0.0, 0.0
    s[SPELL] = EVERYWHERE
    _forget_motion(s)


@compiled(inline=True)
def _knows_the_events(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether stops and breakaways can be linearised about the friction as known.

    The sample of a breakaway is certain when the error of f_c +- o is smaller than the change of
    the effort in one sample. Its effect on the velocity and position of a single sample must also
    be small beside the sensors' noise: otherwise one measurement after a breakaway may reverse the
    predicted motion.
    """
    P = s[CAREFUL + COVARIANCE : CAREFUL + WALK].reshape(STATES, STATES)
    spread = _LOOSER * (P[3, 3] + P[4, 4] + 2.0 * abs(P[3, 4]))
    speed = spread * (s[SAMPLING_TIME] / s[MASS]) ** 2
    way = 0.25 * speed * s[SAMPLING_TIME] ** 2
    hidden = speed < _HIDDEN * s[VELOCITY_VARIANCE] and way < _HIDDEN * s[POSITION_VARIANCE]
    return spread < s[CHANGE] and hidden and s[CAREFUL + 3] > 0.0


@compiled(inline=True)
def _sharpen(s: Float[np.ndarray, " s"]) -> None:
    """Begin the sharp filter, with the first sample that is kept or else with this one."""
    for i in range(WALK):
        s[SHARP + i] = s[CAREFUL + i]
    P = s[SHARP + COVARIANCE : SHARP + WALK].reshape(STATES, STATES)
    s[BEHIND] = 0.0
    s[STAGE] = TRUSTED
    clear_batches(s, SHARP_BATCHES)
    # It catches up with the samples that come in while there is room for these
    if 0.0 < s[STORED] * _PACE <= (_PACE - 1) * ((s.size - MEMORY) // 3):
        s[STAGE] = REPLAYING
        s[REPLAYED] = 1.0
        s[SHARP], s[SHARP + 1] = s[MEMORY + 1], s[MEMORY + 2]
        for i in range(STATES):
            for j in range(STATES):
                P[i, j] = _LOOSER * P[i, j] if i > 1 and j > 1 else 0.0
        _unknown_motion(s, P, 0.0)
    for i in range(FRICTION):
        s[SHARP + WALK + i] = s[DRIFT + i] + RESOLUTION * P[2 + i, 2 + i]


@compiled(inline=True)
def _unknown_motion(s: Float[np.ndarray, " s"], P: Float[np.ndarray, "5 5"], speed: float) -> None:
    """Set what is known of position and velocity by one sample, in a P that is 0 there.

    Without a velocity sensor the velocity is 0, up to the speed and the noise of a sample.
    """
    P[0, 0] = s[POSITION_VARIANCE]
    P[1, 1] = s[VELOCITY_VARIANCE]
    if not np.isfinite(P[1, 1]):
        P[1, 1] = 2.0 * P[0, 0] / s[SAMPLING_TIME] ** 2 + speed * speed


@compiled()
def forget_motion(s: Float[np.ndarray, " s"]) -> None:
    """Begin another stretch of samples, in place: friction as known, the motion anew."""
    restart_admission(admission(s))
    _forget_motion(s)


@compiled(inline=True)
def _forget_motion(s: Float[np.ndarray, " s"]) -> None:
    """Begin the motion anew, which may be as fast as the fastest so far."""
    s[KNOWN] = 0.0
    s[HELD_UNKNOWN] = 0.0
    s[STORED] = 0.0
    if s[STAGE] == REPLAYING:
        s[STAGE] = TRUSTED
    for at in (CAREFUL, SHARP):
        P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
        for i in range(2):
            s[at + RESPONSE + i] = 0.0
            for j in range(STATES):
                P[i, j] = 0.0
                P[j, i] = 0.0
        _unknown_motion(s, P, s[LARGEST_SPEED])


@compiled(inline=True)
def _follow(
    s: Float[np.ndarray, " s"], held: float, x: float, v: float, exactly: bool, unlikely: float
) -> None:
    """Let the sharp filter do what its stage asks for, after the careful one took the sample."""
    if s[STAGE] == LEARNING:
        if _knows_the_events(s):
            _sharpen(s)
    elif s[STAGE] == REPLAYING:
        for _ in range(_PACE):
            if s[REPLAYED] < s[STORED]:
                k = MEMORY + 3 * int(s[REPLAYED])
                _take(s, SHARP, s[k - 3], s[k + 1], s[k + 2])
                s[REPLAYED] += 1.0
        if s[REPLAYED] == s[STORED]:
            s[STAGE] = TRUSTED
    elif s[STAGE] == TRUSTED:
        exactly_too, squares, unlikely_too = _take(s, SHARP, held, x, v)
        s[INNOVATION] = squares
        # The careful filter does not model rests: a better prediction of them is no evidence
        if exactly and exactly_too:
            s[BEHIND] = max(0.0, s[BEHIND] + unlikely_too - unlikely)
        apart = abs(s[SHARP + 3] - s[CAREFUL + 3])
        coulomb = s[CAREFUL + COVARIANCE + 3 * (STATES + 1)]
        if (
            s[BEHIND] > _WORSE
            or abs(s[LACK]) > _LACKING * np.sqrt(s[LACK_VARIANCE])
            or apart > _DIFFERENT * np.sqrt(coulomb)
            or _sticks(s, held, x)
            or not _is_valid(s, SHARP)
        ):
            s[STAGE] = LEFT


@compiled(inline=True)
def _sticks(s: Float[np.ndarray, " s"], held: float, x: float) -> bool:
    """Return whether the axis rests although the effort is above Coulomb friction for certain.

    The net force |u - o| - f_c - 3 sigma would have moved it by `_DUE` standard deviations of the
    position.
    """
    deviation = np.sqrt(s[POSITION_VARIANCE])
    if np.isnan(x) or s[HELD_UNKNOWN] > 0.0:
        return False
    P = s[SHARP + COVARIANCE : SHARP + WALK].reshape(STATES, STATES)
    spread = P[3, 3] + P[4, 4] + 2.0 * abs(P[3, 4])
    net = abs(held - s[SHARP + 4]) - s[SHARP + 3] - _CERTAIN * np.sqrt(spread)
    if net <= 0.0 or abs(x - s[ANCHOR]) > _RESTING * deviation:
        s[ANCHOR], s[DUE_SPEED], s[DUE_WAY] = x, 0.0, 0.0
        return False
    s[DUE_SPEED] += net / s[MASS] * s[SAMPLING_TIME]
    s[DUE_WAY] += s[DUE_SPEED] * s[SAMPLING_TIME]
    return s[DUE_WAY] > _DUE * deviation


@compiled(brief=True)
def ekf_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether it was complete.

    Of a sample that is not (NaN, or impossible) only the rest is used. The load is not read.
    """
    whole = np.isfinite(u) and np.isfinite(x) and (np.isfinite(v) or s[VELOCITY_VARIANCE] == np.inf)
    ready, u, unknown, x, v, _, _, stepped = admit(admission(s), u, x, v, x2, v2)
    if not ready:
        return whole
    if stepped:
        _forget_motion(s)
    measured = np.isfinite(s[VELOCITY_VARIANCE])
    if s[KNOWN] == 0.0 and (np.isnan(x) or (measured and np.isnan(v))):
        return whole
    k = MEMORY + 3 * int(s[STORED])
    if s[STAGE] <= REPLAYING and k + 3 <= s.size and not (unknown or np.isnan(x) or stepped):
        s[k], s[k + 1], s[k + 2] = u, x, v
        s[STORED] += 1.0
    elif s[STAGE] == LEARNING and (unknown or np.isnan(x)):
        s[STORED] = 0.0  # the kept samples must follow each other
    exactly = False
    if s[KNOWN] > 0.0:
        held = s[HELD_EFFORT]
        if not unknown:
            s[SAMPLES] += 1.0
            s[CHANGE] += ((u - held) ** 2 - s[CHANGE]) / s[SAMPLES]
        exactly, s[INNOVATION], unlikely = _take(s, CAREFUL, held, x, v)
        _follow(s, held, x, v, exactly, unlikely)
        if not _is_valid(s, CAREFUL):
            _reset(s)
            exactly = False
    else:
        for at in (CAREFUL, SHARP):
            s[at], s[at + 1] = x, v if measured else 0.0
        s[KNOWN] = 1.0
    if exactly:
        _contrast(s)
        _adapt(s)
        if count_sample(s, BATCHES):
            if _is_plausible(s):
                _keep_good(s)
                _keep_batch(s, CAREFUL, BATCHES)
            else:
                _reset(s)
        if s[STAGE] == TRUSTED and count_sample(s, SHARP_BATCHES):
            _keep_batch(s, SHARP, SHARP_BATCHES)
    used = SHARP if s[STAGE] == TRUSTED else CAREFUL
    for i in range(FRICTION):
        s[VALUES + i] = s[used + 2 + i]
    s[HELD_EFFORT] = u
    s[HELD_UNKNOWN] = 1.0 if unknown else 0.0
    return whole


@compiled()
def ekf_run(
    s: Float[np.ndarray, " s"], samples: Float[np.ndarray, "n 5"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, " n"]]:
    """Take many samples, in place; return c, f_c and o after each, and the innovations."""
    n = samples.shape[0]
    history, innovations = np.empty((n, FRICTION)), np.empty(n)
    for k in range(n):
        ekf_step(s, samples[k, 0], samples[k, 1], samples[k, 2], samples[k, 3], samples[k, 4])
        for i in range(FRICTION):
            history[k, i] = s[VALUES + i]
        innovations[k] = s[INNOVATION]
    return history, innovations
