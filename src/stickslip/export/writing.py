"""Render and write an estimate for a target."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from pathlib import Path, PurePosixPath
from typing import Any

from stickslip.export.base import Exporter, ExportSettings, Rendered
from stickslip.export.parameters import ExportParameters
from stickslip.export.reading import EstimateReading, axes_of, chosen
from stickslip.export.registry import exporter as exporter_named
from stickslip.outputs import files_at_once, write_whole
from stickslip.records import FrictionEstimate, InputError, Status

_DEFAULT_AXIS = "axis"


@dataclass(frozen=True, kw_only=True)
class Export:
    """What was exported.

    Attributes
    ----------
    target
        Name of the target.
    rendered
        The files and what is to be said about them.
    warnings
        Values that were written against their verdict, and those that were withheld.
    complete
        Whether the estimate can be trusted and every value that the target holds was written.
    """

    target: str
    rendered: Rendered
    warnings: tuple[str, ...]
    complete: bool


def render(
    estimate: "FrictionEstimate | Mapping[str, Any] | Path | str",
    target: str,
    *,
    into: "str | bytes | None" = None,
    joint: str | None = None,
    axis: str | None = None,
    reading: EstimateReading | None = None,
    settings: ExportSettings | None = None,
) -> Export:
    """Return what an export of an estimate writes.

    Parameters
    ----------
    estimate
        An estimate, the JSON document of one or of a whole robot, or the path of its file.
    target
        One of `targets`.
    into
        Content of the file to edit.
    joint
        Name of the joint that the axis is; None for the name of the axis.
    axis
        Which axis of a robot; None for all.
    reading
        Side, ratio and units of the estimate, and whether to write by force.
    settings
        Of the target.

    Raises
    ------
    InputError
        If the estimate cannot be read, nothing in it was identified, or the target cannot hold it.
    """
    exporter = exporter_named(target)
    settings = settings or ExportSettings()
    _check_options(exporter, settings)
    if exporter.edits == "never" and into is not None:
        raise InputError(
            f"{exporter.title} is a file of its own, and no file is edited",
            remedy="leave --into out",
        )
    if exporter.edits == "always" and into is None:
        raise InputError(
            f"{exporter.title} is written into an existing file",
            remedy="give the file with --into",
        )
    axes = axes_of(estimate, reading or EstimateReading())
    if axis is not None:
        axes = {axis: chosen(axes, axis)}
    axes = _named(axes, joint)
    axes = {name: each.on(exporter.side) for name, each in axes.items()}
    for name, each in axes.items():
        _check_values(exporter, name, each)
    rendered = exporter.render(axes, settings, into)
    warnings = tuple(
        (f"{name}: " if len(axes) > 1 else "") + sentence
        for name, each in axes.items()
        for sentence in (*each.warnings(), *each.missing(exporter.represents))
    )
    trusted = all(each.source.status is Status.OK for each in axes.values())
    return Export(
        target=target, rendered=rendered, warnings=warnings, complete=trusted and not warnings
    )


def write(
    estimate: "FrictionEstimate | Mapping[str, Any] | Path | str",
    target: str,
    out: Path | str,
    *,
    into: Path | str | None = None,
    joint: str | None = None,
    axis: str | None = None,
    reading: EstimateReading | None = None,
    settings: ExportSettings | None = None,
) -> Export:
    """Write an estimate for a target.

    Parameters
    ----------
    estimate
        An estimate, the JSON document of one or of a whole robot, or the path of its file.
    target
        One of `targets`.
    out
        The file to write, or the folder of a target of several files.
    into
        The file to edit, which may be ``out`` itself.
    joint
        Name of the joint that the axis is; None for the name of the axis.
    axis
        Which axis of a robot; None for all.
    reading
        Side, ratio and units of the estimate, and whether to write by force.
    settings
        Of the target.

    Raises
    ------
    InputError
        As `render` does, and if a file cannot be read or written.
    """
    out = Path(out)
    content = None if into is None else _content(Path(into))
    result = render(
        estimate,
        target,
        into=content,
        joint=joint,
        axis=axis,
        reading=reading,
        settings=settings,
    )
    _write(result.rendered.files, out)
    return result


def _check_options(exporter: Exporter, settings: ExportSettings) -> None:
    for each in fields(settings):
        # The torque constant is also used where the estimate is in ampere
        used = each.name in {"overwrite", "torque_constant", *exporter.options}
        if not used and getattr(settings, each.name) is not None:
            option = f"--{each.name.replace('_', '-')}"
            raise InputError(
                f"{option} is given, and {exporter.title} does not use it",
                remedy=f"leave {option} out",
            )


def _named(
    axes: Mapping[str, ExportParameters], joint: str | None
) -> Mapping[str, ExportParameters]:
    if joint is None:
        return {name or _DEFAULT_AXIS: each for name, each in axes.items()}
    if len(axes) != 1:
        raise InputError(
            f"--joint {joint} is given, and the estimate has {len(axes)} axes, {', '.join(axes)}",
            remedy="leave --joint out, or give one of the axes with --axis",
        )
    return dict.fromkeys([joint], next(iter(axes.values())))


def _check_values(exporter: Exporter, name: str, parameters: ExportParameters) -> None:
    """Check that something of an axis can be written."""
    held = [quantity for quantity in exporter.represents if parameters.has(quantity)]
    if held:
        return
    reasons = "; ".join(parameters.missing(exporter.represents)) or "it holds none of them"
    raise InputError(
        f"nothing of the estimate of {name!r} can be written to {exporter.title} ({reasons})",
        where=parameters.source.file,
        remedy="identify it from a better log, or write it nevertheless with --force",
    )


def _content(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except FileNotFoundError:
        raise InputError(
            "there is no such file", where=str(path), remedy="check the path of --into"
        ) from None
    except OSError as error:
        raise InputError(
            f"the file cannot be read ({error.strerror})",
            where=str(path),
            remedy="give a readable file with --into",
        ) from error


def _write(files: Mapping[str, str | bytes], out: Path) -> None:
    """Write a file, or the files of a folder, complete or not at all."""
    contents = {
        name: content.encode() if isinstance(content, str) else content
        for name, content in files.items()
    }
    if set(contents) == {""}:
        write_whole(out, contents[""], what="--out")
        return
    with files_at_once(out, what="--out") as folder:
        for name, content in contents.items():
            path = folder / PurePosixPath(name)
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
