"""Friction compensation of Beckhoff drives and of TwinCAT CNC."""

import math
import struct

import numpy as np

from stickslip.export.base import MEAN
from stickslip.export.drives.table import LAW, NO_FALL
from stickslip.export.law_table import law_table
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter
from stickslip.records import InputError

_IN_ANY = {
    "direction": MEAN,
    "offset": "is left out: the compensation follows the direction of motion",
}
_NO_PEAK = _IN_ANY | {
    "static_friction": "is left out: the drive gets the Coulomb friction, as a push of the static "
    "friction would make the axis hunt"
}
COULOMB_ONLY = _NO_PEAK | {
    "viscous_friction": "is left out: the compensation does not rise with speed"
}
"""Effects beside the Coulomb friction that a compensation does not represent."""

_CNC_POINTS = 20  # default of P-COMP-00062
_LEAST_SPEED = 1e-3  # of the first point, over the top speed: the CNC requires speeds above 0
_VSTFR = 10.0  # rpm


def _ax8000(axis: AxisToFill) -> Filling:
    """Start-up list of AX8000: object 0x3144 (channel A), 0x3544 (channel B).

    Subindex 1 is the spring rate of the static friction [N m/rad], 2 its torque [N m], 3 the
    dynamic friction factor [N m s/rad], all REAL32, of the motor; of a linear motor with N and m.
    Source: https://infosys.beckhoff.com/content/1033/ax8xxx_object/11604904587.html and the pages
    after it.
    """
    mean = axis.parameters.mean
    friction, distance = mean("presliding_friction"), mean("presliding_distance")
    rate = abs(friction) / distance if friction is not None and distance else None
    unit_of = axis.parameters.unit
    rows = [
        (subindex, value, struct.pack("<f", value).hex(), unit, meaning)
        for subindex, value, unit, meaning in (
            (1, rate, unit_of("stiffness"), "Static friction spring rate"),
            (2, mean("coulomb_friction"), unit_of("effort"), "Static friction torque/force"),
            (3, mean("viscous_friction"), unit_of("viscous_friction"), "Dynamic friction factor"),
        )
        if value is not None
    ]
    missing = "The spring rate (0x3144:01) is not written: no presliding was identified"
    return {"rows": rows}, [missing] if rate is None else []


def _twincat_cnc(axis: AxisToFill) -> Filling:
    """``frict_comp`` of the compensation list of an axis, at most 20 points.

    Speeds are those of the axis, in um/s or 0.001 deg/s. The output is a motor current in the units
    of the drive, here 0.1 % of the rated current, as SERCOS and CANopen drives scale torque by
    default. Source: P-COMP-00041, 42, 46, 47 and 62 in
    https://infosys.beckhoff.com/content/1033/tf5200_axis_compensation_parameters/113455883.html.
    """
    parameters, points = axis.parameters, axis.settings.points
    points = _CNC_POINTS if points is None else points
    if points > _CNC_POINTS:
        raise InputError(
            "out_of_range", name="points", value=points, least=2, most=_CNC_POINTS, unit=""
        )
    top = axis.needed("top_speed", "the speed of the last point")
    table = law_table(parameters, points=points, top_speed=top, least_speed=_LEAST_SPEED * top)
    ratio = parameters.transmission.ratio()
    share = 1000.0 / (rated_effort(axis) * (1.0 if ratio is None else abs(ratio)))  # joint effort
    linear = parameters.kind == "linear"
    unit = 1e6 if linear else 1e3 * 180.0 / math.pi
    speeds, shares = np.round(table.speed * unit), np.round(table.magnitude * share)
    rounding = np.abs(np.interp(speeds / unit, table.speed, table.magnitude) - shares / share)
    error = table.error + float(np.max(rounding))
    notes = [
        "Largest deviation of linear interpolation, with the rounding to whole numbers: "
        f"{error:.2g} {parameters.unit('effort')}",
        "table[].out is in 0.1 % of the rated current; check the scaling of the drive "
        "(dig_drv.act_torque)",
        "The list is active with lr_param.frict_comp 1 (P-AXIS-00522)",
    ]
    if ratio is None:
        notes.append("No gear ratio was given: the motor drives the axis directly")
    rising = np.diff(speeds, prepend=0.0) > 0.0  # low speeds may round to the same number
    rows = list(zip(speeds[rising], shares[rising], strict=True))
    return {"rows": rows, "speed_unit": "um/s" if linear else "0.001 deg/s"}, notes


def _ax2000(axis: AxisToFill) -> Filling:
    """``ISTFR`` [A] and ``VSTFR`` [rpm] of AX2000.

    The additional current rises linearly to ISTFR at the speed VSTFR and is constant above it.
    Source: https://infosys.beckhoff.com/content/1033/ax2000_ascii/15075474571.html (ISTFR) and
    15075995787.html (VSTFR). The pages do not state whether ISTFR is an RMS or a peak current.
    """
    constant = _torque_constant(axis)
    current = axis.parameters.required("coulomb_friction", axis.title) / constant
    return {"current": current, "speed": _VSTFR}, [
        f"VSTFR is not identified: {_VSTFR:g} rpm is a start; raise it if the axis is noisy at rest"
    ]


def _torque_constant(axis: AxisToFill) -> float:
    return axis.needed("torque_constant", "the motor's torque per current")


def rated_effort(axis: AxisToFill) -> float:
    """Return the torque or force of the motor at its rated current [N m or N]."""
    constant = _torque_constant(axis)
    return constant * axis.needed("rated_current", "the rated current of the motor")


AX8000 = TemplateExporter(
    name="ax8000",
    title="Beckhoff AX8000 start-up list",
    group="drive",
    values=_ax8000,
    template="ax8000.csv.jinja",
    side="motor",
    represents=(
        "coulomb_friction",
        "viscous_friction",
        "presliding_friction",
        "presliding_distance",
    ),
    cannot=_NO_PEAK,
    ending=".csv",
    several=False,
)
TWINCAT_CNC = TemplateExporter(
    name="twincat-cnc",
    title="TwinCAT CNC friction table",
    group="drive",
    values=_twincat_cnc,
    template="frict_comp.lis.jinja",
    represents=LAW,
    cannot=_IN_ANY | NO_FALL,
    ending=".lis",
    several=False,
    options=("points", "top_speed", "rated_current", "torque_constant"),
)
AX2000 = TemplateExporter(
    name="ax2000",
    title="Beckhoff AX2000",
    group="drive",
    values=_ax2000,
    template="ax2000.txt.jinja",
    side="motor",
    represents=("coulomb_friction",),
    cannot=COULOMB_ONLY,
    ending=".txt",
    several=False,
    options=("torque_constant",),
)
