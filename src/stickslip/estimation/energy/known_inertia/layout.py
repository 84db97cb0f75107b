"""What lies where in the state of the balance of work on line.

The state is that of `stickslip.estimation.online.recursion`, with room for four parameters, and
behind it what the two filters need.
"""

from stickslip.estimation.online.recursion import VALUES

__all__ = [
    "AXIS",
    "BEGAN",
    "CERTAINTIES",
    "CHANNELS",
    "COVARIANCE",
    "DEPTH",
    "DIFFERENCES",
    "DISAGREEMENT",
    "DISTURBANCE",
    "EARLIER_VELOCITY",
    "FORCES",
    "FREE",
    "FRICTION",
    "GAINS",
    "GUESS",
    "GUESSED",
    "HEADING",
    "INERTIA",
    "KEPT_EFFORT",
    "KEPT_STRETCH",
    "LAG",
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
]

LAG = 64
"""Samples by which the estimate is late: what a velocity gains from later ones is seen by then."""

DEPTH = LAG + 1  # samples remembered
CHANNELS = 4  # position and velocity of the driven mass, then of the load

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
) = range(VALUES + 4, VALUES + 4 + 19)
NOISE = SEEN + CHANNELS  # variances
GUESS = NOISE + CHANNELS  # guessed variances
GUESSED = GUESS + CHANNELS  # samples that the guess counts for
ROUGHNESS = GUESSED + CHANNELS  # sums of squared third differences
TALLIED = ROUGHNESS + CHANNELS  # samples that tell of the noise: an encoder that rests does not
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
WIDTH = 8  # effort, four channels, predicted velocity, two innovations
STATE_SIZE = RING + WIDTH * DEPTH
