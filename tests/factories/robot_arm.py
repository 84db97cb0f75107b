"""An arm of seven joints with gravity and coupling, as a URDF file and as logs of its motion."""

import mujoco
import numpy as np

JOINTS = tuple(f"joint_{k}" for k in range(1, 8))
AXES = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
LENGTHS = (0.16, 0.20, 0.20, 0.20, 0.18, 0.12, 0.08)  # m
MASSES = (4.0, 4.0, 3.0, 2.7, 1.7, 1.8, 0.5)  # kg
INERTIAS = (0.03, 0.03, 0.02, 0.02, 0.01, 0.005, 0.002)  # kg m^2
SIDEWAYS = (0.0, 0.03, 0.02, -0.03, 0.02, 0.01, 0.02)  # m, of the centres of mass
ROTORS = (0.6, 0.6, 0.4, 0.4, 0.2, 0.15, 0.1)  # kg m^2, behind the gears
COULOMB = (4.0, 5.0, 3.0, 3.0, 1.2, 1.0, 0.6)  # N m
VISCOUS = (6.0, 5.0, 4.0, 3.0, 1.5, 1.2, 0.8)  # N m s/rad
STEP, SAMPLE = 2e-4, 2e-3  # s


def urdf(masses: float = 1.0) -> str:
    """Return the arm with its friction, all masses and inertias multiplied by a factor."""
    text = '<robot name="arm"><link name="base"/>'
    below, place = "base", "0 0 0"
    for k, name in enumerate(JOINTS):
        mass, inertia = masses * MASSES[k], masses * INERTIAS[k]
        text += f"""
  <joint name="{name}" type="revolute"><parent link="{below}"/><child link="link_{k}"/>
    <origin xyz="{place}" rpy="0 0 0"/><axis xyz="{AXES[k]}"/>
    <limit lower="-6" upper="6" effort="300" velocity="9"/>
    <dynamics damping="{VISCOUS[k]}" friction="{COULOMB[k]}"/></joint>
  <link name="link_{k}">
    <visual><geometry><mesh filename="package://arm/meshes/{k}.stl"/></geometry></visual>
    <inertial><origin xyz="{SIDEWAYS[k]} 0.01 {LENGTHS[k] / 2}"/><mass value="{mass}"/>
      <inertia ixx="{inertia}" iyy="{inertia}" izz="{inertia / 2}" ixy="0" ixz="0" iyz="0"/>
    </inertial></link>"""
        below, place = f"link_{k}", f"0 0 {LENGTHS[k]}"
    return text + "</robot>"


def record(duration: float = 20.0, seed: int = 3) -> dict[str, np.ndarray]:
    """Return time, and position and held effort of each joint, all of which move at once."""
    generator = np.random.default_rng(seed)
    text = urdf()
    start, end = text.index("<visual>"), text.index("</visual>")
    while start >= 0:  # there are no meshes
        text = text[:start] + text[end + len("</visual>") :]
        start, end = text.find("<visual>"), text.find("</visual>")
    arm = mujoco.MjModel.from_xml_string(text)
    arm.opt.timestep = STEP
    arm.dof_armature[:] = ROTORS
    # Rigid friction: MuJoCo's usual one creeps at speeds that it is to resist
    arm.dof_solimp[:, :2] = 0.9999
    arm.dof_solref[:, 0] = 2.0 * STEP
    data = mujoco.MjData(arm)
    n, every = round(duration / SAMPLE), round(SAMPLE / STEP)
    time = np.arange(n) * SAMPLE
    rates = 2 * np.pi * np.array([0.17, 0.43, 1.1])[:, None] * generator.uniform(0.8, 1.2, (3, 7))
    phases = generator.uniform(0, 2 * np.pi, (3, 7))
    sizes = np.array([0.7, 0.25, 0.06])[:, None]
    middle = np.array([0.0, 0.4, 0.2, 1.0, 0.3, 0.5, 0.0])
    stiffness, damping = np.array(ROTORS) * 3000.0, np.array(ROTORS) * 60.0

    def target(t: float) -> tuple[np.ndarray, np.ndarray]:
        angle = rates * t + phases
        return middle + (sizes * np.sin(angle)).sum(0), (sizes * rates * np.cos(angle)).sum(0)

    data.qpos[:] = target(0.0)[0]
    q, u = np.empty((n, 7)), np.empty((n, 7))
    for k in range(n):
        wanted, speed = target(time[k])
        q[k] = data.qpos
        u[k] = stiffness * (wanted - data.qpos) + damping * (speed - data.qvel)
        data.qfrc_applied[:] = u[k]
        mujoco.mj_step(arm, data, every)
    columns = {"__time": 1.7e9 + time}
    for k, name in enumerate(JOINTS):
        columns[f"/joint_states/{name}/position"] = q[:, k] + generator.normal(scale=2e-5, size=n)
        noise = generator.normal(scale=0.02 * COULOMB[k], size=n)
        columns[f"/joint_states/{name}/effort"] = u[:, k] + noise
    return columns
