"""Kernels of an extended Kalman filter whose states are the motion and its friction.

The states of a filter are z = (x, v, c, f_c, o): position, velocity, viscous friction, Coulomb
friction and offset. Between samples x and v move as `predicted` says, exactly; friction stays.

At rest, friction is whatever the effort asks for, up to a limit: a sample says that the limit is
not reached, which is an inequality, and no Gaussian can hold it. A filter that takes it for an
equation learns that the limit is the effort of the moment, is soon sure of it, and diverges. So
there are two filters side by side:

- The *careful* one carries the motion through what may be a rest under an unknown force, and learns
  nothing of friction there. It needs no good first guess, but forgets the motion at every stop.
- The *sharp* one takes stops, reversals, rests and breakaways as exactly as all other motion. That
  is sound once friction is known so well that the sample of each event follows from it; it begins
  then, with the first of the samples that were kept until then.

The sharp one takes static friction for Coulomb friction. If it is more, the axis is slower after a
breakaway than believed; the filter looks for another speed there (a score test), and whether the
careful one predicts the motion better. If either is so, the sharp one is left for good.
"""

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.ekf_motion import predicted
from stickslip.estimation.online.recursion import SAMPLING_TIME, VALUES

__all__ = [
    "CAREFUL",
    "COVARIANCE",
    "DRIFT",
    "FORCE_VARIANCE",
    "FRICTION",
    "INNOVATION",
    "KNOWN",
    "LEARNING",
    "LEFT",
    "MASS",
    "MEMORY",
    "POSITION_VARIANCE",
    "RESOLUTION",
    "REST_SPEED",
    "REST_VARIANCE",
    "SHARP",
    "STAGE",
    "STATES",
    "TRUSTED",
    "VELOCITY_VARIANCE",
    "WALK",
    "ekf_run",
    "ekf_step",
    "forget_motion",
]

STATES = 5
FRICTION = 3  # of these: c, f_c, o; those of the filter that is believed stand at VALUES

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
) = range(VALUES + FRICTION, VALUES + FRICTION + 17)
DRIFT = REPLAYED + 1  # variances by which c, f_c and o wander in a sample
CAREFUL = DRIFT + FRICTION

# Within the part of a filter: its states, then
COVARIANCE = STATES
WALK = COVARIANCE + STATES * STATES  # variances that friction gains in a sample
RESPONSE = (
    WALK + FRICTION
)  # r: error of z if every breakaway gave a speed of one less than believed
SHARP = CAREFUL + RESPONSE + STATES
MEMORY = SHARP + RESPONSE + STATES  # u, x, v of the first samples, to the end of the state

LEARNING, REPLAYING, TRUSTED, LEFT = 0.0, 1.0, 2.0, 3.0  # stages of the sharp filter

RESOLUTION = 1e-15
"""Variance that a parameter gains in a sample, over that which the filter began with: without it,
P loses its positive eigenvalues to rounding where the sensors are good."""
_SURE = 3.0  # standard deviations of the velocity from 0, from which on the axis moves for sure
_LOOSER = 10.0
"""The sharp filter begins with this many times the careful one's covariance of friction, as what
that learnt is from the same samples: counted twice, it weighs a tenth at most."""
_HIDDEN = 0.01  # of a sensor's variance, that one sample does not show
_PACE = 4  # kept samples that the sharp filter takes in one
_LACKING = 4.0  # standard deviations of the score
_WORSE = 15.0
"""How far the sharp filter may fall behind [nat]; in 19 of 20 logs it stays within 7 if right."""


@compiled(inline=True)
def _carry(s: Float[np.ndarray, " s"], at: int, u: float) -> bool:
    """Predict: z by the axis' own motion, P by F P F' + Q; return whether by the exact one."""
    T, m = s[SAMPLING_TIME], s[MASS]
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    F = np.zeros((2, STATES))
    x, v, q = s[at], s[at + 1], s[FORCE_VARIANCE]
    rested = v == 0.0
    slow = max(s[REST_SPEED], _SURE * np.sqrt(P[1, 1]))
    unclear = s[REST_SPEED] > 0.0 and abs(v) < slow
    if unclear and at == SHARP:
        # Friction stops the spread of the velocity within m P_vv / (2 f_c), and to linearise that
        # is sound if a position sensor would hardly see it
        unclear = m * P[1, 1] > 2.0 * max(s[at + 3], 0.0) * np.sqrt(s[POSITION_VARIANCE])
    if unclear:
        F[0, 0], F[0, 1], F[1, 1] = 1.0, T, 1.0
        x += v * T
        q = s[REST_VARIANCE]
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
    """Take a measurement of state k: K = P h / S, (I - K h') P (I - K h')' + K R K' (Joseph).

    Returns e^2 / S and log S of the innovation e; zeros where it says nothing.
    """
    P = s[at + COVARIANCE : at + WALK].reshape(STATES, STATES)
    S = P[k, k] + variance
    if not (S > 0.0 and np.isfinite(S)):
        return 0.0, 0.0
    e = measured - s[at + k]
    lack = s[at + RESPONSE + k]
    s[LACK] += lack * e / S
    s[LACK_VARIANCE] += lack * lack / S
    gain = np.empty(STATES)
    for i in range(STATES):
        gain[i] = P[i, k] / S
        s[at + i] += gain[i] * e
        s[at + RESPONSE + i] -= gain[i] * lack
    row, column = np.empty(STATES), np.empty(STATES)
    for j in range(STATES):
        row[j] = P[k, j]
    for i in range(STATES):
        for j in range(STATES):
            P[i, j] -= gain[i] * row[j]
    for i in range(STATES):
        column[i] = P[i, k]
    for i in range(STATES):
        for j in range(i, STATES):
            P[i, j] += gain[j] * (gain[i] * variance - column[i])
            P[j, i] = P[i, j]
    return e * e / S, np.log(S)


@compiled(inline=True)
def _take(
    s: Float[np.ndarray, " s"], at: int, u: float, x: float, v: float
) -> tuple[bool, float, float]:
    """Take a sample after the effort u into the filter at a place.

    Returns whether the exact motion led to it, e' S^-1 e, and how unlikely it was [nat].
    """
    exactly = _carry(s, at, u)
    square_x, log_x = _correct(s, at, 0, x, s[POSITION_VARIANCE])
    square_v, log_v = _correct(s, at, 1, v, s[VELOCITY_VARIANCE])
    squares = square_x + square_v
    return exactly, squares, 0.5 * (squares + log_x + log_v)


@compiled(inline=True)
def _knows_the_events(s: Float[np.ndarray, " s"]) -> bool:
    """Return whether stops and breakaways can be linearised about the friction as known.

    The sample of a breakaway is told when f_c +- o is known better than the effort changes in one.
    And what is unknown of it must not show in the velocity and way of a single sample, beside the
    sensors' noise: else one reading after a breakaway may turn the motion round in belief.
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
    # It catches up with the samples that come in while there is room for these
    if 0.0 < s[STORED] * _PACE <= (_PACE - 1) * ((s.size - MEMORY) // 3):
        s[STAGE] = REPLAYING
        s[REPLAYED] = 1.0
        s[SHARP], s[SHARP + 1] = s[MEMORY + 1], s[MEMORY + 2]
        for i in range(STATES):
            for j in range(STATES):
                P[i, j] = _LOOSER * P[i, j] if i > 1 and j > 1 else 0.0
        _unknown_motion(s, P)
    for i in range(FRICTION):
        s[SHARP + WALK + i] = s[DRIFT + i] + RESOLUTION * P[2 + i, 2 + i]


@compiled(inline=True)
def _unknown_motion(s: Float[np.ndarray, " s"], P: Float[np.ndarray, "5 5"]) -> None:
    """Set what is known of position and velocity by one sample, in a P that is 0 there."""
    P[0, 0] = s[POSITION_VARIANCE]
    P[1, 1] = s[VELOCITY_VARIANCE]
    if not np.isfinite(P[1, 1]):
        # Without a velocity sensor the axis starts at rest, give or take the noise of a sample
        P[1, 1] = 2.0 * P[0, 0] / s[SAMPLING_TIME] ** 2


@compiled()
def forget_motion(s: Float[np.ndarray, " s"]) -> None:
    """Begin another stretch of samples, in place: friction as known, the motion anew."""
    s[KNOWN] = 0.0
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
        _unknown_motion(s, P)


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
        # Of rests the careful filter knows nothing: to predict them better proves nothing
        if exactly and exactly_too:
            s[BEHIND] = max(0.0, s[BEHIND] + unlikely_too - unlikely)
        if s[BEHIND] > _WORSE or abs(s[LACK]) > _LACKING * np.sqrt(s[LACK_VARIANCE]):
            s[STAGE] = LEFT


@compiled(brief=True)
def ekf_step(
    s: Float[np.ndarray, " s"], u: float, x: float, v: float, x2: float, v2: float
) -> bool:
    """Take one sample into the state, in place; return whether all of it was finite."""
    if not np.isfinite(u + x + v + x2 + v2):
        return False
    k = MEMORY + 3 * int(s[STORED])
    if s[STAGE] <= REPLAYING and k + 3 <= s.size:
        s[k], s[k + 1], s[k + 2] = u, x, v
        s[STORED] += 1.0
    if s[KNOWN] > 0.0:
        held = s[HELD_EFFORT]
        s[SAMPLES] += 1.0
        s[CHANGE] += ((u - held) ** 2 - s[CHANGE]) / s[SAMPLES]
        exactly, s[INNOVATION], unlikely = _take(s, CAREFUL, held, x, v)
        _follow(s, held, x, v, exactly, unlikely)
    else:
        for at in (CAREFUL, SHARP):
            s[at], s[at + 1] = x, v
        s[KNOWN] = 1.0
    believed = SHARP if s[STAGE] == TRUSTED else CAREFUL
    for i in range(FRICTION):
        s[VALUES + i] = s[believed + 2 + i]
    s[HELD_EFFORT] = u
    return True


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
