"""Joint friction in USD, for PhysX and Newton, as a layer over the user's file."""

import math
import os
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from typing import Any, Literal

from stickslip.errors import RequiredExtra
from stickslip.export.base import (
    IN_A_JOINT,
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Rendered,
    choices,
    prefix,
)
from stickslip.export.parameters import ExportParameters
from stickslip.export.robots.joints import PresentValues, armature, check_kind, edited_file
from stickslip.export.templates import filled_in, heading, notes_on, number
from stickslip.records import InputError

_KINDS = {"PhysicsRevoluteJoint": "rotary", "PhysicsPrismaticJoint": "linear"}
_PER_DEGREE = math.pi / 180.0
_SCHEMAS = "PhysxJointAxisAPI:{axis}", "NewtonJointAPI"


@dataclass(frozen=True, kw_only=True)
class UsdExporter(Exporter):
    """``physxJointAxis:*`` and ``newton:*`` of a joint, in a layer over the user's file.

    The layer has the user's file, which may also be binary, as its sublayer; that file stays as it
    is. Open the layer in its place. Viscous friction of a revolute joint is per degree per second,
    in PhysX and in Newton; all else is in SI units, scaled to the units of the stage.

    Sources: ``PhysxJointAxisAPI`` in
    https://docs.omniverse.nvidia.com/kit/docs/omni_physics/latest/dev_guide/joints/physx_joint_schema.html
    (its parser multiplies the viscous coefficient by 57.29577951308232:
    https://nvidia-omniverse.github.io/PhysX/ovphysx/0.7.0/population/PhysxJointAxisAPI.html), and
    ``NewtonJointAPI`` in generatedSchema.usda of
    https://github.com/newton-physics/newton-usd-schemas.
    """

    name: str = "usd"
    title: str = "USD (PhysX, Newton)"
    represents: tuple[str, ...] = ("viscous_friction", "coulomb_friction", "static_friction")
    cannot: Mapping[str, str] = field(
        default_factory=lambda: {
            **IN_A_JOINT,
            "stribeck_velocity": "is left out: PhysX changes from static to dynamic friction when "
            "the joint moves; Newton has one friction value, and it gets the Coulomb friction",
        }
    )
    ending: str = ".usda"
    edits: Literal["never", "always"] = "always"
    options: tuple[str, ...] = ("link_inertia",)

    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return the layer; see `Exporter.render`."""
        into = edited_file(into, self.title)
        prims: list[dict[str, Any]] = []
        present = PresentValues()
        notes = list(notes_on(self, axes))
        with tempfile.TemporaryDirectory() as folder:
            stage = _opened(into, Path(folder))
            units = _Units.of(stage)
            for name, parameters in axes.items():
                prim = _joint(stage, name)
                check_kind(name, str(prim.GetTypeName()), _KINDS, parameters)
                inertia, remark = armature(parameters, settings)
                values = _values(parameters, inertia, units)
                attributes = {key: prim.GetAttribute(key) for key in values}
                old = {
                    key: str(attribute.Get())
                    for key, attribute in attributes.items()
                    if attribute.IsValid() and attribute.HasAuthoredValue()
                }
                shown = {key: number(value) for key, value in values.items()}
                present.add(name, old, shown)
                axis = "angular" if parameters.kind == "rotary" else "linear"
                prims.append(
                    {
                        "names": str(prim.GetPath()).strip("/").split("/"),
                        "values": values,
                        "schemas": [each.format(axis=axis) for each in _SCHEMAS],
                    }
                )
                notes += [prefix(name, axes) + each for each in remark]
            present.check(overwrite=settings.overwrite)
            default = stage.GetDefaultPrim()
            default_prim = default.GetName() if default else ""
        notes.append(
            f"Values are in units of the stage, {units.metre:g} m and {units.kilogram:g} kg; the "
            "viscous friction of a revolute joint is per degree/s"
        )
        notes.append(f"{_reference(into)} stays as it is; open this layer in its place")
        text = filled_in(
            "stickslip.export.robots",
            "layer.usda",
            lines=heading(self, axes, tuple(notes), units="units of the stage"),
            sublayer=_reference(into),
            tree=_tree(prims),
            default_prim=default_prim,
            units=units,
        )
        return Rendered(files={"": text}, notes=tuple(notes))


def _usd() -> Any:
    with RequiredExtra("usd", "exporting to USD"):
        from pxr import Usd
    return Usd


def _opened(into: FileToEdit, folder: Path) -> Any:
    """Return the stage of a file, with what it references if it stands on disk."""
    Usd = _usd()
    from pxr import Tf

    path = into.path
    if path is None:
        ending = ".usda" if into.content.startswith(b"#usda") else ".usdc"
        path = folder / f"stage{ending}"
        path.write_bytes(into.content)
    try:
        return Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        raise InputError("not_usd", reason=_reason(str(error), path)) from error


def _reason(message: str, path: Path) -> str:
    """Return an error message of the library without the places in its own sources.

    >>> where = "Error in 'Parser::Raise' at line 48 in file /usd/parser.h"
    >>> _reason(f"{where} : '/tmp/arm.usda:2:22: Expected ) at x'", Path("/tmp/arm.usda"))
    'line 2:22: Expected ) at x'
    """
    first = message.strip().splitlines()[0]
    reason = first.partition(" : ")[2] or first
    return reason.strip(" '").replace(f"{path.resolve()}:", "line ")[:200]


def _joints(stage: Any) -> Iterator[Any]:
    return (prim for prim in stage.TraverseAll() if "Joint" in str(prim.GetTypeName()))


def _joint(stage: Any, name: str) -> Any:
    """Return the joint of a name or path."""
    joints = {str(prim.GetPath()): prim for prim in _joints(stage)}
    found = [prim for path, prim in joints.items() if name in (path, prim.GetName())]
    if len(found) == 1:
        return found[0]
    if found:
        raise InputError("joint_not_unique", format="USD", joint=name, count=len(found))
    if not joints:
        raise InputError("no_joints", format="USD", hint="")
    known = dict.fromkeys(prim.GetName() for prim in joints.values())
    raise InputError("unknown_joint", format="USD", joint=name, choices=choices(name, known))


@dataclass(frozen=True, kw_only=True)
class _Units:
    """Units of a stage."""

    metre: float  # length of a unit [m]
    kilogram: float  # mass of a unit [kg]
    up_axis: str

    @classmethod
    def of(cls, stage: Any) -> "_Units":
        from pxr import UsdGeom, UsdPhysics

        geometry: Any = UsdGeom
        physics: Any = UsdPhysics
        return cls(
            metre=float(geometry.GetStageMetersPerUnit(stage)),
            kilogram=float(physics.GetStageKilogramsPerUnit(stage)),
            up_axis=str(geometry.GetStageUpAxis(stage)),
        )


def _values(parameters: ExportParameters, inertia: float | None, units: _Units) -> dict[str, float]:
    """Return the attributes of a joint."""
    length, mass = 1.0 / units.metre, 1.0 / units.kilogram
    if parameters.kind == "rotary":
        axis, scale = "angular", mass * length**2
        effort, per_velocity = scale, scale * _PER_DEGREE
    else:
        axis, scale = "linear", mass
        effort, per_velocity = mass * length, mass
    coulomb = parameters.mean("coulomb_friction")
    static = parameters.mean("static_friction")
    viscous = parameters.mean("viscous_friction")
    values: dict[str, float] = {}
    if coulomb is not None:
        values[f"physxJointAxis:{axis}:dynamicFrictionEffort"] = coulomb * effort
        values[f"physxJointAxis:{axis}:staticFrictionEffort"] = effort * max(
            coulomb, coulomb if static is None else static
        )
        values["newton:friction"] = coulomb * effort
    if viscous is not None:
        values[f"physxJointAxis:{axis}:viscousFrictionCoefficient"] = viscous * per_velocity
        values["newton:damping"] = viscous * per_velocity
    if inertia is not None:
        values[f"physxJointAxis:{axis}:armature"] = inertia * scale
        values["newton:armature"] = inertia * scale
    return values


def _reference(into: FileToEdit) -> str:
    """Return the path of the user's file as the layer names it."""
    if into.path is None:
        return "robot.usd"
    if into.out is None:
        return into.path.name
    if into.out.resolve() == into.path.resolve():
        raise InputError("layer_over_itself", where=str(into.out))
    relative = os.path.relpath(into.path.resolve(), into.out.resolve().parent)
    return relative if relative.startswith("..") else f"./{relative}"


def _tree(prims: list[dict[str, Any]]) -> list[tuple[int, str, dict[str, Any] | None]]:
    """Return the lines of nested overs: depth, name (empty for an end), and what a joint has."""
    lines: list[tuple[int, str, dict[str, Any] | None]] = []
    open_names: list[str] = []

    def close(depth: int) -> None:
        while len(open_names) > depth:
            open_names.pop()
            lines.append((len(open_names), "", None))

    for prim in sorted(prims, key=lambda each: each["names"]):
        *around, name = prim["names"]
        pairs = zip(around, open_names, strict=False)
        common = len(list(takewhile(lambda pair: pair[0] == pair[1], pairs)))
        close(common)
        for each in around[common:]:
            lines.append((len(open_names), each, None))
            open_names.append(each)
        lines.append((len(open_names), name, prim))
    close(0)
    return lines
