"""``[controller]``: the common part of all controllers, and the setup that they are built for."""

from abc import abstractmethod
from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import Any, ClassVar

from pydantic import model_validator

from stickslip.control import (
    PD,
    ExactPulseController,
    Limits,
    PositionController,
    RestDetection,
    SensorErrors,
)
from stickslip.presentation.words import prefixed
from stickslip.records import (
    AxisKind,
    InputError,
    LearnedPulses,
    count_of,
    non_negative,
    positive,
    unit_of,
)
from stickslip.scenario.axis import Axis
from stickslip.scenario.guess import FirstGuesses, GuessTable, guesses_from, learned_from
from stickslip.scenario.table import ScenarioError, Table, key, required
from stickslip.scenario.task import SensorsTable, TaskTable

_BY_RULE = "by a rule; both gains or neither"
POSITION_GAIN: Any = key("proportional gain", ("N/m", "N m/rad"), positive, says=_BY_RULE)
VELOCITY_GAIN: Any = key("derivative gain", ("N s/m", "N m s/rad"), non_negative, says=_BY_RULE)
LONGEST_WIDTH: Any = key("longest pulse", "time", positive, says="no limit")
REST_SAMPLES: Any = key(
    "positions that must agree for a rest; twice as many must fit into a move",
    says="10; with ideal sensors 1, without a velocity 2",
)

_HELD_WITHIN = 100.0  # travel of an axis that is only held, in tolerances

_REST_MOTION = 0.01  # share of the tolerance: an axis on bristles that moves no farther rests

_CONTINUOUS = 1e-9  # step of an encoder without steps, over the noise: too fine to matter

_SURELY = 3.0  # largest error of a mean of measurements, in its standard deviations

_REST_SAMPLES = 10  # samples over which a rest is judged by default, where sensors are not ideal


@dataclass(frozen=True, kw_only=True)
class Setup:
    """All tables of a positioning task but that of the controller."""

    axis: Axis
    task: TaskTable
    sensors: SensorsTable
    guess: GuessTable

    @property
    def kind(self) -> AxisKind:
        """``"linear"`` or ``"rotary"``."""
        return self.axis.kind

    @property
    def rest_motion(self) -> float:
        """Largest motion of an axis at rest [m or rad]; on bristles nothing rests exactly."""
        return _REST_MOTION * self.task.tolerance if self.axis.bristles else 0.0

    def rest(self, given: int | None) -> RestDetection:
        """Return when the axis counts as resting, by its sensors; ``given`` is in samples."""
        sensors = self.sensors
        if sensors.position_noise == 0.0 and sensors.encoder_step == 0.0:
            exact = sensors.velocity == "measured" and sensors.velocity_noise == 0.0
            if exact and not self.rest_motion:
                window = self._window(given, usual=1, least=1)
                return RestDetection(samples=window, spread=0.0, speed=0.0)
            window = self._window(given, usual=_REST_SAMPLES if self.rest_motion else 2, least=2)
            return RestDetection(samples=window, spread=self.rest_motion)
        window = self._window(given, usual=_REST_SAMPLES, least=2)
        noise = sensors.position_noise
        step = sensors.encoder_step or _CONTINUOUS * noise
        # By the positions alone: a velocity may have been made of them, and is never 0 then
        return RestDetection.for_encoder(resolution=step, noise=noise, samples=window)

    def _window(self, given: int | None, *, usual: int, least: int) -> int:
        """Return over how many samples a rest is judged, which must fit into a move twice."""
        move = self.task.samples
        samples = usual if given is None else given
        if samples < least:
            raise ScenarioError(
                "rest_samples_too_few", where="[controller]", samples=samples, least=least
            )
        # A pulse waits for a rest, and its outcome for another
        if 2 * samples >= move:
            raise ScenarioError(
                "rest_samples_too_many",
                where="[controller]",
                samples=samples,
                by_default=given is None,
                move=move,
            )
        return samples

    def tolerance_at(self, rest: RestDetection) -> float:
        """Return the controller's own tolerance where a rest is judged over some samples."""
        return self.tolerance_over(rest.samples)

    def tolerance_over(self, samples: int, *, swing: bool = False) -> float:
        """Return the tolerance less the largest error of the mean of measured positions.

        ``swing`` is whether the samples are those of half a swing.
        """
        sensors, tolerance = self.sensors, self.task.tolerance
        noise = _SURELY * sensors.position_noise / sqrt(samples)
        off = 0.5 * (sensors.encoder_step + self.rest_motion) + noise
        if tolerance <= off:
            raise ScenarioError(
                "tolerance_below_noise_of_swing" if swing else "tolerance_below_noise",
                where="[task]",
                tolerance=tolerance,
                samples=samples,
                error=off,
                unit=unit_of("position", self.kind),
            )
        return tolerance - off

    def running_prior(self, first: FirstGuesses) -> dict[str, Any]:
        """Return first guesses and P(0) of a friction estimator that runs along."""
        task, given = self.task, self.guess.friction_uncertainty
        return first.running(
            uncertainty=ExactPulseController.friction_uncertainty if given is None else given,
            speed=max(task.longest_move, task.tolerance) / task.duration,
        )

    def rest_notes(self, given: int | None) -> tuple[str, ...]:
        """Return notes on when the axis rests, and on the controller's own tolerance."""
        rest, unit = self.rest(given), unit_of("position", self.kind)
        own = self.tolerance_at(rest)
        note = "The axis counts as resting in the sample in which its velocity is 0."
        if rest.samples > 1:
            velocity = "" if rest.speed is None else " and no velocity is seen"
            note = (
                f"The axis counts as resting when {count_of(rest.samples, 'position')} in a row "
                f"lie within {prefixed(rest.spread, unit)}{velocity}."
            )
        if own == self.task.tolerance:
            return (note,)
        return (
            note,
            f"The controller aims at {prefixed(own, unit)}: the tolerance less what the sensors "
            "may be off by at rest.",
        )


class Controller(Table):
    """The table of a controller: its settings, and how it is built."""

    shows_defaults = False
    title: ClassVar[str]  # the controller in words
    guesses: ClassVar[tuple[str, ...]] = ()  # quantities of ``[guess]`` that it uses
    learns: ClassVar[bool] = False  # whether it learns values that can be saved
    learned_names: ClassVar[tuple[str, ...]] = ()  # those that it needs to resume
    resumes: ClassVar[str] = ""  # method whose learned values it takes; empty for its own
    beside_learned: ClassVar[tuple[str, ...]] = ("learned",)  # allowed in ``[guess]`` then

    method: str = required("controller")
    effort_limit: float = required(
        "largest effort; of pwc, that of every pulse", "effort", positive
    )

    @abstractmethod
    def build(self, setup: Setup, first: FirstGuesses) -> PositionController[Any]:
        """Return the controller, set to the first target."""

    def limits(self, setup: Setup, first: FirstGuesses) -> Limits:
        """Return the limits within which the controller runs, by the task."""
        task, sensors, axis, guess = setup.task, setup.sensors, setup.axis, setup.guess

        def part(name: str, guessed: float | None, known: float | None) -> float:
            return first.value(name) if name in first.values else guessed or known or 0.0

        places = task.places
        if len(set(places)) == 1:  # a task that only holds the axis
            places = (*places, task.start + _HELD_WITHIN * task.tolerance)
        return Limits.for_task(
            mass=part("mass", guess.body, axis.body),
            load_mass=part("load_mass", guess.load, axis.load) if axis.flexible else 0.0,
            effort_limit=self.effort_limit,
            sampling_time=task.sampling_time,
            places=places,
            duration=task.duration,
            sensors=SensorErrors(
                sensors.position_noise, sensors.velocity_noise, sensors.encoder_step
            ),
        )

    def used(self) -> tuple[str, ...]:
        """Return the quantities of ``[guess]`` that it uses."""
        return self.guesses

    def check(self, setup: Setup) -> None:
        """Check the settings against the other tables."""
        for name, plain in setup.guess.plain().items():
            if plain not in self.used():
                raise ScenarioError(
                    "unused_guess",
                    where="[guess]",
                    name=name,
                    method=self.method,
                    useless=not (self.learns or self.used()),
                )
        longest: float | None = getattr(self, "longest_width", None)
        if longest is not None and longest >= setup.task.duration:
            duration = setup.task.duration
            raise ScenarioError(
                "pulse_beyond_move", where="[controller]", width=longest, duration=duration
            )

    def guesses_of(self, learned: LearnedPulses, kind: AxisKind, source: str) -> FirstGuesses:
        """Return the values of an earlier run as first guesses."""
        return FirstGuesses(kind=kind, values={}, learned=learned, source=source)

    def begin(self, setup: Setup, folder: Path) -> FirstGuesses:
        """Return the first guesses of a scenario."""
        guess, kind = setup.guess, setup.kind
        if guess.learned is None:
            return guesses_from(guess, kind, folder)
        beside = [name for name, plain in guess.plain().items() if plain not in self.beside_learned]
        if beside:
            raise ScenarioError("learned_beside", where="[guess]", names=beside)
        path = folder / guess.learned
        learned = learned_from(path)
        try:
            method = self.resumes or self.method
            learned.check(method=method, kind=kind, names=self.learned_names)
            return self.guesses_of(learned, kind, f"learned {guess.learned}")
        except InputError as error:
            raise error.at(f"[guess], learned, {path}") from None

    def sources(self, setup: Setup, first: FirstGuesses, controller: Any) -> dict[str, str]:
        """Return the source of each first guess, by name."""
        if first.learned is not None:
            return dict.fromkeys(controller.estimates(controller.init()), first.source)
        return {name: first.sources[name] for name in self.used() if name in first.sources}

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        """Return notes on the controller for the user, one sentence each."""
        return ()


class GainsByRule(Controller):
    """A controller with feedback whose two gains are given, or follow from a rule."""

    @model_validator(mode="after")
    def _check_gains(self) -> "GainsByRule":
        self.given_gains()
        return self

    def given_gains(self) -> PD | None:
        """Return the gains; None for gains by rule."""
        given = self.given()
        names = ("position_gain", "velocity_gain")
        missing = [name for name in names if name not in given]
        if len(missing) == 1:
            raise InputError("gain_missing", name=missing[0])
        return None if missing else PD(**{name: given[name] for name in names})
