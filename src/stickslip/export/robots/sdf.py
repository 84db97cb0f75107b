"""Joint friction in SDFormat, the format of Gazebo, edited as text."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from stickslip.export.base import ExportSettings, FileToEdit, Rendered
from stickslip.export.parameters import ExportParameters
from stickslip.export.robots.joints import check_kind, check_present, edited_file
from stickslip.export.robots.xml_text import Edit, Element, XmlText
from stickslip.export.templates import heading, notes_on, number
from stickslip.records import InputError

_KINDS = {"revolute": "rotary", "continuous": "rotary", "prismatic": "linear"}
_ELEMENTS = {"damping": "viscous_friction", "friction": "coulomb_friction"}


@dataclass(frozen=True, kw_only=True)
class SdfExporter:
    """``<dynamics>`` of the axis of a joint: ``<damping>`` and ``<friction>``.

    Viscous friction is ``damping`` [N m s/rad or N s/m], Coulomb friction is ``friction``
    [N m or N], "the physical static friction value of the joint"
    (http://sdformat.org/spec?elem=joint).
    """

    name: str = "sdf"
    title: str = "SDF (Gazebo)"
    group: Literal["simulator"] = "simulator"
    side: Literal["joint"] = "joint"
    represents: tuple[str, ...] = ("viscous_friction", "coulomb_friction")
    ending: str = ".sdf"
    edits: Literal["always"] = "always"
    several: bool = True
    options: tuple[str, ...] = ()

    @property
    def cannot(self) -> Mapping[str, str]:
        """Effects that SDF does not represent."""
        return {
            "direction": "is replaced by the mean of both directions",
            "offset": "is left out: SDF has no constant joint effort",
            "static_friction": "is left out: SDF has one friction value, and it gets the Coulomb "
            "friction",
        }

    def render(
        self,
        axes: Mapping[str, ExportParameters],
        settings: ExportSettings,
        into: FileToEdit | None = None,
    ) -> Rendered:
        """Return the edited file; see `Exporter.render`."""
        text = XmlText(edited_file(into, self.title).content, "SDF")
        joints = [each for each in text.elements("joint") if "type" in each.attributes]
        edits: list[Edit] = []
        for name, parameters in axes.items():
            joint = text.joint(name, joints)
            check_kind(name, joint.attributes["type"], _KINDS, parameters)
            axis = joint.child("axis")
            if axis is None:
                raise InputError("joint_without_axis", joint=name)
            values = {
                tag: number(value)
                for tag, quantity in _ELEMENTS.items()
                if (value := parameters.mean(quantity)) is not None
            }
            one = {name: parameters}
            remark = heading(one, notes_on(self, one))
            edits += _axis_edits(text, axis, name, values, remark, overwrite=settings.overwrite)
        return Rendered(files={"": text.edited(edits)}, notes=notes_on(self, axes))


def _axis_edits(
    text: XmlText,
    axis: Element,
    name: str,
    values: Mapping[str, str],
    remark: tuple[str, ...],
    *,
    overwrite: bool,
) -> list[Edit]:
    dynamics = axis.child("dynamics")
    lines = {tag: f"<{tag}>{value}</{tag}>".encode() for tag, value in values.items()}
    if dynamics is None:
        indent = text.child_indent(axis)
        opened = [b"<dynamics>", *(b"  " + each for each in lines.values()), b"</dynamics>"]
        return text.insert_child(axis, [text.comment(remark, indent), *opened])
    present = {each.tag: text.inner(each) for each in dynamics.children if each.tag in values}
    check_present(name, present, values, overwrite=overwrite)
    edits = text.insert_before(dynamics, text.comment(remark, text.indent(dynamics)))
    for child in dynamics.children:
        if child.tag in present:
            edits.append(Edit(start=child.start, end=child.end, content=lines.pop(child.tag)))
    return [*edits, *(text.insert_child(dynamics, list(lines.values())) if lines else [])]
