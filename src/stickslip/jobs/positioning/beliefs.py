"""What a controller believes at first: from the scenario, from an estimate, from an earlier run."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from stickslip.control import ExactPulseController
from stickslip.jobs.estimate_file import estimate_in
from stickslip.jobs.json_file import read_json
from stickslip.jobs.positioning.tables import DIRECTIONAL, GuessTable
from stickslip.records import AxisKind, InputError, LearntPulses, unit_of

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
        try:
            held = estimate_in(path, kind)
        except InputError as error:
            raise error.at("[guess], estimate") from None
        values, spreads = dict(held.values), dict(held.spreads)
        missing = {name: error.at("[guess], estimate") for name, error in held.missing.items()}
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
        return LearntPulses.from_dict(read_json(path))
    except InputError as error:
        placed = error if str(path) in error.where else error.at(str(path))
        raise placed.at("[guess], learnt") from None
