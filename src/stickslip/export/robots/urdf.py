"""Joint friction in URDF, edited as text."""

from collections.abc import Mapping

from stickslip.export.robots.dynamics import dynamics_in
from stickslip.export.robots.joints import PresentValues
from stickslip.export.robots.xml_text import Edit, Element, XmlText


def _joint_edits(
    text: XmlText,
    joint: Element,
    values: Mapping[str, str],
    remark: tuple[str, ...],
    present: PresentValues,
) -> list[Edit]:
    """``<dynamics damping= friction=>`` of a joint.

    Viscous friction is ``damping`` [N m s/rad or N s/m], Coulomb friction is ``friction``
    [N m or N], which the specification calls static (https://wiki.ros.org/urdf/XML/joint). Most
    simulators take it as Coulomb friction: Gazebo, PyBullet and MuJoCo do, Drake ignores it.
    """
    dynamics = joint.child("dynamics")
    if dynamics is None:
        attributes = "".join(f' {key}="{value}"' for key, value in values.items())
        indent = text.child_indent(joint)
        lines = [text.comment(remark, indent), f"<dynamics{attributes}/>".encode()]
        return text.insert_child(joint, lines)
    name = joint.attributes["name"]
    present.add(name, dynamics.attributes, values)
    comment = text.comment(remark, text.indent(dynamics))
    return [*text.insert_before(dynamics, comment), *text.set_attributes(dynamics, values)]


URDF = dynamics_in("URDF", _joint_edits)
