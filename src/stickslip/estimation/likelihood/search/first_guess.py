"""Where the search for the likeliest parameters begins."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.likelihood.axis_parameters import (
    AxisParameters,
    load_name,
    mass_name,
)
from stickslip.estimation.likelihood.search.integral_guess import integral_guess
from stickslip.estimation.regression.idim_least_squares import IdimLeastSquares
from stickslip.records import AxisLog, InputError

__all__ = ["first_guess"]

_LEAST = 1e-3  # of the largest effort: a Coulomb friction to begin with
_STATIC = 1.2
"""Static friction over Coulomb friction: where they are equal no derivative leads away."""


def first_guess(
    log: AxisLog, parameters: AxisParameters, given: Mapping[str, float], *, cutoff: float
) -> Float[np.ndarray, " p"]:
    """Return first values of what is sought [SI].

    What is not given comes from inverse dynamics by least squares, or where that fails, from the
    balance of forces integrated twice (`integral_guess`), from the energy estimator, or from
    inverse dynamics of the integrated velocity. The friction of a
    flexible arm whose masses are only guessed comes from the energies with these guesses.

    Parameters
    ----------
    log
        Any log.
    parameters
        What is sought.
    given
        First guesses by name [SI].
    cutoff
        Of a low-pass under which differentiated positions are quiet [Hz].

    Raises
    ------
    InputError
        If no method finds a mass, and none is given.
    """
    given = {_renamed(name, log): value for name, value in given.items()}
    known = {**given, **parameters.known}
    found: dict[str, float] = {}
    if any(name not in given for name in parameters.names):
        found = _estimated(log, parameters, known, cutoff)
    effort = float(np.max(np.abs(log.effort)))
    values: list[float] = []
    for name in parameters.names:
        value = given.get(name, found.get(name, found.get(_followed(name))))
        if "friction" in name and name not in given:
            value = max(value or 0.0, _LEAST * effort if "viscous" not in name else 0.0)
            value *= _STATIC if "static" in name else 1.0
        if name == "offset" and value is None:
            value = 0.0
        if value is None or (name != "offset" and "friction" not in name and value <= 0.0):
            raise InputError(
                f"no first guess of the {name.replace('_', ' ')} can be found in this log",
                where=log.name,
                remedy=f"give initial_values={{{name!r}: ...}}",
            )
        values.append(value)
    return np.array(values)


def _renamed(name: str, log: AxisLog) -> str:
    """Return what a guess is called on this kind of axis."""
    if name in ("mass", "inertia"):
        return mass_name(log.kind)
    return load_name(log.kind) if name in ("load_mass", "load_inertia") else name


def _followed(name: str) -> str:
    return name.replace("static", "coulomb")


def _estimated(
    log: AxisLog, parameters: AxisParameters, known: Mapping[str, float], cutoff: float
) -> dict[str, float]:
    """Return what quicker methods find, the first one's values before the second's."""
    per_direction = any(name.endswith("_positive") for name in parameters.names)
    offset = "offset" in parameters.names
    inertia = known.get(mass_name(log.kind))
    load = known.get(load_name(log.kind))
    if parameters.flexible and log.measured_load_position is None:
        inertia, load = (inertia or 0.0) + (load or 0.0), None
    energy = EnergyEstimator(
        inertia=inertia,
        load_inertia=load,
        stiffness=None if load is None else known.get("stiffness"),
        per_direction=per_direction,
        offset=offset,
    )
    idim = IdimLeastSquares(
        inertia=inertia, per_direction=per_direction, offset=offset, cutoff=cutoff
    )
    found: dict[str, float] = {}
    tried: list[tuple[EnergyEstimator | IdimLeastSquares, AxisLog]] = [(energy, log)]
    if not parameters.flexible:
        tried.insert(0, (idim, log))
    if log.measured_velocity is not None and not parameters.flexible:
        steps = np.diff(log.time) * 0.5 * (log.measured_velocity[1:] + log.measured_velocity[:-1])
        way = np.concatenate(([0.0], np.cumsum(steps)))
        tried.append((idim, replace(log, measured_position=way)))
    for estimator, of in tried:
        if estimator is energy and not parameters.flexible:
            found = {**_integrated(log, parameters), **found}
            if all(_followed(name) in found for name in parameters.names):
                break
        try:
            estimate = estimator.fit(of)
        except InputError:
            continue
        values = {name: p.value for name, p in estimate.parameters.items() if p.value is not None}
        found = {**values, **found}
        if len(values) == len(estimate.parameters):
            break
    return found


def _integrated(log: AxisLog, parameters: AxisParameters) -> dict[str, float]:
    """Return what the integrated balance finds, by the names of what is sought."""
    values = integral_guess(log)
    found = {mass_name(log.kind): values["mass"]} if values else {}
    for name in parameters.names:
        both = _followed(name).removesuffix("_positive").removesuffix("_negative")
        if both in values:
            found.setdefault(_followed(name), values[both])
    return found
