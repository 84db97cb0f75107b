"""Planning a pulse series of a flexible arm: blocks of pulses against the full linear programme."""

from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import numpy as np
from rich.progress import Progress
from scipy import optimize as _optimize
from scipy import sparse as _sparse
from scipy.linalg import expm

from benchmarks.measuring import Comparison, Rows, Target
from stickslip.friction import CoulombViscousFriction
from stickslip.planning import PulseSeriesPlanner
from stickslip.plants import FlexibleArm

_RESISTANCE, _VISCOUS, _DURATION = 0.1, 0.1, 5.0
_REST = (0.0, 0.0, 0.0, 0.0)
_SLOWEST = 1e-3  # of the mean speed, as the planner's
_EXCESS, _WIDE = 0.1, 0.3
"""Of the shortest time and the least impulse, for a plan that need only be there soon."""
_LIMITS = {300: 10.0, 1000: 50.0}
"""A plan of so many samples is to take this time at most [ms]."""

optimize = cast("Any", _optimize)
sparse = cast("Any", _sparse)


@dataclass(frozen=True, kw_only=True)
class _FullProgramme:
    """The same move at full rate, every sample with its variables and its constraint."""

    samples: int

    def _step(self) -> tuple[np.ndarray, np.ndarray]:
        T = _DURATION / self.samples
        M = np.zeros((5, 5))
        M[0, 1] = M[2, 3] = T
        M[1] = np.array([-1.0, -_VISCOUS, 1.0, 0.0, 1.0]) * T
        M[3] = np.array([1.0, 0.0, -1.0, 0.0, 0.0]) * T
        E = expm(M)
        return E[:4, :4], E[:4, 4]

    def sparse(self, method: str) -> float:
        """States and efforts as variables, and one block of equations a sample."""
        n = self.samples
        A, B = self._step()
        eye = sparse.identity(n, format="csr")
        late = sparse.eye(n, k=-1, format="csr")
        states = sparse.kron(eye, np.eye(4)) - sparse.kron(late, A)
        effort = sparse.kron(eye, B[:, None])
        final = sparse.hstack(
            [sparse.csr_matrix((4, 4 * (n - 1))), sparse.identity(4), sparse.csr_matrix((4, 2 * n))]
        )
        equal = sparse.vstack([sparse.hstack([states, -effort, effort]), final], format="csr")
        right = np.concatenate([np.tile(-B * _RESISTANCE, n), [1.0, 0.0, 1.0, 0.0]])
        low, high = np.full(6 * n, -np.inf), np.full(6 * n, np.inf)
        low[1 : 4 * (n - 1) : 4] = _SLOWEST / _DURATION
        low[4 * n :], high[4 * n :] = 0.0, 1.0
        cost = np.concatenate([np.zeros(4 * n), np.full(2 * n, 1.0 / n)])
        return self._solved(
            cost, A_eq=equal, b_eq=right, bounds=np.column_stack([low, high]), method=method
        )

    def condensed(self, method: str) -> float:
        """Efforts as the only variables, and dense constraints."""
        n = self.samples
        A, B = self._step()
        effects = np.empty((n, 4))
        state = B
        for k in range(n):
            effects[k] = state
            state = A @ state
        final = effects[::-1].T
        at, of = np.indices((n - 1, n))
        rows = np.where(of <= at, effects[np.maximum(at - of, 0), 1], 0.0)
        least = _SLOWEST / _DURATION + _RESISTANCE * rows.sum(axis=1)
        return self._solved(
            np.full(2 * n, 1.0 / n),
            A_ub=np.hstack([-rows, rows]),
            b_ub=-least,
            A_eq=np.hstack([final, -final]),
            b_eq=np.array([1.0, 0.0, 1.0, 0.0]) + _RESISTANCE * final.sum(axis=1),
            bounds=(0.0, 1.0),
            method=method,
        )

    def _solved(self, cost: np.ndarray, **programme: Any) -> float:
        # With presolve HiGHS gives up on some of these ("Not Set"), and is slower on the others.
        result = optimize.linprog(cost, options={"presolve": False}, **programme)
        if result.status != 0:
            raise RuntimeError(result.message)
        return float(result.fun) * _DURATION


def compare(progress: Progress) -> list[Comparison]:
    """Plan the same move with this package and by the full programme in HiGHS."""
    law = CoulombViscousFriction.symmetric(coulomb_friction=_RESISTANCE, viscous_friction=_VISCOUS)
    arm = FlexibleArm(mass_1=1.0, mass_2=1.0, stiffness=1.0, friction=law)
    comparisons: list[Comparison] = []
    for samples, limit in _LIMITS.items():
        full = _FullProgramme(samples=samples)
        planner = PulseSeriesPlanner(arm=arm, sampling_time=_DURATION / samples, effort_limit=1.0)
        best = full.sparse("highs-ipm")
        rows = Rows(progress, f"{samples} samples", 7)

        def excess(impulse: float, best: float = best) -> float:
            return impulse / best - 1.0

        def ours(planner: PulseSeriesPlanner = planner, samples: int = samples) -> float:
            return planner.plan(_REST, 1.0, pulses=samples).impulse

        def shortest(planner: PulseSeriesPlanner = planner) -> float:
            return planner.plan(_REST, 1.0).duration

        plan = rows.add("stickslip", ours, 1, error=excess, repetitions=20, ours=True)
        for method in ("highs-ds", "highs-ipm"):
            for form, solve in (("sparse", full.sparse), ("condensed", full.condensed)):
                rows.add(
                    f"all samples, {form}, {method}",
                    partial(solve, method),
                    1,
                    error=excess,
                    repetitions=1,
                )
        hasty = replace(planner, excess=_EXCESS, impulse_gap=_WIDE)
        rows.add("stickslip, the shortest time too", shortest, 1, repetitions=5, ours=True)
        rows.add(
            f"stickslip, at most {_EXCESS:.0%} above the shortest time",
            partial(shortest, hasty),
            1,
            repetitions=5,
            ours=True,
        )
        comparisons.append(
            Comparison(
                title=(
                    f"A move of 1 m in {_DURATION:g} s by {samples} samples "
                    "(two masses of 1 kg, 1 N/m, 0.1 N, 0.1 N s/m, at most 1 N)"
                ),
                item="plan",
                error_name="impulse above the least",
                rows=tuple(rows.rows),
                targets=(
                    Target(
                        text=f"milliseconds a plan of {samples} samples",
                        measured=plan.nanoseconds * 1e-6,
                        limit=limit,
                    ),
                ),
            )
        )
    return comparisons
