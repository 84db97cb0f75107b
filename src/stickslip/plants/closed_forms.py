"""Functions in which the motion of a mass under a constant force and viscous friction is written.

With m v' = F - c v and z = -c t/m: v(t) = v_0 e^z + (F t/m) phi1(z) and
x(t) = v_0 t phi1(z) + (F t^2/m) phi2(z). A mass with velocity v > 0 that the force -B slows down
stops after (m v/B) stopping_time(c v/B), within (m v^2/B) stopping_distance(c v/B). Each keeps its
relative accuracy as c goes to 0, where the textbook forms cancel.
"""

import math

from stickslip.compiled import compiled

_SERIES_TERMS = 22  # of phi2 at |z| < 1: 1/24! = 2e-24
_ATANH_TERMS = 36  # at z < 1, where w = z/(2 + z) < 1/3: 3^-34 = 6e-17


@compiled(inline=True)
def phi1(z: float) -> float:
    """(e^z - 1)/z."""
    return math.expm1(z) / z if z != 0.0 else 1.0


@compiled(inline=True)
def phi2(z: float) -> float:
    """(e^z - 1 - z)/z^2."""
    if abs(z) > 1.0:
        return (math.expm1(z) - z) / (z * z)
    total = 0.0
    for k in range(_SERIES_TERMS, 1, -1):
        total = (total + 1.0) * z / (k + 1)
    return 0.5 * (1.0 + total)


@compiled(inline=True)
def stopping_time(z: float) -> float:
    """log(1 + z)/z."""
    return math.log1p(z) / z if z != 0.0 else 1.0


@compiled(inline=True)
def stopping_distance(z: float) -> float:
    """(z - log(1 + z))/z^2, for z >= 0.

    With w = z/(2 + z) it is (1 - w)^2/4 * 2 sum_{k>=2} w^(k-2) (1 - [k odd]/k).
    """
    if z > 1.0:
        return (z - math.log1p(z)) / (z * z)
    w = z / (2.0 + z)
    total = 0.0
    for k in range(_ATANH_TERMS, 1, -1):
        total = total * w + (1.0 if k % 2 == 0 else 1.0 - 1.0 / k)
    return 0.5 * (1.0 - w) * (1.0 - w) * total
