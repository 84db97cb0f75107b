"""Base of pulse width and pulse amplitude width control."""

from abc import abstractmethod
from dataclasses import dataclass
from math import inf
from typing import TypeVar

from stickslip.control.pulses.controller import PulseController
from stickslip.control.pulses.settings import checked_share, longest_samples, whole
from stickslip.control.rest_detection import RestDetection
from stickslip.records import AxisKind, InputError, positive, quantity_field, unit_of

__all__ = ["PublishedPulseController"]

C = TypeVar("C", bound="PublishedPulseController")


@dataclass(frozen=True, kw_only=True)
class PublishedPulseController(PulseController):
    """A pulse controller as published: pulses of one level, without viscous friction.

    Attributes
    ----------
    pulse_effort
        Largest effort of a pulse; more than the axis needs to break away.
    gain
        Share of the error that a pulse is to take away, ``K_c`` [-]; between 0 and 2.
    longest_width
        Of a pulse, rounded down to whole samples; None for no limit.
    forgetting
        Forgetting factor of the recursion [-], in (0, 1].
    max_idle_pulses
        After so many pulses in a row that did not move the axis it stops; None to go on, as
        published.

    Raises
    ------
    InputError
        If a value is out of its range.
    """

    pulse_effort: float = quantity_field("effort")
    gain: float = 1.0
    longest_width: float | None = quantity_field("time", default=None)
    forgetting: float = 1.0
    max_idle_pulses: int | None = 3

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check_positive("pulse_effort")
        checked_share("gain", self.gain, 2.0, ends="", usual=1.0)
        checked_share("forgetting", self.forgetting, 1.0, ends="high", usual=1.0)
        longest_samples(self.longest_width, self.sampling_time)
        most = self.max_idle_pulses
        if most is not None and not (whole(most) and most >= 1):
            raise InputError(
                f"max_idle_pulses is {most!r}, it must be a whole number of at least 1",
                remedy="give how many pulses in a row may fail to move the axis, or None for any",
            )

    @classmethod
    def from_friction(
        cls: type[C],
        *,
        mass: float,
        coulomb_friction: float,
        static_friction: float | None = None,
        pulse_effort: float,
        sampling_time: float,
        target: float,
        tolerance: float,
        rest: RestDetection,
        kind: AxisKind = "linear",
        gain: float = 1.0,
        longest_width: float | None = None,
        max_idle_pulses: int | None = 3,
    ) -> C:
        """Return one whose first guesses follow from mass and friction.

        Van de Wijdeven (2002) B, Eqs. 4 and 16.

        Parameters
        ----------
        mass
            Moving mass or inertia [kg or kg m^2].
        coulomb_friction
            First guess of it [N or N m].
        static_friction
            Effort it takes to break away, if known; the pulses must exceed it [N or N m].
        pulse_effort, sampling_time, target, tolerance, gain, longest_width
            Of the class [N or N m, s, m or rad, m or rad, -, s].
        rest, kind, max_idle_pulses
            Of the class.

        Raises
        ------
        InputError
            If a value is out of its range, or the pulses cannot overcome the friction.
        """
        _check_first_friction(mass, coulomb_friction, static_friction, pulse_effort, kind)
        return cls(
            **cls._first_gains(mass, coulomb_friction, pulse_effort),
            pulse_effort=pulse_effort,
            sampling_time=sampling_time,
            target=target,
            tolerance=tolerance,
            rest=rest,
            kind=kind,
            gain=gain,
            longest_width=longest_width,
            max_idle_pulses=max_idle_pulses,
        )

    @classmethod
    @abstractmethod
    def _first_gains(
        cls, mass: float, coulomb_friction: float, pulse_effort: float
    ) -> dict[str, float]:
        """Return the first guesses of the method's parameters by field."""

    @property
    def _longest(self) -> float:
        """Longest pulse, in whole samples [s]."""
        return longest_samples(self.longest_width, self.sampling_time) * self.sampling_time

    @property
    def _most_idle_pulses(self) -> float:
        """Most pulses in a row that may fail to move the axis."""
        return inf if self.max_idle_pulses is None else float(self.max_idle_pulses)


def _check_first_friction(
    mass: float,
    coulomb_friction: float,
    static_friction: float | None,
    pulse_effort: float,
    kind: AxisKind,
) -> None:
    """Check mass and friction, and that the pulses can overcome it."""
    unit = unit_of("effort", kind)
    positive("mass", mass, unit_of("mass", kind))
    positive("coulomb_friction", coulomb_friction, unit)
    positive("pulse_effort", pulse_effort, unit)
    limit, name = coulomb_friction, "Coulomb friction"
    if static_friction is not None:
        if not static_friction >= coulomb_friction:
            raise InputError(
                f"static_friction is {static_friction:g} {unit}, less than the Coulomb friction "
                f"of {coulomb_friction:g} {unit}",
                remedy="give the effort it takes to break away, at least the Coulomb friction",
            )
        limit, name = static_friction, "breakaway (static) friction"
    if not pulse_effort > limit:
        raise InputError(
            f"pulse_effort is {pulse_effort:g} {unit}, not more than the {name} of {limit:g} "
            f"{unit}: no pulse would move the axis",
            remedy="allow more effort",
        )
