"""From a scenario with a rigid axis to the controller that lands it."""

from dataclasses import replace
from math import sqrt
from typing import Any

from stickslip.control import PD, AxisLandingController, RestDetection
from stickslip.estimation import EnergyEstimator
from stickslip.jobs.positioning.beliefs import Beliefs
from stickslip.jobs.positioning.refusals import friction_law
from stickslip.jobs.positioning.resting import aim_of, rest_of
from stickslip.jobs.positioning.scenario import Scenario
from stickslip.plants import SingleMass
from stickslip.records import LearntPulses

__all__ = ["axis_landing", "landing_again"]


def axis_landing(
    scenario: Scenario, beliefs: Beliefs, rest: RestDetection, aim: float
) -> AxisLandingController:
    """Return the controller that lands a rigid axis, set to the first target.

    Parameters
    ----------
    scenario
        The task.
    beliefs
        First guesses: of the mass at least.
    rest
        When the axis counts as resting.
    aim
        The controller's own tolerance [m or rad].

    Raises
    ------
    InputError
        If the mass is not guessed, or a guess or a setting cannot be.
    """
    table, task, sensors = scenario.controller, scenario.task, scenario.sensors
    mass = beliefs.value("mass")
    # The estimator that runs along tells no direction from the other
    values = {
        name: beliefs.value(name)
        for name in ("coulomb_friction", "viscous_friction")
        if name in beliefs.values
    }
    known = {"coulomb_friction": 0.0, "viscous_friction": 0.0} | values
    pairs = {name: (value, value) for name, value in known.items()}
    if "static_friction" in beliefs.values:
        static = beliefs.value("static_friction")
        pairs["static_friction"] = (static, static)
    law = friction_law(pairs, beliefs.value("offset") if "offset" in beliefs.values else 0.0)
    settings: dict[str, Any] = {}
    if table.position_gain is not None and table.velocity_gain is not None:
        gains = PD(position_gain=table.position_gain, velocity_gain=table.velocity_gain)
        settings["pd"] = gains
    if table.longest_wait is not None:
        settings["patience"] = table.longest_wait
    sure = beliefs.uncertainties().get("mass_uncertainty")
    if scenario.guess.mass_uncertainty is not None:
        sure = scenario.guess.mass_uncertainty
    if sure is not None:
        settings["mass_uncertainty"] = sure
    return AxisLandingController(
        sampling_time=task.sampling_time,
        target=task.goals[0],
        tolerance=aim,
        axis=SingleMass(mass=mass, friction=law, kind=scenario.axis.kind),
        effort_limit=table.effort_limit,
        estimator=EnergyEstimator(
            inertia=mass, offset=False, force_noise=0.0, initial_values=values or None
        ),
        rest=rest,
        position_noise=sqrt(sensors.position_noise**2 + sensors.encoder_step**2 / 12.0),
        velocity_noise=sensors.velocity_noise,
        longest_width=table.longest_width,
        **settings,
    )


def landing_again(
    scenario: Scenario, controller: AxisLandingController, learnt: LearntPulses
) -> AxisLandingController:
    """Return the controller of a task that goes on from what an earlier run has learned.

    Parameters
    ----------
    scenario
        The task.
    controller
        That would begin anew.
    learnt
        By the pulses of a landing, or by exact pulses alone.

    Raises
    ------
    InputError
        If it cannot be gone on from.
    """
    controller.resumed(learnt)  # refuses what is none of the kind
    values = {"mass": (learnt.values["mass"], learnt.values["mass"])}
    # The friction of each direction has the offset in it
    for name in ("coulomb_friction", "viscous_friction", "static_friction"):
        values[name] = (learnt.values[f"{name}_positive"], learnt.values[f"{name}_negative"])
    beliefs = Beliefs(kind=learnt.kind, values=values, sources={}, missing={})
    rest = rest_of(scenario)
    again = axis_landing(scenario, beliefs, rest, aim_of(scenario, rest))
    return replace(again, experience=learnt)
