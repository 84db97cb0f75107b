"""``[controller]`` of pulse controllers: methods exact, papwc and pwc."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, ClassVar

from stickslip.control import (
    ExactPulseController,
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
)
from stickslip.records import InputError, unit_of
from stickslip.scenario.controllers.base import LONGEST_WIDTH, REST_SAMPLES, Controller
from stickslip.scenario.controllers.resting import aim_of, rest_notes, rest_of
from stickslip.scenario.controllers.setup import Setup
from stickslip.scenario.guess import AXIS_GUESSES, FILES, FirstGuesses
from stickslip.scenario.table import key

__all__ = ["ExactPulses", "PulseAmplitudeWidth", "PulseWidth", "check_guess", "uncertainty_notes"]

_TABLE_1 = 1e-5 * (150.0 * 300.0) ** 2
"""Published P(0) of PAPWC times the squared product of mass and effort of the published pulses: the
spread of A1 f^2 beside that of A2 f is then the same on every axis."""

_MUCH = 10.0

_UNCERTAINTIES = ("mass_uncertainty", "friction_uncertainty", "asymmetry")


class _Pulses(Controller):
    """A controller that moves an axis from rest to rest by pulses."""

    learns: ClassVar[bool] = True
    longest_width: float | None = LONGEST_WIDTH
    max_idle_pulses: int = key("pulses without progress after which it stops", default=3)
    rest_samples: int | None = REST_SAMPLES

    def _common(self, setup: Setup) -> dict[str, Any]:
        rest = rest_of(setup, self.rest_samples)
        return {
            "sampling_time": setup.task.sampling_time,
            "target": setup.task.goals[0],
            "tolerance": aim_of(setup, rest),
            "rest": rest,
            "kind": setup.kind,
            "longest_width": self.longest_width,
            "max_idle_pulses": self.max_idle_pulses,
        }

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        """Return how rest is judged."""
        return rest_notes(setup, rest_of(setup, self.rest_samples))


class ExactPulses(_Pulses):
    """Pulses by the exact law; stops when none can help."""

    title: ClassVar[str] = "pulses planned by the exact law of Coulomb and viscous friction"
    guesses: ClassVar[tuple[str, ...]] = (*AXIS_GUESSES, *_UNCERTAINTIES, *FILES)
    max_idle_pulses: int = key(
        "pulses without progress after which it stops", default=ExactPulseController.max_idle_pulses
    )

    def build(self, setup: Setup, first: FirstGuesses) -> ExactPulseController:
        """Return the controller, as of the base class."""
        settings: dict[str, Any] = {
            "effort_limit": self.effort_limit,
            "position_noise": setup.sensors.position_deviation,
            **self._common(setup),
        }
        if first.learned is not None:
            return ExactPulseController(experience=first.learned, **settings)
        check_guess(self, first)
        given = setup.guess.given()
        uncertainties = first.uncertainties() | {
            name: given[name] for name in _UNCERTAINTIES if name in given
        }
        return ExactPulseController(
            mass=first.mass(),
            friction=first.friction(default=False),
            **uncertainties,
            **settings,
        )

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        """Return also the uncertainties that an estimate holds."""
        return super().notes(setup, first, controller) + uncertainty_notes(self, setup, first)


class _Adaptive(_Pulses):
    """A pulse controller as published, which adapts one or two gains."""

    guesses: ClassVar[tuple[str, ...]] = ("mass", "coulomb_friction", "static_friction", *FILES)

    controller: ClassVar[Any]
    """Its class in `stickslip.control`."""

    first_gains: ClassVar[Mapping[str, str]]
    """Its first gains, by the names of those that it learns."""

    gain: float = key("share of the error that a pulse is to take away, $K_c$", default=1.0)
    forgetting: float = key("forgetting factor $\\lambda$ of the recursion", default=1.0)
    initial_covariance: float

    def build(self, setup: Setup, first: FirstGuesses) -> PulseController:
        """Return the controller, as of the base class."""
        settings = {"pulse_effort": self.effort_limit, "gain": self.gain, **self._common(setup)}
        own = {"forgetting": self.forgetting, "initial_covariance": self.initial_covariance}
        learned = first.learned
        if learned is not None:
            gains = {name: learned.values[each] for each, name in self.first_gains.items()}
            return self.controller(**gains, **own, **settings).resumed(learned)
        check_guess(self, first)
        begun = self.controller.from_friction(
            mass=first.mass(),
            coulomb_friction=first.value("coulomb_friction"),
            static_friction=first.known("static_friction").get("static_friction"),
            **settings,
        )
        return replace(begun, **own)


class PulseWidth(_Adaptive):
    """Adaptive pulse width control."""

    title: ClassVar[str] = "adaptive pulse width control"
    controller: ClassVar[Any] = PulseWidthController
    learned_names: ClassVar[tuple[str, ...]] = ("pulse_gain",)
    first_gains: ClassVar[Mapping[str, str]] = {"pulse_gain": "first_gain"}
    initial_covariance: float = key("$F(0)$ of the recursion", ("1/s^4", "1/s^4"), default=1e5)


class PulseAmplitudeWidth(_Adaptive):
    """Adaptive pulse amplitude pulse width control."""

    title: ClassVar[str] = "adaptive pulse amplitude pulse width control"
    controller: ClassVar[Any] = PulseAmplitudeWidthController
    learned_names: ClassVar[tuple[str, ...]] = ("gain_1", "gain_2")
    first_gains: ClassVar[Mapping[str, str]] = {
        "gain_1": "first_gain_1",
        "gain_2": "first_gain_2",
    }
    initial_covariance: float = key("$P(0)$ of the recursion, over the identity", default=1e-5)

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        """Return also whether the default P(0) is small beside the gains of this axis."""
        notes = super().notes(setup, first, controller)
        if first.learned is not None or "initial_covariance" in self.model_fields_set:
            return notes
        alike = _TABLE_1 / (first.value("mass") * self.effort_limit) ** 2
        if alike <= _MUCH * self.initial_covariance:
            return notes
        return (
            *notes,
            f"PAPWC begins with initial_covariance {self.initial_covariance:g}, which suits the "
            "published axis of 150 kg and 300 N; this one hardly learns with it. What is alike "
            f"here is {alike:.1g}.",
        )


def check_guess(table: Controller, first: FirstGuesses) -> None:
    """Check that some pulse would move the axis by the first guesses."""
    unit, limit = unit_of("effort", first.kind), table.effort_limit
    offset = first.known("offset").get("offset", 0.0)
    for name in ("static_friction", "coulomb_friction"):
        if name not in first.values:
            continue
        forward, backward = first.pair(name)
        for way, needed in (("positive", forward + offset), ("negative", backward - offset)):
            if limit <= needed:
                raise InputError(
                    f"effort_limit is {limit:g} {unit}, and by the first guess it takes "
                    f"{needed:g} {unit} to move the axis in the {way} direction ({name} "
                    f"from {first.sources[name]})",
                    where="[guess]",
                    remedy="guess less, or allow more effort",
                )


def uncertainty_notes(table: Controller, setup: Setup, first: FirstGuesses) -> tuple[str, ...]:
    """Return with which uncertainties of an estimate a controller begins."""
    held = {
        name: value
        for name, value in first.uncertainties().items()
        if name not in setup.guess.given() and name in table.used()
    }
    if not held:
        return ()
    each = " and ".join(f"{name} {value:.2g}" for name, value in held.items())
    estimate = setup.guess.estimate
    return (f"By the standard deviations of estimate {estimate} it begins with {each}.",)
