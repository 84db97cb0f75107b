"""What a file holds that ``stickslip identify --json`` wrote, for whoever begins with it."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite, nan
from pathlib import Path
from typing import Any

from stickslip.input_files import read_json
from stickslip.records import SCHEMA_VERSION, AxisKind, InputError, Status, in_words, unit_of
from stickslip.scenario.body import DIRECTIONAL

__all__ = ["HeldEstimate", "estimate_in"]


@dataclass(frozen=True, kw_only=True)
class HeldEstimate:
    """What an estimate holds of an axis.

    Attributes
    ----------
    values
        By name [SI]: ``mass`` (also of a rotary axis), ``offset``, and each friction, as a pair
        (positive, negative).
    missing
        By name, why what was estimated has no value.
    spreads
        By name, standard deviation over the value, where the file has it [-].
    """

    values: Mapping[str, tuple[float, float]]
    missing: Mapping[str, InputError]
    spreads: Mapping[str, float]


def estimate_in(path: Path, kind: AxisKind) -> HeldEstimate:
    """Read what ``stickslip identify --json`` wrote.

    Parameters
    ----------
    path
        The file.
    kind
        Of the axis that it should be of.

    Raises
    ------
    InputError
        If it is missing, holds something else, is of another kind of axis, or not to be trusted.
    """
    document = read_json(path)
    _check_estimate(document, path, kind)
    values: dict[str, tuple[float, float]] = {}
    missing: dict[str, InputError] = {}
    spreads: dict[str, float] = {}
    for name in (*DIRECTIONAL, "mass", "inertia", "offset"):
        sides = (f"{name}_positive", f"{name}_negative")
        asked = [each for each in ((name,), sides) if each[0] in document["parameters"]]
        if not asked:
            continue
        key = "mass" if name == "inertia" else name
        numbers = [_parameter(document, each, path, kind) for each in asked[0]]
        found = [each for each in numbers if isinstance(each, float)]
        refused = [each for each in numbers if isinstance(each, InputError)]
        if refused:
            missing[key] = refused[0]
        else:
            values[key] = (found[0], found[-1])
            stds = [_number(document["parameters"][each].get("std")) for each in asked[0]]
            spread = [std / abs(value) for std, value in zip(stds, found, strict=True) if value]
            if len(spread) == len(found) and all(isfinite(each) for each in spread):
                spreads[key] = max(spread)
    given = _options(document)
    if "mass" not in values and isinstance(given.get("inertia"), int | float):
        if given.get("load_inertia") is None:
            values["mass"] = (float(given["inertia"]), float(given["inertia"]))
        else:
            missing["mass"] = InputError(
                "the estimate is of a flexible arm, and holds no mass of a rigid axis",
                where=f"{path}, provenance.options.load_inertia",
                remedy="give the moving mass beside the estimate",
            )
    return HeldEstimate(values=values, missing=missing, spreads=spreads)


def _number(value: Any) -> float:
    """Return a number from a document; NaN for what is none."""
    return float(value) if isinstance(value, int | float) else nan


def _options(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the settings of the estimator, or of the one that it has its rows from."""
    provenance = document.get("provenance")
    options = provenance.get("options") if isinstance(provenance, dict) else None
    if isinstance(options, dict) and isinstance(options.get("method"), dict):
        options = options["method"]
    return options if isinstance(options, dict) else {}


def _check_estimate(document: Mapping[str, Any], path: Path, kind: AxisKind) -> None:
    remedy = "give a file that stickslip identify --json wrote"
    for key in ("schema", "kind", "status", "parameters"):
        if key not in document:
            raise InputError(
                f"{key} is missing, this is no estimate", where=str(path), remedy=remedy
            )
    if document["schema"] != SCHEMA_VERSION:
        raise InputError(
            f"the schema is {document['schema']!r}, this version reads {SCHEMA_VERSION}",
            where=f"{path}, schema",
            remedy="identify the log again with this version",
        )
    if not isinstance(document["parameters"], dict):
        raise InputError("it holds no parameters", where=f"{path}, parameters", remedy=remedy)
    if document["kind"] != kind:
        raise InputError(
            f"the estimate is of a {document['kind']} axis, and this one is {kind}",
            where=f"{path}, kind",
            remedy="give an estimate of this axis, or correct its kind",
        )
    if document["status"] != Status.OK.value:
        text = document.get("status_text", "")
        raise InputError(
            f"the estimate is not to be trusted, its status is {document['status']!r}"
            + (f" ({text})" if text else ""),
            where=f"{path}, status",
            remedy="identify a better log, or give the values that you do trust in its place",
        )


def _parameter(
    document: Mapping[str, Any], name: str, path: Path, kind: AxisKind
) -> float | InputError:
    """Return a parameter's value, or why there is none."""
    entry = document["parameters"].get(name)
    where = f"{path}, parameters.{name}"
    if not isinstance(entry, dict) or "value" not in entry:
        return InputError(f"{name} has no value", where=where, remedy="give it beside the estimate")
    value, unit = entry["value"], unit_of(name, kind)
    if value is None:
        return InputError(
            in_words(f"{name} was not identified from the log"),
            where=where,
            remedy="give it beside the estimate, or identify a better log",
        )
    if isinstance(value, bool) or not isinstance(value, int | float) or entry.get("unit") != unit:
        return InputError(
            f"{name} is {value!r} {entry.get('unit', '')}, it must be a number in {unit}",
            where=where,
            remedy="give a file that stickslip identify --json wrote",
        )
    return float(value)
