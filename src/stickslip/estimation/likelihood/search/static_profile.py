"""Static friction of a rigid axis, between the efforts that held it and those that freed it.

Under an effort that is held over each sample a resting mass is freed at the beginning of a sample
or not at all. The motion, and with it the likelihood, is therefore constant in the static friction
but for jumps where it passes an effort of the log. There is no derivative to follow: the likelihood
is looked at level by level.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.likelihood.axis_parameters import AxisParameters
from stickslip.estimation.likelihood.search.maximum import Maximum, search
from stickslip.estimation.likelihood.windows import Window
from stickslip.records import (
    FrictionEstimate,
    ParameterEstimate,
    Status,
    Verdict,
    unit_of,
)

__all__ = ["StaticRange", "with_static_friction"]

_RATIOS = tuple(1.0 + 0.1 * k for k in range(1, 13))
"""Of static to Coulomb friction that are looked at first."""
_QUICK = 4  # steps of the search at each
_MOST_LEVELS = 60  # looked at in a round
_ROUNDS = 8
_MARGIN = 3  # levels on both sides of those not unlikely, that the next round looks between
_UNLIKELY = 0.5 * 3.841458820694124  # half of the 95 % quantile of chi-square, one degree
_SAME = 1e-9  # difference of costs that is rounding
_NORMAL_95 = 1.959963984540054


@dataclass(frozen=True, kw_only=True)
class StaticRange:
    """Static friction that a log allows.

    Attributes
    ----------
    ranges
        By name: the lowest and the highest static friction whose likelihood is within the 95 %
        quantile of the best [N or N m]; None where the log says nothing.
    """

    ranges: Mapping[str, tuple[float, float] | None]

    @property
    def values(self) -> dict[str, float]:
        """The middle of each range."""
        return {name: 0.5 * (r[0] + r[1]) for name, r in self.ranges.items() if r is not None}

    def added_to(self, estimate: FrictionEstimate) -> FrictionEstimate:
        """Return an estimate with the static friction, as independent of the rest."""
        parameters = dict(estimate.parameters)
        covariance = estimate.covariance
        verdicts = list(estimate.diagnostics.verdicts)
        status = estimate.status
        for name, allowed in self.ranges.items():
            unit = unit_of(name, estimate.kind)
            if allowed is None:
                parameters[name] = ParameterEstimate(
                    name=name, value=None, std=None, ci95=None, unit=unit
                )
                reason = "no effort of the log lies between holding the axis and freeing it"
                verdicts.append(Verdict(parameter=name, identifiable=False, reason=reason))
                status = Status.NOT_IDENTIFIABLE if status is Status.OK else status
                continue
            low, high = allowed
            std = (high - low) / (2.0 * _NORMAL_95)
            parameters[name] = ParameterEstimate(
                name=name, value=0.5 * (low + high), std=std, ci95=allowed, unit=unit
            )
            covariance = np.pad(covariance, ((0, 1), (0, 1)))
            covariance[-1, -1] = std**2
            reason = "efforts of the log held the axis and freed it"
            verdicts.append(Verdict(parameter=name, identifiable=True, reason=reason))
        diagnostics = replace(estimate.diagnostics, verdicts=tuple(verdicts))
        return replace(
            estimate,
            parameters=parameters,
            covariance=covariance,
            status=status,
            diagnostics=diagnostics,
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

    Parameters
    ----------
    windows, parameters, maximum
        What was searched with static friction equal to Coulomb friction, and what was found.
    per_direction
        Whether the directions differ.
    coloured
        As in `search`.

    Returns
    -------
    The parameters with the static friction as known, the maximum then, and the range of it.
    """
    sides = ("_positive", "_negative") if per_direction else ("",)
    known = dict(parameters.known)
    best, best_known = maximum, known
    for ratio in _RATIOS:
        trial = known | {
            f"static_friction{side}": ratio
            * max(parameters.value(f"coulomb_friction{end}", maximum.values) for end in ends)
            for side, ends in _ends(sides)
        }
        found = search(
            windows,
            replace(parameters, known=trial),
            maximum.values,
            coloured=coloured,
            states=maximum.states,
            most_steps=_QUICK,
        )
        if found.cost < best.cost:
            best, best_known = found, trial
    if best_known is known:  # no better than Coulomb friction alone, but for the level itself
        best_known = known | {
            f"static_friction{side}": max(
                parameters.value(f"coulomb_friction{end}", maximum.values) for end in ends
            )
            for side, ends in _ends(sides)
        }
    ranges: dict[str, tuple[float, float] | None] = {}
    for side, ends in _ends(sides):
        name = f"static_friction{side}"
        levels = _levels(windows, parameters, best.values, ends, best_known[name])
        ranges[name] = None
        for _ in range(_ROUNDS if levels.size > 1 else 0):
            looked = _thinned(levels)
            value, first, last = _profile(
                windows, parameters, best, best_known, name, looked, coloured=coloured
            )
            if ranges[name] is None and (first, last) == (0, looked.size - 1):
                break  # whatever it is, the log does not show it
            ranges[name] = float(looked[first]), float(looked[last])
            best_known = best_known | {name: value}
            best = search(
                windows,
                replace(parameters, known=best_known),
                best.values,
                coloured=coloured,
                states=best.states,
            )
            if looked.size == levels.size:
                break
            low, high = (
                looked[max(first - _MARGIN, 0)],
                looked[min(last + _MARGIN, looked.size - 1)],
            )
            levels = levels[(levels >= low) & (levels <= high)]
    return replace(parameters, known=best_known), best, StaticRange(ranges=ranges)


def _ends(sides: tuple[str, ...]) -> list[tuple[str, tuple[str, ...]]]:
    """Return each side with the directions that it holds for."""
    both = ("_positive", "_negative")
    return [(side, (side,) if side else both) for side in sides]


def _levels(
    windows: Sequence[Window],
    parameters: AxisParameters,
    values: Float[np.ndarray, " p"],
    ends: tuple[str, ...],
    around: float,
) -> Float[np.ndarray, " m"]:
    """Return the efforts near a static friction between which the motion may jump [N or N m]."""
    offset = parameters.value("offset", values)
    efforts = np.unique(np.concatenate([w.effort for w in windows]) - offset)
    towards = [efforts if end == "_positive" else -efforts for end in ends]
    levels = np.unique(np.concatenate(towards))
    least = max(parameters.value(f"coulomb_friction{end}", values) for end in ends)
    levels = levels[(levels > least) & (levels < around + (around - least) + 0.2 * around)]
    return np.concatenate(([least], levels))


def _thinned(levels: Float[np.ndarray, " m"]) -> Float[np.ndarray, " few"]:
    """Return not too many of them, the first and the last included."""
    if levels.size <= _MOST_LEVELS:
        return levels
    return levels[np.linspace(0, levels.size - 1, _MOST_LEVELS).astype(int)]


def _profile(
    windows: Sequence[Window],
    parameters: AxisParameters,
    best: Maximum,
    known: Mapping[str, float],
    name: str,
    levels: Float[np.ndarray, " m"],
    *,
    coloured: bool,
) -> tuple[float, int, int]:
    """Return the likeliest static friction, and the levels that enclose those not unlikely."""
    middles = 0.5 * (levels[1:] + levels[:-1])
    costs = np.array(
        [
            search(
                windows,
                replace(parameters, known={**known, name: float(middle)}),
                best.values,
                coloured=coloured,
                states=best.states,
                most_steps=2,
            ).cost
            for middle in middles
        ]
    )
    allowed = np.flatnonzero(costs <= np.min(costs) + _UNLIKELY)
    likeliest = np.flatnonzero(costs <= np.min(costs) + _SAME)
    value = 0.5 * float(levels[likeliest[0]] + levels[likeliest[-1] + 1])
    return value, int(allowed[0]), int(allowed[-1]) + 1
