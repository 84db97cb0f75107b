"""The registry of exporters. ``docs/contributing.md`` has the steps to add one."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from stickslip.export.base import Exporter
from stickslip.input_files import nearest
from stickslip.records import InputError


@cache
def exporters() -> Mapping[str, Exporter]:
    """Return every exporter by its name, in the order of the overview."""
    from stickslip.export.robots.urdf import UrdfExporter

    every: tuple[Exporter, ...] = (UrdfExporter(),)
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
    """Return an exporter by its name.

    Raises
    ------
    InputError
        If there is no such target.
    """
    found = exporters().get(name)
    if found is None:
        near = nearest(name, exporters())
        known = ", ".join(exporters())
        raise InputError(
            f"{name!r} is not a target of exports",
            remedy=f"did you mean {near}?" if near else f"the targets are: {known}",
        )
    return found
