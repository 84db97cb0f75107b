"""Friction laws with their values, judged by logs: residual of the effort, and free runs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.friction import CoulombViscousFriction
from stickslip.friction.estimated_law import law_effort
from stickslip.plants import SingleMass
from stickslip.records import AxisLog, FrictionEstimate
from stickslip.simulation import PlantStepper
from studies.real_logs.motion import acting_effort, smooth_motion

_HALF_SAMPLE = 0.5
_SIDES = ("positive", "negative")
_SIMULATED = ("viscous_friction", "coulomb_friction", "offset", "low_speed", "ripple")


@dataclass(frozen=True, kw_only=True)
class AxisLaw:
    """A rigid axis with Coulomb and viscous friction, lower friction at low speed, and a ripple."""

    mass: float  #: [kg].
    #: Coulomb and viscous friction, of both directions or of each, offset, the friction of low
    #: speeds and the ripple, by name [SI].
    values: Mapping[str, float]
    delay: float = 0.0  #: Time by which the effort acts later than it is logged [s].
    period: float = math.inf  #: Of the ripple [m].
    origin: float = 0.0  #: Position at which its sine is zero [m].

    @classmethod
    def of(cls, estimate: FrictionEstimate) -> "AxisLaw":
        """Return the law of an estimate of a linear axis; terms of other kinds are an error."""
        values = {name: estimate.value(name) for name in estimate.parameters}
        mass, delay = values.pop("mass"), values.pop("effort_delay", 0.0)
        if not all(n.startswith(_SIMULATED) for n in values):
            raise SystemExit(f"{estimate.estimator} found {', '.join(values)}: extend this study")
        period = values.pop("ripple_period", math.inf)
        origin = 0.0 if estimate.selection is None else estimate.selection.reference_position
        return cls(mass=mass, values=values, delay=delay, period=period, origin=origin)

    def without_ripple(self) -> "AxisLaw":
        """Return the law without its ripple, whose phase another homing of the axis changes."""
        values = {n: value for n, value in self.values.items() if not n.startswith("ripple")}
        return replace(self, values=values, period=math.inf)

    def friction(self, velocity: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return the friction at each velocity, without the ripple [N]."""
        return law_effort(self.values, velocity, np.sign(velocity))

    def ripple(self, position: Float[np.ndarray, " n"]) -> Float[np.ndarray, " n"]:
        """Return the ripple at each position [N]."""
        wave = 2.0 * np.pi / self.period * (position - self.origin)
        sine, cosine = (self.values.get(f"ripple_{part}", 0.0) for part in ("sine", "cosine"))
        return sine * np.sin(wave) + cosine * np.cos(wave)

    def residual(self, log: AxisLog, *, later: float | None = None) -> float:
        """Return the norm of the unexplained effort over that of the effort, without gaps [-].

        ``later`` is that of `smooth_motion`; None for a held effort with the delay of the law.
        """
        if later is None:
            later = _HALF_SAMPLE + self.delay / log.sampling_time
        motion = smooth_motion(log, later=later)
        rest = motion.effort - self.mass * motion.acceleration
        rest = rest - self.friction(motion.velocity) - self.ripple(motion.position)
        rows = motion.decimated(np.column_stack([motion.effort, rest]))
        return float(np.linalg.norm(rows[:, 1]) / np.linalg.norm(rows[:, 0]))

    def free_run(self, log: AxisLog, *, each_move: bool) -> Float[np.ndarray, " n"]:
        """Return the positions of the simulated axis under the effort of a log without gaps [m].

        Coulomb and viscous friction and offset are propagated exactly, rests included; what is left
        of the law is held over each sample, at the speed in its middle. With ``each_move`` the
        simulation begins again from the measured state at each move.
        """
        T = log.sampling_time
        effort = acting_effort(log, self.delay / T)
        motion = smooth_motion(log)
        starts = sorted({0, *(start for start, _ in motion.moves())}) if each_move else [0]
        plant = SingleMass(mass=self.mass, friction=self._simulated())
        stepper = PlantStepper(plant, sampling_time=T)
        low, slow = (self.values.get(f"low_speed_{what}", 0.0) for what in ("friction", "velocity"))
        sine, cosine = (self.values.get(f"ripple_{part}", 0.0) for part in ("sine", "cosine"))
        wave = 2.0 * math.pi / self.period
        positions = np.empty(len(log))
        for start, stop in zip(starts, [*starts[1:], len(log)], strict=True):
            x, v = float(motion.position[start]), float(motion.velocity[start])
            state, before = stepper.init((x, v)), v
            for k in range(start, stop):
                positions[k] = x
                ahead = 1.5 * v - 0.5 * before  # in the middle of the sample, if it goes on so
                place = wave * (x + 0.5 * T * v - self.origin)
                rest = sine * math.sin(place) + cosine * math.cos(place)
                if low and v:  # beyond the friction at zero speed
                    rest += math.copysign(low * (math.exp(-((ahead / slow) ** 2)) - 1.0), v)
                before = v
                state, (x, v) = stepper.step(state, float(effort[k]) - rest)
        return positions

    def _simulated(self) -> CoulombViscousFriction:
        """Return the part of the law that the simulator has."""
        values: dict[str, float] = {}
        for side in _SIDES:
            for name in ("coulomb_friction", "viscous_friction"):
                both = self.values.get(name, 0.0)
                values[f"{name}_{side}"] = self.values.get(f"{name}_{side}", both)
            values[f"coulomb_friction_{side}"] += self.values.get("low_speed_friction", 0.0)
            values[f"static_friction_{side}"] = values[f"coulomb_friction_{side}"]
        return CoulombViscousFriction(**values, offset=self.values.get("offset", 0.0))


PUBLISHED = AxisLaw(
    mass=95.1089,
    values={"viscous_friction": 203.5034, "coulomb_friction": 20.3935, "offset": -3.1648},
)
"""Law of the EMPS as published by Janot, Gautier and Brunot (2019)."""
DIRECTIONS = AxisLaw(
    mass=95.1540,
    values={
        "viscous_friction_positive": 166.7061,
        "viscous_friction_negative": 240.4236,
        "coulomb_friction_positive": 20.1440,
        "coulomb_friction_negative": 20.6277,
    },
)
"""The same with friction of each direction."""
