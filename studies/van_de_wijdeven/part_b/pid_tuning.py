"""How the PID controllers that pulses are compared with are tuned: by trial, all the same way."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from math import inf, radians, sqrt
from typing import Literal

from stickslip.control import Dither, PIDController, ResetIntegral
from stickslip.records import InputError
from studies.van_de_wijdeven.part_b.random_axes import SAMPLE_NOISE, RandomAxis
from studies.van_de_wijdeven.part_b.setting import SAMPLING_TIME, TOLERANCE
from studies.van_de_wijdeven.part_b.trials import study
from studies.van_de_wijdeven.records import ControllerScore

_REST = 5.0  # standard deviations of the differentiated noise
_REST_SAMPLES = 2


@dataclass(frozen=True, kw_only=True)
class PIDTuning:
    """Tuning of a PID controller for any axis of which mass and friction are guessed."""

    bandwidth: float  #: Crossover frequency [Hz].
    phase_margin: float  #: [degrees].
    integral_ratio: float  #: Crossover frequency over that of the integral [-].
    dead_band: float = 0.0  #: Over the tolerance [-].
    dither: float = 0.0  #: Amplitude over the guessed static friction [-]; 0 for none.
    dither_frequency: float = 50.0  #: Of its square wave [Hz].
    #: Law of the integral's resets; None for none.
    reset: Literal["coulomb", "stribeck"] | None = None

    @property
    def is_possible(self) -> bool:
        """Whether a loop can be shaped so at this sampling time."""
        try:
            self._shaped(1.0, 0.0, 1.0)
        except InputError:
            return False
        return True

    def __call__(self, axis: RandomAxis) -> PIDController:
        """Return the controller for an axis."""
        mass, target, limit = axis.guessed_mass, axis.start_error, axis.effort_limit
        shaped = self._shaped(mass, target, limit)
        reset = dither = None
        if self.reset is not None:
            reset = ResetIntegral(
                law=self.reset,
                rest_speed=_REST * _derivative_noise(shaped.filter_time),
                rest_samples=_REST_SAMPLES,
            )
        if self.dither > 0.0:
            dither = Dither(
                amplitude=self.dither * axis.guessed_friction.static_friction_positive,
                frequency=self.dither_frequency,
                shape="square",
            )
        return replace(shaped, dead_band=self.dead_band * TOLERANCE, dither=dither, reset=reset)

    def _shaped(self, mass: float, target: float, limit: float) -> PIDController:
        return PIDController.for_mass(
            sampling_time=SAMPLING_TIME,
            target=target,
            mass=mass,
            bandwidth=self.bandwidth,
            effort_limit=limit,
            phase_margin=radians(self.phase_margin),
            integral_ratio=self.integral_ratio,
        )


def _derivative_noise(tau: float) -> float:
    """Return the standard deviation of (2 (z - 1))/((2 tau + T) z - (2 tau - T)) of the noise."""
    T = SAMPLING_TIME
    pole = (2.0 * tau - T) / (2.0 * tau + T)
    return SAMPLE_NOISE * 2.0 / (2.0 * tau + T) * sqrt(2.0 / (1.0 + pole))


_GRID: dict[str, tuple[float, ...]] = {
    "bandwidth": (1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0),
    "phase_margin": (20.0, 30.0, 45.0, 60.0),
    "integral_ratio": (3.0, 5.0, 10.0, 20.0),
    "dead_band": (0.0, 0.5, 0.75, 0.9),
    "dither": (0.15, 0.3, 0.45, 0.6, 0.75, 0.9, 1.2),
    "dither_frequency": (12.5, 25.0, 50.0),
}
FASTEST = 0.1 / SAMPLING_TIME
"""A tenth of the sampling rate [Hz], a common rule: beyond it any delay of a loop matters."""
LEAST_MARGIN = 30.0
"""Usual lower limit of the phase margin [degrees]."""
_STARTS = tuple(product((30.0, 60.0), (3.0, 10.0)))  # phase margin and integral ratio


def tune(
    variant: PIDTuning,
    axes: Sequence[RandomAxis],
    *,
    free: Sequence[str] = (),
    fastest: float = FASTEST,
    least_margin: float = LEAST_MARGIN,
    workers: int,
) -> list[tuple[PIDTuning, ControllerScore]]:
    """Tune a variant by trial, on other axes than those of the comparison.

    One setting after the other runs over its grid while the others stay as they are, until a whole
    round changes none; that from several starts. The settings are bandwidth, phase margin, integral
    ratio and those in ``free``: ``"dead_band"``, ``"dither"``, ``"dither_frequency"``. Better is
    what keeps more axes within the tolerance; of equals, what is there sooner in the median. All
    that was tried is returned with its score, the best first.
    """
    tried: dict[PIDTuning, ControllerScore] = {}

    def merit(tuning: PIDTuning) -> tuple[float, float]:
        found = tried[tuning]
        return found.within_tolerance, -(inf if found.median_time is None else found.median_time)

    for phase_margin, integral_ratio in _STARTS:
        best, before = (
            replace(variant, phase_margin=phase_margin, integral_ratio=integral_ratio),
            None,
        )
        while best != before:
            before = best
            for name in ("bandwidth", "phase_margin", "integral_ratio", *free):
                row = [best, *(replace(best, **{name: value}) for value in _GRID[name])]
                row = [
                    each
                    for each in row
                    if each.bandwidth <= fastest
                    and each.phase_margin >= least_margin
                    and each.is_possible
                ]
                new = {str(each): each for each in row if each not in tried}
                scores = study(axes, new, workers=workers, advance=lambda: None)
                tried.update(zip(new.values(), scores, strict=True))
                best = max(row, key=merit)
    return [(each, tried[each]) for each in sorted(tried, key=merit, reverse=True)]
