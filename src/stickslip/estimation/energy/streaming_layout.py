"""What lies where in the state of the energy levels on line, with the inertia sought.

The state is that of `stickslip.estimation.online.recursion`, and behind it what the levels need.
"""

from stickslip.estimation.online.recursion import MOST_PARAMETERS, VALUES

__all__ = [
    "ACCEPTED",
    "AVERAGED",
    "CONSTANT",
    "CONSTANT_SPREAD",
    "DIFFERENCES",
    "EARLIER",
    "EXTREME",
    "FILTER",
    "FORCE_VARIANCE",
    "HYSTERESIS",
    "KNOWN",
    "LAST",
    "LEVEL_VARIANCE",
    "MARK",
    "MEAN",
    "POLE",
    "POSITION_NOISE",
    "ROUGHNESS",
    "SINCE",
    "SQUARE_BIAS",
    "STATE_SIZE",
    "SUMS",
    "VELOCITY_NOISE",
    "WAY",
    "WORK",
]

(
    # Settings
    POLE,  # of the causal low-pass where velocities are differentiated
    POSITION_NOISE,  # standard deviations; negative: estimated on the way
    VELOCITY_NOISE,
    LEVEL_VARIANCE,
    FORCE_VARIANCE,
    HYSTERESIS,  # in standard deviations of the fused position
    SQUARE_BIAS,  # of a differentiated velocity's square, over the variance of the position [1/s^2]
    # What changes
    WORK,
    WAY,  # direction of travel
    EXTREME,  # furthest point in that direction
    MARK,  # that point at the last accepted row
    SINCE,  # way since then
    ACCEPTED,
    CONSTANT_SPREAD,  # variance of the level's constant
    KNOWN,  # samples in the differentiating filter, up to 2
    AVERAGED,  # samples since the last accepted row
) = range(VALUES + MOST_PARAMETERS, VALUES + MOST_PARAMETERS + 16)
ROUGHNESS = AVERAGED + 1  # running means of squared third differences of position and velocity
LAST = ROUGHNESS + 2  # effort, fused position, velocity
FILTER = LAST + 3  # two stages each for effort, position, load position
EARLIER = FILTER + 6  # filtered effort, position, load position, one and two samples ago
DIFFERENCES = EARLIER + 6  # last value, first and second difference of position, of velocity
SUMS = DIFFERENCES + 6  # regressors
CONSTANT = SUMS + MOST_PARAMETERS  # level of the balance, then of each regressor
MEAN = CONSTANT + MOST_PARAMETERS + 1  # means of the same since the last accepted row
STATE_SIZE = MEAN + MOST_PARAMETERS + 1
