"""The step of pulse amplitude pulse width control (van de Wijdeven 2002 B, Eqs. 14-22)."""

from math import sqrt

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulse_kernel import (
    AT_ACHIEVED,
    AT_MOVED,
    ERROR,
    FRESH,
    IDLE,
    LAST,
    MOVING,
    OUTCOME,
    OWN,
    add_level,
    emit,
    fire,
    readable,
    stop,
    watch,
    whole_samples,
)
from stickslip.records import SensorSample

__all__ = [
    "APPLIED",
    "A_1",
    "A_2",
    "METHOD",
    "NOMINAL",
    "PRINTED",
    "S_11",
    "in_range",
    "papwc_step",
    "trimmed_effort",
]

METHOD = 2.0  # in the vector
APPLIED, NOMINAL, PRINTED = 0.0, 1.0, 2.0  # regressors

(
    _EFFORT,
    _T,
    _LONGEST,
    _GAIN,
    _LAMBDA,
    _LOW,  # range of the estimated Coulomb friction; infinite when it is not kept
    _HIGH,
    _REGRESSOR,
    _PATIENCE,
    A_1,
    A_2,
    S_11,  # P = S S', so that it stays definite however large P(0) is
    _S_12,
    _S_21,
    _S_22,
    _U_1,  # regressor of the pulse on its way
    _U_2,
) = range(OWN, OWN + 17)


@compiled()
def trimmed_effort(f_p: float, f_c: float, t_p: float, T_x: float) -> float:
    """Return the effort that does in T_x what f_p does in t_p (Eq. 15), at most f_p."""
    root = f_c * f_c + 4.0 * f_p * (f_p - f_c) * (t_p / T_x) ** 2
    return min(0.5 * (f_c + sqrt(root)), f_p)


@compiled()
def in_range(
    a: tuple[float, float], S: tuple[float, float, float, float], low: float, high: float
) -> tuple[float, float]:
    """Return the estimate [A_1, A_2], with A_2/A_1 taken into [low, high] if it is outside.

    Of the points on the edges w = [1, h], h = low or high, it is the one nearest to a in the metric
    G = P^-1, P = S S' with S by rows: w (w' G a) / (w' G w). NaN if both would need a negative A_1.
    """
    A_1, A_2 = a
    if A_1 > 0.0 and low * A_1 <= A_2 <= high * A_1:
        return a
    S_11, S_12, S_21, S_22 = S
    # S^-1 a and S^-1 w but for the determinant, which cancels
    r_1, r_2 = S_22 * A_1 - S_12 * A_2, S_11 * A_2 - S_21 * A_1
    nearest, edge, scale = 0.0, np.nan, np.nan
    for h in (low, high):
        q_1, q_2 = S_22 - S_12 * h, S_11 * h - S_21
        along, square = q_1 * r_1 + q_2 * r_2, q_1 * q_1 + q_2 * q_2
        if along > 0.0 and along * along > nearest * square:
            nearest, edge, scale = along * along / square, h, along / square
    return scale, edge * scale


@compiled()
def _learn(s: Float[np.ndarray, " s"]) -> None:
    """Take in what the last pulse did (Eqs. 17-21), unless no possible estimate agrees with it.

    With P = S S' and phi = S' u, pi = S phi (Eq. 17), and Eqs. 18 and 19 are (Potter)
    S <- [S - pi phi' / (beta + sqrt(lambda beta))] / sqrt(lambda), beta = lambda + phi' phi.
    """
    u_1, u_2, lam = s[_U_1], s[_U_2], s[_LAMBDA]
    s_11, s_12, s_21, s_22 = s[S_11], s[_S_12], s[_S_21], s[_S_22]
    phi_1, phi_2 = s_11 * u_1 + s_21 * u_2, s_12 * u_1 + s_22 * u_2
    pi_1, pi_2 = s_11 * phi_1 + s_12 * phi_2, s_21 * phi_1 + s_22 * phi_2
    beta = lam + phi_1 * phi_1 + phi_2 * phi_2
    xi = s[LAST + AT_ACHIEVED] - s[A_1] * u_1 - s[A_2] * u_2
    a = (s[A_1] + pi_1 / beta * xi, s[A_2] + pi_2 / beta * xi)
    gamma, root = 1.0 / (beta + sqrt(lam * beta)), sqrt(lam)
    S = (
        (s_11 - gamma * pi_1 * phi_1) / root,
        (s_12 - gamma * pi_1 * phi_2) / root,
        (s_21 - gamma * pi_2 * phi_1) / root,
        (s_22 - gamma * pi_2 * phi_2) / root,
    )
    if s[_HIGH] < np.inf:
        a = in_range(a, S, s[_LOW], s[_HIGH])
    if np.isfinite(a[0] + a[1] + S[0] + S[1] + S[2] + S[3]):
        s[A_1], s[A_2] = a
        s[S_11], s[_S_12], s[_S_21], s[_S_22] = S


@compiled()
def _plan(s: Float[np.ndarray, " s"]) -> None:
    """Fire a pulse of whole samples, its effort trimmed to the width they are longer (Eq. 14)."""
    e, f_p, T = s[ERROR], s[_EFFORT], s[_T]
    b = s[A_1] * f_p * f_p - s[A_2] * f_p  # Eq. 16
    f_c = s[A_2] / s[A_1]
    if not (b > 0.0 and f_c < f_p) or s[IDLE] >= s[_PATIENCE]:
        stop(s)
        return
    sign = 1.0 if e > 0.0 else -1.0
    t_p = min(sqrt(s[_GAIN] * abs(e) / b), s[_LONGEST])
    n = whole_samples(t_p, T)
    T_x = n * T
    f = sign * trimmed_effort(f_p, f_c, t_p, T_x)
    f_n = sign * f_p
    if s[_REGRESSOR] == APPLIED:
        s[_U_1], s[_U_2] = T_x * T_x * f * abs(f), -T_x * T_x * f
    elif s[_REGRESSOR] == NOMINAL:
        s[_U_1], s[_U_2] = t_p * t_p * f_n * abs(f_n), -t_p * t_p * f_n
    else:
        s[_U_1], s[_U_2] = t_p * t_p * f_n * f_n, t_p * t_p * f_n  # Eq. 22
    fire(s, sign * b * t_p * t_p)
    add_level(s, f, n)


@compiled()
def papwc_step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample."""
    s = state.copy()
    if not readable(s, METHOD, sample):
        return s, np.nan
    if watch(s, sample):
        if s[FRESH] > 0.0 and s[LAST + AT_MOVED] > 0.0:
            _learn(s)
        if s[OUTCOME] == MOVING:
            _plan(s)
    return s, emit(s)
