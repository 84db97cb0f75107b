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
from typing import Any

import numpy as np
from numba.np.unsafe.ndarray import to_fixed_tuple
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.numerics.named_fields import fields_at
from stickslip.simulation.kernels.double_double import accumulate
from stickslip.simulation.kernels.first_root import DEGREE, WORK_SIZE, first_root
from stickslip.simulation.kernels.single_mass import GRAZING, Sample, record_event

ARM_MODEL = np.dtype(
    [
        # Of the modes -1, 0, +1: the 5 x 4 increments of (x1, v1, d, v2, x2) over a sample in terms
        # of (v1, d, v2, F), their high parts and their low parts
        ("high", "f8", (3, 20)),
        ("low", "f8", (3, 20)),
        ("sampling_time", "f8"),
        *((name, "f8") for name in ("m1", "m2", "ks")),
        *((name, "f8") for name in ("fc_n", "fc_p", "fs_n", "fs_p", "c_n", "c_p", "offset")),
        ("omega", "f8"),  # sqrt(ks/m2), of the second mass while the first rests
        ("norm", "f8"),  # bound of the system matrix while slipping [1/s]
        ("growth", "f8"),  # T / sqrt(m1): how fast sqrt(2 E) can grow with the effort
        # |v1''| T^2/8 <= bound_r R + bound_u (|U| + max fc), R = sqrt(2 E)
        ("bound_r", "f8"),
        ("bound_u", "f8"),
        ("sag", "f8"),  # sqrt(ks) (omega T)^2/8: bulge of the force on a resting mass, over R
        ("fc_max", "f8"),
        ("budget", "f8"),  # events allowed in a sample
        ("root_m1", "f8"),
        ("root_ks", "f8"),
        ("fine", "f8"),  # 1 if the low parts of the increments matter, else 0
    ]
)
arm_fields = fields_at(ARM_MODEL)

BUDGET_EXCEEDED = 2  # flag of a sample, beside GRAZING

GRAZING_TOLERANCE = 1e-10  # of the velocity's (or amplitude's) bound
SAFETY = 1.0 + 1e-9  # on bounds, against their own rounding
TWO_PI = 2.0 * math.pi
NO_STATE = (math.nan,) * 10
MAGNITUDE = np.int64(0x7FFFFFFFFFFFFFFF)  # all bits of a double but its sign
INVERSE = np.array([0.0] + [1.0 / k for k in range(1, DEGREE + 2)])
BLOCK_MIN, BLOCK_MAX = 8, 128  # samples between renewals of the energy bound

scalars: Any = to_fixed_tuple  # an array as a tuple of its elements
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
def energy_root(m: Any, v: float, d: float, w: float) -> float:
    """R = sqrt(2 E), with E the energy of both masses and the spring."""
    return math.sqrt(m.m1 * v * v + m.m2 * w * w + m.ks * d * d)


@compiled(inline=True)
def slip_threshold(m: Any, R: float, u_max: float) -> float:
    """Return what s v1 must exceed at both ends of a sample to be positive all along it."""
    bulge = m.bound_r * R + m.bound_u * (u_max + m.fc_max)
    return bulge * SAFETY + GRAZING_TOLERANCE * R / m.root_m1 + 1e-300


@compiled(inline=True)
def stick_margin(m: Any, R: float, u_max: float) -> float:
    """Return how far within the static friction the force at both ends of a sample must be."""
    room = min(m.fs_n, m.fs_p) - u_max - m.root_ks * R * (1.0 + GRAZING_TOLERANCE)
    return 0.0 if room > 0.0 else SAFETY * m.sag * R + GRAZING_TOLERANCE * m.root_ks * R


@compiled(inline=True)
def increments(m: Any, mode: int) -> tuple[State, State]:
    """Return the increments of one mode, high and low parts, as scalars.

    Loops keep scalars in registers; an array handed to an inlined function costs its reference
    count at every sample.
    """
    return scalars(m.high[mode + 1], 20), scalars(m.low[mode + 1], 20)


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
    m: Any, U: float, d: float, w: float, rem: float
) -> tuple[int, float, float, float, bool]:
    """Find when a resting first mass breaks away in what is left of the sample.

    The force U - ks d leaves [-fs, fs] by the earliest outward crossing. Returns the mode then (0:
    it stays), the time until then, d on its threshold and v2 then, and whether the force touches
    its limit too closely to decide.
    """
    ks, omega = m.ks, m.omega
    A = math.hypot(d, w / omega)
    near = GRAZING_TOLERANCE * A
    d_p, d_n = (U - m.fs_p) / ks, (U + m.fs_n) / ks
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
        at_end = 0.0 <= turn / omega - rem < GRAZING_TOLERANCE * m.sampling_time
        return 0, 0.0, d, w, close or at_end
    return mode, turn / omega, d_star, mode * omega * math.sqrt((A - d_star) * (A + d_star)), close


@compiled()
def _taylor(
    m: Any, work: Vector, mode: int, g: float, deflate: int, h: float, y: State
) -> tuple[State, float, float, float, float]:
    """Slip for a time h, or up to the first zero of v1 within it.

    ``g`` is the force on the first mass at the start without viscous friction; ``deflate`` the
    multiplicity of the zero of v1 there (0: none). The Taylor coefficients in tau = t/h follow
    from the equations of motion by recurrence. Returns the state after ``tau h``; tau, above 1 if
    there is no zero; how near v1 came to a zero without one; and the first and the second
    derivative of v1 by tau at the zero.
    """
    x, v, d, w, z, xl, vl, dl, wl, zl = y
    ks_1, ks_2 = m.ks / m.m1, m.ks / m.m2
    c_1 = (m.c_p if mode > 0 else m.c_n) / m.m1
    n, bound, reach = 2, m.norm * h, m.norm * h
    while n < DEGREE and bound > 1e-18:
        n += 1
        bound *= reach * INVERSE[n]
    av, ad, aw = 0.0 if deflate else v, d, w
    work[0, 0], work[1, 0], work[2, 0] = av, ad, aw
    following = h * (g / m.m1 - c_1 * av)
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


@compiled(inline=True)
def _slip_force(m: Any, mode: int, U: float) -> float:
    """Return the effort less offset and Coulomb friction while slipping."""
    return U - m.fc_p if mode > 0 else U + m.fc_n


@compiled(inline=True)
def _halted(y: State) -> State:
    """Return the state with the first mass at rest."""
    x, _, d, w, z, xl, _, dl, wl, zl = y
    return x, 0.0, d, w, z, xl, 0.0, dl, wl, zl


@compiled(inline=True)
def _swung(omega: float, rem: float, y: State) -> State:
    """Swing the second mass on its spring over what is left of a sample, the first at rest."""
    x, v, d, w, z, xl, vl, dl, wl, zl = y
    half = math.sin(0.5 * omega * rem)
    cos_1 = -2.0 * half * half
    sin_1 = math.sin(omega * rem)
    dd = cos_1 * d - sin_1 * (w / omega)
    dw = omega * (sin_1 * d) + cos_1 * w
    d, dl = accumulate(d, dl, dd)
    w, wl = accumulate(w, wl, dw)
    z, zl = accumulate(z, zl, -dd)
    return x, v, d, w, z, xl, vl, dl, wl, zl


@compiled()
def _uneventful(m: Any, mode: int, U: float, y: State) -> tuple[State, int]:
    """Propagate over a whole sample without events; return the state and the mode at its end."""
    c, low = increments(m, mode)
    if mode == 0:
        return rest(c, low, m.fine != 0.0, y), 0
    y = slip(c, low, m.fine != 0.0, _slip_force(m, mode, U), y)
    return (_halted(y), 0) if mode * y[1] <= 0.0 else (y, mode)


@compiled()
def arm_events(
    m: Any, work: Vector, event_time: Vector, event_mode: NDArray[np.int8], count: int,
    sample: Sample, y: State,
) -> tuple[State, int, int, int]:  # fmt: skip
    """Propagate over one sample through every event in it.

    Events (time, mode after it) are appended at ``count`` as far as there is room. Returns the
    state, the mode, the new count and the flags. From an effort or a state that is not finite
    follows a state of NaN.
    """
    mode, U, t0 = sample
    T, ks, omega = m.sampling_time, m.ks, m.omega
    fc_n, fc_p, fs_n, fs_p = m.fc_n, m.fc_p, m.fs_n, m.fs_p
    sudden = fs_n > fc_n or fs_p > fc_p  # only then is the flow discontinuous at a graze
    close = GRAZING_TOLERANCE * (
        abs(y[1]) + abs(y[3]) + (m.root_ks * abs(y[2]) + m.growth * abs(U)) / m.root_m1
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
            x, v, d, w, z, xl, vl, dl, _, zl = y
            force = U - ks * d
            near = GRAZING_TOLERANCE * ks * math.hypot(d, w / omega)
            if sudden and (abs(force - fs_p) < near or abs(force + fs_n) < near):
                flags |= GRAZING
            if force > fs_p:
                mode, g, deflate = 1, force - fc_p, 1
            elif force < -fs_n:
                mode, g, deflate = -1, force + fc_n, 1
            else:
                mode, wait, d_star, w_star, touching = _breakaway(m, U, d, w, rem)
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
            if count - count0 > m.budget:
                return y, mode, count, BUDGET_EXCEEDED
            arrived = False
        if mode == 0:
            if rem > 0.0 and count > count0:
                y = _swung(omega, rem, y)
            break
        h = min(rem, 1.0 / m.norm)
        if deflate == 0:
            g = _slip_force(m, mode, U) - ks * y[2]
        y, root, dip, slope, bend = _taylor(m, work, mode, g, deflate, h, y)
        rem -= min(root, 1.0) * h
        deflate = 0
        if root <= 1.0 or mode * y[1] <= 0.0:
            at_end = rem < GRAZING_TOLERANCE * T  # the next effort may or may not find it at rest
            if sudden and (at_end or slope * slope < 4.0 * close * bend * mode):
                flags |= GRAZING
            y, mode, arrived = _halted(y), 0, True
        else:
            if sudden and (dip < close or abs(y[1]) < close):
                flags |= GRAZING
            if not rem > 0.0:  # nor after an overflow
                break
    if count == count0:
        y, mode = _uneventful(m, mode0, U, y0)
    return y, mode, count, flags


@compiled(inline=True)
def _block(R: float, growth: float) -> int:
    """Return for how many samples a bound is worth keeping: until it may have doubled."""
    return BLOCK_MAX if BLOCK_MAX * growth <= R else max(int(R / growth), BLOCK_MIN)


@compiled()
def arm_step(
    model: Vector, state: State, effort: float
) -> tuple[State, tuple[float, float, float, float]]:
    """Propagate one sample under a held effort; pure. The output is (x1, v1, x2, v2).

    The state is (x1, v1, d, v2, x2, their five low parts, mode). The mode is NaN if the event
    budget was exceeded or the effort or the motion is not finite; from such a state follows one of
    NaN.
    """
    m = arm_fields(model)
    y = state[:10]
    has_failed = math.isnan(state[10])
    mode = 0 if has_failed else int(state[10])
    U = math.nan if has_failed else effort - m.offset
    R = energy_root(m, y[1], y[2], y[3]) + m.growth * abs(U)
    c, low = increments(m, mode)
    if mode == 0:
        ny = rest(c, low, m.fine != 0.0, y)
        margin = stick_margin(m, R, abs(U))
        w_max, w_min = m.fs_p - margin, margin - m.fs_n
        ok = w_min <= U - m.ks * y[2] <= w_max and w_min <= U - m.ks * ny[2] <= w_max
    else:
        ny = slip(c, low, m.fine != 0.0, _slip_force(m, mode, U), y)
        threshold = slip_threshold(m, R, abs(U))
        ok = mode * y[1] > threshold and mode * ny[1] > threshold
    flags = 0
    if not ok:
        ny, mode, _, flags = arm_events(
            m, np.empty(WORK_SIZE), np.empty(0), np.empty(0, np.int8), 0, (mode, U, 0.0), y
        )
    failed = flags & BUDGET_EXCEEDED != 0 or not abs(ny[1]) < math.inf
    new_mode = math.nan if failed else float(mode)
    return (*ny, new_mode), (ny[0], ny[1], ny[4], ny[3])


@compiled()
def arm_run(
    model: Vector, state: State, effort: Vector, out: NDArray[np.float64],
    grazing: NDArray[np.bool_], event_time: Vector, event_mode: NDArray[np.int8],
) -> tuple[int, int]:  # fmt: skip
    """Propagate one trajectory and store every sample, as `PlantKernels.run`."""
    m = arm_fields(model)
    x1, v1, x2, v2 = out[0], out[1], out[2], out[3]
    y = state[:10]
    mode = int(state[10])
    n = np.uint64(effort.size)  # unsigned: no index counts from the end
    T, offset, ks = m.sampling_time, m.offset, m.ks
    u_max = largest_magnitude(effort) + abs(offset)
    growth = m.growth * u_max
    fine = m.fine != 0.0
    work = np.empty(WORK_SIZE)
    count = 0
    x1[0], v1[0], x2[0], v2[0] = y[0], y[1], y[4], y[3]
    k = np.uint64(0)
    while k < n:
        R0 = energy_root(m, y[1], y[2], y[3])
        block = _block(R0, growth)
        stop = min(k + np.uint64(block), n)
        R = R0 + block * growth
        threshold = slip_threshold(m, R, u_max)
        margin = stick_margin(m, R, u_max)
        w_max, w_min = m.fs_p - margin, margin - m.fs_n
        while k < stop:
            # one stretch in one mode
            c, low = increments(m, mode)
            if mode == 0:
                while k < stop:
                    U = effort[k] - offset
                    ny = rest(c, low, fine, y)
                    if not (w_min <= U - ks * y[2] <= w_max and w_min <= U - ks * ny[2] <= w_max):
                        break
                    y = ny
                    k += np.uint64(1)
                    x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
            else:
                s = float(mode)
                fc = m.fc_p if mode > 0 else -m.fc_n
                clear = s * y[1] > threshold
                while clear and k < stop:
                    ny = slip(c, low, fine, (effort[k] - offset) - fc, y)
                    if not s * ny[1] > threshold:
                        break
                    y = ny
                    k += np.uint64(1)
                    x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
            if k < stop:
                y, mode, count, flags = arm_events(
                    m, work, event_time, event_mode, count, (mode, effort[k] - offset, k * T), y
                )
                if flags:
                    grazing[k] = flags & GRAZING
                    if flags & BUDGET_EXCEEDED:
                        return count, int(np.int64(k))
                k += np.uint64(1)
                x1[k], v1[k], x2[k], v2[k] = y[0], y[1], y[4], y[3]
    return count, -1
