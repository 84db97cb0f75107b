"""Forward motion of the flexible arm, as linear maps of the efforts.

While the driven mass slips one way the arm is linear (van de Wijdeven 2002 A Eqs. 2.1-2.3 for
x1' > 0). With the state x = (x1, v1, x2, v2), the net force f = u - F (effort less Coulomb
friction and offset), held over each step, and losses of the load (damping d of the spring, Coulomb
friction f2, opposed to forward motion, and viscous friction c2 of mass 2), none of them in the
source:

    x1' = v1,  m1 v1' = f - c v1 - p,  x2' = v2,  m2 v2' = p - c2 v2 - f2,
    p = ks (x1 - x2) + d (v1 - v2).
"""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.numerics.held_step import held_step
from stickslip.plants import FlexibleArm

_SHORT = 0.5  # (w + c/m1) h of a step: its Taylor series converges at once, v1 bends at most once
_TERMS = 16  # of that series: 0.5^17/17! = 2e-20
_HALVINGS = 60  # of an interval, down to rounding

Values = NDArray[np.float64]
Constants = tuple[float, float, float, float, float, float]  # m1, m2, ks, c, d, c2


class LoadLosses(NamedTuple):
    """Losses of mass 2 of an arm beside the spring's force."""

    damping: float = 0.0  #: Of the spring [N s/m or N m s/rad].
    coulomb_friction: float = 0.0  #: Of mass 2 [N or N m].
    viscous_friction: float = 0.0  #: Of mass 2 [N s/m or N m s/rad].


NO_LOSSES = LoadLosses()


@lru_cache(maxsize=256)
def _step_matrix(constants: Constants, h: float) -> Float[np.ndarray, "4 6"]:
    """Return [A_d B_d] of a step h under zero-order hold, of forces on mass 1 and on mass 2."""
    m1, m2, ks, c, d, c2 = constants
    M = np.zeros((4, 6))
    M[0, 1] = M[2, 3] = h
    M[1] = np.array([-ks, -c - d, ks, d, 1.0, 0.0]) * (h / m1)
    M[3] = np.array([ks, d, -ks, -d - c2, 0.0, 1.0]) * (h / m2)
    return held_step(M)


@compiled()
def _forced_states(M: Values, x: Values, f: Values, g: float) -> Values:
    """Return the states from x on under net forces f_k on mass 1 and a constant g on mass 2."""
    n = f.shape[0]
    X = np.empty((n + 1, 4))
    for i in range(4):
        X[0, i] = x[i]
    for k in range(n):
        for i in range(4):
            X[k + 1, i] = (
                M[i, 0] * X[k, 0]
                + M[i, 1] * X[k, 1]
                + M[i, 2] * X[k, 2]
                + M[i, 3] * X[k, 3]
                + M[i, 4] * f[k]
                + M[i, 5] * g
            )
    return X


@compiled()
def _worth_of_steps(M: Values, final: Values, W: Values, D: Values) -> Values:
    """Return what a unit of net force in each step is worth, at the prices of constraints.

    Prices are spread over the steps by the costate p: p_k = A_d' p_{k+1} + w_k, with w_k the prices
    of the state at the instant k (rows of W) and p_n those of the final state; a net force in step
    k is then worth B_d' p_{k+1} + D_k, with D_k what it is worth within its own step.
    """
    n = D.shape[0]
    p, before = final.copy(), np.empty(4)
    worth = np.empty(n)
    for k in range(n - 1, -1, -1):
        worth[k] = M[0, 4] * p[0] + M[1, 4] * p[1] + M[2, 4] * p[2] + M[3, 4] * p[3] + D[k]
        for i in range(4):
            before[i] = M[0, i] * p[0] + M[1, i] * p[1] + M[2, i] * p[2] + M[3, i] * p[3] + W[k, i]
        p, before = before, p
    return worth


@compiled()
def _series(constants: Constants, x: Values, f: float, g: float, C: Values) -> None:
    """Write the Taylor coefficients of v1 under held net forces: v1(t) = sum C_i t^i."""
    m1, m2, ks, c, d, c2 = constants
    a, b, s = x[1], x[3], x[0] - x[2]  # coefficients of v1, v2 and x1 - x2
    C[0] = a
    for i in range(1, _TERMS + 1):
        p = ks * s + d * (a - b)
        a_next = (f - c * a - p) / m1 / i
        b_next = (g + p - c2 * b) / m2 / i
        s = (a - b) / i
        a, b, f, g = a_next, b_next, 0.0, 0.0
        C[i] = a


@compiled()
def _derivative(C: Values, order: int, t: float) -> float:
    """Return v1 (order 0) or a derivative of it at the time t, by its Taylor coefficients."""
    total = 0.0
    for i in range(_TERMS, order - 1, -1):
        factor = 1
        for j in range(order):
            factor *= i - j
        total = total * t + factor * C[i]
    return total


@compiled()
def _sign_change(C: Values, order: int, low: float, high: float, rising: bool) -> float:
    """Return where a derivative of v1 turns positive (or negative, if it is not ``rising``)."""
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        if (_derivative(C, order, middle) < 0.0) == rising:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled()
def _dip(C: Values, h: float) -> float:
    """Return the instant within (0, h) of the lowest local minimum of v1; -1 if there is none.

    The curvature changes its sign at most once in so short a step, so that one instant decides
    whether the slope does so although its signs at both ends do not show it.
    """
    begin, end = _derivative(C, 1, 0.0), _derivative(C, 1, h)
    if begin < 0.0 < end:
        return _sign_change(C, 1, 0.0, h, True)
    bent, straightened = _derivative(C, 2, 0.0), _derivative(C, 2, h)
    if begin >= 0.0 and end >= 0.0 and bent < 0.0 < straightened:
        middle = _sign_change(C, 2, 0.0, h, True)
        if _derivative(C, 1, middle) < 0.0:
            return _sign_change(C, 1, middle, h, True)
    elif begin <= 0.0 and end <= 0.0 and bent > 0.0 > straightened:
        middle = _sign_change(C, 2, 0.0, h, False)
        if _derivative(C, 1, middle) > 0.0:
            return _sign_change(C, 1, 0.0, middle, True)
    return -1.0


@compiled()
def short_response(constants: Constants, t: float) -> Values:
    """Return v1 at a short time t per unit of x1, v1, x2, v2 at its start and of both forces."""
    C, g = np.empty(_TERMS + 1), np.empty(6)
    for k in range(6):
        x = np.zeros(4)
        if k < 4:
            x[k] = 1.0
        _series(constants, x, 1.0 if k == 4 else 0.0, 1.0 if k == 5 else 0.0, C)
        g[k] = _derivative(C, 0, t)
    return g


@compiled()
def _velocity_minima(constants: Constants, h: float, X: Values, f: Values, g: float) -> Values:
    """Return the local minima of v1 strictly between the first and the last instant.

    One row each: step, time within the step, v1. A minimum at the begin of a step has time 0.
    """
    m1, _, ks, c, d, _ = constants
    n = f.shape[0]
    found = np.empty((2 * n, 3))
    count = 0
    before = 1.0  # slope at the end of the step before
    C = np.empty(_TERMS + 1)
    for k in range(n):
        force = f[k] - ks * (X[k, 0] - X[k, 2]) - d * (X[k, 1] - X[k, 3])
        begin = (force - c * X[k, 1]) / m1
        if k > 0 and before <= 0.0 <= begin:
            found[count, 0], found[count, 1], found[count, 2] = k, 0.0, X[k, 1]
            count += 1
        pull = ks * (X[k + 1, 0] - X[k + 1, 2]) + d * (X[k + 1, 1] - X[k + 1, 3])
        before = (f[k] - pull - c * X[k + 1, 1]) / m1
        _series(constants, X[k], f[k], g, C)
        t = _dip(C, h)
        if t > 0.0:
            found[count, 0], found[count, 1], found[count, 2] = k, t, _derivative(C, 0, t)
            count += 1
    return found[:count]


def steps_per_sample(arm: FlexibleArm, sampling_time: float) -> int:
    """Return into how many steps a sample is divided for its motion to be simple within each."""
    c = max(arm.friction.viscous_friction_positive, arm.friction.viscous_friction_negative)
    rate = math.sqrt(arm.stiffness / arm.mass_1 + arm.stiffness / arm.mass_2) + c / arm.mass_1
    return max(1, math.ceil(rate * sampling_time / _SHORT))


@dataclass(frozen=True, kw_only=True)
class ArmMotion:
    """Forward motion of one arm with one friction from one state, in steps of equal length."""

    arm: FlexibleArm  # only masses and stiffness are read
    resistance: float  # what opposes motion at any speed, Coulomb friction and offset [N or N m]
    viscous_friction: float  # while moving forward [N s/m or N m s/rad]
    step: float  # [s]
    steps: int
    start: Float[np.ndarray, " 4"]  # state at the begin
    losses: LoadLosses = NO_LOSSES

    @property
    def _constants(self) -> Constants:
        return _constants(self.arm, self.viscous_friction, self.losses)

    @property
    def _on_load(self) -> float:
        return -self.losses.coulomb_friction

    @property
    def _matrix(self) -> Float[np.ndarray, "4 6"]:
        return _step_matrix(self._constants, self.step)

    @cached_property
    def forced(self) -> Float[np.ndarray, "n 4"]:
        """States from rest at 0 under the net force 1, at every instant."""
        return _forced_states(self._matrix, np.zeros(4), np.ones(self.steps), 0.0)

    @cached_property
    def free(self) -> Float[np.ndarray, "n 4"]:
        """States from the start on without effort, as if friction always opposed forward motion."""
        resistance = np.full(self.steps, -self.resistance)
        return _forced_states(self._matrix, self.start, resistance, self._on_load)

    def states(self, effort: Float[np.ndarray, " k"]) -> Float[np.ndarray, "n 4"]:
        """Return the states under an effort for each of the first k steps."""
        return _forced_states(self._matrix, self.start, effort - self.resistance, self._on_load)

    def minima(
        self, effort: Float[np.ndarray, " k"], states: Float[np.ndarray, "n 4"]
    ) -> Float[np.ndarray, "r 3"]:
        """Return the local minima of v1 between begin and end: step, time in it, v1."""
        net = effort - self.resistance
        return _velocity_minima(self._constants, self.step, states, net, self._on_load)

    def velocity_rows(
        self, instants: Float[np.ndarray, "r 2"], edges: Int[np.ndarray, " b"]
    ) -> tuple[Float[np.ndarray, "r c"], Float[np.ndarray, " r"]]:
        """Return how v1 depends on the efforts, and what it is without them.

        Instants are a step and the time within it; the effort changes at the steps ``edges``, of
        which the last is where it ends.
        """
        at = instants[:, 0].astype(np.intp)
        rows = np.zeros((at.size, 6))
        rows[:, 1] = 1.0
        for r in np.flatnonzero(instants[:, 1] > 0.0):
            rows[r] = short_response(self._constants, float(instants[r, 1]))
        since = at[:, None] - edges[None, :]
        states = self.forced[np.maximum(since, 0)]
        steps = np.where(
            since >= 0, np.einsum("rk,rbk->rb", rows[:, :4], states) + rows[:, 4:5], 0.0
        )
        without = np.einsum("rk,rk->r", rows[:, :4], self.free[at])
        without += rows[:, 4:] @ (-self.resistance, self._on_load)
        return steps[:, :-1] - steps[:, 1:], without

    def worth(
        self,
        final: Float[np.ndarray, " 4"],
        instants: Float[np.ndarray, "r 2"],
        price: Float[np.ndarray, " r"],
    ) -> Float[np.ndarray, " n"]:
        """Return what a unit of effort in each step is worth.

        At the prices ``final`` of the final state, and ``price`` of v1 at the instants.
        """
        W, D = np.zeros((self.steps, 4)), np.zeros(self.steps)
        at = instants[:, 0].astype(np.intp)
        whole = instants[:, 1] == 0.0
        W[:, 1] = np.bincount(at[whole], weights=price[whole], minlength=self.steps)
        for r in np.flatnonzero(~whole):
            g = short_response(self._constants, float(instants[r, 1]))
            W[at[r]] += price[r] * g[:4]
            D[at[r]] += price[r] * g[4]
        return _worth_of_steps(self._matrix, final, W, D)


def forward_motion(
    arm: FlexibleArm,
    *,
    resistance: float,
    viscous_friction: float,
    sampling_time: float,
    start: Float[np.ndarray, " 4"],
    effort: Float[np.ndarray, " n"],
) -> Float[np.ndarray, "n+1 4"]:
    """Return the states at every sample while the driven mass of an arm moves forward.

    Parameters
    ----------
    arm
        Only masses and stiffness are read.
    resistance
        What opposes the motion at any speed, Coulomb friction and offset [N or N m].
    viscous_friction
        While moving forward [N s/m or N m s/rad].
    sampling_time
        [s].
    start
        ``(position, velocity, load_position, load_velocity)`` [m or rad, m/s or rad/s].
    effort
        Of each sample [N or N m].
    """
    matrix = _step_matrix(_constants(arm, viscous_friction, NO_LOSSES), sampling_time)
    return _forced_states(matrix, start, effort - resistance, 0.0)


def _constants(arm: FlexibleArm, viscous_friction: float, losses: LoadLosses) -> Constants:
    damping, _, viscous = losses
    return arm.mass_1, arm.mass_2, arm.stiffness, viscous_friction, damping, viscous


@lru_cache(maxsize=256)
def _resting_matrix(frequency: float, damping: float, step: float) -> Float[np.ndarray, "2 3"]:
    M = np.zeros((2, 3))
    M[0, 1] = step
    M[1] = -(frequency**2) * step, -damping * step, step
    return held_step(M)


def resting_motion(
    arm: FlexibleArm,
    losses: LoadLosses,
    *,
    sampling_time: float,
    start: Float[np.ndarray, " 4"],
    samples: int,
) -> Float[np.ndarray, "n 4"]:
    """Return the states at every sample while mass 1 rests and mass 2 swings about it.

    Coulomb friction of mass 2 opposes forward motion. The arguments are those of `forward_motion`.
    """
    frequency = math.sqrt(arm.stiffness / arm.mass_2)
    damping = (losses.damping + losses.viscous_friction) / arm.mass_2
    M = _resting_matrix(frequency, damping, sampling_time)
    x1, _, x2, v2 = start.tolist()
    states = np.zeros((samples + 1, 4))
    states[:, 0] = x1
    swing = np.array([x2 - x1, v2])
    drift = M[:, 2] * (-losses.coulomb_friction / arm.mass_2)
    for k in range(samples + 1):
        states[k, 2], states[k, 3] = x1 + swing[0], swing[1]
        swing = M[:, :2] @ swing + drift
    return states
