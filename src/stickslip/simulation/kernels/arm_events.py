"""Exact propagation of the flexible arm under a held input, event by event.

The arm (van de Wijdeven 2002 A Eqs. 2.1-2.3 with a stick rule) is affine linear between events, in
each of three modes: the first mass slips in the negative direction (-1), rests (0), or slips in the
positive direction (+1). Coordinates are x1, v1, d = x1 - x2 and v2, so that a drift of the
positions costs no accuracy; each is kept as the sum of two doubles, so that rounding does not add
up over many samples.

- While slipping the force is s fc + c v1; at a zero of v1 the mass rests if |w| <= fs with
  w = U - ks d and U the effort less the offset, else it slips the way of w.
- *Fast path*: one product with the transition matrix, accepted when it is proved that no event
  lies inside the sample. |v1''| <= M2 by an energy bound, so that s v1 > M2 T^2/8 at both ends
  leaves no room for a zero between them; likewise for the force on a resting mass.
- *Slow path*: Taylor polynomial of v1 over what is left of the sample, first zero isolated by its
  Bernstein coefficients; the breakaway of a resting mass in closed form.

The result of a sample is the fast path's whenever no event lies in it, whichever path found that
out, so that one trajectory, a batch and single steps agree to the last bit.
"""

import math

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.simulation.kernels.double_double import accumulate
from stickslip.simulation.kernels.event_list import GRAZING, record_event
from stickslip.simulation.kernels.first_root import DEGREE, first_root

# Places in the model vector. The first hold, for mode -1, 0, +1, the 5 x 4 increments of
# (x1, v1, d, v2, x2) in terms of (v1, d, v2, F), their high parts and then their low parts.
BLOCK_SIZE = 20
LOW_PART = 3 * BLOCK_SIZE
FIRST = 2 * LOW_PART
TIME, M1, M2, KS = FIRST, FIRST + 1, FIRST + 2, FIRST + 3
FC_N, FC_P, FS_N, FS_P = FIRST + 4, FIRST + 5, FIRST + 6, FIRST + 7
C_N, C_P, OFFSET = FIRST + 8, FIRST + 9, FIRST + 10
OMEGA = FIRST + 11  # sqrt(ks/m2), of the second mass while the first rests
NORM = FIRST + 12  # bound of the system matrix while slipping [1/s]
GROWTH = FIRST + 13  # T / sqrt(m1): how fast sqrt(2 E) can grow with the effort
# M2 T^2/8 = BOUND_R R + BOUND_U (|U| + max fc), R = sqrt(2 E)
BOUND_R, BOUND_U = FIRST + 14, FIRST + 15
SAG = FIRST + 16  # sqrt(ks) (omega T)^2/8: how far the force on a resting mass can bulge, times R
FC_MAX, BUDGET = FIRST + 17, FIRST + 18
ROOT_M1, ROOT_KS = FIRST + 19, FIRST + 20
FINE = FIRST + 21  # 1 if the low parts of the increments matter, else 0
MODEL_SIZE = FIRST + 22

BUDGET_EXCEEDED = 2  # flag of a sample, beside GRAZING

GRAZING_TOLERANCE = 1e-10  # of the velocity's (or amplitude's) bound
SAFETY = 1.0 + 1e-9  # on bounds, against their own rounding
TWO_PI = 2.0 * math.pi
NO_STATE = (math.nan,) * 10
MAGNITUDE = np.int64(0x7FFFFFFFFFFFFFFF)  # all bits of a double but its sign
INVERSE = np.array([0.0] + [1.0 / k for k in range(1, DEGREE + 2)])

Vector = NDArray[np.float64]
State = tuple[float, ...]  # (x1, v1, d, v2, x2) and their five low parts


@compiled(inline=True)
def _row(e: State, v: float, d: float, w: float, F: float) -> float:
    return (e[0] * v + e[3] * F) + (e[1] * d + e[2] * w)


@compiled()
def largest_magnitude(values: Vector) -> float:
    """Return the largest magnitude, by the integers whose order is that of magnitudes."""
    bits = values.view(np.int64)
    largest = np.int64(0)
    for i in range(bits.size):
        largest = max(largest, bits[i] & MAGNITUDE)
    return np.array([largest]).view(np.float64)[0]


@compiled(inline=True)
def energy_root(model: Vector, v: float, d: float, w: float) -> float:
    """R = sqrt(2 E), with E the energy of both masses and the spring."""
    return math.sqrt(model[M1] * v * v + model[M2] * w * w + model[KS] * d * d)


@compiled(inline=True)
def slip_threshold(model: Vector, R: float, u_max: float) -> float:
    """Return what s v1 must exceed at both ends of a sample to be positive all along it."""
    bulge = model[BOUND_R] * R + model[BOUND_U] * (u_max + model[FC_MAX])
    return bulge * SAFETY + GRAZING_TOLERANCE * R / model[ROOT_M1] + 1e-300


@compiled(inline=True)
def stick_margin(model: Vector, R: float, u_max: float) -> float:
    """Return how far within the static friction the force at both ends of a sample must be."""
    room = min(model[FS_N], model[FS_P]) - u_max - model[ROOT_KS] * R * (1.0 + GRAZING_TOLERANCE)
    return 0.0 if room > 0.0 else SAFETY * model[SAG] * R + GRAZING_TOLERANCE * model[ROOT_KS] * R


@compiled(inline=True)
def increments(model: Vector, mode: int) -> tuple[State, State]:
    """Return the increments of one mode, high and low parts, as scalars.

    Loops keep scalars in registers; an array handed to an inlined function costs its reference
    count at every sample.
    """
    E = BLOCK_SIZE * (mode + 1)
    L = E + LOW_PART
    return (
        (
            model[E + 0], model[E + 1], model[E + 2], model[E + 3],
            model[E + 4], model[E + 5], model[E + 6], model[E + 7],
            model[E + 8], model[E + 9], model[E + 10], model[E + 11],
            model[E + 12], model[E + 13], model[E + 14], model[E + 15],
            model[E + 16], model[E + 17], model[E + 18], model[E + 19],
        ),
        (
            model[L + 0], model[L + 1], model[L + 2], model[L + 3],
            model[L + 4], model[L + 5], model[L + 6], model[L + 7],
            model[L + 8], model[L + 9], model[L + 10], model[L + 11],
            model[L + 12], model[L + 13], model[L + 14], model[L + 15],
            model[L + 16], model[L + 17], model[L + 18], model[L + 19],
        ),
    )  # fmt: skip


@compiled(inline=True)
def slip(c: State, low: State, fine: bool, F: float, y: State) -> State:
    """Propagate over a whole sample of slip."""
    x, v, d, w, z, xl, vl, dl, wl, zl = y
    dx = _row(c[0:4], v, d, w, F)
    dv = _row(c[4:8], v, d, w, F)
    dd = _row(c[8:12], v, d, w, F)
    dw = _row(c[12:16], v, d, w, F)
    dz = _row(c[16:20], v, d, w, F)
    if fine:
        dx += _row(low[0:4], v, d, w, F)
        dv += _row(low[4:8], v, d, w, F)
        dd += _row(low[8:12], v, d, w, F)
        dw += _row(low[12:16], v, d, w, F)
        dz += _row(low[16:20], v, d, w, F)
    x, xl = accumulate(x, xl, dx)
    v, vl = accumulate(v, vl, dv)
    d, dl = accumulate(d, dl, dd)
    w, wl = accumulate(w, wl, dw)
    z, zl = accumulate(z, zl, dz)
    return x, v, d, w, z, xl, vl, dl, wl, zl


@compiled(inline=True)
def rest(c: State, low: State, fine: bool, y: State) -> State:
    """Propagate over a whole sample of rest: only the second mass moves."""
    x, v, d, w, z, xl, vl, dl, wl, zl = y
    dd = c[9] * d + c[10] * w
    dw = c[13] * d + c[14] * w
    if fine:
        dd += low[9] * d + low[10] * w
        dw += low[13] * d + low[14] * w
    d, dl = accumulate(d, dl, dd)
    w, wl = accumulate(w, wl, dw)
    z, zl = accumulate(z, zl, -dd)
    return x, v, d, w, z, xl, vl, dl, wl, zl


@compiled(inline=True)
def _wrapped(angle: float) -> float:
    """Return the angle in [0, 2 pi)."""
    return angle - TWO_PI * math.floor(angle / TWO_PI)


@compiled()
def _crossing(d: float, w: float, d_star: float, A: float) -> tuple[float, float]:
    """Return how far the second mass must turn until d falls below d_star, and until d is -A.

    The second mass turns on a circle, d = A cos(psi), v2 = A omega sin(psi); w is v2/omega. The
    first is -1 if d does not fall so far.
    """
    psi = math.atan2(w, d)
    lowest = _wrapped(math.pi - psi)
    if abs(d_star) >= A:
        return -1.0, lowest
    turn = _wrapped(math.atan2(math.sqrt((A - d_star) * (A + d_star)), d_star) - psi)
    # The force is within its limit now, so that the crossing cannot just have passed: a turn of
    # (almost) a whole revolution is one of zero, and rounding.
    return (0.0 if turn > TWO_PI - 1e-7 else turn), lowest


@compiled()
def _breakaway(
    model: Vector, U: float, d: float, w: float, rem: float
) -> tuple[int, float, float, float, bool]:
    """Find when a resting first mass breaks away in what is left of the sample.

    The force U - ks d leaves [-fs, fs] by the earliest outward crossing.

    Returns
    -------
    mode, wait, d, v2, close
        The mode then (0: it stays), the time until then, d on its threshold and v2 then, and
        whether the force touches its limit too closely to tell.
    """
    ks, omega = model[KS], model[OMEGA]
    A = math.hypot(d, w / omega)
    near = GRAZING_TOLERANCE * A
    d_p, d_n = (U - model[FS_P]) / ks, (U + model[FS_N]) / ks
    if d_p < -A - near and d_n > A + near:
        return 0, 0.0, d, w, False
    turn, lowest = _crossing(d, w / omega, d_p, A)
    turn_n, highest = _crossing(-d, -w / omega, -d_n, A)
    close = (abs(d_p + A) < near and lowest <= omega * rem) or (
        abs(d_n - A) < near and highest <= omega * rem
    )
    mode, d_star = 1, d_p
    if turn < 0.0 or 0.0 <= turn_n < turn:
        turn, mode, d_star = turn_n, -1, d_n
    if turn < 0.0 or turn / omega >= rem:
        at_end = 0.0 <= turn / omega - rem < GRAZING_TOLERANCE * model[TIME]
        return 0, 0.0, d, w, close or at_end
    return mode, turn / omega, d_star, mode * omega * math.sqrt((A - d_star) * (A + d_star)), close


@compiled()
def _taylor(
    model: Vector, work: Vector, mode: int, g: float, deflate: int, h: float, y: State
) -> tuple[State, float, float, float, float]:
    """Slip for a time h, or up to the first zero of v1 within it.

    ``g`` is the force on the first mass at the start without viscous friction; ``deflate`` the
    multiplicity of the zero of v1 there (0: none). The Taylor coefficients in tau = t/h follow
    from the equations of motion by recurrence.

    Returns
    -------
    y, tau, dip, slope, bend
        The state after ``tau h``; tau is at most 1, and above it if there is no zero; how near v1
        came to a zero without one; and the derivatives of v1 by tau at the zero.
    """
    x, v, d, w, z, xl, vl, dl, wl, zl = y
    ks_1, ks_2 = model[KS] / model[M1], model[KS] / model[M2]
    c_1 = (model[C_P] if mode > 0 else model[C_N]) / model[M1]
    n, bound, reach = 2, model[NORM] * h, model[NORM] * h
    while n < DEGREE and bound > 1e-18:
        n += 1
        bound *= reach * INVERSE[n]
    av, ad, aw = 0.0 if deflate else v, d, w
    work[0, 0], work[1, 0], work[2, 0] = av, ad, aw
    following = h * (g / model[M1] - c_1 * av)
    for k in range(1, n + 1):
        r = h * INVERSE[k]
        av, ad, aw = following, r * (av - aw), r * (ks_2 * ad)
        work[0, k], work[1, k], work[2, k] = av, ad, aw
        following = -(h * INVERSE[k + 1]) * (c_1 * av + ks_1 * ad)
    root, dip = first_root(work, deflate, n - deflate, float(mode))
    tau = min(root, 1.0)
    dx, dv, dd, dw, dz, slope, bend = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(n, 0, -1):
        dx = dx * tau + work[0, k] * INVERSE[k + 1]
        dv = dv * tau + work[0, k]
        dd = dd * tau + work[1, k]
        dw = dw * tau + work[2, k]
        dz = dz * tau + work[2, k] * INVERSE[k + 1]
        bend = bend * tau + slope
        slope = slope * tau + k * work[0, k]
    x, xl = accumulate(x, xl, (dx * tau + work[0, 0]) * tau * h)
    z, zl = accumulate(z, zl, (dz * tau + work[2, 0]) * tau * h)
    d, dl = accumulate(d, dl, dd * tau)
    w, wl = accumulate(w, wl, dw * tau)
    if root <= 1.0:
        v, vl = 0.0, 0.0
    elif deflate:
        v, vl = dv, 0.0
    else:
        v, vl = accumulate(v, vl, dv * tau)
    return (x, v, d, w, z, xl, vl, dl, wl, zl), root, dip, slope, bend


@compiled()
def arm_events(
    model: Vector, work: Vector, event_time: Vector, event_mode: NDArray[np.int8], count: int,
    t0: float, mode: int, U: float, y: State,
) -> tuple[State, int, int, int]:  # fmt: skip
    """Propagate over one sample through every event in it.

    ``t0`` is the time at its start; events (time, mode after it) are appended at ``count`` as far
    as there is room. Returns the state, the mode, the new count and the flags. From an effort or a
    state that is not finite follows a state of NaN.
    """
    T, ks, omega = model[TIME], model[KS], model[OMEGA]
    fc_n, fc_p, fs_n, fs_p = model[FC_N], model[FC_P], model[FS_N], model[FS_P]
    sudden = fs_n > fc_n or fs_p > fc_p  # only then is the flow discontinuous at a graze
    close = GRAZING_TOLERANCE * (
        abs(y[1])
        + abs(y[3])
        + (model[ROOT_KS] * abs(y[2]) + model[GROWTH] * abs(U)) / model[ROOT_M1]
    )
    if not close < math.inf:
        return NO_STATE, mode, count, 0
    if y[1] == 0.0:
        mode = 0
    y0, mode0, count0 = y, mode, count
    rem = T
    flags = 0
    arrived = False  # at a zero of v1 whose outcome is still to be found
    deflate = 0  # multiplicity of the known zero of v1 at the start of what is left
    g = 0.0  # force on the first mass then, without viscous friction
    while True:
        if mode == 0 and rem > 0.0:  # at the end of a sample, the next one's effort decides
            x, v, d, w, z, xl, vl, dl, wl, zl = y
            force = U - ks * d
            near = GRAZING_TOLERANCE * ks * math.hypot(d, w / omega)
            if sudden and (abs(force - fs_p) < near or abs(force + fs_n) < near):
                flags |= GRAZING
            if force > fs_p:
                mode, g, deflate = 1, force - fc_p, 1
            elif force < -fs_n:
                mode, g, deflate = -1, force + fc_n, 1
            else:
                mode, wait, d_star, w_star, touching = _breakaway(model, U, d, w, rem)
                if touching and sudden:
                    flags |= GRAZING
                if mode != 0:
                    if arrived:
                        count = record_event(event_time, event_mode, count, t0 + (T - rem), 0)
                    rem -= wait
                    g = fs_p - fc_p if mode > 0 else fc_n - fs_n
                    deflate = 2 if g == 0.0 else 1
                    z, zl = accumulate(z, zl, -((d_star - d) - dl))
                    y = (x, v, d_star, w_star, z, xl, vl, 0.0, 0.0, zl)
        if arrived or deflate:
            count = record_event(event_time, event_mode, count, t0 + (T - rem), mode)
            if count - count0 > model[BUDGET]:
                return y, mode, count, BUDGET_EXCEEDED
            arrived = False
        if mode == 0:
            if rem > 0.0 and count > count0:
                x, v, d, w, z, xl, vl, dl, wl, zl = y
                half = math.sin(0.5 * omega * rem)
                cos_1 = -2.0 * half * half
                sin_1 = math.sin(omega * rem)
                dd = cos_1 * d - sin_1 * (w / omega)
                dw = omega * (sin_1 * d) + cos_1 * w
                d, dl = accumulate(d, dl, dd)
                w, wl = accumulate(w, wl, dw)
                z, zl = accumulate(z, zl, -dd)
                y = (x, v, d, w, z, xl, vl, dl, wl, zl)
            break
        h = min(rem, 1.0 / model[NORM])
        if deflate == 0:
            g = (U - fc_p if mode > 0 else U + fc_n) - ks * y[2]
        y, root, dip, slope, bend = _taylor(model, work, mode, g, deflate, h, y)
        rem -= min(root, 1.0) * h
        deflate = 0
        if root <= 1.0 or mode * y[1] <= 0.0:
            at_end = rem < GRAZING_TOLERANCE * T  # the next effort may or may not find it at rest
            if sudden and (at_end or slope * slope < 4.0 * close * bend * mode):
                flags |= GRAZING
            x, v, d, w, z, xl, vl, dl, wl, zl = y
            y = (x, 0.0, d, w, z, xl, 0.0, dl, wl, zl)
            mode = 0
            arrived = True
        else:
            if sudden and (dip < close or abs(y[1]) < close):
                flags |= GRAZING
            if not rem > 0.0:  # nor after an overflow
                break
    if count == count0:
        c, low = increments(model, mode0)
        mode = mode0
        if mode == 0:
            y = rest(c, low, model[FINE] != 0.0, y0)
        else:
            y = slip(c, low, model[FINE] != 0.0, U - fc_p if mode > 0 else U + fc_n, y0)
            if mode * y[1] <= 0.0:
                x, v, d, w, z, xl, vl, dl, wl, zl = y
                y = (x, 0.0, d, w, z, xl, 0.0, dl, wl, zl)
                mode = 0
    return y, mode, count, flags
