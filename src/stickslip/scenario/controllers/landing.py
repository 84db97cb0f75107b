"""``[controller]`` of the landing of a rigid axis: method landing."""

from dataclasses import replace
from typing import Any, ClassVar

from pydantic import model_validator

from stickslip.control import AxisLandingController
from stickslip.estimation import EnergyEstimator
from stickslip.plants import SingleMass
from stickslip.records import AxisKind, InputError, LearnedPulses, positive
from stickslip.scenario.body import DIRECTIONAL
from stickslip.scenario.controllers.base import (
    LONGEST_WIDTH,
    POSITION_GAIN,
    REST_SAMPLES,
    VELOCITY_GAIN,
    Controller,
)
from stickslip.scenario.controllers.pulses import check_guess, uncertainty_notes
from stickslip.scenario.controllers.resting import aim_of, rest_notes, rest_of
from stickslip.scenario.controllers.setup import Setup
from stickslip.scenario.guess import AXIS_GUESSES, FILES, FirstGuesses, check_learned
from stickslip.scenario.table import key

__all__ = ["AxisLanding"]


class AxisLanding(Controller):
    """Feedback, then pulses by the exact law."""

    title: ClassVar[str] = "feedback, then pulses that end at rest on the target"
    learns: ClassVar[bool] = True
    guesses: ClassVar[tuple[str, ...]] = (*AXIS_GUESSES, "mass_uncertainty", *FILES)
    learned_names: ClassVar[tuple[str, ...]] = (
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

    @model_validator(mode="after")
    def _check_gains(self) -> "AxisLanding":
        self.given_gains()
        return self

    def check(self, setup: Setup) -> None:
        """Check the settings against the other tables, as of the base class."""
        super().check(setup)
        if setup.sensors.velocity == "none":
            raise InputError(
                "velocity is none, and the feedback of method landing needs it",
                where="[sensors]",
                remedy="measure the velocity, or use method exact",
            )

    def guesses_of(self, learned: LearnedPulses, kind: AxisKind, source: str) -> FirstGuesses:
        """Return what pulses have learned as first guesses, as of the base class."""
        check_learned(learned, method="exact", kind=kind, names=self.learned_names)
        found = learned.values
        # The friction of each direction has the offset in it
        values = {
            name: (found[f"{name}_positive"], found[f"{name}_negative"]) for name in DIRECTIONAL
        }
        values["mass"] = (found["mass"], found["mass"])
        return FirstGuesses(kind=kind, values=values, learned=learned, source=source)

    def build(self, setup: Setup, first: FirstGuesses) -> AxisLandingController:
        """Return the controller, as of the base class."""
        if first.learned is None:
            check_guess(self, first)
        mass = first.mass()
        # The estimator that runs along does not distinguish the directions
        values = first.known("coulomb_friction", "viscous_friction")
        law = first.friction(symmetric=True)
        rest = rest_of(setup, self.rest_samples)
        uncertainties = first.uncertainties() | setup.guess.given()
        uncertainty = uncertainties.get("mass_uncertainty", AxisLandingController.mass_uncertainty)
        controller = AxisLandingController(
            sampling_time=setup.task.sampling_time,
            target=setup.task.goals[0],
            tolerance=aim_of(setup, rest),
            axis=SingleMass(mass=mass, friction=law, kind=setup.kind),
            effort_limit=self.effort_limit,
            estimator=EnergyEstimator(
                inertia=mass, offset=False, force_noise=0.0, initial_values=values or None
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
        """Return how rest is judged, and with what the controller begins."""
        notes = rest_notes(setup, rest_of(setup, self.rest_samples))
        if first.learned is not None:
            return notes
        notes += uncertainty_notes(self, setup, first)
        if "coulomb_friction" not in first.values:
            notes += ("No friction is guessed: the controller begins without any.",)
        return notes
