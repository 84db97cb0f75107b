"""Make the figure of exports: ``python -m studies.documentation.exports``."""

import matplotlib.pyplot as plt
import mujoco
import numpy as np

from stickslip.export import render
from stickslip.friction import CoulombViscousFriction
from stickslip.plants import SingleMass
from stickslip.simulation import simulate
from studies.documentation.style import BLUE, GREY, ORANGE, no_arguments, save, style

INERTIA, COULOMB, VISCOUS = 0.05, 0.5, 0.2
LAW = CoulombViscousFriction.symmetric(coulomb_friction=COULOMB, viscous_friction=VISCOUS)
ESTIMATE = {
    "schema": 1,
    "kind": "rotary",
    "status": "ok",
    "parameters": {
        "inertia": {"value": INERTIA, "unit": "kg m^2"},
        "coulomb_friction": {"value": COULOMB, "unit": "N m"},
        "viscous_friction": {"value": VISCOUS, "unit": "N m s/rad"},
    },
}
MODEL = f"""
<mujoco>
  <option gravity="0 0 0"/>
  <worldbody>
    <body>
      <joint name="elbow" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>
    </body>
  </worldbody>
</mujoco>
"""


def models(inertia: float = INERTIA) -> dict[str, mujoco.MjModel]:
    """Return the exported model, and the same without the settings of the constraint."""
    into = MODEL.replace(f"{INERTIA} {INERTIA} {INERTIA}", f"{inertia} {inertia} {inertia}")
    (content,) = render(ESTIMATE, "mjcf", into=into, joint="elbow").rendered.files.values()
    exported = content.decode() if isinstance(content, bytes) else content
    start = exported.index(" solreffriction")
    default = exported[:start] + exported[exported.index("/>", start) :]
    return {
        "exported": mujoco.MjModel.from_xml_string(exported),
        "MuJoCo's defaults": mujoco.MjModel.from_xml_string(default),
    }


def run(model: mujoco.MjModel, duration: float, *, start: float, load: float) -> np.ndarray:
    """Return time, position and velocity, shape (3, n)."""
    data = mujoco.MjData(model)
    data.qvel[0], data.qfrc_applied[0] = start, load
    states = [(0.0, 0.0, start)]
    while data.time < duration:
        mujoco.mj_step(model, data)
        states.append((data.time, data.qpos[0], data.qvel[0]))
    return np.array(states).T


def main() -> None:
    """Draw a joint that coasts, and one that is held at 0.3 and 0.9 of its friction."""
    style()
    figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.3), layout="constrained")
    step = 0.002
    motion = simulate(
        SingleMass(mass=INERTIA, friction=LAW, kind="rotary"),
        np.zeros(300),
        sampling_time=step,
        initial_state=(0.0, 6.0),
    )
    left.plot(step * np.arange(301), motion.velocity, color=GREY, lw=4, alpha=0.5, label="exact")
    for (name, model), color in zip(models().items(), (BLUE, ORANGE), strict=True):
        time, _, velocity = run(model, 0.6, start=6.0, load=0.0)
        left.plot(time, velocity, color=color, lw=1.2, label=name)
        for share, line in ((0.3, "--"), (0.9, "-")):
            time, position, _ = run(model, 10.0, start=0.0, load=share * COULOMB)
            right.semilogy(
                time[1:],
                np.maximum(np.abs(position[1:]), 1e-12),
                line,
                color=color,
                label=f"{name}, {share:g} of the friction",
            )
    left.set(title="Coasting", xlabel="time [s]", ylabel="velocity [rad/s]")
    left.legend()
    right.set(title="Drift at rest", xlabel="time [s]", ylabel="position [rad]", ylim=(1e-9, 1))
    right.legend(fontsize=7, loc="lower right")
    save(figure, "export-mujoco.png")
    for inertia in (INERTIA, 0.1 * INERTIA):
        for name, model in models(inertia).items():
            for share in (0.3, 0.9):
                _, position, _ = run(model, 10.0, start=0.0, load=share * COULOMB)
                print(
                    f"friction over inertia {COULOMB / inertia:g} rad/s^2, {share:g} of the "
                    f"friction, {name}: {abs(position[-1]):.2g} rad in 10 s"
                )


if __name__ == "__main__":
    no_arguments(__doc__)
    main()
