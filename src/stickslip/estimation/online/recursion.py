"""The state of what is estimated on line, and kernels for recursive least squares in it.

All that a step remembers is one vector of fixed size, so that the same step runs from Python, in a
compiled loop and on a drive. What lies where in the vector is given by the constants below; some
settings that several methods have in common are among them.
"""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.friction import FrictionTerms
from stickslip.records import InputError

MOST_PARAMETERS = 5

Variance = float | tuple[tuple[float, ...], ...]
"""P(0): its diagonal value, or all of it row by row."""

(
    # Settings
    SAMPLING_TIME,
    FORGETTING,
    PARAMETERS,
    LOAD_INERTIA,
    STIFFNESS,
    PER_DIRECTION,
    OFFSET,
    DERIVED,  # velocities are not measured but differentiated
    RELATIVE_PRIOR,  # P(0) follows the largest regressors so far
    EXPONENTIAL,  # everything is forgotten, in `rls_step`
    STRIBECK,  # velocity of the Stribeck effect; 0 without
    DELTA,  # its exponent, 1 or 2
    # What changes
    COUNT,
    COUNTED,  # rows that counted
) = range(14)
FIRST_SPREAD = COUNTED + 1  # diagonal of P(0)
SPREAD = FIRST_SPREAD + MOST_PARAMETERS  # P, row by row
ROW = SPREAD + MOST_PARAMETERS**2  # regressor of the row being taken
GAIN = ROW + MOST_PARAMETERS
TYPICAL = GAIN + MOST_PARAMETERS  # running mean squares of the regressors that count
VALUES = TYPICAL + MOST_PARAMETERS  # estimates; behind them is what a method needs besides

_PRIOR = 1e-8
"""Information of a relative prior, over that of the largest row so far: too little to matter, and
so much that P, 1e8 times what a row leaves of it, keeps eight digits of what it learns."""

_SMALL_ROW = 1e-3  # squared size of a row without new information, over that of a typical one


@compiled(inline=True)
def stribeck_left(s: Float[np.ndarray, " s"], v: float) -> float:
    """Return exp(-(abs(v)/v_s)^delta), the share of the step to static friction that is left."""
    if s[STRIBECK] == 0.0:
        return 0.0
    r = abs(v) / s[STRIBECK]
    return np.exp(-r * r if s[DELTA] == 2.0 else -r)


@compiled(inline=True)
def _counts(s: Float[np.ndarray, " s"], p: int, forgetting: float) -> bool:
    """Return whether the row is not far smaller than a typical one, and let it count as typical."""
    size = 0.0
    for i in range(p):
        if s[TYPICAL + i] > 0.0:
            size = max(size, s[ROW + i] * s[ROW + i] / s[TYPICAL + i])
    if s[COUNTED] > 0.0 and size < _SMALL_ROW:
        return False
    s[COUNTED] += 1.0
    weight = max(1.0 / s[COUNTED], 1.0 - forgetting)
    for i in range(p):
        s[TYPICAL + i] += weight * (s[ROW + i] * s[ROW + i] - s[TYPICAL + i])
    return True


@compiled(inline=True)
def _widen_prior(s: Float[np.ndarray, " s"], p: int) -> None:
    """Let P(0) be that of a small fraction of the largest row so far, whatever its units.

    A regressor counts from its first value other than zero; as it grows, so does the information
    that P begins with, which leaves the estimates as they are.
    """
    for k in range(p):
        size = _PRIOR * s[ROW + k] * s[ROW + k]
        first = s[FIRST_SPREAD + k]
        if first == 0.0 and size > 0.0:
            s[FIRST_SPREAD + k] = 1.0 / size
            s[SPREAD + k * p + k] = 1.0 / size
        elif size * first > 2.0:
            s[FIRST_SPREAD + k] = 1.0 / size
            added = size - 1.0 / first
            for i in range(p):
                s[GAIN + i] = s[SPREAD + i * p + k]
            drop = added / (1.0 + added * s[GAIN + k])
            for i in range(p):
                for j in range(p):
                    s[SPREAD + i * p + j] -= drop * s[GAIN + i] * s[GAIN + j]


@compiled(inline=True)
def _update(
    s: Float[np.ndarray, " s"], y: float, forgetting: float, printed: bool, p: int
) -> float:
    """Take the row W at its place and its target y into the estimates (Eqs. 4.6-4.10, K before P).

    Printed: everything is forgotten exponentially. Otherwise restricted forgetting (Kulhavy 1987):
    the information P^-1 grows by eps W W' with eps = lambda - (1 - lambda) / g and g = W' P W, so
    that only information on what the row measures is forgotten. A row far smaller than those before
    it (a rest, with its noise) holds no new information, and nothing is forgotten for it: eps >= 0
    there. Either way nothing is forgotten in a step that would leave the estimates less certain
    than they were at the start, on average over the parameters: P stays bounded whatever the rows
    are. Without forgetting both are ordinary recursive least squares.

    Returns the squared prediction error over its variance, that of a row's noise being 1.
    """
    if s[RELATIVE_PRIOR] > 0.0:
        _widen_prior(s, p)
    g = 0.0
    e = y
    for i in range(p):
        total = 0.0
        for j in range(p):
            total += s[SPREAD + i * p + j] * s[ROW + j]
        s[GAIN + i] = total
        g += total * s[ROW + i]
        e -= s[ROW + i] * s[VALUES + i]
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
            if s[FIRST_SPREAD + i] > 0.0:
                started += 1
                spread += s[SPREAD + i * p + i] / s[FIRST_SPREAD + i]
                square += s[GAIN + i] * s[GAIN + i] / s[FIRST_SPREAD + i]
        if grown * spread - drop * square > started:
            weight, grown, drop = 1.0, 1.0, 1.0 / (1.0 + g)
    step = e / (weight + g)
    for i in range(p):
        s[VALUES + i] += s[GAIN + i] * step
        for j in range(i, p):
            value = grown * s[SPREAD + i * p + j] - drop * s[GAIN + i] * s[GAIN + j]
            s[SPREAD + i * p + j] = value
            s[SPREAD + j * p + i] = value
    return e * e / (1.0 + g)


@compiled(inline=True)
def update(s: Float[np.ndarray, " s"], y: float, forgetting: float, printed: bool) -> float:
    """Take the row at its place and its target y into the estimates, as `_update` does.

    The loops run over a number that the compiler knows where it is a frequent one.
    """
    p = int(s[PARAMETERS])
    if p == 2:
        return _update(s, y, forgetting, printed, 2)
    if p == 3:
        return _update(s, y, forgetting, printed, 3)
    if p == 4:
        return _update(s, y, forgetting, printed, 4)
    return _update(s, y, forgetting, printed, p)


@compiled(brief=True)
def rls_step(s: Float[np.ndarray, " s"], row: Float[np.ndarray, " p"], y: float) -> bool:
    """Take one row into the state, in place; return whether it was taken.

    It is not if it does not have the size of the estimates, or a number is not finite.
    """
    p = int(s[PARAMETERS])
    finite = np.isfinite(y) and row.size == p
    if finite:
        for i in range(p):
            finite = finite and np.isfinite(row[i])
    if finite:
        for i in range(p):
            s[ROW + i] = row[i]
        update(s, y, s[FORGETTING], s[EXPONENTIAL] > 0.0)
    return finite


@compiled()
def rls_run(
    s: Float[np.ndarray, " s"], rows: Float[np.ndarray, "n p"], targets: Float[np.ndarray, " n"]
) -> Float[np.ndarray, "n p"]:
    """Take many rows, in place, and return the estimates after each."""
    n, p = rows.shape
    history = np.empty((n, p))
    for k in range(n):
        for i in range(p):
            s[ROW + i] = rows[k, i]
        update(s, targets[k], s[FORGETTING], s[EXPONENTIAL] > 0.0)
        for i in range(p):
            history[k, i] = s[VALUES + i]
    return history


def covariance_in(state: Float[np.ndarray, " s"]) -> Float[np.ndarray, "p p"]:
    """Return P from a state; infinite for a parameter that no row depends on yet."""
    p = int(state[PARAMETERS])
    spread = state[SPREAD : SPREAD + p * p].reshape(p, p).copy()
    unknown = np.flatnonzero(state[FIRST_SPREAD : FIRST_SPREAD + p] == 0.0)
    spread[unknown, unknown] = np.inf
    return spread


def lay_friction(s: Float[np.ndarray, " s"], terms: FrictionTerms) -> None:
    """Write into a state which friction is sought; an InputError if there is no room for it."""
    if len(terms.stribeck) > 1 or (terms.stribeck and terms.per_direction):
        raise InputError(
            f"{len(terms.names)} frictions are sought with a Stribeck effect, on line there is "
            "room for one effect that is the same in both directions",
            remedy="leave per_direction out, give one effect, or use fit",
        )
    s[PER_DIRECTION] = terms.per_direction
    s[OFFSET] = "offset" in terms.names
    for effect in terms.stribeck:
        s[STRIBECK], s[DELTA] = effect.velocity, effect.exponent


def lay_prior(
    state: Float[np.ndarray, " s"], values: Sequence[float], variance: Variance | None
) -> None:
    """Write first guesses [SI] and P(0) into a state, in place.

    ``variance`` is P(0) or its diagonal value; None for one that follows the size of the
    regressors.
    """
    p = len(values)
    state[VALUES : VALUES + p] = values
    if variance is None:
        state[RELATIVE_PRIOR] = 1.0
    else:
        P = _matrix(variance, p)
        state[FIRST_SPREAD : FIRST_SPREAD + p] = np.diag(P)
        state[SPREAD : SPREAD + p * p] = P.ravel()


def lay_information(
    state: Float[np.ndarray, " s"],
    at: int,
    most: int,
    values: Sequence[float],
    variance: Variance | None,
) -> None:
    """Write P(0)^-1 theta(0) and P(0)^-1 into a state from ``at`` on, with room for ``most`` each.

    Zeros stay without a variance.
    """
    if variance is not None:
        p = len(values)
        information = np.linalg.inv(_matrix(variance, p))
        state[at : at + p] = information @ np.asarray(values)
        whole = state[at + most : at + most + most * most].reshape(most, most)
        whole[:p, :p] = 0.5 * (information + information.T)


def _matrix(variance: Variance, p: int) -> Float[np.ndarray, "p p"]:
    """Return P(0)."""
    return variance * np.eye(p) if isinstance(variance, float) else np.array(variance)
