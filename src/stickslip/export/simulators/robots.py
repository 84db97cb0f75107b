"""Friction as Python code for Isaac Lab, Genesis and Drake."""

import re
from dataclasses import dataclass
from typing import Any, Literal

from stickslip.export.base import ExportSettings
from stickslip.export.parameters import ExportParameters
from stickslip.export.robots.joints import armature
from stickslip.export.template_exporter import TemplateExporter

_MEAN = "is replaced by the mean of both directions"
_NO_EFFORT = "is left out: a joint has no constant effort"


@dataclass(frozen=True, kw_only=True)
class IsaacLabExporter(TemplateExporter):
    """``friction``, ``dynamic_friction`` and ``viscous_friction`` of an ``ImplicitActuatorCfg``.

    In SI units, per radian (Isaac Lab 2.2 and later, with Isaac Sim 5). Source: ``ActuatorBaseCfg``
    in https://isaac-sim.github.io/IsaacLab/main/source/api/lab/isaaclab.actuators.html.
    """

    name: str = "isaac-lab"
    title: str = "Isaac Lab"
    group: Literal["simulator"] = "simulator"
    template: str = "isaac_lab.py.jinja"
    represents: tuple[str, ...] = ("coulomb_friction", "viscous_friction", "static_friction")
    options: tuple[str, ...] = ("link_inertia",)

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        inertia, notes = armature(parameters, settings)
        coulomb, static = (
            parameters.mean("coulomb_friction"),
            parameters.mean("static_friction"),
        )
        held = {
            "friction": static if static is not None else coulomb,
            "dynamic_friction": coulomb,
            "viscous_friction": parameters.mean("viscous_friction"),
            "armature": inertia,
        }
        expression = re.escape(name)
        return {"expression": expression, "held": _present(held)}, notes


@dataclass(frozen=True, kw_only=True)
class GenesisExporter(TemplateExporter):
    """``set_dofs_frictionloss``, ``set_dofs_damping`` and ``set_dofs_armature`` of an entity.

    Genesis gives every joint an armature of 0.1 kg m^2 by default (``default_armature`` of the
    morphs), so the armature is always set: to the rest of the identified inertia, or to zero.
    Source: https://github.com/Genesis-Embodied-AI/Genesis, genesis/options/morphs.py and
    genesis/engine/entities/rigid_entity/rigid_entity.py.
    """

    name: str = "genesis"
    title: str = "Genesis"
    group: Literal["simulator"] = "simulator"
    template: str = "genesis.py.jinja"
    represents: tuple[str, ...] = ("coulomb_friction", "viscous_friction")
    options: tuple[str, ...] = ("link_inertia",)

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name
        inertia, notes = armature(parameters, settings)
        notes = ["The armature is set, as Genesis adds 0.1 kg m^2 by default", *notes]
        held = {
            "frictionloss": parameters.mean("coulomb_friction"),
            "damping": parameters.mean("viscous_friction"),
            "armature": inertia or 0.0,
        }
        return {"held": _present(held)}, notes


@dataclass(frozen=True, kw_only=True)
class DrakeExporter(TemplateExporter):
    """``set_default_damping`` of a joint.

    Drake's joints have viscous damping and no dry friction: its URDF and SDF parsers ignore
    ``friction``. Source: https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_joint.html
    and https://drake.mit.edu/doxygen_cxx/group__multibody__parsing.html.
    """

    name: str = "drake"
    title: str = "Drake"
    group: Literal["simulator"] = "simulator"
    template: str = "drake.py.jinja"
    represents: tuple[str, ...] = ("viscous_friction",)

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name, settings
        return {"damping": parameters.required("viscous_friction", self.title)}, []


def _present(values: dict[str, float | None]) -> dict[str, float]:
    return {name: value for name, value in values.items() if value is not None}


ISAAC_LAB = IsaacLabExporter(
    cannot={
        "direction": _MEAN,
        "offset": _NO_EFFORT,
        "stribeck_velocity": "is left out: PhysX changes from static to dynamic friction when the "
        "joint moves",
    }
)
GENESIS = GenesisExporter(
    cannot={
        "direction": _MEAN,
        "offset": _NO_EFFORT,
        "static_friction": "is left out: Genesis has one friction value, and it gets the Coulomb "
        "friction",
    }
)
DRAKE = DrakeExporter(
    cannot={
        "coulomb_friction": "is left out: joints of Drake have no Coulomb friction, and a joint "
        "that the real axis holds at rest moves there",
        "static_friction": "is left out, as Coulomb friction is",
        "direction": _MEAN,
        "offset": _NO_EFFORT,
    }
)
