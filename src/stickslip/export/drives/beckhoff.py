"""Friction compensation of Beckhoff drives and of TwinCAT CNC."""

import math
import struct
from dataclasses import dataclass
from typing import Any, Literal

from stickslip.export.base import ExportSettings
from stickslip.export.drives.table import FALLING, LAW
from stickslip.export.law_table import law_table
from stickslip.export.parameters import ExportParameters
from stickslip.export.template_exporter import TemplateExporter
from stickslip.records import InputError, positive

_MEAN = "is replaced by the mean of both directions"
_OFFSET = "is left out: the compensation follows the direction of motion"
_PEAK = (
    "is left out: the drive gets the Coulomb friction, as a push of the static friction would make "
    "the axis hunt"
)
_CNC_POINTS = 20  # default of P-COMP-00062
_LEAST_SPEED = 1e-3  # of the first point, over the top speed: the CNC requires speeds above 0
_VSTFR = 10.0  # rpm


@dataclass(frozen=True, kw_only=True)
class Ax8000Exporter(TemplateExporter):
    """Start-up list of AX8000: object 0x3144 (channel A), 0x3544 (channel B).

    Subindex 1 is the spring rate of the static friction [N m/rad], 2 its torque [N m], 3 the
    dynamic friction factor [N m s/rad], all REAL32, of the motor. Source:
    https://infosys.beckhoff.com/content/1033/ax8xxx_object/11604904587.html and the pages after it.
    """

    name: str = "ax8000"
    title: str = "Beckhoff AX8000 start-up list"
    group: Literal["drive"] = "drive"
    template: str = "ax8000.csv.jinja"
    side: Literal["motor"] = "motor"
    represents: tuple[str, ...] = (
        "coulomb_friction",
        "viscous_friction",
        "presliding_friction",
        "presliding_distance",
    )
    ending: str = ".csv"
    several: bool = False

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name, settings
        rows: list[tuple[int, float, str, str]] = []
        notes: list[str] = []
        friction, distance = (
            parameters.mean("presliding_friction"),
            parameters.mean("presliding_distance"),
        )
        if friction is not None and distance:
            rows.append((1, abs(friction) / distance, "N m/rad", "Static friction spring rate"))
        else:
            notes.append("The spring rate (0x3144:01) is not written: no presliding was identified")
        for subindex, quantity, unit, meaning in (
            (2, "coulomb_friction", "N m", "Static friction torque/force"),
            (3, "viscous_friction", "N m s/rad", "Dynamic friction factor"),
        ):
            if (value := parameters.mean(quantity)) is not None:
                rows.append((subindex, value, unit, meaning))
        filled = [
            (index, value, struct.pack("<f", value).hex(), unit, meaning)
            for index, value, unit, meaning in rows
        ]
        return {"rows": filled}, notes


@dataclass(frozen=True, kw_only=True)
class TwinCatCncExporter(TemplateExporter):
    """``frict_comp`` of the compensation list of an axis, at most 20 points.

    Speeds are those of the axis, in um/s or 0.001 deg/s. The output is a motor current in the units
    of the drive, here 0.1 % of the rated current, as SERCOS and CANopen drives scale torque by
    default. Source: P-COMP-00041, 42, 46, 47 and 62 in
    https://infosys.beckhoff.com/content/1033/tf5200_axis_compensation_parameters/113455883.html.
    """

    name: str = "twincat-cnc"
    title: str = "TwinCAT CNC friction table"
    group: Literal["drive"] = "drive"
    template: str = "frict_comp.lis.jinja"
    represents: tuple[str, ...] = LAW
    ending: str = ".lis"
    several: bool = False
    options: tuple[str, ...] = ("points", "top_speed", "rated_current", "torque_constant")

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name
        points = _CNC_POINTS if settings.points is None else settings.points
        if points > _CNC_POINTS:
            raise InputError("points_range", name="points", value=points, limit=_CNC_POINTS)
        top = needed(settings.top_speed, "top_speed", "the speed of the last point", self.title)
        table = law_table(parameters, points=points, top_speed=top, least_speed=_LEAST_SPEED * top)
        rated = rated_effort(settings, self.title)
        ratio = parameters.transmission.ratio()
        share = 1000.0 / (rated * (1.0 if ratio is None else abs(ratio)))  # of joint effort
        unit = 1e6 if parameters.kind == "linear" else 1e3 * 180.0 / math.pi
        notes = [
            f"Largest deviation of linear interpolation: {table.error:.3g} "
            f"{parameters.unit('effort')}",
            "table[].out is in 0.1 % of the rated current; check the scaling of the drive "
            "(dig_drv.act_torque)",
            "The list is active with lr_param.frict_comp 1 (P-AXIS-00522)",
        ]
        if ratio is None:
            notes.append("No gear ratio was given: the motor drives the axis directly")
        rows = list(zip(table.speed * unit, table.magnitude * share, strict=True))
        speeds = "um/s" if parameters.kind == "linear" else "0.001 deg/s"
        return {"rows": rows, "speed_unit": speeds}, notes


@dataclass(frozen=True, kw_only=True)
class Ax2000Exporter(TemplateExporter):
    """``ISTFR`` [A] and ``VSTFR`` [rpm] of AX2000.

    The additional current rises linearly to ISTFR at the speed VSTFR and is constant above it.
    Source: https://infosys.beckhoff.com/content/1033/ax2000_ascii/15075474571.html (ISTFR) and
    15075995787.html (VSTFR). The pages do not state whether ISTFR is an RMS or a peak current.
    """

    name: str = "ax2000"
    title: str = "Beckhoff AX2000"
    group: Literal["drive"] = "drive"
    template: str = "ax2000.txt.jinja"
    side: Literal["motor"] = "motor"
    represents: tuple[str, ...] = ("coulomb_friction",)
    ending: str = ".txt"
    several: bool = False
    options: tuple[str, ...] = ("torque_constant",)

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        del name
        constant = needed(
            settings.torque_constant,
            "torque_constant",
            "the motor's torque per current",
            self.title,
        )
        current = parameters.required("coulomb_friction", self.title) / constant
        return {"current": current, "speed": _VSTFR}, [
            f"VSTFR is not identified: {_VSTFR:g} rpm is a start; raise it if the axis is noisy at "
            "rest"
        ]


def needed(value: float | None, name: str, meaning: str, title: str) -> float:
    """Return an option that a target needs, which must be positive."""
    if value is None:
        raise InputError("option_needed", title=title, name=name, meaning=meaning)
    return positive(name, value, "")


def rated_effort(settings: ExportSettings, title: str) -> float:
    """Return the torque or force of the motor at its rated current [N m or N]."""
    constant = needed(
        settings.torque_constant, "torque_constant", "the motor's torque per current", title
    )
    return constant * needed(
        settings.rated_current, "rated_current", "the rated current of the motor", title
    )


AX8000 = Ax8000Exporter(cannot={"direction": _MEAN, "offset": _OFFSET, "static_friction": _PEAK})
TWINCAT_CNC = TwinCatCncExporter(
    cannot={
        "direction": _MEAN,
        "offset": _OFFSET,
        "static_friction": FALLING,
        "stribeck_velocity": FALLING,
    }
)
AX2000 = Ax2000Exporter(
    cannot={
        "direction": _MEAN,
        "offset": _OFFSET,
        "static_friction": _PEAK,
        "viscous_friction": "is left out: the compensation does not rise with speed",
    }
)
