"""A table of effort over speed, for the feedforward of any drive."""

from stickslip.export.law_table import table_of
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter

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
AS_STATIC = "is left out, as static friction is"


def _table(axis: AxisToFill) -> Filling:
    """CSV table of the efforts that hold constant speeds, in both directions."""
    parameters = axis.parameters
    table = table_of(parameters, axis.settings, axis.title, default_points=10)
    unit, speed = parameters.unit("effort"), parameters.unit("velocity")
    notes = [f"Largest deviation of linear interpolation: {table.error:.3g} {unit}"]
    if table.flat_below > 0.0:
        notes.append(
            f"Below {table.flat_below:.3g} {speed} the table is at the minimum of the friction"
        )
    rows = list(zip(table.speed, table.forward, table.backward, strict=True))
    return {"rows": rows, "speed": speed, "effort": unit}, notes


TABLE = TemplateExporter(
    name="table",
    title="Table of effort over speed",
    group="drive",
    values=_table,
    template="table.csv.jinja",
    side=None,
    represents=(*LAW, "offset"),
    cannot={"static_friction": FALLING, "stribeck_velocity": AS_STATIC},
    ending=".csv",
    several=False,
    options=("points", "top_speed"),
)
