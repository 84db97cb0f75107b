"""A sudden change of the gain, the friction or the inertia within a log."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from stickslip.estimation.selection.model import Model, testable
from stickslip.estimation.selection.significance import Partial, significant_value

_TINY = np.finfo(float).tiny


@dataclass(frozen=True, kw_only=True)
class ChangeTuning:
    """Tuning of the test for a sudden change."""

    instants: int = 19
    """Instants that are tried, 5 % of the windows apart: a change in between leaves a fortieth of
    the log on the wrong side."""
    smallest_change: float = 0.05
    """Relative change [-]: a smaller one makes parameters wrong by less than half of it."""
    least_part: float = 0.01
    """Share of the squares of the part on either side of an instant [-]: with less, such as the
    inertia in a log that begins at constant speed, few windows decide."""
    smallest_share: float = 2e-3
    """Share of the effort that it must explain [-]: twice that of a term, as a sudden change is
    rarer."""
    largest_p_value: float = 5e-3
    """p-value of the change at the best instant [-]: together with the limit of its size, the
    comparison with drifts and the larger of two p-values, false alarms are rare although the
    instant is searched. 1e-3 misses one change of the gain in about ten."""


def sudden_change(model: Model, tuning: ChangeTuning, start: float = 0.0) -> str:
    """Return a note on a change of gain, friction or inertia at an instant; empty if there is none.

    ``start`` is the time in the log from which that of the model is counted [s].

    A part y of the fitted effort changes at the instant t_1: the column ``y (H(t - t_1) - h)`` with
    the coefficient g is added to those of the model, where h is the share of the squares of y after
    t_1. The part is then ``1 + g (1 - h)`` times y after the instant, and ``1 - g h`` times before.
    The one that explains most is all of the effort (the gain from the logged effort to that of the
    axis), friction, or the force of inertia. It must explain more than a drift of a part, and more
    than the selected drifts.
    """
    steady = replace(
        model, chosen=tuple(pair for pair in model.chosen if pair[0].name not in _DRIFTS)
    )
    if not testable(steady):
        return ""
    basis, time = steady.basis(), steady.rows.time
    best: _Change | None = None
    drift = float(np.sum(basis.residual**2) - np.sum(model.basis().residual ** 2))
    for words, part in _parts(steady):
        ramp = basis.partial((part * (time - np.mean(time)))[:, None])
        drift = max(drift, 0.0 if ramp is None else float(ramp.coordinates[0] ** 2))
        for instant in np.quantile(time, np.linspace(0.0, 1.0, tuning.instants + 2)[1:-1]).tolist():
            share = float(np.sum(part[time > instant] ** 2) / max(float(np.sum(part**2)), _TINY))
            if not tuning.least_part <= share <= 1.0 - tuning.least_part:
                continue
            partial = basis.partial((part * ((time > instant) - share))[:, None])
            if partial is None:
                continue
            found = _Change(words=words, instant=instant, share=share, partial=partial)
            if best is None or found.explained > best.explained:
                best = found
    if best is None or best.explained <= drift:
        return ""
    size = significant_value(basis, best.partial, tuning.largest_p_value, tuning.smallest_share)
    if size is None or abs(size) < tuning.smallest_change:
        return ""
    before, after = 1.0 - size * best.share, 1.0 + size * (1.0 - best.share)
    if min(before, after) <= 0.0:
        return ""
    instant = best.instant + start
    return (
        best.words.format(instant=instant, ratio=after / before)
        + f"; identify the parts before and after {instant:.3g} s on their own (--to, --from)"
    )


@dataclass(frozen=True, kw_only=True)
class _Change:
    """A change of a part of the effort at an instant."""

    words: str
    instant: float  # [s]
    share: float  # of the squares of the part that are later [-]
    partial: Partial

    @property
    def explained(self) -> float:
        """Decrease of the sum of squared residuals."""
        return float(self.partial.coordinates[0] ** 2)


def _parts(model: Model) -> list[tuple[str, Float[np.ndarray, " n"]]]:
    """Return the parts of the fitted effort that may change, with the words for each."""
    inertia = model.scaled(model.rows.acceleration) * (model.inertia or model.solution[0])
    coulomb, viscous = model.friction()
    friction = model.scaled(coulomb * model.rows.direction + viscous * model.rows.velocity)
    return [(_GAIN, model.fitted_effort()), (_FRICTION, friction), (_INERTIA, inertia)]


_DRIFTS = ("offset drift", "friction drift", "viscous drift", "gain drift")
_GAIN = (
    "from about {instant:.3g} s on the same motion takes {ratio:.3g} times the logged effort: the "
    "gain of the drive or the scale of the effort changes there"
)
_FRICTION = "from about {instant:.3g} s on friction is {ratio:.3g} times that before"
_INERTIA = "from about {instant:.3g} s on the inertia is {ratio:.3g} times that before"
