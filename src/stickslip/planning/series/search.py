"""Rounds of programmes in ever finer blocks, until the efforts are good enough or impossible."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int

from stickslip.numerics.linear_programme import Optimum
from stickslip.planning.series.programme import Aim, Programme

__all__ = ["Solution", "landed", "solve"]

_ROUNDS = 25
_MOST_BLOCKS = 450  # a programme with more takes long, and has not been seen to need them
_NEARLY = 1e5  # so much more work may be spent on what lacks but little
_SINGLE = 0.35  # of the pulses: with more blocks than this, rounds cost more than single pulses
_COVERED = 0.8  # of all that is to be gained: the blocks with the rest are left as they are
_MOST_TURNS = 2  # in a block; with more of them its pulses are all about as good
_NEAR = 6  # a block is cut at a turn, and this part of it before and after
_VIOLATED = 1e-8  # of the way and of the mean speed: a violation proven larger is one
_NO_VIOLATION = 1e-9  # likewise: one found smaller may be none at all
_AT_ONCE = 24  # instants that become constraints, besides the minima
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


def landed(programme: Programme, solution: Solution) -> Float[np.ndarray, " n"]:
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
        edges = programme.even_blocks()
        instants = programme.begins(edges[1:-1])
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
        rows, without, size = programme.velocity_rows(edges, instants)
        aim, optimum = _best(programme, aim, edges, rows, without, size)
        if optimum is None:
            break
        b = edges.size - 1
        z = optimum.x[:b] - optimum.x[b : 2 * b] if aim == "effort" else optimum.x[:b]
        z = np.repeat(z, np.diff(edges))
        tried = z * programme.effort_limit
        states = programme.states(tried)
        missing = 0.0 if aim == "effort" else float(optimum.x[-1]) * programme.mean_speed
        least, gains, wish = programme.bound(
            aim, instants, size, optimum, z, states[:, 1] + missing
        )
        if aim == "effort":
            bound = max(bound, least)
        elif least > _VIOLATED:
            refuted = True
            break
        minima = programme.motion.minima(np.repeat(tried, programme.steps_per_pulse), states)
        least_seen = programme.accepted_velocity
        low = minima[minima[:, 2] < least_seen, :2]
        if low.size:
            # Many at once: where optima are alike, each would evade single ones.
            begins = states[: programme.steps : programme.steps_per_pulse, 1]
            slower = np.flatnonzero(begins[1:] < least_seen) + 1
            low = np.vstack([low, programme.begins(slower[:: 1 + slower.size // _AT_ONCE])])
        if aim == "effort" and low.size == 0 and optimum.cost < cost:
            effort, cost = tried, optimum.cost
        good = aim == "effort" and optimum.cost - bound <= gap * optimum.cost
        divided = edges if good else _divided(edges, gains, wish)
        if aim == "violation" and _singly(programme, edges, divided, work - done):
            divided = np.arange(programme.pulses + 1)
        if (low.size == 0 and divided.size == edges.size) or divided.size > _MOST_BLOCKS + 1:
            break
        added = np.setdiff1d(divided, edges)
        velocity = states[:, 1]
        slow = velocity[added * programme.steps_per_pulse] < _SLOW * velocity.max()
        instants = np.vstack([instants, low, programme.begins(added[slow])])
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
    programme: Programme,
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
        optimum = programme.optimum(aim, edges, rows, without, size)
        if optimum is None or optimum.cost > _NO_VIOLATION:
            return aim, optimum
    optimum = programme.optimum("effort", edges, rows, without, size)
    if optimum is not None:
        return "effort", optimum
    # The blocks may be too coarse: go on from those that violate the constraints least.
    return "violation", programme.optimum("violation", edges, rows, without, size)


def _singly(
    programme: Programme, edges: Int[np.ndarray, " b"], finer: Int[np.ndarray, " f"], work: float
) -> bool:
    """Tell whether to go on with single pulses: blocks are many, and the work is affordable."""
    many = finer.size > edges.size and finer.size > _SINGLE * programme.pulses
    return many and programme.pulses <= _MOST_BLOCKS and programme.pulses**2 <= work


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
