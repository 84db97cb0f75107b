"""The pulse controllers, unchanged, on an axis that another simulator moves: MuJoCo.

Run it: python examples/05_pulses_on_a_mujoco_axis.py  (needs the package mujoco)

MuJoCo knows friction as a joint's frictionloss, the same in both directions and with no static
friction above it, so that an axis breaks away at its Coulomb friction. As it comes, this friction
yields: pushed with 95 of 100 N a mass of 150 kg creeps 40 mm a minute, and a controller that waits
for rest waits in vain, or learns from creep. Stiff settings slow that down to 4 µm a minute; the
noslip solver ends it.
"""

from dataclasses import replace
from typing import Any, cast

import mujoco as _mujoco
import numpy as np

from stickslip import CoulombViscousFriction, SensorSample
from stickslip.control import (
    ExactPulseController,
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
    RestDetection,
)

mujoco = cast("Any", _mujoco)  # it has no type information

T = 0.01  # s, of the controllers
STEP = 0.001  # s, of MuJoCo
MASS, COULOMB, VISCOUS = 150.0, 100.0, 700.0  # kg, N, N s/m
ENCODER, NOISE = 1e-6, 1e-6  # m: its step, and the standard deviation before it is rounded
START, TOLERANCE = -0.01, 2e-5  # m; the target is at 0

AXIS = """
<mujoco>
  <option gravity="0 0 0" timestep="{step!r}" integrator="RK4" {noslip}>
    <flag contact="disable" refsafe="disable"/>
  </option>
  <worldbody>
    <body>
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="1 1 1"/>
      <joint type="slide" axis="1 0 0" damping="{viscous!r}" frictionloss="{coulomb!r}" {stiff}/>
    </body>
  </worldbody>
</mujoco>
"""
# The friction constraint: a time constant of two steps, and the impedance as high as it may be
STIFF = f'solreffriction="{2 * STEP!r} 1" solimpfriction="0.9999 0.9999 0.001 0.5 2"'
NOSLIP = 'noslip_iterations="10" noslip_tolerance="0"'


class MuJoCoAxis:
    """A mass on a slide joint with friction, and an encoder."""

    def __init__(self, *, stiff: str = STIFF, noslip: str = NOSLIP) -> None:
        text = AXIS.format(
            step=STEP, mass=MASS, viscous=VISCOUS, coulomb=COULOMB, stiff=stiff, noslip=noslip
        )
        self._model = mujoco.MjModel.from_xml_string(text)
        self._data = mujoco.MjData(self._model)

    @property
    def position(self) -> float:
        """The true one [m]."""
        return float(self._data.qpos[0])

    def place(self, position: float) -> None:
        """Put the mass there, at rest [m]."""
        self._data.qpos[0], self._data.qvel[0] = position, 0.0

    def measured(self, generator: np.random.Generator) -> SensorSample:
        """Return what the encoder shows; there is no velocity sensor."""
        noisy = self.position + NOISE * generator.standard_normal()
        return SensorSample(
            time=float(self._data.time), measured_position=ENCODER * round(noisy / ENCODER)
        )

    def push(self, effort: float, duration: float) -> None:
        """Hold an effort [N] for a time [s]."""
        self._data.qfrc_applied[0] = effort
        mujoco.mj_step(self._model, self._data, nstep=round(duration / STEP))


def creep(axis: MuJoCoAxis) -> float:
    """Return how far the mass moves in a minute under 95 % of its friction [m]."""
    start = axis.position
    axis.push(0.95 * COULOMB, 60.0)
    return abs(axis.position - start)


def controllers() -> dict[str, PulseController]:
    """Return the controllers, which believe 80 % of the Coulomb friction."""
    rest = RestDetection.for_encoder(resolution=ENCODER, noise=NOISE, samples=5)
    guess = CoulombViscousFriction.symmetric(
        coulomb_friction=0.8 * COULOMB, viscous_friction=0.8 * VISCOUS
    )
    papwc, pwc = (
        replace(
            method.from_friction(
                mass=MASS, coulomb_friction=0.8 * COULOMB, pulse_effort=300.0, sampling_time=T,
                target=0.0, tolerance=TOLERANCE, rest=rest,
            ),
            longest_width=0.03,
        )
        for method in (PulseAmplitudeWidthController, PulseWidthController)
    )  # fmt: skip
    exact = ExactPulseController(
        mass=MASS, friction=guess, effort_limit=300.0, sampling_time=T, target=0.0,
        tolerance=TOLERANCE, rest=rest, position_noise=float(np.hypot(NOISE, ENCODER / 12**0.5)),
    )  # fmt: skip
    return {"PWC": pwc, "PAPWC": papwc, "exact": exact}


def run(axis: MuJoCoAxis, controller: PulseController, seed: int) -> Any:
    """Let a controller move the axis for 5 s; return its state."""
    generator = np.random.default_rng(seed)
    state = controller.init()
    for _ in range(round(5.0 / T)):
        state, effort = controller.step(state, axis.measured(generator))
        axis.push(effort, T)
    return state


def main() -> None:
    """Show how far the axis creeps, and what the controllers do with it."""
    for name, axis in (
        ("as it comes", MuJoCoAxis(stiff="", noslip="")),
        ("stiff", MuJoCoAxis(noslip="")),
        ("stiff, noslip", MuJoCoAxis()),
    ):
        print(f"friction {name}: creeps {1e6 * creep(axis):.3g} µm a minute")
    for name, controller in controllers().items():
        axis = MuJoCoAxis()
        axis.place(START)
        state = run(axis, controller, seed=1)
        print(
            f"{name}: {controller.outcome(state).value} after {controller.pulse_count(state)} "
            f"pulses, {1e6 * abs(axis.position):.1f} µm off the target"
        )
        found = controller.estimates(state)
        if "coulomb_friction_positive" in found:
            print(f"  Coulomb friction {found['coulomb_friction_positive']:.2f} N")


if __name__ == "__main__":
    main()
