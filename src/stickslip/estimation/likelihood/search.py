"""Search of the greatest likelihood of the simulated motion.

`search` is a Gauss-Newton search, damped after Levenberg and Marquardt. `staged_search` applies it
to ever longer pieces of a log, so that it ends at the best maximum and not near it.

Static friction of a rigid axis lies between the efforts that held it and those that freed it. Under
an effort that is held over each sample a resting mass is freed at the beginning of a sample or not
at all. The motion, and with it the likelihood, is therefore constant in the static friction but for
jumps where it passes an effort of the log. There is no derivative to follow: `with_static_friction`
compares the likelihood level by level.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.axis_parameters import SIDES, AxisParameters, coulomb_of
from stickslip.estimation.likelihood.windows import ChannelNoise, Window, likeliest_noise, whitened
from stickslip.estimation.point_estimate import NORMAL_95
from stickslip.records import (
    AxisLog,
    EventBudgetError,
    FrictionEstimate,
    InputError,
    ParameterEstimate,
    Status,
    Verdict,
)

_MOST_STEPS = 60  # of a search [-]
_SMALL_GAIN = 1e-4
"""Of the logarithm of the likelihood: a hundredth of a standard deviation in every parameter."""
_FIRST_DAMPING, _LARGEST_DAMPING = 1e-3, 1e8  # share of the diagonal of the Hessian [-]
_EASED, _RAISED = 0.2, 5.0  # factors of the damping after a step that gains, and one that does not
_CLEAN = 1e-9  # of the range of a channel: what is below is rounding

_STAGES = (16, 4)
"""Pieces of the log in the first fits: errors of a guess add up over a short while only, so that no
local maximum of the likelihood is between it and the best."""
_LEAST_PIECE = 100  # samples
_UNEXPLAINED = 1.2
"""Ratio of the errors over a whole stretch to those over pieces of it from which the search may
have ended elsewhere than at the best maximum."""
_NOTEWORTHY = 1.5  # the same for a note
_SPREAD = (0.7, 1.4)  # of friction, in the starts that are then tried
_TRIED = 12  # steps of a search that is not the last
_ROUGH = 0.5  # least gain of its steps in the logarithm of the likelihood
_STATIC_RATIOS = (1.05, 1.15, 1.3, 1.6)
"""Static over Coulomb friction in starts that are always tried where it is sought: the motion jumps
where a breakaway comes or goes."""

_PROFILE_RATIOS = tuple(1.0 + 0.1 * k for k in range(1, 13))
"""Static over Coulomb friction that is tried first."""
_QUICK = 4  # steps of the search at each
_MOST_LEVELS = 60  # in a round
_ROUNDS = 8  # of levels, each within the last one, at most
_MARGIN = 3  # levels on both sides of those not unlikely, to which the next round extends
_UNLIKELY = 0.5 * 3.841458820694124  # half of the 95 % quantile of chi-square, one degree
_SAME = 1e-9  # difference of costs that is rounding


@dataclass(frozen=True, kw_only=True)
class Maximum:
    """End of a search."""

    values: Float[np.ndarray, " p"]  # of the parameters [SI]
    states: tuple[Float[np.ndarray, " s"], ...]  # first state of each window [SI]
    noise: tuple[ChannelNoise, ...]
    cost: float  # negative logarithm of the likelihood, up to a constant
    converged: bool  # whether no step would gain more than what is small


def _noise_of(
    windows: Sequence[Window], errors: Sequence[Sequence[Float[np.ndarray, " _"]]], coloured: bool
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
    most_steps: int = _MOST_STEPS,
    small_gain: float = _SMALL_GAIN,
) -> Maximum:
    """Return the likeliest parameters and first states near a start [SI].

    With the noise of each channel at its likeliest, the gradient of the concentrated likelihood is
    that of a least-squares problem with that noise held, and its Hessian nearly so (Gauss-Newton).
    Coloured errors may be correlated from sample to sample. A step whose gain in the logarithm of
    the likelihood is small is not worth its time.
    """
    values = parameters.bounded(start, start)
    begun = [np.array(w.state) for w in windows] if states is None else [s.copy() for s in states]
    damping = _FIRST_DAMPING
    made = [w.linearised(parameters, values, s) for w, s in zip(windows, begun, strict=True)]
    noise = _noise_of(windows, [errors for errors, _ in made], coloured)
    cost = sum(of.cost for of in noise)
    converged = False
    for _ in range(most_steps):
        hessian, gradient = _normal(windows, made, noise, values.size)
        improved = False
        while damping < _LARGEST_DAMPING:
            step = _damped(hessian, gradient, damping, _held(parameters, values, gradient))
            gain = float(step @ gradient - 0.5 * step @ hessian @ step)
            if gain < small_gain:
                converged = True
                break
            tried_values = parameters.bounded(values + step[: values.size], values)
            ends = np.cumsum([values.size, *(state.size for state in begun)])
            tried_states = [s + step[e - s.size : e] for s, e in zip(begun, ends[1:], strict=True)]
            errors = _errors(windows, parameters, tried_values, tried_states)
            if errors is not None:
                new_noise = _noise_of(windows, errors, coloured)
                new_cost = sum(of.cost for of in new_noise)
                if new_cost < cost:
                    values, begun = tried_values, tried_states
                    noise, cost, improved = new_noise, new_cost, True
                    damping *= _EASED
                    break
            damping *= _RAISED
        if not improved:
            break
        made = [w.linearised(parameters, values, s) for w, s in zip(windows, begun, strict=True)]
    return Maximum(values=values, states=tuple(begun), noise=noise, cost=cost, converged=converged)


def _errors(
    windows: Sequence[Window],
    parameters: AxisParameters,
    values: Float[np.ndarray, " p"],
    states: Sequence[Float[np.ndarray, " s"]],
) -> list[list[Float[np.ndarray, " _"]]] | None:
    """Return the errors of all windows, or None if the motion cannot be simulated."""
    try:
        return [
            w.errors(w.simulated(parameters, values, s))
            for w, s in zip(windows, states, strict=True)
        ]
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


def staged_search(
    log: AxisLog,
    cut: Callable[[int], list[Window]],
    parameters: AxisParameters,
    start: Float[np.ndarray, " p"],
    *,
    horizon: float | None,
    coloured: bool,
) -> tuple[list[Window], Maximum, tuple[str, ...]]:
    """Return the likeliest parameters, over short pieces first, then over what is asked for.

    Errors are taken as white until the last search: a correlation near one forgives a wrong guess
    whatever adds up slowly, and keeps the search near it. The log is cut into so many pieces a
    stretch. The horizon is the duration of a piece in the last search [s], None for whole
    stretches. The windows of the last search come with its maximum, and a note if the model
    explains pieces of the log much better than the whole.
    """
    longest = max(len(part) for part in log.segments())
    last = 1
    if horizon is not None:
        last = max(round((longest - 1) * log.sampling_time / horizon), 1)

    def roughly(windows: list[Window], at: Float[np.ndarray, " p"]) -> Maximum:
        steps, gain = _TRIED, _ROUGH
        return search(windows, parameters, at, coloured=False, most_steps=steps, small_gain=gain)

    stages = [p for p in _STAGES if p > last and longest / p >= _LEAST_PIECE]
    short: Maximum | None = None
    values = start
    for pieces in stages:
        found = roughly(cut(pieces), values)
        values = found.values
        short = found if short is None else short
    windows = cut(last)
    white = search(windows, parameters, values, coloured=False)
    for elsewhere in _static_starts(parameters, white.values):
        other = search(windows, parameters, elsewhere, coloured=False)
        white = min(white, other, key=lambda found: found.cost)
    if short is not None and _growth(white, short) > _UNEXPLAINED:
        starts = [start, *_friction_starts(parameters, values)]
        best = min((roughly(windows, at) for at in starts), key=lambda found: found.cost)
        if best.cost < white.cost:
            states = best.states
            white = search(windows, parameters, best.values, coloured=False, states=states)
    maximum = white
    if coloured:
        begun = [white.values] if short is None else [white.values, values]
        tried = [search(windows, parameters, at, coloured=True) for at in begun]
        maximum = min(tried, key=lambda found: found.cost)
    growth = 1.0 if short is None else _growth(white, short)
    if growth <= _NOTEWORTHY:
        return windows, maximum, ()
    note = (
        f"over the whole log the simulated motion is {growth:.2g} times as far from the "
        f"measured one as over {stages[0]} pieces of it: a disturbing force, or another law of "
        "friction, adds up, which a horizon keeps it from; or the effort acts late, which "
        "largest_delay (--largest-delay) looks for"
    )
    return windows, maximum, (note,)


def _growth(whole: Maximum, pieces: Maximum) -> float:
    """Return how many times larger the errors are over the whole than over pieces."""
    return max(
        one.std / other.std if other.std > 0 else 1.0
        for one, other in zip(whole.noise, pieces.noise, strict=True)
    )


def _static_starts(
    parameters: AxisParameters, values: Float[np.ndarray, " p"]
) -> list[Float[np.ndarray, " p"]]:
    """Return starts with other static frictions, if any is sought."""
    static = [name.startswith("static") for name in parameters.names]
    if not any(static):
        return []
    coulomb = [parameters.value(coulomb_of(name), values) for name in parameters.names]
    return [np.where(static, ratio * np.array(coulomb), values) for ratio in _STATIC_RATIOS]


def _friction_starts(
    parameters: AxisParameters, values: Float[np.ndarray, " p"]
) -> list[Float[np.ndarray, " p"]]:
    """Return starts around given values: Coulomb and viscous friction smaller and larger."""

    def factor(name: str, coulomb: float, viscous: float) -> float:
        return coulomb if "coulomb" in name else viscous if "viscous" in name else 1.0

    return [
        values * np.array([factor(name, coulomb, viscous) for name in parameters.names])
        for coulomb in _SPREAD
        for viscous in _SPREAD
    ]


@dataclass(frozen=True, kw_only=True)
class StaticRange:
    """Static friction that a log allows.

    By name: the lowest and the highest static friction whose likelihood is within the 95 % quantile
    of the best [N or N m]; None where the log does not show it.
    """

    ranges: Mapping[str, tuple[float, float] | None]

    @property
    def values(self) -> dict[str, float]:
        """The middle of each range."""
        return {name: 0.5 * (r[0] + r[1]) for name, r in self.ranges.items() if r is not None}

    def added_to(self, estimate: FrictionEstimate) -> FrictionEstimate:
        """Return an estimate with the static friction, as independent of the rest."""
        parameters, covariance = dict(estimate.parameters), estimate.covariance
        verdicts, status = list(estimate.diagnostics.verdicts), estimate.status
        for name, allowed in self.ranges.items():
            value = self.values.get(name)
            std = None if allowed is None else (allowed[1] - allowed[0]) / (2.0 * NORMAL_95)
            unit = estimate.unit(name)
            parameters[name] = ParameterEstimate(
                name=name, value=value, std=std, ci95=allowed, unit=unit
            )
            if std is None:
                reason = "no effort of the log lies between holding the axis and freeing it"
                status = Status.NOT_IDENTIFIABLE if status is Status.OK else status
            else:
                reason = "efforts of the log held the axis and freed it"
                covariance = np.pad(covariance, ((0, 1), (0, 1)))
                covariance[-1, -1] = std**2
            known = allowed is not None
            verdicts.append(Verdict(parameter=name, identifiable=known, reason=reason))
        return replace(
            estimate,
            parameters=parameters,
            covariance=covariance,
            status=status,
            diagnostics=replace(estimate.diagnostics, verdicts=tuple(verdicts)),
        )


def with_static_friction(
    windows: Sequence[Window],
    parameters: AxisParameters,
    maximum: Maximum,
    *,
    per_direction: bool,
    coloured: bool,
) -> tuple[AxisParameters, Maximum, StaticRange]:
    """Search the static friction of a rigid axis beside the other parameters.

    The search goes on from the maximum with static friction equal to Coulomb friction. It returns
    the parameters with the static friction as known, the maximum then, and the range of it.
    """
    directions = {f"static_friction{side}": (side,) for side in SIDES}
    if not per_direction:
        directions = {"static_friction": SIDES}

    def coulomb(sides: Sequence[str], values: Float[np.ndarray, " p"]) -> float:
        return max(parameters.value(f"coulomb_friction{side}", values) for side in sides)

    def at_ratio(ratio: float) -> dict[str, float]:
        static = {n: ratio * coulomb(sides, maximum.values) for n, sides in directions.items()}
        return {**parameters.known, **static}

    def with_known(known: Mapping[str, float], near: Maximum, steps: int = _MOST_STEPS) -> Maximum:
        fixed, states = replace(parameters, known=known), near.states
        return search(
            windows, fixed, near.values, coloured=coloured, states=states, most_steps=steps
        )

    # Coulomb friction alone, unless a higher static friction is likelier
    best, known = maximum, at_ratio(1.0)
    for ratio in _PROFILE_RATIOS:
        found = with_known(at_ratio(ratio), maximum, _QUICK)
        if found.cost < best.cost:
            best, known = found, at_ratio(ratio)
    ranges: dict[str, tuple[float, float] | None] = {}
    for name, sides in directions.items():
        least, offset = coulomb(sides, best.values), parameters.value("offset", best.values)
        levels = _levels(windows, sides, (least, known[name]), offset)
        ranges[name] = None
        for _ in range(_ROUNDS if levels.size > 1 else 0):
            few = levels
            if levels.size > _MOST_LEVELS:
                few = levels[np.linspace(0, levels.size - 1, _MOST_LEVELS).astype(int)]
            middles = (0.5 * (few[1:] + few[:-1])).tolist()
            costs = np.array([with_known(known | {name: m}, best, 2).cost for m in middles])
            allowed = np.flatnonzero(costs <= np.min(costs) + _UNLIKELY)
            first, last = int(allowed[0]), int(allowed[-1]) + 1
            if ranges[name] is None and (first, last) == (0, few.size - 1):
                break  # whatever it is, the log does not show it
            ranges[name] = float(few[first]), float(few[last])
            likeliest = np.flatnonzero(costs <= np.min(costs) + _SAME)
            value = 0.5 * float(few[likeliest[0]] + few[likeliest[-1] + 1])
            known = known | {name: value}
            best = with_known(known, best)
            if few.size == levels.size:
                break
            low, high = few[max(first - _MARGIN, 0)], few[min(last + _MARGIN, few.size - 1)]
            levels = levels[(levels >= low) & (levels <= high)]
    return replace(parameters, known=known), best, StaticRange(ranges=ranges)


def _levels(
    windows: Sequence[Window], sides: Sequence[str], between: tuple[float, float], offset: float
) -> Float[np.ndarray, " m"]:
    """Return the efforts near a static friction between which the motion may jump [N or N m].

    They lie above the Coulomb friction, and up to somewhat above the static friction.
    """
    efforts = np.unique(np.concatenate([w.effort for w in windows]) - offset)
    towards = [efforts if side == SIDES[0] else -efforts for side in sides]
    levels = np.unique(np.concatenate(towards))
    least, around = between
    levels = levels[(levels > least) & (levels < around + (around - least) + 0.2 * around)]
    return np.concatenate(([least], levels))
