"""The law between a pulse and the displacement that it causes."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike

from stickslip.planning import pulse_kernels
from stickslip.plants import SingleMass, check_affine
from stickslip.records import (
    AxisKind,
    InputError,
    non_negative,
    one_of,
    positive,
    quantity_field,
    unit_of,
)

Values = Float[np.ndarray, "..."]


@dataclass(frozen=True, kw_only=True)
class PulseLaw:
    """How far one pulse moves a resting mass, in one direction, and which pulse moves it how far.

    Van de Wijdeven (2002) B, Eqs. 2, 3, 4, 23 and 24. The mass is pushed by a constant effort for
    the pulse's width, and then slides on without effort until it rests. Efforts, displacements and
    friction are magnitudes, counted in the direction of the pulse; a constant offset (gravity) that
    opposes this direction belongs to Coulomb and to static friction, as `of` adds it.

    Every method takes numbers or arrays, which are broadcast, and returns an array of that shape.

    Raises
    ------
    InputError
        If the mass or the Coulomb friction is not positive, the viscous friction is negative, or
        the static friction is below the Coulomb friction.

    Examples
    --------
    >>> law = PulseLaw(mass=150.0, coulomb_friction=100.0, viscous_friction=700.0,
    ...                static_friction=130.0)
    >>> round(float(law.width_for(0.01, effort=300.0)), 3)
    0.092
    >>> round(float(law.effort_for(0.01, width=0.10)), 1)
    280.1
    >>> f"{float(law.smallest_displacement(width=0.01)):.1e}"
    '1.3e-05'
    """

    mass: float = quantity_field("mass")  #: [kg or kg m^2].
    #: While moving in this direction [N or N m].
    coulomb_friction: float = quantity_field("coulomb_friction")
    #: In this direction [N s/m or N m s/rad]; 0 for Eq. 2.
    viscous_friction: float = quantity_field("viscous_friction")
    #: Effort above which the mass moves [N or N m]; None takes the Coulomb friction.
    static_friction: float | None = quantity_field("static_friction", default=None)
    kind: AxisKind = "linear"  #: ``"linear"`` or ``"rotary"``; decides the units.

    def __post_init__(self) -> None:
        one_of("kind", self.kind, ("linear", "rotary"))
        for name, check in (
            ("mass", positive),
            ("coulomb_friction", positive),
            ("viscous_friction", non_negative),
        ):
            value = check(name, getattr(self, name), unit_of(name, self.kind))
            object.__setattr__(self, name, value)
        if self.static_friction is not None:
            unit = unit_of("static_friction", self.kind)
            static = positive("static_friction", self.static_friction, unit)
            object.__setattr__(self, "static_friction", static)
            if static < self.coulomb_friction:
                raise InputError(
                    "static_below_coulomb",
                    name="static_friction",
                    value=static,
                    coulomb=self.coulomb_friction,
                    unit=unit,
                )

    @classmethod
    def of(cls, plant: SingleMass, *, direction: Literal[1, -1] = 1) -> "PulseLaw":
        """Return the law of a plant in one direction, its offset included.

        Raises
        ------
        InputError
            If the direction is neither 1 nor -1, the friction is not a `CoulombViscousFriction`, or
            the offset is so strong that a mass moving in this direction never stops by itself.
        """
        if direction not in (1, -1):
            raise InputError("not_a_choice", name="direction", value=direction, choices=(1, -1))
        check_affine(plant)
        friction = plant.friction if direction > 0 else plant.friction.mirrored()
        coulomb = friction.coulomb_friction_positive + friction.offset
        if not coulomb > 0:
            unit = unit_of("offset", plant.kind)
            raise InputError(
                "offset_never_stops",
                offset=plant.friction.offset,
                coulomb=friction.coulomb_friction_positive,
                unit=unit,
            )
        return cls(
            mass=plant.mass,
            coulomb_friction=coulomb,
            viscous_friction=friction.viscous_friction_positive,
            static_friction=friction.static_friction_positive + friction.offset,
            kind=plant.kind,
        )

    @property
    def breakaway(self) -> float:
        """The effort above which the mass moves [N or N m]."""
        return self.coulomb_friction if self.static_friction is None else self.static_friction

    def displacement(self, effort: float | ArrayLike, width: float | ArrayLike) -> Values:
        """Return the displacement from rest to rest (Eq. 3; Eq. 2 without viscous friction).

        Parameters
        ----------
        effort, width
            Of the pulse [N or N m, s]; an effort of at most the breakaway moves nothing.

        Raises
        ------
        InputError
            If a width is negative, a value is not finite, or no float can hold the displacement.
        """
        f, t = self._numbers(effort=effort, width=width)
        moving = np.where(f > self.breakaway, f, np.nan)
        displacement = self._apply(pulse_kernels.pulse_displacement, moving, t)
        for bad in f[~np.isfinite(displacement) & ~np.isnan(moving)].flat:
            raise InputError(
                "displacement_overflows", effort=bad, unit=unit_of("effort", self.kind)
            )
        return np.where(np.isnan(moving), 0.0, displacement)

    def duration(self, effort: float | ArrayLike, width: float | ArrayLike) -> Values:
        """Return the time from the pulse's begin until the mass rests again [s].

        Parameters
        ----------
        effort, width
            As of `displacement`, with the same errors; the width is returned where nothing moves.
        """
        f, t = self._numbers(effort=effort, width=width)
        moving = np.where(f > self.breakaway, f, np.nan)
        duration = self._apply(pulse_kernels.pulse_duration, moving, t)
        return np.where(np.isnan(duration), t, duration)

    def width_for(self, displacement: float | ArrayLike, *, effort: float | ArrayLike) -> Values:
        """Return the width of the pulse of given effort that causes a displacement [s].

        Parameters
        ----------
        displacement, effort
            [m or rad], not negative; [N or N m].

        Raises
        ------
        InputError
            If an effort does not exceed the breakaway, or a value is negative or not finite.
        """
        d, f = self._numbers(displacement=displacement, effort=effort)
        if np.any(f <= self.breakaway):
            unit = unit_of("effort", self.kind)
            raise InputError(
                "effort_below_breakaway",
                name="effort",
                value=float(np.min(f)),
                limit_name="breakaway",
                limit=self.breakaway,
                unit=unit,
            )
        return self._apply(pulse_kernels.width_for, d, f, nothing=0.0)

    def effort_for(self, displacement: float | ArrayLike, *, width: float | ArrayLike) -> Values:
        """Return the effort of the pulse of given width that causes a displacement [N or N m].

        NaN where that effort would not free the mass: the displacement is below
        `smallest_displacement`, and no single pulse of this width causes it.

        Parameters
        ----------
        displacement, width
            [m or rad, s], positive; others are an `InputError`.
        """
        d, t = self._numbers(displacement=displacement, width=width)
        for name, values, unit in (
            ("displacement", d, unit_of("position", self.kind)),
            ("width", t, "s"),
        ):
            if np.any(values <= 0):
                positive(name, float(np.min(values)), unit)
        effort = self._apply(pulse_kernels.effort_for, d, t)
        return np.where(effort > self.breakaway, effort, np.nan)

    def smallest_displacement(self, width: float | ArrayLike) -> Values:
        """Return the least displacement that a pulse of given width can cause (Eq. 24) [m or rad].

        It is that of an effort which just frees the mass. The least one of a given effort (Eq. 23)
        is `displacement` with a width of one sample.

        Parameters
        ----------
        width
            [s]; of one sample for the least displacement at all.
        """
        f, t = self._numbers(effort=self.breakaway, width=width)
        return self._apply(pulse_kernels.pulse_displacement, f, t)

    def gain(self, effort: float) -> float:
        """Return b = f (f - F)/(2 m F) (Eq. 4): displacement over squared width [m/s^2 or rad/s^2].

        Parameters
        ----------
        effort
            f, one finite number [N or N m].
        """
        (values,) = self._numbers(effort=effort)
        if values.ndim > 0:
            raise InputError("effort_not_scalar", shape=values.shape)
        f, F = float(values), self.coulomb_friction
        return f * (f - F) / (2.0 * self.mass * F)

    def _numbers(self, **quantities: float | ArrayLike) -> tuple[Values, ...]:
        units = {
            "effort": unit_of("effort", self.kind),
            "width": "s",
            "displacement": unit_of("position", self.kind),
        }
        arrays: list[Values] = []
        for name, values in quantities.items():
            try:
                arrays.append(np.asarray(values, dtype=np.float64))
            except (TypeError, ValueError) as error:
                raise InputError(
                    "not_numbers", name=name, value=values, unit=units[name]
                ) from error
        for name, values in zip(quantities, arrays, strict=True):
            for bad in values[~np.isfinite(values)].flat:
                raise InputError("not_finite", name=name, value=float(bad), unit=units[name])
            if name != "effort" and np.any(values < 0):
                non_negative(name, float(np.min(values)), units[name])
        return tuple(np.broadcast_arrays(*arrays))

    def _apply(self, kernel: Any, a: Values, b: Values, *, nothing: float = np.nan) -> Values:
        """Return the kernel's value for each pair of numbers; ``nothing`` where the first is 0."""
        m, F, c = self.mass, self.coulomb_friction, self.viscous_friction
        pairs = zip(a.flat, b.flat, strict=True)
        values = [kernel(m, F, c, float(p), float(q)) if p != 0 else nothing for p, q in pairs]
        return np.array(values, dtype=np.float64).reshape(a.shape)
