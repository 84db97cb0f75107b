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

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from jaxtyping import Float, Int

from stickslip.planning.arm_motion import ArmMotion
from stickslip.planning.linear_programme import Optimum, minimise
from stickslip.planning.price_kernels import spread_over_rests

__all__ = ["Programme", "Solution"]

Aim = Literal["effort", "violation", "reach"]

_BLOCKS = 48
_ROUNDS = 25
_MOST_BLOCKS = 450  # a programme with more takes long, and has not been seen to need them
_NEARLY = 1e5  # so much more work may be spent on what lacks but little
_SINGLE = 0.35  # of the pulses: with more blocks than this, rounds cost more than single pulses
_COVERED = 0.8  # of all that is to be gained: the blocks with the rest are left as they are
_MOST_TURNS = 2  # in a block; with more of them its pulses are all about as good
_NEIGHBOURS = 2.0  # first blocks: instants within a rest are no farther apart than so many
_NEAR = 6  # a block is cut at a turn, and this part of it before and after
_VIOLATED = 1e-8  # of the way and of the mean speed: a violation proven larger is one
_NO_VIOLATION = 1e-9  # likewise: one found smaller may be none at all
_FARTHEST = 100.0  # times the way: no farther is looked
_AT_ONCE = 24  # instants that become constraints, besides the minima
_TOO_LOW = 0.1  # of the least velocity, which is asked for at single instants only
_SLOW = 0.05  # of the highest velocity: where new blocks begin so slowly, it is looked after


@dataclass(frozen=True, kw_only=True)
class Solution:
    """What a programme came to.

    Attributes
    ----------
    effort
        Of every pulse [N or N m]; None if there is no solution.
    cost, bound
        Mean of ``|u|`` over the effort limit, and what it cannot be less than [-].
    edges, instants
        Blocks and velocity constraints at the end, to go on from.
    refuted
        Whether it is proven that there is no solution.
    """

    effort: Float[np.ndarray, " n"] | None
    cost: float
    bound: float
    edges: Int[np.ndarray, " b"]
    instants: Float[np.ndarray, "r 2"]
    refuted: bool

    @property
    def gap(self) -> float:
        """How far the cost is from its bound at most, as a share of it."""
        return 1.0 - self.bound / self.cost if self.cost > 0.0 else 0.0


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
    def _mean_speed(self) -> float:
        return self.target / (self.steps * self.motion.step)

    @cached_property
    def _terminal(self) -> tuple[Float[np.ndarray, "4 4"], Float[np.ndarray, "m 4"]]:
        """R and the running sums of Q, where Q R are the effects of the pulses at the end.

        The rows of Q' are orthogonal, however alike the four effects are.
        """
        at = np.arange(self.steps, -1, -self.steps_per_pulse)
        effects = self.motion.forced[at]
        Q, R = np.linalg.qr(effects[:-1] - effects[1:])
        return R, np.vstack([np.zeros(4), np.cumsum(Q, axis=0)])

    def _in_terminal_terms(self, state: Float[np.ndarray, " 4"]) -> Float[np.ndarray, " 4"]:
        return np.linalg.solve(self._terminal[0].T, state) / self.effort_limit

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

    def landed(self, solution: Solution) -> Float[np.ndarray, " n"]:
        """Return a solution's efforts with the rounding errors of the final state taken out."""
        effort = np.zeros(self.pulses) if solution.effort is None else solution.effort
        R, sums = self._terminal
        wanted = np.array([self.target, 0.0, self.target, 0.0])
        for _ in range(2):
            missing = wanted - self.states(effort)[-1]
            effort = effort + np.diff(sums, axis=0) @ np.linalg.solve(R.T, missing)
        return effort

    def solve(
        self, *, gap: float, begin: Solution | None = None, work: float = math.inf
    ) -> Solution:
        """Find the efforts whose sum of magnitudes is least, or that there are none.

        Parameters
        ----------
        gap
            How far from its bound the cost may remain, as a share of it [-].
        begin
            A solution with a wider gap, to go on from.
        work
            After which no other round is begun: entries of the constraints' matrices so far.
        """
        if begin is None:
            edges = self.even_blocks()
            instants = self.begins(edges[1:-1])
        else:
            edges, instants = begin.edges, begin.instants
        bound, cost, refuted = 0.0, np.inf, False
        effort: Float[np.ndarray, " n"] | None = None
        aim: Aim = "effort"
        optimum, done = None, 0
        for _ in range(_ROUNDS):
            # Where only the velocity is too low at some instants, a solution is near.
            enough = min(3.0 * work, work + _NEARLY) if aim == "effort" else work
            done += (edges.size - 1) * instants.shape[0]
            if done > enough and optimum is not None:
                break
            rows, without, size = self._velocity_rows(edges, instants)
            aim, optimum = self._best(aim, edges, rows, without, size)
            if optimum is None:
                break
            b = edges.size - 1
            z = optimum.x[:b] - optimum.x[b : 2 * b] if aim == "effort" else optimum.x[:b]
            z = np.repeat(z, np.diff(edges))
            tried = z * self.effort_limit
            states = self.states(tried)
            missing = 0.0 if aim == "effort" else float(optimum.x[-1]) * self._mean_speed
            least, gains, wish = self._bound(
                aim, instants, size, optimum, z, states[:, 1] + missing
            )
            if aim == "effort":
                bound = max(bound, least)
            elif least > _VIOLATED:
                refuted = True
                break
            minima = self.motion.minima(np.repeat(tried, self.steps_per_pulse), states)
            least_seen = _TOO_LOW * self.least_velocity
            low = minima[minima[:, 2] < least_seen, :2]
            if low.size:
                # Many at once: where optima are alike, each would evade single ones.
                begins = states[: self.steps : self.steps_per_pulse, 1]
                slower = np.flatnonzero(begins[1:] < least_seen) + 1
                low = np.vstack([low, self.begins(slower[:: 1 + slower.size // _AT_ONCE])])
            if aim == "effort" and low.size == 0 and optimum.cost < cost:
                effort, cost = tried, optimum.cost
            good = aim == "effort" and optimum.cost - bound <= gap * optimum.cost
            divided = edges if good else _divided(edges, gains, wish)
            if aim == "violation" and self._singly(edges, divided, work - done):
                divided = np.arange(self.pulses + 1)
            if (low.size == 0 and divided.size == edges.size) or divided.size > _MOST_BLOCKS + 1:
                break
            added = np.setdiff1d(divided, edges)
            velocity = states[:, 1]
            slow = velocity[added * self.steps_per_pulse] < _SLOW * velocity.max()
            instants = np.vstack([instants, low, self.begins(added[slow])])
            edges = divided
        return Solution(
            effort=effort,
            cost=cost,
            bound=bound,
            edges=edges,
            instants=instants,
            refuted=refuted and effort is None,
        )

    def _best(
        self,
        aim: Aim,
        edges: Int[np.ndarray, " b"],
        rows: Float[np.ndarray, "m c"],
        without: Float[np.ndarray, " m"],
        size: Float[np.ndarray, " m"],
    ) -> tuple[Aim, Optimum | None]:
        """Return the least effort if there is a solution in these blocks, else the least violation.

        The aim of the round before is the likelier one, and tried first.
        """
        if aim == "violation":
            optimum = self._solve(aim, edges, rows, without, size)
            if optimum is None or optimum.cost > _NO_VIOLATION:
                return aim, optimum
        optimum = self._solve("effort", edges, rows, without, size)
        if optimum is not None:
            return "effort", optimum
        # The blocks may be too coarse: go on from those that violate the constraints least.
        return "violation", self._solve("violation", edges, rows, without, size)

    def _singly(
        self, edges: Int[np.ndarray, " b"], finer: Int[np.ndarray, " f"], work: float
    ) -> bool:
        """Tell whether to go on with single pulses: blocks are many, and the work is affordable."""
        many = finer.size > edges.size and finer.size > _SINGLE * self.pulses
        return many and self.pulses <= _MOST_BLOCKS and self.pulses**2 <= work

    def rough_reach(self) -> float:
        """Return how many times the way to the target can about be gone; 0 if that is unclear."""
        edges = self.even_blocks()
        rows, without, size = self._velocity_rows(edges, self.begins(edges[1:-1]))
        optimum = self._solve("reach", edges, rows, without, size)
        return 0.0 if optimum is None else -optimum.cost

    def begins(self, pulses: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 2"]:
        """Return the instants at which these pulses begin."""
        return np.column_stack([pulses * self.steps_per_pulse, np.zeros(pulses.size)])

    def _velocity_rows(
        self, edges: Int[np.ndarray, " b"], instants: Float[np.ndarray, "r 2"]
    ) -> tuple[Float[np.ndarray, "m c"], Float[np.ndarray, " m"], Float[np.ndarray, " m"]]:
        """Return the least velocity's constraints, rows @ z >= without, each scaled to about 1.

        The last are the sizes that they had.
        """
        rows, without = self.motion.velocity_rows(instants, edges * self.steps_per_pulse)
        size = np.abs(rows).max(axis=1)
        bound = (self.least_velocity - without) / (size * self.effort_limit)
        return rows / size[:, None], bound, size

    def _solve(
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
        _, sums = self._terminal
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
            slower = self._mean_speed / (size * self.effort_limit)
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

    def _bound(
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
        R, _ = self._terminal
        active = np.flatnonzero(optimum.at_most_price < 0.0)
        worth = -optimum.at_most_price[active] / size[active]
        at = instants[active, 0] + instants[active, 1] / self.motion.step
        order = np.argsort(at)
        active, worth, at = active[order], worth[order], at[order] / self.steps_per_pulse
        spread, left = spread_over_rests(at, worth, self.pulses, near)
        begins = velocity[: self.steps : self.steps_per_pulse]
        # The bound is to hold for what is accepted, too, which may be slower at some instants.
        accepted = (1.0 - _TOO_LOW) * self.least_velocity * float(worth.sum())
        slack = float(spread @ (begins - self.least_velocity)) + accepted
        single = left > 0.0
        by_step = self.motion.worth(
            np.linalg.solve(R, optimum.equal_price),
            np.vstack([self.begins(np.arange(self.pulses)), instants[active[single]]]),
            np.concatenate([spread, left[single]]),
        )
        price = np.add.reduceat(by_step, np.arange(0, self.steps, self.steps_per_pulse))
        return price, slack / self.effort_limit


def _divided(
    edges: Int[np.ndarray, " b"], gains: Float[np.ndarray, " n"], wish: Int[np.ndarray, " n"]
) -> Int[np.ndarray, " finer"]:
    """Return finer blocks: those with most to gain are cut where their pulses disagree."""
    by_block = np.add.reduceat(gains, edges[:-1])
    order = np.argsort(-by_block)
    enough = int(np.searchsorted(np.cumsum(by_block[order]), _COVERED * by_block.sum())) + 1
    new = [edges]
    for k in order[:enough]:
        begin, end = int(edges[k]), int(edges[k + 1])
        turns = begin + 1 + np.flatnonzero(np.diff(wish[begin:end]))
        if 1 <= turns.size <= _MOST_TURNS:
            # The turn moves a little once there are other prices.
            near = max(1, (end - begin) // _NEAR)
            cuts = np.concatenate([turns - near, turns, turns + near])
            new.append(cuts[(cuts > begin) & (cuts < end)])
        elif end - begin > 1:
            new.append(np.array([(begin + end) // 2]))
    return np.unique(np.concatenate(new))
