"""``[guess]``: first guesses of a controller, and where each came from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from stickslip.control import ExactPulseController
from stickslip.friction import CoulombViscousFriction
from stickslip.input_files import read_json
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    non_negative,
    positive,
    quantity_name,
    unit_of,
)
from stickslip.scenario.body import DIRECTIONAL, Body, coulomb_viscous
from stickslip.scenario.estimate_file import estimate_in
from stickslip.scenario.table import key

__all__ = [
    "AXIS_GUESSES",
    "FILES",
    "FirstGuesses",
    "GuessTable",
    "check_learned",
    "guesses_from",
    "learned_from",
]

AXIS_GUESSES = ("mass", *DIRECTIONAL, "offset")
FILES = ("estimate", "learned")
_SCENARIO = "the scenario"
_UNCERTAIN = {
    "mass_uncertainty": ("mass",),
    "friction_uncertainty": ("coulomb_friction", "viscous_friction"),
}
_UNCERTAINTY = {
    "mass_uncertainty": (0.01, ExactPulseController.mass_uncertainty),
    "friction_uncertainty": (0.05, ExactPulseController.friction_uncertainty),
}
"""Limits between which the uncertainty of an estimate is used [-]."""


def _named(name: str, value: str, _: str) -> None:
    if not value:
        raise InputError(
            f"{name} is empty, it must name a file", remedy="name the file, or leave it out"
        )


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
    """First guesses, and where each came from.

    Attributes
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    values
        By name [SI]: ``mass``, ``load_mass``, ``stiffness``, ``offset``, and each friction, as a
        pair (positive, negative).
    sources
        By the same names.
    missing
        By name, why there is no value, as far as there is more to say than that it was not given.
    spreads
        By name, standard deviation over the value, as far as an estimate holds it [-].
    learned, source
        What an earlier run has learned, to go on from, or None; and where it came from, in words.
    """

    kind: AxisKind
    values: Mapping[str, tuple[float, float]]
    sources: Mapping[str, str] = field(default_factory=dict)
    missing: Mapping[str, InputError] = field(default_factory=dict)
    spreads: Mapping[str, float] = field(default_factory=dict)
    learned: LearnedPulses | None = None
    source: str = ""

    def pair(self, name: str) -> tuple[float, float]:
        """Return a value in the positive and in the negative direction."""
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
        """Return a value, of friction the mean of both directions."""
        forward, backward = self.pair(name)
        return 0.5 * (forward + backward)

    def mass(self) -> float:
        """Return the mass or inertia, which must be positive [kg or kg m^2]."""
        name = "mass" if self.kind == "linear" else "inertia"
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
                forward, backward = self.pair(name)
                mean = 0.5 * (forward + backward)
                pairs[name] = (mean, mean) if symmetric else (forward, backward)
            elif name != "static_friction":
                pairs[name] = (0.0, 0.0)
        return coulomb_viscous(pairs, self.known("offset").get("offset", 0.0), self.kind)

    def uncertainties(self) -> dict[str, float]:
        """Return relative uncertainties of an estimate, by the names of ``[guess]`` [-].

        Friction changes after the log, which limits them from below; the uncertainty of a first
        guess limits them from above.
        """
        found: dict[str, float] = {}
        for name, of in _UNCERTAIN.items():
            least, most = _UNCERTAINTY[name]
            if all(each in self.spreads for each in of):
                found[name] = min(max(least, *(self.spreads[each] for each in of)), most)
        return found


def guesses_from(guess: GuessTable, kind: AxisKind, folder: Path) -> FirstGuesses:
    """Return the first guesses of a scenario; its own keys take precedence over an estimate."""
    values: dict[str, tuple[float, float]] = {}
    sources: dict[str, str] = {}
    missing: dict[str, InputError] = {}
    spreads: dict[str, float] = {}
    if guess.estimate is not None:
        try:
            held = estimate_in(folder / guess.estimate, kind)
        except InputError as error:
            raise error.at("[guess], estimate") from None
        values, spreads = dict(held.values), dict(held.spreads)
        missing = {name: error.at("[guess], estimate") for name, error in held.missing.items()}
        sources = dict.fromkeys(values, f"estimate {guess.estimate}")
    own: dict[str, tuple[float, float] | None] = {name: guess.sides(name) for name in DIRECTIONAL}
    for name, value in (("mass", guess.body), ("offset", guess.offset)):
        own[name] = None if value is None else (value, value)
    for name, pair in own.items():
        if pair is not None:
            values[name], sources[name] = pair, _SCENARIO
            spreads.pop(name, None)
    return FirstGuesses(kind=kind, values=values, sources=sources, missing=missing, spreads=spreads)


def learned_from(path: Path) -> LearnedPulses:
    """Read what an earlier run has learned."""
    try:
        return LearnedPulses.from_dict(read_json(path))
    except InputError as error:
        placed = error if str(path) in error.where else error.at(str(path))
        raise placed.at("[guess], learned") from None


def check_learned(
    learned: LearnedPulses, *, method: str, kind: AxisKind, names: tuple[str, ...]
) -> None:
    """Check that a controller can go on from what was learned."""
    for name, own, needed in (("method", learned.method, method), ("kind", learned.kind, kind)):
        if own != needed:
            raise InputError(
                f"what was learned is of {name} {own}, this controller needs {needed}",
                where=name,
                remedy=f"give a file of {name} {needed}, or leave learned out",
            )
    for name in names:
        if name not in learned.values:
            raise InputError(
                f"{name} is missing",
                where="values",
                remedy=f"give the file as it was saved, with {', '.join(names)}",
            )
