"""Friction compensation of Bosch Rexroth IndraDrive."""

from stickslip.export.drives.beckhoff import COULOMB_ONLY, rated_effort
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter


def _indradrive(axis: AxisToFill) -> Filling:
    """``S-0-0155, Friction compensation``: a torque that is added in the direction of motion.

    In percent of the rated torque, the default weighting of torque data. Source: IndraDrive
    Functional Description MPH-02, section 8.5 "Friction Torque Compensation", which names
    S-0-0155, S-0-0124 and S-0-0092. The weighting of S-0-0155 is taken from the SERCOS default for
    torque data (S-0-0086) and is not confirmed by that section.
    """
    coulomb = axis.parameters.required("coulomb_friction", axis.title)
    percent = 100.0 * coulomb / rated_effort(axis)
    unit = axis.parameters.unit("coulomb_friction")
    return {"percent": percent, "effort": coulomb, "unit": unit}, [
        "S-0-0155 is in percent of the rated torque; check the weighting of torque data in S-0-0086"
    ]


INDRADRIVE = TemplateExporter(
    name="indradrive",
    title="Rexroth IndraDrive S-0-0155",
    group="drive",
    values=_indradrive,
    template="indradrive.txt.jinja",
    side="motor",
    represents=("coulomb_friction",),
    cannot=COULOMB_ONLY,
    ending=".txt",
    several=False,
    options=("rated_current", "torque_constant"),
)
