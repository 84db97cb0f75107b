"""Kernels of an extended Kalman filter whose states are the motion and its friction.

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
- `stickslip.estimation.online.kalman.one_filter` explains a large innovation by an unknown force,
  and lets the force noise follow the innovations.
- The state of the last complete batch that was finite and plausible is kept. One that is not is
  replaced by it.
"""

from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.faults.admission import admit, restart_admission
from stickslip.estimation.online.faults.unknown_force import PLAUSIBLE
from stickslip.estimation.online.intervals.batches import clear_batches, close_batch, count_sample
from stickslip.estimation.online.intervals.contrasts import EVERYWHERE, add_information, classify
from stickslip.estimation.online.kalman.one_filter import (
    adapt,
    information,
    is_valid,
    take,
    unknown_motion,
)
from stickslip.estimation.online.kalman.state import (
    FRICTION,
    LEARNING,
    LEFT,
    MEMORY,
    REPLAYING,
    STATES,
    TRUSTED,
    fields,
)
from stickslip.estimation.online.method import State

RESOLUTION = 1e-15
"""Variance that a parameter gains in a sample, over that which the filter began with: without it,
P loses its positive eigenvalues to rounding where the sensors are good."""
_LOOSER = 10.0
"""The sharp filter begins with this many times the careful one's covariance of friction, as what
that learned is from the same samples: counted twice, it weighs a tenth at most."""
_HIDDEN = 0.01  # of a sensor's variance, that one sample does not show
_PACE = 4  # kept samples that the sharp filter takes in one
_LACKING = 4.0  # standard deviations of the score
_WORSE = 15.0
"""How far the sharp filter may fall behind [nat]; in 19 of 20 logs it stays within 7 if right."""
_DIFFERENT = 4.0  # standard deviations between the Coulomb frictions of the two filters
_CERTAIN = 3.0  # standard deviations by which an effort must exceed Coulomb friction
_RESTING = 4.0  # standard deviations of the position within which an axis may be at rest
_DUE = 40.0
"""Standard deviations of the position that a resting axis should have moved by, until it is certain
that static friction holds it; so many that a slow reversal is no rest."""


@compiled(inline=True)
def _keep_batch(s: Any, f: Any, batches: Any) -> None:
    """Keep the information of a filter at the end of a batch."""
    J, eta = np.empty((FRICTION, FRICTION)), np.empty(FRICTION)
    if information(s, f, J, eta):
        close_batch(batches, J, eta)


@compiled(inline=True)
def _contrast(s: Any) -> None:
    """Add what the careful filter learned to the groups of its samples, when these change."""
    groups = classify(s.contrasts, s.careful.z[1])
    if groups == s.spell:
        return
    J, eta = np.empty((FRICTION, FRICTION)), np.empty(FRICTION)
    if not information(s, s.careful, J, eta):
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
    """Return whether friction is within `PLAUSIBLE` times the largest effort."""
    P = s.careful.P
    most = PLAUSIBLE * s.admission.largest_effort
    viscous = abs(s.careful.z[2]) - PLAUSIBLE * np.sqrt(max(P[2, 2], 0.0))
    coulomb = abs(s.careful.z[3]) - PLAUSIBLE * np.sqrt(max(P[3, 3], 0.0))
    offset = abs(s.careful.z[4]) - PLAUSIBLE * np.sqrt(max(P[4, 4], 0.0))
    return viscous * s.largest_speed <= most and coulomb <= most and offset <= most


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
        unknown_motion(s, f, 0.0)
    for i in range(FRICTION):
        f.walk[i] = s.drift[i] + RESOLUTION * f.P[2 + i, 2 + i]


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
        unknown_motion(s, f, s.largest_speed)


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
                take(s, s.sharp, False, vector[k - 3], vector[k + 1], vector[k + 2])
                s.replayed += 1
        if s.replayed == s.stored:
            s.stage = TRUSTED
    elif s.stage == TRUSTED:
        exactly_too, squares, unlikely_too = take(s, s.sharp, False, held, x, v)
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
            or not is_valid(s.sharp)
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
    followed = not (unknown or np.isnan(x) or stepped)
    if s.stage <= REPLAYING and s.stored < (vector.size - MEMORY) // 3 and followed:
        k = MEMORY + 3 * int(s.stored)
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
        exactly, s.innovation, unlikely = take(s, s.careful, True, held, x, v)
        _follow(vector, s, held, x, v, exactly, unlikely)
        if not is_valid(s.careful):
            _reset(s)
            exactly = False
    else:
        for f in (s.careful, s.sharp):
            f.z[0], f.z[1] = x, v if measured else 0.0
        s.known = 1
    if exactly:
        _contrast(s)
        adapt(s)
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
