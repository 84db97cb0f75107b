"""The shortest times against bang-bang optima, found from their switching times alone."""

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from pulse_series import ARM, REST
from refusals import refuses
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from stickslip.planning import NoPulseSeriesError, PulseSeriesPlanner
from stickslip.plants import FlexibleArm
from stickslip.records import StickslipError

# Of the shortest time at a fine rate over the optimum: mass 1 creeps instead of resting on the way,
# and switches at samples only.
FINE = 2e-3


def swing(time: float, state: np.ndarray, arm: FlexibleArm, effort: float | None) -> list[float]:
    """The arm's motion while mass 1 slips forward, or rests (no effort given)."""
    x1, v1, x2, v2 = state
    spring = arm.stiffness * (x1 - x2)
    load = spring / arm.mass_2
    if effort is None:
        return [0.0, 0.0, v2, load]
    law = arm.friction
    force = effort - law.coulomb_friction_positive - law.viscous_friction_positive * v1 - spring
    return [v1, force / arm.mass_1, v2, load]


def flown(arm: FlexibleArm, phases: list[tuple[float | None, float]]) -> list[np.ndarray]:
    """Return the state at the end of each phase of held effort."""
    state, states = np.zeros(4), []
    for effort, duration in phases:
        path = solve_ivp(
            swing, (0.0, abs(duration)), state, args=(arm, effort), rtol=1e-10, atol=1e-12
        )
        state = path.y[:, -1]
        states.append(state)
    return states


def bang_bang(arm: FlexibleArm, limit: float, target: float, guess: list[float]) -> np.ndarray:
    """Return how long to push, brake to rest, wait while mass 2 swings, push and brake.

    Five times for five conditions: mass 1 rests after the first braking, both masses at the end.
    """

    def missing(times: np.ndarray) -> list[float]:
        push, brake, wait, push_again, brake_again = times
        states = flown(
            arm,
            [
                (limit, push),
                (-limit, brake),
                (None, wait),
                (limit, push_again),
                (-limit, brake_again),
            ],
        )
        end = states[-1]
        return [states[1][1], end[0] - target, end[1], end[2] - target, end[3]]

    times, _, converged, why = fsolve(missing, guess, xtol=1e-9, full_output=True)
    assert converged == 1, why
    assert np.all(times > 0)
    return times


@pytest.mark.parametrize(
    ("arm", "limit", "target", "guess"),
    [
        (ARM, 1.0, 1.0, [0.9, 0.5, 1.8, 0.6, 0.7]),
        (replace(ARM, mass_2=1.5), 1.2, 1.0, [0.9, 0.4, 2.4, 0.6, 0.7]),
        (replace(ARM, stiffness=0.7), 1.0, 1.2, [0.9, 0.5, 2.2, 0.6, 0.7]),
    ],
)
def test_the_shortest_time_is_that_of_the_bang_bang_optimum(
    arm: FlexibleArm, limit: float, target: float, guess: list[float]
) -> None:
    optimum = float(bang_bang(arm, limit, target, guess).sum())
    planner = PulseSeriesPlanner(arm=arm, sampling_time=0.01, effort_limit=limit)
    fine = planner.plan(REST, target).duration
    assert optimum <= fine <= optimum * (1 + FINE) + planner.sampling_time
    coarse = replace(planner, sampling_time=0.05).plan(REST, target).duration
    assert fine <= coarse <= optimum + 2 * 0.05


@pytest.mark.parametrize(("target", "samples"), [(1.0, 1), (0.4, 1), (1.0, 4)])
def test_bisection_finds_what_a_scan_of_durations_finds(target: float, samples: int) -> None:
    """From the fewest that do on, every larger number of pulses does."""
    planner = PulseSeriesPlanner(
        arm=ARM, sampling_time=0.2, effort_limit=1.0, pulse_samples=samples
    )
    fewest = planner.plan(REST, target).amplitudes.size
    for pulses in range(max(4, fewest - 6), fewest + 12):
        found = contextlib.nullcontext() if pulses >= fewest else pytest.raises(NoPulseSeriesError)
        with found:
            planner.plan(REST, target, pulses=pulses)


def test_every_status_of_the_solver_is_looked_at(monkeypatch: pytest.MonkeyPatch) -> None:
    from scipy import optimize

    solve = optimize.linprog
    tried: list[str] = []

    def troubled(*args: object, **options: object) -> object:
        result = solve(*args, **options)  # type: ignore[arg-type]
        tried.append(str(options["method"]))
        result.status, result.message = 4, "numerical difficulties"
        return result

    monkeypatch.setattr(optimize, "linprog", troubled)
    planner = PulseSeriesPlanner(arm=ARM, sampling_time=1.5, effort_limit=1.0)
    with refuses("programme_unsolved", StickslipError) as refusal:
        planner.plan(REST, 1.0, pulses=4)
    assert "status 4, numerical difficulties" in str(refusal.value)
    assert tried == ["highs-ds", "highs-ds", "highs-ipm"]
