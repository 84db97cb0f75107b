"""Robot descriptions whose joints have an XML element ``<dynamics>``: URDF and SDFormat."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal

from stickslip.export.base import (
    MEAN,
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Rendered,
    one_friction,
)
from stickslip.export.robots.joints import PresentValues, check_kind, edited_file
from stickslip.export.robots.xml_text import Edit, Element, XmlText
from stickslip.export.templates import heading, notes_on, number

JointEdits = Callable[
    [XmlText, Element, Mapping[str, str], tuple[str, ...], PresentValues], list[Edit]
]
"""Returns the edits that write the values of a joint into a text, with a remark before them; adds
the values that they change."""

_KINDS = {"revolute": "rotary", "continuous": "rotary", "prismatic": "linear"}
_NAMES = {"damping": "viscous_friction", "friction": "coulomb_friction"}


@dataclass(frozen=True, kw_only=True)
class DynamicsExporter(Exporter):
    """``damping`` and ``friction`` in the ``<dynamics>`` of a joint."""

    language: str  #: Of the file, as messages name it.
    joint_edits: JointEdits  #: Writes the values of a joint; has the format and its source.
    represents: tuple[str, ...] = ("viscous_friction", "coulomb_friction")
    edits: Literal["never", "always"] = "always"

    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return the edited file; see `Exporter.render`."""
        text = XmlText(edited_file(into, self.title).content, self.language)
        # A joint of a transmission or of ros2_control has a name, and no type
        joints = [each for each in text.elements("joint") if "type" in each.attributes]
        edits: list[Edit] = []
        present = PresentValues()
        for name, parameters in axes.items():
            joint = text.joint(name, joints)
            check_kind(name, joint.attributes["type"], _KINDS, parameters)
            values = {
                key: number(value)
                for key, quantity in _NAMES.items()
                if (value := parameters.mean(quantity)) is not None
            }
            one = {name: parameters}
            remark = heading(self, one, notes_on(self, one))
            edits += self.joint_edits(text, joint, values, remark, present)
        present.check(overwrite=settings.overwrite)
        return Rendered(files={"": text.edited(edits)}, notes=notes_on(self, axes))


def dynamics_in(language: str, joint_edits: JointEdits, title: str = "") -> DynamicsExporter:
    """Return the exporter of a language; its title is the language by default."""
    return DynamicsExporter(
        name=language.lower(),
        title=title or language,
        language=language,
        joint_edits=joint_edits,
        ending=f".{language.lower()}",
        cannot={
            "direction": MEAN,
            "offset": f"is left out: {language} has no constant joint effort",
            "static_friction": one_friction(language),
        },
    )
