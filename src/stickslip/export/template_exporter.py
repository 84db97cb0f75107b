"""Exports that fill in a template, without an existing file."""

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from stickslip.export.base import (
    ExportSettings,
    FileToEdit,
    Group,
    Rendered,
    axis_in_words,
    only_axis,
)
from stickslip.export.parameters import ExportParameters
from stickslip.export.templates import filled_in, heading, notes_on
from stickslip.export.transmission import Side


@dataclass(frozen=True, kw_only=True)
class TemplateExporter:
    """A target whose file is a template, filled in with the values of every axis.

    Attributes
    ----------
    template
        Name of the template in the folder ``templates`` beside the module of the class.
    name, title, group, side, represents, cannot, ending, edits, several, options
        See `Exporter`.
    """

    template: str
    name: str
    title: str
    group: Group
    represents: tuple[str, ...]
    cannot: Mapping[str, str] = field(default_factory=dict)
    side: Side | None = "joint"
    ending: str = ".py"
    edits: Literal["never"] = "never"
    several: bool = True
    options: tuple[str, ...] = ()

    @abstractmethod
    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""

    def render(
        self,
        axes: Mapping[str, ExportParameters],
        settings: ExportSettings,
        into: FileToEdit | None = None,  # noqa: ARG002 - of the protocol
    ) -> Rendered:
        """Return the file; see `Exporter.render`."""
        if not self.several:
            only_axis(axes, self.title)
        filled: list[dict[str, Any]] = []
        notes: list[str] = list(notes_on(self, axes))
        for name, parameters in axes.items():
            values, own = self.values(name, parameters, settings)
            filled.append(
                {"name": name, "words": axis_in_words(name), "kind": parameters.kind, **values}
            )
            notes += [f"{name}: {each}" if len(axes) > 1 else each for each in own]
        package = type(self).__module__.rpartition(".")[0]
        text = filled_in(package, self.template, lines=heading(axes, tuple(notes)), axes=filled)
        return Rendered(files={"": text}, notes=tuple(notes))


def identifier(name: str) -> str:
    """Return a name as an identifier of a programming language.

    Examples
    --------
    >>> identifier("arm/joint-3"), identifier("3")
    ('arm_joint_3', 'axis_3')
    """
    plain = "".join(each if each.isascii() and each.isalnum() else "_" for each in name)
    return plain if plain[:1].isalpha() else f"axis_{plain}"
