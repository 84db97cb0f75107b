"""Exports that fill in a template, without an existing file."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from stickslip.export.base import (
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Rendered,
    axis_in_words,
    only_axis,
)
from stickslip.export.parameters import ExportParameters
from stickslip.export.templates import filled_in, heading, notes_on
from stickslip.records import InputError, positive


@dataclass(frozen=True, kw_only=True)
class AxisToFill:
    """An axis whose values a template is filled in with."""

    parameters: ExportParameters  #: Of the axis, on the side of the target.
    settings: ExportSettings  #: Of the export.
    title: str  #: Of the target.

    def needed(self, name: str, meaning: str, unit: str = "") -> float:
        """Return a setting that the target needs, which must be positive [``unit``]."""
        value = getattr(self.settings, name)
        if value is None:
            raise InputError("option_needed", title=self.title, name=name, meaning=meaning)
        return positive(name, value, unit)


Filling = tuple[dict[str, Any], list[str]]
"""Variables of a template for one axis, and notes on it."""


@dataclass(frozen=True, kw_only=True)
class TemplateExporter(Exporter):
    """A target whose file is a template, filled in with the values of every axis."""

    #: Returns the variables of an axis; its docstring states the format and its source.
    values: Callable[[AxisToFill], Filling]
    #: Name of the template in the folder ``templates`` beside the module of ``values``.
    template: str
    ending: str = ".py"

    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return the file; see `Exporter.render`."""
        del into
        if not self.several:
            only_axis(axes, self.title)
        filled: list[dict[str, Any]] = []
        remarks: dict[str, list[str]] = {}
        for name, parameters in axes.items():
            own = {
                "name": name,
                "words": axis_in_words(name),
                "identifier": identifier(name),
                "expression": re.escape(name),
                "kind": parameters.kind,
            }
            values, remarks[name] = self.values(
                AxisToFill(parameters=parameters, settings=settings, title=self.title)
            )
            filled.append(own | values)
        notes = [*notes_on(self, axes), *_merged(remarks)]
        package = self.values.__module__.rpartition(".")[0]
        text = filled_in(
            package, self.template, lines=heading(self, axes, tuple(notes)), axes=filled
        )
        return Rendered(files={"": text}, notes=tuple(notes))


def _merged(remarks: Mapping[str, list[str]]) -> list[str]:
    """Return the remarks on all axes; one that is the same for each appears once, without a name.

    >>> _merged({"elbow": ["Check the sign", "3 points"], "knee": ["Check the sign"]})
    ['elbow: 3 points', 'Check the sign']
    """
    first, *others = remarks.values()
    same = [each for each in first if all(each in other for other in others)]
    own = [f"{name}: {each}" for name, some in remarks.items() for each in some if each not in same]
    return [*own, *same]


def identifier(name: str) -> str:
    """Return a name as an identifier of a programming language.

    >>> identifier("arm/joint-3"), identifier("3")
    ('arm_joint_3', 'axis_3')
    """
    plain = "".join(each if each.isascii() and each.isalnum() else "_" for each in name)
    return plain if plain[:1].isalpha() else f"axis_{plain}"
