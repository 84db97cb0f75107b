"""The search over ever longer pieces of a log, so that it ends at the best and not near it."""

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.axis_parameters import AxisParameters
from stickslip.estimation.likelihood.search.maximum import Maximum, search
from stickslip.estimation.likelihood.windows import Window, windows_of
from stickslip.estimation.signals.kinematics import LowPass
from stickslip.records import AxisLog

__all__ = ["staged_search"]

_STAGES = (16, 4)
"""Pieces of the log in the first fits: errors of a guess add up over a short while only, so that no
local maximum of the likelihood is between it and the best."""

_LEAST_PIECE = 100  # samples

_UNEXPLAINED = 1.2
"""Times that the errors over a whole stretch exceed those over pieces of it where the search may
have ended elsewhere than at the best."""

_NOTEWORTHY = 1.5  # the same for a note

_SPREAD = (0.7, 1.4)  # of friction, in the starts that are then tried
_TRIED = 12  # steps of a search that is not the last
_ROUGH = 0.5  # what its steps gain at least in the logarithm of the likelihood

_STATIC = (1.05, 1.15, 1.3, 1.6)
"""Static over Coulomb friction in starts that are always tried where it is sought: the motion jumps
where a breakaway comes or goes."""


def staged_search(
    log: AxisLog,
    low_pass: LowPass,
    parameters: AxisParameters,
    start: Float[np.ndarray, " p"],
    *,
    delay: int,
    skipped: int,
    horizon: float | None,
    coloured: bool,
) -> tuple[list[Window], Maximum, tuple[str, ...]]:
    """Return the likeliest parameters, over short pieces first, then over what is asked for.

    Errors are taken as white until the last search: a correlation near one forgives a wrong guess
    whatever adds up slowly, and keeps the search near it.

    Parameters
    ----------
    log
        Uniformly sampled but for gaps.
    low_pass
        What smooths for the first guesses of the states.
    parameters
        What is sought.
    start
        First guess [SI], shape (p,).
    delay, skipped
        Samples that the effort comes late, and those left out at the beginning.
    horizon
        Duration of a piece in the last search [s]; None for whole stretches.
    coloured
        Whether errors may be correlated.

    Returns
    -------
    The windows of the last search, what it found, and a note if the model explains pieces of the
    log much better than the whole.
    """
    longest = max(len(part) for part in log.segments())
    last = 1
    if horizon is not None:
        last = max(round((longest - 1) * log.sampling_time / horizon), 1)

    def cut(pieces: int) -> list[Window]:
        return windows_of(
            log, low_pass, delay=delay, skipped=skipped, pieces=pieces, flexible=parameters.flexible
        )

    stages = [p for p in _STAGES if p > last and longest / p >= _LEAST_PIECE]
    short: Maximum | None = None
    values = start
    for pieces in stages:
        found = search(
            cut(pieces),
            parameters,
            values,
            coloured=False,
            most_steps=_TRIED,
            small_gain=_ROUGH,
        )
        values = found.values
        short = found if short is None else short
    windows = cut(last)
    white = search(windows, parameters, values, coloured=False)
    for elsewhere in _stuck(parameters, white.values):
        other = search(windows, parameters, elsewhere, coloured=False)
        white = min(white, other, key=lambda found: found.cost)
    if short is not None and _growth(white, short) > _UNEXPLAINED:
        white = _from_elsewhere(windows, parameters, white, [start, *_starts(parameters, values)])
    maximum = white
    if coloured:
        begun = [white.values] if short is None else [white.values, values]
        found = [search(windows, parameters, at, coloured=True) for at in begun]
        maximum = min(found, key=lambda found: found.cost)
    growth = 1.0 if short is None else _growth(white, short)
    if growth <= _NOTEWORTHY:
        return windows, maximum, ()
    return (
        windows,
        maximum,
        (
            f"over the whole log the simulated motion is {growth:.2g} times as far from the "
            f"measured one as over {stages[0]} pieces of it: a disturbing force, or another law of "
            "friction, adds up, which a horizon keeps it from; or the effort acts late, which "
            "largest_delay (--largest-delay) looks for",
        ),
    )


def _from_elsewhere(
    windows: list[Window],
    parameters: AxisParameters,
    found: Maximum,
    starts: list[Float[np.ndarray, " p"]],
) -> Maximum:
    """Return the better of a maximum and the best that other starts lead to."""
    best = min(
        (
            search(windows, parameters, at, coloured=False, most_steps=_TRIED, small_gain=_ROUGH)
            for at in starts
        ),
        key=lambda other: other.cost,
    )
    if best.cost >= found.cost:
        return found
    return search(windows, parameters, best.values, coloured=False, states=best.states)


def _growth(whole: Maximum, pieces: Maximum) -> float:
    """Return how many times larger the errors are over the whole than over pieces."""
    return max(
        one.std / other.std if other.std > 0 else 1.0
        for one, other in zip(whole.noise, pieces.noise, strict=True)
    )


def _stuck(
    parameters: AxisParameters, values: Float[np.ndarray, " p"]
) -> list[Float[np.ndarray, " p"]]:
    """Return starts with other static frictions, if any is sought."""
    static = [name.startswith("static") for name in parameters.names]
    if not any(static):
        return []
    coulomb = [
        parameters.value(name.replace("static", "coulomb"), values) for name in parameters.names
    ]
    return [np.where(static, ratio * np.array(coulomb), values) for ratio in _STATIC]


def _starts(
    parameters: AxisParameters, values: Float[np.ndarray, " p"]
) -> list[Float[np.ndarray, " p"]]:
    """Return starts around given values: Coulomb and viscous friction smaller and larger."""
    starts: list[Float[np.ndarray, " p"]] = []
    for coulomb in _SPREAD:
        for viscous in _SPREAD:
            factors = [
                coulomb if "coulomb" in name else viscous if "viscous" in name else 1.0
                for name in parameters.names
            ]
            starts.append(values * np.array(factors))
    return starts
