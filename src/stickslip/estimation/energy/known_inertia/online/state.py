"""State of the online energy estimator with a known inertia.

The fields of the recursion (`stickslip.estimation.online.recursion`) come first, behind them those
of the two filters.
"""

from typing import Any

import numpy as np

from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE
from stickslip.estimation.online.faults.guard import guard_dtype
from stickslip.estimation.online.intervals.batches import batches_dtype
from stickslip.estimation.online.intervals.contrasts import contrasts_dtype
from stickslip.estimation.online.recursion import RECURSION
from stickslip.numerics.named_fields import fields_at, places

LAG = 64
"""Delay of the estimate [samples]; samples after that improve a smoothed velocity no further."""

DEPTH = LAG + 1  # samples remembered
CHANNELS = 4  # position and velocity of the driven mass, then of the load
MOST = 4  # parameters

_LEARNED: list[Any] = [
    ("recursion", RECURSION),
    ("eta", "f8", (MOST,)),  # sum of row times target
    ("information", "f8", (MOST, MOST)),  # J, sum of row times row'
]
_SAMPLE = np.dtype(
    [
        ("effort", "f8"),
        ("measured", "f8", (CHANNELS,)),
        ("predicted_velocity", "f8"),
        ("innovation", "f8", (2,)),  # of position and velocity, in the first filter
        ("missing", "i8"),  # channels, as a sum of 2^channel
        ("unknown", "f8"),  # variance of an unknown force in the interval that begins
    ]
)
_DISAGREEMENT = np.dtype(
    [
        ("last", "f8"),  # difference d of dx / T and the mean velocity
        ("difference_squares", "f8"),  # sum of (d - d_-)^2
        ("sum_squares", "f8"),  # sum of (d + d_-)^2
        ("samples", "f8"),
    ]
)
_FIELDS = np.dtype(
    [
        *_LEARNED,
        ("guard", guard_dtype(places(np.dtype(_LEARNED)))),
        ("inertia", "f8"),
        ("disturbance", "f8"),  # standard deviation of a disturbing force
        ("adaptations", "f8"),  # of the disturbance, from 1 on; 0 if it is given
        ("refresh", "f8"),  # number of counted samples at which noise is next estimated; 0 at first
        ("began", "f8"),  # samples before the filters began
        ("origin", "f8"),  # first position
        ("settled", "f8"),  # samples after which the first filter has forgotten how it began
        ("earlier_velocity", "f8"),  # of the sample before the one that is being whitened
        ("turns", "f8"),  # reversals so far
        ("heading", "f8"),  # direction of the last certain motion
        ("certain_samples", "f8"),  # in which the direction of friction was certain
        ("friction_squares", "f8"),  # sum of squared friction in them
        ("net_square", "f8"),  # largest squared effort less spring force
        ("friction_square", "f8"),  # mean square of the friction
        ("velocity_spread", "f8"),  # standard deviation of the smoothed velocity
        ("uncertain_run", "f8"),  # samples in a row, up to now, with friction of unknown direction
        ("residual_squares", "f8"),  # sum of squared prediction errors over their variances
        ("rows", "f8"),  # number of them
        ("mismatch", "f8"),  # sum of squared innovations over their variances since an adaptation
        ("mismatch_rows", "f8"),  # number of them
        ("gate_scale", "f8"),  # running mean of squared innovations over their variances
        ("force_events", "f8"),  # samples whose innovation only an unknown force explains
        # Of the sample that has just left the ring
        ("kept_effort", "f8"),
        ("kept_stretch", "f8"),  # of its spring
        ("kept_unknown", "f8"),  # variance of its unknown force
        # Of each channel
        ("is_measured", "i8", (CHANNELS,)),
        ("noise", "f8", (CHANNELS,)),  # variance
        ("guess", "f8", (CHANNELS,)),  # guessed variance
        ("guess_samples", "f8", (CHANNELS,)),  # that the guess counts for
        ("roughness", "f8", (CHANNELS,)),  # sum of squared third differences
        ("noisy_samples", "f8", (CHANNELS,)),  # that show noise: those of a resting encoder do not
        ("squares", "f8", (CHANNELS,)),  # sum of squares
        ("differences", "f8", (CHANNELS, 3)),  # last value, first and second difference
        ("chain", "f8", (CHANNELS,)),  # measurements in a row
        ("disagreement", _DISAGREEMENT, (2,)),  # of each mass
        # First filter: position, velocity and friction
        ("free", "f8", (3,)),  # predicted states
        ("gains", "f8", (2, 3)),  # of the innovations of position and velocity
        ("taps", "f8", (DEPTH, 2)),  # of those innovations on an earlier velocity
        # Second filter: position and velocity of both masses
        ("transition", "f8", (4, 4)),
        ("held", "f8", (4,)),  # response to a unit force
        ("ramped", "f8", (4,)),  # response to a force of unit slope
        ("covariance", "f8", (4, 4)),
        ("responses", "f8", (MOST + 1, 4)),  # states, for the measurements and each regressor
        ("ring", _SAMPLE, (DEPTH,)),
        ("batches", batches_dtype(MOST)),
        ("contrasts", contrasts_dtype(MOST)),
        ("admission", ADMISSION_DTYPE),
    ]
)

STATE_SIZE = places(_FIELDS)

fields = fields_at(_FIELDS)
