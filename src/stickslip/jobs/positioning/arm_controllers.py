"""From a scenario with a flexible arm to the controller it asks for."""

from dataclasses import dataclass, fields, replace
from itertools import pairwise
from math import ceil, pi, sqrt
from pathlib import Path
from typing import Any

from stickslip.control import (
    PD,
    FeedbackController,
    LandingController,
    Move,
    PointToPoint,
    scaled_notch,
)
from stickslip.estimation import EnergyEstimator
from stickslip.jobs.positioning.beliefs import Beliefs, beliefs_from, learnt_from
from stickslip.jobs.positioning.refusals import friction_law, told_of
from stickslip.jobs.positioning.scenario import Scenario
from stickslip.jobs.positioning.tables import GuessTable
from stickslip.plants import FlexibleArm
from stickslip.records import (
    InputError,
    LearntPulses,
    positive,
    prefixed,
    unit_of,
)

__all__ = ["ArmChoice", "choose_arm_controller"]

_KNOWN = "the axis, taken as known"
_SURELY = 3.0
"""Standard deviations of a mean that the sensors are taken to be off by."""

_BELIEVED = 0.02
"""Standard deviation of masses and spring that are guessed, over the values, unless told."""

_BODY = ("mass", "inertia", "load_mass", "load_inertia", "stiffness")
_PARTS = ("mass", "load_mass", "stiffness")
_LEARNT = ("coulomb_friction", "viscous_friction", "static_friction")


@dataclass(frozen=True, kw_only=True)
class ArmChoice:
    """A controller of an arm, with the estimator that runs along in it.

    Attributes
    ----------
    controller
        Set to the first target.
    estimator
        Of Coulomb and viscous friction.
    believed
        Where each first guess came from, by name.
    notes
        For the user.
    """

    controller: LandingController | FeedbackController
    estimator: EnergyEstimator
    believed: dict[str, str]
    notes: tuple[str, ...]


def choose_arm_controller(
    scenario: Scenario, folder: Path, learnt: LearntPulses | None = None
) -> ArmChoice:
    """Return the controller, set to the first target, with what it believes.

    Parameters
    ----------
    scenario
        The task, on a flexible arm.
    folder
        Where files that it names are looked for.
    learnt
        By the run before, for first guesses in place of those of the scenario.

    Raises
    ------
    InputError
        If a first guess is unused or impossible, or a setting is.
    """
    guess, kind = scenario.guess, scenario.axis.kind
    _refuse_unused(guess, scenario.controller.method)
    try:
        if learnt is not None:
            return _chosen(scenario, _beliefs_of(learnt, "the run before"), learnt)
        if guess.learnt is None:
            return _chosen(scenario, beliefs_from(guess, kind, folder))
        path = folder / guess.learnt
        learnt = _learnt_from(path, kind)
        _refuse_beside(guess, learnt)
        beliefs = _beliefs_of(learnt, f"learnt {guess.learnt}")
        try:
            return _chosen(scenario, beliefs, learnt)
        except InputError as error:
            raise error if error.where.startswith("[") else error.at(str(path)) from None
    except InputError as error:
        told = told_of(kind, error)
        raise told if told.where else told.at("[controller] and [guess]") from None


def _refuse_unused(guess: GuessTable, method: str) -> None:
    given = [each.name for each in fields(guess) if getattr(guess, each.name) is not None]
    plain = {name: name.removesuffix("_positive").removesuffix("_negative") for name in given}
    for name in given:
        known = (*_BODY, *_LEARNT, "offset", "estimate", "learnt")
        if plain[name] not in known and (name, method) != ("arm_uncertainty", "landing"):
            raise InputError(
                f"{name} is given, and method {method} has no use for it",
                where="[guess]",
                remedy="leave it out",
            )
    beside = [name for name in given if plain[name] in (*_LEARNT, "estimate")]
    if guess.learnt is not None and beside:
        raise InputError(
            f"learnt is given beside {', '.join(beside)}",
            where="[guess]",
            remedy="keep learnt, which holds the friction to go on from, or leave it out",
        )


def _refuse_beside(guess: GuessTable, learnt: LearntPulses) -> None:
    """Refuse a guess of masses and spring beside what was learned of them."""
    given = [name for name in (*_BODY, "arm_uncertainty") if getattr(guess, name) is not None]
    if given and "mass" in learnt.values:
        raise InputError(
            f"learnt is given beside {', '.join(given)}, and holds masses and spring",
            where="[guess]",
            remedy="keep learnt, to go on from it, or leave it out",
        )


def _learnt_from(path: Path, kind: str) -> LearntPulses:
    learnt = learnt_from(path)
    for name, own, asked in (("method", learnt.method, "landing"), ("kind", learnt.kind, kind)):
        if own != asked:
            raise InputError(
                f"what was learnt is of {name} {own}, an arm of this scenario needs {asked}",
                where=f"{path}, {name}",
                remedy=f"give a file of {name} {asked}, or leave learnt out",
            )
    for name in _LEARNT:
        if name not in learnt.values:
            raise InputError(
                f"{name} is missing", where=str(path), remedy="give the file as it was saved"
            )
    return learnt


def _beliefs_of(learnt: LearntPulses, source: str) -> Beliefs:
    names = (*_LEARNT, *(_PARTS if "mass" in learnt.values else ()))
    return Beliefs(
        kind=learnt.kind,
        values={name: (learnt.values[name], learnt.values[name]) for name in names},
        sources=dict.fromkeys(names, source),
        missing={},
    )


def _chosen(scenario: Scenario, beliefs: Beliefs, learnt: LearntPulses | None = None) -> ArmChoice:
    table, task, sensors, kind = (
        scenario.controller,
        scenario.task,
        scenario.sensors,
        scenario.axis.kind,
    )
    arm, believed = _believed(scenario, beliefs)
    _refuse_slow(task.sampling_time, arm)
    values = {
        name: beliefs.value(name)
        for name in ("coulomb_friction", "viscous_friction")
        if name in beliefs.values
    }
    estimator = EnergyEstimator(
        force_noise=0.0,
        inertia=arm.mass_1,
        load_inertia=arm.mass_2,
        stiffness=arm.stiffness,
        offset=False,
        initial_values=values or None,
    )
    aim = _aim(scenario, arm)
    settings: dict[str, Any] = {}
    if table.position_gain is not None and table.velocity_gain is not None:
        gains = PD(position_gain=table.position_gain, velocity_gain=table.velocity_gain)
        settings["pd"] = gains
    uncertainty = _uncertainty(scenario.guess)
    if table.method == "landing" and learnt is not None and "mass" in learnt.values:
        settings["experience"] = learnt
    elif table.method == "landing":
        settings["arm_uncertainty"] = uncertainty
    if table.most_series is not None:
        settings["most_series"] = table.most_series
    if table.longest_wait is not None:
        settings["patience"] = table.longest_wait
    landing = LandingController(
        sampling_time=task.sampling_time,
        target=task.goals[0],
        tolerance=aim,
        arm=arm,
        effort_limit=table.effort_limit,
        estimator=estimator,
        position_noise=sqrt(sensors.position_noise**2 + sensors.encoder_step**2 / 12.0),
        velocity_noise=sensors.velocity_noise,
        **settings,
    )
    notes = _about(believed, beliefs)
    if scenario.axis.offset and "offset" not in beliefs.values:
        notes += (
            "The axis has an offset, which is not learned of an arm, and none is guessed: the "
            "controller takes it for none. Give offset in [guess].",
        )
    if landing.arm_uncertainty > 0.0 and scenario.guess.arm_uncertainty is None:
        notes += (
            f"Masses and spring that are guessed are taken to be off by {_BELIEVED:.0%} or so, and "
            "learned; arm_uncertainty in [guess] says other.",
        )
    controller: LandingController | FeedbackController = landing
    if table.method == "feedback":
        controller = _feedback_of(landing, scenario)
    elif aim != task.tolerance:
        notes += (
            f"The controller aims at {prefixed(aim, unit_of('position', kind))}: the tolerance "
            "less what the sensors may be off by while mass 1 rests.",
        )
    return ArmChoice(controller=controller, estimator=estimator, believed=believed, notes=notes)


def _believed(scenario: Scenario, beliefs: Beliefs) -> tuple[FlexibleArm, dict[str, str]]:
    """Return the arm as it is believed to be, and where each belief came from."""
    kind, guess, axis = scenario.axis.kind, scenario.guess, scenario.axis
    sources: dict[str, str] = {}
    parts: dict[str, float] = {}
    body, true = "mass" if kind == "linear" else "inertia", axis.arm()
    for name, key, guessed, known in (
        ("mass", body, guess.body(kind), true.mass_1),
        ("load_mass", f"load_{body}", guess.load(kind), true.mass_2),
        ("stiffness", "stiffness", guess.stiffness, true.stiffness),
    ):
        value, sources[name] = known, _KNOWN
        if "load_mass" in beliefs.values:  # learned, with the others
            value, sources[name] = beliefs.value(name), beliefs.sources[name]
        elif guessed is not None:
            value, sources[name] = guessed, "the scenario"
        try:
            parts[name] = positive(key, value, unit_of(name, kind))
        except InputError as error:
            raise error.at("[guess]") from None
    pairs = {
        name: beliefs.pair(name) if name in beliefs.values else (0.0, 0.0)
        for name in ("coulomb_friction", "viscous_friction")
    }
    if "static_friction" in beliefs.values:
        pairs["static_friction"] = beliefs.pair("static_friction")
    law = friction_law(pairs, beliefs.value("offset") if "offset" in beliefs.values else 0.0)
    held = max(law.breakaway()) + abs(law.offset)
    if scenario.controller.effort_limit <= held:
        unit = unit_of("effort", kind)
        raise InputError(
            f"effort_limit is {scenario.controller.effort_limit:g} {unit}, and by the first guess "
            f"it takes {held:g} {unit} to free mass 1",
            where="[guess]" if guess.learnt is None else "",
            remedy="guess less, or allow more effort",
        )
    arm = FlexibleArm(
        mass_1=parts["mass"],
        mass_2=parts["load_mass"],
        stiffness=parts["stiffness"],
        friction=law,
        kind=kind,
    )
    names = (*_LEARNT, "offset")
    return arm, sources | {n: beliefs.sources[n] for n in names if n in beliefs.sources}


def _refuse_slow(sampling_time: float, arm: FlexibleArm) -> None:
    """Refuse samples too far apart for the notch at the resonance of the arm."""
    longest = pi / scaled_notch(arm).angular_frequency
    if sampling_time >= longest:
        raise InputError(
            f"sampling_time is {sampling_time:g} s, and the two masses swing against each other so "
            f"fast that it must be below {longest:.3g} s",
            where="[task]",
            remedy="sample faster, ten times as fast as that if you can",
        )


def _about(believed: dict[str, str], beliefs: Beliefs) -> tuple[str, ...]:
    known = [n for n in ("mass", "load_mass", "stiffness") if believed[n] == _KNOWN]
    notes: tuple[str, ...] = ()
    if known:
        words = {"mass": "mass 1", "load_mass": "mass 2", "stiffness": "the spring"}
        each = ", ".join(words[name] for name in known)
        notes += (f"Known to the controller as they are, as [guess] does not say other: {each}.",)
    if "coulomb_friction" not in beliefs.values:
        notes += ("No friction is guessed: the controller begins without any.",)
    return notes


def _uncertainty(guess: GuessTable) -> float:
    """Return how unsure the controller is of masses and spring."""
    if guess.arm_uncertainty is not None:
        return guess.arm_uncertainty
    return _BELIEVED if any(getattr(guess, name) is not None for name in _BODY) else 0.0


def _aim(scenario: Scenario, arm: FlexibleArm) -> float:
    """Return the tolerance less what a measured rest may be off by: the controller's own."""
    sensors, task = scenario.sensors, scenario.task
    half_swing = pi * sqrt(arm.mass_2 / arm.stiffness)
    samples = max(1, ceil(half_swing / task.sampling_time))
    off = 0.5 * sensors.encoder_step + _SURELY * sensors.position_noise / sqrt(samples)
    if task.tolerance <= off:
        unit = unit_of("position", arm.kind)
        raise InputError(
            f"tolerance is {task.tolerance:g} {unit}, and over half a swing of mass 2 the sensors "
            f"tell a position to {off:.3g} {unit} only",
            where="[task]",
            remedy="widen the tolerance, take better sensors, or sample faster",
        )
    return task.tolerance - off


def _feedback_of(landing: LandingController, scenario: Scenario) -> FeedbackController:
    """Return the feedback phase of a landing alone, along all moves of the task."""
    task, first = scenario.task, landing.init().estimator_state
    whole = task.samples * task.sampling_time
    phases: list[FeedbackController] = []
    moves: list[Move] = []
    for start, goal in pairwise((task.start, *task.goals)):
        phase = landing.approach(start, goal, first)
        (move,) = phase.reference.moves
        if move.duration > whole:
            raise InputError(
                f"duration is {whole:g} s, and the reference takes {move.duration:.3g} s to "
                f"{goal:g} {unit_of('position', landing.kind)}",
                where="[task]",
                remedy="give each move more time, or allow more effort",
            )
        phases.append(phase)
        moves.append(replace(move, dwell=whole - move.duration))
    return replace(phases[0], reference=PointToPoint(start=task.start, moves=tuple(moves)))
