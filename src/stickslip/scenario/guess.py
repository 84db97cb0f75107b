"""``[guess]``: first guesses of a controller, from the scenario, an estimate or an earlier run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import isfinite, nan
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from stickslip.control import ExactPulseController
from stickslip.friction import CoulombViscousFriction
from stickslip.input_files import read_json
from stickslip.records import (
    SCHEMA_VERSION,
    AxisKind,
    InputError,
    LearnedPulses,
    Status,
    in_words,
    mass_name,
    non_negative,
    positive,
    quantity_name,
    unit_of,
)
from stickslip.scenario.axis import DIRECTIONAL, SIDES, Body, coulomb_viscous
from stickslip.scenario.table import ScenarioError, key

AXIS_GUESSES = ("mass", *DIRECTIONAL, "offset")
FILES = ("estimate", "learned")
_RUNNING = ("coulomb_friction", "viscous_friction")
_DRIFT = 0.05  # relative standard deviation of the change of friction since a log or an earlier run

_UNCERTAINTY = {
    "mass_uncertainty": (("mass",), 0.01, ExactPulseController.mass_uncertainty),
    "friction_uncertainty": (
        _RUNNING,
        _DRIFT,
        ExactPulseController.friction_uncertainty,
    ),
}
"""Parameters of each uncertainty, and limits between which that of an estimate is used [-]."""


def _named(name: str, value: str, _: str) -> None:
    if not value:
        raise InputError("no_file_named", name=name)


class GuessTable(Body):
    """First guesses; the table of a controller lists the keys that it uses."""

    mass_uncertainty: float | None = key(
        "standard deviation of the mass over its value",
        check=non_negative,
        says=f"{ExactPulseController.mass_uncertainty:g}, or that of the estimate",
    )
    friction_uncertainty: float | None = key(
        "standard deviation of friction over its value",
        check=non_negative,
        says=f"{ExactPulseController.friction_uncertainty:g}, or that of the estimate",
    )
    asymmetry: float | None = key(
        "standard deviation of the difference between the directions, over the value",
        check=non_negative,
        says=f"{ExactPulseController.asymmetry:g}",
    )
    arm_uncertainty: float | None = key(
        "standard deviation of masses and spring over their values; above 0 they are learned",
        check=non_negative,
        says="0.02 if one of them is guessed, else 0",
    )
    estimate: str | None = key(
        "file of `stickslip identify --json`; keys beside it take precedence", check=_named
    )
    learned: str | None = key(
        "file of `stickslip position --learned`, in place of all that it holds", check=_named
    )

    def plain(self) -> dict[str, str]:
        """Return the quantity of each key that was given, by the key."""
        return {name: quantity_name(name).replace("inertia", "mass") for name in self.given()}


@dataclass(frozen=True, kw_only=True)
class FirstGuesses:
    """First guesses and their sources.

    ``values`` [SI] holds ``mass`` (also of a rotary axis), ``load_mass``, ``stiffness``, ``offset``
    and each friction, as pairs (positive, negative direction).
    """

    kind: AxisKind
    values: Mapping[str, tuple[float, float]]
    sources: Mapping[str, str] = field(default_factory=dict)  # in words
    missing: Mapping[str, InputError] = field(default_factory=dict)  # why an estimate has no value
    spreads: Mapping[str, float] = field(default_factory=dict)  # standard deviation over value [-]
    spread: float | None = None  # of friction that a rule has set, over its value [-]
    # of the means of Coulomb and viscous friction over both directions, in this order [SI]
    covariance: Float[np.ndarray, "2 2"] | None = None
    learned: LearnedPulses | None = None  # to resume from
    source: str = ""  # of it

    def pair(self, name: str) -> tuple[float, float]:
        """Return a value in the positive and in the negative direction."""
        if name in self.values:
            return self.values[name]
        if name in self.missing:
            raise self.missing[name]
        body = "inertia" if name == "mass" and self.kind == "rotary" else name
        unit = unit_of(name, self.kind)
        raise ScenarioError("guess_missing", where="[guess]", name=body, unit=unit)

    def value(self, name: str) -> float:
        """Return a value, of friction the mean of both directions."""
        forward, backward = self.pair(name)
        return 0.5 * (forward + backward)

    def mass(self) -> float:
        """Return the mass or inertia, which must be positive [kg or kg m^2]."""
        name = mass_name(self.kind)
        return positive(name, self.value("mass"), unit_of("mass", self.kind))

    def known(self, *names: str) -> dict[str, float]:
        """Return those of the values that are known."""
        return {name: self.value(name) for name in names if name in self.values}

    def friction(self, *, symmetric: bool = False, default: bool = True) -> CoulombViscousFriction:
        """Return the law of these values, with the offset.

        With ``symmetric``, of the means of both directions; without ``default``, Coulomb and
        viscous friction must be known, which are 0 otherwise.
        """
        pairs: dict[str, tuple[float, float]] = {}
        for name in DIRECTIONAL:
            if name in self.values or not (default or name == "static_friction"):
                mean = self.value(name)
                pairs[name] = (mean, mean) if symmetric else self.pair(name)
            elif name != "static_friction":
                pairs[name] = (0.0, 0.0)
        return coulomb_viscous(pairs, self.known("offset").get("offset", 0.0), self.kind)

    def running(self, *, uncertainty: float, speed: float) -> dict[str, Any]:
        """Return the prior of an estimator of viscous and Coulomb friction that runs along.

        The uncertainty is the standard deviation over the value where its source states none. A
        viscous friction of zero is uncertain by what is small beside Coulomb friction at the speed
        of a typical move [m/s or rad/s].
        """
        values = self.known(*_RUNNING)
        coulomb = values.get("coulomb_friction", 0.0)
        if coulomb <= 0.0 or "viscous_friction" not in values:
            return {"initial_values": values or None}
        size = np.array([values["viscous_friction"] or coulomb / speed, coulomb])
        known = np.zeros((2, 2)) if self.covariance is None else self.covariance[::-1, ::-1]
        stated = self.covariance is not None or self.learned is not None
        P = known + np.diag(((_DRIFT if stated else uncertainty) * size) ** 2)
        return {
            "initial_values": values,
            "initial_variance": tuple(tuple(row) for row in P.tolist()),
        }

    def uncertainties(self) -> dict[str, float]:
        """Return relative uncertainties of an estimate, by the names of ``[guess]`` [-].

        Friction changes after the log, which limits them from below; the uncertainty of a first
        guess limits them from above.
        """
        return {
            name: min(max(least, *(self.spreads[each] for each in of)), most)
            for name, (of, least, most) in _UNCERTAINTY.items()
            if all(each in self.spreads for each in of)
        }


def guesses_from(guess: GuessTable, kind: AxisKind, folder: Path) -> FirstGuesses:
    """Return the first guesses of a scenario; its own keys take precedence over an estimate."""
    held = FirstGuesses(kind=kind, values={})
    if guess.estimate is not None:
        try:
            held = estimate_in(folder / guess.estimate, kind)
        except InputError as error:
            raise error.at("[guess], estimate") from None
    missing = {name: error.at("[guess], estimate") for name, error in held.missing.items()}
    values, spreads = dict(held.values), dict(held.spreads)
    sources = dict.fromkeys(values, f"estimate {guess.estimate}")
    own = {name: guess.sides(name) for name in DIRECTIONAL}
    for name, value in (("mass", guess.body), ("offset", guess.offset)):
        own[name] = None if value is None else (value, value)
    for name, pair in own.items():
        if pair is not None:
            values[name], sources[name] = pair, "the scenario"
            spreads.pop(name, None)
    replaced = any(own[name] for name in _RUNNING)
    return FirstGuesses(
        kind=kind,
        values=values,
        sources=sources,
        missing=missing,
        spreads=spreads,
        covariance=None if replaced else held.covariance,
    )


def learned_from(path: Path) -> LearnedPulses:
    """Read what an earlier run has learned."""
    try:
        document = read_json(path)
        try:
            return LearnedPulses.from_dict(document)
        except InputError as error:
            raise error.at(str(path)) from None
    except InputError as error:
        raise error.at("[guess], learned") from None


def estimate_in(path: Path, kind: AxisKind) -> FirstGuesses:
    """Read the values that ``stickslip identify --json`` wrote, for an axis of a kind.

    A file that holds something else, an estimate of another kind of axis, and one that is not to be
    trusted are errors.
    """
    document = read_json(path)
    _check_estimate(document, path, kind)
    values: dict[str, tuple[float, float]] = {}
    missing: dict[str, InputError] = {}
    spreads: dict[str, float] = {}
    parameters = document["parameters"]
    for name in (*DIRECTIONAL, "mass", "inertia", "offset"):
        sides = (name,) if name in parameters else (f"{name}_positive", f"{name}_negative")
        if sides[0] not in parameters:
            continue
        plain = "mass" if name == "inertia" else name
        try:
            found = [_parameter(parameters, each, path, kind) for each in sides]
        except InputError as error:
            missing[plain] = error
            continue
        values[plain] = (found[0], found[-1])
        stds = [_number(parameters[each].get("std")) for each in sides]
        spread = [std / abs(value) for std, value in zip(stds, found, strict=True) if value]
        if len(spread) == len(found) and all(isfinite(each) for each in spread):
            spreads[plain] = max(spread)
    given = _options(document)
    if "mass" not in values and isinstance(given.get("inertia"), int | float):
        if given.get("load_inertia") is None:
            values["mass"] = (float(given["inertia"]), float(given["inertia"]))
        else:
            where = f"{path}, provenance.options.load_inertia"
            missing["mass"] = InputError("estimate_of_arm", where=where)
    return FirstGuesses(
        kind=kind,
        values=values,
        missing=missing,
        spreads=spreads,
        covariance=_covariance(document),
    )


def _covariance(document: Mapping[str, Any]) -> Float[np.ndarray, "2 2"] | None:
    """Return the covariance of Coulomb and viscous friction, each the mean over both directions.

    None where the estimate does not have both, or no finite covariance.
    """
    parameters = document["parameters"]
    identified = [
        name
        for name, entry in parameters.items()
        if isinstance(entry, dict) and entry.get("value") is not None
    ]
    means = np.zeros((2, len(identified)))
    for mean, name in zip(means, _RUNNING, strict=True):
        sides = [
            each for each in (name, *(f"{name}_{side}" for side in SIDES)) if each in identified
        ]
        if len(sides) not in (1, len(SIDES)):
            return None
        for side in sides:
            mean[identified.index(side)] = 1.0 / len(sides)
    try:
        every = np.array(document.get("covariance"), dtype=np.float64)
    except (TypeError, ValueError):
        return None
    if every.shape != (len(identified), len(identified)):
        return None
    found = means @ every @ means.T
    sure = np.isfinite(found).all() and np.linalg.eigvalsh(found)[0] >= 0.0
    return 0.5 * (found + found.T) if sure else None


def _number(value: Any) -> float:
    """Return a number from a document, or NaN."""
    return float(value) if isinstance(value, int | float) else nan


def _options(document: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the settings of the estimator, or of the one that it has its rows from."""
    provenance = document.get("provenance")
    options = provenance.get("options") if isinstance(provenance, dict) else None
    if isinstance(options, dict) and isinstance(options.get("method"), dict):
        options = options["method"]
    return options if isinstance(options, dict) else {}


def _check_estimate(document: Mapping[str, Any], path: Path, kind: AxisKind) -> None:
    for name in ("schema", "kind", "status", "parameters"):
        if name not in document:
            raise InputError("not_an_estimate", where=str(path), name=name)
    if document["schema"] != SCHEMA_VERSION:
        where, schema = f"{path}, schema", document["schema"]
        raise InputError("other_schema", where=where, schema=schema, known=SCHEMA_VERSION)
    if not isinstance(document["parameters"], dict):
        where, value = f"{path}, parameters", document["parameters"]
        raise InputError("estimate_value", where=where, name="parameters", value=value)
    if document["kind"] != kind:
        where, own = f"{path}, kind", document["kind"]
        raise InputError("estimate_of_other_kind", where=where, own=own, needed=kind)
    provenance = document.get("provenance")
    if isinstance(provenance, dict) and provenance.get("effort_unit"):
        where, unit = f"{path}, provenance.effort_unit", provenance["effort_unit"]
        raise InputError("estimate_of_raw_effort", where=where, unit=unit)
    if document["status"] != Status.OK.value:
        where, text = f"{path}, status", document.get("status_text", "")
        status = document["status"]
        raise InputError("estimate_not_trusted", where=where, status=status, text=text)


def _parameter(parameters: Mapping[str, Any], name: str, path: Path, kind: AxisKind) -> float:
    """Return a parameter's value."""
    entry, where = parameters.get(name), f"{path}, parameters.{name}"
    if not isinstance(entry, dict) or "value" not in entry:
        raise InputError("estimate_lacks", where=where, name=name)
    value, unit = entry["value"], unit_of(name, kind)
    if value is None:
        raise InputError("estimate_unidentified", where=where, name=in_words(name))
    if isinstance(value, bool) or not isinstance(value, int | float) or entry.get("unit") != unit:
        found = entry.get("unit", "")
        raise InputError(
            "estimate_number", where=where, name=name, value=value, unit=found, needed=unit
        )
    return float(value)
