"""Friction as parameters of a Simscape block."""

import math

import numpy as np
from jaxtyping import Float

from stickslip.export.base import MEAN
from stickslip.export.parameters import SLIDING
from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter
from stickslip.records import positive

_SLOWEST = 1e-3  # breakaway velocity without a Stribeck effect, over the top speed
_NAMES = {"rotary": ("trq", "Rotational"), "linear": ("frc", "Translational")}


def _simscape(axis: AxisToFill) -> Filling:
    """MATLAB script that sets a Rotational Friction or Translational Friction block.

    The block smooths friction around zero speed (Eqs. of
    https://www.mathworks.com/help/simscape/ref/rotationalfriction.html), so it never holds: below
    the breakaway velocity a loaded axis creeps. The breakaway velocity is that at which the peak of
    its Stribeck effect has the width of the estimate's.
    """
    parameters, top = axis.parameters, axis.settings.top_speed
    coulomb, viscous, static, stribeck = parameters.sliding_law(axis.title)
    top = positive("top_speed", 10.0 if top is None else top, parameters.unit("velocity"))
    if stribeck is None or static == coulomb:
        breakaway = _SLOWEST * top
    else:
        breakaway = stribeck / math.sqrt(2.0)
    short, block = _NAMES[parameters.kind]
    speed = np.geomspace(1e-3 * breakaway, top, 4000)
    law = coulomb + viscous * speed
    if stribeck is not None:
        law = law + (static - coulomb) * np.exp(-((speed / stribeck) ** 2))
    deviation = np.abs(smoothed(speed, coulomb, static, viscous, breakaway) - law)
    above = speed >= breakaway
    effort, velocity = parameters.unit("effort"), parameters.unit("velocity")
    return {
        "short": short,
        "block": block,
        "static": static,
        "coulomb": coulomb,
        "viscous": viscous,
        "breakaway": breakaway,
    }, [
        f"Largest deviation of the smoothed law: {deviation.max():.3g} {effort} below the "
        f"breakaway velocity of {breakaway:.3g} {velocity}, where the block creeps instead of "
        f"holding, and {deviation[above].max():.3g} {effort} above it"
    ]


def smoothed(
    speed: Float[np.ndarray, " n"],
    coulomb: float,
    static: float,
    viscous: float,
    breakaway: float,
) -> Float[np.ndarray, " n"]:
    """Return the friction of a Simscape friction block [N m or N].

    ``sqrt(2 e) (T_brk - T_C) exp(-(w/w_St)^2) w/w_St + T_C tanh(w/w_Coul) + f w`` with
    ``w_St = sqrt(2) w_brk`` and ``w_Coul = w_brk/10``.
    """
    share = speed / (math.sqrt(2.0) * breakaway)
    peak = math.sqrt(2.0 * math.e) * (static - coulomb) * np.exp(-(share**2)) * share
    return peak + coulomb * np.tanh(10.0 * speed / breakaway) + viscous * speed


SIMSCAPE = TemplateExporter(
    name="simscape",
    title="Simscape",
    values=_simscape,
    template="simscape.m.jinja",
    side=None,
    represents=SLIDING,
    cannot={
        "direction": MEAN,
        "offset": "is left out: add an Ideal Torque Source or Ideal Force Source",
    },
    ending=".m",
    several=False,
    options=("top_speed",),
)
