"""Filter of a slipping axis, its disturbance and its effort: model, innovations and derivatives.

While the axis slips in the direction s = +1 or -1,

    m v' = u + j - c v - s f_c - f_0 + d + w,    x' = v,

with the effort u + j, the disturbance force d and the white force w held over each sample. The
disturbance is a first-order autoregression, d(k+1) = r d(k) + w_d(k). Of the effort, j is the known
answer of the controller to the noise of the encoder, and u an integrated random walk,
u(k+1) = u(k) + T p(k), p(k+1) = p(k) + w_p(k). Over a sample of length T, with h = c T/m,
p1 = (1 - exp(-h))/h and p2 = (1 - p1)/h,

    v(k+1) = exp(-h) v(k) + b_v F(k),               b_v = p1 T/m,
    x(k+1) = x(k) + p1 T v(k) + b_x F(k),           b_x = p2 T^2/m,

where F = u + j - s f_c - f_0 + d + w. The logged effort acts later by a delay of whole samples, by
which it is shifted, and a fraction q of one: less j it is u + q T p and noise.

The mean of several samples of an effort is not held but goes on at the rate p, which adds
p2 T^2/m p(k) to the velocity and p3 T^3/m p(k) to the position, with p3 = (1/2 - p2)/h. The rate
changes within the sample, too.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import factorial

from stickslip.compiled import compiled
from stickslip.estimation.likelihood.axis_parameters import SIDES, SoughtParameters
from stickslip.numerics.kalman import predict, update

STATES = 5
"""Position, velocity, disturbance force, effort, rate of change of the effort."""
DISTURBANCE_STATE, EFFORT_STATE, RATE_STATE = 2, 3, 4

_S, _D = 5, 2  # STATES and DISTURBANCE_STATE, known to the compiler so that it unrolls the loops
_SERIES_TERMS = 16  # of the exponential integrals; h < 1 leaves 1e-15


class SlipModel(NamedTuple):
    """The axis over one sample, slipping in the positive (index 0) or negative direction (1).

    Row 0 of the second axis of G and B is the motion itself, row 1 + j its derivative by the
    parameter j that is sought [SI].
    """

    A: Float[np.ndarray, "2 s s"]  # transition of the states
    G: Float[np.ndarray, "2 q s"]  # what friction and offset add
    B: Float[np.ndarray, "2 q s"]  # response to a unit force that is held
    A_p: Float[np.ndarray, "2 p s s"]  # derivatives of A by the parameters
    rate_noise: Float[np.ndarray, "2 s s"]  # covariance by a unit white change of the effort's rate
    fraction: float  # time by which the logged effort acts later than its shift [s]
    shift: int  # of the logged effort by its delay [samples]


class FilterNoise(NamedTuple):
    """Noise of the filter: index 0 holds the values, 1 + a the derivatives by noise level a."""

    Q: Float[np.ndarray, "l 2 s s"]  # covariance of the process noise, in each direction
    R: Float[np.ndarray, "l c"]  # variances of the measurements
    first: Float[np.ndarray, "l s"]  # variances of the states at the start of a stretch
    r: Float[np.ndarray, " l"]  # correlation of the disturbance from sample to sample


class SlipRecord(NamedTuple):
    """Samples of one stretch of a log as the filter needs them."""

    known: Float[np.ndarray, " n"]  # known force: part j of the effort less the loads
    measured: Float[np.ndarray, "n c"]  # position, effort less j and shifted, velocity
    direction: Int[np.ndarray, " n"]  # 1, -1, or 0 where the axis does not surely slip
    jumps: Bool[np.ndarray, " n"]  # where the states of the effort start anew
    loads: Float[np.ndarray, "n l"]  # of which the coefficients are the last parameters


def slip_model(
    sought: SoughtParameters,
    values: Float[np.ndarray, " p"],
    *,
    mass_name: str,
    sampling_time: float,
    correlation: float,
    ramped: bool = False,
) -> SlipModel:
    """Return the model for values of the parameters [SI].

    The correlation r is that of the disturbance from sample to sample. A ramped effort goes on at
    its rate within a sample; it is held otherwise.
    """
    T, p = sampling_time, len(sought.names)
    delay = sought.value("effort_delay", values)
    shift = round(delay / T)
    A, dA = np.zeros((2, STATES, STATES)), np.zeros((2, p, STATES, STATES))
    G, B = np.zeros((2, 1 + p, STATES)), np.zeros((2, 1 + p, STATES))
    rate_noise = np.zeros((2, STATES, STATES))
    m = sought.value(mass_name, values)
    for side, (s, end) in enumerate(zip((1, -1), SIDES, strict=True)):
        c = sought.value(f"viscous_friction{end}", values)
        load = s * sought.value(f"coulomb_friction{end}", values)
        load += sought.value("offset", values)
        h = c * T / m
        (p1, p2, p3), (p1_h, p2_h, p3_h) = _exponential_integrals(h)
        b = np.array([p2 * T * T / m, p1 * T / m, 0.0, 0.0, 0.0])
        ramp = np.array([p3 * T**3 / m, p2 * T * T / m, 0.0, 0.0, 0.0])
        B[side, 0], G[side, 0] = b, -b * load
        A[side] = np.diag([1.0, 1.0 - h * p1, correlation, 1.0, 1.0])
        A[side, 0, 1], A[side, EFFORT_STATE, RATE_STATE] = p1 * T, T
        A[side, :, DISTURBANCE_STATE] += b
        A[side, :, EFFORT_STATE] += b
        rate_noise[side, RATE_STATE, RATE_STATE] = T
        if ramped:
            A[side, :, RATE_STATE] += ramp
            rate_noise[side] = _integrated_noise(m, T)
        for name, h_by, inverse_by in (
            (mass_name, -h / m, -1.0 / m),
            (f"viscous_friction{end}", T / m, 0.0),
        ):
            j = sought.column(name)
            if j is None:
                continue
            # Of the factor 1/m and of h in the integrals
            by = b * inverse_by
            by[:2] += np.array([p2_h * T, p1_h]) * h_by * T / m
            dA[side, j, 0, 1] = p1_h * h_by * T
            dA[side, j, 1, 1] = -(p1 + h * p1_h) * h_by
            dA[side, j, :, DISTURBANCE_STATE] = dA[side, j, :, EFFORT_STATE] = by
            if ramped:
                of_ramp = ramp * inverse_by
                of_ramp[:2] += np.array([p3_h * T, p2_h]) * h_by * T * T / m
                dA[side, j, :, RATE_STATE] = of_ramp
            B[side, 1 + j], G[side, 1 + j] = by, -by * load
        for name, sign in ((f"coulomb_friction{end}", s), ("offset", 1)):
            j = sought.column(name)
            if j is not None:
                G[side, 1 + j] = -sign * b
    return SlipModel(A, G, B, dA, rate_noise, delay - shift * T, shift)


def _integrated_noise(mass: float, duration: float) -> Float[np.ndarray, "s s"]:
    """Return the covariance of the states after white noise of unit intensity in the effort's rate.

    A change of the rate at a time t before the end has moved the states by (t^3/6m, t^2/2m, 0, t,
    1) there, but for viscous friction; the integral of the products over the duration.
    """
    size = np.array([1.0 / (6.0 * mass), 1.0 / (2.0 * mass), 0.0, 1.0, 1.0])
    power = np.array([3.0, 2.0, 0.0, 1.0, 0.0])
    total = power[:, None] + power + 1.0
    return np.outer(size, size) * duration**total / total


def _exponential_integrals(h: float) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
    """Return p1(h), p2(h), p3(h) of the module, and their derivatives by h."""
    if abs(h) > 1.0:
        p1 = -np.expm1(-h) / h
        p2 = (1.0 - p1) / h
        p3 = (0.5 - p2) / h
        p1_h = (np.exp(-h) - p1) / h
        p2_h = (-p1_h - p2) / h
        return np.array([p1, p2, p3]), np.array([p1_h, p2_h, (-p2_h - p3) / h])
    # p_j = sum (-h)^k/(k + j)!
    k = np.arange(_SERIES_TERMS)
    powers = np.concatenate(([0.0], (-h) ** k))
    inverse = 1.0 / factorial(np.arange(_SERIES_TERMS + 4))
    rows = [inverse[j : j + _SERIES_TERMS] for j in (1, 2, 3)]
    integrals = [float(row @ powers[1:]) for row in rows]
    slopes = [-float((k * row) @ powers[:-1]) for row in rows]
    return np.array(integrals), np.array(slopes)


class _Filter(NamedTuple):
    """Measurements, states and work space of the filter; the axes are those of `innovate`."""

    H: Float[np.ndarray, "c s"]
    H_p: Float[np.ndarray, "p c s"]
    deep: int
    Z: Float[np.ndarray, "l q s"]
    P: Float[np.ndarray, "l s s"]
    K: Float[np.ndarray, " s"]
    S: Float[np.ndarray, " l"]
    e: Float[np.ndarray, "l q"]
    PH: Float[np.ndarray, "l s"]
    K_a: Float[np.ndarray, " s"]
    moved: Float[np.ndarray, "q s"]
    work: Float[np.ndarray, "s s"]


class _Sums(NamedTuple):
    """What `innovate` returns."""

    gram: Float[np.ndarray, "l q q"]
    logs: Float[np.ndarray, " l"]
    information: Float[np.ndarray, "a a"]


@compiled()
def _start_anew(f: _Filter, first: Float[np.ndarray, "l s"], motion: bool) -> None:
    """Start the states of the effort anew, and those of the motion if it starts anew too."""
    for i in range(_S):
        if i > _D or (i < _D and motion):
            f.Z[:, :, i] = 0.0
            f.P[:, i] = 0.0
            f.P[:, :, i] = 0.0
            f.P[:, i, i] = first[:, i]


@compiled()
def _pass_without_slip(f: _Filter, noise: FilterNoise) -> None:
    """Propagate the disturbance alone: d <- r d, P_dd <- r^2 P_dd + Q_dd."""
    Q, r, P, Z = noise.Q, noise.r, f.P, f.Z
    for a in range(1, r.size):
        P[a, _D, _D] = (
            r[0] * r[0] * P[a, _D, _D] + 2.0 * r[0] * r[a] * P[0, _D, _D] + Q[a, 0, _D, _D]
        )
        for j in range(f.deep):
            Z[a, j, _D] = r[0] * Z[a, j, _D] + r[a] * Z[0, j, _D]
    P[0, _D, _D] = r[0] * r[0] * P[0, _D, _D] + Q[0, 0, _D, _D]
    for j in range(Z.shape[1]):
        Z[0, j, _D] *= r[0]


@compiled()
def _compare(f: _Filter, R: Float[np.ndarray, "l c"], c: int, measured: float) -> None:
    """Compute the errors e of a measurement, its variances S and the gain; update P_0."""
    H, H_p, Z, P = f.H, f.H_p, f.Z, f.P
    levels, q = f.e.shape
    # Derivatives of the variance need the covariance before its update
    for a in range(1, levels):
        f.S[a] = R[a, c]
        for i in range(_S):
            total = 0.0
            for j in range(_S):
                total += P[a, i, j] * H[c, j]
            f.PH[a, i] = total
            f.S[a] += H[c, i] * total
    f.S[0] = update(H[c], R[0, c], P[0], f.K, _S)
    for a in range(levels):
        for j in range(f.deep if a else q):
            total = measured if a == 0 and j == 0 else 0.0
            for i in range(_S):
                total -= H[c, i] * Z[a, j, i]
                if j > 0:
                    total -= H_p[j - 1, c, i] * Z[a, 0, i]
            f.e[a, j] = total


@compiled()
def _correct(f: _Filter) -> None:
    """Correct the states by the errors, and the covariances P_a."""
    Z, P, K, K_a, S, e = f.Z, f.P, f.K, f.K_a, f.S, f.e
    weight = 1.0 / S[0]
    for a in range(1, S.size):
        for i in range(_S):
            K_a[i] = (f.PH[a, i] - K[i] * S[a]) * weight
        for i in range(_S):
            for j in range(i, _S):
                P[a, i, j] -= (K_a[i] * K[j] + K[i] * K_a[j]) * S[0] + (K[i] * K[j] * S[a])
                P[a, j, i] = P[a, i, j]
        for j in range(f.deep):
            for i in range(_S):
                Z[a, j, i] += K_a[i] * e[0, j] + K[i] * e[a, j]
    for j in range(e.shape[1]):
        for i in range(_S):
            Z[0, j, i] += K[i] * e[0, j]


@compiled()
def _add(sums: _Sums, f: _Filter) -> None:
    """Add the errors of a measurement to the sums."""
    gram, logs, S, e = sums.gram, sums.logs, f.S, f.e
    levels, q = e.shape
    weight = 1.0 / S[0]
    logs[0] += np.log(S[0])
    for j in range(q):
        for i in range(j, q):
            gram[0, j, i] += e[0, j] * e[0, i] * weight
    for a in range(1, levels):
        logs[a] += S[a] * weight
        for j in range(f.deep):
            for i in range(j, f.deep):
                gram[a, j, i] += (
                    e[a, j] * e[0, i] + e[0, j] * e[a, i] - e[0, j] * e[0, i] * S[a] * weight
                ) * weight
        for b in range(a, levels):
            both = 0.5 * S[a] * S[b] * weight + e[a, 0] * e[b, 0]
            sums.information[a - 1, b - 1] += both * weight


@compiled()
def _move(
    f: _Filter,
    model: SlipModel,
    noise: FilterNoise,
    side: int,
    known: float,
    loads: Float[np.ndarray, " l"],
) -> None:
    """Propagate the states and covariances over a sample of slip."""
    A, G, B, dA = model.A, model.G, model.B, model.A_p
    Q, r, Z, P, moved = noise.Q, noise.r, f.Z, f.P, f.moved
    levels, q = f.e.shape
    for a in range(levels - 1, -1, -1):  # derivatives first: they need the values before
        count = f.deep if a else q
        for j in range(count):
            for i in range(_S):
                total = 0.0 if a else G[side, j, i] + B[side, j, i] * known
                for g in range(i, _S):  # the transition is upper triangular
                    total += A[side, i, g] * Z[a, j, g]
                    if j > 0:
                        total += dA[side, j - 1, i, g] * Z[a, 0, g]
                moved[j, i] = total
        for j in range(count):
            if a:
                moved[j, _D] += r[a] * Z[0, j, _D]
            for i in range(_S):
                Z[a, j, i] = moved[j, i]
    for c in range(loads.size):
        for i in range(_S):
            Z[0, q - loads.size + c, i] -= B[side, 0, i] * loads[c]
    for a in range(levels - 1, -1, -1):
        predict(A[side], Q[a, side], P[a], f.work, _S, 1.0, True)
        if a and r[a] != 0.0:  # the only entry of the transition that a level changes
            for i in range(_S):
                total = 0.0
                for g in range(i, _S):
                    total += A[side, i, g] * P[0, g, _D]
                total *= r[a]
                P[a, i, _D] += total
                P[a, _D, i] += total


@compiled()
def innovate(
    model: SlipModel,
    noise: FilterNoise,
    H: Float[np.ndarray, "c s"],
    dH: Float[np.ndarray, "p c s"],
    record: SlipRecord,
    rows: Float[np.ndarray, "n c q"],
    deep: int,
) -> tuple[Float[np.ndarray, "l q q"], Float[np.ndarray, " l"], Float[np.ndarray, "a a"]]:
    """Run the filter over a stretch, and its derivatives beside it (forward mode).

    Row 0 of the states Z is the motion predicted, row j > 0 its derivative by parameter j at a
    fixed gain:

        z_0 <- A z_0 + g_0 + b_0 j,        z_0 <- z_0 + K e_0,   e_0 = y - h' z_0,
        z_j <- A z_j + dA_j z_0 + g_j + b_j j,  z_j <- z_j + K e_j,   e_j = -h' z_j - dh_j' z_0.

    The normalised rows are e_0/sqrt(S) and -e_j/sqrt(S): the error of the parameters is their
    least-squares solution. The gain is held because its change multiplies white innovations, which
    are independent of it. By the noise levels everything is differentiated, the gain included:

        S_a = h' P_a h + R_a,  K_a = (P_a h - K S_a)/S,
        P_a <- P_a - (K_a K' + K K_a') S - K K' S_a,
        P_a <- A P_a A' + A_a P A' + A P A_a' + Q_a.

    The first axis of Z, P, e and the sums is that of `FilterNoise`: values, then derivatives, of
    the first ``deep`` rows only. All states but the disturbance start anew in each stretch of one
    direction. ``rows`` takes the normalised innovations unless it has no room for them (n = 0).

    Returns the upper triangle of sum e e'/S, sum log S, and the information on the noise levels,
    sum of S_a S_b/(2 S^2) + e_a e_b/S.
    """
    known, measured, direction = record.known, record.measured, record.direction
    n, channels = measured.shape
    q, levels = model.G.shape[1], noise.r.size
    f = _Filter(
        H,
        dH,
        deep,
        np.zeros((levels, q, _S)),
        np.zeros((levels, _S, _S)),
        np.zeros(_S),
        np.zeros(levels),
        np.zeros((levels, q)),
        np.zeros((levels, _S)),
        np.zeros(_S),
        np.zeros((q, _S)),
        np.zeros((_S, _S)),
    )
    sums = _Sums(np.zeros((levels, q, q)), np.zeros(levels), np.zeros((levels - 1, levels - 1)))
    f.P[:, _D, _D] = noise.first[:, _D]
    side = -1  # of the stretch under way; -1 outside of one
    for k in range(n):
        now = -1 if direction[k] == 0 else (0 if direction[k] > 0 else 1)
        fresh = now >= 0 and now != side
        jump = now >= 0 and record.jumps[k]
        if now != side or jump:
            _start_anew(f, noise.first, now != side)
            if fresh:
                f.Z[0, 0, 0] = measured[k, 0]
            if fresh or jump:
                f.Z[0, 0, _D + 1] = measured[k, 1]
            side = now
        if now < 0:
            _pass_without_slip(f, noise)
            continue
        for c in range(channels):
            if (fresh and c < 2) or (jump and c == 1):
                continue
            _compare(f, noise.R, c, measured[k, c])
            _correct(f)
            _add(sums, f)
            if rows.shape[0] > 0:
                root = np.sqrt(f.S[0])
                for j in range(q):
                    rows[k, c, j] = f.e[0, j] / root if j == 0 else -f.e[0, j] / root
        _move(f, model, noise, side, known[k], record.loads[k])
    return sums.gram, sums.logs, sums.information
