"""Other simulators, each set up as well as it allows.

All take a `ReferenceRun` of either plant (a single mass is an arm without a spring) and return the
states at all samples, shape (n+1, 2 or 4).
"""

from collections.abc import Callable
from typing import Any, Literal, cast

import mujoco as _mujoco
import numpy as np
from jaxtyping import Float
from scipy import integrate

from benchmarks.reference import ReferenceRun
from stickslip.compiled import compiled
from stickslip.plants import SingleMass

# No type information in the one; in the other, none for events which carry attributes.
mujoco = cast("Any", _mujoco)
solve_ivp = cast("Any", integrate.solve_ivp)

Method = Literal["RK45", "LSODA", "Radau"]
States = Float[np.ndarray, "n+1 s"]
Parts = tuple[float, float, float]
"""mass_1, mass_2, stiffness."""


def _parts(run: ReferenceRun) -> Parts:
    plant = run.plant
    if isinstance(plant, SingleMass):
        return plant.mass, 1.0, 0.0
    return plant.mass_1, plant.mass_2, plant.stiffness


def _start(run: ReferenceRun) -> Float[np.ndarray, "4"]:
    state = np.zeros(4)
    state[: len(run.initial_state)] = run.initial_state
    return state


def by_solve_ivp(
    run: ReferenceRun,
    *,
    method: Method,
    tolerance: float,
    scale: float = 1.0,
    each_sample: bool = False,
) -> States:
    """Integrate with SciPy's solve_ivp, which finds the stops and breakaways as events.

    The relative tolerance is given; the absolute one is larger by the magnitude of the states,
    ``scale``. With ``each_sample`` the integration starts anew at every sample, as a sampled
    controller needs it, and not only where the effort changes.
    """
    solver = _EventSolver(run, method, (tolerance, tolerance * scale))
    states = np.empty((run.effort.size + 1, 4))
    states[0] = _start(run)
    first = 0
    for effort, count in run.effort_runs:
        pieces = [1] * count if each_sample else [count]
        for piece in pieces:
            solver.propagate(effort, states[first : first + piece + 1])
            first += piece
    return states[:, : len(run.initial_state)]


class _EventSolver:
    """The mode (-1, 0, +1) of the first mass and one solve_ivp call from event to event."""

    def __init__(self, run: ReferenceRun, method: Method, tolerances: tuple[float, float]) -> None:
        self._masses = _parts(run)
        self._law = run.plant.friction
        self._time = run.sampling_time
        self._method = method
        self._tolerances = tolerances
        self._mode = int(np.sign(run.initial_state[1]))

    def propagate(self, effort: float, states: Float[np.ndarray, "k 4"]) -> None:
        """Fill in ``states[1:]`` from ``states[0]`` under one held effort."""
        times = self._time * np.arange(len(states))
        state, now, filled = states[0].copy(), 0.0, 1
        if self._mode == 0:
            self._mode = self._direction(effort, state)
        while filled < len(states):
            solution = solve_ivp(
                self._derivative(effort),
                (now, times[-1]),
                state,
                method=self._method,
                t_eval=times[filled:],
                events=self._events(effort),
                rtol=self._tolerances[0],
                atol=self._tolerances[1],
            )
            if solution.status < 0:
                raise ArithmeticError(solution.message)
            got = len(solution.t)
            if got:  # else y has no shape
                states[filled : filled + got] = solution.y.T
            filled += got
            if solution.status == 0:
                return
            which = next(i for i, t in enumerate(solution.t_events) if t.size)
            now, state = float(solution.t_events[which][0]), solution.y_events[which][0]
            if self._mode == 0:
                self._mode = (1, -1)[which]
            else:
                state[1] = 0.0
                self._mode = self._direction(effort, state)

    def _drive(self, effort: float, state: Float[np.ndarray, "4"]) -> float:
        return effort - self._law.offset - self._masses[2] * float(state[0] - state[2])

    def _direction(self, effort: float, state: Float[np.ndarray, "4"]) -> int:
        drive = self._drive(effort, state)
        if drive > self._law.static_friction_positive:
            return 1
        return -1 if drive < -self._law.static_friction_negative else 0

    def _derivative(self, effort: float) -> Callable[[float, Float[np.ndarray, "4"]], list[float]]:
        m1, m2, ks = self._masses
        s, law = self._mode, self._law
        fc = law.coulomb_friction_positive if s > 0 else law.coulomb_friction_negative
        c = law.viscous_friction_positive if s > 0 else law.viscous_friction_negative
        force = effort - law.offset - s * fc

        def slipping(_: float, state: Float[np.ndarray, "4"]) -> list[float]:
            x1, v1, x2, v2 = state.tolist()
            spring = ks * (x1 - x2)
            return [v1, (force - c * v1 - spring) / m1, v2, spring / m2]

        def sticking(_: float, state: Float[np.ndarray, "4"]) -> list[float]:
            x1, _v1, x2, v2 = state.tolist()
            return [0.0, 0.0, v2, ks * (x1 - x2) / m2]

        return slipping if s else sticking

    def _events(self, effort: float) -> list[Any]:
        def stop(_: float, state: Float[np.ndarray, "4"]) -> float:
            return float(state[1])

        def forward(_: float, state: Float[np.ndarray, "4"]) -> float:
            return self._drive(effort, state) - self._law.static_friction_positive

        def backward(_: float, state: Float[np.ndarray, "4"]) -> float:
            return -self._drive(effort, state) - self._law.static_friction_negative

        events: list[Any] = [stop] if self._mode else [forward, backward]
        for event in events:
            event.terminal = True
            event.direction = -self._mode if self._mode else 1
        return events


@compiled()
def _runge_kutta(
    parts: Parts, fc: float, c: float, T: float, substeps: int, u: Any, states: Any
) -> None:
    """Classical Runge-Kutta steps of T / substeps with friction fc sign(v1) + c v1."""
    m1, m2, ks = parts
    h = T / substeps
    x1, v1, x2, v2 = states[0]
    for k in range(u.size):
        for _ in range(substeps):
            dx1 = dv1 = dx2 = dv2 = 0.0
            a1 = b1 = a2 = b2 = 0.0  # slopes of the stage before
            for stage in range(4):
                part = h if stage == 3 else (0.0 if stage == 0 else 0.5 * h)
                p1, q1, p2, q2 = x1 + part * a1, v1 + part * b1, x2 + part * a2, v2 + part * b2
                spring = ks * (p1 - p2)
                a1, b1 = q1, (u[k] - fc * np.sign(q1) - c * q1 - spring) / m1
                a2, b2 = q2, spring / m2
                weight = h / 6 if stage in (0, 3) else h / 3
                dx1 += weight * a1
                dv1 += weight * b1
                dx2 += weight * a2
                dv2 += weight * b2
            x1, v1, x2, v2 = x1 + dx1, v1 + dv1, x2 + dx2, v2 + dv2
        states[k + 1, 0], states[k + 1, 1] = x1, v1
        states[k + 1, 2], states[k + 1, 3] = x2, v2


def by_runge_kutta(run: ReferenceRun, *, substeps: int) -> States:
    """Step with fixed steps, compiled; the sign function stands for friction (no sticking)."""
    law = run.plant.friction
    states = np.empty((run.effort.size + 1, 4))
    states[0] = _start(run)
    _runge_kutta(
        _parts(run),
        law.coulomb_friction_positive,
        law.viscous_friction_positive,
        run.sampling_time,
        substeps,
        run.effort,
        states,
    )
    return states[:, : len(run.initial_state)]


_MJCF = """
<mujoco>
  <option gravity="0 0 0" timestep="{step!r}" integrator="{integrator}">
    <flag contact="disable" refsafe="{refsafe}"/>
  </option>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="{m1!r}" diaginertia="1 1 1"/>
      <joint type="slide" axis="1 0 0" damping="{c!r}" frictionloss="{fc!r}" {stiff}/>
      <body>
        <inertial pos="0 0 0" mass="{m2!r}" diaginertia="1 1 1"/>
        <joint type="slide" axis="1 0 0" stiffness="{ks!r}"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def by_mujoco(
    run: ReferenceRun,
    *,
    substeps: int,
    integrator: Literal["Euler", "implicitfast", "RK4"],
    stiff: bool = True,
) -> States:
    """Simulate with MuJoCo; Coulomb friction is a joint's ``frictionloss``, the same both ways.

    With ``stiff`` the friction constraint is as stiff as its step allows (time constant of two
    steps, impedance 0.9999) and not as soft as it is by default, when a stuck mass creeps.
    """
    m1, m2, ks = _parts(run)
    law = run.plant.friction
    step = run.sampling_time / substeps
    solver = f'solreffriction="{2 * step!r} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
    model = mujoco.MjModel.from_xml_string(
        _MJCF.format(
            step=step,
            integrator=integrator,
            refsafe="disable" if stiff else "enable",
            stiff=solver if stiff else "",
            m1=m1,
            m2=m2,
            ks=ks,
            c=law.viscous_friction_positive,
            fc=law.coulomb_friction_positive,
        )
    )
    data = mujoco.MjData(model)
    x1, v1, x2, v2 = _start(run).tolist()
    data.qpos[:] = x1, x2 - x1
    data.qvel[:] = v1, v2 - v1
    states = np.empty((run.effort.size + 1, 4))
    states[0] = x1, v1, x2, v2
    force, position, velocity = data.qfrc_applied, data.qpos, data.qvel
    for k, effort in enumerate((run.effort - law.offset).tolist()):
        force[0] = effort
        mujoco.mj_step(model, data, nstep=substeps)
        states[k + 1, ::2] = position
        states[k + 1, 1::2] = velocity
    states[1:, 2:] += states[1:, :2]  # the second joint is relative to the first
    return states[:, : len(run.initial_state)]
