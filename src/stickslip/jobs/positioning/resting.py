"""When an axis counts as resting, and how near its target it then must be, by its sensors."""

from dataclasses import replace
from math import sqrt

from stickslip.control import RestDetection
from stickslip.jobs.positioning.scenario import Scenario
from stickslip.records import AxisKind, InputError, count_of, prefixed, unit_of

__all__ = ["about_aim", "about_rest", "aim_of", "rest_of"]

_CONTINUOUS = 1e-9
"""Step of an encoder without steps, over the noise: too fine to matter."""

_SURELY = 3.0
"""Standard deviations of a mean that the sensors are taken to be off by."""

_REST_SAMPLES = 10
"""Samples over which a rest is judged where sensors are not ideal, unless the scenario says."""


def rest_of(scenario: Scenario) -> RestDetection:
    """Return when the axis counts as resting, from what its sensors are known to do.

    Parameters
    ----------
    scenario
        The task.

    Raises
    ------
    InputError
        If ``rest_samples`` are too few, or leave no room for a pulse.
    """
    sensors = scenario.sensors
    seen = sensors.velocity == "measured"
    ideal = sensors.position_noise == 0.0 and sensors.encoder_step == 0.0
    exact = seen and sensors.velocity_noise == 0.0 and not scenario.still
    if ideal and exact:
        return RestDetection(samples=_window(scenario, usual=1, least=1), spread=0.0, speed=0.0)
    if ideal:
        usual = _REST_SAMPLES if scenario.still else 2
        window = _window(scenario, usual=usual, least=2)
        return RestDetection(samples=window, spread=scenario.still)
    window = _window(scenario, usual=_REST_SAMPLES, least=2)
    step = sensors.encoder_step or _CONTINUOUS * sensors.position_noise
    rest = RestDetection.for_encoder(resolution=step, noise=sensors.position_noise, samples=window)
    return replace(rest, speed=0.0) if exact else rest


def _window(scenario: Scenario, *, usual: int, least: int) -> int:
    """Return over how many samples a rest is judged; refuse too few, and more than fit a move."""
    move, given = scenario.task.samples, scenario.controller.rest_samples
    samples = usual if given is None else given
    if samples < least:
        raise InputError(
            f"rest_samples is {samples}, it must be at least {least} with these sensors",
            where="[controller]",
            remedy=f"give {least} or more",
        )
    # A pulse waits for a rest, and its outcome for another
    if 2 * samples >= move:
        unless = " unless told" if given is None else ""
        raise InputError(
            f"rest_samples is {samples}{unless}, and a move of {move} samples has no room for a "
            "rest before a pulse and one after it",
            where="[controller]",
            remedy="judge the rest over fewer samples, or lengthen the duration",
        )
    return samples


def about_rest(rest: RestDetection, kind: AxisKind) -> str:
    """Return what a user should know of it.

    Parameters
    ----------
    rest
        When the axis counts as resting.
    kind
        Of the axis.
    """
    if rest.samples == 1:
        return "The axis counts as resting in the sample in which its velocity is 0."
    still = "" if rest.speed is None else " and no velocity is seen"
    within = prefixed(rest.spread, unit_of("position", kind))
    return (
        f"The axis counts as resting when {count_of(rest.samples, 'position')} in a row lie within "
        f"{within}{still}."
    )


def aim_of(scenario: Scenario, rest: RestDetection) -> float:
    """Return the tolerance less what a measured rest may be off by: the controller's own.

    Parameters
    ----------
    scenario
        The task.
    rest
        When the axis counts as resting.

    Raises
    ------
    InputError
        If nothing is left of the tolerance.
    """
    sensors, tolerance = scenario.sensors, scenario.task.tolerance
    noise = _SURELY * sensors.position_noise / sqrt(rest.samples)
    off = 0.5 * (sensors.encoder_step + scenario.still) + noise
    if tolerance <= off:
        unit = unit_of("position", scenario.axis.kind)
        raise InputError(
            f"tolerance is {tolerance:g} {unit}, and over {count_of(rest.samples, 'sample')} the "
            f"sensors tell a position to {off:.3g} {unit} only",
            where="[task]",
            remedy="widen the tolerance, take better sensors, or give more rest_samples",
        )
    return tolerance - off


def about_aim(aim: float, scenario: Scenario) -> tuple[str, ...]:
    """Return what a user should know of it, if it is not the task's own tolerance.

    Parameters
    ----------
    aim
        The controller's tolerance [m or rad].
    scenario
        The task.
    """
    if aim == scenario.task.tolerance:
        return ()
    unit = unit_of("position", scenario.axis.kind)
    return (
        f"The controller aims at {prefixed(aim, unit)}: the tolerance less what the sensors may be "
        "off by at rest.",
    )
