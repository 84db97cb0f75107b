"""The step of pulse amplitude pulse width control (van de Wijdeven 2002 B, Eqs. 14-22)."""

from math import sqrt
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.pulses.kernel import (
    MOVING,
    OWN,
    add_level,
    emit,
    fire,
    head,
    readable,
    stop,
    watch,
    whole_samples,
)
from stickslip.numerics.named_fields import fields_at
from stickslip.records import SensorSample

__all__ = [
    "APPLIED",
    "METHOD",
    "NOMINAL",
    "OWN_DTYPE",
    "PRINTED",
    "in_range",
    "own_fields",
    "papwc_step",
    "trimmed_effort",
]

METHOD = 2  # in the vector
APPLIED, NOMINAL, PRINTED = 0, 1, 2  # regressors

OWN_DTYPE = np.dtype(
    [
        ("effort", "f8"),
        ("period", "f8"),  # sampling time
        ("longest", "f8"),  # pulse [s]
        ("gain", "f8"),  # K_c
        ("forgetting", "f8"),  # lambda
        ("low", "f8"),  # range of the estimated Coulomb friction; infinite when it is not kept
        ("high", "f8"),
        ("regressor", "i8"),
        ("max_idle_pulses", "f8"),
        ("A_1", "f8"),
        ("A_2", "f8"),
        ("S", "f8", (2, 2)),  # P = S S', so that it stays definite however large P(0) is
        ("u_1", "f8"),  # regressor of the pulse on its way
        ("u_2", "f8"),
    ]
)
"""What pulse amplitude pulse width control adds to the state."""

own_fields = fields_at(OWN_DTYPE, start=OWN)


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
def _learn(s: Any, own: Any) -> None:
    """Take in what the last pulse did (Eqs. 17-21), unless no possible estimate agrees with it.

    With P = S S' and phi = S' u, pi = S phi (Eq. 17), and Eqs. 18 and 19 are (Potter)
    S <- [S - pi phi' / (beta + sqrt(lambda beta))] / sqrt(lambda), beta = lambda + phi' phi.
    """
    u_1, u_2, lam = own.u_1, own.u_2, own.forgetting
    s_11, s_12, s_21, s_22 = own.S[0, 0], own.S[0, 1], own.S[1, 0], own.S[1, 1]
    phi_1, phi_2 = s_11 * u_1 + s_21 * u_2, s_12 * u_1 + s_22 * u_2
    pi_1, pi_2 = s_11 * phi_1 + s_12 * phi_2, s_21 * phi_1 + s_22 * phi_2
    beta = lam + phi_1 * phi_1 + phi_2 * phi_2
    xi = s.last.achieved - own.A_1 * u_1 - own.A_2 * u_2
    a = (own.A_1 + pi_1 / beta * xi, own.A_2 + pi_2 / beta * xi)
    gamma, root = 1.0 / (beta + sqrt(lam * beta)), sqrt(lam)
    S = (
        (s_11 - gamma * pi_1 * phi_1) / root,
        (s_12 - gamma * pi_1 * phi_2) / root,
        (s_21 - gamma * pi_2 * phi_1) / root,
        (s_22 - gamma * pi_2 * phi_2) / root,
    )
    if own.high < np.inf:
        a = in_range(a, S, own.low, own.high)
    if np.isfinite(a[0] + a[1] + S[0] + S[1] + S[2] + S[3]):
        own.A_1, own.A_2 = a
        own.S[0, 0], own.S[0, 1], own.S[1, 0], own.S[1, 1] = S


@compiled()
def _plan(s: Any, own: Any) -> None:
    """Fire a pulse of whole samples, its effort trimmed to the width they are longer (Eq. 14)."""
    e, f_p, T = s.error, own.effort, own.period
    b = own.A_1 * f_p * f_p - own.A_2 * f_p  # Eq. 16
    f_c = own.A_2 / own.A_1
    if not (b > 0.0 and f_c < f_p) or s.idle >= own.max_idle_pulses:
        stop(s)
        return
    sign = 1.0 if e > 0.0 else -1.0
    t_p = min(sqrt(own.gain * abs(e) / b), own.longest)
    n = whole_samples(t_p, T)
    T_x = n * T
    f = sign * trimmed_effort(f_p, f_c, t_p, T_x)
    f_n = sign * f_p
    if own.regressor == APPLIED:
        own.u_1, own.u_2 = T_x * T_x * f * abs(f), -T_x * T_x * f
    elif own.regressor == NOMINAL:
        own.u_1, own.u_2 = t_p * t_p * f_n * abs(f_n), -t_p * t_p * f_n
    else:
        own.u_1, own.u_2 = t_p * t_p * f_n * f_n, t_p * t_p * f_n  # Eq. 22
    fire(s, sign * b * t_p * t_p)
    add_level(s, f, n)


@compiled()
def papwc_step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    """Take a sample."""
    vector = state.copy()
    if not readable(vector, METHOD, sample):
        return vector, np.nan
    s, own = head(vector), own_fields(vector)
    if watch(vector, sample):
        if s.fresh and s.last.moved:
            _learn(s, own)
        if s.outcome == MOVING:
            _plan(s, own)
    return vector, emit(s)
