"""First guesses of the parameters, where the search for the likeliest ones begins."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
from jaxtyping import Float

from stickslip.estimation.energy.estimator import EnergyEstimator
from stickslip.estimation.energy.levels import summed
from stickslip.estimation.likelihood.axis_parameters import (
    SIDES,
    AxisParameters,
    coulomb_of,
    load_name,
    without_side,
)
from stickslip.estimation.regression.idim import IdimLeastSquares
from stickslip.records import AxisLog, InputError, mass_name

_LEAST = 1e-3  # of the largest effort: a Coulomb friction to begin with
_STATIC = 1.2
"""Static friction over Coulomb friction: where they are equal no derivative leads away."""

_REACHES = (1, 2, 4, 8, 16, 32)
"""Samples to each side that a velocity's sign is taken over: the one that explains most is kept."""
_PIECES = 16  # of a segment at most
_LEAST_PIECE = 100  # samples
_RESTING = 4.0  # standard deviations of a velocity's noise below which the axis counts as at rest
_STEPS = 1.5  # of an encoder, the same
_NAMES: tuple[str, ...] = ("mass", "viscous_friction", "coulomb_friction", "offset")
_MEDIAN = 0.6745  # of the magnitude of a standard normal variable


def first_guess(
    log: AxisLog, parameters: AxisParameters, given: Mapping[str, float], *, cutoff: float
) -> Float[np.ndarray, " p"]:
    """Return first values of what is sought [SI]; raise an InputError without one for a mass.

    What is not given comes from inverse dynamics by least squares, or where that fails, from the
    balance of forces integrated twice (`integral_guess`), from the energy estimator, or from
    inverse dynamics of the integrated velocity. The friction of a flexible arm whose masses are
    only guessed comes from the energies with these guesses. Under a low-pass of the cutoff [Hz]
    differentiated positions are quiet.
    """
    body = {"mass": mass_name, "inertia": mass_name}
    body |= {"load_mass": load_name, "load_inertia": load_name}
    given = {body[n](log.kind) if n in body else n: value for n, value in given.items()}
    found: dict[str, float] = {}
    if any(name not in given for name in parameters.names):
        found = _estimated(log, parameters, {**given, **parameters.known}, cutoff)
    effort = float(np.max(np.abs(log.effort)))
    values: list[float] = []
    for name in parameters.names:
        value = given.get(name, found.get(name, found.get(coulomb_of(name))))
        if "friction" in name and name not in given:
            value = max(value or 0.0, _LEAST * effort if "viscous" not in name else 0.0)
            value *= _STATIC if "static" in name else 1.0
        if name == "offset" and value is None:
            value = 0.0
        if value is None or (name != "offset" and "friction" not in name and value <= 0.0):
            raise InputError("no_first_guess_in_log", where=log.name, name=name)
        values.append(value)
    return np.array(values)


def _estimated(
    log: AxisLog, parameters: AxisParameters, known: Mapping[str, float], cutoff: float
) -> dict[str, float]:
    """Return what quicker methods find, the first one's values before the second's."""
    per_direction = any(name.endswith(SIDES[0]) for name in parameters.names)
    offset = "offset" in parameters.names
    inertia, load = known.get(mass_name(log.kind)), known.get(load_name(log.kind))
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
        if log.measured_velocity is not None:
            v = log.measured_velocity
            steps = np.diff(log.time) * 0.5 * (v[1:] + v[:-1])
            tried.append((idim, replace(log, measured_position=summed(steps))))
    for estimator, of in tried:
        if estimator is energy and not parameters.flexible:
            found = {**_integrated(log, parameters), **found}
            if all(coulomb_of(name) in found for name in parameters.names):
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
    for name in map(coulomb_of, parameters.names):
        if without_side(name) in values:
            found.setdefault(name, values[without_side(name)])
    return found


def integral_guess(log: AxisLog) -> dict[str, float]:
    """Return mass, viscous and Coulomb friction and offset [SI], alike in both directions.

    The balance of forces is integrated twice over each piece of the log:
    m x + c ∫x + f_c ∬sgn v + f_0 ∬1 = ∬u + a + b t, with integrals over motion only, where a and b
    are of that piece. It is linear in what is sought, positions stand in it as they are measured,
    and the only derivative is in a sign: no filter is needed, and a log may be short. A disturbing
    force adds up over a piece only.

    The result is empty if nothing moves, or if no mass or a negative friction would come out. What
    the log does not separate, such as Coulomb friction and offset while all motion is one way, is
    shared among them.
    """
    best: dict[str, float] = {}
    least = np.inf
    for reach in _REACHES:
        values, unexplained = _solved(log, reach)
        if values is not None and unexplained < least:
            best, least = dict(zip(_NAMES, values.tolist(), strict=True)), unexplained
    return best


def _solved(log: AxisLog, reach: int) -> tuple[Float[np.ndarray, " 4"] | None, float]:
    """Return the four values, None if they make no axis, and the sum of squares left over."""
    grams, sums, total = np.zeros((4, 4)), np.zeros(4), 0.0
    for part in log.segments():
        if len(part) < 4 * reach + 2:
            continue
        pieces = max(min(_PIECES, len(part) // _LEAST_PIECE), 1)
        bounds = np.linspace(0, len(part), pieces + 1).astype(int).tolist()
        sign = _sign(part.measured_position, reach)
        for piece in (slice(start, stop) for start, stop in pairwise(bounds)):
            rows, target = _rows(
                part.measured_position[piece], part.effort[piece], sign[piece], log.sampling_time
            )
            grams += rows.T @ rows
            sums += rows.T @ target
            total += float(target @ target)
    scale = np.sqrt(np.diag(grams))
    if np.any(scale == 0.0):
        return None, np.inf
    values = np.linalg.lstsq(grams / np.outer(scale, scale), sums / scale, rcond=1e-10)[0] / scale
    if not np.all(np.isfinite(values)) or values[0] <= 0.0 or np.min(values[1:3]) < 0.0:
        return None, np.inf
    # Over the mass, as errors are those of positions: a heavy axis would leave more forces over.
    left = total - 2.0 * float(values @ sums) + float(values @ grams @ values)
    return values, left / float(values[0]) ** 2


def _sign(position: Float[np.ndarray, " n"], reach: int) -> Float[np.ndarray, " n"]:
    """Return the direction of motion, 0 at rest."""
    change = np.zeros(position.size)
    change[reach:-reach] = position[2 * reach :] - position[: -2 * reach]
    noise = float(np.median(np.abs(np.diff(position, 3)))) / _MEDIAN / np.sqrt(20.0)
    steps = np.abs(np.diff(position))
    step = float(np.min(steps[steps > 0.0], initial=np.inf))
    least = _RESTING * np.sqrt(2.0) * noise
    if np.isfinite(step) and np.median(steps) == 0.0:  # an encoder that mostly shows the same
        least = max(least, _STEPS * step)
    return np.where(np.abs(change) > least, np.sign(change), 0.0)


def _rows(
    position: Float[np.ndarray, " n"],
    effort: Float[np.ndarray, " n"],
    sign: Float[np.ndarray, " n"],
    sampling_time: float,
) -> tuple[Float[np.ndarray, "n 4"], Float[np.ndarray, " n"]]:
    """Return the twice integrated balance of a piece, with a line in time taken out."""
    T = sampling_time

    def integrated(rates: Float[np.ndarray, "n ..."]) -> Float[np.ndarray, "n ..."]:
        """Integrate by the trapezoidal rule."""
        return T * summed(0.5 * (rates[1:] + rates[:-1]))

    moving = np.abs(sign)
    travelled = position - position[0]
    columns = np.column_stack([effort * moving, sign, moving])
    # Forces are held over a sample: velocity by one sum, position by that of means of velocities.
    pushed, against, pulled = integrated(T * summed(columns[:-1])).T
    whole = np.column_stack([travelled, integrated(travelled), against, pulled, pushed])
    time = np.arange(effort.size) * T
    line = np.linalg.qr(np.column_stack([np.ones(effort.size), time]))[0]
    kept = whole - line @ (line.T @ whole)
    return kept[:, :4], kept[:, 4]
