"""``stickslip export fmu``, ``fmu-arm``, ``fmu-observer``: functional mock-up units (FMI)."""

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from stickslip.export.base import (
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Group,
    Rendered,
    only_axis,
)
from stickslip.export.templates import heading, notes_on
from stickslip.export.transmission import Side
from stickslip.records import InputError, mass_name, unit_of

if TYPE_CHECKING:
    from stickslip.export.c.content import CodeContent
    from stickslip.export.fmu.model import FmuModel

_PLANT = ("coulomb_friction", "static_friction", "viscous_friction", "offset")
_COMMON = ("fmi_version", "binaries", "sampling_time")


@dataclass(frozen=True, kw_only=True)
class FmuExporter(Exporter):
    """A functional mock-up unit for co-simulation: a plant, or the estimator that observes one."""

    model: Literal["axis", "arm", "observer"]
    group: Group = "code"
    side: Side | None = None
    ending: str = ".fmu"
    several: bool = False
    options: tuple[str, ...] = _COMMON

    def render(
        self, axes: Axes, settings: ExportSettings, into: FileToEdit | None = None
    ) -> Rendered:
        """Return the file; see `Exporter.render`."""
        from stickslip.export.c.content import derived_content, online_estimator
        from stickslip.export.fmu.archive import archive

        del into
        name, parameters = only_axis(axes, self.title)
        inertia = parameters.inertia
        if inertia is None:
            raise InputError("fmu_without_inertia", where=parameters.source.file)
        banner = parameters.source.text.replace("*/", "* /")
        content = derived_content(
            name, parameters, sampling_time=settings.sampling_time, banner=banner
        ).content
        notes = [] if settings.sampling_time else [_DEFAULT.format(content.sampling_time)]
        if self.model == "observer":
            notes.append(
                f"Each communication step is one sample of {content.sampling_time:g} s; effort and "
                "position are read, and a value that is NaN is taken as missing"
            )
        else:
            notes.append(
                f"A communication step must be a whole number of samples of "
                f"{content.sampling_time:g} s; the effort is held over it"
            )
        content = replace(content, energy=online_estimator(parameters, inertia))
        model = self._model(content, inertia, settings)
        notes_made = notes_on(self, axes, *notes)
        file = archive(
            model,
            settings.fmi_version or "2.0",
            settings.binaries or "all",
            banner,
            heading(self, axes, notes_made),
        )
        return Rendered(files={"": file}, notes=notes_made)

    def _model(
        self, content: "CodeContent", inertia: float, settings: ExportSettings
    ) -> "FmuModel":
        from stickslip.export.fmu.model import observer_model, plant_model
        from stickslip.plants import FlexibleArm, SingleMass

        if self.model == "observer":
            return observer_model(content, content.banner)
        law, kind = content.law.affine, content.kind
        plant: SingleMass | FlexibleArm = SingleMass(mass=inertia, friction=law, kind=kind)
        if self.model == "arm":
            load, stiffness = settings.load_inertia, settings.stiffness
            if load is None or stiffness is None:
                missing = "load_inertia" if load is None else "stiffness"
                raise InputError(
                    "option_needed", title=self.title, name=missing, meaning=_NEEDED[missing]
                )
            if not 0.0 < load < inertia:
                raise InputError(
                    "load_of_whole_inertia",
                    name="load_inertia",
                    value=load,
                    limit=inertia,
                    unit=unit_of(mass_name(kind), kind),
                )
            plant = FlexibleArm(
                mass_1=inertia - load, mass_2=load, stiffness=stiffness, friction=law, kind=kind
            )
        return plant_model(content.axis, plant, content.sampling_time, content.banner)


_DEFAULT = "The sampling time is {:g} s, the default"
_NEEDED = {
    "load_inertia": "the part of the identified inertia that moves behind the spring",
    "stiffness": "that of the spring to the load",
}
_WITHOUT_STRIBECK = {
    "stribeck_velocity": "is left out: motion begins at the static and goes on with the Coulomb "
    "friction"
}
AXIS = FmuExporter(
    name="fmu",
    title="Functional mock-up unit (FMI) of the rigid axis",
    model="axis",
    represents=("mass", "inertia", *_PLANT),
    cannot=_WITHOUT_STRIBECK,
)
ARM = FmuExporter(
    name="fmu-arm",
    title="Functional mock-up unit (FMI) of the axis with a load on a spring",
    model="arm",
    represents=("mass", "inertia", *_PLANT),
    cannot=_WITHOUT_STRIBECK,
    options=(*_COMMON, "load_inertia", "stiffness"),
)
OBSERVER = FmuExporter(
    name="fmu-observer",
    title="Functional mock-up unit (FMI) of the online energy estimator",
    model="observer",
    represents=("mass", "inertia"),
    cannot=dict.fromkeys(
        ("coulomb_friction", "viscous_friction"), "is not written: the unit estimates it"
    ),
)
