"""Render and write an estimate for a target."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import partial
from pathlib import Path, PurePosixPath

from stickslip.export.base import (
    DEFAULT_AXIS,
    Axes,
    Exporter,
    ExportSettings,
    FileToEdit,
    Rendered,
    prefix,
    quantities_used,
)
from stickslip.export.parameters import ExportParameters
from stickslip.export.reading import (
    Estimate,
    EstimateReading,
    axes_in,
    document_of,
    in_si_units,
    not_identified,
)
from stickslip.export.registry import exporter as exporter_named
from stickslip.export.registry import exporters
from stickslip.input_files import bytes_of
from stickslip.outputs import files_at_once, write_whole
from stickslip.records import InputError, Status


@dataclass(frozen=True, kw_only=True)
class Export:
    """A rendered export, with its warnings."""

    target: str  #: Name of the target.
    rendered: Rendered  #: The files, and the notes on them.
    #: Values that were written against their verdict, and those that were withheld.
    warnings: tuple[str, ...]
    #: Whether the estimate can be trusted and every value that the target holds was written.
    complete: bool


def render(
    estimate: Estimate,
    target: str,
    *,
    into: FileToEdit | str | bytes | None = None,
    joint: str | None = None,
    reading: EstimateReading | None = None,
    settings: ExportSettings | None = None,
) -> Export:
    """Return what an export of an estimate writes.

    Parameters
    ----------
    estimate
        An estimate or a result of `stickslip.identify`, the JSON document of one axis or of a
        whole robot, or the path of its file.
    target
        One of `targets`.
    into
        The file to edit, or its content.
    joint
        Name of the joint that the axis is; None for the name of the axis.
    reading
        Side, ratio and units of the estimate, which axis, and whether to write by force.
    settings
        Of the target.

    Raises
    ------
    InputError
        If the estimate cannot be read, nothing in it was identified, or the target cannot hold it.
    """
    exporter = exporter_named(target)
    settings = settings or ExportSettings()
    if isinstance(into, str | bytes):
        into = FileToEdit(content=into.encode() if isinstance(into, str) else into)
    _check_options(exporter, settings)
    if exporter.edits == "never" and into is not None:
        raise InputError("not_edited", title=exporter.title)
    if exporter.edits == "always" and into is None:
        raise InputError("file_to_edit_missing", title=exporter.title)
    document, where = document_of(estimate)
    reading = reading or EstimateReading()
    axes = axes_in(document, where, reading)
    used = "torque_constant" in exporter.options or not in_si_units(document)
    if reading.torque_constant is not None and not used:
        raise InputError("torque_constant_unused", where=where, title=exporter.title)
    without = not_identified(document) if reading.axis is None else {}
    if exporter.edits == "always" and joint is None and "" in axes:
        raise InputError(
            "option_needed",
            title=exporter.title,
            name="joint",
            meaning="the joint that the axis is",
        )
    axes = _named(axes, joint)
    axes = {name: each.on(exporter.side) for name, each in axes.items()}
    for name, each in axes.items():
        _check_values(exporter, name, each)
    try:
        rendered = exporter.render(axes, settings, into)
    except InputError as error:
        path = None if into is None else into.path
        raise error if error.where or path is None else error.at(str(path)) from None
    warnings = tuple(
        prefix(name, axes) + sentence
        for name, each in axes.items()
        for sentence in (
            *each.warnings(quantities_used(exporter)),
            *each.missing(exporter.represents),
        )
    ) + tuple(f"{name} is not written: {reason}" for name, reason in without.items())
    trusted = all(each.source.status is Status.OK for each in axes.values())
    return Export(
        target=target, rendered=rendered, warnings=warnings, complete=trusted and not warnings
    )


def write(
    estimate: Estimate,
    target: str,
    out: Path | str,
    *,
    into: Path | str | None = None,
    joint: str | None = None,
    reading: EstimateReading | None = None,
    settings: ExportSettings | None = None,
) -> Export:
    """Write an estimate for a target.

    Parameters
    ----------
    estimate, target, joint, reading, settings
        See `render`.
    out
        The file to write, or the folder of a target of several files.
    into
        The file to edit, which may be ``out`` itself.

    Raises
    ------
    InputError
        As `render` does, and if a file cannot be read or written.
    """
    out = Path(out)
    file = None
    if into is not None:
        content = bytes_of(Path(into), "file", math.inf)
        file = FileToEdit(content=content, path=Path(into), out=out)
    result = render(
        estimate,
        target,
        into=file,
        joint=joint,
        reading=reading,
        settings=settings,
    )
    _write(result.rendered.files, out)
    return result


def method_names() -> tuple[str, ...]:
    """Return the names of the methods ``to_NAME`` of an estimate."""
    return tuple(f"to_{target.replace('-', '_')}" for target in exporters())


def method_of(estimate: Estimate, name: str) -> Callable[..., Export]:
    """Return `write` for the target that a method ``to_NAME`` of an estimate names."""
    target = name.removeprefix("to_").replace("_", "-")
    if target not in exporters():
        raise AttributeError(f"{type(estimate).__name__!r} has no attribute {name!r}")
    return partial(write, estimate, target)


def _check_options(exporter: Exporter, settings: ExportSettings) -> None:
    for each in fields(settings):
        # The torque constant is also used where the estimate is in ampere
        used = each.name in {"overwrite", "torque_constant", *exporter.options}
        if not used and getattr(settings, each.name) is not None:
            raise InputError("option_unused", name=each.name, title=exporter.title)


def _named(axes: Axes, joint: str | None) -> Axes:
    if joint is None:
        return {name or DEFAULT_AXIS: each for name, each in axes.items()}
    if len(axes) != 1:
        raise InputError("joint_of_several_axes", joint=joint, count=len(axes), axes=tuple(axes))
    return dict.fromkeys([joint], next(iter(axes.values())))


def _check_values(exporter: Exporter, name: str, parameters: ExportParameters) -> None:
    """Check that something of an axis can be written."""
    held = [quantity for quantity in exporter.represents if parameters.has(quantity)]
    if held:
        return
    reasons = "; ".join(parameters.missing(exporter.represents)) or "it has no such parameter"
    raise InputError(
        "nothing_to_write",
        where=parameters.source.file,
        axis=name,
        title=exporter.title,
        reasons=reasons,
    )


def _write(files: Mapping[str, str | bytes], out: Path) -> None:
    """Write a file, or the files of a folder, complete or not at all."""
    contents = {
        name: content.encode() if isinstance(content, str) else content
        for name, content in files.items()
    }
    if set(contents) == {""}:
        write_whole(out, contents[""], what="out")
        return
    with files_at_once(out, what="out") as folder:
        for name, content in contents.items():
            path = folder / PurePosixPath(name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
