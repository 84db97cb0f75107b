"""Efforts that move the arm from rest to rest, by linear programmes over blocks of pulses.

While x1' > 0 the final state is linear in the efforts, and so is the velocity at every instant
(EQUATIONS, conjunction): x_N = A_d^N x_0 + sum A_d^(N-1-k) B_d (u_k - F). At full rate that is a
programme of hundreds of dense columns, nearly all at one of their bounds in the optimum. Pulses are
therefore first put together in few blocks of equal effort, whose programme is solved in a
millisecond or two. Its dual prices give the best effort of every single pulse, and so bound the
gain of the full programme (weak duality). Blocks whose pulses have different best efforts are
divided, and instants at which the velocity is too low, also between samples, become constraints.
When the bound leaves no gain, the plan is optimal at full rate.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float, Int
from numpy.typing import NDArray

from stickslip.compiled import compiled
from stickslip.numerics.linear_programme import Optimum, minimise
from stickslip.planning.arm_motion import ArmMotion
from stickslip.planning.tuning import TUNING

Values = Float[np.ndarray, " n"]
Objective = Literal["effort", "violation", "reach"]


VelocityRows = tuple[Float[np.ndarray, "m c"], Float[np.ndarray, " m"], Float[np.ndarray, " m"]]
"""Constraints rows @ z >= without, each scaled to about 1, and the sizes that they had."""


@compiled(inline=True)
def _hat(k: float, a: float, b: float, c: float) -> float:
    """Return the hat function from a over b to c, at k in between."""
    if k < b:
        return (k - a) / (b - a)
    return (c - k) / (c - b) if k > b else 1.0


@compiled()
def spread_over_rests(
    t: NDArray[np.float64], price: NDArray[np.float64], n: int, near: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Spread the prices of instants close to each other over the pulses between them.

    While mass 1 is to rest on the way, the velocity is bounded at every instant, and its price is a
    density. Blocks see it at single instants only; a hat function for each gives the density back.
    Instants ``t`` are ascending, in pulses; those no farther apart than ``near`` are of one rest.
    Returns the prices of the velocity at the begin of each of the n pulses, and what of each price
    has not been spread: at the ends of a rest a part of it is no density.
    """
    spread = np.zeros(n)
    left = price.copy()
    for r in range(t.size):
        b = t[r]
        before = t[r] - t[r - 1] if r > 0 else 0.0
        after = t[r + 1] - t[r] if r + 1 < t.size else 0.0
        inside_before, inside_after = 0.0 < before <= near, 0.0 < after <= near
        share = price[r]
        if not (inside_before or inside_after):
            continue
        if not inside_before:
            share = min(share, 0.5 * price[r + 1])
        elif not inside_after:
            share = min(share, 0.5 * price[r - 1])
        a = b - before if inside_before else b
        c = b + after if inside_after else b
        first, last = int(np.ceil(a)), min(int(np.floor(c)), n - 1)
        total = 0.0
        for k in range(first, last + 1):
            total += _hat(float(k), a, b, c)
        if total > 0.0:
            for k in range(first, last + 1):
                spread[k] += share * _hat(float(k), a, b, c) / total
            left[r] -= share
    return spread, left


@dataclass(frozen=True, kw_only=True)
class Programme:
    """The move of an arm by a number of pulses; forward, from the position 0 of its first mass."""

    motion: ArmMotion  # over all steps at least
    pulses: int  # at least 4
    steps_per_pulse: int
    target: float  # where both masses shall rest
    effort_limit: float  # [N or N m]; all efforts are scaled by it
    lowest: Values  # bounds of the effort of each pulse [N or N m]
    highest: Values
    least_velocity: float  # of the first mass between begin and end

    @property
    def steps(self) -> int:
        """Steps of the whole move."""
        return self.pulses * self.steps_per_pulse

    @property
    def mean_speed(self) -> float:
        """Travel over time [m/s or rad/s]."""
        return self.target / (self.steps * self.motion.step)

    @property
    def accepted_velocity(self) -> float:
        """Velocity accepted between the instants that are constrained [m/s or rad/s]."""
        return TUNING.accepted_share * self.least_velocity

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

    def even_blocks(self, count: int = TUNING.blocks) -> Int[np.ndarray, " b"]:
        """Return the edges of about as many blocks of about equal length.

        The first and the last pulse, whose bounds are others, are blocks of their own.
        """
        edges = np.linspace(0, self.pulses, min(count, self.pulses) + 1).astype(np.intp)
        return np.unique(np.concatenate([edges, [1, self.pulses - 1]]))

    def states(self, effort: Values) -> Float[np.ndarray, "k 4"]:
        """Return the states at every step under the efforts of the pulses."""
        return self.motion.states(np.repeat(effort, self.steps_per_pulse))

    def minima(self, effort: Values) -> Float[np.ndarray, "r 3"]:
        """Return the local minima of the first mass's velocity between begin and end."""
        return self.motion.minima(np.repeat(effort, self.steps_per_pulse), self.states(effort))

    def rough_reach(self) -> float:
        """Return about the largest travel, over that to the target; 0 if that is unclear."""
        edges = self.even_blocks(TUNING.rough_blocks)
        rows = self.velocity_rows(edges, self.begins(edges[1:-1]))
        optimum = self.optimum("reach", edges, rows)
        return 0.0 if optimum is None else -optimum.cost

    def begins(self, pulses: Int[np.ndarray, " k"]) -> Float[np.ndarray, "k 2"]:
        """Return the instants at which these pulses begin."""
        return np.column_stack([pulses * self.steps_per_pulse, np.zeros(pulses.size)])

    def velocity_rows(
        self, edges: Int[np.ndarray, " b"], instants: Float[np.ndarray, "r 2"]
    ) -> VelocityRows:
        """Return the constraints of the least velocity at these instants."""
        rows, without = self.motion.velocity_rows(instants, edges * self.steps_per_pulse)
        size = np.abs(rows).max(axis=1)
        bound = (self.least_velocity - without) / (size * self.effort_limit)
        return rows / size[:, None], bound, size

    def optimum(
        self,
        objective: Objective,
        edges: Int[np.ndarray, " b"],
        velocity: VelocityRows,
    ) -> Optimum | None:
        """Solve for the effort of each block, in shares of the limit.

        The objective is least effort (forward and backward parts of each effort), least violation
        (of the final state and of the least velocity, in shares of the travel and the mean speed),
        or the farthest reach (in times the travel).
        """
        rows, without, size = velocity
        _, sums = self.terminal
        columns = np.diff(sums[edges], axis=0).T
        begin = self._in_terminal_terms(self.motion.free[self.steps])
        end = self._in_terminal_terms(np.array([self.target, 0.0, self.target, 0.0]))
        low = np.maximum.reduceat(self.lowest, edges[:-1]) / self.effort_limit
        high = np.minimum.reduceat(self.highest, edges[:-1]) / self.effort_limit
        box = np.column_stack([low, high])
        if objective == "effort":
            share = np.diff(edges) / self.pulses
            return minimise(
                np.concatenate([share, share]),
                at_most=(np.hstack([-rows, rows]), -without),
                equal=(np.hstack([columns, -columns]), end - begin),
                bounds=np.vstack([np.maximum(box, 0.0), np.maximum(-box[:, ::-1], 0.0)]),
            )
        if objective == "violation":
            off = np.eye(4) * np.linalg.norm(end)
            slower = self.mean_speed / (size * self.effort_limit)
            return minimise(
                np.concatenate([np.zeros(low.size), np.ones(9)]),
                at_most=(
                    np.column_stack([-rows, np.zeros((without.size, 8)), -slower]),
                    -without,
                ),
                equal=(np.hstack([columns, off, -off, np.zeros((4, 1))]), end - begin),
                bounds=np.vstack([box, np.tile([0.0, np.inf], (9, 1))]),
            )
        return minimise(
            np.append(np.zeros(low.size), -1.0),
            at_most=(np.column_stack([-rows, np.zeros(without.size)]), -without),
            equal=(np.column_stack([columns, -end]), -begin),
            bounds=np.vstack([box, [0.0, TUNING.farthest_reach]]),
        )

    def bound(
        self,
        objective: Objective,
        instants: Float[np.ndarray, "r 2"],
        size: Float[np.ndarray, " r"],
        optimum: Optimum,
        z: Values,
        velocity: Float[np.ndarray, " k"],
    ) -> tuple[float, Values, Int[np.ndarray, " n"]]:
        """Return what the cost cannot be less than at full rate, and what each pulse could gain.

        Any prices bound the cost. Those spread over rests are the better ones while blocks are
        wide, and those of the programme itself in the end.
        """
        best = -np.inf
        gains, wish = np.zeros(z.size), np.zeros(z.size, dtype=np.intp)
        for near in (TUNING.rest_gap * max(1.0, self.pulses / TUNING.blocks), 0.0):
            price, slack = self._prices(instants, size, optimum, velocity, near)
            could, would = self._gains(objective, z, price)
            least = optimum.cost - float(could.sum()) - slack
            if least > best:
                best, gains, wish = least, could, would
        return best, gains, wish

    def _gains(
        self, objective: Objective, z: Values, price: Values
    ) -> tuple[Values, Int[np.ndarray, " n"]]:
        """Return for each pulse how much cost it could save at the prices found, and by what.

        What it would choose is the lowest effort (0), the one of least magnitude (1) or the highest
        (2): at given prices no other saves more.
        """
        weight = 1.0 / self.pulses if objective == "effort" else 0.0
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
    ) -> tuple[Values, float]:
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


class Solution(NamedTuple):
    """The result of rounds of programmes."""

    effort: Values | None  # of every pulse [N or N m]; None without a solution
    cost: float  # mean of |u| over the effort limit
    bound: float  # what the cost cannot be less than
    edges: Int[np.ndarray, " b"]  # blocks at the end, to continue from
    instants: Float[np.ndarray, "r 2"]  # velocity constraints at the end
    refuted: bool  # whether it is proven that there is no solution

    @property
    def gap(self) -> float:
        """How far the cost is from its bound at most, as a share of it."""
        return 1.0 - self.bound / self.cost if self.cost > 0.0 else 0.0


_NONE: tuple[Any, Any] = (np.zeros(0, dtype=np.intp), np.zeros((0, 2)))
REFUTED = Solution(None, math.inf, 0.0, *_NONE, refuted=True)
"""Proof that a series has no solution, by bounds without a programme."""


def landed(programme: Programme, solution: Solution) -> Values:
    """Return a solution's efforts with the rounding errors of the final state taken out."""
    effort = np.zeros(programme.pulses) if solution.effort is None else solution.effort
    R, sums = programme.terminal
    wanted = np.array([programme.target, 0.0, programme.target, 0.0])
    for _ in range(2):
        missing = wanted - programme.states(effort)[-1]
        effort = effort + np.diff(sums, axis=0) @ np.linalg.solve(R.T, missing)
    return effort


def solve(
    programme: Programme, *, gap: float, begin: Solution | None = None, work: float = math.inf
) -> Solution:
    """Find the efforts whose sum of magnitudes is least, or that there are none.

    Rounds of programmes in ever finer blocks, until the efforts are good enough or impossible. The
    cost may exceed its bound by the share ``gap``. It continues from the solution ``begin`` of a
    wider gap, and begins no other round after so much ``work``: entries of the constraints'
    matrices so far.
    """
    if begin is None:
        edges = programme.even_blocks()
        instants = programme.begins(edges[1:-1])
    else:
        edges, instants = begin.edges, begin.instants
    bound, cost, refuted = 0.0, np.inf, False
    effort: Values | None = None
    objective: Objective = "effort"
    optimum, done = None, 0
    for _ in range(TUNING.max_rounds):
        # Where only the velocity is too low at some instants, a solution is near.
        enough = min(3.0 * work, work + TUNING.extra_work) if objective == "effort" else work
        done += (edges.size - 1) * instants.shape[0]
        if done > enough and optimum is not None:
            break
        rows = programme.velocity_rows(edges, instants)
        objective, optimum = _best(programme, objective, edges, rows)
        if optimum is None:
            break
        b = edges.size - 1
        z = optimum.x[:b] - optimum.x[b : 2 * b] if objective == "effort" else optimum.x[:b]
        z = np.repeat(z, np.diff(edges))
        tried = z * programme.effort_limit
        states = programme.states(tried)
        missing = 0.0 if objective == "effort" else float(optimum.x[-1]) * programme.mean_speed
        least, gains, wish = programme.bound(
            objective, instants, rows[2], optimum, z, states[:, 1] + missing
        )
        if objective == "effort":
            bound = max(bound, least)
        elif least > TUNING.violation:
            refuted = True
            break
        minima = programme.motion.minima(np.repeat(tried, programme.steps_per_pulse), states)
        least_seen = programme.accepted_velocity
        low = minima[minima[:, 2] < least_seen, :2]
        if low.size:
            # Many at once: where optima are alike, each would evade single ones.
            begins = states[: programme.steps : programme.steps_per_pulse, 1]
            slower = np.flatnonzero(begins[1:] < least_seen) + 1
            some = slower[:: 1 + slower.size // TUNING.instants_at_once]
            low = np.vstack([low, programme.begins(some)])
        if objective == "effort" and low.size == 0 and optimum.cost < cost:
            effort, cost = tried, optimum.cost
        good = objective == "effort" and optimum.cost - bound <= gap * optimum.cost
        divided = edges if good else _divided(edges, gains, wish)
        if objective == "violation" and _singly(programme, edges, divided, work - done):
            divided = np.arange(programme.pulses + 1)
        if (low.size == 0 and divided.size == edges.size) or divided.size > TUNING.max_blocks + 1:
            break
        added = np.setdiff1d(divided, edges)
        velocity = states[:, 1]
        slow = velocity[added * programme.steps_per_pulse] < TUNING.slow_share * velocity.max()
        instants = np.vstack([instants, low, programme.begins(added[slow])])
        edges = divided
    return Solution(effort, cost, bound, edges, instants, refuted and effort is None)


def _best(
    programme: Programme, objective: Objective, edges: Int[np.ndarray, " b"], rows: VelocityRows
) -> tuple[Objective, Optimum | None]:
    """Return the least effort if there is a solution in these blocks, else the least violation.

    The objective of the round before is the likelier one, and tried first.
    """
    if objective == "violation":
        optimum = programme.optimum(objective, edges, rows)
        if optimum is None or optimum.cost > TUNING.rounding:
            return objective, optimum
    optimum = programme.optimum("effort", edges, rows)
    if optimum is not None:
        return "effort", optimum
    # The blocks may be too coarse: continue from those that violate the constraints least.
    return "violation", programme.optimum("violation", edges, rows)


def _singly(
    programme: Programme, edges: Int[np.ndarray, " b"], finer: Int[np.ndarray, " f"], work: float
) -> bool:
    """Return whether single pulses come next: blocks are many, and the work is affordable."""
    many = finer.size > edges.size and finer.size > TUNING.single_share * programme.pulses
    return many and programme.pulses <= TUNING.max_blocks and programme.pulses**2 <= work


def _divided(
    edges: Int[np.ndarray, " b"], gains: Values, wish: Int[np.ndarray, " n"]
) -> Int[np.ndarray, " finer"]:
    """Return finer blocks: those with most to gain are cut where their pulses disagree."""
    by_block = np.add.reduceat(gains, edges[:-1])
    order = np.argsort(-by_block)
    most = TUNING.divided_share * by_block.sum()
    enough = int(np.searchsorted(np.cumsum(by_block[order]), most)) + 1
    new = [edges]
    for k in order[:enough]:
        begin, end = int(edges[k]), int(edges[k + 1])
        turns = begin + 1 + np.flatnonzero(np.diff(wish[begin:end]))
        if 1 <= turns.size <= TUNING.max_turns:
            # The turn moves a little once there are other prices.
            near = max(1, (end - begin) // TUNING.cut_part)
            cuts = np.concatenate([turns - near, turns, turns + near])
            new.append(cuts[(cuts > begin) & (cuts < end)])
        elif end - begin > 1:
            new.append(np.array([(begin + end) // 2]))
    return np.unique(np.concatenate(new))
