"""Friction of an arm by least squares over all its joints, with the inertias of its links unknown.

Shares no code with the package: the rigid bodies move by Newton-Euler equations of this file. It is
the method of Mamedov and Mikhel (2020), "Practical aspects of model-based collision detection",
Frontiers in Robotics and AI 7, without their constraints on the inertias.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, filtfilt

_GRAVITY = 9.81  # m/s^2
_ORDER, _VELOCITY_CUTOFF, _EFFORT_CUTOFF = 5, 0.15, 0.2  # of the Nyquist frequency, as published
_SMALLEST_RATIO = 1e-8  # of singular values: many inertias are not separable
_INERTIAS = ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2))
_OF_A_LINK = 10  # parameters: mass, mass times centre, inertia about the joint

Vectors = Float[np.ndarray, "n 3"]
Matrices = Float[np.ndarray, "n 3 3"]


@dataclass(frozen=True, kw_only=True)
class Chain:
    """Places and axes of the joints of an arm, each in the frame of the joint before."""

    #: Of the frame of each joint, shape (joints, 3, 3) and (joints, 3) [-, m].
    rotations: Float[np.ndarray, "joints 3 3"]
    places: Float[np.ndarray, "joints 3"]
    axes: Float[np.ndarray, "joints 3"]  #: Shape (joints, 3).

    @classmethod
    def of(cls, urdf: Path, names: Sequence[str]) -> "Chain":
        """Return the chain of joints that follow one another; the base is upright."""
        root = ElementTree.parse(urdf).getroot()  # noqa: S314 - a file of known hash
        joints = {each.get("name"): each for each in root.findall("joint")}
        found = [joints[name] for name in names]
        origins = [each.find("origin") for each in found]
        angles = [_numbers(each, "rpy") for each in origins]
        return cls(
            rotations=np.array([_turn(z, 2) @ _turn(y, 1) @ _turn(x, 0) for x, y, z in angles]),
            places=np.array([_numbers(each, "xyz") for each in origins]),
            axes=np.array([_numbers(each.find("axis"), "xyz") for each in found]),
        )

    def regressor(
        self,
        position: Float[np.ndarray, "n joints"],
        velocity: Float[np.ndarray, "n joints"],
        acceleration: Float[np.ndarray, "n joints"],
    ) -> Float[np.ndarray, "n joints parameters"]:
        """Return efforts of the joints for unit parameters of each link.

        Parameters of a link are mass, mass times centre (3) and inertia (6), about its joint:
        F = m a + (dw x + w x w x) mc, N = mc x a + I dw + w x I w.
        """
        n, joints = position.shape
        rows = np.zeros((n, joints, _OF_A_LINK * joints))
        turned = np.tile(np.eye(3), (n, 1, 1))
        place, w, dw = np.zeros((3, n, 3))
        a = np.tile([0.0, 0.0, _GRAVITY], (n, 1))
        axes: list[Vectors] = []
        places: list[Vectors] = []
        for k in range(joints):
            arm = turned @ self.places[k]
            a = a + np.cross(dw, arm) + np.cross(w, np.cross(w, arm))
            place = place + arm
            turned = turned @ self.rotations[k]
            axis = turned @ self.axes[k]
            spin = velocity[:, k : k + 1] * axis
            dw = dw + acceleration[:, k : k + 1] * axis + np.cross(w, spin)
            w = w + spin
            turned = turned @ _about(self.axes[k], position[:, k])
            axes.append(axis)
            places.append(place)
            force, torque = _wrench(turned, a, w, dw)
            for j in range(k + 1):
                lever = _crossed(place - places[j])
                whole = torque + lever @ force
                own = slice(_OF_A_LINK * k, _OF_A_LINK * (k + 1))
                rows[:, j, own] = np.einsum("ni,nip->np", axes[j], whole)
        return rows


def _wrench(
    turned: Matrices, a: Vectors, w: Vectors, dw: Vectors
) -> tuple[Float[np.ndarray, "n 3 p"], Float[np.ndarray, "n 3 p"]]:
    """Return force and torque about the joint for unit parameters of a link."""
    force, torque = np.zeros((2, len(a), 3, _OF_A_LINK))
    force[:, :, 0] = a
    force[:, :, 1:4] = (_crossed(dw) + _crossed(w) @ _crossed(w)) @ turned
    torque[:, :, 1:4] = -_crossed(a) @ turned
    for p, (row, column) in enumerate(_INERTIAS, 4):
        unit = np.zeros((3, 3))
        unit[row, column] = unit[column, row] = 1.0
        inertia = turned @ unit @ turned.transpose(0, 2, 1)
        momentum = np.einsum("nij,nj->ni", inertia, w)
        torque[:, :, p] = np.einsum("nij,nj->ni", inertia, dw) + np.cross(w, momentum)
    return force, torque


def _numbers(element: ElementTree.Element | None, name: str) -> Float[np.ndarray, "3"]:
    text = "0 0 0" if element is None else element.get(name, "0 0 0")
    return np.array([float(word) for word in text.split()])


def _turn(angle: float, axis: int) -> Float[np.ndarray, "3 3"]:
    return _about(np.eye(3)[axis], np.array([angle]))[0]


def _about(axis: Float[np.ndarray, "3"], angle: Float[np.ndarray, " n"]) -> Matrices:
    """Return rotations about an axis (Rodrigues)."""
    cross = _crossed(axis[None])[0]
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * cross + (1.0 - c) * (cross @ cross)


def _crossed(vectors: Vectors) -> Matrices:
    """Return the matrices of cross products with vectors from the left."""
    x, y, z = vectors.T
    zero = np.zeros_like(x)
    return np.stack([[zero, -z, y], [z, zero, -x], [-y, x, zero]]).transpose(2, 0, 1)


@dataclass(frozen=True, kw_only=True)
class Friction:
    """Friction of each joint [N m, N m s/rad], shape (joints,)."""

    coulomb: Float[np.ndarray, " joints"]
    viscous: Float[np.ndarray, " joints"]


def arm_friction(
    chain: Chain,
    time: Float[np.ndarray, " n"],
    position: Float[np.ndarray, "n joints"],
    velocity: Float[np.ndarray, "n joints"],
    effort: Float[np.ndarray, "n joints"],
    *,
    slowest: float = 0.0,
) -> Friction:
    """Return the friction of all joints from one log [s, rad, rad/s, N m], by least squares.

    Rows in which a joint is slower than ``slowest`` times its largest speed are left out.
    """
    velocity = _smooth(velocity, _VELOCITY_CUTOFF)
    acceleration = np.zeros_like(velocity)
    acceleration[1:-1] = (velocity[2:] - velocity[:-2]) / (time[2:] - time[:-2])[:, None]
    acceleration = _smooth(acceleration, _VELOCITY_CUTOFF)
    n, joints = position.shape
    unit = np.eye(joints)
    columns = (acceleration, velocity, np.sign(velocity), np.ones((n, joints)))
    rows = np.concatenate(
        [
            chain.regressor(position, velocity, acceleration),
            *(each[:, :, None] * unit for each in columns),
        ],
        axis=2,
    )
    speed = np.abs(velocity)
    used = speed >= slowest * speed.max(axis=0)
    kept, target = rows[used], _smooth(effort, _EFFORT_CUTOFF)[used]
    size = np.linalg.norm(kept, axis=0)
    size[size == 0.0] = 1.0
    values = np.linalg.lstsq(kept / size, target, rcond=_SMALLEST_RATIO)[0] / size
    _, viscous, coulomb, _ = values[_OF_A_LINK * joints :].reshape(4, joints)
    return Friction(coulomb=coulomb, viscous=viscous)


def _smooth(values: Float[np.ndarray, "n k"], cutoff: float) -> Float[np.ndarray, "n k"]:
    return filtfilt(*butter(_ORDER, cutoff), values, axis=0)
