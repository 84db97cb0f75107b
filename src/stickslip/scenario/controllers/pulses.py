"""``[controller]`` of a rigid axis that pulses move: methods landing, exact, papwc and pwc."""

from dataclasses import replace
from typing import Any, ClassVar

from stickslip.control import (
    AxisLandingController,
    ExactPulseController,
    PositionController,
    PreciseController,
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
)
from stickslip.estimation import EnergyEstimator
from stickslip.plants import SingleMass
from stickslip.records import AxisKind, InputError, LearnedPulses, non_negative, positive, unit_of
from stickslip.scenario.axis import DIRECTIONAL
from stickslip.scenario.controllers.base import (
    LONGEST_WIDTH,
    POSITION_GAIN,
    REST_SAMPLES,
    VELOCITY_GAIN,
    Controller,
    GainsByRule,
    Setup,
)
from stickslip.scenario.guess import AXIS_GUESSES, FILES, FirstGuesses
from stickslip.scenario.table import ScenarioError, key

_TABLE_1 = 1e-5 * (150.0 * 300.0) ** 2
"""Published P(0) of PAPWC times the squared product of mass and effort of the published pulses: the
spread of A1 f^2 beside that of A2 f is then the same on every axis."""

_MUCH = 10.0  # ratio of initial covariances beyond which a note is given

_RUNNING = ("coulomb_friction", "viscous_friction")
_UNCERTAINTIES = ("mass_uncertainty", "friction_uncertainty", "asymmetry")


class _Pulses(Controller):
    """Pulses from rest to rest."""

    learns = True
    longest_width: float | None = LONGEST_WIDTH
    max_idle_pulses: int = key("pulses without progress after which it stops", default=3)
    rest_samples: int | None = REST_SAMPLES

    def _common(self, setup: Setup) -> dict[str, Any]:
        rest = setup.rest(self.rest_samples)
        return {
            "sampling_time": setup.task.sampling_time,
            "target": setup.task.all_targets[0],
            "tolerance": setup.tolerance_at(rest),
            "rest": rest,
            "kind": setup.kind,
            "longest_width": self.longest_width,
            "max_idle_pulses": self.max_idle_pulses,
        }

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        return setup.rest_notes(self.rest_samples)


class ExactPulses(_Pulses):
    """Pulses by the exact law; stops when none can help."""

    title = "pulses planned by the exact law of Coulomb and viscous friction"
    guesses = (*AXIS_GUESSES, *_UNCERTAINTIES, *FILES)
    max_idle_pulses: int = key(
        "pulses without progress after which it stops", default=ExactPulseController.max_idle_pulses
    )

    def build(self, setup: Setup, first: FirstGuesses) -> PositionController[Any]:
        return self._pulses(setup, first)

    def _pulses(self, setup: Setup, first: FirstGuesses) -> ExactPulseController:
        settings: dict[str, Any] = {
            "effort_limit": self.effort_limit,
            "position_noise": setup.sensors.position_deviation,
            **self._common(setup),
        }
        if first.learned is not None:
            return ExactPulseController(experience=first.learned, **settings)
        _check_guess(self, first)
        given = setup.guess.given()
        unknown = {} if first.spread is None else {"friction_uncertainty": first.spread}
        uncertainties = (
            first.uncertainties()
            | unknown
            | {name: given[name] for name in _UNCERTAINTIES if name in given}
        )
        return ExactPulseController(
            mass=first.mass(),
            friction=first.friction(default=False),
            **uncertainties,
            **settings,
        )

    def sources(self, setup: Setup, first: FirstGuesses, controller: Any) -> dict[str, str]:
        sources = super().sources(setup, first, controller)
        if first.learned is None:
            sources.setdefault("static_friction", "Coulomb friction, as none is given")
        return sources

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        return super().notes(setup, first, controller) + _uncertainty_notes(self, setup, first)


class Precise(ExactPulses):
    """A fast move with feedback, then pulses by the exact law."""

    title = "fast move with feedback, then pulses by the exact law"
    resumes = "exact"
    delay: float | None = key(
        "known delay of drive and sensors", "time", non_negative, says="learned in the first move"
    )

    def build(self, setup: Setup, first: FirstGuesses) -> PreciseController:
        first = self._completed(setup, first)
        return PreciseController(pulses=self._pulses(setup, first), delay=self.delay)

    def _completed(self, setup: Setup, first: FirstGuesses) -> FirstGuesses:
        """Return the first guesses with friction, which is learned in the first move."""
        missing = _missing_friction(first)
        if not missing:
            return first
        law = PreciseController.unknown_friction(
            mass=first.mass(),
            effort_limit=self.effort_limit,
            distance=setup.task.longest_move or setup.task.tolerance,
        )
        coulomb, viscous = law.coulomb_friction_positive, law.viscous_friction_positive
        coulomb = min(coulomb, *first.values.get("static_friction", (coulomb,)))
        rule = {"coulomb_friction": (coulomb, coulomb), "viscous_friction": (viscous, viscous)}
        spread = PreciseController.unknown_spread if "coulomb_friction" in missing else None
        return replace(
            first,
            values={**first.values, **{name: rule[name] for name in missing}},
            spread=spread,
        )

    def sources(self, setup: Setup, first: FirstGuesses, controller: Any) -> dict[str, str]:
        rule = "a rule from mass, effort limit and travel, as none is given"
        sources = super().sources(setup, first, controller)
        return sources | dict.fromkeys(_missing_friction(first), rule)

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        notes = super().notes(setup, first, controller)
        note = "Friction that [guess] does not state begins by a rule; the first move estimates it."
        return (*notes, note) if _missing_friction(first) else notes


class _Adaptive(_Pulses):
    """A pulse controller as published, which adapts one or two gains."""

    guesses = ("mass", "coulomb_friction", "static_friction", *FILES)

    controller: ClassVar[Any]  # its class in `stickslip.control`
    first_gains: ClassVar[tuple[str, ...]]  # settings of the gains that it learns, in their order

    gain: float = key("share of the error that a pulse is to take away, $K_c$", default=1.0)
    forgetting: float = key("forgetting factor $\\lambda$ of the recursion", default=1.0)
    initial_covariance: float

    def build(self, setup: Setup, first: FirstGuesses) -> PulseController:
        settings = {"pulse_effort": self.effort_limit, "gain": self.gain, **self._common(setup)}
        own = {"forgetting": self.forgetting, "initial_covariance": self.initial_covariance}
        learned = first.learned
        if learned is not None:
            gains = (learned.values[name] for name in self.learned_names)
            first_gains = dict(zip(self.first_gains, gains, strict=True))
            return self.controller(**first_gains, **own, **settings).resumed(learned)
        _check_guess(self, first)
        mass, coulomb = first.mass(), first.value("coulomb_friction")
        static = first.known("static_friction").get("static_friction", coulomb)
        if static < coulomb:
            raise InputError(
                "static_below_coulomb",
                name="static_friction",
                value=static,
                coulomb=coulomb,
                unit=unit_of("effort", setup.kind),
            )
        names = "pulse_effort", "sampling_time", "target", "tolerance", "rest"
        needed = {name: settings.pop(name) for name in names}
        begun = self.controller.from_friction(mass=mass, coulomb_friction=coulomb, **needed)
        return replace(begun, **own, **settings)


class PulseWidth(_Adaptive):
    """Adaptive pulse width control."""

    title = "adaptive pulse width control"
    controller = PulseWidthController
    learned_names = ("pulse_gain",)
    first_gains = ("first_gain",)
    initial_covariance: float = key("$F(0)$ of the recursion", ("1/s^4", "1/s^4"), default=1e5)


class PulseAmplitudeWidth(_Adaptive):
    """Adaptive pulse amplitude pulse width control."""

    title = "adaptive pulse amplitude pulse width control"
    controller = PulseAmplitudeWidthController
    learned_names = ("gain_1", "gain_2")
    first_gains = ("first_gain_1", "first_gain_2")
    initial_covariance: float = key("$P(0)$ of the recursion, over the identity", default=1e-5)

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
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


class AxisLanding(GainsByRule):
    """Feedback, then pulses by the exact law."""

    title = "feedback, then pulses that end at rest on the target"
    resumes = "exact"
    learns = True
    guesses = (
        *AXIS_GUESSES,
        "mass_uncertainty",
        "friction_uncertainty",
        *FILES,
    )
    learned_names = (
        "mass",
        *(f"{name}_{side}" for name in DIRECTIONAL for side in ("positive", "negative")),
    )
    longest_width: float | None = LONGEST_WIDTH
    rest_samples: int | None = REST_SAMPLES
    position_gain: float | None = POSITION_GAIN
    velocity_gain: float | None = VELOCITY_GAIN
    longest_wait: float | None = key(
        "longest time for the driven mass to rest", "time", positive, says="100 samples"
    )

    def check(self, setup: Setup) -> None:
        super().check(setup)
        if setup.sensors.velocity == "none":
            raise ScenarioError("landing_without_velocity", where="[sensors]")

    def guesses_of(self, learned: LearnedPulses, kind: AxisKind, source: str) -> FirstGuesses:
        found = learned.values
        # The friction of each direction has the offset in it
        values = {
            name: (found[f"{name}_positive"], found[f"{name}_negative"]) for name in DIRECTIONAL
        }
        values["mass"] = (found["mass"], found["mass"])
        # Limits that pulses have shown may lie below an estimate
        sides = zip(values["static_friction"], values["coulomb_friction"], strict=True)
        forward, backward = (max(pair) for pair in sides)
        values["static_friction"] = (forward, backward)
        return FirstGuesses(kind=kind, values=values, learned=learned, source=source)

    def build(self, setup: Setup, first: FirstGuesses) -> AxisLandingController:
        if first.learned is None:
            _check_guess(self, first)
        mass = first.mass()
        law = first.friction(symmetric=True)
        rest = setup.rest(self.rest_samples)
        uncertainties = first.uncertainties() | setup.guess.given()
        uncertainty = uncertainties.get("mass_uncertainty", AxisLandingController.mass_uncertainty)
        controller = AxisLandingController(
            sampling_time=setup.task.sampling_time,
            target=setup.task.all_targets[0],
            tolerance=setup.tolerance_at(rest),
            axis=SingleMass(mass=mass, friction=law, kind=setup.kind),
            effort_limit=self.effort_limit,
            # The estimator that runs along does not distinguish the directions
            estimator=EnergyEstimator(
                inertia=mass, offset=False, force_noise=0.0, **setup.running_prior(first)
            ),
            rest=rest,
            position_noise=setup.sensors.position_deviation,
            velocity_noise=setup.sensors.velocity_noise,
            longest_width=self.longest_width,
            mass_uncertainty=uncertainty,
            pd=self.given_gains(),
            wait_limit=self.longest_wait,
        )
        return replace(controller, experience=first.learned) if first.learned else controller

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        notes = setup.rest_notes(self.rest_samples)
        if first.learned is not None:
            return notes
        notes += _uncertainty_notes(self, setup, first)
        if "coulomb_friction" not in first.values:
            notes += ("No friction is guessed: the controller begins without any.",)
        return notes


def _missing_friction(first: FirstGuesses) -> list[str]:
    """Return the names of the friction without a first guess."""
    return [] if first.learned is not None else [n for n in _RUNNING if n not in first.values]


def _check_guess(table: Controller, first: FirstGuesses) -> None:
    """Check that by the first guesses some pulse would move the axis."""
    unit, limit = unit_of("effort", first.kind), table.effort_limit
    offset = first.known("offset").get("offset", 0.0)
    for name in ("static_friction", "coulomb_friction"):
        if name not in first.values:
            continue
        forward, backward = first.pair(name)
        for direction, needed in (("positive", forward + offset), ("negative", backward - offset)):
            if limit <= needed:
                raise ScenarioError(
                    "limit_below_guess",
                    where="[guess]",
                    limit=limit,
                    needed=needed,
                    unit=unit,
                    motion=f"move the axis in the {direction} direction",
                    source=f"{name} from {first.sources[name]}",
                )


def _uncertainty_notes(table: Controller, setup: Setup, first: FirstGuesses) -> tuple[str, ...]:
    """Return a note on the uncertainties that an estimate gives a controller."""
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
