"""A log of seven joints simulated in MuJoCo, whose friction and inertia are known."""

from pathlib import Path

import mujoco
import numpy as np

JOINTS = ("base", "shoulder", "arm", "elbow", "forearm", "wrist", "flange")
INERTIA = (0.9, 0.7, 0.5, 0.35, 0.12, 0.08, 0.04)  # kg m^2
COULOMB = (3.0, 2.6, 2.0, 1.6, 0.7, 0.5, 0.3)  # N m
VISCOUS = (4.0, 3.5, 2.5, 2.0, 0.8, 0.6, 0.3)  # N m s/rad
STEP, SAMPLE = 1e-4, 2e-3  # s


def model() -> mujoco.MjModel:
    """Return joints about vertical axes, each with a body of its own: no gravity, no coupling."""
    bodies = "".join(
        f"""
        <body pos="{k} 0 0"><joint name="{name}" axis="0 0 1" type="hinge" damping="{c}"/>
          <inertial pos="0 0 0" mass="1" diaginertia="{j} {j} {j}"/></body>"""
        for k, (name, j, c) in enumerate(zip(JOINTS, INERTIA, VISCOUS, strict=True))
    )
    motors = "".join(f'<motor joint="{name}"/>' for name in JOINTS)
    return mujoco.MjModel.from_xml_string(
        f"""<mujoco><option timestep="{STEP}" integrator="Euler" gravity="0 0 0"/>
        <worldbody>{bodies}</worldbody><actuator>{motors}</actuator></mujoco>"""
    )


def record(duration: float = 12.0, seed: int = 1) -> dict[str, np.ndarray]:
    """Return time, and position and held effort of each joint, with the noise of real sensors.

    Coulomb friction is applied as a torque that holds a joint at rest until the effort exceeds it.
    """
    generator = np.random.default_rng(seed)
    arm = model()
    data = mujoco.MjData(arm)
    inertia, coulomb = np.array(INERTIA), np.array(COULOMB)
    n, every = round(duration / SAMPLE), round(SAMPLE / STEP)
    time = np.arange(n) * SAMPLE
    phases = generator.uniform(0, 2 * np.pi, (3, 7))
    rates = 2 * np.pi * np.array([0.31, 0.73, 1.7])[:, None] * generator.uniform(0.8, 1.2, (3, 7))
    sizes = np.array([0.8, 0.3, 0.08])[:, None]
    q, u = np.empty((n, 7)), np.empty((n, 7))
    offset = np.sum(sizes * np.sin(phases), axis=0)
    stiffness, damping = 150.0 * inertia, 20.0 * inertia
    for k in range(n):
        target = np.sum(sizes * np.sin(rates * time[k] + phases), axis=0) - offset
        speed = np.sum(sizes * rates * np.cos(rates * time[k] + phases), axis=0)
        q[k] = data.qpos
        u[k] = stiffness * (target - data.qpos) + damping * (speed - data.qvel)
        for _ in range(every):
            # The torque of dry friction that would stop the joint in this step, at most f_c
            stop = u[k] - np.array(VISCOUS) * data.qvel + inertia * data.qvel / STEP
            data.ctrl[:] = u[k] - np.clip(stop, -coulomb, coulomb)
            mujoco.mj_step(arm, data)
    columns = {"__time": 1.7e9 + time}
    for k, name in enumerate(JOINTS):
        noise = generator.normal(scale=2e-5, size=n)
        columns[f"/joint_states/{name}/position"] = q[:, k] + noise
        columns[f"/joint_states/{name}/effort"] = u[:, k] + generator.normal(
            scale=0.01 * COULOMB[k], size=n
        )
    return columns


def write_csv(path: Path, columns: dict[str, np.ndarray]) -> Path:
    """Write columns as PlotJuggler exports them."""
    rows = np.column_stack(list(columns.values()))
    path.write_text(
        "\n".join([",".join(columns), *(",".join(f"{v:.10g}" if k else f"{v:.9f}"
                   for k, v in enumerate(row)) for row in rows.tolist()), ""])
    )  # fmt: skip
    return path
