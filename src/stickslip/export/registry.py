"""The registry of exporters. ``docs/contributing.md`` has the steps to add one."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from stickslip.export.base import Exporter, choices
from stickslip.records import InputError


@cache
def exporters() -> Mapping[str, Exporter]:
    """Return every exporter by its name, in the order of the overview."""
    from stickslip.export.c.target import CodeExporter
    from stickslip.export.drives.beckhoff import AX2000, AX8000, TWINCAT_CNC
    from stickslip.export.drives.rexroth import INDRADRIVE
    from stickslip.export.drives.table import TABLE
    from stickslip.export.fmu.target import ARM, AXIS, OBSERVER
    from stickslip.export.randomisation.ranges import ISAAC_LAB_EVENTS, MJLAB_EVENTS, RANGES
    from stickslip.export.robots.mjcf import MjcfExporter
    from stickslip.export.robots.sdf import SDF
    from stickslip.export.robots.urdf import URDF
    from stickslip.export.robots.usd import UsdExporter
    from stickslip.export.simulators.modelica import MODELICA
    from stickslip.export.simulators.python_control import PYTHON_CONTROL
    from stickslip.export.simulators.robots import DRAKE, GENESIS, ISAAC_LAB
    from stickslip.export.simulators.simscape import SIMSCAPE

    every: tuple[Exporter, ...] = (
        URDF,
        SDF,
        MjcfExporter(),
        UsdExporter(),
        ISAAC_LAB,
        GENESIS,
        DRAKE,
        MODELICA,
        SIMSCAPE,
        PYTHON_CONTROL,
        TABLE,
        AX8000,
        AX2000,
        TWINCAT_CNC,
        INDRADRIVE,
        RANGES,
        ISAAC_LAB_EVENTS,
        MJLAB_EVENTS,
        CodeExporter(),
        AXIS,
        ARM,
        OBSERVER,
    )
    return MappingProxyType({each.name: each for each in every})


def targets() -> dict[str, str]:
    """Return the title of every target by its name.

    Examples
    --------
    >>> targets()["urdf"]
    'URDF'
    """
    return {name: each.title for name, each in exporters().items()}


def exporter(name: str) -> Exporter:
    """Return an exporter by its name; an unknown one is an InputError."""
    found = exporters().get(name)
    if found is None:
        raise InputError(
            "not_a_choice", name="target", value=name, choices=choices(name, exporters())
        )
    return found
