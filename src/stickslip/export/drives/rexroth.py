"""Friction compensation of Bosch Rexroth IndraDrive."""

from dataclasses import dataclass
from typing import Any, Literal

from stickslip.export.base import ExportSettings
from stickslip.export.drives.beckhoff import rated_effort
from stickslip.export.parameters import ExportParameters
from stickslip.export.template_exporter import TemplateExporter


@dataclass(frozen=True, kw_only=True)
class IndraDriveExporter(TemplateExporter):
    """``S-0-0155, Friction compensation``: a torque that is added in the direction of motion.

    In percent of the rated torque, the default weighting of torque data. Source: IndraDrive
    Functional Description MPH-02, section 8.5 "Friction Torque Compensation", which names
    S-0-0155, S-0-0124 and S-0-0092. The weighting of S-0-0155 is taken from the SERCOS default for
    torque data (S-0-0086) and is not confirmed by that section.
    """

    name: str = "indradrive"
    title: str = "Rexroth IndraDrive S-0-0155"
    group: Literal["drive"] = "drive"
    template: str = "indradrive.txt.jinja"
    side: Literal["motor"] = "motor"
    represents: tuple[str, ...] = ("coulomb_friction",)
    ending: str = ".txt"
    several: bool = False
    options: tuple[str, ...] = ("rated_current", "torque_constant")

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name
        coulomb = parameters.required("coulomb_friction", self.title)
        percent = 100.0 * coulomb / rated_effort(settings, self.title)
        unit = parameters.unit("coulomb_friction")
        return {"percent": percent, "effort": coulomb, "unit": unit}, [
            "S-0-0155 is in percent of the rated torque; check the weighting of torque data in "
            "S-0-0086"
        ]


INDRADRIVE = IndraDriveExporter(
    cannot={
        "direction": "is replaced by the mean of both directions",
        "offset": "is left out: the compensation follows the direction of motion",
        "static_friction": "is left out: the drive gets the Coulomb friction, as a push of the "
        "static friction would make the axis hunt",
        "viscous_friction": "is left out: the compensation does not rise with speed",
    }
)
