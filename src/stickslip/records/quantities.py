"""Every physical quantity, its symbol and its unit, declared once, and how they are written.

Records, docs, reports, the command line and exports read units from here. Inside the package all
values are in these SI units; conversion happens at the edges only.
"""

import re
from dataclasses import dataclass, field
from typing import Any, Literal

AxisKind = Literal["linear", "rotary"]
Sign = Literal["positive", "any", "any in a direction"]


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """A physical quantity of a motion axis."""

    name: str  #: The field's standard term, in words.
    symbol: str  #: The letter used in equations and figures.
    linear: str  #: The SI unit on a linear axis.
    rotary: str  #: The SI unit on a rotary axis.
    #: As a parameter of an estimate: ``"positive"``, ``"any"``, or ``"any in a direction"`` if it
    #: contains the offset there; None for what is no parameter.
    sign: Sign | None = None
    directional: bool = False  #: Whether it can be a parameter of each direction.

    def unit(self, kind: AxisKind) -> str:
        """Return the SI unit on an axis of the given kind."""
        return self.linear if kind == "linear" else self.rotary


def _quantity(
    name: str, symbol: str, linear: str, rotary: str, sign: Sign | None = None
) -> tuple[str, Quantity]:
    quantity = Quantity(
        name=name,
        symbol=symbol,
        linear=linear,
        rotary=rotary,
        sign=sign,
        directional=name in {"coulomb friction", "viscous friction", "static friction"},
    )
    return name.replace(" ", "_"), quantity


QUANTITIES: dict[str, Quantity] = dict(
    [
        _quantity("time", "t", "s", "s"),
        _quantity("sampling time", "T", "s", "s"),
        _quantity("position", "x", "m", "rad"),
        _quantity("velocity", "v", "m/s", "rad/s"),
        _quantity("acceleration", "a", "m/s^2", "rad/s^2"),
        _quantity("effort", "u", "N", "N m"),
        _quantity("energy", "E", "J", "J"),
        _quantity("mass", "m", "kg", "kg m^2", "positive"),
        _quantity("inertia", "J", "kg", "kg m^2", "positive"),
        _quantity("load mass", "m_2", "kg", "kg m^2", "positive"),
        _quantity("load inertia", "J_2", "kg", "kg m^2", "positive"),
        _quantity("stiffness", "k", "N/m", "N m/rad", "positive"),
        _quantity("coulomb friction", "f_c", "N", "N m", "any in a direction"),
        _quantity("viscous friction", "c", "N s/m", "N m s/rad", "positive"),
        _quantity("static friction", "f_s", "N", "N m", "any in a direction"),
        _quantity("offset", "f_0", "N", "N m", "any"),
        _quantity("stribeck velocity", "v_s", "m/s", "rad/s", "positive"),
        # Terms that a log may show beyond these (`stickslip.estimation.selection`)
        _quantity("effort delay", "τ", "s", "s", "any"),
        _quantity("quadratic friction", "c_2", "N s^2/m^2", "N m s^2/rad^2", "positive"),
        _quantity("two thirds friction", "c_2/3", "N (s/m)^(2/3)", "N m (s/rad)^(2/3)", "positive"),
        _quantity("low speed friction", "f_l", "N", "N m", "any"),
        _quantity("low speed velocity", "v_l", "m/s", "rad/s", "positive"),
        _quantity("presliding friction", "f_p", "N", "N m", "any"),
        _quantity("breakaway friction", "f_b", "N", "N m", "positive"),
        _quantity("breakaway growth", "g_b", "N", "N m", "any"),
        _quantity("elasticity", "e", "kg s^2", "kg m^2 s^2", "positive"),
        _quantity("spring stiffness", "k_0", "N/m", "N m/rad", "any"),
        _quantity("gravity sine", "g_s", "N", "N m", "any"),
        _quantity("gravity cosine", "g_c", "N", "N m", "any"),
        _quantity("ripple sine", "r_s", "N", "N m", "any"),
        _quantity("ripple cosine", "r_c", "N", "N m", "any"),
        _quantity("ripple period", "λ", "m", "rad", "positive"),
        _quantity("presliding distance", "d", "m", "rad", "positive"),
        _quantity("model error", "e_m", "-", "-", "any"),
        _quantity("offset drift", "d_0", "N/s", "N m/s", "any"),
        _quantity("friction drift", "d_f", "1/s", "1/s", "any"),
        _quantity("viscous drift", "d_v", "N/m", "N m/rad", "any"),
        _quantity("gain drift", "d_k", "1/s", "1/s", "any"),
        _quantity("dead band", "u_d", "N", "N m", "positive"),
        # Displacement of a pulse over its squared width, and that as A_1 f^2 - A_2 f (Eqs. 4, 16)
        _quantity("pulse gain", "b", "m/s^2", "rad/s^2"),
        _quantity("gain 1", "A_1", "m/(N s)^2", "rad/(N m s)^2"),
        _quantity("gain 2", "A_2", "m/(N s^2)", "rad/(N m s^2)"),
        # Weakest effort that has freed a resting mass, and strongest that has not
        _quantity("freeing effort", "u_f", "N", "N m"),
        _quantity("holding effort", "u_h", "N", "N m"),
        # Relative change of the friction from pulse to pulse
        _quantity("friction walk", "q", "-", "-"),
    ]
)


def mass_name(kind: AxisKind) -> str:
    """Return the name of the moving mass of an axis: ``"mass"``, or ``"inertia"`` of a rotary one.

    Parameters
    ----------
    kind
        ``"linear"`` or ``"rotary"``.
    """
    return "mass" if kind == "linear" else "inertia"


def quantity_name(name: str) -> str:
    """Return the quantity of a parameter, whichever direction or log it is for.

    Examples
    --------
    >>> quantity_name("viscous_friction_positive"), quantity_name("offset[morning]")
    ('viscous_friction', 'offset')
    """
    return shared_name(name).removesuffix("_positive").removesuffix("_negative")


def shared_name(name: str) -> str:
    """Return the name of a parameter without that of the log that it belongs to.

    Examples
    --------
    >>> shared_name("offset[morning]"), shared_name("coulomb_friction_positive")
    ('offset', 'coulomb_friction_positive')
    """
    return name.partition("[")[0]


EffortUnit = Literal["", "A", "%"]
"""Unit of an effort: empty for N or N m by the kind of axis, or ampere or percent of an effort
that is not converted to a force or torque."""


def unit_of(name: str, kind: AxisKind, effort: EffortUnit = "") -> str:
    """Return the unit of a quantity or of one of its ``_positive``/``_negative`` forms.

    It is the SI unit, except for an effort in ampere or percent, with which a mass is effort over
    acceleration.

    Examples
    --------
    >>> unit_of("viscous_friction_positive", "rotary")
    'N m s/rad'
    >>> unit_of("viscous_friction", "rotary", "A"), unit_of("mass", "linear", "A")
    ('A s/rad', 'A s^2/m')
    """
    unit = QUANTITIES[quantity_name(name)].unit(kind)
    if not effort:
        return unit
    force, mass, energy, length = (
        ("N", "kg", "J", "m") if kind == "linear" else ("N m", "kg m^2", "J", "rad")
    )
    replaced = {force: effort, mass: f"{effort} s^2/{length}", energy: f"{effort} {length}"}
    pattern = "|".join(rf"(?<!\w){re.escape(each)}(?![\w^])" for each in replaced)
    return re.sub(pattern, lambda found: replaced[found[0]], unit)


def quantity_field(name: str, **options: Any) -> Any:
    """Declare a dataclass field that holds the named quantity, so that its unit can be read."""
    return field(metadata={"quantity": QUANTITIES[name]}, **options)


_DIRECTIONS = {"_positive": ", forward", "_negative": ", backward"}
_NAMES = re.compile(
    rf"\b(?:{'|'.join(key for key in QUANTITIES if '_' in key)})(?:_positive|_negative)?\b"
)


def parameter_label(name: str, kind: AxisKind = "linear") -> str:
    """Return the field's term for a parameter; a mass of a rotary axis is an inertia.

    Examples
    --------
    >>> parameter_label("coulomb_friction_positive")
    'Coulomb friction, forward'
    >>> parameter_label("load_mass", "rotary")
    'Load inertia'
    >>> parameter_label("offset[morning]")
    'Offset [morning]'
    """
    name, bracket, log = name.partition("[")
    if bracket:
        return f"{parameter_label(name, kind)} [{log}"
    for suffix, words in _DIRECTIONS.items():
        if name.endswith(suffix):
            return parameter_label(name.removesuffix(suffix), kind) + words
    term = QUANTITIES[name].name.replace("coulomb", "Coulomb").replace("stribeck", "Stribeck")
    term = term.replace("two thirds", "2/3-power")
    if kind == "rotary":
        term = term.replace("mass", "inertia")
    return term[0].upper() + term[1:]


def count_of(number: int, thing: str) -> str:
    """Return how many things there are, in words that agree.

    Examples
    --------
    >>> count_of(1, "sample"), count_of(0, "sample")
    ('1 sample', '0 samples')
    """
    return f"{number} {thing}{'' if number == 1 else 's'}"


def share_text(share: float) -> str:
    """Return a share in percent, with two digits however small it is.

    Parameters
    ----------
    share
        The share [-].

    Examples
    --------
    >>> share_text(0.000024), share_text(0.0), share_text(2.7)
    ('0.0024 %', '0 %', '270 %')
    """
    text = f"{100 * share:.2g}"
    return f"{100 * share:.0f} %" if "e+" in text else f"{text} %"


def in_words(sentence: str) -> str:
    """Return a sentence with the field's terms in place of the names of quantities in it.

    Examples
    --------
    >>> in_words("it cannot be separated from viscous_friction and coulomb_friction_positive")
    'it cannot be separated from viscous friction and Coulomb friction (forward)'
    """
    return _NAMES.sub(_term_of, sentence)


def _term_of(name: re.Match[str]) -> str:
    term, _, direction = parameter_label(name[0]).partition(", ")
    term = term if term.startswith(("Coulomb", "Stribeck")) else term[0].lower() + term[1:]
    return f"{term} ({direction})" if direction else term


def unit_text(unit: str) -> str:
    """Return a unit as it is printed.

    Examples
    --------
    >>> unit_text("kg m^2")
    'kg m²'
    """
    return unit.replace("^2", "²")
