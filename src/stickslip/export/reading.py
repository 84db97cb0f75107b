"""Estimates to export: from memory or from the JSON files of ``stickslip identify``."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stickslip.export.base import choices
from stickslip.export.parameters import ExportParameters, Source
from stickslip.export.transmission import Transmission
from stickslip.input_files import read_json
from stickslip.records import (
    PARAMETER_NAMES,
    SCHEMA_VERSION,
    AxesIdentification,
    AxisKind,
    EffortUnit,
    FrictionEstimate,
    Identification,
    InputError,
    Status,
    mass_name,
    positive,
    shared_name,
    unit_of,
)


@dataclass(frozen=True, kw_only=True)
class EstimateReading:
    """How the values of an estimate are meant, and which of them are exported."""

    #: Side of the estimate, and the ratio to the other side.
    transmission: Transmission = field(default_factory=Transmission)
    #: Torque or force per current [N m/A or N/A] for an estimate in ampere, or per percent for one
    #: in percent; None if it is not given.
    torque_constant: float | None = None
    axis: str | None = None  #: Which axis of a robot; None for all.
    #: Whether values are exported that were not identified or are not to be used.
    force: bool = False


Estimate = FrictionEstimate | Identification | AxesIdentification | Mapping[str, Any] | Path | str
"""An estimate or a result that holds it, of one axis or of several; its JSON document; or the path
of a file with that."""


def document_of(estimate: Estimate) -> tuple[Mapping[str, Any], str]:
    """Return the JSON document of an estimate, and its file if it is read from one."""
    if isinstance(estimate, FrictionEstimate | Identification | AxesIdentification):
        return estimate.to_dict(), ""
    if isinstance(estimate, Mapping):
        return estimate, ""
    return read_json(Path(estimate)), str(estimate)


def axes_of(estimate: Estimate, reading: EstimateReading) -> dict[str, ExportParameters]:
    """Return the parameters of each axis of an estimate, by its name; that of one axis is empty.

    Parameters
    ----------
    estimate
        An estimate or a result of `stickslip.identify`, its JSON document, ``{"axes": {NAME:
        document}}`` of a whole robot, or the path of a file with one of these.
    reading
        See `EstimateReading`.

    Raises
    ------
    InputError
        If it is not an estimate, or in ampere without a torque constant.
    """
    return axes_in(*document_of(estimate), reading)


def axes_in(
    document: Mapping[str, Any], where: str, reading: EstimateReading
) -> dict[str, ExportParameters]:
    """Return the parameters of each axis of a document, which was read from a file if named."""
    file = Path(where).name
    if "axes" not in document:
        if reading.axis is not None:
            raise InputError("one_axis_only", where=where, axis=reading.axis)
        return {"": _parameters(document, where, file, reading)}
    axes = document["axes"]
    if not isinstance(axes, Mapping) or not axes:
        raise InputError("not_an_estimate", where=where, name="axes")
    if reading.axis is not None:
        if reading.axis not in axes:
            raise InputError("unknown_axis", axis=reading.axis, choices=choices(reading.axis, axes))
        axes = {reading.axis: axes[reading.axis]}
    return {
        str(name): _parameters(each, _place(where, f"axes.{name}"), file, reading)
        for name, each in axes.items()
    }


def not_identified(document: Mapping[str, Any]) -> dict[str, str]:
    """Return the axes of a robot that have no estimate, each with the reason."""
    without = document.get("not_identified")
    return dict(without) if isinstance(without, Mapping) else {}


def in_si_units(document: Mapping[str, Any]) -> bool:
    """Return whether all values of a document are in SI units, none in ampere or percent.

    The document is one that `axes_in` accepts.
    """
    axes = document.get("axes", {"": document})
    return all(
        entry.get("unit") == unit_of(name, each["kind"])
        for each in axes.values()
        for name, entry in each["parameters"].items()
    )


def _place(*parts: str) -> str:
    return ", ".join(part for part in parts if part)


def _parameters(document: Any, where: str, file: str, reading: EstimateReading) -> ExportParameters:
    kind, status = _checked(document, where)
    verdicts = _verdicts(document)
    values: dict[str, float] = {}
    std: dict[str, float] = {}
    ci95: dict[str, tuple[float, float]] = {}
    withheld: dict[str, str] = {}
    forced: dict[str, str] = {}
    rows: list[tuple[str, int]] = []
    scales: list[float] = []
    identified = 0
    for name, entry in document["parameters"].items():
        place = _place(where, f"parameters.{name}")
        if shared_name(name) not in PARAMETER_NAMES or not isinstance(entry, Mapping):
            raise InputError("estimate_value", where=place, name=name, value=entry)
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
        interval = entry.get("ci95")
        if isinstance(interval, list | tuple) and len(interval) == 2:
            low, high = (_number(each, name, place) for each in interval)
            if low is not None and high is not None:
                ci95[name] = (scale * low, scale * high)
    given = _given_inertia(document, kind, values)
    covariance = _covariance(document, [row for _, row in rows], np.array(scales))
    return ExportParameters(
        kind=kind,
        values=values | given,
        withheld=withheld,
        forced=forced,
        given=frozenset(given),
        std=std,
        ci95=ci95,
        covariance=covariance,
        uncertain=tuple(name for name, _ in rows) if covariance.size else (),
        side=reading.transmission.side,
        transmission=reading.transmission,
        source=_source(document, file, status),
    )


def _checked(document: Any, where: str) -> tuple[AxisKind, Status]:
    """Check the frame of a document; return the kind of axis and the status."""
    for name in ("schema", "kind", "status", "parameters"):
        if not isinstance(document, Mapping) or name not in document:
            raise InputError("not_an_estimate", where=where, name=name)
    if document["schema"] != SCHEMA_VERSION:
        where, schema = _place(where, "schema"), document["schema"]
        raise InputError("other_schema", where=where, schema=schema, known=SCHEMA_VERSION)
    statuses = tuple(each.value for each in Status)
    for name, known in (("kind", ("linear", "rotary")), ("status", statuses)):
        if document[name] not in known:
            raise InputError("estimate_value", where=where, name=name, value=document[name])
    if not isinstance(document["parameters"], Mapping):
        raise InputError("not_an_estimate", where=where, name="parameters")
    return document["kind"], Status(document["status"])


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
        return f"the status of the estimate is {status.value}, and its values are not to be used"
    if "[" in name:
        return (
            "it is of one log of several; take the estimate of that log (FrictionEstimate.of_log)"
        )
    return ""


def _number(value: Any, name: str, where: str) -> float | None:
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise InputError("estimate_value", where=where, name=name, value=value)
    return float(value)


def _scale(name: str, unit: Any, kind: AxisKind, where: str, reading: EstimateReading) -> float:
    """Return the factor of a value to SI units."""
    si = unit_of(name, kind)
    if unit == si:
        return 1.0
    efforts: tuple[EffortUnit, ...] = ("A", "%")
    effort = next((each for each in efforts if unit == unit_of(name, kind, each)), None)
    if effort is None:
        raise InputError("estimate_unit", where=where, name=name, unit=unit, wanted=si)
    if reading.torque_constant is None:
        raise InputError(
            "estimate_in_units_of_drive",
            where=where,
            name=name,
            unit=unit,
            effort=effort,
            wanted=si,
        )
    return positive(
        "torque_constant", reading.torque_constant, f"{unit_of('effort', kind)}/{effort}"
    )


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


def _source(document: Mapping[str, Any], file: str, status: Status) -> Source:
    provenance = document.get("provenance")
    table: Mapping[str, Any] = provenance if isinstance(provenance, Mapping) else {}
    files = table.get("files")
    return Source(
        file=file,
        logs=tuple(str(each) for each in files) if isinstance(files, list | tuple) else (),
        status=status,
        estimator=str(document.get("estimator", "")),
        version=str(table.get("stickslip_version", "")),
        sha256=str(table.get("input_sha256", "")),
    )
