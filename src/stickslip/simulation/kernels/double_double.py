"""Double-double arithmetic: a number kept as the sum of two doubles, with about 31 digits.

T. J. Dekker, "A floating-point technique for extending the available precision", Numer. Math. 18
(1971), pp. 224-242.
"""

from stickslip.compiled import compiled

__all__ = ["accumulate", "add", "divide", "multiply", "two_product"]

_SPLIT = 134217729.0  # 2^27 + 1, Dekker's splitting constant


@compiled(inline=True)
def accumulate(high: float, low: float, increment: float) -> tuple[float, float]:
    """Add to a double-double value; a zero increment leaves it bitwise the same.

    Dekker's fast two-sum: where the increment is the larger one, what it misses is within the
    increment's own rounding.
    """
    t = increment + low
    s = high + t
    return s, t - (s - high)


@compiled(inline=True)
def two_sum(a: float, b: float) -> tuple[float, float]:
    """Return a + b and what it rounds away."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@compiled(inline=True)
def two_product(a: float, b: float) -> tuple[float, float]:
    """Return a b and what it rounds away."""
    p = a * b
    t = _SPLIT * a
    ah = t - (t - a)
    al = a - ah
    t = _SPLIT * b
    bh = t - (t - b)
    bl = b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl


@compiled(inline=True)
def add(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return (ah + al) + (bh + bl)."""
    s, e = two_sum(ah, bh)
    t, f = two_sum(al, bl)
    s, e = two_sum(s, e + t)
    return two_sum(s, e + f)


@compiled(inline=True)
def multiply(ah: float, al: float, bh: float, bl: float) -> tuple[float, float]:
    """Return (ah + al) (bh + bl)."""
    p, e = two_product(ah, bh)
    return two_sum(p, e + (ah * bl + al * bh))


@compiled(inline=True)
def divide(ah: float, al: float, b: float) -> tuple[float, float]:
    """Return (ah + al) / b."""
    q1 = ah / b
    ph, pl = two_product(q1, b)
    rh, rl = add(ah, al, -ph, -pl)
    q2 = rh / b
    ph, pl = two_product(q2, b)
    rh, rl = add(rh, rl, -ph, -pl)
    sh, sl = two_sum(q1, q2)
    return two_sum(sh, sl + rh / b)
