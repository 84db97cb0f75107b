"""Least squares over all joints of an arm, against the inverse dynamics of MuJoCo."""

from xml.etree import ElementTree

import numpy as np
import pytest
import robot_arm

from studies.arm_regression import Chain, arm_friction

mujoco = pytest.importorskip("mujoco", reason="the reference is MuJoCo")


@pytest.fixture
def arm(tmp_path):
    """Return an arm whose frames are turned, with a transmission that names its joints again."""
    path = tmp_path / "arm.urdf"
    text = robot_arm.urdf()
    for k in range(7):
        text = text.replace('rpy="0 0 0"', f'rpy="{0.3 * k} {0.5 - 0.2 * k} {0.7}"', 1)
    names = "".join(f'<joint name="{name}"/>' for name in robot_arm.JOINTS)
    path.write_text(text.replace("</robot>", f"<transmission>{names}</transmission></robot>"))
    return path


def _parameters(urdf):
    """Return mass, mass times centre and inertia about its joint of each link that moves."""
    links = ElementTree.parse(urdf).iter("link")  # noqa: S314 - written by this test
    for link in list(links)[1:]:
        own = link.find("inertial")
        mass = float(own.find("mass").get("value"))
        centre = np.array(own.find("origin").get("xyz").split(), float)
        xx, xy, xz, yy, yz, zz = (
            float(own.find("inertia").get(f"i{name}"))
            for name in ("xx", "xy", "xz", "yy", "yz", "zz")
        )
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        about += mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        yield [mass, *(mass * centre), *about[np.triu_indices(3)]]


def _effort(urdf, position, velocity, acceleration):
    """Return the inverse dynamics of MuJoCo."""
    root = ElementTree.parse(urdf).getroot()  # noqa: S314 - written by this test
    for joint in root.findall("joint"):
        joint.remove(joint.find("dynamics"))
    for link in root.iter("link"):
        for visual in link.findall("visual"):
            link.remove(visual)
    bodies = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, "unicode"))
    data = mujoco.MjData(bodies)
    found = []
    for each in zip(position, velocity, acceleration, strict=True):
        data.qpos, data.qvel, data.qacc = each
        mujoco.mj_inverse(bodies, data)
        found.append(data.qfrc_inverse.copy())
    return np.array(found)


def test_regressor(arm):
    motion = np.random.default_rng(1).normal(size=(3, 20, 7))
    chain = Chain.of(arm, robot_arm.JOINTS)
    found = chain.regressor(*motion) @ np.concatenate(list(_parameters(arm)))
    np.testing.assert_allclose(found, _effort(arm, *motion), rtol=1e-6, atol=1e-6)


def test_friction_without_slow_samples(arm):
    """Friction that is halved near reversals makes the line over all speeds too steep."""
    time = np.arange(6000) * 0.01
    generator = np.random.default_rng(2)
    rates = 2 * np.pi * generator.uniform(0.05, 0.4, (4, 7))
    phases = generator.uniform(0, 2 * np.pi, (4, 7))
    angle = rates[:, None] * time[:, None] + phases[:, None]
    position = 0.4 * np.sin(angle).sum(0)
    velocity = 0.4 * (rates[:, None] * np.cos(angle)).sum(0)
    acceleration = -0.4 * (rates[:, None] ** 2 * np.sin(angle)).sum(0)
    speed = np.abs(velocity) / np.abs(velocity).max(axis=0)
    part = np.where(speed < 0.03, 0.5, 1.0)
    friction = part * np.array(robot_arm.COULOMB) * np.sign(velocity) + robot_arm.VISCOUS * velocity
    effort = _effort(arm, position, velocity, acceleration) + friction
    chain = Chain.of(arm, robot_arm.JOINTS)
    every, slips = (
        arm_friction(chain, time, position, velocity, effort, slowest=each) for each in (0.0, 0.05)
    )
    np.testing.assert_allclose(slips.coulomb, robot_arm.COULOMB, rtol=0.02)
    np.testing.assert_allclose(slips.viscous, robot_arm.VISCOUS, rtol=0.02)
    assert np.all(every.coulomb < slips.coulomb)
    assert np.all(every.viscous > slips.viscous)
