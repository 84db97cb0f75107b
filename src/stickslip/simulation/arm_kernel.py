"""Exact propagation of the flexible arm under a held input, event by event.

The arm (report part A Eqs. 2.1-2.3 with a stick rule) is affine linear between events, in each of
three modes: the first mass slips in the negative direction (-1), rests (0), or slips in the
positive direction (+1). Coordinates are x1, v1, d = x1 - x2 and v2, so that a drift of the
positions costs no accuracy; each is kept as the sum of two doubles, so that rounding does not
add up over many samples.

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

from stickslip.compiled import compiled

__all__ = ["BUDGET_EXCEEDED", "GRAZING", "MODEL_SIZE", "arm_run", "arm_step"]

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
FINE = FIRST + 21  # 1 if the low parts of the increments matter while slipping, else 0
MODEL_SIZE = FIRST + 22

GRAZING, BUDGET_EXCEEDED = 1, 2

DEGREE = 18  # of the Taylor polynomial; the remainder is below 1/19! = 8e-18 of the scale
DEPTH = 50  # bisections of a sub-step: its 2^-50 is as far as times in it can be told apart
WORK_SIZE = (3 + DEPTH + 2, DEGREE + 1)
GRAZING_TOLERANCE = 1e-10  # of the velocity's (or amplitude's) bound
SAFETY = 1.0 + 1e-9  # on bounds, against their own rounding
BLOCK = 32  # samples between renewals of the energy bound
LANES = 16  # trajectories propagated in lockstep
TWO_PI = 2.0 * math.pi

BERNSTEIN = np.array(
    [[math.comb(j, i) / math.comb(DEGREE, i) for i in range(DEGREE + 1)] for j in range(DEGREE + 1)]
)


@compiled(inline=True)
def _row(e0, e1, e2, e3, v, d, w, F):
    return (e0 * v + e3 * F) + (e1 * d + e2 * w)


@compiled(inline=True)
def _accumulate(high, low, increment):
    """Add to a double-double value; a zero increment leaves it bitwise the same.

    Dekker's fast two-sum: where the increment is the larger one, what it misses is within the
    increment's own rounding.
    """
    t = increment + low
    s = high + t
    return s, t - (s - high)


@compiled(inline=True)
def _energy_root(model, v, d, w):
    """R = sqrt(2 E), with E the energy of both masses and the spring."""
    return math.sqrt(model[M1] * v * v + model[M2] * w * w + model[KS] * d * d)


@compiled(inline=True)
def _slip_threshold(model, R, u_max):
    """Return what s v1 must exceed at both ends of a sample to be positive all along it."""
    bulge = model[BOUND_R] * R + model[BOUND_U] * (u_max + model[FC_MAX])
    return bulge * SAFETY + GRAZING_TOLERANCE * R / model[ROOT_M1] + 1e-300


@compiled(inline=True)
def _stick_margin(model, R, u_max):
    """Return how far within the static friction the force at both ends of a sample must be."""
    room = min(model[FS_N], model[FS_P]) - u_max - model[ROOT_KS] * R * (1.0 + GRAZING_TOLERANCE)
    return 0.0 if room > 0.0 else SAFETY * model[SAG] * R + GRAZING_TOLERANCE * model[ROOT_KS] * R


@compiled(inline=True)
def _increments(model, mode):
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
def _slip(c, low, fine, F, x, v, d, w, z, xl, vl, dl, wl, zl):
    """Propagate over a whole sample of slip."""
    dx = _row(c[0], c[1], c[2], c[3], v, d, w, F)
    dv = _row(c[4], c[5], c[6], c[7], v, d, w, F)
    dd = _row(c[8], c[9], c[10], c[11], v, d, w, F)
    dw = _row(c[12], c[13], c[14], c[15], v, d, w, F)
    dz = _row(c[16], c[17], c[18], c[19], v, d, w, F)
    if fine:
        dx += _row(low[0], low[1], low[2], low[3], v, d, w, F)
        dv += _row(low[4], low[5], low[6], low[7], v, d, w, F)
        dd += _row(low[8], low[9], low[10], low[11], v, d, w, F)
        dw += _row(low[12], low[13], low[14], low[15], v, d, w, F)
        dz += _row(low[16], low[17], low[18], low[19], v, d, w, F)
    x, xl = _accumulate(x, xl, dx)
    v, vl = _accumulate(v, vl, dv)
    d, dl = _accumulate(d, dl, dd)
    w, wl = _accumulate(w, wl, dw)
    z, zl = _accumulate(z, zl, dz)
    return x, v, d, w, z, xl, vl, dl, wl, zl


@compiled(inline=True)
def _rest(c, low, d, w, z, dl, wl, zl):
    """Propagate over a whole sample of rest: only the second mass moves."""
    dd = (c[9] * d + c[10] * w) + (low[9] * d + low[10] * w)
    dw = (c[13] * d + c[14] * w) + (low[13] * d + low[14] * w)
    d, dl = _accumulate(d, dl, dd)
    w, wl = _accumulate(w, wl, dw)
    z, zl = _accumulate(z, zl, -dd)
    return d, w, z, dl, wl, zl


@compiled()
def _polish(q, n, a, b, sign):
    """Return the zero of the polynomial q in (a, b], where it has the given sign at a."""
    t = 0.5 * (a + b)
    for _ in range(100):
        p, dp = q[n], 0.0
        for j in range(n - 1, -1, -1):
            dp = dp * t + p
            p = p * t + q[j]
        if p == 0.0:
            return t
        if sign * p > 0.0:
            a = t
        else:
            b = t
        step = p / dp
        new = t - step
        if not a < new < b:
            new = 0.5 * (a + b)
            if new in (a, b):
                return b
        elif abs(step) < 1e-17:
            return new
        if new == t:
            return t
        t = new
    return t


@compiled()
def _first_root(q, n, sign, work):
    """Find the first zero in (0, 1] of a polynomial q of degree n with ``sign q(0) > 0``.

    Returns
    -------
    root, dip
        The zero, or 2 if there is none; and without a zero, how near q came to one.
    """
    rest = 0.0
    slope = 0.0
    end = q[0]
    for j in range(1, n + 1):
        rest += abs(q[j])
        slope += j * abs(q[j])
        end += q[j]
    if abs(q[0]) > rest * SAFETY:
        return 2.0, 1e300
    if n == 0:
        return 2.0, 1e300
    if 2.0 * abs(q[1]) > slope * SAFETY:  # |q1| > sum of the rest: monotone
        if sign * end > 0.0:
            return 2.0, 1e300
        return _polish(q, n, 0.0, 1.0, sign), 1e300
    # Bernstein coefficients: as many zeros as sign variations, less an even number
    top = 3
    for j in range(DEGREE + 1):
        s = 0.0
        for i in range(min(j, n) + 1):
            s += BERNSTEIN[j, i] * q[i]
        work[top, j] = s
    # A stack of intervals, the leftmost on top. Dyadic ends are exact in floating point.
    left = 0.0
    width = 1.0
    depth = 0
    dip = 1e300
    while True:
        first = work[top, 0]
        last = work[top, DEGREE]
        dip = min(dip, abs(last))
        variations = 0
        previous = first
        for j in range(1, DEGREE + 1):
            b = work[top, j]
            if b != 0.0:
                if b * previous < 0.0:
                    variations += 1
                previous = b
        if sign * last <= 0.0 and (variations <= 1 or depth == DEPTH):
            return _polish(q, n, left, left + width, sign), dip
        if variations == 0 or depth == DEPTH:
            # nothing here: go on to the next interval on the right
            left += width
            if left >= 1.0:
                return 2.0, dip
            top -= 1
            while left % (2.0 * width) == 0.0 and width < 1.0:
                width *= 2.0
                depth -= 1
            continue
        # halve: the right half stays at `top`, the left one goes above it (de Casteljau)
        above = top + 1
        for j in range(DEGREE + 1):
            work[above, j] = work[top, 0]
            for i in range(DEGREE - j):
                work[top, i] = 0.5 * (work[top, i] + work[top, i + 1])
        top = above
        width *= 0.5
        depth += 1


@compiled(inline=True)
def _breakaway_angle(psi0, d_star, A, side):
    """Return how far the second mass must turn until d crosses d_star outwards, or -1."""
    if abs(d_star) >= A:
        return -1.0
    psi = side * math.atan2(math.sqrt((A - d_star) * (A + d_star)), d_star)
    turn = psi - psi0
    turn -= TWO_PI * math.floor(turn / TWO_PI)
    # The force is within its limit now, so that the crossing cannot just have passed: a turn of
    # (almost) a whole revolution is one of zero, and rounding.
    return 0.0 if turn > TWO_PI - 1e-7 else turn


@compiled()
def _events(
    model, work, event_time, event_mode, count, t0, mode, U, x, v, d, w, z, xl, vl, dl, wl, zl
):
    """Propagate over one sample through every event in it.

    ``t0`` is the time at its start; events (time, mode after it) are appended at ``count`` as far
    as there is room. Returns the state, the mode, the new count and the flags.
    """
    T = model[TIME]
    m1, m2, ks, omega = model[M1], model[M2], model[KS], model[OMEGA]
    fc_n, fc_p, fs_n, fs_p = model[FC_N], model[FC_P], model[FS_N], model[FS_P]
    sudden = fs_n > fc_n or fs_p > fc_p  # only then is the flow discontinuous at a graze
    v_scale = (_energy_root(model, v, d, w) + model[GROWTH] * abs(U)) / model[ROOT_M1]
    x0, v0, d0, w0, z0, xl0, vl0, dl0, wl0, zl0 = x, v, d, w, z, xl, vl, dl, wl, zl
    if v == 0.0:
        mode = 0
    mode0 = mode
    rem = T
    flags = 0
    events = 0
    arrived = False  # at a zero of v1 whose outcome is still to be found
    deflate = 0  # multiplicity of the known zero of v1 at the start
    g = 0.0  # force on the first mass without viscous friction
    while True:
        if mode == 0:
            force = U - ks * d
            if rem <= 0.0:
                pass  # the next sample's effort decides
            elif force > fs_p:
                mode, g, deflate = 1, force - fc_p, 1
            elif force < -fs_n:
                mode, g, deflate = -1, force + fc_n, 1
            else:
                # d = A cos(psi), v2 = A omega sin(psi), psi' = omega
                A = math.hypot(d, w / omega)
                d_p, d_n = (U - fs_p) / ks, (U + fs_n) / ks
                if sudden and A > 0.0:
                    near = GRAZING_TOLERANCE * A
                    if abs(-d_p - A) < near or abs(d_n - A) < near:
                        flags |= GRAZING
                if d_p >= -A or d_n <= A:
                    psi0 = math.atan2(w / omega, d)
                    turn = _breakaway_angle(psi0, d_p, A, 1.0)
                    side = 1
                    turn_n = _breakaway_angle(psi0, d_n, A, -1.0)
                    if turn < 0.0 or 0.0 <= turn_n < turn:
                        turn, side = turn_n, -1
                    if turn >= 0.0 and turn / omega < rem:
                        deflate = 1
                        mode = side
                        d_star = d_p if side > 0 else d_n
                        g = fs_p - fc_p if side > 0 else fc_n - fs_n
                        if g == 0.0:
                            deflate = 2
                        z, zl = _accumulate(z, zl, -((d_star - d) - dl))
                        w = side * omega * math.sqrt((A - d_star) * (A + d_star))
                        d, dl, wl = d_star, 0.0, 0.0
                        rem -= turn / omega
                        if arrived:  # it came to rest first
                            arrived = False
                            if count < event_time.size:
                                event_time[count] = t0 + (T - rem - turn / omega)
                                event_mode[count] = 0
                            count += 1
                            events += 1
            if arrived or mode != 0:
                if count < event_time.size:
                    event_time[count] = t0 + (T - rem)
                    event_mode[count] = mode
                count += 1
                events += 1
                arrived = False
                if events > model[BUDGET]:
                    flags |= BUDGET_EXCEEDED
                    break
            if rem <= 0.0:
                break
            if mode == 0:
                if events == 0:
                    break
                angle = omega * rem
                half = math.sin(0.5 * angle)
                cos1 = -2.0 * half * half
                sin1 = math.sin(angle)
                dd = cos1 * d - sin1 * (w / omega)
                dw = omega * (sin1 * d) + cos1 * w
                d, dl = _accumulate(d, dl, dd)
                w, wl = _accumulate(w, wl, dw)
                z, zl = _accumulate(z, zl, -dd)
                break
        # slip: Taylor polynomials in tau = t/h
        viscous = model[C_P] if mode > 0 else model[C_N]
        h = min(rem, 1.0 / model[NORM])
        reach = h * model[NORM]
        n = 0
        bound = 1.0
        while n < DEGREE and bound > 1e-18:
            n += 1
            bound *= reach / (n + 1)
        n = max(n, 2)
        if deflate == 0:
            g = (U - fc_p if mode > 0 else U + fc_n) - ks * d
        av, ad, aw = 0.0 if deflate else v, d, w
        q = work[0]
        pd, pw = work[1], work[2]
        q[0], pd[0], pw[0] = av, ad, aw
        a = h * ((g - viscous * av) / m1)
        for k in range(1, n + 1):
            r = h / (k + 1)
            ad_new = h / k * (av - aw)
            aw = h / k * (ks * ad / m2)
            av, ad = a, ad_new
            q[k], pd[k], pw[k] = av, ad, aw
            a = -r * ((viscous * av + ks * ad) / m1)
        root, dip = _first_root(q[deflate:], n - deflate, float(mode), work)
        tau = min(root, 1.0)
        # increments over the (part of the) sub-step
        dx, dv, dd, dw = 0.0, 0.0, 0.0, 0.0
        dz, slope, bend = 0.0, 0.0, 0.0
        for k in range(n, 0, -1):
            dx = dx * tau + q[k] / (k + 1)
            dv = dv * tau + q[k]
            dd = dd * tau + pd[k]
            dw = dw * tau + pw[k]
            dz = dz * tau + pw[k] / (k + 1)
            slope = slope * tau + k * q[k]
            bend = bend * tau + k * (k - 1) * q[k]
        dx = (dx * tau + q[0]) * tau * h
        dz = (dz * tau + pw[0]) * tau * h
        x, xl = _accumulate(x, xl, dx)
        z, zl = _accumulate(z, zl, dz)
        d, dl = _accumulate(d, dl, dd * tau)
        w, wl = _accumulate(w, wl, dw * tau)
        if root > 1.0:
            if deflate:
                v, vl = dv, 0.0
            else:
                v, vl = _accumulate(v, vl, dv * tau)
            if sudden and (
                dip < GRAZING_TOLERANCE * v_scale or abs(v) < GRAZING_TOLERANCE * v_scale
            ):
                flags |= GRAZING
        elif sudden:
            bend = bend / tau if n > 1 else 0.0
            if (
                mode * bend > 0.0
                and slope * slope < 2.0 * GRAZING_TOLERANCE * v_scale * bend * mode
            ):
                flags |= GRAZING
        rem -= tau * h
        if root <= 1.0 or mode * v <= 0.0:
            v, vl = 0.0, 0.0
            mode = 0
            arrived = True
        elif rem <= 0.0:
            break
        deflate = 0
    if events == 0:
        x, v, d, w, z, xl, vl, dl, wl, zl = x0, v0, d0, w0, z0, xl0, vl0, dl0, wl0, zl0
        mode = mode0
        c, low = _increments(model, mode)
        if mode == 0:
            d, w, z, dl, wl, zl = _rest(c, low, d, w, z, dl, wl, zl)
        else:
            F = U - fc_p if mode > 0 else U + fc_n
            x, v, d, w, z, xl, vl, dl, wl, zl = _slip(
                c, low, model[FINE] != 0.0, F, x, v, d, w, z, xl, vl, dl, wl, zl
            )
            if mode * v <= 0.0:
                v, vl = 0.0, 0.0
                mode = 0
    return x, v, d, w, z, xl, vl, dl, wl, zl, mode, count, flags


@compiled()
def arm_step(model, state, effort):
    """Propagate one sample under a held effort; pure.

    Parameters
    ----------
    model
        Vector of `MODEL_SIZE` numbers.
    state
        (x1, v1, d, v2, x2, their five low parts, mode), eleven floats.
    effort
        Held over the sample.

    Returns
    -------
    state, output
        The state at the end and (x1, v1, x2, v2). The mode is NaN if the event budget was exceeded.
    """
    x, v, d, w, z, xl, vl, dl, wl, zl, mode_float = state
    U = effort - model[OFFSET]
    mode = int(mode_float)
    R = _energy_root(model, v, d, w) + model[GROWTH] * abs(U)
    nx, nv, nd, nw, nz, nxl, nvl, ndl, nwl, nzl = x, v, d, w, z, xl, vl, dl, wl, zl
    c, low = _increments(model, mode)
    if mode == 0:
        nd, nw, nz, ndl, nwl, nzl = _rest(c, low, d, w, z, dl, wl, zl)
        margin = _stick_margin(model, R, abs(U))
        w_max, w_min = model[FS_P] - margin, margin - model[FS_N]
        ok = w_min <= U - model[KS] * d <= w_max and w_min <= U - model[KS] * nd <= w_max
    else:
        F = U - model[FC_P] if mode > 0 else U + model[FC_N]
        nx, nv, nd, nw, nz, nxl, nvl, ndl, nwl, nzl = _slip(
            c, low, model[FINE] != 0.0, F, x, v, d, w, z, xl, vl, dl, wl, zl
        )
        threshold = _slip_threshold(model, R, abs(U))
        ok = mode * v > threshold and mode * nv > threshold
    if not ok:
        nx, nv, nd, nw, nz, nxl, nvl, ndl, nwl, nzl, mode, _, flags = _events(
            model,
            np.empty(WORK_SIZE),
            np.empty(0),
            np.empty(0, dtype=np.int8),
            0,
            0.0,
            mode,
            U,
            x,
            v,
            d,
            w,
            z,
            xl,
            vl,
            dl,
            wl,
            zl,
        )
        mode_float = np.nan if flags & BUDGET_EXCEEDED else float(mode)
    return (nx, nv, nd, nw, nz, nxl, nvl, ndl, nwl, nzl, mode_float), (nx, nv, nz, nw)


@compiled()
def arm_run(model, state, effort, x1, v1, x2, v2, grazing, event_time, event_mode):
    """Propagate one trajectory and store every sample.

    Parameters
    ----------
    model, state
        As in `arm_step`.
    effort
        Shape (n,).
    x1, v1, x2, v2
        Outputs, shape (n + 1,).
    grazing
        Output, shape (n,), zero on entry: samples with an event too close to call.
    event_time, event_mode
        Outputs: the events as far as there is room.

    Returns
    -------
    state, count, failed
        The last state, the number of events, and the sample that exceeded the event budget or -1.
    """
    x, v, d, w, z, xl, vl, dl, wl, zl, mode_float = state
    mode = int(mode_float)
    n = np.uint64(effort.size)  # unsigned: no index counts from the end
    T, offset, ks = model[TIME], model[OFFSET], model[KS]
    fine = model[FINE] != 0.0
    work = np.empty(WORK_SIZE)
    count = 0
    x1[0], v1[0], x2[0], v2[0] = x, v, z, w
    k = np.uint64(0)
    while k < n:
        stop = min(k + np.uint64(BLOCK), n)
        u_max = 0.0
        for j in range(k, stop):
            u_max = max(u_max, abs(effort[j] - offset))
        R = _energy_root(model, v, d, w) + (stop - k) * model[GROWTH] * u_max
        threshold = _slip_threshold(model, R, u_max)
        margin = _stick_margin(model, R, u_max)
        w_max, w_min = model[FS_P] - margin, margin - model[FS_N]
        while k < stop:
            # one stretch in one mode
            if mode == 0:
                c, low = _increments(model, 0)
                while k < stop:
                    U = effort[k] - offset
                    nd, nw, nz, ndl, nwl, nzl = _rest(c, low, d, w, z, dl, wl, zl)
                    if not (w_min <= U - ks * d <= w_max and w_min <= U - ks * nd <= w_max):
                        break
                    d, w, z, dl, wl, zl = nd, nw, nz, ndl, nwl, nzl
                    k += np.uint64(1)
                    x1[k], v1[k], x2[k], v2[k] = x, v, z, w
            else:
                s = float(mode)
                fc = model[FC_P] if mode > 0 else -model[FC_N]
                c, low = _increments(model, mode)
                clear = s * v > threshold
                while clear and k < stop:
                    F = (effort[k] - offset) - fc
                    nx, nv, nd, nw, nz, nxl, nvl, ndl, nwl, nzl = _slip(
                        c, low, fine, F, x, v, d, w, z, xl, vl, dl, wl, zl
                    )
                    if not s * nv > threshold:
                        break
                    x, v, d, w, z, xl, vl, dl, wl, zl = nx, nv, nd, nw, nz, nxl, nvl, ndl, nwl, nzl
                    k += np.uint64(1)
                    x1[k], v1[k], x2[k], v2[k] = x, v, z, w
            if k < stop:
                x, v, d, w, z, xl, vl, dl, wl, zl, mode, count, flags = _events(
                    model,
                    work,
                    event_time,
                    event_mode,
                    count,
                    k * T,
                    mode,
                    effort[k] - offset,
                    x,
                    v,
                    d,
                    w,
                    z,
                    xl,
                    vl,
                    dl,
                    wl,
                    zl,
                )
                if flags:
                    grazing[k] = flags & GRAZING
                    if flags & BUDGET_EXCEEDED:
                        return (x, v, d, w, z, xl, vl, dl, wl, zl, float(mode)), count, np.int64(k)
                k += np.uint64(1)
                x1[k], v1[k], x2[k], v2[k] = x, v, z, w
    return (x, v, d, w, z, xl, vl, dl, wl, zl, float(mode)), count, -1
