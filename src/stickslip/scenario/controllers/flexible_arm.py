"""``[controller]`` of a flexible arm: methods landing and feedback."""

from dataclasses import replace
from itertools import pairwise
from math import ceil, pi, sqrt
from typing import Any, ClassVar

from stickslip.control import (
    PD,
    FeedbackController,
    LandingController,
    Move,
    PointToPoint,
    TrackedLandingController,
    scaled_notch,
)
from stickslip.estimation import EnergyEstimator
from stickslip.plants import FlexibleArm
from stickslip.presentation.words import prefixed
from stickslip.records import AxisKind, InputError, LearnedPulses, positive, unit_of
from stickslip.scenario.axis import DIRECTIONAL
from stickslip.scenario.controllers.base import (
    POSITION_GAIN,
    VELOCITY_GAIN,
    Controller,
    GainsByRule,
    Setup,
)
from stickslip.scenario.guess import FILES, FirstGuesses
from stickslip.scenario.table import ScenarioError, key

_SERIES = "series for a target, after which it stops"
_KNOWN = "the axis, taken as known"
_UNCERTAINTY = 0.02
"""Standard deviation of masses and spring that are guessed, over the values, by default."""

_PARTS = {"mass": "mass 1", "load_mass": "mass 2", "stiffness": "the spring"}


class _ArmController(Controller):
    """Landing and feedback of an arm."""

    guesses = (
        *_PARTS,
        *DIRECTIONAL,
        "offset",
        "friction_uncertainty",
        *FILES,
    )
    learned_names = DIRECTIONAL
    resumes = "landing"
    beside_learned = (*_PARTS, "offset", "arm_uncertainty", "learned")
    landing: ClassVar[type[LandingController]] = LandingController
    begins: ClassVar[str] = "without any"  # where no friction is guessed
    differentiates: ClassVar[bool] = False  # positions, where no velocity is measured

    def _pd(self) -> PD | None:
        """Return the gains of PD feedback; None for gains by rule, or where there is none."""
        return None

    def check(self, setup: Setup) -> None:
        super().check(setup)
        if setup.axis.bristles:
            raise ScenarioError("arm_on_bristles", where="[axis]", law=setup.axis.law)
        if setup.sensors.velocity == "none" and not self.differentiates:
            raise ScenarioError("arm_without_velocity", where="[sensors]")

    def guesses_of(self, learned: LearnedPulses, kind: AxisKind, source: str) -> FirstGuesses:
        names = (*DIRECTIONAL, *(_PARTS if "mass" in learned.values else ()))
        values = {name: (learned.values[name], learned.values[name]) for name in names}
        sources = dict.fromkeys(names, source)
        return FirstGuesses(
            kind=kind, values=values, sources=sources, learned=learned, source=source
        )

    def sources(self, setup: Setup, first: FirstGuesses, controller: Any) -> dict[str, str]:
        names = (*DIRECTIONAL, "offset")
        parts = {name: source for name, (_, source) in _parts(setup, first).items()}
        return parts | {n: first.sources[n] for n in names if n in first.sources}

    def _landing(self, setup: Setup, first: FirstGuesses, **settings: Any) -> LandingController:
        """Return the landing controller, whose feedback phase is that of method feedback too."""
        arm = self._arm(setup, first)
        task, sensors = setup.task, setup.sensors
        longest = pi / scaled_notch(arm).angular_frequency
        if task.sampling_time >= longest:
            raise ScenarioError(
                "swing_above_nyquist", where="[task]", value=task.sampling_time, limit=longest
            )
        half_swing = pi * sqrt(arm.mass_2 / arm.stiffness)
        samples = max(1, ceil(half_swing / task.sampling_time))
        return self.landing(
            sampling_time=task.sampling_time,
            target=task.all_targets[0],
            tolerance=setup.tolerance_over(samples, swing=True),
            arm=arm,
            effort_limit=self.effort_limit,
            estimator=EnergyEstimator(
                force_noise=0.0,
                inertia=arm.mass_1,
                load_inertia=arm.mass_2,
                stiffness=arm.stiffness,
                offset=False,
                **setup.running_prior(first),
            ),
            position_noise=sensors.position_deviation,
            velocity_noise=(
                sensors.velocity_noise
                if sensors.velocity == "measured"
                else sqrt(2.0) * sensors.position_deviation / task.sampling_time
            ),
            pd=self._pd(),
            travel=self.limits(setup, first).travel,
            **settings,
        )

    def _arm(self, setup: Setup, first: FirstGuesses) -> FlexibleArm:
        """Return the arm of the first guesses."""
        guess, kind, learned = setup.guess, setup.kind, first.learned
        beside = [name for name, plain in guess.plain().items() if plain in _PARTS]
        beside += ["arm_uncertainty"] if guess.arm_uncertainty is not None else []
        if (
            learned is not None
            and guess.learned is not None
            and "mass" in learned.values
            and beside
        ):
            raise ScenarioError("learned_beside", where="[guess]", names=beside)
        law = first.friction()
        held = max(law.breakaway()) + abs(law.offset)
        if self.effort_limit <= held:
            guessed = InputError(
                "limit_below_guess",
                limit=self.effort_limit,
                needed=held,
                unit=unit_of("effort", kind),
                motion="free mass 1",
                source="",
            )
            raise guessed.at("[guess]", keys=True) if guess.learned is None else guessed
        mass, load, stiffness = (value for value, _ in _parts(setup, first).values())
        return FlexibleArm(mass_1=mass, mass_2=load, stiffness=stiffness, friction=law, kind=kind)

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        sources = {name: source for name, (_, source) in _parts(setup, first).items()}
        known = ", ".join(words for name, words in _PARTS.items() if sources[name] == _KNOWN)
        notes: tuple[str, ...] = ()
        if known:
            notes += (
                f"Known to the controller as they are, as [guess] does not say other: {known}.",
            )
        if "coulomb_friction" not in first.values:
            notes += (f"No friction is guessed: the controller begins {self.begins}.",)
        if setup.axis.offset and "offset" not in first.values:
            notes += (
                "The axis has an offset, which is not learned of an arm, and none is guessed: the "
                "controller takes it for none. Give offset in [guess].",
            )
        return notes


class _ArmByFeedback(GainsByRule, _ArmController):
    """An arm under PD feedback, at first or throughout."""

    position_gain: float | None = POSITION_GAIN
    velocity_gain: float | None = VELOCITY_GAIN

    def _pd(self) -> PD | None:
        return self.given_gains()


class _ArmBySeries(_ArmController):
    """Series of pulses that land both masses."""

    learns = True
    guesses = (*_ArmController.guesses, "arm_uncertainty")
    most_series: int = key(_SERIES, default=LandingController.most_series)
    longest_wait: float | None = key(
        "longest time for the driven mass to rest", "time", positive, says="20 swings of mass 2"
    )

    def build(self, setup: Setup, first: FirstGuesses) -> LandingController:
        learned = first.learned
        settings: dict[str, Any] = {"arm_uncertainty": _uncertainty(setup)}
        if learned is not None and "mass" in learned.values:
            settings = {"experience": learned}
        settings |= {"most_series": self.most_series, "wait_limit": self.longest_wait}
        return self._landing(setup, first, **settings)

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        notes = super().notes(setup, first, controller)
        if controller.arm_uncertainty > 0.0 and setup.guess.arm_uncertainty is None:
            notes += (
                f"Masses and spring that are guessed are taken to be off by {_UNCERTAINTY:.0%} or "
                "so, and learned; arm_uncertainty in [guess] says other.",
            )
        if controller.tolerance != setup.task.tolerance:
            aim = prefixed(controller.tolerance, unit_of("position", setup.kind))
            notes += (
                f"The controller aims at {aim}: the tolerance less what the sensors may be off by "
                "while mass 1 rests.",
            )
        return notes


class ArmLanding(_ArmByFeedback, _ArmBySeries):
    """Feedback, then series of pulses that land both masses."""

    title = "feedback, then pulses that end at rest on the target"


class ArmTracked(_ArmBySeries):
    """Series of pulses that land both masses, tracked by feedback."""

    title = "pulses that end at rest on the target, tracked by feedback"
    landing = TrackedLandingController
    begins = "with a tenth of the effort limit"
    differentiates = True
    most_series: int = key(_SERIES, default=TrackedLandingController.most_series)


class ArmFeedback(_ArmByFeedback):
    """PD control with a notch and compensation of friction."""

    title = "PD control with a notch and compensation of friction"

    def build(self, setup: Setup, first: FirstGuesses) -> FeedbackController:
        """Return the feedback phase of a landing alone, along all moves of the task."""
        landing = self._landing(setup, first)
        task, memory = setup.task, landing.init().estimator_state
        whole = task.samples * task.sampling_time
        phases: list[FeedbackController] = []
        moves: list[Move] = []
        for start, target in pairwise(task.places):
            phase = landing.approach(start, target, memory)
            (move,) = phase.reference.moves
            if move.duration > whole:
                raise ScenarioError(
                    "reference_beyond_move",
                    where="[task]",
                    duration=whole,
                    needed=move.duration,
                    target=target,
                    unit=unit_of("position", landing.kind),
                )
            phases.append(phase)
            moves.append(replace(move, dwell=whole - move.duration))
        return replace(phases[0], reference=PointToPoint(start=task.start, moves=tuple(moves)))


def _parts(setup: Setup, first: FirstGuesses) -> dict[str, tuple[float, str]]:
    """Return first guesses of masses and spring, and the source of each."""
    guess, axis = setup.guess, setup.axis
    parts: dict[str, tuple[float, str]] = {}
    for name, guessed, true in (
        ("mass", guess.body, axis.body),
        ("load_mass", guess.load, axis.load),
        ("stiffness", guess.stiffness, axis.stiffness),
    ):
        parts[name] = (true or 0.0, _KNOWN)
        if first.learned is not None and name in first.values:
            value = positive(name, first.value(name), unit_of(name, setup.kind))
            parts[name] = (value, first.source)
        elif guessed is not None:
            parts[name] = (guessed, "the scenario")
    return parts


def _uncertainty(setup: Setup) -> float:
    """Return the standard deviation of masses and spring over their values [-]."""
    guess = setup.guess
    if guess.arm_uncertainty is not None:
        return guess.arm_uncertainty
    guessed = any(value is not None for value in (guess.body, guess.load, guess.stiffness))
    return _UNCERTAINTY if guessed else 0.0
