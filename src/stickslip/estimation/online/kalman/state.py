"""State of the two Kalman filters side by side: named fields of one vector."""

import numpy as np

from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE
from stickslip.estimation.online.intervals.batches import batches_dtype
from stickslip.estimation.online.intervals.contrasts import contrasts_dtype
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

VALUES = place_of(STATE, "values")
"""Place of the first estimate in a state."""
MEMORY = places(STATE)
