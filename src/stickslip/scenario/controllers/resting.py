"""When an axis counts as resting, and how near its target it then must be, by its sensors."""

from dataclasses import replace
from math import sqrt

from stickslip.control import RestDetection
from stickslip.presentation.words import prefixed
from stickslip.records import InputError, count_of, unit_of
from stickslip.scenario.controllers.setup import Setup

__all__ = ["aim_of", "rest_notes", "rest_of"]

_CONTINUOUS = 1e-9
"""Step of an encoder without steps, over the noise: too fine to matter."""

_SURELY = 3.0
"""Standard deviations of a mean that the sensors are taken to be off by."""

_REST_SAMPLES = 10
"""Samples over which a rest is judged by default, where sensors are not ideal."""


def rest_of(setup: Setup, given: int | None) -> RestDetection:
    """Return when the axis counts as resting, from what its sensors are known to do."""
    sensors = setup.sensors
    seen = sensors.velocity == "measured"
    ideal = sensors.position_noise == 0.0 and sensors.encoder_step == 0.0
    exact = seen and sensors.velocity_noise == 0.0 and not setup.still
    if ideal and exact:
        return RestDetection(samples=_window(setup, given, usual=1, least=1), spread=0.0, speed=0.0)
    if ideal:
        usual = _REST_SAMPLES if setup.still else 2
        window = _window(setup, given, usual=usual, least=2)
        return RestDetection(samples=window, spread=setup.still)
    window = _window(setup, given, usual=_REST_SAMPLES, least=2)
    step = sensors.encoder_step or _CONTINUOUS * sensors.position_noise
    rest = RestDetection.for_encoder(resolution=step, noise=sensors.position_noise, samples=window)
    return replace(rest, speed=0.0) if exact else rest


def _window(setup: Setup, given: int | None, *, usual: int, least: int) -> int:
    """Return over how many samples a rest is judged; refuse too few, and more than fit a move."""
    move = setup.task.samples
    samples = usual if given is None else given
    if samples < least:
        raise InputError(
            f"rest_samples is {samples}, it must be at least {least} with these sensors",
            where="[controller]",
            remedy=f"give {least} or more",
        )
    # A pulse waits for a rest, and its outcome for another
    if 2 * samples >= move:
        unless = " by default" if given is None else ""
        raise InputError(
            f"rest_samples is {samples}{unless}, and a move of {move} samples has no room for a "
            "rest before a pulse and one after it",
            where="[controller]",
            remedy="judge the rest over fewer samples, or lengthen the duration",
        )
    return samples


def aim_of(setup: Setup, rest: RestDetection) -> float:
    """Return the controller's own tolerance where a rest is judged over some samples."""
    over = count_of(rest.samples, "sample")
    return tolerance_over(setup, rest.samples, over, "give more rest_samples")


def tolerance_over(setup: Setup, samples: int, over: str, otherwise: str) -> float:
    """Return the tolerance less what the mean of measured positions may be off by.

    ``over`` names the samples, and ``otherwise`` is a remedy besides better sensors.
    """
    sensors, tolerance = setup.sensors, setup.task.tolerance
    noise = _SURELY * sensors.position_noise / sqrt(samples)
    off = 0.5 * (sensors.encoder_step + setup.still) + noise
    if tolerance <= off:
        unit = unit_of("position", setup.kind)
        raise InputError(
            f"tolerance is {tolerance:g} {unit}, and over {over} the sensors tell a position to "
            f"{off:.3g} {unit} only",
            where="[task]",
            remedy=f"widen the tolerance, take better sensors, or {otherwise}",
        )
    return tolerance - off


def rest_notes(setup: Setup, rest: RestDetection) -> tuple[str, ...]:
    """Return what a user should know of a rest and of the controller's own tolerance."""
    unit, aim = unit_of("position", setup.axis.kind), aim_of(setup, rest)
    still = "" if rest.speed is None else " and no velocity is seen"
    notes = (
        f"The axis counts as resting when {count_of(rest.samples, 'position')} in a row lie within "
        f"{prefixed(rest.spread, unit)}{still}.",
    )
    if rest.samples == 1:
        notes = ("The axis counts as resting in the sample in which its velocity is 0.",)
    if aim == setup.task.tolerance:
        return notes
    return (
        *notes,
        f"The controller aims at {prefixed(aim, unit)}: the tolerance less what the sensors may be "
        "off by at rest.",
    )
