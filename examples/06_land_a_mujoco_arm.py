"""The landing controller, unchanged, on a flexible arm that another simulator moves: MuJoCo.

Run it: python examples/06_land_a_mujoco_arm.py  (needs the package mujoco)

Two masses on slide joints, a tendon with stiffness between them, and friction on the first. The
friction is set to hold truly, as example 05 explains; it breaks away at the Coulomb friction.
A series brakes mass 1 to a crawl of some µm/s at first, and keeps it there while mass 2 comes
along. MuJoCo's Runge-Kutta stages misjudge friction in the step in which a mass all but stops (it
crawls on with 0.25 mm/s at steps of 1 ms); short steps by Euler's method do not.

The controller knows masses and spring, and nothing of friction: it learns it on the way.
"""

from typing import Any, cast

import mujoco as _mujoco
import numpy as np

from stickslip import CoulombViscousFriction, EnergyEstimator, FlexibleArm, SensorSample
from stickslip.control import LandingController, LandingState
from stickslip.records import PositioningOutcome

mujoco = cast("Any", _mujoco)  # it has no type information

T = 0.02  # s, of the controller
STEP = 1e-4  # s, of MuJoCo
MASS_1, MASS_2, STIFFNESS = 1.0, 1.5, 2.0  # kg, kg, N/m
COULOMB, VISCOUS = 0.15, 0.1  # N, N s/m
EFFORT_LIMIT = 2.0  # N
POSITION_NOISE, VELOCITY_NOISE = 1e-5, 1e-4  # m, m/s: standard deviations of a sample
TOLERANCE = 3e-5  # m
TARGETS = (1.0, 0.3)  # m, one after the other
LONGEST = 200.0  # s that a landing may take

ARM = f"""
<mujoco>
  <option gravity="0 0 0" timestep="{STEP!r}" integrator="Euler"
          noslip_iterations="10" noslip_tolerance="0">
    <flag contact="disable" refsafe="disable"/>
  </option>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="{MASS_1!r}" diaginertia="1 1 1"/>
      <joint name="driven" type="slide" axis="1 0 0" damping="{VISCOUS!r}"
             frictionloss="{COULOMB!r}" solreffriction="{2 * STEP!r} 1"
             solimpfriction="0.9999 0.9999 0.001 0.5 2"/>
    </body>
    <body>
      <inertial pos="0 0 0" mass="{MASS_2!r}" diaginertia="1 1 1"/>
      <joint name="load" type="slide" axis="1 0 0"/>
    </body>
  </worldbody>
  <tendon>
    <fixed stiffness="{STIFFNESS!r}" springlength="0">
      <joint joint="load" coef="1"/>
      <joint joint="driven" coef="-1"/>
    </fixed>
  </tendon>
</mujoco>
"""


class MuJoCoArm:
    """Two masses with a spring between them, and sensors of both."""

    def __init__(self) -> None:
        self._model = mujoco.MjModel.from_xml_string(ARM)
        self._data = mujoco.MjData(self._model)

    @property
    def state(self) -> tuple[float, float, float, float]:
        """The true position and velocity of mass 1, and of mass 2 [m, m/s, m, m/s]."""
        (x1, x2), (v1, v2) = self._data.qpos, self._data.qvel
        return float(x1), float(v1), float(x2), float(v2)

    def place(self, position: float, load_position: float) -> None:
        """Put both masses somewhere, at rest [m]."""
        self._data.qpos[:], self._data.qvel[:] = (position, load_position), 0.0

    def measured(self, generator: np.random.Generator) -> SensorSample:
        """Return what the sensors show."""
        x1, v1, x2, v2 = self.state
        e1, f1, e2, f2 = generator.standard_normal(4)
        return SensorSample(
            float(self._data.time),
            x1 + POSITION_NOISE * e1,
            v1 + VELOCITY_NOISE * f1,
            x2 + POSITION_NOISE * e2,
            v2 + VELOCITY_NOISE * f2,
        )

    def push(self, effort: float, duration: float) -> None:
        """Hold an effort [N] on mass 1 for a time [s]."""
        self._data.qfrc_applied[0] = effort
        mujoco.mj_step(self._model, self._data, nstep=round(duration / STEP))


def controller(target: float) -> LandingController:
    """Return the controller, which knows masses and spring alone."""
    unknown = CoulombViscousFriction.symmetric(coulomb_friction=0.0, viscous_friction=0.0)
    return LandingController(
        sampling_time=T, target=target, tolerance=TOLERANCE,
        arm=FlexibleArm(mass_1=MASS_1, mass_2=MASS_2, stiffness=STIFFNESS, friction=unknown),
        effort_limit=EFFORT_LIMIT,
        estimator=EnergyEstimator(
            inertia=MASS_1, load_inertia=MASS_2, stiffness=STIFFNESS, offset=False
        ),
        position_noise=POSITION_NOISE, velocity_noise=VELOCITY_NOISE,
    )  # fmt: skip


def land(
    arm: MuJoCoArm, pilot: LandingController, state: LandingState, generator: np.random.Generator
) -> LandingState:
    """Let the controller work until it has ended; return its state."""
    for _ in range(round(LONGEST / T)):
        state, effort = pilot.step(state, arm.measured(generator))
        if pilot.outcome(state) is not PositioningOutcome.MOVING:
            break
        arm.push(effort, T)
    return state


def swing(arm: MuJoCoArm) -> float:
    """Return the amplitude of mass 2 about mass 1 [m]."""
    x1, _, x2, v2 = arm.state
    return float(np.hypot(x2 - x1, v2 * np.sqrt(MASS_2 / STIFFNESS)))


def main() -> None:
    """Land on one target after the other, and show what was learned."""
    arm, pilot, generator = MuJoCoArm(), controller(TARGETS[0]), np.random.default_rng(1)
    state = pilot.init()
    for target in TARGETS:
        fired, phases = len(state.flights), len(state.phases)
        state = land(arm, pilot, pilot.retargeted(state, target), generator)
        begin, end = state.phases[phases].start, state.phases[-1].start
        print(
            f"to {target:g} m: {pilot.outcome(state).value} after {end - begin:.1f} s and "
            f"{len(state.flights) - fired} series; mass 1 is {1e6 * (arm.state[0] - target):+.1f} "
            f"µm off, mass 2 swings by {1e6 * swing(arm):.1f} µm"
        )
    found = pilot.estimates(state)
    print(
        f"learned: Coulomb friction {found['coulomb_friction']:.4f} N (true {COULOMB:g}), "
        f"viscous friction {found['viscous_friction']:.4f} N s/m (true {VISCOUS:g})"
    )


if __name__ == "__main__":
    main()
