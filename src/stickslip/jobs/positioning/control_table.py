"""The table of a scenario that chooses the controller and its settings."""

from dataclasses import dataclass, fields
from typing import Any, ClassVar, Literal

from stickslip.records import InputError, positive, quantity_field

__all__ = ["CONTROLLERS", "OF_ARMS", "ControllerTable", "Method"]

Method = Literal[
    "exact", "papwc", "pwc", "pd", "pid", "pid-dither", "pid-reset", "landing", "feedback"
]

OF_ARMS: tuple[Method, ...] = ("landing", "feedback")
"""Methods for a flexible arm; all others, and landing, are for a rigid axis."""

CONTROLLERS: dict[Method, str] = {
    "exact": "pulses planned by the exact law of Coulomb and viscous friction",
    "papwc": "adaptive pulse amplitude pulse width control",
    "pwc": "adaptive pulse width control",
    "pd": "PD control",
    "pid": "PID control",
    "pid-dither": "PID control with dither",
    "pid-reset": "PID control with resets of the integral",
    "landing": "feedback, then pulses that end at rest on the target",
    "feedback": "PD control with a notch and compensation of friction",
}
"""Every method, in words."""

_PULSES = ("longest_width", "patience", "rest_samples")
_ADAPTIVE = (*_PULSES, "gain", "forgetting", "initial_covariance")
_FEEDBACK = ("position_gain", "velocity_gain", "filter_time")
_OF_AN_ARM, _OF_A_MASS = ("most_series",), ("longest_width", "rest_samples")  # of a landing
_INTEGRAL = (*_FEEDBACK, "integral_gain", "bandwidth", "dead_band")
_USES: dict[Method, tuple[str, ...]] = {
    "exact": _PULSES,
    "papwc": _ADAPTIVE,
    "pwc": _ADAPTIVE,
    "pd": _FEEDBACK,
    "pid": _INTEGRAL,
    "pid-dither": (*_INTEGRAL, "dither_amplitude", "dither_frequency", "dither_shape"),
    "pid-reset": (*_INTEGRAL, "reset_law", "reset_speed", "reset_samples"),
    "landing": ("position_gain", "velocity_gain", "longest_wait", *_OF_AN_ARM, *_OF_A_MASS),
    "feedback": ("position_gain", "velocity_gain"),
}
# Methods of either kind of axis, with the settings for which they have no use on it
_RIGID: dict[Method, tuple[str, ...]] = {
    each: _OF_AN_ARM if each == "landing" else () for each in _USES if each != "feedback"
}
_FLEXIBLE: dict[Method, tuple[str, ...]] = {
    each: _OF_A_MASS if each == "landing" else () for each in OF_ARMS
}
_NEEDS: dict[Method, tuple[str, ...]] = {
    "pid-dither": ("dither_amplitude", "dither_frequency"),
    "pid-reset": ("reset_law", "reset_speed"),
}
_GAINS = ("position_gain", "integral_gain", "velocity_gain", "filter_time")


@dataclass(frozen=True, kw_only=True)
class ControllerTable:
    """``[controller]``: which one, how strong, and its settings.

    Attributes
    ----------
    method
        ``"landing"``, which is taken where none is given; of a rigid axis also ``"exact"``,
        ``"papwc"``, ``"pwc"``, ``"pd"``, ``"pid"``, ``"pid-dither"`` or ``"pid-reset"``; of a
        flexible arm ``"feedback"``.
    effort_limit
        Largest magnitude of the effort [N or N m]; of ``"pwc"`` the effort of every pulse.
    longest_width
        Of a pulse [s].
    patience
        Pulses in vain after which a pulse controller stops.
    rest_samples
        Samples over which a pulse controller, or the landing of a rigid axis, judges whether the
        axis rests.
    gain, forgetting, initial_covariance
        Of ``"pwc"`` and ``"papwc"``: ``K_c`` [-], ``lambda`` [-], and what the recursion begins
        with [1/s^4, of ``"papwc"`` that of its gains].
    position_gain, integral_gain, velocity_gain
        Of PD and PID [N/m, N/(m s), N s/m; rotary N m/rad, N m/(rad s), N m s/rad]; the first and
        the last of the feedback of a landing too.
    filter_time
        Of the differentiated position [s]; not given: the velocity is measured.
    bandwidth
        Of PID, in place of gains, with the mass in ``[guess]`` [Hz].
    dead_band
        Error within which the integral stands still [m or rad].
    dither_amplitude, dither_frequency, dither_shape
        Of ``"pid-dither"``: [N or N m], [Hz], and ``"square"`` or ``"sine"``.
    reset_law, reset_speed, reset_samples
        Of ``"pid-reset"``: ``"coulomb"`` or ``"stribeck"``, the largest speed taken for rest
        [m/s or rad/s], and for how many samples.
    most_series
        Of the landing of a flexible arm: series of pulses for a target, after which it stops.
    longest_wait
        Of ``"landing"``: how long the driven mass may take to come to rest [s].

    Raises
    ------
    InputError
        If a setting is without use for the method, or one that it needs is missing.
    """

    method: Method = "landing"
    effort_limit: float = quantity_field("effort")
    longest_width: float | None = quantity_field("time", default=None)
    patience: int | None = None
    rest_samples: int | None = None
    gain: float | None = None
    forgetting: float | None = None
    initial_covariance: float | None = None
    position_gain: float | None = quantity_field("stiffness", default=None)
    integral_gain: float | None = None
    velocity_gain: float | None = quantity_field("viscous_friction", default=None)
    filter_time: float | None = quantity_field("time", default=None)
    bandwidth: float | None = None
    dead_band: float | None = quantity_field("position", default=None)
    dither_amplitude: float | None = quantity_field("effort", default=None)
    dither_frequency: float | None = None
    dither_shape: Literal["square", "sine"] | None = None
    reset_law: Literal["coulomb", "stribeck"] | None = None
    reset_speed: float | None = quantity_field("velocity", default=None)
    reset_samples: int | None = None
    most_series: int | None = None
    longest_wait: float | None = quantity_field("time", default=None)

    __pydantic_config__: ClassVar[Any] = {"extra": "forbid"}

    def __post_init__(self) -> None:
        positive("effort_limit", self.effort_limit, "N or N m")
        method, uses = self.method, _USES[self.method]
        for name in self.given():
            if name not in uses:
                others = _RIGID if method != "feedback" else _FLEXIBLE
                users = [
                    each for each in others if name in _USES[each] and name not in others[each]
                ]
                raise InputError(
                    f"{name} is given, and method {method} has no use for it",
                    remedy="leave it out"
                    + (f", or use method {' or '.join(users)}" if users else ""),
                )
        for name in _NEEDS.get(method, ()):
            self._needed(name, f"give it, method {method} has no default for it")
        if "position_gain" in uses:
            self._check_gains()

    def given(self, *, without: tuple[str, ...] = ()) -> dict[str, Any]:
        """Return the settings that were given, by name."""
        never = ("method", "effort_limit", *without)
        return {
            each.name: value
            for each in fields(self)
            if each.name not in never and (value := getattr(self, each.name)) is not None
        }

    def check_axis(self, *, flexible: bool) -> None:
        """Refuse settings of a landing that are of the other kind of axis.

        Parameters
        ----------
        flexible
            Whether the axis is a flexible arm.

        Raises
        ------
        InputError
            If there is one.
        """
        if self.method != "landing":
            return
        for name in (_FLEXIBLE if flexible else _RIGID)["landing"]:
            if getattr(self, name) is not None:
                axis = "a flexible arm" if flexible else "a rigid axis"
                raise InputError(
                    f"{name} is given, and method landing has no use for it on {axis}",
                    where="[controller]",
                    remedy="leave it out",
                )

    @property
    def gains(self) -> dict[str, float]:
        """The gains that were given, and the time constant of the filter."""
        return {name: value for name in _GAINS if (value := getattr(self, name)) is not None}

    def _check_gains(self) -> None:
        if self.method in OF_ARMS:
            if self.gains:
                other = "give it beside the other gain, or neither, for gains that suit the axis"
                self._needed("position_gain", other)
                self._needed("velocity_gain", other)
            return
        if self.bandwidth is not None:
            if self.gains:
                raise InputError(
                    f"bandwidth and {', '.join(self.gains)} are both given",
                    remedy="keep bandwidth, which gives all gains, or the gains themselves",
                )
            return
        other = "give it" if self.method == "pd" else "give it, or bandwidth and the mass"
        self._needed("position_gain", other)
        self._needed("velocity_gain", other)
        if self.method != "pd":
            self._needed("integral_gain", other)

    def _needed(self, name: str, why: str) -> None:
        if getattr(self, name) is None:
            raise InputError(f"{name} is missing", remedy=why)
