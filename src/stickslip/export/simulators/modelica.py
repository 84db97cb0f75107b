"""Friction as a Modelica model of the standard library."""

from typing import Any

import numpy as np

from stickslip.export.base import MEAN
from stickslip.export.law_table import law_table
from stickslip.export.parameters import SLIDING
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter
from stickslip.records import mass_name

_POINTS = 10  # of the table, by default


def _modelica(axis: AxisToFill) -> Filling:
    """``BearingFriction`` with an ``Inertia``, or ``MassWithStopAndFriction`` (library 4.0).

    Both stick and break away by events. ``BearingFriction`` has a table of torque over speed, with
    ``peak`` for the static friction. ``MassWithStopAndFriction`` has
    ``F_Coulomb + F_prop v + F_Stribeck exp(-fexp v)``, in which the Gaussian Stribeck effect of the
    estimate is an exponential one that falls to 1/e at the same speed. Source:
    Modelica/Mechanics/Rotational/Components/BearingFriction.mo and
    Translational/Components/MassWithStopAndFriction.mo of
    https://github.com/modelica/ModelicaStandardLibrary.
    """
    parameters, settings = axis.parameters, axis.settings
    coulomb, viscous, static, stribeck = parameters.sliding_law(axis.title)
    common = {
        "inertia": parameters.required(mass_name(parameters.kind), axis.title),
        "coulomb": coulomb,
        "viscous": viscous,
    }
    if parameters.kind == "linear":
        return _linear(common, static, stribeck)
    rows, peak, error = [(0.0, coulomb), (1.0, coulomb + viscous)], static / coulomb, 0.0
    if stribeck is not None and static > coulomb:
        points = _POINTS if settings.points is None else settings.points
        top = 10.0 * stribeck if settings.top_speed is None else settings.top_speed
        table = law_table(parameters, points=points, top_speed=top, falling=True)
        rows = list(zip(table.speed, table.magnitude, strict=True))
        peak, error = 1.0, table.error
    notes = ["The table goes on beyond its last point along its last line"]
    if error:
        notes.append(f"Largest deviation of the table from the law: {error:.3g} N m")
    return {**common, "rows": rows, "peak": peak}, notes


def _linear(common: dict[str, Any], static: float, stribeck: float | None) -> Filling:
    excess = static - common["coulomb"]
    if excess == 0.0 or stribeck is None:
        note = [] if excess == 0.0 else ["Static friction is left out: no Stribeck velocity"]
        return {**common, "excess": 0.0, "decay": 1.0}, note
    speed = np.linspace(0.0, 5.0, 501)
    error = excess * float(np.max(np.abs(np.exp(-speed) - np.exp(-(speed**2)))))
    return {**common, "excess": excess, "decay": 1.0 / stribeck}, [
        f"Largest deviation of the exponential Stribeck effect from the law: {error:.3g} N"
    ]


MODELICA = TemplateExporter(
    name="modelica",
    title="Modelica",
    values=_modelica,
    template="friction.mo.jinja",
    side=None,
    represents=("mass", "inertia", *SLIDING),
    cannot={
        "direction": MEAN,
        "offset": "is left out: add a ConstantTorque or ConstantForce of the opposite sign",
    },
    ending=".mo",
    several=False,
    options=("points", "top_speed"),
)
