"""Friction as a sampled nonlinear system of python-control."""

from dataclasses import dataclass
from typing import Any, Literal

from stickslip.export.base import ExportSettings
from stickslip.export.parameters import ExportParameters
from stickslip.export.template_exporter import TemplateExporter, identifier
from stickslip.records import InputError, mass_name, positive


@dataclass(frozen=True, kw_only=True)
class PythonControlExporter(TemplateExporter):
    """``nlsys`` with the exact step of an axis under an effort that is held over each sample.

    Coulomb, viscous and static friction of each direction and the offset: the axis moves
    exponentially between the instants at which it stops, sticks or turns, which are found inside
    the sample. Source of ``nlsys``:
    https://python-control.readthedocs.io/en/latest/generated/control.nlsys.html.
    """

    name: str = "python-control"
    title: str = "python-control"
    group: Literal["simulator"] = "simulator"
    template: str = "python_control.py.jinja"
    side: None = None
    represents: tuple[str, ...] = (
        "coulomb_friction",
        "viscous_friction",
        "static_friction",
        "offset",
    )
    several: bool = False
    options: tuple[str, ...] = ("sampling_time",)

    def values(
        self, name: str, parameters: ExportParameters, settings: ExportSettings
    ) -> tuple[dict[str, Any], list[str]]:
        """Return what the template needs of an axis, and what to say of it."""
        if settings.sampling_time is None:
            raise InputError(
                "option_needed",
                title=self.title,
                name="sampling_time",
                meaning="over which the effort is held",
            )
        coulomb = parameters.pair("coulomb_friction") or (0.0, 0.0)
        static = parameters.pair("static_friction") or coulomb
        # Friction per direction contains the offset
        inside = "offset" not in parameters.values and parameters.directional("coulomb_friction")
        offset = parameters.offset
        own = offset if inside else 0.0
        coulomb = coulomb[0] - own, coulomb[1] + own
        static = max(coulomb[0], static[0] - own), max(coulomb[1], static[1] + own)
        return {
            "identifier": identifier(name),
            "units": {each: parameters.unit(each) for each in ("position", "velocity", "effort")},
            "sampling_time": positive("sampling_time", settings.sampling_time, "s"),
            "inertia": parameters.required(mass_name(parameters.kind), self.title),
            "offset": offset,
            "coulomb": coulomb,
            "static": static,
            "viscous": parameters.pair("viscous_friction") or (0.0, 0.0),
        }, []


PYTHON_CONTROL = PythonControlExporter(
    cannot={
        "stribeck_velocity": "is left out, as the exact step has no Stribeck effect: friction is "
        "the Coulomb friction as soon as the axis moves"
    }
)
