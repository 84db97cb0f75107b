"""Friction as a Modelica model of the standard library."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from stickslip.export.base import ExportSettings
from stickslip.export.law_table import falling_table
from stickslip.export.parameters import SLIDING, ExportParameters
from stickslip.export.template_exporter import TemplateExporter, identifier
from stickslip.records import mass_name

_POINTS = 10


@dataclass(frozen=True, kw_only=True)
class ModelicaExporter(TemplateExporter):
    """``BearingFriction`` with an ``Inertia``, or ``MassWithStopAndFriction`` (library 4.0).

    Both stick and break away by events. ``BearingFriction`` has a table of torque over speed, with
    ``peak`` for the static friction. ``MassWithStopAndFriction`` has
    ``F_Coulomb + F_prop v + F_Stribeck exp(-fexp v)``, in which the Gaussian Stribeck effect of the
    estimate is an exponential one that falls to 1/e at the same speed. Source:
    Modelica/Mechanics/Rotational/Components/BearingFriction.mo and
    Translational/Components/MassWithStopAndFriction.mo of
    https://github.com/modelica/ModelicaStandardLibrary.
    """

    name: str = "modelica"
    title: str = "Modelica"
    group: Literal["simulator"] = "simulator"
    template: str = "friction.mo.jinja"
    side: None = None
    represents: tuple[str, ...] = SLIDING
    ending: str = ".mo"
    several: bool = False
    options: tuple[str, ...] = ("points", "top_speed")

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        coulomb, viscous, static, stribeck = parameters.sliding_law(self.title)
        common = {
            "identifier": identifier(name),
            "inertia": parameters.required(mass_name(parameters.kind), self.title),
            "coulomb": coulomb,
            "viscous": viscous,
        }
        if parameters.kind == "linear":
            return self._linear(common, static, stribeck)
        rows, peak, error = [(0.0, coulomb), (1.0, coulomb + viscous)], static / coulomb, 0.0
        if stribeck is not None and static > coulomb:
            points = _POINTS if settings.points is None else settings.points
            top = 10.0 * stribeck if settings.top_speed is None else settings.top_speed
            table = falling_table(parameters, points=points, top_speed=top)
            rows = list(zip(table.speed, table.magnitude, strict=True))
            peak, error = 1.0, table.error
        notes = ["The table goes on beyond its last point along its last line"]
        if error:
            notes.append(f"Largest deviation of the table from the law: {error:.3g} N m")
        return {**common, "rows": rows, "peak": peak}, notes

    def _linear(
        self, common: dict[str, Any], static: float, stribeck: float | None
    ) -> tuple[dict[str, Any], list[str]]:
        excess = static - common["coulomb"]
        if excess == 0.0 or stribeck is None:
            note = [] if excess == 0.0 else ["Static friction is left out: no Stribeck velocity"]
            return {**common, "excess": 0.0, "decay": 1.0}, note
        speed = np.linspace(0.0, 5.0, 501)
        error = excess * float(np.max(np.abs(np.exp(-speed) - np.exp(-(speed**2)))))
        return {**common, "excess": excess, "decay": 1.0 / stribeck}, [
            f"Largest deviation of the exponential Stribeck effect from the law: {error:.3g} N"
        ]


MODELICA = ModelicaExporter(
    cannot={
        "direction": "is replaced by the mean of both directions",
        "offset": "is left out: add a ConstantTorque or ConstantForce of the opposite sign",
    }
)
