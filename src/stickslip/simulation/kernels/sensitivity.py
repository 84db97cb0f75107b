"""First-order sensitivities of the exact motion of both plants, event by event.

Between events a plant is affine linear, y' = A y + b F with y = (x1, v1) or (x1, v1, d, v2) and the
held force F = u - f0 - s fc on the driven mass, so that S = dy/dp obeys the variational equation
S' = A S + b dF/dp + (dA/dp) y + (db/dp) F. Over a whole sample both are one product with matrices
that are made once a mode; over a piece of a sample, the Taylor series of both.

An event at time t* moves with the parameters, and the acceleration of the driven mass jumps there
from a- to a+. In the sensitivity that leaves (saltation; Hiskens and Pai 2000, IEEE Trans. CAS-I
47:204, Eq. 32) S+ = S- + (y'- - y'+) dt*/dp, in the row of v1 only:

- v1 = 0 ends slip: dt*/dp = -S_v/a-, so that S_v+ = S_v a+/a-, which is 0 for a mass that rests;
- the force w = u - f0 - ks d on a resting mass reaches s fs within a sample:
  dt*/dp = (s dfs/dp + df0/dp + d dks/dp + ks S_d)/(ks v2), S_v+ = -a+ dt*/dp;
- a new effort frees the mass at the beginning of a sample: that time does not move, S_v+ = 0.

Where and when an event is, the simulator has found: only its list of events is read here.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stickslip.compiled import compiled

FRICTION_COLUMNS = 5  # fc+, fc-, fs+, fs-, f0, after the parameters of the rates
_TERMS = 18  # of the Taylor series at |A| h <= 1/2: 2^-18/18! = 6e-22
_LONGEST = 0.5  # norm of a step, as `_TERMS` assumes

Vector = NDArray[np.float64]
Matrix = NDArray[np.float64]
Blocks = NDArray[np.float64]
Mode = tuple[Matrix, Blocks, float]
"""Rates, shape (s, s+1), the last column that of F; their derivatives by the first q parameters;
the fastest of the rates [1/s]."""


class Modes(NamedTuple):
    """Motion in the modes -1, 0, +1: rates as of `Mode`, and `sample_matrices`."""

    rates: Blocks
    slopes: NDArray[np.float64]
    norms: Vector
    increments: Blocks
    increment_slopes: NDArray[np.float64]


class Trajectory(NamedTuple):
    """A motion as simulated: its efforts, y at every sample, shape (s, n+1), and its events."""

    effort: Vector
    states: Matrix
    event_time: Vector
    event_mode: NDArray[np.int8]


@compiled()
def _piece(mode: Mode, F: float, dF: Vector, h: float, y: Vector, S: Matrix, work: Blocks) -> None:
    """Carry state and sensitivities over a time h without an event, in place.

    ``work`` has shape (2, s, p + 1) and holds one Taylor coefficient of both.
    """
    R, dR, norm = mode
    s, p = S.shape
    q = dR.shape[0]
    steps = max(math.ceil(norm * h / _LONGEST), 1)
    h /= steps
    a, b = work[0], work[1]
    for _ in range(steps):
        a[:, :p] = S
        a[:, p] = y
        for k in range(1, _TERMS + 1):
            r = h / k
            for i in range(s):
                for j in range(p + 1):
                    b[i, j] = 0.0
                for m in range(s):
                    rate = R[i, m]
                    if rate != 0.0:
                        for j in range(p + 1):
                            b[i, j] += rate * a[m, j]
                    for j in range(q):
                        b[i, j] += dR[j, i, m] * a[m, p]
                if k == 1:
                    b[i, p] += R[i, s] * F
                    for j in range(p):
                        b[i, j] += R[i, s] * dF[j]
                    for j in range(q):
                        b[i, j] += dR[j, i, s] * F
                for j in range(p + 1):
                    b[i, j] *= r
            np.add(y, b[:, p], y)
            np.add(S, b[:, :p], S)
            a, b = b, a


@compiled()
def sample_matrices(
    R: Matrix, dR: Blocks, norm: float, T: float
) -> tuple[Matrix, Blocks]:  # fmt: skip
    """Return the increments over a whole sample and their derivatives by the parameters.

    E, shape (s, s+1), and dE, shape (q, s, s+1): y(T) - y(0) = E (y, F).
    """
    s, q = R.shape[0], dR.shape[0]
    E, dE = np.zeros((s, s + 1)), np.zeros((q, s, s + 1))
    y, S, none = np.zeros(s), np.zeros((s, q)), np.zeros(q)
    work = np.zeros((2, s, q + 1))
    for j in range(s + 1):
        y[:], S[:] = 0.0, 0.0
        if j < s:
            y[j] = 1.0
        _piece((R, dR, norm), 1.0 if j == s else 0.0, none, T, y, S, work)
        E[:, j], dE[:, :, j] = y, S.T
        if j < s:
            E[j, j] -= 1.0
    return E, dE


@compiled()
def _enter(law: Vector, mode: int, q: int, u: float, dF: Vector) -> float:
    """Write dF/dp of a mode; return F = u - f0 - s fc."""
    dF[q : q + FRICTION_COLUMNS] = 0.0
    dF[q + 4] = -1.0
    if mode > 0:
        dF[q] = -1.0
        return (u - law[4]) - law[0]
    if mode < 0:
        dF[q + 1] = 1.0
        return (u - law[4]) + law[1]
    return u - law[4]


@compiled()
def _free(law: Vector, mode: int, ks: float, y: Vector, S: Matrix, dF: Vector, gain: float) -> None:
    """Let the spring free a resting mass within a sample: S_v+ = -a+ dt*/dp.

    ``gain`` is 1/m1. The parameters of the rates are (m1, m2, ks, c+, c-).
    """
    q = S.shape[1] - y.size - FRICTION_COLUMNS
    fs = law[2] if mode > 0 else law[3]
    fc = law[0] if mode > 0 else law[1]
    rate = ks * y[3]  # of the force
    a = mode * (fs - fc) * gain
    for j in range(S.shape[1]):
        rise = ks * S[2, j] - (dF[j] if j == q + 4 else 0.0)
        if j == 2:
            rise += y[2]
        if j == (q + 2 if mode > 0 else q + 3):
            rise += mode
        S[1, j] = -a * rise / rate if rate != 0.0 else 0.0


@compiled()
def sensitivity_run(
    modes: Modes, law: Vector, ks: float, T: float, motion: Trajectory, out: NDArray[np.float64]
) -> None:
    """Write dy/dp of every sample of a simulated motion to ``out``, shape (n+1, s, p).

    ``law`` is (fc+, fc-, fs+, fs-, f0), ``ks`` the stiffness (0 for a single mass). The parameters
    are the q of the rates, fc+, fc-, fs+, fs-, f0 and the s initial states.
    """
    rates, slopes, norms, increments, increment_slopes = modes
    effort, states, event_time, event_mode = motion
    n = effort.size
    s, q = rates.shape[1], slopes.shape[1]
    p = out.shape[2]
    first = q + FRICTION_COLUMNS
    S, N, dF = np.zeros((s, p)), np.zeros((s, p)), np.zeros(p)
    y = np.zeros(s)
    work = np.zeros((2, s, p + 1))
    for i in range(s):
        S[i, first + i] = 1.0
    e = 0
    for k in range(n):
        y[:] = states[:, k]
        mode = 1 if y[1] > 0.0 else (-1 if y[1] < 0.0 else 0)
        if mode == 0 and k > 0:
            S[1] = 0.0
        out[k] = S
        # A mass at rest at first has no velocity to vary unless it is set free at once
        if mode == 0 and k == 0 and not (event_time.size > 0 and event_time[0] == 0.0):
            S[1, first + 1] = 0.0
        start, end = k * T, (k + 1) * T
        force = _enter(law, mode, q, effort[k], dF)
        if e == event_time.size or not event_time[e] < end:
            E, dE = increments[mode + 1], increment_slopes[mode + 1]
            for i in range(s):
                for j in range(p):
                    N[i, j] = S[i, j] + E[i, s] * dF[j]
                for m in range(1, s):
                    rate = E[i, m]
                    if rate != 0.0:
                        for j in range(p):
                            N[i, j] += rate * S[m, j]
                for j in range(q):
                    total = dE[j, i, s] * force
                    for m in range(1, s):
                        total += dE[j, i, m] * y[m]
                    N[i, j] += total
            S[:] = N
            continue
        passed = 0.0
        while e < event_time.size and event_time[e] < end:
            new = int(event_mode[e])
            h = max(event_time[e] - start - passed, 0.0)
            if mode != new or mode != 0:
                now = rates[mode + 1], slopes[mode + 1], norms[mode + 1]
                _piece(now, force, dF, h, y, S, work)
                passed += h
                y[1] = 0.0
                if mode == 0:
                    if event_time[e] != start:
                        _free(law, new, ks, y, S, dF, rates[new + 1, 1, s])
                    force = _enter(law, new, q, effort[k], dF)
                else:
                    r = rates[mode + 1]
                    before = r[1, s] * force + (r[1, 2] * y[2] if s > 2 else 0.0)
                    force = _enter(law, new, q, effort[k], dF)
                    r = rates[new + 1]
                    after = r[1, s] * force + (r[1, 2] * y[2] if s > 2 else 0.0)
                    ratio = after / before if before != 0.0 else 0.0
                    S[1] *= ratio
                mode = new
            e += 1
        now = rates[mode + 1], slopes[mode + 1], norms[mode + 1]
        _piece(now, force, dF, max(T - passed, 0.0), y, S, work)
    out[n] = S
    if states[1, n] == 0.0:
        out[n, 1] = 0.0
