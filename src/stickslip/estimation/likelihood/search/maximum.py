"""Gauss-Newton search of the likeliest parameters, damped after Levenberg and Marquardt."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.axis_parameters import AxisParameters
from stickslip.estimation.likelihood.noise_model import (
    ChannelNoise,
    likeliest_noise,
    whitened,
)
from stickslip.estimation.likelihood.windows import Window
from stickslip.records import EventBudgetError, InputError

__all__ = ["Maximum", "search"]

MOST_STEPS = 60
SMALL_GAIN = 1e-4
"""Of the logarithm of the likelihood: a hundredth of a standard deviation in every parameter."""

_FIRST_DAMPING = 1e-3
_LARGEST_DAMPING = 1e8
_EASED, _RAISED = 0.2, 5.0
_CLEAN = 1e-9  # of the range of a channel: what is below is rounding


@dataclass(frozen=True, kw_only=True)
class Maximum:
    """Where a search ended.

    Attributes
    ----------
    values
        Of the parameters [SI], shape (p,).
    states
        First state of each window [SI].
    noise
        Of each channel.
    cost
        Negative logarithm of the likelihood, up to a constant [-].
    steps
        Linearisations.
    converged
        Whether no step would gain more than what is small.
    """

    values: Float[np.ndarray, " p"]
    states: tuple[Float[np.ndarray, " s"], ...]
    noise: tuple[ChannelNoise, ...]
    cost: float
    steps: int
    converged: bool


def _noise_of(
    windows: Sequence[Window],
    errors: Sequence[Sequence[Float[np.ndarray, " _"]]],
    *,
    coloured: bool,
) -> tuple[ChannelNoise, ...]:
    """Return the likeliest noise of each channel."""
    found: list[ChannelNoise] = []
    for c in range(len(windows[0].channels)):
        span = max(float(np.ptp(w.channels[c].readings)) for w in windows)
        own = [of[c] for of in errors]
        found.append(likeliest_noise(own, coloured=coloured, least=_CLEAN * max(span, _CLEAN)))
    return tuple(found)


def search(
    windows: Sequence[Window],
    parameters: AxisParameters,
    start: Float[np.ndarray, " p"],
    *,
    coloured: bool,
    states: Sequence[Float[np.ndarray, " s"]] | None = None,
    most_steps: int = MOST_STEPS,
    small_gain: float = SMALL_GAIN,
) -> Maximum:
    """Return the likeliest parameters and first states near a start.

    With the noise of each channel at its likeliest, the gradient of the concentrated likelihood is
    that of a least-squares problem with that noise held, and its Hessian nearly so (Gauss-Newton).

    Parameters
    ----------
    windows
        What is to be explained.
    parameters
        What is sought.
    start
        First guess [SI], shape (p,).
    coloured
        Whether errors may be correlated from sample to sample.
    states
        First guesses of the first states [SI]; None takes those of the windows.
    most_steps
        Linearisations at most.
    small_gain
        Of the logarithm of the likelihood, below which a step is not worth its time [-].
    """
    values = parameters.bounded(start, start)
    begun = [np.array(w.state) for w in windows] if states is None else [s.copy() for s in states]
    damping = _FIRST_DAMPING
    made = [w.linearised(parameters, values, s) for w, s in zip(windows, begun, strict=True)]
    noise = _noise_of(windows, [errors for errors, _ in made], coloured=coloured)
    cost = sum(of.cost for of in noise)
    steps, converged = 0, False
    while steps < most_steps and not converged:
        steps += 1
        hessian, gradient = _normal(windows, made, noise, values.size)
        moved = False
        while damping < _LARGEST_DAMPING:
            step = _damped(hessian, gradient, damping, _held(parameters, values, gradient))
            gain = float(step @ gradient - 0.5 * step @ hessian @ step)
            if gain < small_gain:
                converged = True
                break
            trial = _moved(parameters, values, begun, step)
            tried = _errors(windows, parameters, *trial)
            if tried is not None:
                new_noise = _noise_of(windows, tried, coloured=coloured)
                new_cost = sum(of.cost for of in new_noise)
                if new_cost < cost:
                    values, begun = trial
                    noise, cost, moved = new_noise, new_cost, True
                    damping *= _EASED
                    break
            damping *= _RAISED
        if not moved:
            break
        made = [w.linearised(parameters, values, s) for w, s in zip(windows, begun, strict=True)]
    return Maximum(
        values=values,
        states=tuple(begun),
        noise=noise,
        cost=cost,
        steps=steps,
        converged=converged,
    )


def _errors(
    windows: Sequence[Window],
    parameters: AxisParameters,
    values: Float[np.ndarray, " p"],
    states: Sequence[Float[np.ndarray, " s"]],
) -> list[list[Float[np.ndarray, " _"]]] | None:
    """Return the errors of all windows, or None if the motion cannot be simulated."""
    try:
        return [w.errors(parameters, values, s) for w, s in zip(windows, states, strict=True)]
    except (InputError, EventBudgetError):  # a step so long that the motion overflows
        return None


def _normal(
    windows: Sequence[Window],
    made: Sequence[tuple[list[Float[np.ndarray, " _"]], list[Float[np.ndarray, "_ _"]]]],
    noise: Sequence[ChannelNoise],
    sought: int,
) -> tuple[Float[np.ndarray, "size size"], Float[np.ndarray, " size"]]:
    """Return information matrix and gradient of all parameters and first states."""
    size = sought + sum(len(w.state) for w in windows)
    hessian, gradient = np.zeros((size, size)), np.zeros(size)
    at = sought
    for window, (errors, changes) in zip(windows, made, strict=True):
        count = len(window.state)
        place = np.concatenate((np.arange(sought), np.arange(at, at + count)))
        at += count
        for error, change, of in zip(errors, changes, noise, strict=True):
            rows = whitened(change, of.correlation) / of.std
            hessian[np.ix_(place, place)] += rows.T @ rows
            gradient[place] += rows.T @ (whitened(error, of.correlation) / of.std)
    return hessian, gradient


def _held(
    parameters: AxisParameters,
    values: Float[np.ndarray, " p"],
    gradient: Float[np.ndarray, " size"],
) -> list[int]:
    """Return which parameters lie on their bound and would leave it."""
    return [
        k
        for k, name in enumerate(parameters.names)
        if "friction" in name and values[k] <= 0.0 and gradient[k] < 0.0
    ]


def _damped(
    hessian: Float[np.ndarray, "size size"],
    gradient: Float[np.ndarray, " size"],
    damping: float,
    held: list[int],
) -> Float[np.ndarray, " size"]:
    """Return the step (H + damping diag H) step = gradient; zero without information."""
    scale = np.sqrt(np.diag(hessian))
    informed = scale > 0
    informed[held] = False
    step = np.zeros(gradient.size)
    if not np.any(informed):
        return step
    of = scale[informed]
    scaled = hessian[np.ix_(informed, informed)] / np.outer(of, of)
    scaled[np.diag_indices_from(scaled)] += damping
    step[informed] = np.linalg.lstsq(scaled, gradient[informed] / of, rcond=1e-14)[0] / of
    return step


def _moved(
    parameters: AxisParameters,
    values: Float[np.ndarray, " p"],
    states: Sequence[Float[np.ndarray, " s"]],
    step: Float[np.ndarray, " size"],
) -> tuple[Float[np.ndarray, " p"], list[Float[np.ndarray, " s"]]]:
    """Return parameters and first states after a step."""
    moved = parameters.bounded(values + step[: values.size], values)
    at = values.size
    after: list[Float[np.ndarray, " s"]] = []
    for state in states:
        after.append(state + step[at : at + state.size])
        at += state.size
    return moved, after
