"""Friction as Python code for Isaac Lab, Genesis and Drake."""

from stickslip.export.base import IN_A_JOINT, one_friction
from stickslip.export.robots.joints import armature, including_link
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter


def _isaac_lab(axis: AxisToFill) -> Filling:
    """``friction``, ``dynamic_friction`` and ``viscous_friction`` of an ``ImplicitActuatorCfg``.

    In SI units, per radian (Isaac Lab 2.2 and later, with Isaac Sim 5). Source: ``ActuatorBaseCfg``
    in https://isaac-sim.github.io/IsaacLab/main/source/api/lab/isaaclab.actuators.html.
    """
    inertia, notes = armature(axis.parameters, axis.settings)
    mean = axis.parameters.mean
    coulomb, static = mean("coulomb_friction"), mean("static_friction")
    held = {
        "friction": static if static is not None else coulomb,
        "dynamic_friction": coulomb,
        "viscous_friction": mean("viscous_friction"),
        "armature": inertia,
    }
    return {"held": _present(held)}, notes


def _genesis(axis: AxisToFill) -> Filling:
    """``set_dofs_frictionloss``, ``set_dofs_damping`` and ``set_dofs_armature`` of an entity.

    Genesis gives every joint an armature of 0.1 kg m^2 by default (``default_armature`` of the
    morphs), so the armature is always set: to the rest of the identified inertia, or to zero.
    Source: https://github.com/Genesis-Embodied-AI/Genesis, genesis/options/morphs.py and
    genesis/engine/entities/rigid_entity/rigid_entity.py.
    """
    inertia, _ = armature(axis.parameters, axis.settings)
    held = {
        "frictionloss": axis.parameters.mean("coulomb_friction"),
        "damping": axis.parameters.mean("viscous_friction"),
        "armature": inertia or 0.0,
    }
    unit, identified = axis.parameters.unit("inertia"), axis.parameters.inertia
    remark = "to 0" if inertia is None else f"to {inertia:.4g} {unit}"
    note = f"The armature is set {remark}, as Genesis adds 0.1 {unit} by default"
    if inertia is None and identified is not None:
        note = f"{note}; {including_link(identified, unit)}"
    return {"held": _present(held)}, [note]


def _drake(axis: AxisToFill) -> Filling:
    """``set_default_damping`` of a joint.

    Drake's joints have viscous damping and no dry friction: its URDF and SDF parsers ignore
    ``friction``. Source: https://drake.mit.edu/doxygen_cxx/classdrake_1_1multibody_1_1_joint.html
    and https://drake.mit.edu/doxygen_cxx/group__multibody__parsing.html.
    """
    return {"damping": axis.parameters.required("viscous_friction", axis.title)}, []


def _present(values: dict[str, float | None]) -> dict[str, float]:
    return {name: value for name, value in values.items() if value is not None}


ISAAC_LAB = TemplateExporter(
    name="isaac-lab",
    title="Isaac Lab",
    values=_isaac_lab,
    template="isaac_lab.py.jinja",
    represents=("coulomb_friction", "viscous_friction", "static_friction"),
    cannot=IN_A_JOINT
    | {
        "stribeck_velocity": "is left out: PhysX changes from static to dynamic friction when the "
        "joint moves",
    },
    options=("link_inertia",),
)
GENESIS = TemplateExporter(
    name="genesis",
    title="Genesis",
    values=_genesis,
    template="genesis.py.jinja",
    represents=("coulomb_friction", "viscous_friction"),
    cannot=IN_A_JOINT | {"static_friction": one_friction("Genesis")},
    options=("link_inertia",),
)
DRAKE = TemplateExporter(
    name="drake",
    title="Drake",
    values=_drake,
    template="drake.py.jinja",
    represents=("viscous_friction",),
    cannot=IN_A_JOINT
    | {
        "coulomb_friction": "is left out: joints of Drake have no Coulomb friction, and a joint "
        "that the real axis holds at rest moves there",
        "static_friction": "is left out, as Coulomb friction is",
    },
)
