"""Pulse control by the exact law, which learns the friction of both directions from each pulse."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import exp, inf, log, sqrt
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from stickslip.compiled import compiled
from stickslip.control.checks import check_fields
from stickslip.control.equal_positions import compare
from stickslip.control.pulses import exact_state as at
from stickslip.control.pulses.controller import PulseController, longest_samples
from stickslip.control.pulses.exact_choice import plan
from stickslip.control.pulses.exact_learning import learn
from stickslip.control.pulses.kernel import (
    EXACT,
    MOVING,
    PULSING,
    STOPPED,
    emit,
    head,
    readable,
    watch,
)
from stickslip.errors import check_class
from stickslip.friction import CoulombViscousFriction
from stickslip.numerics.named_fields import places
from stickslip.records import (
    InputError,
    LearnedPulses,
    PulseMethod,
    SensorSample,
    non_negative,
    positive,
    quantity_field,
    unit_of,
    whole,
)

_LOGARITHMS = (
    "mass",
    "coulomb_friction_positive",
    "coulomb_friction_negative",
    "viscous_friction_positive",
    "viscous_friction_negative",
)
_STATIC = ("static_friction_positive", "static_friction_negative")
_HELD = ("holding_effort_positive", "holding_effort_negative")
_FREED = ("freeing_effort_positive", "freeing_effort_negative")
_WALK = "friction_walk"

_NO_VISCOUS = 1e-6  # of the mass over the sampling time: stands for none, a logarithm needs some
_FIRST_WALK = 1e-3  # by how much friction is first taken to change from pulse to pulse [-]
_ROUNDING = 1e-9  # of the largest variance
_FINEST_REST = 1e-12  # of the tolerance, where sensors have no noise

_WHY = {
    at.NO_BETTER: "the spread of a pulse is many times what is left, so that none is likely to "
    "help",
    at.EXHAUSTED: "the last pulses have not halved the error",
    at.HELD_FAST: (
        "none of the last pulses has freed the axis: it is blocked, or a sensor is frozen"
    ),
}


@compiled()
def _step(
    state: Float[np.ndarray, " s"], sample: SensorSample
) -> tuple[Float[np.ndarray, " s"], float]:
    vector = state.copy()
    if not readable(vector, EXACT, sample):
        return vector, np.nan
    s, own = head(vector), at.own_fields(vector)
    compare(s.sensor, sample.measured_position, own.noise, s.phase != PULSING, s.pulses == 0)
    if watch(vector, sample):
        if s.fresh:
            learn(s, own)
        if s.outcome == MOVING:
            plan(s, own)
    return vector, emit(s)


@dataclass(frozen=True, kw_only=True)
class ExactPulseController(PulseController):
    """Pulse control that inverts the exact law of a pulse, viscous friction included (Eq. 3).

    Each pulse lasts the fewest whole samples that the effort limit allows, with the effort that
    Eq. 3 asks for. The positions along it teach mass and friction, of each direction by itself; a
    constant offset (gravity) counts with the friction of the direction that it opposes. Estimates
    are logarithms and so stay positive.

    What lies nearer than the smallest step (Eq. 24: the breakaway is above the Coulomb friction) is
    reached by a step beyond it and a predicted step back. When no pulse is likely to improve the
    error it stops (`why` says for which reason). As the error can be halved only so often, and at
    most ``max_idle_pulses`` in a row may fail to, it cannot limit-cycle; what else moves the axis
    begins a new task.

    Attributes
    ----------
    effort_limit
        Largest effort of a pulse.
    mass
        First guess of the moving mass or inertia; not needed with ``experience``.
    friction
        First guesses, breakaway and offset included; not needed with ``experience``.
    mass_uncertainty, friction_uncertainty
        Standard deviation of mass, and of Coulomb and viscous friction, over the value given [-].
    asymmetry
        Standard deviation by which the friction of either direction departs from what the
        directions have in common, over the value given [-].
    position_noise
        Standard deviation of a sampled position, its rounding to encoder steps included.
    longest_width
        Of a pulse, rounded down to whole samples; None for no limit.
    max_idle_pulses
        So many pulses in a row may fail to halve the error before it stops; up to twice as many
        where it has come nearer before.
    experience
        What an earlier run has learned (`resumed`), in place of mass and friction; or None.

    Raises
    ------
    InputError
        If a value is out of its range, or the effort limit does not exceed the breakaway.

    Examples
    --------
    >>> from stickslip.control import RestDetection
    >>> from stickslip.plants import SingleMass
    >>> from stickslip.simulation import simulate_closed_loop
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=100.0, static_friction=130.0,
    ...                                        viscous_friction=700.0)
    >>> guess = CoulombViscousFriction.symmetric(coulomb_friction=80.0, viscous_friction=500.0)
    >>> controller = ExactPulseController(
    ...     sampling_time=0.01, target=0.01, tolerance=1e-6, effort_limit=300.0, mass=150.0,
    ...     friction=guess, rest=RestDetection(samples=1, spread=0.0, speed=0.0))
    >>> run = simulate_closed_loop(SingleMass(mass=150.0, friction=law), controller,
    ...                            sampling_time=0.01, samples=200)
    >>> controller.outcome(run.controller_state).value
    'reached'
    >>> abs(float(run.motion.position[-1]) - 0.01) < 1e-6
    True
    """

    effort_limit: float = quantity_field("effort")
    mass: float | None = quantity_field("mass", default=None)
    friction: CoulombViscousFriction | None = None
    mass_uncertainty: float = 0.05
    friction_uncertainty: float = 0.5
    asymmetry: float = 0.2
    position_noise: float = quantity_field("position", default=0.0)
    longest_width: float | None = quantity_field("time", default=None)
    max_idle_pulses: int = 10
    experience: LearnedPulses | None = None
    method: ClassVar[PulseMethod] = "exact"
    _kernel: ClassVar[Any] = _step

    def __post_init__(self) -> None:
        super().__post_init__()
        self._check(positive, "effort_limit", "mass")
        if self.mass is None and self.experience is None:
            raise InputError("no_first_guess", names=("mass",))
        if self.experience is None or self.friction is not None:
            check_class("friction", self.friction, CoulombViscousFriction)
        ratios = ("mass_uncertainty", "friction_uncertainty", "asymmetry")
        check_fields(self, non_negative, dict.fromkeys(ratios, "(no unit)"))
        self._check(non_negative, "position_noise")
        longest_samples(self.longest_width, self.sampling_time)
        whole("max_idle_pulses", self.max_idle_pulses, least=1)
        if self.friction is not None:
            self._check_friction(self.friction)
        if self.experience is not None:
            self._check_experience(self.experience)

    def _check_friction(self, law: CoulombViscousFriction) -> None:
        unit = self._unit("effort_limit")
        for direction, (coulomb, static) in zip(
            ("positive", "negative"), _resistances(law), strict=True
        ):
            if not coulomb > 0.0:
                raise InputError(
                    "pulse_never_ends",
                    direction=direction,
                    coulomb=coulomb,
                    offset=law.offset,
                    unit=unit,
                )
            if not self.effort_limit > static:
                raise InputError(
                    "effort_below_breakaway",
                    name="effort_limit",
                    value=self.effort_limit,
                    limit_name=f"breakaway in {direction} direction",
                    limit=static,
                    unit=unit,
                )

    def _check_experience(self, learned: LearnedPulses) -> None:
        names = (*_LOGARITHMS, *_STATIC, *_HELD, *_FREED, _WALK)
        self._check_learned(learned, names, at.PARAMETERS)
        for name in names:
            value, unit = learned.values[name], unit_of(name, self.kind)
            strict = name in _LOGARITHMS or name in _FREED
            if value < 0.0 or (strict and value == 0.0):
                code = "not_positive" if strict else "negative"
                raise InputError(code, where="values", name=name, value=value, unit=unit)
        P = learned.covariance
        if not (np.array_equal(P, P.T) and np.linalg.eigvalsh(P)[0] >= -_ROUNDING * P.max()):
            raise InputError("covariance_not_definite", where="covariance")

    def init(self) -> Float[np.ndarray, " s"]:
        """Return the state before the first sample."""
        state = self._first_state(places(at.OWN_DTYPE))
        own = at.own_fields(state)
        own.period, own.limit = self.sampling_time, self.effort_limit
        own.longest = longest_samples(self.longest_width, self.sampling_time)
        own.noise = self.position_noise
        rest_noise = self.position_noise / sqrt(self.rest.samples)
        own.rest_noise = max(rest_noise, _FINEST_REST * self.tolerance)
        own.max_idle_pulses = self.max_idle_pulses
        own.best = own.half_error = own.allowed = inf
        known = self.experience
        values, P = self._guess() if known is None else (known.values, known.covariance)
        own.values = [log(values[name]) for name in _LOGARITHMS]
        own.covariance = P
        own.breakaway = [values[name] for name in _STATIC]
        own.held = [values[name] for name in _HELD]
        own.moved_at = [min(values[name], self.effort_limit) for name in _FREED]
        own.share = 1.0, 1.0
        own.walk = values[_WALK] ** 2
        return state

    def _guess(self) -> tuple[Mapping[str, float], Float[np.ndarray, "p p"]]:
        """Return values and covariance of the first guesses, as of what is learned."""
        law, mass = self.friction, self.mass
        if law is None or mass is None:
            raise InputError("no_first_guess", names=("mass", "friction"))
        least = _NO_VISCOUS * mass / self.sampling_time
        coulomb, static = zip(*_resistances(law), strict=True)
        viscous = [
            max(c, least) for c in (law.viscous_friction_positive, law.viscous_friction_negative)
        ]
        both, apart = self.friction_uncertainty**2, self.asymmetry**2
        P = np.zeros((at.PARAMETERS, at.PARAMETERS))
        P[0, 0] = self.mass_uncertainty**2
        for i in (at.COULOMB, at.VISCOUS):
            P[i : i + 2, i : i + 2] = both + apart * np.eye(2)
        values = {
            **dict(zip(_LOGARITHMS, (mass, *coulomb, *viscous), strict=True)),
            **dict(zip(_STATIC, static, strict=True)),
            **dict.fromkeys(_HELD, 0.0),
            **dict.fromkeys(_FREED, self.effort_limit),
            _WALK: _FIRST_WALK,
        }
        return values, P

    def retargeted(self, state: Float[np.ndarray, " s"], target: float) -> Float[np.ndarray, " s"]:
        """Return the state with another target [m or rad]; a current pulse is finished first."""
        vector = super().retargeted(state, target)
        own = at.own_fields(vector)
        own.best = own.half_error = inf
        return vector

    def estimates(self, state: Float[np.ndarray, " s"]) -> dict[str, float]:
        """Return mass and friction of either direction, offsets included [SI]."""
        own = at.own_fields(state)
        # Not NumPy's exponential, whose last bit depends on the processor, unlike that of C
        values, static = map(exp, own.values), own.breakaway.tolist()
        return dict(zip((*_LOGARITHMS, *_STATIC), (*values, *static), strict=True))

    def why(self, state: Float[np.ndarray, " s"]) -> str | None:
        """Return why the controller has stopped short of the target; None if it has not."""
        stopped = head(state).outcome == STOPPED
        return _WHY[int(at.own_fields(state).reason)] if stopped else None

    def learned(self, state: Float[np.ndarray, " s"]) -> LearnedPulses:
        """Return what was learned, with the covariance of the logarithms of mass and friction."""
        own = at.own_fields(state)
        return self._learned(
            {
                **self.estimates(state),
                **dict(zip(_HELD, own.held.tolist(), strict=True)),
                **dict(zip(_FREED, own.moved_at.tolist(), strict=True)),
                _WALK: sqrt(float(own.walk)),
            },
            own.covariance.copy(),
        )

    def resumed(
        self, learned: LearnedPulses, *, keep_covariance: bool = True
    ) -> "ExactPulseController":
        """Return the same controller, beginning with what an earlier run has learned.

        As `PulseController.resumed`; without the covariance it is as uncertain as of a first guess.
        """
        again = replace(self, experience=learned)
        if keep_covariance:
            return again
        return replace(self, experience=replace(learned, covariance=self._guess()[1]))


def _resistances(
    law: CoulombViscousFriction,
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return Coulomb and static friction with the offset, in either direction [N or N m]."""
    return (
        (law.coulomb_friction_positive + law.offset, law.static_friction_positive + law.offset),
        (law.coulomb_friction_negative - law.offset, law.static_friction_negative - law.offset),
    )
