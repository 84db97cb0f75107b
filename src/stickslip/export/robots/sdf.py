"""Joint friction in SDFormat, the format of Gazebo, edited as text."""

from collections.abc import Mapping

from stickslip.export.robots.dynamics import dynamics_in
from stickslip.export.robots.joints import PresentValues
from stickslip.export.robots.xml_text import Edit, Element, XmlText
from stickslip.records import InputError


def _joint_edits(
    text: XmlText,
    joint: Element,
    values: Mapping[str, str],
    remark: tuple[str, ...],
    present: PresentValues,
) -> list[Edit]:
    """``<dynamics>`` of the axis of a joint: ``<damping>`` and ``<friction>``.

    Viscous friction is ``damping`` [N m s/rad or N s/m], Coulomb friction is ``friction``
    [N m or N], "the physical static friction value of the joint"
    (http://sdformat.org/spec?elem=joint).
    """
    name = joint.attributes["name"]
    axis = joint.child("axis")
    if axis is None:
        raise InputError("joint_without_axis", joint=name)
    dynamics = axis.child("dynamics")
    lines = {tag: f"<{tag}>{value}</{tag}>".encode() for tag, value in values.items()}
    if dynamics is None:
        indent = text.child_indent(axis)
        opened = [b"<dynamics>", *(b"  " + each for each in lines.values()), b"</dynamics>"]
        return text.insert_child(axis, [text.comment(remark, indent), *opened])
    old = {each.tag: text.inner(each) for each in dynamics.children if each.tag in values}
    present.add(name, old, values)
    edits = text.insert_before(dynamics, text.comment(remark, text.indent(dynamics)))
    for child in dynamics.children:
        if child.tag in old:
            edits.append(Edit(start=child.start, end=child.end, content=lines.pop(child.tag)))
    return [*edits, *(text.insert_child(dynamics, list(lines.values())) if lines else [])]


SDF = dynamics_in("SDF", _joint_edits, title="SDF (Gazebo)")
