"""A table of effort over speed, for the feedforward of any drive."""

from dataclasses import dataclass
from typing import Any, Literal

from stickslip.export.base import ExportSettings
from stickslip.export.law_table import table_of
from stickslip.export.parameters import ExportParameters
from stickslip.export.template_exporter import TemplateExporter

LAW = (
    "coulomb_friction",
    "viscous_friction",
    "quadratic_friction",
    "two_thirds_friction",
    "low_speed_friction",
    "low_speed_velocity",
)
FALLING = (
    "is left out: the table holds at each speed the smallest friction of this and all higher "
    "speeds, as a push of the static friction at rest would make the axis hunt"
)


@dataclass(frozen=True, kw_only=True)
class TableExporter(TemplateExporter):
    """CSV table of the efforts that hold constant speeds, in both directions."""

    name: str = "table"
    title: str = "Table of effort over speed"
    group: Literal["drive"] = "drive"
    template: str = "table.csv.jinja"
    side: None = None
    represents: tuple[str, ...] = (*LAW, "offset")
    ending: str = ".csv"
    several: bool = False
    options: tuple[str, ...] = ("points", "top_speed")

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name
        table = table_of(parameters, settings, self.title, default_points=10)
        unit = parameters.unit("effort")
        notes = [f"Largest deviation of linear interpolation: {table.error:.3g} {unit}"]
        if table.flat_below > 0.0:
            speed = parameters.unit("velocity")
            notes.append(
                f"Below {table.flat_below:.3g} {speed} the table is at the minimum of the friction"
            )
        rows = list(zip(table.speed, table.forward, table.backward, strict=True))
        return {"rows": rows, "speed": parameters.unit("velocity"), "effort": unit}, notes


TABLE = TableExporter(cannot={"static_friction": FALLING, "stribeck_velocity": FALLING})
