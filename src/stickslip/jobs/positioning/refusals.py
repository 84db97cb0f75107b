"""Refusals in the words of a scenario: its keys, and the units of its kind of axis."""

from collections.abc import Mapping
from typing import Any

from stickslip.friction import CoulombViscousFriction
from stickslip.records import InputError, in_units_of

__all__ = ["by_one_name", "friction_law", "told_of"]


def told_of(kind: Any, error: InputError) -> InputError:
    """Return a refusal with the units of a kind of axis where it names those of both kinds.

    Parameters
    ----------
    kind
        ``"linear"`` or ``"rotary"``; with anything else the refusal stays as it is.
    error
        The refusal.
    """
    if kind not in ("linear", "rotary"):
        return error
    what, remedy = in_units_of(kind, error.what), in_units_of(kind, error.remedy)
    return InputError(what, where=error.where, remedy=remedy)


def friction_law(pairs: Mapping[str, tuple[float, float]], offset: float) -> CoulombViscousFriction:
    """Return the law of a friction that is given for both directions or for each.

    Parameters
    ----------
    pairs
        Coulomb, viscous and static friction by name, in the positive and in the negative direction;
        without a static friction, the Coulomb friction.
    offset
        Constant effort lost [N or N m].

    Raises
    ------
    InputError
        If there is no such friction; what is alike in both directions is called by its one name.
    """
    coulomb, viscous = pairs["coulomb_friction"], pairs["viscous_friction"]
    static = pairs.get("static_friction", coulomb)
    try:
        return CoulombViscousFriction(
            coulomb_friction_positive=coulomb[0],
            coulomb_friction_negative=coulomb[1],
            viscous_friction_positive=viscous[0],
            viscous_friction_negative=viscous[1],
            static_friction_positive=static[0],
            static_friction_negative=static[1],
            offset=offset,
        )
    except InputError as error:
        raise by_one_name(error, pairs) from None


def by_one_name(error: InputError, pairs: Mapping[str, tuple[float, float]]) -> InputError:
    """Return a refusal in which a friction that is alike in both directions has its one name.

    Parameters
    ----------
    error
        The refusal.
    pairs
        Each friction in the positive and in the negative direction.
    """
    what, remedy = error.what, error.remedy
    for name, (forward, backward) in pairs.items():
        if forward == backward:
            what, remedy = (
                each.replace(f"{name}_positive", name).replace(f"{name}_negative", name)
                for each in (what, remedy)
            )
    coulomb = pairs.get("coulomb_friction")
    if coulomb is not None and coulomb[0] == coulomb[1]:
        what = what.replace(" of that direction", "")
    return InputError(what, where=error.where, remedy=remedy)
