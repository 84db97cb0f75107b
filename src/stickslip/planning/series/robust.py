"""Efforts for a friction that is only known to lie in an interval."""

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float

from stickslip.numerics.linear_programme import minimise
from stickslip.planning.series.programme import Programme
from stickslip.records import StickslipError

__all__ = ["least_worst_residual"]

_BLOCKS = 96
_ROUNDS = 12
_EFFORT_WEIGHT = 1e-6  # of the effort beside the residual: only between equally good efforts
_CONVERGED = 1e-6  # of the swing


def least_worst_residual(
    believed: Programme, extremes: Sequence[Programme]
) -> tuple[Float[np.ndarray, " n"], float]:
    """Return the efforts whose worst final residual over the extremes is least, and that residual.

    What is least is the sum of two residuals, each the largest over the extremes: the distance of
    mass 1 to the target, and the swing that is left, which is the spring's length and the speeds
    over the frequency of mass 2 on its spring. Both are convex in the resistance, and close to it
    in viscous friction, so that the extremes of an interval are the worst. With the believed
    friction mass 1 moves forward all the way; with each extreme it does up to the swing's speed.

    Returns
    -------
    effort
        Of each pulse.
    residual
        The larger of distance and swing [m or rad].
    """
    arm = believed.motion.arm
    frequency = math.sqrt(arm.stiffness / arm.mass_2)
    seen = (
        np.array(
            [
                [1.0, 0.0, 0.0, 0.0],
                [-1.0, 0.0, 1.0, 0.0],
                [0.0, 1.0 / frequency, 0.0, 0.0],
                [0.0, 0.0, 0.0, 1.0 / frequency],
            ]
        )
        / believed.target
    )
    slacks = np.array([[1.0, 0.0], [0.0, 1.0], [0.0, 1.0], [0.0, 1.0]])
    edges = believed.even_blocks(_BLOCKS)
    b, share = edges.size - 1, np.diff(edges) / believed.pulses
    low, high = believed.block_bounds(edges)
    bounds = np.vstack(
        [
            np.column_stack([np.maximum(low, 0.0), np.maximum(high, 0.0)]),
            np.column_stack([np.maximum(-high, 0.0), np.maximum(-low, 0.0)]),
            [[0.0, np.inf], [0.0, np.inf]],
        ]
    )
    cost = np.concatenate([_EFFORT_WEIGHT * share, _EFFORT_WEIGHT * share, [1.0, 1.0]])
    wanted = np.array([believed.target, 0.0, believed.target, 0.0])
    rows: list[Float[np.ndarray, "r c"]] = []
    right: list[Float[np.ndarray, " r"]] = []

    def demand(
        of: Float[np.ndarray, "r b"],
        slack: Float[np.ndarray, "r 2"],
        at_least: Float[np.ndarray, " r"],
    ) -> None:
        """Add of @ z + slack @ (distance, swing) >= at_least."""
        size = np.maximum(np.abs(of).max(axis=1), slack.max(axis=1))
        rows.append(np.hstack([-of, of, -slack]) / size[:, None])
        right.append(-at_least / size)

    for programme in extremes:
        at = programme.steps - edges * programme.steps_per_pulse
        effects = (programme.motion.forced[at[:-1]] - programme.motion.forced[at[1:]]).T
        effects = seen @ effects * believed.effort_limit
        missing = seen @ (wanted - programme.motion.free[programme.steps])
        demand(effects, slacks, missing)
        demand(-effects, slacks, -missing)
    everyone = [(believed, 0.0), *((programme, 1.0) for programme in extremes)]
    speed = believed.target * frequency
    looked_at = [believed.begins(edges[1:-1])] * len(everyone)
    for _ in range(_ROUNDS):
        for (programme, slack), instants in zip(everyone, looked_at, strict=True):
            if instants.size:
                of, without = programme.motion.velocity_rows(
                    instants, edges * programme.steps_per_pulse
                )
                demand(
                    of * (believed.effort_limit / speed),
                    np.tile([0.0, slack], (instants.shape[0], 1)),
                    (believed.least_velocity - without) / speed,
                )
        optimum = minimise(
            cost,
            at_most=(np.vstack(rows), np.concatenate(right)),
            equal=(np.empty((0, 2 * b + 2)), np.empty(0)),
            bounds=bounds,
        )
        if optimum is None:
            break
        distance, swing = float(optimum.x[-2]), float(optimum.x[-1])
        z = np.repeat(optimum.x[:b] - optimum.x[b : 2 * b], np.diff(edges))
        effort = z * believed.effort_limit
        looked_at = []
        for programme, slack in everyone:
            minima = programme.minima(effort)
            least = 0.1 * believed.least_velocity - slack * swing * speed * (1.0 + _CONVERGED)
            looked_at.append(minima[minima[:, 2] < least, :2])
        if not any(instants.size for instants in looked_at):
            return effort, max(distance, swing) * believed.target
    raise StickslipError(
        "the efforts for the friction interval keep mass 1 from moving one way only; give a "
        "narrower interval or more pulses"
    )
