"""Rigid bodies of a robot from a URDF file, and their inverse dynamics."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float

from stickslip.errors import RequiredExtra
from stickslip.input_files import bytes_of
from stickslip.records import AxisKind, InputError

_KINDS: Mapping[str, AxisKind] = {
    "revolute": "rotary",
    "continuous": "rotary",
    "prismatic": "linear",
}
_FIXED = "fixed"
_NO_MASS = 1e-9  # kg and kg m^2 of a link without mass, as MuJoCo needs a positive one
_LEAST_MASS = 1e-6  # kg moved by a joint; less is a file without masses
_POSTURES = 200  # largest number for the mean inertia


@dataclass(frozen=True, kw_only=True)
class RobotModel:
    """Links and joints of a robot, with an upright base."""

    name: str  #: Of the file.
    #: Kind of each joint that moves, by its name, in the order of the file.
    joints: Mapping[str, AxisKind]
    #: MuJoCo model of the links, without friction, damping, limits and contacts.
    bodies: Any = field(repr=False)

    def effort(
        self,
        position: Float[np.ndarray, "n joints"],
        velocity: Float[np.ndarray, "n joints"],
        acceleration: Float[np.ndarray, "n joints"],
    ) -> Float[np.ndarray, "n joints"]:
        """Return the efforts of the rigid-body motion, M(q) a + C(q, v) v + g(q) [N or N m].

        Featherstone (2008), "Rigid Body Dynamics Algorithms", section 5.3 (recursive
        Newton-Euler), as MuJoCo computes it.
        """
        mujoco = _mujoco()
        data = mujoco.MjData(self.bodies)
        effort = np.empty(position.shape)
        at = self._places()
        for k in range(position.shape[0]):
            data.qpos[at] = position[k]
            data.qvel[at] = velocity[k]
            data.qacc[at] = acceleration[k]
            mujoco.mj_inverse(self.bodies, data)
            effort[k] = data.qfrc_inverse[at]
        return effort

    def mean_inertia(self, position: Float[np.ndarray, "n joints"]) -> Float[np.ndarray, " joints"]:
        """Return the mean of the diagonal of M(q) over a motion [kg or kg m^2].

        That is the inertia about each joint with the others at rest.
        """
        chosen = np.linspace(0, position.shape[0] - 1, min(_POSTURES, position.shape[0]))
        postures = position[np.unique(chosen.astype(int))]
        still = np.zeros_like(postures)
        held = self.effort(postures, still, still)
        inertia = np.empty(len(self.joints))
        for k in range(inertia.size):
            turned = still.copy()
            turned[:, k] = 1.0
            inertia[k] = np.mean((self.effort(postures, still, turned) - held)[:, k])
        return inertia

    def _places(self) -> list[int]:
        """Return where MuJoCo keeps each joint; all of them have one coordinate."""
        return [int(self.bodies.joint(name).dofadr[0]) for name in self.joints]


def read_urdf(path: str | Path) -> RobotModel:
    """Return the robot of a URDF file; MissingExtraError without MuJoCo.

    Geometry, limits, friction and damping of the file are not used, and neither is a ``mimic``.
    Refused is a file in which no joint moves, or a joint moves no mass.
    """
    mujoco = _mujoco()
    path = Path(path)
    root = _parsed(path)
    joints = [each for each in root.findall("joint") if each.get("type") != _FIXED]
    kinds: dict[str, AxisKind] = {}
    for joint in joints:
        name, kind = joint.get("name", ""), joint.get("type", "")
        if kind not in _KINDS:
            raise InputError("urdf_joint_kind", where=path.name, joint=name, kind=kind)
        kinds[name] = _KINDS[kind]
    if not kinds:
        raise InputError("urdf_without_joints", where=path.name)
    try:
        bodies = mujoco.MjModel.from_xml_string(_plain(root))
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError("urdf_refused", where=path.name, reason=reason) from None
    bodies.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    for name in kinds:
        if bodies.body_subtreemass[bodies.joint(name).bodyid[0]] < _LEAST_MASS:
            raise InputError("urdf_joint_without_mass", where=path.name, joint=name)
    return RobotModel(name=path.name, joints=kinds, bodies=bodies)


def _mujoco() -> Any:
    """Return the library, which has no type information that holds."""
    with RequiredExtra("robot", "a model of a robot's links"):
        return import_module("mujoco")


def _parsed(path: Path) -> ElementTree.Element:
    """Return the root of a URDF file."""
    content = bytes_of(path, "URDF file")
    try:
        # A local file of the user; expat bounds the expansion of entities
        root = ElementTree.fromstring(content)  # noqa: S314
    except (ElementTree.ParseError, LookupError, ValueError) as error:
        raise InputError("not_urdf", where=path.name, reason=str(error)) from None
    if root.tag != "robot":
        reason = f"its outermost element is <{root.tag}>, not <robot>"
        raise InputError("not_urdf", where=path.name, reason=reason)
    return root


_KEPT = {"link": ("inertial",), "joint": ("origin", "parent", "child", "axis")}


def _plain(root: ElementTree.Element) -> str:
    """Return the links and joints alone: inertias, places and axes, for MuJoCo."""
    robot = ElementTree.Element("robot", name="robot")
    settings = ElementTree.SubElement(robot, "mujoco")
    ElementTree.SubElement(
        settings,
        "compiler",
        fusestatic="true",
        balanceinertia="true",
        boundmass=str(_NO_MASS),
        boundinertia=str(_NO_MASS),
    )
    for element in root:
        if element.tag not in _KEPT:
            continue
        own = {key: element.get(key, "") for key in ("name", "type") if key in element.attrib}
        kept = ElementTree.SubElement(robot, element.tag, own)
        kept.extend(child for child in element if child.tag in _KEPT[element.tag])
    return ElementTree.tostring(robot, encoding="unicode")
