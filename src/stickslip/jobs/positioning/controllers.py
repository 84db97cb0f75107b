"""From a scenario to the controller it asks for."""

from collections.abc import Mapping
from dataclasses import fields, replace
from math import sqrt
from pathlib import Path
from typing import Any

from stickslip.control import (
    AxisLandingController,
    Dither,
    ExactPulseController,
    PIDController,
    PulseAmplitudeWidthController,
    PulseController,
    PulseWidthController,
    ResetIntegral,
    RestDetection,
)
from stickslip.jobs.positioning.axis_landing import axis_landing, landing_again
from stickslip.jobs.positioning.beliefs import Beliefs, beliefs_from, learnt_from
from stickslip.jobs.positioning.refusals import friction_law, told_of
from stickslip.jobs.positioning.resting import about_aim, about_rest, aim_of, rest_of
from stickslip.jobs.positioning.scenario import Scenario
from stickslip.jobs.positioning.tables import DIRECTIONAL, GuessTable
from stickslip.records import (
    InputError,
    LearntPulses,
    unit_of,
)

__all__ = ["Chosen", "choose_controller", "gone_on"]

Chosen = PulseController | AxisLandingController | PIDController

_OF_TABLE_1 = 1e-5 * (150.0 * 300.0) ** 2
"""Published P(0) of PAPWC times the squared product of mass and effort of the published pulses: the
spread of A1 f^2 beside that of A2 f is then the same on every axis."""

_MUCH = 10.0

_SURE = ("mass_uncertainty", "friction_uncertainty", "asymmetry")
_ADAPTIVE = ("mass", "coulomb_friction", "static_friction")
_WANTED: dict[str, tuple[str, ...]] = {
    "exact": ("mass", *DIRECTIONAL, "offset", *_SURE),
    "landing": ("mass", *DIRECTIONAL, "offset", "mass_uncertainty"),
    "papwc": _ADAPTIVE,
    "pwc": _ADAPTIVE,
}


def choose_controller(
    scenario: Scenario, folder: Path
) -> tuple[Chosen, dict[str, str], tuple[str, ...]]:
    """Return the controller, set to the first target, with what it believes.

    Parameters
    ----------
    scenario
        The task.
    folder
        Where files that it names are looked for.

    Returns
    -------
    The controller; by name, where its first guesses came from; and notes for the user.

    Raises
    ------
    InputError
        If a first guess is missing, unused or impossible, or a setting is.
    """
    table, guess, kind = scenario.controller, scenario.guess, scenario.axis.kind
    wanted = _WANTED.get(table.method, () if table.bandwidth is None else ("mass",))
    _refuse_unused(guess, wanted, table.method)
    try:
        if not scenario.waits:
            beliefs = beliefs_from(guess, kind, folder)
            return _feedback(scenario, beliefs), _sources(beliefs, wanted), ()
        rest = rest_of(scenario)
        aim = aim_of(scenario, rest)
        notes = (about_rest(rest, kind), *about_aim(aim, scenario))
        if guess.learnt is not None:
            path, source = folder / guess.learnt, f"learnt {guess.learnt}"
            learnt, first = learnt_from(path), _learner(scenario, _anything(scenario), rest, aim)
            try:
                resumed: Any = gone_on(scenario, first, learnt)
            except InputError as error:
                raise error.at(str(path)) from None
            return resumed, dict.fromkeys(resumed.estimates(resumed.init()), source), notes
        beliefs = beliefs_from(guess, kind, folder)
        _check_guess(beliefs, table.effort_limit)
        if table.method in {"exact", "landing"}:
            notes += _about_uncertainties(beliefs, guess, wanted)
        if table.method == "landing" and "coulomb_friction" not in beliefs.values:
            notes += ("No friction is guessed: the controller begins without any.",)
        if table.method == "papwc" and table.initial_covariance is None:
            notes += _about_covariance(beliefs.value("mass") * table.effort_limit)
        return _learner(scenario, beliefs, rest, aim), _sources(beliefs, wanted), notes
    except InputError as error:
        told = told_of(kind, error)
        raise told if told.where else told.at("[controller] and [guess]") from None


def gone_on(
    scenario: Scenario, controller: PulseController | AxisLandingController, learnt: LearntPulses
) -> PulseController | AxisLandingController:
    """Return a controller that goes on from what was learnt, otherwise as one of its task.

    Parameters
    ----------
    scenario
        The task.
    controller
        Of the task.
    learnt
        By an earlier run.

    Raises
    ------
    InputError
        If it cannot be gone on from.
    """
    if isinstance(controller, AxisLandingController):
        return landing_again(scenario, controller, learnt)
    return controller.resumed(learnt)


def _refuse_unused(guess: GuessTable, wanted: tuple[str, ...], method: str) -> None:
    given = [
        each.name
        for each in fields(guess)
        if getattr(guess, each.name) is not None and each.name not in {"estimate", "learnt"}
    ]
    if guess.learnt is not None and (given or guess.estimate is not None):
        raise InputError(
            f"learnt is given beside {', '.join(given) or 'estimate'}",
            where="[guess]",
            remedy="keep learnt, which holds all that the controller goes on from, or leave it out",
        )
    for name in given:
        plain = name.removesuffix("_positive").removesuffix("_negative")
        if ("mass" if plain == "inertia" else plain) not in wanted:
            raise InputError(
                f"{name} is given, and method {method} has no use for it",
                where="[guess]",
                remedy="leave it out"
                + ("" if method in _WANTED else ", or use method exact, which learns"),
            )
    for name in ("estimate", "learnt"):
        if getattr(guess, name) is not None and not (method in _WANTED or wanted == ("mass",)):
            raise InputError(
                f"{name} is given, and method {method} has no use for it",
                where="[guess]",
                remedy="leave it out, or use method exact, which learns",
            )


def _sources(beliefs: Beliefs, wanted: tuple[str, ...]) -> dict[str, str]:
    return {name: beliefs.sources[name] for name in wanted if name in beliefs.sources}


def _about_uncertainties(
    beliefs: Beliefs, guess: GuessTable, wanted: tuple[str, ...]
) -> tuple[str, ...]:
    told = {
        name: value
        for name, value in beliefs.uncertainties().items()
        if getattr(guess, name) is None and name in wanted
    }
    if not told:
        return ()
    each = " and ".join(f"{name} {value:.2g}" for name, value in told.items())
    return (f"By the standard deviations of estimate {guess.estimate} it begins with {each}.",)


def _about_covariance(product: float) -> tuple[str, ...]:
    """Say it where PAPWC's usual P(0) is small beside the gains of an axis, mass times effort."""
    usual = PulseAmplitudeWidthController.initial_covariance
    alike = _OF_TABLE_1 / product**2
    if not isinstance(usual, float) or alike <= _MUCH * usual:
        return ()
    return (
        f"PAPWC begins with initial_covariance {usual:g}, which suits the published axis of 150 kg "
        f"and 300 N; this one hardly learns with it. What is alike here is {alike:.1g}.",
    )


def _check_guess(beliefs: Beliefs, limit: float) -> None:
    """Refuse first guesses under which no pulse would move the axis."""
    unit = unit_of("effort", beliefs.kind)
    offset = beliefs.value("offset") if "offset" in beliefs.values else 0.0
    for name in ("static_friction", "coulomb_friction"):
        if name not in beliefs.values:
            continue
        forward, backward = beliefs.pair(name)
        for way, needed in (("positive", forward + offset), ("negative", backward - offset)):
            if limit <= needed:
                raise InputError(
                    f"effort_limit is {limit:g} {unit}, and by the first guess it takes "
                    f"{needed:g} {unit} to move the axis in the {way} direction ({name} "
                    f"from {beliefs.sources[name]})",
                    where="[guess]",
                    remedy="guess less, or allow more effort",
                )


def _anything(scenario: Scenario) -> Beliefs:
    """Return first guesses that can be, for a controller to begin with what was learnt instead."""
    friction = 0.5 * scenario.controller.effort_limit
    values = {"mass": 1.0, "coulomb_friction": friction, "viscous_friction": 0.0}
    return Beliefs(
        kind=scenario.axis.kind,
        values={name: (value, value) for name, value in values.items()},
        sources={},
        missing={},
    )


def _learner(
    scenario: Scenario, beliefs: Beliefs, rest: RestDetection, aim: float
) -> PulseController | AxisLandingController:
    if scenario.controller.method == "landing":
        return axis_landing(scenario, beliefs, rest, aim)
    return _pulses(scenario, beliefs, rest, aim)


def _pulses(
    scenario: Scenario, beliefs: Beliefs, rest: RestDetection, aim: float
) -> PulseController:
    table, task, kind = scenario.controller, scenario.task, scenario.axis.kind
    settings = table.given(without=("rest_samples",))
    if table.method == "exact":
        return _exact(scenario, beliefs, rest, aim, settings)
    method = PulseWidthController if table.method == "pwc" else PulseAmplitudeWidthController
    static = beliefs.value("static_friction") if "static_friction" in beliefs.values else None
    first = method.from_friction(
        mass=beliefs.value("mass"),
        coulomb_friction=beliefs.value("coulomb_friction"),
        static_friction=static,
        pulse_effort=table.effort_limit,
        sampling_time=task.sampling_time,
        target=task.goals[0],
        tolerance=aim,
        rest=rest,
        kind=kind,
    )
    return replace(first, **settings)


def _exact(
    scenario: Scenario,
    beliefs: Beliefs,
    rest: RestDetection,
    aim: float,
    settings: Mapping[str, Any],
) -> ExactPulseController:
    task, sensors, guess = scenario.task, scenario.sensors, scenario.guess
    pairs = {name: beliefs.pair(name) for name in ("coulomb_friction", "viscous_friction")}
    if "static_friction" in beliefs.values:
        pairs["static_friction"] = beliefs.pair("static_friction")
    law = friction_law(pairs, beliefs.value("offset") if "offset" in beliefs.values else 0.0)
    sure = beliefs.uncertainties() | {
        name: value for name in _SURE if (value := getattr(guess, name)) is not None
    }
    return ExactPulseController(
        sampling_time=task.sampling_time,
        target=task.goals[0],
        tolerance=aim,
        rest=rest,
        kind=scenario.axis.kind,
        effort_limit=scenario.controller.effort_limit,
        mass=beliefs.value("mass"),
        friction=law,
        position_noise=sqrt(sensors.position_noise**2 + sensors.encoder_step**2 / 12.0),
        **sure,
        **settings,
    )


def _feedback(scenario: Scenario, beliefs: Beliefs) -> PIDController:
    table, task = scenario.controller, scenario.task
    dither = reset = None
    if table.dither_amplitude is not None and table.dither_frequency is not None:
        dither = Dither(
            amplitude=table.dither_amplitude,
            frequency=table.dither_frequency,
            shape=table.dither_shape or "square",
        )
    if table.reset_law is not None and table.reset_speed is not None:
        reset = ResetIntegral(
            law=table.reset_law,
            rest_speed=table.reset_speed,
            rest_samples=1 if table.reset_samples is None else table.reset_samples,
        )
    if table.bandwidth is not None:
        try:
            return PIDController.for_mass(
                sampling_time=task.sampling_time,
                target=task.goals[0],
                mass=beliefs.value("mass"),
                bandwidth=table.bandwidth,
                effort_limit=table.effort_limit,
                dead_band=table.dead_band or 0.0,
                dither=dither,
                reset=reset,
            )
        except InputError as error:
            if "phase margin" not in error.what:
                raise
            raise InputError(
                error.what,
                where="[controller]",
                remedy="ask for less bandwidth, or shorten the sampling time",
            ) from None
    if table.filter_time is None and scenario.sensors.velocity == "none":
        raise InputError(
            "the gains act on a velocity, and none is measured",
            where="[controller]",
            remedy="give filter_time in s, so that the position is differentiated",
        )
    gains = table.gains
    return PIDController(
        sampling_time=task.sampling_time,
        target=task.goals[0],
        position_gain=gains["position_gain"],
        integral_gain=gains.get("integral_gain", 0.0),
        velocity_gain=gains["velocity_gain"],
        effort_limit=table.effort_limit,
        velocity="measured" if table.filter_time is None else "differentiated",
        filter_time=table.filter_time or 0.0,
        dead_band=table.dead_band or 0.0,
        dither=dither,
        reset=reset,
    )
