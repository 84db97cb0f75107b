"""A table of effort over speed, for the feedforward of any drive."""

from stickslip.export.law_table import law_table
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter

_POINTS = 10  # of the table, by default
LAW = (
    "coulomb_friction",
    "viscous_friction",
    "quadratic_friction",
    "two_thirds_friction",
    "low_speed_friction",
    "low_speed_velocity",
)
NO_FALL = {
    "static_friction": "is left out: the table holds at each speed the smallest friction of this "
    "and all higher speeds, as a push of the static friction at rest would make the axis hunt",
    "stribeck_velocity": "is left out, as static friction is",
}
"""Effects that a table without falling friction does not represent."""


def _table(axis: AxisToFill) -> Filling:
    """CSV table of the efforts that hold constant speeds, in both directions."""
    parameters, points = axis.parameters, axis.settings.points
    top = axis.needed("top_speed", "the speed of the last point", "rad/s or m/s")
    table = law_table(parameters, points=_POINTS if points is None else points, top_speed=top)
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
    cannot=NO_FALL,
    ending=".csv",
    several=False,
    options=("points", "top_speed"),
)
