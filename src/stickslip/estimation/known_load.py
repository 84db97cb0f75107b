"""Torque constant of a drive from the gravity of a known weight on a lever."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.selection.judgement.status import judged
from stickslip.records import AxisLog, FrictionEstimate, InputError, finite, positive, unit_of

_GRAVITY = 9.80665  # m/s^2, standard
_SINE, _COSINE = "gravity_sine", "gravity_cosine"
LARGEST_UNCERTAINTY = 0.1
"""Largest half of the 95 % interval of the torque constant over its value [-]: with a larger one,
friction in N m is no more useful than in ampere."""


@dataclass(frozen=True, kw_only=True)
class KnownLoad:
    """A weight on a lever that turns about a horizontal axis; all else is balanced."""

    mass: float  #: Of the weight [kg].
    radius: float  #: From the axis to its centre of mass [m].

    def __post_init__(self) -> None:
        for name in ("mass", "radius"):
            positive(name, finite(name, getattr(self, name), self._unit(name)), self._unit(name))

    @staticmethod
    def _unit(name: str) -> str:
        return "kg" if name == "mass" else "m"

    @property
    def torque(self) -> float:
        """Amplitude of the torque of gravity, m g r [N m]."""
        return self.mass * _GRAVITY * self.radius

    def converted(self, log: AxisLog, estimate: FrictionEstimate) -> AxisLog:
        """Return a log in ampere with its effort in N m.

        The estimate is of that log, with the term ``"gravity"``. A log that does not determine the
        amplitude of gravity to 10 % is an InputError.
        """
        parameters = [estimate.parameters.get(name) for name in (_SINE, _COSINE)]
        if not all(parameter and parameter.identified for parameter in parameters):
            raise InputError("known_load_not_seen", where=log.name)
        amplitude, gradient = _amplitude(estimate)
        std = float(np.sqrt(gradient @ estimate.covariance @ gradient))
        quantiles = [each.quantile for each in parameters if each is not None]
        half = max(quantiles) * std / amplitude
        if not half <= LARGEST_UNCERTAINTY:
            raise InputError(
                "known_load_uncertain", where=log.name, percent=100 * half,
                most=100 * LARGEST_UNCERTAINTY,
            )  # fmt: skip
        constant = self.torque / amplitude
        note = (
            f"effort: the torque constant is {constant:.4g} N m/{log.effort_unit} "
            f"± {100 * half:.2g} % (95 %), as {self.mass:g} kg at {self.radius:g} m take "
            f"{amplitude:.4g} {log.effort_unit}; all else is taken as balanced"
        )
        source = log.source
        if source is not None:
            others = [each for each in source.assumptions if each != source.unconverted]
            source = replace(source, assumptions=(*others, note), unconverted="")
        return replace(log, effort=constant * log.effort, effort_unit="", source=source)

    def widened(self, estimate: FrictionEstimate) -> FrictionEstimate:
        """Return an estimate in N m whose intervals include the uncertainty of the torque constant.

        A parameter is p m g r / G with p and the amplitude G in ampere: its relative error is that
        of p less that of G. The estimate is of the log that `converted` returns.
        """
        amplitude, gradient = _amplitude(estimate)
        known = [name for name, each in estimate.parameters.items() if each.identified]
        values = np.array([estimate.value(name) for name in known])
        forces = np.array([_of_effort(name) for name in known])
        change = np.eye(len(known)) - np.outer(values * forces, gradient) / amplitude
        covariance = change @ estimate.covariance @ change.T
        parameters = dict(estimate.parameters)
        for k, name in enumerate(known):
            own = parameters[name]
            if own.ci95 is None or own.value is None:
                continue
            std = float(np.sqrt(max(covariance[k, k], 0.0)))
            half = own.quantile * std
            low, high = own.value - half, own.value + half
            parameters[name] = replace(own, std=std, ci95=(low, high))
        found = replace(estimate, parameters=parameters, covariance=covariance)
        inertia, least = parameters.get("inertia"), self.mass * self.radius**2
        if inertia is None or inertia.ci95 is None or inertia.ci95[1] >= least:
            return found
        cause = (
            f"the inertia, at most {inertia.ci95[1]:.4g} kg m^2, is smaller than the {least:.4g} "
            "kg m^2 of the known load; check its mass and radius, and whether all else is balanced"
        )
        return judged(found, [cause])


def _amplitude(estimate: FrictionEstimate) -> tuple[float, Float[np.ndarray, " p"]]:
    """Return the amplitude of gravity, and its derivatives with respect to the parameters."""
    sine, cosine = estimate.value(_SINE), estimate.value(_COSINE)
    amplitude = float(np.hypot(sine, cosine))
    known = [name for name, each in estimate.parameters.items() if each.identified]
    gradient = np.zeros(len(known))
    gradient[known.index(_SINE)] = sine / amplitude
    gradient[known.index(_COSINE)] = cosine / amplitude
    return amplitude, gradient


def _of_effort(name: str) -> bool:
    """Return whether a parameter is proportional to the unit of the effort."""
    return unit_of(name, "rotary", "A") != unit_of(name, "rotary")
