"""What the flexible arm does while its driven mass moves forward, as linear maps of the efforts."""

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Float, Int

from stickslip.planning.series.price_kernels import worth_of_steps
from stickslip.planning.series.slip_kernels import forced_states, short_response, velocity_minima
from stickslip.plants import FlexibleArm

__all__ = ["ArmMotion", "forward_motion", "steps_per_sample"]

_SHORT = 0.5  # (w + c/m1) h of a step: its Taylor series converges at once, v1 bends at most once


@lru_cache(maxsize=256)
def _step_matrix(m1: float, m2: float, ks: float, c: float, h: float) -> Float[np.ndarray, "4 5"]:
    """Return [A_d B_d] of a step h under zero-order hold."""
    from scipy.linalg import expm

    M = np.zeros((5, 5))
    M[0, 1] = M[2, 3] = h
    M[1] = np.array([-ks, -c, ks, 0.0, 1.0]) * (h / m1)
    M[3] = np.array([ks, 0.0, -ks, 0.0, 0.0]) * (h / m2)
    matrix: Float[np.ndarray, "4 5"] = np.ascontiguousarray(expm(M)[:4])
    matrix.flags.writeable = False
    return matrix


def steps_per_sample(arm: FlexibleArm, sampling_time: float) -> int:
    """Return into how many steps a sample is divided for its motion to be simple within each."""
    c = max(arm.friction.viscous_friction_positive, arm.friction.viscous_friction_negative)
    rate = math.sqrt(arm.stiffness / arm.mass_1 + arm.stiffness / arm.mass_2) + c / arm.mass_1
    return max(1, math.ceil(rate * sampling_time / _SHORT))


@dataclass(frozen=True, kw_only=True)
class ArmMotion:
    """Forward motion of one arm with one friction from one state, in steps of equal length.

    Attributes
    ----------
    arm
        Only masses and stiffness are read.
    resistance
        What opposes the motion at any speed, Coulomb friction and offset [N or N m].
    viscous_friction
        While moving forward [N s/m or N m s/rad].
    step
        [s].
    steps
        How many are looked at.
    start
        State at the begin [m or rad, m/s or rad/s].
    """

    arm: FlexibleArm
    resistance: float
    viscous_friction: float
    step: float
    steps: int
    start: Float[np.ndarray, " 4"]

    @property
    def _constants(self) -> tuple[float, float, float, float]:
        return self.arm.mass_1, self.arm.mass_2, self.arm.stiffness, self.viscous_friction

    @property
    def _matrix(self) -> Float[np.ndarray, "4 5"]:
        return _step_matrix(*self._constants, self.step)

    @cached_property
    def forced(self) -> Float[np.ndarray, "n 4"]:
        """States from rest at 0 under the net force 1, at every instant."""
        return forced_states(self._matrix, np.zeros(4), np.ones(self.steps))

    @cached_property
    def free(self) -> Float[np.ndarray, "n 4"]:
        """States from the start on without effort, as if friction always opposed forward motion."""
        return forced_states(self._matrix, self.start, np.full(self.steps, -self.resistance))

    def states(self, effort: Float[np.ndarray, " k"]) -> Float[np.ndarray, "n 4"]:
        """Return the states under an effort for each of the first k steps [N or N m]."""
        return forced_states(self._matrix, self.start, effort - self.resistance)

    def minima(
        self, effort: Float[np.ndarray, " k"], states: Float[np.ndarray, "n 4"]
    ) -> Float[np.ndarray, "r 3"]:
        """Return the local minima of v1 between begin and end: step, time in it, v1."""
        return velocity_minima(*self._constants, self.step, states, effort - self.resistance)

    def velocity_rows(
        self, instants: Float[np.ndarray, "r 2"], edges: Int[np.ndarray, " b"]
    ) -> tuple[Float[np.ndarray, "r c"], Float[np.ndarray, " r"]]:
        """Return how v1 depends on the efforts, and what it is without them.

        Parameters
        ----------
        instants
            Step and time [s] within it.
        edges
            Steps at which the effort changes; the last is where it ends.
        """
        at = instants[:, 0].astype(np.intp)
        rows = np.empty((at.size, 5))
        rows[:] = (0.0, 1.0, 0.0, 0.0, 0.0)
        for r in np.flatnonzero(instants[:, 1] > 0.0):
            rows[r] = short_response(*self._constants, float(instants[r, 1]))
        since = at[:, None] - edges[None, :]
        states = self.forced[np.maximum(since, 0)]
        steps = np.where(
            since >= 0, np.einsum("rk,rbk->rb", rows[:, :4], states) + rows[:, 4:], 0.0
        )
        without = np.einsum("rk,rk->r", rows[:, :4], self.free[at]) - self.resistance * rows[:, 4]
        return steps[:, :-1] - steps[:, 1:], without

    def worth(
        self,
        final: Float[np.ndarray, " 4"],
        instants: Float[np.ndarray, "r 2"],
        price: Float[np.ndarray, " r"],
    ) -> Float[np.ndarray, " n"]:
        """Return what a unit of effort in each step is worth at given prices.

        Parameters
        ----------
        final
            Prices of the final state.
        instants, price
            Step and time [s] within it, and price of v1 there.
        """
        W, D = np.zeros((self.steps, 4)), np.zeros(self.steps)
        at = instants[:, 0].astype(np.intp)
        whole = instants[:, 1] == 0.0
        W[:, 1] = np.bincount(at[whole], weights=price[whole], minlength=self.steps)
        for r in np.flatnonzero(~whole):
            g = short_response(*self._constants, float(instants[r, 1]))
            W[at[r]] += price[r] * g[:4]
            D[at[r]] += price[r] * g[4]
        return worth_of_steps(self._matrix, final, W, D)


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
    resistance, viscous_friction
        As of `ArmMotion` [N or N m, N s/m or N m s/rad].
    sampling_time
        [s].
    start
        State at the begin [m or rad, m/s or rad/s].
    effort
        Of each sample [N or N m].
    """
    matrix = _step_matrix(arm.mass_1, arm.mass_2, arm.stiffness, viscous_friction, sampling_time)
    return forced_states(matrix, start, effort - resistance)
