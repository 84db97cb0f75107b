"""State layout of the online energy estimator with known inertia.

The state is that of `stickslip.estimation.online.recursion`, with room for four parameters, and
behind it what the two filters need.
"""

from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE, ADMISSION_SIZE
from stickslip.estimation.online.faults.guard import guard_size
from stickslip.estimation.online.intervals.batches import batch_size
from stickslip.estimation.online.intervals.contrasts import contrast_size
from stickslip.estimation.online.recursion import VALUES
from stickslip.numerics.named_fields import fields_at

__all__ = [
    "ADAPTED",
    "ADMISSION",
    "AXIS",
    "BATCHES",
    "BEGAN",
    "CERTAINTIES",
    "CHAIN",
    "CHANNELS",
    "CONTRASTS",
    "COVARIANCE",
    "DEPTH",
    "DIFFERENCES",
    "DISAGREEMENT",
    "DISTURBANCE",
    "EARLIER_VELOCITY",
    "FORCES",
    "FORCE_EVENTS",
    "FREE",
    "FRICTION",
    "GAINS",
    "GATE_SCALE",
    "GUARD",
    "GUESS",
    "GUESSED",
    "HEADING",
    "INERTIA",
    "INFORMATION",
    "KEPT_EFFORT",
    "KEPT_STRETCH",
    "KEPT_UNKNOWN",
    "LAG",
    "MISMATCH",
    "MISMATCHED",
    "MOST",
    "NET",
    "NOISE",
    "REFRESH",
    "RESIDUALS",
    "RESPONSES",
    "RING",
    "ROUGHNESS",
    "ROWS",
    "SEEN",
    "SETTLED",
    "SPREAD_OF_VELOCITY",
    "SQUARES",
    "STATE_SIZE",
    "TALLIED",
    "TAPS",
    "TURNS",
    "UNCERTAIN",
    "WIDTH",
    "admission",
]

LAG = 64
"""Samples by which the estimate is late: what a velocity gains from later ones is seen by then."""

DEPTH = LAG + 1  # samples remembered
CHANNELS = 4  # position and velocity of the driven mass, then of the load
MOST = 4  # parameters
INFORMATION = VALUES + MOST  # eta, then J: sums of row times target, and of row times row'
GUARD = INFORMATION + MOST + MOST * MOST

(
    INERTIA,
    DISTURBANCE,  # standard deviation of a disturbing force
    REFRESH,  # number of telling samples at which the noise is next taken anew; 0 before the first
    BEGAN,  # samples before the filters began
    EARLIER_VELOCITY,  # of the sample before the one that is being whitened
    TURNS,  # reversals so far
    HEADING,  # direction of the last certain motion
    CERTAINTIES,  # samples in which the direction of friction was certain
    FORCES,  # sum of squared friction in them
    NET,  # largest squared effort less spring force
    FRICTION,  # mean square of the friction
    SPREAD_OF_VELOCITY,  # standard deviation of the smoothed velocity
    SETTLED,  # samples after which the first filter has forgotten how it began
    RESIDUALS,  # sum of squared prediction errors over their variances
    ROWS,  # number of them
    KEPT_EFFORT,  # of the sample that has just left the ring
    KEPT_STRETCH,  # and of its spring
    UNCERTAIN,  # samples in a row, up to now, in which the direction of friction was uncertain
    SEEN,  # which channels are measured
) = range(GUARD + guard_size(GUARD), GUARD + guard_size(GUARD) + 19)
NOISE = SEEN + CHANNELS  # variances
GUESS = NOISE + CHANNELS  # guessed variances
GUESSED = GUESS + CHANNELS  # samples that the guess counts for
ROUGHNESS = GUESSED + CHANNELS  # sums of squared third differences
TALLIED = ROUGHNESS + CHANNELS  # samples that show the noise: those of an encoder at rest do not
SQUARES = TALLIED + CHANNELS  # sums of squares
DIFFERENCES = SQUARES + CHANNELS  # last value, first and second difference
DISAGREEMENT = DIFFERENCES + 3 * CHANNELS  # of each mass, see `compare`
FREE = DISAGREEMENT + 4 * 2  # position, velocity and friction predicted
GAINS = FREE + 3  # of the first filter: position, then velocity
TAPS = GAINS + 6  # of the innovations of position and velocity
AXIS = TAPS + 2 * DEPTH  # transition (4 x 4), held and ramped response
COVARIANCE = AXIS + 24  # of the second filter
RESPONSES = COVARIANCE + 16  # its states, for the measurements and each regressor
RING = RESPONSES + 4 * 5
WIDTH = 10
"""Effort, four channels, predicted velocity, two innovations, missing channels (a sum of
2^channel), variance of an unknown force in the interval that begins."""
(
    ADAPTED,  # number of adaptations of the disturbance force, from 1 on; 0 if it is given
    MISMATCH,  # sum of squared innovations over their variances since the last one
    MISMATCHED,  # number of rows in it
    GATE_SCALE,  # running mean of squared innovations over their variances
    FORCE_EVENTS,  # samples whose innovation asked for an unknown force
    KEPT_UNKNOWN,  # variance of the unknown force of the sample that has just left the ring
) = range(RING + WIDTH * DEPTH, RING + WIDTH * DEPTH + 6)
CHAIN = KEPT_UNKNOWN + 1  # measurements of each channel in a row
BATCHES = CHAIN + CHANNELS
CONTRASTS = BATCHES + batch_size(MOST)
ADMISSION = CONTRASTS + contrast_size(MOST)
STATE_SIZE = ADMISSION + ADMISSION_SIZE

admission = fields_at(ADMISSION_DTYPE, start=ADMISSION)
