"""An input that makes the bound on the parameters small, within the limits of the axis."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import minimize

from stickslip.estimation.likelihood.bound import CramerRaoBound, bound_of, default_sought
from stickslip.plants import Plant
from stickslip.records import EventBudgetError, InputError, positive, unit_of
from stickslip.simulation import MotionSensitivity, Sensors, simulate_sensitivity

_TONES = 6
"""Sines that the input is made of; their sum is clipped at the limit of the effort, so that the
family reaches from soft multisines to switching between both limits."""

_CYCLES = 2.0  # of the slowest sine in the whole input, at least
_SAMPLES = 12.0  # in a cycle of the fastest
_FASTEST = 8.0  # times the rate at which the effort turns the axis around at the limit of its speed
_TRIED = 48  # random inputs that the search begins with, of sines as slow as the input is long
_TRIED_ODD = 24  # of each family that repeats itself
_REFINED = 2  # families, the best input of each
_EVALUATIONS = 400  # in each refinement
_PENALTY = 20.0  # for a limit exceeded by as much as itself
_LOUDEST = 3.0  # amplitude of a sine over the limit of the effort
_USED = 0.999  # of the limits, against rounding
_LEAST_DETERMINED = -100.0  # logarithm of the determinant where nothing is


@dataclass(frozen=True, kw_only=True)
class InputLimits:
    """Limits of an axis.

    Attributes
    ----------
    effort
        Largest magnitude [N or N m].
    speed
        Largest magnitude [m/s or rad/s]; None for no limit.
    travel
        Largest distance from where the axis begins [m or rad]; None for no limit.
    """

    effort: float
    speed: float | None = None
    travel: float | None = None

    def __post_init__(self) -> None:
        positive("effort_limit", self.effort, "N or N m")
        for name, unit in (("speed", "m/s or rad/s"), ("travel", "m or rad")):
            if (limit := getattr(self, name)) is not None:
                positive(f"{name}_limit", limit, unit)

    def excess(self, largest_speed: float, largest_travel: float) -> float:
        """Return by how much a motion exceeds the limits [-]; 0 if it does not."""
        pairs = ((self.speed, largest_speed), (self.travel, largest_travel))
        excess = [reached / (_USED * limit) - 1.0 for limit, reached in pairs if limit is not None]
        return sum((max(each, 0.0) for each in excess), start=0.0)


@dataclass(frozen=True, kw_only=True)
class DesignedInput:
    """An input and the bound on the parameters that is expected with it."""

    sampling_time: float  #: [s].
    effort: Float[np.ndarray, " n"]  #: Held over each sample [N or N m], shape (n,).
    bound: CramerRaoBound  #: On the parameters, with it.
    largest_speed: float  #: That the plant is expected to reach [m/s or rad/s].
    largest_travel: float  #: That the plant is expected to reach [m or rad].


def design_input(
    plant: Plant,
    *,
    duration: float,
    sampling_time: float,
    sensors: Sensors,
    limits: InputLimits,
    generator: np.random.Generator,
    sought: Sequence[str] | None = None,
) -> DesignedInput:
    """Return an input whose Fisher information about the parameters is large (D-optimal).

    The determinant of the information is the inverse squared volume of the ellipsoid that the
    estimates scatter in; it does not depend on the units of the parameters. It is maximised over
    clipped multisines around the effort that holds the axis: random ones first, then the best of
    them by Powell's method. Besides sines that begin as slow as the input is long there are
    families of odd multiples of a frequency, one for each octave up to what the axis and its limits
    follow: an input that is longer has all families of a shorter one, and so is hardly worse than
    the shorter one again and again. A rough estimate of the plant from any motion is enough.

    Parameters
    ----------
    plant
        The axis, from a first estimate.
    duration, sampling_time
        Of the input [s].
    sensors
        What will measure, with its noise.
    limits
        What the axis allows.
    generator
        Of the random inputs that the search begins with.
    sought
        Names of the parameters; see `cramer_rao_bound`.

    Raises
    ------
    InputError
        If the duration is too short, or no input within the limits separates the parameters.

    Examples
    --------
    >>> from stickslip.friction import CoulombViscousFriction
    >>> from stickslip.plants import SingleMass
    >>> law = CoulombViscousFriction.symmetric(coulomb_friction=20.0, viscous_friction=200.0)
    >>> designed = design_input(
    ...     SingleMass(mass=95.0, friction=law), duration=2.0, sampling_time=0.01,
    ...     sensors=Sensors(position_noise=1e-5, velocity="none"),
    ...     limits=InputLimits(effort=120.0, speed=0.3, travel=0.1),
    ...     generator=np.random.default_rng(1))
    >>> designed.largest_travel <= 0.1, designed.bound.std["mass"] < 1.0
    (True, True)
    """
    n = round(positive("duration", duration, "s") / positive("sampling_time", sampling_time, "s"))
    if n < _SAMPLES * _CYCLES:
        raise InputError("input_too_short", samples=n, least=_SAMPLES * _CYCLES)
    names = default_sought(plant) if sought is None else tuple(sought)
    time = sampling_time * np.arange(n)
    slowest = _CYCLES / duration
    fastest = max(min(1.0 / (_SAMPLES * sampling_time), _turning_rate(plant, limits)), slowest)
    centre = float(np.clip(_balance(plant) / limits.effort, -1.0, 1.0))
    best: tuple[float, Float[np.ndarray, " n"]] | None = None

    def cost(design: Float[np.ndarray, " m"], frequencies: Float[np.ndarray, " tones"]) -> float:
        nonlocal best
        sine, cosine = np.clip(design.reshape(2, _TONES), -_LOUDEST, _LOUDEST)
        angles = 2.0 * np.pi * np.outer(frequencies, time)
        total = centre + sine @ np.sin(angles) + cosine @ np.cos(angles)
        effort = limits.effort * np.clip(total, -1.0, 1.0)
        try:
            found = simulate_sensitivity(plant, effort, sampling_time=sampling_time)
        except EventBudgetError:
            return -_LEAST_DETERMINED
        excess = limits.excess(*_extent(found))
        determinant = _determinant(bound_of(plant, found, sensors, names))
        value = -determinant + _PENALTY * excess
        if excess == 0.0 and determinant > _LEAST_DETERMINED and (best is None or value < best[0]):
            best = value, effort
        return value

    starts: list[tuple[float, Float[np.ndarray, " m"], Float[np.ndarray, " tones"]]] = []
    for frequencies, tried in _families(slowest, fastest):
        designs = [
            size * generator.standard_normal(2 * _TONES) for size in np.geomspace(0.02, 1.0, tried)
        ]
        costs = [cost(design, frequencies) for design in designs]
        least = int(np.argmin(costs))
        starts.append((costs[least], designs[least], frequencies))
    starts.sort(key=lambda start: start[0])
    for _, design, frequencies in starts[:_REFINED]:
        minimize(
            cost, design, args=(frequencies,), method="Powell", options={"maxfev": _EVALUATIONS}
        )
    if best is None:
        raise _refusal(plant, limits)
    effort = best[1]
    found = simulate_sensitivity(plant, effort, sampling_time=sampling_time)
    largest_speed, largest_travel = _extent(found)
    return DesignedInput(
        sampling_time=sampling_time,
        effort=effort,
        bound=bound_of(plant, found, sensors, names),
        largest_speed=largest_speed,
        largest_travel=largest_travel,
    )


def _extent(found: MotionSensitivity) -> tuple[float, float]:
    """Return the largest speed and distance from the start [m/s or rad/s, m or rad]."""
    position = found.motion.position
    travel = float(np.max(np.abs(position - position[0])))
    return float(np.max(np.abs(found.motion.velocity))), travel


def _families(slowest: float, fastest: float) -> list[tuple[Float[np.ndarray, " tones"], int]]:
    """Return frequencies [Hz] of the sines, and how many random inputs to try of each set.

    Odd multiples of one frequency move a symmetric axis as far one way as the other, so that it
    stays where it is however often they repeat.
    """
    families = [(np.geomspace(slowest, fastest, _TONES), _TRIED)]
    base = fastest / (2 * _TONES - 1)
    while base > slowest:
        spread = np.geomspace(1.0, fastest / base, _TONES)
        odd = 2.0 * np.round((spread - 1.0) / 2.0) + 1.0
        odd = np.maximum(odd, 2.0 * np.arange(_TONES) + 1.0)
        families.append((base * odd, _TRIED_ODD))
        base *= 0.5
    return families


def _balance(plant: Plant) -> float:
    """Return the effort [N or N m] midway between those that free the axis each way."""
    law: Any = plant.friction
    between = law.static_friction_positive - law.static_friction_negative
    return float(law.offset + 0.5 * between)


def _refusal(plant: Plant, limits: InputLimits) -> InputError:
    """Return why no input separates the parameters."""
    law: Any = plant.friction
    unit = unit_of("effort", plant.kind)
    takes = {
        "forwards": law.offset + law.static_friction_positive,
        "backwards": law.static_friction_negative - law.offset,
    }
    held = {direction: effort for direction, effort in takes.items() if effort >= limits.effort}
    if held:
        direction = next(iter(held)) if len(held) == 1 else ""
        least = max(held.values())
        return InputError(
            "effort_frees_nothing",
            limit=limits.effort,
            direction=direction,
            needed=min(held.values()),
            least=least,
            unit=unit,
        )
    return InputError("no_input_separates")


def _turning_rate(plant: Plant, limits: InputLimits) -> float:
    """Return a frequency [Hz] above which the effort hardly moves the axis."""
    mass = sum(value for name, value in vars(plant).items() if name.startswith("mass"))
    if limits.speed is not None:
        return _FASTEST * limits.effort / (mass * limits.speed)
    if limits.travel is not None:
        return _FASTEST * float(np.sqrt(limits.effort / (mass * limits.travel)))
    return np.inf


def _determinant(bound: CramerRaoBound) -> float:
    """Return the logarithm of the determinant of the information, over the number of parameters."""
    sign, value = np.linalg.slogdet(bound.information)
    if sign <= 0 or not np.isfinite(value) or not np.all(np.isfinite(np.diag(bound.covariance))):
        return _LEAST_DETERMINED
    return max(float(value) / len(bound.names), _LEAST_DETERMINED)
