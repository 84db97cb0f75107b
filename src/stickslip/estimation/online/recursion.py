"""State of the online estimators, and kernels for recursive least squares in it.

All that a step remembers is one vector of fixed size, so that the same step runs from Python, in a
compiled loop and on a drive. It begins with the fields of `RECURSION`, among them some settings
that several methods have in common.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.estimation.online.method import State
from stickslip.friction import FrictionTerms
from stickslip.numerics.named_fields import fields_at, place_of
from stickslip.records import InputError

MOST_PARAMETERS = 5  # of a recursive estimator

Variance = float | tuple[tuple[float, ...], ...]
"""P(0): its diagonal value, or the whole matrix row by row."""

RECURSION = np.dtype(
    [
        # Settings
        ("sampling_time", "f8"),
        ("forgetting", "f8"),
        ("parameters", "i8"),  # number of parameters
        ("load_inertia", "f8"),
        ("stiffness", "f8"),
        ("per_direction", "i8"),
        ("has_offset", "i8"),
        ("differentiates", "i8"),  # velocities are not measured but differentiated
        ("has_relative_prior", "i8"),  # P(0) follows the largest regressors so far
        ("exponential", "i8"),  # 1 for exponential forgetting, in `rls_step`
        ("stribeck_velocity", "f8"),  # 0 without a Stribeck effect
        ("stribeck_exponent", "i8"),  # 1 or 2
        # What changes
        ("samples", "i8"),
        ("typical_rows", "i8"),  # rows that are not far smaller than a typical one
        ("first_spread", "f8", (MOST_PARAMETERS,)),  # diagonal of P(0)
        ("spread", "f8", (MOST_PARAMETERS, MOST_PARAMETERS)),  # P
        ("row", "f8", (MOST_PARAMETERS,)),  # regressor of the row being taken
        ("gain", "f8", (MOST_PARAMETERS,)),
        ("typical", "f8", (MOST_PARAMETERS,)),  # running mean squares of the regressors that count
        ("values", "f8", (MOST_PARAMETERS,)),  # estimates
    ]
)
"""Fields that the state of every estimator by least squares begins with."""

recursion_fields = fields_at(RECURSION)

VALUES = place_of(RECURSION, "values")
"""Place of the first estimate in a state."""

_PRIOR = 1e-8
"""Information of a relative prior, over that of the largest row so far: too little to matter, and
so much that P, 1e8 times what a row leaves of it, keeps eight digits of what it learns."""

_SMALL_ROW = 1e-3  # squared size of a row without new information, over that of a typical one


@compiled(inline=True)
def stribeck_left(s: Any, v: float) -> float:
    """Return exp(-(abs(v)/v_s)^delta), the share of the step to static friction that is left."""
    if s.stribeck_velocity == 0.0:
        return 0.0
    r = abs(v) / s.stribeck_velocity
    return np.exp(-r * r if s.stribeck_exponent == 2 else -r)


@compiled(inline=True)
def _counts(s: Any, p: int, forgetting: float) -> bool:
    """Return whether the row is not far smaller than a typical one, and let it count as typical."""
    size = 0.0
    for i in range(p):
        if s.typical[i] > 0.0:
            size = max(size, s.row[i] * s.row[i] / s.typical[i])
    if s.typical_rows > 0 and size < _SMALL_ROW:
        return False
    s.typical_rows += 1
    weight = max(1.0 / s.typical_rows, 1.0 - forgetting)
    for i in range(p):
        s.typical[i] += weight * (s.row[i] * s.row[i] - s.typical[i])
    return True


@compiled(inline=True)
def _widen_prior(s: Any, p: int) -> None:
    """Let P(0) be that of a small fraction of the largest row so far, whatever its units.

    A regressor counts from its first value other than zero; as it grows, so does the information
    that P begins with, which leaves the estimates as they are.
    """
    for k in range(p):
        size = _PRIOR * s.row[k] * s.row[k]
        first = s.first_spread[k]
        if first == 0.0 and size > 0.0:
            s.first_spread[k] = 1.0 / size
            s.spread[k, k] = 1.0 / size
        elif size * first > 2.0:
            s.first_spread[k] = 1.0 / size
            added = size - 1.0 / first
            for i in range(p):
                s.gain[i] = s.spread[i, k]
            drop = added / (1.0 + added * s.gain[k])
            for i in range(p):
                for j in range(p):
                    s.spread[i, j] -= drop * s.gain[i] * s.gain[j]


@compiled(inline=True)
def _update(s: Any, y: float, forgetting: float, printed: bool, p: int) -> float:
    """Update the estimates with the row W and its target y (Eqs. 4.6-4.10, K before P).

    Printed: everything is forgotten exponentially. Otherwise restricted forgetting (Kulhavy 1987):
    the information P^-1 grows by eps W W' with eps = lambda - (1 - lambda) / g and g = W' P W, so
    that only information on what the row measures is forgotten. A row far smaller than those before
    it (a rest, with its noise) holds no new information, and nothing is forgotten for it: eps >= 0
    there. Either way nothing is forgotten in a step that would leave the estimates less certain
    than they were at the start, on average over the parameters: P stays bounded whatever the rows
    are. Without forgetting both are ordinary recursive least squares.

    Returns the squared prediction error over its variance, that of a row's noise being 1.
    """
    if s.has_relative_prior:
        _widen_prior(s, p)
    g = 0.0
    e = y
    for i in range(p):
        total = 0.0
        for j in range(p):
            total += s.spread[i, j] * s.row[j]
        s.gain[i] = total
        g += total * s.row[i]
        e -= s.row[i] * s.values[i]
    if not (g > 0.0 and np.isfinite(g)):
        return e * e
    weight, grown = 1.0, 1.0
    if printed:
        weight, grown = forgetting, 1.0 / forgetting
        drop = grown / (forgetting + g)
    else:
        eps = forgetting - (1.0 - forgetting) / g
        if forgetting < 1.0 and not _counts(s, p, forgetting) and eps < 0.0:
            eps = 0.0
        drop = eps / (1.0 + eps * g)
    if forgetting < 1.0 and (printed or drop < 0.0):
        spread, square = 0.0, 0.0
        started = 0
        for i in range(p):
            if s.first_spread[i] > 0.0:
                started += 1
                spread += s.spread[i, i] / s.first_spread[i]
                square += s.gain[i] * s.gain[i] / s.first_spread[i]
        if grown * spread - drop * square > started:
            weight, grown, drop = 1.0, 1.0, 1.0 / (1.0 + g)
    step = e / (weight + g)
    for i in range(p):
        s.values[i] += s.gain[i] * step
        for j in range(i, p):
            value = grown * s.spread[i, j] - drop * s.gain[i] * s.gain[j]
            s.spread[i, j] = value
            s.spread[j, i] = value
    return e * e / (1.0 + g)


@compiled(inline=True)
def update(s: Any, y: float, forgetting: float, printed: bool) -> float:
    """Update the estimates with the row and its target y, as `_update` does.

    For a frequent number of parameters the loops have a constant length, which compiles to faster
    code.
    """
    p = s.parameters
    if p == 2:
        return _update(s, y, forgetting, printed, 2)
    if p == 3:
        return _update(s, y, forgetting, printed, 3)
    if p == 4:
        return _update(s, y, forgetting, printed, 4)
    return _update(s, y, forgetting, printed, p)


@compiled(brief=True)
def rls_step(state: State, row: Float[np.ndarray, " p"], y: float) -> bool:
    """Take one row into the state, in place; return whether it was taken.

    It is not if it does not have the size of the estimates, or a number is not finite.
    """
    s = recursion_fields(state)
    p = s.parameters
    finite = np.isfinite(y) and row.size == p
    if finite:
        for i in range(p):
            finite = finite and np.isfinite(row[i])
    if finite:
        for i in range(p):
            s.row[i] = row[i]
        update(s, y, s.forgetting, s.exponential > 0)
    return finite


@compiled()
def rls_run(
    state: State, rows: Float[np.ndarray, "n p"], targets: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n p"]:
    """Take many rows, in place, and return the estimates after each."""
    s = recursion_fields(state)
    n, p = rows.shape
    history = np.empty((n, p))
    for k in range(n):
        for i in range(p):
            s.row[i] = rows[k, i]
        update(s, targets[k], s.forgetting, s.exponential > 0)
        for i in range(p):
            history[k, i] = s.values[i]
    return history


def covariance_in(state: State) -> Float[np.ndarray, "p p"]:
    """Return P from a state; infinite for a parameter that no row depends on yet."""
    s = recursion_fields(state)
    p = int(s.parameters)
    spread = s.spread[:p, :p].copy()
    unknown = np.flatnonzero(s.first_spread[:p] == 0.0)
    spread[unknown, unknown] = np.inf
    return spread


def set_friction(s: Any, terms: FrictionTerms) -> None:
    """Write the estimated friction terms into the fields; an InputError if one has none."""
    if len(terms.stribeck) > 1 or (terms.stribeck and terms.per_direction):
        raise InputError("stribeck_effects_on_line", frictions=len(terms.names))
    s.per_direction = terms.per_direction
    s.has_offset = "offset" in terms.names
    for effect in terms.stribeck:
        s.stribeck_velocity, s.stribeck_exponent = effect.velocity, effect.exponent


def set_prior(s: Any, values: Sequence[float], variance: Variance | None) -> None:
    """Write number of parameters, first guesses [SI] and P(0) into the fields.

    ``variance`` is P(0) or its diagonal value; None for one that follows the size of the
    regressors.
    """
    p = len(values)
    s.parameters = p
    s.values[:p] = values
    if variance is None:
        s.has_relative_prior = 1
    else:
        P = _matrix(variance, p)
        s.first_spread[:p] = np.diag(P)
        s.spread[:p, :p] = P


def set_information(
    eta: Float[np.ndarray, " q"],
    information: Float[np.ndarray, "q q"],
    values: Sequence[float],
    variance: Variance | None,
) -> None:
    """Write P(0)^-1 theta(0) and P(0)^-1, in place; zeros stay without a variance."""
    if variance is not None:
        p = len(values)
        inverse = np.linalg.inv(_matrix(variance, p))
        eta[:p] = inverse @ np.asarray(values)
        information[:p, :p] = 0.5 * (inverse + inverse.T)


def _matrix(variance: Variance, p: int) -> Float[np.ndarray, "p p"]:
    """Return P(0)."""
    return np.array(variance) if isinstance(variance, tuple) else variance * np.eye(p)
