"""What a controller believes at first: from the scenario, from an estimate, from an earlier run."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, nan
from pathlib import Path
from typing import Any

from stickslip.control import ExactPulseController
from stickslip.jobs.position.tables import DIRECTIONAL, GuessTable
from stickslip.records import (
    SCHEMA_VERSION,
    AxisKind,
    InputError,
    LearntPulses,
    Status,
    in_words,
    unit_of,
)

__all__ = ["Beliefs", "beliefs_from", "learnt_from"]

_FROM_SCENARIO = "the scenario"

_UNCERTAIN = {
    "mass_uncertainty": ("mass",),
    "friction_uncertainty": ("coulomb_friction", "viscous_friction"),
}
_UNCERTAINTY = {
    "mass_uncertainty": (0.01, ExactPulseController.mass_uncertainty),
    "friction_uncertainty": (0.05, ExactPulseController.friction_uncertainty),
}
"""Between which limits an estimate's uncertainty is believed [-]."""


@dataclass(frozen=True, kw_only=True)
class Beliefs:
    """First guesses, and where each came from.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    values
        By name [SI]: ``mass``, ``offset``, and each friction for both directions as a pair
        (positive, negative).
    sources
        By the same names.
    missing
        By name, why there is no value, as far as there is more to say than that it was not given.
    spreads
        By name, standard deviation over the value, as far as an estimate tells it [-].
    """

    kind: AxisKind
    values: Mapping[str, tuple[float, float]]
    sources: Mapping[str, str]
    missing: Mapping[str, InputError]
    spreads: Mapping[str, float] = field(default_factory=dict)

    def pair(self, name: str) -> tuple[float, float]:
        """Return a value in the positive and in the negative direction.

        Raises
        ------
        InputError
            If it is not known.
        """
        if name in self.values:
            return self.values[name]
        if name in self.missing:
            raise self.missing[name]
        shown = "inertia" if name == "mass" and self.kind == "rotary" else name
        raise InputError(
            f"{shown} is missing, the controller needs a first guess of it",
            where="[guess]",
            remedy=f"give {shown} in {unit_of(name, self.kind)}, or an estimate file that holds it",
        )

    def value(self, name: str) -> float:
        """Return a value, of friction the mean of both directions.

        Raises
        ------
        InputError
            If it is not known.
        """
        forward, backward = self.pair(name)
        return 0.5 * (forward + backward)

    def uncertainties(self) -> dict[str, float]:
        """Return how sure an estimate is of mass and friction, by the names of ``[guess]``.

        A log tells what friction was while it was recorded, so no estimate counts as surer than
        friction stays; and none as less sure than a first guess.
        """
        told: dict[str, float] = {}
        for name, of in _UNCERTAIN.items():
            least, most = _UNCERTAINTY[name]
            if all(each in self.spreads for each in of):
                told[name] = min(max(least, *(self.spreads[each] for each in of)), most)
        return told


def beliefs_from(guess: GuessTable, kind: AxisKind, folder: Path) -> Beliefs:
    """Return the first guesses of a scenario; what it says itself comes before an estimate.

    Parameters
    ----------
    guess
        Its table.
    kind
        Of the axis.
    folder
        Where the estimate file is looked for.

    Raises
    ------
    InputError
        If the estimate file cannot be used.
    """
    values: dict[str, tuple[float, float]] = {}
    sources: dict[str, str] = {}
    missing: dict[str, InputError] = {}
    spreads: dict[str, float] = {}
    if guess.estimate is not None:
        path = folder / guess.estimate
        values, missing, spreads = _estimate_from(path, kind)
        sources = dict.fromkeys(values, f"estimate {guess.estimate}")
    own: dict[str, tuple[float, float] | None] = {name: guess.sides(name) for name in DIRECTIONAL}
    try:
        body = guess.body(kind)
    except InputError as error:
        raise error.at("[guess]") from None
    own["mass"] = None if body is None else (body, body)
    own["offset"] = None if guess.offset is None else (guess.offset, guess.offset)
    for name, pair in own.items():
        if pair is not None:
            values[name], sources[name] = pair, _FROM_SCENARIO
            spreads.pop(name, None)
    return Beliefs(kind=kind, values=values, sources=sources, missing=missing, spreads=spreads)


def _estimate_from(
    path: Path, kind: AxisKind
) -> tuple[dict[str, tuple[float, float]], dict[str, InputError], dict[str, float]]:
    """Read what ``stickslip identify --json`` wrote: values, why others are missing, spreads."""
    document = _json(path, "estimate")
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
            told = [std / abs(value) for std, value in zip(stds, found, strict=True) if value]
            if len(told) == len(found) and all(isfinite(each) for each in told):
                spreads[key] = max(told)
    given = _options(document)
    if "mass" not in values and isinstance(given.get("inertia"), int | float):
        if given.get("load_inertia") is None:
            values["mass"] = (float(given["inertia"]), float(given["inertia"]))
        else:
            missing["mass"] = InputError(
                "the estimate is of a flexible arm, and holds no mass of a rigid axis",
                where=f"{path}, provenance.options.load_inertia",
                remedy="give the moving mass in [guess] beside the estimate",
            )
    return values, missing, spreads


def _number(value: Any) -> float:
    """Return a number from a document; NaN for what is none."""
    return float(value) if isinstance(value, int | float) else nan


def _options(document: Mapping[str, Any]) -> Mapping[str, Any]:
    provenance = document.get("provenance")
    options = provenance.get("options") if isinstance(provenance, dict) else None
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
            f"the estimate is of a {document['kind']} axis, the scenario's is {kind}",
            where=f"{path}, kind",
            remedy="give an estimate of this axis, or correct kind in [axis]",
        )
    if document["status"] != Status.OK.value:
        text = document.get("status_text", "")
        raise InputError(
            f"the estimate is not to be trusted, its status is {document['status']!r}"
            + (f" ({text})" if text else ""),
            where=f"{path}, status",
            remedy="identify a better log, or write the values that you do trust into [guess]",
        )


def _parameter(
    document: Mapping[str, Any], name: str, path: Path, kind: AxisKind
) -> float | InputError:
    """Return a parameter's value, or why there is none."""
    entry = document["parameters"].get(name)
    where = f"{path}, parameters.{name}"
    if not isinstance(entry, dict) or "value" not in entry:
        return InputError(
            f"{name} has no value", where=where, remedy="give it in [guess] beside the estimate"
        )
    value, unit = entry["value"], unit_of(name, kind)
    if value is None:
        return InputError(
            in_words(f"{name} was not identified from the log"),
            where=where,
            remedy="give it in [guess] beside the estimate, or identify a better log",
        )
    if isinstance(value, bool) or not isinstance(value, int | float) or entry.get("unit") != unit:
        return InputError(
            f"{name} is {value!r} {entry.get('unit', '')}, it must be a number in {unit}",
            where=where,
            remedy="give a file that stickslip identify --json wrote",
        )
    return float(value)


def learnt_from(path: Path) -> LearntPulses:
    """Read what an earlier run has learnt.

    Parameters
    ----------
    path
        The file that ``stickslip position --learnt`` wrote.

    Raises
    ------
    InputError
        If it is missing or holds something else.
    """
    try:
        return LearntPulses.from_dict(_json(path, "learnt"))
    except InputError as error:
        raise error if str(path) in error.where else error.at(str(path)) from None


def _json(path: Path, what: str) -> dict[str, Any]:
    try:
        document = json.loads(path.read_bytes())
    except FileNotFoundError:
        raise InputError(
            f"there is no such file, named as {what} in [guess]",
            where=str(path),
            remedy="check the path, which is relative to the scenario",
        ) from None
    except OSError as error:
        raise InputError(
            f"the file named as {what} in [guess] cannot be read ({error.strerror})",
            where=str(path),
            remedy="give a readable file",
        ) from error
    except ValueError as error:
        raise InputError(
            f"the file named as {what} in [guess] is not JSON ({error})",
            where=str(path),
            remedy="give a file that stickslip wrote",
        ) from error
    if not isinstance(document, dict):
        raise InputError(
            f"the file named as {what} in [guess] holds no table",
            where=str(path),
            remedy="give a file that stickslip wrote",
        )
    return document
