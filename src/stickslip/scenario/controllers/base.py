"""``[controller]``: what the tables of all controllers have in common."""

from abc import abstractmethod
from pathlib import Path
from typing import Any, ClassVar

from stickslip.control import PD, PositionController
from stickslip.records import AxisKind, InputError, LearnedPulses, non_negative, positive
from stickslip.scenario.controllers.setup import Setup
from stickslip.scenario.guess import FirstGuesses, check_learned, guesses_from, learned_from
from stickslip.scenario.table import Table, key, required

__all__ = ["LONGEST_WIDTH", "POSITION_GAIN", "REST_SAMPLES", "VELOCITY_GAIN", "Controller"]

_BY_RULE = "by a rule; both gains or neither"
POSITION_GAIN: Any = key("proportional gain", ("N/m", "N m/rad"), positive, says=_BY_RULE)
VELOCITY_GAIN: Any = key("derivative gain", ("N s/m", "N m s/rad"), non_negative, says=_BY_RULE)
LONGEST_WIDTH: Any = key("longest pulse", "time", positive, says="no limit")
REST_SAMPLES: Any = key(
    "positions that must agree for a rest; twice as many must fit into a move",
    says="10; with ideal sensors 1, without a velocity 2",
)


class Controller(Table):
    """The table of a controller: its settings, and how it is built."""

    shows_defaults: ClassVar[bool] = False

    title: ClassVar[str]
    """The controller in words."""

    guesses: ClassVar[tuple[str, ...]] = ()
    """Quantities of ``[guess]`` that it uses."""

    learns: ClassVar[bool] = False
    """Whether it learns something that can be saved."""

    learned_names: ClassVar[tuple[str, ...]] = ()
    """Values of what was learned that it needs to go on."""

    beside_learned: ClassVar[tuple[str, ...]] = ("learned",)
    """Quantities of ``[guess]`` that may be given beside what was learned."""

    method: str = required("controller")
    effort_limit: float = required(
        "largest effort; of pwc, that of every pulse", "effort", positive
    )

    @abstractmethod
    def build(self, setup: Setup, first: FirstGuesses) -> PositionController[Any]:
        """Return the controller, set to the first target."""

    def used(self) -> tuple[str, ...]:
        """Return the quantities of ``[guess]`` that it uses."""
        return self.guesses

    def check(self, setup: Setup) -> None:
        """Check the settings against the other tables."""
        method = self.method
        for name, plain in setup.guess.plain().items():
            if plain not in self.used():
                learns = ", or use method exact, which learns"
                raise InputError(
                    f"{name} is given, and method {method} has no use for it",
                    where="[guess]",
                    remedy="leave it out" + ("" if self.learns or self.used() else learns),
                )
        longest: float | None = getattr(self, "longest_width", None)
        if longest is not None and longest >= setup.task.duration:
            raise InputError(
                f"longest_width is {longest:g} s, and a move ends after {setup.task.duration:g} s",
                where="[controller]",
                remedy="allow shorter pulses only, or lengthen the duration",
            )

    def guesses_of(self, learned: LearnedPulses, kind: AxisKind, source: str) -> FirstGuesses:
        """Return what an earlier run has learned as first guesses."""
        check_learned(learned, method=self.method, kind=kind, names=self.learned_names)
        return FirstGuesses(kind=kind, values={}, learned=learned, source=source)

    def begin(self, setup: Setup, folder: Path) -> FirstGuesses:
        """Return the first guesses of a scenario."""
        guess, kind = setup.guess, setup.kind
        if guess.learned is None:
            return guesses_from(guess, kind, folder)
        beside = [name for name, plain in guess.plain().items() if plain not in self.beside_learned]
        if beside:
            raise InputError(
                f"learned is given beside {', '.join(beside)}",
                where="[guess]",
                remedy="keep learned, which holds all that the controller goes on from, or leave "
                "it out",
            )
        path = folder / guess.learned
        learned = learned_from(path)
        try:
            return self.guesses_of(learned, kind, f"learned {guess.learned}")
        except InputError as error:
            raise error.at(str(path)) from None

    def believed(self, setup: Setup, first: FirstGuesses, controller: Any) -> dict[str, str]:
        """Return where each first guess came from, by name."""
        if first.learned is not None:
            return dict.fromkeys(controller.estimates(controller.init()), first.source)
        return {name: first.sources[name] for name in self.used() if name in first.sources}

    def notes(self, setup: Setup, first: FirstGuesses, controller: Any) -> tuple[str, ...]:
        """Return what a user should know of the controller, one sentence each."""
        return ()

    def given_gains(self) -> PD | None:
        """Return the gains of the feedback of a landing; None for gains by rule."""
        given = self.given()
        names = ("position_gain", "velocity_gain")
        missing = [name for name in names if name not in given]
        if len(missing) == 1:
            raise InputError(
                f"{missing[0]} is missing",
                remedy="give it beside the other gain, or neither, for gains that suit the axis",
            )
        return None if missing else PD(**{name: given[name] for name in names})
