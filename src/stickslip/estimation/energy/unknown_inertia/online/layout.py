"""State layout of the online energy estimator with an unknown inertia.

The state is that of `stickslip.estimation.online.recursion`, and behind it what the levels need.
"""

from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE, ADMISSION_SIZE
from stickslip.estimation.online.faults.guard import guard_size
from stickslip.estimation.online.intervals.batches import batch_size
from stickslip.estimation.online.intervals.contrasts import contrast_size
from stickslip.estimation.online.recursion import MOST_PARAMETERS, VALUES
from stickslip.numerics.named_fields import fields_at

__all__ = [
    "ACCEPTED",
    "ADAPTED",
    "ADMISSION",
    "AVERAGED",
    "BATCHES",
    "CHAIN",
    "CONSTANT",
    "CONSTANT_SPREAD",
    "CONTRASTS",
    "DIFFERENCES",
    "EARLIER",
    "EXTREME",
    "FILTER",
    "FORCE_EVENTS",
    "FORCE_VARIANCE",
    "GATE_SCALE",
    "GUARD",
    "HYSTERESIS",
    "INFORMATION",
    "IN_BLOCK",
    "KINETIC_SQUARES",
    "KNOWN",
    "LAST",
    "LAST_ERROR",
    "LEVEL_VARIANCE",
    "MARK",
    "MEAN",
    "NOISE_SQUARES",
    "POLE",
    "POSITION_NOISE",
    "PRODUCTS",
    "ROUGHNESS",
    "ROWS",
    "ROW_VARIANCE",
    "SETTLE",
    "SINCE",
    "SQUARES",
    "SQUARE_BIAS",
    "STATE_SIZE",
    "SUMS",
    "TRACKED",
    "UNKNOWN",
    "VELOCITY_NOISE",
    "WAY",
    "WAY_SQUARE",
    "WORK",
    "admission",
]

(
    # Settings
    POLE,  # of the causal low-pass where velocities are differentiated
    POSITION_NOISE,  # standard deviations; negative: estimated on the way
    VELOCITY_NOISE,
    ROW_VARIANCE,  # of a level and the walk since the last row, together
    HYSTERESIS,  # in standard deviations of the fused position
    SQUARE_BIAS,  # of a differentiated velocity's square, over the variance of the position [1/s^2]
    SETTLE,  # samples without a gap before a level counts
    # What changes
    LEVEL_VARIANCE,
    FORCE_VARIANCE,  # of a disturbance force, in the same unit
    WORK,
    WAY,  # direction of travel
    EXTREME,  # furthest point in that direction
    MARK,  # that point at the last accepted row
    SINCE,  # way since then
    ACCEPTED,  # levels since the level's constant began
    CONSTANT_SPREAD,  # variance of the level's constant
    KNOWN,  # samples in the differentiating filter, up to 2
    AVERAGED,  # samples since the last accepted row
    CHAIN,  # samples since the last gap or unknown force
    UNKNOWN,  # whether the force in the current interval is unknown
    ADAPTED,  # number of adaptations of the force variance, from 1 on; 0 if it is given
    IN_BLOCK,  # rows since the last one
    WAY_SQUARE,  # mean squared way of a row
    PRODUCTS,  # sum of products of neighbouring normalised innovations
    SQUARES,  # sum of their squares
    NOISE_SQUARES,  # sum of the variances of the kinetic energy in the rows since then
    KINETIC_SQUARES,  # sum of its squares
    LAST_ERROR,  # the last of them
    GATE_SCALE,  # running mean of their squares
    ROWS,  # number of them
    FORCE_EVENTS,  # rows that only an unknown force explains
) = range(VALUES + MOST_PARAMETERS, VALUES + MOST_PARAMETERS + 31)
TRACKED = FORCE_EVENTS + 1  # samples in a row, and third differences so far, of either signal
ROUGHNESS = TRACKED + 4  # running means of squared third differences of position and velocity
LAST = ROUGHNESS + 2  # effort, fused position, velocity
FILTER = LAST + 3  # two stages each for effort, position, load position
EARLIER = FILTER + 6  # filtered effort, position, load position, one and two samples ago
DIFFERENCES = EARLIER + 6  # last value, first and second difference of position, of velocity
SUMS = DIFFERENCES + 6  # regressors
CONSTANT = SUMS + MOST_PARAMETERS  # level of the balance, then of each regressor
MEAN = CONSTANT + MOST_PARAMETERS + 1  # means of the same since the last accepted row
INFORMATION = MEAN + MOST_PARAMETERS + 1  # eta, then J: sums of row times target, and of row row'
GUARD = INFORMATION + MOST_PARAMETERS + MOST_PARAMETERS**2
BATCHES = GUARD + guard_size(GUARD)
CONTRASTS = BATCHES + batch_size(MOST_PARAMETERS)
ADMISSION = CONTRASTS + contrast_size(MOST_PARAMETERS)
STATE_SIZE = ADMISSION + ADMISSION_SIZE

admission = fields_at(ADMISSION_DTYPE, start=ADMISSION)
