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

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float, Int
from scipy.special import factorial

from stickslip.compiled import compiled
from stickslip.numerics.kalman import predict, update

__all__ = [
    "DISTURBANCE_STATE",
    "EFFORT_STATE",
    "STATES",
    "AxisModel",
    "ParameterLayout",
    "innovate",
]

STATES = 5
"""Position, velocity, disturbance force, effort, rate of change of the effort."""

DISTURBANCE_STATE, EFFORT_STATE = 2, 3

_S, _D = 5, 2  # the same, known to the compiler so that it unrolls the loops over them
_SERIES_TERMS = 16  # of the exponential integrals; h < 1 leaves 1e-15


@dataclass(frozen=True, kw_only=True)
class ParameterLayout:
    """Places of the sought and known parameters.

    Attributes
    ----------
    sought
        Names of the parameters that are estimated, in the order of the columns; ``effort_delay`` is
        one of them if the delay is estimated.
    known
        Values of the others by name [SI].
    """

    sought: tuple[str, ...]
    known: dict[str, float]

    def value(self, base: str, direction: int, values: Float[np.ndarray, " p"]) -> float:
        """Return the value of a parameter in a direction of travel [SI]."""
        name = self.source(base, direction)
        if name is None:
            return 0.0
        return float(values[self.sought.index(name)]) if name in self.sought else self.known[name]

    def source(self, base: str, direction: int) -> str | None:
        """Return the name that holds a parameter in a direction of travel."""
        side = "_positive" if direction > 0 else "_negative"
        for name in (base, base + side):
            if name in self.sought or name in self.known:
                return name
        return None

    def column(self, base: str, direction: int) -> int | None:
        """Return the column of a parameter in a direction of travel, None if it is not sought."""
        name = self.source(base, direction)
        return self.sought.index(name) if name in self.sought else None


@dataclass(frozen=True, kw_only=True)
class AxisModel:
    """The model over a sample for each direction of travel: index 0 positive, 1 negative.

    Attributes
    ----------
    transition
        Shape (2, 5, 5).
    constant
        What friction and offset add to the states; row 0 of the second axis is the motion itself,
        the others are its derivatives by the parameters [SI], shape (2, 1 + p, 5).
    transition_change
        Derivatives of the transition by the parameters [SI], shape (2, p, 5, 5).
    force_response
        Response of the states to a force held over the sample, and its derivatives, in the order of
        ``constant``, shape (2, 1 + p, 5).
    rate_noise
        Covariance that a unit white change of the effort's rate adds to the states over a sample
        [SI], shape (2, 5, 5).
    fraction
        Time by which the logged effort acts later than its shift by whole samples [s].
    shift
        Whole samples that the effort acts late.
    """

    transition: Float[np.ndarray, "2 s s"]
    constant: Float[np.ndarray, "2 q s"]
    transition_change: Float[np.ndarray, "2 p s s"]
    force_response: Float[np.ndarray, "2 q s"]
    rate_noise: Float[np.ndarray, "2 s s"]
    fraction: float
    shift: int

    @classmethod
    def of(
        cls,
        layout: ParameterLayout,
        values: Float[np.ndarray, " p"],
        *,
        mass_name: str,
        sampling_time: float,
        correlation: float,
        ramped: bool = False,
    ) -> "AxisModel":
        """Return the model for values of the parameters.

        Parameters
        ----------
        layout
            Which parameters the values are.
        values
            [SI].
        mass_name
            ``"mass"`` or ``"inertia"``.
        sampling_time
            [s].
        correlation
            r, of the disturbance from sample to sample [-].
        ramped
            Whether the effort goes on at its rate within a sample; it is held otherwise.
        """
        T, p = sampling_time, len(layout.sought)
        delay = layout.value("effort_delay", 1, values)
        shift = round(delay / T)
        transition = np.zeros((2, STATES, STATES))
        constant = np.zeros((2, 1 + p, STATES))
        response = np.zeros((2, 1 + p, STATES))
        change = np.zeros((2, p, STATES, STATES))
        rate_noise = np.zeros((2, STATES, STATES))
        for side, s in enumerate((1, -1)):
            m = layout.value(mass_name, s, values)
            c = layout.value("viscous_friction", s, values)
            load = s * layout.value("coulomb_friction", s, values)
            load += layout.value("offset", s, values)
            h = c * T / m
            integrals, slopes = _exponential_integrals(h)
            p1, p2, p3 = integrals
            p1_h, p2_h, p3_h = slopes
            b = np.array([p2 * T * T / m, p1 * T / m, 0.0, 0.0, 0.0])
            ramp = np.array([p3 * T**3 / m, p2 * T * T / m, 0.0, 0.0, 0.0])
            response[side, 0], constant[side, 0] = b, -b * load
            A = np.diag([1.0, 1.0 - h * p1, correlation, 1.0, 1.0])
            A[0, 1], A[EFFORT_STATE, EFFORT_STATE + 1] = p1 * T, T
            A[:, DISTURBANCE_STATE] += b
            A[:, EFFORT_STATE] += b
            rate_noise[side, EFFORT_STATE + 1, EFFORT_STATE + 1] = T
            if ramped:
                A[:, EFFORT_STATE + 1] += ramp
                rate_noise[side] = _integrated_noise(m, T)
            transition[side] = A
            for base, h_by, inverse_by in (
                (mass_name, -h / m, -1.0 / m),
                ("viscous_friction", T / m, 0.0),
            ):
                j = layout.column(base, s)
                if j is None:
                    continue
                # Of the factor 1/m and of h in the integrals
                by = b * inverse_by
                by[:2] += np.array([p2_h * T, p1_h]) * h_by * T / m
                change[side, j, 0, 1] = p1_h * h_by * T
                change[side, j, 1, 1] = -(p1 + h * p1_h) * h_by
                change[side, j, :, DISTURBANCE_STATE] = by
                change[side, j, :, EFFORT_STATE] = by
                if ramped:
                    of_ramp = ramp * inverse_by
                    of_ramp[:2] += np.array([p3_h * T, p2_h]) * h_by * T * T / m
                    change[side, j, :, EFFORT_STATE + 1] = of_ramp
                response[side, 1 + j], constant[side, 1 + j] = by, -by * load
            for base, sign in (("coulomb_friction", s), ("offset", 1)):
                j = layout.column(base, s)
                if j is not None:
                    constant[side, 1 + j] = -sign * b
        return cls(
            transition=transition,
            constant=constant,
            transition_change=change,
            force_response=response,
            rate_noise=rate_noise,
            fraction=delay - shift * T,
            shift=shift,
        )


def _integrated_noise(mass: float, duration: float) -> Float[np.ndarray, "s s"]:
    """Return the covariance of the states after white noise of unit intensity in the effort's rate.

    A change of the rate at a time t before the end has moved the states by (t^3/6m, t^2/2m, 0, t,
    1) there, but for viscous friction; the integral of the products over the duration.
    """
    size = np.array([1.0 / (6.0 * mass), 1.0 / (2.0 * mass), 0.0, 1.0, 1.0])
    power = np.array([3.0, 2.0, 0.0, 1.0, 0.0])
    total = power[:, None] + power + 1.0
    return np.outer(size, size) * duration**total / total


def _exponential_integrals(
    h: float,
) -> tuple[Float[np.ndarray, " 3"], Float[np.ndarray, " 3"]]:
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


@compiled()
def innovate(
    A: Float[np.ndarray, "2 s s"],
    G: Float[np.ndarray, "2 q s"],
    B: Float[np.ndarray, "2 q s"],
    dA: Float[np.ndarray, "2 p s s"],
    Q: Float[np.ndarray, "2 s s"],
    H: Float[np.ndarray, "c s"],
    dH: Float[np.ndarray, "p c s"],
    R: Float[np.ndarray, " c"],
    first: Float[np.ndarray, " s"],
    A_n: Float[np.ndarray, "a s s"],
    Q_n: Float[np.ndarray, "a 2 s s"],
    R_n: Float[np.ndarray, "a c"],
    first_n: Float[np.ndarray, "a s"],
    known: Float[np.ndarray, " n"],
    measured: Float[np.ndarray, "n c"],
    direction: Int[np.ndarray, " n"],
    renewed: Bool[np.ndarray, " n"],
    loads: Float[np.ndarray, "n l"],
    rows: Float[np.ndarray, "n c q"],
    deep: int,
) -> tuple[
    Float[np.ndarray, "q q"],
    Float[np.ndarray, "a q q"],
    float,
    Float[np.ndarray, " a"],
    Float[np.ndarray, "a a"],
]:
    """Run the filter over a log, and its derivatives beside it (forward mode).

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

    All states but the disturbance start anew in each stretch of one direction.

    Parameters
    ----------
    A, G, B, dA
        Axis in each direction; see `AxisModel`.
    Q
        Process noise in each direction.
    H, dH, R
        Rows of the measurements (position, effort, and velocity if measured), their derivatives by
        the parameters, and variances of their noise.
    first
        Variances of the states at the start of a stretch; position and effort are measured there.
    A_n, Q_n, R_n, first_n
        Derivatives by the noise levels.
    known
        Force on the axis in each sample that is known: part j of the effort less the loads.
    measured
        Measurements of each sample, the effort less its known part and shifted by its delay in
        whole samples.
    direction
        Of travel: 1, -1, or 0 where the axis does not surely slip.
    renewed
        Where the effort jumps: its states start anew there.
    loads
        Columns of the loads, of which the coefficients are the last parameters.
    rows
        Takes the normalised innovations, zero where the axis does not surely slip; without room for
        them (n = 0) they are not kept.
    deep
        Number of columns whose derivatives by the noise levels are taken: 1 takes those of the
        innovations alone.

    Returns
    -------
    Gramian of the rows and its derivatives; sum of log S and its derivatives; information on the
    noise levels, sum of S_a S_b/(2 S^2) + e_a e_b/S.
    """
    n, channels = measured.shape
    q, levels = G.shape[1], Q_n.shape[0]
    kept = rows.shape[0] > 0
    Z, Z_n = np.zeros((q, _S)), np.zeros((levels, deep, _S))
    P, work = np.zeros((_S, _S)), np.zeros((_S, _S))
    P_n, K_n = np.zeros((levels, _S, _S)), np.zeros(_S)
    K, moved, e, e_n = np.zeros(_S), np.zeros((q, _S)), np.zeros(q), np.zeros((levels, deep))
    S_n = np.zeros(levels)
    gram, gram_n = np.zeros((q, q)), np.zeros((levels, q, q))
    information, logs_n, logs = np.zeros((levels, levels)), np.zeros(levels), 0.0
    P[_D, _D] = first[_D]
    for a in range(levels):
        P_n[a, _D, _D] = first_n[a, _D]
    side = -1  # of the stretch under way; -1 outside of one
    for k in range(n):
        now = -1 if direction[k] == 0 else (0 if direction[k] > 0 else 1)
        fresh = now >= 0 and now != side
        if now != side:
            for i in range(_S):
                if i == _D:
                    continue
                for j in range(q):
                    Z[j, i] = 0.0
                for j in range(deep):
                    for a in range(levels):
                        Z_n[a, j, i] = 0.0
                for j in range(_S):
                    P[i, j], P[j, i] = 0.0, 0.0
                    for a in range(levels):
                        P_n[a, i, j], P_n[a, j, i] = 0.0, 0.0
                if now >= 0:
                    P[i, i] = first[i]
                    for a in range(levels):
                        P_n[a, i, i] = first_n[a, i]
            if now >= 0:
                Z[0, 0], Z[0, _D + 1] = measured[k, 0], measured[k, 1]
            side = now
        if now < 0:
            # d <- r d, P_dd <- r^2 P_dd + Q_dd
            r = A[0, _D, _D]
            for a in range(levels):
                P_n[a, _D, _D] = (
                    r * r * P_n[a, _D, _D]
                    + 2.0 * r * A_n[a, _D, _D] * P[_D, _D]
                    + Q_n[a, 0, _D, _D]
                )
                for j in range(deep):
                    Z_n[a, j, _D] = r * Z_n[a, j, _D] + A_n[a, _D, _D] * Z[j, _D]
            P[_D, _D] = r * r * P[_D, _D] + Q[0, _D, _D]
            for j in range(q):
                Z[j, _D] *= r
            continue
        if renewed[k] and not fresh:
            for i in range(_D + 1, _S):
                for j in range(q):
                    Z[j, i] = 0.0
                for j in range(deep):
                    for a in range(levels):
                        Z_n[a, j, i] = 0.0
                for j in range(_S):
                    P[i, j], P[j, i] = 0.0, 0.0
                    for a in range(levels):
                        P_n[a, i, j], P_n[a, j, i] = 0.0, 0.0
                P[i, i] = first[i]
                for a in range(levels):
                    P_n[a, i, i] = first_n[a, i]
            Z[0, _D + 1] = measured[k, 1]
        for c in range(channels):
            if (fresh and c < 2) or (renewed[k] and c == 1):
                continue
            # Derivatives of the variance need the covariance before its update
            for a in range(levels):
                total = R_n[a, c]
                for i in range(_S):
                    for j in range(_S):
                        total += H[c, i] * P_n[a, i, j] * H[c, j]
                S_n[a] = total
            S = update(H[c], R[c], P, K, _S)
            logs += np.log(S)
            for j in range(q):
                total = measured[k, c] if j == 0 else 0.0
                for i in range(_S):
                    total -= H[c, i] * Z[j, i]
                    if j > 0:
                        total -= dH[j - 1, c, i] * Z[0, i]
                e[j] = total
            for a in range(levels):
                logs_n[a] += S_n[a] / S
                for j in range(deep):
                    total = 0.0
                    for i in range(_S):
                        total -= H[c, i] * Z_n[a, j, i]
                        if j > 0:
                            total -= dH[j - 1, c, i] * Z_n[a, 0, i]
                    e_n[a, j] = total
                for i in range(_S):
                    total = -K[i] * S_n[a]
                    for j in range(_S):
                        total += P_n[a, i, j] * H[c, j]
                    K_n[i] = total / S
                for i in range(_S):
                    for j in range(_S):
                        P_n[a, i, j] -= (K_n[i] * K[j] + K[i] * K_n[j]) * S + (K[i] * K[j] * S_n[a])
                for j in range(deep):
                    for i in range(_S):
                        Z_n[a, j, i] += K_n[i] * e[j] + K[i] * e_n[a, j]
            for j in range(q):
                for i in range(_S):
                    Z[j, i] += K[i] * e[j]
            root = np.sqrt(S)
            for j in range(q):
                if kept:
                    rows[k, c, j] = e[j] / root if j == 0 else -e[j] / root
                for i in range(j, q):
                    gram[j, i] += e[j] * e[i] / S
            for a in range(levels):
                for j in range(deep):
                    for i in range(j, deep):
                        gram_n[a, j, i] += (
                            e_n[a, j] * e[i] + e[j] * e_n[a, i] - e[j] * e[i] * S_n[a] / S
                        ) / S
                for b in range(a, levels):
                    information[a, b] += (0.5 * S_n[a] * S_n[b] / S + e_n[a, 0] * e_n[b, 0]) / S
        for a in range(levels):
            for j in range(deep):
                for i in range(_S):
                    total = A_n[a, i, i] * Z[j, i]
                    for g in range(_S):
                        total += A[side, i, g] * Z_n[a, j, g]
                        if j > 0:
                            total += dA[side, j - 1, i, g] * Z_n[a, 0, g]
                    moved[j, i] = total
            for j in range(deep):
                for i in range(_S):
                    Z_n[a, j, i] = moved[j, i]
        for j in range(q):
            for i in range(_S):
                total = G[side, j, i] + B[side, j, i] * known[k]
                for g in range(_S):
                    total += A[side, i, g] * Z[j, g]
                    if j > 0:
                        total += dA[side, j - 1, i, g] * Z[0, g]
                moved[j, i] = total
        for j in range(q):
            for i in range(_S):
                Z[j, i] = moved[j, i]
        for c in range(loads.shape[1]):
            for i in range(_S):
                Z[q - loads.shape[1] + c, i] -= B[side, 0, i] * loads[k, c]
        for a in range(levels):
            predict(A[side], Q_n[a, side], P_n[a], work, _S)
            if A_n[a, _D, _D] != 0.0:  # the only entry of a transition that a level changes
                for i in range(_S):
                    total = 0.0
                    for g in range(_S):
                        total += A[side, i, g] * P[g, _D]
                    total *= A_n[a, _D, _D]
                    P_n[a, i, _D] += total
                    P_n[a, _D, i] += total
        predict(A[side], Q[side], P, work, _S)
    for j in range(q):
        for i in range(j):
            gram[j, i] = gram[i, j]
            for a in range(levels):
                gram_n[a, j, i] = gram_n[a, i, j]
    for a in range(levels):
        for b in range(a):
            information[a, b] = information[b, a]
    # The derivatives e_j = -h' z_j enter with the sign of the least-squares columns
    for j in range(1, q):
        gram[0, j], gram[j, 0] = -gram[0, j], -gram[j, 0]
        for a in range(levels):
            gram_n[a, 0, j], gram_n[a, j, 0] = -gram_n[a, 0, j], -gram_n[a, j, 0]
    return gram, gram_n, logs, logs_n, information
