"""State of the online energy estimator with an unknown inertia.

The fields of the recursion (`stickslip.estimation.online.recursion`) come first, behind them those
of the energy levels.
"""

from typing import Any

import numpy as np

from stickslip.estimation.online.faults.admission import ADMISSION_DTYPE
from stickslip.estimation.online.faults.guard import guard_dtype
from stickslip.estimation.online.intervals.batches import batches_dtype
from stickslip.estimation.online.intervals.contrasts import contrasts_dtype
from stickslip.estimation.online.recursion import MOST_PARAMETERS, RECURSION
from stickslip.numerics.named_fields import fields_at, places

_TRACKED = np.dtype(
    [
        ("samples", "f8"),  # in a row
        ("differences_seen", "f8"),  # third differences so far
        ("differences", "f8", (3,)),  # last value, first and second difference
        ("roughness", "f8"),  # running mean of squared third differences
    ]
)
_MOTION = np.dtype([("effort", "f8"), ("position", "f8"), ("load_position", "f8")])

_LEARNED: list[Any] = [
    ("recursion", RECURSION),
    # Settings
    ("pole", "f8"),  # of the causal low-pass where velocities are differentiated
    ("position_noise", "f8"),  # standard deviations; negative: estimated from the samples
    ("velocity_noise", "f8"),
    ("row_variance", "f8"),  # of a level and the walk since the last row, together
    # Of a differentiated velocity's square, over the variance of the position [1/s^2]
    ("square_bias", "f8"),
    ("settle", "f8"),  # samples without a gap before a level counts
    # Motion
    ("heading", "f8"),  # direction of travel
    ("extreme", "f8"),  # furthest point in that direction
    ("mark", "f8"),  # that point at the last accepted row
    ("filtered_samples", "f8"),  # in the differentiating filter, up to 2
    ("chain", "f8"),  # samples since the last gap or unknown force
    ("unknown", "f8"),  # 1 if the force in the current interval is unknown
    ("tracked", _TRACKED, (2,)),  # noise of position and velocity
    ("last_effort", "f8"),
    ("last_position", "f8"),  # fused
    ("last_velocity", "f8"),
    ("stages", "f8", (3, 2)),  # two of the low-pass for effort, position and load position
    ("filtered", _MOTION),  # one sample ago
    ("earlier", _MOTION),  # two samples ago
    # Levels
    ("work", "f8"),
    ("sums", "f8", (MOST_PARAMETERS,)),  # regressors
    ("travel", "f8"),  # since the last accepted row
    ("accepted", "f8"),  # levels since the level's constant began
    ("averaged", "f8"),  # samples since the last accepted row
    ("means", "f8", (MOST_PARAMETERS + 1,)),  # of level and regressors since then
    ("constants", "f8", (MOST_PARAMETERS + 1,)),  # of the level, then of each regressor
    ("constant_spread", "f8"),  # variance of the level's constant
    ("level_variance", "f8"),
    ("force_variance", "f8"),  # of a disturbance force, in the same unit
    # Innovations of the rows
    ("adaptations", "f8"),  # of the force variance, from 1 on; 0 if it is given
    ("block_rows", "f8"),  # rows since the last adaptation
    ("travel_square", "f8"),  # mean squared travel of a row
    ("products", "f8"),  # sum of products of neighbouring normalised innovations
    ("squares", "f8"),  # sum of their squares
    ("last_error", "f8"),  # the last of them
    ("gate_scale", "f8"),  # running mean of their squares
    ("rows", "f8"),  # number of them
    ("noise_squares", "f8"),  # sum of the kinetic energy's variances in the rows of the block
    ("kinetic_squares", "f8"),  # sum of its squares
    ("force_events", "f8"),  # rows that only an unknown force explains
    # Information
    ("eta", "f8", (MOST_PARAMETERS,)),  # sum of row times target
    ("information", "f8", (MOST_PARAMETERS, MOST_PARAMETERS)),  # sum of row times row'
]
_FIELDS = np.dtype(
    [
        *_LEARNED,
        ("guard", guard_dtype(places(np.dtype(_LEARNED)))),
        ("batches", batches_dtype(MOST_PARAMETERS)),
        ("contrasts", contrasts_dtype(MOST_PARAMETERS)),
        ("admission", ADMISSION_DTYPE),
    ]
)
STATE_SIZE = places(_FIELDS)

fields = fields_at(_FIELDS)
