"""Joint friction in URDF, edited as text."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from stickslip.export.base import ExportSettings, FileToEdit, Rendered
from stickslip.export.parameters import ExportParameters
from stickslip.export.robots.joints import check_kind, check_present, edited_file
from stickslip.export.robots.xml_text import Edit, Element, XmlText
from stickslip.export.templates import heading, notes_on, number

_KINDS = {"revolute": "rotary", "continuous": "rotary", "prismatic": "linear"}
_ATTRIBUTES = {"damping": "viscous_friction", "friction": "coulomb_friction"}


@dataclass(frozen=True, kw_only=True)
class UrdfExporter:
    """``<dynamics damping= friction=>`` of a joint.

    Viscous friction is ``damping`` [N m s/rad or N s/m], Coulomb friction is ``friction``
    [N m or N], which the specification calls static (https://wiki.ros.org/urdf/XML/joint). Most
    simulators take it as Coulomb friction: Gazebo, PyBullet and MuJoCo do, Drake ignores it.
    """

    name: str = "urdf"
    title: str = "URDF"
    group: Literal["simulator"] = "simulator"
    side: Literal["joint"] = "joint"
    represents: tuple[str, ...] = ("viscous_friction", "coulomb_friction")
    ending: str = ".urdf"
    edits: Literal["always"] = "always"
    several: bool = True
    options: tuple[str, ...] = ()

    @property
    def cannot(self) -> Mapping[str, str]:
        """Effects that URDF does not represent."""
        return {
            "direction": "is replaced by the mean of both directions",
            "offset": "is left out: URDF has no constant joint effort",
            "static_friction": "is left out: URDF has one friction value, and it gets the Coulomb "
            "friction",
        }

    def render(
        self,
        axes: Mapping[str, ExportParameters],
        settings: ExportSettings,
        into: FileToEdit | None = None,
    ) -> Rendered:
        """Return the edited file; see `Exporter.render`."""
        text = XmlText(edited_file(into, self.title).content, self.title)
        # A joint of a transmission or of ros2_control has a name, and no type
        joints = [each for each in text.elements("joint") if "type" in each.attributes]
        edits: list[Edit] = []
        for name, parameters in axes.items():
            joint = text.joint(name, joints)
            check_kind(name, joint.attributes["type"], _KINDS, parameters)
            edits += self._joint_edits(text, joint, name, parameters, settings)
        notes = notes_on(self, axes)
        return Rendered(files={"": text.edited(edits)}, notes=notes)

    def _joint_edits(
        self,
        text: XmlText,
        joint: Element,
        name: str,
        parameters: ExportParameters,
        settings: ExportSettings,
    ) -> list[Edit]:
        values = {
            attribute: number(value)
            for attribute, quantity in _ATTRIBUTES.items()
            if (value := parameters.mean(quantity)) is not None
        }
        one = {name: parameters}
        remark = heading(one, notes_on(self, one))
        dynamics = joint.child("dynamics")
        if dynamics is None:
            attributes = "".join(f' {key}="{value}"' for key, value in values.items())
            indent = text.child_indent(joint)
            lines = [text.comment(remark, indent), f"<dynamics{attributes}/>".encode()]
            return text.insert_child(joint, lines)
        check_present(name, dynamics.attributes, values, overwrite=settings.overwrite)
        comment = text.comment(remark, text.indent(dynamics))
        return [*text.insert_before(dynamics, comment), *text.set_attributes(dynamics, values)]
