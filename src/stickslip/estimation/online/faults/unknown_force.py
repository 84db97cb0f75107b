"""Forces that no model explains: the gate of an innovation, and how a force noise adapts.

The online filters have these in common. An innovation beyond the gate is explained by an unknown
force in that sample. Without a given force noise q, q follows the innovations block by block
(bounded covariance matching), q+ = q (mean e' S^-1 e / size)^gamma.
"""

import numpy as np

from stickslip.compiled import compiled

GATE = 64.0
"""Squared innovation over its (usual) variance beyond which there was an unknown force [-]."""
GATE_MEMORY = 1.0 / 256.0  # weight of an innovation in the running mean that scales the gate [-]
ADAPTATION = 64.0  # innovations from one adaptation of the force noise to the next [-]
OVERCONFIDENT = 2.0
"""Mean squared innovation over its variance beyond which the information so far is reduced, and q
follows at once [-]: 1 in 10^5 adaptations exceeds it by chance. At 1.5 of 32 measurements 1 in 30
does, and the information of a log is lost several times over."""
PLAUSIBLE = 5.0  # friction over the largest effort beyond which an estimate is not plausible [-]

_LEAST_EXPONENT = 0.05  # of an adaptation after many of them [-]


@compiled(inline=True)
def adaptation_exponent(mean: float, adaptations: float) -> float:
    """Return gamma: it falls from 1 with the adaptations so far, unless q is far too small."""
    if mean > OVERCONFIDENT:
        return 1.0
    return max(_LEAST_EXPONENT, 1.0 / np.sqrt(adaptations))
