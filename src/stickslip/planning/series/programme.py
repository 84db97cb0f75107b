"""Which efforts take the arm from rest to rest, as linear programmes over blocks of pulses.

While x1' > 0 the final state is linear in the efforts, and so is the velocity at every instant
(EQUATIONS, conjunction): x_N = A_d^N x_0 + sum A_d^(N-1-k) B_d (u_k - F). At full rate that is a
programme of hundreds of dense columns, nearly all at one of their bounds in the optimum. So pulses
are first put together in few blocks of equal effort, whose programme is solved in a millisecond or
two. Its prices tell for every single pulse what it would rather do, and so bound what the full
programme can gain (weak duality); blocks whose pulses disagree are divided there, and instants
where the velocity is found to be too low, also between samples, become constraints. When the bound
leaves nothing to gain, the plan is optimal at full rate.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from stickslip.numerics.linear_programme import Optimum, minimise
from stickslip.planning.series.arm_motion import ArmMotion
from stickslip.planning.series.price_kernels import spread_over_rests

__all__ = ["Aim", "Programme"]

Aim = Literal["effort", "violation", "reach"]

_BLOCKS, _ROUGH_BLOCKS = 64, 40
_NEIGHBOURS = 2.0  # first blocks: instants within a rest are no farther apart than so many
_FARTHEST = 100.0  # times the way: no farther is looked
_TOO_LOW = 0.1  # of the least velocity, which is asked for at single instants only


@dataclass(frozen=True, kw_only=True)
class Programme:
    """The move of an arm by a number of pulses; forward, from the position 0 of its first mass.

    Attributes
    ----------
    motion
        Of the arm, over all steps at least.
    pulses
        How many, at least 4.
    steps_per_pulse
        Of the motion.
    target
        Where both masses shall rest [m or rad].
    effort_limit
        [N or N m]; what all efforts are scaled by.
    lowest, highest
        Bounds of the effort of each pulse [N or N m].
    least_velocity
        Of the first mass between begin and end [m/s or rad/s].
    """

    motion: ArmMotion
    pulses: int
    steps_per_pulse: int
    target: float
    effort_limit: float
    lowest: Float[np.ndarray, " n"]
    highest: Float[np.ndarray, " n"]
    least_velocity: float

    @property
    def steps(self) -> int:
        """Steps of the whole move."""
        return self.pulses * self.steps_per_pulse

    @property
    def mean_speed(self) -> float:
        """Way over time [m/s or rad/s]."""
        return self.target / (self.steps * self.motion.step)

    @property
    def accepted_velocity(self) -> float:
        """What is not too low between the instants at which the least velocity is asked for."""
        return _TOO_LOW * self.least_velocity

    @cached_property
    def terminal(self) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "m 4"]]:
        """R and the running sums of Q, where Q R are the effects of the pulses at the end.

        The rows of Q' are orthogonal, however alike the four effects are.
        """
        at = np.arange(self.steps, -1, -self.steps_per_pulse)
        effects = self.motion.forced[at]
        Q, R = np.linalg.qr(effects[:-1] - effects[1:])
        return R, np.vstack([np.zeros(4), np.cumsum(Q, axis=0)])

    def _in_terminal_terms(self, state: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 4"]:
        return np.linalg.solve(self.terminal[0].T, state) / self.effort_limit

    def even_blocks(self, count: int = _BLOCKS) -> Int[np.ndarray, " b"]:
        """Return the edges of about as many blocks of about equal length.

        The first and the last pulse, whose bounds are others, are blocks of their own.
        """
        edges = np.linspace(0, self.pulses, min(count, self.pulses) + 1).astype(np.intp)
        return np.unique(np.concatenate([edges, [1, self.pulses - 1]]))

    def states(self, effort: Float[np.ndarray, " n"]) -> Float[np.ndarray, "k 4"]:
        """Return the states at every step under the efforts of the pulses."""
        return self.motion.states(np.repeat(effort, self.steps_per_pulse))

    def minima(self, effort: Float[np.ndarray, " n"]) -> Float[np.ndarray, "r 3"]:
        """Return the local minima of the first mass's velocity between begin and end."""
        return self.motion.minima(np.repeat(effort, self.steps_per_pulse), self.states(effort))

    def rough_reach(self) -> float:
        """Return how many times the way to the target can about be gone; 0 if that is unclear."""
        edges = self.even_blocks(_ROUGH_BLOCKS)
        rows, without, size = self.velocity_rows(edges, self.begins(edges[1:-1]))
        optimum = self.optimum("reach", edges, rows, without, size)
        return 0.0 if optimum is None else -optimum.cost

    def begins(self, pulses: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 2"]:
        """Return the instants at which these pulses begin."""
        return np.column_stack([pulses * self.steps_per_pulse, np.zeros(pulses.size)])

    def velocity_rows(
        self, edges: Int[np.ndarray, " b"], instants: Float[np.ndarray, "r 2"]
    ) -> tuple[Float[np.ndarray, "m c"], Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return the least velocity's constraints, rows @ z >= without, each scaled to about 1.

        The last are the sizes that they had.
        """
        rows, without = self.motion.velocity_rows(instants, edges * self.steps_per_pulse)
        size = np.abs(rows).max(axis=1)
        bound = (self.least_velocity - without) / (size * self.effort_limit)
        return rows / size[:, None], bound, size

    def optimum(
        self,
        aim: Aim,
        edges: Int[np.ndarray, " b"],
        rows: Float[np.ndarray, "m c"],
        without: Float[np.ndarray, " m"],
        size: Float[np.ndarray, " m"],
    ) -> Optimum | None:
        """Solve for the effort of each block, in shares of the limit.

        The aim is least effort (forward and backward parts of each effort), least violation (of
        the final state and of the least velocity, in shares of the way and the mean speed), or the
        farthest reach (in times the way).
        """
        _, sums = self.terminal
        columns = np.diff(sums[edges], axis=0).T
        begin = self._in_terminal_terms(self.motion.free[self.steps])
        way = self._in_terminal_terms(np.array([self.target, 0.0, self.target, 0.0]))
        low, high = self.block_bounds(edges)
        box = np.column_stack([low, high])
        if aim == "effort":
            share = np.diff(edges) / self.pulses
            return minimise(
                np.concatenate([share, share]),
                at_most=(np.hstack([-rows, rows]), -without),
                equal=(np.hstack([columns, -columns]), way - begin),
                bounds=np.vstack([np.maximum(box, 0.0), np.maximum(-box[:, ::-1], 0.0)]),
            )
        if aim == "violation":
            off = np.eye(4) * np.linalg.norm(way)
            slower = self.mean_speed / (size * self.effort_limit)
            return minimise(
                np.concatenate([np.zeros(low.size), np.ones(9)]),
                at_most=(
                    np.column_stack([-rows, np.zeros((without.size, 8)), -slower]),
                    -without,
                ),
                equal=(np.hstack([columns, off, -off, np.zeros((4, 1))]), way - begin),
                bounds=np.vstack([box, np.tile([0.0, np.inf], (9, 1))]),
            )
        return minimise(
            np.append(np.zeros(low.size), -1.0),
            at_most=(np.column_stack([-rows, np.zeros(without.size)]), -without),
            equal=(np.column_stack([columns, -way]), -begin),
            bounds=np.vstack([box, [0.0, _FARTHEST]]),
        )

    def block_bounds(
        self, edges: Int[np.ndarray, " b"]
    ) -> tuple[Float[np.ndarray, " c"], Float[np.ndarray, " c"]]:
        """Return the lowest and the highest effort of each block, as shares of the limit."""
        low = np.maximum.reduceat(self.lowest, edges[:-1]) / self.effort_limit
        high = np.minimum.reduceat(self.highest, edges[:-1]) / self.effort_limit
        return low, high

    def bound(
        self,
        aim: Aim,
        instants: Float[np.ndarray, "r 2"],
        size: Float[np.ndarray, " r"],
        optimum: Optimum,
        z: Float[np.ndarray, " n"],
        velocity: Float[np.ndarray, " k"],
    ) -> tuple[float, Float[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return what the cost cannot be less than at full rate, and what each pulse could gain.

        Any prices bound the cost. Those spread over rests are the better ones while blocks are
        wide, and those of the programme itself in the end.
        """
        best = -np.inf
        gains, wish = np.zeros(z.size), np.zeros(z.size, dtype=np.intp)
        for near in (_NEIGHBOURS * max(1.0, self.pulses / _BLOCKS), 0.0):
            price, slack = self._prices(instants, size, optimum, velocity, near)
            could, would = self._gains(aim, z, price)
            least = optimum.cost - float(could.sum()) - slack
            if least > best:
                best, gains, wish = least, could, would
        return best, gains, wish

    def _gains(
        self,
        aim: Aim,
        z: Float[np.ndarray, " n"],
        price: Float[np.ndarray, " n"],
    ) -> tuple[Float[np.ndarray, " n"], Int[np.ndarray, " n"]]:
        """Return for each pulse how much cost it could save at the prices found, and by what.

        What it would choose is the lowest effort (0), the one of least magnitude (1) or the highest
        (2): at given prices no other saves more.
        """
        weight = 1.0 / self.pulses if aim == "effort" else 0.0
        low, high = self.lowest / self.effort_limit, self.highest / self.effort_limit
        choices = np.stack([low, np.clip(0.0, low, high), high])
        costs = weight * np.abs(choices) - price * choices
        gains = np.maximum(weight * np.abs(z) - price * z - costs.min(axis=0), 0.0)
        return gains, costs.argmin(axis=0)

    def _prices(
        self,
        instants: Float[np.ndarray, "r 2"],
        size: Float[np.ndarray, " r"],
        optimum: Optimum,
        velocity: Float[np.ndarray, " k"],
        near: float,
    ) -> tuple[Float[np.ndarray, " n"], float]:
        """Return what effort is worth in each pulse, and by how much these prices bound less."""
        R, _ = self.terminal
        active = np.flatnonzero(optimum.at_most_price < 0.0)
        worth = -optimum.at_most_price[active] / size[active]
        at = instants[active, 0] + instants[active, 1] / self.motion.step
        order = np.argsort(at)
        active, worth, at = active[order], worth[order], at[order] / self.steps_per_pulse
        spread, left = spread_over_rests(at, worth, self.pulses, near)
        begins = velocity[: self.steps : self.steps_per_pulse]
        # The bound is to hold for what is accepted, too, which may be slower at some instants.
        accepted = (self.least_velocity - self.accepted_velocity) * float(worth.sum())
        slack = float(spread @ (begins - self.least_velocity)) + accepted
        single = left > 0.0
        by_step = self.motion.worth(
            np.linalg.solve(R, optimum.equal_price),
            np.vstack([self.begins(np.arange(self.pulses)), instants[active[single]]]),
            np.concatenate([spread, left[single]]),
        )
        price = np.add.reduceat(by_step, np.arange(0, self.steps, self.steps_per_pulse))
        return price, slack / self.effort_limit
