"""Friction as parameters of a Simscape block."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float

from stickslip.export.base import ExportSettings
from stickslip.export.parameters import SLIDING, ExportParameters
from stickslip.export.template_exporter import TemplateExporter, identifier
from stickslip.records import positive

_SLOWEST = 1e-3  # breakaway velocity without a Stribeck effect, over the top speed
_NAMES = {"rotary": ("trq", "Rotational"), "linear": ("frc", "Translational")}


@dataclass(frozen=True, kw_only=True)
class SimscapeExporter(TemplateExporter):
    """MATLAB script that sets a Rotational Friction or Translational Friction block.

    The block smooths friction around zero speed (Eqs. of
    https://www.mathworks.com/help/simscape/ref/rotationalfriction.html), so it never holds: below
    the breakaway velocity a loaded axis creeps. The breakaway velocity is that at which the peak of
    its Stribeck effect has the width of the estimate's.
    """

    name: str = "simscape"
    title: str = "Simscape"
    group: Literal["simulator"] = "simulator"
    template: str = "simscape.m.jinja"
    side: None = None
    represents: tuple[str, ...] = SLIDING
    ending: str = ".m"
    several: bool = False
    options: tuple[str, ...] = ("top_speed",)

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        coulomb, viscous, static, stribeck = parameters.sliding_law(self.title)
        top = 10.0 if settings.top_speed is None else settings.top_speed
        top = positive("top_speed", top, parameters.unit("velocity"))
        if stribeck is None or static == coulomb:
            breakaway = _SLOWEST * top
        else:
            breakaway = stribeck / math.sqrt(2.0)
        short, block = _NAMES[parameters.kind]
        speed = np.concatenate([np.geomspace(1e-3 * breakaway, top, 4000)])
        law = coulomb + viscous * speed
        if stribeck is not None:
            law = law + (static - coulomb) * np.exp(-((speed / stribeck) ** 2))
        deviation = np.abs(smoothed(speed, coulomb, static, viscous, breakaway) - law)
        above = speed >= breakaway
        effort, velocity = parameters.unit("effort"), parameters.unit("velocity")
        notes = [
            f"Largest deviation of the smoothed law: {deviation.max():.3g} {effort} below the "
            f"breakaway velocity of {breakaway:.3g} {velocity}, where the block creeps instead of "
            f"holding, and {deviation[above].max():.3g} {effort} above it"
        ]
        return {
            "identifier": identifier(name),
            "short": short,
            "block": block,
            "static": static,
            "coulomb": coulomb,
            "viscous": viscous,
            "breakaway": breakaway,
        }, notes


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


SIMSCAPE = SimscapeExporter(
    cannot={
        "direction": "is replaced by the mean of both directions",
        "offset": "is left out: add an Ideal Torque Source or Ideal Force Source",
    }
)
