"""Estimates to export: from memory or from the JSON files of ``stickslip identify``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from stickslip.export.parameters import ExportParameters, Source
from stickslip.export.transmission import Transmission
from stickslip.input_files import nearest, read_json
from stickslip.records import (
    PARAMETER_NAMES,
    SCHEMA_VERSION,
    AxisKind,
    FrictionEstimate,
    InputError,
    Status,
    mass_name,
    positive,
    shared_name,
    unit_of,
)

_WRITTEN = "give a file that stickslip identify --json wrote"
_IN_AMPERE: Mapping[str, str] = {
    "kg": "A s^2/m",
    "kg m^2": "A s^2/rad",
    **{
        unit: unit.replace("N m", "A").replace("N", "A")
        for kind in ("linear", "rotary")
        for name in PARAMETER_NAMES
        if (unit := unit_of(name, kind)).startswith("N")
    },
}
"""Unit of a parameter of an estimate whose effort is a current, by the SI unit."""


@dataclass(frozen=True, kw_only=True)
class EstimateReading:
    """How the values of an estimate are meant, and which of them are exported.

    Attributes
    ----------
    transmission
        Side of the estimate, and the ratio to the other side.
    effort_unit
        ``"A"`` if the logged effort is a current although the estimate has it in N or N m; None for
        the units of the estimate.
    torque_constant
        Torque or force per current [N m/A or N/A], for an estimate in ampere; None if not given.
    force
        Whether values are exported that were not identified or are not to be used.
    """

    transmission: Transmission = field(default_factory=Transmission)
    effort_unit: Literal["A"] | None = None
    torque_constant: float | None = None
    force: bool = False


def axes_of(
    estimate: "FrictionEstimate | Mapping[str, Any] | Path | str", reading: EstimateReading
) -> dict[str, ExportParameters]:
    """Return the parameters of each axis of an estimate, by its name; that of one axis is empty.

    Parameters
    ----------
    estimate
        An estimate, its JSON document, ``{"axes": {NAME: document}}`` of a whole robot, or the path
        of a file with one of these.
    reading
        See `EstimateReading`.

    Raises
    ------
    InputError
        If it is not an estimate, or in ampere without a torque constant.
    """
    where = ""
    if isinstance(estimate, FrictionEstimate):
        document: Mapping[str, Any] = estimate.to_dict()
    elif isinstance(estimate, Mapping):
        document = estimate
    else:
        document, where = read_json(Path(estimate)), str(estimate)
    if "axes" not in document:
        return {"": _parameters(document, where, reading)}
    axes = document["axes"]
    if not isinstance(axes, Mapping) or not axes:
        raise InputError("it holds no axes", where=_place(where, "axes"), remedy=_WRITTEN)
    return {
        str(name): _parameters(each, _place(where, f"axes.{name}"), reading)
        for name, each in axes.items()
    }


def chosen(axes: Mapping[str, ExportParameters], name: str) -> ExportParameters:
    """Return one axis of a robot by its name."""
    if name in axes:
        return axes[name]
    near = nearest(name, axes)
    known = ", ".join(axes)
    raise InputError(
        f"the estimate has no axis {name!r}",
        where="--axis",
        remedy=f"did you mean {near}?" if near else f"its axes are: {known or 'not named'}",
    )


def _place(*parts: str) -> str:
    return ", ".join(part for part in parts if part)


def _parameters(document: Any, where: str, reading: EstimateReading) -> ExportParameters:
    kind, status = _checked(document, where)
    verdicts = _verdicts(document)
    values: dict[str, float] = {}
    std: dict[str, float] = {}
    withheld: dict[str, str] = {}
    forced: dict[str, str] = {}
    rows: list[tuple[str, int]] = []
    scales: list[float] = []
    identified = 0
    for name, entry in document["parameters"].items():
        place = _place(where, f"parameters.{name}")
        if shared_name(name) not in PARAMETER_NAMES or not isinstance(entry, Mapping):
            raise InputError(f"{name!r} is not a parameter", where=place, remedy=_WRITTEN)
        value = _number(entry.get("value"), name, place)
        row = identified
        identified += value is not None
        reason = _reason(name, value, status, verdicts)
        if value is None or "[" in name or (reason and not reading.force):
            withheld[name] = reason
            continue
        if reason:
            forced[name] = reason
        scale = _scale(name, entry.get("unit"), kind, place, reading)
        values[name] = scale * value
        rows.append((name, row))
        scales.append(scale)
        spread = _number(entry.get("std"), name, place)
        if spread is not None:
            std[name] = abs(scale) * spread
    given = _given_inertia(document, kind, values)
    covariance = _covariance(document, [row for _, row in rows], np.array(scales))
    return ExportParameters(
        kind=kind,
        values=values | given,
        withheld=withheld,
        forced=forced,
        given=frozenset(given),
        std=std,
        covariance=covariance,
        uncertain=tuple(name for name, _ in rows) if covariance.size else (),
        side=reading.transmission.side,
        transmission=reading.transmission,
        source=_source(document, where, status),
    )


def _checked(document: Any, where: str) -> tuple[AxisKind, Status]:
    """Check the frame of a document; return the kind of axis and the status."""
    if not isinstance(document, Mapping):
        raise InputError("this is no estimate", where=where, remedy=_WRITTEN)
    for name in ("schema", "kind", "status", "parameters"):
        if name not in document:
            raise InputError(
                f"{name} is missing, this is no estimate", where=where, remedy=_WRITTEN
            )
    if document["schema"] != SCHEMA_VERSION:
        raise InputError(
            f"the schema is {document['schema']!r}, this version reads {SCHEMA_VERSION}",
            where=_place(where, "schema"),
            remedy="identify the log again with this version",
        )
    if document["kind"] not in ("linear", "rotary"):
        raise InputError(
            f"the kind of axis is {document['kind']!r}",
            where=_place(where, "kind"),
            remedy=_WRITTEN,
        )
    if not isinstance(document["parameters"], Mapping):
        raise InputError(
            "it holds no parameters", where=_place(where, "parameters"), remedy=_WRITTEN
        )
    try:
        return document["kind"], Status(document["status"])
    except ValueError:
        raise InputError(
            f"the status is {document['status']!r}", where=_place(where, "status"), remedy=_WRITTEN
        ) from None


def _verdicts(document: Mapping[str, Any]) -> dict[str, tuple[bool, str]]:
    """Return whether each parameter was identified, and why."""
    diagnostics = document.get("diagnostics")
    verdicts = diagnostics.get("verdicts") if isinstance(diagnostics, Mapping) else None
    return {
        str(each["parameter"]): (each.get("identifiable") is True, str(each.get("reason", "")))
        for each in (verdicts if isinstance(verdicts, list | tuple) else ())
        if isinstance(each, Mapping) and "parameter" in each
    }


def _reason(
    name: str, value: float | None, status: Status, verdicts: Mapping[str, tuple[bool, str]]
) -> str:
    """Return why a parameter does not have the verdict ``identified``; empty if it has."""
    identifiable, reason = verdicts.get(name, (value is not None, ""))
    if value is None or not identifiable:
        return reason or "the log does not determine it"
    if not status.usable:
        return f"the estimate is not to be used, its status is {status.value!r}"
    if "[" in name:
        return (
            "it is of one log of several; take the estimate of that log (FrictionEstimate.of_log)"
        )
    return ""


def _number(value: Any, name: str, where: str) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError(
            f"{name} is {value!r}, it must be a finite number", where=where, remedy=_WRITTEN
        )
    return float(value)


def _scale(name: str, unit: Any, kind: AxisKind, where: str, reading: EstimateReading) -> float:
    """Return the factor of a value to SI units."""
    si = unit_of(name, kind)
    in_ampere = _IN_AMPERE.get(si, "")
    if unit == in_ampere or (unit == si and in_ampere and reading.effort_unit == "A"):
        if reading.torque_constant is None:
            raise InputError(
                f"{name} is in {in_ampere}, of an effort in ampere, and the target needs {si}",
                where=where,
                remedy="give --torque-constant in N m/A (N/A of a linear motor)",
            )
        return positive("torque constant", reading.torque_constant, "N m/A or N/A")
    if unit != si:
        raise InputError(
            f"{name} is in {unit!r}, and this kind of axis has {si}", where=where, remedy=_WRITTEN
        )
    return 1.0


def _given_inertia(
    document: Mapping[str, Any], kind: AxisKind, values: Mapping[str, float]
) -> dict[str, float]:
    """Return the moving mass that was given to the estimator, if it did not estimate one."""
    name = mass_name(kind)
    provenance = document.get("provenance")
    options = provenance.get("options") if isinstance(provenance, Mapping) else None
    if isinstance(options, Mapping) and isinstance(options.get("method"), Mapping):
        options = options["method"]
    if name in document["parameters"] or name in values or not isinstance(options, Mapping):
        return {}
    inertia = options.get("inertia")
    if options.get("load_inertia") is not None or not isinstance(inertia, int | float):
        return {}
    return {name: float(inertia)}


def _covariance(document: Mapping[str, Any], rows: list[int], scales: "np.ndarray") -> "np.ndarray":
    """Return the covariance of the exported values; empty if the estimate holds none of them."""
    try:
        whole = np.array(document.get("covariance", []), dtype=np.float64)
    except (TypeError, ValueError):
        return np.zeros((0, 0))
    square = whole.ndim == 2 and whole.shape[0] == whole.shape[1]
    if not square or (rows and max(rows) >= whole.shape[0]) or not rows:
        return np.zeros((0, 0))
    part = whole[np.ix_(rows, rows)]
    return part * np.outer(scales, scales) if np.isfinite(part).all() else np.zeros((0, 0))


def _source(document: Mapping[str, Any], where: str, status: Status) -> Source:
    provenance = document.get("provenance")
    table: Mapping[str, Any] = provenance if isinstance(provenance, Mapping) else {}
    files = table.get("files")
    return Source(
        file=Path(where.partition(", ")[0]).name if where else "",
        logs=tuple(str(each) for each in files) if isinstance(files, list | tuple) else (),
        status=status,
        estimator=str(document.get("estimator", "")),
        version=str(table.get("stickslip_version", "")),
        sha256=str(table.get("input_sha256", "")),
    )
