"""Friction as a sampled nonlinear system of python-control."""

from stickslip.export.template_exporter import AxisToFill, Filling, TemplateExporter
from stickslip.records import mass_name


def _python_control(axis: AxisToFill) -> Filling:
    """``nlsys`` with the exact step of an axis under an effort that is held over each sample.

    Coulomb, viscous and static friction of each direction and the offset: the axis moves
    exponentially between the instants at which it stops, sticks or turns, which are found inside
    the sample. Source of ``nlsys``:
    https://python-control.readthedocs.io/en/latest/generated/control.nlsys.html.
    """
    parameters = axis.parameters
    sampling_time = axis.needed("sampling_time", "over which the effort is held", "s")
    coulomb = parameters.pair("coulomb_friction") or (0.0, 0.0)
    static = parameters.pair("static_friction") or coulomb
    # Friction per direction contains the offset
    inside = "offset" not in parameters.values and parameters.directional("coulomb_friction")
    offset = parameters.offset
    own = offset if inside else 0.0
    coulomb = coulomb[0] - own, coulomb[1] + own
    static = max(coulomb[0], static[0] - own), max(coulomb[1], static[1] + own)
    return {
        "units": {each: parameters.unit(each) for each in ("position", "velocity", "effort")},
        "sampling_time": sampling_time,
        "inertia": parameters.required(mass_name(parameters.kind), axis.title),
        "offset": offset,
        "coulomb": coulomb,
        "static": static,
        "viscous": parameters.pair("viscous_friction") or (0.0, 0.0),
    }, []


PYTHON_CONTROL = TemplateExporter(
    name="python-control",
    title="python-control",
    values=_python_control,
    template="python_control.py.jinja",
    side=None,
    represents=(
        "mass",
        "inertia",
        "coulomb_friction",
        "viscous_friction",
        "static_friction",
        "offset",
    ),
    cannot={
        "stribeck_velocity": "is left out, as the exact step has no Stribeck effect: friction is "
        "the Coulomb friction as soon as the axis moves"
    },
    several=False,
    options=("sampling_time",),
)
